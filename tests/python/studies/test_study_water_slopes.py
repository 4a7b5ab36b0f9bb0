"""The study drawdown: its sites, the limits of the factor of safety, and its course."""

import importlib
import json
import sys
from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI

from mpm_core import InputError

STUDIES = Path(__file__).parents[3] / "studies"
sys.path.insert(0, str(STUDIES))
MESHES = STUDIES.parent / "meshes"
SMALL = "--cell-size 2 --elements P1 --factor-times 1"


def site(name, folder, *changes):
    text = (MESHES / f"{name}.toml").read_text().replace('"bank_on_ground.geo"', f'"{MESHES}/bank_on_ground.geo"')
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = folder / "site.toml"
    path.write_text(text)
    return path


def run(name, path, folder, options):
    study = importlib.import_module(name)
    assert study.main([*SMALL.split(), *options.split(), "--site", str(path), "--output", str(folder / "results")]) == 0
    rows = np.genfromtxt(folder / "results" / "factors.csv", delimiter=",", names=True)
    return json.loads((folder / "results" / "summary.json").read_text()), rows


@pytest.mark.parametrize(
    "old, new, words",
    [
        ("cohesion = 4e3", "cohesion = -4e3", "soils.bank.*cohesion"),
        ("conductivity = 3e-7", "conductivity = 0.0", "soils.bank: conductivity: got 0.0"),
        ("unit_weight = 20e3  # N/m3, saturated\n", "", "soils.bank: has no unit_weight"),
        ("[soils.bank]", "[soils.levee]", "levee"),
        ("[boundaries.face]", "[boundaries.front]", "front"),
        ("reservoir = [[0.0, 7.0], [3.0, 1.0]]", "rain = 1.0", "no boundary has a reservoir"),
    ],
)
def test_a_wrong_site_is_named(old, new, words, tmp_path):
    with pytest.raises(InputError, match=words):
        run("drawdown", site("drawdown", tmp_path, (old, new)), tmp_path, "--days 1")


def test_a_drawdown_that_is_followed_long_ends_at_the_limit_of_a_slow_one(tmp_path):
    # The same boundary conditions for ever: the flow in time becomes the steady one, and with it the factor.
    path = site("drawdown", tmp_path, ("= 3e-7", "= 1e-4"), ("conductivity = 1e-7", "conductivity = 1e-4"))
    summary, rows = run("drawdown", path, tmp_path, "--days 400")
    slow, fast = (limit["factor_of_safety"] for limit in summary["limits"])
    assert rows["factor_of_safety"][-1] == pytest.approx(slow, rel=0.006)  # the width of the last step
    assert fast < rows["factor_of_safety"].min() * 1.006
    assert summary["failure_time_days"] is None or rows["factor_of_safety"].min() < 1


def test_a_drawdown_in_no_time_begins_at_the_limit_without_drainage(tmp_path):
    # Pore pressures then fall by the load of the water that left, times m_v / (m_v + n / K_w): 0.996 here.
    path = site(
        "drawdown", tmp_path, ("= 3e-7", "= 1e-11"), ("conductivity = 1e-7", "conductivity = 1e-11"), ("[3.0,", "[0.1,")
    )
    summary, rows = run("drawdown", path, tmp_path, "--days 0.1")
    slow, fast = (limit["factor_of_safety"] for limit in summary["limits"])
    assert rows["factor_of_safety"][-1] == pytest.approx(fast, rel=0.012)
    assert fast < 0.8 * slow
    assert rows["factor_of_safety"][0] > 1 > fast
    assert 0 < summary["failure_time_days"] < 0.1


def test_slower_tables_take_longer(tmp_path):
    from common.slope_site import read_slope_site

    path = site("drawdown", tmp_path)
    one, ten = (read_slope_site(path, MPI.COMM_WORLD, 3.0, slower).times(1e9) for slower in (1.0, 10.0))
    assert one == [3 * 86400.0] and ten == [30 * 86400.0]
