"""All solvers reach the same root, and Newton's method does so quadratically."""

import numpy as np
import pytest
from implicit_cases import slope

import mpm_core as mpm
from mpm_core import _core
from mpm_core.implicit import Stepper

KINDS = [
    mpm.RelaxationKind.RICHARDSON,
    mpm.RelaxationKind.LOCAL,
    mpm.RelaxationKind.KINETIC,
    mpm.RelaxationKind.VISCOUS,
]


DT = 0.1
"""[s], some 6 critical steps"""


def solved_step(solver, *, nmd=False, quasi_static=False):
    """Nodal velocities of a step in which soil yields, and how it was solved: a sliding slope, or one below collapse that is
    brought to equilibrium at once."""
    model = slope(0.2, weight=20e3 if quasi_static else 80e3)
    if not quasi_static:
        list(model.implicit(2 * DT, dt=DT, damping=0.75))
    options = _core.ImplicitOptions()
    options.damping, options.nmd, options.quasi_static = 0.75, nmd, quasi_static
    stepper = Stepper(model, solver, options, DT)
    assert stepper.attempt(DT) == ""
    assert model.report().plastic_fraction > (0.01 if quasi_static else 0.1)
    return model.nodal("velocity"), stepper.last


@pytest.mark.parametrize("nmd", [False, True])
@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_every_relaxation_reaches_the_root_of_newtons_method(kind, nmd):
    expected, _ = solved_step(mpm.Newton(tolerance=1e-12), nmd=nmd)
    found, _ = solved_step(mpm.Relaxation(kind, tolerance=1e-11), nmd=nmd)
    assert np.abs(found - expected).max() < 1e-8 * np.abs(expected).max()


@pytest.mark.parametrize("quasi_static", [False, True])
@pytest.mark.parametrize("nmd", [False, True])
def test_newtons_method_converges_quadratically(nmd, quasi_static):
    _, solution = solved_step(mpm.Newton(tolerance=1e-13), nmd=nmd, quasi_static=quasi_static)
    r = np.array([x for x in solution.residuals if x > 1e-12])
    # The order of convergence over the last three residuals above round-off.
    assert np.log(r[-1] / r[-2]) / np.log(r[-2] / r[-3]) > 1.7, solution.residuals
