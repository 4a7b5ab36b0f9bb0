"""Elastic moduli of points: what acts by them does not depend on how the law says it."""

import numpy as np
import pytest
from core_cases import box, by_id
from mpm_core.free_field import layers_at
from mpm_core.ground_column import GroundColumn
from test_laws_everywhere import CLAY, LAWS, PRESSURE, START

import mpm_core as mpm

YOUNG, POISSON = 1e6, 0.3
STRONG = {"poisson": POISSON, "cohesion": 1e9, "friction_angle": 30.0}
PLAIN = mpm.MohrCoulomb(young=YOUNG, **STRONG)
OF_POINTS = mpm.Heterogeneous(mpm.MohrCoulomb(young=16 * YOUNG, **STRONG), ["young"])
"""A law that is sixteen times as stiff as its points"""


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS.keys())
def test_the_moduli_are_those_of_the_tangent(law):
    stress, state = START[None].copy(), np.zeros((1, law.n_state))
    for name in {"log_preconsolidation", "log_image_pressure"} & set(law.state_names):
        state[0, law.state_names.index(name)] = 0.4
    moduli, tangent = law.wave_moduli(stress, state), np.empty((1, 4, 4))
    law.update(np.zeros((1, 4)), stress, state, tangent)
    of_volume = (
        PRESSURE if "Hencky" in law.name else 0.0
    )  # d tau / d strain is that of the Cauchy stress less the stress
    assert moduli[0] == pytest.approx([tangent[0, 0, 0] - of_volume, tangent[0, 3, 3]], rel=1e-9)


def test_moduli_of_points_are_asked_for_by_arrays_of_the_right_shape():
    with pytest.raises(mpm.InputError, match=r"stress has shape \(2, 3\), expected \(2, 4\)"):
        CLAY.wave_moduli(np.zeros((2, 3)), np.zeros((2, 3)))
    with pytest.raises(mpm.InputError, match=r"state has shape \(2, 1\), expected \(2, 3\)"):
        CLAY.wave_moduli(np.zeros((2, 6)), np.zeros((2, 1)))


def block(law, per_cell=6):
    """Elastic soil of one stiffness, by the law's number or by values of its particles."""
    model = mpm.Model(box((6, 6), (1.0, 1.0), diagonals="alternating"), law)
    model.seed(density=2000.0, per_cell=per_cell)
    if law is OF_POINTS:
        model.set_parameter("young", YOUNG)
    return model


def waves(law):
    """A block that is shaken through its base, with damping in proportion to stiffness."""
    model = block(law)
    model.absorb(3, thickness=20.0)
    model.shake(mpm.Motion([0.0, 0.01, 0.02], [0.0, 1e-3, 0.0]), (1.0, 0.5))
    model.explicit(0.03, dt=2e-4, energy_limit=None, rayleigh=mpm.Rayleigh(stiffness=1e-3)).last()
    return model


def short_consolidation(law):
    """The first step after a load, in which only the pressure projection keeps the pressures from oscillating."""
    model = block(law, per_cell=3)
    model.add_water(porosity=0.4, conductivity=1e-9, modulus=np.inf)
    model.roller(1, (1, 0))
    model.roller(2, (1, 0))
    model.fix(3)
    model.hold_pore_pressure(4, 0.0)
    model.press_surface(4, 10.0)
    model.implicit(1.0, dt=1.0, quasi_static=True, small_displacements=True).last()
    return model


def damped_implicit_steps(law):
    """Implicit steps whose local damping goes by the frequencies of the mesh."""
    model = block(law)
    model.fix(3)
    model.set_gravity((0.0, -9.81))
    model.implicit(0.2, dt=0.05, damping=0.75, energy_limit=None).last()
    return model


def implicit_contact(law):
    """A block on a rigid plane, against which it has springs in proportion to its modulus."""
    model = block(law)
    x, y = model.particles.position.T
    model.remove((np.abs(x - 0.5) > 0.3) | (y < 0.3))
    model.add_contact(mpm.Plane(point=(0.0, 0.27), normal=(0.0, 1.0)), friction=0.3)
    model.set_gravity((2.0, -9.81))
    model.implicit(0.2, dt=0.05, energy_limit=None).last()
    return model


@pytest.mark.parametrize("problem", [waves, short_consolidation, damped_implicit_steps, implicit_contact])
def test_points_of_a_stiffer_law_are_as_soil_of_their_own_stiffness(problem):
    models = problem(PLAIN), problem(OF_POINTS)
    for name in ("stress", "pore_pressure" if problem is short_consolidation else "velocity"):
        one, other = (by_id(model, name) for model in models)
        assert np.abs(one).max() > 0
        np.testing.assert_allclose(other, one, rtol=0, atol=1e-9 * np.abs(one).max())


def test_the_ground_beside_has_the_stiffness_of_the_points():
    plain, of_points = (
        GroundColumn(layers_at(model, 1), model.laws, None, mpm.Rayleigh())
        for model in (block(PLAIN), block(OF_POINTS))
    )
    np.testing.assert_allclose(of_points._moduli, plain._moduli, rtol=1e-12)


def test_the_time_step_of_clay_follows_its_preconsolidation():
    # M = 3 K (1 - nu) / (1 + nu) with K = v 2 p_c / kappa, at twice the preconsolidation pressure of now
    model = mpm.Model(box((4, 4), (1.0, 1.0)), CLAY)
    model.seed(density=2000.0, per_cell=3)
    at_law = model.critical_time_step()
    model.set_state("log_preconsolidation", np.full(len(model.particles), np.log(9.0)))
    assert model.critical_time_step() == pytest.approx(at_law / 3)
    h = 0.25 / np.sqrt(2)
    modulus = 3 * 2.0 * (2 * 9 * 60e3) / 0.04 * 0.75 / 1.25
    assert model.critical_time_step() == pytest.approx(h / np.sqrt(modulus / 2000.0))


@pytest.mark.parametrize("ratio", [1.0, 16.0])
def test_clay_absorbs_waves_by_its_stiffness_at_its_pressure(ratio):
    # A pulse leaves a bar; springs that the law's numbers gave would send half of it back where p_c / p = 16.
    pressure = 50e3
    clay = mpm.CamClay(
        compression=0.2,
        swelling=0.04,
        critical_slope=1.0,
        poisson=0.25,
        void_ratio=1.0,
        preconsolidation=1.2 * ratio * pressure,
    )
    model = mpm.Model(box((60, 1), (1.0, 1 / 60)), clay)
    model.seed(density=2000.0, per_cell=10)
    x = model.particles.position[:, 0]
    stress = np.zeros((len(x), 4))
    stress[:, :3] = -pressure
    modulus = float(clay.wave_moduli(stress[:1], np.zeros((1, 3)))[0, 0])
    speed, peak = np.sqrt(modulus / 2000.0), 1e-6
    velocity = np.where(np.abs(x - 0.5) < 0.25, peak * np.cos(2 * np.pi * (x - 0.5)) ** 2, 0.0)
    for tag in range(1, 5):
        model.roller(tag, np.eye(2)[(tag - 1) // 2])
    model.particles.set("stress", stress)
    model.release(2)
    model.absorb(2)
    change = -2000.0 * speed * velocity
    stress += change[:, None] * np.array([1.0, 1 / 3, 1 / 3, 0.0])
    model.particles.set("stress", stress)
    model.particles.set("velocity", np.column_stack([velocity, 0 * velocity]))
    model.explicit(0.9 / speed, energy_limit=None).last()
    assert np.abs(model.particles.velocity[:, 0]).max() < 0.05 * peak
