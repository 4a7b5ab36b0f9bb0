"""A column of level ground in which a wave travels upwards: the free field beside a side of a mesh."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._core import RunError, fast_wave_squared
from .ground_water import GroundWater, lumped, to_levels
from .rayleigh import Rayleigh

Floats = NDArray[np.float64]
COURANT = 0.5
SHEAR_OF_PLANE = {2: (3, 1), 3: (5, 4, 2)}
"""Components of stress that act on a level plane, along each axis"""
STRESS_OF_AXES = {2: ((0, 3), (3, 1)), 3: ((0, 3, 5), (3, 1, 4), (5, 4, 2))}
"""Component of stress by two axes"""


@dataclass(frozen=True)
class Layers:
    """Soil between levels, as it is when a column begins to move; lists, for checkpoints.

    Args:
        heights: of the levels [m], rising, n + 1 of them.
        law: number of the law of each layer (n).
        density: [kg/m3], (n).
        stress: [Pa], (n, S).
        state: state variables, (n, n_state) of the law with the most.
        cell_size: [m], (n).
        coupled_mass: fraction of a layer's mass by which one of its levels takes the velocity of the other, (n).
        normal: outer one of the side beside the column, (D).
        time: when it begins to move [s].
        pores: porosity [-], conductivity along each axis [m/s], mass of the water in a volume of soil [kg/m3], and pore pressure
            [Pa], (n, D + 3); an empty list without pore water.
        gravity: downwards [m/s2].
    """

    heights: list[float]
    law: list[int]
    density: list[float]
    stress: list[list[float]]
    state: list[list[float]]
    cell_size: list[float]
    coupled_mass: list[float]
    normal: list[float]
    time: float
    pores: list[list[float]] = field(default_factory=list)
    gravity: float = 0.0


@dataclass(frozen=True)
class Base:
    """Base of a column.

    Args:
        impedances: ``rho c_p`` and ``rho c_s`` of the ground below [kg/(m2 s)]; zeros for those of the lowest layer, infinite
            where the base moves with twice the incoming wave.
        thickness: of the ground below that acts as springs [m].
        times: of the incoming wave [s], rising; none where there is none.
        velocities: of it [m/s].
        direction: of it, unit vector (D).
    """

    impedances: tuple[float, float]
    thickness: float
    times: Floats
    velocities: Floats
    direction: Floats

    def wave(self, time: float) -> Floats:
        """Velocity of the incoming wave [m/s], (D)."""
        if len(self.times) == 0:
            return 0.0 * self.direction
        return float(np.interp(time, self.times, self.velocities, left=0.0, right=0.0)) * self.direction


class GroundColumn:
    """Level ground by linear finite elements over its height, in explicit steps of one length like those of a model.

    All points of a level move alike. The mass matrix of velocities is that of the particles, so that waves are as fast as in
    the model. Pore water flows through the soil (`GroundWater`). Strains are small: the column keeps its geometry, and stresses
    are not rotated. Of total stresses only what changes from the start counts, so that it begins in equilibrium.

    Args:
        layers: the soil.
        laws: those of the model.
        base: what it stands on; None for a base at rest.
        rayleigh: damping at small strains.
        water: properties of the pore water of the model; None without.
    """

    def __init__(
        self, layers: Layers, laws: list[Any], base: Base | None, rayleigh: Rayleigh, water: Any = None
    ) -> None:
        self.heights = np.array(layers.heights)
        self._laws, self._base, self._rayleigh = laws, base, rayleigh
        self._law, self._cell_size = np.array(layers.law), np.array(layers.cell_size)
        self._normal, self._start = np.array(layers.normal), layers.time
        dim, n = len(self._normal), len(self._law)
        self._on_plane = list(SHEAR_OF_PLANE[dim])
        self._on_side = np.array(STRESS_OF_AXES[dim])
        self._thickness, self._density = np.diff(self.heights), np.array(layers.density)
        self.stress, self._state = np.array(layers.stress), np.array(layers.state).reshape(n, -1)
        self._stress_start = self.stress.copy()
        self._pieces = [(law, np.flatnonzero(self._law == k)) for k, law in enumerate(laws)]
        p_wave, shear = np.empty((2, n))
        for law, rows in self._pieces:
            p_wave[rows], shear[rows] = law.wave_moduli(self.stress[rows], self._state_of(law, rows)).T
        self._moduli = np.column_stack([shear] * (dim - 1) + [p_wave])  # (n, D), across and along the column
        self._lame = p_wave - 2 * shear
        self._mass = self._density * self._thickness
        self._coupled = (self._mass * layers.coupled_mass)[:, None]
        self._own = 0.5 * self._mass[:, None] - self._coupled
        self._nodal_mass = lumped(self._mass)
        highest = np.maximum(p_wave, [laws[k].p_wave_modulus for k in self._law])  # as it may become
        of_soil, speeds = self._density, np.sqrt(highest / self._density)
        self._base_moduli = self._moduli[0].copy()  # of the ground below, undrained where it has water
        self._water = None
        if layers.pores:
            pores = np.array(layers.pores)
            self._water = GroundWater(
                self._thickness, self._mass, pores, water, layers.gravity, self.heights[-1], layers.time
            )
            of_soil = self._density - pores[:, -2]
            parts = np.column_stack([highest, np.full(n, water.modulus), pores[:, 0], of_soil, pores[:, -2]])
            speeds = np.sqrt([fast_wave_squared(*row) for row in parts])
            self._standing_start = self._water.standing_at(self.heights, layers.time)
            self._base_moduli[-1] += self._water.stiffness[0]
        critical, critical_of_soil = (
            float((self._thickness / speed).min()) for speed in (speeds, np.sqrt(highest / of_soil))
        )
        self.dt = COURANT * rayleigh.time_step(critical, critical_of_soil)
        """Length of a step [s]"""
        self.velocity, self._displacement = np.zeros((n + 1, dim)), np.zeros(dim)
        self._steps = 0
        self._rows = [(self.time, self.velocity.copy(), self._tractions(np.zeros_like(self.stress)))]

    @property
    def time(self) -> float:
        """Time [s]."""
        return self._start + self._steps * self.dt

    def advance(self, present: float, until: float) -> tuple[Floats, Floats, Floats]:
        """Step to a time or just beyond it.

        Args:
            present: time of the model [s]; a run that ended early leaves the column ahead of it.
            until: [s].

        Returns:
            Times (m) [s], velocities (m, n + 1, D) [m/s] and tractions on the side since the start (m, n + 1, D) [Pa], from
            the last time before the present on.

        Raises:
            RunError: a law failed.
        """
        past = sum(time <= present for time, _, _ in self._rows)
        self._rows = self._rows[max(past - 1, 0) :]
        while self.time < until:
            viscous = self._step()
            self._rows.append((self.time, self.velocity.copy(), self._tractions(viscous)))
        times, velocities, tractions = zip(*self._rows)
        return np.array(times), np.array(velocities), np.array(tractions)

    def _state_of(self, law: Any, rows: NDArray[np.intp]) -> Floats:
        """State variables of layers of a law, (m, n_state)."""
        return np.ascontiguousarray(self._state[rows, : law.n_state])

    def _change(self) -> Floats:
        """Total stress since the start, (n, S)."""
        change = self.stress - self._stress_start
        if self._water:
            change[:, :3] -= self._water.pressure_change[:, None]
        return change

    def _velocity_of_soil(self) -> Floats:
        """At the levels [m/s], (n + 1, D)."""
        return self._water.velocity_of_soil(self.velocity) if self._water else self.velocity

    def _rates(self) -> Floats:
        """Derivative of the velocity of the soil by height, (n, D)."""
        return np.diff(self._velocity_of_soil(), axis=0) / self._thickness[:, None]

    def _is_damped(self) -> NDArray[np.bool_]:
        if self._state.shape[1] == 0:
            return np.ones(len(self._law), dtype=bool)
        return self._state[:, 0] <= self._rayleigh.plastic_strain

    def _viscous_stress(self, damped: NDArray[np.bool_]) -> Floats:
        """Stress of the damping in proportion to stiffness, (n, S)."""
        stress = np.zeros_like(self.stress)
        if self._rayleigh.stiffness > 0:
            rates = self._rates()
            stress[:, :3] = (self._rayleigh.stiffness * self._lame * rates[:, -1])[:, None]
            stress[:, self._on_plane] = self._rayleigh.stiffness * self._moduli * rates
            stress[~damped] = 0.0
        return stress

    def _step(self) -> Floats:
        """Take one step; returns the viscous stress at its start."""
        damped = self._is_damped()
        viscous = self._viscous_stress(damped)
        on_plane = (self._change() + viscous)[:, self._on_plane]
        force = to_levels(on_plane, -on_plane)
        if self._water:
            force[:, -1] += self._water.loads_of(self.time)
            self._water.accelerate(self.dt, force, self._is_held(), self.time)
        if self._rayleigh.mass > 0:  # as gravity, on soil and water alike (docs/water_particles.md)
            rate = self._rayleigh.mass * lumped(self._mass * damped)
            force -= rate[:, None] * self._velocity_of_soil()
        change = self.dt * force / self._nodal_mass[:, None]
        self._take(change)
        self._displacement += self.dt * self.velocity[0]
        self._strain()
        self._steps += 1
        return viscous

    def _is_held(self) -> bool:
        """Whether the motion of the base is prescribed."""
        return self._base is None or bool(np.isinf(self._base.impedances[0]))

    def _take(self, change: Floats) -> None:
        """Change the velocities, with the dashpots of the base, which act as those of a model."""
        base = self._base
        if base is None or self._is_held():
            end = 0.0 * change[0] if base is None else 2 * base.wave(self.time + 0.5 * self.dt)
            change[0] = end - self.velocity[0]
            self.velocity += self._gained(change)
            self.velocity[0] = end
            return
        change[0] -= self.dt / self._nodal_mass[0] * self._base_moduli / base.thickness * self._displacement
        normal, shear = base.impedances
        damping = np.array([shear] * (change.shape[1] - 1) + [normal])
        damping = np.where(damping > 0, damping, np.sqrt(self._density[0] * self._base_moduli))
        mean = self.velocity[0] + 0.5 * self._gained(change)[0]
        against = 2 * base.wave(self.time + 0.5 * self.dt) - mean
        shared = self._own[0] / self._nodal_mass[0]  # part of an acceleration at the base that its particles take
        change[0] += self.dt * damping * against / (self._nodal_mass[0] + 0.5 * shared * self.dt * damping)
        self.velocity += self._gained(change)

    def _gained(self, change: Floats) -> Floats:
        """What the particles gain at the levels by changes of the velocities there."""
        lower, upper = change[:-1], change[1:]
        gained = to_levels(self._own * lower + self._coupled * upper, self._coupled * lower + self._own * upper)
        return gained / self._nodal_mass[:, None]

    def _strain(self) -> None:
        increment = np.zeros_like(self.stress)
        increment[:, self._on_plane] = self.dt * self._rates()
        if self._water:
            self._water.follow(self.dt, increment[:, self._on_plane[-1]], self.time)
        for law, rows in self._pieces:
            if len(rows) == 0:
                continue
            stress, state = self.stress[rows], self._state_of(law, rows)
            report = law.update(
                increment[rows], stress, state, time=self.time, dt=self.dt, cell_size=self._cell_size[rows]
            )
            if report.failed:
                height = self.heights[rows[report.first_failed]]
                raise RunError(f"the law {law.name} failed in the free field above the height {height:.6g} m")
            self.stress[rows], self._state[rows, : law.n_state] = stress, state

    def _tractions(self, viscous: Floats) -> Floats:
        """On the side, means of the layers around each level, (n + 1, D) [Pa].

        Without the pressure of standing water, which presses on the model's soil wherever it ends, at its sides too.
        """
        change = self._change() + viscous
        traction = np.einsum("nij,j->ni", change[:, self._on_side], self._normal) * self._thickness[:, None]
        length = to_levels(self._thickness, self._thickness)
        means = to_levels(traction, traction) / length[:, None]
        if self._water:
            risen = self._water.standing_at(self.heights, self.time) - self._standing_start
            means += risen[:, None] * self._normal
        return means
