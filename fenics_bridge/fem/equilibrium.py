"""One step to equilibrium, for any elements, as a system for Newton's method."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from dolfinx import fem
from mpi4py import MPI
from numpy.typing import NDArray

from fenics_bridge import compat
from fenics_bridge.fem.missing_stress import missing_fraction
from fenics_bridge.types import Law


@dataclass
class Body:
    """A body of finite elements: the state that a step changes, and the operators for it."""

    solution: fem.Function
    """Function of the unknowns"""
    increment: fem.Function
    """Their change in the step"""
    points: Any
    """Quadrature points"""
    kinematics: Any
    """Operator that gives the points' strain, internal forces and stiffness, as `Kinematics`"""
    constraints: Any
    """Constraints on the unknowns"""
    solver: Any
    """Solver of linear systems"""
    members: Any = None
    """Structural members, `structures.installed.Members`; None where there can be none"""

    def internal_forces(self, stress: NDArray[np.float64]) -> Any:
        """Nodal forces of a stress (n, S) and of the members at the end of the step, ghosts up to date. Collective."""
        forces = self.kinematics.internal_forces(stress)
        if self.members:
            of_members = self.members.forces()
            forces.array[: len(of_members)] += of_members
            compat.forward(forces)
        return forces

    def accept(self) -> None:
        """Accept the end of the step as the state that the next step starts from."""
        self.points.accept()
        if self.members:
            self.members.accept()
        self.solution.x.array[:] += self.increment.x.array

    def snapshot(self) -> tuple[Any, Any, Any]:
        """Copies of the state that the next step starts from, for `restore`."""
        of_members = self.members.snapshot() if self.members else None
        return self.solution.x.array.copy(), self.points.snapshot(), of_members

    def restore(self, snapshot: tuple[Any, Any, Any]) -> None:
        """Restore a state that was copied before."""
        self.solution.x.array[:] = snapshot[0]
        self.points.restore(snapshot[1])
        if self.members:
            self.members.restore(snapshot[2])


class EquilibriumStep:
    """One step of a Body to equilibrium, as a system for `newton`.

    Args:
        body: the body.
        laws: laws in the order of the body's points.
        external: nodal forces of the loads at the step's end.
        before: nodal forces of the loads at its start.
        displacement: fraction of the displacements that the supports prescribe at the step's end [-].
        viscosity: factor of the elastic stiffness; that times the strain increment is a stress added to that of the laws [-].
        scale: norm of forces by which residuals are divided; by default it is found at the start.
        part: fraction of the way to the prescribed displacements that the step goes [-].
    """

    def __init__(
        self,
        body: Body,
        laws: Sequence[Law],
        external: Any,
        before: Any,
        displacement: float,
        viscosity: float = 0.0,
        scale: Any = None,
        part: float = 1.0,
    ) -> None:
        self._body, self._laws, self._viscosity = body, laws, viscosity
        self._space = body.solution.function_space
        self._comm = self._space.mesh.comm
        self._n_owned = self._space.dofmap.index_map.size_local * self._space.dofmap.index_map_bs
        self._fixed = body.constraints.dofs
        self._external, self._before = external, before
        self.scale = scale
        self.reason = ""
        """Why the last correction or move could not be made"""
        self._moved = part * (body.constraints.at(displacement) - body.solution.x.array[self._fixed])
        self.moves_supports = self._comm.allreduce(bool(np.any(self._moved)), MPI.LOR)
        """Whether the step prescribes displacements other than zero"""
        self._base = np.zeros_like(body.increment.x.array)
        self._correction = fem.Function(self._space)

    def start(self) -> float:
        """The residual at no increment but that of the supports, whose effect is taken by the present tangent."""
        points, increment = self._body.points, self._body.increment
        increment.x.array[:] = 0.0
        increment.x.array[self._fixed] = self._moved
        self._base[:] = increment.x.array
        spread = self._body.kinematics.strain_increment()
        points.update(self._laws, np.zeros_like(spread))
        points.add_viscosity(self._laws, self._viscosity, np.zeros_like(spread))
        self._follow_members(as_elastic=True)
        return self._residual(points.trial_stress + np.einsum("nij,nj->ni", points.tangent, spread))

    def begin_from(self, motion: Any) -> Any:
        """Begin the iteration from an increment per degree of freedom [m], but for the supports', if the laws can follow it."""
        self._correction.x.array[:] = motion
        self._correction.x.array[self._fixed] = 0.0
        if self.move(1.0) == np.inf:
            self.start()
        else:
            self.keep()

    def correction(self) -> bool:
        """Solve the tangent system for the residual. Returns whether it was solved; `reason` says why not."""
        matrix = self._body.kinematics.stiffness()
        if self._body.members:
            matrix = self._body.members.with_stiffness(matrix, self._fixed[self._fixed < self._n_owned])
        self.reason = self._body.solver.solve(matrix, self._residual_vector, self._correction)
        return not self.reason

    def move(self, step: float) -> float:
        """Add a fraction of the correction to the last point of the iteration; returns the residual there."""
        body, points = self._body, self._body.points
        body.increment.x.array[:] = self._base + step * self._correction.x.array
        strain = body.kinematics.strain_increment()
        failure = points.update(self._laws, strain)
        self.reason = next(filter(None, self._comm.allgather(failure)), "")
        if self.reason:
            return np.inf
        self._follow_members()
        return self._residual(points.trial_stress + points.add_viscosity(self._laws, self._viscosity, strain))

    def out_of_balance(self) -> float:
        """The residual of the laws' stresses alone, without the viscous ones, at the last point that was moved to."""
        return self._residual(self._body.points.trial_stress)

    def carried_fraction(self) -> float:
        """Power of the laws' stresses over that of the external forces, both on the increment; NaN where these do none.

        In a mechanism it is the factor by which the load would have to be multiplied to be carried.
        """
        body, n = self._body, self._n_owned
        increment = body.increment.x.array[:n]
        internal = body.internal_forces(body.points.trial_stress).array[:n]
        works = self._comm.allreduce(np.array([internal @ increment, self._external[:n] @ increment]))
        return works[0] / works[1] if works[1] > 0 else np.nan

    def missing_fraction(self) -> float:
        """Largest missing stress of a cell over the strength that it mobilises, see `missing_stress`; for a viscous step [-]."""
        body = self._body
        here = missing_fraction(body.points, self._laws, self._viscosity, body.kinematics.strain_increment())
        return self._comm.allreduce(here, MPI.MAX)

    def work(self) -> float:
        """The residual times the correction."""
        n = self._n_owned
        return self._comm.allreduce(float(np.dot(self._residual_vector.array[:n], self._correction.x.array[:n])))

    def wants_more(self, tolerance: float) -> bool:
        """Whether a residual below the tolerance is not enough: it is."""
        return False

    def keep(self) -> None:
        """Make this the last point of the iteration."""
        self._base[:] = self._body.increment.x.array

    def _follow_members(self, as_elastic: bool = False) -> None:
        if self._body.members:
            self._body.members.follow(self._body.increment.x.array[: self._n_owned], as_elastic)

    def _residual(self, stress: NDArray[np.float64]) -> float:
        """Norm of the out-of-balance forces over that of the forces at work."""
        forces = self._body.internal_forces(stress)
        forces.array[:] = self._external - forces.array
        if self.scale is None:
            self.scale = self._forces_at_work(forces.array)
        forces.array[self._fixed] = 0.0
        self._residual_vector = forces
        return self._relative(forces.array)

    def _relative(self, out_of_balance: Any) -> Any:
        """Norm of the out-of-balance forces where nothing is prescribed, over that of the forces at work."""
        return self._norm(out_of_balance) / self.scale if self.scale > 0 else 0.0

    def _forces_at_work(self, out_of_balance: Any) -> Any:
        """Largest norm of the loads before and after the step and of the reactions at its start.

        It is set once: in an iteration that runs away the reactions grow without limit and would hide the residual.
        """
        reactions = np.zeros_like(out_of_balance)
        reactions[self._fixed] = out_of_balance[self._fixed]
        return max(self._norm(forces) for forces in (self._external, self._before, reactions))

    def measure_reactions(self) -> None:
        """Divide residuals by the forces that act at the last point, where the start had more.

        The start of a step that prescribes displacements has the reactions of the present tangent. Soil that is elastic at
        first and then yields carries a small part of them: of the reactions of a footing that is pressed into sand a
        hundredth.
        """
        out_of_balance = self._external - self._body.internal_forces(self._body.points.trial_stress).array
        self.scale = min(self.scale, self._forces_at_work(out_of_balance))

    def _norm(self, array: NDArray[Any]) -> float:
        return np.sqrt(self._comm.allreduce(float(np.sum(array[: self._n_owned] ** 2))))
