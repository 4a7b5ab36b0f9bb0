"""The implicit scheme against the explicit one: order in time, the slope with and without damping, and steps that fail."""

import numpy as np
import pytest
from core_cases import box
from implicit_cases import crest_displacement, slope

import mpm_core as mpm
from mpm_core import RunError

H, WAVE_SPEED = 1.0, np.sqrt(1e6 / 1000.0)
PARTICLES = {"integration": mpm.Integration.PARTICLES}


def vibrating_column():
    """An elastic column in its lowest mode, with the period 4 H / c; particles do not leave their cells."""
    model = mpm.Model(box([1, 10], [0.1, H]), mpm.LinearElastic(young=1e6, poisson=0.0))
    model.seed(density=1000.0, per_cell=6)
    for tag in (1, 2):
        model.roller(tag, (1, 0))
    model.fix(3)
    x = model.particles.position
    model.particles.set("velocity", np.c_[np.zeros(len(x)), 1e-3 * np.sin(0.5 * np.pi * x[:, 1] / H)])
    return model


def test_converges_to_the_explicit_result_at_first_order():
    until = 0.7 * H / WAVE_SPEED
    reference = vibrating_column()
    list(reference.explicit(until, courant=0.01))
    expected = reference.particles.displacement
    errors = []
    for steps in (40, 80, 160):
        model = vibrating_column()
        list(model.implicit(until, dt=until / steps))
        errors.append(np.abs(model.particles.displacement - expected).max())
    order = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (order > 0.85).all() and (order < 1.15).all(), errors


def test_nodes_that_the_soil_leaves_keep_the_velocity_of_the_step():
    model = mpm.Model(
        box([12, 3], [1.2, 0.3], body=((0.1, 0.1), (0.3, 0.2))), mpm.LinearElastic(young=1e6, poisson=0.2)
    )
    model.seed(density=1000.0, per_cell=6, cell_tag=1)
    body = np.unique(model.mesh.cells[np.unique(model.particles.cell)])
    model.particles.set("velocity", np.tile([1.0, 0.0], (len(model.particles), 1)))
    list(model.implicit(0.5, dt=0.5))  # it flies five cells on without strain
    assert (model.nodal("mass")[body] == 0).all()
    np.testing.assert_allclose(model.nodal("velocity")[body], np.tile([1.0, 0.0], (len(body), 1)), atol=1e-9)


def test_damping_is_that_of_the_explicit_scheme_where_steps_are_small():
    until = 3.0 * H / WAVE_SPEED
    reference, model = vibrating_column(), vibrating_column()
    dt = 0.05 * reference.critical_time_step()
    list(reference.explicit(until, dt=dt, damping=0.5))
    list(model.implicit(until, dt=dt, damping=0.5))
    amplitude = 1e-3 * 2 * H / (np.pi * WAVE_SPEED)  # without damping
    difference = np.abs(model.particles.displacement - reference.particles.displacement).max()
    assert np.abs(reference.particles.displacement).max() < 0.6 * amplitude
    assert difference < 0.03 * amplitude


def test_undamped_slope_comes_to_the_explicit_place():
    """An independent explicit code gives 0.68 to 0.69 m at the crest after 2 s and 0.65 m implicitly with steps of 0.1 s."""
    model = slope()
    *_, report = model.implicit(2.0, dt=0.1, **PARTICLES)
    assert crest_displacement(model) == pytest.approx(0.65, abs=0.02)
    assert report.kinetic_energy < 0.01 * report.external_work


@pytest.fixture(scope="module")
def slope_at_rest():
    """Displacement of the crest at 10 s and where the explicit slide ends."""
    model = slope()
    crest = {}
    for until in (10.0, 45.0, 50.0):
        *_, report = model.explicit(until, damping=0.75, **PARTICLES)
        crest[until] = crest_displacement(model)
    assert report.kinetic_energy < 1e-3 * report.external_work
    assert crest[50.0] - crest[45.0] < 0.005 * crest[50.0]
    return crest[10.0], crest[50.0]


@pytest.mark.parametrize(
    ("solver", "multiple"),
    [(mpm.Newton(), 25), (mpm.Newton(), 100), (mpm.Relaxation(tolerance=1e-6), 50)],
    ids=["newton 25", "newton 100", "relaxation 50"],
)
def test_damped_slope_comes_to_rest_where_the_explicit_one_does(slope_at_rest, solver, multiple):
    """And creeps as slowly on the way there, at steps of many critical ones, which know nothing of the elastic oscillations
    that hold the explicit slide back: their mean effect is part of the damping."""
    on_the_way, at_rest = slope_at_rest
    model = slope()
    dt = multiple * model.critical_time_step()
    list(model.implicit(10.0, dt=dt, damping=0.75, solver=solver, **PARTICLES))
    assert crest_displacement(model) == pytest.approx(on_the_way, rel=0.1)
    *_, report = model.implicit(50.0, dt=dt, damping=0.75, solver=solver, **PARTICLES)
    assert report.kinetic_energy < 1e-5 * report.external_work
    assert crest_displacement(model) == pytest.approx(at_rest, rel=0.1)


def test_without_shock_and_crossing_noise_both_schemes_come_to_rest_in_the_same_place():
    """Gravity that rises over five seconds makes no elastic waves that load the soil beyond its strength, and mixed integration
    hardly any noise: what then differs is neither scheme's own, but the step's. Single slides to rest scatter by two per cent,
    in no order of the step, so the mean of three counts."""

    def crest_at_rest(scheme, **options):
        model = slope()
        model.set_gravity((0.0, -9.81), ramp=5.0)
        dt = options.pop("multiple", 0.5) * model.critical_time_step()
        run = getattr(model, scheme)
        report = run(50.0, dt=dt, every=50.0, damping=0.75, integration=mpm.Integration.MIXED, **options).last()
        assert report.kinetic_energy < 1e-3 * report.external_work
        return crest_displacement(model)

    explicit = crest_at_rest("explicit")
    implicit = [crest_at_rest("implicit", multiple=multiple) for multiple in (25, 50, 100)]
    assert np.mean(implicit) == pytest.approx(explicit, rel=0.03)


def test_thin_toe_does_not_hinder_the_slide_unless_its_nodes_have_no_ghost_penalty():
    """The toe runs out over cells in which there is hardly any soil."""

    def slide(**options):
        model = slope()
        reports = list(model.implicit(10.0, dt=50 * model.critical_time_step(), damping=0.75, **PARTICLES, **options))
        return model, sum(report.iterations for report in reports), sum(report.cuts for report in reports)

    explicit = slope()
    list(explicit.explicit(10.0, damping=0.75, **PARTICLES))
    model, iterations, cuts = slide()
    assert cuts == 0
    toe = [each.particles.position[:, 0].max() for each in (model, explicit)]
    assert toe[0] > 2.15 and toe[0] == pytest.approx(toe[1], abs=0.02)
    assert np.linalg.norm(model.particles.velocity, axis=1).max() < 0.05
    _, without, cuts = slide(ghost=mpm.GhostPenalty(filled=0.0))
    assert cuts > 0 and without > 1.5 * iterations


def test_a_step_that_fails_is_cut_and_leaves_the_particles_as_they_were():
    """No quasi-static slope carries 3.5 times its collapse load."""
    model = slope(0.2)
    before = {
        name: getattr(model.particles, name) for name in ("id", "position", "velocity", "stress", "volume", "state")
    }
    with pytest.raises(RunError, match="failed with all step lengths from 1 s down to 0.000977 s"):
        list(model.implicit(1.0, dt=1.0, quasi_static=True, solver=mpm.Newton(max_iterations=8)))
    assert model.time == 0
    order = np.argsort(model.particles.id)
    for name, values in before.items():
        np.testing.assert_array_equal(getattr(model.particles, name)[order], values[np.argsort(before["id"])])


def test_a_particle_that_would_leave_is_put_back():
    model = mpm.Model(box([2, 2]), mpm.LinearElastic(young=1e4, poisson=0.2))
    model.seed_points([[0.5, 0.4]], [1e-3], density=1000.0)
    model.particles.set("velocity", [[1.0, 0.0]])
    with pytest.raises(RunError, match="left the background mesh"):
        list(model.implicit(10.0, dt=1.0))
    assert model.particles.position[0, 0] > 0.99
    assert len(model.particles) == 1


def test_equilibrate_balances_loads_without_spending_time():
    model = mpm.Model(box([4, 4]), mpm.LinearElastic(young=1e7, poisson=0.3))
    model.seed(density=1000.0, per_cell=10)
    for tag in (1, 2):
        model.roller(tag, (1, 0))
    model.fix(3)
    model.set_gravity((0, -10.0))
    model.particles.set("velocity", np.full((len(model.particles), 2), 1e-3))
    assert model.out_of_balance() > 0.5
    report = model.equilibrate(tolerance=1e-8)
    assert report.unbalanced_ratio < 1e-8
    assert report.time == 0 and report.kinetic_energy == 0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"dt": 0.0}, "dt is 0.0 s"),
        ({"dt": 0.1, "damping": 1.0}, "damping is 1.0"),
        ({"dt": 0.1, "every": -1.0}, "every is -1.0"),
        ({"dt": 0.1, "pic": 2.0}, "pic is 2.0"),
    ],
)
def test_bad_input_is_named(options, message):
    with pytest.raises(mpm.InputError, match=message):
        vibrating_column().implicit(1.0, **options)


def test_bad_ghost_penalty_is_named():
    with pytest.raises(mpm.InputError, match="filled is 2.0"):
        mpm.GhostPenalty(filled=2.0)
