"""From finite elements to particles."""

import gc

import numpy as np
import pytest
from bridge_cases import POISSON, YOUNG, excess_of_strength, slope_model, slope_particles
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

UNIT_WEIGHT = 18e3


def solved(**options):
    model = slope_model(dilation_angle=0.0, **options)
    model.solve(bridge.Load(unit_weight=UNIT_WEIGHT))
    assert model.converged
    return model


@pytest.mark.parametrize("degree", [1, 2])
def test_on_the_same_cells_the_particles_are_in_equilibrium_at_once(degree):
    particles = slope_particles(UNIT_WEIGHT)
    report = bridge.initialise(particles, solved(degree=degree))
    assert report.unbalanced_ratio < 1e-10
    assert report.returned_share == 0 and report.yielded_share == 0


@pytest.mark.parametrize(
    ("fem_size", "cell_size", "kind", "smooth"),
    [(0.1, 0.05, "crossed", True), (0.05, 0.1, "crossed", False), (0.05, 0.1, "gmsh", True), (0.1, 0.1, "gmsh", True)],
)
def test_on_other_cells_the_particles_come_into_equilibrium(fem_size, cell_size, kind, smooth):
    particles = slope_particles(UNIT_WEIGHT, cell_size=cell_size, kind=kind)
    report = bridge.initialise(particles, solved(cell_size=fem_size), smooth=smooth)
    assert report.unbalanced_ratio < 0.05
    assert report.settled_ratio < 1e-3 and report.yielded_share < 0.01
    assert excess_of_strength(particles.particles.stress, 1e3, 25.0).max() < 1e-8


def test_particles_take_the_values_of_the_finite_elements():
    fem, model = solved(), slope_particles(UNIT_WEIGHT)
    bridge.initialise(model, fem, equilibrate=False)
    values = fem.evaluate_at(model.particles.position)
    assert np.allclose(model.particles.stress, values["stress"], atol=1e-9 * UNIT_WEIGHT)
    assert np.array_equal(model.particles.state, values["state"]) and values["state"].max() > 1e-4
    assert np.allclose(model.particles.displacement, values["displacement"], atol=1e-14)
    bridge.initialise(slope_particles(UNIT_WEIGHT), fem, count_displacement=False, equilibrate=False)


@pytest.mark.parametrize("count", [True, False])
def test_particles_move_with_the_body(count):
    """Then they no longer fill cells as before; a zero-load equilibration brings them back into balance."""
    fem, model = solved(), slope_particles(UNIT_WEIGHT)
    order = np.argsort(model.particles.id)
    start = model.particles.position[order]
    moved = fem.evaluate_at(start)["displacement"]
    bridge.initialise(model, fem, move=True, count_displacement=count, equilibrate=False)
    order = np.argsort(model.particles.id)
    assert np.allclose(model.particles.position[order], start + moved, atol=1e-14)
    assert np.allclose(model.particles.displacement[order], moved if count else 0.0, atol=1e-14)
    assert np.abs(moved).max() > 0.01


def test_particles_that_moved_come_into_equilibrium():
    model = slope_particles(UNIT_WEIGHT)
    report = bridge.initialise(model, solved(degree=1), move=True)
    assert report.unbalanced_ratio > 1e-3 > report.settled_ratio
    assert report.yielded_share < 0.05


def test_smooth_stress_is_brought_inside_the_strength():
    model = slope_particles(UNIT_WEIGHT, cell_size=0.05)
    report = bridge.initialise(model, solved(), smooth=True, equilibrate=False)
    assert 0 < report.returned_share < 0.1 and report.settled_ratio is None
    assert excess_of_strength(model.particles.stress, 1e3, 25.0).max() < 1e-8


def test_elastic_start():
    soil = bridge.soil_mesh(*bridge.slope_mesh(MPI.COMM_WORLD))
    supports = [bridge.roller(bridge.LEFT, (1, 0)), bridge.fixed(bridge.BASE)]
    solution = bridge.solve_elastic(soil[0], soil[2], supports, YOUNG, POISSON, UNIT_WEIGHT)
    law = mpm.LinearElastic(young=YOUNG, poisson=POISSON)
    report = bridge.initialise(slope_particles(UNIT_WEIGHT, law=law), solution)
    assert report.unbalanced_ratio < 1e-10


def test_background_mesh_outlives_the_mesh_that_it_came_from():
    model = slope_particles(UNIT_WEIGHT)
    gc.collect()
    assert model.out_of_balance() > 0.9


@pytest.mark.parametrize(
    ("law", "words"),
    [
        (mpm.LinearElastic(young=YOUNG, poisson=POISSON), "fem.*MohrCoulomb.*LinearElastic"),
        (
            mpm.MohrCoulomb(young=YOUNG, poisson=POISSON, cohesion=2e3, friction_angle=25.0),
            "cohesion=1000.*cohesion=2000",
        ),
    ],
)
def test_laws_that_do_not_match_are_named(law, words):
    with pytest.raises(bridge.InputError, match=words):
        bridge.initialise(slope_particles(UNIT_WEIGHT, law=law), solved())


def test_finite_elements_that_are_not_solved_are_refused():
    with pytest.raises(bridge.InputError, match="fem.*not been solved"):
        bridge.initialise(slope_particles(UNIT_WEIGHT), slope_model(dilation_angle=0.0))


def test_particle_outside_is_named():
    model = slope_particles(UNIT_WEIGHT)
    model.seed_points([[3.0, 0.5]], [1e-3], density=2000.0)
    with pytest.raises(bridge.InputError, match=r"particles: point .* at \(3, 0.5\) m is outside"):
        bridge.initialise(model, solved())
