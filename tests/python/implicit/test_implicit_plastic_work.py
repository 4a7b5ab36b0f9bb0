"""Plastic work of quasi-static steps, whose other energies have no balance."""

import numpy as np
import pytest
from core_cases import box, rollers

import mpm_core as mpm

YOUNG, POISSON = 1e6, 0.3
SHEAR = YOUNG / (2 * (1 + POISSON))
FIRST_YIELD, STRAIN = 0.004, 0.01
LAW = mpm.von_mises(young=YOUNG, poisson=POISSON, yield_stress=2 * SHEAR * FIRST_YIELD)


def pressed(dim):
    """A block of volume 1 between smooth walls, whose top goes down by 0.01 in a second."""
    model = mpm.Model(box((2,) * dim), LAW)
    model.seed(density=2000.0, per_cell=dim + 1)
    rollers(model, range(dim - 1))
    model.fix(2 * dim - 1)
    model.prescribe(2 * dim, (*[None] * (dim - 1), -STRAIN))
    return model


@pytest.mark.parametrize("dim", [2, 3])
def test_plastic_work_of_quasi_static_steps_is_that_of_confined_compression(dim):
    """q = 2 G eps up to the yield stress, and q d(eps) 2 / 3 is the work of the deviator on its strain."""
    model = pressed(dim)
    for report in model.implicit(1.0, dt=0.1, quasi_static=True, small_displacements=True):
        plastic = 2 / 3 * 2 * SHEAR * FIRST_YIELD * max(0.0, report.time * STRAIN - FIRST_YIELD)
        assert report.plastic_work == pytest.approx(plastic, abs=1e-9 * report.stress_work)
        assert report.unexplained_energy == 0
    assert report.stress_work == pytest.approx(report.stored_energy + plastic, rel=1e-9)


def test_plastic_work_begins_anew_with_other_stresses():
    model = pressed(2)
    model.implicit(1.0, dt=0.1, quasi_static=True, small_displacements=True).last()
    model.particles.set("stress", np.zeros_like(model.particles.stress))
    model.prescribe(4, (None, STRAIN))
    report = model.implicit(1.2, dt=0.1, quasi_static=True, small_displacements=True).last()
    assert report.plastic_work == pytest.approx(0.0, abs=1e-9 * report.stress_work)
