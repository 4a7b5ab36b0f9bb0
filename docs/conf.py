"""Sphinx: how the documentation is built. `tests/run docs` calls it with the built package on the path."""

import shutil
from pathlib import Path

import mpm_core
from mpm_core.particles import field_table

project = "Talus"
author = copyright = "The Talus developers"
release = version = mpm_core.__version__
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
myst_enable_extensions = ["dollarmath", "amsmath", "colon_fence"]
myst_heading_anchors = 3
exclude_patterns = ["_build"]
html_theme = "sphinx_rtd_theme"
html_title = "Talus"
html_static_path = ["_static"]
html_css_files = ["talus.css"]
# Formulas without a network: Debian's MathJax 2 is copied to the pages; elsewhere they load MathJax from the network.
MATHJAX = Path("/usr/share/javascript/mathjax")
if MATHJAX.is_dir():
    mathjax_path = "mathjax/MathJax.js?config=TeX-AMS_CHTML"
    delimiters = {"inlineMath": [["\\(", "\\)"]], "displayMath": [["\\[", "\\]"]]}
    mathjax2_config = {
        "tex2jax": {**delimiters, "processClass": "math", "ignoreClass": "mathjax_ignore"},
        "messageStyle": "none",
    }
# Single backticks stand for code in the docstrings.
default_role = "code"
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_typehints_format = "short"
# Signatures show these names, not what they stand for.
autodoc_type_aliases = {name: name for name in ("ArrayLike", "Law", "Laws", "MeshTags", "OfPosition", "Surface")}
napoleon_google_docstring = True
napoleon_numpy_docstring = False


# Both packages have an error of this name.
suppress_warnings = ["ref.python"]


def readable(app, what, name, obj, options, lines):
    """Docstrings are plain text: a bar is the length of a vector."""
    lines[:] = [line.replace("|", "\\|").replace("*", "\\*") for line in lines]


def with_field_tables(app, name, source):
    """Tables of fields are made from the schedules that the code follows."""
    for words, core in (("plane", mpm_core._core.Model2), ("space", mpm_core._core.Model3)):
        for what in ("particle", "nodal"):
            schedule = core.default_particle_schedule() if what == "particle" else core.nodal_schedule()
            source[0] = source[0].replace(f"TABLE_OF_{what}_fields_{words}".upper(), field_table(schedule))


def copy_mathjax(app, error):
    if MATHJAX.is_dir() and app.builder.name == "html" and not error:
        parts = shutil.ignore_patterns(
            "unpacked", "docs", "test", "localization", "MathML", "AsciiMath", "SVG", "HTML-CSS"
        )
        shutil.copytree(MATHJAX, Path(app.outdir) / "_static/mathjax", ignore=parts, dirs_exist_ok=True)


def setup(app):
    app.connect("source-read", with_field_tables)
    app.connect("build-finished", copy_mathjax)
    # Before napoleon, which makes markup of its own.
    app.connect("autodoc-process-docstring", readable, priority=400)
