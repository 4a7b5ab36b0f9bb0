"""Slopes on ground of the same soil, in the studies that look for collapse."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[3] / "studies"))

import collapse  # noqa: E402
import safety  # noqa: E402

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


def test_particles_have_no_ground_below_the_toe(capsys):
    with pytest.raises(SystemExit):
        safety.parse(["--depth", "1", "--particles"])
    assert "--depth is 1, expected 0 with --particles" in capsys.readouterr().err
