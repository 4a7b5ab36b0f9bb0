"""Viscoplastic Mohr-Coulomb against its closed form in simple shear, in every scheme; its limits and its tangent."""

import numpy as np
import pytest
from core_cases import box, run
from law_cases import Batch, random_points
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

ELASTIC = {"young": 10e6, "poisson": 0.3}
SHEAR, LAME = 10e6 / 2.6, 10e6 * 0.3 / (1.3 * 0.4)
VISCOSITY, RATE = 2e6, 0.01  # the overstress in steady shear is 20 kPa
CLAY = mpm.ViscoplasticMohrCoulomb(**ELASTIC, cohesion=10e3, friction_angle=0.0, viscosity=VISCOSITY)
SAND = mpm.ViscoplasticMohrCoulomb(
    **ELASTIC, cohesion=2e3, friction_angle=30.0, dilation_angle=12.0, viscosity=VISCOSITY
)
PRESSURE = 40e3


def shear_stress(law, time):
    """Shear stress in simple shear at RATE from an isotropic pressure, after a time, by Perzyna's law.

    df/dt = G rate - K f / viscosity with K = G + (lambda + G) sin(phi) sin(psi), once f = 0 at t_y, and
    d(tau)/dt = G (rate - f / viscosity).
    """
    sine, flow = np.sin(np.radians([law.friction_angle, law.dilation_angle]))
    strength = PRESSURE * sine + law.cohesion * np.cos(np.radians(law.friction_angle))
    stiffness = SHEAR + (LAME + SHEAR) * sine * flow
    relaxation, yielded = VISCOSITY / stiffness, strength / (SHEAR * RATE)
    t = max(time - yielded, 0.0)
    # f = G rate T (1 - exp(-t / T)), integrated
    multiplier = SHEAR * RATE * relaxation / VISCOSITY * (t - relaxation * (1 - np.exp(-t / relaxation)))
    return SHEAR * (RATE * time - multiplier)


@pytest.mark.parametrize("law", [CLAY, SAND], ids=["Tresca", "dilatant"])
def test_simple_shear_is_that_of_perzyna_to_first_order_in_the_step(law):
    errors = []
    for steps in (200, 400, 800):
        test = mpm.ElementTest(law, [-PRESSURE] * 3 + [0.0])
        for _ in range(steps):
            test.step([0, 0, 0, RATE * 2.0 / steps], dt=2.0 / steps)
        errors.append(test.stress[3] - shear_stress(law, 2.0))
    assert abs(errors[-1]) < 2e-3 * shear_stress(law, 2.0)
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.05)
    assert errors[1] / errors[2] == pytest.approx(2.0, rel=0.05)


def test_steady_shear_of_a_clay_is_that_of_a_bingham_fluid():
    for rate in (1e-3, 1e-2, 1e-1):
        test = mpm.ElementTest(CLAY, [-PRESSURE] * 3 + [0.0])
        for _ in range(400):
            test.step([0, 0, 0, rate * 0.05], dt=0.05)
        assert test.stress[3] == pytest.approx(10e3 + VISCOSITY * rate, rel=1e-9)
        assert test.time == pytest.approx(20.0)


def test_overstress_relaxes_at_rest_on_every_part_of_the_surface():
    # Duvaut-Lions by backward Euler: what is outside is divided by 1 + dt / T, and the nearest point stays what it is
    stress, _ = random_points(3, 500, pressure=20e3, deviator=40e3, strain=0.0)
    inviscid = mpm.MohrCoulomb(**ELASTIC, cohesion=2e3, friction_angle=30.0, dilation_angle=12.0)
    inside = Batch(inviscid, stress, np.zeros_like(stress)).stress
    state, at_rest = np.zeros((500, 2)), np.zeros_like(stress)
    dt, now = 0.3 * SAND.relaxation_time, stress.copy()
    for k in range(1, 6):
        SAND.update(at_rest, now, state, dt=dt)
        assert np.abs(now - inside - (stress - inside) / 1.3**k).max() < 1e-6
    assert (np.abs(stress - inside).max(axis=1) > 1e3).sum() > 200


@pytest.mark.parametrize("dim", [2, 3])
def test_limits_of_slow_and_fast_loading(dim):
    stress, strain = random_points(dim, 300, pressure=30e3, deviator=10e3, strain=2e-3)
    inviscid = mpm.MohrCoulomb(**ELASTIC, cohesion=2e3, friction_angle=30.0, dilation_angle=12.0)
    slow, reference = Batch(SAND, stress, strain), Batch(inviscid, stress, strain)
    assert np.array_equal(slow.stress, reference.stress) and np.array_equal(slow.tangent, reference.tangent)
    assert np.array_equal(slow.state, reference.state) and reference.report.plastic > 100
    now, state = stress.copy(), np.zeros((300, SAND.n_state))
    SAND.update(strain, now, state, dt=0.0)
    elastic = Batch(mpm.LinearElastic(**ELASTIC), stress, strain)
    assert np.abs(now - elastic.stress).max() < 1e-9 * np.abs(stress).max()
    assert np.abs(state).max() < 1e-18


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("law", [CLAY, SAND], ids=["Tresca", "dilatant"])
def test_tangent_is_the_derivative_of_the_stress(law, dim):
    stress, strain = random_points(dim, 200, pressure=30e3, deviator=10e3, strain=2e-3)

    def updated(increment):
        new, state, tangent = stress.copy(), np.zeros((200, law.n_state)), np.zeros((200, *2 * stress.shape[1:]))
        law.update(increment, new, state, tangent, dt=0.7 * law.relaxation_time)
        return new, tangent

    tangent, step = updated(strain)[1], 1e-8
    derivative = np.zeros_like(tangent)
    for k in range(strain.shape[1]):
        push = np.zeros(strain.shape[1])
        push[k] = step
        derivative[:, :, k] = (updated(strain + push)[0] - updated(strain - push)[0]) / (2 * step)
    error = np.abs(tangent - derivative).max(axis=(1, 2)) / law.p_wave_modulus
    assert np.median(error) < 1e-7 and (error < 1e-5).mean() > 0.95  # kinks between regions are left out


def sheared_box():
    """A square of two triangles whose base is fixed and whose top moves along: every node is prescribed."""
    model = mpm.Model(box([1, 1]), CLAY)
    model.seed(density=2000.0, per_cell=3)
    model.particles.set("stress", np.tile([-PRESSURE] * 3 + [0.0], (len(model.particles), 1)))
    model.fix(3)
    model.prescribe(4, (RATE, 0.0))
    return model


def test_particles_in_both_schemes_follow_the_closed_form():
    explicit, implicit = sheared_box(), sheared_box()
    run(explicit, 1.0, dt=1e-3, allow_unstable=True)
    list(implicit.implicit(1.0, dt=1e-2, quasi_static=True))
    expected = shear_stress(CLAY, 1.0)
    # The strain is 0.01, of which rotation makes second order
    assert np.abs(explicit.particles.stress[:, 3] - expected).max() < 2e-3 * expected
    assert np.abs(implicit.particles.stress[:, 3] - expected).max() < 1e-2 * expected


def test_finite_elements_follow_the_closed_form_in_time():
    domain, _, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, [1.0, 1.0], [1, 1])
    supports = [bridge.fixed(3), bridge.prescribed(4, (RATE, 0.0))]
    errors = []
    for steps in (50, 100):
        fem = bridge.QuasiStatic(domain, CLAY, facet_tags, supports, degree=1)
        fem.set_initial_stress(np.tile([-PRESSURE] * 3 + [0.0], (fem.points.n, 1)), bridge.Load())
        for k in range(1, steps + 1):
            assert fem.equilibrate(bridge.Load(displacement=k / steps), duration=1.0 / steps).converged
        errors.append(np.abs(fem.points.stress[:, 3] - shear_stress(CLAY, 1.0)).max())
    assert errors[1] < 5e-3 * shear_stress(CLAY, 1.0)
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.1)
    assert fem.points.time == pytest.approx(1.0)
    assert fem.equilibrate(fem.load).converged  # slow without limit: what is above the strength is gone
    assert fem.points.stress[:, 3] == pytest.approx(10e3, rel=1e-9)


def test_equilibration_of_particles_ends_without_overstress():
    model = sheared_box()
    run(model, 1.0, dt=1e-3, allow_unstable=True)
    assert model.particles.stress[:, 3].min() > 12e3
    model.prescribe(4, (0.0, 0.0))
    model.equilibrate()
    assert model.particles.stress[:, 3] == pytest.approx(10e3, rel=1e-3)
