"""The linear systems: multigrid whose work does not grow with the mesh, and cells that are cut by the body's boundary."""

import numpy as np
import pytest
from core_cases import box
from implicit_cases import LEFT, SLOPE_SOIL, floor, slope, tangent

import mpm_core as mpm
from mpm_core import _core, linear
from mpm_core.implicit import Stepper


def krylov_iterations(h, law, nmd):
    """Of each Newton iteration in a quasi-static step of the slope under 20 kN/m3."""
    return quasi_static_step(slope(h, weight=20e3, per_cell=3, law=law), nmd)


def quasi_static_step(model, nmd):
    """Krylov iterations of each Newton iteration."""
    options = _core.ImplicitOptions()
    options.quasi_static, options.nmd = True, nmd
    stepper = Stepper(model, mpm.Newton(), options, 1.0)
    assert stepper.attempt(1.0) == ""
    return stepper.last.linear_iterations


@pytest.mark.parametrize("nmd", [False, True])
def test_krylov_iterations_grow_by_less_than_half_from_h_to_a_quarter(nmd, monkeypatch):
    monkeypatch.setattr(linear, "DIRECT_LIMIT", {2: 0, 3: 0})
    law = mpm.LinearElastic(young=SLOPE_SOIL.young, poisson=SLOPE_SOIL.poisson)
    coarse, fine = (max(krylov_iterations(h, law, nmd)) for h in (0.1, 0.025))
    assert 1 < coarse < 25
    assert fine < 1.5 * coarse


def test_krylov_iterations_grow_by_less_than_half_in_three_dimensions(monkeypatch):
    monkeypatch.setattr(linear, "DIRECT_LIMIT", {2: 0, 3: 0})

    def iterations(n):
        model = mpm.Model(box([n] * 3), mpm.LinearElastic(young=1e6, poisson=0.3))
        model.seed(density=2000.0, per_cell=1)
        model.fix(floor(3))
        model.roller(LEFT, (1, 0, 0))
        model.set_gravity((0, 0, -9.81))
        return max(quasi_static_step(model, False))

    assert iterations(16) < 1.5 * iterations(4)


def test_multigrid_solves_the_tangent_of_yielding_soil(monkeypatch):
    monkeypatch.setattr(linear, "DIRECT_LIMIT", {2: 0, 3: 0})
    assert max(krylov_iterations(0.05, SLOPE_SOIL, False)) < 40


def condition(shift, ghost):
    """Condition number of the tangent of a block that has moved across the cells by a fraction of one; what sticks out into cells
    that are less than half full has failed in tension, and has no stiffness of its own."""
    n, per_side, h = 8, 6, 1 / 8
    soil = mpm.MohrCoulomb(young=1e6, poisson=0.3, cohesion=1.0, friction_angle=30.0)
    model = mpm.Model(box([n, n]), soil)
    axis = (np.arange(3 * per_side) + 0.5) / per_side * h
    points = (
        np.stack(np.meshgrid(axis, axis, indexing="ij"), -1).reshape(-1, 2) + (2 + np.array([shift, 0.37 * shift])) * h
    )
    model.seed_points(points, np.full(len(points), (h / per_side) ** 2), density=2000.0)
    cell = model.particles.cell
    filled = np.bincount(cell, model.particles.volume, minlength=len(model.mesh.cells)) / model.mesh.cell_volumes
    model.particles.set("stress", np.where((filled[cell] < 0.5)[:, None], [5.0, 5.0, 5.0, 0.0], 0.0))
    options = _core.ImplicitOptions()
    options.ghost = ghost.options()
    step = _core.ImplicitStep2(model._core)
    step.start(options, 50 * model.critical_time_step())
    step.trial(tangents=True)
    step.assemble()
    return np.linalg.cond(tangent(step, 2).toarray())


def test_ghost_penalty_keeps_the_condition_number_while_a_body_moves_across_cells():
    shifts = (0.1, 0.15, 0.2, 0.4, 0.8, 0.95)
    whole = condition(0.0, mpm.GhostPenalty())
    assert max(condition(shift, mpm.GhostPenalty()) for shift in shifts) < 3 * whole
    assert max(condition(shift, mpm.GhostPenalty(filled=0.0)) for shift in shifts) > 100 * whole
