"""Laboratory tests on a single point of a law: some components of strain are prescribed, and the stress in the others."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._core import InputError, RunError, law_types
from .checks import positive, real_numbers, within
from .mesh import floats

MAX_ITERATIONS = 50
MAX_HALVINGS = 10


class ElementTest:
    """A point of a law at which some components of strain are prescribed, and the stress in the other components.

    Args:
        law: any law.
        stress: at the start [Pa], tension positive, shape (4,) in plane strain or (6,).
        state: state variables at the start, shape (n_state,); zero by default.
        cell_size: size of the cell that the point represents [m]; by default that of the law.

    Example:
        >>> test = mpm.ElementTest(soil, stress=[-100e3] * 3 + [0.0] * 3)
        >>> for _ in range(100):  # drained triaxial compression along x: sides at 100 kPa
        ...     test.step([-1e-3, None, None, 0.0, 0.0, 0.0])
        >>> test.stress
    """

    def __init__(
        self, law: Any, stress: ArrayLike, state: ArrayLike | None = None, cell_size: float | None = None
    ) -> None:
        if not isinstance(law, tuple(law_types)):
            raise InputError(f"law is {law!r}, expected a constitutive law such as MohrCoulomb(...)")
        self.law = law
        self.time = 0.0
        """Time [s]"""
        self._cell_size = None if cell_size is None else np.array([positive("cell_size", cell_size, "m")])
        self.stress = floats("stress", stress, (None,))
        """Stress [Pa], shape (S,)"""
        if len(self.stress) not in (4, 6):
            raise InputError(f"stress has shape {self.stress.shape}, expected (4,) or (6,)")
        self.state = floats("state", np.zeros(law.n_state) if state is None else state, (law.n_state,))
        """State variables, shape (n_state,)"""
        self.strain = np.zeros_like(self.stress)
        """Strain since the start, engineering shear, shape (S,)"""
        self._last = np.zeros_like(self.stress)

    def __repr__(self) -> str:
        return f"<ElementTest: t = {self.time:g} s, stress {self.stress} Pa, strain {self.strain}\n  {self.law!r}>"

    def step(self, strain_increment: ArrayLike, stress: ArrayLike | None = None, dt: float = np.inf) -> None:
        """Drive the point by one increment, by Newton's method with the law's tangent.

        Args:
            strain_increment: shape (S,), None where the stress is prescribed instead.
            stress: stress [Pa] to reach in those components, shape (S,); the present one by default.
            dt: duration of the increment [s]; by default loading is infinitely slow.

        Raises:
            InputError: another number of components, or such as are neither numbers nor None; a duration below zero.
            RunError: the law failed, or no strain was found that gives the stresses; the message has the increment. The point is unchanged.
        """
        self._dt = within("dt", dt, 0, np.inf)
        try:
            components = [np.nan if component is None else component for component in strain_increment]  # type: ignore[union-attr]
            given = real_numbers("strain_increment", components)
        except (TypeError, InputError):
            raise InputError(f"strain_increment is {strain_increment!r}, expected numbers, or None") from None
        if given.shape != self.stress.shape:
            raise InputError(f"strain_increment has shape {given.shape}, expected {self.stress.shape}")
        free, increment = np.isnan(given), given.copy()
        target = self.stress if stress is None else floats("stress", stress, self.stress.shape)
        for guess in self._guesses(given, free):
            increment[free] = guess[free]
            if self._solved(increment, free, target):
                self.time += dt if np.isfinite(dt) else 0.0
                return
        raise RunError(
            f"no strain was found that gives the stress {target[free]} Pa; the last strain increment tried is {increment}: take "
            "smaller increments, or a stress that the soil can bear"
        )

    def _guesses(self, given: NDArray[np.float64], free: NDArray[np.bool_]) -> Iterator[NDArray[np.float64]]:
        """Increments from which Newton's method begins, one after the other; only the free components count."""
        yield np.zeros_like(given)
        # A point that softens may be taken for an elastic one from the first guess, but not from its last increment.
        yield self._last
        # A point that is pulled may be at its apex, where no strain changes the stress, from both, but not at constant volume.
        normal = free[:3]
        same_volume = np.zeros_like(given)
        same_volume[:3][normal] = -given[:3][~normal].sum() / max(normal.sum(), 1)
        yield same_volume

    def _solved(self, increment: NDArray[np.float64], free: NDArray[np.bool_], target: NDArray[np.float64]) -> bool:
        """Find the free components of the increment from those given, in place; take the step if there are any."""
        new, state, tangent = self._updated(increment)
        for _ in range(MAX_ITERATIONS):
            if np.abs(new - target)[free].max(initial=0.0) <= self._tolerance(new):
                self.stress, self.state, self.strain = new, state, self.strain + increment
                self._last = increment
                return True
            # On an edge of Mohr-Coulomb two stresses are equal whatever the strains: of all of these the smallest step
            step, *_ = np.linalg.lstsq(tangent[np.ix_(free, free)], (new - target)[free], rcond=1e-12)
            new, state, tangent = self._moved(increment, free, step)
        return False

    def _moved(
        self, increment: NDArray[np.float64], free: NDArray[np.bool_], step: NDArray[np.float64]
    ) -> tuple[NDArray, NDArray, NDArray]:
        """Take a step off the free components of the increment, in place, or a fraction of it that the law can follow, and update the point.

        Soil without stress is so soft that a step may be far too long for a law whose stiffness grows with the stress.
        """
        start = increment[free]
        for halvings in range(MAX_HALVINGS):
            increment[free] = start - 0.5**halvings * step
            with suppress(RunError):
                return self._updated(increment)
        increment[free] = start - step
        return self._updated(increment)

    def _tolerance(self, stress: NDArray[np.float64]) -> float:
        return 1e-9 * float(np.abs(stress).max()) + 1e-12 * self.law.p_wave_modulus

    def _updated(self, increment: NDArray[np.float64]) -> tuple[NDArray, NDArray, NDArray]:
        size = len(increment)
        stress, state, tangent = self.stress[None].copy(), self.state[None].copy(), np.zeros((1, size, size))
        context = {"time": self.time, "dt": self._dt, "cell_size": self._cell_size}
        report = self.law.update(np.ascontiguousarray(increment[None]), stress, state, tangent, **context)
        if report.failed:
            raise RunError(
                f"{type(self.law).__name__} failed at the stress {self.stress} Pa, strain increment {increment}"
            )
        return stress[0], state[0], tangent[0]
