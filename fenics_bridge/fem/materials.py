"""Laws of a body by cell."""

from __future__ import annotations

import numpy as np
from dolfinx.mesh import Mesh

from fenics_bridge.errors import agree
from fenics_bridge.mesh.names import by_number, described, label
from fenics_bridge.mesh.tagged import owned_cells, require_tags_of, tag_values
from fenics_bridge.types import Law, Laws, MeshTags
from mpm_core import law_types

KINDS = tuple(law_types)
"""The classes of laws"""


class Materials:
    """One law for the whole body, or one for each cell tag. Collective.

    Args:
        domain: mesh of the body.
        law: law of `mpm_core`, or laws by cell tag or name.
        cell_tags: tags of the cells; None where there is one law.

    Raises:
        InputError: a tag has no law, a law is given for an unknown tag, or the tags are those of another mesh. Raised on all
            ranks alike.
    """

    def __init__(self, domain: Mesh, law: Laws, cell_tags: MeshTags | None) -> None:
        require_tags_of(domain, cell_tags, domain.topology.dim)
        self._comm, self._cell_tags, n_cells = domain.comm, cell_tags, owned_cells(domain)
        self.tags: tuple = (None,)
        """Tags of the laws, in their order; (None,) for a law of the whole body"""
        wrong = [one for one in (law.values() if isinstance(law, dict) else [law]) if not isinstance(one, KINDS)]
        agree(self._comm, f"law is {wrong[0]!r}, expected a law such as MohrCoulomb(...)" if wrong else None)
        if not isinstance(law, dict):
            self.number = np.zeros(n_cells, dtype=np.int32)
            return
        agree(
            self._comm,
            "cell_tags is None, expected the tags that the laws are given for" if cell_tags is None else None,
        )
        values = tag_values(domain, cell_tags, domain.topology.dim)[:n_cells]
        law = by_number(self._comm, cell_tags, law, "law", "cell")
        known = sorted(set().union(*self._comm.allgather(set(values.tolist()))))
        without = [tag for tag in known if tag not in law]
        problem = f"law: no law for cells with tag {label(cell_tags, without[0])} (0: untagged)" if without else None
        agree(self._comm, problem)
        self.tags = tuple(law)
        self.number = np.zeros(n_cells, dtype=np.int32)
        for number, tag in enumerate(self.tags):
            self.number[values == tag] = number

    def laws(self, law: Laws) -> list[Law]:
        """The laws in their order. Collective.

        Args:
            law: law, or laws by cell tag or name, for the same tags as at the start.

        Raises:
            InputError: laws for other tags. Raised on all ranks alike.
        """
        named = isinstance(law, dict) and self.tags != (None,)
        given = by_number(self._comm, self._cell_tags, law, "law", "cell") if named else {None: law}
        tags = described(self._cell_tags, self.tags)
        expected = f"laws for the cell tags {tags}" if self.tags != (None,) else "one law"
        mistake = set(given) != set(self.tags) or isinstance(given.get(None), dict)
        agree(self._comm, f"law is {law!r}, expected {expected}" if mistake else None)
        return [given[tag] for tag in self.tags]
