"""Parameters of laws that vary from point to point in finite elements."""

from __future__ import annotations

from typing import Any

import numpy as np
from mpm_core.parameter_fields import parameter_values

from fenics_bridge.errors import InputError, agree
from fenics_bridge.mesh.names import tag_numbers
from fenics_bridge.mesh.tagged import owned_cells, tag_values


def set_parameter(model: Any, name: str, values: Any) -> None:
    """Apply `QuasiStatic.set_parameter`."""
    domain, points, laws = model.domain, model.points, model.laws
    tags, of_point = {}, None
    if isinstance(values, dict):
        given = "cell_tags is None, expected the tags that values are given for" if model.cell_tags is None else None
        agree(domain.comm, given)
        tags = {key: tag_numbers(domain.comm, model.cell_tags, (key,), name, "cell") for key in values}
        of_cell = tag_values(domain, model.cell_tags, domain.topology.dim)[: owned_cells(domain)]
        of_point = np.repeat(of_cell[points.cells], points.per_cell)
    problem = None
    try:
        points.set_parameter(laws, name, parameter_values(name, values, points.coordinates(), of_point, tags))
    except InputError as error:
        problem = str(error)
    agree(domain.comm, problem)
