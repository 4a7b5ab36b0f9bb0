"""Water that stands on separate parts of the ground under one tag loads what is below these parts, and nothing between them."""

from pathlib import Path

import numpy as np
import pytest
from dolfinx.mesh import compute_midpoints, exterior_facet_indices, meshtags
from mpi4py import MPI

import fenics_bridge as bridge
from fenics_bridge import water

STUDIES = Path(__file__).parents[3] / "studies"
BEDS, OTHER = 9, 8
KPA = 1e3


def ground(height, is_bed):
    """Soil of 10 m by a height that is a function of x, and tags: BEDS where its surface is a bed, OTHER on the rest of it."""
    domain, _, _ = bridge.box_mesh(MPI.COMM_WORLD, (10.0, 2.0), (40, 8))
    x = domain.geometry.x
    x[:, 1] *= height(x[:, 0]) / 2.0
    domain.topology.create_connectivity(1, 2)
    facets = exterior_facet_indices(domain.topology)
    middle = compute_midpoints(domain, 1, facets)
    surface = (middle[:, 1] > 0.99 * height(middle[:, 0])) & (middle[:, 0] > 1e-6) & (middle[:, 0] < 10 - 1e-6)
    facets, middle = facets[surface], middle[surface]
    return domain, meshtags(domain, 1, facets, np.where(is_bed(middle), BEDS, OTHER).astype(np.int32))


def dyke():
    """Beds at 2 m, and a dyke between them, 4 m high from x = 4 to 6 m and with slopes of 1 : 2 beside that."""
    height = lambda x: 2.0 + np.clip(2.0 * (2.0 - np.abs(x - 5.0)), 0.0, 2.0)
    return ground(height, lambda middle: (middle[:, 0] < 3.0) | (middle[:, 0] > 7.0))


PLACES = np.array([[1.0, 1.0], [3.0, 1.0], [3.5, 1.0], [5.0, 1.0], [5.0, 3.9], [9.0, 1.0]])


def test_nothing_stands_on_a_dyke_between_two_basins():
    load = water.standing_water(*dyke(), [water.Reservoir(BEDS, 3.0)])
    assert load(PLACES, 0.0) == pytest.approx(9.81 * KPA * np.array([1.0, 1.0, 0.0, 0.0, 0.0, 1.0]), abs=1e-6)


def test_the_sides_of_the_dyke_have_the_water_above_them():
    load = water.standing_water(*dyke(), [water.Reservoir(BEDS, 3.0), water.Reservoir(OTHER, 3.0)])
    above = np.array([1.0, 1.0, 0.0, 0.0, 0.0, 1.0])
    assert load(PLACES, 0.0) == pytest.approx(9.81 * KPA * above, abs=1e-6)
    quarter = np.array([[3.25, 0.5], [6.75, 0.5]])  # the ground is at 2.5 m there
    assert load(quarter, 0.0) == pytest.approx([0.5 * 9.81 * KPA] * 2, rel=1e-9)


def test_lines_end_where_facets_do_not_meet():
    lines = water.ground_lines(*dyke(), BEDS)
    assert [(x[0], x[-1]) for x, _ in lines] == [(0.0, 3.0), (7.0, 10.0)]
    assert all(len(x) == 13 and np.ptp(y) < 1e-12 and np.all(np.diff(x) > 0) for x, y in lines)
    assert len(water.ground_lines(*dyke(), OTHER)) == 1


def test_free_water_is_beside_the_dyke_only():
    from common.slope.site import SlopeSite

    domain, tags = dyke()
    slope = SlopeSite(None, {}, [water.Reservoir(BEDS, 3.0)], (domain, None, tags))
    free = slope.free_water(0.0)
    at = np.array([[1.0, 2.5], [5.0, 2.5], [5.0, 4.5], [9.0, 2.5], [1.0, 3.5]])
    assert free(at) == pytest.approx(9.81 * KPA * np.array([0.5, 0.0, 0.0, 0.5, 0.0]), abs=1e-6)
