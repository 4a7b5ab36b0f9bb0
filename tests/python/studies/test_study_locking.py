"""The study locking: mixed discretisation frees what plain linear triangles lock, by either scheme, on any number of ranks."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest
from study_main import STUDIES, ended

PRANDTL = 2 + np.pi
ENVIRONMENT = {"OMP_NUM_THREADS": "1", "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
NO_PICTURES = """
import sys
sys.path.insert(0, {studies!r})
import locking
from common import summary
summary.draw_pictures = lambda pictures: None
locking.run_study(locking.main)
"""


def run(folder, *options, launch=None):
    if launch is None:
        result = ended("locking", folder, *options)
    else:
        script = NO_PICTURES.format(studies=str(STUDIES))
        command = [*launch, sys.executable, "-c", script, "--output", str(folder), *options]
        result = subprocess.run(command, capture_output=True, text=True, timeout=300, env={**os.environ, **ENVIRONMENT})
    assert result.returncode == 0, result.stderr
    return json.loads((folder / "summary.json").read_text())


def select(rows, **wanted):
    """Errors from coarse to fine."""
    return [row["error"] for row in rows if all(row[key] == value for key, value in wanted.items())]


@pytest.fixture(scope="module")
def implicit(tmp_path_factory):
    folder = tmp_path_factory.mktemp("locking")
    return folder, run(folder, "--schemes", "implicit", "--meshes", "3", "--reference-mesh", "3")


def test_cooks_membrane(implicit):
    """The benchmark's number at the middle of the loaded edge is 16.44."""
    rows = [row for row in implicit[1]["cook"] if row["poisson"] > 0.4999999]
    assert rows[0]["reference"] == pytest.approx(16.44, rel=5e-3)
    plain, nmd = select(rows, elements="plain"), select(rows, elements="NMD")
    assert plain[-1] > 2 / 3
    assert nmd[2] < 0.5 * nmd[1] and nmd[2] < 0.06


def test_footing(implicit):
    """Locked ground hardens without end; with mixed discretisation it yields near Prandtl's pressure, from above."""
    rows = [row for row in implicit[1]["footing"] if row["poisson"] == 0.49]
    assert rows[0]["reference"] == pytest.approx(PRANDTL)
    assert min(select(rows, elements="plain")) > 0.5
    nmd = select(rows, elements="NMD")
    assert nmd[2] < 0.6 * nmd[1] and nmd[2] < 0.08
    assert all(row["value"] > PRANDTL for row in rows)


def test_slope(implicit):
    rows = implicit[1]["slope"]
    assert min(select(rows, elements="plain")) > 0.5
    nmd = select(rows, elements="NMD")
    assert nmd[2] < 0.6 * nmd[1] and nmd[2] < 0.1


def test_pictures(implicit):
    for case in ("cook", "footing", "slope"):
        for name in (f"error_{case}.png", f"pressure_{case}_implicit.png"):
            assert (implicit[0] / name).stat().st_size > 10_000


@pytest.mark.usefixtures("without_pictures")
def test_explicit_scheme_comes_to_the_same_rest(implicit, tmp_path):
    """At the same Poisson ratio and on the same mesh; an explicit run is at rest up to a thousandth of its forces.

    With NMD it also averages mean stresses, which moving implicit particles do not: it converges to the same, a little sooner.
    """
    explicit = run(tmp_path, "--schemes", "explicit", "--meshes", "2", "--reference-mesh", "1")
    for case in ("cook", "footing"):
        for row in (row for row in explicit[case] if row["elements"] != "Taylor-Hood"):
            same = [other["value"] for other in implicit[1][case] if other["elements"] == row["elements"]
                    and (other["divisions"], other["poisson"]) == (row["divisions"], row["poisson"])]  # fmt: skip
            if same and row["elements"] == "plain":
                assert row["value"] == pytest.approx(same[0], rel=5e-3)
            elif same:
                error = abs(same[0] - row["reference"])
                assert 0.8 * error < abs(row["value"] - row["reference"]) < 1.005 * error
    assert min(select(explicit["slope"], elements="plain")) > 0.5 > max(select(explicit["slope"], elements="NMD"))


def test_three_ranks_find_the_same(implicit, tmp_path):
    """On the coarsest mesh."""
    launch = ("mpirun", "--oversubscribe", "--mca", "mpi_yield_when_idle", "1", "-n", "3")
    three = run(tmp_path, "--schemes", "implicit", "--meshes", "1", "--reference-mesh", "1", launch=launch)
    for case in ("cook", "footing", "slope"):
        key = lambda row: (row["elements"], row["divisions"], row["poisson"])
        one = {key(row): row["value"] for row in implicit[1][case]}
        assert {row["elements"] for row in three[case]} == {"Taylor-Hood", "plain", "NMD"}
        for row in three[case]:
            assert row["value"] == pytest.approx(one[key(row)], rel=1e-5)
