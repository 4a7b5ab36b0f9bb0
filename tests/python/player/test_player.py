"""The package of the player by itself: it needs no other part of Talus, and shows the values that it was given."""

import base64
import re
import subprocess
import sys
import zlib
from pathlib import Path

import numpy as np
import pytest
from browser import NEEDED, move_slider, open_page, started

from particle_player import Movie, Quantity, Scene, parts_of_page, save_player
from particle_player.movie import ABSENT, LEVELS, quantised

ROOT = Path(__file__).parents[3]
SCENE = Scene(np.array([(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0)]), np.array([(0, 1, 2), (0, 2, 3)]))
TIMES = np.linspace(0.0, 1.0, 6)


def movie(n=50):
    """Particles on a line, each of which moves to the right by its own speed."""
    x = np.linspace(0.1, 0.9, n)
    return Movie("A <line>", SCENE, [
        {"time": t, "position": np.column_stack([x + t * x, x]), "volume": np.full(n, 1e-3), "speed": x} for t in TIMES
    ], {"speed": Quantity("Speed", "mm/s", scale=1e3)})  # fmt: skip


def unpacked(field, shape):
    """What `readField` in data.js computes: low bytes, then high bytes, of differences from frame to frame."""
    apart = np.frombuffer(zlib.decompress(base64.b64decode(field["data"])), np.uint8).reshape(2, *shape)
    levels = np.cumsum(apart[0].astype(np.uint16) + 256 * apart[1].astype(np.uint16), axis=0, dtype=np.uint16)
    values = field["low"] + (field["high"] - field["low"]) / LEVELS * levels
    return np.where(levels == ABSENT, np.nan, values)


def test_values_come_back_within_half_a_step(tmp_path):
    table = np.random.default_rng(0).normal(size=(4, 30))
    table[2:, 7] = np.nan  # a particle that left
    found = unpacked(quantised(table), table.shape)
    assert np.array_equal(np.isnan(found), np.isnan(table))
    step = np.nanmax(table) - np.nanmin(table)
    assert np.nanmax(abs(found - table)) <= 0.5001 * step / LEVELS


def test_the_colour_scale_is_in_the_unit_that_is_shown():
    data = parts_of_page([movie()]).data
    assert data["limits"]["speed"] == (0.0, 1000.0)  # mm/s, of 0.1 to 0.9 m/s
    assert data["quantities"]["speed"]["unit"] == "mm/s"


def test_the_package_imports_nothing_else_of_talus():
    code = "import sys, particle_player; print(*{name.split('.')[0] for name in sys.modules})"
    names = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT
    ).stdout.split()
    assert {"particle_player", "numpy", "matplotlib"} <= set(names)
    assert not {"mpm_core", "fenics_bridge", "dolfinx", "studies", "talus", "h5py", "mpi4py"} & set(names)


def test_a_page_without_movies_or_frames_is_refused(tmp_path):
    with pytest.raises(ValueError, match="movies is empty, expected at least one"):
        save_player(tmp_path / "page.html", [])
    with pytest.raises(ValueError, match="frames is empty, expected at least one"):
        parts_of_page([Movie("none", SCENE, [], {})])


TURN = np.radians(30.0)
VIEW = np.array([(-np.sin(TURN), np.cos(TURN), 0.0), (-0.5 * np.cos(TURN), -0.5 * np.sin(TURN), np.sqrt(0.75)),
                 (np.sqrt(0.75) * np.cos(TURN), np.sqrt(0.75) * np.sin(TURN), 0.5)])  # fmt: skip
"""From 30 degrees beside the x axis, and from 30 degrees above"""


def body():
    """Two particles behind one another as seen in the first frame, the nearer one first; in the second frame they have changed places."""
    places = np.array([(1.0, 2.0, 3.0) + 4 * VIEW[2], (1.0, 2.0, 3.0)])
    corners = np.array([(-2.0, -2.0), (4.0, -2.0), (4.0, 4.0), (-2.0, 4.0)])
    scene = Scene(
        corners, np.empty((0, 3), dtype=int), outline=np.stack([corners, np.roll(corners, 1, axis=0)], axis=1)
    )
    frames = [{"time": float(k), "position": places[:: 1 - 2 * k], "volume": np.full(2, 0.5), "speed": np.array([1.0, 0.0]),
               "light": np.array([0.5, 1.0]), "bodies": np.array([[(0.0, 0.0, 0.0), (1.0, 2.0, 3.0)]])} for k in range(2)]  # fmt: skip
    return Movie("body", scene, frames, {"speed": Quantity("Speed", "m/s")}, VIEW)


def test_a_body_is_projected_onto_its_picture():
    data = parts_of_page([body()]).data
    (found,) = data["movies"]
    x, y, depth, light = (unpacked(found["fields"][name], (2, 2)) for name in ("x", "y", "depth", "light"))
    right, up, towards = VIEW @ (1.0, 2.0, 3.0)
    assert x == pytest.approx(right) and y == pytest.approx(up)
    assert depth == pytest.approx(towards + np.array([(4.0, 0.0), (0.0, 4.0)]), abs=1e-4)
    assert light == pytest.approx(np.array([(0.5, 1.0)] * 2), abs=1e-4)
    assert found["bodies"][0] == pytest.approx([0.0, 0.0, right, up], abs=1e-5)
    assert found["view"] == VIEW.tolist() and found["scene"]["mesh"] == [] and len(found["scene"]["outline"]) == 16
    assert (
        data["extent"][0] == pytest.approx([-2.24, -2.24])
        and parts_of_page([movie()]).data["movies"][0]["view"] is None
    )


@NEEDED
def test_the_player_shows_the_nearer_particle_of_a_body_and_its_three_coordinates(tmp_path):
    save_player(tmp_path / "page.html", [body()])
    with started() as browser:
        open_page(browser, tmp_path / "page.html")
        assert browser.get_log("browser") == []
        for step in (0, 1):
            move_slider(browser, step)
            shown = """const v = page.player.views[0], [x, y] = v.screenOf(0), r = v.ratio;
                       const p = Math.round(y * r) * v.picture.width + Math.round(x * r);
                       return [v.shownParticle[p], v.pixels[p] & 255, page.player.colours[v.shownParticle[p] === 0 ? 255 : 0] & 255];"""
            particle, red, colour = browser.execute_script(shown)
            assert particle == step and red == pytest.approx(colour * (0.5 if particle == 0 else 1.0), abs=1)
            near = browser.execute_script(f"return page.player.describe(page.player.views[0], {step})").splitlines()[1]
            numbers = [
                float(text.replace("\N{MINUS SIGN}", "-")) for text in re.findall(r"[-\N{MINUS SIGN}\d.]+", near)
            ]
            assert numbers == pytest.approx((1.0, 2.0, 3.0) + 4 * VIEW[2], abs=2e-3)


@NEEDED
def test_a_page_of_its_own_shows_the_particles(tmp_path):
    save_player(tmp_path / "page.html", [movie(), movie()], "Two </script> & one", slider=("unit weight", "kN/m³"))
    text = (tmp_path / "page.html").read_text()
    assert not re.search(r"https?://", text)
    with started() as browser:
        open_page(browser, tmp_path / "page.html")
        assert browser.get_log("browser") == []
        assert browser.title == "Two </script> & one"
        move_slider(browser, 3)
        assert (
            browser.execute_script("return document.getElementById('clock').textContent") == "unit weight = 0.6 kN/m³"
        )
        found = browser.execute_script(
            "return page.player.views.map((v) => ['x', 'y'].map((f) => valueAt(v.movie.fields[f], v.movie.count, 49, 3, 0)))"
        )
        np.testing.assert_allclose(found, 2 * [[0.9 * 1.6, 0.9]], atol=2 / LEVELS)
        said = browser.execute_script("return page.player.describe(page.player.views[0], 49)")
        assert said.splitlines()[0] == "particle 49" and "Speed: 900 mm/s" in said
