"""The page of a run in a browser without a window: it loads, the slider moves the particles, the mouse finds them."""

import numpy as np
import pytest
from browser import NEEDED, move_slider, number_of_colours, open_page, picture, started
from PIL import Image

from particle_player import Movie
from studies.common.parameters import Parameter
from studies.common.plots import DISPLACEMENT, SHEAR_STRAIN, Scene
from studies.common.report import Report, Section, save_report

pytestmark = NEEDED
SIDE, TIMES = 40, np.linspace(0.0, 2.0, 11)


def frames():
    """A block that shears with time. Rows are in another order each time, and the last particle leaves halfway."""
    x, y = (c.ravel() for c in np.meshgrid(*[(np.arange(SIDE) + 0.5) / SIDE] * 2))
    order = np.random.default_rng(1)
    for t in TIMES:
        rows = order.permutation(SIDE**2 - (t > 1.0))
        moved = 0.5 * t * y[rows]
        yield {
            "time": t, "id": rows, "position": np.c_[x[rows] + moved, y[rows]], "volume": np.full(len(rows), 1 / SIDE**2),
            "displacement": moved, "shear_strain": 0.5 * t * np.ones(len(rows)),
        }  # fmt: skip


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    folder = tmp_path_factory.mktemp("page")
    points = np.array([(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0)])
    scene = Scene(points, np.array([(0, 1, 2), (0, 2, 3)]))
    quantities = {"displacement": DISPLACEMENT, "shear_strain": SHEAR_STRAIN}
    movies = [Movie("MPM", scene, list(frames()), quantities), Movie("FEM", scene, list(frames())[:1], quantities)]
    Image.new("RGB", (8, 8), "red").save(folder / "figure.png")
    save_report(folder / "report.html", Report(
        "Shear </script> & <b>", "A block", {"moved": "1 m"}, movies, figures={folder / "figure.png": "A figure"},
        curves={"History": {"time_s": TIMES, "crest_displacement_m": 0.5 * TIMES, "centre_y_m": 5335020.0 + 8.0 * TIMES}},
        parameters=[Parameter("height", 1.0, "m", "height of the block")], results={"steps": 10},
    ))  # fmt: skip
    (folder / "figure.png").unlink()  # the page must not need it
    return folder / "report.html"


@pytest.fixture(scope="module")
def browser(page):
    with started() as driver:
        open_page(driver, page)
        yield driver


def position(browser, particle, frame):
    """As the page has it, in metres."""
    return browser.execute_script(
        "const m = page.player.views[0].movie;"
        "return ['x', 'y'].map((f) => valueAt(m.fields[f], m.count, arguments[0], arguments[1], 0))", particle, frame
    )  # fmt: skip


def test_it_loads_without_errors_and_without_a_network(browser, page):
    assert browser.get_log("browser") == []
    assert browser.title == "Shear </script> & <b>"
    text = page.read_text()
    assert "http://" not in text.replace("http://www.w3.org/2000/svg", "") and "https://" not in text
    assert browser.execute_script("return document.querySelector('figure img').naturalWidth") == 8


@pytest.mark.parametrize("width", [1300, 700])
def test_wide_tables_scroll_by_themselves(browser, page, tmp_path, width):
    """Nine members have 36 columns of forces, and their results long names; neither makes the page wider than its window."""
    forces = {f"largest_axial_force_of_nail_{k}_{part}_N": 123456.7 for k in range(9) for part in "abcd"}
    stages = Section("Stages", columns=["Stage", *forces], rows=[["in situ", *["123456.7"] * len(forces)]])
    path = tmp_path / "report.html"
    long = {f"members_in_last_equilibrium: {name}": value for name, value in forces.items()}
    options = [Parameter("name_of_an_option", 1.0, "kN/m3", "what it means, in some words")]
    save_report(path, Report("Nails", sections=[stages], parameters=options, results=long))
    size = browser.get_window_size()
    browser.set_window_size(width, 1000)
    try:
        open_page(browser, path)
        inside = "return [document.documentElement.scrollWidth, document.documentElement.clientWidth]"
        wide, shown = browser.execute_script(inside)
        assert wide <= shown
        scrolls = (
            "const t = document.querySelector('section table').parentElement; return t.scrollWidth > t.clientWidth"
        )
        assert browser.execute_script(scrolls)
    finally:
        browser.set_window_size(size["width"], size["height"])
        open_page(browser, page)


def test_positions_are_those_that_were_given(browser):
    given = list(frames())
    for k in (0, 4, 10):
        for row in (0, 700):
            expected = given[k]["position"][row]
            # Half a step of 65,534 over 2 m at most, and single precision
            np.testing.assert_allclose(position(browser, int(given[k]["id"][row]), k), expected, atol=2 / 65534)


def test_a_particle_that_left_is_absent(browser):
    last = SIDE**2 - 1
    assert position(browser, last, 5)[0] is not None
    assert position(browser, last, 6) == [None, None]  # NaN in JSON


def test_the_slider_moves_the_particles(browser):
    seen = []
    for frame in (0, 10):
        move_slider(browser, frame)
        seen.append(browser.execute_script("return page.player.views[0].screenOf(1500)"))
        assert (
            browser.execute_script("return document.getElementById('clock').textContent") == f"t = {TIMES[frame]:.1f} s"
        )
    scale = browser.execute_script("return page.player.views[0].s")
    y = 1500 // SIDE + 0.5
    assert seen[1][0] - seen[0][0] == pytest.approx(scale * y / SIDE, rel=1e-3)
    assert seen[1][1] == pytest.approx(seen[0][1])


def test_the_picture_is_not_blank_and_changes_with_time_and_colour(browser):
    pictures = []
    for frame, quantity in ((0, "displacement"), (10, "displacement"), (10, "shear_strain")):
        browser.execute_script(
            "const q = document.getElementById('quantity'); q.value = arguments[0]; q.onchange()", quantity
        )
        move_slider(browser, frame)
        pictures.append(picture(browser))
    assert number_of_colours(pictures[1]) > 500
    for one, other in ((0, 1), (1, 2)):
        assert np.mean((pictures[one] != pictures[other]).any(axis=2)) > 0.02


def test_the_mouse_finds_particles_and_their_values(browser):
    move_slider(browser, 10)
    found = browser.execute_script(
        "const v = page.player.views[0], box = v.box.getBoundingClientRect(), [x, y] = v.screenOf(810);"
        "const i = v.particleAt(box.left + x, box.top + y); return [i, page.player.describe(v, i)]"
    )
    row, column = divmod(810, SIDE)
    y = (row + 0.5) / SIDE
    assert found[0] == 810
    assert found[1].startswith("particle 810\n")
    assert f"Total displacement: {y:.4g} m" in found[1]
    assert f"at ({(column + 0.5) / SIDE + y:.4g}, {y:.4g}) m" in found[1]


def test_zooming_keeps_the_point_under_the_mouse(browser):
    kept = browser.execute_script(
        "const p = page.player, v = p.views[0], box = v.box.getBoundingClientRect();"
        "const at = () => [(200 - v.ox) / v.s, (v.oy - 100) / v.s], before = [...at(), v.s];"
        "p.zoom(v, { preventDefault() {}, clientX: box.left + 200, clientY: box.top + 100, deltaY: -300 });"
        "const after = [...at(), v.s]; p.wholeView(); return [before, after]"
    )
    np.testing.assert_allclose(kept[1][:2], kept[0][:2], atol=1e-9)
    assert kept[1][2] == pytest.approx(np.exp(0.45) * kept[0][2])


def test_both_panels_show_the_same_part_and_the_curves_follow(browser):
    move_slider(browser, 5)
    views = browser.execute_script("return page.player.views.map((v) => [v.s, v.ox, v.now.k])")
    assert views[0][:2] == views[1][:2]
    assert [k for _, _, k in views] == [5, 0]
    assert browser.execute_script("return document.querySelector('.curve output').textContent") == "0.5 m"
    assert browser.get_log("browser") == []


def test_coordinates_of_a_map_are_drawn_where_they_are_and_in_all_digits(browser):
    move_slider(browser, 5)
    curve = "document.querySelectorAll('.curve')[1]"
    assert (
        browser.execute_script(f"return {curve}.querySelector('output').textContent")
        == f"{5335020 + 8 * TIMES[5]:.0f} m"
    )
    ticks = browser.execute_script(
        f"return [...{curve}.querySelectorAll('text[text-anchor=end]')].map((t) => t.textContent)"
    )
    assert [float(t) for t in ticks] == sorted({float(t) for t in ticks}) and 5335020 <= float(ticks[0]) <= 5335024
    first = browser.execute_script(
        "return [shown(0), shown(1e-5), shown(-2.5e7), shown(3.14159), shown(691024.271, 30)]"
    )
    assert first == ["0", "1.00e\u22125", "\u22122.50e+7", "3.142", "691024.3"]


# --- 100,000 particles -----------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def large(tmp_path_factory):
    """A page with 100,000 particles that move to the right, each by its height, within ten frames."""
    x, y = (c.ravel() for c in np.meshgrid((np.arange(500) + 0.5) / 100, (np.arange(200) + 0.5) / 100))
    still = {"volume": np.full(x.size, 1e-4), "id": np.arange(x.size)}
    moving = [
        {"time": t, **still, "position": np.c_[x + t * y, y], "displacement": t * y, "shear_strain": t * y**2}
        for t in np.linspace(0, 1, 10)
    ]
    scene = Scene(np.array([(0.0, 0.0), (8.0, 0.0), (8.0, 2.0), (0.0, 2.0)]), np.array([(0, 1, 2), (0, 2, 3)]))
    path = tmp_path_factory.mktemp("large") / "report.html"
    quantities = {"displacement": DISPLACEMENT, "shear_strain": SHEAR_STRAIN}
    save_report(path, Report("A large block", movies=[Movie("MPM", scene, moving, quantities)]))
    return path


def test_a_hundred_thousand_particles(browser, page, large):
    open_page(browser, large)
    assert browser.get_log("browser") == []
    before, after = [], []
    for frame, found in ((0, before), (9, after)):
        move_slider(browser, frame)
        found.append(picture(browser))
        found.append(browser.execute_script("return page.player.views[0].screenOf(99999)"))
    assert browser.execute_script("return page.player.views[0].movie.count") == 100_000
    assert number_of_colours(after[0]) > 100  # not blank
    assert np.mean((before[0] != after[0]).any(axis=2)) > 0.05
    scale = browser.execute_script("return page.player.views[0].s")
    assert after[1][0] - before[1][0] == pytest.approx(1.995 * scale, rel=1e-3)
    frame_ms = browser.execute_script(
        "const p = page.player, start = performance.now(); for (let k = 0; k < 5; k++) p.show(0.1 * k);"
        "return (performance.now() - start) / 5"
    )
    print(f"\n100,000 particles: {frame_ms:.0f} ms per frame, page of {large.stat().st_size / 1e6:.1f} MB")
    open_page(browser, page)
