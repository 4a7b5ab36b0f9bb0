"""Explicit steps of soil and water with a velocity each between sides that absorb waves, free fields and driven bases."""

import numpy as np
import pytest
from core_cases import box

import mpm_core as mpm

POROSITY, GRAINS, WATER = 0.4, 2650.0, 1000.0
DENSITY = (1 - POROSITY) * GRAINS + POROSITY * WATER
SOFT, STIFF = (mpm.LinearElastic(young=young, poisson=0.3) for young in (10e6, 20e6))
SHEAR_SPEED = np.sqrt(10e6 / 2.6 / DENSITY)
LEFT, RIGHT, BASE, TOP = 1, 2, 3, 4
AMPLITUDE = 1e-4
WITHOUT_DAMPING = {"conversion": None, "energy_limit": None, "damping": 0.0}


def saturated(mesh, laws, modulus, *, of_total_stress=False, per_cell=10):
    """Soil of one law or in two layers whose water hardly flows, or of the law of undrained soil."""
    if of_total_stress:
        laws = [mpm.Undrained(law, water_modulus=modulus, porosity=POROSITY) for law in laws]
    model = mpm.Model(mesh, laws)
    for number in range(len(laws)):
        model.seed(density=DENSITY, per_cell=per_cell, cell_tag=number if len(laws) > 1 else None, material=number)
    if not of_total_stress:
        model.add_water(porosity=POROSITY, conductivity=1e-9, modulus=modulus)
    return model


def pulse(length):
    time = np.linspace(0.0, length, 201)
    return mpm.Motion(time, AMPLITUDE * np.sin(np.pi * time / length) ** 2)


@pytest.mark.parametrize("nmd", [False, True])
@pytest.mark.parametrize("along", [0, 1])
def test_water_that_does_not_flow_leaves_the_waves_of_undrained_soil(along, nmd):
    """Pulses of 40 cells through both ends of a bar, for compression with the modulus M + K / n. What comes back is what comes
    back in undrained soil, in shear less than a hundredth."""
    modulus = 2.2e8
    stiffness = SOFT.p_wave_modulus + modulus / POROSITY if along == 0 else 10e6 / 2.6
    across = 1 / np.sqrt(stiffness / DENSITY)
    velocities = []
    for of_total_stress in (False, True):
        model = saturated(box((80, 1), (1.0, 1 / 80)), [SOFT], modulus, of_total_stress=of_total_stress)
        for side in (LEFT, RIGHT, BASE, TOP):
            model.roller(side, np.eye(2)[1 - along])
        model.absorb((LEFT, RIGHT))
        model.shake(pulse(0.5 * across), np.eye(2)[along])
        middle = np.abs(model.mesh.points[:, 0] - 0.5).argmin()
        model.explicit(0.75 * across, nmd=nmd, **WITHOUT_DAMPING).last()
        both = model.nodal("velocity")[middle, along]
        assert both == pytest.approx(2 * AMPLITUDE, rel=0.02)  # both pulses, one upon the other
        model.explicit(1.8 * across, nmd=nmd, **WITHOUT_DAMPING).last()
        velocities.append(model.nodal("velocity")[:, along])
    assert np.abs(velocities[0] - velocities[1]).max() < 1e-3 * AMPLITUDE
    assert along == 0 or np.abs(velocities[0]).max() < 0.01 * AMPLITUDE


def velocities_at(model, until, places, nmd):
    nodes = [np.linalg.norm(model.mesh.points - place, axis=1).argmin() for place in places]
    reports = model.explicit(until, every=until / 40, nmd=nmd, **WITHOUT_DAMPING)
    return np.array([model.nodal("velocity")[nodes] for _ in reports])


@pytest.mark.parametrize("nmd", [False, True])
@pytest.mark.parametrize("rigid", [False, True])
def test_a_level_site_between_free_fields_moves_as_a_column(rigid, nmd):
    """A soft layer on a stiff one, in shear and compression at once: everywhere on the surface, to 1 % of the peak."""

    def let_in(model):
        if rigid:
            model.drive(BASE, pulse(2 / SHEAR_SPEED), (1.0, 0.5))
        else:
            model.absorb(BASE, thickness=50.0)
            model.shake(pulse(2 / SHEAR_SPEED), (1.0, 0.5))

    def ground(counts, size):
        mesh = box(counts, size, body=((-np.inf, 0.5), (np.inf, np.inf)))
        return saturated(mesh, [STIFF, SOFT], 2.2e7)

    until = 3 / SHEAR_SPEED
    columns = []
    for axis in (0, 1):
        model = ground((1, 24), (1 / 24, 1.0))
        for side in (LEFT, RIGHT, BASE, TOP):
            model.roller(side, np.eye(2)[1 - axis])
        let_in(model)
        columns.append(velocities_at(model, until, [(0.0, 1.0)], nmd)[:, :, axis])
    model = ground((12, 24), (0.5, 1.0))
    let_in(model)
    model.absorb((LEFT, RIGHT), free_field=True)
    motion = velocities_at(model, until, [(0.0, 1.0), (0.25, 1.0), (0.5, 1.0)], nmd)
    expected = np.stack(columns, axis=2)
    assert np.abs(expected).max() > 1.5 * AMPLITUDE
    assert np.abs(motion - expected).max() < 0.01 * np.abs(expected).max()


def test_sides_absorb_alike_before_and_after_the_water_has_a_velocity_of_its_own():
    """Soil at rest under its weight, whose supports are released: forces that hold it are those of soil and water together."""
    model = saturated(box((8, 8), (1.0, 1.0)), [SOFT], 2.2e7, per_cell=3)
    cells = np.asarray(model.mesh.points)[model.mesh.cells[model.particles.cell]].mean(axis=1)
    buoyant = -9.81 * (DENSITY - WATER) * (1 - cells[:, 1])
    model.particles.set("stress", np.column_stack([buoyant / 2, buoyant, buoyant / 2, 0 * buoyant]))
    model.set_pore_pressure(lambda x: 9810.0 * (1 - x[:, 1]))
    model.set_gravity((0.0, -9.81))
    states = []
    for _ in range(2):
        model.absorb((LEFT, RIGHT, BASE), thickness=20.0)
        states.append(model._absorbing_state()["nodes"])
        report = model.explicit(model.time + 1e-6, damping=0.0).last()
    assert report.kinetic_energy < 1e-12 * 9.81 * DENSITY
    for (place, before), (again, after) in zip(*states, strict=True):
        assert place == again
        for one, other in zip(before, after, strict=True):
            for value, same in zip(one[:3], other[:3], strict=True):  # dashpots, springs, and forces
                assert np.asarray(same) == pytest.approx(np.asarray(value), rel=1e-6, abs=1e-3)
