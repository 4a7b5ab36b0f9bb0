"""Equilibrium of soil without dilation, by relaxation where Newton's method gives up; failure that is shown."""

from pathlib import Path

import numpy as np
import pytest
from bridge_cases import MESHES, POISSON, YOUNG, column, slope_model
from mpi4py import MPI
from mpm_core.newton import newton

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge.fem.equilibration import EquilibriumReport
from fenics_bridge.fem.load_steps import advance

ROOT = Path(__file__).parents[3]


def weight(unit_weight):
    return bridge.Load(unit_weight=unit_weight)


def elastic_column():
    domain, facet_tags, supports, _ = column(2)
    law = mpm.LinearElastic(young=YOUNG, poisson=POISSON)
    return bridge.QuasiStatic(domain, law, facet_tags, supports)


def test_an_elastic_body_relaxes_at_the_rate_of_the_closed_form():
    """A step with theta K_el du added leaves theta / (1 + theta) of the residual of an elastic body."""
    model = elastic_column()
    report = model.equilibrate(weight(20e3), tolerance=1e-30, max_iterations=1)
    relaxation = report.relaxation
    theta = 1 / np.diff([0.0, *relaxation.time])
    expected = report.residuals[0] * np.cumprod(theta / (1 + theta))
    above = expected > 1e-10  # the last ones are round-off
    assert report.converged and len(relaxation.residual) >= 4
    assert np.allclose(np.array(relaxation.residual)[above], expected[above], rtol=1e-6)
    # On the motion of a step an elastic body carries 1 - theta / (1 + theta) of what is missing, and all of the rest.
    carried = 1 - np.array([report.residuals[0], *expected[:-1]]) / report.residuals[0] * theta / (1 + theta)
    assert np.allclose(np.array(relaxation.carried)[above], carried[above], rtol=1e-6)


@pytest.mark.parametrize("missing", [0.0, 1e-2])
def test_an_elastic_body_is_not_in_equilibrium_because_nothing_yields(missing):
    """Where nothing yields no stress is missing, to round-off; the first pseudo-step still leaves a quarter of the forces."""
    report = elastic_column().equilibrate(
        weight(20e3), tolerance=1e-30, max_iterations=1, relaxed_tolerance=1e-6, missing_tolerance=missing
    )
    assert report.converged and report.relaxation.missing[0] < 1e-12
    assert report.relaxation.residual[0] > 0.1
    assert report.relaxation.residual[-1] <= max(missing, 1e-6)


def test_a_body_that_flows_at_a_steady_rate_takes_one_system_a_step():
    """A plastic block flows at constant volume, at the strain rate (p - 2 s_u) / 4G: each step begins at its own end."""
    block, _, sides = bridge.box_mesh(MPI.COMM_WORLD, [1.0, 1.0], [2, 2])
    clay = mpm.tresca(young=1e6, poisson=0.3, shear_strength=10e3)
    supports = [bridge.roller(1, (1, 0)), bridge.roller(3, (0, 1))]
    model = bridge.QuasiStatic(block, clay, sides, supports)
    assert model.equilibrate(bridge.Load(pressure={4: 19.9e3})).converged
    report = model.equilibrate(bridge.Load(pressure={4: 20.2e3}))
    relaxation = report.relaxation
    steps = len(relaxation.time)
    assert report.outcome == "failure" and steps >= 5
    assert relaxation.iterations <= steps + 3  # but for the first steps, in which the block yields
    assert relaxation.carried[-1] == pytest.approx(20e3 / 20.2e3, rel=1e-6)
    # The viscous stress is deviatoric in the plane, +-(p - 2 s_u) / 2, and the elastic strain across the plane is zero.
    in_plane = -0.1e3, -20.1e3
    stress = np.array([*in_plane, clay.poisson * sum(in_plane)])
    deviator = np.linalg.norm(stress - stress.mean())
    assert relaxation.missing[-1] == pytest.approx(0.01 * np.sqrt(2) * 10e3 / deviator, rel=1e-4)
    rates = np.diff(relaxation.growth) / np.diff(relaxation.time)
    assert np.allclose(rates[-2:], 0.2e3 / (4 * clay.shear_modulus), rtol=1e-4)


def test_supports_move_once_in_a_relaxation():
    """A plastic block under a plate that is pressed down: the plate ends where it is prescribed, at the force 2 s_u."""
    block, _, sides = bridge.box_mesh(MPI.COMM_WORLD, [1.0, 1.0], [2, 2])
    clay = mpm.tresca(young=1e6, poisson=0.3, shear_strength=10e3)
    supports = [bridge.roller(1, (1, 0)), bridge.roller(3, (0, 1)), bridge.Support(4, (None, -0.05))]
    model = bridge.QuasiStatic(block, clay, sides, supports)
    report = model.equilibrate(bridge.Load(displacement=1.0), tolerance=1e-30, relaxed_tolerance=1e-6, max_iterations=1)
    assert report.converged and len(report.relaxation.time) > 1
    top = model.evaluate_at(np.array([[0.3, 1.0], [0.8, 1.0]]))["displacement"]
    assert np.allclose(top[:, 1], -0.05, rtol=0, atol=1e-12)
    assert model.reaction(4)[1] == pytest.approx(20e3, rel=1e-4)


class Chatters:
    """A system whose residual is 1, and after each number of corrections in `falls` half of what it was."""

    reason = ""

    def __init__(self, falls):
        self.corrections, self.residual, self.falls = 0, 1.0, falls

    def start(self):
        return self.residual

    def correction(self):
        self.corrections += 1
        self.residual *= 0.49 if self.corrections in self.falls else 1.0
        return True

    def move(self, fraction):
        return self.residual

    def work(self):
        return self.residual

    def keep(self):
        pass

    def wants_more(self, tolerance):
        return False


def test_newton_gives_up_where_the_residual_does_not_halve_in_time():
    assert newton(Chatters(falls=[]), patience=6).iterations == 6
    assert newton(Chatters(falls=[5]), patience=6).iterations == 5 + 6
    assert newton(Chatters(falls=[5]), max_iterations=20).iterations == 20
    assert newton(Chatters(falls=range(100)), patience=2, max_iterations=50).converged


def test_relaxation_finds_the_equilibrium_that_newton_finds():
    newton, relaxed = slope_model(), slope_model()
    newton.solve(weight(15e3))
    for load in (7.5e3, 15e3):
        report = relaxed.equilibrate(weight(load), tolerance=1e-30, max_iterations=1, relaxed_tolerance=1e-8)
        assert report.converged and report.relaxation is not None
    scale = np.abs(newton.displacement.x.array).max()
    assert np.allclose(relaxed.displacement.x.array, newton.displacement.x.array, atol=0.01 * scale)
    assert np.allclose(relaxed.increment.x.array, report.motion)


# Griffiths and Lane (1999), Geotechnique 49, 387-403, example 1: slope 1:2, phi = 20 degrees, c / (gamma H) = 0.05, no
# dilation: 1.4 by their finite elements; 1.380 by Bishop and Morgenstern (1960).
@pytest.mark.parametrize(("degree", "cell_size"), [(2, 2.0), (2, 1.0), (1, 1.0)])
def test_factor_of_safety_without_dilation_is_the_published_one(degree, cell_size):
    law = mpm.MohrCoulomb(young=1e8, poisson=0.3, cohesion=10e3, friction_angle=20.0)
    background = bridge.slope_mesh(
        MPI.COMM_WORLD, height=10.0, angle=np.degrees(np.arctan(0.5)), crest=12.0, cell_size=cell_size, kind="fitted",
        runout=cell_size,
    )  # fmt: skip
    domain, _, facet_tags = bridge.soil_mesh(*background)
    supports = [bridge.roller(bridge.LEFT, (1, 0)), bridge.fixed(bridge.BASE)]
    model = bridge.QuasiStatic(domain, law, facet_tags, supports, degree=degree, nmd=degree == 1)
    result = bridge.factor_of_safety(model, weight(20e3), start=0.8, tolerance=5e-3)
    assert 0.98 * 1.38 < result.value < 1.02 * 1.4
    assert result.failed and result.failed_at - result.value < 0.02 and result.residual <= 1e-5
    # A second sign of failure: on the mechanism the stresses do less work than the weight, but nearly as much.
    assert 0.9 < result.carried < 1
    assert 0.9 < np.linalg.norm(result.mechanism.x.array.reshape(-1, 2), axis=1).max() <= 1.0 + 1e-12


def test_bearing_capacity_without_dilation():
    """Nc of phi = 30 degrees is 30.14 with associated flow; without dilation it lies between that and Davis' value."""
    sizes = {"near_size": 0.2, "edge_size": 0.05, "far_size": 1.0}
    domain, _, facet_tags = bridge.read_mesh(MESHES / "footing.geo", MPI.COMM_WORLD, parameters=sizes)
    law = mpm.MohrCoulomb(young=1e7, poisson=0.3, cohesion=1e3, friction_angle=30.0)
    supports = [bridge.roller(1, (1, 0)), bridge.roller(3, (1, 0)), bridge.fixed(2)]
    model = bridge.QuasiStatic(domain, law, facet_tags, supports)
    result = bridge.collapse_load(model, lambda q: bridge.Load(pressure={5: q}), first_step=4e3, tolerance=1e-2)
    davis = bridge.davis_strength(law)
    tangent = np.tan(np.radians(davis.friction_angle))
    prandtl = (np.exp(np.pi * tangent) * np.tan(np.radians(45 + davis.friction_angle / 2)) ** 2 - 1) / tangent
    assert result.failed
    assert davis.cohesion * prandtl < result.value < 1.02 * 30.14e3


def test_a_vertical_cut_that_softens_fails_between_its_residual_and_its_peak_strength():
    def cut(law):
        domain, _, facet_tags = bridge.soil_mesh(*bridge.slope_mesh(MPI.COMM_WORLD, angle=90))
        supports = [bridge.roller(bridge.LEFT, (1, 0)), bridge.fixed(bridge.BASE)]
        model = bridge.QuasiStatic(domain, law, facet_tags, supports)
        result = bridge.collapse_load(model, weight, first_step=1e3, tolerance=5e-3)
        assert result.failed
        return result.value

    strengths = ((1e3, 30.0), (0.3e3, 25.0))
    peak, residual = (
        mpm.MohrCoulomb(young=1e6, poisson=0.3, cohesion=cohesion, friction_angle=angle)
        for cohesion, angle in strengths
    )
    softening = mpm.SofteningMohrCoulomb(
        peak, residual_cohesion=0.3e3, residual_friction_angle=25.0, softening_strain=0.1, reference_length=0.1
    )
    assert 1.2 * cut(residual) < cut(softening) < 0.99 * cut(peak)


def test_without_relaxation_nothing_is_called_failure():
    model = slope_model(0.2, "fitted", dilation_angle=0.0, solver=bridge.Solver(relaxation=False, max_iterations=4))
    result = bridge.collapse_load(model, weight, first_step=5e3)
    assert not result.failed and np.isnan(result.carried) and "iterations" in result.reason
    assert (
        result.value
        < bridge.collapse_load(slope_model(0.2, "fitted", dilation_angle=0.0), weight, first_step=5e3).value
    )


def on_ground(cell_size, height, angle, width, depth, cohesion, friction_angle, solver=None):
    """A slope without dilation in the middle of a body."""
    shape = {"height": height, "angle": angle, "crest": 0.5 * width, "runout": 0.5 * width, "depth": depth}
    sizes = {"cell_size": cell_size, "far_size": 6 * cell_size}
    domain, _, facet_tags = bridge.read_mesh(MESHES / "hillside.geo", MPI.COMM_WORLD, parameters=shape | sizes)
    law = mpm.MohrCoulomb(young=30e6, poisson=0.3, cohesion=cohesion, friction_angle=friction_angle)
    supports = [bridge.roller("left", (1, 0)), bridge.roller("right", (1, 0)), bridge.fixed("base")]
    return bridge.QuasiStatic(domain, law, facet_tags, supports, solver=solver)


SLOPES = {
    "the paper's slope": lambda solver: slope_model(0.2, "fitted", dilation_angle=0.0, solver=solver),
    "a bank with little cohesion": lambda solver: on_ground(1.0, 3.0, 26.565, 24.0, 6.0, 2e3, 34.0, solver),
    "a step of 1 m in a body of 30 m": lambda solver: on_ground(0.5, 1.0, 90.0, 30.0, 5.0, 6e3, 20.0, solver),
}


@pytest.mark.parametrize("name", SLOPES)
def test_practice_is_within_its_tolerance_however_small_the_mechanism(name):
    """With 1 % of the stress missing the strength can be 1 % too small, so that the factor is at most 1 % too large."""
    practice, fine = (bridge.factor_of_safety(SLOPES[name](s), weight(20e3)) for s in (bridge.PRACTICE, None))
    assert practice.failed and fine.failed
    bisection = 2e-3 * fine.value  # the factor's own tolerance
    assert fine.value - bisection <= practice.value <= 1.01 * fine.value + bisection
    assert 0 < practice.missing <= 1e-2 and 1e-5 < practice.residual
    assert fine.missing == 0 and fine.residual <= 1e-5


def test_a_tolerance_over_the_forces_of_all_of_the_body_does_not_hide_a_small_mechanism():
    """The step of 1 m weighs 1 % of its body, and 1 % of all forces would hold it up."""

    def stands(solver):
        slope = SLOPES["a step of 1 m in a body of 30 m"](solver)
        slope.law = bridge.reduced_strength(slope.law, 3.0)  # the factor of safety is 1.8
        slope.solve(weight(20e3))
        return slope.converged

    assert not stands(bridge.Solver(tolerance=1e-2, relaxed_tolerance=1e-2))
    assert not stands(bridge.PRACTICE)


@pytest.mark.parametrize("solver", [bridge.Solver(), bridge.PRACTICE], ids=["default", "practice"])
def test_a_circular_load_on_heavy_ground_fails_as_on_weightless_one(solver):
    """The weight of level clay does no work in a mechanism of constant volume. That of the body here is 9000 times the load."""
    sizes = {"half_width": 1.0, "width": 40.0, "depth": 40.0, "near_size": 0.25, "far_size": 5.0, "edge_size": 0.06}
    domain, _, facet_tags = bridge.read_mesh(MESHES / "footing.geo", MPI.COMM_WORLD, parameters=sizes)
    clay = mpm.tresca(young=20e6, poisson=0.3, shear_strength=20e3)
    supports = [bridge.roller("axis", (1, 0)), bridge.roller("far", (1, 0)), bridge.fixed("base")]
    carried = []
    for unit_weight in (0.0, 18e3):
        geometry = bridge.Geometry.AXISYMMETRIC
        fem = bridge.QuasiStatic(domain, clay, facet_tags, supports, geometry=geometry, solver=solver)
        fem.solve(bridge.Load(unit_weight=unit_weight))
        fem.solve(bridge.Load(unit_weight=unit_weight, pressure={"footing": 140e3}), tolerance=0.01)
        carried.append(next(iter(fem.load.pressure.values())) / 20e3)
    assert carried[1] == pytest.approx(carried[0], rel=0.02)  # twice the tolerance of the steps
    assert (
        carried[1] < 5.69
    )  # a rigid smooth plate (Cox, Eason and Hopkins 1961), whose mechanism this load can have, too


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"tolerance": 0.0}, "tolerance.*0.0"),
        ({"relaxed_tolerance": 2}, "relaxed_tolerance.*2"),
        ({"missing_tolerance": -0.01}, "missing_tolerance.*-0.01"),
        ({"max_steps": 0.5}, "max_steps"),
    ],
)
def test_bad_options_are_named(options, words):
    with pytest.raises(bridge.InputError, match=words):
        bridge.Solver(**options)
    with pytest.raises(bridge.InputError, match=words):
        elastic_column().equilibrate(weight(1.0), **options)


def fake(outcome, iterations=5):
    return EquilibriumReport(outcome, [1.0, 0.0], "", iterations)


def test_steps_grow_again_after_one_that_was_too_large():
    """Only steps above 0.01 fail, and only below 0.1: the way to 10 is not made in steps of 0.01."""
    value = 0.0

    def equilibrate(target):
        nonlocal value
        good = target - value <= 0.01 or value >= 0.1
        value = target if good else value
        return fake("equilibrium" if good else "undecided")

    steps = advance(equilibrate, 0.0, 10.0, 1.0, 1e-3)
    assert steps[-1].value == 10.0 and steps[-1].converged
    assert len(steps) < 60


@pytest.mark.parametrize(("start", "first_step"), [(0.5, 1e-3), (1.0, 1e-3), (3.0, 1e-9), (0.0, 1e-3)])
def test_a_first_step_below_the_tolerance_does_not_end_the_search(start, first_step):
    """2e-3 of the value is more than the first step: the search went no further than the start, and took that for the limit."""
    steps = advance(lambda value: fake("equilibrium" if value < np.pi else "failure"), start, np.inf, first_step, 2e-3)
    best = max(step.value for step in steps if step.converged)
    assert np.pi * (1 - 4e-3) < best < np.pi and len(steps) < 50


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"first_step": 0.0}, "first_step is 0.0 .*expected a positive number"),
        ({"first_step": -1.0}, "first_step is -1.0"),
        ({"tolerance": 0.0}, "tolerance is 0.0"),
        ({"tolerance": 2.0}, "tolerance is 2.0, expected a fraction between 0 and 1"),
    ],
)
def test_steps_that_cannot_be_are_named(options, words):
    with pytest.raises(bridge.InputError, match=words):
        bridge.collapse_load(slope_model(0.2, "fitted"), lambda w: bridge.Load(w), **{"first_step": 1e3, **options})


def test_a_value_that_fails_is_never_passed():
    tried = []

    def equilibrate(value):
        tried.append(value)
        return fake("equilibrium" if value < np.pi else "failure")

    steps = advance(equilibrate, 0.0, np.inf, 1.0, 1e-4)
    best = max(step.value for step in steps if step.converged)
    assert np.pi - 2e-4 * np.pi < best < np.pi
    failed = [value for value in tried if value > np.pi]
    assert failed == sorted(failed, reverse=True)
    assert failed[-1] - best < 4e-4 * np.pi  # the bracket is as narrow as the tolerance says


def pressed_footing(tolerance):
    """Half of a smooth footing, 1 m wide, that is pressed into sand, phi = psi = 20 degrees: 2 Q / (gamma B^2)."""
    parameters = {"width": 3.0, "depth": 1.5, "edge_size": 0.03, "near_size": 0.1, "far_size": 0.6}
    ground, _, sides = bridge.read_mesh(ROOT / "meshes" / "footing.geo", MPI.COMM_WORLD, parameters=parameters)
    sand = mpm.MohrCoulomb(young=20e6, poisson=0.3, cohesion=2.0, friction_angle=20.0, dilation_angle=20.0)
    supports = [bridge.roller("axis", (1, 0)), bridge.roller("far", (1, 0)), bridge.fixed("base"),
                bridge.prescribed("footing", (0.0, -0.02))]  # fmt: skip
    model = bridge.QuasiStatic(ground, sand, sides, supports)
    at_rest = bridge.k0_stress(model.points.coordinates(), surface=0.0, unit_weight=20e3, k0=0.5)
    model.set_initial_stress(at_rest, bridge.Load(unit_weight=20e3, displacement=0.0))
    for part in (0.1, 0.25, 0.5):
        load = bridge.Load(unit_weight=20e3, displacement=part)
        assert model.equilibrate(load, relaxed_tolerance=tolerance).converged
    return 4 * model.reaction("footing")[1] / 20e3


def test_forces_under_a_footing_that_is_pressed_into_sand_do_not_depend_on_the_tolerance():
    """Residuals are over forces that the soil can carry, not over those of an elastic step, a hundred times as large.

    N_gamma of a rough footing is 2.839 (Martin 2005, method of characteristics). Finite elements come from above, and this mesh
    is coarse.
    """
    found, exact = (pressed_footing(tolerance) for tolerance in (1e-5, 1e-6))
    assert found == pytest.approx(exact, rel=0.01)
    assert 2.839 < exact < 1.17 * 2.839
