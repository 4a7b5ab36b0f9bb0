"""NorSand: critical state, limit of dilatancy, static liquefaction, start, input, run-out."""

import numpy as np
import pytest
from core_cases import box, run
from law_cases import Batch, random_points
from nor_sand_cases import (
    BULK,
    CHI,
    LOOSE,
    SAND,
    H,
    M,
    critical,
    drained,
    element,
    excess,
    image_pressure,
    isotropic,
    p_and_q,
    residual_pressure,
    sand,
    states_of,
    undrained,
    void_ratio,
)

import mpm_core as mpm


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
