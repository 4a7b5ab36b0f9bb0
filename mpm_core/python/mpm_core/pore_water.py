"""Water in the pores of a body's soil, and its boundary conditions."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from mpi4py import MPI
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._core import InputError
from .anisotropy import tensors_of_laws
from .checks import at_points, real_numbers
from .collective import collectively
from .conditions import Conditions
from .input_warnings import warn_of_pores, warn_of_rain, warn_of_water_density
from .mesh import Tag, floats
from .parameter_fields import Field
from .particles import Particles
from .retention import curves_of_laws, joined
from .water_checks import density_of_water, filled_fraction, require_pores, require_saturation, require_soil
from .water_tables import History, Value, history_of

WaterCondition: TypeAlias = tuple[int, History, bool, bool, bool]
"""Facet tag; pressure [Pa] or level [m] over time; whether it is a level; whether the pore water has that pressure; whether it
presses on the soil"""


class WaveSpeeds(NamedTuple):
    """Compression waves in saturated soil [m/s]; Verruijt, Soil Dynamics (2010), section 5."""

    undrained: float
    """Soil and water move together: sqrt((E + K_w / n) / rho), E the oedometric modulus of the soil"""
    fast: float
    """The faster one without drag, which no wave exceeds with it; the time step of explicit runs is that of this wave"""


class PoreWater(Conditions):
    """The pore water of a body; see `Model`."""

    laws: list[Any]
    particles: Particles
    wave_moduli: Any
    _water_conditions: list[WaterCondition]
    _retention: list[list[NDArray[np.float64]]]

    def add_water(
        self,
        *,
        porosity: Field,
        conductivity: Field,
        density: float = 1000.0,
        modulus: float = 2.2e9,
        kozeny_carman: bool = False,
        suction_limit: float = np.inf,
        drained_surface: bool = False,
        retention: Any = None,
        anisotropy: Any = None,
        saturation: Field = 1.0,
        unit_weight: float | None = None,
    ) -> None:
        """Fill the pores of all particles with water, which from then on flows in implicit and explicit steps.

        Stresses of the particles are then effective stresses, and their density is that of the saturated soil. Pore pressures
        begin at zero, see `set_pore_pressure`. A boundary without a condition is impervious, see `hold_pore_pressure`.

        Warns of a density, modulus or conductivity that is probably in other units.

        Args:
            porosity: volume of the pores over that of the soil [-], in (0, 1); it follows the volume of the particles.
            conductivity: hydraulic conductivity k [m/s], positive, as measured in a laboratory under 9.81 m/s2, whatever the
                gravity of the model: under n times that gravity water flows n times as fast by its own weight. Both: a number;
                an array, shape (n,), in the order of ``particles``; a function of positions, shape (n, D); or {cell tag or
                name: number}.
            density: of water without pressure [kg/m3]. Water that stands up to a level weighs density times gravity.
            modulus: bulk modulus of water [Pa]; may be infinite.
            kozeny_carman: let the conductivity follow the porosity as n^3 / (1 - n)^2.
            suction_limit: largest suction of the water [Pa], 0 or more, in explicit runs: where soil grows beyond it, its pores
                are not full, and pressure comes back when they are; no water enters at free surfaces then. By default
                it bears any.
            drained_surface: hold the pressure at zero along the free surface of the soil, wherever it is in the mesh, or at that
                of the water of `stand_water`. Without a retention curve water enters there as well as it leaves, so that soil
                never drains. Soil that may dry lets water out there, and takes in the rain of `rain`. Where soil
                ends at the border of the mesh there is no free surface, see `hold_pore_pressure`; implicit runs warn at the top.
            retention: retention curve of soil that dries under suction in implicit runs, or a list with one for each law (None
                where soil stays saturated): an object with functions ``saturation``, ``effective`` and
                ``relative_permeability`` of the suction [Pa], such as `fenics_bridge.water.VanGenuchten`. Effective stress is
                Bishop's, with the effective saturation; particles become lighter as they dry.
            anisotropy: conductivities along the axes over ``conductivity``, (D,), positive, or their tensor, (D, D), symmetric
                with positive principal values, of strata that dip for instance (`fenics_bridge.water.dipping`); or a list with
                one for each law (None for 1 in all directions). Axes are fixed in space.
            saturation: fraction of the pores that water fills as explicit runs begin [-], more than 0 and at most 1: less than 1
                in moist soil above the water table, which has the pressure of the ``suction_limit`` until its pores are full. As
                ``porosity``. The density of moist soil is that with its water. Where soil has a retention curve, this gives it.
            unit_weight: old way to give the density, which is ``unit_weight`` / 9.81 m/s2; for one version more.

        Raises:
            InputError: on all ranks, for values out of these ranges, or a model without particles.
        """

        def checked() -> tuple[Any, NDArray, NDArray, NDArray]:
            water = _core.PoreWater()
            water.density = density_of_water(density, unit_weight)
            if not modulus > 0:
                raise InputError(f"modulus is {modulus} Pa, expected a positive number, or infinity")
            water.modulus, water.kozeny_carman = float(modulus), bool(kozeny_carman)
            if not suction_limit >= 0:
                raise InputError(f"suction_limit is {suction_limit} Pa, expected 0 or more")
            water.suction_limit = float(suction_limit)
            water.drained_surface = bool(drained_surface)
            n, k = self._values("porosity", porosity), self._values("conductivity", conductivity)
            require_pores(n, k)
            filled = self._values("saturation", saturation)
            require_saturation(filled, water.suction_limit, retention)
            if self._core.has_two_phases and (filled < 1).any():
                raise InputError(
                    f"saturation is {filled.min()} after explicit(), by which water has a mass of its own; expected it before the first one"
                )
            self._set_retention(water, curves_of_laws(retention, self.laws))
            water.anisotropy = tensors_of_laws(anisotropy, len(self.laws), self.mesh.dim)
            if any(isinstance(law, _core.Undrained) for law in self.laws):
                raise InputError(
                    "laws has an Undrained law, which contains pore water already; expected laws of effective stress"
                )
            return water, n, k, filled

        if self.comm.allreduce(len(self.particles)) == 0:
            raise InputError("the model has no particles, expected them before add_water()")
        water, n, k, filled = collectively(self.comm, checked)
        is_moist = self.comm.allreduce(bool((filled < 1).any()) or len(self.particles.saturation) > 0, MPI.LOR)
        warn_of_water_density(self.comm, water.density)
        warn_of_pores(self.comm, water.modulus, self.comm.allreduce(float(k.max(initial=0.0)), MPI.MAX))
        self._core.water = water
        self.particles.set("porosity", n)
        self.particles.set("conductivity", k)
        self.particles.set("pore_pressure", np.where(filled < 1, -water.suction_limit, 0.0))
        self.particles.set("pressure_gradient", np.zeros((len(n), self.mesh.dim)))
        if water.may_dry or is_moist:
            self.particles.set("saturation", filled)
        self._set_water_conditions([])

    @property
    def has_water(self) -> bool:
        """Whether the pores of the particles hold water. Not collective."""
        return self._core.water is not None

    def wave_speeds(self) -> WaveSpeeds:
        """Speeds of the compression waves that the pore water makes fast, the largest over the particles. Collective.

        Raises:
            InputError: on all ranks, for a model without water.
        """
        self._require_water()
        p, water = self.particles, self._core.water
        n, volume = p.porosity, p.volume
        density, of_water = p.mass / volume, n * water.density
        if self._core.has_two_phases:
            density = density + p.water_mass / volume
        modulus = self.wave_moduli()[:, 0]
        undrained = (modulus + water.modulus / n) / density
        fast = [
            _core.fast_wave_squared(e, water.modulus, pores, rho - wet, wet)
            for e, pores, rho, wet in zip(modulus, n, density, of_water, strict=True)
        ]
        squared = (float(max(values, default=0.0)) for values in (undrained, fast))
        return WaveSpeeds(*(float(np.sqrt(self.comm.allreduce(value, MPI.MAX))) for value in squared))

    def _values(self, name: str, given: Field) -> NDArray[np.float64]:
        """Values of all particles of this rank: (n,)."""
        position = self.particles.position
        if isinstance(given, dict):
            tags, values = self.mesh.cell_tags[self.particles.cell], np.full(len(position), np.nan)
            for key, value in given.items():
                values[np.isin(tags, self.mesh.tags_of("cell", key))] = real_numbers(name, value)
            if np.isnan(values).any():
                raise InputError(f"{name} has no value for the cell tag {tags[np.isnan(values)][0]}")
            return values
        found = given(position) if callable(given) else given
        return at_points(name, found, len(position))

    def set_pore_pressure(self, pressure: float | Callable[[NDArray], ArrayLike]) -> None:
        """Give the particles pore pressures: those at the nodes, and linear in each cell.

        Where soil may dry its saturation and mass follow; where water moves by itself, its mass does, that of full pores. Moist soil
        (``saturation`` of `add_water`) keeps the pressure of the ``suction_limit`` until explicit runs begin.

        Args:
            pressure: [Pa], compression positive: a number, or a function of positions, shape (n, D), that returns shape (n,).

        Raises:
            InputError: on all ranks, for a model without water, or pressures that are not finite.
        """
        self._require_water()

        def at_nodes() -> NDArray[np.float64]:
            points = self.mesh.points
            found = pressure(points) if callable(pressure) else pressure
            return floats("pressure", at_points("pressure", found, len(points)), (len(points),))

        corners = self.mesh.cells[self.particles.cell]
        values = collectively(self.comm, at_nodes)[corners]
        x, position = self.mesh.points[corners], self.particles.position
        gradient = np.linalg.solve(x[:, 1:] - x[:, :1], (values[:, 1:] - values[:, :1])[..., None])[..., 0]
        found = values[:, 0] + np.einsum("pa,pa->p", gradient, position - x[:, 0])
        saturation, water = self.particles.saturation, self._core.water
        if len(saturation) and not water.may_dry:
            moist = saturation < 1
            found[moist], gradient[moist] = -water.suction_limit, 0.0
        self.particles.set("pore_pressure", found)
        self.particles.set("pressure_gradient", gradient)
        self.saturate()

    def averaged_pore_pressure(self) -> NDArray[np.float64]:
        """Pore pressures [Pa] that act on soil and water where `nmd=True` averages volumetric strains. Collective.

        In explicit steps these are the means of the cells' pressures over nodes, as forces take them. The pressures of particles
        may alternate from cell to cell besides, and are too low in the cells at a drained surface; neither does any work.

        Returns:
            Of the particles of this rank, shape (n,); the same for all in a cell.

        Raises:
            InputError: on all ranks, for a model without water.
        """
        self._require_water()
        return self._core.averaged_over_nodes(self.particles.pore_pressure)

    def saturate(self) -> None:
        """Give particles the saturation of their pressures, and the mass of the water that they then have.

        Needed after pressures were set as a field of particles. Nothing where soil stays saturated. Collective.

        Raises:
            InputError: on all ranks, for a model without water.
        """
        self._require_water()
        p, water = self.particles, self._core.water
        if not water.may_dry:
            return
        after = np.asarray(water.saturation(p.material, p.pore_pressure), dtype=float)
        pores = water.density * p.porosity * p.volume
        p.set("mass", p.mass + pores * (after - p.saturation))
        p.set("saturation", after)

    def stand_water(self, level: Value) -> None:
        """Let water stand over the free surface of the soil, wherever that is and however it moves.

        Its pressure is that of the pore water at the surface, where water enters or leaves, and presses on the soil. A further
        call changes the level. Along facets with a tag, at the sides of the mesh, use `hold_pore_pressure` besides.

        Args:
            level: of the water along the last axis [m]; a table lets it fall or rise. Gravity across that axis is left out.

        Raises:
            InputError: on all ranks, for a model whose free surface is not drained, or a level that is not finite.
        """
        self._set_surface("standing", "level", level)

    def rain(self, rate: Value) -> None:
        """Let rain fall on the free surface of soil that may dry, in implicit runs; what it cannot take runs off.

        Args:
            rate: on the horizontal [m/s], 0 or more; may be a table. A further call changes it.

        Raises:
            InputError: on all ranks, for a model without `retention` or with a free surface that is not drained, or a rate
                below zero.
        """
        self._require_water()
        if not self._core.water.may_dry:
            raise InputError(
                "the model has no retention curve, which says how rain enters; expected add_water(retention=...)"
            )
        self._set_surface("rain", "rate", rate, least=0.0)
        warn_of_rain(self.comm, max(value for _, value in self._core.water.rain))

    def _set_surface(self, entry: str, name: str, value: Value, least: float = -np.inf) -> None:
        self._require_water()
        history = collectively(self.comm, lambda: history_of(name, value, least))
        if not self._core.water.drained_surface:
            raise InputError(f"{name}: the free surface is not drained, expected add_water(drained_surface=True)")
        water = self._core.water
        setattr(water, entry, history)
        self._core.water = water
        self._set_water_conditions(self._water_conditions)

    def hold_pore_pressure(
        self, facet_tag: Tag, pressure: Value | None = None, *, level: Value | None = None, presses: bool | None = None
    ) -> None:
        """Prescribe the pore pressure at the nodes on facets with a tag, where water then enters or leaves.

        A further call changes it.

        Args:
            facet_tag: by number or name.
            pressure: [Pa], the same at all nodes; 0 where water leaves freely.
            level: height of standing water [m] along the last axis instead: below it the pressure of water with the density of
                the pore water, under the gravity along that axis; zero above, where soil that may dry is impervious. Both may be
                tables, ((time [s], value), ...).
            presses: whether this pressure also loads the surface of the soil, as a total stress, which standing water does; by
                default with ``level``.

        Raises:
            InputError: on all ranks, for a model without water, an unknown tag, both of pressure and level or none of them, or a
                number that is not finite.
        """
        self._require_water()

        def checked() -> tuple[tuple[int, ...], History, bool]:
            if (pressure is None) == (level is None):
                raise InputError(f"pressure is {pressure} and level is {level}, expected one of them")
            tags = self.mesh.tags_of("facet", facet_tag)
            if level is not None:
                return tags, history_of("level", level), presses is None or bool(presses)
            return tags, history_of("pressure", 0.0 if pressure is None else pressure), bool(presses)

        tags, value, loads = collectively(self.comm, checked)
        self._replace(tags, True, (value, level is not None, True, loads))

    def press_surface(self, facet_tag: Tag, pressure: float) -> None:
        """Load the soil at facets with a tag by a pressure, as a total stress at their nodes. A further call changes it.

        Unlike those of `traction`, its forces do not move with the particles; they act wherever soil is behind the facets.

        Args:
            facet_tag: by number or name.
            pressure: [Pa], compression positive.

        Raises:
            InputError: on all ranks, for a model without water, an unknown tag, or a pressure that is not finite.
        """
        self._require_water()
        tags, value = collectively(
            self.comm, lambda: (self.mesh.tags_of("facet", facet_tag), float(floats("pressure", pressure, ())))
        )
        self._replace(tags, False, ([(0.0, value)], False, False, True))

    def _replace(self, tags: tuple[int, ...], held: bool, values: tuple[History, bool, bool, bool]) -> None:
        """Replace the conditions at facets with these tags, of the pore water or of loads."""
        kept = [one for one in self._water_conditions if one[0] not in tags or one[3] != held]
        self._set_water_conditions([*kept, *((tag, *values) for tag in tags)])

    def seal(self, facet_tag: Tag) -> None:
        """Make facets with a tag impervious again.

        Raises:
            InputError: no pore pressure is prescribed there.
        """

        def remaining() -> list[WaterCondition]:
            tags = self.mesh.tags_of("facet", facet_tag)
            if not {one[0] for one in self._water_conditions if one[3]} >= set(tags):
                raise InputError(f"facet_tag {facet_tag!r} has no prescribed pore pressure")
            return [one for one in self._water_conditions if one[0] not in tags or not one[3]]

        self._set_water_conditions(collectively(self.comm, remaining))

    def water_volume(self) -> float:
        """Volume of the pores that water fills [m3], per metre or radian in two dimensions. Collective.

        What their pressure presses into the pores besides, p / K_w of it, counts as inflow and in the masses of particles.
        """
        self._require_water()
        p = self.particles
        pores = p.porosity * p.volume
        if self._core.has_two_phases:
            filled = np.minimum(pores, p.water_mass / self._core.water.density)
        else:
            filled = pores * filled_fraction(p)
        return self.comm.allreduce(float(np.sum(filled)))

    def water_inflow(self) -> float:
        """Water that has entered the soil since `add_water` [m3], as `water_volume`; negative where it left. Collective."""
        self._require_water()
        return self.comm.allreduce(self._core.water.inflow)

    def _set_water_conditions(self, conditions: list[WaterCondition]) -> None:
        water = self._core.water
        water.set_conditions(conditions)
        self._core.water, self._water_conditions = water, conditions

    def _set_retention(self, water: Any, curves: list[list[NDArray[np.float64]]]) -> None:
        water.set_retention([joined(values) for values in curves])
        self._retention = curves

    def _require_water(self) -> None:
        if self._core.water is None:
            raise InputError("the model has no pore water, expected add_water() before")

    def _check_water(self) -> None:
        """Refuse particles without pores, such as those seeded after `add_water`, or too light. Collective."""
        if self._core.water is not None:
            collectively(self.comm, lambda: require_soil(self))


def refuse_water(body: PoreWater, scheme: str) -> None:
    """Raises InputError where a scheme would leave the flow of the pore water out."""
    if body._core.water is not None:
        raise InputError(
            f"the model has pore water, whose flow {scheme} does not support; use implicit() by Newton's method"
        )
