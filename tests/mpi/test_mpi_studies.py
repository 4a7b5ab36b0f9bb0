"""Studies on several ranks: `mpirun -n N python3 -m pytest tests/mpi`."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "studies"), str(ROOT / "studies" / "verification"), str(ROOT / "tests" / "python")]
import axisymmetric_cylinder  # noqa: E402
import compare_fem  # noqa: E402
import drawdown  # noqa: E402
import handover  # noqa: E402
import quarter_model  # noqa: E402
import safety  # noqa: E402
import slope  # noqa: E402
import thick_cylinder  # noqa: E402
from bridge_cases import slope_particles  # noqa: E402
from common.slope.fem import slope_fem, weight  # noqa: E402

import fenics_bridge as bridge  # noqa: E402


@pytest.fixture
def without_pictures(monkeypatch):
    """Studies draw neither figures nor films, for which ranks wait: of tests that read numbers only."""
    monkeypatch.setattr("common.summary.draw_pictures", lambda pictures: None)


def summary_of(study, folder, *options):
    assert study.main(["--output", str(folder), *options]) == 0
    MPI.COMM_WORLD.barrier()
    return json.loads((folder / "summary.json").read_text())


def test_slope_from_start_to_page(shared_path):
    """The main study with its finite elements, hand-over, balance of load, pictures and page."""
    summary = summary_of(slope, shared_path, "--cell-size", "0.1", "--time", "0.5", "--frames", "3")
    assert summary["ranks"] == MPI.COMM_WORLD.size
    assert summary["initial_out_of_balance_ratio"] < 1e-8
    # Cells of 0.1, 0.05 and 0.025 m give 0.1205, 0.1195 and 0.1193 m.
    assert summary["crest_displacement_m"] == pytest.approx(0.1193, rel=0.02)
    assert (shared_path / "report.html").stat().st_size > 100_000


def test_factor_of_safety_is_that_of_one_rank(shared_path):
    options = ["--cell-size", "0.2", "--meshes", "1", "--no-without-dilation"]
    found = summary_of(safety, shared_path, *options)["factor_of_safety"]
    alone = bridge.factor_of_safety(slope_fem(safety.parse(options), MPI.COMM_SELF, 0.2), weight(20e3))
    assert found == pytest.approx(alone.value, rel=1e-2)  # rounding decides which of the last steps fails
    assert (shared_path / "mechanism.png").exists()


@pytest.mark.usefixtures("without_pictures")
@pytest.mark.parametrize("move", [False, True])
def test_hand_overs_of_the_study(shared_path, monkeypatch, move):
    monkeypatch.setattr(handover, "FRACTIONS", (0.9,))
    options = ["--cell-size", "0.2", "--crest", "1.2", "--time", "0.02", *(["--move"] if move else [])]
    (row,) = summary_of(handover, shared_path, *options)["handovers"]
    assert row["out_of_balance_ratio_after"] < 1e-3 and row["newly_yielded_fraction"] < 0.01
    assert move or row["out_of_balance_ratio_before"] < 1e-8
    assert 0.01 < row["crest_displacement_m"] < 0.2


@pytest.mark.usefixtures("without_pictures")
def test_particles_differ_from_quadratic_elements_as_linear_ones_do(shared_path, monkeypatch):
    """At rest, in the cells in which they began, particles are linear finite elements."""
    monkeypatch.setattr(compare_fem, "UNIT_WEIGHTS", (10e3,))
    options = ["--cell-size", "0.2", "--meshes", "1"]
    (row,) = summary_of(compare_fem, shared_path, *options)["comparisons"]
    a = compare_fem.parse(options)
    bodies, a.equilibrium = [], "fine"
    for a.elements in ("P1", "P2"):
        bodies.append(slope_fem(a, MPI.COMM_SELF, 0.2))
        bodies[-1].solve(weight(10e3))
    points = slope_particles(10e3, cell_size=0.2, kind="fitted", comm=MPI.COMM_SELF).particles.position
    linear, quadratic = (body.evaluate_at(points)["displacement"] for body in bodies)
    expected = np.linalg.norm(linear - quadratic) / np.linalg.norm(quadratic)
    assert row["displacement_difference_l2"] == pytest.approx(expected, rel=0.05)


def test_cylinder_of_the_verification(shared_path):
    """Its particles move from rank to rank, and some ranks have none that carries the pressure."""
    assert [check.quantity for check in thick_cylinder.run(True, shared_path).checks if not check.passed] == []


@pytest.mark.parametrize("case", [axisymmetric_cylinder, quarter_model])
def test_half_sections_of_the_verification(shared_path, case):
    """Rings on a rank that has none of the axis, or none of the wall; and a body of three dimensions beside them."""
    assert [check.quantity for check in case.run(True, shared_path).checks if not check.passed] == []


def test_a_drawdown_and_its_slide(shared_path):
    """Flow in time, factors of safety between their limits, the hand-over under pore pressures, pictures and page."""
    path = shared_path / "site.toml"
    if MPI.COMM_WORLD.rank == 0:
        text = (ROOT / "meshes" / "drawdown.toml").read_text().replace('"bank', f'"{ROOT}/meshes/bank')
        path.write_text(
            text.replace("= 4e3", "= 2e3").replace("= 27.0", "= 15.0")
        )  # linear elements on large cells are too stiff
    MPI.COMM_WORLD.barrier()
    options = "--cell-size 3 --elements P1 --days 3 --factor-times 1 --slide --time 0.3 --frames 2 --no-film"
    options += " --particles-per-cell 3"
    summary = summary_of(drawdown, shared_path / "results", "--site", str(path), *options.split())
    slow, fast = (limit["factor_of_safety"] for limit in summary["limits"])
    assert fast < summary["lowest_factor_of_safety"] < slow
    assert summary["initial_out_of_balance_ratio"] < 1e-8 and summary["largest_displacement_m"] > 0
