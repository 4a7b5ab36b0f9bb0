"""Rayleigh damping of soil and water with a velocity each: decay of modes, flow, energy, time step."""

import numpy as np
import pytest
from core_cases import box, rollers, run
from two_phase_cases import BASE, DENSITY, ELASTIC, GAMMA, GRAINS, LEFT, OEDOMETER, POROSITY, RIGHT, TOP, WATER, column

import mpm_core as mpm

SHEAR = 10e6 / 2.6
WITHOUT_WATCH = {"conversion": None, "energy_limit": None}


def bar(count, law=ELASTIC, *, modulus=2.2e8, conductivity=1e-8, moves=1):
    """A saturated bar of one cell's width between fixed ends, whose motion is along one axis; its water hardly flows."""
    model = mpm.Model(box((count, 1), (1.0, 1.0 / count)), law)
    model.seed(density=DENSITY, per_cell=10)
    for end in (LEFT, RIGHT):
        model.fix(end)
    for side in (BASE, TOP):
        model.roller(side, np.eye(2)[1 - moves])
    model.add_water(porosity=POROSITY, conductivity=conductivity, modulus=modulus)
    return model


def set_off(model, shape, resting):
    model.explicit(1e-9).last()  # from now on the water has a velocity of its own
    for name in ("velocity", "water_velocity"):
        model.particles.set(name, shape)
    if resting:
        model.rest()


@pytest.mark.parametrize("resting", [False, True])
@pytest.mark.parametrize("mass, stiffness", [(1.0, 0.0), (0.0, 1.0), (0.5, 0.5)])
def test_a_shear_mode_decays_as_one_mass_with_the_shear_modulus_of_the_soil(mass, stiffness, resting):
    """omega = pi sqrt(G / rho) with the density of soil and water, xi = alpha / 2 omega + beta omega / 2: 2 % here. After four
    periods the energy is exp(-16 pi xi) of that at the start, and what is lost is the work of damping. If the water were not
    damped by mass, xi would be 4/5 of that.
    """
    omega, ratio = np.pi * np.sqrt(SHEAR / DENSITY), 0.02
    damping = mpm.Rayleigh(mass=2 * omega * ratio * mass, stiffness=2 / omega * ratio * stiffness)
    model = bar(40)
    x = model.particles.position[:, :1]
    set_off(model, 1e-6 * np.sin(np.pi * x) * [0, 1], resting)
    start = model.report().kinetic_energy
    report = run(model, model.time + 8 * np.pi / omega, rayleigh=damping, conversion=None)
    left = report.kinetic_energy + report.stored_energy
    assert -np.log(left / start) == pytest.approx(16 * np.pi * ratio, rel=0.01)
    assert report.damping_work == pytest.approx(start - left, rel=0.01)
    assert abs(report.unexplained_energy) < 0.01 * start


@pytest.mark.parametrize("nmd", [False, True])
@pytest.mark.parametrize("mass, stiffness", [(0.03, 0.0), (0.0, 0.06)])
def test_a_compression_mode_is_damped_by_the_drained_modulus(mass, stiffness, nmd):
    """Undrained soil swings with omega^2 = pi^2 (M + K_w / n) / rho, and the viscous stress beta M takes out beta M pi^2 / rho in
    the place of beta omega^2: xi = alpha / 2 omega + beta omega / 2 M / (M + K_w / n). With K_w / n = M that is half of what the
    undrained modulus would give.
    """
    omega = np.pi * np.sqrt(2 * OEDOMETER / DENSITY)
    ratio = mass + stiffness * OEDOMETER / (2 * OEDOMETER)
    damping = mpm.Rayleigh(mass=2 * omega * mass, stiffness=2 / omega * stiffness)
    model = bar(40, modulus=POROSITY * OEDOMETER, moves=0)
    x = model.particles.position[:, :1]
    set_off(model, 1e-6 * np.sin(np.pi * x) * [1, 0], False)
    start, frequency = model.report().kinetic_energy, omega / (2 * np.pi)
    report = run(model, model.time + 4 / frequency, rayleigh=damping, nmd=nmd)
    assert -np.log(report.kinetic_energy / start) == pytest.approx(16 * np.pi * ratio, rel=0.02)
    assert report.damping_work == pytest.approx(start - report.kinetic_energy, rel=0.02)
    assert abs(report.unexplained_energy) < 0.01 * start


@pytest.mark.parametrize("place", ["plane", "solid", "axisymmetric"])
def test_undrained_soil_is_braked_as_one_mass(place):
    """A body that moves as a whole: v = w = v_0 exp(-alpha t), and no water flows though the soil conducts well."""
    dim = 3 if place == "solid" else 2
    geometry = mpm.Geometry.AXISYMMETRIC if place == "axisymmetric" else None
    mesh = box((6,) * dim, (3.0,) * dim, body=((0.0 if geometry else 1.0,) + (1.0,) * (dim - 1), (2.0,) * dim))
    model = mpm.Model(mesh, ELASTIC, **({"geometry": geometry} if geometry else {}))
    model.seed(density=DENSITY, per_cell=4, cell_tag=1)
    model.add_water(porosity=POROSITY, conductivity=0.1, modulus=2.2e7)
    velocity = 1e-3 * np.eye(dim)[-1] if geometry else 1e-3 * np.arange(1.0, dim + 1)
    model.particles.set("velocity", np.tile(velocity, (len(model.particles), 1)))
    report = run(model, 0.05, rayleigh=mpm.Rayleigh(mass=10.0, stiffness=1e-4), nmd=True, **WITHOUT_WATCH)
    p = model.particles
    slowed = (1 - 10.0 * report.time / report.steps) ** report.steps  # by steps of dt: 1 - alpha dt each
    assert slowed == pytest.approx(np.exp(-0.5), rel=1e-2)
    for found in (p.velocity, p.water_velocity):
        np.testing.assert_allclose(found, np.tile(slowed * velocity, (len(p), 1)), rtol=0, atol=1e-5 * 1e-3)


@pytest.mark.parametrize("anisotropy", [None, (0.5, 1.0)])
def test_damping_does_not_change_steady_flow_through_soil(anisotropy):
    """Water that rises through a column: n (w - v) = k i. By the water's own velocity, forces alpha m_w w would be as a drag
    1 + alpha k / n g times as large, and by the mean velocity of both 1 + alpha k rho_w / rho g: 1.51 and 1.10 here."""
    conductivity, gradient, damping = 0.1, 0.2, mpm.Rayleigh(mass=20.0, stiffness=1e-3)
    found = []
    for rayleigh in (None, damping):
        model = column(10, conductivity=conductivity, modulus=2.2e7, anisotropy=anisotropy)
        model.hold_pore_pressure(BASE, GAMMA * gradient)
        model.set_pore_pressure(lambda x: GAMMA * gradient * (1 - x[:, 1]))
        p = model.particles
        p.set("stress", p.pore_pressure[:, None] * [3 / 7, 1.0, 3 / 7, 0.0])  # no total stress
        model.explicit(1.5, rayleigh=rayleigh, damping=0.5, pic=0.02, nmd=True, energy_limit=None).last()
        flux = (POROSITY * (p.water_velocity - p.velocity))[:, 1]
        assert flux.mean() == pytest.approx(conductivity * gradient, rel=1e-4)
        assert np.abs(p.velocity).max() < 1e-5 * flux.mean()
        found.append((flux, p.stress[:, 1], model.averaged_pore_pressure()))
    for damped, undamped in zip(found[1], found[0], strict=True):
        np.testing.assert_allclose(damped, undamped, rtol=0, atol=5e-4 * np.abs(undamped).max())


@pytest.mark.parametrize("nmd", [False, True])
@pytest.mark.parametrize("resting", [False, True])
@pytest.mark.parametrize("place", ["plane", "solid", "axisymmetric"])
def test_the_balance_of_energy_closes_with_damping(place, resting, nmd):
    """A smooth motion of soil and water in a box, through which water flows as well: what it loses by damping is in the report."""
    dim = 3 if place == "solid" else 2
    geometry = mpm.Geometry.AXISYMMETRIC if place == "axisymmetric" else None
    mesh = box((8,) * dim if dim == 2 else (4,) * dim, shake=0.1, diagonals="alternating")
    model = mpm.Model(mesh, ELASTIC, **({"geometry": geometry} if geometry else {}))
    model.seed(density=DENSITY, per_cell={2: 6, 3: 8}[dim])
    rollers(model, but=(1,) if geometry else ())
    model.add_water(porosity=POROSITY, conductivity=1e-3, modulus=2.2e7)
    x = model.particles.position
    set_off(
        model,
        1e-3 * np.column_stack([np.sin(np.pi * x[:, 0]) * np.cos(np.pi * x[:, -1])] + [0 * x[:, 0]] * (dim - 1)),
        resting,
    )
    start = model.report()
    damping = mpm.Rayleigh(mass=40.0, stiffness=2e-4)
    report = run(model, 0.01, rayleigh=damping, nmd=nmd, **WITHOUT_WATCH)
    undamped = start.kinetic_energy
    assert report.damping_work > 0.2 * undamped and report.drag_work > 0
    assert abs(report.unexplained_energy - start.unexplained_energy) < 0.02 * undamped


def damped_step(model, beta, alpha=0.0):
    """dt (sqrt(1 + x^2) - x) with x = beta dt / dt_s^2 + alpha dt / 4, and dt_s of the effective stresses and the grains alone."""
    fast = model.critical_time_step()
    of_soil = mpm.critical_cell(model).altitude / np.sqrt(OEDOMETER / ((1 - POROSITY) * GRAINS))
    x = beta * fast / of_soil**2 + 0.25 * alpha * fast
    return fast * (np.sqrt(1 + x**2) - x)


@pytest.mark.parametrize("resting", [False, True])
def test_the_time_step_is_stable_and_no_shorter_than_the_damping_of_the_soil_needs(resting):
    """Damping of effective stresses does not damp the fast wave by which steps are short, so that they need not be as short as
    beta over the step of that wave would have it."""

    def ground():
        model = bar(20, modulus=2e7, conductivity=1e-3, moves=0)
        set_off(model, 1e-6 * np.random.default_rng(3).standard_normal((len(model.particles), 2)), resting)
        return model, model.critical_time_step()

    def growth_of(beta, options):
        model, fast = ground()
        step, start = damped_step(model, beta * fast), model.report()
        damping = mpm.Rayleigh(stiffness=beta * fast)
        report = run(model, start.time + 400 * step, rayleigh=damping, **options(fast), **WITHOUT_WATCH)
        return report.kinetic_energy / start.kinetic_energy, report.steps - start.steps, step / damping.time_step(fast)

    growth, steps, longer = growth_of(3.0, lambda fast: {"courant": 1.0})
    assert growth < 1.0 and steps == 400 and longer > 2
    with pytest.raises(mpm.InputError, match="above the critical time step"):
        growth_of(30.0, lambda fast: {"dt": 0.1 * fast})
    try:
        growth, *_ = growth_of(30.0, lambda fast: {"dt": fast, "allow_unstable": True})
    except mpm.RunError:
        growth = np.inf
    assert not growth < 1.0


def test_soil_that_has_yielded_is_not_damped_and_neither_is_its_water():
    soil = mpm.MohrCoulomb(young=10e6, poisson=0.3, cohesion=1e6, friction_angle=0.0)
    momenta = []
    for strain in (0.0, 0.01):
        model = mpm.Model(box((4, 4)), soil)
        model.seed(density=DENSITY, per_cell=10)
        model.add_water(porosity=POROSITY, conductivity=1e-3, modulus=2.2e7)
        state = model.particles.state.copy()
        state[:, 0] = strain
        model.particles.set("state", state)
        model.particles.set("velocity", np.tile([1e-6, 0.0], (len(model.particles), 1)))
        run(model, 0.02, rayleigh=mpm.Rayleigh(mass=5.0, stiffness=1e-4), energy_limit=None)
        momenta.append(model.report().momentum[0])
    assert momenta[1] == pytest.approx(DENSITY * 1e-6, rel=1e-9)
    assert momenta[0] == pytest.approx(DENSITY * 1e-6 * np.exp(-0.1), rel=1e-3)


def test_mass_damping_beyond_what_the_drag_takes_out_is_refused():
    """alpha <= 4 g rho / (k rho_w), with the largest conductivity of anisotropic soil: 4 9.81 1.99 / 0.5 = 156.2 1/s."""
    limit = 4 * 9.81 * DENSITY / (WATER * 0.5)
    model = column(4, conductivity=0.1, modulus=2.2e7, anisotropy=(5.0, 0.5))
    for _ in range(2):  # before and after the water has a velocity of its own
        with pytest.raises(mpm.InputError, match=r"rayleigh.mass is 160 1/s, expected at most 156\.\d+ 1/s"):
            model.explicit(1.0, rayleigh=mpm.Rayleigh(mass=160.0))
        model.explicit(model.time + 1e-5, rayleigh=mpm.Rayleigh(mass=0.999 * limit)).last()


def shaken(counts, size, *, of_total_stress=False):
    """A layer into whose base a pulse of shear comes, which leaves there again; supports are those of a column in shear."""
    modulus = 2.2e7
    law = mpm.Undrained(ELASTIC, water_modulus=modulus, porosity=POROSITY) if of_total_stress else ELASTIC
    model = mpm.Model(box(counts, size), law)
    model.seed(density=DENSITY, per_cell=10)
    if not of_total_stress:
        model.add_water(porosity=POROSITY, conductivity=1e-9, modulus=modulus)
    speed = np.sqrt(SHEAR / DENSITY)
    time = np.linspace(0.0, 2 / speed, 201)
    model.absorb(BASE, thickness=50.0)
    model.shake(mpm.Motion(time, 1e-4 * np.sin(0.5 * np.pi * speed * time) ** 2), (1.0, 0.0))
    return model, 3 / speed


def surface_velocities(model, until, places, rayleigh):
    nodes = [np.linalg.norm(model.mesh.points - (x, 1.0), axis=1).argmin() for x in places]
    reports = model.explicit(until, every=until / 30, nmd=True, rayleigh=rayleigh, **WITHOUT_WATCH)
    return np.array([model.nodal("velocity")[nodes, 0] for _ in reports])


def test_ground_between_absorbing_sides_moves_as_undrained_soil_that_is_damped():
    """A column whose water hardly flows moves as one of undrained soil, and a site between free fields as that column: in shear both
    have the same density and modulus. Damping of 6 % takes a tenth and more of the motion."""
    rayleigh = mpm.Rayleigh.of_ratio(0.06, (10.0, 50.0))
    columns = []
    for of_total_stress, damping in ((False, None), (False, rayleigh), (True, rayleigh)):
        model, until = shaken((1, 20), (0.05, 1.0), of_total_stress=of_total_stress)
        for side in (LEFT, RIGHT):
            model.roller(side, (0, 1))
        columns.append(surface_velocities(model, until, [0.0], damping)[:, 0])
    undamped, damped, of_undrained = columns
    peak = np.abs(damped).max()
    assert peak < 0.9 * np.abs(undamped).max()
    assert np.abs(damped - of_undrained).max() < 2e-3 * peak
    model, until = shaken((10, 20), (0.5, 1.0))
    model.absorb((LEFT, RIGHT), free_field=True)
    site = surface_velocities(model, until, [0.0, 0.25, 0.5], rayleigh)
    print(
        peak,
        np.abs(undamped).max(),
        np.abs(damped - of_undrained).max() / peak,
        np.abs(site - damped[:, None]).max() / peak,
    )
    assert np.abs(site - damped[:, None]).max() < 0.01 * peak
