"""Elasto-plastic equilibrium with the laws of the particles."""

import re

import numpy as np
import pytest
from bridge_cases import (
    POISSON,
    UNIT_WEIGHT,
    YOUNG,
    column,
    column_settlement,
    column_stress,
    excess_of_strength,
    interior_points,
    slope_model,
    top_of_column,
)
from dolfinx import mesh
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge.compat import cell_nodes
from fenics_bridge.mesh.tagged import owned_cells


def elastic_column(dim, degree=2):
    domain, facet_tags, supports, _ = column(dim)
    law = mpm.LinearElastic(young=YOUNG, poisson=POISSON)
    return bridge.QuasiStatic(domain, law, facet_tags, supports, degree)


@pytest.mark.parametrize(("dim", "degree"), [(2, 2), (3, 2), (2, 4)])
def test_elastic_column_is_exact_at_the_quadrature_points(dim, degree):
    model = elastic_column(dim, degree)
    model.solve(bridge.Load(unit_weight=UNIT_WEIGHT))
    exact = column_stress(model.points.coordinates()[:, -1], dim)
    assert model.converged
    assert np.allclose(model.points.stress, exact, atol=1e-8 * UNIT_WEIGHT)
    assert top_of_column(model) == pytest.approx(column_settlement(), rel=1e-9)
    points = interior_points(50, dim)
    values = model.evaluate_at(points, smooth=True)
    assert np.allclose(values["stress"], column_stress(points[:, -1], dim), atol=1e-8 * UNIT_WEIGHT)


def test_the_mean_of_a_cell_is_that_by_its_area():
    # The mean of x^2 over a triangle with its corners at x_k is (sum of x_k^2 + sum of x_k x_l, k < l) / 6
    model = elastic_column(2, 4)
    squares = model.points.cell_function(model.points.coordinates()[:, 1] ** 2, "square", 0)
    y = model.domain.geometry.x[bridge.compat.cell_nodes(model.domain)][:, :, 1]
    assert np.allclose(squares.x.array, (y.sum(axis=1) ** 2 + (y**2).sum(axis=1)) / 12, rtol=1e-12)


@pytest.mark.parametrize("degree", [1, 2])
def test_the_law_of_the_particles_gives_the_linear_solution(degree):
    model = slope_model(degree=degree)
    model.equilibrate(bridge.Load(unit_weight=UNIT_WEIGHT), mpm.LinearElastic(young=YOUNG, poisson=POISSON))
    supports = [bridge.roller(bridge.LEFT, (1, 0)), bridge.fixed(bridge.BASE)]
    linear = bridge.solve_elastic(model.domain, model.facet_tags, supports, YOUNG, POISSON, UNIT_WEIGHT, degree)
    scale = np.abs(linear.displacement.x.array).max()
    assert np.allclose(model.displacement.x.array, linear.displacement.x.array, atol=1e-9 * scale)


@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("dim", [2, 3])
def test_reactions_at_all_supports_add_up_to_the_load(dim, degree):
    # A block between smooth sides on a rough base: K_0 stresses, so that a side carries K_0 gamma / 2, and no shear.
    domain, cell_tags, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, (2.0, *(1.0,) * (dim - 1)), (4,) * dim)
    sides = [bridge.roller(tag, np.eye(dim)[(tag - 1) // 2]) for tag in range(1, 2 * dim - 1)]
    law = mpm.LinearElastic(young=YOUNG, poisson=POISSON)
    model = bridge.QuasiStatic(domain, law, facet_tags, [*sides, bridge.fixed(2 * dim - 1)], degree)
    model.solve(bridge.Load(unit_weight=UNIT_WEIGHT))
    forces = np.array([model.reaction(tag) for tag in range(1, 2 * dim + 1)])
    expected = np.zeros((2 * dim, dim))
    expected[0, 0] = -0.5 * UNIT_WEIGHT * POISSON / (1 - POISSON)
    expected[1, 0] = -expected[0, 0]
    if dim == 3:
        expected[2:4, 1] = 2 * expected[:2, 0]
    expected[2 * dim - 2, -1] = -2 * UNIT_WEIGHT
    assert np.allclose(forces, expected, atol=1e-6 * UNIT_WEIGHT)


def test_stages_add_up_and_pressure_acts_on_its_facets():
    model = elastic_column(2)
    model.solve(bridge.Load(unit_weight=UNIT_WEIGHT))
    model.solve(bridge.Load(unit_weight=UNIT_WEIGHT, pressure={bridge.CREST: 5e3}))
    exact = column_stress(model.points.coordinates()[:, 1], 2)
    sideways = POISSON / (1 - POISSON)
    exact += -5e3 * np.array([sideways, 1, sideways, 0])
    assert np.allclose(model.points.stress, exact, atol=1e-8 * UNIT_WEIGHT)
    # the body presses on its base with its weight and the pressure: 0.5 m wide, 1 m high
    assert np.allclose(model.reaction(bridge.BASE)[1], -(UNIT_WEIGHT * 0.5 + 5e3 * 0.5))
    model.reset_displacement()
    model.solve(bridge.Load())
    assert np.allclose(model.points.stress, 0, atol=1e-8 * UNIT_WEIGHT)
    assert top_of_column(model) == pytest.approx(-column_settlement() + 5e3 / (UNIT_WEIGHT / -2 / column_settlement()))


@pytest.mark.parametrize("friction_angle", [0.0, 30.0])
def test_compression_between_plates_ends_at_the_strength(friction_angle):
    """Biaxial test: sigma_1 = 2 c tan(45 + phi/2) at failure without side pressure."""
    background, cell_tags, facet_tags = bridge.slope_mesh(MPI.COMM_WORLD, angle=90, crest=0.5, cell_size=0.25)
    domain, _, facet_tags = bridge.soil_mesh(background, cell_tags, facet_tags)
    law = mpm.MohrCoulomb(young=YOUNG, poisson=POISSON, cohesion=1e3, friction_angle=friction_angle)
    supports = [
        bridge.roller(bridge.LEFT, (1, 0)),
        bridge.roller(bridge.BASE, (0, 1)),
        bridge.prescribed(bridge.CREST, (None, -0.05)),
    ]
    model = bridge.QuasiStatic(domain, law, facet_tags, supports)
    model.solve(bridge.Load(displacement=1.0))
    strength = 2e3 * np.tan(np.radians(45 + friction_angle / 2))
    assert model.converged
    assert np.allclose(model.points.stress[:, 1], -strength, rtol=1e-6)
    assert model.reaction(bridge.CREST)[1] == pytest.approx(0.5 * strength, rel=1e-6)
    assert model.reaction(bridge.BASE)[1] == pytest.approx(-0.5 * strength, rel=1e-6)


@pytest.mark.parametrize(("degree", "nmd"), [(2, False), (1, True)])
def test_compression_of_a_cube_ends_at_the_strength(degree, nmd):
    domain = mesh.create_unit_cube(MPI.COMM_WORLD, 2, 2, 2)
    places = [
        lambda x: np.isclose(x[0], 0),
        lambda x: np.isclose(x[1], 0),
        lambda x: np.isclose(x[2], 0),
        lambda x: np.isclose(x[2], 1),
    ]
    facets = [mesh.locate_entities_boundary(domain, 2, place) for place in places]
    values = np.repeat(np.arange(1, 5, dtype=np.int32), [len(f) for f in facets])
    order = np.argsort(np.concatenate(facets))
    facet_tags = mesh.meshtags(domain, 2, np.concatenate(facets)[order], values[order])
    law = mpm.MohrCoulomb(young=YOUNG, poisson=POISSON, cohesion=1e3, friction_angle=30.0, dilation_angle=10.0)
    supports = [
        bridge.roller(1, (1, 0, 0)),
        bridge.roller(2, (0, 1, 0)),
        bridge.roller(3, (0, 0, 1)),
        bridge.prescribed(4, (None, None, -0.05)),
    ]
    model = bridge.QuasiStatic(domain, law, facet_tags, supports, degree=degree, nmd=nmd)
    model.solve(bridge.Load(displacement=1.0))
    strength = 2e3 * np.tan(np.radians(60))
    assert model.converged and np.allclose(model.points.stress[:, 2], -strength, rtol=1e-6)
    assert np.allclose(model.points.stress[:, [0, 1, 3, 4, 5]], 0, atol=1e-5 * strength)
    assert model.reaction(4)[2] == pytest.approx(strength, rel=1e-6)


def layers(domain):
    """Tags of the cells above (7) and below (4) half of the height."""
    number = owned_cells(domain)
    above = domain.geometry.x[cell_nodes(domain)[:number], 1].mean(axis=1) > 0.5
    return mesh.meshtags(domain, 2, np.arange(number, dtype=np.int32), np.where(above, 7, 4).astype(np.int32))


def layered_column(upper, lower, **options):
    """QuasiStatic of the column, 1 m high, with a law for each layer."""
    domain, facet_tags, supports, _ = column(2)
    cell_tags = layers(domain)
    return bridge.QuasiStatic(domain, {7: upper, 4: lower}, facet_tags, supports, cell_tags=cell_tags, **options)


@pytest.mark.parametrize("degree", [1, 2])
def test_layers_with_their_own_law_and_weight(degree):
    """One-dimensional compression: stress from the weights above, strain from each layer's oedometer modulus."""
    soft, stiff = (mpm.LinearElastic(young=young, poisson=POISSON) for young in (YOUNG, 5 * YOUNG))
    model = layered_column(soft, stiff, degree=degree)
    weight = {7: 10e3, 4: 30e3}
    model.solve(bridge.Load(unit_weight=weight))
    assert model.converged and [law.young for law in model.laws] == [YOUNG, 5 * YOUNG]
    assert model.reaction(bridge.BASE)[1] == pytest.approx(-0.5 * (0.5 * 10e3 + 0.5 * 30e3))
    y = model.points.coordinates()[:, 1]
    exact = -np.where(y > 0.5, 10e3 * (1 - y), 10e3 * 0.5 + 30e3 * (0.5 - y))
    assert np.allclose(model.points.stress[:, 1], exact, atol=1e-8 * 20e3 if degree == 2 else 0.25 * 30e3)
    modulus = YOUNG * (1 - POISSON) / ((1 + POISSON) * (1 - 2 * POISSON))
    upper = 10e3 * 0.5**2 / 2 / modulus
    lower = (10e3 * 0.5 * 0.5 + 30e3 * 0.5**2 / 2) / (5 * modulus)
    assert top_of_column(model) == pytest.approx(-upper - lower, rel=1e-9 if degree == 2 else 0.1)
    model.solve(bridge.Load(unit_weight=30e3))  # from weights by tag to one for all
    assert model.reaction(bridge.BASE)[1] == pytest.approx(-0.5 * 30e3)


def test_layers_with_laws_of_different_kinds():
    """A weak layer yields under pressure, the elastic one does not; laws with more and with fewer state variables."""
    strong = mpm.LinearElastic(young=YOUNG, poisson=POISSON)
    plain = mpm.MohrCoulomb(young=YOUNG, poisson=POISSON, cohesion=1e3, friction_angle=0.0)
    weak = mpm.SofteningMohrCoulomb(
        plain, residual_cohesion=1e3, residual_friction_angle=0.0, softening_strain=0.1, reference_length=0.1
    )
    stresses = []
    for law in (plain, weak):  # softening to the strength at the start is no softening
        model = layered_column(strong, law)
        model.solve(bridge.Load(pressure={bridge.CREST: 10e3}))
        assert model.converged
        yielded = model.points.state[:, 0] > 0
        assert yielded[model.points.coordinates()[:, 1] < 0.5].all()
        assert not yielded[model.points.coordinates()[:, 1] > 0.5].any()
        stresses.append(model.points.stress.copy())
    assert np.allclose(stresses[0], stresses[1], atol=1e-6 * 10e3)
    assert model.points.state.shape[1] == weak.n_state > plain.n_state


def test_strength_of_layers_is_reduced_together():
    laws = [mpm.MohrCoulomb(young=YOUNG, poisson=POISSON, cohesion=c, friction_angle=0.0) for c in (2e3, 4e3)]
    weak = bridge.reduced_strength({7: laws[0], 4: laws[1]}, 2.0)
    assert weak[7].cohesion == 1e3 and weak[4].cohesion == 2e3


@pytest.mark.parametrize(
    ("law", "tagged", "words"),
    [
        ({7: 1}, True, "law.*tag 4"),
        ({7: 1, 4: 1, 9: 1}, True, "law.*tag 9.*4, 7"),
        ({7: 1, 4: 1}, False, "cell_tags.*None"),
    ],
)
def test_laws_that_do_not_fit_the_cell_tags_are_named(law, tagged, words):
    good = layered_column(*[mpm.LinearElastic(young=YOUNG, poisson=POISSON)] * 2)
    laws = dict.fromkeys(law, good.laws[0])
    with pytest.raises(bridge.InputError, match=words):
        bridge.QuasiStatic(good.domain, laws, good.facet_tags, [], cell_tags=layers(good.domain) if tagged else None)
    with pytest.raises(bridge.InputError, match="law.*cell tags"):
        good.equilibrate(bridge.Load(), good.laws[0])
    with pytest.raises(bridge.InputError, match="unit_weight.*cell.*tag 3"):
        good.solve(bridge.Load(unit_weight={3: 1.0}))


def test_inclined_rollers_are_refused_with_the_reason():
    with pytest.raises(bridge.InputError, match=r"normal.*\(1.0, 1.0\).*axis.*inclined"):
        bridge.roller(bridge.LEFT, (1, 1))


@pytest.mark.parametrize("dilation_angle", [25.0, 0.0])
def test_newton_converges_quadratically(dilation_angle):
    model = slope_model(dilation_angle=dilation_angle)
    model.solve(bridge.Load(unit_weight=15e3))
    report = model.equilibrate(bridge.Load(unit_weight=17e3), tolerance=1e-12)
    print("residuals", *(f"{residual:.2e}" for residual in report.residuals))
    tail = [r for r in report.residuals if r > 1e-13][-3:]  # the last ones before rounding shows
    order = np.log(tail[2] / tail[1]) / np.log(tail[1] / tail[0])
    assert report.converged and order > 1.7


def test_stress_of_the_slope_is_admissible_and_its_mean_too():
    model = slope_model()
    model.solve(bridge.Load(unit_weight=UNIT_WEIGHT))
    assert model.converged and model.points.state[:, 0].max() > 1e-4
    assert excess_of_strength(model.points.stress, 1e3, 25.0).max() < 1e-8
    points = np.random.default_rng(0).random((500, 2)) * (1.1, 1.0)
    values = model.evaluate_at(points)
    assert excess_of_strength(values["stress"], 1e3, 25.0).max() < 1e-8
    assert values["state"].shape == (500, model.law.n_state) and values["state"].min() >= 0


def test_step_beyond_collapse_fails_and_leaves_everything_as_it_was():
    model = slope_model()
    model.solve(bridge.Load(unit_weight=15e3))
    before = model.points.stress.copy(), model.displacement.x.array.copy(), model.load
    report = model.equilibrate(bridge.Load(unit_weight=40e3))
    assert not report.converged and not model.converged
    assert np.array_equal(before[0], model.points.stress) and np.array_equal(before[1], model.displacement.x.array)
    assert model.load == before[2]
    steps = model.solve(bridge.Load(unit_weight=40e3), tolerance=0.05)
    assert not model.converged and 20e3 < model.load.unit_weight < 25e3 and not all(s.converged for s in steps)


def test_ground_at_rest_stays_at_rest():
    model = elastic_column(2)
    load = bridge.Load(unit_weight=UNIT_WEIGHT)
    start = bridge.k0_stress(model.points.coordinates(), 1.0, UNIT_WEIGHT, 0.8)
    model.set_initial_stress(start, load)
    report = model.equilibrate(load)
    assert report.converged and np.allclose(model.points.stress, start, atol=1e-8 * UNIT_WEIGHT)
    assert np.abs(model.displacement.x.array).max() < 1e-12


def test_slope_at_rest_comes_into_equilibrium():
    model = slope_model()
    load = bridge.Load(unit_weight=15e3)
    surface = [(1.1, 1.0), (2.1, 0.0)]
    model.set_initial_stress(bridge.k0_stress(model.points.coordinates(), surface, 15e3, bridge.k0_jaky(25.0)), load)
    assert model.equilibrate(load).converged
    weight = 15e3 * 1.6
    assert model.reaction(bridge.BASE)[1] == pytest.approx(-weight)
    assert excess_of_strength(model.points.stress, 1e3, 25.0).max() < 1e-8


def test_progress_names_every_step(capsys):
    model = slope_model()
    steps = model.solve(bridge.Load(unit_weight=15e3), progress=bridge.print_step)
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == len(steps) and "Newton" in lines[0] and "residual" in lines[0]


def test_an_undecided_step_has_a_short_line_and_is_not_what_a_load_fails_at_where_smaller_steps_pass_it(capsys):
    model = slope_model(solver=bridge.Solver(max_steps=2))
    with pytest.warns(RuntimeWarning, match="was not reached") as caught:
        steps = model.solve(bridge.Load(unit_weight=60e3), progress=bridge.print_step)
    lines = capsys.readouterr().err.splitlines()
    report, line = next((s.report, line) for s, line in zip(steps, lines) if s.report.outcome == "undecided")
    assert line.endswith(f"undecided ({report.cause})") and report.cause.endswith("after 2 steps of relaxation")
    assert report.reason.startswith(f"{report.cause}; under unit weight") and "more dilation" in report.reason
    reached = max(step.value for step in steps if step.converged)
    assert any(step.value < reached for step in steps if not step.converged)
    words = r"equilibrium, (\S+)% of the way from the load before: at (\S+)%"
    said = [float(number) for number in re.search(words, str(caught[0].message)).groups()]
    assert said[0] == pytest.approx(100 * reached, abs=1e-3) and said[1] > said[0]


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda m: m.set_initial_stress(np.zeros((3, 4)), bridge.Load()), r"stress.*\(3, 4\)"),
        (lambda m: m.solve(bridge.Load(pressure={77: 1.0})), "pressure.*tag 77"),
        (lambda m: slope_model(degree=3), r"degree is 3, expected one of \(1, 2, 4\)"),
        (lambda m: elastic_column(3, 4), r"degree is 4, expected one of \(1, 2\)"),
        (lambda m: m.evaluate_at(np.array([[5.0, 5.0]])), r"\(5, 5\)"),
    ],
)
def test_bad_arguments_are_named(call, words):
    with pytest.raises(bridge.InputError, match=words):
        call(slope_model())
