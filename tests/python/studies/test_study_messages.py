"""What studies print: warnings that they leave out, and lines of results."""

import importlib
import re
import warnings
from argparse import Namespace
from pathlib import Path

import pytest
from mpi4py import MPI
from study_main import ended

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import terrain
from fenics_bridge.fem import failure
from fenics_bridge.fem.locking import warn_of_locking_at_failure
from mpm_core import failure_watch

STUDIES = Path(__file__).parents[3] / "studies"

from common import quiet
from common.option_words import in_options
from common.water import seepage_plots


def test_warnings_that_a_study_leaves_out_are_those_of_the_core():
    assert re.match(quiet.GATHERS, failure_watch.GATHERING) and re.match(quiet.LOCKS, failure_watch.LOCKING)
    assert not re.match(quiet.LOCKS, failure_watch.GATHERING)

    @quiet.without_warning(quiet.LOCKS)
    def warned(text):
        warnings.warn(text, RuntimeWarning, stacklevel=2)

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warned(failure_watch.LOCKING)
        with pytest.raises(RuntimeWarning, match="particles gather"):
            warned(failure_watch.GATHERING)


def test_round_off_of_an_inflow_is_nothing():
    inflows = {"upstream": 0.5, "downstream": -0.5, "crest": 1.9e-20}
    discharge = importlib.import_module("common.water.discharge")
    shown = discharge.in_words(inflows, discharge.PLANE)
    assert [text.split()[0] for text in shown.values()] == ["500", "-500", "0"]
    assert all(text.endswith("litres per metre and day") for text in shown.values())
    assert discharge.in_words({"crest": 0.0}, discharge.RING) == {"crest": "0 m3/day all around the axis"}


@pytest.mark.parametrize("number, shown", [(1, [0]), (3, [0, 1, 2]), (7, [0, 2, 4, 6])])
def test_few_pictures_are_drawn_of_many(number, shown):
    assert seepage_plots.few(list(range(number))) == shown


def test_initial_stresses_are_described_in_a_line():
    line = importlib.import_module("slope").start_line
    ratios = {"initial_out_of_balance_ratio": 0.25, "equilibrated_out_of_balance_ratio": 1e-9,
              "newly_yielded_fraction": 0.02, "returned_to_strength_fraction": 0.0}  # fmt: skip
    assert (
        line(Namespace(initial="zero", initial_unit_weight=18e3), ratios)
        == "initial stresses (zero): out-of-balance ratio 0.25"
    )
    assert line(Namespace(initial="fem", initial_unit_weight=18e3), ratios) == (
        "initial stresses (fem, 18000 N/m3): out-of-balance ratio before equilibration 0.25, after 1e-09; newly yielded 2 %; "
        "returned to the yield surface 0 %"
    )


@pytest.mark.parametrize(
    "options, settlement, said",
    [
        # read from 12 to 24 times width s_u / E: 0.06 m to 0.12 m
        ("", 0.02, "not reached: it is read at settlements of 0.06 to 0.12 m"),
        ("--frames 2", 0.3, "not known: none of --frames 2 is at a settlement of 0.06 to 0.12 m"),
    ],
)
def test_a_bearing_capacity_factor_that_is_not_known_says_why(options, settlement, said):
    study = importlib.import_module("footing_push")
    a = study.parse(options.split())
    assert study.factor_said(a, None, settlement) == said and study.factor_said(a, 5.3, settlement).startswith(
        "5.30 at settlements of "
    )


@pytest.mark.parametrize("rigidity, percent", [(200, "12"), (700, "3.4"), (800, None), (2000, None)])
def test_a_bearing_capacity_factor_of_an_embedded_footing_is_said_to_be_one(rigidity, percent):
    """It is read up to a settlement of 24 / rigidity of the width, of which 3 % are too much."""
    study = importlib.import_module("footing_push")
    said = study.embedded(study.parse(["--rigidity", str(rigidity)]))
    assert (
        (f"embedded by up to {percent} % of its width" in said and "--rigidity 800" in said) if percent else said == ""
    )


@pytest.mark.parametrize("study, options, said", [
    ("wall", "--wall-friction-angle 0.35", "--wall-friction-angle is 0.35 degrees; angles are in degrees, and 0.35 rad are 20.1"),
    ("wall", "--young 10e3", "the sand: young is 10000 Pa, which hardly any soil has"),
    ("wall", "--wall-friction-angle 20", ""),
    ("footing", "--cohesion 20", "the ground: cohesion is 20 Pa"),
    ("footing", "--young 20e3", "the ground: young is 20000 Pa"),
    ("footing", "", ""),
    ("footing_push", "--strength 20", "the clay: shear_strength is 20 Pa"),
    ("footing_push", "", ""),
    ("cone", "--strength 20", "the soil: shear_strength is 20 Pa"),
    ("cone", "", ""),
    ("liquefaction", "--young 10e3", "the sand: young is 10000 Pa"),
    ("liquefaction", "", ""),
])  # fmt: skip
def test_values_that_are_probably_in_other_units_are_a_warning(study, options, said, recwarn):
    importlib.import_module(study).parse(options.split())
    text = " ".join(str(one.message) for one in recwarn)
    assert said in text if said else "hardly any soil" not in text and "angles are in degrees" not in text


def test_help_shows_one_default_of_an_option():
    text = " ".join(importlib.import_module("retrogression").parser().format_help().split())
    assert "length of the level crest [m] (default: 30)" in text and "1.1 times the height" not in text


def warned_of_elements():
    """The warning of elements of degree 1 that lock as soil fails."""
    domain, _, facet_tags = bridge.box_mesh(MPI.COMM_SELF, (1.0, 1.0), (1, 1))
    law = mpm.MohrCoulomb(young=1e6, poisson=0.3, cohesion=1e3, friction_angle=30.0, dilation_angle=0.0)
    model = bridge.QuasiStatic(domain, law, facet_tags, [bridge.fixed(3)], degree=1)
    with pytest.warns(RuntimeWarning) as warned:
        warn_of_locking_at_failure(model)
    return str(warned[0].message)


def warned_of_revolution(degree=2, dilation_angle=0.0):
    """The warnings of elements of a body of revolution before it fails."""
    domain, _, facet_tags = bridge.box_mesh(MPI.COMM_SELF, (1.0, 1.0), (1, 1))
    law = mpm.MohrCoulomb(young=1e6, poisson=0.3, cohesion=1e3, friction_angle=30.0, dilation_angle=dilation_angle)
    supports = [bridge.fixed(3), bridge.roller(1, (1, 0))]
    geometry = mpm.Geometry.AXISYMMETRIC
    model = bridge.QuasiStatic(domain, law, facet_tags, supports, degree=degree, geometry=geometry)
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        warn_of_locking_at_failure(model)
    return " ".join(str(one.message) for one in warned)


@pytest.mark.parametrize("degree, dilation_angle, warns", [(2, 0.0, True), (2, 30.0, False), (4, 0.0, False)])
def test_quadratic_elements_of_a_body_of_revolution_are_a_warning_where_the_soil_keeps_its_volume(
    degree, dilation_angle, warns
):
    """A circular footing on clay carries 6.00 s_u on quadratic elements and 5.76 on those of degree 4, rather than 5.69 (docs/fem.md)."""
    text = warned_of_revolution(degree=degree, dilation_angle=dilation_angle)
    assert ("quadratic elements of a body of revolution are up to a tenth too strong" in text) == warns


@pytest.mark.parametrize(
    "study, message, said, not_said",
    [
        ("safety", warned_of_elements, "take --elements P1-averaged, or --elements P2", "nmd=|degree="),
        ("slope", lambda: failure_watch.LOCKING, "Use --nmd, .* with --integration mixed", "nmd=|=MIXED"),
        ("slope", lambda: failure_watch.GATHERING, "with --nmd and --integration particles", "nmd=|=MIXED"),
        ("drawdown", warned_of_elements, "take --elements P2", "nmd=|degree="),
        ("safety", warned_of_revolution, "take --elements P4, or compare", "nmd=|degree="),
    ],
)
def test_warnings_of_the_library_name_the_options_of_a_study(study, message, said, not_said):
    text = in_options(message(), importlib.import_module(study).parser())
    assert re.search(said, text) and not re.search(not_said, text)


def test_errors_of_the_library_name_the_options_of_a_study():
    parser = importlib.import_module("safety").parser()
    assert in_options(failure.advice("no equilibrium", [], None, False), parser).endswith(
        "gave up: try smaller steps, --equilibrium practice, or more dilation"
    )
    assert "a smaller --start" in in_options("2.1 %, or take a smaller start", parser)


def test_a_raster_without_coordinate_reference_names_the_option(tmp_path):
    path = tmp_path / "ground.asc"
    path.write_text("ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 1\n1 1\n")
    with pytest.raises(mpm.InputError, match="is unknown") as error:
        terrain.read_raster(path)
    text = in_options(str(error.value), importlib.import_module("runout").parser())
    assert "name it by --crs EPSG:25832 for instance, or --crs local" in text and "crs=" not in text


def test_a_script_without_options_says_what_the_library_says():
    assert in_options(failure_watch.LOCKING, None) == failure_watch.LOCKING


@pytest.mark.parametrize("study, words, doubt", [
    ("safety", "--cohesion 12", "the slope: cohesion is 12 Pa, which hardly any soil has"),
    ("collapse", "--young 20e3", "the slope: young is 20000 Pa, which hardly any soil has"),
    ("slope", "--cohesion 1", "the slope: cohesion is 1 Pa, which hardly any soil has"),
    ("levee", "--young 40", "the soil: young is 40 Pa, which hardly any soil has"),
    ("earthquake", "--cohesion 25", "the soil: cohesion is 25 Pa, which hardly any soil has"),
    ("runout", "--young 5e3", "the slide: young is 5000 Pa, which hardly any soil has"),
    ("safety", "--seismic-coefficient 15", "--seismic-coefficient is 15, more than the weight: it is the horizontal acceleration"),
])  # fmt: skip
def test_options_of_soils_that_are_in_other_units_are_doubted_as_those_of_sites_are(study, words, doubt):
    module = importlib.import_module(study)
    with pytest.warns(RuntimeWarning, match=doubt):
        module.parse(words.split())
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        module.parse([])


def test_a_bank_of_clay_whose_strength_is_in_kpa_is_doubted_before_it_is_refused(tmp_path):
    result = ended("retrogression", tmp_path / "there", *"--cohesion 15 --cell-size 3 --crest 6 --no-pictures".split())
    assert (
        result.returncode == 2 and "the slope: cohesion is 15 Pa, which hardly any soil has" in result.stderr
    ), result.stderr
