"""Studies in which a rigid body moves against soil: a restart, two ranks, the body in pictures, page and files."""

import csv
import json
import os
import re
import subprocess
import sys

import h5py
import numpy as np
import pytest
from study_main import STUDIES, ended

# Python's own copy, without what MPI adds to it in this process.
ENVIRONMENT = {**os.environ, "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
SMALL = {
    "barrier": "--cell-size 0.25 --particles-per-cell 3 --length 5 --duration 2 --frames 4 --no-film",
    "cone": "--cell-size 0.006 --particles-per-cell 3 --penetration 0.01 --speed 0.02 --width 5 --frames 8 --no-film",
    "footing_push": "--cell-size 0.1 --particles-per-cell 3 --penetration 0.02 --speed 5e-3 --frames 4 --no-film",
    "piezocone": "--cell-size 0.0059 --penetration 0.003 --step 0.1 --width 8 --conductivity 1e-6 --frames 4 --no-film",
    "wall": "--cell-size 0.2 --particles-per-cell 3 --motion free --support 0.2 --frames 4 --no-film",
}

EVERY = {"piezocone": "3"}
"""Steps between checkpoints; 40 of explicit runs"""
MEANS = {
    "force_factor", "load_factor", "cone_factor", "resistance_Pa", "coefficient", "wall_friction", "net_resistance_Pa",
    "pore_pressure_ratio",
}  # fmt: skip
"""Columns that are means since the row before, which a restart sets at another time"""


def run(study, folder, *options, ranks=1):
    options = [*SMALL[study].split(), *options]
    if ranks == 1:
        done = ended(study, folder, *options)
    else:
        command = ["mpirun", "-n", str(ranks), "--oversubscribe", "--mca", "mpi_yield_when_idle", "1"]
        command += [sys.executable, str(STUDIES / f"{study}.py"), "--output", str(folder), *options]
        done = subprocess.run(command, capture_output=True, text=True, timeout=300, env=ENVIRONMENT)
    assert done.returncode == 0, done.stderr
    return folder


def row(folder, name="history.csv", number=-1):
    with open(folder / name, newline="") as file:
        return {key: float(value) for key, value in list(csv.DictReader(file))[number].items()}


@pytest.fixture(scope="module", params=sorted(SMALL))
def study(request, tmp_path_factory):
    """Its name, and the folder of a small run."""
    return request.param, run(
        request.param, tmp_path_factory.mktemp(request.param), "--checkpoint-every", EVERY.get(request.param, "40")
    )


@pytest.mark.usefixtures("without_pictures")
def test_a_restart_ends_as_the_run_that_never_stopped(study, tmp_path):
    name, whole = study
    again = run(name, tmp_path, "--restart", str(whole / "checkpoint.h5"))
    for file in ("history.csv", "body_0.csv"):
        one, other = row(whole, file), row(again, file)
        assert {k: v for k, v in one.items() if k not in MEANS} == {k: v for k, v in other.items() if k not in MEANS}


def test_two_ranks_give_the_same(study, tmp_path):
    name, alone = study
    two = run(name, tmp_path, "--no-pictures", ranks=2)
    one, other = row(alone, "body_0.csv"), row(two, "body_0.csv")
    largest = {
        unit: max(abs(v) for k, v in one.items() if k.endswith(unit)) for unit in {k.split("_")[-1] for k in one}
    }
    for key, value in one.items():
        assert other[key] == pytest.approx(value, rel=1e-6, abs=1e-6 * largest[key.split("_")[-1]]), key


def test_the_body_moves_in_files_and_on_the_page(study):
    _, folder = study
    frames = sorted((folder / "bodies").iterdir())
    with h5py.File(frames[0]) as first, h5py.File(frames[-1]) as last:
        # Bodies that rest are stored once.
        moved = (last if "points" in last else first)["points"][()] - first["points"][()]
        nodes = [np.unique(first["cells"][()][first["body"][()] == k]) for k in range(first["body"][()].max() + 1)]
    ways = []
    for k, own in enumerate(nodes):
        start, end = (row(folder, f"body_{k}.csv", number) for number in (0, -1))
        ways.append([end[f"displacement_{axis}_m"] - start[f"displacement_{axis}_m"] for axis in "xy"])
        assert moved[own, :2] == pytest.approx(np.tile(ways[k], (len(own), 1)), abs=1e-6)
    way, count = ways[0], len(nodes[0])
    data = json.loads(re.search(r'id="data">(.*?)</script>', (folder / "report.html").read_text(), re.DOTALL).group(1))
    (movie,) = data["movies"]
    shown = np.array(movie["bodies"])
    assert len(shown) == len(movie["times"]) == len(frames)
    ends = shown.reshape(len(shown), -1, 2)[[0, -1]]
    assert (ends[1] - ends[0])[: 2 * count] == pytest.approx(np.tile(way, (2 * count, 1)), abs=2e-5)
