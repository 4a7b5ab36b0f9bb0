"""Axisymmetric finite elements and particles: hand-over, comparison, forces, elastic and mixed solutions."""

import numpy as np
import pytest
from axisymmetric_cases import (
    AXIS,
    AXISYMMETRIC,
    BASE,
    SOIL,
    TOP,
    UNIT_WEIGHT,
    WALL,
    cylinder_fem,
    cylinder_mesh,
    cylinder_particles,
)
from bridge_cases import excess_of_strength
from dolfinx import fem
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge.transfer.moved import held_volumes
from fenics_bridge.transfer.particle_forces import boundary_forces

ELASTIC = mpm.LinearElastic(young=1e6, poisson=0.3)


# --- hand-over -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("per_cell", [3, 12])
def test_on_the_same_cells_the_particles_are_in_equilibrium_at_once(per_cell):
    """Linear elements have the hoop strain of the particles, and 3 or 12 particles give the nodes their exact weight."""
    finite_elements = cylinder_fem(degree=1)
    assert 0.01 < np.mean(finite_elements.points.state[:, 0] > 0) < 0.5
    report = bridge.initialise(cylinder_particles(per_cell=per_cell), finite_elements, equilibrate=False)
    assert report.unbalanced_ratio < 1e-8 and report.returned_fraction == 0  # the elements' own residual is below 1e-8


def test_what_leaves_quadratic_elements_out_of_balance_goes_with_the_cells():
    found = []
    for cells in (6, 12, 24):
        elements = cylinder_fem(cells, law=ELASTIC, degree=2)
        found.append(
            bridge.initialise(cylinder_particles(cells, law=ELASTIC), elements, equilibrate=False).unbalanced_ratio
        )
    assert found[0] < 0.01 and found[1] < 0.75 * found[0] and found[2] < 0.75 * found[1]


@pytest.mark.parametrize(("degree", "fem_cells", "options"), [
    (2, 8, {}), (2, 12, {"smooth": True}), (1, 8, {"move": True}), (2, 6, {"move": True}),
])  # fmt: skip
def test_particles_come_into_equilibrium(degree, fem_cells, options):
    model = cylinder_particles(per_cell=10, headroom=0.25)
    report = bridge.initialise(model, cylinder_fem(fem_cells, degree=degree), **options)
    assert (
        report.unbalanced_ratio < (0.5 if options.get("move") else 0.15)
        and report.equilibrated_ratio < 1e-3
        and report.yielded_fraction < 0.02
    )
    assert excess_of_strength(model.particles.stress, SOIL["cohesion"], SOIL["friction_angle"]).max() < 1e-8


def test_hoop_stress_and_state_are_those_of_the_finite_elements():
    elements, model = cylinder_fem(degree=2), cylinder_particles()
    bridge.initialise(model, elements, equilibrate=False)
    values = elements.evaluate_at(model.particles.position)
    assert np.array_equal(model.particles.stress, values["stress"]) and np.array_equal(
        model.particles.state, values["state"]
    )
    difference = bridge.compare(elements, model, places=model.particles.position)
    assert difference["stress"].maximum == 0 and difference["displacement"].l2 < 1e-14
    # A cylinder widens under its weight: rings are strained, and their stress is another one than along the radius
    stress = model.particles.stress
    assert np.abs(stress[:, 2] - stress[:, 0]).max() > 0.1 * UNIT_WEIGHT


@pytest.mark.parametrize("degree", [1, 2])
def test_ground_at_rest_with_k0_stays_at_rest(degree):
    """sigma_r = sigma_theta = K0 sigma_v in level ground: nothing moves, and nothing yields."""
    law = mpm.MohrCoulomb(**SOIL | {"cohesion": 1e3, "friction_angle": 30.0})
    domain, _, facet_tags = cylinder_mesh()
    supports = [bridge.roller(AXIS, (1, 0)), bridge.roller(WALL, (1, 0)), bridge.fixed(BASE)]
    elements = bridge.QuasiStatic(domain, law, facet_tags, supports, degree, geometry=AXISYMMETRIC)
    load = bridge.Load(unit_weight=UNIT_WEIGHT)
    elements.set_initial_stress(bridge.k0_stress(elements.points.coordinates(), 1.0, UNIT_WEIGHT, 0.6), load)
    assert elements.equilibrate(load).converged
    model = cylinder_particles(law=law)
    model.roller(WALL, (1, 0))
    report = bridge.initialise(model, elements)
    assert (
        report.unbalanced_ratio < (1e-8 if degree == 1 else 5e-3)
        and report.yielded_fraction == report.returned_fraction == 0
    )
    stress, depth = model.particles.stress, 1.0 - model.particles.position[:, 1]
    assert np.abs(stress[:, 1] + UNIT_WEIGHT * depth).max() < UNIT_WEIGHT / 8  # one value in each cell
    assert np.abs(stress[:, [0, 2]] - 0.6 * stress[:, [1]]).max() < 0.03 * UNIT_WEIGHT
    list(model.explicit(0.05))
    settlement = UNIT_WEIGHT / (2 * 1.35e6)  # by which weightless ground would settle: gamma H^2 / 2 E_oed
    assert np.abs(model.particles.displacement - elements.evaluate_at(model.particles.initial_position)["displacement"]).max() \
        < 0.02 * settlement  # fmt: skip


def stretched(a, b):
    """Displacement u_r = a r, u_y = b r + b y of the cylinder."""
    space = cylinder_fem(16, solve=False, degree=1).displacement.function_space
    displacement = fem.Function(space)
    displacement.interpolate(lambda x: np.array([a * x[0], b * (x[0] + x[1])]))
    return displacement


def test_cells_hold_the_rings_that_have_moved_into_them():
    """Of a linear motion det F = (1 + a)^2 (1 + b) with the hoop, wherever the body goes: R^2 H / 2 times that."""
    domain, _, _ = cylinder_mesh(16, headroom=0.5)
    held = held_volumes(domain, stretched(0.1, 0.05), AXISYMMETRIC)
    assert held.sum() == pytest.approx(0.5 * 1.1**2 * 1.05, rel=2e-3)
    model = cylinder_particles(16, headroom=0.5)
    assert np.all(held <= 1.03 * model.cell_volumes)


@pytest.mark.parametrize("degree", [1, 2])
def test_volume_of_particles_that_moved_is_that_of_the_body(degree):
    """By Pappus' theorem, from the moved corners of the section: the integral of r^2 / 2 dy around it."""
    soft = mpm.LinearElastic(young=2e5, poisson=0.3)
    elements, model = cylinder_fem(law=soft, degree=degree), cylinder_particles(per_cell=10, headroom=0.25, law=soft)
    bridge.initialise(model, elements, move=True, equilibrate=False)
    corners = np.vstack([np.column_stack([np.linspace(a, b, 97), np.linspace(c, d, 97)])[:-1] for a, b, c, d in
                         ((0, 1, 0, 0), (1, 1, 0, 1), (1, 0, 1, 1), (0, 0, 1, 0))])  # fmt: skip
    r, y = (corners + elements.evaluate_at(corners)["displacement"]).T
    s = np.roll(r, -1)
    volume = np.sum((r**2 + r * s + s**2) / 6 * (np.roll(y, -1) - y))
    held = held_volumes(model.mesh.domain, elements.displacement, AXISYMMETRIC)
    assert held.sum() == pytest.approx(volume, rel=2e-3)
    with_particles = np.isin(np.arange(len(held)), model.particles.cell)  # what else the body fills is but a rim
    assert model.particles.volume.sum() == pytest.approx(held[with_particles].sum(), rel=1e-12)
    assert held[with_particles].sum() > 0.99 * held.sum()
    assert volume < 0.98 * 0.5
    assert model.particles.mass.sum() == pytest.approx(0.5 * UNIT_WEIGHT / 9.81, rel=1e-12)


# --- forces -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("tag", "force"), [(WALL, (-1.0, 0.0)), (TOP, (0.0, -0.5)), (BASE, (0.0, 0.5))])
def test_pressure_on_a_boundary_is_that_on_one_radian(tag, force):
    """The wall has the area R H, the ends R^2 / 2; and on the ends it acts where their rings are: moment R^3 / 3."""
    model = cylinder_particles()
    found = boundary_forces(model, tag, 100.0)
    assert found.sum(axis=0) == pytest.approx(100.0 * np.array(force), abs=1e-10)
    if tag != WALL:
        moment = np.sum(found[:, 1] * model.particles.position[:, 0])
        assert moment == pytest.approx(100.0 * 2 * force[1] / 3, rel=5e-3)


# --- elastic and mixed solutions -----------------------------------------------------------------------------------


@pytest.mark.parametrize("degree", [1, 2])
def test_elastic_solution_is_that_of_the_elasto_plastic_elements(degree):
    domain, _, facet_tags = cylinder_mesh()
    supports = [bridge.roller(AXIS, (1, 0)), bridge.fixed(BASE)]
    solution = bridge.solve_elastic(domain, facet_tags, supports, 1e6, 0.3, UNIT_WEIGHT, degree, geometry=AXISYMMETRIC)
    elements = cylinder_fem(law=ELASTIC, degree=degree)
    points = np.random.default_rng(1).uniform(0.02, 0.98, (50, 2))
    for smooth in (False, True):
        here, there = (each.evaluate_at(points, smooth=smooth) for each in (solution, elements))
        assert np.allclose(here["displacement"], there["displacement"], atol=1e-9)
        if degree == 1:
            assert np.allclose(here["stress"], there["stress"], atol=1e-6 * UNIT_WEIGHT)
    strain = [bridge.evaluate_at(points, e=each.deviatoric_strain_function())["e"] for each in (solution, elements)]
    assert np.allclose(*strain, atol=0.02 * strain[1].max())
    model = cylinder_particles(law=ELASTIC)
    assert bridge.initialise(model, solution, equilibrate=False).unbalanced_ratio < (1e-8 if degree == 1 else 0.02)


@pytest.mark.parametrize("solve", ["linear", "quadratic", "mixed"])
def test_uniform_strain_has_its_stress_up_to_the_axis(solve):
    """u_r = a r: the hoop strain is a, also where r = 0."""
    domain, _, facet_tags = cylinder_mesh(4)
    a, young, poisson = 1e-3, 1000.0, 0.25  # lambda = G = 400
    supports = [bridge.roller(AXIS, (1, 0)), bridge.prescribed(WALL, (a, None)), bridge.roller(BASE, (0, 1)),
                bridge.roller(TOP, (0, 1))]  # fmt: skip
    arguments = domain, facet_tags, supports, young, poisson, 0.0
    if solve == "mixed":
        solution = bridge.solve_nearly_incompressible(*arguments, geometry=AXISYMMETRIC)
    else:
        solution = bridge.solve_elastic(*arguments, 1 if solve == "linear" else 2, geometry=AXISYMMETRIC)
    stress = solution.stress.x.array.reshape(-1, 4)
    assert np.abs(stress - [1.6, 0.8, 1.6, 0.0]).max() < 1e-9


@pytest.mark.parametrize("poisson", [0.3, 0.4999])
def test_taylor_hood_elements_give_the_cylinder_of_lame(poisson):
    """A = p a^2 / (b^2 - a^2), u = (1 + nu) / E ((1 - 2 nu) A r + A b^2 / r), mean stress 2 (1 + nu) A / 3."""
    found = []
    for cells in (4, 8, 16):
        domain, _, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, [1.0, 0.25], [cells, 2])
        domain.geometry.x[:, 0] += 1.0
        ends = [bridge.roller(3, (0, 1)), bridge.roller(4, (0, 1))]
        law = mpm.LinearElastic(young=1000.0, poisson=poisson)
        elements = bridge.MixedQuasiStatic(domain, law, facet_tags, ends, geometry=AXISYMMETRIC)
        assert elements.equilibrate(bridge.Load(pressure={1: 1.0})).converged
        at = np.array([[1.0, 0.1], [2.0, 0.1]])
        exact = (1 + poisson) / 1000.0 * ((1 - 2 * poisson) / 3 * at[:, 0] + 4 / 3 / at[:, 0])
        found.append(np.abs(elements.evaluate_at(at)["displacement"][:, 0] / exact - 1).max())
    assert found[2] < 1e-5 and found[0] > 36 * found[2]
    assert elements.pressure_at(at) == pytest.approx(-2 * (1 + poisson) / 9, rel=0.02)
    linear = bridge.solve_nearly_incompressible(
        domain, facet_tags, ends, 1000.0, poisson, 0.0, {1: (1.0, 0.0)}, geometry=AXISYMMETRIC
    )
    assert linear.evaluate_at(at)["displacement"][:, 0] == pytest.approx(exact, rel=2e-5)


# --- what is refused -----------------------------------------------------------------------------------------------


def test_another_geometry_is_named():
    plane = mpm.Model(bridge.background_mesh(*cylinder_mesh(2)), ELASTIC)
    plane.seed(density=100.0, per_cell=3)
    elements = cylinder_fem(2, law=ELASTIC, degree=1)
    for call in (lambda: bridge.initialise(plane, elements), lambda: bridge.compare(elements, plane)):
        with pytest.raises(
            bridge.InputError,
            match="the geometry of the finite elements is AXISYMMETRIC, that of the particles is PLANE_STRAIN",
        ):
            call()
    domain, _, facet_tags = cylinder_mesh(2)
    solution = bridge.solve_elastic(domain, facet_tags, [bridge.fixed(BASE)], 1e6, 0.3, 1e3)
    with pytest.raises(
        bridge.InputError,
        match="the geometry of the finite elements is PLANE_STRAIN, that of the particles is AXISYMMETRIC",
    ):
        bridge.initialise(cylinder_particles(2, law=ELASTIC), solution)


def test_a_free_axis_is_named():
    domain, _, facet_tags = cylinder_mesh(2)
    free = [bridge.fixed(BASE)]
    calls = (
        lambda: bridge.solve_elastic(domain, facet_tags, free, 1e6, 0.3, 1e3, geometry=AXISYMMETRIC),
        lambda: bridge.solve_nearly_incompressible(domain, facet_tags, free, 1e6, 0.3, 1e3, geometry=AXISYMMETRIC),
        lambda: bridge.MixedQuasiStatic(domain, ELASTIC, facet_tags, free, geometry=AXISYMMETRIC),
    )
    for call in calls:
        with pytest.raises(bridge.InputError, match="supports: .* nodes lie on the axis and may move along the radius"):
            call()
