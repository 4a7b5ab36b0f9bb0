"""Rigid bodies that forces move in implicit steps: derivatives, balance, closed forms, and Newton's method."""

import numpy as np
import pytest
from core_cases import box, rollers
from implicit_cases import matrix_of_strains
from mpi4py import MPI
from test_implicit_contact import CLAY, ELASTIC, G, soil, started

import mpm_core as mpm

pytestmark = pytest.mark.filterwarnings("error:nothing holds the particles")  # a surface does


@pytest.mark.parametrize("rotates", [False, True])
@pytest.mark.parametrize("dim, geometry", [(2, None), (3, None), (2, mpm.Geometry.AXISYMMETRIC)])
@pytest.mark.parametrize("nmd", [False, True])
def test_the_derivatives_are_those_of_the_balances(dim, geometry, nmd, rotates):
    if geometry and rotates:
        pytest.skip("bodies do not rotate in axial symmetry")
    stiffer = mpm.LinearElastic(young=3 * ELASTIC.young, poisson=ELASTIC.poisson)  # which has averages of its own
    model, dt = soil(dim, geometry=geometry, law=[ELASTIC, stiffer]), 0.02
    model.assign((model.particles.position[:, 0] > 0.7).astype(np.int32))
    surface = (mpm.Disc if dim == 2 else mpm.Sphere)([0.7] * (dim - 1) + [0.3], 0.2)
    axes = [not geometry] * (dim - 1) + [True]
    inertia = [0.3, 0.2, 0.4] if rotates and dim == 3 else [0.3]
    body = mpm.FreeBody(mass=7.0, axes=axes, rotates=rotates, inertia=inertia if rotates else None)
    model.add_contact(surface, friction=0.4, body=body, centre=np.add(surface.centre, 0.03))
    rng = np.random.default_rng(3)
    step = started(model, dt, nmd=nmd)
    n = sum(axes) + rotates * (2 * dim - 3)
    v = rng.normal(0.0, 0.1, step.iterate.shape).reshape(-1, dim) + np.array([0.0] * (dim - 1) + [-0.6])
    v, w = v.ravel(), np.full(n, 0.2)
    w[0 if geometry else dim - 1] = 0.4

    def balances(nodes, bodies):
        step.iterate, step.body_velocity = nodes, bodies
        assert step.trial(tangents=False)["failed"] == 0
        return np.array(step.residual), np.array(step.body_residual)

    step.iterate, step.body_velocity = v, w
    step.trial(tangents=True)
    step.assemble()
    columns, rows = (np.array(x).reshape(n, -1) for x in (step.body_columns, step.body_rows))
    rows = rows + matrix_of_strains(step, dim, np.array(step.body_rows_by_strain).reshape(n, -1))
    block = np.array(step.body_block).reshape(n, n)
    small = 1e-6
    for k in range(n):
        there, back = (balances(v, w + sign * small * np.eye(n)[k]) for sign in (1, -1))
        nodes, bodies = (-(a - b) / (2 * small * dt) for a, b in zip(there, back, strict=True))
        assert np.abs(columns[k] - nodes).max() < 1e-5 * np.abs(nodes).max()
        assert block[:, k] == pytest.approx(bodies, abs=1e-5 * np.abs(bodies).max())
    for _ in range(2):
        direction = rng.normal(0.0, 1.0, len(v))
        there, back = (balances(v + sign * small * direction, w)[1] for sign in (1, -1))
        expected = -(there - back) / (2 * small * dt)
        assert rows @ direction == pytest.approx(expected, abs=1e-5 * np.abs(rows).max())


def loaded_layer(body, *, weight=0.0, velocity=None):
    """A layer of 0.3 by 0.5 m between rollers on a fixed base, and a plate on it."""
    model = mpm.Model(box((6, 30), (0.3, 1.5)), ELASTIC)
    points = 0.025 * (np.indices((12, 20)).reshape(2, -1).T + 0.5)
    model.seed_points(points, np.full(len(points), 0.025**2), density=2000.0)
    rollers(model, axes=[0])
    model.fix(3)
    if weight:
        model.set_gravity((0.0, -weight))
    return model, model.add_contact(mpm.Box((-0.1, 0.5), (0.4, 0.6)), body=body, velocity=velocity)


def test_a_load_settles_as_far_as_the_plate_that_it_moves_must():
    # The way of the plate under a load is that at which a plate with this way feels the load.
    load = 1500.0
    model, plate = loaded_layer(mpm.Servo(force=(0.0, -load), speed=1.0))
    *_, report = model.implicit(1.0, dt=1.0, quasi_static=True)
    assert plate.force == pytest.approx([0, load], rel=1e-7)
    settled = -plate.displacement[1]
    assert settled == pytest.approx(
        load / 0.3 / (1e6 * 0.7 / (1.3 * 0.4)) * 0.5, rel=0.03
    )  # stress over M, times the height
    assert report.iterations <= 8
    other, plate = loaded_layer(None, velocity=(0.0, -settled))
    list(other.implicit(1.0, dt=1.0, quasi_static=True))
    assert plate.force[1] == pytest.approx(load, rel=1e-6)


def test_a_weight_rests_on_soil_and_falls_before_it_does():
    mass, dt, steps = 50.0, 0.01, 5
    model, plate = loaded_layer(mpm.FreeBody(mass=mass, axes=(False, True), rotates=False), weight=G)
    list(model.implicit(1.0, dt=0.5, quasi_static=True))
    assert plate.force[1] == pytest.approx(mass * G, rel=1e-6)
    # Backward Euler under a constant acceleration: g dt^2 n (n + 1) / 2.
    model = mpm.Model(box((4, 8), (1.0, 2.0)), ELASTIC)
    model.seed_points([(0.5, 0.1)], [1e-4], density=2000.0)
    model.fix(3)
    model.set_gravity((0.0, -G))
    stone = model.add_contact(mpm.Disc((0.5, 1.5), 0.1), body=mpm.FreeBody(mass=3.0, axes=(False, True), rotates=False))
    list(model.implicit(steps * dt, dt=dt))
    assert -stone.displacement[1] == pytest.approx(G * dt**2 * steps * (steps + 1) / 2, rel=1e-9)
    assert -stone.velocity[1] == pytest.approx(G * dt * steps, rel=1e-9)
    with pytest.raises(mpm.RunError, match="nothing holds a rigid body"):
        list(model.implicit(1.0, dt=0.5, quasi_static=True))


def test_a_footing_under_load_converges_quadratically_on_clay():
    model = mpm.Model(box((24, 16), (3.0, 2.0)), CLAY)
    x = 0.0625 * (np.indices((48, 24)).reshape(2, -1).T + 0.5)
    model.seed_points(x, np.full(len(x), 0.0625**2), density=1800.0)
    rollers(model, axes=[0])
    model.fix(3)
    load = 35e3  # 3.5 of the 5.14 times the strength that the clay carries
    footing = model.add_contact(
        mpm.Box((1.0, 1.5), (2.0, 1.7)), friction=0.5, body=mpm.Servo(force=(0.0, -load), speed=1.0)
    )
    step = started(model, 1.0, quasi_static=True, nmd=True)
    solution = mpm.Newton(tolerance=1e-10).solver(MPI.COMM_SELF, 2).solve(step, 1.0, True)
    assert solution.converged
    before, after = solution.residuals[-2:]
    assert solution.iterations <= 8 and after < 100 * before**2 + 1e-10
    assert step.finish() == ""
    assert footing.force[1] == pytest.approx(load, rel=1e-6)
    assert 1e-3 < -footing.displacement[1] < 0.1


def test_a_body_that_nothing_touches_rotates_on():
    # Its angular momentum is kept: R I R^T omega, in space about principal axes that rotate with it.
    inertia, dt = np.array([1.0, 2.0, 2.5]), 0.01
    model = mpm.Model(box((2, 2, 2), (2.0, 2.0, 2.0)), ELASTIC)
    model.seed_points([(0.1, 0.1, 0.1)], [1e-3], density=2000.0)
    model.fix(5)
    body = mpm.FreeBody(mass=10.0, inertia=inertia)
    stone = model.add_contact(mpm.Box((0.8, 0.9, 1.0), (1.2, 1.3, 1.4)), body=body, spin=(1.0, 0.5, 2.0))
    list(model.implicit(20 * dt, dt=dt))
    rotation = stone.rotation
    momentum = rotation @ (inertia * (rotation.T @ stone.spin))
    assert momentum == pytest.approx(inertia * [1.0, 0.5, 2.0], rel=1e-8)
    assert np.linalg.norm(stone.angle) > 0.4


def test_a_disc_rolls_down_a_slope():
    # a = 2/3 g sin(theta) without slip; backward Euler's way after n steps of a constant acceleration is a dt^2 n (n + 1) / 2.
    # The layer is soft enough that the disc touches several particles: over a row of points it would go by bumps.
    dt, steps, slope = 0.02, 20, np.radians(30.0)
    model = mpm.Model(box((32, 12), (2.4, 0.9)), mpm.LinearElastic(young=5e6, poisson=0.3))
    size = 0.0125
    column, row = np.indices((192, 8)).reshape(2, -1)
    points = size * np.column_stack([column + 0.4 + 0.2 * (row % 2), row + 0.5])  # none on the diagonal of a square
    model.seed_points(points, np.full(len(points), size**2), density=2000.0)
    rollers(model, axes=[0])
    model.fix(3)
    model.set_gravity((G * np.sin(slope), -G * np.cos(slope)))
    disc = model.add_contact(mpm.Disc((0.6, 0.4), 0.3), friction=0.5, body=mpm.FreeBody(mass=100.0))
    list(model.implicit(steps * dt, dt=dt))
    way = 2 / 3 * G * np.sin(slope) * dt**2 * steps * (steps + 1) / 2
    assert disc.displacement[0] == pytest.approx(way, rel=0.005)
    assert -0.3 * disc.angle[0] == pytest.approx(disc.displacement[0], rel=0.001)


def test_a_smooth_disc_that_may_turn_is_refused_without_inertia():
    model, plate = loaded_layer(None)
    body = mpm.FreeBody(mass=3.0, axes=(False, True), force=(0.0, -500.0))
    model.add_contact(mpm.Disc((0.15, 0.8), 0.2), body=body)
    with pytest.raises(mpm.RunError, match="nothing keeps from turning, needs rotates=False"):
        list(model.implicit(1.0, dt=1.0, quasi_static=True))


def tilt_of_a_footing(finer, young, poisson, half, load, offset):
    """Tilt of a smooth strip on a wide layer under an eccentric load, on cells of 0.125 m over `finer`."""
    size = 0.0625 / finer
    mesh = box((48 * finer, 26 * finer), (6.0, 3.25), diagonals="alternating")
    model = mpm.Model(mesh, mpm.LinearElastic(young=young, poisson=poisson))
    points = size * (np.indices((96 * finer, 48 * finer)).reshape(2, -1).T + (0.3, 0.5))  # beside the diagonals
    model.seed_points(points, np.full(len(points), size**2), density=1000.0)
    rollers(model, axes=[0])
    model.fix(3)
    body = mpm.FreeBody(mass=1.0, inertia=0.1, axes=(False, True), force=(0.0, -load))
    strip, centre = mpm.Box((3.0 - half, 3.0), (3.0 + half, 3.2)), (3.0 + offset, 3.0)
    footing = model.add_contact(strip, penalty=1.0, body=body, centre=centre)
    *_, report = model.implicit(1.0, dt=1.0, quasi_static=True)
    assert report.iterations <= 8
    assert footing.force[1] == pytest.approx(load, rel=1e-6)
    assert footing.moment[0] == pytest.approx(0.0, abs=1e-6 * load * offset)
    return -footing.angle[0]


def test_a_footing_tilts_under_an_eccentric_load():
    # A smooth rigid strip of half width a on an elastic half plane tilts by 4 (1 - nu^2) M / (pi a^2 E) (Muskhelishvili 1953).
    # Cells at its edges make it wider by a part of their size, so that the error falls with the first power of it.
    young, poisson, half, load, offset = 1e7, 0.3, 0.5, 20e3, 0.1
    coarse, fine = (tilt_of_a_footing(finer, young, poisson, half, load, offset) for finer in (1, 2))
    exact = 4 * (1 - poisson**2) * load * offset / (np.pi * half**2 * young)
    assert coarse < fine < exact
    assert 2 * fine - coarse == pytest.approx(exact, rel=0.02)


def test_what_the_scheme_leaves_out_is_refused():
    model, plate = loaded_layer(mpm.FreeBody(mass=3.0, rotates=False))
    with pytest.raises(mpm.InputError, match="second_order is True, expected False with a Box"):
        model.implicit(1.0, dt=0.1, second_order=True)
    ball = model.add_contact(mpm.Disc((0.1, 0.9), 0.1))
    ball.add_collision(plate)
    with pytest.raises(mpm.InputError, match="Box that collides with other bodies"):
        model.implicit(1.0, dt=0.1)
