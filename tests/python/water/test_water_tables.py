"""Tables of boundary conditions over time: the water that enters is the integral of the table, however short an event is."""

from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI

import fenics_bridge as bridge
from fenics_bridge import water

STUDIES = Path(__file__).parents[3] / "studies"
DAY = 86400.0
STORM = [[0.0, 0.0], [10.0, 0.0], [10.01, 100.0], [10.41, 100.0], [10.42, 0.0]]  # (days, mm/day)
GUST = [[0.0, 0.0], [10.0, 0.0], [10.001, 200.0], [10.3, 0.0]]
SITE = f"""
mesh = "{STUDIES.parent}/meshes/layer.geo"
cell_size = 0.2
[soils.clay]
conductivity = 1e-4
porosity = 0.4
gardner = {{alpha = 3e-4}}
[boundaries.base]
head = 0.0
[boundaries.top]
rain = TABLE
"""


@pytest.mark.usefixtures("without_pictures")
@pytest.mark.parametrize("table", [STORM, GUST])
@pytest.mark.parametrize("days", [60, 400])
def test_a_short_storm_enters_the_ground_of_a_study(table, days, tmp_path):
    import seepage

    (tmp_path / "site.toml").write_text(SITE.replace("TABLE", str(table)))
    arguments = f"--site {tmp_path}/site.toml --days {days} --frames 2 --no-film --output {tmp_path}/results"
    assert seepage.main(arguments.split()) == 0
    rows = np.genfromtxt(tmp_path / "results" / "history.csv", delimiter=",", names=True)
    times, rates = np.array(table).T
    fell = 1e-3 * np.sum(
        0.5 * (rates[1:] + rates[:-1]) * np.diff(times)
    )  # m: 41 mm, and 30 mm; the soil can take 8.6 m/day
    width = 0.5
    entered = np.sum(np.diff(rows["time_days"]) * rows["inflow_top_m2_per_day"][1:]) / width
    assert entered == pytest.approx(fell, rel=1e-6)
    # Steps end at all corners of the table, and the most intense rain is met.
    assert all(np.abs(rows["time_days"] - day).min() < 1e-6 for day in times)
    assert len(rows) < 150


def test_a_step_over_a_whole_event_takes_up_its_rain():
    domain, _, tags = bridge.box_mesh(MPI.COMM_WORLD, (1.0, 2.0), (1, 8))
    loam = water.PorousSoil(1e-4, porosity=0.4, retention=water.Gardner(alpha=3e-4))
    table = ((0.0, 0.0), (10.0, 4e-6), (20.0, 0.0))
    flow = water.Seepage(domain, loam, tags, [water.Head(3, 0.0), water.Rain(4, table)])
    flow.solve()
    for end, mean in ((5.0, 1e-6), (15.0, 3e-6), (100.0, 0.5 * 5.0 * 2e-6 / 85.0)):  # of the triangle, by hand
        assert flow.advance(end - flow.time)
        assert flow.inflow(4) == pytest.approx(mean, rel=1e-9)


def test_a_table_may_be_a_numpy_array():
    rows = ((0.0, 1.0), (10.0, 2.0))
    results = []
    for table in (rows, list(rows), np.array(rows)):
        domain, _, tags = bridge.box_mesh(MPI.COMM_WORLD, (1.0, 1.0), (2, 2))
        flow = water.Seepage(
            domain,
            water.PorousSoil(1e-4),
            tags,
            [water.Head(3, table), water.Flux(4, np.array(((0.0, 1e-7), (10.0, 2e-7))))],
        )
        flow.solve()
        assert flow.advance(5.0)
        assert flow.inflow(4) == pytest.approx(1.25e-7, rel=1e-9)  # from 1 to 1.5 in five seconds
        results.append(flow.pressure_head.x.array.max())
    assert results == pytest.approx([1.5] * 3, rel=1e-9)  # at the base, whose head is 1.5 m then
