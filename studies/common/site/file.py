"""A site as a TOML file: mesh, soils with their laws by name, supports by boundary, and stages of construction.

Example of a file:

    mesh = "embankment.geo"            # beside this file; or a .msh
    cell_size = 0.5                    # and other constants of the .geo file under [constants]
    axisymmetric = true                # the mesh is a half section about the axis x = 0; false by default
                                       # dimension = 3 for a body of tetrahedra

    [soils.clay]                       # a physical group of the mesh
    unit_weight = 17e3                 # N/m3
    k0 = 0.8                           # horizontal over vertical effective stress of soil that is there from the beginning; with
                                       # material = "hardening-soil" also overconsolidation = 2
    material = "tresca"                # and the parameters of the law, named as the options of the study slope
    young = 3e6
    cohesion = {value = 12e3, per_metre = 1.5e3, top = 3.0}    # grows with depth below the height `top`;
                                       # a strength may be a random field, see `site_fields`

    [soils.fill]
    unit_weight = 19e3
    python_law = "law.py:Sand"         # beside this file; or umat = "umat.so", properties, variables, strength_properties

    [supports]                         # by default base fixed, and left, right, front, back and sides on rollers
    base = "fixed"

    [[stages]]                         # for the studies embankment, excavation and safety
    name = "in situ"
    fill = ["clay"]

`site_keys` has all keys of such files, and `meshes/dike.toml` is an example for all studies.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI
from mpm_core.law_warnings import keeps_volume

import fenics_bridge as bridge
import mpm_core as mpm

from ..checks import say
from ..slope.case import GRAVITY
from ..stages.flow import with_steady_flow
from .doubts import warn_of_buoyant_weight, warn_of_pressures, warn_of_water
from .fields import SoilField, fields_of, values_of
from .hardening_doubts import k0_doubt
from .interfaces import fractions_of, in_stages, split_beside, weakened, with_ratios_beside
from .k0 import from_the_beginning, k0_of, overconsolidation_of
from .keys import CHANGES, STAGE_WATER, changes_of, member_of, part_of, read_site_table
from .law_doubts import DOUBTS
from .laws import (
    HISTORY,
    OVERCONSOLIDATION,
    idle_doubt,
    law_keys,
    left_out_doubt,
    located,
    numbers_of,
    unit_doubt,
    unit_weight_of,
)
from .member_doubts import warn_of_pulling_struts
from .mesh import check_soils, geometry_of, site_mesh
from .names import mistakes_in, require_soils
from .stages import stage_of, warn_of_held
from .strength import law_of_table, ratio_of, with_strength_ratios, without_history
from .supports import supports_of, supports_of_soil, warn_of_rigid_core


@dataclass
class Site:
    """A site as its file describes it, on its mesh.

    domain, cell_tags, facet_tags: the whole mesh, with cells that never hold soil; soils: names, in the file's order
    laws: by cell tag; unit_weight: by soil [N/m3]; supports: of `fenics_bridge`; stages: as for `carry_out`
    further_laws: those that come in by stages; members: structural ones by name, of stages; axisymmetric: whether it is a half section; stage_rows: stages as in the file
    random: parameters of soils that are random fields; k0: ratio of horizontal to vertical effective stress by soil, of those that have one
    overconsolidation: largest vertical effective stress before over that of the beginning by soil, of those that have one
    strength_ratio: undrained strength over vertical effective stress of the beginning by soil, of those that have one
    path: of the file, for messages
    """

    domain: Any
    cell_tags: Any
    facet_tags: Any
    soils: list[str]
    laws: dict[int, Any]
    unit_weight: dict[str, float]
    supports: list[bridge.Support]
    stages: list[bridge.Stage]
    further_laws: list[Any] = field(default_factory=list)
    axisymmetric: bool = False
    stage_rows: Sequence[dict[str, Any]] = ()
    members: dict[str, mpm.Member] = field(default_factory=dict)
    random: Sequence[SoilField] = ()
    k0: dict[str, float] = field(default_factory=dict)
    overconsolidation: dict[str, float] = field(default_factory=dict)
    strength_ratio: dict[str, bridge.StrengthRatio] = field(default_factory=dict)
    path: Path = Path()

    @property
    def dimension(self) -> int:
        """2 for a section, 3 for a body of tetrahedra."""
        return int(self.domain.topology.dim)

    @property
    def soils_with_strength_ratio(self) -> list[str]:
        """Soils whose undrained strength follows the vertical effective stress, from the beginning or by the law of a stage."""
        given = {key for stage in self.stages for key in stage.strength_ratio}
        return [
            soil
            for soil in self.soils
            if soil in {*self.strength_ratio, *given} or given.intersection(self.tags_of([soil]))
        ]

    @property
    def begins_at_rest(self) -> bool:
        """Whether it matters with which stresses its soils are there from the beginning."""
        return bool(self.k0 or self.overconsolidation)

    @property
    def geometry(self) -> mpm.Geometry | None:
        """Geometry of elements and particles; None for the one of the mesh's dimension."""
        return mpm.Geometry.AXISYMMETRIC if self.axisymmetric else None

    def finite_elements(self, degree: int, laws: dict[int, Any] | None = None, **options: Any) -> bridge.QuasiStatic:
        """Elements of all soils, with a law for each tag; options: further ones of `QuasiStatic`. Collective.

        Linear elements average volumetric strains where a soil of the site keeps its volume, unless `nmd` says otherwise. Without
        stages all structural members are there, in a site that begins at rest from `begin_at_rest` on.
        """
        options.setdefault("nmd", degree == 1 and keeps_volume([*self.laws.values(), *self.further_laws]))
        body, cell_tags, facet_tags = self.body()
        fem = bridge.QuasiStatic(
            body,
            laws or self.laws,
            facet_tags,
            supports_of_soil(self.supports, body, facet_tags),
            degree,
            cell_tags=cell_tags,
            geometry=self.geometry,
            **options,
        )
        self.vary(fem, laws or self.laws)
        if self.members and not self.stages and not self.begins_at_rest:
            with mistakes_in(self.path):
                fem.reconfigure(members=self.members)
        return fem

    def vary(self, fem: bridge.QuasiStatic, laws: dict[int, Any]) -> None:
        """Give the points of elements with these laws by cell tag the values of random fields. Collective."""
        of_point = np.repeat(np.array(list(laws))[fem.points.material], fem.points.per_cell)
        places = fem.points.coordinates()
        for name, values in values_of(self.random, places, of_point, self.tags_of, laws).items():
            fem.set_parameter(name, values)

    def body(self) -> tuple[Any, Any, Any]:
        """Domain, cell tags and facet tags of the soils alone. Collective."""
        return bridge.soil_mesh(self.domain, self.cell_tags, self.facet_tags, tag=self.soils)

    def model(self, more: Sequence[Any] = ()) -> tuple[mpm.Model, dict[int, int]]:
        """A model without particles on the whole mesh, and the number of the law of each tag; `more` laws last. Collective."""
        mesh = bridge.background_mesh(self.domain, self.cell_tags, self.facet_tags)
        laws = [*self.laws.values(), *self.further_laws, *more]
        return mpm.Model(mesh, laws, geometry=self.geometry), {tag: k for k, tag in enumerate(self.laws)}

    def particles(self, per_cell: int, laws: dict[int, Any] | None = None, more: Sequence[Any] = ()) -> mpm.Model:
        """A model with particles of all soils, unstressed, with weight and supports. Collective.

        Args:
            per_cell: particles in each cell.
            laws: by cell tag, instead of the site's; more: laws beside them, last.
        """
        mesh = bridge.background_mesh(self.domain, self.cell_tags, self.facet_tags)
        laws = laws or self.laws
        model, number = mpm.Model(mesh, [*laws.values(), *more], geometry=self.geometry), {
            tag: k for k, tag in enumerate(laws)
        }
        for soil, weight in self.unit_weight.items():
            for tag in mesh.tags_of("cell", soil):
                model.seed(density=weight / GRAVITY, per_cell=per_cell, cell_tag=tag, material=number[tag])
        p = model.particles
        of_particle = np.array(list(laws))[p.material]
        for name, values in values_of(self.random, p.position, of_particle, self.tags_of, laws).items():
            model.set_parameter(name, values)
        bridge.apply_supports(model, self.supports)
        model.set_gravity([0.0] * (mesh.dim - 1) + [-GRAVITY])
        return model

    def weaker_laws(self, factor: float) -> list[Any]:
        """All laws, those of stages last, with their strength divided by a factor; elastic soil beside others stays as it is."""
        laws = dict(enumerate([*self.laws.values(), *self.further_laws]))
        return list(bridge.reduced_strength(laws, factor).values())

    def require_no_fields(self, path: Path) -> None:
        """Raise InputError for random fields in the file of a study that has none."""
        if self.random:
            one = self.random[0]
            raise mpm.InputError(f"{path}: soils.{one.soil}: {one.parameter} is a random field; the studies safety, collapse, excavation, "
                                 "embankment, drawdown, rain and slope have them")  # fmt: skip

    def left_out_at_once(self) -> str:
        """A warning of what stages change beside placing soils, for a study that has all soils at once; else no text."""
        changes = changes_of(self.stage_rows, (*CHANGES, *STAGE_WATER))
        if not changes:
            return ""
        return (
            f"all soils are there at once, and what the stages of the site change is left out: {changes}; the study safety "
            "takes it into account in its factor by finite elements, and the study embankment in a slide (docs/howto/stages.md)"
        )

    def tags_of(self, soils: Sequence[str]) -> list[int]:
        """Cell tags of soils, whose laws they number.

        Raises:
            InputError: a soil is not one of the site's.
        """
        require_soils(soils, self.soils, str(self.path))
        names = bridge.names_of(self.cell_tags)
        return [tag for soil in soils for tag in names.get(soil, (soil,))]

    def load(self, factor: float = 1.0) -> bridge.Load:
        """The weights of all soils times a factor."""
        return bridge.Load({soil: factor * weight for soil, weight in self.unit_weight.items()})


def read_site(path: Path, comm: MPI.Comm, cell_size: float | None = None, needed: Sequence[str] = ()) -> Site:
    """Read a site and make its mesh; warns of water and loads that only other studies use. Collective.

    Args:
        path: of the TOML file.
        cell_size: [m], instead of the one in the file.
        needed: keys that the study needs besides mesh and soils.

    Raises:
        InputError: on all ranks, with the file, the key and what was expected.
    """
    table = read_site_table(path, needed)
    warn_of_water(table, path)
    warn_of_pressures(table, path)
    site = site_of(table, path, comm, cell_size)
    mesh = site.domain, site.cell_tags, site.facet_tags
    site.stages = with_steady_flow(mesh, site.stages, table, path, site.geometry)
    return site


def site_of(
    table: dict, path: Path, comm: MPI.Comm, cell_size: float | None = None, interfaces: bool | None = None
) -> Site:
    """The site that a table describes, as `read_site` has it from a file.

    Args:
        table: of the site.
        path: of the file, for its mesh and messages.
        comm: the ranks.
        cell_size: [m], instead of the one in the file.
        interfaces: whether soil beside walls has the strength of their interfaces from the beginning; None: while they are there.
    """
    axisymmetric = geometry_of(table, path) is not None
    domain, cell_tags, facet_tags = site_mesh(table, path, comm, cell_size)
    check_soils(table, path, cell_tags)
    if axisymmetric:
        warn_of_rigid_core(path, domain, facet_tags, table.get("supports") or None)
    soils, laws, weights = table["soils"], {}, {}
    k0, ratios = k0_of(soils, path), overconsolidation_of(soils, path)
    weak = {soil: ratio for soil, given in soils.items() if (ratio := ratio_of(given, f"{path}: soils.{soil}"))}
    random: list[SoilField] = []
    classes = _classes(table, path)
    for soil, given in soils.items():
        where = f"{path}: soils.{soil}"
        weights[soil] = unit_weight_of(given, where)
        parameters = located(part_of(given, law_keys()), path.parent)
        heights: dict[int, float] = {}
        fields, parameters = fields_of(soil, without_history(parameters), domain.topology.dim, where)
        random += fields
        if not set(parameters) - {"porosity"}:
            raise mpm.InputError(f"{where} has no law, which this study needs: material, and the parameters of the law")
        if any(isinstance(value, dict) for value in parameters.values()):
            cell_tags, heights = bridge.graded_tags(domain, cell_tags, soil, lambda x: x[:, -1], classes)
            own = {tag: law_of_table(parameters, height, where, fields) for tag, height in heights.items()}
        else:
            law = law_of_table(parameters, None, where, fields)
            own = dict.fromkeys(bridge.names_of(cell_tags).get(soil, (soil,)), law)
        laws |= own
        say(unit_doubt(parameters | numbers_of(given, HISTORY), where, heights.values()))
        with_history = part_of(given, (*law_keys(), OVERCONSOLIDATION))
        say(idle_doubt(with_history, where))
        say(left_out_doubt(with_history, where))
        one = next(iter(own.values()))
        for doubt in DOUBTS:
            say(doubt(one, where))
        say("" if soil in k0 else k0_doubt(one, ratios.get(soil, 1.0), where))
    others = {
        name: law_of_table(located(part_of(given, law_keys()), path.parent), None, f"{path}: laws.{name}")
        for name, given in table.get("laws", {}).items()
    }
    for name, given in table.get("laws", {}).items():
        for of_table in (unit_doubt, idle_doubt, left_out_doubt):
            say(of_table(given, f"{path}: laws.{name}"))
        for doubt in DOUBTS:
            say(doubt(others[name], f"{path}: laws.{name}"))
    members = {name: member_of(given, f"{path}: members.{name}") for name, given in table.get("members", {}).items()}
    _require_columns(members, path)
    _require_dimension(members, domain.topology.dim, path)
    rows, names = table.get("stages", []), {} if interfaces is False else fractions_of(table.get("members", {}), path)
    cell_tags, beside = split_beside(domain, cell_tags, laws, members, names)
    at_once = interfaces or (interfaces is None and not rows)
    laws = weakened(laws, beside, at_once)
    site = Site(domain, cell_tags, facet_tags, list(soils), laws, weights, supports_of(table, path, domain, facet_tags), [],
                list(others.values()), axisymmetric, rows, members, random, k0, ratios, weak, path)  # fmt: skip
    site.stages = [stage_of(given, k, site, others, path) for k, given in enumerate(rows)]
    warn_of_held(site.stages, path)
    if beside.walls and not at_once:
        site.stages, further = in_stages(site.stages, laws, beside, lambda soil: site.tags_of([soil]))
        site.further_laws += further
    absent = [name for name in members if rows and not any(name in stage.install for stage in site.stages)]
    if absent:
        say(
            f"{path}: no stage installs {', '.join(map(repr, absent))}, which therefore is not there; name it in install of a stage"
        )
    placed = {soil for stage in site.stages for soil in stage.fill}
    left = {soil: weight for soil, weight in weights.items() if soil not in placed}
    begins_later = bool(rows and left and "day" in rows[0])
    if begins_later:  # what these stages do not place is there before them
        site.stages[0] = replace(site.stages[0], reset_displacement=True)
        site.stages.insert(0, bridge.Stage("beginning", fill=list(left), unit_weight=left))
    elif rows and left:
        names = ", ".join(map(repr, left))
        say(
            f"{path}: no stage fills the cells of {names}, which therefore hold no soil; name it in fill of a stage where it is there"
        )
    warn_of_buoyant_weight(weights, rows, path)
    warn_of_pulling_struts(site)
    site.stages = from_the_beginning(site.stages, site, begins_later or not rows or "day" not in rows[0], path)
    site.stages = with_strength_ratios(site.stages, site, table.get("laws", {}), path)
    if beside.walls:
        site.stages = with_ratios_beside(site.stages, site.laws, beside, lambda soil: site.tags_of([soil]))
    return site


def _classes(table: Mapping[str, Any], path: Path) -> int:
    """Number of steps of parameters that grow with depth; path: of the file, for the error."""
    classes = table.get("classes", 20)
    if not isinstance(classes, int) or isinstance(classes, bool) or classes < 1:
        raise mpm.InputError(f"{path}: classes is {classes!r}, expected a whole number from 1 on")
    return classes


def _require_dimension(members: Mapping[str, mpm.Member], dim: int, path: Path) -> None:
    """Require that the points of members have as many coordinates as those of the mesh; path: of the file, for the error."""
    for name, member in members.items():
        if member.dim != dim:
            raise mpm.InputError(
                f"{path}: members.{name}: its points have {member.dim} coordinates, expected {dim}, as dimension is {dim} in the file of the site"
            )


def _require_columns(members: Collection[str], path: Path) -> None:
    """Require that no two members have the same columns in tables, where spaces become underscores."""
    first: dict[str, str] = {}
    for name in members:
        other = first.setdefault(name.replace(" ", "_"), name)
        if other != name:
            raise mpm.InputError(
                f"{path}: members: {other!r} and {name!r} would have the same columns in tables, expected other names"
            )
