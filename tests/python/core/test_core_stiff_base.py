"""Absorbing and driven bases that are far stiffer than the soil, over many periods: dashpots only take energy out."""

import numpy as np
import pytest
from core_cases import box, run
from mpm_core.ground_column import Base, GroundColumn, Layers

import mpm_core as mpm

CELLS, HEIGHT, DENSITY = 20, 10.0, 1900.0
LAW = mpm.LinearElastic(young=100e6, poisson=0.3)
SPEED = np.sqrt(LAW.p_wave_modulus / DENSITY)
PERIOD = 4 * HEIGHT / SPEED
AMPLITUDE = 0.1


def vibrating(resting=False):
    """A column on the facets of tag 3 with the velocities of its first mode of compression, and nothing that holds it yet."""
    model = mpm.Model(box((1, CELLS), (HEIGHT / CELLS, HEIGHT)), LAW)
    model.seed(density=DENSITY, per_cell=3)
    for side in (1, 2):
        model.roller(side, (1, 0))
    velocity = np.zeros((len(model.particles), 2))
    velocity[:, 1] = AMPLITUDE * np.sin(np.pi * model.particles.position[:, 1] / (2 * HEIGHT))
    model.particles.set("velocity", velocity)
    if resting:
        model.rest()
    return model


def envelope(model, periods, **options):
    """Largest kinetic energy within each period [J]."""
    energy = [
        report.kinetic_energy
        for report in model.explicit(periods * PERIOD, every=PERIOD / 16, damping=0.0, conversion=None, **options)
    ]
    return np.array(energy).reshape(periods, 16).max(axis=1)


@pytest.mark.parametrize("resting", [False, True])
def test_a_driven_base_at_rest_is_a_fixed_one(resting):
    fixed, driven = vibrating(resting), vibrating(resting)
    fixed.fix(3)
    driven.drive(3, mpm.Motion([0.0, 100.0], [0.0, 0.0]), (0, 1))
    held, found = envelope(fixed, 20), envelope(driven, 20)
    assert found == pytest.approx(held, rel=1e-9)
    assert found[-1] == pytest.approx(found[0], rel=0.02)


@pytest.mark.parametrize(
    ("options", "lower", "upper"),
    [
        ({}, 0.96, 1.04),
        ({"nmd": True}, 0.96, 1.08),  # averages of strains are rough at the ends
        ({"stress_update": mpm.StressUpdate.LAST}, 0.65, 1.0),  # dissipates by itself
    ],
)
@pytest.mark.parametrize("resting", [False, True])
def test_vibrations_on_a_stiff_base_fade_as_waves_leave_through_it(resting, options, lower, upper):
    # Each of the two reflections at the base in a period multiplies the wave by (a - 1) / (a + 1), a = ratio of impedances
    ratio, periods = 50.0, 20
    model = vibrating(resting)
    model.absorb(3, impedances=(ratio * DENSITY * SPEED,) * 2)
    found = envelope(model, periods, **options)
    fading = ((ratio - 1) / (ratio + 1)) ** (4 * (periods - 1))
    assert lower * fading < found[-1] / found[0] < upper * fading
    assert fading < 0.05


@pytest.mark.parametrize("impedance", [5e6, 1e9, np.inf])
def test_free_fields_on_a_stiff_base_keep_the_amplitude_of_a_steady_motion(impedance):
    levels = np.linspace(0, HEIGHT, CELLS + 1)
    layers = Layers(
        heights=list(levels), law=[0] * CELLS, density=[DENSITY] * CELLS, stress=np.zeros((CELLS, 4)).tolist(), state=[[0.0]] * CELLS,
        cell_size=[1.0] * CELLS, coupled_mass=[1 / 6] * CELLS, normal=[1.0, 0.0], time=0.0, pores=[[0.5, 1e-9, 1e-9, 500.0, 0.0]] * CELLS,
    )  # fmt: skip
    time = np.linspace(0, 8, 3201)
    base = Base(
        (impedance,) * 2, 200.0, time, 0.1 * np.sin(4 * np.pi * time) * np.minimum(1, time), np.array([0.6, 0.8])
    )
    water = mpm._core.PoreWater()
    water.modulus = 2e8
    column = GroundColumn(layers, [LAW], base, mpm.Rayleigh(0.0, 0.0), water)
    largest = np.zeros(8)
    while column.time < 8:
        column._step()
        second = min(int(column.time), 7)
        largest[second] = max(largest[second], abs(column.velocity[:, 1]).max())
    assert largest[2:].max() < 1.2 * largest[2:].min()


@pytest.mark.parametrize("side", ["absorbs", "is driven"])
def test_stresses_first_are_refused_beside_dashpots(side):
    model = vibrating()
    if side == "absorbs":
        model.absorb(3)
    else:
        model.drive(3, mpm.Motion([0.0, 1.0], [0.0, 0.0]), (0, 1))
    with pytest.raises(mpm.InputError, match="stress_update is FIRST with absorbing or driven sides"):
        run(model, 0.01, stress_update=mpm.StressUpdate.FIRST)
