"""An arc-length method for finite elements, as a measure of what it carries: for the table of solvers in docs/factor_of_safety.md.

The load factor is an unknown of the step, whose length in displacement is given: the updated normal plane of Ramm (1981, in
Nonlinear Finite Element Analysis in Structural Mechanics, 63-89), with the consistent tangent. A step that does not converge is
repeated with half the length, one that converges fast is followed by a longer one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from dolfinx import fem

import fenics_bridge as bridge

TOLERANCE, ITERATIONS, FAST = 1e-8, 25, 7
"""Out-of-balance over external force, most iterations of a step, and those of a step that is followed by a longer one"""

SHORTEST, SYSTEMS = 1e-4, 2000
"""Length of a step, as a fraction of the first one, and linear systems, at which the method gives up"""


@dataclass
class _Path:
    """The body, the nodal forces of the whole load, and the factor that is carried."""

    body: Any
    laws: Any
    load: Any
    correction: Any
    factor: float = 0.0

    def residual(self, factor):
        """Out-of-balance forces at the increment, and their norm over that of the load; infinite where a law fails."""
        failure = self.body.points.update(self.laws, self.body.kinematics.strain_increment())
        forces = self.body.kinematics.internal_forces(self.body.points.trial_stress)
        forces.array[:] = factor * self.load - forces.array
        forces.array[self.body.constraints.dofs] = 0.0
        return forces, np.inf if failure else np.linalg.norm(forces.array) / np.linalg.norm(self.load)

    def solved(self, vector):
        """The displacements under a vector by the present tangent; None where it cannot be solved."""
        failure = self.body.solver.solve(self.body.kinematics.stiffness(), vector, self.correction)
        return None if failure else self.correction.x.array.copy()


def carried_fraction(model: bridge.QuasiStatic, load: bridge.Load, first: float = 0.1) -> float:
    """Largest fraction of a load, at most 1, that the arc-length method brings to equilibrium from zero. On one rank.

    Args:
        model: unloaded finite elements.
        load: of unit weights only.
        first: fraction of the load in the first step.
    """
    body = model._body
    forces = model._loads.forces(load).copy()
    forces[body.constraints.dofs] = 0.0
    path = _Path(body, model.laws, forces, fem.Function(body.solution.function_space))
    last, length, shortest, before = None, None, 0.0, len(model.linear_iterations)
    while path.factor < 1.0:
        start = path.factor
        motion, length, iterations = _step(path, last, length, first)
        shortest = shortest or SHORTEST * length
        if motion is None:
            path.factor, length = start, 0.5 * length
            if length < shortest or len(model.linear_iterations) - before > SYSTEMS:
                break
            continue
        body.accept()
        last = motion
        if path.factor <= start:  # the load falls: its peak is behind
            return start
        if iterations <= FAST:
            length *= 1.5
    return min(path.factor, 1.0)


def _step(path, last, length, first):
    """One step of a length, in the direction of the last motion; its motion (None: not converged), length and iterations."""
    body, start = path.body, path.factor
    body.increment.x.array[:] = 0.0
    vector, _ = path.residual(start)
    vector.array[:] = path.load
    forward = path.solved(vector)
    if forward is None:
        return None, length, 0
    size = np.linalg.norm(forward)
    length = first * size if length is None else length
    sign = 1.0 if last is None or last @ forward > 0 else -1.0
    body.increment.x.array[:] = sign * length / size * forward
    path.factor = start + sign * length / size
    for iteration in range(1, ITERATIONS + 1):
        vector, norm = path.residual(path.factor)
        if norm < TOLERANCE:
            return body.increment.x.array.copy(), length, iteration
        if not norm < 1e3:
            break
        back = path.solved(vector)
        vector.array[:] = path.load
        forward = path.solved(vector)
        if back is None or forward is None:
            break
        motion = body.increment.x.array
        change = -(motion @ back) / (motion @ forward)
        path.factor += change
        motion += back + change * forward
    return None, length, ITERATIONS
