"""The length of time steps by the error of backward Euler: clay that creeps under a constant pressure, by closed forms."""

import numpy as np
import pytest
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water

DAY, PRESSURE, MU, VOLUME, DAYS = 86400.0, 100e3, 0.01, 2.0, 10000.0


def creeping_cylinder():
    """A cylinder of height 1 m and radius 1 m under its preconsolidation pressure all around, which drains at once."""
    domain, _, facet_tags = bridge.box_mesh(MPI.COMM_SELF, (1.0, 1.0), (1, 1))
    clay = mpm.CamClay(
        compression=0.2, swelling=0.04, critical_slope=1.0, poisson=0.2, void_ratio=VOLUME - 1, preconsolidation=PRESSURE, creep=MU
    )  # fmt: skip
    axis, side, base, top = 1, 2, 3, 4
    model = water.Consolidation(
        domain,
        clay,
        water.PorousSoil(1e-3, porosity=0.5),
        facet_tags,
        [bridge.roller(axis, (1, 0)), bridge.roller(base, (0, 1))],
        [water.Head(tag, 0.0) for tag in (side, top)],
        load=bridge.Load(pressure={side: PRESSURE, top: PRESSURE}),
        geometry=bridge.Geometry.AXISYMMETRIC,
        unit_weight=1e-3,
    )
    model.initialise(np.tile([-PRESSURE] * 3 + [0.0], (model.points.n, 1)))
    return model


def settled(growth, accuracy):
    """Settlement after DAYS by creep, and the number of steps; the time at which a column of the same clay has settled as much, over DAYS."""
    model = creeping_cylinder()
    reports = model.run(DAYS * DAY, 0.1 * DAY, growth, accuracy=accuracy)
    assert reports[-1].converged
    lost = VOLUME * (1 - np.exp(3 * model.displacement.x.array.min()))
    return lost / (MU * np.log(1 + DAYS)), (np.exp(lost / MU) - 1) / DAYS, reports


@pytest.mark.parametrize("growth", [1.15, 1.5])
def test_backward_euler_lags_behind_creep_by_half_of_a_step(growth):
    """exp(x) = c t with x' = exp(-x): steps from t / g to t have c = (g - 1) / (g ln g), about 1 - ln(g) / 2."""
    _, lag, reports = settled(growth, None)
    last, before = reports[-2].dt, reports[-3].dt  # the last one is cut to end in time
    assert last / before == pytest.approx(growth, rel=1e-6)
    assert lag == pytest.approx((growth - 1) / (growth * np.log(growth)), abs=0.15 * (growth - 1))


@pytest.mark.parametrize("accuracy", [0.01, 0.003])
def test_steps_are_as_long_as_the_accuracy_lets_them(accuracy):
    exact, _, reports = settled(3.0, accuracy)
    assert abs(1 - exact) < 1.2 * accuracy
    assert abs(1 - exact) > 0.3 * accuracy  # no shorter than they need to be
    assert abs(1 - settled(3.0, None)[0]) > 0.04
    # ln(g) / 2 / ln(t) is the accuracy where steps are g times as long as the ones before
    assert reports[-3].dt / reports[-4].dt == pytest.approx(1 + 2 * accuracy * np.log(DAYS), rel=0.05)


def test_a_run_that_goes_on_keeps_the_pace():
    """Cut in two at a time, the run has steps of the same lengths, but for those that end there."""
    whole, model = creeping_cylinder(), creeping_cylinder()
    steps = whole.run(1000 * DAY, 0.1 * DAY, 1.3, accuracy=0.01)
    first = model.run(100 * DAY, 0.1 * DAY, 1.3, accuracy=0.01)
    second = model.run(1000 * DAY, max(report.dt for report in first), 1.3, accuracy=0.01)
    assert len(steps) <= len(first) + len(second) <= len(steps) + 4
    ends = [one.displacement.x.array.min() for one in (whole, model)]
    assert ends[1] == pytest.approx(ends[0], rel=2e-3)


@pytest.mark.parametrize("accuracy", [0.0, -0.01, np.inf, np.nan])
def test_an_accuracy_out_of_range_is_named(accuracy):
    with pytest.raises(mpm.InputError, match=f"accuracy is {accuracy}, expected a positive number, or None"):
        creeping_cylinder().run(DAY, 0.1 * DAY, accuracy=accuracy)
