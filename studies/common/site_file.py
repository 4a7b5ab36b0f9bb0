"""A site as a TOML file: mesh, soils with their laws by name, supports by boundary, and stages of construction.

Example of a file:

    mesh = "embankment.geo"            # beside this file; or a .msh
    cell_size = 0.5                    # and other constants of the .geo file under [constants]
    axisymmetric = true                # the mesh is a half section about the axis x = 0; false by default

    [soils.clay]                       # a physical group of the mesh
    unit_weight = 17e3                 # N/m3
    material = "tresca"                # and the parameters of the law, named as the options of the study slope
    young = 3e6
    cohesion = {value = 12e3, per_metre = 1.5e3, top = 3.0}    # grows with depth below the height `top`

    [soils.fill]
    unit_weight = 19e3
    python_law = "law.py:Sand"         # beside this file; or umat = "umat.so", properties, variables, strength_properties

    [supports]                         # by default base fixed, and left, right and sides on rollers
    base = "fixed"

    [[stages]]                         # for the studies embankment and excavation
    name = "in situ"
    fill = ["clay"]
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import tomllib
from mpi4py import MPI
from mpm_core.law_warnings import keeps_volume

import fenics_bridge as bridge
import mpm_core as mpm

from .options import add_number, study_parser
from .parameters import ParameterError, checked_values
from .slope_case import GRAVITY, add_soil_options
from .soils import add_law_options, law_of

KEYS = ("mesh", "cell_size", "axisymmetric", "constants", "soils", "laws", "supports", "stages", "classes")
STAGE_KEYS = (
    "name", "fill", "excavate", "law", "unit_weight", "pressure", "support", "release", "water_level", "reset_displacement"
)  # fmt: skip
DEFAULT_SUPPORTS = {"base": "fixed", "left": "roller", "right": "roller", "sides": "roller"}


@dataclass
class Site:
    """A site as its file describes it, on its mesh.

    domain, cell_tags, facet_tags: the whole mesh, with cells that never hold soil; soils: names, in the file's order
    laws: by cell tag; unit_weight: by soil [N/m3]; supports: of `fenics_bridge`; stages: as for `carry_out`
    further_laws: those that come in by stages; axisymmetric: whether it is a half section
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

    @property
    def geometry(self) -> mpm.Geometry | None:
        """Geometry of elements and particles; None for the one of the mesh's dimension."""
        return mpm.Geometry.AXISYMMETRIC if self.axisymmetric else None

    def finite_elements(self, degree: int, laws: dict[int, Any] | None = None, **options: Any) -> bridge.QuasiStatic:
        """Elements of all soils, with a law for each tag; options: further ones of `QuasiStatic`. Collective.

        Linear elements average volumetric strains where a soil of the site keeps its volume, unless `nmd` says otherwise.
        """
        options.setdefault("nmd", degree == 1 and keeps_volume([*self.laws.values(), *self.further_laws]))
        body, cell_tags, facet_tags = bridge.soil_mesh(self.domain, self.cell_tags, self.facet_tags, tag=self.soils)
        return bridge.QuasiStatic(
            body,
            laws or self.laws,
            facet_tags,
            self.supports,
            degree,
            cell_tags=cell_tags,
            geometry=self.geometry,
            **options,
        )

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
        bridge.apply_supports(model, self.supports)
        model.set_gravity([0.0] * (mesh.dim - 1) + [-GRAVITY])
        return model

    def weaker_laws(self, factor: float) -> list[Any]:
        """All laws, those of stages last, with their strength divided by a factor; elastic soil beside others stays as it is."""
        laws = dict(enumerate([*self.laws.values(), *self.further_laws]))
        return list(bridge.reduced_strength(laws, factor).values())

    def left_out_at_once(self) -> str:
        """A warning of what stages change beside placing soils, for a study that has all soils at once; else no text."""
        found = []
        for stage in self.stages:
            weights = [
                weight for soil, weight in stage.unit_weight.items() if weight != self.unit_weight.get(str(soil))
            ]
            changes = {"excavate": stage.excavate, "law": stage.law, "unit_weight": weights, "pressure": stage.pressure,
                       "support": stage.support, "release": stage.release, "water_level": stage.pore_pressure}  # fmt: skip
            found += [f"{key} of {stage.name!r}" for key, change in changes.items() if change]
        if not found:
            return ""
        return (
            f"all soils are there at once, and what the stages of the site change is left out: {', '.join(found)}; the study safety "
            "takes it into account in its factor by finite elements, and the study embankment in a slide (docs/howto/stages.md)"
        )

    def tags_of(self, soils: Sequence[str]) -> list[int]:
        """Cell tags of soils, whose laws they number.

        Raises:
            InputError: a soil is not one of the site's.
        """
        for soil in soils:
            if soil not in self.soils:
                raise mpm.InputError(f"soil {soil!r} is not among the soils {', '.join(self.soils)}")
        names = bridge.names_of(self.cell_tags)
        return [tag for soil in soils for tag in names.get(soil, (soil,))]

    def load(self, factor: float = 1.0) -> bridge.Load:
        """The weights of all soils times a factor."""
        return bridge.Load({soil: factor * weight for soil, weight in self.unit_weight.items()})


def read_site(path: Path, comm: MPI.Comm, cell_size: float | None = None) -> Site:
    """Read a site and make its mesh. Collective.

    Args:
        path: of the TOML file.
        cell_size: [m], instead of the one in the file.

    Raises:
        InputError: on all ranks, with the file, the key and what was expected.
    """
    return site_of(_table(path), path, comm, cell_size)


def site_of(table: dict, path: Path, comm: MPI.Comm, cell_size: float | None = None) -> Site:
    """The site that a table describes, as `read_site` has it from a file; path: of the file, for its mesh and messages."""
    axisymmetric = table.get("axisymmetric", False)
    if not isinstance(axisymmetric, bool):
        raise mpm.InputError(f"{path}: axisymmetric is {axisymmetric!r}, expected true or false")
    domain, cell_tags, facet_tags = site_mesh(table, path, comm, cell_size)
    soils, laws, weights = table["soils"], {}, {}
    for soil, given in soils.items():
        where = f"{path}: soils.{soil}"
        weights[soil] = unit_weight_of(given, where)
        parameters = _located({key: value for key, value in given.items() if key != "unit_weight"}, path)
        if any(isinstance(value, dict) for value in parameters.values()):
            cell_tags, heights = bridge.graded_tags(
                domain, cell_tags, soil, lambda x: x[:, -1], table.get("classes", 20)
            )
            laws |= {tag: law_at(parameters, height, where) for tag, height in heights.items()}
        else:
            law = law_at(parameters, 0.0, where)
            laws |= dict.fromkeys(bridge.names_of(cell_tags).get(soil, (soil,)), law)
    others = {
        name: law_at(_located(given, path), 0.0, f"{path}: laws.{name}")
        for name, given in table.get("laws", {}).items()
    }
    site = Site(domain, cell_tags, facet_tags, list(soils), laws, weights, supports_of(table, path, domain, facet_tags), [],
                list(others.values()), axisymmetric)  # fmt: skip
    site.stages = [_stage(given, k, site, others, path) for k, given in enumerate(table.get("stages", []))]
    return site


def unit_weight_of(soil: dict, where: str) -> float:
    """Unit weight [N/m3] in the table of a soil; where: it stands, for messages."""
    if "unit_weight" not in soil:
        raise mpm.InputError(f"{where} has no unit_weight [N/m3]")
    if not is_number(soil["unit_weight"]) or soil["unit_weight"] < 0:
        raise mpm.InputError(f"{where}: unit_weight is {soil['unit_weight']!r}, expected a number from 0 on [N/m3]")
    return float(soil["unit_weight"])


def is_number(value: Any) -> bool:
    """Whether a value of a site's file is a finite number."""
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def site_mesh(table: dict, path: Path, comm: MPI.Comm, cell_size: float | None) -> tuple[Any, Any, Any]:
    """The mesh that the table of a site's file names, cell tags and facet tags; `cell_size` [m] instead of the one there."""
    size = table.get("cell_size") if cell_size is None else cell_size
    constants = table.get("constants", {}) | ({} if size is None else {"cell_size": size})
    return bridge.read_mesh(path.parent / table["mesh"], comm, parameters=constants)


def cell_size_of(path: Path) -> float | None:
    """Cell size [m] that a site names; None where it names none."""
    return _table(path).get("cell_size")


def law_at(table: dict, height: float, where: str) -> Any:
    """The law that a table describes, where its parameters that grow with depth have their value at a height [m]."""
    parser = study_parser(None)
    add_soil_options(parser, dilation_angle=0.0)
    add_law_options(parser)
    add_number(
        parser, "--shear-strength", None, "Pa", "undrained shear strength, for tresca: instead of cohesion", at_least=0
    )
    values = vars(parser.parse_args([]))
    try:
        here = {key.replace("_", "-"): _at_height(key, value, height) for key, value in table.items()}
        values |= checked_values(where, here, parser._actions)
    except (ParameterError, ValueError) as error:
        raise mpm.InputError(str(error) if isinstance(error, ParameterError) else f"{where}: {error}") from None
    if values["shear_strength"] is not None:
        values["cohesion"] = values["shear_strength"]
    return law_of(argparse.Namespace(**values))


def _located(table: dict, path: Path) -> dict:
    """The table of a law whose files are beside the site's."""
    files = {key: str(path.parent / table[key]) for key in ("umat", "python_law", "python-law") if key in table}
    return table | files


def _at_height(name: str, value: Any, height: float) -> Any:
    """A parameter as it is, or its value at a height: value + per_metre * (top - height)."""
    if not isinstance(value, dict):
        return value
    if set(value) != {"value", "per_metre", "top"} or not all(map(is_number, value.values())):
        raise ValueError(
            f"{name} is {value}, expected {{value = , per_metre = , top = }}: it grows with depth below top [m]"
        )
    return float(value["value"] + value["per_metre"] * max(value["top"] - height, 0.0))


def _table(path: Path) -> dict:
    return read_toml(path, KEYS, needed=("mesh", "soils"))


def read_toml(path: Path, keys: Sequence[str], needed: Sequence[str]) -> dict:
    """A TOML file as a table.

    Raises:
        InputError: it cannot be read, is not TOML, has a key that is not among `keys` or lacks one that is needed.
    """
    try:
        with open(path, "rb") as file:
            table = tomllib.load(file)
    except OSError as error:
        raise mpm.InputError(f"cannot read the site {path}: {error.strerror}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise mpm.InputError(f"the site {path} is not TOML: {error}") from None
    for key in table:
        if key not in keys:
            raise mpm.InputError(f"{path}: unknown key {key!r}, expected some of {', '.join(keys)}")
    for key in needed:
        if key not in table:
            raise mpm.InputError(f"{path} has no {key!r}")
    return table


def supports_of(table: dict, path: Path, domain: Any, facet_tags: Any) -> list[bridge.Support]:
    """The supports that a site names; by default those of boundaries with the names of `DEFAULT_SUPPORTS`. Collective."""
    names = bridge.names_of(facet_tags)
    given = table.get("supports") or {name: kind for name, kind in DEFAULT_SUPPORTS.items() if name in names}
    if not given:
        raise mpm.InputError(
            f"{path} has no [supports], and the mesh has no boundary named {', '.join(DEFAULT_SUPPORTS)}; it has {list(names)}"
        )
    return [_support(name, kind, f"{path}: supports.{name}", domain, facet_tags) for name, kind in given.items()]


def _support(name: str, kind: str, where: str, domain: Any, facet_tags: Any) -> bridge.Support:
    if kind == "fixed":
        return bridge.fixed(name)
    if kind != "roller":
        raise mpm.InputError(f"{where} is {kind!r}, expected 'fixed' or 'roller'")
    normal = bridge.flat_normal(domain, facet_tags, name)
    if normal is None:
        raise mpm.InputError(
            f"{where}: a roller needs a boundary at right angles to an axis, expected 'fixed' for this one"
        )
    return bridge.roller(name, normal)


def _stage(given: dict, number: int, site: Site, laws: dict[str, Any], path: Path) -> bridge.Stage:
    where = f"{path}: stages[{number}]"
    for key in given:
        if key not in STAGE_KEYS:
            raise mpm.InputError(f"{where}: unknown key {key!r}, expected some of {', '.join(STAGE_KEYS)}")
    for key in ("law", "unit_weight", "pressure", "support"):
        if not isinstance(given.get(key, {}), dict):
            raise mpm.InputError(f"{where}: {key} is {given[key]!r}, expected a table such as {key} = {{name = value}}")
    reset = given.get("reset_displacement", False)
    if not isinstance(reset, bool):
        raise mpm.InputError(f"{where}: reset_displacement is {reset!r}, expected true or false")
    fill = given.get("fill", [])
    fill = [fill] if isinstance(fill, str) else fill
    for soil in [*fill, *given.get("law", {})]:
        if soil not in site.unit_weight:
            raise mpm.InputError(f"{where}: soil {soil!r} is not among the soils {', '.join(site.unit_weight)}")
    for soil, law in given.get("law", {}).items():
        if law not in laws:
            raise mpm.InputError(
                f"{where}: law of {soil!r} is {law!r}, expected one of [laws]: {', '.join(laws) or 'there is none'}"
            )
    return bridge.Stage(
        str(given.get("name", f"stage {number + 1}")),
        fill=fill,
        excavate=given.get("excavate", ()),
        law={soil: laws[law] for soil, law in given.get("law", {}).items()},
        unit_weight={**{soil: site.unit_weight[soil] for soil in fill}, **given.get("unit_weight", {})},
        pressure=given.get("pressure", {}),
        support=[_support(name, kind, f"{where}.support.{name}", site.domain, site.facet_tags)
                 for name, kind in given.get("support", {}).items()],
        release=given.get("release", ()),
        pore_pressure=_water(given["water_level"], where) if "water_level" in given else None,
        reset_displacement=reset,
    )  # fmt: skip


def _water(level: Any, where: str) -> Any:
    """Pore pressures below a water level: a number, or points (x, level) of its surface."""
    points = level if isinstance(level, list) else [[0.0, level]]
    good = points and all(
        isinstance(point, list) and len(point) == 2 and all(map(is_number, point)) for point in points
    )
    if not good or any(after[0] < before[0] for before, after in zip(points, points[1:])):
        raise mpm.InputError(
            f"{where}: water_level is {level!r}, expected a number [m] or points [x, level] with x rising"
        )
    return bridge.hydrostatic(np.array(level, dtype=float))
