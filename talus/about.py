"""The command ``talus info``: versions, solvers, processors."""

from __future__ import annotations

import ctypes.util
import importlib
import os
import shutil
import sys

from talus import find

SOLVERS = ("mumps", "superlu_dist", "hypre", "ml")
"""Packages of PETSc that solve or precondition linear systems"""


def about() -> str:
    """Lines of text."""
    sys.path.insert(0, str(find.SHIPPED))
    versions = importlib.import_module("common.summary").versions()
    lines = {
        **{name.replace("_", " "): version for name, version in versions.items()},
        "gmsh": _module_version("gmsh"),
        "linear solvers": _solvers(),
        "processors": f"{len(os.sched_getaffinity(0))} for this process; mpirun {shutil.which('mpirun') or 'not found'}",
        "films": "MP4 by ffmpeg" if shutil.which("ffmpeg") else "GIF (ffmpeg not found)",
        "meshes": "read by a process that may not start programs" if ctypes.util.find_library("seccomp") else
        "searched for commands before they are read (libseccomp not found)",
        "studies": ", ".join(str(folder) for folder in find.folders()),
    }  # fmt: skip
    return "\n".join(f"{name + ':':<16} {value}" for name, value in lines.items())


def _module_version(name: str) -> str:
    try:
        return str(importlib.import_module(name).__version__)
    except ImportError:
        return "not found"


def _solvers() -> str:
    try:
        system = importlib.import_module("petsc4py.PETSc").Sys
    except ImportError:
        return "PETSc not found"
    if not hasattr(system, "hasExternalPackage"):
        return "PETSc"
    there = [name for name in SOLVERS if system.hasExternalPackage(name)]
    return ", ".join(["PETSc", *there])
