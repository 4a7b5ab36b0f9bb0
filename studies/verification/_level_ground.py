"""Level ground of the cases of Hardening Soil: a column of it between rollers."""

from __future__ import annotations

from typing import Any

from common.files import ROOT
from mpi4py import MPI

import fenics_bridge as bridge

HEIGHT, WIDTH = 10.0, 1.0  # m


def ground(cell_size: float) -> tuple[Any, list[Any]]:
    """(domain, cell_tags, facet_tags) of the mesh, with cells of a size [m], and its supports."""
    parameters = {"height": HEIGHT, "width": WIDTH, "cell_size": cell_size}
    mesh = bridge.read_mesh(ROOT / "meshes" / "layer.geo", MPI.COMM_WORLD, parameters=parameters)
    return mesh, [bridge.roller("left", (1, 0)), bridge.roller("right", (1, 0)), bridge.fixed("base")]
