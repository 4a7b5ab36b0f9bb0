"""The study levee: loose sand liquefies beside the levee, which settles; dense sand carries it."""

import importlib
import json

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.collections import LineCollection
from matplotlib.quiver import Quiver
from matplotlib.tri import Triangulation
from study_main import ended

SMALL = [
    "--cell-size", "2", "--beside", "12", "--motion", "ricker", "--frequency", "1.5", "--peak", "3", "--duration", "2", "--rest", "0.5",
    "--frames", "2", "--no-pictures",
]  # fmt: skip


@pytest.fixture(scope="module")
def of(tmp_path_factory):
    """Summary and history of a small earthquake for sand of a void ratio; each is computed once."""
    known = {}

    def run(void_ratio):
        if void_ratio not in known:
            folder = tmp_path_factory.mktemp(f"levee_{void_ratio}")
            result = ended("levee", folder, *SMALL, "--void-ratio", str(void_ratio))
            assert result.returncode == 0, result.stderr
            summary = json.loads((folder / "summary.json").read_text())
            known[void_ratio] = summary, np.genfromtxt(folder / "history.csv", delimiter=",", names=True)
        return known[void_ratio]

    return run


def test_loose_sand_liquefies_beside_the_levee_and_not_below_its_crest(of):
    summary, history = of(0.88)
    assert summary["largest_pore_pressure_ratio_free_field"] > 0.85
    assert summary["largest_pore_pressure_ratio_below_crest"] < 0.4
    assert summary["crest_settlement_m"] > 0.02 and summary["spreading_of_toes_m"] > 0.02
    settlement = history["crest_settlement_m"]
    assert abs(settlement[0]) < 1e-12 and settlement[history["time_s"] < 0.2].max() < 1e-3  # it begins at rest
    assert summary["unexplained_energy_fraction"] < 0.01


def test_dense_sand_carries_the_levee(of):
    loose, dense = (of(void_ratio)[0] for void_ratio in (0.88, 0.65))
    assert dense["crest_settlement_m"] < 0.5 * loose["crest_settlement_m"]
    assert dense["spreading_of_toes_m"] < 0.5 * loose["spreading_of_toes_m"]


def summary_with_water(folder, *options):
    result = ended("levee", folder, *SMALL, "--void-ratio", "0.88", *options)
    assert result.returncode == 0, result.stderr
    return json.loads((folder / "summary.json").read_text())


def test_water_that_hardly_flows_is_as_that_of_undrained_soil(of, tmp_path):
    undrained = of(0.88)[0]
    summary = summary_with_water(tmp_path, "--conductivity", "1e-9", "--stiff-conductivity", "1e-9")
    for name in ("crest_settlement_m", "spreading_of_toes_m", "largest_pore_pressure_ratio_free_field"):
        assert summary[name] == pytest.approx(undrained[name], rel=0.1)


def test_the_ground_settles_as_its_water_flows_off(of, tmp_path):
    """Coarse sand: excess pore pressures go within a second, and the ground beside, which the levee has pushed up, settles."""
    undrained = of(0.88)[0]
    summary = summary_with_water(tmp_path, "--conductivity", "0.03", "--rest", "1.5")
    history = np.genfromtxt(tmp_path / "history.csv", delimiter=",", names=True)
    assert undrained["ground_settlement_m"] < -0.003  # pushed up, in this narrow ground
    assert summary["ground_settlement_m"] > undrained["ground_settlement_m"] + 0.01
    assert summary["largest_pore_pressure_ratio_free_field"] > 0.4
    assert history["pore_pressure_ratio_free_field"][-1] < 0.1
    assert summary["crest_settlement_m"] > summary["crest_settlement_at_end_of_motion_m"]
    assert abs(summary["unexplained_energy_fraction"]) < 0.01


@pytest.mark.parametrize(
    ("largest", "times"), [(0.2, 10.0), (0.21, 5.0), (0.5, 2.0), (1.9, 1.0), (30.0, 1.0), (0.0, 1.0), (2e-3, 1000.0)]
)
def test_displacements_are_enlarged_to_a_thirtieth_of_the_width_at_most(largest, times):
    plots = importlib.import_module("common.water.levee_plots")
    assert plots.enlargement(largest, 60.0) == pytest.approx(times)  # a thirtieth is 2 m


def test_displacements_are_drawn_beside_the_outline_before(monkeypatch):
    """A block of 40 m by 10 m that moves as a whole by (0.3, -0.1) m: drawn four times as far, rounded down to twice as far."""
    plots, figures = importlib.import_module("common.water.levee_plots"), []
    monkeypatch.setattr(plots, "save_figure", lambda figure, path: figures.append(figure))
    x, y = np.meshgrid(np.linspace(0, 40, 11), np.linspace(-10, 0, 4))
    triangles = Triangulation(x.ravel(), y.ravel())
    points, cells = np.column_stack([triangles.x, triangles.y]), triangles.triangles
    moved = np.array([0.3, -0.1])
    frame = {"time": 8.0, "mesh_corners": points[cells].reshape(-1, 6), "moved": np.tile(moved, (len(cells), 1))}
    plots.save_displacement(None, frame)
    axes = figures[0].axes[0]
    after, before = (np.array(one.get_segments()) for one in axes.collections if isinstance(one, LineCollection))
    assert np.linalg.norm(np.diff(before, axis=1)[:, 0], axis=1).sum() == pytest.approx(100.0)  # no gap within
    assert np.allclose(after - before, 2 * moved) and "enlarged 2 times" in axes.get_title(loc="left")
    arrows = next(one for one in axes.collections if isinstance(one, Quiver))
    assert np.allclose(arrows.U, 0.3) and np.allclose(arrows.V, -0.1) and 40 < len(arrows.U) <= 44
    (low, high), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    tips = arrows.XY + np.column_stack([arrows.U, arrows.V]) / arrows.scale
    assert np.all((tips > (low, bottom)) & (tips < (high, top)))
    plt.close(figures[0])


def test_displacements_are_those_of_the_crest_and_the_toes_themselves(monkeypatch):
    """Ground that stretches sideways and sinks in proportion to its height, faster and faster: u = t^2/2 (x, -y - 10) / 100 m."""
    levee, site, motions = (
        importlib.import_module(name) for name in ("levee", "common.water.levee_site", "common.earthquake.site")
    )
    a = levee.parse([*SMALL, "--height", "4"])
    model = site.model_in_equilibrium(a, motions.outcrop_motion(a)[2])
    field = lambda places: (places + (0.0, 10.0)) * (0.01, -0.01)
    followed, time = levee.Followed(model, a), 0.0
    monkeypatch.setattr(type(model), "nodal", lambda *_: time * field(model.mesh.points))
    assert followed.row(0.0)["crest_settlement_m"] == 0.0
    for time in (0.5, 1.5, 2.0):
        row = followed.row(time)
    assert row["crest_settlement_m"] == pytest.approx(0.28) and row["ground_settlement_m"] == pytest.approx(0.2)
    assert row["spreading_of_toes_m"] == pytest.approx(0.02 * 20.0)


def test_the_levee_has_the_strength_of_its_options():
    options = "--cohesion 8e3 --friction-angle 30 --dilation-angle 4 --young 50e6 --poisson 0.25".split()
    law = importlib.import_module("common.water.levee_site").laws_at_rest(
        importlib.import_module("levee").parse(options)
    )["levee"]
    assert (law.cohesion, law.friction_angle, law.dilation_angle, law.young, law.poisson) == (
        8e3,
        30.0,
        4.0,
        50e6,
        0.25,
    )


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--cell-size", "3"], "--cell-size is 3 m, expected at most half of --height"),
        (["--stiff-conductivity", "1e-7"], "--stiff-conductivity is given, expected --conductivity with it"),
        (["--conductivity", "0"], "--conductivity"),
        (["--sanisand", "dilatency=1"], "did you mean dilatancy?"),
        (
            ["--sanisand", "dilatancy=1", "void_ratio=0.65"],
            "'void_ratio=0.65', expected --void-ratio 0.65 in its place",
        ),
        (["--highest-frequency", "0.5"], "--highest-frequency is 0.5 Hz, expected above the lowest frequency"),
    ],
)
def test_wrong_options_are_named(tmp_path, options, message):
    result = ended("levee", tmp_path, *options)
    assert result.returncode == 2 and message in result.stderr, result.stderr


@pytest.mark.parametrize(("frequency", "said"), [("10", False), ("10.6", True)])
def test_cells_too_coarse_for_shear_waves_of_the_sand_are_doubted(frequency, said, recwarn):
    """Toyoura sand of e = 0.85 has G = 125 p_a (2.97 - e)^2 / (1 + e) sqrt(p / p_a), p_a = 101.3 kPa, under an attraction of 1 kPa added to p.

    3 m below the surface p = 8.75 kN/m3 3 m (1 + 2 K0) / 3 = 16.2 kPa with K0 = 3/7, which makes 82.2 m/s: cells of 1 m are an eighth of a wave of 10.3 Hz.
    """
    levee, site = importlib.import_module("levee"), importlib.import_module("common.water.levee_site")
    a = levee.parse(["--highest-frequency", frequency])
    pressure = (18559.46 - 9810.0) * 3.0 * (1 + 6 / 7) / 3 + 1e3
    shear = 125 * 101.3e3 * 2.12**2 / 1.85 * np.sqrt(pressure / 101.3e3)
    assert site.speed_of_sand(a) == pytest.approx(np.sqrt(shear / 1891.9), rel=0.01)
    texts = [str(one.message) for one in recwarn if "--cell-size is 1 m, expected" in str(one.message)]
    assert len(texts) == said and all("in the sand: higher frequencies" in text for text in texts)


@pytest.mark.parametrize("void_ratio", ["1.6", "3.0"])
def test_sand_that_fails_under_its_load_names_its_void_ratio(void_ratio, tmp_path):
    """Above the critical void ratio of Toyoura sand without pressure, 0.934, undrained sand loses its strength."""
    run = ended("levee", tmp_path, *SMALL, "--void-ratio", void_ratio)
    assert run.returncode == 2
    warning, error = run.stderr.strip().splitlines()[0], run.stderr.strip().splitlines()[-1]
    assert f"--void-ratio is {float(void_ratio):g}, and the critical void ratio of the sand is 0.934" in warning
    assert f"sand of this --void-ratio, {float(void_ratio):g}, may be too loose to carry its load: lower it" in error


def test_sand_that_can_have_strength_is_not_warned_of():
    levee, site = importlib.import_module("levee"), importlib.import_module("common.water.levee_site")
    assert site.too_loose(levee.parser().parse_args(["--void-ratio", "0.93"])) == ""
