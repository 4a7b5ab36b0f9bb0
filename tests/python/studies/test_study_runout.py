"""Run-out over terrain: rasters that do not fit together, and a slide that still moves in the end."""

import importlib
import sys
from pathlib import Path

import numpy as np
import pytest

import mpm_core as mpm

STUDIES = Path(__file__).parents[3] / "studies"
sys.path.insert(0, str(STUDIES))


def write(path, values, corner=500000.0):
    """An ESRI ASCII grid of cells of 5 m."""
    rows = "\n".join(" ".join(f"{value:.3f}" for value in row) for row in values)
    path.write_text(
        f"ncols {values.shape[1]}\nnrows {values.shape[0]}\nxllcorner {corner}\nyllcorner {corner}\ncellsize 5\n{rows}\n"
    )
    return str(path)


@pytest.fixture
def elevations():
    """A plane, and a cap 4 m high in the middle."""
    x, y = np.meshgrid(np.arange(20) * 5.0, np.arange(20) * 5.0)
    plane = 60 - 0.5 * x
    return plane, plane + 4 * np.maximum(1 - ((x - 47.5) / 20) ** 2 - ((y - 47.5) / 20) ** 2, 0)


def built(a):
    runout = importlib.import_module("runout")
    return runout.build(a, *runout.grounds(a))


def test_rasters_of_other_places_are_refused(tmp_path, elevations):
    plane, ground = elevations
    runout = importlib.import_module("runout")
    files = "--terrain", write(tmp_path / "a.asc", ground), "--rupture", write(tmp_path / "b.asc", plane, corner=0.0)
    # points are the centres of the cells
    with pytest.raises(
        mpm.InputError,
        match=r"--rupture covers x 2.5 to 97.5 m .*, expected a part of --terrain, x 500002.5 to 500097.5 m",
    ):
        runout.grounds(runout.parse([*files, "--crs", "local"]))


def test_elevations_in_other_units_are_refused(tmp_path, elevations):
    plane, ground = elevations
    files = "--terrain", write(tmp_path / "feet.asc", ground / 0.3048), "--rupture", write(tmp_path / "b.asc", plane)
    # at the edge the ground is the highest at 60 m, which is 196.85 ft
    with pytest.raises(mpm.InputError, match=r"--terrain is up to 137 m above --rupture at the edge of the rasters"):
        built(importlib.import_module("runout").parse([*files, "--crs", "local"]))


@pytest.mark.parametrize(("shift", "refused"), [(0.5, False), (1.0, True)])
def test_surveys_that_differ_by_less_than_half_a_particle_at_the_edge_are_taken(shift, refused, tmp_path, elevations):
    """As two surveys of the same ground do, by decimetres; particles are 1.33 m apart."""
    plane, ground = elevations
    ground[:3, :3] += shift
    files = "--terrain", write(tmp_path / "a.asc", ground), "--rupture", write(tmp_path / "b.asc", plane)
    runout = importlib.import_module("runout")
    a = runout.parse([*files, "--crs", "local"])
    if refused:
        with pytest.raises(mpm.InputError, match=f"--terrain is up to {shift:g} m above --rupture at the edge"):
            runout.body_between(a, *runout.grounds(a))
    else:
        body = runout.body_between(a, *runout.grounds(a))
        # those of the cap of more than 0.133 m, and the corner
        expected = ground - plane > 0.133
        assert body.sum() == expected.sum()


def test_a_slide_too_small_for_its_cells_names_their_options():
    with pytest.raises(
        mpm.InputError, match=r"--thickness is 8 m with --height 0.06 m and --cell-size 4 m, expected a slide"
    ):
        built(importlib.import_module("runout").parse(["--height", "0.06"]))


@pytest.mark.parametrize("last, said", [(200.0, "by 2 m/s"), (5.0, "")])
def test_a_slide_that_still_moves_is_said(last, said):
    history = {"kinetic_energy_J": np.array([0.0, 1000.0, last])}
    words = importlib.import_module("runout").still_moving(history, 100.0)  # sqrt(2 x 200 J / 100 kg) = 2 m/s
    assert said in words and bool(words) == bool(said)
