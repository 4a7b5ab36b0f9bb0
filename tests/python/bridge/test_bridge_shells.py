"""Beams in axisymmetric finite elements are shells of revolution: plates and cylinders against their closed forms."""

import numpy as np
import pytest
from dolfinx.mesh import compute_midpoints, meshtags
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water
from fenics_bridge.mesh.tagged import tag_values

pytestmark = [pytest.mark.filterwarnings("ignore:the beam 'shell' " + text) for text in ("ends at", "is as stiff as")]

COMM = MPI.COMM_WORLD
AXIS, RIM, BOTTOM, TOP = 1, 2, 3, 4
RADIUS, PRESSURE, BENDING = 2.0, 1e3, 1e6


def cylinder(counts, law, supports, height=0.5, **options):
    domain, _, facet_tags = bridge.box_mesh(COMM, (RADIUS, height), counts)
    supports = [bridge.roller(AXIS, (1, 0)), *supports]
    return bridge.QuasiStatic(domain, law, facet_tags, supports, geometry=mpm.Geometry.AXISYMMETRIC, **options)


def plate(cells, **ends):
    """Forces in a circular plate under 1 kPa that the rim holds; the soil below it is 1e5 times softer. Segments of half a cell."""
    fem = cylinder((cells, 2), mpm.LinearElastic(young=1e-3, poisson=0.0), [bridge.prescribed(RIM, (None, 0.0))])
    line = [(0.0, 0.5), (RADIUS, 0.5)]
    fem.reconfigure(members={"shell": mpm.beam(line, 1e8, BENDING, clamped_start=True, **ends)})
    fem.solve(bridge.Load(pressure={TOP: PRESSURE}))
    return fem.member_forces("shell")


def test_a_plate_on_a_simple_support_bends_as_timoshenko_has_it():
    """Without Poisson's ratio w = 5 q a^4 / 64 D, M_r = 3 q (a^2 - r^2) / 16, M_hoop = q (3 a^2 - r^2) / 16 (Timoshenko, chapter 3)."""
    errors = []
    for cells in (4, 8):
        forces = plate(cells)
        r = forces.positions[:, 0]
        middle = (r[1:] + r[:-1]) / 2
        deflection = -forces.displacement[0, 1] / (5 * PRESSURE * RADIUS**4 / (64 * BENDING))
        radial = np.abs(forces.moment) - 3 * PRESSURE * (RADIUS**2 - r**2) / 16
        hoop = np.abs(forces.hoop_moment) - PRESSURE * (3 * RADIUS**2 - middle**2) / 16
        largest = 3 * PRESSURE * RADIUS**2 / 16
        errors.append((abs(deflection - 1), np.abs(radial).max() / largest, np.abs(hoop).max() / largest))
        # The shear force carries the load within, q r / 2, over each cell, whose nodes have it by Simpson's rule.
        shear = np.abs(forces.shear_force).reshape(-1, 2).mean(axis=1)
        assert np.allclose(shear, PRESSURE * middle.reshape(-1, 2).mean(axis=1) / 2, atol=0.02 * PRESSURE * RADIUS)
        assert np.all(np.sign(forces.hoop_moment) == np.sign(forces.moment[0]))
        assert np.abs(forces.hoop_force).max() < 0.01 * PRESSURE * RADIUS  # the soft soil hardly stretches it
    assert max(errors[1]) < 0.01
    assert errors[1][0] < 0.3 * errors[0][0]  # second order


def test_a_clamped_plate_bends_as_timoshenko_has_it():
    """w = q a^4 / 64 D, M = q a^2 / 16 at the centre and -q a^2 / 8 at the rim."""
    coarse, fine = (plate(cells, clamped_end=True) for cells in (4, 8))
    deflection, moment = PRESSURE * RADIUS**4 / (64 * BENDING), PRESSURE * RADIUS**2 / 16
    errors = [np.array([-one.displacement[0, 1] / deflection, abs(one.moment[0]) / moment, abs(one.moment[-1]) / moment / 2]) - 1
              for one in (coarse, fine)]  # fmt: skip
    assert np.abs(errors[1]).max() < 0.02 and abs(errors[1][0]) < 0.3 * abs(errors[0][0])
    assert fine.moment[0] * fine.moment[-1] < 0


@pytest.mark.parametrize(
    ("options", "exact"), [({"degree": 1}, 1e-8), ({"degree": 2}, 0.02), ({"degree": 1, "nmd": True}, 1e-8)]
)
def test_a_cylinder_and_the_soil_in_it_share_a_pressure_by_their_stiffness(options, exact):
    """u = -q / (E / (a (1 + nu) (1 - 2 nu)) + E A / a^2) in plane strain; the hoop force is E A u / a.

    Quadratic elements give the pressure to their nodes by Simpson's rule, and the shell its force by equal parts.
    """
    young, poisson, stiffness = 20e6, 0.25, 40e6
    supports = [bridge.roller(BOTTOM, (0, 1)), bridge.roller(TOP, (0, 1))]
    fem = cylinder((8, 4), mpm.LinearElastic(young=young, poisson=poisson), supports, height=1.0, **options)
    fem.reconfigure(members={"shell": mpm.beam([(RADIUS, 0.0), (RADIUS, 1.0)], stiffness, BENDING)})
    fem.solve(bridge.Load(pressure={RIM: PRESSURE}))
    soil = young / (RADIUS * (1 + poisson) * (1 - 2 * poisson))
    moved = -PRESSURE / (soil + stiffness / RADIUS**2)
    forces = fem.member_forces("shell")
    assert np.allclose(forces.displacement[:, 0], moved, rtol=exact)
    assert np.allclose(forces.hoop_force, stiffness * moved / RADIUS, rtol=exact)
    assert np.allclose(forces.axial_force, 0.0, atol=exact * stiffness * abs(moved)) and "hoop force" in repr(forces)


def test_a_cylinder_yields_in_its_hoops():
    supports = [bridge.roller(BOTTOM, (0, 1)), bridge.roller(TOP, (0, 1))]
    fem = cylinder((8, 4), mpm.LinearElastic(young=20e6, poisson=0.25), supports, height=1.0, degree=1)
    shell = mpm.beam([(RADIUS, 0.0), (RADIUS, 1.0)], 40e6, BENDING, spacing=0.25, plastic_moment=1e3)
    weak = mpm.Member(**{**vars(shell), "compressive_strength": 500.0})
    fem.reconfigure(members={"shell": weak})
    fem.solve(bridge.Load(pressure={RIM: PRESSURE}))
    assert np.allclose(fem.member_forces("shell").hoop_force, -500.0)
    # The soil carries the rest of the pressure, q - N / a.
    soil = 20e6 / (RADIUS * 1.25 * 0.5)
    assert np.allclose(fem.member_forces("shell").displacement[:, 0], -(PRESSURE - 250.0) / soil, rtol=1e-6)


def test_other_members_are_refused_in_axial_symmetry():
    fem = cylinder((4, 2), mpm.LinearElastic(young=1e6, poisson=0.2), [bridge.fixed(BOTTOM)])
    line = [(0.5, 0.1), (0.5, 0.4)]
    for member, message in (
        (mpm.bar(line, 1e6), "'one' is no beam in an axisymmetric body"),
        (mpm.strut(*line, 1e6), "'one' is no beam in an axisymmetric body"),
        (mpm.beam(line, 1e9, 1e6, bond_strength=1e3), "'one' is a beam with a bond_strength"),
        (mpm.beam([(-0.5, 0.1), (0.5, 0.1)], 1e9, 1e6), "'one' reaches to x = -0.5 m in an axisymmetric body"),
        (mpm.beam([(0.5, 0.5), (0.0, 0.5), (0.0, 0.1)], 1e9, 1e6), "'one' runs along the axis of an axisymmetric body"),
    ):
        with pytest.raises(mpm.InputError, match=f"members: {message}"):
            fem.reconfigure(members={"one": member})
    assert not fem.members


def test_shells_in_ground_that_consolidates_carry_in_the_end_what_they_do_without_a_flow():
    domain, _, facet_tags = bridge.box_mesh(COMM, (4.0, 2.0), (8, 4))
    supports = [bridge.roller(AXIS, (1, 0)), bridge.roller(RIM, (1, 0)), bridge.fixed(BOTTOM)]
    law, geometry, load = (
        mpm.LinearElastic(young=10e6, poisson=0.3),
        mpm.Geometry.AXISYMMETRIC,
        bridge.Load(18e3, {TOP: 30e3}),
    )
    shells = {
        "raft": mpm.beam([(0.0, 2.0), (2.0, 2.0)], 1e9, 5e6, clamped_start=True),
        "pipe": mpm.beam([(2.0, 2.0), (2.0, 1.0)], 1e8, 5e5),
    }
    level = lambda x: 9810.0 * (2.0 - x[:, 1])
    fem = bridge.QuasiStatic(domain, law, facet_tags, supports, geometry=geometry)
    fem.reconfigure(pore_pressure=level)
    fem.solve(bridge.Load(18e3))
    model = water.Consolidation(
        domain,
        law,
        water.PorousSoil(1e-6),
        facet_tags,
        supports,
        [water.Reservoir(TOP, 2.0)],
        load=load,
        geometry=geometry,
    )
    model.initialise(fem, level)
    for body in (model, fem):
        body.reconfigure(members=shells)
    assert all(model.advance(dt).converged for dt in (1e3, 1e5, 1e8))
    fem.solve(load)
    for name in shells:
        for part in ("axial_force", "moment", "hoop_force", "hoop_moment"):
            found, expected = (getattr(one.member_forces(name), part) for one in (model, fem))
            assert np.allclose(found, expected, rtol=0, atol=1e-6 * np.abs(expected).max() + 1e-6), (name, part)


def test_water_outside_of_a_shaft_presses_its_wall_together():
    """N = -p R under a uniform pressure of the water in soft ground: dry within, where nothing is, and where soil was dug away."""
    for inner in (RADIUS, 0.0):
        domain, _, facet_tags = bridge.box_mesh(COMM, (2 * RADIUS - inner, 0.5), (8 if inner else 16, 2))
        domain.geometry.x[:, 0] += inner
        cells = np.arange(len(tag_values(domain, None, 2)), dtype=np.int32)
        outside = compute_midpoints(domain, 2, cells)[:, 0] > RADIUS
        cell_tags = meshtags(domain, 2, cells, np.where(outside, 1, 2).astype(np.int32))
        supports = [bridge.roller(RIM, (1, 0)), bridge.roller(BOTTOM, (0, 1)), bridge.roller(TOP, (0, 1))]
        supports += [] if inner else [bridge.roller(AXIS, (1, 0))]
        fem = bridge.QuasiStatic(domain, mpm.LinearElastic(young=1.0, poisson=0.0), facet_tags, supports, cell_tags=cell_tags,
                                 geometry=mpm.Geometry.AXISYMMETRIC)  # fmt: skip
        wall = mpm.beam([(RADIUS, 0.0), (RADIUS, 0.5)], 1e8, 1e6, impervious=True)
        water_outside = lambda x: np.where(x[:, 0] > RADIUS, PRESSURE, 0.0)
        fem.reconfigure(off=[] if inner else [2], members={"shell": wall}, pore_pressure=water_outside)
        fem.solve(bridge.Load())
        forces = fem.member_forces("shell").hoop_force
        assert np.allclose(forces, -PRESSURE * RADIUS, rtol=1e-3)  # a cell's nodes have the pressure by Simpson's rule
        assert forces.mean() == pytest.approx(-PRESSURE * RADIUS, rel=1e-6)
