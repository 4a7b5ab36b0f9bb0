"""What FFCx and its C compiler write while forms are compiled: one line for the user, the rest to a logger.

And what a run that was killed meanwhile leaves in the cache: the file of a form without its library.
"""

from __future__ import annotations

import logging
import os
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

from ffcx.codegeneration import jit

from mpm_core import RunError

LOGGER = logging.getLogger("fenics_bridge.forms")
"""Gets the compiler's lines, at level DEBUG; add a handler to keep them"""
FFCX = "ffcx"
"""Name of FFCx's own logger"""
ABANDONED = 300.0
"""Age [s] of the newest file of a form from which no process compiles it any more"""
LOGGER.setLevel(logging.DEBUG)
LOGGER.propagate = False
LOGGER.addHandler(logging.NullHandler())


class _CompilerLines(logging.Filter):
    """Replaces the lines that FFCx and distutils, by which older versions of it call the compiler, log for a form by one."""

    said = False

    def filter(self, record: logging.LogRecord) -> bool:
        is_of_compiler = "distutils" in record.pathname
        if not (is_of_compiler or record.name == FFCX) or record.levelno > logging.INFO:
            return True
        if not self.said and (is_of_compiler or "C compiler" in record.getMessage()):
            self.said = True
            cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "fenics"
            print(f"compiling forms of finite elements; later runs find them in {cache}", file=sys.stderr, flush=True)
        LOGGER.debug(record.getMessage())
        return False


def redirect_compiler_lines() -> None:
    """Send the compiler's lines to `LOGGER` from now on, and show warnings by Python. Calls after the first change nothing."""
    root, ffcx = logging.getLogger(), logging.getLogger(FFCX)
    if not any(isinstance(each, _CompilerLines) for each in root.filters):
        lines = _CompilerLines()
        root.addFilter(lines)
        ffcx.addFilter(lines)
        ffcx.setLevel(logging.INFO)  # that of the line by which newer versions say that they call the compiler
        logging.captureWarnings(
            False
        )  # FFCx, when it is imported, turns the warnings of all modules into lines of its log


_cached_module = jit.get_cached_module
_loaded: dict[tuple[str, ...], Any] = {}


def _module_or_error(module_name: str, object_names: Any, cache_dir: Any, timeout: int) -> Any:
    """FFCx's function of this name, for a form that another process compiles, or was killed compiling.

    A form that this process has loaded is taken from memory: FFCx would list the whole cache to find it again.
    """
    key = (str(cache_dir), module_name, *object_names)
    if key in _loaded:
        return _loaded[key]
    source = Path(cache_dir) / f"{module_name}.c"
    if not source.with_suffix(".c.cached").exists():
        with suppress(FileNotFoundError):  # another run may remove it, too
            ages = [time.time() - path.stat().st_mtime for path in Path(cache_dir).glob(f"{module_name}.*")]
            if ages and min(ages) > ABANDONED:
                source.unlink()
    try:
        found = _cached_module(module_name, object_names, cache_dir, timeout)
        if found[0] is not None:
            _loaded[key] = found
        return found
    except TimeoutError:
        raise RunError(
            f"a form of the finite elements is not compiled after {timeout} s: another run compiles it, or was ended while it did; if "
            f"none is compiling, remove {source}"
        ) from None


def repair_cache() -> None:
    """Compile forms anew whose compilation was broken off, and say which file is in the way where another run may compile them."""
    jit.get_cached_module = _module_or_error
