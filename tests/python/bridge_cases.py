"""Bodies and closed forms that several tests of the bridge share."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from dolfinx.mesh import compute_midpoints, meshtags
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

MESHES = Path(__file__).resolve().parents[2] / "meshes"
YOUNG, POISSON, UNIT_WEIGHT = 200e3, 0.33, 20e3


def column(dim, cell_size=0.25):
    """(domain, facet_tags, supports, height) of a column between rollers on a fixed base."""
    if dim == 3:
        domain, _, facet_tags = bridge.read_mesh(MESHES / "column.geo", MPI.COMM_WORLD, 3, {"cell_size": cell_size})
        supports = [bridge.roller(2, (1, 0, 0)), bridge.roller(3, (0, 1, 0)), bridge.fixed(1)]
        return domain, facet_tags, supports, 1.0
    background, cell_tags, facet_tags = bridge.slope_mesh(MPI.COMM_WORLD, angle=90, crest=0.5, cell_size=cell_size)
    domain, _, facet_tags = bridge.soil_mesh(background, cell_tags, facet_tags)
    sides = [bridge.roller(tag, (1, 0)) for tag in (bridge.LEFT, bridge.SLOPE)]
    return domain, facet_tags, [*sides, bridge.fixed(bridge.BASE)], 1.0


def column_stress(y, dim, height=1.0, poisson=POISSON, unit_weight=UNIT_WEIGHT):
    """sigma_v = gamma (H - y), sigma_h = nu / (1 - nu) sigma_v, compression negative: (n, S)."""
    vertical = -unit_weight * (height - np.asarray(y))
    stress = np.zeros((len(vertical), 4 if dim == 2 else 6))
    stress[:, :3] = (poisson / (1 - poisson) * vertical)[:, None]
    stress[:, dim - 1] = vertical
    return stress


def column_settlement(height=1.0, young=YOUNG, poisson=POISSON, unit_weight=UNIT_WEIGHT):
    """u_top = -gamma H^2 / (2 E_oed) with the oedometer modulus E_oed."""
    oedometer = young * (1 - poisson) / ((1 + poisson) * (1 - 2 * poisson))
    return -unit_weight * height**2 / (2 * oedometer)


def top_of_column(model):
    """Vertical displacement of the top of the column [m]."""
    top = np.full((1, model.domain.geometry.dim), 0.2)
    top[0, -1] = 1.0
    return model.evaluate_at(top)["displacement"][0, -1]


def interior_points(n, dim, seed=0):
    """Random points inside the column of unit height and half that width."""
    width = [0.5] * (dim - 1)
    return np.random.default_rng(seed).random((n, dim)) * (*width, 1.0)


def slope_model(cell_size=0.1, kind="crossed", dilation_angle=25.0, comm=MPI.COMM_WORLD, **options):
    """QuasiStatic of the paper's slope."""
    domain, _, facet_tags = bridge.soil_mesh(*bridge.slope_mesh(comm, cell_size=cell_size, kind=kind))
    law = mpm.MohrCoulomb(
        young=YOUNG, poisson=POISSON, cohesion=1e3, friction_angle=25.0, dilation_angle=dilation_angle
    )
    supports = [bridge.roller(bridge.LEFT, (1, 0)), bridge.fixed(bridge.BASE)]
    return bridge.QuasiStatic(domain, law, facet_tags, supports, **options)


def excess_of_strength(stress, cohesion, friction_angle):
    """Mohr-Coulomb's function over the cohesion, in plane strain; positive outside the surface. stress: (n, 4)"""
    xx, yy, zz, xy = stress.T
    centre, radius = 0.5 * (xx + yy), np.hypot(0.5 * (xx - yy), xy)
    principal = np.sort(np.column_stack([centre - radius, centre + radius, zz]), axis=1)
    phi = np.radians(friction_angle)
    low, high = principal[:, 0], principal[:, 2]
    return (0.5 * (high - low) + 0.5 * (high + low) * np.sin(phi) - cohesion * np.cos(phi)) / cohesion


def slope_particles(unit_weight, cell_size=0.1, kind="crossed", law=None, comm=MPI.COMM_WORLD):
    """`mpm_core.Model` of the paper's slope with particles, supports and gravity."""
    law = law or mpm.MohrCoulomb(young=YOUNG, poisson=POISSON, cohesion=1e3, friction_angle=25.0)
    model = mpm.Model(bridge.background_mesh(*bridge.slope_mesh(comm, cell_size=cell_size, kind=kind)), law)
    model.seed(density=unit_weight / 9.81, per_cell=10, cell_tag=bridge.SOIL)
    model.roller(bridge.LEFT, (1, 0))
    model.fix(bridge.BASE)
    model.set_gravity((0, -9.81))
    return model


CLAY = {"young": 1e6, "poisson": 0.45, "cohesion": 8e3, "friction_angle": 0.0}


def clay_block(geometry, comm=MPI.COMM_WORLD, law=None, below=None, more=(), **options):
    """(finite elements, particles in their cells) of clay, or another soil, that stands free on rough ground; both average strains.

    below: law of the lower half; that of the upper one by default. more: laws of the particles that none of them has.
    """
    axisymmetric = geometry == bridge.Geometry.AXISYMMETRIC
    dim = 3 if geometry == bridge.Geometry.SOLID else 2
    domain, _, facet_tags = bridge.box_mesh(comm, [1.0] * dim, [4 if dim == 3 else 6] * dim)
    law = law or mpm.MohrCoulomb(**CLAY)
    laws = {1: law, 2: below or law}
    index_map = domain.topology.index_map(dim)
    cells = np.arange(index_map.size_local + index_map.num_ghosts, dtype=np.int32)
    heights = compute_midpoints(domain, dim, cells)[:, dim - 1]
    tags = meshtags(domain, dim, cells, np.where(heights < 0.5, 2, 1).astype(np.int32))
    base = 2 * dim - 1
    supports = [bridge.roller(1, np.eye(dim)[0]), bridge.fixed(base)]
    fem = bridge.QuasiStatic(
        domain, laws, facet_tags, supports, 1, geometry=geometry if axisymmetric else None, nmd=True, cell_tags=tags,
        solver=bridge.Solver(tolerance=1e-11), **options,
    )  # fmt: skip
    fem.solve(bridge.Load(unit_weight=18e3))
    assert fem.converged
    mesh = bridge.background_mesh(domain, tags, facet_tags)
    model = mpm.Model(mesh, [*laws.values(), *more], **({"geometry": geometry} if axisymmetric else {}))
    for material, tag in enumerate(laws):
        model.seed(density=18e3 / 9.81, per_cell={3: 4, 2: 3}[dim], cell_tag=tag, material=material)
    model.roller(1, np.eye(dim)[0])
    model.fix(base)
    model.set_gravity([0.0] * (dim - 1) + [-9.81])
    return fem, model
