"""Energy of contact between velocity fields: none is generated, and what impacts and friction take is friction_work."""

import numpy as np
import pytest
from core_cases import box
from field_contact_cases import block_on_layer, fill

import mpm_core as mpm

FIRST, MODIFIED_LAST = mpm.StressUpdate.FIRST, mpm.StressUpdate.MODIFIED_LAST


@pytest.mark.parametrize("update", [MODIFIED_LAST, FIRST])
@pytest.mark.parametrize("cells", [20, 40])
def test_equal_bars_exchange_their_velocities(cells, update):
    """Two bars of length L that meet at the speed v: the stress is rho c v / 2 until 2 L / c, when they part again."""
    side, density, modulus, speed = 1.0 / cells, 1000.0, 1e6, 0.1
    wave = np.sqrt(modulus / density)
    mesh = box((round(2.5 * cells), 4), (2.5, 4 * side), diagonals="alternating")
    law = mpm.LinearElastic(young=modulus, poisson=0.0)
    model = mpm.Model(mesh, [law, law], velocity_fields=[0, 1])
    fill(model, (0.25, 0.0), (1.25, 4 * side), density=density, material=0, spacing=0.25 * side)
    fill(model, (1.25, 0.0), (2.25, 4 * side), density=density, material=1, spacing=0.25 * side)
    for tag in (3, 4):
        model.roller(tag, (0, 1))
    contact = model.add_field_contact((1.0, 0.0))
    second = model.particles.material == 1
    model.particles.set("velocity", np.where(second[:, None], -0.5, 0.5) * np.array([speed, 0.0]))
    start, until = model.report().kinetic_energy, 2.0 / wave
    times, stresses, taken = [], [], []
    for report in model.explicit(1.3 * until, every=0.01 * until, stress_update=update):
        times.append(report.time / until)
        stresses.append(contact.force[0] / (0.5 * density * wave * speed * 4 * side))
        taken.append(report.friction_work / start)
        np.testing.assert_allclose(report.momentum, 0.0, atol=1e-10 * report.mass * speed)
    times, stresses = np.array(times), np.array(stresses)
    assert times[stresses > 0.5].max() == pytest.approx(1.0, abs=0.03)
    assert stresses[(times > 0.2) & (times < 0.8)].mean() == pytest.approx(1.0, abs=0.03)
    assert (stresses[times > 1.15] == 0.0).all()
    # no more than the cells at the impact have, h / L of the energy, is dissipated
    assert np.diff(taken).min() > -1e-6 and 0 < taken[-1] < side
    for material, sign in ((0, -1), (1, 1)):
        mean = model.particles.velocity[model.particles.material == material, 0].mean()
        assert sign * mean / (0.5 * speed) == pytest.approx(1.0, abs=2 * side)
    assert abs(report.unexplained_fraction) < 1e-3


def stack(fields, friction, shake):
    """A stiff block on a soft one, which begins to vibrate under its weight, in two velocity fields or in one."""
    side = 0.1
    mesh = box((20, 20), (2.0, 2.0), diagonals="alternating", shake=shake)
    laws = [mpm.LinearElastic(young=young, poisson=0.3) for young in (1e6, 1e7)]
    model = mpm.Model(mesh, laws, velocity_fields=[0, 1] if fields else [0, 0])
    fill(model, (0.2, 0.0), (1.8, 0.8), density=2000.0, material=0, spacing=0.5 * side)
    fill(model, (0.6, 0.8), (1.4, 1.6), density=2000.0, material=1, spacing=0.5 * side)
    model.fix(3)
    model.set_gravity((0.0, -10.0))
    if fields:
        model.add_field_contact((0.0, 1.0), friction=friction)
    return model


def energies(model, **options):
    """Over time: energy that has come into being, what contact has taken, unexplained energy, work of gravity [J]."""
    rows = []
    for report in model.explicit(1.5, every=0.025, integration=mpm.Integration.PARTICLES, energy_limit=None, **options):
        energy = report.kinetic_energy + report.stored_energy - report.external_work
        rows.append((energy, report.friction_work, report.unexplained_energy, report.external_work))
    return np.array(rows).T


@pytest.mark.parametrize("update", [MODIFIED_LAST, FIRST])
@pytest.mark.parametrize("shake", [0.0, 0.2])
def test_a_block_that_vibrates_on_another_gains_no_energy(shake, update):
    """Undamped, it generates no more energy than the same particles in one field, by a hundredth of the works."""
    alone, _, missing, _ = energies(stack(False, 0.0, shake), stress_update=update)
    for friction in (0.0, 0.5):
        energy, taken, unexplained, work = energies(stack(True, friction, shake), stress_update=update)
        largest = np.abs(work).max()
        assert energy.max() < max(alone.max(), 0.0) + 1e-3 * largest
        assert np.diff(taken).min() > -2e-3 * largest and 0 < taken[-1] < 0.1 * largest
        # at the end: where stresses are updated first, the next step still adds to what contact takes in this one
        assert abs(unexplained[-1]) < np.abs(missing).max() + 2e-3 * largest


@pytest.mark.parametrize("shift", [0.0, 0.017])
def test_an_undamped_block_that_sticks_stays_where_it_is(shift):
    """The waves of its start do not make it creep."""
    model, _ = block_on_layer(20.0, 0.5, shift=shift)

    def slip(until):
        list(model.explicit(until))
        block, x = model.particles.material == 1, model.particles
        beneath = ~block & (x.position[:, 1] > 0.25) & (x.position[:, 0] > 0.3) & (x.position[:, 0] < 0.8)
        return x.displacement[block, 0].mean() - x.displacement[beneath, 0].mean()

    first, second = slip(0.5), slip(1.0)
    assert abs(second - first) < 0.2 * first
