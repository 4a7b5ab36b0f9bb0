"""What FFCx and its C compiler write while forms are compiled: one line for the user, the rest to a logger."""

from __future__ import annotations

import logging
import os
import sys
from pathlib import Path

LOGGER = logging.getLogger("fenics_bridge.forms")
"""Gets the compiler's lines, at level DEBUG; add a handler to keep them"""
FFCX = "ffcx"
"""Name of FFCx's own logger"""
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
