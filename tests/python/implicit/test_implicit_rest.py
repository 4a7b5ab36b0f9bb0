"""When a run is quasi-static, and equilibrium under prescribed displacement."""

import numpy as np
import pytest
from core_cases import box, rollers
from implicit_cases import crest_displacement, slope

import mpm_core as mpm
from mpm_core import RunError


def test_reactions_take_the_place_of_external_force_under_prescribed_displacement():
    """A block between two plates is pressed together by 1 %: stress as of uniaxial strain, and no external force."""
    law = mpm.LinearElastic(young=1e6, poisson=0.2)
    model = mpm.Model(box([4, 4]), law)
    model.seed(density=1000.0, per_cell=3)
    rollers(model, but=(4,))
    model.prescribe(4, (0, -0.01))
    *_, report = model.implicit(1.0, dt=1.0, quasi_static=True)
    expected = -0.01 * law.p_wave_modulus
    assert model.particles.stress[:, 1] == pytest.approx(np.full(len(model.particles), expected), rel=1e-9)
    assert 0 < report.unbalanced_ratio < 0.1  # the particles have moved in their cells


def test_a_body_is_quasi_static_after_it_has_been_brought_to_equilibrium():
    model = mpm.Model(box([4, 4]), mpm.LinearElastic(young=1e6, poisson=0.2))
    model.seed(density=1000.0, per_cell=10)
    model.fix(3)
    model.set_gravity((0, -10.0))
    *_, moving = model.implicit(0.02, dt=0.01)
    assert not moving.is_quasi_static(1e-3)
    assert model.equilibrate(tolerance=1e-4).is_quasi_static(1e-3)


def test_displacements_of_an_equilibration_are_those_by_which_particles_have_moved():
    """Also where steps that only redistribute stresses follow the one that moves particles."""
    model = slope(0.1, weight=20e3)
    start = model.particles.position[np.argsort(model.particles.id)]
    model.equilibrate(nmd=True, tolerance=1e-6)
    p, order = model.particles, np.argsort(model.particles.id)
    assert model.steps > 2
    np.testing.assert_allclose(p.displacement[order], p.position[order] - start, rtol=0, atol=1e-14)


@pytest.mark.parametrize("nmd", [False, True])
def test_equilibrate_from_zero_in_one_call(nmd):
    """Little soil is left elastic at 87 % of the collapse load."""
    model = slope(0.1, weight=20e3)
    report = model.equilibrate(nmd=nmd, tolerance=1e-6)
    assert report.unbalanced_ratio < 1e-6
    assert report.plastic_fraction > 0
    assert 0.03 < crest_displacement(model) < 0.1


def test_equilibrate_applies_the_loads_in_parts_and_says_how_far_it_came():
    """A slope at 3.5 times its collapse load finds no equilibrium, but carries a part of it."""
    model = slope(0.2)
    with pytest.raises(RunError, match=r"no equilibrium at t = 0 s with more than 0\.\d+ of the loads") as error:
        model.equilibrate(max_steps=100, integration=mpm.Integration.PARTICLES)
    part = float(str(error.value).split("more than ")[1].split()[0])
    assert 20e3 < part * 80e3 < 45e3


def test_an_equilibration_ends_where_the_rest_of_the_loads_is_below_the_tolerance():
    """The slope carries a quarter to a half of its weight (above), so three quarters out of balance at most can be reached."""
    model = slope(0.2)
    report = model.equilibrate(tolerance=0.8, max_steps=100, integration=mpm.Integration.PARTICLES)
    assert 0.4 < report.unbalanced_ratio <= 0.8
    assert report.unbalanced_ratio == pytest.approx(
        model.out_of_balance(integration=mpm.Integration.PARTICLES), rel=0.02
    )


def test_an_interrupted_equilibration_leaves_the_time_as_it_was(monkeypatch):
    """A step without duration ends at the present time, so that it begins before it."""

    def interrupt(*_):
        raise KeyboardInterrupt

    model = slope(0.2)
    monkeypatch.setattr("mpm_core.newton.NewtonSolver.solve", interrupt)
    with pytest.raises(KeyboardInterrupt):
        model.equilibrate()
    assert model.time == 0.0


@pytest.mark.parametrize("small_displacements", [False, True])
def test_a_plate_that_will_move_stands_still_in_equilibrate(small_displacements):
    """Between a base and a plate at rest the mean vertical strain of a block, and so its mean stress, is zero."""
    law = mpm.LinearElastic(young=1e6, poisson=0.2)
    model = mpm.Model(box([4, 4]), law)
    model.seed(density=1000.0, per_cell=3)
    rollers(model, but=(4,))
    model.prescribe(4, (None, -0.01))
    model.set_gravity((0, -10.0))
    model.equilibrate(small_displacements=small_displacements)
    weight = 1000.0 * 10.0
    assert abs(model.particles.stress[:, 1].mean()) < 0.01 * weight
    assert model.particles.stress[:, 1].max() == pytest.approx(weight * (1 / 2 - 1 / 8), rel=0.05)  # upper row of cells
    model.implicit(0.1, dt=0.1, quasi_static=True, small_displacements=True).last()
    assert model.particles.stress[:, 1].mean() == pytest.approx(-0.1 * 0.01 * law.p_wave_modulus, rel=0.1)
