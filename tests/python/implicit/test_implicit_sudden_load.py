"""Why damped explicit and implicit runs end apart after a sudden load: the overshoot that long steps do not resolve."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from core_cases import box
from mpm_core.energy import EnergyWatch

import mpm_core as mpm
from mpm_core.implicit import energy_advice, implicit_options

YOUNG, STRENGTH, DENSITY, HEIGHT, DAMPING = 1e6, 1e3, 2000.0, 0.1, 0.75
YIELD = 2 * STRENGTH  # axial stress at which soil without Poisson's ratio yields under uniaxial strain [Pa]
LOAD = 0.9  # static axial stress over that
PERIOD = 2 * np.pi * HEIGHT * np.sqrt(DENSITY / 2 / YOUNG)  # half of the mass on a spring of the modulus E [s]


def strain_at_rest(scheme, ramp):
    """Axial strain in the middle of a wide layer, one cell high, over the strain at which it yields, when it is at rest."""
    law = mpm.tresca(young=YOUNG, poisson=0.0, shear_strength=STRENGTH)
    model = mpm.Model(box((21, 2), (2.1, 2 * HEIGHT), body=([0, 0], [2.1, HEIGHT])), law)
    model.seed(density=DENSITY, per_cell=3, cell_tag=1)
    for side in (1, 2):
        model.roller(side, normal=(1, 0))
    model.fix(3)
    model.set_gravity((0.0, -LOAD * YIELD / (DENSITY * HEIGHT / 2)), ramp=ramp)
    if scheme == "explicit":
        report = model.explicit(60 * PERIOD, damping=DAMPING, courant=0.2).last()
    else:
        report = model.implicit(60 * PERIOD, dt=20 * model.critical_time_step(), damping=DAMPING).last()
    assert report.kinetic_energy < 1e-6 * report.external_work
    p = model.particles
    start = p.initial_position
    middle = abs(start[:, 0] - 1.05) < 0.3
    return -np.mean(p.displacement[middle, 1] / start[middle, 1]) * YOUNG / YIELD


def strain_after_overshoot():
    """The same of a spring that yields, after a sudden load with local damping.

    Stresses and strains are over those at which it yields; beyond, its modulus falls from 1 to K/E = 1/3. Up to the static load the
    mass gains (1 - alpha) of the work of R, beyond it loses (1 + alpha) of it, and comes to a stop at the plastic strain x:
    (1 + alpha) ((1 - F)^2 / 2 + (1 - F) x + x^2 / 6) = (1 - alpha) F^2 / 2. Then it swings elastically.
    """
    energy = (1 - DAMPING) / (1 + DAMPING) * LOAD**2 / 2 - (1 - LOAD) ** 2 / 2
    beyond = 3 * (np.sqrt((1 - LOAD) ** 2 + 2 / 3 * energy) - (1 - LOAD))
    return LOAD + beyond * (1 - 1 / 3)


def test_explicit_steps_overshoot_a_sudden_load_as_in_closed_form_and_long_implicit_steps_do_not():
    assert strain_after_overshoot() > 1.2 * LOAD
    assert strain_at_rest("explicit", 0.0) == pytest.approx(strain_after_overshoot(), rel=0.01)
    assert strain_at_rest("implicit", 0.0) == pytest.approx(LOAD, rel=0.01)


def test_both_end_in_the_same_place_when_the_load_rises_slowly():
    ends = [strain_at_rest(scheme, 20 * PERIOD) for scheme in ("explicit", "implicit")]
    assert ends == pytest.approx([LOAD, LOAD], rel=0.01)


@pytest.mark.parametrize("dilation_angle, nmd, advice", [(10.0, True, True), (0.0, True, False), (10.0, False, False)])
def test_advice_on_energy_names_averaged_strains_where_soil_dilates(dilation_angle, nmd, advice):
    # Backward Euler dissipates the waves of a sudden load, so that any of these runs passes the limit of 2 %.
    soil = mpm.MohrCoulomb(young=1e6, poisson=0.3, cohesion=1e3, friction_angle=25.0, dilation_angle=dilation_angle)
    model = mpm.Model(box((4, 4)), soil)
    model.seed(density=2000.0, per_cell=6)
    model.fix(3)
    model.set_gravity((0.0, -9.81))
    with pytest.raises(mpm.RunError, match="above energy_limit, 2 %") as error:
        model.implicit(1.0, dt=0.02, nmd=nmd, energy_limit=0.02).last()
    assert ("nmd=True generate energy where soil dilates" in str(error.value)) == advice


@pytest.mark.parametrize(
    "nmd, generated, advice, other",
    [
        (True, True, "initialise nmd=False", "shorter steps"),
        (False, True, "docs/energy.md", "backward Euler"),
        (True, False, "shorter steps, dissipate less", "initialise"),
    ],
)
def test_advice_on_energy_that_was_generated_is_not_that_on_dissipated_energy(nmd, generated, advice, other):
    # Backward Euler dissipates. Energy that is generated comes from averaged strains beside forces that are not averaged.
    model = mpm.Model(box((4, 4)), mpm.MohrCoulomb(young=1e6, poisson=0.3, cohesion=1e3, friction_angle=25.0))
    model.seed(density=2000.0, per_cell=6)
    report = replace(model.report(), steps=100, unexplained_energy=-1.0 if generated else 1.0, energy_scale=10.0)
    options = implicit_options(0.0, 0.0, nmd, mpm.Integration.MIXED, quasi_static=False, ghost=None)
    watch = EnergyWatch(None, True, partial(energy_advice, model, options))
    with pytest.warns(mpm.EnergyWarning) as caught:
        watch.look(report)
    text = str(caught[0].message)
    assert ("was generated" in text) == generated and advice in text and other not in text
