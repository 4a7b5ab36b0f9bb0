"""Pore water in soil that is compressed by a tenth of its height and more: Xie and Leo's column with its moving surface."""

import numpy as np
import pytest
from core_cases import box

import mpm_core as mpm

WEIGHT, MODULUS, CONDUCTIVITY = 9810.0, 1e6, 1e-6
"""Unit weight of water [N/m3], oedometric modulus [Pa] and conductivity [m/s]"""


def column(cells, load, per_cell=12):
    """A column 1 m high under a mesh twice as high; the load is on the particles of its uppermost row."""
    width = 4.0 / cells
    mesh = box((4, 2 * cells), (width, 2.0), diagonals="alternating", body=((0, 0), (width, 1.0)))
    model = mpm.Model(mesh, mpm.LinearElastic(young=MODULUS, poisson=0.0))
    model.seed(density=2000.0, per_cell=per_cell, cell_tag=1)
    model.roller(1, (1, 0))
    model.roller(2, (1, 0))
    model.fix(3)
    model.add_water(porosity=0.6, conductivity=CONDUCTIVITY, modulus=np.inf, drained_surface=True)
    y = model.particles.position[:, 1]
    force = np.zeros((len(y), 2))
    force[y > y.max() - 1e-9, 1] = -load * width / np.sum(y > y.max() - 1e-9)
    model.particles.set("traction", force)
    return model


def follow(model, factors, steps=40, **options):
    """Settlement of the surface and pressure at the base at time factors; the conductivity is k0 stretch^2."""
    start, period = model.particles.volume.copy(), WEIGHT / (CONDUCTIVITY * MODULUS)
    height = dict(zip(model.particles.id.tolist(), start.tolist()))

    def watch():
        stretch = model.particles.volume / [height[number] for number in model.particles.id.tolist()]
        model.particles.set("conductivity", CONDUCTIVITY * stretch**2)
        return False

    found, time = [], 0.0
    for factor in factors:
        dt = (factor * period - time) / steps
        list(model.implicit(factor * period, dt=dt, quasi_static=True, watch=watch, **options))
        time = factor * period
        p = model.particles
        low = np.argmin(p.position[:, 1])
        base = p.pore_pressure[low] - p.pressure_gradient[low, 1] * p.position[low, 1]
        found.append((1 - p.volume.sum() / start.sum(), base))
    return np.array(found).T


def closed_form(load, factors):
    """Xie and Leo (2004): sigma' = -M ln(stretch) and k = k0 stretch^2 make the stretch obey a linear diffusion equation in
    material coordinates, so that S/H = (1 - e^(-q/M)) U(T) and p = M ln[1 + (e^(q/M) - 1) sum ...] at the base."""
    m, t = np.pi * (np.arange(200) + 0.5)[:, None], np.asarray(factors)
    decay = np.exp(-(m**2) * t)
    degree, base = 1 - np.sum(2 / m**2 * decay, axis=0), np.sum(2 / m * np.sin(m) * decay, axis=0)
    return (1 - np.exp(-load / MODULUS)) * degree, MODULUS * np.log(1 + (np.exp(load / MODULUS) - 1) * base)


@pytest.mark.parametrize("ratio, settlement, pressure", [(0.1, 0.012, 0.003), (0.5, 0.022, 0.004)])
def test_a_column_consolidates_over_large_strains(ratio, settlement, pressure):
    """The larger load compresses by 31 %: the surface crosses six rows of cells, and the closed form is met to 2 %."""
    load, factors = ratio * MODULUS, (0.1, 0.2, 0.5)
    settled, base = follow(column(20, load), factors, integration=mpm.Integration.MIXED)
    expected_settlement, expected_base = closed_form(load, factors)
    np.testing.assert_allclose(settled, expected_settlement, rtol=settlement)
    np.testing.assert_allclose(base, expected_base, rtol=0, atol=pressure * load)


def test_a_step_that_would_close_the_pores_is_refused():
    model = column(10, 0.1 * MODULUS)
    model.particles.set("porosity", np.full(len(model.particles), 0.02))
    with pytest.raises(mpm.RunError, match="lose its volume"):
        list(model.implicit(1e6, dt=1e5, quasi_static=True))


@pytest.mark.parametrize("nmd", [False, True])
def test_pressed_soil_loses_the_weight_of_the_water_that_leaves_it(nmd):
    """A column under water that loses some 10 % of its height rests under its buoyant weight and its load: sum V s' = sum f y."""
    model = mpm.Model(
        box([1, 16], [0.1, 4 / 3], body=([0, 0], [0.1, 1.0])), mpm.LinearElastic(young=100e3, poisson=0.3)
    )
    model.seed(density=1800.0, per_cell=3, cell_tag=1)
    model.roller(1, (1, 0))
    model.roller(2, (1, 0))
    model.fix(3)
    model.set_gravity((0.0, -9.81))
    model.add_water(porosity=0.5, conductivity=1e-6, modulus=np.inf, drained_surface=True)
    model.stand_water(2.0)
    p = model.particles
    model.set_pore_pressure(lambda x: 9810.0 * (2.0 - x[:, 1]))
    p.set("stress", -(1800 * 9.81 - 9810) * (1 - p.position[:, 1:]) * np.array([3 / 7, 1, 3 / 7, 0]))
    load = -20e3 * 0.1 * p.volume / p.volume.sum()
    p.set("traction", np.column_stack([0 * load, load]))
    mass, pores, dt = p.mass.sum(), (p.volume * p.porosity).sum(), 1000.0
    while model.time < 1e6:
        model.implicit(model.time + dt, dt=dt, quasi_static=True, nmd=nmd).last()
        dt = min(1.6 * dt, 2e5)
    lost = mass - p.mass.sum()
    assert lost == pytest.approx(-1000 * model.water_inflow(), rel=1e-9) and lost > 0.03 * mass
    assert lost == pytest.approx(1000 * (pores - (p.volume * p.porosity).sum()), rel=1e-9)
    carried = load - 9.81 * (p.mass - 1000 * p.volume)
    assert p.volume @ p.stress[:, 1] == pytest.approx(carried @ p.position[:, 1], rel=5e-3)
