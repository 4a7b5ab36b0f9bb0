"""From finite elements to particles that move with the body."""

import numpy as np
import pytest
from bridge_cases import POISSON, YOUNG, column, slope_model, slope_particles
from dolfinx import fem
from handover_cases import UNIT_WEIGHT, solved
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import compat
from fenics_bridge.mesh.tagged import cell_volumes
from fenics_bridge.transfer.moved import fitted_volumes, held_volumes, simplex_samples


@pytest.mark.parametrize("count", [True, False])
def test_particles_move_with_the_body(count):
    """Then they no longer fill cells as before; a zero-load equilibration brings them back into balance."""
    fem_model, model = solved(), slope_particles(UNIT_WEIGHT)
    order = np.argsort(model.particles.id)
    start = model.particles.position[order]
    moved = fem_model.evaluate_at(start)["displacement"]
    bridge.initialise(model, fem_model, move=True, count_displacement=count, equilibrate=False)
    order = np.argsort(model.particles.id)
    assert np.allclose(model.particles.position[order], start + moved, atol=1e-14)
    assert np.allclose(model.particles.displacement[order], moved if count else 0.0, atol=1e-14)
    assert np.abs(moved).max() > 0.01


@pytest.mark.parametrize(
    ("degree", "fem_size", "cell_size", "kind"),
    [(1, 0.1, 0.1, "crossed"), (2, 0.1, 0.1, "crossed"), (1, 0.1, 0.05, "crossed"), (2, 0.05, 0.1, "gmsh")],
)
def test_particles_that_moved_come_into_equilibrium_and_hardly_any_yields(degree, fem_size, cell_size, kind):
    model = slope_particles(UNIT_WEIGHT, cell_size=cell_size, kind=kind)
    report = bridge.initialise(model, solved(degree=degree, cell_size=fem_size), move=True)
    assert report.unbalanced_ratio > 1e-3 > report.equilibrated_ratio
    assert report.yielded_fraction < 0.01


def test_particles_near_collapse_too():
    """22 kN/m3 is 92 % of what these cells carry with associated flow."""
    fem_model = slope_model(degree=2)
    fem_model.solve(bridge.Load(unit_weight=22e3))
    law = mpm.MohrCoulomb(young=YOUNG, poisson=POISSON, cohesion=1e3, friction_angle=25.0, dilation_angle=25.0)
    for move in (False, True):
        report = bridge.initialise(slope_particles(22e3, law=law), fem_model, move=move)
        assert report.equilibrated_ratio < 1e-3 and report.yielded_fraction < 0.01


def stretched(stretch, shift):
    """Displacement of the slope, 1.6 m2, that is linear in the coordinates."""
    space = slope_model(degree=1).displacement.function_space
    displacement = fem.Function(space)
    displacement.interpolate(lambda x: np.array([stretch * x[0] + shift, 0.2 * x[0]]))
    return displacement


def test_cells_hold_what_has_moved_into_them():
    """Stretched, sheared and shifted linearly, the body keeps its volume but for the stretch, wherever it goes."""
    domain, _, _ = bridge.slope_mesh(MPI.COMM_WORLD, cell_size=0.1, headroom=1.0)
    held = held_volumes(domain, stretched(0.1, 0.013))
    assert held.sum() == pytest.approx(1.1 * 1.6, rel=2e-3)
    middle = domain.geometry.x[compat.cell_nodes(domain)].mean(axis=1)
    start = np.column_stack([(middle[:, 0] - 0.013) / 1.1, middle[:, 1]])
    start[:, 1] -= 0.2 * start[:, 0]
    inside = np.minimum.reduce([*start.T, 1 - start[:, 1], (2.1 - start.sum(axis=1)) / 2])
    full = cell_volumes(domain)
    assert np.array_equal(held[inside > 0.1], full[inside > 0.1]) and (held[inside < -0.1] == 0).all()
    assert np.sum(inside > 0.1) > 300 and held.max() <= full.max() * 1.03


def test_body_that_shrinks_in_three_dimensions_keeps_its_share_of_the_cells():
    domain, _, _, _ = column(3)
    displacement = fem.Function(compat.function_space(domain, "Lagrange", 2, 3))
    displacement.interpolate(lambda x: -0.1 * x)
    held, full = held_volumes(domain, displacement), cell_volumes(domain)
    assert held.sum() == pytest.approx(0.9**3 * full.sum(), rel=5e-3) and np.all(held <= full * 1.05)


@pytest.mark.parametrize("dim", [2, 3])
def test_samples_of_a_simplex_are_even(dim):
    """Half of the volume is where a coordinate is below 1 - 0.5^(1/D); the mean is the centroid."""
    shares = simplex_samples(dim, 200)
    assert np.allclose(shares.sum(axis=1), 1) and shares.min() >= 0
    assert np.allclose(shares.mean(axis=0), 1 / (dim + 1), atol=0.01)
    assert np.allclose((shares < 1 - 0.5 ** (1 / dim)).mean(axis=0), 0.5, atol=0.03)


def test_volumes_are_fitted_cell_by_cell():
    fitted = fitted_volumes(np.array([1.0, 2.0, 3.0]), np.array([0, 0, 2]), np.array([6.0, 1.0, 0.0]))
    assert np.allclose(fitted, [2.0, 4.0, 3.0])


def test_volume_of_particles_that_moved_is_that_of_the_body():
    """By the divergence theorem the area is the integral of x dy around it, along the moved corners of its boundary."""
    model, fem_model = slope_particles(UNIT_WEIGHT), solved(degree=1)
    bridge.initialise(model, fem_model, move=True, equilibrate=False)
    corners = np.vstack([np.column_stack([np.linspace(a, b, 11), np.linspace(c, d, 11)])[:-1] for a, b, c, d in
                         ((0, 2.1, 0, 0), (2.1, 1.1, 0, 1), (1.1, 0, 1, 1), (0, 0, 1, 0))])  # fmt: skip
    x, y = (corners + fem_model.evaluate_at(corners)["displacement"]).T
    area = 0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))
    assert model.particles.volume.sum() == pytest.approx(area, rel=5e-3)
    assert area < 0.98 * 1.6
