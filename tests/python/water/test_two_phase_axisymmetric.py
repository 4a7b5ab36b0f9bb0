"""Explicit steps of soil and water with a velocity each in axial symmetry."""

import numpy as np
import pytest
from core_cases import box

import mpm_core as mpm

POROSITY, GRAINS, WATER, GAMMA = 0.4, 2650.0, 1000.0, 9810.0
DENSITY = (1 - POROSITY) * GRAINS + POROSITY * WATER
ELASTIC = mpm.LinearElastic(young=10e6, poisson=0.3)
OEDOMETER = ELASTIC.p_wave_modulus
INNER, OUTER, BASE, TOP = 1, 2, 3, 4


def ring(cells, lengths, inner=0.0, **water):
    """A body of revolution of saturated soil, whose rectangle begins at a radius."""
    mesh = box(cells, lengths, diagonals="alternating", place=lambda x: x + (inner, 0.0))
    model = mpm.Model(mesh, ELASTIC, geometry=mpm.Geometry.AXISYMMETRIC)
    model.seed(density=DENSITY, per_cell=6)
    return model, {"porosity": POROSITY, "modulus": 2.2e7} | water


def acting(model, nmd):
    """The centres of the particles' cells, and the pore pressures that act there."""
    p = model.particles
    centres = np.asarray(model.mesh.points)[model.mesh.cells[p.cell]].mean(axis=1)
    return centres, model.averaged_pore_pressure() if nmd else p.pore_pressure


@pytest.mark.parametrize("nmd, error", [(False, 0.05), (True, 0.005)])
def test_a_cylinder_between_smooth_walls_consolidates_as_terzaghi_has_it(nmd, error):
    """The volume that has left is per radian; without averages the pressure of the uppermost cells is too low, as in plane strain."""
    load, conductivity, radius = 10e3, 2e-4, 0.2
    model, water = ring([4, 20], [radius, 1.0], conductivity=conductivity)
    model.roller(OUTER, (1, 0))
    model.fix(BASE)
    model.add_water(**water)
    model.traction(TOP, (0.0, -load))
    first = load / (1 + OEDOMETER * POROSITY / 2.2e7)
    stress = np.zeros(model.particles.stress.shape)
    stress[:, :3], stress[:, 1] = 0.3 / 0.7 * (first - load), first - load
    model.particles.set("stress", stress)
    model.set_pore_pressure(first)
    c_v = conductivity / GAMMA / (1 / OEDOMETER + POROSITY / 2.2e7)
    m = np.pi * (np.arange(200) + 0.5)
    for factor in (0.2, 0.5):
        model.explicit(factor / c_v, nmd=nmd).last()
        x, p = acting(model, nmd)
        assert p == pytest.approx(
            np.sin(m * (1 - x[:, 1:])) @ (2 / m * np.exp(-(m**2) * factor)) * first, abs=error * load
        )
        degree = 1 - np.sum(2 / m**2 * np.exp(-(m**2) * factor))
        assert -model.water_inflow() / (0.5 * radius**2 * load / OEDOMETER) == pytest.approx(degree, rel=0.015)
    u = np.abs(model.particles.displacement).max(axis=0)
    assert u[0] < 2e-3 * u[1]  # straight down


@pytest.mark.parametrize("nmd", [False, True])
def test_water_flows_to_a_well_as_thiem_has_it(nmd):
    """Steady flow between the radii a and b: p rises with ln(r / a), and r times the flux is -k / gamma_w dp / ln(b / a)."""
    a, b, conductivity, rise = 0.2, 1.2, 1e-2, 10e3
    model, water = ring([20, 1], [b - a, 0.05], inner=a, conductivity=conductivity)
    for side in (INNER, OUTER):
        model.fix(side)
    for side in (BASE, TOP):
        model.roller(side, (0, 1))
    model.add_water(**water)
    model.hold_pore_pressure(INNER, 0.0, presses=False)
    model.hold_pore_pressure(OUTER, rise, presses=False)
    model.explicit(1.0, nmd=nmd, damping=0.1).last()
    x, p = acting(model, nmd)
    assert p == pytest.approx(rise * np.log(x[:, 0] / a) / np.log(b / a), abs=0.012 * rise)
    particles = model.particles
    flux = POROSITY * (particles.water_velocity - particles.velocity)[:, 0] * particles.position[:, 0]
    assert flux.mean() == pytest.approx(-conductivity / GAMMA * rise / np.log(b / a), rel=0.01)


@pytest.mark.parametrize("nmd", [False, True])
def test_a_uniform_pressure_moves_nothing(nmd):
    """Also at the axis, where the hoop term of a pressure and its gradient balance."""
    model, water = ring([6, 6], [1.0, 1.0], conductivity=1e-2)
    model.roller(OUTER, (1, 0))
    for side in (BASE, TOP):
        model.roller(side, (0, 1))
    model.add_water(**water)
    model.set_pore_pressure(10e3)
    model.explicit(0.05, nmd=nmd).last()
    p = model.particles
    assert max(np.abs(p.velocity).max(), np.abs(p.water_velocity).max()) < 1e-10
    assert p.pore_pressure == pytest.approx(10e3, rel=1e-9)


def test_water_does_not_cross_the_axis_and_none_is_lost():
    """A cylinder that drains at its side as it settles under its weight, on a plane: what its water loses is what flows out."""
    model, water = ring([8, 10], [0.4, 0.5], conductivity=1e-3, suction_limit=0.0)
    gap = model.gap(mpm.Plane((0, 0), normal=(0, 1)))
    model.add_contact(mpm.Plane((0, gap - 1e-9), normal=(0, 1)), friction=0.5)
    model.add_water(**water)
    model.set_gravity((0.0, -9.81))
    model.explicit(1e-9).last()
    first = model.particles.water_mass.sum()
    model.explicit(0.1, nmd=True).last()
    p = model.particles
    assert model.water_inflow() < 0
    assert p.water_mass.sum() - first == pytest.approx(WATER * model.water_inflow(), rel=1e-9)
    near = p.position[:, 0] < 0.03
    assert np.abs(p.water_velocity[near, 0]).max() < 0.1 * np.abs(p.water_velocity).max()
