"""HDF5 files of arrays whose rows lie on all ranks. The first rank writes them with h5py, one after another."""

from __future__ import annotations

import io
import os
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray


class RowsFile:
    """A new HDF5 file to which each rank adds its rows of arrays.

    What the system refuses to write is an error of `close` only, which the first rank calls, so that no rank waits for another;
    the file is removed then.

    Args:
        path: of the file; an older one is replaced.
        comm: communicator whose first rank writes.
        compression: level of deflate, 1 to 9; 0 stores values as they are.
        checksums: protect data by checksums (Fletcher 32), and HDF5's own tables by those of its format 1.10.

    Note:
        Collective, as all methods but `close` are.
    """

    def __init__(self, path: str, comm: MPI.Comm, *, compression: int = 0, checksums: bool = False) -> None:
        self._path, self._comm = path, comm
        self._refusal: OSError | None = None
        self._file: Any = None
        self._options: dict[str, Any] = {"fletcher32": True} if checksums else {}
        if compression:
            self._options |= {"compression": "gzip", "compression_opts": compression}
        if comm.rank == 0:
            import h5py  # not where a run writes nothing

            self._h5py = h5py
            try:
                self._sink = _Sink(path, "w+")
            except OSError as refusal:
                self._refusal = refusal
            else:
                self._file = h5py.File(self._sink, "w", libver=("v110", "v110") if checksums else None)

    def add_common(self, name: str, values: NDArray[Any]) -> None:
        """Add an array that is the same on all ranks."""
        if self._file is not None:
            self._file.create_dataset(name, data=values, **self._options)

    def add(self, name: str, rows: NDArray[Any], counts: Sequence[int]) -> None:
        """Add an array.

        Args:
            name: path within the file.
            rows: this rank's rows, (n,) or (n, k).
            counts: number of rows of each rank.
        """
        whole = _gathered(self._comm, rows, counts)
        if self._file is None or whole is None:
            return
        if self._options and whole.size:
            self._file.create_dataset(name, data=whole, **self._options)
            return
        # As create_dataset does it, in a fifth of the time, which counts in frames of many small fields.
        all_rows, space = self._h5py.h5s.ALL, self._h5py.h5s.create_simple(whole.shape)
        kind = self._h5py.h5t.py_create(whole.dtype)
        creation = self._h5py.h5p.create(self._h5py.h5p.DATASET_CREATE)
        creation.set_obj_track_times(False)  # the same frame makes the same file, whenever it is written
        self._h5py.h5d.create(self._file.id, name.encode(), kind, space, creation).write(all_rows, all_rows, whole)

    def close(self, durable: bool = False) -> None:
        """Close the file, on the first rank.

        Args:
            durable: wait until its data are on the disk.

        Raises:
            OSError: with path and reason: the file could not be written.
        """
        if self._file is not None:
            self._file.close()
            if durable:
                self._sink.attempt(lambda: os.fsync(self._sink.fileno()))
            self._sink.close()
            self._refusal = self._sink.refusal
            if self._refusal is not None:
                with suppress(OSError):
                    os.unlink(self._path)
        if self._refusal is not None:
            raise OSError(self._refusal.errno, self._refusal.strerror, self._path)


class HeldRows:
    """The arrays of a `RowsFile`, gathered to the first rank, which can write them later and by another thread."""

    def __init__(self, path: str, comm: MPI.Comm, compression: int) -> None:
        self._path, self._comm, self._compression = path, comm, compression
        self._arrays: dict[str, NDArray[Any]] = {}

    def add(self, name: str, rows: NDArray[Any], counts: Sequence[int]) -> None:
        """Add an array as `RowsFile.add` does; its values must not change any more. Collective."""
        whole = _gathered(self._comm, rows, counts)
        if whole is not None:
            self._arrays[name] = whole

    def close(self) -> None:
        """Write the file, on the first rank.

        Raises:
            OSError: with path and reason: the file could not be written.
        """
        file = RowsFile(self._path, MPI.COMM_SELF, compression=self._compression)
        for name, whole in self._arrays.items():
            file.add(name, whole, [len(whole)])
        file.close()


class _Sink(io.FileIO):
    """A file for HDF5, which cannot close a file that the system refuses to write: the first refusal is kept here."""

    refusal: OSError | None = None

    def attempt(self, work: Callable[[], Any]) -> None:
        if self.refusal is None:
            try:
                work()
            except OSError as refusal:
                self.refusal = refusal

    def write(self, data: Any) -> int:
        def write_all() -> None:
            rest = memoryview(data).cast("B")
            while rest:
                rest = rest[super(_Sink, self).write(rest) :]

        self.attempt(write_all)
        return len(data)

    def truncate(self, size: int | None = None) -> int:
        self.attempt(lambda: super(_Sink, self).truncate(size))
        return size or 0


def _gathered(comm: MPI.Comm, rows: NDArray[Any], counts: Sequence[int]) -> NDArray[Any] | None:
    """Rows of all ranks by rising rank, on the first rank."""
    rows = np.ascontiguousarray(rows)
    if comm.size == 1:
        return rows
    whole = np.empty((sum(counts), *rows.shape[1:]), rows.dtype) if comm.rank == 0 else None
    width = int(np.prod(rows.shape[1:]))
    comm.Gatherv(rows, None if whole is None else [whole, [n * width for n in counts]])
    return whole
