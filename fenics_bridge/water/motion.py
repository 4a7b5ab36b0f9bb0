"""Inertia of soil and pore water that move together, by Newmark's method."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from dolfinx import fem
from numpy.typing import ArrayLike, NDArray

from fenics_bridge.errors import InputError, agree, is_finite, real_numbers
from fenics_bridge.types import OfPosition


@dataclass(frozen=True)
class Newmark:
    """Method of Newmark (1959): v and a of the end of a step follow from u.

    beta = 1/4, gamma = 1/2 is the trapezoidal rule, without dissipation; the default damps waves that the steps do not resolve
    (Zienkiewicz and Shiomi 1984).

    Raises:
        InputError: parameters with which steps are not stable, whatever their length.
    """

    beta: float = 0.3025
    """Part of the acceleration at the end in the displacement [-]"""
    gamma: float = 0.6
    """Its part in the velocity [-]"""

    def __post_init__(self) -> None:
        if not (is_finite(self.gamma) and self.gamma >= 0.5):
            raise InputError(f"gamma is {self.gamma!r}, expected 0.5 or more")
        least = 0.25 * (self.gamma + 0.5) ** 2
        if not (is_finite(self.beta) and self.beta >= least * (1 - 1e-12)):
            raise InputError(f"beta is {self.beta!r}, expected (gamma + 1/2)^2 / 4 = {least:g} or more")


class Motion:
    """Velocity and acceleration of a body, and the acceleration at the end of a step as an expression of its displacement.

    Args:
        method: Newmark's parameters.
        space: space of the displacement.
        increment: displacement of a step, UFL.
    """

    def __init__(self, method: Newmark, space: Any, increment: Any) -> None:
        self.method, self._space, self._increment = method, space, increment
        self.velocity, self.acceleration = (fem.Function(space, name=name) for name in ("velocity", "acceleration"))
        self._carried, self._factor = fem.Function(space), fem.Constant(space.mesh, 1.0)
        self.at_end = self._factor * (increment - self._carried)
        """Acceleration at the end of the step under way [m/s2], UFL"""

    def begin(self, dt: float) -> None:
        """Prepare a step of a length [s]: a1 = (du - dt v0 - dt^2 (1/2 - beta) a0) / (beta dt^2)."""
        v, a, beta = self.velocity.x.array, self.acceleration.x.array, self.method.beta
        self._carried.x.array[:] = dt * v + dt**2 * (0.5 - beta) * a
        self._factor.value = 1 / (beta * dt**2)

    def accept(self, increment: NDArray[np.float64], dt: float) -> None:
        """Take over the displacement (m,) [m] of a step: v1 = v0 + dt ((1 - gamma) a0 + gamma a1)."""
        v, a, gamma = self.velocity.x.array, self.acceleration.x.array, self.method.gamma
        end = self._factor.value * (increment - self._carried.x.array)
        v += dt * ((1 - gamma) * a + gamma * end)
        a[:] = end

    def rest_on(self) -> None:
        """Make `at_end` the acceleration as it is, for no further displacement."""
        self._carried.x.array[:] = -self.acceleration.x.array / self._factor.value

    def set_velocity(self, velocity: OfPosition | ArrayLike) -> None:
        """Begin with a velocity. Collective.

        Args:
            velocity: function of positions (n, D) [m] that returns (n, D) [m/s], or one vector (D,).

        Raises:
            InputError: values of another shape or not finite. Raised on all ranks alike.
        """
        dim = self._space.mesh.geometry.dim
        x = self._space.tabulate_dof_coordinates()[:, :dim]
        given = velocity(x) if callable(velocity) else velocity
        values = real_numbers(self._space.mesh.comm, "velocity", given)
        good = values.shape in ((dim,), x.shape) and bool(np.all(np.isfinite(values)))
        agree(
            self._space.mesh.comm,
            None
            if good
            else f"velocity has shape {values.shape}, expected finite values of shape {x.shape} or ({dim},)",
        )
        self.velocity.x.array[:] = np.broadcast_to(values, x.shape).ravel()
        self.acceleration.x.array[:] = 0.0
