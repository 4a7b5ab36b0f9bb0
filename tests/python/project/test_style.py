"""Layout and lint of the sources, as the hooks of a commit check them; each tool only in the version that the hooks use."""

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[3]
HOOKS = (ROOT / ".pre-commit-config.yaml").read_text()
SOURCES = [
    path for suffix in ("h", "cpp") for folder in ("mpm_core", "tests") for path in (ROOT / folder).rglob(f"*.{suffix}")
]
PYTHON = ["mpm_core", "fenics_bridge", "particle_player", "talus", "studies", "tests", "docs"]


def call(*command):
    done = subprocess.run([str(word) for word in command], cwd=ROOT, capture_output=True, text=True, timeout=120)
    return done.returncode, done.stdout + done.stderr


def tool(name, hook):
    """The command of a tool, if it is there in the major version of the hook; another one lays out in another way."""
    wanted = re.search(rf"{hook}\n\s+rev: v?(\d+)\.", HOOKS).group(1)
    if shutil.which(name) is None:
        pytest.skip(f"needs {name} {wanted}")
    found = re.search(r"(\d+)\.\d+", call(name, "--version")[1]).group(1)
    if found != wanted:
        pytest.skip(f"needs {name} {wanted}, found {found}")
    return name


def test_cpp_is_laid_out_by_clang_format():
    assert len(SOURCES) > 100
    code, text = call(tool("clang-format", "mirrors-clang-format"), "--dry-run", "--Werror", *SOURCES)
    assert code == 0, text


def test_python_is_laid_out_by_black():
    # With --diff, black does not look into its cache.
    black = tool("black", "psf/black")
    code, _ = call(black, "--check", "--quiet", *PYTHON)
    assert code == 0, call(black, "--diff", "--quiet", *PYTHON)[1]


def test_ruff_has_nothing_to_say():
    if shutil.which("ruff") is None:
        pytest.skip("needs ruff")
    code, text = call("ruff", "check", "--no-cache", "--output-format=concise", *PYTHON)
    assert code == 0, text


def test_types_are_right():
    # What mypy accepts depends on the types that NumPy declares, and these change with NumPy's version.
    if shutil.which("mypy") is None or int(np.__version__.split(".")[0]) > 1:
        pytest.skip("needs mypy and NumPy 1, Debian 12's")
    code, text = call("mypy", "--cache-dir", ROOT / "build" / "mypy_cache")
    assert code == 0, text
