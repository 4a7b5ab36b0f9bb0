"""Soil that has been pulled apart closes again before it carries pressure, and gains no volume in a cycle of both.

The elastic strain is stress over modulus, so that all numbers follow from what is opened and closed, by hand.
"""

import numpy as np
import pytest
from core_cases import box
from law_cases import Batch, components

import mpm_core as mpm

YOUNG, POISSON, FRICTION = 1e6, 0.25, 30.0
BULK = YOUNG / (3 * (1 - 2 * POISSON))


def laws(cohesion):
    soil = dict(young=YOUNG, poisson=POISSON, cohesion=cohesion, friction_angle=FRICTION)

    peak = mpm.MohrCoulomb(**soil)
    softening = mpm.SofteningMohrCoulomb(
        peak=peak,
        residual_cohesion=0.5 * cohesion,
        residual_friction_angle=20.0,
        residual_dilation_angle=0.0,
        softening_strain=0.1,
        reference_length=0.1,
    )
    return [
        peak,
        softening,
        mpm.ViscoplasticMohrCoulomb(**soil, viscosity=1e3),
        mpm.matched_drucker_prager(**soil),
    ]


def strained(law, volumes, dim=2, shear=0.0):
    """Mean stresses [Pa] and separations after each of some volumetric strains, in small steps, and the work [J/m3]."""
    stress, state = np.zeros((1, components(dim))), np.zeros((1, law.n_state))
    column, found, work = law.state_names.index("separation"), [], 0.0
    for volume in volumes:
        for _ in range(100):
            strain = np.zeros((1, components(dim)))
            strain[0, : (2 if dim == 2 else 3)] = volume / 100 / (2 if dim == 2 else 3)
            strain[0, 3] = shear
            before = stress.copy()
            law.update(strain, stress, state)
            work += float(np.sum(0.5 * (before + stress) * strain))
        found.append((stress[0, :3].mean(), state[0, column]))
    return *np.array(found).T, work


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("kind", range(4))
def test_grains_carry_pressure_again_when_they_are_as_dense_as_before(kind, dim):
    """Without cohesion: apart by 1 %, closed by 0.6 %, then by 0.7 %, of which 0.3 % are compression."""
    law = laws(0.0)[kind]
    pressure, separation, _ = strained(law, [0.01, -0.006, -0.007], dim)
    assert np.allclose(separation, [0.01, 0.004, 0.0], atol=1e-12)
    assert np.allclose(pressure, [0.0, 0.0, -BULK * 0.003], rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("kind", range(4))
def test_cycles_of_shear_and_volume_leave_no_volume(kind):
    """Twenty cycles without pressure, sheared on the way, that end at the initial volume: no stress, no separation."""
    law = laws(0.0)[kind]
    pressure, separation, _ = strained(law, [0.01, -0.01] * 20, shear=1e-4)
    assert np.abs(pressure).max() < 1e-9 * YOUNG
    assert np.allclose(separation[1::2], 0.0, atol=1e-15)


@pytest.mark.parametrize("kind", [0, 1, 3])
def test_what_opens_dissipates_and_what_closes_gives_nothing_back(kind):
    """With cohesion the soil opens at the apex, and closes without stress: a cycle takes c cot(phi) times the opening."""
    law = laws(2e3)[kind]
    apex = 2e3 / np.tan(np.radians(FRICTION))
    opening = 0.01
    pressure, separation, work = strained(law, [opening + apex / BULK, -opening - apex / BULK], dim=3)
    assert np.allclose(pressure, [apex, 0.0], rtol=1e-6, atol=1e-6)
    assert np.allclose(separation, [opening, 0.0], atol=1e-9)
    assert work == pytest.approx(apex * opening, rel=0.01)  # the elastic part is given back; steps of 1 %


def test_viscosity_delays_the_opening_as_it_does_flow():
    """Backward Euler on a plane without dilation: of the stress beyond the apex 1 / (1 + dt G / eta) is left."""
    law = laws(0.0)[2]
    dt, shear = 0.01, YOUNG / (2 * (1 + POISSON))
    left = 1 / (1 + dt * shear / 1e3)
    stress, state, strain = np.zeros((1, 6)), np.zeros((1, law.n_state)), np.zeros((1, 6))
    strain[0, :3] = 0.001 / 3
    law.update(strain, stress, state, dt=dt)
    assert np.allclose(stress[0, :3], left * BULK * 0.001)
    assert state[0, 1] == pytest.approx((1 - left) * 0.001)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("cohesion", [0.0, 2e3])
@pytest.mark.parametrize("kind", range(4))
def test_tangents_while_it_opens_and_closes(kind, cohesion, dim):
    """The tangent is the derivative of the stress for random increments of soil that is apart by 0.1 %."""
    law = laws(cohesion)[kind]
    rng = np.random.default_rng(3)
    strain = rng.normal(0.0, 1e-3, (300, components(dim)))
    if dim == 2:
        strain[:, 2] = 0.0
    state = np.zeros((300, law.n_state))
    state[:, law.state_names.index("separation")] = 1e-3
    stress = np.zeros((300, components(dim)))
    stress[:, :3] = rng.uniform(0.0, 0.5 * cohesion, (300, 1))
    batch = Batch(law, stress, strain, state)
    closing = batch.state[:, law.state_names.index("separation")]
    assert ((closing > 0) & (closing < 1e-3)).sum() > 30 and (closing == 0).sum() > 10  # in part, and wholly
    rough, fine = batch.differences(1e-9), batch.differences(2.5e-10)
    smooth = np.abs(rough - fine).max(axis=(1, 2)) < 1e-6 * law.p_wave_modulus
    assert smooth.mean() > 0.7
    assert np.abs(batch.tangent - fine)[smooth].max() < 3e-6 * law.p_wave_modulus


def test_grains_that_fall_and_settle_keep_their_volume():
    """A column of dry grains collapses. At rest the volume less the separation is the initial one, compressed by 0.3 % at most,
    rho g h / E, and only loose grains on the surface are still apart. Without a memory of the separation the volume grows by
    8 %."""
    cell, height, length = 0.02, 0.1, 0.2
    grains = mpm.MohrCoulomb(young=0.84e6, poisson=0.3, cohesion=0.0, friction_angle=19.8)
    mesh = box([35, 6], lengths=[35 * cell, 6 * cell], diagonals="alternating", body=([0.0, 0.0], [length, height]))
    model = mpm.Model(mesh, grains)
    model.seed(density=2650.0, per_cell=6, cell_tag=1)
    model.roller(1, (1, 0))
    model.fix(3)
    model.set_gravity((0.0, -9.81))
    report = model.explicit(1.0, pic=0.006).last()
    assert report.kinetic_energy < 1e-3 * report.external_work and model.particles.position[:, 0].max() > 0.3
    volume, separation = model.particles.volume, model.state("separation")
    assert 0.997 < (volume * np.exp(-separation)).sum() / (length * height) < 1.0
    assert volume.sum() == pytest.approx(length * height, rel=0.02)
