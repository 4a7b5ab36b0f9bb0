"""Reading a mesh by gmsh in a process of its own, with limits, since gmsh crashes or hangs on some damaged files."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fenics_bridge.errors import InputError
from fenics_bridge.mesh import gmsh_reader

SCRIPT = Path(__file__).with_name("gmsh_confined.py")


@dataclass(frozen=True)
class Limits:
    """Limits of the process, see `read_mesh`."""

    time: float
    memory: float | None
    allow_commands: bool

    def memory_bytes(self) -> int:
        """The limit in bytes; half of the machine's memory if none was given."""
        if self.memory is not None:
            return int(self.memory)
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") // 2


def read_apart(path: Path, dim: int, result: Path, name: str, limits: Limits) -> dict[str, NDArray]:
    """Arrays of a file as `gmsh_reader.read_file` gives them, read by a process of its own.

    Args:
        path: the file.
        dim: 2 for triangles, 3 for tetrahedra.
        result: file to which the process writes the arrays.
        name: name of the mesh in messages.
        limits: what the process may take and do.

    Raises:
        InputError: the mesh cannot be used, or the process failed or exceeded its limits.
    """
    code, text = _ran(path, dim, result, name, limits)
    if code == gmsh_reader.REFUSED:
        perhaps = f"; perhaps it is damaged, or needs more than {limits.memory_bytes() / 1e9:.2g} GB, see memory_limit"
        raise InputError(f"path: {name!r}: {text}{perhaps if text.endswith(gmsh_reader.NO_REASON) else ''}")
    if code == gmsh_reader.TOO_LARGE or any(word in text for word in ("bad_alloc", "MemoryError", "allocate memory")):
        raise InputError(f"path: gmsh needs more than {limits.memory_bytes() / 1e9:.2g} GB for {name!r}; if the mesh is so "
                         "large, raise memory_limit")  # fmt: skip
    if code != 0:
        how = f"signal {-code}" if code < 0 else f"code {code}"
        last = text.rsplit("\n", 1)[-1]
        raise InputError(
            f"path: gmsh crashed while it read {name!r} ({how}{': ' + last if last else ''}); it is damaged, or one of its "
            "constants, such as a cell size, is out of range (parameters)"
        )
    with np.load(result) as arrays:
        return dict(arrays)


def _ran(path: Path, dim: int, result: Path, name: str, limits: Limits) -> tuple[Any, ...]:
    """Exit code and standard error of the process."""
    errors = result.with_name("errors")
    words = [str(path), str(dim), str(result), str(limits.memory_bytes()), "yes" if limits.allow_commands else "no"]
    with open(errors, "wb") as file:
        # It ends when its standard input does: at the latest with this process.
        reader = subprocess.Popen([sys.executable, str(SCRIPT), *words], stdin=subprocess.PIPE,
                                  stdout=subprocess.DEVNULL, stderr=file)  # fmt: skip
    try:
        code = reader.wait(limits.time)
    except subprocess.TimeoutExpired:
        raise InputError(
            f"path: gmsh took more than {limits.time:g} s for {name!r}; if the mesh is so large, raise time_limit"
        ) from None
    finally:
        reader.kill()
        if reader.stdin is not None:
            reader.stdin.close()
        reader.wait()
    return code, errors.read_text(errors="replace").strip()
