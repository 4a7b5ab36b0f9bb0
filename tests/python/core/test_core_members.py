"""Structural members that move with particles: against springs, pendulums, plastic ties and the finite elements' equilibrium."""

import math

import numpy as np
import pytest
from mpi4py import MPI
from mpm_core.member_methods import take_members

import fenics_bridge as bridge
import mpm_core as mpm

COMM = MPI.COMM_WORLD
LEFT, RIGHT, BOTTOM, TOP = 1, 2, 3, 4
BLOCK = (1.0, 0.5, 1.5, 1.0)
"""Lower left and upper right corner of a block, 0.5 m wide"""


def block_model(gravity=(0.0, 0.0), boxes=(BLOCK,), counts=(24, 24), lengths=(3.0, 3.0), density=2000.0):
    """Stiff blocks without supports in an empty mesh."""
    domain, cell_tags, facet_tags = bridge.box_mesh(COMM, lengths, counts)
    model = mpm.Model(bridge.background_mesh(domain, cell_tags, facet_tags), mpm.LinearElastic(young=50e6, poisson=0.2))
    size = 0.5 * lengths[0] / counts[0]  # two by two particles in a square
    for x0, y0, x1, y1 in boxes:
        x, y = (np.arange(low + size / 2, high, size) for low, high in ((x0, x1), (y0, y1)))
        points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        model.seed_points(points, np.full(len(points), size**2), density=density)
    model.set_gravity(gravity)
    return model


def mean(model, name):
    p = model.particles
    return np.average(getattr(p, name), axis=0, weights=p.mass)


def test_a_block_on_a_strut_swings_as_a_mass_on_a_spring():
    model, stiffness, length, speed = block_model(), 2e6, 1.0, 0.5
    model.install({"strut": mpm.strut((1.25, 0.75), (1.25, 0.75 + length), stiffness * length, fixed_end=True)})
    model.particles.set("velocity", np.tile((0.0, -speed), (len(model.particles), 1)))
    frequency = math.sqrt(stiffness / (2000 * 0.25))
    quarter = math.pi / 2 / frequency
    list(model.explicit(until=quarter))
    force = model.member_forces("strut").axial_force[0]
    assert force == pytest.approx(speed * math.sqrt(stiffness * 500), rel=0.03)  # v sqrt(k m), at the turning point
    assert abs(mean(model, "velocity")[1]) < 0.03 * speed
    list(model.explicit(until=2 * quarter))
    assert mean(model, "velocity")[1] == pytest.approx(speed, rel=0.03)


def test_a_tie_that_yields_holds_a_falling_block_by_its_strength():
    strength, gravity = 2e3, 10.0
    model = block_model(gravity=(0.0, -gravity))
    model.install({"tie": mpm.strut((1.25, 0.75), (1.25, 2.0), 50e6, tensile_strength=strength, fixed_end=True)})
    list(model.explicit(until=0.1))
    assert model.member_forces("tie").axial_force[0] == pytest.approx(strength, rel=1e-9)
    acceleration = gravity - strength / 500.0
    assert mean(model, "velocity")[1] == pytest.approx(-acceleration * 0.1, rel=0.02)


def test_a_block_on_a_cable_swings_as_a_pendulum_by_a_large_angle():
    length, gravity, time = 1.5, 9.81, 0.4
    pivot = np.array([1.25 - length * math.sin(1.0), 0.75 + length * math.cos(1.0)])
    model = block_model(gravity=(0.0, -gravity), lengths=(3.0, 3.0))
    model.install({"cable": mpm.strut((1.25, 0.75), pivot, 20e6, compressive_strength=0.0, fixed_end=True)})
    list(model.explicit(until=time))
    angle, rate, steps = 1.0, 0.0, 4000
    for _ in range(steps):  # semi-implicit Euler, to 1e-4
        rate -= gravity / length * math.sin(angle) * time / steps
        angle += rate * time / steps
    expected = pivot + length * np.array([math.sin(angle), -math.cos(angle)])
    moved = mean(model, "position")
    assert np.linalg.norm(moved - expected) < 0.01 * np.linalg.norm(expected - (1.25, 0.75))
    assert np.linalg.norm(moved - pivot) == pytest.approx(length, rel=2e-3)


def test_blocks_that_part_are_held_by_the_bond_of_their_anchor():
    """Its head is connected in the upper block, and its body of 0.4 m slips in the lower one under the force q L."""
    bond, length, time = 3e3, 0.4, 0.05
    model = block_model(boxes=(BLOCK, (1.0, 1.75, 1.5, 2.25)))
    anchor = mpm.bar(
        [(1.25, 2.0), (1.25, 0.55)], 20e6, bond_strength=bond, free_length=1.05, connected=True, spacing=0.1
    )
    model.install({"anchor": anchor})
    upper = model.particles.position[:, 1] > 1.5
    model.particles.set("velocity", np.where(upper[:, None], (0.0, 0.5), (0.0, -0.5)))
    list(model.explicit(until=time))
    forces = model.member_forces("anchor")
    assert forces.axial_force[0] == pytest.approx(bond * length, rel=1e-9)
    assert np.allclose(-np.diff(forces.axial_force), bond * 0.1 * np.array([0.5, 1.0, 1.0, 1.0]), rtol=1e-6)
    p = model.particles
    change = p.velocity[p.position[:, 1] > 1.5, 1].mean() - 0.5
    assert change == pytest.approx(-bond * length / 500.0 * time, rel=0.05)  # at once but for the elastic beginning


def test_members_between_bodies_conserve_momentum():
    model = block_model(boxes=(BLOCK, (1.0, 1.75, 1.5, 2.25)))
    model.install({"strut": mpm.strut((1.3, 0.9), (1.2, 1.9), 5e6)})
    upper = model.particles.position[:, 1] > 1.5
    model.particles.set("velocity", np.where(upper[:, None], (0.1, 0.5), (0.0, 0.0)))
    before = mean(model, "velocity")
    list(model.explicit(until=0.05))
    assert abs(model.member_forces("strut").axial_force[0]) > 100.0
    assert np.allclose(mean(model, "velocity"), before, atol=1e-12)


def retained(degree=1):
    """Elastic ground with a wall and a nail in equilibrium under its weight, by finite elements; and its mesh."""
    mesh = bridge.box_mesh(COMM, (6.0, 3.0), (24, 12))
    supports = [bridge.fixed(BOTTOM), bridge.roller(LEFT, (1, 0))]
    soil = mpm.LinearElastic(young=10e6, poisson=0.2)
    fem = bridge.QuasiStatic(mesh[0], soil, mesh[2], supports, degree=degree)
    fem.reconfigure(
        members={
            "wall": mpm.beam([(3.1, 3.0), (3.1, 0.8)], 1e8, 2e5, plastic_moment=1e3),
            "nail": mpm.bar([(3.1, 2.5), (5.2, 2.1)], 20e6, prestress=5e3),
        }
    )
    fem.solve(bridge.Load(unit_weight=20e3))
    model = mpm.Model(bridge.background_mesh(*mesh), soil)
    model.seed(density=2000.0, per_cell=3)
    bridge.apply_supports(model, supports)
    model.set_gravity((0.0, -10.0))
    return fem, model


def test_particles_take_members_over_from_finite_elements_in_equilibrium():
    fem, model = retained()
    handover = bridge.initialise(model, fem, equilibrate=False)
    assert handover.unbalanced_ratio < 1e-10
    assert np.abs(fem.member_forces("wall").moment).max() > 50.0
    list(model.explicit(until=0.1, nmd=False))
    for name in ("wall", "nail"):
        before, after = fem.member_forces(name), model.member_forces(name)
        assert np.allclose(after.axial_force, before.axial_force, rtol=0, atol=1e-6 * np.abs(before.axial_force).max())
        assert np.allclose(after.moment, before.moment, rtol=0, atol=1e-6 * max(1.0, np.abs(before.moment).max()))


def test_stiff_members_shorten_the_steps_and_keep_them_stable():
    fem, model = retained()
    bridge.initialise(model, fem, equilibrate=False)
    plain = model.critical_time_step()
    model.install({"stiff": mpm.bar([(1.0, 2.9), (5.0, 0.3)], 50e9)})
    assert model.critical_time_step() < 0.1 * plain
    *_, last = model.explicit(until=0.01, nmd=False)
    assert np.abs(model.particles.velocity).max() < 1e-6  # it is without strain, so that nothing moves
    assert last.dt < model.critical_time_step()
    with pytest.raises(mpm.InputError, match="dt is .*, above the critical time step"):
        list(model.explicit(until=0.02, dt=plain))


def test_a_stiff_member_does_not_make_pic_brake_the_soil():
    """Its fraction is that of a critical step of the cells, however short the steps are that a member asks for."""

    def energy(model):
        return np.sum(model.particles.mass[:, None] * model.particles.velocity**2)

    parts = []
    for members in ({}, {"bar": mpm.bar([(1.1, 0.75), (1.4, 0.75)], 1e9)}):
        model = block_model(counts=(48, 48))
        model.install(members)
        x = model.particles.position - mean(model, "position")
        model.particles.set("velocity", 2.0 * np.column_stack([-x[:, 1], x[:, 0]]))
        before = energy(model)
        list(model.explicit(until=0.02, pic=0.01))
        parts.append(energy(model) / before)
    assert parts[0] < 0.999
    assert parts[1] == pytest.approx(parts[0], abs=0.02)


def test_asking_for_the_critical_step_leaves_the_next_report_as_it_is():
    fem, model = retained()
    bridge.initialise(model, fem, equilibrate=False)
    list(model.explicit(until=0.01, nmd=False))
    assert model.report().unbalanced_ratio < 1e-9
    model.critical_time_step()
    assert model.report().unbalanced_ratio < 1e-9


def test_a_member_leaves_the_mesh_with_the_soil_that_flows_out():
    model = block_model(gravity=(0.0, -20.0), boxes=((1.0, 0.1, 1.5, 0.6),))
    model.outflow(BOTTOM)
    model.install({"bar": mpm.bar([(1.25, 0.15), (1.25, 0.55)], 5e6)})
    list(model.explicit(until=0.35))
    assert len(model.particles) == 0
    assert np.all(model.member_forces("bar").axial_force == 0.0)


def test_a_part_in_the_air_carries_nothing_and_goes_along():
    model = block_model(gravity=(0.0, -10.0))
    model.install({"bar": mpm.bar([(1.25, 0.6), (1.25, 1.9)], 5e6, spacing=0.13)})  # the block ends at 1 m
    list(model.explicit(until=0.1))
    forces = model.member_forces("bar")
    in_air = forces.positions[:-1, 1] > 1.15
    assert in_air.sum() > 3
    assert np.all(forces.axial_force[in_air] == 0.0)
    fall = mean(model, "displacement")
    assert np.allclose(forces.displacement, fall, atol=0.01 * np.linalg.norm(fall))


def test_a_plastic_moment_limits_the_moments_of_a_wall_that_particles_bend():
    limit = 200.0
    domain, cell_tags, facet_tags = bridge.box_mesh(COMM, (6.0, 3.0), (24, 12))
    soil = mpm.LinearElastic(young=1e6, poisson=0.2)

    def pushed(plastic_moment):
        model = mpm.Model(bridge.background_mesh(domain, cell_tags, facet_tags), soil)
        model.seed(density=2000.0, per_cell=3)
        model.fix(BOTTOM)
        model.roller(RIGHT, (1, 0))
        model.install({"wall": mpm.beam([(3.1, 2.9), (3.1, 0.3)], 1e7, 1e5, plastic_moment)})
        model.set_gravity((5.0, -10.0))
        list(model.explicit(until=0.3, rayleigh=mpm.Rayleigh(mass=10.0, plastic_strain=np.inf)))
        return model.member_forces("wall")

    assert np.abs(pushed(math.inf).moment).max() > 1.5 * limit
    assert np.abs(pushed(limit).moment).max() == pytest.approx(limit)


def test_a_run_with_members_goes_on_from_a_checkpoint_to_the_last_bit(tmp_path):
    def made():
        return block_model(gravity=(0.0, -10.0), boxes=(BLOCK, (1.0, 1.75, 1.5, 2.25)))

    members = {"tie": mpm.strut((1.25, 0.75), (1.25, 2.0), 5e6, tensile_strength=1e3),
               "wall": mpm.beam([(1.1, 0.55), (1.1, 0.95)], 1e7, 1e4, spacing=0.1)}  # fmt: skip
    whole, first = made(), made()
    for model in (whole, first):
        model.install(members)
        list(model.explicit(until=0.04, every=0.02))
    first.save(tmp_path / "half.h5")
    again = made()
    again.restore(tmp_path / "half.h5")
    assert again.members == first.members == members
    for model in (whole, again):
        list(model.explicit(until=0.08))
    assert np.array_equal(whole.particles.position[np.argsort(whole.particles.id)],
                          again.particles.position[np.argsort(again.particles.id)])  # fmt: skip
    for name in members:
        one, other = whole.member_forces(name), again.member_forces(name)
        assert np.array_equal(one.axial_force, other.axial_force) and np.array_equal(
            one.displacement, other.displacement
        )


def test_a_damaged_member_in_a_checkpoint_is_an_error_and_changes_nothing(tmp_path):
    model = block_model()
    model.install({"bar": mpm.bar([(1.1, 0.6), (1.4, 0.9)], 5e6)})
    model.save(tmp_path / "good.h5")
    description = mpm.checkpoint_description(tmp_path / "good.h5")
    assert description["members"][0]["name"] == "bar"
    other = block_model()
    other.install({"tie": mpm.bar([(1.1, 0.6), (1.4, 0.9)], 5e6)})
    for damage in ({"axial_force": [1.0]}, {"cells": []}, {"moments": [1.0, 2.0]}):
        entries = [{**description["members"][0], "state": {**description["members"][0]["state"], **damage}}]
        with pytest.raises(mpm.InputError, match="lists whose lengths do not fit"):
            take_members(other, entries)
        take_members(other, description["members"])
        assert list(other.members) == ["bar"]


def test_what_does_not_support_members_says_so():
    model = block_model()
    bar = {"bar": mpm.bar([(1.1, 0.6), (1.4, 0.9)], 5e6)}
    model.install(bar)
    with pytest.raises(mpm.InputError, match="structural members .'bar'., which the implicit scheme does not support"):
        list(model.implicit(until=0.1, dt=0.01))
    with pytest.raises(mpm.InputError, match="equilibrate.. does not support structural members"):
        model.equilibrate()
    with pytest.raises(mpm.InputError, match="transfer is AFFINE with structural members"):
        list(model.explicit(until=0.1, transfer=mpm.Transfer.AFFINE))
    with pytest.raises(mpm.InputError, match="'bar' is installed already"):
        model.install(bar)
    with pytest.raises(mpm.InputError, match="'nail' has 3 dimensions, expected 2"):
        model.install({"nail": mpm.bar([(0, 0, 0), (1, 0, 0)], 5e6)})
    with pytest.raises(mpm.InputError, match=r"structural member 'far' at \(1.25, 3.125\) m is outside"):
        model.install({"far": mpm.bar([(1.25, 0.75), (1.25, 4.0)], 5e6)})
    with pytest.raises(mpm.InputError, match="forces has 'other', expected names of members"):
        model.install({"new": mpm.bar([(1.1, 0.6), (1.4, 0.9)], 5e6)}, {"other": model.member_forces("bar")})
    with pytest.raises(mpm.InputError, match=r"name is 'tie', expected one of \['bar'\]"):
        model.member_forces("tie")
    assert list(model.members) == ["bar"]


def test_a_hand_over_with_members_asks_for_no_equilibration():
    fem, model = retained()
    with pytest.raises(mpm.InputError, match="equilibrate is True, expected False with structural members"):
        bridge.initialise(model, fem)
    model.install({"nail": mpm.bar([(3.1, 2.5), (5.2, 2.1)], 20e6)})
    with pytest.raises(mpm.InputError, match="model has the member 'nail', expected it in fem only"):
        bridge.initialise(model, fem, equilibrate=False)


def test_members_go_where_the_soil_goes_that_has_settled_before_them():
    """Elastic ground of 3 m settles by w = γ (2 H y - y²) / (2 M) at the height y, before its bar is installed."""
    mesh = bridge.box_mesh(COMM, (3.0, 4.0), (12, 16), body=((0.0, 0.0), (3.0, 3.0)))
    soil, supports = mpm.LinearElastic(young=1e6, poisson=0.0), [bridge.fixed(BOTTOM), bridge.roller(LEFT, (1, 0))]
    supports.append(bridge.roller(RIGHT, (1, 0)))
    body, _, facet_tags = bridge.soil_mesh(*mesh, tag=[bridge.BODY])
    fem = bridge.QuasiStatic(body, soil, facet_tags, supports)
    fem.solve(bridge.Load(unit_weight=20e3))
    fem.reconfigure(members={"bar": mpm.bar([(0.5, 2.0), (2.5, 2.0)], 1e6)})
    fem.solve(bridge.Load(unit_weight=20e3))
    model = mpm.Model(bridge.background_mesh(*mesh), soil)
    model.seed(density=2000.0, per_cell=3, cell_tag=bridge.BODY)
    bridge.apply_supports(model, supports)
    model.set_gravity((0.0, -10.0))
    bridge.initialise(model, fem, move=True, equilibrate=False)
    settled = 20e3 * (2 * 3 * 2 - 2**2) / 2e6
    assert np.allclose(model.member_forces("bar").positions[:, 1], 2.0 - settled, atol=1e-6)


def test_a_checkpoint_holds_members_of_numpy_numbers(tmp_path):
    model = block_model()
    bar = mpm.bar(
        [(1.1, 0.6), (1.4, 0.9)], np.int64(5_000_000), tensile_strength=np.float32(1e3), spacing=np.float32(0.5)
    )
    model.install({"bar": bar})
    model.save(tmp_path / "state.h5")
    assert model.members == {"bar": mpm.bar([(1.1, 0.6), (1.4, 0.9)], 5e6, tensile_strength=1e3, spacing=0.5)}


def test_members_of_which_one_does_not_fit_are_not_installed():
    model = block_model()
    model.install({"tie": mpm.bar([(1.1, 0.6), (1.4, 0.9)], 5e6)})
    near, far = mpm.bar([(1.1, 0.6), (1.4, 0.6)], 5e6), mpm.bar([(1.25, 0.75), (1.25, 4.0)], 5e6)
    with pytest.raises(mpm.InputError, match="structural member 'far'"):
        model.install({"near": near, "far": far})
    assert list(model.members) == ["tie"]
    short = mpm.MemberForces(np.array([(1.1, 0.6), (1.2, 0.6), (1.4, 0.6)]), np.zeros((3, 2)), np.ones(1), np.zeros(3))
    with pytest.raises(mpm.InputError, match=r"forces: axial_force of 'near' has shape \(1,\), expected \(2,\)"):
        model.install({"near": near}, {"near": short})
    with pytest.raises(
        mpm.InputError, match="prestress is 5000 N/m, expected a tensile force up to tensile_strength, 0 N/m"
    ):
        mpm.strut((0, 0), (1, 0), 1e8, tensile_strength=0.0, prestress=5e3)
    with pytest.raises(
        mpm.InputError, match="expected a compressive force up to compressive_strength, 2000 N/m; tension is"
    ):
        mpm.strut((0, 0), (1, 0), 1e8, compressive_strength=2e3, prestress=-5e3)
    with pytest.raises(mpm.InputError, match="prestress is inf, expected a finite number"):
        mpm.bar([(0, 0), (1, 0)], 5e6, prestress=math.inf)


def test_a_stage_of_particles_after_members_were_taken_over_changes_nothing():
    domain, cell_tags, facet_tags = bridge.box_mesh(COMM, (4.0, 2.0), (16, 8))
    soil, supports = mpm.LinearElastic(young=10e6, poisson=0.3), [bridge.fixed(BOTTOM)]
    fem = bridge.QuasiStatic(domain, soil, facet_tags, supports, degree=1, cell_tags=cell_tags)
    staged, soils = bridge.FemSite(fem), fem.soils
    nail = {"nail": mpm.bar([(1.0, 1.5), (3.0, 1.4)], 10e6)}
    staged.carry_out(bridge.Stage("ground", fill=soils, unit_weight=dict.fromkeys(soils, 20e3), install=nail))
    model = mpm.Model(bridge.background_mesh(domain, cell_tags, facet_tags), soil)
    site = bridge.ParticleSite(model, dict.fromkeys(soils, 0), supports, per_cell=3)
    site.take_over(staged)
    with pytest.raises(mpm.InputError, match="stage 'load': the model has the members .'nail'., expected no stage"):
        site.carry_out(bridge.Stage("load", pressure={TOP: 10e3}))
    assert site.number == 1
    assert site.state.pressure == {}


def test_an_axisymmetric_model_takes_no_members():
    mesh = bridge.background_mesh(*bridge.box_mesh(COMM, (2.0, 2.0), (4, 4)))
    model = mpm.Model(mesh, mpm.LinearElastic(young=1e6, poisson=0.2), geometry=mpm.Geometry.AXISYMMETRIC)
    with pytest.raises(mpm.InputError, match="members in an axisymmetric model"):
        model.install({"bar": mpm.bar([(0.5, 0.5), (1.5, 0.5)], 5e6)})
    assert model.members == {}


@pytest.mark.parametrize(
    ("member", "message"),
    [
        (mpm.beam([(0.1, 0.9), (0.1, 0.1)], 2.9e6, 79e3), "'it' is as stiff as a plate 0.572 m thick with a Young's modulus of 5.07e.06 Pa"),
        (mpm.beam([(0.1, 0.9), (0.1, 0.1)], 24e6, 1.28e6), "as a plate 0.8 m thick with a Young's modulus of 3e.07 Pa"),
        (mpm.beam([(0.1, 0.9), (0.1, 0.1)], 2.9e9, 79e6, 430.0), "plastic_moment of the member 'it' is 430 N m/m, so that it yields at"),
        (mpm.bar([(0.1, 0.9), (0.8, 0.9)], 30e3), "axial_stiffness of the member 'it' is 30000 N/m, less than"),
        (mpm.bar([(0.1, 0.9), (0.8, 0.9)], 30e6, 60.0), "tensile_strength of the member 'it' is 60 N/m, .* strain of 2e-06"),
        (mpm.strut((0.1, 0.9), (0.8, 0.9), 0.7e9, compressive_strength=800.0), "compressive_strength of the member 'it' is 800 N/m"),
        (mpm.beam([(0.1, 0.9), (0.1, 0.1)], 24e9, 1.28e6), "a plate 0.0253 m thick .* of 9.49e.11 Pa, more than that of steel"),
        (mpm.strut((0.1, 0.9), (0.8, 0.9), 0.7e6), "axial_stiffness of the member 'it' is 700000 N/m, less than that of any strut or tie"),
        (mpm.strut((0.1, 0.9), (0.8, 0.9), 0.7e9, prestress=-60.0), "prestress of the member 'it' is -60 N/m, which hardly"),
        (mpm.bar([(0.1, 0.9), (0.8, 0.9)], 30e6, bond_strength=25.0), "bond_strength of the member 'it' is 25 N/m2, less than"),
    ],
)  # fmt: skip
def test_members_in_kn_are_a_warning_in_particles_and_in_finite_elements(member, message):
    """An AZ 18-700, a diaphragm wall of 0.8 m, a nail and a strut, with stiffness, strength, prestress or bond in kN.

    The wall with EA = 24 GN/m and EI = 1.28 MN m2/m is a plate with t^2 = 12 EI / EA = (0.0253 m)^2 and E = EA / t = 949 GPa.
    """
    mesh = bridge.box_mesh(COMM, (1.0, 1.0), (4, 4))
    model = mpm.Model(bridge.background_mesh(*mesh), mpm.LinearElastic(young=10e6, poisson=0.2))
    with pytest.warns(RuntimeWarning, match=message):
        model.install({"it": member})
    fem = bridge.QuasiStatic(mesh[0], mpm.LinearElastic(young=10e6, poisson=0.2), mesh[2], [bridge.fixed(BOTTOM)])
    with pytest.warns(RuntimeWarning, match=message):
        fem.reconfigure(members={"it": member})


def test_usual_members_are_no_warning(recwarn):
    fem, _ = retained()
    plates = {f"{young:g} {thick}": mpm.beam([(3.0, 3.0), (3.0, 0.8)], young * thick, young * thick**3 / 12, 1e-3 * young * thick**2 / 4)
              for young, thick in ((30e9, 0.8), (5e9, 0.6), (2e9, 0.4))}  # fmt: skip
    grids = {f"grid {k}": mpm.bar([(1.0, 1.0), (5.0, 1.0)], k, 0.1 * k, 0.0) for k in (2e5, 2e6)}
    nail = mpm.bar([(1.0, 1.0), (5.0, 1.0)], 30e6, 20e3, bond_strength=3e3)
    tie = mpm.strut((3.0, 1.0), (5.0, 1.0), 2e7, prestress=2e3)
    slab = mpm.strut((3.0, 1.0), (5.0, 1.0), 9e9, prestress=-10e3)  # of concrete, 0.3 m thick
    liner = mpm.beam([(3.0, 3.0), (3.0, 0.8)], 210e9 * 0.014, 210e9 * 0.014**3 / 12)  # of steel, 14 mm thick
    fem.reconfigure(members={**plates, **grids, "nail": nail, "tie": tie, "slab": slab, "liner": liner})
    assert not [w for w in recwarn if "not in k" in str(w.message)]


@pytest.mark.parametrize(
    ("member", "place"),
    [
        (mpm.bar([(0.2, 2.5), (0.8, 2.6)], 5e6), "0.2, 2.5"),
        (mpm.strut((1.2, 0.8), (2.8, 1.0), 5e6, prestress=10e3), "2.8, 1"),
        (mpm.strut((0.2, 2.5), (-2.0, 2.5), 5e6, fixed_end=True), "0.2, 2.5"),
    ],
)
def test_a_member_in_no_soil_is_a_warning_when_particles_start(member, place):
    model = block_model(gravity=(0.0, -10.0))
    model.install({"up": member})
    with pytest.warns(RuntimeWarning, match=rf"the member 'up' carries nothing: there is no soil at \({place}\) m"):
        model.explicit(until=1e-3).last()


def test_a_member_partly_in_soil_is_no_warning(recwarn):
    model = block_model(gravity=(0.0, -10.0))
    model.install(
        {"bar": mpm.bar([(1.25, 0.6), (1.25, 1.9)], 5e6), "tie": mpm.strut((1.2, 1.0), (0.0, 1.0), 5e6, fixed_end=True)}
    )
    model.explicit(until=1e-3).last()
    assert not [w for w in recwarn if "carries nothing" in str(w.message)]
