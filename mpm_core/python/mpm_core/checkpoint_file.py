"""The file of a checkpoint. docs/checkpoints.md describes its layout."""

from __future__ import annotations

import errno
import os
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from typing import Any, NamedTuple, TypeVar

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from ._core import RunError
from .collective import check_same_path, collectively, write_on_first_rank
from .hdf5 import RowsFile

Arrays = dict[str, NDArray[Any]]
T = TypeVar("T")
FORMAT = 2
"""Number of the layout; files of another one are refused"""


def write_file(path: str, comm: MPI.Comm, description: str, groups: Mapping[str, Arrays]) -> None:
    """Write a checkpoint aside, wait until it is on the disk, and rename it; an older file stays until then. Collective.

    Args:
        path: of the checkpoint, the same on all ranks.
        comm: communicator of the model.
        description: text of the description, the same on all ranks.
        groups: this rank's rows of arrays, in the groups ``particles``, ``cells`` and ``ranks``; those of ``ranks`` have one.

    Raises:
        InputError: on all ranks: the path is not the same on all of them.
        RunError: on all ranks, with path and reason; nothing is left behind.
    """
    check_same_path(comm, path)
    aside = f"{path}.part"
    file = RowsFile(aside, comm, checksums=True)
    file.add_common("format", np.array([FORMAT]))
    file.add_common("description", np.array([description.encode()]))
    own = {"particles": len(groups["particles"]["id"]), **{name: len(a) for name, a in groups["cells"].items()}}
    counts = comm.allgather(own)

    def add(name: str, rows: NDArray[Any], counts_of_rows: list[int]) -> None:
        file.add(name, rows, counts_of_rows)
        file.wait()
        if comm.rank == 0:  # at once, since it could not hold all of them
            file.store()

    for name, rows in groups["particles"].items():
        add(f"particles/{name}", rows, [count["particles"] for count in counts])
    for name, rows in groups["cells"].items():
        add(f"cells/{name}", rows, [count[name] for count in counts])
    for name, rows in {**groups["ranks"], **{f"rows_of_{k}": np.array([n]) for k, n in own.items()}}.items():
        add(f"ranks/{name}", rows, [1] * comm.size)

    def put_in_place() -> None:
        file.close(durable=True)
        _rename(aside, path)

    write_on_first_rank(comm, path, put_in_place)


def _rename(aside: str, path: str) -> None:
    """Rename a file that is on the disk, and wait until its new name is, too."""
    try:
        os.replace(aside, path)
    except OSError:
        os.unlink(aside)
        raise
    folder = os.open(os.path.dirname(path) or ".", os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(folder)  # the name is on the disk too
    except OSError as error:
        if error.errno != errno.EINVAL:  # some file systems cannot
            raise
    finally:
        os.close(folder)


class Column(NamedTuple):
    """Required shape and type of an array of particles."""

    width: int
    whole: bool
    optional: bool


class CheckpointFile:
    """A checkpoint opened by all ranks, each of which reads what it needs. Shapes and types are checked.

    Raises:
        RunError: on all ranks, here and in each method: the file or an array of it is not there, damaged, or of another kind.

    Note:
        Collective, as all methods are.
    """

    def __init__(self, path: str, comm: MPI.Comm) -> None:
        self._path, self._comm = path, comm
        self._file: Any = self._tried(None, self._opened)

    def __enter__(self) -> CheckpointFile:
        return self

    def __exit__(self, *error: object) -> None:
        with suppress(RuntimeError):
            self._file.close()

    def _tried(self, name: str | None, work: Callable[[], T]) -> T:
        """Run a function that reads an array of the file, or the whole file."""

        def run() -> T:
            try:
                return work()
            except (OSError, RuntimeError, LookupError, ValueError, TypeError, MemoryError) as error:
                what = f"checkpoint {self._path}" if name is None else f"/{name} in {self._path}"
                reason = getattr(error, "strerror", None) or (str(error.args[0]) if error.args else str(error))
                raise RunError(f"cannot read {what}: {reason}") from None

        return collectively(self._comm, run, RunError)

    def _opened(self) -> Any:
        import h5py  # not where a run reads nothing

        with open(self._path, "rb"):  # the system names what it refuses in plain words
            pass
        file = h5py.File(self._path, "r")
        if "format" not in file or "description" not in file:
            raise ValueError("it is not a checkpoint")
        number = int(file["format"][0])
        if number != FORMAT:
            raise ValueError(f"it has format {number}, this program reads format {FORMAT}")
        return file

    def description(self) -> bytes:
        """The text of the description, as it is in the file."""

        def read() -> bytes:
            text = self._file["description"][0]
            if not isinstance(text, bytes):
                raise ValueError("its description is no text")
            return bytes(text)

        return self._tried(None, read)

    def _dataset(self, name: str) -> Any:
        dataset = self._file[name]
        claimed, stored = dataset.nbytes, dataset.id.get_storage_size()
        if claimed > min(stored, os.path.getsize(self._path)):
            raise ValueError(f"it has {len(dataset)} rows in {claimed} bytes, of which {stored} are stored")
        return dataset

    def length(self, name: str) -> int:
        """Number of rows of an array."""
        return self._tried(name, lambda: len(self._dataset(name)))

    def names(self, group: str) -> set[str]:
        """Names of the arrays of a group."""
        return self._tried(group, lambda: set(self._file[group]))

    def rows(
        self, name: str, rows: slice, width: int = 1, whole: bool = False, length: int | None = None
    ) -> NDArray[Any]:
        """This rank's rows of an array of real or whole numbers: (n,), or (n, width); `length` is what the array must have."""

        def read() -> NDArray[Any]:
            dataset = self._dataset(name)
            if dataset.dtype != (np.int64 if whole else np.float64):
                raise ValueError(f"it has the type {dataset.dtype}, expected {'int64' if whole else 'float64'}")
            if dataset.shape[1:] != (() if width == 1 else (width,)):
                raise ValueError(f"it has the shape {dataset.shape}, expected {width} number(s) per row")
            if length is not None and len(dataset) != length:
                raise ValueError(f"it has {len(dataset)} rows, expected {length}")
            values = np.ascontiguousarray(dataset[rows])
            if len(values) != rows.stop - rows.start:
                raise ValueError(f"it has {len(dataset)} rows, expected {rows.stop} at least")
            return values

        return self._tried(name, read)

    def own_rows(self, name: str, array: str) -> slice:
        """The rows that the same rank of a run on as many ranks wrote of an array."""
        counts = self.rows(f"ranks/rows_of_{name}", slice(0, self._comm.size), whole=True)
        total = self.length(array)

        def check() -> None:
            if counts.min() < 0 or counts.max() > total or counts.sum() != total:
                raise ValueError(f"it has the numbers {counts.min()} to {counts.max()}, but {array} has {total} rows")

        self._tried(f"ranks/rows_of_{name}", check)
        first = int(counts[: self._comm.rank].sum())
        return slice(first, first + int(counts[self._comm.rank]))

    def particles(self, columns: Mapping[str, Column], rows: slice) -> Arrays:
        """Fields of the particles in some rows."""
        there, length = self.names("particles"), self.length("particles/id")
        return {
            name: self.rows(f"particles/{name}", rows, column.width, column.whole, length)
            for name, column in columns.items()
            if column.width and (name in there or not column.optional)
        }

    def totals(self, names: Iterable[str], rows: slice) -> Arrays:
        """Totals of some ranks."""
        return {name: self.rows(f"ranks/{name}", rows) for name in names}

    def cells(self, widths: Mapping[str, int]) -> Arrays:
        """Tables of the cells of this rank."""
        there = self.names("cells")
        return {
            name: self.rows(f"cells/{name}", self.own_rows(name, f"cells/{name}"), width)
            for name, width in widths.items()
            if name in there
        }

    def rows_of_cells(self, name: str, width: int, cells: NDArray[np.integer]) -> Arrays:
        """The rows of some cells in a table that any rank wrote, by its name; none where the file has no such table."""
        if name not in self.names("cells"):
            return {}
        rows = self.rows(f"cells/{name}", slice(0, self.length(f"cells/{name}")), width)
        return {name: np.ascontiguousarray(rows[np.isin(rows[:, 0], cells)])}
