"""Sphinx: how the documentation is built. `tests/run docs` calls it with the built package on the path."""

from pathlib import Path

import mpm_core

ROOT = Path(__file__).parents[1]

project = "Talus"
author = copyright = "The Talus developers"
release = version = mpm_core.__version__
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
myst_enable_extensions = ["dollarmath", "amsmath", "colon_fence"]
myst_heading_anchors = 3
exclude_patterns = ["_build"]
html_theme = "furo"
html_title = "Talus"
# Single backticks stand for code in the docstrings.
default_role = "code"
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
napoleon_google_docstring = True
napoleon_numpy_docstring = False


# Both packages have an error of this name.
suppress_warnings = ["ref.python"]


def readable(app, what, name, obj, options, lines):
    """Docstrings are plain text: a bar is the length of a vector, and those of fenics_bridge keep their lines."""
    lines[:] = [line.replace("|", "\\|").replace("*", "\\*") for line in lines]
    if name.startswith("fenics_bridge."):
        lines[:] = [f"| {line}" if line.strip() else "" for line in lines]


def setup(app):
    # Before napoleon, which makes markup of its own.
    app.connect("autodoc-process-docstring", readable, priority=400)
