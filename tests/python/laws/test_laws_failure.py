"""A law that finds no solution at a point: the increment or the step is cut; if nothing helps, the error says all about it."""

import re
import sys

import numpy as np
import pytest
from bridge_cases import column
from core_cases import box, rollers, run
from law_cases import Batch, random_points

import fenics_bridge as bridge
import mpm_core as mpm

ELASTIC = mpm.LinearElastic(young=20e6, poisson=0.3)
WATER = {"water_modulus": 2e8, "porosity": 0.4}
STRAIN = 1e-3


class Fragile:
    """Linear elasticity that knows no answer to strain increments above a limit: it gives NaN there, or raises."""

    n_state, p_wave_modulus = 2, ELASTIC.p_wave_modulus

    def __init__(self, limit, raises=False):
        self.limit, self.raises = limit, raises

    def update(self, strain_increment, stress, state, tangent):
        too_big = np.abs(strain_increment).max(axis=1) > self.limit
        if self.raises and too_big.any():
            raise ArithmeticError("too big")
        ELASTIC.update(strain_increment, stress, np.zeros((len(stress), 1)), tangent)
        state[:, 1] += strain_increment.sum(axis=1)
        stress[too_big] = np.nan


def pressed(law, squares=1):
    """A unit square of soil on a floor whose top is pressed down by STRAIN in each step of 1e-4 s."""
    model = mpm.Model(box([squares] * 2), law)
    model.seed(density=2000.0, per_cell=3)
    rollers(model, [0])
    model.roller(3, (0, 1))
    model.prescribe(4, (0, -STRAIN / 1e-4))
    return model


@pytest.mark.parametrize("raises", [False, True])
def test_explicit_step_cuts_the_increment(raises, monkeypatch):
    # An elastic law gives the same in any number of parts; 0.3 of the increment asks for four
    printed = []
    monkeypatch.setattr(sys, "unraisablehook", lambda problem: printed.append(str(problem.exc_value)))
    models = [pressed(law) for law in (mpm.PythonLaw(Fragile(0.3 * STRAIN, raises)), ELASTIC)]
    for model in models:
        run(model, 1e-3, dt=1e-4, allow_unstable=True)
    stress = [m.particles.stress[np.argsort(m.particles.id)] for m in models]
    assert np.abs(stress[1][:, 1]).min() > 9 * STRAIN * ELASTIC.young
    assert np.abs(stress[0] - stress[1]).max() < 1e-12 * np.abs(stress[1]).max()
    total = np.log(models[0].particles.volume / 1.0 * 6)  # of six particles; increments refer to the present height
    assert models[0].state("state_1") == pytest.approx(total, rel=2 * STRAIN)
    assert printed == (["too big"] if raises else [])


def test_explicit_run_ends_with_law_particle_place_and_increment():
    model = pressed(mpm.PythonLaw(Fragile(1e-3 * STRAIN)))
    with pytest.raises(mpm.RunError) as error:
        run(model, 1e-3, dt=1e-4, allow_unstable=True)
    pattern = (
        r"particle (\d+) at \((.*), (.*)\) m .* follows the law PythonLaw of Fragile \(number 0\), which failed for the "
        r"strain increment \((.*), (.*), 0, (.*)\), also when it was cut into 64 parts \(in the step after t = 0 s\)"
    )
    number, x, y, _, vertical, _ = re.fullmatch(pattern, str(error.value)).groups()
    row = list(model.particles.id).index(int(number))
    assert (float(x), float(y)) == pytest.approx(tuple(model.particles.position[row]), rel=1e-5)
    assert float(vertical) == pytest.approx(-STRAIN, rel=1e-3)
    assert (model.particles.stress == 0).all() and (model.particles.state == 0).all()


def test_implicit_step_is_cut():
    # Four and more steps in place of each; the strains of the steps refer to the changing height
    models = [pressed(law, 2) for law in (mpm.PythonLaw(Fragile(3 * STRAIN)), ELASTIC)]
    reports = [list(m.implicit(2e-3, dt=1e-3, quasi_static=True)) for m in models]
    assert sum(r.cuts for r in reports[0]) >= 2 and sum(r.cuts for r in reports[1]) == 0
    assert models[0].time == models[1].time == 2e-3
    stress = [m.particles.stress[:, 1].mean() for m in models]
    assert stress[0] == pytest.approx(stress[1], rel=0.02)


def test_implicit_run_ends_with_law_particle_place_and_increment():
    model = pressed(mpm.PythonLaw(Fragile(1e-3 * STRAIN)), 2)
    before = model.particles.position
    with pytest.raises(mpm.RunError) as error:
        list(model.implicit(1e-4, dt=1e-4, quasi_static=True))
    pattern = (
        r"the implicit step at t = 0 s failed with all step lengths from 0.0001 s down to .* s: particle \d+ at \(.*\) m .* follows "
        r"the law PythonLaw of Fragile \(number 0\), which failed for the strain increment \(.*\) \(in the step after t = 0 s\)"
    )
    assert re.fullmatch(pattern, str(error.value)), error.value
    assert (model.particles.position == before).all() and (model.particles.stress == 0).all()


def test_finite_elements_halve_the_load_step_and_say_why():
    domain, facet_tags, supports, _ = column(2)
    found = {}
    for limit in (1e-1, 2e-4, 1e-9):
        fem = bridge.QuasiStatic(
            domain, mpm.PythonLaw(Fragile(limit)), facet_tags, supports, 1, solver=bridge.Solver(relaxation=False)
        )
        steps = fem.solve(bridge.Load(unit_weight=10e3), first_step=1.0)
        found[limit] = fem, steps
    (easy, easy_steps), (hard, hard_steps), (hopeless, hopeless_steps) = found.values()
    assert easy.converged and len(easy_steps) == 1
    assert hard.converged and not hard_steps[0].converged
    assert np.abs(hard.points.stress - easy.points.stress).max() < 1e-6 * np.abs(easy.points.stress).max()
    assert not hopeless.converged and (hopeless.points.stress == 0).all()
    pattern = r"the law PythonLaw of Fragile failed at \((.*), (.*)\) m for the strain increment \(([^)]*)\)"
    match = re.match(pattern, hopeless_steps[-1].report.reason)
    assert match and np.abs(np.array(match[3].split(", "), dtype=float)).max() > 1e-9


def test_relaxation_makes_smaller_increments_where_a_law_fails():
    domain, facet_tags, supports, _ = column(2)
    stress = {}
    for limit in (1e-1, 2e-4, 1e-9):
        fem = bridge.QuasiStatic(domain, mpm.PythonLaw(Fragile(limit)), facet_tags, supports, degree=1)
        report = fem.equilibrate(bridge.Load(unit_weight=10e3))
        stress[limit] = fem.points.stress
        assert report.converged == (limit > 1e-9)
        assert (report.relaxation is None) == (limit == 1e-1)
    assert np.abs(stress[2e-4] - stress[1e-1]).max() < 1e-6 * np.abs(stress[1e-1]).max()
    assert report.outcome == "undecided" and "the law PythonLaw of Fragile failed at" in report.reason


WRAPPED = {
    "Python": lambda law: law,
    "Hencky": mpm.Hencky,
    "undrained": lambda law: mpm.Undrained(law, **WATER),
    "undrained Hencky": lambda law: mpm.Undrained(mpm.Hencky(law), **WATER),
}


@pytest.mark.parametrize("wrapped", WRAPPED.values(), ids=WRAPPED.keys())
@pytest.mark.parametrize("raises", [False, True])
def test_failed_points_are_left_as_they_were_and_the_others_are_not_touched_by_them(wrapped, raises, monkeypatch):
    monkeypatch.setattr(sys, "unraisablehook", lambda problem: None)
    stress, strain = random_points(3, 300, pressure=50e3, deviator=10e3, strain=STRAIN)
    state = np.random.default_rng(3).uniform(0, 0.1, (300, 4))
    fragile = wrapped(mpm.PythonLaw(Fragile(2 * STRAIN, raises)))
    good = wrapped(mpm.PythonLaw(Fragile(1.0)))
    state = np.ascontiguousarray(state[:, : good.n_state])
    batches = [Batch(law, stress, strain, state) for law in (fragile, good)]
    failed = np.abs(strain).max(axis=1) > 2 * STRAIN
    assert 10 < failed.sum() < 290
    assert batches[0].report.failed == failed.sum() and batches[0].report.first_failed == np.argmax(failed)
    assert np.abs(batches[0].stress[failed] - stress[failed]).max() < 1e-9 * 50e3
    assert (batches[0].state[failed] == state[failed]).all()
    assert batches[0].stress[~failed] == pytest.approx(batches[1].stress[~failed], rel=1e-12, abs=1e-12 * 50e3)
    assert batches[0].state[~failed] == pytest.approx(batches[1].state[~failed], rel=1e-12, abs=1e-12)


def test_hencky_refuses_points_that_would_lose_their_volume():
    strain = np.full((3, 6), -1e-3)
    strain[1, :3] = -0.4
    batch = Batch(mpm.Hencky(ELASTIC), np.zeros((3, 6)), strain)
    assert (batch.report.failed, batch.report.first_failed) == (1, 1)
    assert (batch.stress[1] == 0).all() and (batch.state[1] == 0).all() and (batch.stress[[0, 2], 0] < 0).all()


def test_cam_clay_without_pressure_is_named():
    clay = mpm.CamClay(
        compression=0.2, swelling=0.04, critical_slope=1.0, poisson=0.25, void_ratio=1.0, preconsolidation=60e3
    )
    model = pressed(mpm.Undrained(clay, **WATER))
    with pytest.raises(mpm.RunError, match=r"follows the law Undrained of CamClay \(number 0\)"):
        run(model, 1e-4, dt=1e-4, allow_unstable=True)
