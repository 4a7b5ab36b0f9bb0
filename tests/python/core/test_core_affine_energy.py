"""Energy with affine transfer: of particles that carry gradients, in short waves, and what the transfer takes out."""

import numpy as np
import pytest
from core_cases import box, run

import mpm_core as mpm

FLIP, AFFINE = mpm.Transfer.FLIP, mpm.Transfer.AFFINE
YOUNG, DENSITY = 200e3, 2000.0
SPEED = np.sqrt(YOUNG / DENSITY)  # of waves
WAVES = 4  # in the length of the bar, 1 m
LEFT_OUT = 0.75**16
"""Most of the energy of any wave that 16 terms of the inverse mass matrix leave out in triangles, (1 - 1 / (D + 2))^16"""


def bar(cells, shape, high=2):
    """A bar of so many cells to a wave length between rollers, whose particles have the velocities that nodes give them."""
    n = WAVES * cells
    model = mpm.Model(box([n, high], [1.0, high / n]), mpm.LinearElastic(young=YOUNG, poisson=0.0))
    model.seed(density=DENSITY, per_cell=3)  # Gauss points, of which the mass matrix is exact
    for tag, normal in ((1, (1, 0)), (2, (1, 0)), (3, (0, 1)), (4, (0, 1))):
        model.roller(tag, normal=normal)
    corners = model.mesh.points[model.mesh.cells[model.particles.cell]]
    nodal = 1e-3 * shape(corners[:, :, 0])
    edges = np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2)
    of_others = np.linalg.solve(edges, (model.particles.position - corners[:, 0])[:, :, None])[..., 0]
    weights = np.column_stack([1 - of_others.sum(axis=1), of_others])
    velocity = np.zeros((len(nodal), 2))
    velocity[:, 0] = np.einsum("pk,pk->p", weights, nodal)
    model.particles.set("velocity", velocity)
    return model, nodal.mean(axis=1)


def standing(x):
    return np.sin(2 * np.pi * WAVES * x)


def packet(x):
    return np.exp(-(((x - 0.5) / 0.12) ** 2)) * standing(x)


def reports(model, periods, **options):
    """Reports of some periods, the first before there is any motion."""
    period = 1 / WAVES / SPEED
    options = {"courant": 0.1, "transfer": AFFINE, "energy_limit": None, **options}
    first = run(model, 1e-9, dt=1e-9, transfer=AFFINE)
    return [first, *model.explicit(periods * period, every=period / 40, **options)]


@pytest.mark.parametrize("cells", [3, 4, 8, 16])
@pytest.mark.parametrize("travels", [False, True])
def test_the_energy_of_short_waves_goes_back_and_forth(cells, travels, recwarn):
    # A standing wave, and one that travels with the stress -rho c v and comes back from the end of the bar. No particle crosses
    # a cell, so that the transfer takes nothing out. Without the energy of the gradients three and four cells had a gap of 65
    # and 50 % in their balance, 16 one of 5 %.
    model, velocity = bar(cells, packet if travels else standing)
    if travels:
        stress = np.zeros_like(model.particles.stress)
        stress[:, 0] = -DENSITY * SPEED * velocity
        model.particles.set("stress", stress)
    course = reports(model, periods=3)
    start = course[0].kinetic_energy + course[0].stored_energy
    staggered = (
        np.pi * WAVES * SPEED * course[1].dt
    )  # velocities are half a step behind stresses: omega dt / 2 of the energy
    for report in course:
        assert report.kinetic_energy + report.stored_energy == pytest.approx(start, rel=staggered + LEFT_OUT)
        assert abs(report.pic_loss) < LEFT_OUT * start
        assert abs(report.unexplained_energy) < LEFT_OUT * start
    stored = max(report.stored_energy for report in course)
    assert stored > (0.5 if travels else 0.95) * start
    assert not [one for one in recwarn if issubclass(one.category, mpm.EnergyWarning)]


@pytest.mark.parametrize("cells", [4, 8])
def test_what_pic_takes_out_of_a_wave_is_the_loss_of_the_transfer(cells):
    # Of the momenta M_l v of the nodes, M v is that of the particles' own velocities, c = (2 + cos k h) / 3 of it in this wave.
    # PIC takes the fraction s of the rest in each step: the energy, half of which is kinetic on average, falls by exp(-(1-c) s).
    # In the two rows of nodes at the sides of the bar, of 17, c is another one.
    model, _ = bar(cells, standing, high=16)
    beta, courant, periods = 0.05, 0.1, 4
    course = reports(model, periods, pic=beta, courant=courant)
    start, end = (report.kinetic_energy + report.stored_energy for report in (course[0], course[-1]))
    c = (2 + np.cos(2 * np.pi / cells)) / 3
    critical = model.critical_time_step()
    left = (1 - beta) ** ((1 - c) * course[-1].time / critical)
    assert left < 0.8
    assert end / start == pytest.approx(left, abs=2 / 17 * (1 - left))
    assert course[-1].pic_loss / start == pytest.approx(1 - left, abs=2 / 17 * (1 - left))
    assert abs(course[-1].unexplained_fraction) < LEFT_OUT


def test_the_gradients_that_flip_takes_away_are_a_loss_of_the_transfer():
    model, _ = bar(4, standing)
    reports(model, periods=1.1)
    before = run(model, model.time + 1e-9, dt=1e-9, transfer=AFFINE)
    own = 0.5 * model.particles.mass @ np.sum(model.particles.velocity**2, axis=1)
    assert own < 0.6 * before.kinetic_energy
    after = run(model, model.time + 1e-9, dt=1e-9, transfer=FLIP)
    assert after.kinetic_energy == pytest.approx(own, rel=1e-6)
    assert after.pic_loss - before.pic_loss == pytest.approx(before.kinetic_energy - own, rel=1e-6)
    assert after.unexplained_energy == pytest.approx(before.unexplained_energy, abs=1e-6 * before.kinetic_energy)


def test_a_collapsing_heap_gets_little_energy_from_the_transfer():
    # A steep heap that falls apart has single particles at its surface, whose gradients once gave the nodes more than they had
    # taken, 4 % of the energy; it is 1 to 2.2 % now, by the mesh, since particles crowd. What the books say of it while the heap
    # slides they still say where it has come to rest, where it does not matter what counts as kinetic energy.
    soil = mpm.MohrCoulomb(young=200e3, poisson=0.3, cohesion=500.0, friction_angle=25.0)
    model = mpm.Model(box([48, 16], [3.0, 1.0], body=([0.0, 0.0], [0.6, 0.8]), shake=0.1), soil)
    model.seed(density=2000.0, per_cell=6, cell_tag=1)
    model.roller(1, normal=(1, 0))
    model.fix(3)
    model.set_gravity((0, -30.0))
    sliding, resting = (run(model, until, transfer=AFFINE, energy_limit=None) for until in (0.5, 1.5))
    own = 0.5 * model.particles.mass @ np.sum(model.particles.velocity**2, axis=1)
    assert (
        sliding.kinetic_energy > 0.05 * sliding.energy_scale and resting.kinetic_energy < 0.002 * resting.energy_scale
    )
    assert own < resting.kinetic_energy
    assert abs(resting.pic_loss) < 0.025 * resting.energy_scale
    assert sliding.pic_loss == pytest.approx(resting.pic_loss, abs=0.004 * resting.energy_scale)
    # What is missing in the balance is unexplained, but for half a step of works
    missing = sliding.external_work - sliding.kinetic_energy - sliding.stress_work
    generated = min(0.0, sliding.pic_loss)
    assert sliding.unexplained_energy == pytest.approx(
        missing - sliding.pic_loss + generated, abs=0.005 * sliding.energy_scale
    )
