"""Frames over time: an HDF5 file for each, and an XDMF file that tells ParaView, VTK and meshio what they contain."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path
from time import monotonic
from types import TracebackType
from typing import Any, TypeVar

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from ._core import InputError, RunError
from .collective import check_same_path, collectively, write_on_first_rank, written
from .components import STATE, tensor_components
from .hdf5 import RowsFile

_TYPES = {1: "Scalar", 3: "Vector", 9: "Tensor"}
_HEAD = '<?xml version="1.0"?>\n<Xdmf Version="3.0">\n<Domain>\n'
_TAIL = "</Grid>\n</Domain>\n</Xdmf>\n"
SHORT = 1 << 19
"""Characters of an XDMF file that is rewritten for each frame, some 150 frames of all fields; see `REWRITING` for longer ones"""
REWRITING = 0.005
"""Fraction of the time in which a long XDMF file is rewritten; for each frame it would take the square of their number"""
PART = 1 << 20
"""Bytes of a frame beyond which another rank writes further fields, to a file of its own"""


class Series:
    """The file ``PATH.xdmf``, and beside it the folder ``PATH`` with an HDF5 file for each frame. Collective.

    The XDMF file is written aside and renamed for each frame, so that it is whole and names whole files only, whenever it is
    read or the run is killed. When it is long, several frames may share a rewriting; `close` names the last ones.

    The first rank writes small frames for all. Of large ones each rank gathers and writes some of the fields, to the files
    ``000012-1.h5`` and so on. The XDMF file names these, and the first file has links to them, which HDF5 follows.

    After `write_in_background` threads write each frame, while the steps after it go on. The frame counts when it is on the
    disk; before the next one is begun, all ranks wait for it, and only then a frame of several files is named.

    Args:
        path: without suffix, or with .h5 or .xdmf. What an earlier series left there is removed.
        comm: communicator of the ranks that have rows.
        grid: name of the grid.
        float32: store real numbers in single precision.
        compression: level of deflate, 0 to 9.

    Raises:
        InputError: another level of compression, or a path that is not the same on all ranks.
        RunError: on all ranks, with path and reason.
    """

    def __init__(
        self, path: str | os.PathLike[str], comm: MPI.Comm, grid: str, float32: bool, compression: int
    ) -> None:
        if compression not in range(10):
            raise InputError(f"compression is {compression}, expected a whole number from 0 to 9")
        text = re.sub(r"\.(h5|xdmf)$", "", os.fspath(path))
        self.comm, self.folder, self.real = comm, Path(text), np.dtype(np.float32 if float32 else np.float64)
        self.n_frames = 0
        self._xdmf, self._grid, self._compression = f"{text}.xdmf", grid, int(compression)
        self._closed, self._frames = False, [""]
        self._length, self._next_rewriting, self._unnamed = 0, 0.0, 0
        self._thread: ThreadPoolExecutor | None = None
        self._unfinished: tuple[Callable[[], object], Frame] | None = None
        """Function that writes this rank's file of the last frame or waits for it, and the frame"""
        self.shared: dict[str, Any] = {}
        """Data of frames on the disk that later frames refer to; cleared when a frame fails, which may have stored some"""
        check_same_path(comm, text)
        write_on_first_rank(comm, text, self._begin)

    def __str__(self) -> str:
        return f"{self._xdmf}, {self.n_frames} frames on the disk{', closed' if self._closed else ''}"

    def write_in_background(self) -> None:
        """Write later frames by a thread; the arrays that it is given must not change any more."""
        self._thread = ThreadPoolExecutor(1)

    def _begin(self) -> None:
        self.folder.mkdir(exist_ok=True)
        for old in self.folder.iterdir():
            if re.fullmatch(r"(\d{6,}|mesh)(-\d+)?\.h5", old.name):
                old.unlink()
        self._replace_xdmf(self._collection())

    def _collection(self, frame: str = "") -> str:
        return f'<Grid Name="{self._grid}" GridType="Collection" CollectionType="Temporal">\n{"".join(self._frames)}{frame}'

    def _replace_xdmf(self, text: str) -> None:
        aside = f"{self._xdmf}.part"
        try:
            with open(aside, "wb", buffering=0) as file:
                content = f"{_HEAD}{text}{_TAIL}".encode()
                os.posix_fallocate(file.fileno(), 0, len(content))  # else ext4 waits for the disk when it is renamed
                file.write(content)
            os.replace(aside, self._xdmf)
        except OSError:
            with suppress(OSError):
                os.unlink(aside)
            raise

    @contextmanager
    def frame(self, time: float, start: str = "") -> Iterator[Frame]:
        """A frame to add fields to; it is named in the XDMF file in the end.

        Args:
            time: s, finite.
            start: what the XDMF file says of the frame beside its fields.

        Raises:
            InputError: the time is not finite.
            RunError: on all ranks, with path and reason; the series is then as before, and may go on. In the background, that
                the frame before could not be written; this one is not begun then.
        """
        self.finish()
        if not np.isfinite(time):
            raise InputError(f"time is {time}, expected a finite number of seconds")
        head = f'<Grid Name="frame" GridType="Uniform">\n<Time Value="{float(time)!r}"/>\n{start}'
        with self._written(f"{self.n_frames:06d}", head, "</Grid>\n") as frame:
            yield frame

    @contextmanager
    def single(self) -> Iterator[Frame]:
        """Data that all frames have in common, in the file ``mesh.h5``; until there is a frame the XDMF file describes them."""
        head = f'<Grid Name="{self._grid}" GridType="Uniform">\n'
        with self._written("mesh", head, None) as frame:
            yield frame

    @contextmanager
    def _written(self, name: str, head: str, end: str | None) -> Iterator[Frame]:
        """A file to add to, then its description: of a frame among others with an end, of the only grid without."""
        if self._closed:
            raise RunError(f"cannot write {self.folder}: it is closed")
        frame = Frame(self.folder, name, self.comm, self.real, self._compression)
        yield frame
        frame.description = f"{head}{''.join(frame.text)}{end or ''}"
        frame.is_only_grid = end is None
        frame.wait()

        def write() -> None:
            frame.write()
            if frame.n_files == 1:
                self._name(frame)

        work: Callable[[], object] = write
        if self._thread is not None and self.comm.rank < frame.n_files:
            work = self._thread.submit(write).result
        self._unfinished = work, frame
        if self._thread is None:
            self.finish()

    def _name(self, frame: Frame) -> None:
        """Name a frame that is on the disk in the XDMF file. On the first rank."""
        start, text = monotonic(), frame.description
        if self._length > SHORT and start < self._next_rewriting:
            self._unnamed += 1
            return
        self._replace_xdmf(text if frame.is_only_grid else self._collection(text))
        self._next_rewriting, self._unnamed = start + (monotonic() - start) / REWRITING, 0

    def finish(self) -> None:
        """Wait until the last frame is on the disk.

        Raises:
            RunError: on all ranks, with path and reason: it could not be written.
        """
        if self._unfinished is None:
            return
        (work, frame), self._unfinished = self._unfinished, None
        try:
            if frame.n_files == 1:
                write_on_first_rank(self.comm, self._xdmf, work)
            else:
                collectively(self.comm, lambda: written(self._xdmf, work), RunError)
                write_on_first_rank(self.comm, self._xdmf, lambda: self._name(frame))
        except RunError:
            frame.remove()
            self.shared.clear()
            raise
        if not frame.is_only_grid:
            self._frames.append(frame.description)
            self._length += len(self._frames[-1])
            self.n_frames += 1

    def close(self) -> None:
        """Complete the files; nothing can be written after that. Ranks communicate only where frames are written in background.

        Raises:
            RunError: with path and reason: the last frame cannot be written, or the last ones not be named; in background on all
                ranks, else on the first one.
        """
        self._closed = True
        try:
            self.finish()
        finally:
            comm = MPI.COMM_SELF if self._thread is None else self.comm
            write_on_first_rank(comm, self._xdmf, self._name_rest)

    def abandon(self) -> None:
        """Complete the files as far as possible, without communication: this rank ends with an error.

        A frame of several files is not named then, since other ranks may have failed to write theirs.
        """
        self._closed = True
        unfinished, self._unfinished = self._unfinished, None
        with suppress(OSError):
            try:
                if unfinished is not None:
                    work, frame = unfinished
                    if self.comm.rank < frame.n_files:
                        work()
                    if frame.n_files == 1 and not frame.is_only_grid:
                        self._frames.append(frame.description)
            finally:
                self._name_rest()

    def _name_rest(self) -> None:
        """Name the frames that are not named yet."""
        if self._unnamed:
            self._unnamed = 0
            self._replace_xdmf(self._collection())


T = TypeVar("T", bound="Output")


class Output:
    """Base class of outputs of one series: a context manager that closes the series."""

    def __init__(self, series: Series) -> None:
        self._series = series

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self._series}>"

    def close(self) -> None:
        """Complete the XDMF file; nothing can be written after that."""
        self._series.close()

    def __enter__(self: T) -> T:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None:
            self.close()
        else:
            self._series.abandon()


class Frame:
    """A frame that is being written, to one file or to one of each of some ranks.

    Args:
        folder: of the files.
        name: of the first file, without suffix.
        comm: communicator of the ranks that have rows.
        real: type of real numbers in the files.
        compression: level of deflate.
    """

    def __init__(self, folder: Path, name: str, comm: MPI.Comm, real: np.dtype[Any], compression: int) -> None:
        self._folder, self._name, self._comm = folder, name, comm
        self._real, self._compression = real, compression
        self._files: list[RowsFile] = []
        self._bytes: list[int] = []
        self.text: list[str] = []
        """What the XDMF file says of its points, cells and fields"""
        self.description = ""
        """All that the XDMF file says of it"""
        self.is_only_grid = False
        """Whether this is the only grid of the XDMF file, not one of a collection over time"""
        self._add_file()

    @property
    def n_files(self) -> int:
        """Number of files; each is written by the rank of its number."""
        return len(self._files)

    def _file_name(self, number: int) -> str:
        return f"{self._name}-{number}.h5" if number else f"{self._name}.h5"

    def _add_file(self) -> None:
        path, writer = self._folder / self._file_name(self.n_files), self.n_files
        self._files.append(RowsFile(str(path), self._comm, writer=writer, compression=self._compression))
        self._bytes.append(0)

    def wait(self) -> None:
        """Wait until all fields are with the ranks that write them. Collective."""
        for file in self._files:
            file.wait()

    def write(self) -> None:
        """Write this rank's file.

        Raises:
            OSError: with path and reason: the file could not be written.
        """
        for file in self._files:
            file.close()

    def remove(self) -> None:
        """Remove this rank's file."""
        if self._comm.rank < self.n_files:
            with suppress(OSError):
                (self._folder / self._file_name(self._comm.rank)).unlink()

    def add_data(self, name: str, rows: NDArray[Any], counts: Sequence[int]) -> str:
        """Add a dataset; returns how the XDMF file names it. Collective."""
        n_bytes = sum(counts) * math.prod(rows.shape[1:]) * rows.dtype.itemsize
        number = int(np.argmin(self._bytes))
        if self._bytes[number] and self._bytes[number] + n_bytes > PART and self.n_files < self._comm.size:
            number = self.n_files
            self._add_file()
        self._bytes[number] += n_bytes
        self._files[number].add(name, rows, counts)
        if number:
            self._files[0].add_link(name, self._file_name(number))
        kind = "Float" if rows.dtype.kind == "f" else "Int"
        shape = " ".join(map(str, (sum(counts), *rows.shape[1:])))
        return (
            f'<DataItem Format="HDF" NumberType="{kind}" Precision="{rows.dtype.itemsize}" Dimensions="{shape}">'
            f"{self._folder.name}/{self._file_name(number)}:/{name}</DataItem>"
        )

    def add_grid(self, kind: str, cells: str, n_cells: int, width: int, points: str) -> None:
        """Describe the cells, and points of three coordinates, by what `add_data` returned."""
        self.text.append(
            f'<Topology TopologyType="{kind}" NumberOfElements="{n_cells}" NodesPerElement="{width}">{cells}</Topology>\n'
            f'<Geometry GeometryType="XYZ">{points}</Geometry>\n'
        )

    def describe_field(self, name: str, center: str, width: int, data: str) -> None:
        """Describe a field by what `add_data` returned."""
        self.text.append(
            f'<Attribute Name="{name}" AttributeType="{_TYPES.get(width, "Matrix")}" Center="{center}">{data}</Attribute>\n'
        )

    def add_field(
        self, name: str, center: str, values: NDArray[Any], counts: Sequence[int], axisymmetric: bool = False
    ) -> None:
        """Add a field on nodes or cells: a tensor by its components, states by number, other real numbers as they are.

        Args:
            name: of the field.
            center: "Node" or "Cell".
            values: this rank's rows, (n,) or (n, k).
            counts: number of rows of each rank.
            axisymmetric: whether the third of four components of a symmetric tensor is that of the hoop.
        """
        width = values.shape[1] if values.ndim == 2 else 1
        whole = values.ndim == 1 or width == 9 and name != STATE  # XDMF has tensors of nine
        components = None if whole else tensor_components(name, width, axisymmetric)
        if components:
            for k, component in enumerate(components):
                self.add_field(f"{name}_{component}", center, values[:, k], counts)
            return
        if values.dtype.kind == "f" or values.ndim == 2:
            values = padded(values, self._real)
        shown = values.shape[1] if values.ndim == 2 else 1
        self.describe_field(name, center, shown, self.add_data(name, values, counts))


def padded(values: NDArray[Any], real: np.dtype[Any]) -> NDArray[Any]:
    """Real numbers as they are stored: two components with a third one of zero, one component without an axis of its own."""
    if values.ndim == 2 and values.shape[1] == 2:
        three = np.zeros((len(values), 3), real)
        three[:, :2] = values
        return three
    return np.ascontiguousarray(values[:, 0] if values.ndim == 2 and values.shape[1] == 1 else values, real)
