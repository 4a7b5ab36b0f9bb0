"""The studies collapse, safety and footing, on coarse meshes."""

import json

import numpy as np
import pytest
from study_main import ended


def summary_of(name, folder, *options):
    result = ended(name, folder, *options)
    assert result.returncode == 0, result.stderr
    return json.loads((folder / "summary.json").read_text())


def test_slope_converges_from_above_to_limit_analysis(tmp_path):
    summary = summary_of("collapse", tmp_path, "--cell-size", "0.1", "--meshes", "2")
    assert summary["limit_analysis_unit_weight"] == pytest.approx(22.9e3, rel=1e-3)
    coarse, fine = (m["collapse_unit_weight"] for m in summary["meshes"] if m["dilation_angle_degrees"] == 25)
    assert 22.9e3 < fine < coarse and fine == summary["collapse_unit_weight"]
    assert fine == pytest.approx(22.9e3, rel=0.06)
    assert summary["collapse_unit_weight_without_dilation"] < fine
    assert np.all(np.diff(summary["curve_largest_displacement_m"]) > 0)
    for name in ("load_displacement", "convergence", "mechanism", "mechanism_without_dilation"):
        assert (tmp_path / f"{name}.png").stat().st_size > 10_000


@pytest.mark.usefixtures("without_pictures")
@pytest.mark.parametrize("angle", [30, 60, 85, 90])
def test_slopes_of_any_angle(tmp_path, angle):
    """Height 2 m, cohesion 3 kPa: coarse linear triangles come from above too."""
    summary = summary_of("collapse", tmp_path, "--angle", str(angle), "--height", "2", "--crest", "3", "--cohesion", "3e3",
                         "--friction-angle", "20", "--cell-size", "0.4", "--meshes", "1", "--no-without-dilation")  # fmt: skip
    assert summary["dilation_angle_degrees"] == 20
    ratio = summary["collapse_unit_weight"] / summary["limit_analysis_unit_weight"]
    assert 1.0 < ratio < 1.15
    assert summary["stability_number"] == pytest.approx(summary["collapse_unit_weight"] * 2 / 3e3)


def test_factor_of_safety(tmp_path):
    summary = summary_of("safety", tmp_path, "--cell-size", "0.1", "--meshes", "2")
    assert summary["limit_analysis_factor_of_safety"] == pytest.approx(1.053, rel=1e-3)
    coarse, fine = (m["factor_of_safety"] for m in summary["meshes"] if m["dilation_angle_degrees"] == 25)
    assert 1.053 < fine < coarse and fine == summary["factor_of_safety"] == pytest.approx(1.053, rel=0.02)
    assert summary["factor_of_safety_without_dilation"] < fine
    assert (tmp_path / "factor_displacement.png").exists() and (tmp_path / "mechanism.png").exists()


@pytest.mark.usefixtures("without_pictures")
def test_an_earthquake_as_a_force_that_stays(tmp_path):
    """From above, coarse cells to 8 %. With the critical coefficient as the coefficient the factor is 1."""
    slope = ["--cohesion", "2500", "--crest", "2", "--cell-size", "0.2", "--meshes", "1", "--no-without-dilation"]
    summary = summary_of("safety", tmp_path / "a", *slope, "--seismic-coefficient", "0.15", "--critical-seismic")
    assert summary["limit_analysis_factor_of_safety"] == pytest.approx(1.297, rel=1e-3)
    assert summary["limit_analysis_seismic_coefficient"] == pytest.approx(0.348, rel=2e-3)
    assert 1 < summary["factor_of_safety"] / summary["limit_analysis_factor_of_safety"] < 1.06
    critical = summary["critical_seismic_coefficient"]
    assert 1 < critical / summary["limit_analysis_seismic_coefficient"] < 1.08
    again = summary_of("safety", tmp_path / "b", *slope, "--seismic-coefficient", str(critical))
    assert again["factor_of_safety"] == pytest.approx(1.0, abs=5e-3)


@pytest.mark.usefixtures("without_pictures")
def test_a_slope_that_fails_without_inertia_keeps_its_factor(tmp_path):
    weak = ["--cohesion", "700", "--cell-size", "0.2", "--meshes", "1", "--no-without-dilation", "--critical-seismic"]
    summary = summary_of("safety", tmp_path, *weak)
    assert summary["factor_of_safety"] < 1 and summary["critical_seismic_coefficient"] is None


@pytest.mark.usefixtures("without_pictures")
def test_a_critical_coefficient_of_a_mesh_that_is_too_short_says_so(tmp_path):
    """The deep slip lines of clay begin far behind the crest; a short mesh fails at a larger coefficient than limit analysis."""
    clay = ["--friction-angle", "0", "--cohesion", "6e3", "--depth", "1", "--cell-size", "0.25", "--meshes", "1"]
    said = ended("safety", tmp_path, *clay, "--critical-seismic").stdout.splitlines()
    after = said.index("critical seismic coefficient by limit analysis, associated flow: 0.174") + 1
    assert "behind the mesh: --crest is too short to compare" in said[after]


@pytest.mark.parametrize(("friction_angle", "tolerance", "cell_size"), [(0, 0.02, 0.1), (20, 0.05, 0.125)])
def test_bearing_capacity(tmp_path, friction_angle, tolerance, cell_size):
    """Prandtl: 2 + pi; 14.83 for 20 degrees."""
    summary = summary_of(
        "footing", tmp_path, "--friction-angle", str(friction_angle), "--cell-size", str(cell_size), "--meshes", "2"
    )
    expected = {0: 2 + np.pi, 20: 14.83}[friction_angle]
    assert summary["prandtl_bearing_capacity_factor_Nc"] == pytest.approx(expected, rel=1e-3)
    assert expected < summary["bearing_capacity_factor_Nc"] < (1 + tolerance) * expected
    assert summary["collapse_pressure_Pa"] == pytest.approx(1e3 * summary["bearing_capacity_factor_Nc"])
    without = summary["bearing_capacity_factor_Nc_without_dilation"]
    assert 0.8 * expected < without <= summary["bearing_capacity_factor_Nc"]
    assert all((tmp_path / f"{name}.png").exists() for name in ("load_settlement", "convergence", "mechanism"))


@pytest.mark.parametrize(
    ("name", "options", "words"),
    [
        ("collapse", ["--angle", "20"], ["--friction-angle", "25", "--angle", "any unit weight"]),
        ("collapse", ["--angle", "91"], ["--angle", "91", "at most 90"]),
        ("collapse", ["--cohesion", "0"], ["--cohesion", "0"]),
        ("collapse", ["--cell-size", "3"], ["--cell-size", "3", "--height"]),
        (
            "safety",
            ["--unit-weight", "2000e3", "--start", "1", "--cell-size", "0.2", "--meshes", "1"],
            ["start", "only", "of the load is carried", "mechanism"],
        ),
        ("safety", ["--seismic-coefficient", "-0.1"], ["--seismic-coefficient is -0.1, expected at least 0"]),
        ("footing", ["--dilation-angle", "10"], ["--dilation-angle", "10", "--friction-angle"]),
    ],
)
def test_wrong_options_are_named(tmp_path, name, options, words):
    result = ended(name, tmp_path, *options)
    assert result.returncode == 2
    assert all(word in result.stderr for word in words), result.stderr


def test_a_lower_bound_is_never_called_collapse():
    """Where no failure was shown: in the lines, in the summary and by the exit code."""
    from common.collapse_runs import UNDECIDED, CollapseRuns, Target

    import fenics_bridge as bridge

    def run(failed):
        return bridge.Collapse(
            1.3, 1.35, failed, "the solver's reason", 0.99, 1e-6, 0.0, np.array([[1.0, 0.1], [1.3, 0.2]]), None, []
        )

    target = Target("factor", "failed_at_factor", "limit", 1.38, title="{:.3f}", line="{:.3f}", label="Factor [-]")
    shown = CollapseRuns(target, 20.0, [1.0], {20.0: [run(True)]})
    not_shown = CollapseRuns(target, 20.0, [1.0], {20.0: [run(True)], 0.0: [run(False)]})
    assert shown.exit_code() == 0 and "AT LEAST" not in shown.lines() and shown.summary()["failure_shown"]
    assert not_shown.exit_code() == UNDECIDED == 3 and not not_shown.summary()["failure_shown"]
    assert "AT LEAST 1.300" in not_shown.lines() and "the solver's reason" in not_shown.lines()
    assert not_shown.rows()[1]["carried_fraction_of_mechanism"] is None
