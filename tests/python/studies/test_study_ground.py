"""Slopes on ground of the same soil, in the studies that look for collapse."""

import collapse
import pytest
import safety
from common.slope.fem import outside_line

import fenics_bridge as bridge

FLAT_CLAY = ["--angle", "30", "--friction-angle", "0", "--cohesion", "1000", "--height", "1", "--crest", "2",
             "--cell-size", "0.2", "--meshes", "1"]  # fmt: skip


def stability_factor(depth):
    options = collapse.parse([*FLAT_CLAY, "--depth", str(depth)])
    return collapse.collapse(options, options.cell_size, 0.0).value * options.height / options.cohesion


def test_a_flat_slope_of_clay_fails_deep_below_its_toe():
    # Taylor (1937): without friction and on deep ground, slopes flatter than 53 degrees fail at gamma H / c = 5.52, at more where
    # the ground is shallow. Finite elements come from above, by some per cent on these cells; bisection takes 0.2 %.
    shallow, deep = stability_factor(0.5), stability_factor(1.5)
    assert 0.998 * 5.52 < deep < 1.03 * 5.52
    assert shallow > 1.05 * deep


def test_factor_of_safety_with_ground_is_that_of_the_best_circle():
    options = safety.parse([*FLAT_CLAY, "--crest", "3", "--depth", "1", "--unit-weight", "5000"])
    found = safety.safety(options, options.cell_size, 0.0).value
    limit = bridge.log_spiral_safety(1.0, 30, 1e3, 0.0, 5e3, depth=1.0)
    assert limit == pytest.approx(1.0 / (0.172 * 5.0), rel=3e-3)  # Taylor's number
    assert found == pytest.approx(limit, rel=0.02)  # quadratic elements, seven of them over the height of the circle
    line = safety.slip_line(options, limit)
    assert line[:, 1].min() == pytest.approx(-1.0, rel=1e-3) and outside_line(options, line) == ""


def test_a_slip_line_that_leaves_the_mesh_is_named():
    options = safety.parse([*FLAT_CLAY, "--crest", "1", "--depth", "1"])
    line = safety.slip_line(options, 1.0)
    assert f"its slip line starts {-line[0, 0]:.2g} m behind the mesh: --crest is too short" in outside_line(
        options, line
    )
    line[-1, 0] += 3.0
    assert "before the mesh, whose side holds the soil up" in outside_line(options, line)


def test_particles_have_no_ground_below_the_toe(capsys):
    with pytest.raises(SystemExit):
        safety.parse(["--depth", "1", "--particles"])
    assert "--depth is 1, expected 0 with --particles" in capsys.readouterr().err
