"""The slope by the implicit and the quasi-static scheme, and both schemes side by side."""

import json

import pytest
from study_main import ended


def study(name, folder, *options):
    result = ended(name, folder, *options)
    summary = folder / "summary.json"
    return result, json.loads(summary.read_text()) if summary.exists() else None


@pytest.mark.usefixtures("without_pictures")
@pytest.mark.parametrize("solver", ["newton", "relaxation"])
def test_implicit_slope_takes_twenty_critical_steps_at_once(tmp_path, solver):
    result, summary = study("slope", tmp_path, "--scheme", "implicit", "--solver", solver, "--particles-per-cell", "3",
                            "--time", "1.5", "--frames", "3")  # fmt: skip
    assert result.returncode == 0, result.stderr
    # Triangles of squares of 0.1 m are h = 0.05 m high, c_d = sqrt(E_oed / rho) = sqrt(296 kPa / 8155 kg/m3) = 6.0 m/s: a
    # critical step of about 8e-3 s and at least 4 steps of 20 of them in each interval of 0.5 s, more where one is cut.
    assert summary["scheme"] == "implicit" and 12 <= summary["steps"] <= 20
    assert 0.05 < summary["crest_displacement_m"] < 0.6


@pytest.mark.usefixtures("without_pictures")
def test_quasi_static_slope_carries_what_it_can(tmp_path):
    carried, summary = study("slope", tmp_path / "a", "--scheme", "quasi-static", "--unit-weight", "15e3", "--time", "1",
                             "--dt", "0.25", "--frames", "4")  # fmt: skip
    assert carried.returncode == 0, carried.stderr
    assert summary["time_s"] == 1.0 and summary["steps"] == 4 and summary["unexplained_fraction_of_energy"] is None
    bad, _ = study("slope", tmp_path / "b", "--scheme", "quasi-static", "--initial", "fem")
    assert bad.returncode == 2 and "--initial is fem" in bad.stderr and "zero" in bad.stderr


def test_both_schemes_side_by_side(tmp_path):
    result, summary = study("slope_schemes", tmp_path, "--time", "1",
                            "--longer-steps", "1", "--frames", "5")  # fmt: skip
    assert result.returncode == 0, result.stderr
    assert {path.name for path in tmp_path.glob("*.png")} == {
        "displacement.png", "shear_strain.png", "vertical_stress.png", "crest.png"
    }  # fmt: skip
    newton, relaxation = (
        next(row for name, row in summary["runs"].items() if f"{solver}, 20 " in name + " ")
        for solver in ("Newton", "relaxation")
    )
    # One residual and, as neither solver had to cut a step, the same steps: the solver does not change where the slope goes.
    assert relaxation["steps"] == newton["steps"]
    assert relaxation["crest_displacement_m"] == pytest.approx(newton["crest_displacement_m"], rel=1e-5)
