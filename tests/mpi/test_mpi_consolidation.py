"""Consolidation on several ranks is that on one."""

import warnings

import numpy as np
import pytest
from dolfinx.mesh import compute_midpoints, locate_entities, meshtags
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water

LEFT, RIGHT, BASE, TOP = 1, 2, 3, 4


FULL = water.AlwaysSaturated()


def layer(comm, element, retention=FULL, nmd=False, geometry=None):
    """A layer of Mohr-Coulomb soil, 4 m by 2 m, under a load that grows, with a seepage face at its right side."""
    domain, _, facet_tags = bridge.box_mesh(comm, (4.0, 2.0), (8, 4))
    soil = mpm.MohrCoulomb(young=10e6, poisson=0.3, cohesion=1e3, friction_angle=20.0, dilation_angle=0.0)
    supports = [bridge.roller(LEFT, (1, 0)), bridge.roller(RIGHT, (1, 0)), bridge.fixed(BASE)]
    boundary = [water.Reservoir(TOP, ((0.0, 2.0), (1e4, 3.0))), water.SeepageFace(RIGHT)]
    load = lambda time: bridge.Load(unit_weight=20e3, pressure={TOP: 1.5 * time})
    return water.Consolidation(
        domain, soil, water.PorousSoil(1e-7, retention=retention), facet_tags, supports, boundary, load=load, element=element, nmd=nmd,
        geometry=geometry,
    )  # fmt: skip


@pytest.mark.parametrize("geometry", [None, bridge.Geometry.AXISYMMETRIC], ids=["plane", "axisymmetric"])
@pytest.mark.parametrize("retention", [FULL, water.VanGenuchten(2e-4, 2.0)], ids=["full", "dries"])
@pytest.mark.parametrize("element, nmd", [*((one, False) for one in water.Element), (water.Element.STABILISED, True)])
def test_steps_with_plastic_soil_and_a_seepage_face_do_not_depend_on_the_number_of_ranks(
    element, nmd, retention, geometry
):
    points, results = np.array([[0.5, 0.3], [2.1, 1.4], [3.9, 0.2]]), []
    for comm in (MPI.COMM_SELF, MPI.COMM_WORLD):
        model = layer(comm, element, retention, nmd, geometry)
        reports = model.run(3e4, 1e3, growth=2.0)
        assert reports[-1].converged and max(abs(r.water_error) for r in reports) < 1e-12
        assert comm.allreduce(float(model.points.deviatoric_strain.max(initial=0.0)), MPI.MAX) > 1e-3
        there = model.evaluate_at(points)
        results.append(
            [
                *(1e3 * there["displacement"]).ravel(),
                *(1e-3 * there["pressure"]).ravel(),
                *(1e-3 * there["stress"]).ravel(),
                1e7 * model.inflow(RIGHT),
                1e7 * model.inflow(TOP),
                model.stored_water(),
                *(1e-3 * model.reaction(BASE)),
                float(sum(r.iterations for r in reports)),
            ]
        )
    assert results[1] == pytest.approx(results[0], rel=1e-6, abs=1e-6)


def test_the_first_rank_alone_warns_of_large_cells_and_all_remember_it():
    texts = []
    for comm in (MPI.COMM_SELF, MPI.COMM_WORLD):
        model = layer(comm, water.Element.STABILISED)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            for time in (1e2, 2e2):
                assert model.run(time, 1e2)[-1].converged
        here = [str(one.message) for one in caught if "cells at the drained boundary" in str(one.message)]
        counts = comm.allgather(len(here))
        assert counts == [1] + [0] * (comm.size - 1)
        texts.append(comm.bcast(here))
    assert texts[0] == texts[1]


def test_a_bad_argument_is_refused_on_all_ranks():
    model = layer(MPI.COMM_WORLD, water.Element.STABILISED)
    with pytest.raises(mpm.InputError, match="dt is -1.0 s"):
        model.advance(-1.0)
    with pytest.raises(mpm.InputError, match="no facet has the tag 9"):
        model.boundary = [water.Head(9, 1.0)]
        model.advance(1.0)


def test_soil_is_placed_and_removed_alike_on_any_number_of_ranks():
    """Wet soil in a corner is dug away under water and replaced by a fill that drains; facets lie inside of the mesh."""
    points, results = np.array([[0.5, 0.3], [1.2, 2.0], [3.9, 1.2]]), []
    for comm in (MPI.COMM_SELF, MPI.COMM_WORLD):
        domain, _, facets = bridge.box_mesh(comm, (4.0, 3.0), (8, 6))
        cells = np.arange(
            sum(getattr(domain.topology.index_map(2), n) for n in ("size_local", "num_ghosts")), dtype=np.int32
        )
        x, y = compute_midpoints(domain, 2, cells)[:, :2].T
        tags = np.where(y < 2.0, 1, np.where(x < 2.0, 2, 3)).astype(np.int32)
        bed = locate_entities(domain, 1, lambda p: np.abs(p[1] - 2.0) < 1e-9)
        numbers = dict(zip(facets.indices.tolist(), facets.values.tolist())) | dict.fromkeys(bed.tolist(), 9)
        facets = meshtags(domain, 1, np.array(sorted(numbers), dtype=np.int32),
                          np.array([numbers[i] for i in sorted(numbers)], dtype=np.int32))  # fmt: skip
        clay, sand = (mpm.LinearElastic(young=young, poisson=0.3) for young in (5e6, 2e7))
        soil = water.PorousSoil(1e-8, porosity=0.4)
        model = water.Consolidation(
            domain, {1: clay, 2: clay, 3: sand}, {1: soil, 2: soil, 3: None}, facets,
            [bridge.roller(LEFT, (1, 0)), bridge.roller(RIGHT, (1, 0)), bridge.fixed(BASE)], [water.Reservoir(9, 3.0)],
            load=bridge.Load(unit_weight={1: 18e3, 2: 18e3, 3: 20e3}), cell_tags=meshtags(domain, 2, cells, tags),
        )  # fmt: skip
        for off in ([3], [2, 3], [2]):
            model.reconfigure(off=off, duration=1e3)
            assert model.run(model.time + 3e4, 2e3, growth=2.0)[-1].converged
        there = model.evaluate_at(points)
        results.append(
            [*(1e3 * there["displacement"]).ravel(), *(1e-3 * there["pressure"]).ravel(), *(1e-3 * there["stress"]).ravel(),
             1e7 * model.inflow(9), *(1e-3 * model.reaction(BASE))]
        )  # fmt: skip
    assert np.abs(results[0]).max() > 1.0
    assert results[1] == pytest.approx(results[0], rel=1e-6, abs=1e-6)


def test_facets_of_soil_without_water_are_those_that_touch_no_wet_soil():
    """Of two dry rows of cells on two wet ones: untagged edges between the nodes of the upper two heights, on any ranks."""
    domain, _, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, (1.0, 1.0), (2, 4))
    cells = domain.topology.index_map(2)
    tags = np.ones(cells.size_local + cells.num_ghosts, dtype=np.int32)
    tags[locate_entities(domain, 2, lambda x: x[1] > 0.5 - 1e-9)] = 2
    cell_tags = meshtags(domain, 2, np.arange(len(tags), dtype=np.int32), tags)
    found = water.waterless_facets(domain, cell_tags, facet_tags, [2])
    (number,) = found.names[water.WATERLESS]
    own = domain.topology.index_map(1).size_local
    assert domain.comm.allreduce(int(np.sum((found.values == number) & (found.indices < own)))) == 2 + 1 + 2
    kept = np.isin(found.indices, facet_tags.indices)
    assert np.array_equal(found.values[kept], facet_tags.values)
