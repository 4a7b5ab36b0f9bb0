"""Energy of pore water: what its flow takes out, its weight and pressures do, and its compression stores."""

import numpy as np
import pytest
from core_cases import box

import mpm_core as mpm

SOIL = mpm.LinearElastic(young=10e6, poisson=0.3)
OEDOMETER, WEIGHT, POROSITY, LOAD = SOIL.p_wave_modulus, 9810.0, 0.4, 10e3
BASE, TOP = 3, 4


def column(cells, conductivity=1e-6, modulus=np.inf):
    """A column 1 m high and 0.2 m wide on a fixed base between rollers."""
    model = mpm.Model(box((2, cells), (0.2, 1.0), diagonals="alternating"), SOIL)
    model.seed(density=1990.0, per_cell=3)
    model.roller(1, (1, 0))
    model.roller(2, (1, 0))
    model.fix(BASE)
    model.add_water(porosity=POROSITY, conductivity=conductivity, modulus=modulus)
    return model


def loaded(cells, conductivity=1e-6, modulus=np.inf):
    """A weightless column that drains at its loaded top; and its time H^2 / c_v [s] with incompressible water."""
    model = column(cells, conductivity, modulus)
    model.hold_pore_pressure(TOP, 0.0)
    model.press_surface(TOP, LOAD)
    return model, WEIGHT / (conductivity * OEDOMETER)


def elastic_energy(stress, volume):
    """Of a change of stress in plane strain, sum V s : C^-1 : s / 2 [J/m]."""
    trace = stress[:, :3].sum(axis=1)
    squares = (stress[:, :3] ** 2).sum(axis=1) + 2 * stress[:, 3] ** 2
    return volume @ ((1 + 0.3) * squares - 0.3 * trace**2) / (2 * 10e6)


@pytest.mark.parametrize("modulus", [np.inf, 2.2e7])
@pytest.mark.parametrize("quasi_static", [True, False])
def test_the_energy_of_a_step_is_an_identity(modulus, quasi_static):
    """What a step does not explain is what backward Euler dissipates: the energies of the changes of stress, pressure and
    velocity. Steps are longer than h^2 / 4 c_v, so that the pressure projection has no part in it; all cells are full.
    """
    model, period = loaded(10, modulus=modulus)
    p, before = model.particles, 0.0
    keeps = {"quasi_static": True, "small_displacements": True} if quasi_static else {}
    for k in range(5):
        stress, pressure, velocity = p.stress, p.pore_pressure, p.velocity
        volume, pores = p.volume, p.volume * p.porosity
        report = model.implicit((k + 1) * 0.05 * period, dt=0.05 * period, **keeps).last()
        lost = elastic_energy(p.stress - stress, volume) + 0.5 * (p.mass @ (p.velocity - velocity) ** 2).sum()
        lost += 0.5 * pores @ (p.pore_pressure - pressure) ** 2 / modulus
        error = 1e-9 if quasi_static else 2e-3  # of the strains, by which volumes and places change
        assert report.unexplained_energy - before == pytest.approx(lost, abs=error * report.energy_scale)
        assert report.unexplained_energy - before > 1e-5 * report.energy_scale
        before = report.unexplained_energy


def test_half_of_the_work_of_a_load_is_stored_and_half_taken_out_by_the_flow():
    """Terzaghi: q S = q^2 H / M, of which the skeleton stores half, whatever the conductivity. The rest of the other half is
    the discretisation's, to first order in the size of cells and in the growth of steps."""
    missing = []
    for cells, growth in ((12, 1.2), (40, 1.05)):
        model, period = loaded(cells)
        dt = 1e-6 * period
        while model.time < 20 * period:
            to = min(20 * period, model.time + dt)
            report = model.implicit(to, dt=dt, quasi_static=True, small_displacements=True).last()
            dt *= growth
        whole = 0.2 * LOAD**2 / OEDOMETER
        assert report.external_work == pytest.approx(whole, rel=2e-3)
        assert report.stored_energy == pytest.approx(0.5 * whole, rel=2e-3)
        assert report.plastic_work == pytest.approx(0.0, abs=1e-9 * whole)
        missing.append(0.5 - report.drag_work / whole)
        assert report.unexplained_fraction == pytest.approx(missing[-1], abs=3e-3)
    assert 0 < missing[1] < missing[0] / 3 < 0.03


@pytest.mark.parametrize("scheme", ["quasi-static", "implicit", "explicit"])
def test_the_loss_of_head_is_what_the_flow_takes_out(scheme):
    """Steady flow upwards: gamma_w Q times the difference of heads comes in by pressures, and goes by drag."""
    model = column(10, conductivity=1e-3, modulus=2.2e7 if scheme == "explicit" else np.inf)
    model.set_gravity((0.0, -9.81))
    model.hold_pore_pressure(BASE, 1.5 * WEIGHT, presses=False)
    model.hold_pore_pressure(TOP, 0.0)
    model.set_pore_pressure(lambda x: 1.5 * WEIGHT * (1 - x[:, 1]))
    effective = -(990.0 * 9.81 - 0.5 * WEIGHT) * (1 - model.particles.position[:, 1])
    model.particles.set("stress", effective[:, None] * np.array([3 / 7, 1.0, 3 / 7, 0.0]))

    def go(until):
        if scheme == "explicit":
            return model.explicit(until, nmd=True).last()
        return model.implicit(until, dt=0.1, quasi_static=scheme == "quasi-static").last()

    start, end = go(0.2), go(1.2)
    power = WEIGHT * 0.5 * (1e-3 * 0.5 * 0.2)
    assert end.drag_work - start.drag_work == pytest.approx(power, rel=5e-3)
    assert end.external_work - start.external_work == pytest.approx(power, rel=5e-3)
    assert abs(end.unexplained_energy - start.unexplained_energy) < 1e-3 * power
    assert abs(end.unexplained_fraction) < 1e-3


def test_a_column_that_swings_and_drains_accounts_for_its_energy_in_explicit_steps():
    """A load comes on at once: waves and flow, and drag takes half of its work in the end."""
    model, period = loaded(10, 5e-3, 2.2e7)
    for report in model.explicit(3 * period, every=0.2 * period, nmd=True):
        assert abs(report.unexplained_fraction) < 5e-3
    assert report.external_work == pytest.approx(0.2 * LOAD**2 / OEDOMETER, rel=0.02)
    assert report.drag_work == pytest.approx(0.5 * report.external_work, rel=0.02)


def test_advice_on_dissipated_energy_is_one_that_runs_with_water_can_follow():
    """They refuse steps of second order."""
    model = column(10, conductivity=1e-12, modulus=2.2e8)
    height = model.particles.position[:, 1]
    model.particles.set("velocity", np.column_stack([np.zeros_like(height), 1e-3 * np.sin(np.pi * height / 2)]))
    with pytest.warns(mpm.EnergyWarning, match="too early: shorter steps dissipate less"):
        list(model.implicit(5e-3, dt=1e-4))


def sliding_block(suction_limit, conductivity=1e-2):
    """Saturated sand, 1.5 m long and 0.5 m high, with the pressures of level ground, on a rough plane that follows the mesh."""
    sand = mpm.MohrCoulomb(young=5e6, poisson=0.3, cohesion=5e3, friction_angle=35.0, dilation_angle=0.0)
    model = mpm.Model(box((20, 9), (2.0, 0.9), diagonals="alternating"), sand)
    squares = np.indices((60, 20)).reshape(2, -1).T
    model.seed_points(0.025 * (squares + 0.5) + (0.2, 0.2), np.full(len(squares), 0.025**2), density=1990.0)
    model.add_contact(mpm.Plane((0.0, 0.2 - 1e-9), (0, 1)), friction=0.466)
    model.add_water(porosity=POROSITY, conductivity=conductivity, modulus=2.2e7, suction_limit=suction_limit)
    model.set_gravity((4.15, -8.89))
    depth = 0.7 - model.particles.position[:, 1]
    model.set_pore_pressure(lambda x: 8.89e3 * (0.7 - x[:, 1]))
    model.particles.set("stress", -8.8e3 * depth[:, None] * np.array([0.5, 1.0, 0.5, 0.0]))
    return model


def test_energy_that_suction_generates_at_the_surface_of_sand_that_conducts_well_is_said_to_be_so():
    """A block that slides. Where its pores bear no suction, its energy balance closes to a hundredth."""
    at_fault, others = {"suction_limit": 5e3}, [{"suction_limit": 0.0}, {"suction_limit": 5e3, "conductivity": 1e-5}]
    for water in others:
        assert abs(sliding_block(**water).explicit(0.1, nmd=True).last().unexplained_fraction) < 0.01
    with pytest.raises(
        mpm.RunError, match="generated .*its suction_limit of 5000 Pa draws in .*: take suction_limit=0 there"
    ):
        sliding_block(**at_fault).explicit(0.3, nmd=True).last()
