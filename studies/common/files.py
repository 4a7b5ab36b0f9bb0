"""Files that appear as a whole or not at all, and files that a run can do without."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
IN_SOURCES = (ROOT / "CMakeLists.txt").exists()
"""Whether the studies are those of the source tree, not of an installed package"""

NOT_WRITTEN: list[str] = []
"""Pictures and films that this run could not write, each with the reason; ``run_study`` prints them at the end."""

PROGRAM = os.environ.get("TALUS_PROGRAM", "studies/run")
"""The command that runs studies, as messages name it"""


class OutputError(RuntimeError):
    """The results cannot be written; the message names the path and the reason."""


@contextlib.contextmanager
def written_whole(path: Path) -> Iterator[Path]:
    """A path beside ``path`` to write to; what is there in the end gets its name, and replaces what had it.

    Raises:
        OutputError: the system refused to write; with path and reason. What had the name before stays.
    """
    aside = path.with_name(path.name + ".part")
    try:
        yield aside
        with open(aside, "rb") as file:
            os.fsync(file.fileno())
        os.replace(aside, path)
    except OSError as error:
        raise OutputError(f"cannot write {path}: {error.strerror or error}") from None
    finally:
        with contextlib.suppress(OSError):
            aside.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write a file of text as a whole, see `written_whole`."""
    with written_whole(path) as aside:
        aside.write_text(text, encoding="utf-8")


@contextlib.contextmanager
def expendable(path: Path) -> Iterator[Path]:
    """As `written_whole`, for a picture or film: if it cannot be written, the run records the reason and continues without it."""
    try:
        with written_whole(path) as aside:
            yield aside
    except OutputError as error:
        NOT_WRITTEN.append(str(error))
