"""The implicit scheme of second order in time: its order, what energy it leaves, and its steps by an error estimate."""

import warnings
from functools import cache

import numpy as np
import pytest
from core_cases import box
from implicit_cases import slope

import mpm_core as mpm

YOUNG, DENSITY, LENGTH = 1e6, 1000.0, 1.0
OMEGA = np.pi / 2 / LENGTH * np.sqrt(YOUNG / DENSITY)  # of the bar's slowest oscillation, fixed at its foot
PERIOD = 2 * np.pi / OMEGA


def bar(amplitude=1e-6):
    """An upright elastic bar (Poisson's ratio 0, so that it swings in one dimension), with the velocity of its first mode."""
    model = mpm.Model(box([1, 16], lengths=(1 / 16, LENGTH)), mpm.LinearElastic(young=YOUNG, poisson=0.0))
    model.seed(density=DENSITY, per_cell=6)
    model.fix(3)
    y = model.particles.position[:, 1]
    velocity = amplitude * OMEGA * np.sin(np.pi / 2 * y / LENGTH)
    model.particles.set("velocity", np.column_stack([0 * y, velocity]))
    return model


def top(model):
    """Displacement of the uppermost particle."""
    p = model.particles
    return p.displacement[np.argmax(p.initial_position[:, 1]), 1]


def displacement_after(time, steps, **options):
    model = bar()
    model.implicit(time, dt=time / steps, every=time, **options).last()
    return top(model)


@cache
def limit_of_short_steps(time):
    return displacement_after(time, 512, second_order=True)


def test_order_in_time_of_a_vibrating_bar():
    # The limit is that of the bar in space, so it is taken from very short steps; it meets the closed form,
    # amplitude x sin(omega t), to the error of 16 cells.
    exact = limit_of_short_steps(PERIOD)
    assert exact == pytest.approx(0.0, abs=0.02e-6)
    errors = [abs(displacement_after(PERIOD, n, second_order=True) - exact) for n in (16, 32, 64)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2, abs=0.1)
    assert np.log2(errors[1] / errors[2]) == pytest.approx(2, abs=0.1)


def test_energy_that_a_step_leaves_is_that_of_the_method():
    # |R(i w dt)|^2 = (1 + 2 z) / (1 + z)^2, z = (g w dt)^2; backward Euler 1 / (1 + (w dt)^2).
    steps, dt = 40, PERIOD / 20
    z = ((1 - np.sqrt(0.5)) * OMEGA * dt) ** 2
    left = {}
    for second_order in (True, False):
        model = bar()
        start = model.report().kinetic_energy
        report = model.implicit(steps * dt, dt=dt, every=steps * dt, second_order=second_order).last()
        left[second_order] = (report.kinetic_energy + report.stored_energy) / start
        assert report.unexplained_energy == pytest.approx(start * (1 - left[second_order]), rel=0.02, abs=1e-3 * start)
    assert left[True] == pytest.approx(((1 + 2 * z) / (1 + z) ** 2) ** steps, abs=0.01)
    assert left[False] == pytest.approx((1 / (1 + (OMEGA * dt) ** 2)) ** steps, rel=0.2)
    assert left[True] > 0.95 and left[False] < 0.05


def test_only_the_waves_of_a_sudden_load_lose_energy_in_a_slide():
    # The elastic waves of gravity at once are shorter than the steps, which damp them. Gravity that rises over a second
    # causes none; the soil slides and yields as well.
    lost, plastic = {}, {}
    for ramp, time in ((0.0, 0.2), (1.0, 1.2)):
        model = slope(weight=60e3, per_cell=3)
        model.set_gravity((0, -9.81), ramp=ramp)
        report = model.implicit(time, dt=0.05, second_order=True, integration=mpm.Integration.MIXED).last()
        lost[ramp] = report.unexplained_fraction
        plastic[ramp] = report.plastic_work / report.external_work
    assert plastic[1.0] > 0.2
    assert lost[0.0] > 0.03 and abs(lost[1.0]) < 0.01


def test_an_undamped_run_by_backward_euler_is_told_of_second_order():
    for second_order in (False, True):
        model = slope(weight=60e3, per_cell=3)
        model.set_gravity((0, -9.81), ramp=1.0)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            model.implicit(
                1.2, dt=0.1, every=0.3, second_order=second_order, nmd=True, integration=mpm.Integration.MIXED
            ).last()
        warned = [str(each.message) for each in caught if issubclass(each.category, mpm.EnergyWarning)]
        assert len(warned) == (0 if second_order else 1)
        assert all("second_order=True" in text for text in warned)


def test_the_accuracy_wanted_is_reached_by_shorter_steps():
    time = PERIOD
    exact = limit_of_short_steps(time)
    errors, steps = [], []
    for accuracy in (4e-8, 4e-9):
        model = bar()
        model.implicit(time, dt=0.1 * time, every=time, second_order=True, accuracy=accuracy).last()
        errors.append(abs(top(model) - exact))
        steps.append(model.steps)
    assert errors[0] > errors[1] and steps[0] < steps[1]
    # The estimate is that of first order: an error ten times smaller takes steps shorter by the root of ten.
    assert steps[1] / steps[0] == pytest.approx(np.sqrt(10), rel=0.35)
    assert errors[1] < 10 * 4e-9


def test_what_does_not_go_together_is_refused():
    model = bar()
    with pytest.raises(mpm.InputError, match="second_order is True"):
        model.implicit(1.0, dt=0.1, quasi_static=True, second_order=True)
    with pytest.raises(mpm.InputError, match="second_order is True with damping 0.75, expected damping 0"):
        model.implicit(1.0, dt=0.1, damping=0.75, second_order=True)
    with pytest.raises(mpm.InputError, match="accuracy is 0.1 m"):
        model.implicit(1.0, dt=0.1, accuracy=0.1)


@pytest.mark.parametrize("solver", [mpm.Newton(), mpm.Relaxation()], ids=["Newton", "relaxation"])
def test_a_prescribed_velocity_is_met_at_the_end_of_a_step(solver):
    model = bar(amplitude=0.0)
    model.prescribe(4, (0.0, -1e-3))
    model.implicit(0.02, dt=0.005, second_order=True, solver=solver).last()
    nodes = model.mesh.points[:, 1] == LENGTH
    assert model.nodal("velocity")[nodes, 1] == pytest.approx(-1e-3, rel=1e-9)
    near = model.particles.initial_position[:, 1] > 0.99
    assert model.particles.displacement[near, 1] == pytest.approx(-2e-5, rel=0.05)
