"""Tractions on the particles next to a boundary (15)."""

import numpy as np
import pytest
from core_cases import DIMS, box, by_id, moduli, rollers, run

import mpm_core as mpm

YOUNG, POISSON, DENSITY = 1e6, 0.3, 2000.0
ELASTIC = mpm.LinearElastic(young=YOUNG, poisson=POISSON)


@pytest.mark.parametrize("dim", DIMS)
@pytest.mark.parametrize("per_cell", [1, 4, 10])
def test_forces_add_up_to_traction_times_area(dim, per_cell):
    lengths = [2.0, 1.5, 3.0][:dim]
    model = mpm.Model(box([3] * dim, lengths, shake=0.15), ELASTIC)
    model.seed(density=DENSITY, per_cell=per_cell)
    traction = np.array([100.0, -50.0, 20.0])[:dim]
    side = np.prod(lengths[1:])
    assert model.traction(2, traction) == pytest.approx(side, rel=1e-13)
    forces = model.particles.traction
    assert forces.sum(axis=0) == pytest.approx(traction * side, rel=1e-13)
    loaded = np.any(forces != 0, axis=1)
    # on the cells behind the side only, and there on the particles nearest to it
    assert np.all(model.particles.position[loaded, 0] > lengths[0] * (1 - 0.5))
    model.traction(2, traction)  # loads add up
    model.traction(3, traction)
    total = traction * (2 * side + np.prod(lengths) / lengths[1])
    assert model.particles.traction.sum(axis=0) == pytest.approx(total, rel=1e-13)


@pytest.mark.parametrize("dim", DIMS)
def test_traction_accelerates_a_free_body_and_moves_with_it(dim):
    model = mpm.Model(box([8] * dim, body=([0.0] * dim, [0.375] * dim)), ELASTIC)
    model.seed(density=DENSITY, per_cell=4, cell_tag=1)
    traction = np.array([300.0] + [50.0] * (dim - 1))
    area = model.traction(1, traction)
    assert area == pytest.approx(0.375 ** (dim - 1), rel=1e-12)
    carried = by_id(model, "traction")
    before, cells = model.report(), by_id(model, "cell")
    report = run(model, 0.8)
    assert np.subtract(report.momentum, before.momentum) == pytest.approx(traction * area * 0.8, rel=1e-12)
    moved = by_id(model, "cell") != cells
    assert np.any(moved & np.any(carried != 0, axis=1))
    assert np.array_equal(by_id(model, "traction"), carried)


@pytest.mark.parametrize("dim", DIMS)
def test_pressure_on_a_confined_block_compresses_it_evenly(dim):
    # sigma_xx = -p, sigma_yy = sigma_zz = -nu / (1 - nu) p, u = -p L / (K + 4G/3)
    pressure = 100.0
    model = mpm.Model(box([8] + [2] * (dim - 1), [2.0] + [0.5] * (dim - 1), diagonals="alternating"), ELASTIC)
    model.seed(density=DENSITY, per_cell=4)
    rollers(model, but=(2,))
    model.traction(2, [-pressure] + [0.0] * (dim - 1))
    report = run(model, 2.0, damping=0.5)
    assert report.unbalanced_ratio < 1e-3
    expected = np.zeros(model.particles.stress.shape[1])
    expected[:3] = [-pressure, *[-POISSON / (1 - POISSON) * pressure] * 2]
    x, stress = model.particles.initial_position, model.particles.stress
    square = np.floor(4 * x[:, 0])
    for k in range(7):  # equilibrium of all squares but those that carry the load
        assert np.allclose(stress[square == k].mean(axis=0), expected, rtol=0, atol=0.01 * pressure)
    far = x[:, 0] < 1.0
    assert np.allclose(stress[far], expected, rtol=0, atol=0.01 * pressure)
    strain = pressure / moduli(YOUNG, POISSON)[2]
    assert np.allclose(model.particles.displacement[far, 0], -strain * x[far, 0], rtol=0, atol=0.01 * strain)


def test_bad_tractions_are_refused():
    model = mpm.Model(box([2, 2], body=([0, 0], [0.5, 0.5])), ELASTIC)
    model.seed(density=DENSITY, per_cell=1, cell_tag=1)
    with pytest.raises(mpm.InputError, match="facet_tag 2 has no filled cell"):
        model.traction(2, (1.0, 0.0))
    with pytest.raises(mpm.InputError, match=r"traction has shape \(3,\)"):
        model.traction(1, (1.0, 0.0, 0.0))
    with pytest.raises(mpm.InputError, match="traction is nan"):
        model.traction(1, (1.0, np.nan))
    with pytest.raises(mpm.InputError, match="facet_tag is 9"):
        model.traction(9, (1.0, 0.0))
