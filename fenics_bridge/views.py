"""Finite elements as a notebook shows them: kind, size, state, with units. Nothing is exchanged between ranks."""

from __future__ import annotations

from collections.abc import Iterable

from dolfinx.mesh import Mesh

from mpm_core import Geometry

_KINDS = {2: "triangles", 3: "tetrahedra"}


def body_text(name: str, domain: Mesh, *facts: str, geometry: Geometry | None = None, lines: Iterable[str] = ()) -> str:
    """Finite elements in words.

    Args:
        name: of the class.
        domain: mesh of the body.
        facts: what else there is to say.
        geometry: plane strain, axial symmetry or a solid.
        lines: what has a line of its own, such as laws.
    """
    cells = domain.topology.index_map(domain.topology.dim).size_local
    where = f" on rank {domain.comm.rank} of {domain.comm.size}" if domain.comm.size > 1 else ""
    kind = [] if geometry is None else [geometry.name.lower().replace("_", " ")]
    first = f"<{name}: {', '.join([*kind, f'{cells} {_KINDS[domain.geometry.dim]}{where}', *facts])}"
    return "\n  ".join([first, *lines]) + ">"


def law_lines(laws: object) -> list[str]:
    """A law, or laws by cell tag or name, in words."""
    return [f"{soil}: {law!r}" for soil, law in laws.items()] if isinstance(laws, dict) else [repr(laws)]
