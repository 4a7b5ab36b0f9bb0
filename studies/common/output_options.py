"""Options of the files for ParaView: which fields, how exact, how small."""

from __future__ import annotations

import argparse
import os
import shutil
from collections.abc import Sequence
from pathlib import Path

import mpm_core as mpm

from .options import add_switch

FRAME_BYTES = 44
"""Memory of a particle in each frame for pictures: nine numbers in single precision, and its number"""


def add_output_options(parser: argparse.ArgumentParser, names: Sequence[str]) -> None:
    """Options ``--fields``, ``--float64`` and ``--compression``.

    Args:
        names: fields of particles that there are; positions are always written.
    """

    def fields(text: str) -> str:
        wrong = [name for name in text.split(",") if name not in names]
        if wrong:
            raise argparse.ArgumentTypeError(f"has '{wrong[0]}', expected some of {','.join(names)}")
        return text

    def level(text: str) -> int:
        if text not in list("0123456789"):
            raise argparse.ArgumentTypeError(f"is '{text}', expected a whole number from 0 to 9")
        return int(text)

    level.takes = "a number"  # type: ignore[attr-defined]
    parser.add_argument(
        "--fields", type=fields, default=",".join(names), metavar="A,B,...",
        help="particle fields to store, beside the position (default: all)",
    )  # fmt: skip
    parser.add_argument("--float64", action="store_true", help="store fields in double precision")
    parser.add_argument(
        "--compression",
        type=level,
        default=0,
        metavar="N",
        help="level of compression of the files, 0 to 9 (default: 0)",
    )


def add_picture_options(parser: argparse.ArgumentParser) -> None:
    """Options ``--no-pictures`` and ``--no-film`` of a study that draws figures and a film."""
    add_switch(
        parser, "--pictures", True, "draw figures and a film; otherwise the page has the player and the curves only"
    )
    add_switch(parser, "--film", True, "draw a film, which takes most of the time of all pictures")


def check_frames(model: mpm.Model, options: argparse.Namespace, folder: Path) -> None:
    """Refuse more frames than the machine's memory, or the disk of the results folder, can take. Collective.

    Args:
        options: with ``frames``, ``fields``, ``float64`` and ``compression``.

    Raises:
        InputError: on all ranks alike, with the bytes that they would take and those that there are.
    """
    comm = model.comm
    particles, frames = comm.allreduce(len(model.particles)), options.frames
    numbers = 3 + sum(_width(model, name) for name in options.fields.split(","))
    needed = {
        "memory": (frames * particles * FRAME_BYTES, os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")),
        "disk": (frames * particles * numbers * (8 if options.float64 else 4), shutil.disk_usage(folder).free),
    }
    if options.compression > 0:
        del needed["disk"]
    for where, (bytes_needed, there) in comm.bcast(needed).items():
        if bytes_needed > there:
            raise mpm.InputError(
                f"--frames is {frames}: {particles} particles would take {bytes_needed:.3g} bytes of {where}, but there "
                f"are {there:.3g}"
            )


def _width(model: mpm.Model, name: str) -> int:
    """Numbers of a field per particle; one, where the model has it under another name."""
    values = getattr(model.particles, name, None)
    return 1 if values is None or values.ndim == 1 else values.shape[1]
