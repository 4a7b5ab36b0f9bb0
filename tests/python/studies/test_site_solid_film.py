"""Films of bodies and their view in the player of the page: what is drawn where, what lies before what, and the light on it."""

import matplotlib.pyplot as plt
import numpy as np
import pytest
from mpl_toolkits.mplot3d import proj3d
from test_site_solid import cube

from studies.common.plots import DISPLACEMENT, colour_limits
from studies.common.solids import film
from studies.common.solids.film import View, draw_particles, fitted_view, lit_surface
from studies.common.solids.movie import solid_movie
from studies.common.solids.plots import brightness
from studies.common.solids.view import picture_axes

SIDE = np.array([1.0, 0.0])
AXES = picture_axes(SIDE)
RED, BLUE = (200, 0, 0, 255), (0, 0, 200, 255)


def block(moved=(0.0, 0.0, 0.0), time=0.0, cells=12):
    """Particles that fill a cube of 1 m, all moved alike."""
    grid = (np.stack(np.meshgrid(*3 * [np.arange(cells)]), axis=-1).reshape(-1, 3) + 0.5) / cells
    n = len(grid)
    return {"time": time, "position": grid + moved, "moved": np.tile(moved, (n, 1)), "volume": np.full(n, 1 / n), "id": np.arange(n),
            "displacement": np.full(n, np.linalg.norm(moved)), "shear_strain": np.zeros(n), "speed": np.zeros(n)}  # fmt: skip


@pytest.mark.parametrize("side", [(1.0, 0.0), (0.0, -1.0), (-1.0, 1.0)])
def test_points_are_where_the_axes_have_them_and_the_body_is_within(side):
    figure = plt.figure(figsize=(6.9, 4.6), dpi=150)
    try:
        axes = figure.add_axes((0.0, 0.17, 1.0, 0.78), projection="3d")
        points = np.array([(x, y, z) for x in (2.0, 9.0, 30.0) for y in (-3.0, 5.0) for z in (1.0, 4.0, 9.0)])
        view = fitted_view(axes, points, np.array(side))
        expected = axes.transData.transform(np.column_stack(proj3d.proj_transform(*points.T, axes.get_proj())[:2]))
        found = view.pixels(points)
        assert found == pytest.approx(expected, abs=1e-3)
        low, high = found.min(axis=0), found.max(axis=0)
        free = np.array([690 * 1.5, 0.78 * 460 * 1.5])
        assert low[0] > 0 and low[1] > 0.17 * 690 and high[0] < 1035 and high[1] < 0.95 * 690
        assert (free - (high - low)).min() == pytest.approx(2 * film.MARGIN * 150, abs=2)
        assert (low + high) / 2 == pytest.approx(np.array([1035 / 2, (0.17 + 0.39) * 690]), abs=2)
    finally:
        plt.close(figure)


def test_the_particle_that_is_nearer_covers_the_other_one_by_a_disc():
    """Of 2 m and 30 pixels per metre, 60 pixels wide, whichever of them comes first."""
    view = View(AXES, np.array([50.0, 40.0]), 30.0)
    far, near = 0.3 * AXES[0], 0.3 * AXES[0] + 5 * AXES[2]
    for places, colours in (((far, near), (RED, BLUE)), ((near, far), (BLUE, RED))):
        pixels = np.full((80, 100, 4), 255, dtype=np.uint8)
        draw_particles(
            pixels, view, np.array(places), np.array([1.0, 2.0][:: 1 if places[0] is far else -1]), np.array(colours)
        )
        blue = (pixels[..., 2] > 100) & (pixels[..., 0] == 0)
        assert not ((pixels[..., 0] > 100) & (pixels[..., 2] == 0)).any()
        assert blue.sum() == pytest.approx(np.pi * 30**2, rel=0.03)
        rows, columns = np.nonzero(blue)
        assert (columns.mean() + 0.5, 80 - rows.mean() - 0.5) == pytest.approx((50 + 0.3 * 30, 40), abs=0.6)


@pytest.mark.parametrize("normal", [(0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.6, 0.0, 0.8), (0.5, -0.5, np.sqrt(0.5))])
def test_a_plane_has_the_light_of_its_normal(normal):
    """The depth of a plane falls by its slope to the right and upwards, also beside other directions of the eye."""
    right, up, towards = AXES @ normal
    y, x = np.mgrid[60:0:-1, 0:80]
    depth = -(right * x + up * y) / towards
    found = lit_surface(depth, np.ones_like(depth, dtype=bool), 3.0, AXES)
    assert found[20:-20, 20:-20] == pytest.approx(float(brightness(np.array(normal))), abs=1e-9)


def test_a_body_that_moves_does_so_in_the_film(monkeypatch):
    """By its displacement times the scale of the picture; in the colour of its displacement."""
    moved = np.array([1.5, -0.5, -0.25])
    frames = [block(k * moved / 2, 0.1 * k) for k in range(3)]
    views, kept = [], []
    fitted = film.fitted_view
    monkeypatch.setattr(film, "fitted_view", lambda *given: views.append(fitted(*given)) or views[-1])
    monkeypatch.setattr(film, "save_film", lambda path, shown, draw, seconds: kept.extend(draw(shown)))
    film.save_solid_film("film", frames, "displacement", DISPLACEMENT, SIDE, np.empty((0, 2, 3)))
    height = len(kept[0])
    assert len(kept) == 3 and height % 2 == 0 and kept[0].shape == kept[2].shape
    background = (kept[0] == kept[2]).all(axis=2)[: int(0.8 * height)]  # without the scale
    places = []
    largest = colour_limits(DISPLACEMENT, [frames[-1]["displacement"]])[1]
    for picture, value in ((kept[0], 0.0), (kept[2], np.linalg.norm(moved))):
        highest = np.array(plt.get_cmap("viridis")(value / largest)[:3]) * 255
        part = picture[: int(0.8 * height), :, :3].astype(float)
        # Shades of one colour.
        shade = part.max(axis=2) / highest.max()
        is_body = (
            (np.abs(part - shade[..., None] * highest).max(axis=2) < 3) & (shade > 0.6) & (shade <= 1.01) & ~background
        )
        rows, columns = np.nonzero(is_body)
        places.append((columns.mean(), height - rows.mean()))
    expected = views[0].per_metre * (AXES[:2] @ moved)
    assert np.subtract(places[1], places[0]) == pytest.approx(expected, abs=0.03 * np.linalg.norm(expected))


def test_the_player_has_the_view_and_the_light_of_a_body():
    frames = [block(), block((0.5, 0.0, 0.0), 1.0)]
    frames[0].pop("moved")
    movie = solid_movie("block", cube(), frames)
    assert movie.view == pytest.approx(AXES)
    assert len(movie.scene.initial_outline) == 9 and movie.scene.initial_outline.shape[1:] == (2, 2)
    light, at = movie.frames[0]["light"], frames[0]["position"]
    top = (at[:, 2] > 0.95) & (np.abs(at[:, :2] - 0.5) < 0.3).all(axis=1)
    front = (at[:, 0] > 0.95) & (np.abs(at[:, 1:] - 0.5) < 0.3).all(axis=1)
    for chosen, normal in ((top, (0.0, 0.0, 1.0)), (front, (1.0, 0.0, 0.0))):
        assert light[chosen].mean() == pytest.approx(float(brightness(np.array(normal))), abs=0.05)
    assert movie.frames[0]["volume"] == pytest.approx(1 / 144)  # the area of a particle as wide as a cube of its volume
    assert solid_movie("none", None, frames) is None and solid_movie("none", cube(), []) is None
