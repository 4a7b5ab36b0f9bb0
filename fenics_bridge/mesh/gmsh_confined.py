"""The process that reads a mesh by gmsh: bounded in memory, without the right to start programs, and gone with its parent.

A .geo file is a program: `SystemCall` runs commands. A damaged .msh makes gmsh read for ever, or take all memory.
"""

from __future__ import annotations

import ctypes
import errno
import os
import re
import resource
import sys
import threading
from pathlib import Path
from typing import Any

import gmsh  # noqa: F401  # loaded at once: it starts programs, which are forbidden later
import gmsh_reader  # type: ignore[import]  # beside this file, which is started as a script
import numpy as np

ALLOW, REFUSE = 0x7FFF0000, 0x00050000 | errno.EPERM
"""SCMP_ACT_ALLOW and SCMP_ACT_ERRNO(EPERM) of libseccomp"""


def end_with_parent() -> None:
    """End this process when the parent has: then its end of our standard input is closed, however it ended."""

    def wait() -> None:
        while os.read(0, 1024):  # not sys.stdin, whose lock would be held when this process ends
            pass
        os._exit(1)

    threading.Thread(target=wait, daemon=True).start()


def limit_memory(size: int) -> int:
    """No more than `size` bytes of address space beyond what is used by now, which is returned."""
    used = (
        int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize() if sys.platform == "linux" else 0
    )
    resource.setrlimit(resource.RLIMIT_AS, (used + size, used + size))
    return used


def most_used() -> int:
    """The largest address space that this process had [bytes]; 0 where the system does not say."""
    if sys.platform != "linux":
        return 0
    found = re.search(r"VmPeak:\s+(\d+) kB", Path("/proc/self/status").read_text())
    return int(found.group(1)) * 1024 if found else 0


def forbid_programs() -> bool:
    """Forbid this process and its children to start programs. Returns whether the system supports this."""
    try:
        library = ctypes.CDLL("libseccomp.so.2")
    except OSError:
        return False
    library.seccomp_init.restype = ctypes.c_void_p
    rules = ctypes.c_void_p(library.seccomp_init(ctypes.c_uint32(ALLOW)))
    for name in (b"execve", b"execveat"):
        number = library.seccomp_syscall_resolve_name(name)
        if library.seccomp_rule_add(rules, ctypes.c_uint32(REFUSE), number, 0) != 0:
            return False
    return library.seccomp_load(rules) == 0


def children() -> tuple[Any, ...]:
    """Resources used by the children of this process; they change when one is started, even if it cannot become a program."""
    return tuple(resource.getrusage(resource.RUSAGE_CHILDREN))


COMMANDS = re.compile(rb"\b(?:NonBlocking)?System(?:Call)?\b|\bOnelabRun\b")
NAMED = re.compile(rb"\b(?:Include|Merge|MergeWithBoundingBox|Open)\s+(?:\"([^\"\n]*)\"\s*;|[^;]*;)")


def command_in(path: Path, seen: Any = ()) -> str | None:
    """Why a .geo file, or one that it names, may run commands; None when no word of theirs says so. Their comments count too.

    Args:
        path: the file.
        seen: files that have been searched already.
    """
    text = path.read_bytes()
    if COMMANDS.search(text):
        return f"{path.name} mentions SystemCall or the like"
    for found in NAMED.finditer(text):
        if found.group(1) is None:
            return f"{path.name} has {found.group().decode(errors='replace')!r}, a file that cannot be searched"
        other = (path.parent / os.fsdecode(found.group(1))).resolve()
        if other.is_file() and other not in seen:
            why = command_in(other, (*seen, path.resolve(), other))
            if why is not None:
                return why
    return None


def main(path: Path, dim: str, result: str, memory: str, allow_commands: str) -> Any:
    end_with_parent()
    used = limit_memory(int(memory))
    confined = allow_commands == "no" and forbid_programs()
    before = children()
    refused = "it runs commands by SystemCall; allow_commands=True lets it, if you trust it"
    if allow_commands == "no" and not confined and path.suffix.lower() == ".geo":
        why = command_in(path)
        if why is not None:
            raise gmsh_reader.MeshError(
                f"{refused} ({why}, and without libseccomp nothing would keep gmsh from running it)"
            )
    try:
        arrays = gmsh_reader.read_file(path, int(dim))
    except MemoryError:
        sys.exit(gmsh_reader.TOO_LARGE)
    except gmsh_reader.MeshError as error:
        # An array that grows doubles, so that what failed was up to half of the memory.
        if str(error).endswith(gmsh_reader.NO_REASON) and most_used() > used + 0.4 * int(memory):
            sys.exit(gmsh_reader.TOO_LARGE)
        raise
    finally:
        if confined and children() != before:
            raise gmsh_reader.MeshError(refused)
    np.savez(result, **arrays)


if __name__ == "__main__":
    try:
        main(Path(sys.argv[1]), *sys.argv[2:])
    except gmsh_reader.MeshError as error:
        print(error, file=sys.stderr)
        sys.exit(gmsh_reader.REFUSED)
