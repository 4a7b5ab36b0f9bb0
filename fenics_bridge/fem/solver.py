"""Tolerances of an equilibrium."""

from __future__ import annotations

from dataclasses import dataclass

from mpi4py import MPI

from fenics_bridge.errors import InputError, agree


@dataclass(frozen=True)
class Solver:
    """Solver of an equilibrium and its tolerances. Out-of-balance forces are over the forces at work [-].

    `PRACTICE` is a coarser level as in practice: at most 1 % of the stress is missing where the soil yields.

    Raises:
        InputError: a value out of its range.
    """

    tolerance: float = 1e-8
    """Out-of-balance force at which Newton's method ends [-]"""
    max_iterations: int = 25
    """Largest number of iterations of Newton's method in a step"""
    relaxation: bool = True
    """Whether `relaxation.relax` takes over where Newton's method does not converge; coupled with water it does not, and
    `relaxed_tolerance` then holds for what Newton's method reaches"""
    relaxed_tolerance: float = 1e-5
    """Out-of-balance force at which a relaxation ends [-]; where a cell that yields lacks more than 1 % of its strength then, a tenth
    of it, down to a thousandth"""
    missing_tolerance: float = 0.0
    """A relaxation also ends when the out-of-balance force, and in every cell that yields the missing stress over the mobilised
    strength, are below this number [-]; at 0 only `relaxed_tolerance` counts"""
    max_steps: int = 80
    """Largest number of steps of a relaxation; four times as many where supports move"""

    def __post_init__(self) -> None:
        for name in ("tolerance", "relaxed_tolerance"):
            if not 0 < getattr(self, name) < 1:
                raise InputError(f"{name} is {getattr(self, name)!r}, expected a number between 0 and 1")
        if not 0 <= self.missing_tolerance < 1:
            raise InputError(f"missing_tolerance is {self.missing_tolerance!r}, expected a number from 0 to below 1")
        for name in ("max_iterations", "max_steps"):
            if not (isinstance(getattr(self, name), int) and getattr(self, name) > 0):
                raise InputError(f"{name} is {getattr(self, name)!r}, expected a whole number above 0")


PRACTICE = Solver(tolerance=1e-7, missing_tolerance=1e-2)
"""Also accepts a relaxation with an out-of-balance force of 1 % in which no cell that yields lacks more than 1 % of the stress,
tolerances as in practice. Factors of safety become up to 1 % higher, whatever part of the body fails: see `missing_stress`."""


def given_solver(comm: MPI.Comm, solver: Solver | None) -> Solver:
    """The solver that a caller gives, or the default one. Collective.

    Raises:
        InputError: something else is given. Raised on all ranks alike.
    """
    known = isinstance(solver, (Solver, type(None)))
    agree(comm, None if known else f"solver is {solver!r}, expected a Solver, or None")
    return solver or Solver()
