"""Checks of options that depend on each other, on files or on the size of a mesh; each ends the run with an error."""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path

from mpi4py import MPI

from .options import check


def check_effect(
    parser: argparse.ArgumentParser, options: argparse.Namespace, holds: bool, names: Sequence[str], expected: str
) -> None:
    """End with an error when the command line names options that have no effect with others. A file of parameters may name them.

    Args:
        holds: whether they have an effect.
        expected: with which options they would have one.
    """
    for name in () if holds else names:
        check(parser, name not in getattr(options, "given", ()), f"{name} is given, expected {expected} with it")


def check_whole(parser: argparse.ArgumentParser, cells: float, message: Callable[[], str] | str) -> None:
    """End with an error when a body does not consist of whole cells.

    Args:
        cells: length of the body over that of a cell.
    """
    check(parser, abs(cells - round(cells)) <= 1e-4 * cells, message)


def check_two_cells(parser: argparse.ArgumentParser, options: argparse.Namespace, names: Sequence[str]) -> None:
    """End with an error where a length, by its name among the options, is shorter than two cells."""
    for name in names:
        check(parser, options.cell_size <= 0.5 * getattr(options, name),
              lambda name=name: f"--cell-size is {options.cell_size:g} m, expected at most half of --{name.replace('_', '-')}")  # fmt: skip


def check_file(parser: argparse.ArgumentParser, path: Path | None, name: str) -> None:
    """End with an error when an option names a file that is not there."""
    check(parser, path is None or path.is_file(), lambda: f"{name} is {path}, but there is no such file")


def say(text: str) -> None:
    """Warn of what is probably a mistake; nothing for an empty text. The first rank does."""
    if text and MPI.COMM_WORLD.rank == 0:
        warnings.warn(text, RuntimeWarning, stacklevel=3)


LOWEST = 1e3
"""Pressure [Pa] below which it is more probably one in kPa"""


def low_pressure(name: str, pressure: float) -> str:
    """What a warning says of a pressure of soil that is probably in kPa; empty for others.

    Args:
        name: of the option.
    """
    if not 0 < pressure < LOWEST:
        return ""
    return f"{name} is {pressure:g} Pa, less than under 0.1 m of soil: {pressure:g} kPa are {pressure:g}e3"


def check_cells_of_radius(parser: argparse.ArgumentParser, options: argparse.Namespace) -> None:
    """End with an error where the cells beside a round body are larger than a third of its radius."""
    check(
        parser,
        3 * options.cell_size <= options.radius * (1 + 1e-9),
        lambda: f"--cell-size is {options.cell_size:g} m, expected a third of --radius, {options.radius:g} m, at most",
    )


MOST_CELLS = 2e7
"""Number of cells above which a mesh is a mistake: on one machine it takes its memory"""


def check_cells(parser: argparse.ArgumentParser, options: argparse.Namespace, cells: float, *names: str) -> None:
    """End with an error, before a mesh is made, when it would have more than `MOST_CELLS` cells.

    Args:
        cells: estimated number.
        names: of the options on which it depends.
    """
    values = ", ".join(f"{name} {getattr(options, name[2:].replace('-', '_')):g}" for name in names)
    check(
        parser,
        cells <= MOST_CELLS,
        lambda: f"{values}: the mesh would have some {cells:.2g} cells, expected at most {MOST_CELLS:.0e}",
    )
