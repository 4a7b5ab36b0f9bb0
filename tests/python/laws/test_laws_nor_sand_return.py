"""The return of NorSand: an independent integration, tangent, huge increments, plastic work, finite elements."""

import numpy as np
import pytest
from bridge_cases import column
from law_cases import Batch, assert_alike_alone_and_among_others, assert_tangent, random_points, walk
from nor_sand_cases import (
    BULK,
    CHI,
    DENSE,
    GAMMA,
    LAMBDA,
    LOOSE,
    RIGIDITY,
    SAND,
    H,
    M,
    N,
    critical,
    direction_factor,
    element,
    excess,
    image_pressure,
    isotropic,
    p_and_q,
    sand,
    states_of,
    void_ratio,
)
from scipy.integrate import solve_ivp

import fenics_bridge as bridge
import mpm_core as mpm


def rates(strain_rate):
    """The rate equations of the law along a fixed strain rate, for scipy: y = (stress, ln p_i, e), 6 components."""
    weights, direct = np.array([1, 1, 1, 2, 2, 2]), np.array([1, 1, 1, 0, 0, 0])

    def rate(_, y):
        stress, log_image, e = y[:6], y[6], y[7]
        p = -stress[:3].mean()
        s = stress + p * direct
        q = np.sqrt(1.5 * (weights * s * s).sum())
        g = direction_factor(stress)[0]
        elastic = p * np.diag([2 * RIGIDITY] * 3 + [RIGIDITY] * 3)
        elastic[:3, :3] += p * (BULK - 2 * RIGIDITY / 3)
        psi = e - GAMMA + LAMBDA * (log_image - np.log(1e3))
        slope, by_psi = M - N * CHI * abs(psi), -N * CHI * np.sign(psi)
        z = np.log(p) - log_image
        void_rate = (1 + e) * strain_rate[:3].sum()
        trial, multiplier, hardening = elastic @ strain_rate, 0.0, 0.0
        if g * q / p - slope * (1 - z) > -1e-6:  # f = g q - M_i p (1 - z)
            steps = 1e-5 * q * np.eye(6)
            turn = (direction_factor(stress + steps) - direction_factor(stress - steps)) / (2e-5 * q)  # dg/dsigma
            normal = g * 1.5 * s / q * weights - slope * z / 3 * direct + q * turn  # df/dsigma
            flow = 1.5 * s / q * weights - slope * z / g / 3 * direct  # along the deviator, engineering shear
            hardening = H * (np.exp(z - CHI * psi / slope) - 1) / g
            resistance = (p * (1 - z) * by_psi * LAMBDA + slope * p) * hardening
            multiplier = (normal @ trial - p * (1 - z) * by_psi * void_rate) / (normal @ elastic @ flow + resistance)
            multiplier = max(0.0, multiplier)
            trial = trial - elastic @ flow * multiplier
        return np.r_[trial, hardening * multiplier, void_rate]

    return rate


DIRECTIONS = {
    "oedometer": [-1.0, 0, 0, 0, 0, 0],
    "undrained triaxial": [-1, 0.5, 0.5, 0, 0, 0],
    "simple shear": [0, -0.2, 0, 1.0, 0, 0],
    "general": [-0.3, -0.5, 0.6, 0.4, -0.6, 0.5],
}


@pytest.mark.parametrize("direction", DIRECTIONS.values(), ids=DIRECTIONS.keys())
@pytest.mark.parametrize("psi", [LOOSE, DENSE], ids=["loose", "dense"])
def test_paths_agree_with_an_independent_integration_to_first_order(direction, psi):
    # From K0 stresses on the yield surface; errors of 1 and of 10 times as many increments
    total, stress = 0.04 * np.array(direction), np.array([-120e3, -80e3, -70e3, 10e3, 0, 0])
    state = states_of(SAND, stress[None], psi)[0]
    start = np.r_[stress, np.log(image_pressure(SAND, state)), void_ratio(SAND, state)]
    reference = solve_ivp(rates(total), (0, 1), start, method="LSODA", rtol=1e-9, atol=1e-7, max_step=1e-3).y[:, -1]
    errors = {}
    for steps in (10, 100, 1000):
        test = mpm.ElementTest(SAND, stress, state)
        for _ in range(steps):
            test.step(total / steps)
        errors[steps] = np.abs(test.stress - reference[:6]).max() / np.abs(reference[:6]).max()
    assert errors[10] < 0.15 and errors[1000] < 2e-3
    assert errors[100] < 0.2 * errors[10] or errors[100] < 2e-3
    assert errors[1000] < 0.15 * errors[100] or errors[1000] < 2e-4
    assert image_pressure(SAND, test.state) == pytest.approx(np.exp(reference[6]), rel=5e-3)


def test_one_ten_and_a_hundred_increments_come_closer_to_a_thousand():
    for psi in (LOOSE, DENSE):
        ends = {}
        for steps in (1, 10, 100, 1000):
            test = element(SAND, 100e3, psi)
            for _ in range(steps):
                test.step(np.array([-0.02, 0.006, 0.004, 0.01, 0, 0]) / steps)
            ends[steps] = test.stress
        errors = [np.abs(ends[steps] - ends[1000]).max() / np.abs(ends[1000]).max() for steps in (1, 10, 100)]
        assert errors[0] < 0.5 and errors[1] < 0.3 * errors[0] and errors[2] < 0.15 * errors[1]


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("psi", [LOOSE, DENSE])
@pytest.mark.parametrize("strain", [1e-4, 1e-3, 1e-2])
def test_tangent_is_the_derivative_of_the_stress(dim, psi, strain):
    stress, increment = random_points(dim, 400, pressure=60e3, deviator=3e3, strain=strain)
    batch = Batch(SAND, stress, increment, states_of(SAND, stress, psi))
    assert 100 < batch.report.plastic <= 400 and batch.report.failed == 0
    assert_tangent(batch, 1e-4 * strain, tolerance=1e-5, share=0.9)


def test_tangent_where_the_surface_meets_the_axis():
    # Compression next to the axis returns to q = 0, where the stress depends on the volume only
    stress = np.array([isotropic(60e3)]) * np.linspace(1.0, 1.5, 50)[:, None]
    strain = np.full((50, 6), -1e-3) * np.array([1, 1, 1, 0.1, -0.1, 0.05])
    batch = Batch(SAND, stress, strain, states_of(SAND, stress, LOOSE))
    assert batch.report.plastic == 50 and p_and_q(batch.stress)[1].max() < 1e-6
    assert_tangent(batch, 1e-8, tolerance=1e-6, share=0.99)
    assert np.abs(batch.tangent[:, 3:]).max() < 1e-6 * SAND.p_wave_modulus


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("psi", [LOOSE, DENSE])
def test_stress_stays_admissible(dim, psi):
    law = sand(void_ratio=critical(60e3) + psi)
    stress, _ = random_points(dim, 1000, pressure=60e3, deviator=3e3, strain=0.0)
    stress, state = walk(law, stress, 1e-3, 100)
    assert excess(law, stress, state).max() < 1e-9
    assert (p_and_q(stress)[0] > 0).all() and np.mean(state[:, 0] > 0) > 0.9


@pytest.mark.parametrize("strain", [0.03, 0.1, 0.3])
def test_huge_increments_return_to_the_surface(strain):
    stress, increment = random_points(3, 1000, pressure=60e3, deviator=3e3, strain=strain)
    increment[:, :3] -= 0.9 * increment[:, :3].mean(axis=1)[:, None]
    for psi in (0.3, LOOSE, DENSE):
        batch = Batch(SAND, stress, increment, states_of(SAND, stress, psi))
        assert batch.report.failed == 0 and np.isfinite(batch.stress).all() and np.isfinite(batch.tangent).all()
        assert excess(SAND, batch.stress, batch.state).max() < 1e-6  # pressures fall by up to 1e5


def test_increments_beyond_all_bounds_fail_or_return_to_the_surface():
    # Compressible, very loose and stiff: trial pressures of up to exp(100) times those of the start
    law = sand(critical_compression=0.15, coupling=0.5, dilatancy=5.5, hardening=900.0, rigidity=600.0)
    stress, increment = random_points(3, 2000, pressure=60e3, deviator=3e3, strain=0.1)
    start = states_of(law, stress, 0.4)
    batch = Batch(law, stress, increment, start)
    failed = (batch.stress == stress).all(axis=1)
    assert 0 < failed.sum() == batch.report.failed < 1000
    assert (batch.state[failed] == start[failed]).all() and not batch.tangent[failed].any()
    for values in (batch.stress, batch.state, batch.tangent):
        assert np.isfinite(values).all()
    assert excess(law, batch.stress[~failed], batch.state[~failed]).max() < 1e-6


@pytest.mark.parametrize("dim", [2, 3])
def test_a_point_is_updated_alike_alone_and_among_others_with_and_without_tangent(dim):
    # Elastic, plastic, returned by brackets (the largest increments) and failing (not a number, no pressure)
    stress, strain = random_points(dim, 401, pressure=60e3, deviator=12e3, strain=1.0)
    strain *= 10 ** np.random.default_rng(2).uniform(-6, -0.5, (401, 1))
    start = states_of(SAND, stress, LOOSE, overconsolidation=1.3)
    strain[17, 1], stress[100, :3] = np.nan, 1.0
    report = assert_alike_alone_and_among_others(SAND, stress, strain, start)
    assert report.failed >= 2 and 100 < report.plastic < 400


@pytest.mark.parametrize("psi", [LOOSE, DENSE])
def test_plastic_work_is_that_of_friction_and_never_negative(psi):
    # q de_q^p + p de_v^p = p (q/p + M_i / g - q/p) de_q^p = p M_i / g de_q^p; plastic is what the elastic strains, by ln p and by
    # the secant shear modulus, leave of the strain increment
    stress, strain = random_points(3, 400, pressure=60e3, deviator=8e3, strain=1e-3)
    batch = Batch(SAND, stress, strain, states_of(SAND, stress, psi))
    before, after = p_and_q(stress)[0], p_and_q(batch.stress)[0]
    growth, direct = np.log(after / before), np.array([1, 1, 1, 0, 0, 0])
    shear = RIGIDITY * (after - before) / growth
    change = batch.stress + np.outer(after, direct) - stress - np.outer(before, direct)
    elastic = change / (shear * np.array([[2, 2, 2, 1, 1, 1]]).T).T - np.outer(growth / BULK / 3, direct)
    work = (batch.stress * (strain - elastic)).sum(axis=1)
    slope = M - N * CHI * np.abs(void_ratio(SAND, batch.state) - critical(image_pressure(SAND, batch.state)))
    slope /= direction_factor(batch.stress)
    off_axis = p_and_q(batch.stress)[1] > 1e-6 * after
    assert (off_axis & (batch.state[:, 0] > 0)).sum() > 150 and (work > -1e-9 * after).all()
    assert work[off_axis] == pytest.approx((after * slope * batch.state[:, 0])[off_axis], rel=1e-6, abs=1e-6)


def test_newtons_method_converges_quadratically_in_finite_elements():
    # A column between a fixed base and a crest that is pressed down, with a constant pressure on one side
    domain, facet_tags, _, _ = column(2)
    law, pressure = sand(attraction=1e3), {bridge.SLOPE: 20e3}
    supports = [
        bridge.roller(bridge.LEFT, (1, 0)),
        bridge.fixed(bridge.BASE),
        bridge.prescribed(bridge.CREST, (0, -0.005)),
    ]
    fem = bridge.QuasiStatic(domain, law, facet_tags, supports, degree=2)
    fem.set_initial_stress(np.tile([-20e3] * 3 + [0.0], (fem.points.n, 1)), bridge.Load(pressure=pressure))
    fem.points.state[:] = states_of(law, fem.points.stress, 0.05)
    report = fem.equilibrate(bridge.Load(displacement=1.0, pressure=pressure))
    assert report.converged and report.relaxation is None and report.iterations <= 5
    assert report.residuals[-1] < 100 * report.residuals[-2] ** 2 < 1e-7
    assert fem.points.state[:, 0].min() > 1e-3  # all of it yields
