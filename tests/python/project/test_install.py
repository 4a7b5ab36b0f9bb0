"""The core as an installed C++ library, used by a program outside of the toolkit."""

import os
import subprocess
from pathlib import Path

import pytest

import mpm_core

ROOT = Path(__file__).parents[3]
BUILD = Path(mpm_core.__file__).parents[2]


def run(*command):
    allowed = {**os.environ, "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, env=allowed)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.skipif(not (BUILD / "CMakeCache.txt").exists(), reason="the package was not built here by CMake")
def test_a_program_builds_with_the_installed_core_and_falls_as_it_must(tmp_path):
    run("cmake", "--install", BUILD, "--component", "development", "--prefix", tmp_path / "talus")
    folders = "-S", ROOT / "tests/install", "-B", tmp_path / "build"
    run("cmake", "-G", "Ninja", *folders, f"-Dtalus_DIR={tmp_path}/talus/lib/cmake/talus")
    run("cmake", "--build", tmp_path / "build")
    mass, momentum = map(float, run(tmp_path / "build/fall").split())
    assert mass == pytest.approx(2000.0, rel=1e-12)
    assert momentum == pytest.approx(-2000.0 * 9.81 * 0.1, rel=1e-10)
