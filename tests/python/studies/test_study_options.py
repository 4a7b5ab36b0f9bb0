"""Options of studies that do not fit together, or that have no effect, end a run at once with the option, its value and what was
expected."""

import importlib
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import mpm_core as mpm

STUDIES = Path(__file__).parents[3] / "studies"

from talus.begin import begin

REFUSED = [
    # bodies of whole cells
    ("barrier", "--cell-size 0.3", "--cell-size is 0.3, expected 1 over a whole number, such as 0.125"),
    ("wall", "--cell-size 0.15", "--cell-size is 0.15, expected 1 over a whole number, such as 0.125"),
    ("wall", "--cell-size -1", "--cell-size is '-1', expected a ratio above 0 and at most 0.25"),
    ("earthquake", "--cell-size 0.7", "--cell-size is 0.7 m, expected --height, 10 m, over a whole number"),
    # more cells than a machine can take
    ("slope", "--height 1e9 --cell-size 1", "--cell-size 1, --height 1e+09, --angle 45, --crest 1.1e+09: the mesh would"),
    ("cone", "--radius 5 --cell-size 1e-3 --penetration 1e-4", "the mesh would have some 1.2e+08 cells, expected at most"),
    ("footing_push", "--cell-size 1e-5", "the mesh would have some"),
    ("footing", "--cell-size 1e-5", "the mesh would have some"),
    ("liquefaction", "--cell-size 1e-3", "the mesh would have some"),
    ("coupled_slope", "--cell-size 1e-3", "the mesh would have some"),
    ("earthquake", "--cell-size 1e-3", "the mesh would have some"),
    ("barrier", "--cell-size 1e-3", "the mesh would have some"),
    ("wall", "--cell-size 1e-4", "the mesh would have some"),
    # the motion of an earthquake
    ("earthquake", "--highest-frequency 0.1",
     "--highest-frequency is 0.1 Hz, expected above the lowest frequency of the noise (half of --frequency, 1 Hz)"),
    ("earthquake", "--highest-frequency 26", "--highest-frequency is 26 Hz, expected at most 25 Hz: steps of 0.02 s have"),
    ("earthquake", "--motion ricker --frequency 13", "expected at most 12.5 Hz: steps of 0.02 s have spectra up to 25 Hz, and a"),
    ("earthquake", "--motion ricker --duration 1.4", "--duration is 1.4 s, expected at least 1.5 s, three periods of --fr"),
    ("earthquake", "--highest-frequency 1.001 --duration 1", "has no frequency from 1 to 1.001 Hz"),
    ("earthquake", "--accelerogram no.txt", "--accelerogram is no.txt, but there is no such file"),
    # options without effect
    ("slope", "--paper --viscosity 1000", "--viscosity is given, expected --material viscoplastic with it"),
    ("slope", "--material mohr-coulomb --viscosity 10", "--viscosity is given, expected --material viscoplastic with it"),
    ("slope", "--material tresca --friction-angle 20", "--friction-angle is given, expected --material mohr-coulomb or"),
    ("retrogression", "--compression-slope 0.2", "--compression-slope is given, expected --material cam-clay with it"),
    ("slope", "--umat law.so --material tresca", "--material is given, expected no --umat with it"),
    ("element_test", "--material cam-clay --creep 0.01", "--creep is 0.01, expected --rate with it: without one, the test has no"),
    ("element_test", "--material cam-clay --creep 0.01 --test cyclic-shear", "--creep is 0.01, expected 0 for cycles, which have no"),
    ("element_test", "--material cam-clay --reference-time 3600", "--reference-time is given, expected --creep with it"),
    ("slope", "--material hardening-soil --threshold-strain 1e-4", "--threshold-strain is given, expected --small-strain-modulus"),
    ("element_test", "--properties 1", "--properties is given, expected --umat with it"),
    ("slope", "--solver relaxation", "--solver is given, expected --scheme implicit or quasi-static with it"),
    ("slope", "--initial zero --initial-unit-weight 1e4", "--initial-unit-weight is given, expected --initial fem"),
    ("slope", "--site site.toml --angle 30", "--angle is given, expected no --site with it"),
    ("slope", "--factor 2", "--factor is given, expected --site with it"),
    ("safety", "--site site.toml --cohesion 2e3", "--cohesion is given, expected no --site with it"),
    ("collapse", "--site site.toml --height 2", "--height is given, expected no --site with it"),
    ("wall", "--motion active --support 0.2", "--support is given, expected --motion free with it"),
    ("wall", "--motion free --speed 0.2", "--speed is given, expected --motion active or passive with it"),
    ("earthquake", "--unit g", "--unit is given, expected --accelerogram with it"),
    ("earthquake", "--motion ricker --seed 2", "--seed is given, expected --motion noise with it"),
    # words that are nearly right
    ("slope", "--material mohrcoulomb", "; did you mean mohr-coulomb?"),
    ("handover", "--fractions 2", "unrecognized arguments: --fractions 2\n"),
    ("wall", "--ranks 2", "unrecognized arguments: --ranks 2; it comes before the study: studies/run --ranks N "),
    # the mesh of a slope, its particles, and files
    ("slope", "--angle 60 --mesh crossed", "--mesh is crossed, expected fitted or gmsh for --angle 60"),
    ("slope", "--cell-size 0.3", "--mesh is crossed, expected fitted or gmsh for --angle 45, --height 1, --crest 1.1 and"),
    ("handover", "--mesh crossed --cell-size 0.25", "--mesh is crossed, expected fitted or gmsh for --angle 45"),
    ("collapse", "--angle 5 --friction-angle 1 --mesh fitted", "--mesh is fitted, expected gmsh for --angle 5"),
    ("slope", "--cell-size 3", "--cell-size is 3 m, expected at most --height, 1 m, and --crest, 1.1 m"),
    ("slope", "--particles-per-cell 7", "--particles-per-cell is '7', expected one of 1, 3, 4, 6, 8, 10, 12, 15, 16,"),
    ("runout", "--terrain no.asc --rupture no.tif --height 30", "--height is given, expected no --terrain with it"),
    ("runout", "--crs local", "--crs is given, expected --terrain and --rupture with it"),
    # a slope that does not fail
    ("retrogression", "--disturbed 0.2 --cell-size 1", "--disturbed is 0.2 m, expected at least --cell-size, 1 m"),
    ("retrogression", "--material tresca", "--material is tresca, expected --material softening or a law with the state"),
    ("retrogression", "--disturbed-loss 90", "--disturbed-loss is '90', expected a number above 0 and at most 1"),
    ("coupled_slope", "--width 4 --angle 12", "--width is 4 with --angle 12, which leaves no level ground beside the slope"),
    ("coupled_slope", "--angle 80", "--angle is 80, expected 11.4 to 78.6, or 90, degrees"),
    ("cost", "--initial-unit-weight 25e3", "--initial-unit-weight is 25000 N/m3, expected below --unit-weight, 20000 N/m3"),
    ("cost", "--tolerance 1", "--tolerance is '1', expected a number above 0 and below 1"),
    ("coupled_slope", "--unit-weight 20", "--unit-weight is 20 N/m3, expected above --initial-unit-weight, 15000 N/m3"),
    ("runout", "--terrain no.asc --rupture no.tif", "--terrain is no.asc, but there is no such file"),
]  # fmt: skip


@pytest.mark.parametrize("study, options, message", REFUSED)
def test_options_that_do_not_fit_are_refused_at_once(tmp_path, capsys, study, options, message):
    with pytest.raises(SystemExit) as ended:
        importlib.import_module(study).main([*options.split(), "--output", str(tmp_path / "results")])
    assert ended.value.code == 2 and not (tmp_path / "results").exists()
    assert message in capsys.readouterr().err


@pytest.mark.parametrize("study, options, message", [
    ("slope", "--umat no.so", "--umat is 'no.so', but the file does not exist"),
    ("slope", "--python-law no.py:Law", "--python-law is 'no.py:Law', but the file no.py does not exist"),
    ("consolidation", "--pressures foo=1", "--pressures names 'foo', expected some of axis, base, far, surface, footing"),
    ("earthquake", "--accelerogram {empty}", "is empty"),
    ("earthquake", "--accelerogram {text}", "expected lines of a time and an acceleration, divided by blanks or a comma, and #"),
])  # fmt: skip
def test_files_and_names_that_do_not_fit_are_named(tmp_path, study, options, message):
    files = {"empty": "# nothing but this\n", "text": "hello world\n"}
    paths = {name: tmp_path / f"{name}.txt" for name in files}
    for name, content in files.items():
        paths[name].write_text(content)
    with pytest.raises(mpm.InputError) as refused:
        importlib.import_module(study).main([*options.format(**paths).split(), "--output", str(tmp_path / "results")])
    assert message in str(refused.value)


def test_options_of_a_file_may_be_without_effect(tmp_path):
    path = tmp_path / "parameters.toml"  # as the results of an earlier run have it, with all options
    path.write_text("material = 'mohr-coulomb'\nviscosity = 1000\nsolver = 'newton'\nsoftening-strain = 0.3\n")
    assert importlib.import_module("slope").parse(["--parameters", str(path)]).viscosity == 1000


def test_a_slope_takes_the_simplest_mesh_that_suits_its_angle():
    parse = importlib.import_module("slope").parse
    given = {"": "crossed", "--angle 30": "fitted", "--angle 5": "gmsh"}
    assert {options: parse(options.split()).mesh for options in given} == given


def test_numbers_of_particles_are_those_that_fill_a_triangle_or_a_tetrahedron():
    from common.schemes import PER_CELL

    def fills(dim, number):
        mesh = mpm.Mesh(np.vstack([np.zeros(dim), np.eye(dim)]), [list(range(dim + 1))])
        try:
            return mpm.Model(mesh, mpm.LinearElastic(young=1.0, poisson=0.0)).seed(density=1.0, per_cell=number) > 0
        except mpm.InputError:
            return False

    assert PER_CELL == tuple(number for number in range(1, 101) if fills(2, number) or fills(3, number))


def test_studies_with_nearly_the_right_name_are_named():
    refused = subprocess.run([str(STUDIES / "run"), "slpoe"], capture_output=True, text=True)
    assert refused.returncode == 2 and "there is no study 'slpoe'; did you mean slope? there are:\n" in refused.stderr


def test_both_lists_of_studies_are_alike():
    lists = [[str(STUDIES / "run"), "--list"], [sys.executable, "-m", "talus", "list"]]
    by_shell, by_python = (subprocess.run(words, capture_output=True, text=True).stdout for words in lists)
    assert by_shell == by_python != ""


def test_a_new_study_is_not_named_by_a_keyword(tmp_path):
    with pytest.raises(ValueError, match="the name is 'class'"):
        begin("class", tmp_path)


def test_results_do_not_go_to_a_file(tmp_path):
    path = tmp_path / "results"
    path.write_text("mine")
    with pytest.raises(importlib.import_module("common.files").OutputError, match="it is a file, not a folder"):
        importlib.import_module("slope").main(["--output", str(path)])


def test_warnings_are_shown_once_and_without_their_place(tmp_path):
    script = tmp_path / "warns.py"
    script.write_text(
        "import warnings\nfrom common.ranks import run_study\n"
        "run_study(lambda: [warnings.warn('soft', stacklevel=level) for level in (1, 2, 3)] and 0)\n"
    )
    done = subprocess.run(
        [sys.executable, str(script)],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": f"{os.environ.get('PYTHONPATH', '')}:{STUDIES}"},
    )
    assert done.stderr == "warning: soft\n"


def test_a_warning_is_shown_once():
    """Also the beginning of one that was shown, as particles warn of what elements did, with other words at the end."""
    shown = []
    show = importlib.import_module("common.ranks").shown_once(lambda text, *rest: shown.append((str(text), *rest)))
    for text in (
        "it locks; elements do",
        "it locks",
        RuntimeWarning("it locks; elements do"),
        "elements do",
        "it locks here",
    ):
        show(text, RuntimeWarning, "file.py", 1)
    assert [text for text, *_ in shown] == ["it locks; elements do", "elements do", "it locks here"]
    assert shown[0][1:] == (RuntimeWarning, "file.py", 1)


@pytest.mark.parametrize("study, option", [("balance", "rebalance"), ("liquefaction", "runout-length")])
def test_an_option_has_the_name_that_it_has_in_the_study_slope(study, option):
    options = {p.name: p for p in importlib.import_module(study).parser().parse_args([]).parameters()}
    slope = {p.name: p for p in importlib.import_module("slope").parse([]).parameters()}
    assert options[option].unit == slope[option].unit
    assert slope[option].meaning.startswith(options[option].meaning)
