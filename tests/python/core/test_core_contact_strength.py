"""The shear strength of rigid surfaces: resistance that grows with velocity, and strength by segments and triangles."""

import re

import numpy as np
import pytest
from core_cases import box
from test_core_contact import G, along, block
from test_core_triangles import sheet

import mpm_core as mpm

SAND = mpm.LinearElastic(young=2e6, poisson=0.3)


@pytest.mark.parametrize("shake, turned", [(0.0, 0.0), (0.25, 0.3)], ids=["aligned", "irregular and inclined"])
def test_a_block_slides_as_voellmy_says(shake, turned):
    # dv/dt = a - C v^2 / h with a = g (sin - mu cos) and the height h: x = v_t^2 / a ln cosh(a t / v_t), v_t^2 = a h / C.
    model, plane, turn = block(angle=turned, shake=shake)
    theta, friction, drag, height, end = np.radians(30), 0.2, 0.4, 0.5, 1.5
    model.set_gravity(turn @ (G * np.sin(theta), -G * np.cos(theta)), ramp=0.02)
    ground = model.add_contact(plane, friction=friction, drag=drag)
    list(model.explicit(end))
    a = G * (np.sin(theta) - friction * np.cos(theta))
    limit = np.sqrt(a * height / drag)
    after = end - 0.02 / 2  # gravity rises in 0.02 s
    assert along(model, turn[:, 0]) == pytest.approx(limit**2 / a * np.log(np.cosh(a * after / limit)), rel=0.01)
    # Drag acts where the base touches: the rear of the block lifts, and in an irregular mesh it rocks, on 98 % of its base.
    speed = along_velocity(model, turn[:, 0])
    assert speed == pytest.approx(limit * np.tanh(a * after / limit), rel=0.02 if shake else 0.01)
    assert repr(ground).endswith("friction 0.2, adhesion 0 Pa, drag 0.4>")


def along_velocity(model, direction):
    particles = model.particles
    return float(np.average(particles.velocity @ direction, weights=particles.mass))


def test_a_block_is_stopped_by_the_rough_part_of_a_line():
    # It slides freely up to 2.5 m; friction then grows with the part of its length L on the rough segment. Its pressure is
    # not uniform, W/L (1 + 6 e / L (2 s - 1)) at s L from its rear, since friction mu W at its base has the lever e = mu f H / 2.
    model, _, _ = block()  # from 0.5 to 1.5 m
    ground = mpm.Polyline([(0.0, 0.8 - 1e-12), (2.5, 0.8 - 1e-12), (7.0, 0.8 - 1e-12)])
    model.set_gravity((0, -G), ramp=0.1)
    mu, speed = 0.3, 3.0
    model.add_contact(ground, friction=[0.0, mu])
    list(model.explicit(0.3, damping=0.5))
    start = along(model, (1, 0))
    model.particles.set("velocity", model.particles.velocity + (speed, 0.0))
    list(model.explicit(0.3 + 0.32))
    smooth = along(model, (1, 0)) - start
    assert smooth == pytest.approx(speed * 0.32, rel=1e-3)  # its front at 2.46 m
    list(model.explicit(2.5))
    went = along(model, (1, 0)) - start
    assert went == pytest.approx(1.0 + stopping_distance(mu, speed, length=1.0, height=0.5), rel=0.01)


def stopping_distance(mu, speed, length, height):
    """Path from where the front of a block enters rough ground, by small steps."""
    x, v, dx = 0.0, speed, 1e-4
    while v > 0:
        rough = min(x / length, 1.0)  # at the front
        fraction, push = rough, 0.0
        for _ in range(20):  # the pressure depends on the friction that it causes
            push = mu * fraction
            tilt = 6 * push * height / 2 / length  # p = 1 + tilt (2 s - 1) over the mean, s from 0 at the rear
            fraction = rough + tilt * rough * (1 - rough)
        x += dx
        v = np.sqrt(max(v**2 - 2 * mu * fraction * G * dx, 0.0))
    return x


def on_sheet(friction, drag=0.0, end=0.5, speed=0.0):
    """A block that slides over 40 by 30 squares of two triangles with a friction by their centres.

    Returns:
        Model, ground, and the mean moment about the vertical through the middle of the block over the mean normal force [m].
    """
    points, triangles = sheet((40, 30), (-0.5, -0.5, 0.3 - 1e-12), (4.0, 0, 0), (0, 3.0, 0))
    centres = points[triangles].mean(axis=1)
    surface = mpm.Triangles(points, triangles)
    model = mpm.Model(box((6, 4, 3), (3.0, 2.0, 1.5)), SAND)
    grid = 0.125 * (np.indices((6, 6, 4)).reshape(3, -1).T + 0.5) + (0.3, 0.6, 0.3)
    model.seed_points(grid, np.full(len(grid), 0.125**3), density=1000.0)
    model.set_gravity((5.0, 0.0, -8.5))
    model.particles.set("velocity", model.particles.velocity + (speed, 0.0, 0.0))
    ground = model.add_contact(surface, friction=friction(centres), drag=drag, centre=(0.675, 0.975, 0.3))
    sums = np.zeros(2)
    for _ in model.explicit(end, every_steps=5, dt=5e-4):
        sums += ground.moment[2] + lever(model) * ground.force[1], -ground.force[2]
    return model, ground, sums[0] / sums[1]


def lever(model):
    """How far the block has slid, since moments count about the place at the start [m]."""
    return -float(np.average(model.particles.displacement[:, 0]))


def test_each_triangle_has_its_friction():
    # A third of the block's width of 0.75 m has the friction 0.4, the rest 0.1: as much as 0.2 everywhere. With that third in the
    # middle nothing turns the block; with that at one side the moment is (0.4 - 0.1) N / 3 x 0.25 m, as long as it slides much faster than it turns.
    middle, left, mean = (
        on_sheet(friction, end=0.15, speed=3.0)
        for friction in (
            lambda x: np.where(abs(x[:, 1] - 0.975) < 0.126, 0.4, 0.1),
            lambda x: np.where(x[:, 1] < 0.85, 0.4, 0.1),
            lambda x: 0.2,
        )
    )
    moved = np.average(middle[0].particles.displacement[:, 0])
    assert moved == pytest.approx(np.average(mean[0].particles.displacement[:, 0]), rel=0.01)
    moment = (
        (0.4 - 0.1) / 3 * 0.25
    )  # over N, of which the vibrating block has up to 6 % less on a third than on average
    assert left[2] == pytest.approx(moment, rel=0.1)
    assert abs(middle[2]) < 0.05 * moment and abs(mean[2]) < 0.05 * moment


def test_a_checkpoint_needs_the_values_of_the_triangles(tmp_path):
    def friction(x):
        return np.where(x[:, 0] > 1.0, 0.5, 0.1)

    model, ground, _ = on_sheet(friction, drag=0.1, end=0.1)
    model.save(tmp_path / "there.h5")
    resumed, *_ = on_sheet(lambda x: 0.3, end=5e-4)
    with pytest.raises(
        mpm.InputError, match="a Triangles whose friction differs between its 2400 parts by values that the model"
    ):
        resumed.restore(tmp_path / "there.h5")
    resumed, *_ = on_sheet(friction, end=5e-4)
    resumed.restore(tmp_path / "there.h5")
    for each in (model, resumed):
        list(each.explicit(0.3, dt=5e-4))
    assert np.array_equal(model.particles.position, resumed.particles.position)
    assert "friction up to 0.5, adhesion 0 Pa, drag 0.1" in repr(resumed.contacts[0])
    assert resumed.contacts[0].values() == ground.values()


def test_a_checkpoint_has_the_strength_of_segments(tmp_path):
    # A script that continues has no particles to add contact for: mesh and laws are all that it needs, as docs/howto/restart.md says.
    ground = mpm.Polyline([(0.0, 0.8 - 1e-12), (2.5, 0.8 - 1e-12), (7.0, 0.8 - 1e-12)])
    model, _, _ = block()
    model.set_gravity((1.0, -G))
    model.add_contact(ground, friction=[0.1, 0.3], adhesion=[0.0, 50.0], drag=[0.0, 0.1])
    list(model.explicit(0.3))
    model.save(tmp_path / "there.h5")
    resumed = mpm.Model(model.mesh, model.laws)
    resumed.restore(tmp_path / "there.h5")
    for each in (model, resumed):
        list(each.explicit(0.9))
    assert np.array_equal(model.particles.position, resumed.particles.position)
    assert repr(model.contacts[0]) == repr(resumed.contacts[0])
    assert model.contacts[0].values() == resumed.contacts[0].values()


def test_implicit_steps_know_the_friction_of_segments():
    def path(friction):
        model, _, _ = block()
        model.set_gravity((0, -G))
        ground = mpm.Polyline([(0.0, 0.8 - 1e-12), (2.5, 0.8 - 1e-12), (7.0, 0.8 - 1e-12)])
        model.add_contact(ground, friction=friction)
        model.particles.set("velocity", model.particles.velocity + (2.0, 0.0))
        list(model.implicit(until=0.4, dt=0.02))
        return along(model, (1, 0))

    assert path([0.4, 0.0]) == pytest.approx(path(0.4), abs=1e-9)  # it remains on the first segment
    assert path([0.0, 0.4]) == pytest.approx(path(0.0), abs=1e-9)
    assert path(0.0) > path(0.4) + 0.2


@pytest.mark.parametrize("scheme", ["explicit", "implicit"])
@pytest.mark.parametrize("per_cell", [3, 6, 12])
def test_adhesion_acts_on_all_of_the_surface_wherever_particles_lie(scheme, per_cell):
    # A block on a plate that moves along: its particles are in rows of other heights than the plate, and those that touch it have 0.8
    # of its length. The block is held at one end, so that adhesion acts on all of it.
    model = mpm.Model(box((16, 4), (4.0, 1.0), diagonals="alternating", body=((1, 0), (3, 0.5))), SAND)
    model.seed(density=1000.0, per_cell=per_cell, cell_tag=1)
    plate = mpm.Plane((0.0, model.gap(mpm.Plane((0.0, 0.0), (0.0, 1.0))) - 1e-9), (0.0, 1.0))
    adhesion, length = 200.0, 2.0
    model.set_gravity((0.0, -G))
    end = mpm.Plane((3.0, 0.0), (-1.0, 0.0))
    model.add_contact(mpm.Plane((3.0 - model.gap(end) + 1e-9, 0.0), (-1.0, 0.0)))
    ground = model.add_contact(plate, adhesion=adhesion, velocity=(0.05, 0.0))
    if scheme == "explicit":
        list(model.explicit(0.2, damping=0.3))
        before = ground.impulse[0]
        list(model.explicit(0.4, damping=0.3))
        force = (ground.impulse[0] - before) / 0.2
    else:
        list(model.implicit(0.4, dt=0.1, quasi_static=True))
        force = ground.force[0]
    # The lowest particles reach below the soil, so that a gap is left under it, which the stiff springs of implicit steps do not close.
    error = 0.12 if scheme == "implicit" else {3: 0.09, 6: 0.04, 12: 0.03}[per_cell]
    assert -force == pytest.approx(adhesion * length, rel=error)
    assert ground.area == pytest.approx(length, rel=error)


@pytest.mark.parametrize("per_cell", [3, 6])
def test_a_servo_keeps_its_load_by_adhesion(per_cell):
    # A plate that is dragged along with 300 N/m by an adhesion that could bear 3200. Its dashpot m / dt has the mass of all particles that
    # hold it, also of those that do not touch it: with the mass of these alone it swung, by -3082 to 1656 N/m.
    model = mpm.Model(box((16, 4), (4.0, 1.0), diagonals="alternating", body=((1, 0), (3, 0.5))), SAND)
    model.seed(density=1800.0, per_cell=per_cell, cell_tag=1)
    model.set_gravity((0.0, -G))
    model.add_contact(
        mpm.Plane((0.0, model.gap(mpm.Plane((0.0, 0.0), (0.0, 1.0))) - 1e-9), (0.0, 1.0)), friction=1.0, adhesion=5e3
    )
    top = mpm.Plane((0.0, 0.5), (0.0, -1.0))
    level = 0.5 - model.gap(top) + 1e-9
    servo = mpm.Servo(force=(300.0, -500.0), speed=0.05)
    plate = model.add_contact(mpm.Box((1.2, level), (2.8, level + 0.3)), adhesion=2e3, penalty=1.0, body=servo)
    list(model.explicit(0.5, damping=0.3))
    before = plate.impulse[0]
    forces = [plate.force[0] for _ in model.explicit(1.0, every=0.05, damping=0.3)]
    assert (plate.impulse[0] - before) / 0.5 == pytest.approx(-300.0, rel=0.02)
    assert forces == pytest.approx(np.full(len(forces), -300.0), rel=0.1)


def test_adhesion_ends_where_soil_leaves_the_surface():
    # Lifted by its particles' radius it is gone; in between its strength falls with the distance.
    found = []
    for lifted in (0.0, 0.5, 1.01):
        model, plane, _ = block()
        radius = 1 / 32
        model.place(model.particles.position + (0.0, lifted * radius))
        ground = model.add_contact(plane, adhesion=500.0, velocity=(0.5, 0.0))
        list(model.explicit(2e-3))
        found.append(-ground.force[0] / 500.0)  # over a length of 1 m
    assert found[1] == pytest.approx(0.5, abs=0.02) and found[2] == 0.0 and found[0] == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize(
    "surface, values, message",
    [
        (mpm.Plane((0, 0.7), (0, 1)), {"friction": [0.1, 0.2]}, "friction is [0.1, 0.2], expected a number; one for each part"),
        (mpm.Polyline([(0, 0.7), (7, 0.7)]), {"drag": [0.1, 0.2]}, "drag has 2 numbers, expected one, or one for each of 1 segments"),
        (mpm.Polyline([(0, 0.7), (3, 0.7), (7, 0.7)]), {"adhesion": [5.0, -1.0]}, "adhesion is -1.0 Pa at index 1, expected numbers not"),
        (mpm.Polyline([(0, 0.7), (3, 0.7), (7, 0.7)]), {"friction": [0.2, np.nan]}, "friction is nan at index (1,), expected finite"),
        (mpm.Plane((0, 0.7), (0, 1)), {"drag": -0.1}, "drag is -0.1 (a coefficient), expected a number not below zero"),
        (mpm.Plane((0, 0.79), (0, 1)), {"drag": 0.1, "bonded": True}, "drag 0.1, expected 0 where bonded is True"),
    ],
)  # fmt: skip
def test_wrong_strengths_are_named(surface, values, message):
    model, _, _ = block()
    with pytest.raises(mpm.InputError, match=re.escape(message)):
        model.add_contact(surface, **values)
    assert not model.contacts


def test_implicit_steps_refuse_drag():
    model, plane, _ = block()
    model.add_contact(plane, drag=0.1)
    with pytest.raises(
        mpm.InputError, match="drag of the Plane is above 0, which the implicit scheme does not support"
    ):
        list(model.implicit(until=0.1, dt=0.05))
