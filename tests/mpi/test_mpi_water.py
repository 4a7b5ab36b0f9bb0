"""Seepage on several ranks is that on one."""

import numpy as np
import pytest
from dolfinx import mesh
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water

WEIGHT = 9810.0


def dam(comm):
    domain, _, facet_tags = bridge.box_mesh(comm, (16.0, 10.0), (32, 20))
    soil = water.PorousSoil(1e-5, compressibility=1e-7, retention=water.VanGenuchten(3e-4, 2.0, residual=0.05))
    return water.Seepage(domain, soil, facet_tags, [water.Reservoir(1, 10.0), water.Reservoir(2, 2.0)])


def test_a_dam_and_its_drawdown_do_not_depend_on_the_number_of_ranks():
    points = np.array([[4.0, 3.0], [8.0, 7.0], [15.9, 2.2]])
    results = []
    for comm in (MPI.COMM_SELF, MPI.COMM_WORLD):
        flow = dam(comm)
        flow.solve()
        steady = flow.inflow(1)
        flow.boundary[0] = water.Reservoir(1, ((0.0, 10.0), (1e4, 6.0)))
        for _ in range(3):
            assert flow.advance(2e3)
        heads = bridge.evaluate_at(points, p=flow.pressure_head)["p"][:, 0]
        results.append([steady / 1e-5, flow.inflow(1) / 1e-5, flow.inflow(2) / 1e-5, flow.stored_water(), *heads])
    assert results[1] == pytest.approx(results[0], rel=1e-8, abs=1e-8)


def test_rain_on_a_slope_does_not_depend_on_the_number_of_ranks():
    inflows = []
    for comm in (MPI.COMM_SELF, MPI.COMM_WORLD):
        domain, _, facet_tags = bridge.soil_mesh(*bridge.slope_mesh(comm, cell_size=0.1))
        soil = water.PorousSoil(1e-6, retention=water.VanGenuchten(1e-3, 2.0))
        boundary = [water.Head(bridge.LEFT, 0.2), water.SeepageFace(bridge.SLOPE), water.Rain(bridge.CREST, 2e-7)]
        flow = water.Seepage(domain, soil, facet_tags, boundary)
        flow.solve()
        inflows.append([1e6 * flow.inflow(tag) for tag in (bridge.LEFT, bridge.SLOPE, bridge.CREST)])
        assert sum(inflows[-1]) == pytest.approx(0.0, abs=1e-9)
    assert inflows[1] == pytest.approx(inflows[0], rel=1e-8)


def test_standing_water_loads_the_pores_alike_on_every_number_of_ranks():
    points, heads = np.array([[1.0, 0.5], [2.5, 0.6], [3.4, 0.1]]), []
    for comm in (MPI.COMM_SELF, MPI.COMM_WORLD):
        mesh = bridge.slope_mesh(comm, height=2.0, angle=45.0, crest=2.0, cell_size=0.25, kind="fitted")
        domain, _, facet_tags = bridge.soil_mesh(*mesh)
        boundary = [water.Reservoir(bridge.SLOPE, ((0.0, 1.8), (1e4, 0.4))), water.Reservoir(bridge.LEFT, 1.8)]
        standing = water.standing_water(domain, facet_tags, boundary[:1])
        soil = water.PorousSoil(1e-8, compressibility=1e-7, retention=water.VanGenuchten(1e-4, 2.0))
        flow = water.Seepage(domain, soil, facet_tags, boundary, loading=standing)
        flow.solve()
        for _ in range(4):
            assert flow.advance(2.5e3)
        heads.append(bridge.evaluate_at(points, p=flow.pressure_head)["p"][:, 0])
        heads[-1] = np.append(heads[-1], flow.stored_water())
    assert heads[1] == pytest.approx(heads[0], rel=1e-8, abs=1e-8)


@pytest.mark.parametrize("wet", [False, True])
def test_prescribed_pressures_are_handed_over_alike_on_any_number_of_ranks(wet):
    """Pore pressures of finite elements become pore water, or a part of the total stress; both are in balance on the same cells."""
    soil = mpm.MohrCoulomb(young=2e7, poisson=0.3, cohesion=6e3, friction_angle=28.0)
    law = soil if wet else mpm.Undrained(soil, water_modulus=2e8, porosity=0.4)
    supports, results = [bridge.fixed(bridge.BASE), bridge.roller(bridge.LEFT, (1, 0))], []
    for comm in (MPI.COMM_SELF, MPI.COMM_WORLD):
        background = bridge.slope_mesh(comm, height=4.0, angle=45.0, crest=4.0, cell_size=0.5)
        body, _, facets = bridge.soil_mesh(*background)
        fem = bridge.QuasiStatic(body, soil, facets, supports, degree=1)
        fem.reconfigure(pore_pressure=lambda x: WEIGHT * (2.0 - 0.25 * x[:, 0] - x[:, 1]))
        fem.solve(bridge.Load(unit_weight=20e3))
        model = mpm.Model(bridge.background_mesh(*background), law)
        model.seed(density=20e3 / 9.81, per_cell=3, cell_tag=bridge.SOIL)
        bridge.apply_supports(model, supports)
        model.set_gravity((0.0, -9.81))
        if wet:
            model.add_water(porosity=0.4, conductivity=1e-9)
        assert bridge.initialise(model, fem).unbalanced_ratio < 1e-9
        p = model.particles
        pressure = p.pore_pressure if wet else model.state("excess_pore_pressure")
        sums = [
            p.volume @ pressure,
            p.volume @ pressure**2,
            p.volume @ p.stress[:, 1],
            p.volume @ p.stress[:, 3] ** 2,
        ]
        results.append(comm.allreduce(np.array(sums)))
    assert results[1] == pytest.approx(results[0], rel=1e-6)


def test_flow_through_a_soil_that_not_all_ranks_have():
    """Two soils in series: q = dh / (l_1 / k_1 + l_2 / k_2), everywhere along the axis."""
    domain, _, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, (8.0, 1.0), (16, 2))
    cells = domain.topology.index_map(2)
    count = cells.size_local + cells.num_ghosts
    first = mesh.compute_midpoints(domain, 2, np.arange(count, dtype=np.int32))[:, 0] < 0.5
    tags = mesh.meshtags(domain, 2, np.arange(count, dtype=np.int32), np.where(first, 1, 2).astype(np.int32))
    soils = {1: water.PorousSoil(1e-6), 2: water.PorousSoil(1e-5)}
    flow = water.Seepage(domain, soils, facet_tags, [water.Head(1, 2.0), water.Head(2, 1.0)], cell_tags=tags)
    flow.solve()
    velocity = bridge.evaluate_at(np.array([[0.2, 0.4], [0.45, 0.9], [3.3, 0.7], [7.9, 0.1]]), v=flow.velocity())["v"]
    assert velocity == pytest.approx(np.tile([1.0 / (0.5 / 1e-6 + 7.5 / 1e-5), 0.0], (4, 1)), rel=1e-9, abs=1e-16)


@pytest.mark.parametrize("cells", [1, 12])
def test_flow_to_a_well_in_axial_symmetry_does_not_depend_on_the_number_of_ranks(cells):
    """Steady, and in time with an unsaturated zone, about the axis; some ranks may have no cell of the smallest mesh."""
    results = []
    for comm in (MPI.COMM_SELF, MPI.COMM_WORLD):
        domain, _, facet_tags = bridge.box_mesh(comm, (3.0, 2.0), (cells, cells))
        soil = water.PorousSoil(1e-5, compressibility=1e-7, retention=water.VanGenuchten(3e-4, 2.0, residual=0.05))
        boundary = [water.Reservoir(2, 2.0), water.Head(3, 1.0)]
        flow = water.Seepage(domain, soil, facet_tags, boundary, geometry=bridge.Geometry.AXISYMMETRIC)
        flow.solve()
        results.append([1e5 * flow.inflow(2), flow.stored_water(), water.exit_gradient(flow, 3)])
        flow.boundary[0] = water.Reservoir(2, ((0.0, 2.0), (1e3, 0.5)))
        for _ in range(4):
            before = flow.stored_water()
            assert flow.advance(5e2)
            assert flow.stored_water() - before == pytest.approx(5e2 * flow.inflow(None), abs=1e-10)
        heads = bridge.evaluate_at(np.array([[0.0, 1.7], [1.2, 0.6]]), p=flow.pressure_head)["p"][:, 0]
        results[-1] += [1e5 * flow.inflow(2), flow.stored_water(), *heads]
    assert results[1] == pytest.approx(results[0], rel=1e-8, abs=1e-8)
