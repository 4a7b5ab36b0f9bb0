"""Damping of soil at small strains."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._core import InputError
from .checks import positive, real_numbers, within
from .mesh import floats


@dataclass(frozen=True)
class Rayleigh:
    """Rayleigh damping: forces ``mass`` times momentum and ``stiffness`` times the rate of the elastic stresses.

    A harmonic motion of angular frequency w is damped with the ratio ``mass / (2 w) + stiffness w / 2`` of the critical
    damping. It stands for the hysteresis of soil below its yield surface; where soil yields, its law damps alone.

    In explicit runs with pore water, ``stiffness`` counts the effective stresses only, and ``mass`` acts on soil and water by the
    velocity of the soil, so that it does not change the flow of water through the soil (docs/water_particles.md).

    Args:
        mass: alpha [1/s]. It slows down all motion, that of a rigid body too.
        stiffness: beta [s]. It shortens the critical time step to ``sqrt(1 + x**2) - x`` times that without, with ``x`` some
            ``stiffness`` over that step: to a fifth for x = 2.4. With pore water in explicit runs it does so by much less, since
            the water's wave, by which the step is short, is not damped.
        plastic_strain: accumulated plastic deviatoric strain of a point above which its cell is no longer damped [-]; the
            stresses of ``stiffness`` would strengthen a shear band, and the forces of ``mass`` brake a slide. Infinite where they
            are to brake it, as in the place of local damping (docs/run_out.md).

    Raises:
        InputError: a number that is negative.

    Example:
        >>> damping = mpm.Rayleigh.of_ratio(0.02, frequencies=(1.0, 5.0))
        >>> model.explicit(until=10.0, rayleigh=damping)
    """

    mass: float = 0.0
    stiffness: float = 0.0
    plastic_strain: float = 1e-3

    def __post_init__(self) -> None:
        positive("mass", self.mass, "1/s", zero=True)
        positive("stiffness", self.stiffness, "s", zero=True)
        within("plastic_strain", self.plastic_strain, 0, np.inf)

    @classmethod
    def of_ratio(cls, ratio: float, frequencies: ArrayLike, plastic_strain: float = 1e-3) -> Rayleigh:
        """The damping with a given ratio at two frequencies, less between them and more outside.

        Args:
            ratio: of the critical damping [-], from 0 to below 1.
            frequencies: the two frequencies [Hz], shape (2,).
            plastic_strain: as above.

        Raises:
            InputError: a ratio out of its range, frequencies that are not positive.
        """
        within("ratio", ratio, 0, 1, open_above=True)
        pair = floats("frequencies", frequencies, (2,)).tolist()
        one, other = (2 * np.pi * positive("frequencies", frequency, "Hz") for frequency in pair)
        return cls(2 * ratio * one * other / (one + other), 2 * ratio / (one + other), plastic_strain)

    def ratio(self, frequency: ArrayLike) -> NDArray[np.float64]:
        """Damping ratio at the given frequencies [Hz]; same shape.

        Raises:
            InputError: a frequency that is not positive.
        """
        frequencies = real_numbers("frequency", frequency)
        if not (frequencies > 0).all():
            raise InputError(f"frequency is {frequencies.min():g} Hz, expected positive numbers")
        omega = 2 * np.pi * frequencies
        return 0.5 * (self.mass / omega + self.stiffness * omega)

    def time_step(self, critical: float, critical_of_soil: float | None = None) -> float:
        """Critical time step [s] under this damping, from that without.

        Args:
            critical: [s].
            critical_of_soil: that of the stresses and the mass of the soil alone [s], where its water has a velocity of its own.
        """
        ratio = self.stiffness * critical / (critical_of_soil or critical) ** 2 + 0.25 * self.mass * critical
        return critical * float(np.sqrt(1 + ratio**2) - ratio)

    def _as_core(self) -> tuple[float, float, float]:
        return self.mass, self.stiffness, self.plastic_strain


NO_DAMPING = Rayleigh()


def checked_rayleigh(rayleigh: Rayleigh | None) -> Rayleigh:
    """The damping; none for None.

    Raises:
        InputError: something else.
    """
    if rayleigh is not None and not isinstance(rayleigh, Rayleigh):
        raise InputError(f"rayleigh is {rayleigh!r}, expected a Rayleigh or None")
    return rayleigh or NO_DAMPING


def implicit_mass_damping(rayleigh: Rayleigh | None) -> float:
    """The forces over the momentum [1/s] that implicit steps take from a damping.

    Raises:
        InputError: forces by stiffness, or only where soil does not yield, which implicit steps do not have.
    """
    damping = checked_rayleigh(rayleigh)
    if damping.stiffness > 0:
        raise InputError(f"rayleigh.stiffness is {damping.stiffness:g} s, expected 0 with the implicit scheme")
    if damping.mass > 0 and damping.plastic_strain < np.inf:
        raise InputError(
            f"rayleigh.plastic_strain is {damping.plastic_strain:g}, expected inf with the implicit scheme, which damps soil that "
            "yields as well"
        )
    return damping.mass
