"""Structural members in finite elements are the same on 1, 2 and 3 ranks."""

import warnings

import numpy as np
import pytest
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge.structures.embedding import cell_sizes_along

COMM = MPI.COMM_WORLD


def retained(comm):
    """Ground that a wall and a strut retain while its left part is loaded and the wall yields."""
    domain, cell_tags, facet_tags = bridge.box_mesh(comm, (6.0, 3.0), (24, 12))
    soil = mpm.MohrCoulomb(young=10e6, poisson=0.3, cohesion=5e3, friction_angle=30.0, dilation_angle=10.0)
    supports = [bridge.fixed(3), bridge.roller(1, (1, 0)), bridge.roller(2, (1, 0))]
    fem = bridge.QuasiStatic(domain, soil, facet_tags, supports, cell_tags=cell_tags)
    site = bridge.FemSite(fem)
    soils = fem.soils
    members = {
        "wall": mpm.beam([(3.1, 3.0), (3.1, 0.8)], 1e9, 2e6, plastic_moment=2e3),
        "strut": mpm.strut((3.1, 2.7), (5.9, 2.9), 50e6, prestress=-5e3),
        "tie": mpm.strut((3.1, 2.5), (-4.0, 2.5), 50e6, fixed_end=True),
    }
    site.carry_out(bridge.Stage("ground", fill=soils, unit_weight=dict.fromkeys(soils, 18e3)))
    site.carry_out(bridge.Stage("members", install=members, reset_displacement=True))
    site.carry_out(bridge.Stage("load", pressure={4: 40e3}))
    return {name: fem.member_forces(name) for name in members}, fem.reaction(3)


def test_members_carry_the_same_on_all_numbers_of_ranks():
    together, reaction = retained(COMM)
    alone, expected = retained(MPI.COMM_SELF)
    assert np.abs(alone["wall"].moment).max() > 500.0
    assert np.abs(alone["strut"].axial_force).max() > 1e3
    assert np.allclose(reaction, expected, rtol=1e-6)
    for name, forces in together.items():
        for part in ("positions", "displacement", "axial_force", "moment"):
            values, exact = getattr(forces, part), getattr(alone[name], part)
            assert np.allclose(values, exact, rtol=0, atol=1e-6 * max(np.abs(exact).max(), 1e-9))


def test_nodes_beside_the_border_of_ranks_move_with_the_cell_that_contains_them():
    """A node 1 % of a cell away from any line of the mesh is a little outside of the cells on its other side."""

    def forces(comm, x):
        domain, cell_tags, facet_tags = bridge.box_mesh(comm, (4.0, 4.0), (8, 8))
        soil = mpm.LinearElastic(young=1e6, poisson=0.3)
        fem = bridge.QuasiStatic(domain, soil, facet_tags, [bridge.fixed(3)], degree=1, cell_tags=cell_tags)
        fem.reconfigure(members={"tie": mpm.strut((x, 3.0), (x + 0.3, 1.2), 10e6)})
        fem.solve(bridge.Load(pressure={4: 10e3}, traction={4: (10e3, 0.0)}))
        return fem.member_forces("tie").axial_force

    for x in np.arange(0.505, 3.6, 0.5):
        assert np.allclose(forces(COMM, x), forces(MPI.COMM_SELF, x), rtol=1e-9)


def sliding(comm, rebalance=None):
    """A leaning wall and a tie in soft ground that slides over the borders of ranks, and what they carry."""
    domain, cell_tags, facet_tags = bridge.box_mesh(comm, (6.0, 3.0), (24, 12))
    soil = mpm.LinearElastic(young=0.5e6, poisson=0.2)
    model = mpm.Model(bridge.background_mesh(domain, cell_tags, facet_tags), soil)
    x, y = np.meshgrid(np.arange(0.56, 4.5, 0.125), np.arange(0.06, 2.0, 0.125))
    points = np.stack([x, y], axis=-1).reshape(-1, 2)
    model.seed_points(points, np.full(len(points), 0.125**2), density=2000.0)
    model.roller(3, (0, 1))
    model.set_gravity((4.0, -10.0))
    members = {
        "wall": mpm.beam([(2.9, 1.9), (2.9, 0.2)], 1e7, 5e4, plastic_moment=500.0),
        "tie": mpm.strut((1.5, 1.5), (0.2, 1.5), 2e6, fixed_end=True),
        "nail": mpm.bar([(3.0, 1.0), (4.2, 0.8)], 5e6, tensile_strength=2e3),
    }
    model.install(members)
    list(model.explicit(until=0.4, rebalance=rebalance))
    return {name: model.member_forces(name) for name in members}, model.critical_time_step()


def require_same(together, alone):
    assert max(np.abs(forces.axial_force).max() for forces in alone.values()) > 500.0
    assert np.abs(alone["wall"].moment).max() > 50.0
    assert np.abs(alone["nail"].displacement).max() > 0.2  # of cells of 0.25 m
    for name, forces in together.items():
        for part in ("positions", "displacement", "axial_force", "moment"):
            values, exact = getattr(forces, part), getattr(alone[name], part)
            assert np.allclose(values, exact, rtol=0, atol=1e-7 * max(np.abs(exact).max(), 1e-9))


def test_particles_move_members_alike_on_all_numbers_of_ranks():
    alone, step = sliding(MPI.COMM_SELF)
    together, step_together = sliding(COMM)
    assert np.isclose(step, step_together, rtol=1e-7)
    require_same(together, alone)


def test_a_new_partition_does_not_change_what_members_carry():
    alone, _ = sliding(MPI.COMM_SELF)
    together, _ = sliding(COMM, rebalance=1.01)
    require_same(together, alone)


def test_a_member_in_no_soil_is_said_once_and_one_across_ranks_is_not():
    domain, cell_tags, facet_tags = bridge.box_mesh(COMM, (6.0, 3.0), (24, 12), body=((0.0, 0.0), (6.0, 1.0)))
    model = mpm.Model(bridge.background_mesh(domain, cell_tags, facet_tags), mpm.LinearElastic(young=1e6, poisson=0.2))
    model.seed(density=2000.0, per_cell=3, cell_tag=bridge.BODY)
    model.fix(3)
    model.set_gravity((0.0, -10.0))
    model.install({"long": mpm.bar([(0.1, 1.0), (5.9, 0.9)], 5e6), "up": mpm.bar([(0.1, 2.0), (5.9, 2.0)], 5e6)})
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        model.explicit(until=1e-3).last()
    said = [str(one.message) for one in found if "carries nothing" in str(one.message)]
    assert len(said) == (1 if COMM.rank == 0 else 0)
    assert all("'up'" in text for text in said)


def test_sizes_of_segments_do_not_depend_on_the_border_of_ranks():
    """The cells along lines of which some are on the border of ranks, and some between cells of other sizes."""

    def sizes(comm):
        mesh = bridge.slope_mesh(comm, height=2.0, angle=30.0, crest=2.0, cell_size=0.3, kind="gmsh")
        body = bridge.soil_mesh(*mesh)[0]
        return cell_sizes_along(body, [np.array([(0.1 + 0.17 * k, 1.9), (0.2 + 0.25 * k, 0.1)]) for k in range(11)])

    assert sizes(COMM) == pytest.approx(sizes(MPI.COMM_SELF), rel=1e-12)


def test_shells_of_revolution_carry_the_same_on_all_numbers_of_ranks():
    def forces(comm):
        domain, _, facet_tags = bridge.box_mesh(comm, (4.0, 2.0), (16, 8))
        soil = mpm.MohrCoulomb(young=10e6, poisson=0.3, cohesion=5e3, friction_angle=30.0, dilation_angle=10.0)
        supports = [bridge.roller(1, (1, 0)), bridge.roller(2, (1, 0)), bridge.fixed(3)]
        fem = bridge.QuasiStatic(domain, soil, facet_tags, supports, geometry=mpm.Geometry.AXISYMMETRIC)
        raft = mpm.beam([(0.0, 2.0), (1.5, 2.0)], 1e9, 5e6, clamped_start=True)
        pipe = mpm.beam([(1.5, 2.0), (1.5, 1.0)], 1e9, 5e6)
        fem.reconfigure(members={"raft": raft, "pipe": pipe})
        fem.solve(bridge.Load(unit_weight=18e3, pressure={4: 30e3}))
        return [getattr(fem.member_forces(name), part) for name in ("raft", "pipe")
                for part in ("axial_force", "moment", "hoop_force", "hoop_moment")]  # fmt: skip

    for values, expected in zip(forces(COMM), forces(MPI.COMM_SELF)):
        assert np.allclose(values, expected, rtol=0, atol=1e-6 * np.abs(expected).max())
