"""Levels of water that slope above the ground, where the surface of standing water is level."""

import numpy as np
import pytest
import study_main  # noqa: F401
from common.results import ROOT
from common.site.doubts import top_of
from common.site.file import read_site
from mpi4py import MPI

TRIANGLES = np.array([[(0, 0), (4, 0), (0, 2)], [(4, 0), (4, 1), (0, 2)], [(5, 0), (6, 0), (6, 3)]], dtype=float)


def test_the_top_of_triangles():
    found = top_of(TRIANGLES, np.array([0.0, 2.0, 4.0, 4.5, 5.5, 6.0]))
    assert found[:2] == pytest.approx([2.0, 1.5])
    assert np.isneginf(found[3]) and found[4] == pytest.approx(1.5)


def read_dike(folder, level):
    """The site of a dike with a water level."""
    path = folder / "site.toml"
    stage = f'[[stages]]\nname = "in situ"\nfill = ["bank", "ground"]\nwater_level = {level}\n'
    path.write_text(f'extends = "{ROOT}/meshes/dike.toml"\n{stage}')
    return read_site(path, MPI.COMM_WORLD)


@pytest.mark.parametrize("level, slopes", [
    ("[[0, 6], [10, 6], [26, 0], [40, 0]]", False),  # along the crest's left part and the face of 1:2 of the bank
    ("[[0, 6], [10, 9], [26, 2], [36, 2]]", True),  # above the face
    ("[[0, 6], [22, 2], [36, 2]]", False),  # in the bank, and level where it stands before it
    ("[[0, 6], [22, 2], [36, 0]]", True),  # falls where it stands
    ("2.0", False),
])  # fmt: skip
def test_a_level_that_slopes_where_water_stands_is_doubted(tmp_path, level, slopes, recwarn):
    """The dike is 8 m high and 1:2, its crest ends at x = 10 m and its toe is at x = 26 m."""
    read_dike(tmp_path, level)
    said = [str(one.message) for one in recwarn if "water_level slopes by 1:" in str(one.message)]
    assert len(said) == slopes
    assert not said or "stages[0]: water_level" in said[0] and "above the ground" in said[0]


@pytest.mark.parametrize(
    "level, dry", [("-5.0", True), ("[[0, -4.5], [36, -6]]", True), ("-4.0", False), ("[[0, -3], [36, -6]]", False)]
)
def test_a_level_below_the_base_is_doubted(tmp_path, level, dry, recwarn):
    """The base of the dike's ground is at -4 m: a depth of 5 m below the crest is at 3 m."""
    read_dike(tmp_path, level)
    said = [str(one.message) for one in recwarn if "below the base of the mesh" in str(one.message)]
    assert len(said) == dry
    assert not said or "stages[0]: water_level is -" in said[0] and "base of the mesh at -4 m" in said[0]


@pytest.mark.parametrize(
    "weight, wet, light", [(9000.0, True, True), (9000.0, False, False), (19000.0, True, False), (0.0, True, False)]
)
def test_a_buoyant_unit_weight_is_doubted_below_water(tmp_path, weight, wet, light, recwarn):
    path = tmp_path / "site.toml"
    level = "water_level = 3.0" if wet else ""
    path.write_text(
        f'extends = "{ROOT}/meshes/dike.toml"\n[soils.ground]\nunit_weight = {weight}\n'
        f'[[stages]]\nname = "in situ"\nfill = ["bank", "ground"]\n{level}\n'
    )
    read_site(path, MPI.COMM_WORLD)
    said = [
        str(one.message)
        for one in recwarn
        if "'ground' is lighter than water, 9000 N/m3: unit_weight" in str(one.message)
    ]
    assert len(said) == light
