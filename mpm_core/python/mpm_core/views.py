"""Meshes, models, particles and reports as a notebook shows them; particles for pandas, meshio and matplotlib."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ._core import Geometry, InputError
from .components import AXES, is_vector, tensor_components

if TYPE_CHECKING:
    from .mesh import Mesh
    from .particles import Particles
    from .report import Report

COVER = 1.15 * np.sqrt(2)
"""Width of circles over the side of a square that is as large, with which particles cover the soil with hardly any gaps; of squares side
by side it is the diagonal, and the patterns inside triangles are a little looser"""

_KINDS = {2: "triangles", 3: "tetrahedra"}


def mesh_text(mesh: Mesh) -> str:
    """A mesh in words: cells and nodes of this rank, size, tags by name."""
    dim, points = mesh.dim, mesh.points
    size = " x ".join(f"{length:.4g} m" for length in np.ptp(points, axis=0)) if len(points) else "nothing"
    tags = "; ".join(
        f"{kind} tags " + ", ".join(_tag(mesh, kind, tag) for tag in sorted(known))
        for kind, known in mesh.tags.items()
        if known
    )
    where = f" on rank {mesh.comm.rank} of {mesh.comm.size}" if mesh.comm.size > 1 else ""
    return f"<Mesh: {mesh.owned_cells} {_KINDS[dim]} and {len(points)} nodes{where}, {size}; {tags}>"


def _tag(mesh: Mesh, kind: str, tag: int) -> str:
    """A tag with its name, if it has one."""
    return next((f"{tag} ({name})" for name, tags in mesh.names[kind].items() if tag in tags), str(tag))


def particles_text(particles: Particles) -> str:
    """Particles in words: their number on this rank, and fields with units."""
    units = _units(particles)
    fields = ", ".join(f"{field['name']} [{units[field['name']]}]" for field in particles.schedule())
    return f"<Particles: {len(particles)} on this rank; {fields}>"


def model_text(model: Any) -> str:
    """A model in words: geometry, time, particles of this rank, laws, gravity, boundary conditions, pore water, rigid surfaces."""
    geometry = model.geometry.name.lower().replace("_", " ")
    rows = [f"law {number}: {law!r}" for number, law in enumerate(model.laws)]
    rows.append(f"gravity {_vector(model.gravity)} m/s2")
    for tag, whole, values in model._conditions:
        moves = f"velocity {_vector(values)} m/s" if any(value != 0 for value in values) else "fixed"
        condition = moves if whole else f"roller, normal {_vector(values)}"
        rows.append(f"facet tag {_tag(model.mesh, 'facet', tag)}: {condition}")
    rows += [*_water_rows(model), *(repr(contact).strip("<>") for contact in model.contacts)]
    return (
        f"<{type(model).__name__}: {geometry}, t = {model.time:g} s; {len(model.particles)} particles on this rank, "
        + "\n  ".join([f"{model.mesh.owned_cells} cells", *rows])
        + ">"
    )


def _water_rows(model: Any) -> Iterator[str]:
    """Pore water in words, and what is prescribed for it; tables have their first and last values."""
    water = model._core.water
    if water is None:
        return
    yield (
        f"pore water of {water.density:g} kg/m3, modulus {water.modulus:g} Pa, free surface "
        f"{'drained' if water.drained_surface else 'impervious'}{', soil that dries' if water.may_dry else ''}"
    )
    for name, unit, history in (("water stands up to", "m", water.standing), ("rain", "m/s", water.rain)):
        if history:
            yield f"{name} {_span(history)} {unit}"
    for tag, history, is_level, held, _ in model._water_conditions:
        what = "water level" if is_level else "pore pressure" if held else "total pressure"
        yield f"facet tag {_tag(model.mesh, 'facet', tag)}: {what} {_span(history)} {'m' if is_level else 'Pa'}"


def _span(history: Sequence[tuple[float, float]]) -> str:
    """A number, or the first and last ones of a table over time."""
    first, last = history[0][1], history[-1][1]
    return f"{first:g}" if len(history) == 1 else f"{first:g} to {last:g}"


def _vector(values: Sequence[float | None] | np.ndarray) -> str:
    return f"({', '.join('free' if value is None else f'{value:g}' for value in values)})"


def report_text(report: Report) -> str:
    """A report in words: time, steps, mass, energies, out-of-balance ratio."""
    work = "unknown" if np.isnan(report.plastic_work) else f"{report.plastic_work:.4g} J"  # of laws in Python and UMATs
    return (
        f"<{type(report).__name__}: t = {report.time:g} s after {report.steps} steps, the last of {report.dt:.3g} s; "
        f"{report.particles} particles, {report.mass:.6g} kg; kinetic energy {report.kinetic_energy:.4g} J, external work "
        f"{report.external_work:.4g} J, plastic work {work}; {report.plastic_fraction:.1%} yield, "
        f"out-of-balance ratio {report.unbalanced_ratio:.2g}>"
    )


def _values(particles: Particles, name: str) -> np.ndarray:
    """A field of all particles; InputError for an optional one that none of them has yet."""
    values = np.asarray(getattr(particles, name))
    if len(values) != len(particles):
        raise InputError(f"particle field is {name!r}, but no particle carries one")
    return values


def _columns(particles: Particles, name: str) -> dict[str, np.ndarray]:
    """A field as columns with one number per particle."""
    values = _values(particles, name)
    if values.ndim == 1:
        return {name: values}
    width, dim = values.shape[1], particles.position.shape[1]
    tensor = tensor_components(name, width, particles._geometry == Geometry.AXISYMMETRIC)
    ends = AXES[dim] if is_vector(name, width, dim) else tensor or range(width)
    return {f"{name}_{end}": values[:, k] for k, end in enumerate(ends)}


def _units(particles: Particles) -> dict[str, str]:
    """Units of the fields, including those that follow from others."""
    units = {field["name"]: field["unit"] for field in particles.schedule()}
    volume = "m2" if particles._geometry == Geometry.PLANE_STRAIN else "m3"  # of a slice 1 m thick, of one radian
    return units | {"displacement": "m", "plastic_strain": "-", "volume": volume}


def particle_table(particles: Particles, names: Sequence[str]) -> Any:
    """See `Particles.to_dataframe`."""
    import pandas

    units = _units(particles)
    columns, unit_of = {}, {}
    for name in names:
        for column, values in _columns(particles, name).items():
            columns[column], unit_of[column] = values, units[name]
    frame = pandas.DataFrame(columns, index=pandas.Index(particles.id, name="id"))
    frame.attrs["units"] = unit_of
    return frame


def particle_mesh(particles: Particles, names: Sequence[str]) -> Any:
    """See `Particles.to_meshio`."""
    import meshio

    dim, fields = particles.position.shape[1], {}
    for name in names:
        values = _values(particles, name)
        if values.ndim == 2 and is_vector(name, values.shape[1], dim):
            fields[name] = _in_space(values)
        else:
            fields |= _columns(particles, name)
    cells = [("vertex", np.arange(len(particles))[:, None])]
    return meshio.Mesh(_in_space(particles.position), cells, point_data=fields)


def _in_space(vectors: np.ndarray) -> np.ndarray:
    """Vectors with three components."""
    return np.pad(vectors, ((0, 0), (0, 3 - vectors.shape[1])))


def _plotted(particles: Particles, name: str) -> tuple[np.ndarray, str]:
    """One number per particle, and its label: a field or a component of it, or the size of a vector."""
    units = _units(particles)
    dim = particles.position.shape[1]
    for field in sorted(units, key=len, reverse=True):
        if name != field and not name.startswith(f"{field}_"):
            continue
        values = _values(particles, field)
        columns = _columns(particles, field)
        if name not in columns and name == field and is_vector(field, values.shape[-1], dim):
            columns = {name: np.linalg.norm(values, axis=1)}
        if name not in columns:
            raise InputError(f"name is {name!r}, expected one of {', '.join(columns)}")
        return columns[name], f"{name.replace('_', ' ')} [{units[field]}]"
    raise InputError(f"name is {name!r}, expected a field or a component of it: {', '.join(sorted(units))}")


def plot_particles(particles: Particles, name: str, axes: Any, area: np.ndarray) -> Any:
    """See `Particles.plot`; areas in two dimensions [m^2]."""
    import matplotlib.pyplot as plt
    from matplotlib.collections import EllipseCollection

    values, label = _plotted(particles, name)
    position = particles.position
    dim = position.shape[1]
    width, height = np.ptp(position[:, :2], axis=0) if len(position) else (0.0, 0.0)
    wide = dim == 2 and 3 * height < width
    if axes is None:
        size = (6.4, 6.0 * max(height / width, 0.1) + 1.8) if wide else (6.4, 4.8)
        axes = plt.figure(figsize=size, layout="compressed").add_subplot(projection="3d" if dim == 3 else None)
    if dim == 3:
        drawn = axes.scatter(*position.T, c=values, s=2)
        axes.set_zlabel("z [m]")
        extents = np.ptp([axes.get_xlim(), axes.get_ylim(), axes.get_zlim()], axis=1)
        axes.set_box_aspect(extents)  # equal scales
        for axis, extent in zip("xyz", extents, strict=True):  # numbers of a thin side would lie on one another
            axes.locator_params(axis=axis, nbins=max(1, round(8 * extent / extents.max())), min_n_ticks=1)
    else:
        size = COVER * np.sqrt(area)
        drawn = EllipseCollection(
            size, size, np.zeros(len(size)), units="xy", offsets=position, offset_transform=axes.transData, array=values
        )
        axes.add_collection(drawn)
        axes.autoscale_view()
        axes.set_aspect("equal")
    axes.set(xlabel="x [m]", ylabel="y [m]")
    place: dict[str, Any] = (
        {"pad": 0.15, "shrink": 0.7} if dim == 3 else {"location": "bottom", "aspect": 40} if wide else {}
    )
    axes.figure.colorbar(drawn, ax=axes, label=label, **place)
    return axes
