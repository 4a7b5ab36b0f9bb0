"""Flow around a wall, and its force on the wall, are the same on 1, 2 and 3 ranks."""

import numpy as np
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water

COMM = MPI.COMM_WORLD
LINE = [(3.0, 4.0), (3.0, 2.0), (4.0, 2.0)]  # with a corner, and an end in the soil
POINTS = np.array([(2.9, 3.0), (3.1, 3.0), (3.5, 1.9), (3.5, 2.1), (5.0, 0.5)])


def walled(comm):
    """Inflow, gradient where the water leaves, pressures, and what a wall carries."""
    mesh = bridge.box_mesh(comm, (8.0, 4.0), (32, 16))
    body, _, facets = bridge.soil_mesh(*mesh, tag=bridge.BODY, walls=[LINE])
    flow = water.Seepage(body, water.PorousSoil(1e-4), facets, [water.Head(1, 4.0), water.Head(2, 1.0)], degree=2)
    flow.solve()
    supports = [bridge.fixed(3), bridge.roller(1, (1, 0)), bridge.roller(2, (1, 0))]
    fem = bridge.QuasiStatic(mesh[0], mpm.LinearElastic(young=1e7, poisson=0.3), mesh[2], supports, cell_tags=mesh[1])
    wall = mpm.beam(LINE, 1e9, 2e7, impervious=True)
    fem.reconfigure(members={"wall": wall}, pore_pressure=flow.pore_pressure())
    fem.solve(bridge.Load(unit_weight=20e3))
    forces = fem.member_forces("wall")
    n = body.geometry.index_map().size_global
    return [n, flow.inflow(1), water.exit_gradient(flow, 2), flow.pore_pressure()(POINTS), forces.moment, forces.axial_force,
            fem.pore_pressure_function().x.norm()]  # fmt: skip


def test_a_wall_holds_the_same_water_back_on_all_numbers_of_ranks():
    together, alone = walled(COMM), walled(MPI.COMM_SELF)
    assert together[0] == 33 * 17 + 12  # the nodes of the wall but for that of its end in the soil
    assert np.abs(alone[4]).max() > 1e3 and alone[3][0] > alone[3][1] + 4e3
    for values, expected in zip(together, alone):
        assert np.allclose(values, expected, rtol=1e-6, atol=1e-6 * np.abs(expected).max())


def test_a_wall_beside_the_mesh_is_refused_on_all_ranks():
    mesh = bridge.box_mesh(COMM, (8.0, 4.0), (32, 16))
    try:
        bridge.soil_mesh(*mesh, tag=bridge.BODY, walls=[[(7.9, 4.0), (7.9, 3.0)]])  # which one rank has
    except mpm.InputError as error:
        message = str(error)
    assert "walls: the line 0 goes through a cell at (7.9, 3." in message
    assert len(set(COMM.allgather(message))) == 1


def beside_walls(comm):
    """Tags, names and area of the cells beside two walls that meet, by tag."""
    domain, cell_tags, _ = bridge.box_mesh(comm, (8.0, 4.0), (32, 16))
    tags, before = bridge.tags_beside(domain, cell_tags, LINE)
    tags, second = bridge.tags_beside(domain, tags, [(4.0, 2.0), (4.0, 0.0)])
    owned = tags.indices < domain.topology.index_map(2).size_local
    counts = comm.allreduce(np.bincount(tags.values[owned], minlength=8))
    return before, second, bridge.names_of(tags), counts.tolist()


def test_the_cells_beside_walls_are_the_same_on_all_numbers_of_ranks():
    together = beside_walls(COMM)
    assert together == beside_walls(MPI.COMM_SELF)
    assert len(together[0]) == 1 and len(together[1]) == 2 and min(count for count in together[3] if count) < 10
