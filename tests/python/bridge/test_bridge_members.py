"""Bars, struts and beams in finite elements: against closed forms of bars, beams and sliding blocks."""

import math

import numpy as np
import pytest
from dolfinx.mesh import compute_midpoints, meshtags
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge.structures.bond import bond_strengths, slip_tangent
from mpm_core import _core

COMM = MPI.COMM_WORLD
LEFT, RIGHT, BOTTOM, TOP = 1, 2, 3, 4


def body(lengths, counts, law, supports, **options):
    domain, cell_tags, facet_tags = bridge.box_mesh(COMM, lengths, counts)
    return bridge.QuasiStatic(domain, law, facet_tags, supports, cell_tags=cell_tags, **options)


def tagged(lengths, counts, number_of):
    """Mesh of a box, tags of its cells, a function of the positions (x, y) of their centres, and tags of its facets."""
    domain, _, facet_tags = bridge.box_mesh(COMM, lengths, counts)
    cells = np.arange(bridge.original_cells(domain).size, dtype=np.int32)
    numbers = number_of(*compute_midpoints(domain, 2, cells)[:, :2].T)
    return domain, meshtags(domain, 2, cells, numbers.astype(np.int32)), facet_tags


@pytest.mark.parametrize("options", [{"degree": 1}, {"degree": 2}, {"degree": 4}, {"degree": 1, "nmd": True}])
def test_a_bar_and_soil_share_the_force_of_a_plate_by_their_stiffness(options):
    young, stiffness, strain = 1e6, 3e6, 0.005
    supports = [bridge.roller(BOTTOM, (0, 1)), bridge.roller(LEFT, (1, 0)), bridge.prescribed(TOP, (None, -2 * strain))]
    fem = body((1.0, 2.0), (4, 8), mpm.LinearElastic(young=young, poisson=0.0), supports, **options)
    fem.reconfigure(members={"bar": mpm.bar([(0.43, 0.0), (0.43, 2.0)], stiffness)})  # on no line of the mesh
    fem.solve(bridge.Load(displacement=1.0))
    forces = fem.member_forces("bar")
    assert np.allclose(forces.axial_force, -stiffness * strain, rtol=1e-9)
    assert fem.reaction(TOP)[1] == pytest.approx(young * strain + stiffness * strain, rel=1e-9)
    assert np.allclose(forces.displacement[:, 1], -strain * forces.positions[:, 1], atol=1e-12)


def simply_supported(cells, degree=2):
    """Deflection and moments of a beam on two supports under 1 kPa; the soil below it is 1e5 times softer."""
    length, pressure, stiffness = 4.0, 1e3, 1e6
    supports = [bridge.roller(LEFT, (0, 1)), bridge.prescribed(RIGHT, (0.0, 0.0))]
    fem = body((length, 0.5), (cells, 2), mpm.LinearElastic(young=1e-3, poisson=0.0), supports, degree=degree)
    fem.reconfigure(members={"beam": mpm.beam([(0.0, 0.5), (length, 0.5)], 1e8, stiffness)})
    fem.solve(bridge.Load(pressure={TOP: pressure}))
    return fem.member_forces("beam"), 5 * pressure * length**4 / (384 * stiffness), pressure * length**2 / 8


def test_a_beam_on_two_supports_bends_as_by_euler_and_bernoulli():
    errors = []
    for cells in (8, 16):
        forces, deflection, moment = simply_supported(cells)
        errors.append(-forces.displacement[:, 1].min() / deflection - 1)
        assert forces.moment.max() == pytest.approx(moment, rel=1e-4)
    assert errors[0] < 0.01
    assert errors[1] == pytest.approx(errors[0] / 4, rel=0.02)  # second order


def test_moment_and_shear_follow_the_convention_of_their_docstring():
    forces, _, moment = simply_supported(8)
    # Loaded from above its upper side, the left one seen along it, is compressed, so that the moment is positive. The pressure on a
    # quadratic element acts at the middle of its edge by two thirds: moments are exact at the corners.
    x = forces.positions[::2, 0]
    assert np.allclose(forces.moment[::2], 1e3 * x * (4 - x) / 2, atol=1e-4 * moment)
    assert np.allclose(forces.shear_force.reshape(-1, 2).mean(axis=1), 1e3 * (2 - (x[1:] + x[:-1]) / 2), atol=0.2)


def test_a_plastic_hinge_limits_the_moment_and_the_soil_carries_the_rest():
    length, limit = 4.0, 1e3
    supports = [bridge.fixed(BOTTOM), bridge.roller(LEFT, (0, 1)), bridge.roller(RIGHT, (0, 1))]

    def solved(plastic_moment):
        fem = body((length, 1.0), (8, 2), mpm.LinearElastic(young=1e4, poisson=0.0), supports)
        fem.reconfigure(members={"beam": mpm.beam([(0.0, 1.0), (length, 1.0)], 1e8, 1e6, plastic_moment)})
        fem.solve(bridge.Load(pressure={TOP: 1e3}))
        assert fem.converged
        return fem.member_forces("beam")

    elastic, plastic = solved(math.inf), solved(limit)
    assert 1.2 * limit < elastic.moment.max() < 1e3 * length**2 / 8
    assert plastic.moment.max() == pytest.approx(limit)
    assert -plastic.displacement[:, 1].min() > 1.2 * -elastic.displacement[:, 1].min()


def test_a_strut_is_a_spring_between_soil_and_a_fixed_point():
    stiffness, length, pressure = 5e6, 2.0, 20e3
    fem = body((3.0, 1.0), (12, 4), mpm.LinearElastic(young=5e6, poisson=0.2), [bridge.fixed(LEFT)])
    fem.reconfigure(members={"strut": mpm.strut((3.0, 0.5), (3.0 + length, 0.5), stiffness, fixed_end=True)})
    fem.solve(bridge.Load(pressure={RIGHT: -pressure}))  # pulls the body against the strut
    forces = fem.member_forces("strut")
    moved = forces.displacement[0, 0]
    assert forces.axial_force == pytest.approx([-stiffness * moved / length], rel=1e-9)
    assert moved > 0
    assert forces.displacement[1] == pytest.approx([0.0, 0.0])
    assert fem.reaction(LEFT)[0] == pytest.approx(pressure + forces.axial_force[0], rel=1e-6)  # it pulls at the support


def test_a_prestress_is_that_at_the_end_of_its_stage_and_then_follows_the_strain(tmp_path):
    fem = body((3.0, 1.0), (12, 4), mpm.LinearElastic(young=5e6, poisson=0.2), [bridge.fixed(LEFT)])
    site = bridge.FemSite(fem)
    tie = mpm.strut((3.0, 0.5), (5.0, 0.5), 5e6, prestress=30e3, fixed_end=True)
    tags = fem.soils
    site.carry_out(bridge.Stage("ground", fill=tags, unit_weight=dict.fromkeys(tags, 0.0)))
    site.carry_out(bridge.Stage("tie", install={"tie": tie}))
    assert fem.member_forces("tie").axial_force == pytest.approx([30e3])
    pulled = fem.member_forces("tie").displacement[0, 0]
    assert pulled > 0
    site.carry_out(bridge.Stage("pull", pressure={RIGHT: -10e3}))
    forces = fem.member_forces("tie")
    slackened = forces.displacement[0, 0] - pulled
    assert slackened > 0
    assert forces.axial_force == pytest.approx([30e3 - 5e6 * slackened / 2.0], rel=1e-9)
    site.carry_out(bridge.Stage("without", pressure={RIGHT: 0.0}, remove="tie"))
    assert fem.members == {}
    assert np.abs(fem.displacement.x.array).max() < 1e-9  # elastic: all of it has gone back


def test_a_prestress_that_a_load_without_stages_has_reached_follows_the_strain():
    fem = body((3.0, 1.0), (12, 4), mpm.LinearElastic(young=5e6, poisson=0.2), [bridge.fixed(LEFT)])
    fem.reconfigure(members={"tie": mpm.strut((3.0, 0.5), (5.0, 0.5), 5e6, prestress=30e3, fixed_end=True)})
    fem.solve(bridge.Load(pressure={RIGHT: 5e3}))
    assert fem.member_forces("tie").axial_force == pytest.approx([30e3])
    before = fem.member_forces("tie").displacement[0, 0]
    fem.solve(bridge.Load(pressure={RIGHT: 0.0}))
    forces = fem.member_forces("tie")
    assert forces.axial_force == pytest.approx([30e3 - 5e6 * (forces.displacement[0, 0] - before) / 2.0], rel=1e-9)
    assert forces.axial_force[0] < 30e3


def tied():
    """A block of elastic soil with a prestressed tie that has not been stressed yet."""
    fem = body((3.0, 1.0), (12, 4), mpm.LinearElastic(young=5e6, poisson=0.2), [bridge.fixed(LEFT)])
    tie = {"tie": mpm.strut((3.0, 0.5), (5.0, 0.5), 5e6, prestress=30e3, fixed_end=True)}
    fem.reconfigure(members=tie)
    return fem, tie


def test_a_prestress_follows_the_strain_after_the_equilibrium_that_stresses_it():
    fem, _ = tied()
    assert fem.equilibrate(bridge.Load()).converged
    assert fem.member_forces("tie").axial_force == pytest.approx([30e3])
    before = fem.member_forces("tie").displacement[0, 0]
    assert fem.equilibrate(bridge.Load(pressure={RIGHT: -10e3})).converged
    forces = fem.member_forces("tie")
    slackened = forces.displacement[0, 0] - before
    assert slackened > 0
    assert forces.axial_force == pytest.approx([30e3 - 5e6 * slackened / 2.0], rel=1e-9)


def test_a_search_for_collapse_begins_with_the_whole_prestress():
    fem, _ = tied()
    first = []
    bridge.collapse_load(
        fem, lambda q: bridge.Load(pressure={TOP: q}), first_step=1.0, tolerance=0.5,
        progress=lambda step: first.append(fem.member_forces("tie").axial_force[0]),
    )  # fmt: skip
    assert first[0] == pytest.approx(30e3)


def test_a_given_initial_stress_leaves_members_undeformed():
    fem, _ = tied()
    fem.solve(bridge.Load())
    fem.solve(bridge.Load(pressure={RIGHT: -10e3}))
    fem.set_initial_stress(np.zeros_like(fem.points.stress), bridge.Load())
    forces = fem.member_forces("tie")
    assert forces.axial_force == pytest.approx([30e3])
    assert np.all(forces.displacement == 0.0)


def test_a_member_that_a_stage_removes_and_installs_is_stressed_anew():
    tie = tied()[1]
    fem = body((3.0, 1.0), (12, 4), mpm.LinearElastic(young=5e6, poisson=0.2), [bridge.fixed(LEFT)])
    site = bridge.FemSite(fem)
    site.carry_out(bridge.Stage("tie", fill=fem.soils, unit_weight=dict.fromkeys(fem.soils, 0.0), install=tie))
    site.carry_out(bridge.Stage("pull", pressure={RIGHT: -10e3}))
    assert fem.member_forces("tie").axial_force[0] < 29e3
    site.carry_out(bridge.Stage("again", remove="tie", install=tie))
    assert fem.member_forces("tie").axial_force == pytest.approx([30e3])


def slab(thick=0.1):
    """A strong slab 6 m long on a thin layer of clay on a rigid base; the strength of the clay is 10 kPa."""
    domain, cell_tags, facet_tags = tagged((6.0, 0.3), (60, 3), lambda x, y: np.where(y < thick, 1, 2))
    laws = {1: mpm.tresca(young=20e6, poisson=0.3, shear_strength=10e3), 2: mpm.LinearElastic(young=200e6, poisson=0.3)}
    return bridge.QuasiStatic(domain, laws, facet_tags, [bridge.fixed(BOTTOM)], cell_tags=cell_tags)


@pytest.mark.parametrize("strength", [0.0, 15e3])
def test_a_slab_on_clay_slides_under_the_strength_of_the_clay_and_of_its_tie(strength):
    """Limit analysis: a horizontal traction t on the top slides the slab at t L = s_u L + T."""
    fem = slab()
    if strength:
        tie = mpm.strut((0.05, 0.2), (-3.0, 0.2), 50e6, tensile_strength=strength, fixed_end=True)
        fem.reconfigure(members={"tie": tie})
    found = bridge.collapse_load(fem, lambda t: bridge.Load(traction={TOP: (t, 0.0)}), first_step=2e3)
    assert found.failed
    assert found.value == pytest.approx(10e3 + strength / 6.0, rel=0.015)
    if strength:
        assert fem.member_forces("tie").axial_force == pytest.approx([strength])


def test_the_factor_of_safety_leaves_the_strength_of_members_as_it_is():
    """t L = s_u L / F + T."""
    fem, traction, strength = slab(), 9e3, 20e3
    fem.reconfigure(
        members={"tie": mpm.strut((0.05, 0.2), (-3.0, 0.2), 50e6, tensile_strength=strength, fixed_end=True)}
    )
    found = bridge.factor_of_safety(fem, bridge.Load(traction={TOP: (traction, 0.0)}), start=1.0)
    assert found.failed
    assert found.value == pytest.approx(10e3 / (traction - strength / 6.0), rel=0.015)


def test_the_stiffness_has_its_entries_at_the_same_places_where_members_yield():
    """The solver adds a part of its first matrix to tangents that are singular, entry by entry (it crashed in a nailed cut)."""
    fem = body((2.0, 1.0), (8, 4), mpm.LinearElastic(young=1e6, poisson=0.2), [bridge.fixed(BOTTOM)])
    nail = mpm.bar([(0.3, 0.6), (1.7, 0.4)], 1e6, tensile_strength=1e3)
    fem.reconfigure(members={"nail": nail, "tie": mpm.strut((0.3, 0.8), (1.7, 0.9), 1e6, tensile_strength=1e3)})
    members, kinematics = fem._members, fem._kinematics
    kinematics.strain_increment()
    soil, held = kinematics.stiffness(), np.zeros(0, dtype=int)
    elastic = members.with_stiffness(soil, held)
    members._tangent = 0.0 * members._tangent
    yielding = members.with_stiffness(soil, held)
    for one, other in zip(elastic.getValuesCSR()[:2], yielding.getValuesCSR()[:2]):
        assert np.array_equal(one, other)
    assert elastic.norm() > yielding.norm()


def test_a_geogrid_carries_no_compression():
    supports = [bridge.roller(BOTTOM, (0, 1)), bridge.roller(LEFT, (1, 0)), bridge.prescribed(TOP, (None, -0.01))]
    fem = body((1.0, 2.0), (4, 8), mpm.LinearElastic(young=1e6, poisson=0.0), supports)
    fem.reconfigure(members={"grid": mpm.bar([(0.4, 0.0), (0.4, 2.0)], 3e6, compressive_strength=0.0)})
    fem.solve(bridge.Load(displacement=1.0))
    assert np.all(fem.member_forces("grid").axial_force == 0.0)
    assert fem.reaction(TOP)[1] == pytest.approx(1e6 * 0.005, rel=1e-9)


@pytest.mark.parametrize(("degree", "cells"), [(1, 2), (2, 2), (1, 4)])
def test_an_anchor_is_pulled_out_by_the_strength_of_its_bond(degree, cells):
    """A block on rollers hangs on an anchor alone, whose body of 1.5 m slips under the force q L, on all meshes alike."""
    bond, length = 4e3, 1.5
    domain, cell_tags, facet_tags = tagged(
        (4.0, 2.0), (4 * cells, 2 * cells), lambda x, y: np.digitize(x, [1, 1.5]) + 1
    )
    soil = mpm.LinearElastic(young=20e6, poisson=0.3)
    supports = [bridge.fixed(LEFT), bridge.roller(BOTTOM, (0, 1))]
    fem = bridge.QuasiStatic(domain, soil, facet_tags, supports, degree=degree, cell_tags=cell_tags)
    anchor = mpm.bar([(0.7, 1.0), (3.5, 1.0)], 100e6, bond_strength=bond, free_length=1.3, connected=True)
    fem.reconfigure(off=[2], members={"anchor": anchor})
    fem.solve(bridge.Load(traction={RIGHT: (0.9 * bond * length / 2.0, 0.0)}))
    assert fem.converged
    forces = fem.member_forces("anchor")
    assert forces.axial_force[0] == pytest.approx(0.9 * bond * length, rel=1e-6)
    change = np.abs(np.diff(forces.axial_force))
    middles = (forces.positions[1:, 0] + forces.positions[:-1, 0]) / 2
    assert np.all(change[1:] <= bond * np.diff(middles)[1:] * (1 + 1e-9))
    with pytest.warns(RuntimeWarning, match="the load was not reached"):
        fem.solve(bridge.Load(traction={RIGHT: (1.02 * bond * length / 2.0, 0.0)}), tolerance=0.01)
    assert fem.member_forces("anchor").axial_force[0] == pytest.approx(bond * length, rel=2e-3)


def test_the_stiffness_of_a_bar_that_slips_is_the_derivative_of_its_forces():
    lengths, stiffness = np.array([0.5, 0.4, 0.6, 0.5, 0.3, 0.4]), 1e6
    member = mpm.bar([(0.0, 0.0), (2.7, 0.0)], stiffness, tensile_strength=900.0, bond_strength=700.0, connected=True)
    bond, limits = bond_strengths(member, lengths), (np.full(6, -np.inf), np.full(6, 900.0))
    assert bond[0] == math.inf and bond[1:] == pytest.approx([315.0, 350.0, 385.0, 280.0, 245.0, 140.0])
    strain = np.array([1.2e-3, 0.7e-3, 0.6e-3, 0.1e-3, 0.3e-3, 0.02e-3])

    def forces(strains):
        return _core.forces_with_slip(stiffness * strains, stiffness / lengths, *limits, bond)

    found = forces(strain)
    assert found[0] == 900.0 and found[3] - found[4] < 280.0  # the first yields, and some nodes stick
    assert np.any(np.isclose(np.abs(np.diff(found)), bond[1:-1]))  # others slip
    expected = stiffness * slip_tangent(found, limits, bond, lengths)
    small = 1e-9
    for k in range(6):
        step = np.zeros(6)
        step[k] = small
        assert np.allclose((forces(strain + step) - found) / small, expected[:, k], atol=1e-3 * stiffness)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: mpm.bar([(0, 0)], 1e6), "points is .*, expected two or more"),
        (lambda: mpm.bar([(0, 0), (0, 0)], 1e6), "expected points that differ"),
        (lambda: mpm.bar([(0, 0), (1, 0)], 0.0), "axial_stiffness is 0.0 N/m, expected a positive number"),
        (lambda: mpm.bar([(0, 0), (1, 0)], 1e6, tensile_strength=-1.0), "tensile_strength is -1.0"),
        (lambda: mpm.bar([(0, 0), (1, 0)], 1e6, tensile_strength=0.0, compressive_strength=0.0), "carries nothing"),
        (lambda: mpm.bar([(0, 0), (1, 0)], 1e6, tensile_strength=1e3, prestress=2e3), "prestress is 2000 N/m"),
        (lambda: mpm.bar([(0, 0), (1, 0)], 1e6, spacing=-1.0), "spacing is -1.0 m"),
        (lambda: mpm.bar([(0, 0), (1, 0)], 1e6, bond_strength=-1.0), "bond_strength is -1.0"),
        (
            lambda: mpm.bar([(0, 0), (1, 0)], 1e6, free_length=1.0),
            "free_length is 1.0, expected 0.0 <= free_length < 1.0",
        ),
        (lambda: mpm.beam([(0, 0), (1, 0)], 1e6, 0.0), "bending_stiffness is 0.0"),
        (lambda: mpm.beam([(0, 0, 0), (1, 0, 0)], 1e6, 1e6), "beams are for plane strain"),
        (lambda: mpm.strut((0, 0), (1, 0), 1e6, fixed_end="yes"), "fixed_end is 'yes'"),
    ],
)
def test_members_that_cannot_be_name_what_is_wrong(make, message):
    with pytest.raises(mpm.InputError, match=message):
        make()


@pytest.mark.parametrize(
    ("members", "message"),
    [
        ({"wall": mpm.bar([(0.5, 0.5), (0.5, 3.0)], 1e6)}, "member 'wall': the point .* is in no soil"),
        ({"nail": mpm.bar([(0, 0, 0), (1, 0, 0)], 1e6)}, "members: 'nail' has 3 dimensions, expected 2"),
        ({"nail": 3}, "members is .*, expected a dictionary"),
    ],
)
def test_members_that_do_not_fit_the_body_change_nothing(members, message):
    fem = body((1.0, 2.0), (2, 4), mpm.LinearElastic(young=1e6, poisson=0.0), [bridge.fixed(BOTTOM)])
    with pytest.raises(mpm.InputError, match=message):
        fem.reconfigure(members=members)
    assert fem.members == {}


def test_stages_that_install_and_remove_what_is_not_there_are_errors():
    fem = body((1.0, 2.0), (2, 4), mpm.LinearElastic(young=1e6, poisson=0.0), [bridge.fixed(BOTTOM)])
    site, nail = bridge.FemSite(fem), mpm.bar([(0.2, 0.5), (0.8, 0.5)], 1e6)
    weights = dict.fromkeys(fem.soils, 20e3)
    site.carry_out(bridge.Stage("ground", fill=fem.soils, unit_weight=weights, install={"nail": nail}))
    with pytest.raises(mpm.InputError, match=r"stage 'twice': install: the member 'nail' is there already"):
        site.carry_out(bridge.Stage("twice", install={"nail": nail}))
    with pytest.raises(
        mpm.InputError, match=r"stage 'none': remove: there is no member 'tie', expected one of \['nail'\]"
    ):
        site.carry_out(bridge.Stage("none", remove="tie"))
    with pytest.raises(mpm.InputError, match="stage 'list': install is .*, expected a dictionary"):
        site.carry_out(bridge.Stage("list", install=[nail]))
    with pytest.raises(mpm.InputError, match=r"name is 'tie', expected one of \['nail'\]"):
        fem.member_forces("tie")


def test_a_stage_that_digs_soil_away_from_a_member_changes_nothing():
    domain, cell_tags, facet_tags = tagged((4.0, 2.0), (16, 8), lambda x, y: np.where((x < 2) & (y > 1), 2, 1))
    soil, supports = mpm.LinearElastic(young=10e6, poisson=0.3), [bridge.fixed(BOTTOM), bridge.roller(LEFT, (1, 0))]
    fem = bridge.QuasiStatic(domain, soil, facet_tags, supports, cell_tags=cell_tags)
    site = bridge.FemSite(fem)
    nail = {"nail": mpm.bar([(1.0, 1.5), (3.0, 1.4)], 10e6)}
    site.carry_out(bridge.Stage("ground", fill=[1, 2], unit_weight={1: 20e3, 2: 20e3}, install=nail))
    stress = fem.points.stress.copy()
    with pytest.raises(mpm.InputError, match="the member 'nail': the point .* is in no soil that is there"):
        site.carry_out(bridge.Stage("cut", excavate=2))
    assert np.array_equal(fem.points.stress, stress)
    assert tuple(fem.off) == ()
    site.carry_out(bridge.Stage("nothing"))
    assert np.allclose(fem.points.stress, stress, atol=1e-6 * np.abs(stress).max())


def test_stages_find_members_in_no_soil_before_anything_is_computed():
    domain, cell_tags, facet_tags = tagged((2.0, 2.0), (8, 8), lambda x, y: np.where(y < 1, 1, 2))
    fem = bridge.QuasiStatic(
        domain, mpm.LinearElastic(young=1e6, poisson=0.0), facet_tags, [bridge.fixed(BOTTOM)], cell_tags=cell_tags
    )
    site, weight = bridge.FemSite(fem), {1: 20e3, 2: 20e3}
    nail, strut = mpm.bar([(0.2, 1.5), (1.8, 1.5)], 1e6), mpm.strut((-3.0, 0.5), (1.0, 0.5), 1e6, fixed_end=True)
    early = [bridge.Stage("base", fill=1, unit_weight=weight, install={"nail": nail}), bridge.Stage("top", fill=2)]
    dug = [
        bridge.Stage("all", fill=[1, 2], unit_weight=weight, install={"nail": nail}),
        bridge.Stage("dig", excavate=2),
    ]
    turned = [bridge.Stage("all", fill=[1, 2], unit_weight=weight, install={"strut": strut})]
    for stages, message in (
        (early, r"stage 'base': the member 'nail': the point \(0.2, 1.5\) m is in no soil"),
        (dug, r"stage 'dig': the member 'nail': the point \(0.2, 1.5\) m is in no soil"),
        (
            turned,
            r"stage 'all': the member 'strut', whose last point is the one that is held in space: the point \(-3, 0.5\) m",
        ),
    ):
        with pytest.raises(mpm.InputError, match=message):
            list(bridge.carry_out(site, stages))
        assert site.number == 0 and site.state.there == () and fem.members == {}
    assert list(bridge.carry_out(site, [*dug[:1], bridge.Stage("out", excavate=2, remove="nail")]))[-1].number == 2


def test_a_prestress_that_the_soil_does_not_bear_has_a_reason_without_a_number_that_is_none():
    fem = body((3.0, 1.0), (12, 4), mpm.tresca(young=5e6, poisson=0.3, shear_strength=5e3), [bridge.fixed(BOTTOM)])
    fem.reconfigure(members={"tie": mpm.strut((3.0, 0.9), (5.0, 0.9), 5e6, prestress=1e6, fixed_end=True)})
    with pytest.warns(RuntimeWarning, match="the load was not reached") as found:
        fem.solve(bridge.Load())
    assert not any("nan" in str(one.message) for one in found)


def test_names_of_soils_whose_strength_stays_are_known_after_stages():
    """A slab under t on clay of 10 kPa: half of it is not reduced, t L = s_u L (1 + 1 / F) / 2."""
    domain, numbers, facet_tags = tagged((6.0, 0.3), (60, 3), lambda x, y: np.where(y > 0.1, 3, np.where(x < 3, 1, 2)))
    cell_tags = bridge.name_tags(numbers, {"left": 1, "right": 2, "slab": 3})
    clay = mpm.tresca(young=20e6, poisson=0.3, shear_strength=10e3)
    laws = {"left": clay, "right": clay, "slab": mpm.LinearElastic(young=200e6, poisson=0.3)}
    fem = bridge.QuasiStatic(domain, laws, facet_tags, [bridge.fixed(BOTTOM)], cell_tags=cell_tags)
    site = bridge.FemSite(fem)
    site.carry_out(bridge.Stage("ground", fill=list(laws), unit_weight=dict.fromkeys(laws, 0.0)))
    load = bridge.Load(traction={TOP: (8e3, 0.0)})
    found = bridge.factor_of_safety(fem, load, start=1.0, unreduced=["left"])
    assert found.value == pytest.approx(1 / (2 * 8 / 10 - 1), rel=0.03)
