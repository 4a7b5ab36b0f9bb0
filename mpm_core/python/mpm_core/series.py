"""Frames over time: an HDF5 file for each, and an XDMF file that tells ParaView, VTK and meshio what they contain."""

from __future__ import annotations

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
from .collective import check_same_path, write_on_first_rank
from .hdf5 import RowsFile

_TENSOR = {4: ("xx", "yy", "{out}", "xy"), 6: ("xx", "yy", "zz", "xy", "yz", "xz")}
_TYPES = {1: "Scalar", 3: "Vector", 9: "Tensor"}
_HEAD = '<?xml version="1.0"?>\n<Xdmf Version="3.0">\n<Domain>\n'
_TAIL = "</Grid>\n</Domain>\n</Xdmf>\n"
SHORT = 1 << 19
"""Characters of an XDMF file that is rewritten for each frame, some 150 frames of all fields; see `REWRITING` for longer ones"""
REWRITING = 0.005
"""Fraction of the time in which a long XDMF file is rewritten; for each frame it would take the square of their number"""


class Series:
    """The file ``PATH.xdmf``, and beside it the folder ``PATH`` with an HDF5 file for each frame. Collective.

    The XDMF file is written aside and renamed for each frame, so that it is whole and names whole files only, whenever it is
    read or the run is killed. When it is long, several frames may share a rewriting; `close` names the last ones.

    After `write_in_background` a thread of the first rank writes each frame, while the steps after it go on. The frame counts
    when it is on the disk; before the next one is begun, all ranks wait for it.

    Args:
        path: without suffix, or with .h5 or .xdmf. What an earlier series left there is removed.
        comm: communicator whose first rank writes.
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
        self._unfinished: tuple[Callable[[], object], str] | None = None
        """Function that writes the last frame or waits for it, and the text of the frame in the XDMF file"""
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
            if re.fullmatch(r"(\d{6,}|mesh)\.h5", old.name):
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
        path = self.folder / f"{name}.h5"
        if self._closed:
            raise RunError(f"cannot write {self.folder}: it is closed")
        file = RowsFile(str(path), self.comm, compression=self._compression)
        frame = Frame(file, f"{self.folder.name}/{name}.h5", self.real)
        yield frame
        file.wait()
        text = f"{head}{''.join(frame.text)}"

        def write() -> None:
            file.close()
            start = monotonic()
            if self._length > SHORT and start < self._next_rewriting:
                self._unnamed += 1
                return
            try:
                self._replace_xdmf(text if end is None else self._collection(text + end))
            except OSError:
                with suppress(OSError):
                    path.unlink()
                raise
            self._next_rewriting, self._unnamed = start + (monotonic() - start) / REWRITING, 0

        work: Callable[[], object] = write
        if self._thread is not None and self.comm.rank == 0:
            work = self._thread.submit(write).result
        self._unfinished = work, "" if end is None else text + end
        if self._thread is None:
            self.finish()

    def finish(self) -> None:
        """Wait until the last frame is on the disk.

        Raises:
            RunError: on all ranks, with path and reason: it could not be written.
        """
        if self._unfinished is None:
            return
        (work, text), self._unfinished = self._unfinished, None
        try:
            write_on_first_rank(self.comm, self._xdmf, work)
        except RunError:
            self.shared.clear()
            raise
        if text:
            self._frames.append(text)
            self._length += len(text)
            self.n_frames += 1

    def close(self) -> None:
        """Complete the files; nothing can be written after that. Ranks communicate only where frames are written in background.

        Raises:
            RunError: with path and reason: the last frame cannot be written, or the last ones not be named; in background on all
                ranks, else on the first one.
        """
        self._closed = True
        comm = MPI.COMM_SELF if self._thread is None else self.comm
        write_on_first_rank(comm, self._xdmf, self._complete)

    def abandon(self) -> None:
        """Complete the files as far as possible, without communication: this rank ends with an error."""
        self._closed = True
        if self.comm.rank == 0:
            with suppress(OSError):
                self._complete()

    def _complete(self) -> None:
        """Wait for the last frame, and name those that are not named yet."""
        (work, text), self._unfinished = self._unfinished or (None, ""), None
        try:
            if work is not None:
                work()
                self._frames.append(text)
        finally:
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
    """A file of a series that is being written."""

    def __init__(self, file: RowsFile, address: str, real: np.dtype[Any]) -> None:
        self._file, self._address, self._real = file, address, real
        self.text: list[str] = []
        """Its description in the XDMF file"""

    def add_data(self, name: str, rows: NDArray[Any], counts: Sequence[int]) -> str:
        """Add a dataset; returns how the XDMF file names it. Collective."""
        self._file.add(name, rows, counts)
        kind = "Float" if rows.dtype.kind == "f" else "Int"
        shape = " ".join(map(str, (sum(counts), *rows.shape[1:])))
        return (
            f'<DataItem Format="HDF" NumberType="{kind}" Precision="{rows.dtype.itemsize}" Dimensions="{shape}">'
            f"{self._address}:/{name}</DataItem>"
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
        self, name: str, center: str, values: NDArray[Any], counts: Sequence[int], out_of_plane: str = "zz"
    ) -> None:
        """Add a field on nodes or cells: a tensor by its components, other real numbers as they are; whole ones as given.

        Args:
            name: of the field.
            center: "Node" or "Cell".
            values: this rank's rows, (n,) or (n, k).
            counts: number of rows of each rank.
            out_of_plane: name of the third of four components.
        """
        width = values.shape[1] if values.ndim == 2 else 1
        if width in _TENSOR:
            for k, component in enumerate(_TENSOR[width]):
                self.add_field(f"{name}_{component.format(out=out_of_plane)}", center, values[:, k], counts)
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
