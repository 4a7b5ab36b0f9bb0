"""The study slope: the paper's number, its files, its errors and its end by Ctrl-C."""

import csv
import importlib
import json
import os
import re
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from mpi4py import MPI
from study_main import STUDIES, ended

FILES = ["figure_2_mesh.png", "figure_3_displacement.png", "figure_4_shear_strain.png", "figure_5_vertical_stress.png",
         "figure_6_crest.png", "particles/000000.h5", "particles.xdmf", "mesh/mesh.h5", "mesh.xdmf", "history.csv",
         "summary.json"]  # fmt: skip


def command(folder, *options):
    return [sys.executable, str(STUDIES / "slope.py"), "--output", str(folder), *options]


def slope(folder, *options):
    return ended("slope", folder, *options)


def history(folder):
    with open(folder / "history.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    return {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}


def test_the_papers_slope_slides_as_far_as_in_an_independent_code(tmp_path):
    # Independent explicit code of the standard method, same data, any time step from 1e-4 to 4e-3 s: 0.11 m at 0.9 s, 0.28 m
    # at 8.7 s, 0.36 m at 17 s, 0.41 to 0.42 m at 34.8 s, rising fast at first and creeping later.
    soil = "--material mohr-coulomb --damping 0.75 --time 34.8 --initial zero"
    options = f"{soil} --integration particles --no-nmd --dt 4e-3 --frames 50"
    result = slope(tmp_path, *options.split())
    assert result.returncode == 0, result.stderr
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["soil_cells"] == 640 and summary["particles"] == 6400 and summary["steps"] == 8700
    assert 0.41 * 0.92 < summary["crest_displacement_m"] < 0.43 * 1.08
    curve = history(tmp_path)
    at = np.interp([0.9, 8.7, 17.0], curve["time_s"], curve["crest_displacement_m"])
    assert at == pytest.approx([0.11, 0.28, 0.36], rel=0.15)
    assert np.all(np.diff(curve["time_s"]) > 0)
    energy = summary["energy_J_per_m"]
    spent = sum(energy[name] for name in ("kinetic_energy", "damping_work", "unexplained_energy"))
    assert abs(summary["unexplained_fraction_of_energy"]) == pytest.approx(
        abs(energy["unexplained_energy"]) / energy["external_work"], rel=1e-9
    )
    assert energy["external_work"] - spent > energy["plastic_work"] > 0


def test_a_short_run_writes_all_it_promises(tmp_path):
    result = slope(tmp_path, "--time", "0.5", "--frames", "3")
    assert result.returncode == 0, result.stderr
    assert all((tmp_path / name).stat().st_size > 0 for name in FILES)
    assert list(tmp_path.glob("slide.*"))
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["finished_run"] and summary["time_s"] == 0.5
    # FEM and particles share the cells, so the particles start in equilibrium.
    assert summary["initial_out_of_balance_ratio"] < 1e-9
    assert {"talus", "dolfinx", "petsc", "compiler", "git_revision"} <= set(summary["versions"])
    assert summary["parameters"]["unit_weight"] == 80e3 and summary["particle_steps_per_second"] > 0
    assert len(history(tmp_path)["time_s"]) == 4


def test_forces_in_proportion_to_momentum_take_the_place_of_local_damping(tmp_path):
    options = ("--mass-damping", "4", "--time", "0.5", "--frames", "3", "--no-pictures")
    assert slope(tmp_path, *options).returncode == 0
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["parameters"]["damping"] == 0 and summary["parameters"]["mass_damping"] == 4
    # Soil that yields is braked, too, and the work is booked: with local damping alone there would be none.
    energy = summary["energy_J_per_m"]
    assert energy["damping_work"] > energy["kinetic_energy"] > 0
    assert abs(summary["unexplained_fraction_of_energy"]) < 0.01
    for wrong in (("--transfer", "affine"), ("--scheme", "quasi-static"), ("--paper",)):
        refused = slope(tmp_path / "refused", *options, *wrong)
        assert refused.returncode == 2 and "--mass-damping is" in refused.stderr


def test_slopes_of_one_shape_slide_alike_whatever_their_height(tmp_path):
    # Four times the lengths and the stresses: displacements are four times as large after twice the time.
    def crest(name, height, time):
        size = ("--height", f"{height:g}", "--young", f"{200e3 * height:g}", "--cohesion", f"{1e3 * height:g}")
        result = slope(tmp_path / name, *size, "--time", f"{time:g}", "--frames", "2", "--no-pictures")
        assert result.returncode == 0, result.stderr
        return json.loads((tmp_path / name / "summary.json").read_text())["crest_displacement_m"]

    assert crest("large", 4, 2) == pytest.approx(4 * crest("small", 1, 1), rel=1e-6)
    a = importlib.import_module("slope").parse(["--height", "10", "--crest", "15"])
    assert (a.crest, a.cell_size, a.runout_length) == (15, 1, 20)


def test_a_start_that_may_take_long_says_so(monkeypatch, capfd):
    case_module = importlib.import_module("common.slope.case")
    case = case_module.build_slope(case_module.slope_options(["--particles-per-cell", "1"]), MPI.COMM_SELF)
    case_module.solved_fem(case, 10e3)
    assert "finite elements" not in capfd.readouterr().err
    monkeypatch.setattr(case_module, "MANY_CELLS", 600)
    case_module.solved_fem(case, 10e3)
    assert "finite elements on 640 triangles under 10000 N/m3" in capfd.readouterr().err


@pytest.mark.parametrize(
    ("options", "material", "damping", "mass_damping", "pic", "time"),
    [
        ((), "viscoplastic", 0, 5, 0.02, 16),
        (("--scheme", "implicit"), "viscoplastic", 0, 5, 0.02, 16),
        (("--height", "4"), "viscoplastic", 0, 2.5, 0.02, 32),
        (("--transfer", "affine"), "viscoplastic", 0, 0, 0, 16),
        (("--damping", "0.5", "--material", "softening"), "softening", 0.5, 0, 0, 16),
        (("--damping", "0", "--time", "2"), "viscoplastic", 0, 0, 0, 2),
        (("--mass-damping", "0", "--pic", "0.1"), "viscoplastic", 0, 0, 0.1, 16),
        (("--paper",), "mohr-coulomb", 0.75, 0, 0, 34.8),
        (("--scheme", "quasi-static"), "mohr-coulomb", 0.75, 0, 0, 34.8),
    ],
)
def test_what_brakes_a_slide_unless_told_otherwise(options, material, damping, mass_damping, pic, time):
    a = importlib.import_module("slope").parse(list(options))
    assert (a.material, a.damping, a.mass_damping, a.pic, a.time) == (material, damping, mass_damping, pic, time)


def test_the_slope_comes_to_rest_where_smaller_cells_have_it(tmp_path):
    # On cells of 0.1, 0.05, 0.025 and 0.0125 m: docs/run_out.md
    crest = {}
    for cell in ("0.1", "0.05"):
        folder = tmp_path / cell
        assert slope(folder, "--cell-size", cell, "--frames", "8", "--no-pictures").returncode == 0
        summary = json.loads((folder / "summary.json").read_text())
        assert summary["energy_J_per_m"]["kinetic_energy"] < 1e-5 * summary["energy_J_per_m"]["external_work"]
        assert abs(summary["unexplained_fraction_of_energy"]) < 0.01
        crest[cell] = summary["crest_displacement_m"]
    assert crest["0.1"] == pytest.approx(crest["0.05"], rel=0.1)


def test_a_slope_that_fails_warns_of_nothing_at_its_defaults(tmp_path):
    # In half a second without damping it fails. The message is there where strains are not averaged.
    for name, options in (("default", []), ("plain", ["--no-nmd"])):
        result = slope(tmp_path / name, "--damping", "0", "--time", "0.5", "--frames", "3", "--no-pictures", *options)
        assert result.returncode == 0, result.stderr
        assert ("warning: " in result.stderr) == (name == "plain")


@pytest.mark.parametrize(
    ("options", "averages"),
    [
        ([], "true"),
        (["--dilation-angle", "10"], "true"),
        (["--dilation-angle", "25"], "false"),
        (["--scheme", "implicit"], "true"),
        (["--scheme", "implicit", "--dilation-angle", "10"], "false"),
        (["--paper"], "false"),
    ],
)
def test_strains_are_averaged_where_soil_locks_as_it_fails(tmp_path, options, averages):
    result = slope(
        tmp_path,
        "--cell-size",
        "0.25",
        "--mesh",
        "fitted",
        "--time",
        "1e-3",
        "--frames",
        "1",
        "--no-pictures",
        *options,
    )
    assert result.returncode == 0, result.stderr
    assert f"\nnmd = {averages}  #" in (tmp_path / "parameters.toml").read_text()


def test_frames_by_steps_are_for_the_files_alone(tmp_path):
    small = ("--initial", "zero", "--cell-size", "0.2", "--crest", "1.2", "--particles-per-cell", "3")
    result = slope(tmp_path, *small, "--time", "0.3", "--frames", "4", "--frame-steps", "7")
    assert result.returncode == 0, result.stderr
    stored = len(history(tmp_path)["time_s"])
    steps = json.loads((tmp_path / "summary.json").read_text())["steps"]
    assert stored > steps // 7 >= 5
    assert [len(list((tmp_path / name).glob("0*.h5"))) for name in ("particles", "mesh")] == [stored, stored]
    drawn = re.search(r'"times":(\[[^]]*\])', (tmp_path / "report.html").read_text())
    assert json.loads(drawn.group(1)) == pytest.approx(np.linspace(0, 0.3, 5))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--height", "-1"], ["--height", "-1", "above 0"]),
        (["--poisson", "0.5"], ["--poisson", "0.5"]),
        (["--friction-angle", "90"], ["--friction-angle", "90"]),
        (["--dilation-angle", "30"], ["--dilation-angle", "30", "--friction-angle"]),
        (["--particles-per-cell", "0"], ["--particles-per-cell", "0"]),
        (["--particles-per-cell", "7"], ["--particles-per-cell", "7", "6", "10"]),
        (["--cell-size", "0.3"], ["0.3", "height"]),
        (["--dt", "1"], ["dt", "1 s", "critical"]),
        (["--output", "/proc/nowhere"], ["/proc/nowhere"]),
        (["--frames", "100000000"], ["--frames", "100000000", "bytes of memory, but there are"]),
    ],
)
def test_wrong_options_are_named(tmp_path, options, words):
    result = slope(tmp_path, "--time", "0.1", *options)
    assert result.returncode == 2
    assert all(word in result.stderr for word in words), result.stderr


def test_a_background_mesh_that_is_too_short_ends_the_run_with_the_place_and_keeps_what_there_is(tmp_path):
    result = slope(tmp_path, "--runout-length", "0.1", "--damping", "0", "--time", "3", "--frames", "30")
    assert result.returncode == 1
    assert "left the background mesh" in result.stderr
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert not summary["finished_run"] and "left the background mesh" in summary["stopped_because"]
    assert len(history(tmp_path)["time_s"]) > 1 and (tmp_path / "figure_4_shear_strain.png").exists()


@pytest.mark.usefixtures("without_pictures")
def test_soil_that_rises_above_the_mesh_needs_headroom(tmp_path):
    """Ground under 18 kN/m3 that weighs 4 kN/m3 from now on rises by (18 - 4) H^2 / (2 M) = 0.024 m (M = 297 kPa, H = 1 m), and twice that
    before it comes to rest: a quarter to a half of the cell of 0.1 m that the mesh has above the crest by default."""
    rising = ["--initial-unit-weight", "18e3", "--unit-weight", "4e3", "--time", "0.2", "--frames", "2"]
    result = slope(tmp_path / "without", *rising, "--headroom", "0")
    assert result.returncode == 1
    assert (
        "left the background mesh" in result.stderr and "leaves it at its top more --headroom than 0 m" in result.stderr
    )
    assert slope(tmp_path / "with", *rising).returncode == 0
    case_module = importlib.import_module("common.slope.case")
    for more, height in ([], 1.1), (["--headroom", "0.45"], 1.5):  # by whole cells
        case = case_module.build_slope(case_module.slope_options([*more]), MPI.COMM_SELF)
        assert case.domain.geometry.x[:, 1].max() == pytest.approx(height)


def test_ctrl_c_ends_cleanly(tmp_path):
    process = subprocess.Popen(command(tmp_path, "--time", "1000", "--frames", "4000"), stderr=subprocess.PIPE, text=True,
                               env={**os.environ})  # fmt: skip
    rows = tmp_path / "history.csv"
    deadline = time.monotonic() + 120
    while time.monotonic() < deadline and not (rows.exists() and rows.read_text().count("\n") > 3):
        time.sleep(0.1)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=120)
    assert process.returncode == 130
    assert "interrupted" in errors and "written" in errors
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert not summary["finished_run"] and summary["time_s"] < 1000
    assert all((tmp_path / name).exists() for name in FILES)


def test_an_ensemble_tells_how_far_results_scatter(tmp_path):
    result = slope(tmp_path, "--ensemble", "3", "--initial", "zero", "--particles-per-cell", "3", "--time", "1", "--frames", "4",
                   "--no-film")  # fmt: skip
    assert result.returncode == 0, result.stderr
    summary = json.loads((tmp_path / "summary.json").read_text())
    ensemble = summary["ensemble"]
    assert ensemble["members"] == 3 and "3 members" in result.stdout
    assert (tmp_path / "figure_8_ensemble.png").stat().st_size > 0
    for name in ("crest_displacement_m", "runout_m"):
        mean, scatter = (ensemble[name][key] for key in ("mean", "standard_deviation"))
        # Members begin with round-off between them, so they are neither equal nor far apart.
        assert 0 < scatter < 0.05 * mean
        assert abs(mean - summary[name]) < 3 * scatter


def test_an_ensemble_does_not_go_with_a_restart(tmp_path):
    result = slope(tmp_path, "--ensemble", "2", "--site", "meshes/embankment.toml")
    assert result.returncode == 2 and "--ensemble is 2, expected 1" in result.stderr
