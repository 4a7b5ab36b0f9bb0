"""What the studies share: options, results folder, summary, history, interruption, progress, pictures and films."""

import argparse
import csv
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from matplotlib import colormaps
from matplotlib.image import imread

from particle_player import boundary_edges
from studies.common import animation, interrupt, plots
from studies.common.files import NOT_WRITTEN
from studies.common.history import History
from studies.common.interrupt import Interrupt
from studies.common.lengths import metres
from studies.common.options import add_choice, add_count, add_number, add_switch, check, study_parser
from studies.common.progress import Progress
from studies.common.summary import versions, write_summary


def example_parser():
    parser = study_parser("An example.")
    add_number(parser, "--height", 1.0, "m", "height of the slope", above=0.0)
    add_number(parser, "--friction-angle", 25.0, "degrees", "friction angle", at_least=0.0, below=90.0)
    add_count(parser, "--ppc", 10, "particles in each cell", choices=(1, 3, 10))
    add_count(parser, "--steps", 5, "number of steps")
    add_choice(parser, "--mesh", "crossed", ("crossed", "gmsh"), "background mesh")
    add_switch(parser, "--nmd", True, "nodal mixed discretisation")
    return parser


def test_options_have_their_defaults():
    options = example_parser().parse_args([])
    assert (options.height, options.friction_angle, options.ppc, options.steps) == (1.0, 25.0, 10, 5)
    assert (options.mesh, options.nmd, options.output) == ("crossed", True, None)


def test_help_says_units_and_defaults():
    text = " ".join(example_parser().format_help().split())
    assert "height of the slope [m] (default: 1)" in text
    assert "friction angle [degrees] (default: 25)" in text
    assert "--no-nmd" in text


BAD_OPTIONS = [
    (["--height", "0"], "--height is '0', expected a number above 0 m"),
    (["--height", "tall"], "--height is 'tall', expected a number above 0 m"),
    (["--height", "nan"], "--height is 'nan', expected a number above 0 m"),
    (
        ["--friction-angle", "90"],
        "--friction-angle is '90', expected a number at least 0 and below 90 degrees",
    ),
    (["--ppc", "2"], "--ppc is '2', expected one of 1, 3, 10"),
    (["--steps", "0"], "--steps is '0', expected a whole number from 1 on"),
    (["--steps", "1.5"], "--steps is '1.5', expected a whole number from 1 on"),
    (["--mesh", "square"], "--mesh is 'square', expected one of crossed, gmsh"),
    (["--hight", "1"], "--hight"),
]


@pytest.mark.parametrize("arguments, message", BAD_OPTIONS)
def test_bad_options_are_named_with_what_was_expected(capsys, arguments, message):
    with pytest.raises(SystemExit) as ended:
        example_parser().parse_args(arguments)
    assert ended.value.code == 2
    assert message in capsys.readouterr().err


def test_options_that_do_not_fit_together(capsys):
    with pytest.raises(SystemExit):
        check(example_parser(), False, "--dilation-angle is 30, expected at most --friction-angle")
    assert "--dilation-angle is 30" in capsys.readouterr().err


def test_summary_holds_parameters_versions_and_results(tmp_path):
    options = argparse.Namespace(height=1.0, output=Path("somewhere"))
    write_summary(tmp_path, options, {"crest_displacement_m": np.float64(0.42), "counts": {"cells": np.int64(640)}})
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["parameters"] == {"height": 1.0, "output": "somewhere"}
    assert summary["crest_displacement_m"] == 0.42 and summary["counts"]["cells"] == 640 and summary["ranks"] == 1
    assert set(versions()) == set(summary["versions"]) >= {"talus", "dolfinx", "petsc", "compiler", "git_revision"}
    assert [path.name for path in tmp_path.iterdir()] == ["summary.json"]


def test_history_is_on_disk_after_each_row(tmp_path):
    with History(tmp_path / "history.csv", ["time_s", "energy_J"]) as history:
        for k in range(3):
            history.add(energy_J=10.0 * k, time_s=0.1 * k)
            with open(tmp_path / "history.csv", newline="") as file:
                rows = list(csv.DictReader(file))
            assert [float(row["energy_J"]) for row in rows] == [10.0 * i for i in range(k + 1)]
        np.testing.assert_allclose(history["time_s"], [0.0, 0.1, 0.2])
        with pytest.raises(ValueError, match="columns are time_s, expected time_s, energy_J"):
            history.add(time_s=1.0)


@pytest.mark.parametrize("number", interrupt.SIGNALS)
def test_the_first_signal_sets_a_flag(number, capfd):
    outer = signal.signal(number, signal.SIG_DFL)  # SIGHUP is ignored where the tests themselves run under nohup
    with Interrupt() as interrupted:
        assert not interrupted.requested() and interrupted.exit_code == 0
        os.kill(os.getpid(), number)
        assert interrupted.requested()
        for same in (
            number,
            signal.SIGTERM,
            signal.SIGUSR1,
        ):  # what a scheduler sends to several processes, and each hands on
            os.kill(os.getpid(), same)
    assert signal.signal(number, outer) == signal.SIG_DFL
    assert interrupted.exit_code == 128 + number
    assert "ending after this step" in capfd.readouterr().err


class CommOfASignal:
    """A communicator on which a signal comes in the middle of an exchange, when the flag has already been read."""

    rank = 0

    def __init__(self, number):
        self.number = number

    def allreduce(self, value, op):
        if self.number:
            number, self.number = self.number, 0
            os.kill(os.getpid(), number)
            time.sleep(0.01)  # the handler runs before this returns
        return value


def test_a_run_under_nohup_does_not_see_the_end_of_the_terminal():
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with Interrupt() as interrupted:
            os.kill(os.getpid(), signal.SIGHUP)
            assert not interrupted.requested()
    finally:
        signal.signal(signal.SIGHUP, before)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGUSR1])
def test_a_signal_during_the_exchange_is_not_lost(number):
    with Interrupt(CommOfASignal(number)) as interrupted:
        assert interrupted.requested() or interrupted.requested()
        assert interrupted.requested()
    assert interrupted.exit_code == 128 + number


def test_the_second_signal_ends_the_program():
    script = "import time\nfrom studies.common.interrupt import Interrupt\n"
    script += "with Interrupt():\n  print('ready', flush=True)\n  while True: time.sleep(0.01)"
    child = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert child.stdout.readline() == "ready\n"
    child.send_signal(signal.SIGTERM)
    assert any("ending after this step" in line for line in iter(child.stderr.readline, ""))
    time.sleep(interrupt.AGAIN + 0.2)
    assert child.poll() is None
    child.send_signal(signal.SIGTERM)
    assert child.wait(timeout=10) == -signal.SIGTERM


@pytest.mark.parametrize("ranks", [1, 2])
def test_ctrl_c_that_nothing_catches_ends_all_ranks_without_a_traceback(ranks):
    script = """
import os, signal
import fenics_bridge  # with it comes gmsh, which would have Ctrl-C end Python at once
from mpi4py import MPI
from studies.common.ranks import run_study
def main():
    if MPI.COMM_WORLD.rank == MPI.COMM_WORLD.size - 1:
        os.kill(os.getpid(), signal.SIGINT)
    while True:
        MPI.COMM_WORLD.barrier()
run_study(main)
"""
    command = [sys.executable, "-c", script]
    if ranks > 1:
        command = ["mpirun", "-n", str(ranks), "--oversubscribe", *command]
    root = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    child = subprocess.run(command, capture_output=True, text=True, timeout=60, env={**os.environ, **root})
    assert child.returncode == 130
    assert ": interrupted" in child.stderr and "Traceback" not in child.stderr


def test_progress_without_a_terminal_prints_lines(capsys):
    with Progress("sliding", until=2.0, pause=0.05) as progress:
        progress.show(0.5, 10, crest="0.10 m")
        assert capsys.readouterr().err == ""
        time.sleep(0.06)
        progress.show(1.0, 20, crest="0.20 m")
        line = capsys.readouterr().err
        assert line.startswith("sliding: 1 of 2 s, ") and "steps/s, crest 0.20 m" in line
        progress.show(2.0, 40, crest="0.30 m")
    assert "sliding: 2 of 2 s, 0 s left" in capsys.readouterr().err


POINTS = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])
CELLS = np.array([[0, 1, 2], [1, 3, 2]])
POSITION = np.array([[0.2, 0.2], [0.5, 0.3], [0.3, 0.5]])
VOLUME = np.full(3, 0.1)


def scene():
    return plots.Scene(POINTS, CELLS, np.array([True, False]))


def test_boundary_edges_belong_to_one_triangle():
    assert sorted(map(tuple, boundary_edges(CELLS))) == [(0, 1), (0, 2), (1, 3), (2, 3)]


def test_colour_limits_hold_over_time_and_are_round():
    frames = [np.linspace(-13e3, 0.0, 1000), np.linspace(-79.3e3, 1.0, 1000), np.zeros(0)]
    assert plots.colour_limits(plots.VERTICAL_STRESS, frames) == (-80.0, 0.0)
    assert (
        plots.colour_limits(plots.DISPLACEMENT, [np.zeros(5)])[0]
        < plots.colour_limits(plots.DISPLACEMENT, [np.zeros(5)])[1]
    )
    low, high = plots.colour_limits(plots.POROSITY, [np.full(100, 0.45), np.linspace(0.449, 0.452, 100)])
    assert 0.43 <= low <= 0.44 and 0.46 <= high <= 0.47  # not from zero, where no change would show
    assert plots.colour_limits(plots.POROSITY, [np.linspace(0.4, 0.5, 1000)]) == (0.4, 0.5)


def has_colour(path):
    picture = imread(path)[..., :3]
    return picture.shape[1] > 500 and np.ptp(picture, axis=2).max() > 0.3


def test_pictures_are_drawn(tmp_path):
    plots.save_mesh(tmp_path / "mesh.png", scene(), POSITION, VOLUME)
    plots.save_particles(tmp_path / "u.png", scene(), POSITION, VOLUME, np.arange(3.0), plots.DISPLACEMENT, title="now")
    plots.save_history(tmp_path / "h.png", np.arange(3.0), {"a": np.arange(3.0), "b": np.ones(3)}, "Value [m]")
    assert all(has_colour(tmp_path / name) for name in ("mesh.png", "u.png", "h.png"))


def test_a_picture_that_fails_costs_only_itself(tmp_path, capsys):
    options = study_parser("An example.").parse_args([])
    drawn = []

    def fail():
        drawn.append(json.loads((tmp_path / "summary.json").read_text())["answer"])
        raise RuntimeError("no ink")

    pictures = {"first": fail, "second": lambda: drawn.append("second")}
    NOT_WRITTEN.clear()
    write_summary(tmp_path, options, {"answer": 42}, pictures=pictures)
    assert drawn == [42, "second"]
    (reason,) = json.loads((tmp_path / "summary.json").read_text())["not_written"]
    line = fail.__code__.co_firstlineno + 2
    assert reason == f"cannot draw first: RuntimeError: no ink (test_studies_common.py:{line})"
    assert "figures: 2" in capsys.readouterr().err
    NOT_WRITTEN.clear()


def test_discs_of_a_film_have_their_place_size_and_colour():
    position, volume = np.array([[0.5, 0.25], [0.1, 0.75]]), np.full(2, 0.02)
    frame = {"time": 1.0, "position": position, "volume": volume, "strain": np.array([0.0, 1.0])}
    (pixels,) = animation._pictures(
        scene(), [frame], "strain", plots.SHEAR_STRAIN, (0.0, 1.0), scene().limits([position])
    )
    colours = colormaps[plots.SHEAR_STRAIN.colours]([0.0, 1.0], bytes=True)[:, :3]
    height, width = pixels.shape[:2]
    with plots.paper_style():
        figure, axes, _ = plots.figure_with_bar(*scene().limits([position]))
        figure.set_dpi(150)
        centre = axes.transData.transform(position)
        radius = 0.5 * plots.disc_diameter(volume)[0] * axes.bbox.width / np.ptp(axes.get_xlim())
    found = (pixels[: int(height - axes.bbox.y0), :, :3] == colours[0]).all(axis=2)  # above the bar of colours
    rows, columns = np.nonzero(found)
    near = np.hypot(columns - centre[0, 0], height - rows - centre[0, 1]) < 1.5 * radius
    assert columns[near].mean() == pytest.approx(centre[0, 0], abs=1.5)
    assert height - rows[near].mean() == pytest.approx(centre[0, 1], abs=1.5)
    assert near.sum() == pytest.approx(np.pi * radius**2, rel=0.15)  # lines of the mesh lie over it


@pytest.mark.parametrize("has_ffmpeg", [True, False])
def test_films_have_their_frames(tmp_path, monkeypatch, has_ffmpeg):
    if not has_ffmpeg:
        monkeypatch.setattr(animation.shutil, "which", lambda _: None)
    elif not animation.shutil.which("ffmpeg"):
        pytest.skip("needs ffmpeg")
    frames = [{"time": 0.1 * k, "position": POSITION + 0.1 * k, "volume": VOLUME, "displacement": np.full(3, 0.1 * k)}
              for k in range(4)]  # fmt: skip
    path = animation.save_animation(
        tmp_path / "slide", scene(), frames, "displacement", plots.DISPLACEMENT, seconds=1.0
    )
    assert path.suffix == (".mp4" if has_ffmpeg else ".gif")
    assert path.stat().st_size > 2000


@pytest.mark.parametrize(
    "length, text",
    [(0.4712, "0.471 m"), (12.3456, "12.346 m"), (-0.25, "-0.250 m"), (3.96e-4, "0.000396 m"), (-1.29e-6, "-1.29e-06 m"),
     (0.0, "0 m"), (-3e-17, "0 m")],
)  # fmt: skip
def test_small_lengths_are_printed_with_significant_digits(length, text):
    assert metres(length) == text
