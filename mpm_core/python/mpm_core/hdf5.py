"""HDF5 files of arrays whose rows lie on all ranks. One rank writes them with h5py."""

from __future__ import annotations

import io
import math
import os
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray


class RowsFile:
    """A new HDF5 file of arrays, whose rows are gathered from all ranks to one, which writes the file.

    What the system refuses to write is an error of `close` only, so that no rank waits for another; the file is removed then.

    Args:
        path: of the file; an older one is replaced.
        comm: communicator of the ranks that have rows.
        writer: rank that writes.
        compression: level of deflate, 1 to 9; 0 stores values as they are.
        checksums: protect data by checksums (Fletcher 32), and HDF5's own tables by those of its format 1.10.
    """

    def __init__(
        self, path: str, comm: MPI.Comm, *, writer: int = 0, compression: int = 0, checksums: bool = False
    ) -> None:
        self._path, self._comm, self._writer, self._checksums = path, comm, writer, checksums
        self._options: dict[str, Any] = {"fletcher32": True} if checksums else {}
        if compression:
            self._options |= {"compression": "gzip", "compression_opts": compression}
        self._arrays: dict[str, NDArray[Any]] = {}
        self._links: dict[str, str] = {}
        self._gathers: list[MPI.Request] = []
        self._file: Any = None
        self._refusal: OSError | None = None

    def add_common(self, name: str, values: NDArray[Any]) -> None:
        """Add an array that is the same on all ranks."""
        if self._comm.rank == self._writer:
            self._arrays[name] = values

    def add_link(self, name: str, file: str) -> None:
        """Add a link to the array of the same name in another file of the same folder, which HDF5 follows."""
        self._links[name] = file

    def add(self, name: str, rows: NDArray[Any], counts: Sequence[int]) -> None:
        """Begin to gather an array; `wait` ends it. Collective.

        Args:
            name: path within the file.
            rows: this rank's rows, (n,) or (n, k); they must not change before they are written.
            counts: number of rows of each rank.
        """
        rows = np.ascontiguousarray(rows)
        if self._comm.size == 1:
            self._arrays[name] = rows
            return
        whole = None
        if self._comm.rank == self._writer:
            whole = self._arrays[name] = np.empty((sum(counts), *rows.shape[1:]), rows.dtype)
        width = math.prod(rows.shape[1:])
        self._gathers.append(
            self._comm.Igatherv(rows, whole if whole is None else [whole, [n * width for n in counts]], self._writer)
        )

    def wait(self) -> None:
        """Wait until all arrays are gathered. Collective."""
        MPI.Request.Waitall(self._gathers)
        self._gathers.clear()

    def store(self) -> None:
        """Write the arrays that are gathered, on the rank that writes, by any of its threads."""
        import h5py  # not where a run writes nothing

        if self._file is None and self._refusal is None:
            self._open()
        for name, values in self._arrays.items() if self._file is not None else ():
            if self._options and values.size:
                h5py.File(self._file).create_dataset(name, data=values, **self._options)
                continue
            # As create_dataset does it, in a fifth of the time, which counts in frames of many small fields.
            kind, space = h5py.h5t.py_create(values.dtype), h5py.h5s.create_simple(values.shape)
            dataset = h5py.h5d.create(self._file, name.encode(), kind, space, self._creation, self._into_groups)
            dataset.write(h5py.h5s.ALL, h5py.h5s.ALL, values)
        if self._links and self._file is not None:
            group = h5py.h5g.open(self._file, b"/")
            for name, file in self._links.items():
                group.links.create_external(name.encode(), file.encode(), f"/{name}".encode())
        self._arrays.clear()
        self._links.clear()

    def _open(self) -> None:
        import h5py

        try:
            self._sink = _Sink(self._path, "w+")
        except OSError as refusal:
            self._refusal = refusal
            return
        access = h5py.h5p.create(h5py.h5p.FILE_ACCESS)
        access.set_fclose_degree(h5py.h5f.CLOSE_STRONG)  # nothing of it stays open when it is closed
        access.set_fileobj_driver(h5py.h5fd.fileobj_driver, self._sink)
        if self._checksums:
            access.set_libver_bounds(h5py.h5f.LIBVER_V110, h5py.h5f.LIBVER_V110)
        self._file = h5py.h5f.create(self._path.encode(), h5py.h5f.ACC_TRUNC, fapl=access)
        self._creation = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
        self._creation.set_obj_track_times(False)  # the same frame makes the same file, whenever it is written
        self._into_groups = h5py.h5p.create(h5py.h5p.LINK_CREATE)
        self._into_groups.set_create_intermediate_group(True)

    def close(self, durable: bool = False) -> None:
        """Write what is gathered and close the file; on the rank that writes, others do nothing.

        Args:
            durable: wait until its data are on the disk.

        Raises:
            OSError: with path and reason: the file could not be written.
        """
        if self._comm.rank != self._writer:
            return
        self.store()
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
