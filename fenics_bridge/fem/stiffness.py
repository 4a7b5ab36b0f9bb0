"""Bilinear forms as matrices that are the same to the last bit each time."""

from __future__ import annotations

import numpy as np
from dolfinx import fem
from dolfinx.fem import petsc
from mpi4py import MPI
from mpm_core.petsc import coo_matrix, set_values
from petsc4py import PETSc

from fenics_bridge import compat
from fenics_bridge.mesh.background import global_numbers
from fenics_bridge.mesh.tagged import owned_cells


class Stiffness:
    """A bilinear form on a space and itself as a PETSc matrix, the supports' rows and columns taken out.

    PETSc would add up what several ranks contribute to an entry in the order in which their messages arrive. So each rank
    assembles its share alone, shared nodes included, and shares are added in an order that is always the same.
    """

    def __init__(self, form, space, constraints):
        """form: UFL; space: of its test and trial functions; constraints: Constraints. Collective."""
        self._form, self._bcs = fem.form(form), constraints.bcs
        index_map, bs = space.dofmap.index_map, space.dofmap.index_map_bs
        blocks = index_map.size_local + index_map.num_ghosts
        self._share = coo_matrix(MPI.COMM_SELF, (bs * blocks, bs * blocks), (bs, bs), _places(space, blocks, bs))
        local = PETSc.LGMap().create(np.arange(blocks, dtype=np.int32), bsize=bs, comm=MPI.COMM_SELF)
        self._share.setLGMap(local, local)
        numbers = bs * global_numbers(index_map, blocks)[:, None] + np.arange(bs)
        self._share.assemble()
        start, columns, _ = self._share.getValuesCSR()
        rows = np.repeat(np.arange(bs * blocks), np.diff(start))
        places = numbers.ravel()[rows], numbers.ravel()[columns]
        owned = bs * index_map.size_local
        self._matrix = coo_matrix(space.mesh.comm, (owned, owned), (bs, bs), places)

    def assembled(self):
        """The matrix with the form's present coefficients; the same object each time. Collective."""
        self._share.zeroEntries()
        petsc.assemble_matrix(self._share, self._form, bcs=self._bcs)
        self._share.assemble()
        set_values(self._matrix, self._share.getValuesCSR()[2])
        return self._matrix


def _places(space, blocks, bs):
    """Rows and columns of the entries that cells of this rank have, and of the diagonal: local, each once."""
    cells = compat.cell_dofs(space)[: owned_cells(space.mesh)].astype(np.int64)
    pairs = (cells[:, :, None] * blocks + cells[:, None, :]).ravel()
    rows, columns = np.divmod(np.unique(np.append(pairs, np.arange(blocks) * (blocks + 1))), max(blocks, 1))
    parts = np.arange(bs)
    rows = np.broadcast_to(bs * rows[:, None, None] + parts[:, None], (len(rows), bs, bs))
    return rows.ravel(), (bs * columns[:, None, None] + np.broadcast_to(parts, (bs, bs))).ravel()
