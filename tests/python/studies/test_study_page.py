"""What a page says, without a browser: the order of its parts, curves worth drawing, units, the quantity shown first."""

import json
import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

from particle_player import Movie
from studies.common import movie
from studies.common.page import TITLES, _facts, _heading
from studies.common.parameters import Parameter
from studies.common.plots import DISPLACEMENT, SHEAR_STRAIN, VERTICAL_STRESS, Scene
from studies.common.report import Report, name_and_unit, save_report

TIMES = np.linspace(0.0, 2.0, 5)
SCENE = Scene(np.array([(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0)]), np.array([(0, 1, 2), (0, 2, 3)]))
QUANTITIES = {"shear_strain": SHEAR_STRAIN, "displacement": DISPLACEMENT, "vertical_stress": VERTICAL_STRESS}


def frame(time, count=4, **values):
    """Particles in a row; what is not named is zero."""
    zero = np.zeros(count)
    position = np.column_stack([np.arange(count) / count, zero])
    return {
        "time": time,
        "position": position,
        "volume": np.full(count, 0.1),
        **dict.fromkeys(QUANTITIES, zero),
        **values,
    }


def page(tmp_path, movies=(), curves=None):
    Image.new("RGB", (8, 8), "red").save(tmp_path / "figure.png")
    save_report(tmp_path / "report.html", Report(
        "Title", movies=movies, curves=curves or {}, figures={tmp_path / "figure.png": "A figure"},
        parameters=[Parameter("height", 1.0, "m", "height of the block")], results={"runout_m": 0.5, "steps": 10},
    ))  # fmt: skip
    text = (tmp_path / "report.html").read_text()
    return text, json.loads(re.search(r'id="data">(.*?)</script>', text, re.DOTALL).group(1))


def test_figures_come_before_curves_and_units_stand_in_brackets(tmp_path):
    text, _ = page(tmp_path)
    assert text.index("A figure") < text.index('<div id="curves">') < text.index("Parameters</h2>")
    assert "<td>[m]</td>" in text and "<td>m</td>" not in text
    assert "<td>Run-out</td>" in text


def test_what_does_not_change_is_said_and_not_drawn(tmp_path):
    table = {
        "time_s": TIMES,
        "runout_m": TIMES**2,
        "dt_s": np.array([0.0, *np.full(4, 1e-3)]),
        "cuts": np.zeros(5),
        "none": np.full(5, np.nan),
    }
    _, data = page(tmp_path, curves={TITLES["history"]: table})
    (curves,) = data["curves"]
    assert curves["title"] == "History of the run" and curves["along"]["name"] == "Time"
    assert [curve["name"] for curve in curves["curves"]] == ["Run-out"]
    assert curves["constant"] == "Constant: Time step 0.001 s, Cuts 0, None –."


def test_no_panel_is_of_one_colour_at_first(tmp_path):
    growing = np.array([0.0, 0.1, 0.5, 1.0])
    slide = Movie("MPM", SCENE, [frame(t, shear_strain=t * growing, displacement=t * growing,
                                       vertical_stress=-1e4 * growing) for t in TIMES], QUANTITIES)  # fmt: skip
    before = Movie("FEM", SCENE, [frame(0.0, displacement=1e-3 * growing, vertical_stress=-8e3 * growing)], QUANTITIES)
    assert page(tmp_path, [slide])[1]["first"] == "shear_strain"
    assert page(tmp_path, [slide, before])[1]["first"] == "vertical_stress"
    corner = Movie(
        "FEM",
        SCENE,
        [frame(0.0, 100, shear_strain=np.eye(1, 100)[0], vertical_stress=np.linspace(-8e3, 0, 100))],
        QUANTITIES,
    )
    assert page(tmp_path, [slide, corner])[1]["first"] == "vertical_stress"  # a particle at a corner is not seen
    still = Movie("still", SCENE, [frame(0.0)], QUANTITIES)
    assert page(tmp_path, [still])[1]["first"] == "shear_strain"


def test_a_study_written_for_the_earlier_version_still_makes_its_movie():
    frames = [frame(t, speed=np.ones(4)) for t in TIMES]
    with pytest.warns(DeprecationWarning, match="common.movie.particle_movie; the old name will go"):
        old = movie.Movie
    made = old("particles", SCENE, frames)
    assert made == movie.particle_movie("particles", SCENE, frames) and set(made.quantities) == set(movie.QUANTITIES)
    assert old("particles", None, frames) is None  # on ranks other than the first


def test_names_of_columns_are_words_with_units():
    assert name_and_unit("kinetic_energy_J_per_m") == ("Kinetic energy of the particles", "J/m")
    assert name_and_unit("plastic_fraction") == ("Fraction of particles that yield", "-")
    assert name_and_unit("crest_displacement_m") == ("Crest displacement", "m")
    assert name_and_unit("velocity_x_m/s") == ("Velocity x", "m/s")
    assert name_and_unit("yield_acceleration_m_per_s2") == ("Yield acceleration", "m/s\u00b2")
    assert name_and_unit("momentum_x_N.s") == ("Momentum x", "N s") == name_and_unit("momentum_x_Ns")
    assert name_and_unit("force_normal_N") == ("Force normal", "N") and name_and_unit("mass_kg") == ("Mass", "kg")
    assert name_and_unit("wall_moment_N_m_per_m") == ("Wall moment", "N m/m")
    assert name_and_unit("computing_seconds") == ("Computing", "s") and name_and_unit("bearing_factor_Nc")[1] == "-"


def test_the_computing_time_of_a_part_is_not_taken_for_that_of_the_run():
    assert _facts({"factor_of_safety": 1.25, "wall_seconds": 3.0, "steps": 7}) == {"Factor of safety": "1.25"}
    assert name_and_unit("wall_seconds") == ("Computing time without pictures", "s")


@pytest.mark.parametrize(
    ("site", "heading"),
    [
        ("my/pit.toml", ("Site pit", "Study excavation")),
        ("meshes/excavation.toml", ("An excavation in stages", "A pit is dug.")),
    ],
)
def test_the_heading_names_a_site_of_the_user(site, heading):
    usual = [SimpleNamespace(dest="site", default=Path("meshes/excavation.toml"))]
    text = "An excavation in stages: a pit is dug.\n\nMore."
    assert _heading(SimpleNamespace(site=Path(site), actions=usual, study="excavation", description=text)) == heading
