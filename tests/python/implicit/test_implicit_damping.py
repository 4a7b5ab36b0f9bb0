"""Forces in proportion to the momentum in implicit steps, against the numbers that the methods give one degree of freedom."""

import numpy as np
import pytest
from core_cases import box

import mpm_core as mpm

ALPHA, DT, STEPS, GRAVITY, SPEED = 3.0, 0.05, 8, 2.0, 0.4
DAMPING = mpm.Rayleigh(mass=ALPHA, plastic_strain=np.inf)
SOIL = mpm.MohrCoulomb(young=1e6, poisson=0.3, cohesion=1.0, friction_angle=30.0)


def flying(dim=2):
    """A body that nothing holds, and that moves without strain."""
    model = mpm.Model(box([8] * dim, [4.0] * dim, body=([1.5] * dim, [2.5] * dim)), SOIL)
    model.seed(density=1000.0, per_cell=6 if dim == 2 else 8, cell_tag=1)
    model.particles.set("velocity", np.tile([SPEED, *[0.0] * (dim - 1)], (len(model.particles), 1)))
    return model


@pytest.mark.filterwarnings("ignore:nothing holds the particles")
@pytest.mark.parametrize("dim", [2, 3])
def test_a_flight_is_slowed_down_as_by_backward_euler(dim):
    # v1 = (v0 + g dt) / (1 + alpha dt); the work of the forces is that of alpha m v1 over v1 dt.
    model = flying(dim)
    model.set_gravity((GRAVITY, *[0.0] * (dim - 1)))
    report = model.implicit(STEPS * DT, dt=DT, rayleigh=DAMPING, energy_limit=None).last()
    velocity, work, mass = SPEED, 0.0, model.particles.mass.sum()
    for _ in range(STEPS):
        velocity = (velocity + GRAVITY * DT) / (1 + ALPHA * DT)
        work += ALPHA * mass * velocity**2 * DT
    expected = np.tile([velocity, *[0.0] * (dim - 1)], (len(model.particles), 1))
    np.testing.assert_allclose(model.particles.velocity, expected, rtol=1e-9, atol=1e-9 * SPEED)
    assert report.damping_work == pytest.approx(work, rel=1e-9)


def test_steps_of_second_order_take_it_as_their_method_does():
    # Both stages have the coefficient g: v1 = v0 (1 + (1 - 2 g) z) / (1 - g z)^2 with z = -alpha dt (Alexander 1977).
    model, g, z = flying(), 1 - np.sqrt(0.5), -ALPHA * DT
    model.implicit(STEPS * DT, dt=DT, second_order=True, rayleigh=DAMPING, energy_limit=None).last()
    factor = (1 + (1 - 2 * g) * z) / (1 - g * z) ** 2
    assert factor == pytest.approx(np.exp(z), rel=2e-3)
    expected = np.tile([SPEED * factor**STEPS, 0.0], (len(model.particles), 1))
    np.testing.assert_allclose(model.particles.velocity, expected, rtol=1e-9, atol=1e-9 * SPEED)


def test_quasi_static_steps_have_none():
    def settled(**options):
        model = mpm.Model(box([2, 6], [0.5, 1.5]), mpm.LinearElastic(young=1e6, poisson=0.3))
        model.seed(density=1000.0, per_cell=6)
        model.roller((1, 2), (1, 0))
        model.fix(3)
        model.set_gravity((0.0, -10.0))
        model.implicit(1.0, dt=1.0, quasi_static=True, **options).last()
        return model.particles.displacement

    np.testing.assert_array_equal(settled(rayleigh=DAMPING), settled())


@pytest.mark.parametrize(
    ("damping", "message"),
    [
        (mpm.Rayleigh(mass=1.0, stiffness=0.1, plastic_strain=np.inf), "rayleigh.stiffness is 0.1 s, expected 0"),
        (mpm.Rayleigh(mass=1.0), "rayleigh.plastic_strain is 0.001, expected inf"),
        (5.0, "rayleigh is 5.0, expected a Rayleigh or None"),
    ],
)
def test_damping_that_implicit_steps_do_not_have_is_refused(damping, message):
    with pytest.raises(mpm.InputError, match=message):
        flying().implicit(DT, dt=DT, rayleigh=damping)
