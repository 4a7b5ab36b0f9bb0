"""Coupled finite elements with inertia: waves in saturated soil, energy, free fall, and the limit of slow motion."""

import numpy as np
import pytest
from consolidation_cases import BASE, ELEMENTS, LEFT, RIGHT, TOP
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water

SOIL = mpm.LinearElastic(young=10e6, poisson=0.3)
POROSITY, DENSITY = 0.4, 0.6 * 2650 + 0.4 * 1000
TRAPEZOIDAL = water.Newmark(beta=0.25, gamma=0.5)


def column(
    element, cells, dt=1.0, conductivity=1e-12, modulus=2.2e8, load=None, boundary=(), method=TRAPEZOIDAL, **options
):
    """A column 1 m high between rollers on a fixed base, weightless."""
    domain, _, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, (1.0 / cells, 1.0), (1, cells))
    return water.Consolidation(
        domain, SOIL, water.PorousSoil(conductivity, porosity=POROSITY, density=DENSITY), facet_tags,
        [bridge.roller(LEFT, (1, 0)), bridge.roller(RIGHT, (1, 0)), bridge.fixed(BASE)], list(boundary),
        load=load or bridge.Load(), element=element, water_modulus=modulus, inertia=method, **options,
    )  # fmt: skip


def first_period(model, speed, per_period=40):
    """The first mode, sin(pi y / 2H), set in motion: its period by the trapezoidal rule over the exact one, and the peaks."""
    exact = 4.0 / speed
    at_rest = model.evaluate_at(np.array([[0.005, 1.0]]))["displacement"][0, 1]
    model.motion.set_velocity(lambda x: 1e-3 * np.column_stack([np.zeros(len(x)), np.sin(np.pi * x[:, 1] / 2)]))
    tops = [0.0]
    while len(tops) < per_period + 4:
        assert model.advance(exact / per_period).converged
        tops.append(model.evaluate_at(np.array([[0.005, 1.0]]))["displacement"][0, 1] - at_rest)
    tops = np.array(tops)
    k = np.flatnonzero((tops[:-1] < 0) & (tops[1:] >= 0))[0]
    found = (k - tops[k] / (tops[k + 1] - tops[k])) / per_period
    half = np.pi / per_period  # the rule has tan(w' dt / 2) = w dt / 2
    return found * np.arctan(half) / half, tops


@pytest.mark.parametrize("modulus", [2.2e8, 2.2e9])
def test_undrained_soil_swings_with_the_speed_of_its_wave(modulus):
    """The first mode has the frequency pi c / 2H, c^2 = (E + K_w / n) / rho (Verruijt 2010)."""
    speed = np.sqrt((SOIL.p_wave_modulus + modulus / POROSITY) / DENSITY)
    period, tops = first_period(column(water.Element.TAYLOR_HOOD, 20, modulus=modulus), speed)
    assert period == pytest.approx(1.0, abs=2e-3)
    assert -tops.min() == pytest.approx(tops.max(), rel=0.01)  # nothing is lost
    assert tops.max() == pytest.approx(1e-3 * 2 / (np.pi * speed), rel=0.01)


def test_the_projection_slows_waves_down_to_the_second_order():
    """It lets cells store a little more water, as long as a wave is not long beside them."""
    speed = np.sqrt((SOIL.p_wave_modulus + 2.2e8 / POROSITY) / DENSITY)
    errors = [first_period(column(water.Element.STABILISED, n), speed, 4 * n)[0] - 1 for n in (10, 20)]
    assert 3.5 < errors[0] / errors[1] < 4.5 and abs(errors[1]) < 0.02


def swinging_particles(cells, per_period, modulus=2.2e8):
    """Speed of the first mode of undrained implicit particles over the exact one, without the error of backward Euler."""
    speed = np.sqrt((SOIL.p_wave_modulus + modulus / POROSITY) / DENSITY)
    mesh = bridge.box_mesh(MPI.COMM_WORLD, (2.0 / cells, 1.0), (2, cells))
    model = mpm.Model(bridge.background_mesh(*mesh), SOIL)
    model.seed(density=DENSITY, per_cell=3)
    model.roller(LEFT, (1, 0))
    model.roller(RIGHT, (1, 0))
    model.fix(BASE)
    model.add_water(porosity=POROSITY, conductivity=1e-12, modulus=modulus)
    height = model.particles.position[:, 1]
    model.particles.set("velocity", np.column_stack([0 * height, 1e-4 * np.sin(0.5 * np.pi * height)]))
    steps = model.implicit(3.2 / speed, dt=4.0 / speed / per_period, every_steps=1)
    times, momentum = np.array([(report.time, report.momentum[1]) for report in steps]).T
    k = np.flatnonzero(momentum[:-1] * momentum[1:] < 0)
    zeros = times[k] - momentum[k] * (times[k + 1] - times[k]) / (momentum[k + 1] - momentum[k])
    step = 2 * np.pi / per_period  # a step turns a mode by arctan(w dt)
    return 2.0 / (zeros[1] - zeros[0]) / speed * step / np.arctan(step)


@pytest.mark.filterwarnings("ignore:.*dissipated:mpm_core.EnergyWarning")
def test_undrained_particles_swing_with_the_speed_of_their_wave():
    """Their projection takes the mass for a stiffness: without that they are slower the shorter the step, by tens of per cent."""
    errors = [swinging_particles(20, n) - 1 for n in (200, 400)]
    assert -0.01 < errors[1] < 0 and errors[0] < 1.6 * errors[1]


def test_a_front_has_the_pressure_of_the_water_behind_it():
    """Behind the front of a load q that is put on at once p / q = (K_w / n) / (E + K_w / n), before it nothing; W4."""
    stiff = 2.2e8 / POROSITY
    speed = np.sqrt((SOIL.p_wave_modulus + stiff) / DENSITY)
    model = column(water.Element.STABILISED, 100, load=bridge.Load(pressure={TOP: 1e3}), method=water.Newmark())
    while model.time < 0.6 / speed:
        assert model.advance(0.6 / speed / 60).converged
    height = np.concatenate([[0.1, 0.2], np.linspace(0.55, 0.95, 41)])
    p = model.evaluate_at(np.column_stack([np.full(43, 0.005), height]))["pressure"][:, 0] / 1e3
    np.testing.assert_allclose(p[:2], 0.0, atol=0.02)
    assert p[2:].mean() == pytest.approx(stiff / (stiff + SOIL.p_wave_modulus), rel=0.02)


@ELEMENTS
def test_soil_that_drains_freely_swings_as_without_water(element):
    """With much conductivity and no accelerated drag p = 0 all over: the mode has E_oed and the density of the saturated soil."""
    speed = np.sqrt(SOIL.p_wave_modulus / DENSITY)
    model = column(element, 20, conductivity=1e6, boundary=[water.Head(tag, 0.0) for tag in (LEFT, RIGHT, TOP)])
    model.initialise(pore_pressure=lambda x: -9810.0 * x[:, 1])  # at rest, with a stress of the soil that balances it
    stress = np.zeros((len(model.points.coordinates()), 4))
    stress[:, :3] = -9810.0 * model.points.coordinates()[:, 1:2]
    model.initialise(stress, lambda x: -9810.0 * x[:, 1])
    model.load = bridge.Load(unit_weight=0.0)
    assert first_period(model, speed)[0] == pytest.approx(1.0, abs=5e-3)


def test_a_slow_load_is_that_of_quasi_static_steps():
    """Consolidation over many periods of the column."""
    models = [
        column(water.Element.TAYLOR_HOOD, 10, conductivity=1e-6, modulus=np.inf, boundary=[water.Head(TOP, 1.0)], method=method,
               load=lambda time: bridge.Load(unit_weight=9810.0, pressure={TOP: 1e3 * min(time, 100.0)}))
        for method in (water.Newmark(), None)
    ]  # fmt: skip
    for model in models:
        model.initialise(pore_pressure=lambda x: 9810.0 * (1.0 - x[:, 1]))
        for _ in range(20):
            assert model.advance(10.0).converged
    found, expected = (model.evaluate_at(np.array([[0.005, 1.0], [0.005, 0.1]])) for model in models)
    for name in ("displacement", "pressure", "stress"):
        np.testing.assert_allclose(found[name], expected[name], rtol=1e-5, atol=1e-5 * np.abs(expected[name]).max())
    np.testing.assert_allclose(models[0].reaction(BASE), models[1].reaction(BASE), rtol=1e-5, atol=1.0)


@ELEMENTS
def test_saturated_soil_in_free_fall_has_no_pressure_and_no_flow(element):
    domain, _, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, (1.0, 1.0), (4, 4))
    model = water.Consolidation(
        domain, SOIL, water.PorousSoil(1e-3, density=DENSITY), facet_tags, [bridge.roller(LEFT, (1, 0))], [],
        load=bridge.Load(unit_weight=9.81 * DENSITY), element=element, inertia=TRAPEZOIDAL,
    )  # fmt: skip
    model.motion.set_velocity((0.0, 2.0))
    model.motion.acceleration.x.array[1::2] = -9.81
    for _ in range(5):
        assert model.advance(0.1).converged
    there = model.evaluate_at(np.array([[0.5, 0.5]]))
    assert there["displacement"][0, 1] == pytest.approx(2.0 * 0.5 - 0.5 * 9.81 * 0.25, rel=1e-6)
    assert np.abs(model.pressure.x.array).max() < 1e-4 and np.abs(model.points.stress).max() < 1e-3


def test_mistakes_are_named():
    with pytest.raises(bridge.InputError, match=r"beta is 0.25, expected \(gamma \+ 1/2\)\^2 / 4 = 0.3025"):
        water.Newmark(beta=0.25, gamma=0.6)
    with pytest.raises(bridge.InputError, match="gamma is 0.4, expected 0.5 or more"):
        water.Newmark(gamma=0.4)
    with pytest.raises(bridge.InputError, match="density is -1.0 kg/m3"):
        water.PorousSoil(1e-6, density=-1.0)
    with pytest.raises(bridge.InputError, match="inertia is True, expected a Newmark"):
        column(water.Element.STABILISED, 2, method=True)
    domain, _, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, (1.0, 1.0), (2, 2))
    with pytest.raises(bridge.InputError, match="has no density, expected one for steps with inertia"):
        water.Consolidation(
            domain, SOIL, water.PorousSoil(1e-6), facet_tags, [bridge.fixed(BASE)], [], inertia=TRAPEZOIDAL
        )
    model = column(water.Element.STABILISED, 2)
    with pytest.raises(bridge.InputError, match=r"velocity has shape \(3,\)"):
        model.motion.set_velocity((1.0, 2.0, 3.0))
