"""Stages of construction: one list of them for finite elements and for quasi-static particles."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from fenics_bridge.errors import InputError, agree
from fenics_bridge.fem.k0 import surface_height
from mpm_core import _core
from mpm_core.checks import renamed


@dataclass(frozen=True)
class Stage:
    """What changes in a stage of construction; everything else stays as it is.

    Soils and boundaries are given by name, or by number, as they are in the mesh.

    name: for messages and reports
    fill: soils that are placed, free of stress at the moment when they are placed
    excavate: soils that are taken away
    law: {soil: law} in force from now on; state variables of the soil are reset, its stress stays
    unit_weight: {soil: [N/m3]} from now on; every soil needs one when it is placed
    pressure: {boundary: [Pa]} on what is there, compression positive, from now on; 0 takes it away
    support: supports (`fixed`, `roller`, `prescribed`) that begin to hold, from where the nodes are now
    release: boundaries whose supports are taken away
    pore_pressure: function of positions (n, D) [m] that returns pore pressures (n,) [Pa], e.g. `hydrostatic(2.0)`; None
        leaves them as they are. Stresses of laws are effective then, unit weights are those of the saturated soil, and
        water also presses on the surface of the soil where there is pore pressure at it.
    stress: function of positions that returns the stresses (n, S) [Pa] with which the soils of `fill` come, e.g. by K0
    reset_displacement: displacements count from the beginning of this stage
    """

    name: str
    fill: tuple = ()
    excavate: tuple = ()
    law: dict = field(default_factory=dict)
    unit_weight: dict = field(default_factory=dict)
    pressure: dict = field(default_factory=dict)
    support: tuple = ()
    release: tuple = ()
    pore_pressure: Callable | None = None
    stress: Callable | None = None
    reset_displacement: bool = False

    def __post_init__(self):
        for name in ("fill", "excavate", "release", "support"):
            value = getattr(self, name)
            single = isinstance(value, (str, int)) or not hasattr(value, "__iter__")
            object.__setattr__(self, name, (value,) if single else tuple(value))


@dataclass(frozen=True)
class StageReport:
    """How a stage went.

    number: from 1 on; name: of the stage; steps: steps that were tried; iterations: of Newton's method over all of them
    largest_displacement: of a node, or of a particle, since displacements count [m]
    """

    number: int
    name: str
    steps: int
    iterations: int
    largest_displacement: float


class StageError(RuntimeError):
    """A stage has no equilibrium; the message names the stage, the fraction reached, the place and law of failure, and a remedy.

    fraction: of the stage's change that is in equilibrium [-]; the model stays in that state
    """

    def __init__(self, message, fraction):
        super().__init__(message)
        self.fraction = fraction

    share = renamed("share", "fraction")


def hydrostatic(level, unit_weight=9.81e3):
    """Pore pressure of water at rest below a level, zero above it, as a function of positions (n, D).

    level: height [m], polyline (k, 2) of points (x, y), or function of horizontal coordinates, as in `k0_stress`
    unit_weight: of water [N/m3]
    """
    if not (np.isfinite(unit_weight) and unit_weight >= 0):
        raise InputError(f"unit_weight: got {unit_weight!r} N/m3, expected a number from 0 on")
    return lambda x: unit_weight * np.maximum(surface_height(level, x) - x[:, -1], 0.0)


def carry_out(site, stages):
    """Carry out stages one after the other: a generator of StageReports, each when its stage is in equilibrium.

    site: `FemSite` or `ParticleSite`, whatever the stages before have made of it
    Raises InputError, on all ranks, for a stage that asks for what is not there; StageError for one without equilibrium.

    Example:
        >>> stages = [
        ...     bridge.Stage("in situ", fill="clay", unit_weight={"clay": 17e3}),
        ...     bridge.Stage("layer 1", fill="layer 1", unit_weight={"layer 1": 20e3}, reset_displacement=True),
        ... ]
        >>> for report in bridge.carry_out(bridge.FemSite(fem), stages):
        ...     print(report.name, report.largest_displacement)
    """
    for stage in stages:
        yield site.carry_out(stage)


class SiteState:
    """What holds at a site beside stresses: which soils are there, their laws and weights, loads, supports, water.

    All by the numbers of tags. `after(stage)` is the state that a stage leads to; it raises InputError, on all ranks.
    there: soils that are there; law, unit_weight: by soil; pressure: by boundary; supports: {boundary: Support}
    """

    def __init__(self, comm, cells_of, facets_of, name_of, supports=()):
        """cells_of, facets_of: functions of (name or number, argument) that give the numbers of tags, or raise.

        name_of: function of a soil's tag that gives its name for messages
        """
        self._comm, self._cells_of, self._facets_of, self._name_of = comm, cells_of, facets_of, name_of
        self.there: tuple[int, ...] = ()
        self.law: dict = {}
        self.unit_weight: dict = {}
        self.pressure: dict = {}
        self.supports, self.pore_pressure = tuple(supports), None

    def after(self, stage):
        """The state that a stage leads to, and the soils that it places and takes away, as numbers of tags. Collective."""
        new = object.__new__(SiteState)
        new.__dict__.update(self.__dict__)
        where = f"stage {stage.name!r}: "
        fill, excavate = (self._numbers(where + name, getattr(stage, name)) for name in ("fill", "excavate"))
        there = set(self.there)
        wrong = None
        wrong = next((f"{where}fill: {stage.fill!r} is there already" for tag in fill if tag in there), wrong)
        wrong = next(
            (f"{where}excavate: {stage.excavate!r} is not there" for tag in excavate if tag not in there), wrong
        )
        agree(self._comm, wrong)
        new.there = tuple(sorted(there.difference(excavate).union(fill)))
        agree(self._comm, None if new.there else f"{where}excavate: no soil is left")
        agree(self._comm, _wrong_value(stage, where))
        new.law = self.law | self._by_soil(where + "law", stage.law)
        new.unit_weight = self.unit_weight | self._by_soil(where + "unit_weight", stage.unit_weight)
        without = [tag for tag in new.there if tag not in new.unit_weight]
        agree(self._comm, f"{where}unit_weight: the soil {self._name_of(without[0])} has none" if without else None)
        pressure = {n: p for key, p in stage.pressure.items() for n in self._facets_of(key, where + "pressure")}
        new.pressure = {tag: p for tag, p in (self.pressure | pressure).items() if p != 0}
        new.supports = self._supports_after(stage, where)
        if stage.pore_pressure is not None:
            new.pore_pressure = stage.pore_pressure
        return new, fill, excavate

    def _supports_after(self, stage, where):
        held = {n for support in self.supports for n in self._facets_of(support.facet_tag, where + "support")}
        gone = {n for tag in stage.release for n in self._facets_of(tag, where + "release")}
        wrong = gone - held
        agree(self._comm, f"{where}release: {stage.release!r} names a boundary without support" if wrong else None)
        # What was prescribed in an earlier stage has happened, and is held now.
        kept = [replace(s, displacement=s.displacement and tuple(v and 0.0 for v in s.displacement))
                for s in self.supports if not gone.issuperset(self._facets_of(s.facet_tag, where + "support"))]  # fmt: skip
        for support in stage.support:
            self._facets_of(support.facet_tag, where + "support")
        return (*kept, *stage.support)

    def _numbers(self, argument, names):
        return tuple(dict.fromkeys(n for name in names for n in self._cells_of(name, argument)))

    def _by_soil(self, argument, given):
        return {number: value for key, value in given.items() for number in self._cells_of(key, argument)}


def _wrong_value(stage, where):
    """What is wrong with the values of a stage; None for nothing."""
    for name in ("unit_weight", "pressure"):
        for key, value in getattr(stage, name).items():
            if not (np.isscalar(value) and np.isfinite(value)):
                return f"{where}{name}: got {value!r} for {key!r}, expected a finite number"
    for key, law in stage.law.items():
        if not isinstance(law, tuple(_core.law_types)):
            return f"{where}law: got {law!r} for {key!r}, expected a constitutive law such as MohrCoulomb(...)"
    return None
