"""A slope in three dimensions that yields, by finite elements."""

import fenics_bridge as bridge
import mpm_core as mpm

SOIL = mpm.MohrCoulomb(young=200e3, poisson=0.33, cohesion=1e3, friction_angle=25.0, dilation_angle=25.0)


def slope_in_space(comm, n, law=SOIL, prefix="fem_", nmd=False):
    """1 m high, 0.5 m wide, 45 degrees; n cubes over its height, each cut in six tetrahedra; ends symmetric and fixed."""
    domain, _, facet_tags = bridge.box_mesh(comm, (1.0, 0.5, 1.0), (round(1.5 * n), n // 2, n))
    x = domain.geometry.x
    x[:, 0] *= 2.1 - x[:, 2]
    supports = [bridge.roller(1, (1, 0, 0)), bridge.roller(3, (0, 1, 0)), bridge.fixed(4), bridge.fixed(5)]
    return bridge.QuasiStatic(domain, law, facet_tags, supports, degree=1, options_prefix=prefix, nmd=nmd)
