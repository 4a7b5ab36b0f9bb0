"""Soils whose parameters vary with position, such as a strength that grows with depth: cells sorted into classes."""

from __future__ import annotations

from typing import Any

import numpy as np
from dolfinx import mesh
from mpi4py import MPI

from fenics_bridge import compat
from fenics_bridge.errors import agree, real_numbers, require_mesh
from fenics_bridge.mesh.names import label, name_tags, names_of, tag_numbers
from fenics_bridge.mesh.tagged import retagged, tag_values
from fenics_bridge.types import MeshTags, OfPosition


def graded_tags(
    domain: mesh.Mesh,
    cell_tags: MeshTags,
    soil: int | str,
    value_of: OfPosition,
    classes: int = 20,
) -> tuple[MeshTags, dict[int, float]]:
    """Sort the cells of a soil into classes by a function of position, each with a tag of its own. Collective.

    Classes are equally wide between the least and the largest value at the cells' centroids, so a parameter that is
    linear in the value is off by at most half a class. The soil's name then stands for all of its classes.

    Args:
        domain: mesh of DOLFINx.
        cell_tags: tags of its cells.
        soil: name or tag of the soil.
        value_of: function of positions (n, D) [m] that returns values (n,), e.g. their depths.
        classes: number of classes; those without cells get no tag.

    Returns:
        The new cell tags, and the value in the middle of each class by its tag.

    Raises:
        InputError: no cell has the soil's tag, classes is below 1, or a value is not finite. Raised on all ranks alike.

    Example:
        >>> tags, depths = bridge.graded_tags(domain, cell_tags, "clay", lambda x: 3.0 - x[:, 1])
        >>> laws = {tag: mpm.tresca(young=5e6, poisson=0.49, shear_strength=12e3 + 1.5e3 * z) for tag, z in depths.items()}
    """
    require_mesh(domain)
    comm, dim = domain.comm, domain.topology.dim
    old = tag_numbers(comm, cell_tags, soil, "soil", "cell")
    agree(comm, None if classes >= 1 else f"classes is {classes!r}, expected a whole number from 1 on")
    tags = tag_values(domain, cell_tags, dim)
    corners = domain.geometry.x[compat.cell_nodes(domain), : domain.geometry.dim]
    rows = np.flatnonzero(np.isin(tags, old))
    given = real_numbers(comm, "value_of", value_of(corners[rows].mean(axis=1)))
    values = np.broadcast_to(given, len(rows))
    agree(comm, None if np.all(np.isfinite(values)) else "value_of gives values that are not finite")
    low, high = comm.allreduce(values.min(initial=np.inf), MPI.MIN), comm.allreduce(
        values.max(initial=-np.inf), MPI.MAX
    )
    width = (high - low) / classes or 1.0
    # A centroid on the border of two classes must not go to either by round-off.
    number = np.clip(np.floor((values - low) / width + 1e-9).astype(np.int32), 0, classes - 1)
    present = sorted(set().union(*comm.allgather(set(np.unique(number).tolist()))))
    first = 1 + comm.allreduce(int(cell_tags.values.max(initial=0)), MPI.MAX)
    tags[rows] = first + np.searchsorted(present, number)
    new = tuple(range(first, first + len(present)))
    name = soil if isinstance(soil, str) else label(cell_tags, soil).strip("'")
    kept = {other: _without(numbers, old, new) for other, numbers in names_of(cell_tags).items()}
    return name_tags(retagged(domain, cell_tags, tags), {**kept, name: new}), dict(
        zip(new, low + width * (np.array(present) + 0.5))
    )


def _without(numbers: Any, old: Any, new: Any) -> Any:
    """Tags of a name, with those of the graded soil replaced by those of its classes."""
    rest = tuple(number for number in numbers if number not in old)
    return (*rest, *new) if len(rest) < len(numbers) else numbers
