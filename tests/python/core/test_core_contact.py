"""Contact with rigid surfaces: when it begins, the friction of a block, momentum, energy, restart, and wrong input."""

import warnings

import numpy as np
import pytest
from core_cases import box
from mpm_core.probes import ProbeFile

import mpm_core as mpm

G = 9.81
pytestmark = pytest.mark.filterwarnings("error:nothing holds the particles")  # a surface does


def rotation(angle):
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def block(*, angle=0.0, shake=0.0, young=2e7, length=1.0, drop=0.0):
    """A block of 16 by 8 particles whose lower edge is at ``drop`` above a plane through (0.5, 0.8) at this angle to the mesh.

    Returns:
        Model, the plane, and the rotation that turns the axes into those along and normal to it.
    """
    mesh = box((28, 12), (7.0, 3.0), shake=shake, diagonals="alternating")
    model = mpm.Model(mesh, mpm.LinearElastic(young=young, poisson=0.3))
    side = length / 16
    grid = np.indices((16, 8)).reshape(2, -1).T + 0.5
    turn, corner = rotation(angle), np.array([0.5, 0.8])
    model.seed_points(corner + (side * grid + (0, drop)) @ turn.T, np.full(len(grid), side**2), density=1000.0)
    normal = turn @ (0, 1)
    # Seeded at the edge to the last digit, up to round-off of the rotation.
    return model, mpm.Plane(corner - 1e-12 * normal, normal), turn


def along(model, direction):
    particles = model.particles
    return float(np.average(particles.displacement @ direction, weights=particles.mass))


@pytest.mark.parametrize(
    "shake, turned", [(0.0, 0.0), (0.0, 0.3), (0.25, 0.0)], ids=["aligned", "inclined", "irregular"]
)
@pytest.mark.parametrize("slope, friction", [(30, 0.0), (30, 0.2), (30, 0.3), (30, 0.5), (45, 0.3), (45, 0.5)])
def test_a_block_slides_as_coulomb_says(slope, friction, shake, turned):
    # Gravity rises over the time T, so that the block does not bounce; with a = g (sin - mu cos) the distance is
    # a (T^2 / 6 + T u / 2 + u^2 / 2) at the time T + u, and the leap-frog adds half a step of the velocity at the end.
    model, plane, turn = block(angle=turned, shake=shake)
    theta, rise, end = np.radians(slope), 0.1, 1.0
    model.set_gravity(turn @ (G * np.sin(theta), -G * np.cos(theta)), ramp=rise)
    ground = model.add_contact(plane, friction=friction)
    *_, report = model.explicit(end)
    a, u = G * (np.sin(theta) - friction * np.cos(theta)), end - rise
    distance = a * (rise**2 / 6 + rise * u / 2 + u**2 / 2) + a * (end - rise / 2) * report.dt / 2
    assert along(model, turn[:, 0]) == pytest.approx(distance, rel=5e-3)
    mean = turn.T @ ground.impulse / (end - rise / 2)
    weight = report.mass * G * np.cos(theta)
    assert mean == pytest.approx([friction * weight, -weight], abs=5e-3 * weight)


@pytest.mark.parametrize("slope, friction", [(30, 0.62), (45, 1.1)])
def test_a_block_sticks_below_the_angle_of_friction(slope, friction):
    # Its elastic shear gamma = rho g sin(theta) H / (2 G), and no creep: the block stays where it is when it is at rest.
    model, plane, _ = block()
    theta = np.radians(slope)
    model.set_gravity((G * np.sin(theta), -G * np.cos(theta)), ramp=0.4)
    model.add_contact(plane, friction=friction)
    list(model.explicit(0.8))
    first = along(model, (1, 0))
    list(model.explicit(1.6))
    assert 0 < first < 5e-4
    assert abs(along(model, (1, 0)) - first) < 5e-5  # sliding freely it would be 0.8^2 g / 4 = 1.6 m


def test_a_block_on_level_ground_stops_after_v2_over_2_mu_g():
    model, plane, _ = block()
    model.set_gravity((0, -G), ramp=0.1)
    ground = model.add_contact(plane, friction=0.3)
    list(model.explicit(0.3, damping=0.5))  # at rest under its weight
    start, speed = along(model, (1, 0)), 2.0
    model.particles.set("velocity", model.particles.velocity + (speed, 0.0))
    list(model.explicit(0.3 + 1.0))
    assert along(model, (1, 0)) - start == pytest.approx(speed**2 / (2 * 0.3 * G), rel=5e-3)
    assert ground.displacement == pytest.approx([0, 0])


def test_soil_at_rest_sinks_in_as_its_weight_and_the_penalty_say():
    # The lowest particles, of side d, carry the weight W: kappa = beta m_p / dt^2 on each, so that W = L d rho beta / dt^2 g.
    model, plane, _ = block()
    model.set_gravity((0, -G), ramp=0.1)
    ground = model.add_contact(plane, penalty=0.5)
    *_, report = model.explicit(0.6, damping=0.3)
    weight, side = report.mass * G, 1 / 16
    assert ground.force == pytest.approx([0, -weight], abs=1e-3 * weight)
    assert -model.gap(plane) == pytest.approx(weight * report.dt**2 / (0.5 * 1000.0 * side), rel=0.1)
    assert ground.moment == pytest.approx([0.5 * -weight], rel=1e-2)  # about the block's lower left corner


def test_nothing_is_felt_before_the_gap_closes():
    drop = 0.2
    model, plane, _ = block(drop=drop)
    model.set_gravity((0, -G))
    ground = model.add_contact(plane)
    assert model.gap(plane) == pytest.approx(drop, abs=1e-9)
    fallen = 0.0
    for _ in model.explicit(0.3, every_steps=1):
        if np.any(ground.force):
            break
        fallen = -along(model, (0, 1))
    cell = 0.25
    assert drop - 0.05 * cell < fallen < drop + 1e-9
    assert ground.force[1] < 0 and ground.force[0] == 0


@pytest.mark.parametrize("stress_update", [mpm.StressUpdate.MODIFIED_LAST, mpm.StressUpdate.FIRST])
@pytest.mark.parametrize("friction", [0.0, 0.4])
def test_momentum_is_that_of_gravity_and_contact_and_no_energy_is_made(stress_update, friction):
    # A block flies against a plane: kinetic and stored energy never grow, and its momentum is lost to the plane.
    model, plane, turn = block(angle=0.2, shake=0.2, drop=0.02)
    model.particles.set("velocity", np.tile(turn @ (1.0, -1.5), (len(model.particles), 1)))
    ground = model.add_contact(plane, friction=friction)
    before = model.report()
    start = np.array(before.momentum)
    for report in model.explicit(0.3, every_steps=20, stress_update=stress_update):
        assert np.array(report.momentum) + ground.impulse == pytest.approx(start, abs=1e-10 * np.abs(start).max())
        assert report.external_work <= 1e-9 * before.kinetic_energy  # of the contact, the only force from outside
    assert turn[:, 1] @ ground.impulse < 0  # the plane has been hit
    assert abs(report.unexplained_fraction) < 0.02
    assert report.kinetic_energy + report.stored_energy < before.kinetic_energy


def test_a_cylinder_in_axial_symmetry_rests_on_its_weight():
    # Per radian: mass rho H R^2 / 2, and particles as wide as in the half section, V / r = d^2.
    model = mpm.Model(
        box((6, 6), (1.5, 1.5)), mpm.LinearElastic(young=2e7, poisson=0.3), geometry=mpm.Geometry.AXISYMMETRIC
    )
    side, radius, height = 1 / 16, 1.0, 0.5
    points = side * (np.indices((16, 8)).reshape(2, -1).T + 0.5) + (0, 0.5)
    model.seed_points(points, side**2 * points[:, 0], density=1000.0)
    model.set_gravity((0, -G), ramp=0.1)
    table = mpm.Plane((0, 0.5 - 1e-12), (0, 1))
    assert model.gap(table) == pytest.approx(0, abs=1e-9)
    ground = model.add_contact(table, friction=0.3)
    *_, report = model.explicit(0.6, damping=0.3)
    weight = 1000.0 * height * radius**2 / 2 * G
    assert report.mass * G == pytest.approx(weight)
    assert ground.force[1] == pytest.approx(-weight, rel=1e-2)
    assert ground.moment == pytest.approx([-weight * 2 / 3 * radius], rel=2e-2)  # pressure p r dr: at 2/3 of the radius


def test_a_wall_gives_a_block_the_momentum_of_its_impulse():
    # The wall starts slowly and reaches 2 m/s; its displacement is the integral of a velocity that is linear in time.
    model, _, _ = block()
    times, speeds = [0.05, 0.25], [0.0, 2.0]
    wall = model.add_contact(mpm.Box((0.1, 0.0), (0.4, 2.9)), velocity=(times, [[v, 0.0] for v in speeds]))
    *_, report = model.explicit(0.55)
    assert wall.displacement == pytest.approx([0.5 * 2.0 * 0.2 + 2.0 * 0.3, 0.0])
    assert report.momentum == pytest.approx(-wall.impulse, abs=1e-10 * report.momentum[0])
    assert report.momentum[0] >= report.mass * 2.0 * (1 - 1e-3)  # it is as fast as the wall, or was thrown ahead
    assert model.gap(mpm.Box(*(np.array([(0.1, 0.0), (0.4, 2.9)]) + wall.displacement))) > -1e-3


def test_a_block_slides_in_three_dimensions():
    mesh = box((6, 4, 3), (3.0, 2.0, 1.5))
    model = mpm.Model(mesh, mpm.LinearElastic(young=2e7, poisson=0.3))
    grid = 0.125 * (np.indices((6, 6, 4)).reshape(3, -1).T + 0.5) + (0.3, 0.6, 0.3)
    model.seed_points(grid, np.full(len(grid), 0.125**3), density=1000.0)
    slope, friction, rise, end = np.radians(30), 0.3, 0.1, 0.6
    model.set_gravity((G * np.sin(slope), 0.0, -G * np.cos(slope)), ramp=rise)
    ground = model.add_contact(mpm.Plane((0, 0, 0.3 - 1e-12), (0, 0, 2)), friction=friction)
    *_, report = model.explicit(end)
    a, u = G * (np.sin(slope) - friction * np.cos(slope)), end - rise
    distance = a * (rise**2 / 6 + rise * u / 2 + u**2 / 2) + a * (end - rise / 2) * report.dt / 2
    assert along(model, (1, 0, 0)) == pytest.approx(distance, rel=5e-3)
    assert abs(along(model, (0, 1, 0))) < 1e-4 and ground.moment.shape == (3,)


ZIGZAG = [(1.0, 1.0), (3.0, 1.2), (3.2, 2.5), (4.0, 0.5), (6.0, 1.5)]
CROWN = [(1.0, 0.5), (6.0, 0.8), (5.0, 2.5), (4.0, 1.0), (2.0, 2.4)]  # counterclockwise: the soil is inside


def on_segments(points, closed):
    """Points densely on a polyline; an open one goes on beyond its ends."""
    points = np.array(points)
    ends = np.roll(points, -1, axis=0) if closed else points[1:]
    starts = (points if closed else points[:-1]).copy()
    if not closed:
        starts[0] -= 10 * (ends[0] - starts[0])
        ends[-1] += 10 * (ends[-1] - starts[-1])
    t = np.linspace(0, 1, 40001)[:, None]
    return np.concatenate([a + t * (b - a) for a, b in zip(starts, ends, strict=True)])


def inside(points, x):
    """Whether x is in a closed polygon: the number of its segments to the right of x is odd."""
    a, b = np.array(points), np.roll(points, -1, axis=0)
    spans = (a[:, 1] > x[1]) != (b[:, 1] > x[1])
    return (
        np.sum(
            spans & (x[0] < a[:, 0] + (x[1] - a[:, 1]) * (b[:, 0] - a[:, 0]) / np.where(spans, b[:, 1] - a[:, 1], 1))
        )
        % 2
    )


def test_distances_are_those_to_the_nearest_point():
    model = mpm.Model(box((7, 3), (7.0, 3.0)), mpm.LinearElastic(young=1e6, poisson=0.3))
    volume = 1e-12
    model.seed_points([(1.0, 1.0)], [volume], density=1.0)
    ring, hole = mpm.Polyline(CROWN, closed=True), mpm.Polyline(CROWN[::-1], closed=True)
    line, turned = mpm.Polyline(ZIGZAG), mpm.Polyline(ZIGZAG[::-1])
    dense, dense_ring = on_segments(ZIGZAG, False), on_segments(CROWN, True)
    corner, far = np.array([2.0, 1.0]), np.array([4.0, 2.0])

    def of(surface):
        return model.gap(surface) + 0.5 * volume**0.5

    for x in np.random.default_rng(1).uniform((0.1, 0.1), (6.9, 2.9), (60, 2)):
        model.place(x[None])
        nearest = np.linalg.norm(dense - x, axis=1).min()
        assert abs(of(line)) == pytest.approx(nearest, abs=1e-3) and of(turned) == pytest.approx(-of(line), abs=1e-12)
        nearest = np.linalg.norm(dense_ring - x, axis=1).min()
        assert abs(of(ring)) == pytest.approx(nearest, abs=1e-3) and of(hole) == pytest.approx(-of(ring), abs=1e-12)
        assert (of(ring) > 0) == inside(CROWN, x)
        assert of(mpm.Disc((3, 1), 0.7)) == pytest.approx(np.hypot(*(x - (3, 1))) - 0.7, abs=1e-12)
        beyond = np.maximum(corner - x, x - far)
        assert of(mpm.Box(corner, far)) == pytest.approx(
            np.linalg.norm(np.maximum(beyond, 0)) + min(beyond.max(), 0), abs=1e-12
        )


def test_a_surface_is_a_probe(tmp_path):
    model, plane, _ = block()
    model.set_gravity((0, -G), ramp=0.1)
    ground = model.add_contact(plane, friction=0.3, velocity=(0.1, 0.0))
    with ProbeFile(tmp_path / "ground.csv", ground) as file:
        for _ in model.explicit(0.2, every=0.1):
            file.record()
    rows = np.genfromtxt(tmp_path / "ground.csv", delimiter=",", names=True, deletechars="")
    assert rows["time_s"] == pytest.approx([0.1, 0.2]) and rows["displacement_x_m"] == pytest.approx([0.01, 0.02])
    last = [rows[name][-1] for name in ("force_x_N", "force_y_N", "impulse_y_N.s", "moment_z_N.m")]
    assert last == pytest.approx([*ground.force, ground.impulse[1], *ground.moment], rel=1e-6)


def test_a_run_goes_on_from_a_checkpoint_to_the_last_bit(tmp_path):
    def prepared():
        model, plane, _ = block(angle=0.2, drop=0.001)
        model.set_gravity((3.0, -9.0))
        return model, plane

    whole, plane = prepared()
    wall = mpm.Box((2.6, 0.0), (6.0, 2.5))
    for surface, velocity in ((plane, None), (wall, ([0.0, 0.1], [[0.0, 0.0], [-4.0, 0.0]]))):
        whole.add_contact(surface, friction=0.3, velocity=velocity)
    list(whole.explicit(0.15, dt=2e-4))
    whole.save(tmp_path / "there.h5")
    resumed, _ = prepared()
    resumed.restore(tmp_path / "there.h5")
    for model in (whole, resumed):
        list(model.explicit(0.4, dt=2e-4))
    assert len(resumed.contacts) == 2 and whole.contacts[1].impulse[0] > 0
    for name in ("position", "velocity", "stress", "contact_slip_0", "contact_slip_1"):
        assert np.array_equal(getattr(whole.particles, name), getattr(resumed.particles, name)), name
    for one, other in zip(whole.contacts, resumed.contacts, strict=True):
        for name in ("force", "impulse", "moment", "displacement"):
            assert np.array_equal(getattr(one, name), getattr(other, name)), name
    other = whole.contacts[1]
    prepared()[0].save(tmp_path / "before.h5")
    whole.restore(tmp_path / "before.h5")
    for use in (repr, lambda contact: contact.force, lambda contact: contact.outline()):
        with pytest.raises(
            mpm.InputError, match="rigid surface 1 is not in the model, which has 0 since it was restored"
        ):
            use(other)


@pytest.mark.parametrize(
    "surface, options, message",
    [
        (lambda: mpm.Plane((0, 0), (0, 0)), {}, "normal is"),
        (lambda: mpm.Plane((0, np.nan), (0, 1)), {}, "point is nan"),
        (lambda: mpm.Plane((0, 0, 0), (0, 1)), {}, "point has shape"),
        (lambda: mpm.Plane((0, 0), (0, 1)), {"friction": -0.1}, "friction is -0.1"),
        (lambda: mpm.Plane((0, 0), (0, 1)), {"friction": np.inf}, "friction is inf"),
        (lambda: mpm.Plane((0, 0), (0, 1)), {"penalty": 1.5}, "penalty is 1.5"),
        (lambda: mpm.Plane((0, 0), (0, 1)), {"velocity": ([1.0, 0.0], np.zeros((2, 2)))}, "expected rising"),
        (lambda: mpm.Disc((3, 1), -1.0), {}, "radius is -1.0"),
        (lambda: mpm.Sphere((3, 1, 1), 1.0), {}, "surface is a Sphere"),
        (lambda: mpm.Box((1, 1), (0, 2)), {}, "expected lower < upper"),
        (lambda: mpm.Polyline([(0, 0)]), {}, "expected 2 or more"),
        (lambda: mpm.Polyline([(0, 0), (0, 0), (1, 0)]), {}, "twice in a row"),
        (lambda: mpm.Polyline([(0, 0), (2, 0), (2, 1), (1, -1)]), {}, "cross"),
        (lambda: mpm.Polyline([(7, 0), (0, 0)]), {}, "overlaps the soil by"),  # the soil is on its right
        (lambda: "ground", {}, "surface is 'ground'"),
    ],
)
def test_wrong_input_is_named(surface, options, message):
    model, _, _ = block()
    with pytest.raises(mpm.InputError, match=message):
        model.add_contact(surface(), **options)
    assert not model.contacts


def test_an_overlap_is_refused_with_its_depth():
    model, _, _ = block()
    with pytest.raises(mpm.InputError, match=r"overlaps the soil by 0\.05 m"):
        model.add_contact(mpm.Plane((0, 0.85), (0, 1)))


def test_equilibrate_refuses_contacts():
    model, plane, _ = block()
    model.add_contact(plane)
    with pytest.raises(mpm.InputError, match=r"rigid surfaces \(Plane\)"):
        model.equilibrate()


@pytest.mark.parametrize("penalty, deep", [(0.2, True), (1.0, False)])
def test_a_run_says_how_deep_soil_sinks_into_a_soft_contact_and_what_helps(penalty, deep):
    # At rest the springs of the lowest row carry 16 rows of particles, so that it is 16 g dt_c^2 / beta deep, dt_c being the first
    # step: 0.28 and 0.06 of a cell.
    mesh = box((8, 12), (1.0, 1.5))
    model = mpm.Model(mesh, mpm.LinearElastic(young=2e5, poisson=0.3))
    side = 1.0 / 16
    grid = np.indices((16, 16)).reshape(2, -1).T + 0.5
    model.seed_points(side * grid + (0.0, 0.25), np.full(len(grid), side**2), density=2000.0)
    for edge in (1, 2):
        model.roller(edge, normal=(1, 0))
    model.set_gravity((0.0, -G), ramp=0.5)
    ground = model.add_contact(mpm.Plane((0, 0.25), normal=(0, 1)), penalty=penalty)
    first = 0.1 / np.ceil(0.1 / (0.9 * model.critical_time_step()))  # a whole number of steps between reports
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        model.explicit(4.0, every=0.1, damping=0.7, courant=0.9, energy_limit=None).last()
    depth = ground._state()["penetration"]
    assert depth == pytest.approx(16 * G * first**2 / penalty, rel=0.02)
    texts = [str(each.message) for each in told if "cells deep" in str(each.message)]
    assert len(texts) == deep and (depth > 0.25 / 8) == deep
    assert all(
        "rigid surface 0 (Plane)" in text and "penalty=1 of add_contact in place of 0.2" in text for text in texts
    )


def test_soil_that_is_placed_inside_of_a_surface_later_is_refused_when_the_run_begins():
    model = mpm.Model(box((12, 8), (1.2, 0.8)), mpm.LinearElastic(young=1e6, poisson=0.3))
    model.seed_points([(0.6, 0.2)], [1e-4], density=1000.0)
    model.add_contact(mpm.Box((0.4, 0.5), (0.8, 0.6)))
    model.seed_points([(0.6, 0.55)], [1e-4], density=1000.0)  # 0.05 m deep, with a radius of 0.005 m
    for run in (lambda: model.explicit(0.01), lambda: model.implicit(0.01, dt=0.01)):
        with pytest.raises(mpm.InputError, match=r"overlaps the soil by 0\.055 m"):
            run()
    assert model.steps == 0


def test_soil_that_is_placed_inside_of_a_surface_that_has_moved_is_refused(tmp_path):
    """A box turns by a quarter about its corner, from the right of it to above it, in the first run."""
    model = mpm.Model(box((12, 8), (1.2, 0.8)), mpm.LinearElastic(young=1e6, poisson=0.3))
    model.seed_points([(0.1, 0.1)], [1e-4], density=1000.0)
    model.set_gravity((0.0, -1e-6))
    turned = model.add_contact(mpm.Box((0.6, 0.3), (1.0, 0.4)), spin=np.pi / 2, centre=(0.6, 0.3))
    list(model.explicit(1.0, dt=1e-3))
    assert turned.rotation == pytest.approx(np.array([(0.0, -1.0), (1.0, 0.0)]), abs=1e-12)
    model.seed_points([(0.8, 0.35)], [1e-4], density=1000.0)  # where it was
    list(model.explicit(1.001, dt=1e-3))
    model.seed_points([(0.55, 0.5)], [1e-4], density=1000.0)  # in the middle of where it is, 0.1 m wide
    for run in (lambda: model.explicit(1.1), lambda: model.implicit(1.1, dt=0.01)):
        with pytest.raises(mpm.InputError, match=r"which has moved by .* overlaps the soil by 0\.05[45]"):
            run()
    model.save(tmp_path / "state.h5")
    model.restore(tmp_path / "state.h5")  # what a run has there may be deeper
    list(model.explicit(1.002, dt=1e-4))
