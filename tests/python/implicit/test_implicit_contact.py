"""Contact in implicit steps: tangent, Newton's method, closed forms of sliding and of compression, and tied surfaces."""

import numpy as np
import pytest
from core_cases import box, rollers
from implicit_cases import difference_of_residual, tangent
from mpi4py import MPI

import mpm_core as mpm
from mpm_core import _core

G = 9.81
pytestmark = pytest.mark.filterwarnings("error:nothing holds the particles")  # a surface does
ELASTIC = mpm.LinearElastic(young=1e6, poisson=0.3)


def soil(dim, *, geometry=None, side=0.1, cells=None, size=(4, 3, 3), corner=0.5, law=ELASTIC):
    """A block of particles of this side whose low corner is at (corner, ...), on a mesh that does not follow it."""
    mesh = box(cells or [6] * dim, [1.5] * dim, shake=0.15, diagonals="alternating")
    model = mpm.Model(mesh, law, geometry=geometry)
    grid = corner + side * (np.indices(size[:dim]).reshape(dim, -1).T + 0.5)
    volume = side**dim * (grid[:, 0] if geometry else np.ones(len(grid)))
    model.seed_points(grid, volume, density=2000.0)
    return model


def started(model, dt, **options):
    chosen = _core.ImplicitOptions()
    for name, value in options.items():
        setattr(chosen, name, value)
    step = getattr(_core, type(model._core).__name__.replace("Model", "ImplicitStep"))(model._core)
    step.start(chosen, dt)
    return step


SURFACES = {
    "rough": (lambda dim: mpm.Plane([0.5] * dim, [0.0] * (dim - 1) + [1.0]), {"friction": 0.3, "adhesion": 300.0}),
    "sticks": (lambda dim: mpm.Plane([0.5] * dim, [0.0] * (dim - 1) + [1.0]), {"friction": 50.0}),
    "ball": (
        lambda dim: (mpm.Disc if dim == 2 else mpm.Sphere)([0.7] * (dim - 1) + [0.3], 0.2),
        {"friction": 0.4, "velocity": None},  # set below
    ),
    "turns": (lambda dim: mpm.Box([0.4] * dim, [1.2] * (dim - 1) + [0.5]), {"friction": 0.4, "spin": 3.0}),
    "tied": (lambda dim: mpm.Plane([0.5] * dim, [0.0] * (dim - 1) + [1.0]), {"bonded": True, "spin": 3.0}),
}


@pytest.mark.parametrize("name", SURFACES)
@pytest.mark.parametrize("dim, geometry", [(2, None), (3, None), (2, mpm.Geometry.AXISYMMETRIC)])
@pytest.mark.parametrize("nmd", [False, True])
def test_the_tangent_is_the_derivative_of_the_residual(name, dim, geometry, nmd):
    model, dt = soil(dim, geometry=geometry), 0.02
    surface, options = SURFACES[name][0](dim), dict(SURFACES[name][1])
    if "spin" in options and geometry:
        del options["spin"]
    elif "spin" in options and dim == 3:
        options["spin"] = (1.0, -2.0, 3.0)
    if "velocity" in options:
        options["velocity"] = [0.0 if geometry else 0.2] * (dim - 1) + [0.5]
    model.add_contact(surface, **options)
    rng = np.random.default_rng(3)
    step = started(model, dt, nmd=nmd)
    v = rng.normal(0.0, 0.1, step.iterate.shape).reshape(-1, dim)
    v += [0.3] * (dim - 1) + [-0.6]  # along the surface and into it
    v = v.ravel()
    step.iterate = v
    assert step.trial(tangents=True)["failed"] == 0
    step.assemble()
    j = tangent(step, dim)
    for _ in range(3):
        direction = rng.normal(0.0, 1.0, len(v))
        difference = difference_of_residual(step, v, direction, dt)
        assert np.abs(j @ direction - difference).max() < 5e-6 * np.abs(difference).max()


@pytest.mark.parametrize("slope, friction", [(30, 0.0), (30, 0.3), (45, 0.5), (30, 0.62)])
@pytest.mark.parametrize("turned", [0.0, 0.3])
def test_a_block_slides_as_coulomb_says(slope, friction, turned):
    # Backward Euler under a constant acceleration a goes a dt^2 n (n + 1) / 2 in n steps.
    theta = np.radians(slope)
    turn = np.array([[np.cos(turned), -np.sin(turned)], [np.sin(turned), np.cos(turned)]])
    model = mpm.Model(box((16, 8), (4.0, 2.0), shake=0.2), mpm.LinearElastic(young=2e7, poisson=0.3))
    grid = (np.indices((8, 4)).reshape(2, -1).T + 0.5) / 8
    model.seed_points((0.4, 0.5) + grid @ turn.T, np.full(len(grid), 1 / 64), density=1000.0)
    ground = model.add_contact(mpm.Plane((0.4, 0.5) - 1e-12 * turn[:, 1], turn[:, 1]), friction=friction)
    model.set_gravity(turn @ (G * np.sin(theta), -G * np.cos(theta)))
    dt, steps = 0.02, 30
    *_, report = model.implicit(steps * dt, dt=dt)
    slides = max(G * (np.sin(theta) - friction * np.cos(theta)), 0.0)
    distance = (model.particles.displacement @ turn[:, 0]).mean()
    assert distance == pytest.approx(slides * dt**2 * steps * (steps + 1) / 2, rel=5e-3, abs=1e-4)
    weight = report.mass * G
    held = min(friction * np.cos(theta), np.sin(theta))
    expected = weight * np.array([held, -np.cos(theta)]) * report.time
    assert turn.T @ ground.impulse == pytest.approx(expected, abs=5e-3 * weight * report.time)
    assert (ground.sticking_fraction > 0.8) == (np.tan(theta) < friction)


def off_diagonals(points, side):
    """Rows of a grid of particles, moved to and fro so that none is on a diagonal, on which two triangles would share it."""
    rows = np.floor(points[:, 1] / side)
    return points + np.column_stack([0.1 * side * (-1.0) ** rows, np.zeros(len(points))])


def compressed(bonded, n, shift=0.0):
    """A layer between plates that approach by a thousandth of its height, with particles of 0.05 / n.

    Returns:
        The force on a plate over that in closed form, and the normal stresses over that force per area.
    """
    side, rows = 0.05 / n, 10 * n
    model = mpm.Model(box((3 * n, 15 * n), (0.3, 1.5)), mpm.LinearElastic(young=1e6, poisson=0.3))
    grid = side * (np.indices((6 * n, rows)).reshape(2, -1).T + 0.5)
    grid = (grid if bonded else off_diagonals(grid, side)) + (0.0, 0.4 + shift)
    model.seed_points(grid, np.full(len(grid), side**2), density=2000.0)
    rollers(model, axes=[0])
    move = 5e-4 if bonded else -5e-4
    plates = [
        model.add_contact(mpm.Plane((0, 0.4 + shift), (0, 1)), bonded=bonded),
        model.add_contact(mpm.Plane((0, 0.9 + shift), (0, -1)), bonded=bonded, velocity=(0.0, move)),
    ]
    *_, report = model.implicit(1.0, dt=0.5, quasi_static=True, integration=mpm.Integration.MIXED)
    force = 1e6 * 0.7 / (1.3 * 0.4) * move / 0.5 * 0.3  # M times the strain times the width
    assert plates[0].force[1] + plates[1].force[1] == pytest.approx(0, abs=1e-6 * abs(force))
    return -plates[1].force[1] / force, -model.particles.stress[:, 1] / plates[1].force[1] * 0.3


@pytest.mark.parametrize("n", [1, 2])
def test_plates_compress_a_layer_that_feels_all_of_their_force(n):
    # Of 10 n particles those at the plates have a spring a tenth as long as they are, and lack a quarter, as their radius is
    # half the root of an area: 0.3 of a particle in all, which does not strain.
    force, stresses = compressed(False, n)
    assert force == pytest.approx(10 * n / (10 * n - 0.3), abs=1e-3)
    assert stresses == pytest.approx(1.0, abs=0.01)  # 0.72 to 1 with the forces at the particles' centres


def test_plates_pull_a_layer_that_is_tied_to_them():
    # As above; tied particles lack their outer half: 0.8 of a particle in all, where nothing spreads.
    errors = [compressed(True, n)[0] - 1 for n in (1, 2)]
    assert 0 < errors[1] < 0.65 * errors[0] < 0.65 * 0.8 / (10 - 0.8)
    assert abs(compressed(True, 2, 0.0371)[0] - 1) < 0.8 / (20 - 0.8)  # the layer cuts cells


@pytest.mark.parametrize("across", [3, 6])
def test_cells_that_a_plate_cuts_feel_its_force_on_average(across):
    # The mean normal stress of the particles at the plate, over eight heights of it in a cell. Each has an error, as particles
    # fill a cell in steps of their size; with the forces at their centres the mean is 0.75.
    stress = []
    for part in np.arange(8) / 8:
        model = mpm.Model(box((3, 8), (0.3, 0.8)), mpm.LinearElastic(young=1e6, poisson=0.3))
        side, base = 0.1 / across, 0.2 + 0.1 * part
        points = off_diagonals(side * (np.indices((3 * across, 4 * across)).reshape(2, -1).T + 0.5), side) + (0, base)
        model.seed_points(points, np.full(len(points), side**2), density=2000.0)
        rollers(model, axes=[0])
        model.add_contact(mpm.Plane((0, base - 1e-12), (0, 1)))
        model.load_surface(mpm.Plane((0, base + 0.4), (0, -1)), pressure=1e3)
        model.implicit(1.0, dt=0.5, quasi_static=True, integration=mpm.Integration.MIXED).last()
        at_plate = model.particles.position[:, 1] < base + 0.8 * side
        stress.append(-model.particles.stress[at_plate, 1].mean() / 1e3)
    assert np.mean(stress) == pytest.approx(1.0, abs=0.08)


def test_newtons_method_converges_quadratically():
    model = soil(2, law=mpm.MohrCoulomb(young=1e6, poisson=0.3, cohesion=1e3, friction_angle=30.0, dilation_angle=30.0))
    model.add_contact(mpm.Disc((0.72, 0.3), 0.2 - 1e-9), friction=0.2, velocity=(0.05, 0.3))
    model.add_contact(mpm.Plane((0.5, 0.5), (0, 1)), friction=0.3)
    model.set_gravity((0.0, -G))
    step = started(model, 0.02)
    solution = mpm.Newton(tolerance=1e-12).solver(MPI.COMM_SELF, 2).solve(step, step.dt, True)
    assert solution.converged
    last = [r for r in solution.residuals if r > 1e-12][-3:]  # until round-off
    assert last[-1] < 10 * last[-2] ** 2 < 1e3 * last[-3] ** 4


def footing_on(law, weight, push, nmd=True):
    """A rough footing on a bed between smooth walls and on a rough base; all of them are rigid surfaces."""
    model = mpm.Model(box((24, 16), (3.0, 2.0)), law)
    x = 0.0625 * (np.indices((48, 24)).reshape(2, -1).T + 0.5)
    model.seed_points(x, np.full(len(x), 0.0625**2), density=1800.0)
    model.add_contact(mpm.Plane((0, 0), (0, 1)), friction=0.5)
    for place, normal in ((0.0, (1, 0)), (3.0, (-1, 0))):
        model.add_contact(mpm.Plane((place, 0), normal))
    model.set_gravity((0.0, -weight / 1800.0), ramp=0.5)
    model.add_contact(
        mpm.Box((1.0, 1.5), (2.0, 1.7)), friction=0.5, velocity=([0.0, 0.5, 0.6], [(0, 0), (0, 0), (0, -push)])
    )
    return list(
        model.implicit(1.0, dt=0.1, every_steps=1, quasi_static=True, nmd=nmd, integration=mpm.Integration.MIXED)
    )


CLAY = mpm.tresca(young=5e6, poisson=0.49, shear_strength=10e3)
SAND = mpm.MohrCoulomb(young=5e6, poisson=0.3, cohesion=1e3, friction_angle=30.0, dilation_angle=0.0)


@pytest.mark.parametrize("law, weight", [(CLAY, 18e3), (CLAY, 0.0), (SAND, 18e3)])
def test_rough_footings_on_soil_that_yields_take_few_iterations(law, weight):
    steps = footing_on(law, weight, push=0.02)
    pushed = [report for report in steps if report.time > 0.55]
    assert sum(report.cuts for report in pushed) == 0 and len(pushed) == 5
    assert all(report.iterations <= 10 for report in pushed)
    assert steps[-1].plastic_fraction > 0.02


def test_a_step_begins_with_the_forces_with_which_the_last_one_ended():
    # The soil has shrunk by more than it sinks into the ground: with the radius of the last step's start it would hang there.
    model = soil(2, size=(3, 10))
    ground = model.add_contact(mpm.Plane((0.5, 0.5), (0, 1)))
    model.set_gravity((0.0, -G))
    *_, report = model.implicit(1.0, dt=1.0, quasi_static=True)
    weight = report.mass * G
    assert ground.force[1] == pytest.approx(-weight, rel=1e-6)
    step = started(model, 1.0, quasi_static=True)
    step.iterate = np.zeros_like(step.iterate)
    step.trial(tangents=False)
    assert (
        abs(np.asarray(step.residual).reshape(-1, 2).sum(axis=0)[1]) < 5e-3 * weight
    )  # its stiffness is that of the new size


def test_a_run_goes_on_from_a_checkpoint_to_the_last_bit(tmp_path):
    def built():
        model = soil(2)
        model.add_contact(mpm.Plane((0.5, 0.5), (0, 1)), friction=0.3)
        model.add_contact(mpm.Disc((0.72, 0.9), 0.1), friction=0.3, velocity=(0.1, -0.2), spin=1.0)
        model.set_gravity((2.0, -G))
        return model

    first, second = built(), built()
    list(first.implicit(0.04, dt=0.01))
    first.save(tmp_path / "half.h5")
    list(first.implicit(0.08, dt=0.01))
    second.restore(tmp_path / "half.h5")
    list(second.implicit(0.08, dt=0.01))
    for name in ("position", "velocity", "stress", "contact_slip_0", "contact_slip_1"):
        assert np.array_equal(getattr(first.particles, name), getattr(second.particles, name))
    assert first.contacts[1].values() == second.contacts[1].values()


def test_what_the_scheme_leaves_out_is_refused():
    model = soil(2)
    model.add_contact(mpm.Plane((0.5, 0.5), (0, 1)))
    for options in ({"small_displacements": True, "quasi_static": True}, {"solver": mpm.Relaxation()}):
        with pytest.raises(mpm.InputError, match=r"rigid surfaces \(Plane\)"):
            model.implicit(1.0, dt=0.1, **options)
    with pytest.raises(mpm.InputError, match="the surface has friction 0.3, adhesion 0 Pa, expected 0 where bonded"):
        model.add_contact(mpm.Plane((0.5, 0.5), (0, 1)), friction=0.3, bonded=True)
    with pytest.raises(mpm.InputError, match="no particle is beside surface"):
        model.add_contact(mpm.Plane((0.2, 0.2), (0, 1)), bonded=True)
