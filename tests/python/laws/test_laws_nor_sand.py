"""NorSand: critical state, limit of dilatancy, static liquefaction, an independent integration, tangent, start, input."""

import numpy as np
import pytest
from bridge_cases import column
from core_cases import box, run
from law_cases import Batch, assert_tangent, mean_and_radius, random_points, triaxial, walk
from scipy.integrate import solve_ivp

import fenics_bridge as bridge
import mpm_core as mpm

GAMMA, LAMBDA, M, CHI, N, H, RIGIDITY, NU = 0.9, 0.03, 1.25, 4.0, 0.2, 100.0, 200.0, 0.2
PARAMETERS = {"critical_void_ratio": GAMMA, "critical_compression": LAMBDA, "critical_slope": M, "dilatancy": CHI,
              "coupling": N, "hardening": H, "rigidity": RIGIDITY, "poisson": NU, "void_ratio": 0.8}  # fmt: skip
SAND = mpm.NorSand(**PARAMETERS, image_pressure=100e3)
BULK = RIGIDITY * 2 * (1 + NU) / (3 * (1 - 2 * NU))
"""K / p"""
LOOSE, DENSE = 0.08, -0.15
"""State parameters"""


def sand(**changes):
    return mpm.NorSand(**{**PARAMETERS, "image_pressure": 100e3, **changes})


def isotropic(pressure):
    return [-pressure] * 3 + [0.0] * 3


def states_of(law, stress, psi, overconsolidation=1.0):
    """The states at the start, shape (n, 3)."""
    states = np.zeros((len(stress), law.n_state))
    for name, values in mpm.nor_sand_state(law, stress, psi, overconsolidation).items():
        states[:, law.state_names.index(name)] = values
    return states


def element(law, pressure, psi, overconsolidation=1.0):
    stress = np.array(isotropic(pressure))
    return mpm.ElementTest(law, stress, states_of(law, stress[None], psi, overconsolidation)[0])


def p_and_q(stress):
    p, radius = mean_and_radius(np.atleast_2d(stress))
    return -p, np.sqrt(3) * radius


def void_ratio(law, state):
    return (1 + law.void_ratio) * np.exp(np.atleast_2d(state)[:, 2]) - 1


def image_pressure(law, state):
    return (law.image_pressure + law.attraction) * np.exp(np.atleast_2d(state)[:, 1])


def critical(p, law=SAND):
    return law.critical_void_ratio - law.critical_compression * np.log(p / 1e3)


def excess(law, stress, state):
    """The yield function over the pressure."""
    p, q = p_and_q(stress)
    p = p + law.attraction
    image = image_pressure(law, state)
    psi = void_ratio(law, state) - critical(image, law)
    slope = np.maximum(M - law.coupling * law.dilatancy * np.abs(psi), M / 2)
    return q / p - slope * (1 + np.log(image / p))


def drained(law, psi, axial, steps, pressure=100e3):
    """Triaxial compression: strain, p, q, e and p_i of all steps."""
    test, rows = element(law, pressure, psi), []
    for _ in range(steps):
        test.step([axial / steps, None, None, 0.0, 0.0, 0.0])
        rows.append((*test.strain, *test.stress, *test.state))
    rows = np.array(rows)
    p, q = p_and_q(rows[:, 6:12])
    return rows[:, :6], p, q, void_ratio(law, rows[:, 12:]), image_pressure(law, rows[:, 12:])


def test_isotropic_compression_along_the_axis_of_the_yield_surface():
    # chi = 0: p = e p_i, dln p_i = H (e - 1) de_v^p / M (Euler's e) and de_v^e = dln p / (K/p), exact in any increments
    law = sand(dilatancy=0.0)
    for steps in (1, 20):
        test = element(law, 100e3, LOOSE)
        for step in range(1, steps + 1):
            test.step([None, None, None, 0, 0, 0], isotropic(100e3 * 3 ** (step / steps)))
        expected = np.log(3) * (1 / BULK + M / (H * (np.e - 1)))
        assert -test.strain[:3].sum() == pytest.approx(expected, rel=1e-8)
        assert image_pressure(law, test.state) == pytest.approx(300e3 / np.e)
        assert test.state[0] < 1e-12  # no deviatoric strain


@pytest.mark.parametrize("psi", [-0.05, -0.1, -0.2])
def test_dense_sand_dilates_at_the_peak_by_its_state_parameter(psi):
    # At constant M_i (N = 0) q/p = M (1 + ln(p_i/p)). At its peak d(q/p) = 0, and as dq = 3 dp, dp = 0 too: p_i rests, which it
    # does at p_max. So q/p = M - chi psi_i and D = chi psi_i; psi_i of increments of 0.01 % strain.
    law = sand(coupling=0.0)
    strain, p, q, e, image = drained(law, psi, -0.1, 1000)
    peak = (q / p).argmax()
    psi_image = e[peak] - critical(image[peak])
    assert 10 < peak < 990 and -0.25 < psi_image < -0.02
    assert q[peak] / p[peak] == pytest.approx(M - CHI * psi_image, rel=5e-4)
    change = strain[peak + 5] - strain[peak - 5]  # the elastic part is small: stresses rest
    dilatancy = -change[:3].sum() / (-2 / 3 * (change[0] - change[1]))
    assert dilatancy == pytest.approx(CHI * psi_image, rel=0.02)
    assert q[-1] / p[-1] < q[peak] / p[peak]


def test_loose_sand_contracts_to_the_critical_state():
    # q = M p with p = p0 + q / 3, and e = e_c(p)
    _, p, q, e, image = drained(SAND, LOOSE, -3.0, 3000)
    assert (np.diff(e) < 0).all() and (np.diff(q) > 0).all()
    assert q[-1] == pytest.approx(100e3 * M / (1 - M / 3), rel=2e-3)
    assert e[-1] == pytest.approx(critical(p[-1]), abs=1e-3)
    assert image[-1] == pytest.approx(p[-1], rel=2e-3)


def undrained(law, psi, axial, steps, pressure=100e3):
    """p' and q of triaxial compression at constant volume."""
    _, stress = triaxial(element(law, pressure, psi), axial, steps, drained=False)
    return p_and_q(stress)


def residual_pressure(psi, pressure=100e3):
    """p_c(e) = exp((gamma - e) / lambda) kPa at the void ratio of the start."""
    return 1e3 * np.exp((GAMMA - critical(pressure) - psi) / LAMBDA)


def test_loose_sand_liquefies_under_undrained_shear():
    # The strength falls from a peak at a small strain, below the critical line, to that of the critical state at this volume
    p, q = undrained(SAND, LOOSE, -3.0, 6000)
    peak, residual = q.argmax(), residual_pressure(LOOSE)
    assert peak < 100 and q[peak] / p[peak] < 0.9 * M  # strain below 5 %
    assert (np.diff(q[peak:]) < 0).all()
    assert p[-1] == pytest.approx(residual, rel=0.01) and q[-1] == pytest.approx(M * residual, rel=0.01)
    assert q[-1] < 0.2 * q[peak]


def test_dense_sand_gains_strength_under_undrained_shear():
    # p falls up to the image state, q = M_i p, and then rises all the way to the critical state at this volume
    p, q = undrained(SAND, -0.05, -3.0, 6000)
    turn = p.argmin()
    assert 0 < turn < 100 and (np.diff(p[turn:]) > 0).all() and (np.diff(q) > 0).all()
    residual = residual_pressure(-0.05)
    assert residual > 400e3 and q[-1] == pytest.approx(M * residual, rel=0.01)


@pytest.mark.parametrize("psi", [LOOSE, -0.05])
def test_sand_with_water_that_does_not_drain_is_at_constant_volume(psi):
    # Triaxial compression at constant total side stress: q and the effective p are those at constant volume
    law = mpm.Undrained(SAND, water_modulus=2.2e9, porosity=0.45)
    stress = np.array([isotropic(100e3)])
    state = np.append(states_of(SAND, stress, psi)[0], 0.0)
    test = mpm.ElementTest(law, stress[0], state)
    p, q = undrained(SAND, psi, -0.2, 400)
    for step in range(400):
        test.step([-0.2 / 400, None, None, 0, 0, 0])
        if step % 40 == 39:
            effective = test.stress + test.state[-1] * np.array([1, 1, 1, 0, 0, 0])
            found = p_and_q(effective)
            assert found[0][0] == pytest.approx(p[step], rel=0.01) and found[1][0] == pytest.approx(q[step], rel=0.01)
    assert (test.state[-1] > 80e3) == (psi > 0)  # of the 100 kPa of the start


def rates(strain_rate):
    """The rate equations of the law along a fixed strain rate, for scipy: y = (stress, ln p_i, e), 6 components."""
    weights = np.array([1, 1, 1, 2, 2, 2])

    def rate(_, y):
        stress, log_image, e = y[:6], y[6], y[7]
        p = -stress[:3].mean()
        s = stress + np.array([p, p, p, 0, 0, 0])
        q = np.sqrt(1.5 * (weights * s * s).sum())
        elastic = p * np.diag([2 * RIGIDITY] * 3 + [RIGIDITY] * 3)
        elastic[:3, :3] += p * (BULK - 2 * RIGIDITY / 3)
        psi = e - GAMMA + LAMBDA * (log_image - np.log(1e3))
        slope, by_psi = M - N * CHI * abs(psi), -N * CHI * np.sign(psi)
        z = np.log(p) - log_image
        void_rate = (1 + e) * strain_rate[:3].sum()
        trial, multiplier, hardening = elastic @ strain_rate, 0.0, 0.0
        if q / p - slope * (1 - z) > -1e-6:
            normal = 1.5 * s / q - (slope - q / p) / 3 * np.array([1, 1, 1, 0, 0, 0])  # df/dsigma
            flow = normal * weights  # engineering shear
            hardening = H * (np.exp(z - CHI * psi / slope) - 1)
            resistance = (p * (1 - z) * by_psi * LAMBDA + slope * p) * hardening
            multiplier = (flow @ trial - p * (1 - z) * by_psi * void_rate) / (flow @ elastic @ flow + resistance)
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


@pytest.mark.parametrize("psi", [LOOSE, DENSE])
def test_plastic_work_is_that_of_friction_and_never_negative(psi):
    # q de_q^p + p de_v^p = p (q/p + M_i - q/p) de_q^p = p M_i de_q^p; plastic is what the elastic strains, by ln p and by the
    # secant shear modulus, leave of the strain increment
    stress, strain = random_points(3, 400, pressure=60e3, deviator=8e3, strain=1e-3)
    batch = Batch(SAND, stress, strain, states_of(SAND, stress, psi))
    before, after = p_and_q(stress)[0], p_and_q(batch.stress)[0]
    growth, direct = np.log(after / before), np.array([1, 1, 1, 0, 0, 0])
    shear = RIGIDITY * (after - before) / growth
    change = batch.stress + np.outer(after, direct) - stress - np.outer(before, direct)
    elastic = change / (shear * np.array([[2, 2, 2, 1, 1, 1]]).T).T - np.outer(growth / BULK / 3, direct)
    work = (batch.stress * (strain - elastic)).sum(axis=1)
    slope = M - N * CHI * np.abs(void_ratio(SAND, batch.state) - critical(image_pressure(SAND, batch.state)))
    off_axis = p_and_q(batch.stress)[1] > 1e-6 * after
    assert (off_axis & (batch.state[:, 0] > 0)).sum() > 150 and (work > -1e-9 * after).all()
    assert work[off_axis] == pytest.approx((after * slope * batch.state[:, 0])[off_axis], rel=1e-6, abs=1e-6)


def test_soil_that_opens_keeps_a_little_pressure_and_closes_again():
    # The pressure falls by exp(K/p e_v) to 1e-6 of 1 kPa and stays; compressed, it rises again once e is back
    test = element(SAND, 20e3, LOOSE)
    for _ in range(100):
        test.step([3e-3, 3e-3, 3e-3, 1e-3, 0, 0])
    assert p_and_q(test.stress)[0] == pytest.approx(1e-3, rel=1e-6)
    assert p_and_q(test.stress)[1] <= M * 1e-3
    for _ in range(120):
        test.step([-3e-3, -3e-3, -3e-3, -1e-3, 0, 0])
    assert p_and_q(test.stress)[0] > 20e3
    assert excess(SAND, test.stress, test.state) < 1e-9


def test_without_pressure_a_point_fails_unless_there_is_attraction():
    nothing, strain = np.zeros((1, 6)), np.full((1, 6), -1e-4)
    batch = Batch(SAND, nothing, strain)
    assert batch.report.failed == 1 and not batch.stress.any() and not batch.state.any()
    batch = Batch(sand(attraction=1e3), nothing, strain)
    assert batch.report.failed == 0 and batch.stress[0, 0] < 0
    assert Batch(SAND, np.array([isotropic(60e3)]), np.full((1, 6), np.nan)).report.failed == 1


@pytest.mark.parametrize("attraction", [0.0, 5e3])
def test_the_start_is_on_the_surface_and_has_the_state_parameter(attraction):
    law = sand(attraction=attraction)
    stress, _ = random_points(3, 200, pressure=60e3, deviator=8e3, strain=0.0)
    psi = np.linspace(-0.2, 0.2, 200)
    state = states_of(law, stress, psi)
    assert np.abs(excess(law, stress, state)).max() < 1e-12
    assert void_ratio(law, state) == pytest.approx(critical(p_and_q(stress)[0] + attraction) + psi)
    assert Batch(law, stress, -1e-5 * np.tile([1.0, 1, 1, 0, 0, 0], (200, 1)), state).report.plastic > 100
    inside = states_of(law, stress, psi, 1.5)
    assert Batch(law, stress, np.zeros((200, 6)), inside).report.plastic == 0
    assert image_pressure(law, inside) == pytest.approx(1.5 * image_pressure(law, state))


def test_a_wrong_start_is_named():
    with pytest.raises(mpm.InputError, match="expected below the attraction"):
        mpm.nor_sand_state(SAND, np.zeros((1, 4)), 0.0)
    with pytest.raises(mpm.InputError, match="overconsolidation is 0.5, expected at least 1"):
        mpm.nor_sand_state(SAND, np.array([isotropic(1e3)]), 0.0, 0.5)
    with pytest.raises(mpm.InputError, match="state_parameter is -2 at 1000 Pa, where the void ratio would be -1.1"):
        mpm.nor_sand_state(SAND, np.array([isotropic(1e3)]), -2.0)


def test_bad_parameters_are_named_with_value_and_range():
    for name, value in [("critical_compression", 0.0), ("critical_slope", -1.0), ("poisson", 0.5), ("hardening", 0.0),
                        ("dilatancy", -1.0), ("image_pressure", 0.0), ("coupling", -0.1)]:  # fmt: skip
        with pytest.raises(mpm.InputError, match=f"^{name} = {value:g}, but it must be "):
            sand(**{name: value})


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


def run_out(psi):
    """Run-out [m] of a saturated column, 0.5 m wide and 0.8 m high, that does not drain, in 0.4 s."""
    law = sand(attraction=200.0)
    model = mpm.Model(
        box([20, 10], [2.0, 1.0], body=([0.0, 0.0], [0.5, 0.8]), diagonals="alternating"),
        mpm.Undrained(law, water_modulus=2e6, porosity=0.45),
    )
    model.seed(density=1900.0, per_cell=6, cell_tag=1)
    model.roller(1, (1, 0))
    model.fix(3)
    model.set_gravity((0.0, -9.81))
    vertical = -1900.0 * 9.81 * (0.8 - model.particles.position[:, 1])
    stress = np.column_stack([0.6 * vertical, vertical, 0.6 * vertical, 0 * vertical])
    model.particles.set("stress", stress)
    for name, values in mpm.nor_sand_state(law, stress, psi).items():
        model.set_state(name, values)
    report = run(model, 0.4, nmd=True)
    assert np.isfinite(model.particles.stress).all() and abs(report.unexplained_fraction) < 0.01
    return model.particles.position[:, 0].max() - 0.5


def test_a_column_of_loose_sand_flows_and_one_of_dense_sand_stands():
    # Undrained strengths at a pressure p: M p exp(-psi / lambda), 0.04 and 150 times M p, where 0.5 times the weight is needed;
    # free fall takes 0.4 s for 0.8 m
    loose, dense = run_out(0.1), run_out(-0.15)
    assert loose > 0.5 and dense < 0.02
