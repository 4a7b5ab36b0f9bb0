"""Versions of Talus and its libraries. A library is imported when its version is asked for, since it may be missing."""

from __future__ import annotations

import importlib
import platform
import subprocess
from collections.abc import Callable
from typing import Any

from .files import IN_SOURCES, ROOT

SOURCES: dict[str, tuple[str, Callable[[Any], str]]] = {
    "talus": ("mpm_core", lambda module: module.__version__),
    "compiler": ("mpm_core", lambda module: f"GCC or compatible {module.compiler}"),
    "numpy": ("numpy", lambda module: module.__version__),
    "mpi": ("mpi4py.MPI", lambda module: module.Get_library_version().split(",")[0].strip()),
    "dolfinx": ("dolfinx", lambda module: module.__version__),
    "petsc": ("petsc4py.PETSc", lambda module: ".".join(map(str, module.Sys.getVersion()))),
}
"""Modules by the names under which their versions are stored, and how a module names its version"""


def versions() -> dict[str, str]:
    """Versions by name; the reason in the place of the version of what cannot be loaded."""
    found = {"git_revision": git_revision(), "python": platform.python_version()}
    return found | {name: version_of(module, text) for name, (module, text) in SOURCES.items()}


def version_of(module: str, text: Callable[[Any], str] = lambda module: module.__version__) -> str:
    """Version of a module; "not found" where there is none, or the reason why it cannot be loaded."""
    try:
        return str(text(importlib.import_module(module)))
    except ModuleNotFoundError as error:
        return "not found" if error.name in (module, module.split(".")[0]) else f"not loaded: {error}"
    except Exception as error:  # a library of the system that is missing, or of another version, raises of any kind
        return f"not loaded: {error}"


def git_revision() -> str:
    """Commit of the sources, with ``-changed`` when files differ; ``unknown`` outside a clone; none for an installed package."""
    if not IN_SOURCES:
        return "none, installed package"
    command = ["git", "-C", str(ROOT), "describe", "--always", "--abbrev=12", "--exclude=*", "--dirty=-changed"]
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True, timeout=10).stdout.strip()
    except (OSError, subprocess.SubprocessError):
        return "unknown"
