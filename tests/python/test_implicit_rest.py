"""When a run is quasi-static, and equilibrium under prescribed displacement."""

import numpy as np
import pytest
from core_cases import box

import mpm_core as mpm


def test_reactions_take_the_place_of_external_force_under_prescribed_displacement():
    """A block between two plates is pressed together by 1 %: stress as of uniaxial strain, and no external force."""
    law = mpm.LinearElastic(young=1e6, poisson=0.2)
    model = mpm.Model(box([4, 4]), law)
    model.seed(density=1000.0, per_cell=3)
    for tag in (1, 2):
        model.roller(tag, (1, 0))
    model.roller(3, (0, 1))
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
