"""Pore water of a column of level ground, which flows up and down through the soil."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .water_checks import LABORATORY_GRAVITY

Floats = NDArray[np.float64]


def to_levels(lower: Floats, upper: Floats) -> Floats:
    """Sums of the contributions of layers to the levels below and above them, (n + 1, ...)."""
    total = np.zeros((len(lower) + 1, *lower.shape[1:]))
    total[:-1] += lower
    total[1:] += upper
    return total


def lumped(values: Floats) -> Floats:
    """Values of layers, half of each at the level below and half at the level above, (n + 1, ...)."""
    return to_levels(0.5 * values, 0.5 * values)


class GroundWater:
    """Pore water of layers, with a velocity w of its own beside that of the soil v, as in explicit steps of a model.

    The levels have the mean velocity of both, weighted by their masses, which the column knows, and the relative velocity w - v.
    The equations are (W6) and (W7) of ``docs/water_particles.md`` for a unit of area. The base is impervious; the surface drains.

    Args:
        thickness: of the layers [m], (n).
        mass: of soil and water [kg/m2], (n).
        pores: porosity [-], conductivity along each axis [m/s], mass of the water in a volume of soil [kg/m3], and pressure [Pa],
            (n, D + 3).
        water: properties of the water of the model.
        gravity: downwards [m/s2].
        surface: its height [m].
        time: at the start [s].
    """

    def __init__(
        self, thickness: Floats, mass: Floats, pores: Floats, water: Any, gravity: float, surface: float, time: float
    ) -> None:
        self._water, self._gravity, self._surface = water, gravity, surface
        self._thickness = thickness.copy()
        self.porosity, self._conductivity = pores[:, 0].copy(), pores[:, 1:-2].copy()
        self.mass = pores[:, -2] * thickness
        """Mass of the water [kg/m2], (n)"""
        self._soil = lumped(mass - self.mass)[:, None]
        self.pressure = pores[:, -1].copy()
        """Pore pressure [Pa], (n)"""
        self.relative = np.zeros((len(thickness) + 1, self._conductivity.shape[1]))
        """Relative velocity w - v [m/s], (n + 1, D)"""
        self._pressure_start, self._mass_start = self.pressure.copy(), self.mass.copy()
        self._sum_at_levels()
        self._standing_start = self._standing(time)

    @property
    def stiffness(self) -> Floats:
        """K_w / n [Pa], (n)."""
        return self._water.modulus / self.porosity

    @property
    def pressure_change(self) -> Floats:
        """Since the start [Pa], (n)."""
        return self.pressure - self._pressure_start

    def loads_of(self, time: float) -> Floats:
        """Vertical forces on soil and water since the start [N/m2], (n + 1): the weight of the water, and that which stands above."""
        loads = -self._gravity * lumped(self.mass - self._mass_start)
        loads[-1] -= self._standing(time) - self._standing_start
        return loads

    def velocity_of_soil(self, mean: Floats) -> Floats:
        """Velocity of the soil at the levels [m/s], (n + 1, D), by the mean of soil and water."""
        water = self._at_levels[:, None]
        return mean - water / (water + self._soil) * self.relative

    def accelerate(self, dt: float, force: Floats, held: bool, time: float) -> None:
        """Change the relative velocity by the forces at the start of a step and the drag at its end.

        Args:
            dt: length of the step [s].
            force: on soil and water [N/m2], (n + 1, D).
            held: whether the motion of the base is prescribed, for soil and water alike.
            time: at the start [s].
        """
        water = self._at_levels[:, None]
        filled = np.minimum(1.0, self._at_levels / (self._water.density * self._around))
        pressures = to_levels(-self.pressure, self.pressure)
        pressures[-1] -= self._standing(time)
        on_water = np.zeros_like(force)
        on_water[:, -1] = filled * pressures - self._gravity * self._at_levels
        unit_weight = self._water.density * LABORATORY_GRAVITY
        drag = lumped((self._thickness * self.porosity**2)[:, None] * unit_weight / self._conductivity)
        free = self.relative + dt * (on_water / water - (force - on_water) / self._soil)
        self.relative = free / (1 + dt * drag * (1 / self._soil + 1 / water))
        self.relative[0, slice(None) if held else -1] = 0.0

    def follow(self, dt: float, strain: Floats, time: float) -> None:
        """Let the water flow over a step, and find pressures of the mass of the water and the volume of the pores.

        Args:
            dt: length of the step [s].
            strain: increment of the vertical strain of the soil, (n).
            time: at the start [s].
        """
        flux = self._at_levels / self._around * self.relative[:, -1]
        if np.isfinite(self._water.suction_limit) and self._standing(time) <= 0:
            flux[-1] = max(flux[-1], 0.0)  # no water enters
        self.mass -= dt * np.diff(flux)
        before, grown = self.porosity, 1 + strain
        self._thickness = self._thickness * grown
        self.porosity = (before + strain) / grown
        if self._water.kozeny_carman:
            ratio = (self.porosity / before) ** 3 * ((1 - before) / (1 - self.porosity)) ** 2
            self._conductivity *= ratio[:, None]
        full = self._water.density * self.porosity * self._thickness
        self.pressure = np.maximum(self._water.modulus * (self.mass / full - 1), -self._water.suction_limit)
        self._sum_at_levels()

    def _sum_at_levels(self) -> None:
        """Find the mass of the water [kg/m2] and the thickness of soil [m] of the levels, (n + 1)."""
        self._at_levels, self._around = lumped(np.column_stack([self.mass, self._thickness])).T

    def standing_at(self, heights: Any, time: float) -> Any:
        """Hydrostatic pressure below the level of the water that stands over the ground [Pa], at a height or heights [m]."""
        if not self._water.standing:
            return 0.0 * heights
        times, levels = zip(*self._water.standing)
        level = float(np.interp(time, times, levels))
        return np.maximum(0.0, self._water.density * self._gravity * (level - heights))

    def _standing(self, time: float) -> float:
        """Pressure of the water that stands over the surface [Pa]."""
        return float(self.standing_at(self._surface, time))
