"""Output of rigid surfaces over time, for ParaView and other programs."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ._core import InputError
from .collective import collectively
from .output_checks import type_of_positions
from .series import Output, Series, padded

if TYPE_CHECKING:
    from .model import Model


class BodyOutput(Output):
    """Frames of the rigid surfaces that a model's particles touch, as segments or triangles; a context manager.

    Fields are the ``velocity`` [m/s] of points, and on segments and triangles the number of their ``body``, in the order of
    ``Model.contacts``, and the ``force`` of the soil on it in the last step [N].

    Example:
        >>> with BodyOutput(model, "results/bodies") as output:
        ...     for report in model.explicit(until=1.0, every=0.1):
        ...         output.write()

    Args:
        model: the model, with contact; surfaces that are added later are not written.
        path: of the XDMF file and of the folder of frames, without suffix; the folder around them must exist. What an
            earlier series left there is removed.
        float32: store real numbers in single precision; in double precision if false.
        compression: level of deflate, 1 to 9; 0 stores values as they are.

    Raises:
        InputError: a model without contact.
        RunError: on all ranks, with path and reason, when the files cannot be written.

    Note:
        Collective: construction, ``write`` and ``close`` are called by all ranks; the first rank writes.
    """

    def __init__(self, model: Model, path: str | os.PathLike[str], float32: bool = True, compression: int = 0) -> None:
        def require_contact() -> None:
            if not model.contacts:
                raise InputError("model has no contact, expected rigid surfaces to write; see model.add_contact")

        collectively(model.comm, require_contact)
        super().__init__(Series(path, model.comm, "bodies", float32, compression))
        self._contacts = model.contacts
        cells, outlines, self._body, first = [], [], [], 0
        for number, contact in enumerate(self._contacts):
            points, of_surface = contact.outline()
            cells.append(of_surface + first)
            outlines.append(points)
            self._body.append(np.full(len(of_surface), number, np.int32))
            first += len(points)
        self._cells = np.concatenate(cells).astype(np.int32)
        self._position_type = type_of_positions(model.comm, np.concatenate(outlines), self._series.real)

    def write(self) -> None:
        """Write a frame of the surfaces as they are now, which is on disk when this returns.

        Raises:
            RunError: the frame cannot be written.
        """
        contacts, dim = self._contacts, self._contacts[0].model.mesh.dim
        outlines = [contact.outline()[0] for contact in contacts]
        points, body = np.concatenate(outlines), np.concatenate(self._body)
        velocities = [contact.velocity_at(x) for contact, x in zip(contacts, outlines, strict=True)]
        fields: tuple[tuple[str, str, NDArray], ...] = (
            ("velocity", "Node", np.concatenate(velocities)), ("body", "Cell", body),
            ("force", "Cell", np.array([contact.force for contact in contacts])[body]),
        )  # fmt: skip
        with self._series.frame(contacts[0].model.time) as frame:
            before, place, topology = self._series.shared.get(
                "stored", (b"", "", "")
            )  # points; where they and the cells are
            if points.tobytes() != before:  # surfaces that rest are stored once
                place = frame.add_data("points", *self._rows(padded(points, self._position_type)))
                topology = topology or frame.add_data("cells", *self._rows(self._cells))
            frame.add_grid("Polyline" if dim == 2 else "Triangle", topology, len(self._cells), dim, place)
            for name, center, values in fields:
                frame.add_field(name, center, *self._rows(values))
        self._series.shared["stored"] = (points.tobytes(), place, topology)

    def _rows(self, values: NDArray) -> tuple[NDArray, list[int]]:
        """Rows that this rank writes, and the number of rows of each rank: the first rank writes all of them."""
        comm = self._series.comm
        return values if comm.rank == 0 else values[:0], [len(values)] + [0] * (comm.size - 1)
