"""Large deformation with large steps: a column under its weight, a rigid rotation, a beam that bends far."""

import numpy as np
import pytest
from core_cases import box

import mpm_core as mpm
from mpm_core import _core


def test_finite_strain_column_settles_to_the_exact_value():
    """Where the Cauchy stress follows a rate law and nu = 0, sigma = E ln(stretch), and sigma = -w (H - X) at the place that
    was X above the base. So u(X) = int_0^X exp(-w (H - s)/E) ds - X: -0.986801 m at the top. Linear MPM errs where particles
    cross between cells; ten cells and 24 particles in each keep that below half a per cent."""
    height, weight, young = 50.0, 800.0, 1e6
    model = mpm.Model(box([1, 10], [5.0, height]), mpm.LinearElastic(young=young, poisson=0.0))
    model.seed(density=weight / 10.0, per_cell=24)
    for tag in (1, 2):
        model.roller(tag, (1, 0))
    model.fix(3)
    model.set_gravity((0, -10.0), ramp=1.0)
    *_, report = model.implicit(1.0, dt=0.1, quasi_static=True)
    assert report.cuts == 0
    top = np.argmax(model.particles.initial_position[:, 1])
    x = model.particles.initial_position[top, 1]
    exact = young / weight * (np.exp(-weight * (height - x) / young) - np.exp(-weight * height / young)) - x
    assert exact == pytest.approx(-0.9868, abs=1e-4)
    assert model.particles.displacement[top, 1] == pytest.approx(exact, rel=5e-3)


def test_rigid_rotation_turns_stresses_and_keeps_their_size():
    """The nodes spin by w over dt: no strain, and a rotation by 2 arctan(w dt / 2), however large."""
    model = mpm.Model(box([4, 4]), mpm.LinearElastic(young=1e6, poisson=0.3))
    model.seed_points([[0.45, 0.6], [0.55, 0.52]], [1e-2, 1e-2], density=1000.0)
    model.particles.set("stress", np.tile([5.0, -3.0, 1.0, 2.0], (2, 1)))
    angle, dt = 0.7, 0.1
    step = _core.ImplicitStep2(model._core)
    step.start(_core.ImplicitOptions(), dt)
    arm = step.points - 0.5
    step.iterate = (2 * np.tan(angle / 2) / dt * np.c_[-arm[:, 1], arm[:, 0]]).ravel()
    assert step.trial()["failed"] == 0
    assert step.finish() == ""
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    tensor = turn @ np.array([[5.0, 2.0], [2.0, -3.0]]) @ turn.T
    expected = [tensor[0, 0], tensor[1, 1], 1.0, tensor[0, 1]]
    assert np.abs(model.particles.stress - expected).max() < 1e-9


def test_a_body_that_spins_grows_by_half_the_square_of_the_angle_of_a_step():
    """1 + a W lengthens all arms by sqrt(1 + a^2), which is no strain: the known limit of docs/howto/limits.md."""
    model = mpm.Model(box([6, 6], (6.0, 6.0), body=((2.0, 2.0), (4.0, 4.0))), mpm.LinearElastic(young=1e9, poisson=0.3))
    model.seed(density=1.0, per_cell=6, cell_tag=1)
    arm = model.particles.position - 3.0
    model.particles.set("velocity", 0.2 * np.c_[-arm[:, 1], arm[:, 0]])
    list(model.implicit(1.0, dt=1.0))
    order = np.argsort(model.particles.id)
    moved = (model.particles.position - model.particles.displacement - 3.0)[order]
    gradient = np.linalg.lstsq(moved, model.particles.position[order] - 3.0, rcond=None)[0].T
    angle = 0.5 * (gradient[1, 0] - gradient[0, 1])  # less than 0.2, as masses are lumped
    assert 0.1 < angle < 0.2
    np.testing.assert_allclose(gradient, [[1.0, -angle], [angle, 1.0]], atol=1e-6)
    assert np.linalg.norm(gradient[:, 0]) == pytest.approx(np.sqrt(1 + angle**2), rel=1e-6)


# Tip displacement of the inextensible elastica by its length, across and along, at P L^2 / (E I).
ELASTICA = {1: (0.30172, 0.05643), 2: (0.49346, 0.16064)}


def bent_beam(squares, load, steps=20):
    """Tip displacement by length of a beam 1 x 0.1 m, clamped on the left, with a tip load that rises step by step."""
    depth, young = 0.1, 1e6
    h = depth / squares
    nx, ny, low = round(1.05 / h), round(0.75 / h), round(0.6 / h) * h
    mesh = box([nx, ny], [nx * h, ny * h], diagonals="alternating", body=((0, low), (1.0, low + depth)))
    model = mpm.Model(mesh, mpm.LinearElastic(young=young, poisson=0.0))
    model.seed(density=1.0, per_cell=24, cell_tag=1)
    model.fix(1)
    force = load * young * depth**3 / 12
    for k in range(1, steps + 1):
        tip = model.particles.initial_position[:, 0] > 1.0 - h
        traction = np.zeros(model.particles.position.shape)
        traction[tip, 1] = -force * k / steps / tip.sum()
        model.particles.set("traction", traction)
        list(model.implicit(float(k), dt=1.0, quasi_static=True))
    tip = model.particles.initial_position[:, 0] > 1.0 - h
    u = model.particles.displacement[tip].mean(axis=0)
    return -u[1], -u[0]


@pytest.mark.parametrize("load", [1, 2])
def test_beam_bends_as_the_elastica(load):
    """Triangles are stiff in bending, so the beam comes nearer as they become smaller."""
    across, along = ELASTICA[load]
    errors = [abs(bent_beam(squares, load)[0] / across - 1) for squares in (2, 4, 8)]
    assert errors[2] < 0.05 and errors[2] < errors[0]
    assert errors[0] > 0.1
