"""Rigid bodies: free and rolling, prescribed rotation, loads, adhesion; momentum, energy, restart, and wrong input."""

import numpy as np
import pytest
from core_cases import box

import mpm_core as mpm

G = 9.81
pytestmark = pytest.mark.filterwarnings(
    "ignore:.*energy at work", "ignore:nothing acts", "error:nothing holds the particles"
)


def layer(cells, size, height, *, per_side=2, young=1e8, density=2000.0):
    """An elastic layer of ``height`` on a fixed base, over the whole length of a box."""
    mesh = box(cells, size, diagonals="alternating" if len(cells) == 2 else "one-way")
    model = mpm.Model(mesh, mpm.LinearElastic(young=young, poisson=0.3))
    d = size[0] / cells[0] / per_side
    counts = [round(length / d) for length in (*size[:-1], height)]
    points = d * (np.indices(counts).reshape(len(cells), -1).T + 0.5)
    model.seed_points(points, np.full(len(points), d ** len(cells)), density=density)
    model.fix(2 * len(cells) - 1)
    return model


@pytest.mark.parametrize("slope, friction", [(30, 0.3), (30, 0.1), (45, 0.5)])
def test_a_cylinder_rolls_as_coulomb_says(slope, friction):
    # It rolls with 2/3 g sin where friction is at least tan / 3, else it slides and spins up with 2 mu g cos. Gravity rises over
    # T, so that it does not bounce. Errors are those of points under a disc: their distance is a 48th of its radius.
    theta, rise, end, radius = np.radians(slope), 0.1, 0.5, 0.5
    model = layer((48, 4), (3.0, 0.25), 0.125, per_side=6)
    model.set_gravity((G * np.sin(theta), -G * np.cos(theta)), ramp=rise)
    disc = model.add_contact(mpm.Disc((0.6, 0.625 + 1e-9), radius), friction=friction, body=mpm.FreeBody(mass=500.0))
    list(model.explicit(end, damping=0.7, energy_limit=np.inf))
    rolls = friction >= np.tan(theta) / 3
    a = 2 / 3 * G * np.sin(theta) if rolls else G * (np.sin(theta) - friction * np.cos(theta))
    spun = a if rolls else 2 * friction * G * np.cos(theta)
    u = end - rise
    duration = rise**2 / 6 + rise * u / 2 + u**2 / 2
    assert disc.displacement[0] == pytest.approx(a * duration, rel=5e-3)
    assert -disc.angle[0] * radius == pytest.approx(spun * duration, rel=5e-3)
    assert disc.kinetic_energy == pytest.approx(250.0 * disc.velocity @ disc.velocity + 0.5 * 62.5 * disc.spin[0] ** 2)


@pytest.mark.parametrize("friction", [0.3, 0.1])
def test_a_sphere_rolls_as_coulomb_says(friction):
    # 5/7 g sin where friction is at least 2/7 tan. The ball is light: under a heavy one the layer gives way, and it creeps.
    theta, rise, end, radius = np.radians(30), 0.1, 0.4, 0.5
    model = layer((24, 3, 2), (1.5, 0.1875, 0.125), 0.0625, per_side=4)
    model.set_gravity((G * np.sin(theta), 0.0, -G * np.cos(theta)), ramp=rise)
    sphere = mpm.Sphere((0.4, 0.094, 0.0625 + radius + 1e-9), radius)
    ball = model.add_contact(sphere, friction=friction, body=mpm.FreeBody(mass=20.0))
    list(model.explicit(end, damping=0.7, energy_limit=np.inf))
    rolls = friction >= 2 / 7 * np.tan(theta)
    a = 5 / 7 * G * np.sin(theta) if rolls else G * (np.sin(theta) - friction * np.cos(theta))
    spun = a if rolls else 2.5 * friction * G * np.cos(theta)
    u = end - rise
    duration = rise**2 / 6 + rise * u / 2 + u**2 / 2
    assert ball.displacement[0] == pytest.approx(a * duration, rel=5e-3)
    assert ball.angle[1] * radius == pytest.approx(spun * duration, rel=5e-3)


def disc_and_block(mass, friction, young, **options):
    """A spinning disc that flies against a block of 32 by 8 particles of 3.9 kg, without gravity."""
    model = mpm.Model(box((28, 12), (7.0, 3.0), shake=0.2), mpm.LinearElastic(young=young, poisson=0.3))
    d = 1 / 16
    points = d * (np.indices((32, 8)).reshape(2, -1).T + 0.5) + (2.0, 0.8)
    model.seed_points(points, np.full(len(points), d * d), density=1000.0)
    surface = mpm.Disc((3.0, 1.3 + 0.4 + 0.01), 0.4)
    body = mpm.FreeBody(mass=mass)
    disc = model.add_contact(surface, friction=friction, velocity=(1.0, -3.0), spin=4.0, body=body, **options)
    assert disc.kinetic_energy == pytest.approx(0.5 * mass * 10 + 0.25 * mass * 0.4**2 * 16)
    return model, disc


@pytest.mark.parametrize("mass", [500.0, 1.0], ids=["heavy", "light"])
@pytest.mark.parametrize("friction, adhesion", [(0.0, 0.0), (0.5, 0.0), (0.5, 1000.0)])
def test_contact_makes_no_energy_in_any_step(mass, friction, adhesion):
    # The soil is dust: without stresses, contact alone changes the energy. The work on the soil, the kinetic energy of the
    # body and the energy of the springs never grow together.
    model, disc = disc_and_block(mass, friction, 1e-6, adhesion=adhesion)
    begin, rows = disc.kinetic_energy, []
    for report in model.explicit(0.05, dt=5e-4, every_steps=1, energy_limit=np.inf):
        rows.append((report.external_work + disc.kinetic_energy, disc.stored_energy))
    work, stored = np.array(rows).T  # stored at the step's start
    balance = np.array([begin, *(work[:-1] + stored[1:])])
    assert np.diff(balance).max() <= 1e-14 * begin
    assert 0.2 * begin < balance[-1] < 0.95 * begin


@pytest.mark.parametrize("mass", [500.0, 1.0], ids=["heavy", "light"])
@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_momentum_of_body_and_soil_is_kept(mass, friction):
    model, disc = disc_and_block(mass, friction, 2e6)
    start, begin = mass * disc.velocity, disc.kinetic_energy
    for report in model.explicit(0.05, every_steps=10, energy_limit=np.inf):
        momentum = np.array(report.momentum) + mass * disc.velocity
        assert momentum == pytest.approx(start, abs=1e-10 * np.linalg.norm(start))
        total = report.kinetic_energy + report.stored_energy + disc.kinetic_energy
        assert total <= begin * (1 + 1e-12)
    assert disc.impulse == pytest.approx(mass * disc.velocity - start, abs=1e-9 * np.linalg.norm(start))
    assert disc.impulse[1] > 0 and (abs(disc.spin[0] - 4.0) < 1e-12) == (friction == 0.0)


def far_from_soil(dim):
    """A model whose soil no body reaches."""
    model = mpm.Model(box((2,) * dim, (100.0,) * dim), mpm.LinearElastic(young=1e6, poisson=0.3))
    model.seed_points([[90.0] * dim], [1e-3], density=1000.0)
    return model


def test_a_body_flies_as_galilei_says():
    # With steps that add g dt before they move: s = v t + g t (t + dt) / 2, and the applied force grows linearly.
    model = far_from_soil(2)
    model.set_gravity((0.0, -G))
    body = mpm.FreeBody(mass=2.0, force=([0.0, 1.0], [(0.0, 0.0), (6.0, 0.0)]))
    stone = model.add_contact(mpm.Disc((10, 50), 0.5), velocity=(1.0, 2.0), spin=3.0, body=body)
    end, dt = 1.0, 0.01
    list(model.explicit(end, dt=dt))
    assert stone.velocity == pytest.approx([1.0 + 3.0 * end**2 / 2, 2.0 - G * end])
    assert stone.displacement[1] == pytest.approx(2.0 * end - G * end * (end + dt) / 2)
    assert stone.displacement[0] == pytest.approx(1.0 * end + 3.0 * end**3 / 6, rel=dt)
    assert stone.angle == pytest.approx([3.0 * end]) and stone.area == stone.pressure == 0.0


@pytest.mark.parametrize("inertia", [(1.0, 2.0, 2.5), (2.0, 2.0, 1.0)], ids=["asymmetric", "symmetric"])
def test_a_body_rotates_freely_as_euler_says(inertia):
    # R diag(I) R^T omega stays; the energy differs by O(dt^2) and does not drift; the axis of a symmetric body goes round the
    # angular momentum L with |L| / I_1.
    inertia, spin, end = np.array(inertia), np.array([0.5, 1.0, 2.0]), 4.0
    momentum, energy = inertia * spin, 0.5 * inertia @ spin**2

    def run(dt):
        model = far_from_soil(3)
        top = model.add_contact(
            mpm.Sphere((10, 10, 10), 1.0), spin=spin, body=mpm.FreeBody(mass=1.0, inertia=inertia), centre=(10, 10, 10)
        )
        errors = []
        for _ in model.explicit(end, dt=dt, every_steps=1):
            turn = top.rotation
            assert turn.T @ turn == pytest.approx(np.eye(3), abs=1e-12)
            assert turn @ (inertia * (turn.T @ top.spin)) == pytest.approx(momentum, rel=1e-12)
            errors.append(abs(top.kinetic_energy - energy))
        return top, max(errors)

    (coarse, one), (fine, other) = run(0.02), run(0.01)
    assert 3.5 < one / other < 4.5  # second order
    if inertia[0] != inertia[1]:
        return
    length = np.linalg.norm(momentum)
    expected = rotation_about(momentum / length, length / inertia[0] * end) @ (0, 0, 1)
    errors = [np.linalg.norm(top.rotation[:, 2] - expected) for top in (coarse, fine)]
    assert errors[1] < 1e-3 and 3.5 < errors[0] / errors[1] < 4.5


def rotation_about(axis, angle):
    """Rotation about an axis of length 1, by Rodrigues' formula."""
    cross = np.cross(axis, np.eye(3), axisb=0, axisc=0)
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def test_a_spinning_disc_under_a_load_drags_the_soil():
    # A servo presses it on a layer; it slides everywhere, so that the force along the layer is mu N and the moment mu N R.
    model = layer((16, 2), (2.0, 0.25), 0.125, per_side=4)
    model.fix(1), model.fix(2)
    load, friction, radius = 20e3, 0.4, 0.3
    servo = mpm.Servo(force=([0.0, 0.02], [(0, 0), (0, -load)]), speed=0.5)
    disc = model.add_contact(
        mpm.Disc((1.0, 0.125 + radius + 0.002), radius), friction=friction, spin=([0.05, 0.1], [0.0, -20.0]), body=servo
    )
    list(model.explicit(0.2, damping=0.5, energy_limit=np.inf))
    assert disc.force[1] == pytest.approx(load, rel=1e-2) and disc.displacement[0] == 0.0
    before, start = disc.impulse, model.time
    list(model.explicit(0.25, damping=0.5, energy_limit=np.inf))
    mean = (disc.impulse - before) / (model.time - start)
    assert mean == pytest.approx([friction * load, load], rel=1e-2)  # clockwise: its lowest point goes to the left
    assert disc.moment[0] == pytest.approx(disc.force[0] * radius, rel=1e-2)
    assert disc.sticking_fraction == 0.0
    assert disc.angle[0] == pytest.approx(-20.0 * (0.05 / 2 + 0.15))
    assert disc.rotation[0] == pytest.approx([np.cos(disc.angle[0]), -np.sin(disc.angle[0])])


def test_a_plate_under_a_dead_load_rests_on_the_soil():
    # It moves along y alone; reaction, area and pressure follow from weight, load and width.
    model = layer((16, 2), (2.0, 0.25), 0.125)
    model.set_gravity((0.0, -G), ramp=0.02)
    mass, load, width = 300.0, 5e3, 1.0
    body = mpm.FreeBody(mass=mass, axes=(False, True), rotates=False, force=([0.0, 0.02], [(0, 0), (0, -load)]))
    plate = model.add_contact(mpm.Box((0.5, 0.125), (0.5 + width, 0.4)), friction=0.5, body=body)
    list(model.explicit(0.3, damping=0.7, energy_limit=np.inf))
    assert plate.force[1] == pytest.approx(mass * G + load, rel=1e-2)
    assert plate.area == pytest.approx(width, rel=1e-3) and plate.pressure == pytest.approx(
        (mass * G + load) / width, rel=1e-2
    )
    assert plate.displacement[0] == plate.angle[0] == 0.0 and plate.sticking_fraction == 1.0
    assert abs(plate.moment[0]) < 1e-2 * load * width


@pytest.mark.parametrize("adhesion", [1000.0, 3000.0])
def test_adhesion_holds_a_block_up_to_its_strength(adhesion):
    # A block of height H on a slope: tau = rho g H sin(theta) drives it, the adhesion holds it, whatever the pressure.
    mesh = box((28, 8), (7.0, 2.0), diagonals="alternating")
    model = mpm.Model(mesh, mpm.LinearElastic(young=2e7, poisson=0.3))
    points = (np.indices((16, 8)).reshape(2, -1).T + 0.5) / 16 + (0.5, 0.8)
    model.seed_points(points, np.full(len(points), 1 / 16**2), density=1000.0)
    theta, rise, end, height = np.radians(30), 0.1, 0.6, 0.5
    model.set_gravity((G * np.sin(theta), -G * np.cos(theta)), ramp=rise)
    ground = model.add_contact(mpm.Plane((0.0, 0.8 - 1e-12), (0, 1)), adhesion=adhesion)
    *_, report = model.explicit(end)
    moved = np.average(model.particles.displacement[:, 0], weights=model.particles.mass)
    driving, strength = G * np.sin(theta), adhesion / (1000.0 * height)
    if strength > driving:
        assert 0 < moved < 5e-4 and ground.sticking_fraction > 0.5
        return
    # It begins to slide at t0 = rise * strength / driving, with an acceleration that grows linearly up to a.
    a, first, u = driving - strength, rise * (1 - strength / driving), end - rise
    distance = a * (first**2 / 6 + first * u / 2 + u**2 / 2) + a * (end - rise / 2) * report.dt / 2
    assert moved == pytest.approx(distance, rel=5e-3) and ground.sticking_fraction == 0.0


@pytest.mark.parametrize(
    "body", [mpm.FreeBody(mass=50.0), mpm.Servo(force=(0.0, -500.0), speed=1.0)], ids=["free", "servo"]
)
def test_a_body_goes_on_from_a_checkpoint_to_the_last_bit(tmp_path, body):
    def prepared():
        model = layer((16, 4), (2.0, 0.5), 0.25)
        model.set_gravity((1.0, -9.0))
        return model

    surface = mpm.Box((0.5, 0.26), (0.9, 0.4)) if isinstance(body, mpm.FreeBody) else mpm.Disc((1.0, 0.41), 0.15)
    whole = prepared()
    whole.add_contact(surface, friction=0.3, adhesion=100.0, spin=1.0, body=body)
    list(whole.explicit(0.06, dt=1e-4, energy_limit=np.inf))
    whole.save(tmp_path / "there.h5")
    resumed = prepared()
    resumed.restore(tmp_path / "there.h5")
    for model in (whole, resumed):
        list(model.explicit(0.12, dt=1e-4, energy_limit=np.inf))
    one, other = whole.contacts[0], resumed.contacts[0]
    assert one.impulse[1] > 0 and one.angle[0] != 0
    assert np.array_equal(whole.particles.position, resumed.particles.position)
    for name in (
        "force",
        "impulse",
        "moment",
        "displacement",
        "velocity",
        "angle",
        "spin",
        "rotation",
        "kinetic_energy",
    ):
        assert np.array_equal(getattr(one, name), getattr(other, name)), name
    assert one.values() == other.values()


DISC = mpm.Disc((1.0, 1.0), 0.5)


@pytest.mark.parametrize(
    "surface, options, message",
    [
        (DISC, {"body": mpm.FreeBody(mass=0.0)}, "mass is 0.0 kg"),
        (DISC, {"body": mpm.FreeBody(mass=np.nan)}, "mass is nan"),
        (DISC, {"body": mpm.FreeBody(mass=1.0, inertia=-1.0)}, "inertia is"),
        (DISC, {"body": mpm.FreeBody(mass=1.0, axes=(True,))}, "axes is"),
        (DISC, {"body": mpm.FreeBody(mass=1.0, force=(1.0, 2.0, 3.0))}, "force has shape"),
        (DISC, {"body": mpm.FreeBody(mass=1.0), "centre": (1.0, 1.1)}, "inertia is not given"),
        (mpm.Plane((0, 0.4), (0, 1)), {"body": mpm.FreeBody(mass=1.0)}, "inertia is not given"),
        (DISC, {"body": mpm.Servo(force=(0.0, -1.0), speed=0.0)}, "speed is 0.0 m/s"),
        (DISC, {"body": mpm.Servo(force=(0.0, 0.0), speed=1.0)}, "force of the Servo is zero"),
        (DISC, {"body": mpm.Servo(force=(1.0, 1.0), speed=1.0, axes=(False, True))}, "not controlled"),
        (DISC, {"body": 5.0}, "body is 5.0"),
        (DISC, {"spin": (1.0, 2.0)}, "spin has shape"),
        (DISC, {"spin": ([1.0, 0.0], [1.0, 2.0])}, "expected rising"),
        (DISC, {"centre": (1.0, 1.0, 1.0)}, "centre has shape"),
        (DISC, {"adhesion": -1.0}, "adhesion is -1.0 Pa"),
        (DISC, {"bonded": "no"}, "bonded is 'no', expected True or False"),
        (DISC, {"body": mpm.FreeBody(mass=1.0, rotates="no")}, "rotates is 'no', expected True or False"),
        (mpm.Polyline([(0, 0.6), (2, 0.6), (2, 0.9)], closed="no"), {}, "closed is 'no', expected True or False"),
    ],
)
def test_wrong_input_is_named(surface, options, message):
    model = layer((8, 4), (2.0, 1.0), 0.25)
    with pytest.raises(mpm.InputError, match=message):
        model.add_contact(surface, **options)
    assert not model.contacts


def test_inertia_must_be_that_of_a_body():
    model = far_from_soil(3)
    ball = mpm.Sphere((10, 10, 10), 1.0)
    for inertia in ((1.0, 1.0, 2.1), (1.0, 2.0)):
        with pytest.raises(mpm.InputError, match="inertia"):
            model.add_contact(ball, body=mpm.FreeBody(mass=1.0, inertia=inertia))


def test_nothing_rotates_in_axial_symmetry():
    model = mpm.Model(box((4, 4)), mpm.LinearElastic(young=1e6, poisson=0.3), geometry=mpm.Geometry.AXISYMMETRIC)
    model.seed_points([(0.5, 0.2)], [1e-3], density=1000.0)
    ball = mpm.Disc((0.0, 0.8), 0.1)
    for options in ({"spin": 1.0}, {"body": mpm.FreeBody(mass=1.0, rotates=True)}):
        with pytest.raises(mpm.InputError, match="axial symmetry"):
            model.add_contact(ball, **options)
    with pytest.raises(mpm.InputError, match="axes is"):
        model.add_contact(ball, body=mpm.FreeBody(mass=1.0, axes=(True, True)))
    stone = model.add_contact(ball, body=mpm.FreeBody(mass=1.0))
    model.set_gravity((0.0, -G))
    list(model.explicit(0.1, dt=1e-3))
    assert stone.displacement == pytest.approx([0.0, -G * 0.1 * 0.101 / 2]) and stone.spin == 0.0
