"""Bodies of revolution that several tests share: half sections, the axis at x = 0, tags as of `bridge.box_mesh`."""

from __future__ import annotations

from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

AXISYMMETRIC = bridge.Geometry.AXISYMMETRIC
SOIL = {"young": 1e6, "poisson": 0.3, "cohesion": 4e3, "friction_angle": 25.0}
UNIT_WEIGHT = 18e3
AXIS, WALL, BASE, TOP = 1, 2, 3, 4


def cylinder_mesh(cells=8, comm=MPI.COMM_WORLD, width=1.0, height=1.0, headroom=0.0):
    """(domain, cell_tags, facet_tags) of a cylinder of 1 m by 1 m; with headroom, of its soil and empty cells around it."""
    counts = [round(cells * (length + headroom)) for length in (width, height)]
    lengths = [width + headroom, height + headroom]
    body = ((-1.0, -1.0), (width, height)) if headroom else None
    return bridge.box_mesh(comm, lengths, counts, body=body)


def cylinder_fem(cells=8, comm=MPI.COMM_WORLD, solve=True, law=None, **options):
    """`QuasiStatic` of a cylinder of soil that stands free on rough ground, under its weight: its foot yields."""
    domain, _, facet_tags = cylinder_mesh(cells, comm)
    law = law or mpm.MohrCoulomb(**SOIL)
    supports = [bridge.roller(AXIS, (1, 0)), bridge.fixed(BASE)]
    fem = bridge.QuasiStatic(domain, law, facet_tags, supports, geometry=AXISYMMETRIC, **options)
    if solve:
        fem.solve(bridge.Load(unit_weight=UNIT_WEIGHT))
        assert fem.converged
    return fem


def cylinder_particles(cells=8, comm=MPI.COMM_WORLD, per_cell=3, law=None, headroom=0.0):
    """`mpm_core.Model` of the same cylinder with particles, supports and gravity."""
    mesh = bridge.background_mesh(*cylinder_mesh(cells, comm, headroom=headroom))
    model = mpm.Model(mesh, law or mpm.MohrCoulomb(**SOIL), geometry=AXISYMMETRIC)
    model.seed(density=UNIT_WEIGHT / 9.81, per_cell=per_cell, cell_tag=bridge.BODY if headroom else None)
    model.roller(AXIS, (1, 0))
    model.fix(BASE)
    model.set_gravity((0.0, -9.81))
    return model
