"""Saving and restoring a model. The layout of the file is described in docs/checkpoints.md."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from . import _core, partition
from ._core import InputError, RunError
from .checkpoint_file import Arrays, CheckpointFile, Column, write_file
from .collective import collectively
from .collisions import set_collisions
from .contact import OF_SURFACES, set_contacts
from .contact_strength import require_strengths
from .description import parsed
from .far_field import require_border
from .field_contact import set_field_contacts
from .fingerprint import mesh_fingerprint
from .law_text import law_text
from .member_methods import members_entry, take_members
from .rows import find_items
from .step_control import StepControl
from .surface_description import require_surfaces
from .water_entry import take_water, water_entry

if TYPE_CHECKING:
    from .model import Model

_OWNED_CELLS = "owned_cells"
"""Table of the cells that each rank owns, where the mesh has been repartitioned: a restart can then have the same partition."""

_MOST_EXACT, _MOST_TOTAL, _MOST_VALUE = 2.0**53, 9e18, 1e100
"""Whole numbers below the first are exact in double precision; totals, and values of particles, do not come near the others"""

_MOVED_CORNERS = "moved_corners"
"""Table of the corners of the cells with particles, where these cells have moved with them"""


def save(model: Model, path: str | os.PathLike[str], notes: Mapping[str, Any] | None = None) -> None:
    """See `Model.save`."""
    groups = {**_core.checkpoint_arrays(model._core), "particles": _particle_arrays(model)}
    sums = _sums(_all_rows(model.comm, groups["ranks"]))
    text = collectively(model.comm, lambda: _text({**_description(model), "sums": sums}, notes))
    if model.repartitions > 0:
        groups["cells"][_OWNED_CELLS] = _own_cells(model).astype(np.float64)
    write_file(os.fspath(path), model.comm, text, groups)


def _particle_arrays(model: Model) -> Arrays:
    """The fields that the particles of any rank have, (n,) or (n, k); cells by their numbers over all ranks. Collective."""
    schedule = [field for field in model.particles.schedule() if field["components"]]
    arrays = {field["name"]: model._core.column(field["name"], None) for field in schedule}
    arrays["cell"] = model.mesh.global_cells[arrays["cell"]]
    arrays["material"] = arrays["material"].astype(np.int64)
    n = len(arrays["id"])
    here = {field["name"] for field in schedule if not field["optional"] or 0 < n == len(arrays[field["name"]])}
    there = here.union(*model.comm.allgather(here))
    return {
        name: values.ravel() if values.shape[1:] == (1,) else values for name, values in arrays.items() if name in there
    }


def _all_rows(comm: MPI.Comm, ranks: Arrays) -> Arrays:
    """The totals of all ranks, from a row of each."""
    rows = comm.allgather([rows[0] for rows in ranks.values()])
    return dict(zip(ranks, np.array(rows).T, strict=True))


def _sums(ranks: Arrays) -> dict[str, float | None]:
    """Sums of totals over ranks, free of round-off; None for one that a law does not say."""
    sums = {name: math.fsum(rows) for name, rows in ranks.items()}
    return {name: total if math.isfinite(total) else None for name, total in sums.items()}


def _own_cells(model: Model) -> NDArray[np.int64]:
    """Numbers over all ranks of the cells that this rank owns."""
    return model.mesh.global_cells[: model.mesh.owned_cells]


def _text(description: dict[str, Any], notes: Mapping[str, Any] | None) -> str:
    try:
        return json.dumps({**description, "notes": dict(notes or {})}, indent=1)
    except (TypeError, ValueError) as error:
        raise InputError(f"notes contain a value that JSON cannot represent: {error}") from None


def checkpoint_description(path: str | os.PathLike[str], comm: MPI.Comm = MPI.COMM_WORLD) -> dict[str, Any]:
    """Description in a checkpoint, read without a model. Collective.

    Args:
        path: the file.
        comm: the ranks that read it.

    Returns:
        ``time`` [s], ``steps``, ``ranks``, ``materials``, ``notes`` and the other entries that docs/checkpoints.md lists.

    Raises:
        RunError: on all ranks, with path and reason, as `Model.restore`.
    """
    name = os.fspath(path)
    with CheckpointFile(name, comm) as file:
        return parsed(name, file.description())


def restore(model: Model, path: str | os.PathLike[str]) -> None:
    """See `Model.restore`."""
    name = os.fspath(path)
    there = checkpoint_description(name, model.comm)
    here = _description(model)
    collectively(model.comm, lambda: _compare(name, there, here))
    surfaces = [one["surface"] for one in there["contacts"]]
    surfaces += [one["interface"] for one in there["field_contacts"]]
    collectively(model.comm, lambda: require_surfaces(model, surfaces))
    collectively(model.comm, lambda: require_strengths(model, there["contacts"]))
    collectively(model.comm, lambda: require_border(model, name, there["far_field"]))
    with CheckpointFile(name, model.comm) as file:
        if there["cuts"] and there["ranks"] == model.comm.size:
            _take_partition(model, file, name)
            model.repartitions = there["cuts"]
        with _usable(name):
            for field in there["added_fields"]:
                if field["name"] not in {known["name"] for known in model.particles.schedule()}:
                    model.add_field(**field)
        contacts = tuple(there[name] for name in ("contacts", "collisions", "field_contacts"))
        before, water = (model._contacts, model._collisions, model._field_contacts), water_entry(model)
        members = members_entry(model)
        try:
            with _usable(name):
                _replace_contacts(model, *contacts)
                take_members(model, there["members"])
                take_water(model, there["water"])
                model._core.set_supports(there["supports"])  # the energy of particles with gradients depends on them
            _core.restore(model._core, *_state(model, file, name, there), name)
        except RunError:
            model._core.set_supports(model._conditions)
            _replace_contacts(model, *before)
            take_members(model, members)
            take_water(model, water)
            raise
    with _usable(name):
        _take(model, there)


@contextmanager
def _usable(path: str) -> Iterator[None]:
    """Name the file where an entry of its description has the right shape, but no use; it is the same on all ranks."""
    try:
        yield
    except (InputError, TypeError, ValueError, LookupError, AttributeError, OverflowError) as error:
        reason = str(error).partition("\n")[0]
        raise RunError(
            f"cannot read checkpoint {path}: its description cannot be used ({type(error).__name__}: {reason})"
        ) from None


def _take_partition(model: Model, file: CheckpointFile, path: str) -> None:
    """Give the model's mesh the partition that it had in a run on as many ranks."""
    array = f"cells/{_OWNED_CELLS}"
    cells = file.rows(array, file.own_rows(_OWNED_CELLS, array))
    numbers = np.where(np.abs(cells) < 2**53, cells, -1).astype(np.int64)  # also where it is no number
    if not partition.is_partition(model, numbers):
        raise RunError(f"cannot read /{array} in {path}: it does not contain each cell of the mesh exactly once")
    partition.take_partition(model, numbers)


def _state(
    model: Model, file: CheckpointFile, path: str, there: dict[str, Any]
) -> tuple[Arrays, Arrays, Arrays, NDArray[np.int64] | None]:
    """Particles, cells and totals for `_core.restore`, and the rank that owns the cell of each of these particles.

    None stands for the ranks where each rank owns the cells that the particles of the same rank of the file are in.
    """
    comm, none = model.comm, np.empty(0, np.int64)
    # Fields of rigid surfaces that the model has had and the run had not: they keep their initial value.
    new = {field["name"] for field in _added_fields(model)} - {field["name"] for field in there["added_fields"]}
    columns = {
        field["name"]: Column(
            field["components"],
            model._core.column(field["name"], none).dtype.kind == "i",
            field["optional"] or (field["name"] in new and field["name"].startswith(OF_SURFACES)),
        )
        for field in model.particles.schedule()
    }
    tables = _core.checkpoint_tables(model._core)
    n_ranks, n = file.length("ranks/rows_of_particles"), file.length("particles/id")
    if n_ranks != there["ranks"]:
        raise RunError(f"cannot read /ranks/rows_of_particles in {path}: it has {n_ranks} rows, expected one for each of the "
                       f"{there['ranks']} ranks that its description says")  # fmt: skip
    totals = file.totals(tables["ranks"], slice(0, n_ranks))
    collectively(comm, lambda: _require_totals(path, totals, tables["ranks"], there), RunError)
    same = n_ranks == comm.size
    if same:
        particles = file.particles(columns, file.own_rows("particles", "particles/id"))
        same = comm.allreduce(int(np.isin(particles["cell"], _own_cells(model)).all()), MPI.MIN) == 1
    if same:
        own_totals = {name: rows[comm.rank : comm.rank + 1] for name, rows in totals.items()}
        cells = file.cells(tables["cells"])
        _require_particles(model, path, particles, cells, totals, there["next_id"])
        return particles, cells, own_totals, None
    equal_part = slice(n * comm.rank // comm.size, n * (comm.rank + 1) // comm.size)
    particles = file.particles(columns, equal_part)
    own = _own_cells(model)
    corners = file.rows_of_cells(_MOVED_CORNERS, tables["cells"][_MOVED_CORNERS], own)
    _require_particles(model, path, particles, corners, totals, there["next_id"])
    owners, _ = find_items(comm, own, np.arange(len(own)), particles["cell"])
    collectively(comm, lambda: _require_owners(path, particles, owners), RunError)
    return particles, corners, totals, np.ascontiguousarray(owners)


def _require_totals(path: str, totals: Arrays, tables: dict[str, Any], there: dict[str, Any]) -> None:
    """Refuse totals that no run writes, and such as differ from the description: nothing else tells of a wrong energy."""
    for name, (most_count, is_positive, may_be_unknown) in tables.items():
        rows, most = totals[name], min(most_count, _MOST_EXACT)
        if most > 0:
            good = (rows >= 0) & (rows <= most) & (rows == np.floor(rows))
            expected = f"a whole number from 0 to {most:.0f}"
        else:
            known = (np.abs(rows) < _MOST_TOTAL) & (rows >= (0 if is_positive else -np.inf))
            good = known | (may_be_unknown & np.isnan(rows))
            expected = "a number from 0 on" if is_positive else "a finite number"
        for value in rows[~good]:
            raise RunError(f"cannot read /ranks/{name} in {path}: it has the value {value:f}, expected {expected}")
    for steps, dt in zip(totals["steps"], totals["last_dt"], strict=True):
        if (steps > 0) != (dt > 0):
            expected = "a number above 0" if steps > 0 else "0"
            raise RunError(f"cannot read /ranks/last_dt in {path}: it has the value {dt} after {steps:.0f} steps, "
                           f"expected {expected}")  # fmt: skip
    for name in ("time", "steps"):
        if any(totals[name] != there[name]):
            raise RunError(f"cannot read /ranks/{name} in {path}: it has the value {totals[name][0]}, expected {there[name]}, as "
                           "its description says")  # fmt: skip
    for name, total in _sums(totals).items():
        expected_sum = there["sums"].get(name)
        if total != expected_sum:
            raise RunError(f"cannot read /ranks/{name} in {path}: its sum over ranks is {total}, expected {expected_sum}, as its "
                           "description says")  # fmt: skip


def _require_particles(model: Model, path: str, particles: Arrays, cells: Arrays, totals: Arrays, next_id: int) -> None:
    """Refuse particles, and tables of this rank's cells, that no run writes. Collective."""
    own, n_laws = _own_cells(model), len(model.laws)

    def check() -> None:
        for name, values in particles.items():
            good, expected = np.abs(values) < _MOST_VALUE, "finite numbers"
            if name in ("mass", "volume"):
                good, expected = good & (values > 0), "numbers above 0"
            elif name == "material":
                good, expected = (values >= 0) & (values < n_laws), f"the number of one of {n_laws} materials"
            for value in values[~good]:
                raise RunError(
                    f"cannot read /particles/{name} in {path}: it has the number {value}, expected {expected}"
                )
        for name, rows in cells.items():
            for row in rows[~(np.isfinite(rows).all(axis=1) & np.isin(rows[:, 0], own))]:
                what = f"cell {row[0]:.0f}, which is not there" if np.isfinite(row).all() else f"row {row}"
                raise RunError(f"cannot read /cells/{name} in {path}: it has the {what}")
            if name == "traction_moments" and "traction" not in particles:
                raise RunError(f"cannot read /cells/{name} in {path}: the particles have no traction")

    collectively(model.comm, check, RunError)
    _require_ids(model.comm, path, particles["id"], next_id)
    _require_mass(model.comm, path, particles, totals, cells)


def _require_ids(comm: MPI.Comm, path: str, numbers: NDArray[np.int64], end: int) -> None:
    """Refuse particles whose numbers are out of range, or that have the same. Collective."""

    def refuse(row: int, what: str) -> None:
        raise RunError(f"cannot read /particles/id in {path}: it has the number {numbers[row]}{what}")

    def check_range() -> None:
        for row in np.flatnonzero((numbers < 0) | (numbers >= end)):
            refuse(row, f", expected one below {end}, as next_id of its description says")

    collectively(comm, check_range, RunError)
    ranks, rows = find_items(comm, numbers, np.arange(len(numbers)), numbers)

    def check_once() -> None:
        for row in np.flatnonzero((ranks != comm.rank) | (rows != np.arange(len(numbers)))):
            refuse(row, " twice, expected each number once")

    collectively(comm, check_once, RunError)


def _require_mass(comm: MPI.Comm, path: str, particles: Arrays, totals: Arrays, cells: Arrays) -> None:
    """Refuse particles, and sums over cells, whose mass is not what was seeded and has not flowed out. Collective."""
    own = float(particles["mass"].sum())
    mass, seeded = comm.allreduce(own), totals["seeded_mass"][0] - totals["outflow_mass"].sum()
    tables = {name: float(rows[:, 2].sum()) for name, rows in cells.items() if name.startswith("moments")}

    def check() -> None:
        sums = [("particles/mass", mass, seeded, "as were seeded and have not flowed out")]
        if tables:
            sums.append((f"cells/{' and '.join(tables)}", sum(tables.values()), own, "as its particles have"))
        for name, found, expected, why in sums:
            if abs(found - expected) > 1e-9 * abs(expected):
                raise RunError(f"cannot read /{name} in {path}: it has {found} kg, expected {expected} kg, {why}")

    collectively(comm, check, RunError)


def _require_owners(path: str, particles: Arrays, owners: NDArray[np.int64]) -> None:
    for row in np.flatnonzero(owners < 0):
        number, cell = particles["id"][row], particles["cell"][row]
        raise RunError(f"cannot read /particles/cell in {path}: particle {number} is in cell {cell}, which no rank has")


_Entries: TypeAlias = list[dict[str, Any]]


def _replace_contacts(model: Model, contacts: _Entries, collisions: _Entries, of_fields: _Entries) -> None:
    """Give the model other contacts and collisions."""
    model._contacts, model._collisions, model._field_contacts = [], [], []
    _core.clear_contacts(model._core)
    collectively(model.comm, lambda: set_contacts(model, contacts))
    set_collisions(model, collisions)
    set_field_contacts(model, of_fields)


_COMPARED = {
    "dimension": "dimension",
    "geometry": "geometry",
    "materials": "materials",
    "velocity_fields": "division into velocity fields",
    "mesh": "background mesh",
}


def _compare(path: str, there: dict[str, Any], here: dict[str, Any]) -> None:
    """Refuse a checkpoint of another dimension, geometry, mesh or materials."""
    for key, what in _COMPARED.items():
        if there[key] != here[key]:
            raise InputError(
                f"checkpoint {path} is of another {what}: it has {_shown(there[key])}, the model has {_shown(here[key])}"
            )


def _shown(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value)


def _description(model: Model) -> dict[str, Any]:
    """State of a model besides particles, totals and time."""
    core = model._core
    return {
        "program": f"talus {_core.version}",
        "units": "SI: m, kg, s, N, Pa; per metre of thickness in plane strain, per radian in axial symmetry; tension positive",
        "components": "xx yy zz xy" if model.mesh.dim == 2 else "xx yy zz xy yz xz",
        "ranks": model.comm.size,
        "time": model.time,
        "steps": core.steps,
        "dimension": model.mesh.dim,
        "geometry": model.geometry.name,
        "velocity_fields": model._velocity_fields,
        "mesh": f"fingerprint {mesh_fingerprint(model.mesh):016x}",
        "materials": [law_text(law) for law in model.laws],
        "gravity": list(core.gravity),
        "gravity_ramp": core.gravity_ramp,
        "outflow_tags": list(core.outflow_tags),
        "supports": [[tag, whole, vector] for tag, whole, vector in model._conditions],
        "prescribed": {str(tag): model._conditions.index(condition) for tag, condition in model._prescribed.items()},
        "next_id": model._next_id,
        "added_fields": _added_fields(model),
        "cuts": model.repartitions,
        "left_imbalance": model._left_imbalance,
        "integration": None if model._integration is None else model._integration.name,
        "last_integration": core.last_integration.name,
        "contacts": model._contacts,
        "collisions": model._collisions,
        "field_contacts": model._field_contacts,
        "members": members_entry(model),
        "water": water_entry(model),
        "absorbing": model._absorbing_state(),
        "far_field": model._border_state(),
        "implicit": None if model._control is None else vars(model._control),
    }


def _added_fields(model: Model) -> list[dict[str, Any]]:
    """The fields of particles that the model has declared beside those of every model."""
    own = {field["name"] for field in type(model._core).default_particle_schedule()}
    keys = ("name", "unit", "meaning", "components", "initial")
    return [{key: field[key] for key in keys} for field in model.particles.schedule() if field["name"] not in own]


def _take(model: Model, there: dict[str, Any]) -> None:
    """Restore the model's state from a description."""
    core = model._core
    core.gravity, core.gravity_ramp = there["gravity"], there["gravity_ramp"]
    core.outflow_tags = there["outflow_tags"]
    model._conditions = [(tag, whole, vector) for tag, whole, vector in there["supports"]]
    model._prescribed = {int(tag): model._conditions[k] for tag, k in there["prescribed"].items()}
    model._next_id, model._late = there["next_id"], None
    model._left_imbalance = there["left_imbalance"]
    model._integration = _core.Integration.__members__.get(there["integration"])
    core.last_integration = _core.Integration.__members__[there.get("last_integration") or "PARTICLES"]
    model._control = None
    model._resumed = StepControl(**there["implicit"]) if there["implicit"] else None
    collectively(model.comm, lambda: core.set_supports(model._conditions))
    model._take_absorbing(there["absorbing"])
    model._take_border_state(there["far_field"])
