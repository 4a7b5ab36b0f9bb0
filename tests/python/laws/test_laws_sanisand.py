"""SANISAND: critical state, an independent integration, increments, tangent, rotation, cyclic loading, input."""

import numpy as np
import pytest
from law_cases import Batch, random_points, triaxial, walk
from sanisand_cases import C, Reference, M, critical_pressure, critical_void_ratio, element, sand, tensor

import mpm_core as mpm

LOOSE, DENSE = 0.9, 0.735


def p_and_q(stress):
    stress = np.atleast_2d(stress)
    return -stress[:, :3].mean(axis=1), stress[:, 1] - stress[:, 0]


def void_ratio(test):
    return (1 + test.law.void_ratio) * np.exp(test.state[1]) - 1


# --- critical state ---


@pytest.mark.parametrize(("e", "pressure"), [(LOOSE, 300e3), (0.833, 100e3), (DENSE, 1000e3)])
def test_undrained_compression_ends_in_the_critical_state(e, pressure):
    test = element(sand(e), pressure)
    _, stress = triaxial(test, -0.6, 600, drained=False)
    p, q = p_and_q(stress[-1])
    assert p[0] == pytest.approx(critical_pressure(e), rel=0.01)
    assert q[0] == pytest.approx(M * p[0], rel=0.01)


@pytest.mark.parametrize(("direction", "ratio"), [(-1, M), (1, C * M)])
def test_drained_test_ends_at_the_critical_void_ratio(direction, ratio):
    law = sand(0.83)
    test = element(law, 200e3)
    for _ in range(3000):
        test.step([2e-4 * direction, None, None, 0.0, 0.0, 0.0])
    p, q = p_and_q(test.stress)
    assert abs(q[0]) == pytest.approx(ratio * p[0], rel=0.02)
    assert void_ratio(test) == pytest.approx(critical_void_ratio(p[0]), abs=0.006)
    assert void_ratio(test) > 0.84


def test_loose_sand_contracts_to_a_peak_and_dense_sand_dilates():
    _, loose = triaxial(element(sand(LOOSE), 1000e3), -0.2, 400, drained=False)
    _, dense = triaxial(element(sand(DENSE), 100e3), -0.2, 400, drained=False)
    (p, q), (p_dense, q_dense) = p_and_q(loose), p_and_q(dense)
    assert q.max() > 1.1 * q[-1] and p[-1] < 0.35e6
    assert q_dense[-1] == pytest.approx(q_dense.max(), rel=2e-3) and p_dense[-1] > 1e6


# --- integration ---


def path():
    """Strains of a path with reversals, in all components."""
    rng = np.random.default_rng(5)
    for axial, shear, volume in [(-4e-3, 3e-3, -5e-4), (3e-3, -5e-3, 0.0), (-6e-3, 2e-3, 3e-4), (1e-5, 2e-5, -1e-5)]:
        other = 0.3 * abs(axial) * rng.normal(size=2)
        yield np.array([axial, -axial / 2 + volume, -axial / 2, shear, *other])


@pytest.mark.parametrize("e", [LOOSE, DENSE])
def test_it_is_the_solution_of_its_differential_equations(e):
    law = sand(e, fabric_rate=300.0)
    test, reference = element(law, 150e3), Reference(law, 150e3)
    for strain in path():
        test.step(strain)
        reference.strained(strain)
        p = np.trace(reference.stress) / 3
        assert -tensor(test.stress) == pytest.approx(reference.stress, abs=1e-3 * p)
        assert -tensor(test.state[2:8]) == pytest.approx(reference.alpha, abs=1e-3)
        assert -tensor(test.state[8:14]) == pytest.approx(reference.reversal, abs=1e-3)
        assert -tensor(test.state[14:]) == pytest.approx(reference.z, abs=5e-3)
    assert (abs(reference.z).max() > 0.3) == (e == DENSE)


def test_one_increment_is_as_good_as_a_thousand():
    for strain in path():
        one, many = element(sand(), 100e3), element(sand(), 100e3)
        one.step(strain)
        for _ in range(1000):
            many.step(strain / 1000)
        assert one.stress == pytest.approx(many.stress, abs=1e-3 * abs(many.stress[:3]).mean())
        assert one.state == pytest.approx(many.state, abs=2e-3)


@pytest.mark.parametrize("dim", [2, 3])
def test_tangent_is_the_derivative(dim):
    stress, strain = random_points(dim, 200, pressure=100e3, deviator=5e3, strain=3e-4)
    _, state = walk(sand(), stress, 2e-4, 5)
    batch = Batch(sand(), stress, strain, state)
    assert batch.report.failed == 0
    # That the lengths of substeps follow the strain, too, is not in it
    error = abs(batch.tangent - batch.differences(2e-9)).max(axis=(1, 2)) / sand().p_wave_modulus
    assert np.median(error) < 1e-4 and np.quantile(error, 0.8) < 1e-3 and error.max() < 0.05


def test_plane_strain_is_three_dimensions_without_the_other_shears():
    stress, _ = random_points(2, 50, pressure=100e3, deviator=5e3, strain=3e-4)
    rng = np.random.default_rng(3)
    plane, plane_state = stress.copy(), np.zeros((50, 20))
    solid, solid_state = np.hstack([stress, np.zeros((50, 2))]), np.zeros((50, 20))
    for _ in range(10):
        strain = rng.normal(0, 3e-4, (50, 4))
        sand().update(strain, plane, plane_state)
        sand().update(np.hstack([strain, np.zeros((50, 2))]), solid, solid_state)
    assert solid[:, :4] == pytest.approx(plane, rel=1e-12, abs=1e-6)
    assert solid_state == pytest.approx(plane_state, rel=1e-10, abs=1e-12)


def test_the_tensors_of_its_state_turn_with_the_material():
    """An increment of turned soil is the turned increment; the core turns the stress before the update, the law its states."""
    law, angle = sand(DENSE), 0.7
    rng = np.random.default_rng(8)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    spin = np.array([[0, -1], [1, 0]]) * np.tan(angle / 2) * 2  # whose Cayley transform is the turn

    def turned(rows, factor=1.0):
        full = np.array([[rows[:, 0], factor * rows[:, 3]], [factor * rows[:, 3], rows[:, 1]]]).transpose(2, 0, 1)
        full = turn @ full @ turn.T
        return np.column_stack([full[:, 0, 0], full[:, 1, 1], rows[:, 2], full[:, 0, 1] / factor])

    stress, _ = random_points(2, 20, pressure=100e3, deviator=5e3, strain=3e-4)
    _, state = walk(law, stress, 1e-3, 5)
    stress, state = stress.copy(), state
    other, other_state, nothing = turned(stress), state.copy(), np.zeros((20, 4))
    law.update(nothing, stress, state)
    law.update(nothing, other, other_state, deformation=np.tile(np.eye(2) + spin, (20, 1, 1)))
    strain = rng.normal(0, 5e-4, (20, 4)) * [1, 1, 0, 1]
    law.update(strain, stress, state)
    law.update(turned(strain, 0.5), other, other_state)
    assert other == pytest.approx(turned(stress), abs=1e-4)
    for first in (2, 8, 14):
        assert other_state[:, first : first + 4] == pytest.approx(turned(state[:, first : first + 4]), abs=1e-9)
    assert abs(state[:, 14:18]).max() > 0.1


# --- cycles ---


def cycles_to_liquefaction(e, ratio, pressure=100e3, most=200, amplitude_step=2e-5, **changes):
    """Cycles of undrained simple shear of the stress ratio tau / p_0 until p' is below a tenth of its start; strains and pressures."""
    test = element(sand(e, **changes), pressure, 4)
    largest, reversals, direction = ratio * pressure, 0, 1
    strains, pressures = [0.0], [pressure]
    while reversals < 2 * most:
        test.step([0, 0, 0, direction * amplitude_step])
        strains.append(test.strain[3])
        pressures.append(-test.stress[:3].mean())
        if direction * test.stress[3] >= largest:
            reversals, direction = reversals + 1, -direction
        if pressures[-1] < 0.1 * pressure:
            break
    return reversals / 2, np.array(strains), np.array(pressures)


def test_cyclic_resistance_falls_with_cycles_and_rises_with_density():
    cycles = {ratio: cycles_to_liquefaction(0.8, ratio)[0] for ratio in (0.12, 0.16, 0.22)}
    assert 1 < cycles[0.22] < cycles[0.16] < cycles[0.12] < 200
    assert cycles_to_liquefaction(0.85, 0.16)[0] < cycles[0.16]
    assert cycles_to_liquefaction(DENSE, 0.16, most=30)[2].min() > 20e3


def test_fabric_makes_dilated_sand_contract_on_reversal():
    """The loops of stress that the cycles end in come nearer to zero pressure."""
    _, _, loops = cycles_to_liquefaction(0.78, 0.2, most=40)
    _, _, without = cycles_to_liquefaction(0.78, 0.2, most=40, fabric_limit=0.0)
    assert loops.min() < 0.6 * without.min()


# --- start, looseness, input ---


def test_soil_begins_at_the_ratio_of_its_stress():
    """At rest under K_0 its yield surface passes through the stress, which stays, and loading begins as a first loading."""
    law = sand(0.8)
    stress = np.array([[-50e3, -100e3, -50e3, 0.0]])
    state = np.zeros((1, law.n_state))
    law.update(np.array([[0, -1e-6, 0, 0.0]]), stress, state)
    assert stress[0, 1] < -100e3
    assert abs(stress - [[-50e3, -100e3, -50e3, 0.0]]).max() < 300
    back = state[0, 2:6]
    assert back[:3].sum() == pytest.approx(0, abs=1e-12) and back[1] < -0.45
    assert state[0, 8:12] == pytest.approx(back, abs=1e-3)


def test_states_follow_from_stress_and_state_parameter():
    law = sand(0.8, attraction=1e3)
    stress = np.array([[-50e3, -100e3, -50e3, 0.0], [-100e3, -200e3, -100e3, 10e3]])
    values = mpm.sanisand_state(law, stress, [0.02, -0.1])["log_specific_volume"]
    p = -stress[:, :3].mean(axis=1) + 1e3
    assert 1.8 * np.exp(values) - 1 == pytest.approx(critical_void_ratio(p) + [0.02, -0.1])
    with pytest.raises(mpm.InputError, match="state_parameter is -2 at .* expected a positive one"):
        mpm.sanisand_state(law, stress, -2.0)
    with pytest.raises(mpm.InputError, match="stress has the mean 2000 Pa, expected below the attraction, 1000 Pa"):
        mpm.sanisand_state(law, np.full((1, 4), 2e3) * [1, 1, 1, 0], 0.0)


def test_loosened_sand_keeps_a_small_pressure_and_closes_again():
    test = element(sand(0.8), 20e3, 4)
    test.step([0.02, 0.02, 0.0, 0.01])
    assert -test.stress[:3].mean() == pytest.approx(10.1325, rel=1e-9)
    assert void_ratio(test) == pytest.approx(1.8 * np.exp(0.04) - 1)
    for _ in range(100):
        test.step([-4e-4, -4e-4, 0.0, 1e-4])
    assert -test.stress[:3].mean() > 50e3


def test_points_that_cannot_be_worked_with_fail_and_stay():
    stress, state = np.array([[-1e5, -1e5, -1e5, 0.0]] * 3), np.zeros((3, 20))
    strain = np.array([[0, -1e-4, 0, 0], [np.nan, 0, 0, 0], [0, 0, 0, 1e-4]])
    report = sand().update(strain, stress, state)
    assert report.failed == 1 and report.first_failed == 1
    assert stress[1].tolist() == [-1e5, -1e5, -1e5, 0.0] and not state[1].any()


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("extension_ratio", 0.3, r"extension_ratio = 0.3, but it must be in \[0.5, 1\]"),
        ("rigidity", 0.0, "rigidity = 0, but it must be positive"),
        ("largest_pressure", -1.0, "largest_pressure = -1, but it must be positive"),
        ("fabric_limit", -1.0, "fabric_limit = -1, but it must be at least 0"),
        ("void_ratio", float("nan"), "void_ratio = nan, but it must be positive"),
    ],
)
def test_parameters_out_of_range_are_named(name, value, message):
    with pytest.raises(mpm.InputError, match=message):
        sand(**{name: value})


def test_stiffness_follows_the_pressure():
    law = sand(0.8)
    stress = np.array([[-100e3] * 3 + [0.0], [-400e3] * 3 + [0.0]])
    moduli = law.wave_moduli(stress, np.zeros((2, 20)))
    shear = 125 * 101.325e3 * (2.97 - 0.8) ** 2 / 1.8 * np.sqrt(100 / 101.325)
    assert moduli[0, 1] == pytest.approx(shear) and moduli[1] == pytest.approx(2 * moduli[0])
    assert law.p_wave_modulus == pytest.approx(np.sqrt(10) * moduli[0, 0])
    small = 1e-7
    test = element(law, 100e3, 4)
    test.step([0, 0, 0, small])
    assert test.stress[3] == pytest.approx(shear * small, rel=1e-3)
