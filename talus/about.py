"""The command ``talus info``: versions, solvers, processors. It also runs where something is missing, and says what."""

from __future__ import annotations

import importlib
import os
import shutil
import sys
from typing import Any

from talus import find

SOLVERS = ("mumps", "superlu_dist", "hypre", "ml")
"""Packages of PETSc that solve or precondition linear systems"""

OTHERS = ("h5py", "gmsh", "matplotlib", "jinja2", "tqdm")
"""Modules that files, meshes, pictures, pages and progress bars need"""


def version() -> str:
    """Version of Talus, or the reason why its core cannot be loaded."""
    return str(_versions().version_of("mpm_core"))


def about() -> str:
    """Versions, solvers and processors as lines of text."""
    from ctypes.util import find_library  # which takes a third of the other imports of `talus`

    common = _versions()
    lines = {
        **{name.replace("_", " "): version for name, version in common.versions().items()},
        **{name: common.version_of(name) for name in OTHERS},
        "linear solvers": common.version_of("petsc4py.PETSc", _solvers),
        "processors": f"{len(os.sched_getaffinity(0))} for this process; mpirun {shutil.which('mpirun') or 'not found'}",
        "films": "MP4 by ffmpeg" if shutil.which("ffmpeg") else "GIF (ffmpeg not found)",
        "meshes": "gmsh reads them in a process that cannot start programs" if find_library("seccomp") else
        "files are searched for commands before gmsh reads them (libseccomp not found)",
        "studies": ", ".join(str(folder) for folder in find.folders()),
    }  # fmt: skip
    return "\n".join(f"{name + ':':<16} {value}" for name, value in lines.items())


def _versions() -> Any:
    """The module of studies that finds versions."""
    sys.path.insert(0, str(find.SHIPPED))
    return importlib.import_module("common.versions")


def _solvers(petsc: Any) -> str:
    if not hasattr(petsc.Sys, "hasExternalPackage"):
        return "PETSc"
    return ", ".join(["PETSc", *(name for name in SOLVERS if petsc.Sys.hasExternalPackage(name))])
