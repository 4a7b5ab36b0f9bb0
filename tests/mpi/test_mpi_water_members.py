"""Structural members in ground that consolidates are the same on 1, 2 and 3 ranks."""

import numpy as np
import pytest
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water

LEFT, RIGHT, BASE, TOP = 1, 2, 3, 4
BODIES = pytest.mark.parametrize(
    ("element", "nmd"),
    [(water.Element.TAYLOR_HOOD, False), (water.Element.STABILISED, False), (water.Element.STABILISED, True)],
    ids=["taylor_hood", "stabilised", "nmd"],
)


def require_same(together, alone):
    for name, forces in together.items():
        for part in ("positions", "displacement", "axial_force", "moment"):
            values, exact = getattr(forces, part), getattr(alone[name], part)
            assert np.allclose(values, exact, rtol=0, atol=1e-6 * max(np.abs(exact).max(), 1e-9)), (name, part)


def retained(comm, element, nmd):
    """Ground that a wall with a plastic hinge, a strut, a tie and a nail that slips retain while its load consolidates it."""
    domain, cell_tags, facet_tags = bridge.box_mesh(comm, (6.0, 3.0), (12, 6))
    soil = mpm.MohrCoulomb(young=10e6, poisson=0.3, cohesion=5e3, friction_angle=30.0, dilation_angle=10.0)
    supports = [bridge.fixed(BASE), bridge.roller(LEFT, (1, 0)), bridge.roller(RIGHT, (1, 0))]
    members = {
        "wall": mpm.beam([(3.1, 3.0), (3.1, 0.8)], 1e9, 2e6, plastic_moment=2e3),
        "strut": mpm.strut((3.1, 2.7), (5.9, 2.9), 50e6, prestress=-5e3),
        "tie": mpm.strut((3.1, 2.5), (-4.0, 2.5), 50e6, fixed_end=True),
        "nail": mpm.bar([(2.8, 1.9), (0.7, 1.6)], 20e6, bond_strength=3e3),
    }
    fem = bridge.QuasiStatic(
        domain, soil, facet_tags, supports, element.value, nmd, as_particles=nmd, cell_tags=cell_tags
    )
    level = lambda x: 9810.0 * (3.0 - x[:, 1])
    fem.reconfigure(pore_pressure=level, members={"wall": members["wall"]})
    fem.solve(bridge.Load(18e3))
    assert fem.converged
    model = water.Consolidation(
        domain, soil, water.PorousSoil(1e-8), facet_tags, supports, [water.Reservoir(TOP, 3.0)], element=element, nmd=nmd,
        load=lambda time: bridge.Load(18e3, {TOP: min(time, 1e5) * 0.3}, traction={TOP: (min(time, 1e5) * 0.05, 0.0)}), cell_tags=cell_tags,
    )  # fmt: skip
    model.initialise(fem, level)
    model.reconfigure(members=members, duration=2e4)
    assert model.run(2e5, 1e4, growth=1.5)[-1].converged
    model.reconfigure(members={name: one for name, one in members.items() if name != "strut"})
    assert model.run(4e5, 5e4)[-1].converged
    return {name: model.member_forces(name) for name in model.members}, model.reaction(BASE)


@BODIES
def test_members_in_consolidating_ground_carry_the_same_on_all_numbers_of_ranks(element, nmd):
    together, reaction = retained(MPI.COMM_WORLD, element, nmd)
    alone, expected = retained(MPI.COMM_SELF, element, nmd)
    assert list(together) == ["wall", "tie", "nail"]
    assert min(np.abs(forces.axial_force).max() for forces in alone.values()) > 500.0
    assert np.abs(alone["wall"].moment).max() > 200.0
    assert np.allclose(reaction, expected, rtol=1e-6)
    require_same(together, alone)


@pytest.mark.parametrize("element", list(water.Element))
def test_bars_in_three_dimensions_carry_the_same_on_all_numbers_of_ranks(element):
    def forces(comm):
        domain, _, facet_tags = bridge.box_mesh(comm, (2.0, 1.0, 1.0), (4, 2, 2))
        supports = [bridge.fixed(5), bridge.roller(1, (1, 0, 0)), bridge.roller(3, (0, 1, 0))]
        model = water.Consolidation(
            domain, mpm.LinearElastic(young=5e6, poisson=0.2), water.PorousSoil(1e-8), facet_tags, supports,
            [water.Head(6, 1.0)], load=bridge.Load(pressure={6: 20e3}), element=element,
        )  # fmt: skip
        members = {
            "bar": mpm.bar([(0.3, 0.3, 0.9), (1.7, 0.6, 0.2)], 3e6, bond_strength=4e3),
            "strut": mpm.strut((1.9, 0.9, 0.8), (4.0, 1.0, 1.2), 2e6, fixed_end=True),
        }
        model.reconfigure(members=members)
        assert model.run(1e5, 1e4, growth=2.0)[-1].converged
        return {name: model.member_forces(name) for name in members}

    together, alone = forces(MPI.COMM_WORLD), forces(MPI.COMM_SELF)
    assert min(np.abs(one.axial_force).max() for one in alone.values()) > 100.0
    require_same(together, alone)
