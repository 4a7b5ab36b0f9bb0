"""Ground whose water table is below its surface: at rest until something loads it."""

from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI

from fenics_bridge import water

STUDIES = Path(__file__).parents[3] / "studies"
DAY = 86400.0
SITE = f"""
mesh = "{STUDIES.parent}/meshes/layer.geo"
cell_size = 0.2
[soils.clay]
unit_weight = 18e3
conductivity = 1e-9
porosity = 0.5
material = "elastic"
young = 4e6
poisson = 0.25
[supports]
left = "roller"
right = "roller"
base = "fixed"
[boundaries.left]
head = 1.0
[points]
surface = [0.25, 2.0]
"""


@pytest.mark.parametrize("element", water.Element)
def test_ground_above_its_water_table_does_not_settle_without_a_load(element, tmp_path):
    from common.consolidation.site import read_consolidation_site

    (tmp_path / "site.toml").write_text(SITE)
    site = read_consolidation_site(tmp_path / "site.toml", MPI.COMM_WORLD)
    model = site.at_rest(element)
    places = np.array([[0.25, 0.1], [0.25, 1.0], [0.25, 1.9], [0.25, 2.0]])
    before = model.evaluate_at(places)
    assert before["pressure"][:, 0] == pytest.approx(9810.0 * (1.0 - places[:, 1]), abs=1e-3)
    # Total stress gamma (2 - y), and the pressure of the water, suction too: effective stress by their difference.
    y = model.points.coordinates()[:, 1]
    effective = -(18e3 * (2.0 - y) - 9810.0 * (1.0 - y))
    assert model.points.stress[:, 1].mean() == pytest.approx(effective.mean(), rel=1e-6)
    assert model.advance(DAY).converged and model.advance(100 * DAY).converged
    after = model.evaluate_at(places)
    # The suction that was left out, 9.81 kPa at the surface, compressed the upper metre by 1 mm.
    assert np.abs(after["displacement"]).max() < 1e-9
    assert after["pressure"] == pytest.approx(before["pressure"], abs=1e-3)
