"""Modified Cam-Clay: compression lines, critical state, an independent integration, tangent, admissibility, input."""

import numpy as np
import pytest
from law_cases import (
    Batch,
    assert_alike_alone_and_among_others,
    assert_tangent,
    mean_and_radius,
    random_points,
    triaxial,
    walk,
)
from scipy.integrate import solve_ivp

import mpm_core as mpm

LAMBDA, KAPPA, M, NU, E0 = 0.2, 0.04, 1.0, 0.25, 1.0
PARAMETERS = {"compression": LAMBDA, "swelling": KAPPA, "critical_slope": M, "poisson": NU, "void_ratio": E0}
CLAY = mpm.CamClay(**PARAMETERS, preconsolidation=100e3)


def isotropic(pressure):
    return [-pressure] * 3 + [0.0] * 3


def p_and_q(stress):
    p, radius = mean_and_radius(np.atleast_2d(stress))
    return -p, np.sqrt(3) * radius


@pytest.mark.parametrize("steps", [1, 400])
def test_isotropic_compression_follows_the_swelling_and_then_the_virgin_line(steps):
    # dv = -kappa dp/p, then -lambda dp/p, with dv = v de_v; one increment gives the same as many
    test = mpm.ElementTest(CLAY, isotropic(50e3))
    for p, line in [(100e3, KAPPA), (200e3, LAMBDA)]:
        start, volume = p_and_q(test.stress)[0][0], (1 + E0) * np.exp(test.strain[:3].sum())
        for step in range(1, steps + 1):
            target = start * (p / start) ** (step / steps)
            test.step([None, None, None, 0, 0, 0], [-target] * 3 + [0.0] * 3)
        change = (1 + E0) * np.exp(test.strain[:3].sum()) - volume
        assert change == pytest.approx(-line * np.log(p / start), rel=1e-5)


def rates(strain_rate):
    """The rate equations of the law along a fixed strain rate, for scipy: y = (stress, p_c, v), 6 components."""

    def rate(_, y):
        stress, pc, v = y[:6], y[6], y[7]
        p = -stress[:3].mean()
        s = stress + np.array([p, p, p, 0, 0, 0])
        bulk = v * p / KAPPA
        shear = 3 * (1 - 2 * NU) / (2 * (1 + NU)) * bulk
        elastic = np.diag([2 * shear] * 3 + [shear] * 3)
        elastic[:3, :3] += bulk - 2 * shear / 3
        trial = elastic @ strain_rate
        weights = np.array([1, 1, 1, 2, 2, 2])
        q2 = 1.5 * (weights * s * s).sum()
        multiplier = 0.0
        normal = 3 * s / M**2 - (2 * p - pc) / 3 * np.array([1, 1, 1, 0, 0, 0])  # df/dsigma
        if q2 / M**2 + p * (p - pc) > -1e-6 * pc**2:
            flow = normal * weights  # engineering shear
            hardening = p * pc * v / (LAMBDA - KAPPA) * (2 * p - pc)
            multiplier = max(0.0, flow @ trial / (flow @ elastic @ flow + hardening))
            trial = trial - elastic @ flow * multiplier
        return np.r_[trial, pc * v / (LAMBDA - KAPPA) * multiplier * (2 * p - pc), v * strain_rate[:3].sum()]

    return rate


@pytest.mark.parametrize(
    "direction",
    [[-1.0, 0, 0, 0, 0, 0], [-1, 0.5, 0.5, 0, 0, 0], [-0.2, 0, 0, 1.0, 0, 0], [0.3, -0.5, 0.1, 0.4, -0.6, 0.5]],
    ids=["oedometer", "undrained triaxial", "simple shear", "general"],
)
@pytest.mark.parametrize("pressure", [100e3, 30e3], ids=["normally consolidated", "overconsolidated"])
def test_paths_agree_with_an_independent_integration(direction, pressure):
    total = 0.08 * np.array(direction)
    start = np.r_[isotropic(pressure), 100e3, 1 + E0]
    reference = solve_ivp(rates(total), (0, 1), start, method="LSODA", rtol=1e-8, atol=1e-3, max_step=1e-3).y[:, -1]
    errors = []
    for steps in (200, 800):
        test = mpm.ElementTest(CLAY, isotropic(pressure))
        for _ in range(steps):
            test.step(total / steps)
        errors.append(np.abs(test.stress - reference[:6]).max() / np.abs(reference[:6]).max())
    assert errors[1] < 2e-3
    assert errors[1] < 0.5 * errors[0] or errors[1] < 5e-4  # first order
    assert 100e3 * np.exp(test.state[1]) == pytest.approx(reference[6], rel=5e-3)


def test_drained_triaxial_ends_at_the_critical_state():
    # q = M p and p = p0 + q/3
    test = mpm.ElementTest(CLAY, isotropic(100e3))
    triaxial(test, -1.5, 1500)
    p, q = p_and_q(test.stress)
    assert q[0] == pytest.approx(100e3 * M / (1 - M / 3), rel=5e-3)
    assert q[0] == pytest.approx(M * p[0], rel=5e-3)
    before = test.strain[:3].sum()
    test.step([-1e-3, None, None, 0, 0, 0])
    assert abs(test.strain[:3].sum() - before) < 2e-5


def test_undrained_strength_of_normally_consolidated_clay():
    # At constant v and from p0 = pc: q_f = M p0 (1/2)^Lambda with Lambda = 1 - kappa/lambda
    test = mpm.ElementTest(CLAY, isotropic(100e3))
    triaxial(test, -0.4, 800, drained=False)
    assert p_and_q(test.stress)[1][0] == pytest.approx(M * 100e3 * 0.5 ** (1 - KAPPA / LAMBDA), rel=5e-3)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("strain", [1e-4, 1e-2])
def test_tangent_is_the_derivative_of_the_stress(dim, strain):
    stress, increment = random_points(dim, 400, pressure=60e3, deviator=12e3, strain=strain)
    batch = Batch(CLAY, stress, increment)
    assert 50 < batch.report.plastic <= 400 and batch.report.failed == 0
    assert_tangent(batch, 1e-3 * strain, tolerance=1e-4)


@pytest.mark.parametrize("dim", [2, 3])
def test_stress_stays_admissible(dim):
    stress, _ = random_points(dim, 1000, pressure=60e3, deviator=10e3, strain=0.0)
    stress, state = walk(CLAY, stress, 1e-3, 100)
    p, q = p_and_q(stress)
    pc = 100e3 * np.exp(state[:, 1])
    assert np.max((q**2 / M**2 + p * (p - pc)) / pc**2) < 1e-9
    assert (p > 0).all()


def test_huge_increments_return_to_the_surface():
    stress, increment = random_points(3, 1000, pressure=60e3, deviator=10e3, strain=0.1)
    batch = Batch(CLAY, stress, increment)
    assert batch.report.failed == 0
    p, q = p_and_q(batch.stress)
    pc = 100e3 * np.exp(batch.state[:, 1])
    assert np.max((q**2 / M**2 + p * (p - pc)) / (pc**2 + q**2)) < 1e-9


@pytest.mark.parametrize("dim", [2, 3])
def test_a_point_is_updated_alike_alone_and_among_others_with_and_without_tangent(dim):
    # Elastic, plastic and failing (not a number, no pressure), with increments up to huge ones
    stress, strain = random_points(dim, 401, pressure=60e3, deviator=10e3, strain=1.0)
    strain *= 10 ** np.random.default_rng(2).uniform(-6, -1, (401, 1))
    strain[17, 1], stress[100, :3] = np.nan, 1.0
    report = assert_alike_alone_and_among_others(CLAY, stress, strain, np.zeros((401, CLAY.n_state)))
    assert report.failed >= 2 and 50 < report.plastic < 350


def test_initial_stress_inside_is_kept():
    stress, increment = random_points(3, 500, pressure=50e3, deviator=2e3, strain=0.0)
    batch = Batch(CLAY, stress, increment)
    assert batch.report.plastic == 0
    assert np.abs(batch.stress - stress).max() < 1e-10 * 50e3


def test_without_pressure_a_point_fails_unless_there_is_attraction():
    nothing, strain = np.zeros((1, 6)), np.full((1, 6), -1e-4)
    assert Batch(CLAY, nothing, strain).report.failed == 1
    batch = Batch(mpm.CamClay(**PARAMETERS, preconsolidation=100e3, attraction=1e3), nothing, strain)
    assert batch.report.failed == 0
    assert batch.stress[0, 0] < 0


def test_clay_that_was_torn_apart_goes_on():
    """Without a least pressure, round-off of the attraction less the stress would leave no pressure, and no next increment."""
    clay = mpm.CamClay(**PARAMETERS, preconsolidation=100e3, attraction=2e3)
    test = mpm.ElementTest(clay, isotropic(90e3))
    for _ in range(100):  # by exp(-50) in pressure
        test.step([0.01, 0.01, 0.01, 0, 0, 0])
    least = 1e-4 * 102e3
    assert test.stress[:3] == pytest.approx(2e3 - least, rel=1e-9)
    test.step([0.0] * 6)
    assert test.stress[:3] == pytest.approx(2e3 - least, rel=1e-9)
    for _ in range(100):
        test.step([-0.01, -0.01, -0.01, 0, 0, 0])
    assert (test.stress[:3] < -1e3).all()


def test_a_point_may_begin_with_a_preconsolidation_of_its_own():
    state = np.array([[0.0, np.log(300e3 / 100e3), 0.0]])
    batch = Batch(CLAY, np.array([isotropic(250e3)]), np.zeros((1, 6)), state)
    assert batch.report.plastic == 0
    assert np.abs(batch.stress + np.array([250e3] * 3 + [0.0] * 3)).max() < 1e-6


def test_log_preconsolidation_puts_a_stress_on_or_inside_the_surface():
    stress, _ = random_points(3, 200, pressure=60e3, deviator=5e3, strain=0.0)
    for ratio, strain in [(1.0, -1e-6), (1.5, 0.0)]:
        state = np.zeros((200, 3))
        state[:, 1] = mpm.log_preconsolidation(CLAY, stress, ratio)
        batch = Batch(CLAY, stress, strain * np.tile([1.0, 1, 1, 0, 0, 0], (200, 1)), state)
        p, q = p_and_q(stress)
        assert p + q**2 / M**2 / p == pytest.approx(100e3 * np.exp(state[:, 1]) / ratio)
        assert batch.report.plastic == 0 if ratio > 1 else batch.report.plastic > 0
    with pytest.raises(mpm.InputError, match="expected below the attraction"):
        mpm.log_preconsolidation(CLAY, np.zeros((1, 4)))


def test_bad_parameters_are_named_with_value_and_range():
    good = {**PARAMETERS, "preconsolidation": 100e3}
    for name, value in [("swelling", 0.0), ("compression", 0.03125), ("critical_slope", -1.0), ("poisson", 0.5),
                        ("preconsolidation", 0.0), ("void_ratio", -1.0), ("attraction", -1.0)]:  # fmt: skip
        with pytest.raises(mpm.InputError, match=f"^{name} = {value:g}, but it must be "):
            mpm.CamClay(**{**good, name: value})
