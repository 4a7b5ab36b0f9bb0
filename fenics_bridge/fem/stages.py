"""Stages of construction: the same list serves finite elements and quasi-static particles."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI
from mpm_core.checks import renamed
from mpm_core.input_warnings import warn_of_water_weight
from mpm_core.members import Member

from fenics_bridge.errors import InputError, agree, is_finite
from fenics_bridge.fem.deconfinement import wrong_deconfinement
from fenics_bridge.fem.k0 import LARGEST_K0, Surface, surface_height
from fenics_bridge.fem.overconsolidation import LARGEST, require_history
from fenics_bridge.fem.strength_ratio import StrengthRatio, require_cohesive
from fenics_bridge.fem.supports import Support
from fenics_bridge.types import Law, OfPosition
from mpm_core import _core

if TYPE_CHECKING:
    from fenics_bridge.fem.fem_site import FemSite
    from fenics_bridge.transfer.particle_site import ParticleSite


@dataclass(frozen=True)
class Stage:
    """Changes in a stage of construction; everything else stays as it is.

    Soils and boundaries are given by name, or by number, as they are in the mesh.
    """

    name: str
    """For messages and reports"""
    fill: Any = ()
    """Soils that are placed, one or several, free of stress at the moment when they are placed"""
    excavate: Any = ()
    """Soils that are removed, one or several"""
    law: dict[int | str, Law] = field(default_factory=dict)
    """Laws by soil, in force from now on; state variables of the soil are reset, its stress stays"""
    unit_weight: dict[int | str, float] = field(default_factory=dict)
    """Unit weights [N/m3] by soil, from now on; every soil needs one when it is placed"""
    pressure: dict[int | str, float] = field(default_factory=dict)
    """Pressures [Pa] by boundary on the soil that is there, compression positive, from now on; 0 removes one"""
    support: Any = ()
    """Supports (`fixed`, `roller`, `prescribed`), one or several, that begin to hold, from where the nodes are now"""
    release: Any = ()
    """Boundaries, one or several, whose supports are removed; a support of several boundaries stays at the others"""
    pore_pressure: OfPosition | None = None
    """Function of positions (n, D) [m] that returns pore pressures (n,) [Pa], e.g. `hydrostatic(2.0)`; None leaves them as they
    are. Stresses of laws are effective then, unit weights are those of the saturated soil, and water also presses on the surface
    of the soil where there is pore pressure at it"""
    stress: OfPosition | None = None
    """Function of positions (n, D) [m] that returns the stresses (n, S) [Pa] with which the soils of `fill` come, e.g. by K0"""
    k0: dict[int | str, float] = field(default_factory=dict)
    """K0 by soil of `fill`, instead of `stress`: these soils come with stresses in equilibrium under their weight, whose horizontal part is K0
    times the vertical one, both effective; in axial symmetry that along the radius and that around the axis"""
    overconsolidation: dict[int | str, float] = field(default_factory=dict)
    """Overconsolidation ratio by soil of `fill`, whose law is HardeningSoil: at the end of this stage the soil has the hardening of ground that
    has been normally consolidated to so many times its vertical effective stress"""
    strength_ratio: dict[int | str, StrengthRatio] = field(default_factory=dict)
    """Undrained strength over vertical effective stress by soil, whose law is from now on one without friction that varies in its cohesion. The
    stress is that at the beginning of the stage, and of soils of `fill`, which need `k0`, the one with which they come"""
    reset_displacement: bool = False
    """Whether displacements count from the beginning of this stage"""
    install: dict[str, Member] = field(default_factory=dict)
    """Structural members (`mpm_core.bar`, `strut`, `beam`) by the name of each, without strain when they are installed. A prestress
    is that at the end of this stage; from the next one on the force follows the deformation"""
    remove: Any = ()
    """Names of members, one or several, that are taken out"""
    deconfinement: float = 1.0
    """Fraction of the out-of-balance forces of this stage that it releases, above 0; the next stage releases what is still held with its own"""

    def __post_init__(self) -> None:
        for name in ("fill", "excavate", "release", "support", "remove"):
            value = getattr(self, name)
            single = isinstance(value, (str, int)) or not hasattr(value, "__iter__")
            object.__setattr__(self, name, (value,) if single else tuple(value))


@dataclass(frozen=True)
class StageReport:
    """Result of a stage."""

    number: int
    """Number of the stage, from 1 on"""
    name: str
    """Name of the stage"""
    steps: int
    """Steps that were tried"""
    iterations: int
    """Iterations of Newton's method over all of them"""
    largest_displacement: float
    """Largest displacement of a node, or of a particle, since displacements count [m]"""

    def __repr__(self) -> str:
        return (
            f"<StageReport {self.number} {self.name!r}: {self.steps} steps, {self.iterations} iterations; largest displacement "
            f"{self.largest_displacement:.4g} m>"
        )


class StageError(RuntimeError):
    """A stage has no equilibrium; the message names the stage, the fraction reached, the place and law of failure, and a remedy.

    Args:
        message: the message.
        fraction: fraction of the stage's change that is in equilibrium [-].
    """

    def __init__(self, message: str, fraction: float) -> None:
        super().__init__(message)
        self.fraction = fraction
        """Fraction of the stage's change that is in equilibrium [-]; the model stays in that state"""

    share = renamed("share", "fraction")


def hydrostatic(level: Surface, unit_weight: float = 9.81e3) -> OfPosition:
    """Pore pressure of water at rest below a level, zero above it.

    Args:
        level: height [m], polyline (k, 2) of points (x, y) [m], or function of horizontal coordinates, as for `k0_stress`.
        unit_weight: unit weight of water [N/m3].

    Returns:
        Function of positions (n, D) [m] that returns pore pressures (n,) [Pa].

    Raises:
        InputError: unit_weight is negative or not finite, or level of another shape.
    """
    if not callable(level):
        surface_height(level, np.zeros((0, 2)), "level")
    if not (is_finite(unit_weight) and unit_weight >= 0):
        raise InputError(f"unit_weight is {unit_weight!r} N/m3, expected a number from 0 on")
    warn_of_water_weight(MPI.COMM_WORLD, unit_weight)
    return lambda x: unit_weight * np.maximum(surface_height(level, x, "level") - x[:, -1], 0.0)


def carry_out(site: FemSite | ParticleSite, stages: Iterable[Stage]) -> Iterator[StageReport]:
    """Carry out stages one after the other. Collective.

    Args:
        site: finite elements or particles, in the state to which earlier stages have brought them.
        stages: the stages.

    Yields:
        Report of each stage when it is in equilibrium.

    Raises:
        InputError: a stage names a soil or boundary that does not exist, or one of a sequence cannot follow those before it; of a
            sequence before the first stage is computed. Raised on all ranks alike.
        StageError: a stage has no equilibrium.

    Example:
        >>> stages = [
        ...     bridge.Stage("in situ", fill="clay", unit_weight={"clay": 17e3}),
        ...     bridge.Stage("layer 1", fill="layer 1", unit_weight={"layer 1": 20e3}, reset_displacement=True),
        ... ]
        >>> for report in bridge.carry_out(bridge.FemSite(fem), stages):
        ...     print(report.name, report.largest_displacement)
    """
    if isinstance(stages, Stage) or not hasattr(site, "carry_out"):
        raise InputError(
            f"site is a {type(site).__name__} and stages a {type(stages).__name__}, expected a FemSite or ParticleSite and a list"
        )
    if isinstance(stages, Sequence):
        require_stages(site, stages)
    for stage in stages:
        yield site.carry_out(stage)


def require_stages(site: FemSite | ParticleSite, stages: Sequence[Stage]) -> None:
    """Go through stages without computing them. Collective.

    Raises:
        InputError: of the first stage that names what does not exist, or that those before it do not allow, as one that removes
            soil that is not there. Raised on all ranks alike.
    """
    state = site.state
    for stage in stages:
        state, _, _ = state.after(stage)


class SiteState:
    """The state of a site except for its stresses: the soils that are present, their laws and weights, loads, supports and water.

    All by the numbers of tags. `after(stage)` is the state that a stage leads to.

    Args:
        comm: the ranks that share the site.
        cells_of: function of a soil (name or number) and of the name of an argument that gives the numbers of its tags, or
            raises.
        facets_of: the same for boundaries.
        name_of: function of a soil's tag that gives its name for messages.
        supports: boundary conditions at the start.
        require_members: function of a stage's name for messages, tags that are there and members by name, which raises where a member is
            in no soil.
    """

    def __init__(
        self,
        comm: MPI.Comm,
        cells_of: Callable[[Any, str], Sequence[int]],
        facets_of: Callable[[Any, str], Sequence[int]],
        name_of: Callable[[int], str],
        supports: Sequence[Support] = (),
        require_members: Callable[[str, Sequence[int], dict[str, Member]], None] | None = None,
    ) -> None:
        self._comm, self._cells_of, self._facets_of, self._name_of = comm, cells_of, facets_of, name_of
        self._require_members = require_members
        self.there: tuple[int, ...] = ()
        """Tags of the soils that are there"""
        self.law: dict = {}
        """Laws by soil, where stages gave them"""
        self.unit_weight: dict = {}
        """Unit weights by soil [N/m3]"""
        self.pressure: dict = {}
        """Pressures by boundary [Pa]"""
        self.supports = tuple(supports)
        """The boundary conditions in force"""
        self.pore_pressure: OfPosition | None = None
        """Function of positions that returns pore pressures [Pa]"""
        self.members: dict[str, Member] = {}
        """Structural members that are there, by name"""

    def after(self, stage: Stage) -> tuple[SiteState, tuple[int, ...], tuple[int, ...]]:
        """The state that a stage leads to. Collective.

        Args:
            stage: the changes.

        Returns:
            The new state, and the tags of the soils that are placed and of those that are removed.

        Raises:
            InputError: the stage has an unknown soil or boundary, or a value out of range. Raised on all ranks alike.
        """
        new = object.__new__(SiteState)
        new.__dict__.update(self.__dict__)
        where = f"stage {stage.name!r}: "
        fill, excavate = (self._numbers(where + name, getattr(stage, name)) for name in ("fill", "excavate"))
        there = set(self.there)
        wrong = None
        name = self._name_of
        wrong = next((f"{where}fill: the soil {name(tag)} is there already" for tag in fill if tag in there), wrong)
        wrong = next(
            (f"{where}excavate: the soil {name(tag)} is not there" for tag in excavate if tag not in there), wrong
        )
        agree(self._comm, wrong)
        new.there = tuple(sorted(there.difference(excavate).union(fill)))
        agree(self._comm, None if new.there else f"{where}excavate: no soil is left")
        agree(self._comm, _wrong_value(stage, where) or _wrong_member(stage, where, self.members))
        new.law = self.law | self._by_soil(where + "law", stage.law)
        new.unit_weight = self.unit_weight | self._by_soil(where + "unit_weight", stage.unit_weight)
        for argument in ("k0", "overconsolidation"):
            soils = getattr(stage, argument)
            other = next((s for s in soils if set(self._cells_of(s, where + argument)).difference(fill)), None)
            wrong = None if other is None else f"{where}{argument} is given for {other!r}, expected a soil of fill"
            agree(self._comm, wrong)
        weak, k0 = self._by_soil(where + "strength_ratio", stage.strength_ratio), self.k0_of(stage)
        absent = next((tag for tag in weak if tag not in new.there), None)
        agree(self._comm, None if absent is None else f"{where}strength_ratio: the soil {name(absent)} is not there")
        bare = next((tag for tag in weak if tag in fill and tag not in k0), None)
        wrong = "comes without stress, expected k0 for it, or its strength_ratio in a later stage"
        agree(self._comm, None if bare is None else f"{where}strength_ratio: the soil {name(bare)} {wrong}")
        without = [tag for tag in new.there if tag not in new.unit_weight]
        agree(self._comm, f"{where}unit_weight: the soil {self._name_of(without[0])} has none" if without else None)
        pressure = {n: p for key, p in stage.pressure.items() for n in self._facets_of(key, where + "pressure")}
        new.pressure = {tag: p for tag, p in (self.pressure | pressure).items() if p != 0}
        new.supports = self._supports_after(stage, where)
        new.members = {name: one for name, one in self.members.items() if name not in stage.remove} | stage.install
        if new.members and self._require_members is not None:
            self._require_members(where, new.there, new.members)
        if stage.pore_pressure is not None:
            new.pore_pressure = stage.pore_pressure
        return new, fill, excavate

    def at(self, other: SiteState) -> SiteState:
        """The state of another site with the same tags, on the mesh of this one."""
        new = object.__new__(SiteState)
        own = ("_comm", "_cells_of", "_facets_of", "_name_of", "_require_members")
        new.__dict__.update({**other.__dict__, **{name: getattr(self, name) for name in own}})
        return new

    def _supports_after(self, stage: Stage, where: str) -> Any:
        held = {n for support in self.supports for n in self._facets_of(support.facet_tag, where + "support")}
        gone = {n for tag in stage.release for n in self._facets_of(tag, where + "release")}
        wrong = gone - held
        agree(self._comm, f"{where}release: {stage.release!r} names a boundary without support" if wrong else None)
        kept: list[Support] = []
        for support in self.supports:
            numbers = self._facets_of(support.facet_tag, where + "support")
            left: list[int | str] = [number for number in numbers if number not in gone]
            tags: list[int | str] = [support.facet_tag] if len(left) == len(numbers) else left
            # What was prescribed in an earlier stage has happened, and is held now.
            held_now = support.displacement and tuple(v and 0.0 for v in support.displacement)
            kept += [replace(support, facet_tag=tag, displacement=held_now) for tag in tags]
        for support in stage.support:
            self._facets_of(support.facet_tag, where + "support")
        return (*kept, *stage.support)

    def k0_of(self, stage: Stage) -> dict[int, float]:
        """K0 of the soils that a stage places, by their tags."""
        return self._by_soil(f"stage {stage.name!r}: k0", stage.k0)

    def overconsolidation_of(self, stage: Stage, laws: Mapping[int, Law]) -> dict[int, float]:
        """Overconsolidation ratios of the soils that a stage places, by their tags. Collective.

        Args:
            stage: the stage.
            laws: laws by cell tag, of these soils at least.

        Raises:
            InputError: the law of a soil has no memory of it, or soil of CamClay has neither K0 nor stresses. Raised on all ranks alike.
        """
        where = f"stage {stage.name!r}: "
        ratios = self._by_soil(where + "overconsolidation", stage.overconsolidation)
        stressed = self.k0_of(stage) if stage.stress is None else ratios
        require_history(self._comm, where, laws, ratios, self._name_of, stressed)
        return ratios

    def strength_ratio_of(self, stage: Stage, laws: Mapping[int, Law]) -> dict[int, StrengthRatio]:
        """Strength ratios that a stage gives, by the tags of their soils. Collective.

        Args:
            stage: the stage.
            laws: laws by cell tag from this stage on, of these soils at least.

        Raises:
            InputError: the law of a soil has another strength. Raised on all ranks alike.
        """
        where = f"stage {stage.name!r}: "
        ratios = self._by_soil(where + "strength_ratio", stage.strength_ratio)
        require_cohesive(self._comm, where, laws, ratios, self._name_of)
        return ratios

    def _numbers(self, argument: str, names: Any) -> Any:
        return tuple(dict.fromkeys(n for name in names for n in self._cells_of(name, argument)))

    def _by_soil(self, argument: str, given: Any) -> Any:
        return {number: value for key, value in given.items() for number in self._cells_of(key, argument)}


def _wrong_member(stage: Stage, where: str, there: Mapping[str, Member]) -> str | None:
    """Error in the members that a stage installs and removes; None without an error."""
    if not isinstance(stage.install, dict) or not all(isinstance(one, Member) for one in stage.install.values()):
        return f"{where}install is {stage.install!r}, expected a dictionary of what `bar`, `strut` and `beam` return, by name"
    for name in stage.remove:
        if name not in there:
            return f"{where}remove: there is no member {name!r}, expected one of {list(there)}"
    again = next((name for name in stage.install if name in there and name not in stage.remove), None)
    return None if again is None else f"{where}install: the member {again!r} is there already"


def _wrong_value(stage: Stage, where: str) -> str | None:
    """Error in the values of a stage; None without an error."""
    for name in ("unit_weight", "pressure", "law", "k0", "overconsolidation", "strength_ratio"):
        if not isinstance(getattr(stage, name), dict):
            what = "boundary" if name == "pressure" else "soil"
            return f"{where}{name} is {getattr(stage, name)!r}, expected a dictionary by {what}"
    for support in stage.support:
        if not isinstance(support, Support):
            return f"{where}support is {support!r}, expected what `fixed`, `roller` and `prescribed` return"
    for name in ("pore_pressure", "stress"):
        if not (getattr(stage, name) is None or callable(getattr(stage, name))):
            return f"{where}{name} is {getattr(stage, name)!r}, expected a function of positions"
    for name in ("unit_weight", "pressure"):
        for key, value in getattr(stage, name).items():
            if not is_finite(value):
                return f"{where}{name} is {value!r} for {key!r}, expected a finite number"
    for key, value in stage.k0.items():
        if not (is_finite(value) and 0 < value <= LARGEST_K0):
            return (
                f"{where}k0 is {value!r} for {key!r}, expected a number above 0 and up to {LARGEST_K0:g}, such as 0.5"
            )
    for key, value in stage.overconsolidation.items():
        if not (is_finite(value) and 1 <= value <= LARGEST):
            return (
                f"{where}overconsolidation is {value!r} for {key!r}, expected a ratio from 1 to {LARGEST:g}, such as 2"
            )
    for key, value in stage.strength_ratio.items():
        if not isinstance(value, StrengthRatio):
            return f"{where}strength_ratio is {value!r} for {key!r}, expected a StrengthRatio"
    if stage.k0 and stage.stress is not None:
        return f"{where}stress and k0 are given, expected one of them"
    for key, law in stage.law.items():
        if not isinstance(law, tuple(_core.law_types)):
            return f"{where}law is {law!r} for {key!r}, expected a constitutive law such as MohrCoulomb(...)"
    return wrong_deconfinement(stage, where)
