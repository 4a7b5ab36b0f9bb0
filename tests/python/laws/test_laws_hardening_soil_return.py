"""The return of Hardening Soil: tangent, convergence with the increments, huge increments, directions, plastic work."""

import numpy as np
import pytest
from hardening_soil_cases import clay, isotropic, sand, small_strain_sand
from law_cases import Batch, assert_alike_alone_and_among_others, assert_tangent, random_points, walk

import mpm_core as mpm


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("soil", [sand, clay, small_strain_sand])
@pytest.mark.parametrize("strain", [1e-5, 1e-4, 1e-3, 1e-2])
def test_tangent_is_the_derivative_of_the_stress(dim, soil, strain):
    stress, increment = random_points(dim, 400, pressure=60e3, deviator=10e3, strain=strain)
    law = soil(tension_cutoff=0.0)
    batch = Batch(law, stress, increment)
    assert 100 < batch.report.plastic <= 400 and batch.report.failed == 0
    assert_tangent(batch, 1e-4 * strain, tolerance=1e-5)


@pytest.mark.parametrize("soil", [sand, small_strain_sand])
def test_tangent_at_failure(soil):
    law = soil()
    stress, state = walk(law, np.tile(isotropic(100e3), (100, 1)), 2e-3, 20)
    increment = np.random.default_rng(3).normal(0.0, 1e-3, stress.shape)
    batch = Batch(law, stress, increment, state)
    assert batch.report.plastic > 60
    assert_tangent(batch, 1e-8)


@pytest.mark.parametrize("soil", [sand, clay])
@pytest.mark.parametrize(
    "total",
    [[-0.02, 0.006, 0.004, 0.01, 0, 0], [-0.02, 0, 0, 0, 0, 0], [-0.01, 0.005, 0.005, 0, 0, 0]],
    ids=["general", "oedometer", "undrained"],
)
def test_more_increments_come_closer_to_the_limit_to_first_order(soil, total):
    ends = {}
    for steps in (1, 10, 100, 1000):
        test = mpm.ElementTest(soil(), [-80e3, -50e3, -50e3, 0, 0, 0])
        for _ in range(steps):
            test.step(np.array(total) / steps)
        ends[steps] = test.stress
    size = np.abs(ends[1000]).max()
    errors = [np.abs(ends[steps] - ends[1000]).max() / size for steps in (1, 10, 100)]
    assert errors[0] < 0.3 and errors[1] < 0.5 * errors[0] + 1e-3 and errors[2] < 0.2 * errors[1] + 1e-3


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("soil", [sand, clay, small_strain_sand])
def test_increments_of_any_size_return_to_admissible_stresses(dim, soil):
    law = soil()
    for strain in (1e-6, 1e-3, 0.03, 0.1):
        stress, state = walk(law, np.tile(isotropic(50e3)[: 4 if dim == 2 else 6], (300, 1)), strain, 20)
        assert np.isfinite(stress).all() and (state[:, 0] >= 0).all()
        still, state_before = stress.copy(), state.copy()
        report = law.update(np.zeros_like(stress), still, state)
        assert report.failed == 0
        assert np.abs(still - stress).max() < 1e-7 * np.abs(stress).max()
        assert state == pytest.approx(state_before, abs=1e-7)


@pytest.mark.parametrize("soil", [sand, small_strain_sand])
@pytest.mark.parametrize("dim", [2, 3])
def test_a_point_is_updated_alike_alone_and_among_others_with_and_without_tangent(dim, soil):
    # Elastic, plastic, loose and failing, new and hardened, with increments from tiny to huge ones
    rng, law = np.random.default_rng(2), soil()
    stress, increment = random_points(dim, 801, pressure=60e3, deviator=10e3, strain=1.0)
    increment *= 10 ** rng.uniform(-7, -1, (801, 1))
    increment[17, 1], stress[100, 1] = np.nan, np.inf
    state = np.zeros((801, law.n_state))
    hardened = rng.uniform(size=801) < 0.5
    state[hardened, 1:3] = rng.uniform(0.0, [2e-3, 12.0], (hardened.sum(), 2))
    report = assert_alike_alone_and_among_others(law, stress, increment, state)
    assert report.failed == 2 and 200 < report.plastic < 780


def test_turned_points_are_turned_results():
    law, rng = sand(), np.random.default_rng(7)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    order = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)]

    def turned(vectors, factor):
        tensors = np.zeros((len(vectors), 3, 3))
        for k, (i, j) in enumerate(order):
            tensors[:, i, j] = tensors[:, j, i] = vectors[:, k] * (1 if k < 3 else factor)
        tensors = turn @ tensors @ turn.T
        return np.stack([tensors[:, i, j] / (1 if k < 3 else factor) for k, (i, j) in enumerate(order)], axis=1)

    stress, increment = random_points(3, 100, pressure=60e3, deviator=10e3, strain=2e-3)
    one, other = stress.copy(), np.ascontiguousarray(turned(stress, 1.0))
    law.update(increment, one, np.zeros((100, 3)))
    law.update(np.ascontiguousarray(turned(increment, 0.5)), other, np.zeros((100, 3)))
    assert turned(one, 1.0) == pytest.approx(other, abs=1e-8 * np.abs(other).max())


def test_points_that_are_no_numbers_fail_and_stay():
    law = sand()
    stress = np.tile(isotropic(50e3), (3, 1))
    stress[1, 0] = np.nan
    increment = np.zeros((3, 6))
    increment[2, 3] = np.inf
    report = law.update(increment, stress, np.zeros((3, 3)), np.zeros((3, 6, 6)))
    assert report.failed == 2 and report.first_failed == 1
