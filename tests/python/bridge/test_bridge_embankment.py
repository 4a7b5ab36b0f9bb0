"""An embankment on soft clay, as a user would compute it first: what the options that he does not name give."""

import warnings

import numpy as np
import pytest
from dolfinx.mesh import CellType, DiagonalType, compute_midpoints, create_rectangle, locate_entities_boundary, meshtags
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

CLAY = mpm.tresca(young=4e6, poisson=0.45, shear_strength=10e3)
FILL = mpm.MohrCoulomb(young=20e6, poisson=0.3, cohesion=5e3, friction_angle=33.0)
WIDTH, HEIGHT, DEPTH, TOP, SHOULDER = 36.0, 11.0, 6.0, 10.0, 8.0  # m


def embankment(cell):
    """A fill of 4 m, with a slope of 1:2, is placed at once on 6 m of clay at rest, which cannot carry it."""
    counts = [round(length / cell) for length in (WIDTH, HEIGHT)]
    domain = create_rectangle(
        MPI.COMM_SELF, [[0, 0], [WIDTH, HEIGHT]], counts, CellType.triangle, diagonal=DiagonalType.crossed
    )
    cells = np.arange(domain.topology.index_map(2).size_local, dtype=np.int32)
    x, y = compute_midpoints(domain, 2, cells).T[:2]
    fill = (y > DEPTH) & (y < TOP) & (x < SHOULDER + 2 * (TOP - y))
    cell_tags = meshtags(domain, 2, cells, np.where(y < DEPTH, 1, np.where(fill, 2, 0)).astype(np.int32))
    sides = [(0, 0.0), (0, WIDTH), (1, 0.0)]
    found = [locate_entities_boundary(domain, 1, lambda p, a=a, at=at: np.isclose(p[a], at)) for a, at in sides]
    facets = np.concatenate(found).astype(np.int32)
    tags = np.repeat(np.arange(1, 4), [len(f) for f in found]).astype(np.int32)
    order = np.argsort(facets)
    mesh = bridge.background_mesh(domain, cell_tags, meshtags(domain, 1, facets[order], tags[order]))

    model = mpm.Model(mesh, [CLAY, FILL])
    for material, density in enumerate((1600.0, 1900.0)):
        model.seed(density=density, per_cell=10, cell_tag=material + 1, material=material)
    for tag in (1, 2):
        model.roller(tag, normal=(1, 0))
    model.fix(3)
    model.set_gravity((0.0, -9.81))
    p = model.particles
    vertical = np.where(p.material == 0, -1600.0 * 9.81 * (DEPTH - p.position[:, 1]), 0.0)
    p.set("stress", np.column_stack([0.82 * vertical, vertical, 0.82 * vertical, 0 * vertical]))
    return model


def slide(cell, **options):
    """Displacement of the crest after 2 s [m], and the last report."""
    model = embankment(cell)
    report = model.explicit(2.0, nmd=True, **options).last()
    p = model.particles
    crest = np.argmin(np.linalg.norm(p.initial_position - (SHOULDER, TOP), axis=1))
    return float(np.linalg.norm(p.displacement[crest])), report


@pytest.fixture(scope="module")
def coarse():
    """Displacement of the crest on cells of 1 m, whose slide no warning is about [m]."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return slide(1.0)[0]


def test_it_slides_as_far_on_finer_cells_and_keeps_its_energy(coarse):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        fine, report = slide(0.5)
    assert fine > 0.5  # it has failed
    assert coarse == pytest.approx(fine, rel=0.07)
    assert abs(report.unexplained_fraction) < 2e-3


def test_averages_without_mixed_integration_say_that_they_go_too_far(coarse):
    with pytest.warns(
        RuntimeWarning, match="integration=PARTICLES: particles gather in some cells, and the slide goes too far"
    ):
        far, _ = slide(1.0, integration=mpm.Integration.PARTICLES)
    assert far > 1.5 * coarse
