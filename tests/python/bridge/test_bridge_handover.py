"""From finite elements to particles."""

import gc

import numpy as np
import pytest
from bridge_cases import POISSON, YOUNG, column, column_settlement, excess_of_strength, interior_points, slope_particles
from dolfinx import mesh
from handover_cases import UNIT_WEIGHT, solved
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import compat


@pytest.mark.parametrize("degree", [1, 2])
def test_on_the_same_cells_the_particles_are_in_equilibrium_at_once(degree):
    particles = slope_particles(UNIT_WEIGHT)
    report = bridge.initialise(particles, solved(degree=degree))
    assert report.unbalanced_ratio < 1e-10
    assert report.returned_fraction == 0 and report.yielded_fraction == 0


@pytest.mark.parametrize(
    ("fem_size", "cell_size", "kind", "smooth"),
    [(0.1, 0.05, "crossed", True), (0.05, 0.1, "crossed", False), (0.05, 0.1, "gmsh", True), (0.1, 0.1, "gmsh", True)],
)
def test_on_other_cells_the_particles_come_into_equilibrium(fem_size, cell_size, kind, smooth):
    particles = slope_particles(UNIT_WEIGHT, cell_size=cell_size, kind=kind)
    report = bridge.initialise(particles, solved(cell_size=fem_size), smooth=smooth)
    assert report.unbalanced_ratio < 0.05
    assert report.equilibrated_ratio < 1e-3 and report.yielded_fraction < 0.01
    assert excess_of_strength(particles.particles.stress, 1e3, 25.0).max() < 1e-8


def test_particles_take_the_values_of_the_finite_elements():
    fem_model, model = solved(), slope_particles(UNIT_WEIGHT)
    bridge.initialise(model, fem_model, equilibrate=False)
    values = fem_model.evaluate_at(model.particles.position)
    assert np.allclose(model.particles.stress, values["stress"], atol=1e-9 * UNIT_WEIGHT)
    assert np.array_equal(model.particles.state, values["state"]) and values["state"].max() > 1e-4
    assert np.allclose(model.particles.displacement, values["displacement"], atol=1e-14)
    bridge.initialise(slope_particles(UNIT_WEIGHT), fem_model, count_displacement=False, equilibrate=False)


@pytest.mark.parametrize(("fem_size", "cell_size"), [(0.1, 0.1), (0.1, 0.05), (0.05, 0.1)])
def test_soil_that_is_handed_over_softens_as_seeded_soil_does(fem_size, cell_size):
    """The particles begin with the strength that the finite elements left them, and soften by the size of their own cells."""
    peak = mpm.MohrCoulomb(young=YOUNG, poisson=POISSON, cohesion=1e3, friction_angle=25.0)
    law = mpm.SofteningMohrCoulomb(peak, residual_cohesion=0.9e3, residual_friction_angle=25.0, softening_strain=0.1,
                                   reference_length=0.1)  # fmt: skip
    body, _, facets = bridge.soil_mesh(*bridge.slope_mesh(MPI.COMM_WORLD, cell_size=fem_size))
    held = [bridge.roller(bridge.LEFT, (1, 0)), bridge.fixed(bridge.BASE)]
    fem_model = bridge.QuasiStatic(body, law, facets, held, degree=1)
    fem_model.solve(bridge.Load(unit_weight=UNIT_WEIGHT))
    assert fem_model.converged
    model = slope_particles(UNIT_WEIGHT, cell_size, law=law)
    bridge.initialise(model, fem_model, equilibrate=False)
    # Squares cut in four by their diagonals: triangles that are halves of squares of this side. Strength is lost by plastic
    # strain times size over the reference length: that of the elements' cells before, that of the particles' cells after
    plastic, band, _, _ = model.particles.state.T
    assert plastic.max() > 1e-4
    assert np.allclose(band, plastic * fem_size / np.sqrt(2) / 0.1, rtol=1e-12, atol=0)
    order = np.argsort(model.particles.id)
    before = model.particles.state[order]
    model.set_gravity((0.0, -2 * 9.81))
    list(model.explicit(0.02))
    more = model.particles.state[np.argsort(model.particles.id)] - before
    assert more[:, 0].max() > 1e-3
    assert np.allclose(more[:, 1], more[:, 0] * cell_size / np.sqrt(2) / 0.1, rtol=1e-9, atol=1e-15)


def test_accumulated_strain_goes_to_the_particles():
    """Of the column between rollers e_yy is the only strain, and the sum of sqrt(2/3 de : de) is 2/3 of its size."""
    domain, facet_tags, supports, height = column(2)
    law = mpm.LinearElastic(young=YOUNG, poisson=POISSON)
    plastic = bridge.QuasiStatic(domain, law, facet_tags, supports)
    plastic.solve(bridge.Load(unit_weight=UNIT_WEIGHT))
    elastic = bridge.solve_elastic(domain, facet_tags, supports, YOUNG, POISSON, UNIT_WEIGHT, degree=2)
    points = interior_points(30, 2)
    top = column_settlement(unit_weight=UNIT_WEIGHT)
    cells = bridge.PointSearch(domain, points)
    for solution in (plastic, elastic):
        strain = cells.values(solution.deviatoric_strain_function())[:, 0]
        exact = 2 / 3 * np.abs(2 * top * (height - points[:, 1]))
        assert np.allclose(strain, exact, atol=2 / 3 * abs(2 * top) * 0.25)  # constant in cells of 0.25 m
        assert np.abs(strain - exact).mean() < 0.3 * exact.mean()
    model = slope_particles(UNIT_WEIGHT)
    fem_model = solved(degree=1)
    bridge.initialise(model, fem_model, equilibrate=False)
    there = bridge.evaluate_at(model.particles.position, strain=fem_model.deviatoric_strain_function())["strain"]
    assert np.array_equal(model.particles.deviatoric_strain, there[:, 0]) and there.max() > 1e-3


def test_smooth_stress_is_brought_inside_the_strength():
    model = slope_particles(UNIT_WEIGHT, cell_size=0.05)
    report = bridge.initialise(model, solved(), smooth=True, equilibrate=False)
    assert 0 < report.returned_fraction < 0.1 and report.equilibrated_ratio is None
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


def test_materials_are_matched_place_by_place():
    """Two laws over and under half of the height, in the finite elements and in the particles."""
    domain, cell_tags, facet_tags = bridge.soil_mesh(*bridge.slope_mesh(MPI.COMM_WORLD))
    above = domain.geometry.x[compat.cell_nodes(domain)[cell_tags.indices], 1].mean(axis=1) > 0.5
    layers = mesh.meshtags(domain, 2, cell_tags.indices, np.where(above, 7, 4).astype(np.int32))
    laws = [mpm.MohrCoulomb(young=YOUNG, poisson=POISSON, cohesion=c, friction_angle=25.0) for c in (1e3, 3e3)]
    supports = [bridge.roller(bridge.LEFT, (1, 0)), bridge.fixed(bridge.BASE)]
    fem_model = bridge.QuasiStatic(domain, {7: laws[0], 4: laws[1]}, facet_tags, supports, 1, cell_tags=layers)
    fem_model.solve(bridge.Load(unit_weight=UNIT_WEIGHT))
    model = slope_particles(UNIT_WEIGHT, law=laws)
    model.assign(np.where(model.particles.position[:, 1] > 0.5, 0, 1))
    report = bridge.initialise(model, fem_model)
    assert report.unbalanced_ratio < 1e-8 and report.yielded_fraction == 0
    model.assign(np.zeros(len(model.particles), dtype=int))
    with pytest.raises(bridge.InputError, match="cohesion=3000.*material 0.*cohesion=1000"):
        bridge.initialise(model, fem_model)
