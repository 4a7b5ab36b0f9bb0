"""The study verification: each case at its small size, what a failure does, and the page in docs/."""

import html
import importlib.util
import json
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from study_main import ended

ROOT = Path(__file__).parents[3]
FOLDER = ROOT / "studies" / "verification"
CASES = sorted(path.stem for path in FOLDER.glob("[!_]*.py"))
sys.path.insert(0, str(FOLDER))

from _case import Check, Kind, Result  # noqa: E402
from _slip_surfaces import sliding_blocks  # noqa: E402
from _static_bound import SIDES, static_bound  # noqa: E402
from _table import case_row, docs_page, percent, read_table  # noqa: E402
from mpi4py import MPI  # noqa: E402

import fenics_bridge as bridge  # noqa: E402


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """Folder and exit code of all cases at their small sizes."""
    folder = tmp_path_factory.mktemp("verification")
    command = [sys.executable, str(FOLDER / "__main__.py"), "--quick", "--output", str(folder)]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=1500)
    assert (folder / "verification.json").exists(), ran.stderr
    return folder, ran


@pytest.mark.parametrize("name", CASES)
def test_case_passes_at_its_small_size(results, name):
    cases = {case.name: case for case in read_table(results[0] / "verification.json").cases}
    case = cases[name]
    failed = [(check.quantity, check.expected, check.computed) for check in case.checks if check.verdict == "FAIL"]
    assert case.error == "" and case.checks and failed == []
    for figure in case.figures:
        assert (results[0] / name / figure).stat().st_size > 10_000


def test_page_and_exit_code(results):
    folder, ran = results
    assert ran.returncode == 0, ran.stdout + ran.stderr
    page = html.unescape((folder / "report.html").read_text())
    assert all(case.title in page for case in read_table(folder / "verification.json").cases)


def test_the_page_in_docs_is_made_from_its_table():
    docs = ROOT / "docs"
    table = read_table(docs / "verification.json")
    assert {case.name for case in table.cases} == set(CASES) and not table.quick
    assert (docs / "verification.md").read_text("utf-8") == docs_page(table)
    for case in table.cases:
        assert all((docs / "images" / "verification" / f"{case.name}_{name}").exists() for name in case.figures)


def check(computed, **options):
    return Check("a number", 10.0, "by hand", computed, 0.1, **options)


@pytest.mark.parametrize(
    ("computed", "options", "error"),
    [
        (9.0, {}, 0.1),
        (12.0, {"kind": Kind.AT_LEAST}, 0.0),
        (8.0, {"kind": Kind.AT_LEAST}, 0.2),
        (12.0, {"kind": Kind.AT_MOST}, 0.2),
        (12.0, {"scale": 4.0, "over": "the load"}, 0.5),
    ],
)
def test_error_of_a_check(computed, options, error):
    found = check(computed, **options)
    assert found.error == pytest.approx(error)
    assert found.passed == (error <= 0.1)


def test_the_source_names_the_scale_of_the_error():
    """The scale is named where there is one, and only there."""
    for wrong in ({"scale": 4.0}, {"over": "the load"}):
        with pytest.raises(ValueError, match="expected the name of the scale"):
            check(12.0, **wrong)
    row = case_row("case", "group", "Title.", Result([check(12.0, scale=4.0, over="the load")]), "", 0.0).checks[0]
    assert row.source == "by hand; error over the load"


def test_nothing_computed_is_no_pass():
    assert not any(check(float("nan"), kind=kind).passed for kind in Kind)


def test_a_failure_does_not_stop_the_others_and_shows_in_the_exit_code(tmp_path, monkeypatch, capsys):
    spec = importlib.util.spec_from_file_location("verification_main", FOLDER / "__main__.py")
    study = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(study)

    def broken(quick, folder):
        raise ValueError("out of order")

    outcomes = {
        "broken": broken,
        "wrong": lambda quick, folder: Result([check(20.0)]),
        "limited": lambda quick, folder: Result([check(20.0, limit="nobody reaches it")]),
        "right": lambda quick, folder: Result([check(10.5)]),
    }
    monkeypatch.setattr(study, "GROUPS", {"Trials": tuple(outcomes)})
    monkeypatch.setattr(study, "CASES", tuple(outcomes))
    for name, run in outcomes.items():
        monkeypatch.setitem(sys.modules, name, SimpleNamespace(run=run, __doc__=f"The {name} case."))

    def exit_code(*names):
        return study.main(["--output", str(tmp_path), "--overwrite", "--cases", ",".join(names)])

    assert exit_code(*outcomes) == 1
    table = json.loads((tmp_path / "verification.json").read_text())
    assert [case["error"] for case in table["cases"]] == ["ValueError: out of order", "", "", ""]
    assert "1 pass, 1 fail, 1 known limits; errors in broken" in capsys.readouterr().out
    assert "Known limit: nobody reaches it" in docs_page(read_table(tmp_path / "verification.json"))
    assert [exit_code(name) for name in outcomes] == [1, 1, 0, 0]


def test_methods_stand_side_by_side():
    def found(computed, method, quantity="load"):
        return Check(quantity, 10.0, "theory", computed, 0.01, "kN", method=method)

    checks = [
        found(10.05, "elements"),
        found(11.0, "particles"),
        found(10.0, "elements", "moment"),
        found(10.0, "", "sum"),
    ]
    columns, rows, wrong = case_row("case", "group", "Title.", Result(checks), "", 0.0).rows()
    assert columns[2:5] == ("elements", "particles", "Computed")
    assert [row[:5] for row in rows] == [
        ["load", "10 kN", "10.05 kN (0.5 %)", "11 kN (10 %)", ""],
        ["moment", "10 kN", "10 kN (0 %)", "", ""],
        ["sum", "10 kN", "", "", "10 kN (0 %)"],
    ]
    assert [row[6] for row in rows] == ["FAIL", "pass", "pass"] and wrong == [0]


def test_wrong_case_is_named(tmp_path):
    ran = ended("verification", tmp_path, "--cases", "colum")
    assert ran.returncode == 2 and "--cases names 'colum'" in ran.stderr and "did you mean column?" in ran.stderr


def test_blocks_on_a_plane_are_one_wedge():
    """A vertical cut on a plane at 45 degrees: 4 c / (gamma H), whatever cuts the wedge in three; no way down, no factor."""
    surface = np.array([(0.0, 1.0), (3.0 - 1e-9, 1.0), (3.0, 0.0), (5.0, 0.0)])
    plane = np.array([(2.0, 1.0), (2.4, 0.6), (2.7, 0.3), (3.0, 0.0)])
    even = lambda x, y: np.full(len(x), 5e3)  # noqa: E731
    assert sliding_blocks(plane, (2.5, 2.8), surface, even, 20e3) == pytest.approx(4 * 5 / 20, rel=1e-6)
    assert sliding_blocks(plane[::-1], (2.8, 2.5), surface, even, 20e3) == np.inf


@pytest.mark.parametrize(("width", "lowest", "highest"), [(0.5, 2.0, 2 * 2.0), (2.0, 2 * 2**0.5, 3.786)])
def test_stresses_in_equilibrium_are_a_lower_bound(width, lowest, highest):
    """A cut 1 m high. By hand: uniaxial stress carries 2 c / gamma, Heyman's stresses 2.83 of a wide one; a wedge at 45° needs
    4 c / gamma at most, and 3.786 is the best mechanism known for a wide one."""
    domain, cells, facets = bridge.box_mesh(MPI.COMM_WORLD, (width, 1.0), (round(6 * width), 6))
    sides = bridge.name_tags(facets, {"left": 1, "right": 2, "base": 3, "top": 4})
    mesh = domain, bridge.name_tags(cells, {"clay": 1}), sides
    factor = static_bound(mesh, {"clay": 30e3}, 10e3, ["right", "top"], ["left"])
    assert lowest * np.cos(np.pi / SIDES) - 1e-6 <= factor / 3 <= highest
    half = static_bound(mesh, {"clay": 15e3}, 10e3, ["right", "top"], ["left"])
    assert half == pytest.approx(factor / 2, rel=1e-6)


def test_percentages_keep_two_digits():
    assert [percent(x) for x in (0.0123, 0.5, 1e-5)] == ["1.2 %", "50 %", "0.001 %"]
