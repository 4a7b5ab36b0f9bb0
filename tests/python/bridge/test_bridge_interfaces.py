"""Soil that slides along walls: cells beside them with a fraction of its strength."""

import numpy as np
import pytest
from common.earth_pressure import stress_field
from dolfinx import mesh
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

WALL, BELOW, FAR, BASE, TOP = 1, 2, 3, 4, 5
PHI, FRACTION, SURCHARGE = np.radians(25.0), 2 / 3, 1e5


def tagged_box(size, cells):
    """A box of one soil, the upper half of whose left side is a wall."""
    domain, *_ = bridge.box_mesh(MPI.COMM_WORLD, size, cells)
    count = domain.topology.index_map(2).size_local
    cell_tags = mesh.meshtags(domain, 2, np.arange(count, dtype=np.int32), np.ones(count, dtype=np.int32))
    length, depth = size
    places = {
        WALL: lambda x: (x[0] < 1e-9) & (x[1] > depth / 2 - 1e-9), BELOW: lambda x: (x[0] < 1e-9) & (x[1] < depth / 2 + 1e-9),
        FAR: lambda x: x[0] > length - 1e-9, BASE: lambda x: x[1] < 1e-9, TOP: lambda x: x[1] > depth - 1e-9,
    }  # fmt: skip
    found = [mesh.locate_entities_boundary(domain, 1, place) for place in places.values()]
    facets = np.concatenate(found).astype(np.int32)
    values = np.repeat(np.array(list(places), dtype=np.int32), [len(part) for part in found])
    order = np.argsort(facets)
    return domain, bridge.name_tags(cell_tags, {"soil": 1}), mesh.meshtags(domain, 1, facets[order], values[order])


def passive_coefficient(cells, fraction=FRACTION):
    """Horizontal pressure of a wall that is pushed into weightless soil, 1 m high, over the surcharge; and its friction."""
    domain, cell_tags, facet_tags = tagged_box((4.0, 2.0), (4 * cells, 2 * cells))
    soil = mpm.MohrCoulomb(young=1e8, poisson=0.3, cohesion=1.0, friction_angle=25.0, dilation_angle=25.0)
    laws = {1: soil}
    if fraction < 1:
        cell_tags, before = bridge.tags_beside(domain, cell_tags, [(0.0, 1.0), (0.0, 2.0)])
        laws |= {new: bridge.reduced_strength(laws[old], 1 / fraction) for new, old in before.items()}
    supports = [
        bridge.prescribed(WALL, (1.0, 0.0)),
        bridge.roller(BELOW, (1, 0)),
        bridge.roller(FAR, (1, 0)),
        bridge.fixed(BASE),
    ]
    fem = bridge.QuasiStatic(domain, laws, facet_tags, supports, cell_tags=cell_tags)
    fem.solve(bridge.Load(pressure={TOP: SURCHARGE}, displacement=1e-6))
    fem.solve(bridge.Load(pressure={TOP: SURCHARGE}, displacement=0.1), first_step=0.05)
    assert fem.converged
    force = fem.reaction(WALL)
    return abs(force[0]) / SURCHARGE, abs(force[1] / force[0])


def test_passive_pressure_on_a_wall_has_the_friction_of_its_interface():
    """The coefficient of weightless soil under a surcharge is exact (Lancellotta 2002); the band makes it smaller by its width."""
    delta = np.arctan(FRACTION * np.tan(PHI))
    exact, rough = (stress_field(PHI, angle, passive=True) for angle in (delta, PHI))
    assert rough > 1.05 * exact
    (coarse, _), (fine, friction) = passive_coefficient(4), passive_coefficient(8)
    assert -0.03 < fine / exact - 1 < 0
    assert abs(fine / exact - 1) < 0.6 * abs(coarse / exact - 1)
    assert 0.95 * np.tan(delta) < friction < np.tan(delta)
    assert passive_coefficient(4, fraction=1.0)[0] > rough


def corners_of(domain, tags, numbers):
    nodes = bridge.background_arrays(domain)["cells"]
    return domain.geometry.x[nodes[np.isin(tags.values, numbers)], :2]


def test_the_cells_that_touch_a_line_are_beside_it_but_not_those_below_its_end():
    domain, cell_tags, _ = tagged_box((4.0, 2.0), (8, 4))
    tags, before = bridge.tags_beside(domain, cell_tags, mpm.beam([(2.0, 2.0), (2.0, 1.0)], 1e9, 1e6))
    assert before == {2: 1} and bridge.names_of(tags) == {"soil": (1, 2)}
    beside = corners_of(domain, tags, [2])
    # Each square beside the wall has two triangles, of which both touch it, and so do the second squares' that share a corner.
    assert np.all(np.abs(beside[:, :, 0] - 2.0).min(axis=1) < 1e-12)
    assert beside.mean(axis=1)[:, 1].min() > 1.0 and np.ptp(beside[:, :, 0]) == pytest.approx(1.0)
    area = np.abs(np.cross(beside[:, 1] - beside[:, 0], beside[:, 2] - beside[:, 0])).sum() / 2
    assert area == pytest.approx(1.0)  # 0.5 m on both sides of 1 m of wall


def test_a_cell_beside_two_lines_has_a_tag_of_its_own():
    domain, cell_tags, _ = tagged_box((4.0, 2.0), (8, 4))
    tags, first = bridge.tags_beside(domain, cell_tags, [(2.0, 2.0), (2.0, 1.0)])
    tags, second = bridge.tags_beside(domain, tags, [(2.5, 2.0), (2.5, 1.0)])
    assert first == {2: 1} and second == {3: 1, 4: 2} and bridge.names_of(tags) == {"soil": (1, 2, 3, 4)}
    assert np.ptp(corners_of(domain, tags, [4])[:, :, 0]) == pytest.approx(0.5)


@pytest.mark.parametrize("line", [
    [(2.0, 2.0), (2.0, 1.0), (3.0, 1.0)], [(1.0, 0.5), (3.0, 0.5), (3.0, 1.5), (1.0, 1.5), (1.0, 0.5)],
])  # fmt: skip
def test_cells_around_the_corners_of_a_line_are_beside_it(line):
    """All cells with a node of the line, but those beyond its ends."""
    domain, cell_tags, _ = tagged_box((4.0, 2.0), (16, 8))
    tags, before = bridge.tags_beside(domain, cell_tags, line)
    found, everywhere = corners_of(domain, tags, list(before)), corners_of(domain, tags, [1, *before])
    for corner in line[1:-1] if line[0] != line[-1] else line:
        assert at(found, corner) == at(everywhere, corner) > 2


def at(corners, point):
    """How many cells have a point among their corners."""
    return int(np.any(np.all(np.isclose(corners, point), axis=2), axis=1).sum())


def test_a_line_outside_of_the_mesh_touches_no_cell():
    domain, cell_tags, _ = tagged_box((4.0, 2.0), (8, 4))
    tags, before = bridge.tags_beside(domain, cell_tags, [(6.0, 2.0), (6.0, 1.0)])
    assert before == {} and np.array_equal(tags.values, cell_tags.values)


@pytest.mark.parametrize("wall, expected", [
    ([(2.1, 2.0), (2.1, 1.0)], "goes through a cell"),
    ([(2.0, 2.0)], "expected two or more finite points"),
])  # fmt: skip
def test_lines_that_are_none_or_that_the_mesh_does_not_follow_are_refused(wall, expected):
    domain, cell_tags, _ = tagged_box((4.0, 2.0), (8, 4))
    with pytest.raises(bridge.InputError, match=expected):
        bridge.tags_beside(domain, cell_tags, wall)
