"""Rigid bodies that touch one another: momentum, energy, bounce, rolling, rest, restart, and wrong input."""

from itertools import combinations, product

import numpy as np
import pytest
from core_cases import box

import mpm_core as mpm

G = 9.81


def far_from_soil(dim):
    """A model whose soil, one particle that flies with the bodies, is reached by none."""
    model = mpm.Model(box((2,) * dim, (100.0,) * dim), mpm.LinearElastic(young=1e6, poisson=0.3))
    model.seed_points([[90.0] * dim], [1e-3], density=1000.0)
    return model


def ball(dim, centre, radius=0.5):
    at = (*centre, *[50.0] * (dim - len(centre)))
    return (mpm.Disc if dim == 2 else mpm.Sphere)(at, radius)


def motion(bodies, masses, centres, dim):
    """Momentum, angular momentum about the origin and energy of balls, the latter from their velocities and spins alone."""
    velocities = np.array([body.velocity for body in bodies])
    places = np.array(centres) + [body.displacement for body in bodies]
    spins = np.array([body.spin for body in bodies])
    inertias = (0.5 if dim == 2 else 0.4) * np.array(masses) * 0.25
    own = (inertias[:, None] * spins).sum(axis=0)
    turning = np.cross(places, np.array(masses)[:, None] * velocities)
    energy = 0.5 * np.sum(masses * np.sum(velocities**2, axis=1)) + 0.5 * np.sum(
        inertias * np.sum(spins**2, axis=1)
    )
    return np.array(masses) @ velocities, np.atleast_1d(turning.sum(axis=0)) + own, energy


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("friction, restitution", [(0.0, 1.0), (0.0, 0.5), (0.3, 1.0), (0.5, 0.3)])
def test_many_balls_keep_their_momentum_and_gain_no_energy(dim, friction, restitution):
    # A heap of balls shoots into another one, all of them spinning.
    model, random = far_from_soil(dim), np.random.default_rng(1)
    corners = 1.05 * np.indices((2,) * dim).reshape(dim, -1).T + 10.0
    centres = np.concatenate([corners, corners + np.eye(dim)[0] * 3.0 + 0.3])
    masses = random.uniform(1.0, 5.0, len(centres))
    bodies = []
    for k, (centre, mass) in enumerate(zip(centres, masses)):
        velocity = random.normal(size=dim) + np.eye(dim)[0] * (4.0 if k < len(corners) else -4.0)
        spin = random.normal(size=1 if dim == 2 else 3)
        bodies.append(model.add_contact(ball(dim, centre), velocity=velocity, spin=spin, body=mpm.FreeBody(mass=mass)))
    for one, other in combinations(bodies, 2):
        one.add_collision(other, friction=friction, restitution=restitution)
    momentum, turning, energy = motion(bodies, masses, centres, dim)
    begin, hits = energy, 0
    for _ in model.explicit(1.0, dt=2e-3, every_steps=1):
        now = motion(bodies, masses, centres, dim)
        assert now[0] == pytest.approx(momentum, abs=1e-10 * np.abs(momentum).max())
        assert now[1] == pytest.approx(turning, abs=1e-10 * np.abs(turning).max())
        assert now[2] <= energy * (1 + 1e-13)
        hits, energy = hits + any(np.any(body.collision_impulse) for body in bodies), now[2]
    assert hits > 100
    if restitution == 1.0 and friction == 0.0:
        assert energy == pytest.approx(begin, rel=1e-12)
    else:
        assert energy < 0.95 * begin


@pytest.mark.parametrize("dim, part", [(2, 1 / 3), (3, 2 / 7)])
@pytest.mark.parametrize("friction", [0.05, 2.0])
def test_two_balls_that_graze_one_another(dim, part, friction):
    # Equal balls of mass m, one at rest: along the normal v_n (1 -+ e) / 2; the tangential impulse is mu p_n, or what stops
    # the sliding of the points that touch, which is m v_t / 2 times 1/3 of discs and 2/7 of spheres.
    model, mass, e, angle = far_from_soil(dim), 3.0, 0.6, np.radians(40)
    normal, along = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
    speed, start = 2.0, np.array([10.0, 10.0])
    velocity = np.append((speed, 0.0), np.zeros(dim - 2))
    one = model.add_contact(ball(dim, start), velocity=velocity, body=mpm.FreeBody(mass=mass))
    other = model.add_contact(ball(dim, start + normal * (1 + 1e-9)), body=mpm.FreeBody(mass=mass))
    one.add_collision(other, friction=friction, restitution=e)
    list(model.explicit(1e-5, dt=1e-6))
    v_n, v_t = speed * np.cos(angle), -speed * np.sin(angle)
    p_n = mass * v_n * (1 + e) / 2
    p_t = np.sign(v_t) * min(friction * p_n, part * mass * abs(v_t) / 2)
    impulse = p_n * normal + p_t * along
    assert other.collision_impulse[:2] == pytest.approx(impulse, rel=1e-5)
    assert one.velocity[:2] == pytest.approx(velocity[:2] - impulse / mass, rel=1e-5)
    inertia = (0.5 if dim == 2 else 0.4) * mass * 0.25
    assert [one.spin[-1], other.spin[-1]] == pytest.approx([-0.5 * p_t / inertia] * 2, rel=1e-5)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_row_of_balls_passes_an_impact_on(dim):
    # Newton's cradle: equal elastic balls that touch; the last one leaves with the velocity of the first.
    model, bodies = far_from_soil(dim), []
    for k in range(5):
        at = (10.0 + k + (0.0 if k else -0.01), 10.0)
        velocity = np.append(1.0 if k == 0 else 0.0, np.zeros(dim - 1))
        bodies.append(model.add_contact(ball(dim, at), velocity=velocity, body=mpm.FreeBody(mass=1.0)))
    for one, other in zip(bodies, bodies[1:]):
        one.add_collision(other, restitution=1.0)
    list(model.explicit(0.1, dt=1e-3))
    assert [body.velocity[0] for body in bodies] == pytest.approx([0, 0, 0, 0, 1.0], abs=1e-12)


def grounds(dim):
    """Level ground at the height 10 m, as different surfaces."""
    if dim == 2:
        shapes = mpm.Plane((0, 10), (0, 1)), mpm.Box((0, 5), (80, 10)), mpm.Polyline([(0, 10), (40, 10), (80, 10)])
        return dict(zip(("plane", "box", "line"), shapes))
    corners = np.array([(0, 0, 10), (80, 0, 10), (80, 80, 10), (0, 80, 10)], dtype=float)
    shapes = (
        mpm.Plane((0, 0, 10), (0, 0, 1)),
        mpm.Box((0, 0, 5), (80, 80, 10)),
        mpm.Triangles(corners, [(0, 1, 2), (0, 2, 3)]),
    )
    return dict(zip(("plane", "box", "triangles"), shapes))


@pytest.mark.parametrize("dim, ground", [(dim, name) for dim in (2, 3) for name in grounds(dim)])
def test_a_ball_bounces_until_it_rests(dim, ground):
    # From the height h it falls t0 = sqrt(2 h / g), and comes to rest after t0 (1 + e) / (1 - e); the first bounce is e^2 h high.
    model, height, e, dt = far_from_soil(dim), 0.2, 0.5, 1e-4
    up = np.eye(dim)[-1]
    model.set_gravity(-G * up)
    surface = ball(dim, (10.0, 10.5 + height) if dim == 2 else (10.0, 50.0, 10.5 + height))
    stone = model.add_contact(surface, body=mpm.FreeBody(mass=2.0))
    stone.add_collision(model.add_contact(grounds(dim)[ground]), friction=0.3, restitution=e)
    fall, heights = np.sqrt(2 * height / G), []
    for report in model.explicit(fall * (1 + 2 * e), dt=dt, every_steps=1):
        heights.append((report.time, stone.displacement @ up + height))
    time, above = np.array(heights).T
    assert above[time > fall + 10 * dt].max() == pytest.approx(e**2 * height, rel=5e-3)
    list(model.explicit(1.02 * fall * (1 + e) / (1 - e), dt=dt))
    rest = stone.displacement.copy()
    assert rest @ up == pytest.approx(-height, abs=2 * dt * np.sqrt(2 * G * height))
    list(model.explicit(model.time + 0.2, dt=dt))
    assert stone.displacement == pytest.approx(rest, abs=2 * G * dt**2) and stone.kinetic_energy < (G * dt) ** 2
    weight = stone.collision_impulse @ up / model.time
    assert weight == pytest.approx(2.0 * G, rel=1e-3)  # it began and ended at rest


@pytest.mark.parametrize("dim, rolling", [(2, 2 / 3), (3, 5 / 7)])
@pytest.mark.parametrize("slope, friction", [(30, 0.3), (30, 0.1), (45, 0.5)])
def test_a_body_rolls_on_a_rigid_plane(dim, rolling, slope, friction):
    # v after n steps is exactly a n dt, so that s = a t (t + dt) / 2; it rolls where friction reaches (1 - rolling) tan.
    model, theta, dt = far_from_soil(dim), np.radians(slope), 1e-3
    down, up = np.eye(dim)[0], np.eye(dim)[-1]
    model.set_gravity(G * (np.sin(theta) * down - np.cos(theta) * up))
    centre = 50.0 * np.ones(dim)
    stone = model.add_contact(ball(dim, centre), body=mpm.FreeBody(mass=2.0))
    plane = model.add_contact(mpm.Plane(centre - 0.5 * up, up))
    stone.add_collision(plane, friction=friction, restitution=0.5)
    list(model.explicit(1.0, dt=dt))
    rolls = friction >= (1 - rolling) * np.tan(theta)
    a = rolling * G * np.sin(theta) if rolls else G * (np.sin(theta) - friction * np.cos(theta))
    spun = a if rolls else friction * G * np.cos(theta) / (0.5 if dim == 2 else 0.4)
    angle = stone.angle[0] * -1 if dim == 2 else stone.angle[1]
    assert stone.displacement @ down == pytest.approx(0.5 * a * (1 + dt), rel=5e-3)
    assert angle * 0.5 == pytest.approx(0.5 * spun * (1 + dt), rel=5e-3)
    assert plane.collision_impulse @ up == pytest.approx(-2.0 * G * np.cos(theta), rel=5e-3)


def test_a_disc_turns_a_free_box_and_energy_is_not_made():
    # It hits the box beside its centre: an impulse that turns it. Momentum and angular momentum are kept.
    model, mass, big = far_from_soil(2), 2.0, 6.0
    disc = model.add_contact(ball(2, (10.0, 10.0)), velocity=(3.0, 0.4), spin=5.0, body=mpm.FreeBody(mass=mass))
    block = model.add_contact(mpm.Box((10.6, 9.7), (11.6, 12.0)), body=mpm.FreeBody(mass=big))
    block.add_collision(disc, friction=0.4, restitution=0.9)
    begin = energy = disc.kinetic_energy
    inertias = 0.5 * mass * 0.25, big / 12 * (1.0 + 2.3**2)
    places = np.array([(10.0, 10.0), (11.1, 10.85)])

    def turning():
        x = places + [body.displacement for body in (disc, block)]
        v = np.array([body.velocity for body in (disc, block)])
        return float(np.cross(x, v) @ (mass, big) + disc.spin[0] * inertias[0] + block.spin[0] * inertias[1])

    first = turning()
    for _ in model.explicit(0.5, dt=1e-3, every_steps=1):
        assert mass * disc.velocity + big * block.velocity == pytest.approx([6.0, 0.8], abs=1e-12)
        assert turning() == pytest.approx(first, abs=1e-11)
        now = disc.kinetic_energy + block.kinetic_energy
        assert now <= energy * (1 + 1e-13)
        energy = now
    assert block.spin[0] != 0 and 0.3 * begin < energy < begin


def heap(path=None):
    """Three discs, of which one lies on two, between walls that carry them."""
    model = far_from_soil(2)
    model.set_gravity((0.0, -G))
    centres = [(10.0, 10.5), (11.0, 10.5), (10.5, 10.5 + np.sqrt(0.75) + 1e-9)]
    discs = [model.add_contact(ball(2, x), body=mpm.FreeBody(mass=1.0)) for x in centres]
    shapes = mpm.Plane((0, 10), (0, 1)), mpm.Box((5, 10), (9.5, 20)), mpm.Box((11.5, 10), (15, 20))
    walls = [model.add_contact(shape) for shape in shapes]
    for one, other in [*combinations(discs, 2), *product(discs, walls)]:
        one.add_collision(other, restitution=0.2)
    return model, discs, walls


def test_a_heap_of_discs_rests():
    # The walls carry the thrust of the upper disc: each half of its weight times tan(30).
    model, discs, walls = heap()
    list(model.explicit(0.2, dt=1e-3))
    before = [wall.collision_impulse for wall in walls]
    list(model.explicit(0.7, dt=1e-3))
    forces = (np.array([wall.collision_impulse for wall in walls]) - before) / 0.5
    thrust = 0.5 * G * np.tan(np.radians(30))
    assert forces == pytest.approx(np.array([(0, -3.0 * G), (-thrust, 0), (thrust, 0)]), abs=1e-3 * G)
    for disc in discs:
        assert np.linalg.norm(disc.displacement) < 1e-3 and np.linalg.norm(disc.velocity) < G * 1e-3


def test_a_heap_goes_on_from_a_checkpoint_to_the_last_bit(tmp_path):
    model, discs, _ = heap()
    list(model.explicit(0.1, dt=1e-3))
    model.save(tmp_path / "there.h5")
    resumed = far_from_soil(2)
    resumed.restore(tmp_path / "there.h5")
    for one in (model, resumed):
        list(one.explicit(0.2, dt=1e-3))
    for one, other in zip(model.contacts, resumed.contacts, strict=True):
        assert np.any(one.collision_impulse)
        for name in ("displacement", "velocity", "spin", "collision_impulse"):
            assert np.array_equal(getattr(one, name), getattr(other, name)), name


def test_wrong_input_is_named():
    model, other_model = far_from_soil(2), far_from_soil(2)
    free = mpm.FreeBody(mass=1.0)
    disc = model.add_contact(ball(2, (10.0, 10.0)), body=free)
    apart = model.add_contact(ball(2, (12.0, 10.0)), body=free)
    near = model.add_contact(ball(2, (10.7, 10.0)), body=free)
    block = model.add_contact(mpm.Box((30, 30), (31, 31)), body=free)
    ground = model.add_contact(mpm.Plane((0, 5), (0, 1)))
    moved = model.add_contact(ball(2, (20.0, 10.0)), velocity=(1.0, 0.0))
    stranger = other_model.add_contact(ball(2, (10.0, 10.0)), body=free)
    disc.add_collision(apart)
    for one, other, options, message in [
        (disc, near, {}, "surfaces 0 and 2 overlap by 0.3 m"),
        (disc, disc, {}, "the body itself"),
        (disc, stranger, {}, "of the same model"),
        (disc, 3, {}, "of the same model"),
        (block, ground, {}, "a Box and a Plane"),
        (ground, moved, {}, "move as prescribed"),
        (apart, disc, {}, "collide already"),
        (disc, ground, {"friction": -0.1}, "friction is -0.1"),
        (disc, ground, {"friction": np.nan}, "friction is nan"),
        (disc, ground, {"restitution": 1.1}, "restitution is 1.1"),
        (disc, ground, {"restitution": np.nan}, "restitution is nan"),
    ]:
        with pytest.raises(mpm.InputError, match=message):
            one.add_collision(other, **options)
