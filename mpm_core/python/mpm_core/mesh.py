"""The background mesh."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from mpi4py import MPI
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._core import InputError
from .checks import real_numbers
from .collective import collectively
from .rows import find_items, request_rows
from .views import mesh_text

Tag = int | str | Sequence[int | str]
"""A tag by its number or name, or several of them."""


def _integers(name: str, values: ArrayLike, dtype: type, width: int | None) -> NDArray:
    """Values as whole numbers of the given type, (n,) or (n, width)."""
    array = np.asarray(values)
    if array.size == 0:
        array = np.zeros((0,) if width is None else (0, width), dtype=dtype)
    if not np.issubdtype(array.dtype, np.integer):
        raise InputError(f"{name} has dtype {array.dtype}, expected whole numbers")
    if array.ndim != (1 if width is None else 2) or (width is not None and array.shape[1] != width):
        raise InputError(f"{name} has shape {array.shape}, expected {'(n,)' if width is None else f'(n, {width})'}")
    return np.ascontiguousarray(array, dtype=dtype)


def _numbers(given: ArrayLike, count: int) -> NDArray[np.int64]:
    """Numbers over all ranks; by default those on this rank."""
    return np.array(given, dtype=np.int64) if np.size(given) else np.arange(count, dtype=np.int64)


def floats(name: str, values: ArrayLike, shape: tuple[int | None, ...]) -> NDArray[np.float64]:
    """Values as finite float64 numbers in the given shape (None: any length).

    Raises:
        InputError: other dtype, shape, or a value that is not finite.
    """
    array = np.asarray(values)
    if not (np.issubdtype(array.dtype, np.floating) or np.issubdtype(array.dtype, np.integer)):
        raise InputError(f"{name} has dtype {array.dtype}, expected real numbers")
    if array.ndim != len(shape) or any(e is not None and e != s for e, s in zip(shape, array.shape, strict=True)):
        expected = tuple("n" if e is None else e for e in shape)
        raise InputError(f"{name} has shape {array.shape}, expected {expected}".replace("'", ""))
    array = np.ascontiguousarray(array, dtype=np.float64).reshape(array.shape)  # it makes a row of a single number
    if not np.isfinite(array).all():
        where = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        raise InputError(f"{name} is {array[where]} at index {where}, expected finite numbers")
    return array


class Mesh:
    """Background mesh of triangles (plane strain) or tetrahedra, given by arrays. Collective.

    Each rank gives the cells that it owns, then its ghost cells (those that share a facet with an owned one).

    Args:
        points: node coordinates [m], shape (nodes, D) with D = 2 or 3.
        cells: node numbers of each cell, shape (cells, D + 1); any orientation.
        cell_tags: tag of each cell, shape (cells,); 0 everywhere by default.
        facets: node numbers of each tagged facet, shape (facets, D).
        facet_tags: tag of each of them, shape (facets,).
        global_nodes: number of each node over all ranks, shape (nodes,).
        global_cells: number of each cell over all ranks, shape (cells,).
        cell_owners: rank that owns each cell, shape (cells,).
        cell_names, facet_names: names that may stand for tags, {name: tag or tags}; the same on every rank.
        comm: the ranks that share the mesh.

    Raises:
        InputError: wrong shape, dtype or number; a cell without area or volume; overlapping (inverted) cells; a tagged
            facet that is no facet of a cell. Raised on every rank alike.
    """

    def __init__(
        self,
        points: ArrayLike,
        cells: ArrayLike,
        *,
        cell_tags: ArrayLike = (),
        facets: ArrayLike = (),
        facet_tags: ArrayLike = (),
        global_nodes: ArrayLike = (),
        global_cells: ArrayLike = (),
        cell_owners: ArrayLike = (),
        cell_names: Mapping[str, int | Sequence[int]] | None = None,
        facet_names: Mapping[str, int | Sequence[int]] | None = None,
        comm: MPI.Comm = MPI.COMM_SELF,
    ) -> None:
        self.comm = comm

        def build() -> Any:
            array = np.asarray(points)
            if array.ndim != 2 or array.shape[1] not in (2, 3):
                raise InputError(f"points has shape {array.shape}, expected (n, 2) or (n, 3)")
            dim = array.shape[1]
            node_numbers = np.asarray(cells)
            if node_numbers.ndim == 2 and node_numbers.size and node_numbers.shape[1] != dim + 1:
                kind = "triangles, 3" if dim == 2 else "tetrahedra, 4"
                raise InputError(f"cells has {node_numbers.shape[1]} nodes per cell, expected {kind} nodes each")
            if comm.size > 1:
                for name, given in (
                    ("global_nodes", global_nodes),
                    ("global_cells", global_cells),
                    ("cell_owners", cell_owners),
                ):
                    if len(array) and not np.size(given):
                        raise InputError(f"{name} is empty, expected on {comm.size} ranks")
            core = (_core.Mesh2 if dim == 2 else _core.Mesh3)(
                floats("points", array, (None, dim)),
                _integers("cells", cells, np.int32, dim + 1),
                _integers("cell_tags", cell_tags, np.int32, None),
                _integers("facets", facets, np.int32, dim),
                _integers("facet_tags", facet_tags, np.int32, None),
                _integers("global_nodes", global_nodes, np.int64, None),
                _integers("global_cells", global_cells, np.int64, None),
                _integers("cell_owners", cell_owners, np.int32, None),
                comm.rank,
            )
            return dim, array, core

        self.dim, array, self._core = collectively(comm, build)
        self.points: NDArray[np.float64] = np.array(array, dtype=np.float64)
        """Node coordinates [m], shape (nodes, D)."""
        self.cells: NDArray[np.int32] = np.array(cells, dtype=np.int32).reshape(-1, self.dim + 1)
        """Node numbers of each cell, shape (cells, D + 1); owned cells first."""
        self.cell_tags: NDArray[np.int32] = self._core.cell_tags
        self.facets: NDArray[np.int32] = np.array(facets, dtype=np.int32).reshape(-1, self.dim)
        self.global_nodes: NDArray[np.int64] = _numbers(global_nodes, len(self.points))
        """Number of each node over all ranks, shape (nodes,)."""
        self.global_cells: NDArray[np.int64] = _numbers(global_cells, len(self.cells))
        """Number of each cell over all ranks, shape (cells,); it does not depend on the partition."""
        self.cell_numbers: int = 1 + comm.allreduce(int(self.global_cells.max(initial=-1)), MPI.MAX)
        """Highest number of a cell over all ranks, plus one."""
        self._places: WeakKeyDictionary[Mesh, tuple[NDArray[np.int64], NDArray[np.int64]]] = WeakKeyDictionary()
        self.tags: dict[str, set[int]] = {
            "cell": set().union(*comm.allgather(set(map(int, np.unique(self.cell_tags))))),
            "facet": set().union(*comm.allgather({int(t) for t in np.asarray(facet_tags).ravel()})),
        }
        """Tags that the mesh has on any rank, of cells ("cell") and of facets ("facet")."""
        given = {"cell": cell_names or {}, "facet": facet_names or {}}
        self.names: dict[str, dict[str, tuple[int, ...]]] = {
            kind: {name: tuple(int(t) for t in np.atleast_1d(tags)) for name, tags in names.items()}
            for kind, names in given.items()
        }
        """Tags by name, of cells ("cell") and of facets ("facet")."""

    def __repr__(self) -> str:
        return mesh_text(self)

    @property
    def owned_cells(self) -> int:
        """Number of cells that this rank owns; they come before its ghost cells."""
        return self._core.owned_cells

    @property
    def cell_volumes(self) -> NDArray[np.float64]:
        """Area (D = 2) or volume (D = 3) of each cell [m^D], shape (cells,)."""
        return self._core.volumes()

    def cells_of(self, points: ArrayLike) -> NDArray[np.int32]:
        """Number of the cell on this rank that contains each point, -1 outside of its cells; shape (n,). Not collective.

        Args:
            points: positions [m], shape (n, D).

        Raises:
            InputError: points of another shape or dtype.
        """
        return self._core.cells_of(floats("points", points, (None, self.dim)))

    def nodal_of(self, other: "Mesh", values: ArrayLike) -> NDArray[np.float64]:
        """Nodal values of the same mesh under another partition, at the nodes of this one. Collective.

        Args:
            other: the mesh under the other partition.
            values: a row for each of its nodes, shape (nodes,) or (nodes, k).

        Returns:
            A row for each node of this mesh, shape (nodes,) or (nodes, k).

        Raises:
            InputError: values of another shape, or another mesh.

        Example:
            >>> start = model.mesh
            >>> list(model.explicit(until=1.0, rebalance=1.2))
            >>> start.nodal_of(model.mesh, model.nodal("velocity"))
        """
        array = np.ascontiguousarray(real_numbers("values", values))
        if array.ndim not in (1, 2) or len(array) != len(other.points):
            raise InputError(f"values has shape {array.shape}, expected a row for each of {len(other.points)} nodes")
        if other is self:
            return array
        rows = array.reshape(len(array), *array.shape[1:] or [1])
        if other not in self._places:
            self._places[other] = self._places_of(other)
        ranks, places = self._places[other]
        return request_rows(self.comm, ranks, places, lambda asked: rows[asked[:, 0]]).reshape(-1, *array.shape[1:])

    def _places_of(self, other: "Mesh") -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Ranks and rows, (nodes,) and (nodes, 1), at which the same mesh under another partition has these nodes. Collective."""
        known = np.unique(other.cells[: other.owned_cells])
        ranks, rows = find_items(self.comm, other.global_nodes[known], known, self.global_nodes)

        def require_all() -> None:
            if absent := self.global_nodes[ranks < 0].tolist():
                raise InputError(
                    f"other is a mesh without node {absent[0]}, expected this mesh under another partition"
                )

        collectively(self.comm, require_all)
        return ranks, rows[:, None]

    def tags_of(self, kind: str, given: Tag) -> tuple[int, ...]:
        """The tags of cells or facets (``kind``) that are meant by a number, a name or a sequence of them.

        Raises:
            InputError: no cell or facet has one of them; the message lists the known names and tags.
        """
        names, known, tags = self.names[kind], self.tags[kind], []
        several = [given] if isinstance(given, (str, int, np.integer)) else given
        if not isinstance(several, Iterable) or not all(isinstance(one, (str, int, np.integer)) for one in several):
            raise InputError(f"{kind}_tag is {given!r}, expected a number or a name, or several of them")
        for one in several:
            present = [tag for tag in (names.get(one, ()) if isinstance(one, str) else (int(one),)) if tag in known]
            if not present:
                there = [*(name for name, of_name in names.items() if known & {*of_name}), *sorted(known)]
                what = f"'{one}'" if isinstance(one, str) else one
                raise InputError(f"{kind}_tag is {what}, which the mesh does not have; it has {there}")
            tags += present
        return tuple(dict.fromkeys(tags))


def cell_sizes(volumes: NDArray[np.float64], dim: int) -> NDArray[np.float64]:
    """Size h of simplices [m]: side of the square or cube that D! of their volume fill, (D! V)^(1/D).

    Softening is spread over a band of this width, and laws get it as the size of a point's cell.

    Args:
        volumes: volumes of the cells [m2 or m3].
        dim: dimension D of the mesh, 2 or 3.
    """
    return _core.cell_sizes(volumes, dim)
