"""Modified Cam-Clay with creep: settlement over time, isotaches, strength by rate, limits of fast and slow, tangent."""

import numpy as np
import pytest
from bridge_cases import column
from core_cases import box, rollers, run
from law_cases import Batch, assert_alike_alone_and_among_others, assert_tangent, mean_and_radius, random_points

import fenics_bridge as bridge
import mpm_core as mpm

LAMBDA, KAPPA, MU, M, NU, E0, DAY = 0.2, 0.04, 0.008, 1.0, 0.25, 1.0, 86400.0
PC = 100e3
EXPONENT = (LAMBDA - KAPPA) / MU
V0 = 1 + E0


def clay(**changes):
    return mpm.CamClay(**{
        "compression": LAMBDA, "swelling": KAPPA, "critical_slope": M, "poisson": NU, "void_ratio": E0, "preconsolidation": PC,
        "creep": MU, **changes,
    })  # fmt: skip


def isotropic(pressure):
    return [-pressure] * 3 + [0.0] * 3


def volume(test):
    return V0 * np.exp(test.strain[:3].sum())


def p_and_q(stress):
    mean, radius = mean_and_radius(np.atleast_2d(stress))
    return -mean[0], np.sqrt(3) * radius[0]


@pytest.mark.parametrize("ratio", [1.0, 0.9, 0.7])
def test_volume_at_constant_pressure_falls_with_the_logarithm_of_time(ratio):
    """-dv/dt = mu / tau (p / p_c)^((lambda - kappa) / mu), p_c grows by exp(-dv / (lambda - kappa)): v falls by mu ln(1 + t / tau (p / p_c0)^...)."""
    test, time = mpm.ElementTest(clay(), isotropic(ratio * PC)), 0.0
    for end in np.geomspace(1e-3, 1e5, 600) * DAY:
        test.step([None, None, None, 0, 0, 0], isotropic(ratio * PC), dt=end - time)
        time = end
    expected = MU * np.log(1 + time / DAY * ratio**EXPONENT)
    assert V0 - volume(test) == pytest.approx(expected, rel=0.01)


def test_an_increment_without_duration_is_of_the_law_without_creep():
    ends = []
    for creep in (MU, 0.0):
        test = mpm.ElementTest(clay(creep=creep), isotropic(PC))
        test.step([None, None, None, 0, 0, 0], isotropic(1.3 * PC))
        ends.append(test.strain.copy())
    assert (ends[0] == ends[1]).all()
    assert ends[0].sum() < -1e-2


def test_compression_ten_times_as_fast_follows_a_line_beside_the_other():
    """Isotaches: p / p_c is higher by the rate's ratio to the power mu / (lambda - kappa), and at the same volume p by that to mu / lambda."""
    pressures = []
    for rate in (1e-9, 1e-8):
        test = mpm.ElementTest(clay(), isotropic(0.99 * PC))
        strain, steps = 0.2, 2000
        for _ in range(steps):
            test.step([-strain / steps / 3] * 3 + [0, 0, 0], dt=strain / steps / rate)
        pressures.append(p_and_q(test.stress)[0])
    assert pressures[1] / pressures[0] == pytest.approx(10 ** (MU / LAMBDA), rel=1e-3)


@pytest.mark.parametrize("rate", [1e-8, 1e-6, 1e-2])
def test_undrained_strength_depends_on_the_rate_as_by_hand(rate):
    """In the critical state 2 p = R p_c, R^exponent = (rate of e_q) M v tau / (2 mu), and kappa ln p + (lambda - kappa) ln p_c stays."""
    start = 0.8 * PC
    test, axial, steps = mpm.ElementTest(clay(), isotropic(start)), 0.3, 3000
    for _ in range(steps):
        e = axial / steps
        test.step([-e, e / 2, e / 2, 0, 0, 0], dt=e / rate)
    p, q = p_and_q(test.stress)
    ratio = (rate * M * V0 * DAY / (2 * MU)) ** (1 / EXPONENT)
    # kappa ln(p / start) + (lambda - kappa) ln(2 p / (R p_c0)) = 0
    expected = np.exp((KAPPA * np.log(start) + (LAMBDA - KAPPA) * np.log(ratio * PC / 2)) / LAMBDA)
    assert p == pytest.approx(expected, rel=2e-3)
    assert q == pytest.approx(M * p, rel=1e-3)


def test_loading_without_time_is_elastic():
    test = mpm.ElementTest(clay(), isotropic(PC))
    test.step([-0.01, 0, 0, 0.0, 0, 0], dt=0.0)
    same = mpm.ElementTest(clay(creep=0.0, preconsolidation=10 * PC), isotropic(PC))
    same.step([-0.01, 0, 0, 0.0, 0, 0])
    assert test.stress == pytest.approx(same.stress, rel=1e-12)
    assert test.state[0] == 0.0


def test_little_creep_comes_to_the_law_without_it():
    increments = np.random.default_rng(3).normal(0.0, 2e-3, (40, 6)) - [2e-3, 0, 0, 0, 0, 0]
    found = []
    for creep in (0.0, 1e-6):
        test = mpm.ElementTest(clay(creep=creep), isotropic(0.5 * PC))
        for increment in increments:
            test.step(increment, dt=DAY)
        found.append(test.stress)
    assert found[1] == pytest.approx(found[0], rel=1e-3, abs=1e-3 * PC)


def test_stress_relaxes_at_constant_strain():
    """kappa ln p + (lambda - kappa) ln p_c stays, and d ln p / dt = -mu / (kappa tau) (p / p_c)^exponent."""
    test = mpm.ElementTest(clay(), isotropic(PC))
    time = 0.0
    for end in np.geomspace(1e-4, 1e4, 800) * DAY:
        test.step([0.0] * 6, dt=end - time)
        time = end
    # ln(p / p_c) = -y: dy/dt = mu (1 / kappa + 1 / (lambda - kappa)) / tau exp(-exponent y)
    softness = MU * (1 / KAPPA + 1 / (LAMBDA - KAPPA))
    y = np.log(1 + EXPONENT * softness * time / DAY) / EXPONENT
    expected = PC * np.exp(-y * (LAMBDA - KAPPA) / LAMBDA)
    assert p_and_q(test.stress)[0] == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("strain", [1e-5, 1e-3, 1e-2])
@pytest.mark.parametrize("dt", [1e-3, DAY, 1e4 * DAY])
def test_tangent_is_the_derivative_of_the_stress(dim, strain, dt):
    stress, increment = random_points(dim, 300, pressure=60e3, deviator=20e3, strain=strain)
    batch = Batch(clay(preconsolidation=60e3), stress, increment, dt=dt)
    assert batch.report.failed == 0
    assert_tangent(batch, 1e-4 * strain, tolerance=1e-5)


@pytest.mark.parametrize("overconsolidation", [1.0, 1.5, 4.0, 50.0])
def test_steps_of_any_length_and_size_have_a_solution(overconsolidation):
    law = clay(preconsolidation=overconsolidation * 60e3)
    for dt in (1e-9, 1.0, DAY, 1e5 * DAY):
        for size in (1e-8, 1e-4, 1e-2, 0.1):
            stress, increment = random_points(3, 200, pressure=60e3, deviator=15e3, strain=size)
            state = np.zeros((200, law.n_state))
            report = law.update(increment, stress, state, dt=dt)
            assert report.failed == 0
            assert np.isfinite(stress).all()
            assert np.isfinite(state).all()
            assert (stress[:, :3].mean(axis=1) < 0).all()


PLANE = np.array([-90e3] * 3 + [0.0])
STEPS, STRAIN = 10, 2e-4


def compressed_point(dt):
    test = mpm.ElementTest(clay(), PLANE)
    for _ in range(STEPS):
        test.step([0, -STRAIN, 0, 0], dt=dt)
    return test.stress


@pytest.mark.parametrize("scheme", ["explicit", "implicit"])
def test_particles_creep_by_the_duration_of_their_steps(scheme):
    dt = 1e-4 if scheme == "explicit" else DAY
    model = mpm.Model(box([1, 1]), clay())
    model.seed(density=2000.0, per_cell=3)
    rollers(model, [0])
    model.roller(3, (0, 1))
    model.particles.set("stress", np.tile(PLANE, (len(model.particles), 1)))
    model.prescribe(4, (0, -STRAIN / dt))
    if scheme == "explicit":
        run(model, STEPS * dt, dt=dt, allow_unstable=True)
    else:
        list(model.implicit(STEPS * dt, dt=dt, quasi_static=True))
    expected = compressed_point(dt)
    assert np.abs(model.particles.stress - expected).max() < 1e-6 * np.abs(expected).max()
    assert np.abs(expected - compressed_point(100 * DAY)).max() > 0.1 * np.abs(expected).max()


def test_finite_elements_creep_by_the_duration_of_their_steps():
    domain, facet_tags, supports, height = column(2)
    moved = (None, -STRAIN * STEPS * height)
    supports = [*supports[:2], bridge.roller(bridge.BASE, (0, 1)), bridge.prescribed(bridge.CREST, moved)]
    fem = bridge.QuasiStatic(domain, clay(), facet_tags, supports, degree=2)
    fem.set_initial_stress(np.tile(PLANE, (fem.points.n, 1)), bridge.Load())
    for step in range(1, STEPS + 1):
        assert fem.equilibrate(bridge.Load(displacement=step / STEPS), duration=3 * DAY).converged
    expected = compressed_point(3 * DAY)
    assert np.abs(fem.points.stress - expected).max() < 1e-6 * np.abs(expected).max()


@pytest.mark.parametrize("dt", [1e-4, DAY])
@pytest.mark.parametrize("dim", [2, 3])
def test_a_point_is_updated_alike_alone_and_among_others_with_and_without_tangent(dim, dt):
    random, law = np.random.default_rng(2), clay(preconsolidation=60e3)
    stress, increment = random_points(dim, 801, pressure=60e3, deviator=10e3, strain=1.0)
    increment *= 10 ** random.uniform(-7, -1.5, (801, 1))
    increment[17, 1], stress[100, 1] = np.nan, np.inf
    state = np.zeros((801, law.n_state))
    state[:, 1] = random.uniform(-0.2, 2.0, 801)
    report = assert_alike_alone_and_among_others(law, stress, increment, state, dt=dt)
    assert report.failed == 2
    assert 50 < report.plastic < 780


def test_creep_below_zero_is_refused():
    with pytest.raises(mpm.InputError, match="creep"):
        clay(creep=-0.01)
