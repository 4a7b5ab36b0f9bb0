"""The study slope starts from elasto-plastic equilibrium."""

import json

import pytest
from study_main import ended


def slope(folder, *options):
    return ended("slope", folder, "--time", "0.05", "--frames", "1", "--no-pictures", *options)


@pytest.mark.parametrize("options", [[], ["--nmd", "--mesh", "gmsh"], ["--angle", "60"]])
def test_particles_are_in_equilibrium_at_once_and_none_yields_anew(tmp_path, options):
    """Finite elements and particles share the cells, so what balances the one balances the other."""
    result = slope(tmp_path, *options, "--initial-unit-weight", "10e3")
    assert result.returncode == 0, result.stderr
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["initial_out_of_balance_ratio"] < 1e-8
    assert summary["equilibrated_out_of_balance_ratio"] < 1e-8
    assert summary["newly_yielded_fraction"] == 0 and summary["returned_to_strength_fraction"] == 0


def test_initial_unit_weight_beyond_collapse_is_named_with_what_the_slope_carries(tmp_path):
    result = slope(tmp_path, "--initial-unit-weight", "40e3")
    assert result.returncode == 2
    assert "--initial-unit-weight is 40000 N/m3" in result.stderr and "does not carry" in result.stderr
    # Linear triangles of 0.1 m are some 20 % too stiff at collapse, which is near 20 kN/m3 without dilation.
    assert 20e3 < float(result.stderr.split("above ")[1].split()[0]) < 26e3


def test_a_friction_angle_in_radians_is_named_where_the_slope_does_not_carry_its_weight(tmp_path):
    result = slope(tmp_path, "--friction-angle", "0.43")
    assert result.returncode == 2 and "0.43 rad are 24.6 degrees" in result.stderr


def test_an_inclination_in_radians_is_warned_of(tmp_path):
    result = slope(tmp_path, "--angle", "0.78", "--time", "0.001")
    assert result.returncode == 0 and "warning: --angle is 0.78 degrees; " in result.stderr
    assert "0.78 rad are 44.7 degrees" in result.stderr


def test_elastic_start_is_in_equilibrium_too(tmp_path):
    assert slope(tmp_path, "--initial", "elastic").returncode == 0
    assert json.loads((tmp_path / "summary.json").read_text())["initial_out_of_balance_ratio"] < 1e-8
