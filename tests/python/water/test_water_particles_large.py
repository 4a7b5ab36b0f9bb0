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
    model.add_water(porosity=0.6, conductivity=CONDUCTIVITY, modulus=np.inf, unit_weight=WEIGHT, drained_surface=True)
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
