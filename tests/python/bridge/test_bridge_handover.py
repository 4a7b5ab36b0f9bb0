"""From finite elements to particles."""

import gc
import warnings

import numpy as np
import pytest
from bridge_cases import (
    POISSON,
    YOUNG,
    column,
    column_settlement,
    excess_of_strength,
    interior_points,
    slope_model,
    slope_particles,
)
from dolfinx import fem, mesh
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import compat
from fenics_bridge.mesh.tagged import cell_volumes
from fenics_bridge.transfer.moved import fitted_volumes, held_volumes, simplex_samples

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


class Loam:
    """The Mohr-Coulomb law, called from Python, with an array among its attributes."""

    n_state = 2
    p_wave_modulus = mpm.LinearElastic(young=YOUNG, poisson=POISSON).p_wave_modulus
    strength_parameters = {"c": "strength", "phi": "friction angle"}

    def __init__(self, c, exponents=(1.0, 0.0)):
        self.c, self.phi, self.exponents = c, 25.0, np.array(exponents)

    def update(self, *points):
        strength = {"cohesion": self.c * self.exponents[0], "friction_angle": self.phi}
        mpm.MohrCoulomb(young=YOUNG, poisson=POISSON, **strength).update(*points)


def test_laws_in_python_match_by_their_code_and_values():
    """Not as objects: a factor of safety makes new ones each time."""

    def reduced(*values):
        return bridge.reduced_strength(mpm.PythonLaw(Loam(*values)), 1.05)

    body, _, facets = bridge.soil_mesh(*bridge.slope_mesh(MPI.COMM_WORLD, cell_size=0.2))
    held = [bridge.roller(bridge.LEFT, (1, 0)), bridge.fixed(bridge.BASE)]
    fem_model = bridge.QuasiStatic(body, reduced(1.2e3), facets, held, degree=1)
    fem_model.solve(bridge.Load(unit_weight=UNIT_WEIGHT))
    assert fem_model.converged
    model = slope_particles(UNIT_WEIGHT, cell_size=0.2, law=reduced(1.2e3))
    assert bridge.initialise(model, fem_model).unbalanced_ratio < 1e-8
    for values, words in (
        ((1.26e3,), r"has law=Loam\(c=1142.8.*has law=Loam\(c=1200.0"),
        ((1.2e3, (1.0, 0.1)), "has law=Loam"),
    ):
        with pytest.raises(mpm.InputError, match=words):
            bridge.initialise(slope_particles(UNIT_WEIGHT, cell_size=0.2, law=reduced(*values)), fem_model)


@pytest.mark.parametrize(
    ("weight", "said"), [(UNIT_WEIGHT, False), (0.5 * UNIT_WEIGHT, True), (1.1 * UNIT_WEIGHT, True)]
)
def test_particles_of_another_weight_are_said(weight, said):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        bridge.initialise(slope_particles(weight), solved(degree=1), equilibrate=False)
    words = f"unit weight of particles is {weight:.5g} N/m3, density times gravity, that of the finite elements {UNIT_WEIGHT:.5g} N/m3"
    assert any(words in str(one.message) for one in caught) == said


@pytest.mark.parametrize(
    ("load", "given", "said"),
    [
        ({"pressure": {4: 5e3}}, None, "pressure"),
        ({"traction": {4: (1e3, -5e3)}}, None, "traction"),
        ({"pressure": {4: 0.0}}, None, ""),
        ({"pressure": {4: 5e3}}, lambda model: model.traction(4, (0.0, -5e3)), ""),
        ({"pore_pressure": bridge.hydrostatic(1.0)}, None, "pore pressure"),
        ({"pore_pressure": lambda x: 0 * x[:, 0]}, None, ""),
        (
            {"pore_pressure": bridge.hydrostatic(1.0)},
            lambda model: model.particles.set("traction", bridge.seepage_forces(model, bridge.hydrostatic(1.0))),
            "",
        ),
        ({"displacement": 1.0}, None, "prescribed displacement at 4"),
        ({"displacement": 1.0}, lambda model: model.fix(4), ""),
        ({"displacement": 0.0}, None, ""),
    ],
)
def test_loads_that_particles_lack_are_said(load, given, said):
    """Once, with their names; particles without them are far from equilibrium."""
    domain, cell_tags, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, (1.0, 1.0), (4, 4))
    law, load = mpm.LinearElastic(young=1e7, poisson=0.3), dict(load)
    supports = [bridge.fixed(3), bridge.roller(1, (1, 0)), bridge.roller(2, (1, 0))]
    pushed = [bridge.prescribed(4, (0.0, -1e-3))] if "displacement" in load else []
    fem_model = bridge.QuasiStatic(domain, law, facet_tags, [*supports, *pushed], 1)
    if "pore_pressure" in load:
        fem_model.reconfigure(pore_pressure=load.pop("pore_pressure"))
    fem_model.solve(bridge.Load(unit_weight=20e3, **load))
    model = mpm.Model(bridge.background_mesh(domain, cell_tags, facet_tags), law)
    model.seed(density=20e3 / 9.81, per_cell=3)
    bridge.apply_supports(model, supports)
    model.set_gravity((0.0, -9.81))
    if given is not None:
        given(model)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        handover = bridge.initialise(model, fem_model, equilibrate=False)
    texts = [str(one.message) for one in caught if "the finite elements carry" in str(one.message)]
    assert [text[: len(text.split(", which")[0])] for text in texts] == (
        [f"the finite elements carry {said}"] if said else []
    )
    assert said == "" or handover.unbalanced_ratio > 0.01


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


def test_finite_elements_that_are_not_solved_are_refused():
    with pytest.raises(bridge.InputError, match="fem.*not been solved"):
        bridge.initialise(slope_particles(UNIT_WEIGHT), slope_model(dilation_angle=0.0))


def test_particle_outside_is_named():
    model = slope_particles(UNIT_WEIGHT)
    model.seed_points([[3.0, 0.5]], [1e-3], density=2000.0)
    with pytest.raises(bridge.InputError, match=r"particles: point .* at \(3, 0.5\) m is outside"):
        bridge.initialise(model, solved())


@pytest.mark.parametrize(
    ("make", "fields", "options", "found"),
    [
        (lambda model: model.add_contact(mpm.Plane((0.0, -0.1), (0.0, 1.0))), None, {}, "contact with .* \\(Plane\\)"),
        (lambda model: model.absorb(2), None, {}, "sides that absorb waves"),
        (lambda model: None, [0, 1], {}, "2 velocity fields"),
        (lambda model: None, None, {"integration": mpm.Integration.DUAL_DOMAIN}, "integration DUAL_DOMAIN"),
        (
            lambda model: model.absorb(2),
            [0, 0],
            {"integration": mpm.Integration.DUAL_DOMAIN},
            "sides .* and integration",
        ),
    ],
)
def test_what_equilibrate_does_not_support_is_refused_before_particles_change(make, fields, options, found):
    cells = bridge.box_mesh(MPI.COMM_WORLD, [1.0, 1.0], [4, 4])
    soil = mpm.LinearElastic(young=1e6, poisson=0.3)
    elements = bridge.QuasiStatic(cells[0], soil, cells[2], [bridge.fixed(3)], degree=1)
    elements.solve(bridge.Load(unit_weight=UNIT_WEIGHT))
    model = mpm.Model(bridge.background_mesh(*cells), [soil, soil], velocity_fields=fields)
    model.seed(density=UNIT_WEIGHT / 9.81, per_cell=3)
    model.fix(3)
    model.set_gravity((0, -9.81))
    make(model)
    with pytest.raises(mpm.InputError, match=f"equilibrate is True, expected False with {found}"):
        bridge.initialise(model, elements, **options)
    with pytest.raises(mpm.InputError, match=f"equilibrate\\(\\) does not support {found}"):
        model.equilibrate(**options)
    assert not model.particles.stress.any()
    bridge.initialise(model, elements, equilibrate=False, **options)
    assert model.particles.stress.any()


@pytest.mark.parametrize(
    "options, words", [({"nmd": "no"}, "nmd is 'no'"), ({"integration": "mixed"}, "integration is 'mixed'")]
)
def test_options_of_the_run_that_are_none_are_refused_before_particles_change(options, words):
    model = slope_particles(UNIT_WEIGHT)
    with pytest.raises(mpm.InputError, match=words):
        bridge.initialise(model, solved(degree=1), **options)
    assert not model.particles.stress.any()


def test_gravity_that_still_rises_is_refused_and_said():
    """Under the gravity at the start of a ramp, which is zero, particles would lose the stresses that they are given."""
    particles, elements = slope_particles(UNIT_WEIGHT), solved(degree=1)
    particles.set_gravity(particles.gravity, ramp=2.0)
    with pytest.raises(mpm.InputError, match=r"gravity is 0% of \[0.0, -9.81\] m/s2 at t = 0 s, and rises until 2 s"):
        bridge.initialise(particles, elements)
    particles.set_gravity(particles.gravity)
    bridge.initialise(particles, elements)
    assert particles.particles.stress[:, 1].min() < -0.7 * UNIT_WEIGHT  # the slope is 1 m high
