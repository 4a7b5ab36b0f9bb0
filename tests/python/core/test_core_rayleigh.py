"""Rayleigh damping in the explicit scheme, against the decay of one degree of freedom in closed form."""

import numpy as np
import pytest
from core_cases import box, moduli, run

import mpm_core as mpm

YOUNG, POISSON, DENSITY = 1e6, 0.3, 1000.0
_, SHEAR, MODULUS = moduli(YOUNG, POISSON)
SPEED = np.sqrt(SHEAR / DENSITY)
RATIO = 0.02
RAYLEIGH = mpm.Rayleigh.of_ratio(RATIO, frequencies=(0.5 * SPEED, 1.5 * SPEED))  # the modes 1 and 3 of a bar of 1 m


def shear_bar(count=60):
    """A bar of one cell's width that moves across only, with both ends fixed."""
    model = mpm.Model(box((count, 1), (1.0, 1.0 / count)), mpm.LinearElastic(young=YOUNG, poisson=POISSON))
    model.seed(density=DENSITY, per_cell=10)
    model.fix((1, 2))
    for tag in (3, 4):
        model.roller(tag, (1, 0))
    return model


def with_mode(model, mode, resting, amplitude=1e-6):
    x = model.particles.position
    model.particles.set("velocity", np.column_stack([0 * x[:, 0], amplitude * np.sin(mode * np.pi * x[:, 0])]))
    if resting:
        model.rest()
    return model


@pytest.mark.parametrize("resting", [False, True])
@pytest.mark.parametrize("mode", [1, 2, 3])
def test_a_mode_decays_by_its_damping_ratio(mode, resting):
    # The mesh lowers the square of mode 3's frequency, and its damping, by (kh)^2 / 4 = 0.6 %.
    # Energy after n periods: exp(-4 pi n xi); xi is 2 % for modes 1 and 3, and 7/8 of it for mode 2.
    model = with_mode(shear_bar(), mode, resting)
    frequency, periods = 0.5 * mode * SPEED, 4
    expected = {1: RATIO, 2: RATIO * (0.75 / 2 + 0.25 * 2), 3: RATIO}[mode]  # alpha/(2 w) + beta w/2 at w1, 2 w1, 3 w1
    assert RAYLEIGH.ratio(frequency) == pytest.approx(expected, rel=1e-12)
    start = model.report().kinetic_energy
    report = run(model, periods / frequency, rayleigh=RAYLEIGH, conversion=None)
    decay = -np.log((report.kinetic_energy + report.stored_energy) / start)
    assert decay == pytest.approx(4 * np.pi * periods * expected, rel=0.01)
    # what is lost is the work of damping, and nothing else
    lost = start - report.kinetic_energy - report.stored_energy
    assert report.damping_work == pytest.approx(lost, rel=0.01)
    assert abs(report.unexplained_energy) < 0.01 * start


@pytest.mark.parametrize("resting", [False, True])
def test_undrained_soil_is_damped_as_its_shear_modulus_says_where_cells_do_not_lock(resting):
    # In a box with smooth walls u = (sin pi x cos pi y, -cos pi x sin pi y) is a mode without change of volume, so that water
    # takes no part in it: w^2 = 2 pi^2 G / rho, and xi = beta w / 2. The energy after 2 periods is exp(-8 pi xi) of that before.
    # An irregular mesh, since cells of a regular one have next to no divergence of their own.
    skeleton = mpm.LinearElastic(young=YOUNG, poisson=POISSON)
    model = mpm.Model(box((14, 14), shake=0.2), mpm.Undrained(skeleton, water_modulus=2e7, porosity=0.4))
    model.seed(density=DENSITY, per_cell=3)
    for tag, axis in ((1, 0), (2, 0), (3, 1), (4, 1)):
        model.roller(tag, np.eye(2)[axis])
    x, y = np.pi * model.particles.position.T
    model.particles.set("velocity", 1e-6 * np.column_stack([np.sin(x) * np.cos(y), -np.cos(x) * np.sin(y)]))
    if resting:
        model.rest()
    omega = np.pi * np.sqrt(2 * SHEAR / DENSITY)
    start = model.report().kinetic_energy
    damping = mpm.Rayleigh(stiffness=2 * RATIO / omega)
    report = run(model, 4 * np.pi / omega, nmd=True, rayleigh=damping, conversion=None)
    left = report.kinetic_energy + report.stored_energy
    assert -np.log(left / start) == pytest.approx(8 * np.pi * RATIO, rel=0.04)
    assert report.damping_work == pytest.approx(start - left, rel=0.01)


@pytest.mark.parametrize("mass", [0.0, 2.0])
def test_a_rigid_motion_is_slowed_down_by_the_mass_term_only(mass):
    model = mpm.Model(box((4, 4)), mpm.LinearElastic(young=YOUNG, poisson=POISSON))
    model.seed(density=DENSITY, per_cell=10)
    model.particles.set("velocity", np.tile([1e-6, 2e-6], (len(model.particles), 1)))
    run(model, 0.5, rayleigh=mpm.Rayleigh(mass=mass, stiffness=1e-3), energy_limit=None)
    slowed = np.exp(-mass * 0.5)
    np.testing.assert_allclose(
        model.particles.velocity, np.tile([1e-6 * slowed, 2e-6 * slowed], (len(model.particles), 1)), rtol=2e-3
    )


@pytest.mark.parametrize("resting", [False, True])
def test_the_shortened_time_step_is_stable_and_the_one_without_damping_is_not(resting):
    def growth_of(options):
        model = shear_bar()
        noise = 1e-6 * np.random.default_rng(3).standard_normal((len(model.particles), 2))
        model.particles.set("velocity", noise)
        if resting:
            model.rest()
        critical = model.critical_time_step()
        damping = mpm.Rayleigh(stiffness=2.5 * critical)
        step = damping.time_step(critical)
        assert step == pytest.approx(critical * (np.sqrt(1 + 2.5**2) - 2.5), rel=1e-12)
        start = model.report().kinetic_energy
        model.explicit(400 * step, rayleigh=damping, conversion=None, energy_limit=None, **options(critical)).last()
        return model.report().kinetic_energy / start

    assert growth_of(lambda critical: {"courant": 1.0}) < 1.0
    with pytest.raises(mpm.InputError, match="above the critical time step"):
        growth_of(lambda critical: {"dt": 0.5 * critical})
    try:
        growth = growth_of(lambda critical: {"dt": critical, "allow_unstable": True})
    except mpm.RunError:
        growth = np.inf
    assert not growth < 1.0


def test_soil_that_has_yielded_is_not_damped():
    soil = mpm.MohrCoulomb(young=YOUNG, poisson=POISSON, cohesion=1e6, friction_angle=0.0)
    momenta = []
    for strain in (0.0, 0.01):
        model = mpm.Model(box((4, 4)), soil)
        model.seed(density=DENSITY, per_cell=10)
        state = model.particles.state.copy()
        state[:, 0] = strain
        model.particles.set("state", state)
        model.particles.set("velocity", np.tile([1e-6, 0.0], (len(model.particles), 1)))
        run(model, 0.1, rayleigh=mpm.Rayleigh(mass=5.0, stiffness=1e-3), energy_limit=None)
        momenta.append(model.report().momentum[0])
    assert momenta[1] == pytest.approx(DENSITY * 1e-6, rel=1e-9)
    assert momenta[0] == pytest.approx(DENSITY * 1e-6 * np.exp(-0.5), rel=5e-3)


@pytest.mark.parametrize(
    "make, message",
    [
        (lambda: mpm.Rayleigh(mass=-1.0), "mass is -1.0 1/s, expected a number not below zero"),
        (lambda: mpm.Rayleigh(stiffness=np.nan), "stiffness is nan s"),
        (lambda: mpm.Rayleigh.of_ratio(1.5, (1.0, 2.0)), "ratio is 1.5, expected 0 <= ratio < 1"),
        (lambda: mpm.Rayleigh.of_ratio("2 %", (1.0, 2.0)), "ratio is '2 %', expected a number"),
        (lambda: mpm.Rayleigh.of_ratio(0.1, (0.0, 2.0)), "frequencies is 0.0 Hz, expected a positive number"),
        (lambda: shear_bar().explicit(1.0, rayleigh=0.05), "rayleigh is 0.05, expected a Rayleigh or None"),
    ],
)
def test_bad_input_is_refused(make, message):
    with pytest.raises(mpm.InputError, match=message):
        make()


def test_damping_of_zero_is_none():
    def steps(rayleigh):
        model = with_mode(shear_bar(), 1, resting=False)
        report = run(model, 0.1, rayleigh=rayleigh)
        return report.steps, report.damping_work, model.particles.velocity

    undamped = steps(None)
    for rayleigh in (mpm.Rayleigh.of_ratio(0.0, (1.0, 5.0)), mpm.Rayleigh(plastic_strain=np.inf)):
        assert (rayleigh.ratio(1.0), rayleigh.time_step(1e-3)) == (0.0, 1e-3)
        count, work, velocity = steps(rayleigh)
        assert (count, work) == (undamped[0], 0.0)
        np.testing.assert_array_equal(velocity, undamped[2])
    for wrong in (0.0, [1.0, -1.0], "1"):
        with pytest.raises(mpm.InputError, match="frequency"):
            RAYLEIGH.ratio(wrong)
