"""The study scaling: what is counted follows from geometry where the cut is known."""

import csv
import json
import os
import subprocess
import sys
from pathlib import Path

STUDIES = Path(__file__).parents[3] / "studies"


def test_scaling_runs_small_and_counts_what_geometry_says(tmp_path):
    command = [sys.executable, str(STUDIES / "scaling.py"), "--output", str(tmp_path)]
    result = subprocess.run([*command, "--side-2d", "24", "--side-3d", "4", "--steps", "2"],
                            capture_output=True, text=True, timeout=120)  # fmt: skip
    assert result.returncode == 0, result.stderr
    with open(tmp_path / "counted.csv", newline="") as file:
        rows = {(int(row["dimension"]), int(row["ranks"])): row for row in csv.DictReader(file)}
    assert rows[2, 1]["messages"] == rows[3, 1]["bytes"] == "0"
    two = rows[2, 2]
    # Two parts have one neighbour each, three messages; no cut of a square into halves is shorter than its side.
    assert (two["neighbours"], two["messages"]) == ("1", "3") and 24 <= int(two["shared_nodes"]) <= 2 * 24 + 1
    assert int(two["bytes"]) == 8 * 9 * int(two["shared_nodes"])
    # Four times the ranks, half the sides of a part, within the raggedness of cuts through whole cells.
    assert 1.2 < int(rows[2, 16]["shared_nodes"]) / int(rows[2, 64]["shared_nodes"]) < 3
    with open(tmp_path / "timed.csv", newline="") as file:
        assert [row["kind"] for row in csv.DictReader(file)] == ["strong", "weak"] * 2


def test_balance_lowers_the_most_particles_on_a_rank(tmp_path):
    root = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    command = [
        sys.executable,
        str(STUDIES / "balance.py"),
        "--output",
        str(tmp_path),
        "--cell-size",
        "0.2",
        "--crest",
        "1.2",
    ]
    small = ["--particles-per-cell", "3", "--time", "0.2", "--frames", "5"]
    result = subprocess.run(["mpirun", "-n", "2", "--oversubscribe", "--mca", "mpi_yield_when_idle", "1", *command, *small],
                            capture_output=True, text=True, timeout=120, env={**os.environ, **root})  # fmt: skip
    assert result.returncode == 0, result.stderr
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["repartitions"] >= 1 and summary["largest_difference_m"] < 1e-8
    assert summary["mean_imbalance_repartitioned"] < 1.2 < summary["mean_imbalance_first_partition"] < 2
    alone = subprocess.run([*command, *small], capture_output=True, text=True, timeout=60)
    assert alone.returncode == 2 and "--ranks" in alone.stderr
