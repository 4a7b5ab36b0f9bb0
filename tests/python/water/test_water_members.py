"""Structural members in ground that consolidates: drained and undrained limits, prestress, take-over, inertia, wrong input."""

import warnings

import numpy as np
import pytest
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water

COMM = MPI.COMM_WORLD
LEFT, RIGHT, BASE, TOP = 1, 2, 3, 4
OF_WATER = 9810.0
SOIL = mpm.LinearElastic(young=5e6, poisson=0.2)
SHEAR = SOIL.young / (2 * (1 + SOIL.poisson))
LONG = 1e14
"""Time after which no excess pressure is left [s]"""
BODIES = pytest.mark.parametrize(
    ("element", "nmd"),
    [(water.Element.TAYLOR_HOOD, False), (water.Element.STABILISED, False), (water.Element.STABILISED, True)],
    ids=["taylor_hood", "stabilised", "nmd"],
)
WALL_AND_TIES = {
    "wall": mpm.beam([(1.7, 2.0), (1.7, 0.6)], 1e8, 2e6),  # on no line of the mesh
    "tie": mpm.strut((1.7, 1.8), (-3.0, 1.8), 5e6, prestress=2e3, fixed_end=True),
    "nail": mpm.bar([(1.7, 1.3), (3.3, 0.9)], 4e6),
}


def hydrostatic(x):
    return OF_WATER * (2.0 - x[:, -1])


def load(size=1.0):
    """Weight of the ground, and a load on its surface that also pushes it to the right."""
    return bridge.Load(18e3, {TOP: 10e3 * size}, traction={TOP: (4e3 * size, 0.0)})


def ground(comm=COMM, element=water.Element.TAYLOR_HOOD, nmd=False, law=SOIL, size=1.0, **options):
    """Ground, 4 m by 2 m, with water up to its surface, on which a load acts from the beginning."""
    domain, cell_tags, facet_tags = bridge.box_mesh(comm, (4.0, 2.0), (8, 4))
    supports = [bridge.fixed(BASE), bridge.roller(LEFT, (1, 0)), bridge.roller(RIGHT, (1, 0))]
    options.setdefault("boundary", [water.Head(TOP, 2.0)])
    model = water.Consolidation(
        domain, law, water.PorousSoil(1e-8), facet_tags, supports, load=load(size), element=element, nmd=nmd,
        cell_tags=cell_tags, **options,
    )  # fmt: skip
    model.initialise(pore_pressure=hydrostatic)
    return model


def drained(model, members, size=1.0):
    """Finite elements without a flow of water: the same ground with its members under hydrostatic pressure."""
    fem = bridge.QuasiStatic(
        model.domain, SOIL, model._facet_tags, model._supports.supports, model.degree, model._nmd,
        as_particles=model._nmd, cell_tags=model.cell_tags,
    )  # fmt: skip
    fem.reconfigure(pore_pressure=hydrostatic, members=members)
    fem.solve(load(size), first_step=1.0)
    assert fem.converged
    return fem


def require_same(model, fem, tolerance):
    """Forces and displacements of all members in both, over the largest of each member."""
    assert list(model.members) == list(fem.members)
    for name in fem.members:
        found, expected = model.member_forces(name), fem.member_forces(name)
        for part in ("axial_force", "moment", "displacement"):
            values, exact = getattr(found, part), getattr(expected, part)
            assert np.allclose(values, exact, rtol=0, atol=tolerance * max(np.abs(exact).max(), 1e-9)), (name, part)


@BODIES
def test_what_members_carry_in_the_end_is_what_they_carry_without_flow(element, nmd):
    """Elastic soil forgets how the water left: members, loads and pore pressures are those of a body without flow."""
    model = ground(element=element, nmd=nmd)
    model.reconfigure(members=WALL_AND_TIES, duration=1.5 * LONG)
    assert model.advance(LONG).converged
    half = model.member_forces("nail").axial_force
    assert model.advance(LONG).converged
    fem = drained(model, WALL_AND_TIES)
    require_same(model, fem, 1e-7)
    assert model.reaction(BASE) == pytest.approx(fem.reaction(BASE), rel=1e-7)
    assert fem.member_forces("tie").axial_force == pytest.approx([2e3])
    assert np.abs(half - fem.member_forces("nail").axial_force).max() > 100.0
    assert model.advance(LONG).converged  # the tie is locked off, in ground that does not move any more
    require_same(model, fem, 1e-7)


@BODIES
def test_forces_of_members_are_held_and_released_evenly(element, nmd):
    """What is in equilibrium stays; and drained elastic soil is half way when half of the duration of a removal is over."""
    model = ground(element=element, nmd=nmd)
    without = {name: one for name, one in WALL_AND_TIES.items() if name != "tie"}
    model.initialise(drained(model, WALL_AND_TIES), hydrostatic)
    model.reconfigure(duration=2 * LONG)
    assert model.advance(LONG).converged
    still = np.abs(model.displacement.x.array).max()
    model.reconfigure(members=without, duration=2 * LONG)
    moved = []
    for _ in range(2):
        assert model.advance(LONG).converged
        moved.append(model.displacement.x.array.copy())
    largest = np.abs(moved[1]).max()
    assert largest > 1e-6
    assert still < 1e-6 * largest
    assert np.abs(moved[1] - 2 * moved[0]).max() < 1e-5 * largest


@BODIES
def test_removed_members_leave_elastic_soil_as_without_them(element, nmd):
    model = ground(element=element, nmd=nmd)
    model.reconfigure(members=WALL_AND_TIES)
    assert model.advance(1e5).converged
    model.reconfigure(members={})
    assert model.members == {}
    without = ground(element=element, nmd=nmd)
    assert without.advance(1e5).converged
    apart = np.abs(model.displacement.x.array - without.displacement.x.array).max()
    for each in (model, without):
        assert each.advance(LONG).converged and each.advance(LONG).converged
    assert np.abs(model.displacement.x.array - without.displacement.x.array).max() < 1e-7 * apart


@BODIES
def test_bars_and_struts_in_three_dimensions_end_as_without_flow(element, nmd):
    domain, _, facet_tags = bridge.box_mesh(COMM, (1.0, 1.0, 1.0), (2, 2, 2))
    supports = [bridge.fixed(5), *(bridge.roller(1 + k, np.eye(3)[k // 2]) for k in range(4))]
    members = {
        "bar": mpm.bar([(0.2, 0.3, 1.0), (0.7, 0.6, 0.1)], 3e6),
        "strut": mpm.strut((0.9, 0.9, 0.8), (0.9, 3.0, 1.2), 2e6, fixed_end=True),
    }
    push, level = bridge.Load(18e3, {6: 20e3}, traction={6: (5e3, 8e3, 0.0)}), lambda x: OF_WATER * (1.0 - x[:, 2])
    model = water.Consolidation(
        domain, SOIL, water.PorousSoil(1e-8), facet_tags, supports, [water.Head(6, 1.0)], load=push, element=element, nmd=nmd
    )  # fmt: skip
    model.initialise(pore_pressure=level)
    model.reconfigure(members=members)
    assert model.advance(1.0).converged
    early = model.member_forces("strut").axial_force
    assert model.advance(LONG).converged and model.advance(LONG).converged
    fem = bridge.QuasiStatic(domain, SOIL, facet_tags, supports, model.degree, nmd, as_particles=nmd)
    fem.reconfigure(pore_pressure=level, members=members)
    fem.solve(push, first_step=1.0)
    require_same(model, fem, 1e-7)
    assert abs(early / fem.member_forces("strut").axial_force - 1) > 0.02


@BODIES
def test_a_bar_in_a_plate_load_test_carries_its_share_before_any_water_leaves(element, nmd):
    """Uniform strain e under a rigid plate, all boundaries being impervious: the reaction is (M + K_w / n) e b + E A e."""
    strain, modulus, stiffness = 1e-3, 4e6, 3e6
    domain, _, facet_tags = bridge.box_mesh(COMM, (1.0, 2.0), (3, 5))
    supports = [bridge.roller(BASE, (0, 1)), bridge.roller(LEFT, (1, 0)), bridge.roller(RIGHT, (1, 0)),
                bridge.prescribed(TOP, (None, -2 * strain))]  # fmt: skip
    model = water.Consolidation(
        domain, SOIL, water.PorousSoil(1e-8, porosity=0.4), facet_tags, supports, [], load=bridge.Load(displacement=1.0),
        element=element, nmd=nmd, water_modulus=modulus,
    )  # fmt: skip
    model.reconfigure(members={"bar": mpm.bar([(0.43, 0.0), (0.43, 2.0)], stiffness)})
    assert model.advance(1e-3).converged
    assert np.allclose(model.member_forces("bar").axial_force, -stiffness * strain, rtol=1e-6)
    carried = SOIL.p_wave_modulus + modulus / 0.4 + stiffness
    assert model.reaction(TOP)[1] == pytest.approx(carried * strain, rel=1e-6)


def reinforced(pressure, stiffness, element, nmd):
    """Mean axial force of a geotextile over time, in a block of clay under a uniform pressure that is free at its right side.

    The block is impervious in the first, short step, and then drains at its right side.
    """
    domain, _, facet_tags = bridge.box_mesh(COMM, (4.0, 2.0), (8, 4))
    supports = [bridge.roller(LEFT, (1, 0)), bridge.roller(BASE, (0, 1))]
    model = water.Consolidation(
        domain, SOIL, water.PorousSoil(1e-8), facet_tags, supports, [], load=bridge.Load(pressure={TOP: pressure}),
        element=element, nmd=nmd, water_modulus=np.inf,
    )  # fmt: skip
    model.reconfigure(members={"geotextile": mpm.bar([(0.0, 0.9), (3.3, 0.9)], stiffness)})
    assert model.advance(1e-3).converged
    forces = [model.member_forces("geotextile").axial_force]
    model.boundary = [water.Head(RIGHT, 1.0)]
    for dt in (2e5, 4e5, 8e5, 16e5, LONG):
        assert model.advance(dt).converged
        forces.append(model.member_forces("geotextile").axial_force)
    return np.array(forces)


@BODIES
def test_the_force_of_a_geotextile_falls_as_pore_pressure_dissipates(element, nmd):
    """Clay under a pressure q spreads by q / 4G while no water leaves, and in the end by nu q / 2G: a soft geotextile follows it.

    A stiff one holds the clay back, so that it is strained less at both times. The head of the drained side acts in the same way
    with and without q, so that the difference of both is due to q, the soil being elastic.
    """
    pressure, soft, stiff = 10e3, 1.0, 5e6
    due = {one: reinforced(pressure, one, element, nmd) - reinforced(0.0, one, element, nmd) for one in (soft, stiff)}
    at_once, at_last = pressure / (4 * SHEAR), SOIL.poisson * pressure / (2 * SHEAR)
    assert np.allclose(due[soft][0], soft * at_once, rtol=1e-6)
    assert np.allclose(due[soft][-1], soft * at_last, rtol=1e-6)
    for force in due.values():
        assert np.all(np.diff(force.mean(axis=1)) < 0)
    assert np.all(due[stiff][0] < stiff * at_once) and np.all(due[stiff][-1] < stiff * at_last)


def test_a_prestress_holds_until_its_duration_ends_and_then_follows_the_strain():
    stiffness, length, prestress = 5e6, 3.0, 20e3
    model = ground(size=0.0)
    assert model.advance(LONG).converged
    anchor = mpm.strut((3.0, 1.5), (3.0, 1.5 + length), stiffness, prestress=prestress, fixed_end=True)
    model.reconfigure(members={"anchor": anchor}, duration=3e4)
    assert model.member_forces("anchor").axial_force == pytest.approx([prestress], rel=0)
    lifted = []
    for _ in range(3):
        assert model.advance(1e4).converged
        assert model.member_forces("anchor").axial_force == pytest.approx([prestress], rel=0)
        lifted.append(model.member_forces("anchor").displacement[0, 1])
    assert 0 < lifted[0] < lifted[1] < lifted[2]
    assert model.advance(1e6).converged  # the ground around it consolidates under its pull
    slackened = model.member_forces("anchor").displacement[0, 1] - lifted[-1]
    assert slackened > 1e-6
    expected = prestress - stiffness * slackened / length
    assert model.member_forces("anchor").axial_force == pytest.approx([expected], rel=1e-9)
    model.reconfigure()  # nothing changes
    assert model.member_forces("anchor").axial_force == pytest.approx([expected], rel=1e-9)
    model.reconfigure(members={"anchor": anchor}, duration=1e4)  # it is there already, and is not stressed again
    assert model.advance(1e4).converged
    assert model.member_forces("anchor").axial_force[0] < prestress


@BODIES
def test_members_are_taken_over_from_finite_elements_in_equilibrium(element, nmd):
    model = ground(element=element, nmd=nmd)
    fem = drained(model, WALL_AND_TIES)
    model.initialise(fem, hydrostatic)
    before = {name: fem.member_forces(name) for name in WALL_AND_TIES}
    assert model.members == WALL_AND_TIES
    for dt in (1e3, 1e6):
        assert model.advance(dt).converged
        for name, old in before.items():
            new = model.member_forces(name)
            assert np.abs(new.axial_force - old.axial_force).max() < 1e-8 * np.abs(old.axial_force).max()
            assert np.abs(new.moment - old.moment).max() <= 1e-8 * np.abs(old.moment).max(initial=0.0)
            assert np.abs(new.displacement).max() < 1e-8 * np.abs(old.displacement).max()  # counted from now on
    model.load = load(2.0)
    for dt in (1e3, LONG, LONG):
        assert model.advance(dt).converged
    fem.solve(load(2.0), first_step=1.0)
    for name in WALL_AND_TIES:
        expected = fem.member_forces(name).axial_force
        assert model.member_forces(name).axial_force == pytest.approx(expected, abs=1e-7 * np.abs(expected).max())


def test_a_step_that_fails_changes_no_member():
    clay = mpm.MohrCoulomb(young=5e6, poisson=0.2, cohesion=6e3, friction_angle=20.0, dilation_angle=20.0)
    members = WALL_AND_TIES | {"wall": mpm.beam([(1.7, 2.0), (1.7, 0.6)], 1e8, 2e6, plastic_moment=500.0)}
    found = []
    for fails in (False, True):
        model = ground(law=clay, boundary=[water.Head(TOP, 2.0)])
        model.reconfigure(members=members, duration=2e4)
        assert model.advance(1e4).converged
        if fails:
            before = {name: model.member_forces(name) for name in members}
            model.load = bridge.Load(18e3, {TOP: 10e3}, traction={TOP: (50e3, 0.0)})
            assert not model.advance(2e4).converged
            for name, old in before.items():
                new = model.member_forces(name)
                assert np.array_equal(new.axial_force, old.axial_force)
                assert np.array_equal(new.moment, old.moment)
                assert np.array_equal(new.displacement, old.displacement)
            model.load = load()
        assert model.advance(1e4).converged  # the prestress has held
        assert model.member_forces("tie").axial_force == pytest.approx([2e3], rel=0)
        assert model.advance(1e5).converged
        found.append([model.member_forces(name).axial_force for name in members] + [model.member_forces("wall").moment])
    for one, other in zip(*found):
        assert np.allclose(one, other, rtol=1e-9, atol=1e-9 * np.abs(one).max(initial=0.0))


@pytest.mark.parametrize("element", list(water.Element))
def test_a_mass_on_a_spring_swings_as_newmarks_method_says(element):
    """Soil 1e5 times stiffer than a strut slides on a roller: the trapezoidal rule turns by 2 atan(w dt / 2) in a step."""
    length, width, height, density = 2.0, 2.0, 1.0, 2000.0
    mass, velocity = density * width * height, 0.01
    domain, _, facet_tags = bridge.box_mesh(COMM, (width, height), (4, 2))
    stiff = mpm.LinearElastic(young=1e10, poisson=0.2)
    model = water.Consolidation(
        domain, stiff, water.PorousSoil(1e-8, density=density), facet_tags, [bridge.roller(BASE, (0, 1))],
        [water.Head(TOP, height)], load=bridge.Load(OF_WATER), element=element, inertia=water.Newmark(0.25, 0.5),
    )  # fmt: skip
    model.initialise(pore_pressure=lambda x: OF_WATER * (height - x[:, 1]))
    stiffness = 1e5
    spring = mpm.strut((2.0, 0.5), (2.0 + length, 0.5), stiffness * length, fixed_end=True)
    model.reconfigure(members={"spring": spring})
    model.motion.set_velocity((velocity, 0.0))
    frequency, dt, swings = np.sqrt(stiffness / mass), 0.1, []
    for _ in range(40):
        assert model.advance(dt).converged
        swings.append(model.member_forces("spring").axial_force[0])
    steps = np.arange(1, 41)
    expected = -stiffness * velocity / frequency * np.sin(2 * steps * np.arctan(frequency * dt / 2))
    assert np.ptp(expected) > 1.9 * stiffness * velocity / frequency
    assert np.abs(swings - expected).max() < 1e-3 * np.abs(expected).max()
    # The force of a spring that is taken out falls linearly, and the momentum changes by half of it times the duration.
    speed = lambda: model.motion.velocity.x.array.reshape(-1, 2)[:, 0].mean()
    force, before = model.member_forces("spring").axial_force[0], speed()
    model.reconfigure(members={}, duration=4 * dt)
    for _ in range(4):
        assert model.advance(dt).converged
    pushed = force * 4 * dt / (2 * mass)
    assert speed() - before == pytest.approx(pushed, rel=2e-3)
    assert abs(pushed) > 0.05 * velocity
    after = speed()
    assert model.advance(dt).converged
    assert speed() == pytest.approx(after, rel=1e-6)


def test_members_that_do_not_fit_are_refused_and_change_nothing():
    model = ground()
    model.reconfigure(members=WALL_AND_TIES)
    assert model.advance(1e4).converged
    bar = mpm.bar([(0.5, 0.5), (1.5, 0.5)], 1e6)
    for members, message in (
        ({"b": mpm.bar([(0.5, 0.5, 0.5), (0.6, 0.5, 0.5)], 1e6)}, "members: 'b' has 3 dimensions, expected 2"),
        ({"b": mpm.bar([(0.5, 0.5), (0.5, 3.0)], 1e6)}, "the member 'b': the point .* is in no soil that is there"),
        ([bar], "members is .*, expected a dictionary"),
    ):
        with pytest.raises(mpm.InputError, match=message):
            model.reconfigure(members=members)
        assert model.members == WALL_AND_TIES
    with pytest.raises(mpm.InputError, match="name is 'pile', expected one of .*'wall', 'tie', 'nail'"):
        model.member_forces("pile")
    with pytest.raises(mpm.InputError, match="stress is a QuasiStatic without the member 'wall' of this model"):
        model.initialise(drained(model, {"bar": bar}), hydrostatic)
    assert model.advance(1e4).converged
    domain, _, facet_tags = bridge.box_mesh(COMM, (1.0, 1.0), (2, 2))
    round_body = water.Consolidation(
        domain, SOIL, water.PorousSoil(1e-8), facet_tags, [bridge.fixed(BASE), bridge.roller(LEFT, (1, 0))],
        [water.Head(TOP, 1.0)], geometry=mpm.Geometry.AXISYMMETRIC,
    )  # fmt: skip
    with pytest.raises(mpm.InputError, match="members: 'b' is no beam in an axisymmetric body"):
        round_body.reconfigure(members={"b": mpm.bar([(0.2, 0.5), (0.8, 0.5)], 1e6)})


def test_water_that_flows_through_an_impervious_wall_is_said():
    model = ground()
    with pytest.warns(RuntimeWarning, match="water flows through 'wall' in water.Consolidation"):
        model.reconfigure(members={"wall": mpm.beam([(2.0, 2.0), (2.0, 0.5)], 1e9, 2e7, impervious=True)})


def test_an_impervious_wall_that_is_taken_over_is_said_once():
    model, wall = ground(), mpm.beam([(2.0, 2.0), (2.0, 0.5)], 1e9, 2e7, impervious=True)
    fem = drained(model, {"wall": wall})
    with pytest.warns(RuntimeWarning, match="water flows through 'wall' in water.Consolidation"):
        model.initialise(fem, hydrostatic)
    with warnings.catch_warnings():
        warnings.filterwarnings("error", message="water flows through")
        model.reconfigure(members=model.members)
        model.initialise(fem, hydrostatic)


def test_a_new_beginning_leaves_members_with_their_prestress_alone():
    model = ground()
    model.reconfigure(members=WALL_AND_TIES)
    for dt in (1e4, 1e6):
        assert model.advance(dt).converged
    assert abs(model.member_forces("tie").axial_force[0] - 2e3) > 100.0
    model.initialise(pore_pressure=hydrostatic)
    assert model.member_forces("tie").axial_force == pytest.approx([2e3], rel=0)
    for name in WALL_AND_TIES:
        forces = model.member_forces(name)
        assert not forces.displacement.any() and not forces.moment.any()
        assert name == "tie" or not forces.axial_force.any()
    again = ground()
    again.reconfigure(members=WALL_AND_TIES)
    for dt in (1e4, 1e6):
        assert model.advance(dt).converged and again.advance(dt).converged
    for name in WALL_AND_TIES:
        expected = again.member_forces(name).axial_force
        assert model.member_forces(name).axial_force == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())
