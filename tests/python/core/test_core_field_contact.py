"""Contact between velocity fields: a block that slides on a layer or sticks to it, impacts, and a body that falls on another."""

import warnings

import numpy as np
import pytest
from core_cases import box
from field_contact_cases import DENSITY, GRAVITY, LENGTH, block_on_layer, fill, velocity_of, weight

import mpm_core as mpm

ALIGNED = box((28, 14), (1.4, 0.7), diagonals="alternating")
PLACES = {"along cells": (ALIGNED, 0.0), "through cells": (ALIGNED, 0.017), "irregular": (None, 0.0)}


def mean_force(model, contact, start, end, **options):
    """Mean force on the second body from one time to another."""
    list(model.explicit(start, pic=0.05, **options))
    before = contact.impulse
    list(model.explicit(end, pic=0.05, **options))
    return (contact.impulse - before) / (end - start)


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("angle, friction", [(30.0, 0.3), (40.0, 0.5), (25.0, 0.0)])
def test_a_block_slides_with_coulomb_friction(place, angle, friction):
    mesh, shift = PLACES[place]
    model, contact = block_on_layer(angle, friction, mesh=mesh, shift=shift)
    list(model.explicit(0.1, pic=0.05))  # until shear waves have gone through the block
    before, start = contact.impulse, velocity_of(model, 1)
    *_, report = model.explicit(0.35, pic=0.05)
    force, acceleration = (contact.impulse - before) / 0.25, (velocity_of(model, 1) - start) / 0.25
    along, normal = weight(angle)
    assert -force[0] / force[1] == pytest.approx(friction, abs=0.005 * friction + 1e-12)
    assert force[1] == pytest.approx(normal, rel=0.03)  # the block still oscillates on the layer
    # Newton's second law for the block: no other force acts on it
    mass = DENSITY * LENGTH * 0.2
    np.testing.assert_allclose(mass * acceleration, [along + force[0], force[1] - normal], atol=1e-9 * along * 1e3)
    assert report.friction_work == pytest.approx(
        -force[0] * 0.25 * (velocity_of(model, 1)[0] + start[0]) / 2, rel=0.15
    ) or (friction == 0 and abs(report.friction_work) < 1e-2 * report.external_work)


@pytest.mark.parametrize("place", PLACES)
def test_a_block_sticks_below_the_angle_of_friction(place):
    mesh, shift = PLACES[place]
    model, contact = block_on_layer(20.0, 0.5, mesh=mesh, shift=shift)
    force = mean_force(model, contact, 0.1, 0.4)
    along, normal = weight(20.0)
    np.testing.assert_allclose(force, [-along, normal], rtol=0.01)
    free = np.array([GRAVITY * np.sin(np.radians(20.0)) * 0.4, 0.0])
    assert np.linalg.norm(velocity_of(model, 1)) < 0.01 * free[0]


@pytest.mark.parametrize("place, error", [("along cells", 0.1), ("irregular", 0.1), ("through cells", 0.15)])
def test_adhesion_adds_to_friction(place, error):
    # where the block slides, T = mu N + a L; the area is found from the volumes of the bodies, to a particle
    mesh, shift = PLACES[place]
    adhesion, friction = 500.0, np.tan(np.radians(12.0))
    model, contact = block_on_layer(35.0, friction, mesh=mesh, shift=shift, adhesion=adhesion)
    list(model.explicit(0.1, pic=0.05, damping=0.5))
    force = mean_force(model, contact, 0.1, 0.4)
    assert -force[0] - friction * force[1] == pytest.approx(adhesion * LENGTH, rel=error)
    # tan(critical) = tan(phi) + a / (rho g t cos(critical)), here 26.4 degrees: three degrees below it the block stays
    held, contact = block_on_layer(23.4, friction, mesh=mesh, shift=shift, adhesion=adhesion)
    list(held.explicit(0.1, pic=0.05, damping=0.5))
    force = mean_force(held, contact, 0.1, 0.4)
    assert -force[0] == pytest.approx(weight(23.4)[0], rel=0.005)


@pytest.mark.parametrize("friction", [0.0, 0.4])
@pytest.mark.parametrize(
    "dim, update",
    [(2, mpm.StressUpdate.MODIFIED_LAST), (2, mpm.StressUpdate.FIRST), (3, mpm.StressUpdate.MODIFIED_LAST)],
)
def test_an_impact_keeps_momentum_and_loses_energy(update, friction, dim):
    mesh = box((48, 24) if dim == 2 else (12, 6, 6), (2.4, 1.2, 1.2)[:dim], shake=0.15)
    soil = mpm.LinearElastic(young=1e5, poisson=0.3)
    model = mpm.Model(mesh, [soil, soil], velocity_fields=[0, 1])
    spacing = 0.0125 if dim == 2 else 0.1
    fill(model, (0.5,) + (0.4,) * (dim - 1), (0.9,) + (0.8,) * (dim - 1), density=1000.0, material=0, spacing=spacing)
    fill(model, (1.2,) + (0.3,) * (dim - 1), (1.6,) + (0.7,) * (dim - 1), density=500.0, material=1, spacing=spacing)
    contact = model.add_field_contact((1.0, 0.0, 0.0)[:dim], friction=friction)
    second = model.particles.material == 1
    model.particles.set("velocity", np.where(second[:, None], -1.0, 0.5) * np.eye(dim)[0])
    momentum = np.array(model.report().momentum)
    energies, touched = [], []
    # With FIRST single reports have an energy balance that light nodes spoil, also where nothing touches.
    limit = None if update == mpm.StressUpdate.FIRST else 0.2
    for report in model.explicit(0.5, every=0.005, pic=0.02, stress_update=update, energy_limit=limit):
        np.testing.assert_allclose(report.momentum, momentum, atol=1e-10 * report.mass)
        energies.append(report.kinetic_energy + report.stored_energy)
        touched.append(contact.nodes)
    assert touched[0] == 0 and max(touched) > 3
    assert max(energies) < (1 + 1e-9) * energies[0]
    assert 0 < report.friction_work < energies[0] - report.kinetic_energy
    if dim == 2:  # in three dimensions the cells are four times as large
        assert abs(report.unexplained_fraction) < 0.01
    # two free blocks have separated again, and did not pass through one another
    x, second = model.particles.position[:, 0], model.particles.material == 1
    assert x[~second].max() < x[second].min()
    mass = model.particles.mass[second].sum()
    np.testing.assert_allclose(contact.impulse, mass * (velocity_of(model, 1) + np.eye(dim)[0]), atol=1e-9 * mass)


def test_nothing_is_felt_before_the_particles_touch():
    mesh = box((10, 20), (1.0, 2.0), diagonals="alternating", shake=0.2)
    soil = mpm.LinearElastic(young=1e6, poisson=0.2)
    model = mpm.Model(mesh, [soil, soil], velocity_fields=[0, 1])
    fill(model, (0.0, 0.0), (1.0, 0.5), density=2000.0, material=0, spacing=0.05)
    fill(model, (0.3, 0.73), (0.7, 1.03), density=1000.0, material=1, spacing=0.05)
    for tag in (1, 2, 3):
        model.fix(tag)
    model.set_gravity((0.0, -10.0))
    contact = model.add_field_contact((0.0, 1.0))
    # it falls through 0.23 m, less 5 % of a cell: 0.1 m wide cells, h = 0.1 m
    until = np.sqrt(2 * (0.23 - 0.005) / 10.0)
    list(model.explicit(until))
    second = model.particles.material == 1
    assert contact.nodes == 0 and not contact.impulse.any()
    np.testing.assert_allclose(model.particles.displacement[second, 1], -(0.23 - 0.005), atol=1e-3)
    list(model.explicit(until + 0.02))
    assert contact.impulse[1] > 0
    list(model.explicit(until + 0.5, pic=0.1))
    assert model.particles.position[second, 1].min() > 0.5 - 0.02  # it stays above


@pytest.mark.parametrize("update", [mpm.StressUpdate.MODIFIED_LAST, mpm.StressUpdate.FIRST])
def test_a_restart_goes_on_to_the_last_bit(tmp_path, update):
    model, contact = block_on_layer(30.0, 0.3, mesh=ALIGNED, adhesion=100.0)
    list(model.explicit(0.02, stress_update=update, energy_limit=None))
    model.save(tmp_path / "state.h5")
    same, _ = block_on_layer(30.0, 0.3, mesh=ALIGNED, contact=False)
    same.restore(tmp_path / "state.h5")
    for each in (model, same):
        *_, report = each.explicit(0.05, stress_update=update, energy_limit=None)
    np.testing.assert_array_equal(model.particles.velocity, same.particles.velocity)
    np.testing.assert_array_equal(contact.impulse, same.field_contacts[0].impulse)
    assert report.friction_work == model.report().friction_work > 0
    block_on_layer(30.0, 0.3, mesh=ALIGNED, contact=False)[0].save(tmp_path / "before.h5")
    model.restore(tmp_path / "before.h5")
    for use in (repr, lambda contact: contact.force, lambda contact: contact.touching()):
        with pytest.raises(
            mpm.InputError, match="field contact 0 is not in the model, which has 0 since it was restored"
        ):
            use(contact)


def test_bodies_on_a_curved_interface():
    # A ring around a disc of the same soil: the normals are radial, and a pressure outside goes through the interface.
    mesh = box((16, 16), (2.0, 2.0), diagonals="alternating")
    soil = mpm.LinearElastic(young=1e6, poisson=0.2)
    model = mpm.Model(mesh, [soil, soil], velocity_fields=[0, 1])
    # Not on diagonals, where a point could be in either triangle, so that mesh and particles are symmetric.
    grid = (np.indices((64, 48)).reshape(2, -1).T + 0.5) / (32, 24)
    radius = np.linalg.norm(grid - 1.0, axis=1)
    for law, inside in ((0, radius < 0.4), (1, (radius > 0.4) & (radius < 0.8))):
        model.seed_points(grid[inside], np.full(inside.sum(), 1 / (32 * 24)), density=1000.0, material=law)
    contact = model.add_field_contact(mpm.Disc((1.0, 1.0), 0.4), friction=0.2)
    outward = (model.particles.position - 1.0) / np.linalg.norm(model.particles.position - 1.0, axis=1)[:, None]
    model.particles.set("velocity", -0.1 * outward * (model.particles.material == 1)[:, None])
    list(model.explicit(2e-3))
    points, normals, forces = contact.touching()
    assert len(points) > 8
    arms = points - 1.0
    np.testing.assert_allclose(normals, arms / np.linalg.norm(arms, axis=1)[:, None], atol=1e-12)
    assert (np.einsum("ni,ni->n", forces, normals) > 0).all()  # pushes the ring outward
    assert np.linalg.norm(contact.impulse) < 1e-9 * np.abs(forces).sum() * 2e-3  # as it is symmetric


@pytest.mark.parametrize(
    "arguments, message",
    [
        ({"interface": (0.0, 0.0)}, "normal|length|direction"),
        ({"interface": (0.0, 1.0, 0.0)}, "interface"),
        ({"interface": (0.0, 1.0), "second": 2}, "second is 2, expected the number of a velocity field, 0 to 1"),
        ({"interface": (0.0, 1.0), "second": 0}, "first and second are both 0"),
        ({"interface": (0.0, 1.0), "friction": -0.1}, "friction is -0.1"),
        ({"interface": (0.0, 1.0), "adhesion": -1.0}, "adhesion is -1.0"),
        ({"interface": mpm.Sphere((0.0, 0.0, 0.0), 1.0)}, "Sphere"),
    ],
)
def test_bad_arguments_are_refused(arguments, message):
    model, _ = block_on_layer(0.0, 0.0, mesh=ALIGNED, contact=False)
    with pytest.raises(mpm.InputError, match=message):
        model.add_field_contact(**arguments)
    assert model.field_contacts == []


def test_fields_touch_once():
    model, _ = block_on_layer(0.0, 0.0, mesh=ALIGNED)
    with pytest.raises(mpm.InputError, match="in contact already"):
        model.add_field_contact((0.0, 1.0), first=1, second=0)


@pytest.mark.parametrize("interface, first", [((0.0, -1.0), 0), ((0.0, 1.0), 1), (mpm.Plane((0, 0.3), (0, -1)), 0)])
def test_an_interface_that_points_the_wrong_way_is_noticed(interface, first):
    """A block on the ground would sink into it and then be held as in tension."""
    elastic = mpm.LinearElastic(young=1e6, poisson=0.2)
    for direction, reversed_ in ((interface, True), ((0.0, 1.0 if first == 0 else -1.0), False)):
        model = mpm.Model(box((12, 8), (1.2, 0.8)), [elastic] * 2, velocity_fields=[0, 1])
        for (low, high), (bottom, top), material in (((0, 24), (0, 6), 0), ((8, 16), (6, 10), 1)):
            columns, rows = np.meshgrid(np.arange(low, high), np.arange(bottom, top))
            points = (np.column_stack([columns.ravel(), rows.ravel()]) + 0.5) * 0.05
            model.seed_points(points, np.full(len(points), 0.05**2), density=1000.0, material=material)
        model.fix(3)
        model.set_gravity((0, -10.0))
        model.add_field_contact(direction, first=first, second=1 - first)
        with warnings.catch_warnings(record=True) as found:
            warnings.simplefilter("always")
            next(iter(model.explicit(1e-3, every_steps=1)))
        assert any("turn it round" in str(one.message) for one in found) == reversed_
