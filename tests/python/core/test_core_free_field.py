"""Free fields beside a site, and rigid bases: a level site between such sides moves as a column of its layers."""

import numpy as np
import pytest
from core_cases import box, by_id, moduli, run
from mpm_core.free_field import layers_at
from mpm_core.ground_column import Base, GroundColumn

import mpm_core as mpm

POISSON, DENSITY = 0.3, 1000.0
STIFF, SOFT = (mpm.LinearElastic(young=young, poisson=POISSON) for young in (2e6, 1e6))
_, SHEAR, MODULUS = moduli(1e6, POISSON)
SPEED = np.sqrt(SHEAR / DENSITY)
LEFT, RIGHT, BASE, TOP = 1, 2, 3, 4  # tags of the sides of `box`
AMPLITUDE = 1e-5


def pulse(length):
    """A bump of velocity of a duration [s]."""
    time = np.linspace(0.0, length, 201)
    return mpm.Motion(time, AMPLITUDE * np.sin(np.pi * time / length) ** 2)


def site(counts, size, *, resting=False, laws=(STIFF, SOFT), density=DENSITY):
    """A soft layer on a stiff one, each half of the height, without supports."""
    upper = [-np.inf] * (len(size) - 1) + [0.5 * size[-1]], [np.inf] * len(size)
    model = mpm.Model(box(counts, size, body=upper), list(laws))
    for tag in (0, 1):
        model.seed(density=density, per_cell=10, cell_tag=tag, material=tag)
    if resting:
        model.rest()
    return model


def motion_of(model, until, places, **options):
    """Velocities at the nodes nearest to places at 60 times, (60, places, D)."""
    nodes = [np.linalg.norm(model.mesh.points - place, axis=1).argmin() for place in places]
    return np.array([
        model.nodal("velocity")[nodes]
        for _ in model.explicit(until, every=until / 60, conversion=None, energy_limit=None, **options)
    ])  # fmt: skip


def column_motion(count, until, axis, let_in, **options):
    """Velocity along an axis at the top of a column of one cell's width that moves along this axis only, (60,)."""
    model = site((1, count), (1.0 / count, 1.0))
    for tag in (LEFT, RIGHT, BASE, TOP):
        model.roller(tag, np.eye(2)[1 - axis])
    let_in(model)
    return motion_of(model, until, [(0.0, 1.0)], **options)[:, 0, axis]


@pytest.mark.parametrize("rigid", [False, True])
@pytest.mark.parametrize("resting", [False, True])
def test_a_layered_site_between_free_fields_moves_as_a_column(resting, rigid):
    # Shear and compression at once: the sides are neither free to strain nor held. Everywhere on the surface, 1 % of the peak.
    count, until = 24, 3.0 / SPEED

    def let_in(model):
        if rigid:
            model.drive(BASE, pulse(2.0 / SPEED), (1.0, 0.5))
        else:
            model.absorb(BASE, thickness=50.0)
            model.shake(pulse(2.0 / SPEED), (1.0, 0.5))

    columns = np.column_stack([column_motion(count, until, axis, let_in) for axis in (0, 1)])
    motions = {}
    for free_field in (True, False):
        model = site((12, count), (0.5, 1.0), resting=resting)
        let_in(model)
        model.absorb((LEFT, RIGHT), free_field=free_field)
        motions[free_field] = motion_of(model, until, [(0.0, 1.0), (0.25, 1.0), (0.5, 1.0)])
    peak = np.abs(columns).max()
    assert np.abs(motions[True] - columns[:, None]).max() < 0.01 * peak
    assert np.abs(motions[False] - columns[:, None]).max() > 0.2 * peak


def test_a_site_under_its_weight_stays_at_rest_and_yields_as_a_column():
    # Soil that yields in the pulse: the free field follows the same law, so that the site has no sides either.
    soil = mpm.MohrCoulomb(young=1e6, poisson=POISSON, cohesion=0.5e3, friction_angle=0.0)
    model = site((10, 20), (0.5, 1.0), laws=(soil, soil))
    depth = 1.0 - model.particles.position[:, 1]
    cells = np.bincount(model.particles.cell, depth) / np.bincount(model.particles.cell)
    vertical = -DENSITY * 10.0 * cells[model.particles.cell]
    model.particles.set("stress", np.column_stack([vertical, vertical, vertical, 0 * vertical]))
    model.set_gravity((0.0, -10.0))
    model.absorb(BASE, thickness=100.0)
    model.absorb((LEFT, RIGHT), free_field=True, thickness=100.0)
    model.shake(mpm.Motion([0.0, 0.02, 0.04, 0.1], [0.0, 0.05, -0.05, 0.0]), (1, 0))
    report = run(model, 0.02)  # before the wave has come up to the middle
    at_top = model.particles.position[:, 1] > 0.9
    assert np.abs(model.particles.velocity[at_top]).max() < 1e-3 * 10.0 * 0.02
    report = run(model, 0.3)
    assert model.particles.plastic_strain.max() > 0.005 and report.mass > 0
    x, u = model.particles.position[:, 0], model.particles.displacement[:, 0]
    level = np.round(model.particles.initial_position[:, 1] / 0.05 - 0.5).astype(int)
    for side in (x < 0.1, x > 0.4):
        mean = np.array(
            [[u[chosen & (level == k)].mean() for k in range(20)] for chosen in (side, np.abs(x - 0.25) < 0.05)]
        )
        assert np.abs(mean[0] - mean[1]).max() < 0.01 * np.abs(u).max()


def test_a_free_field_bears_no_shear_stress_on_level_planes():
    """Under the mirrored motion it moves the other way by as much; with 0.2 kPa from the cells beside it, it would creep as they lean."""
    soil = mpm.MohrCoulomb(young=1e6, poisson=POISSON, cohesion=0.5e3, friction_angle=0.0)
    model = site((2, 20), (0.1, 1.0), laws=(soil, soil))
    model.particles.set("stress", np.tile((-3e3, -3e3, -3e3, 0.2e3), (len(model.particles), 1)))
    layers = layers_at(model, LEFT)
    assert np.allclose(layers.stress, (-3e3, -3e3, -3e3, 0.0))
    time, velocity = np.array([0.0, 0.02, 0.04, 0.1]), np.array([0.0, 0.05, -0.05, 0.0])
    moved = []
    for sign in (1.0, -1.0):
        base = Base((0.0, 0.0), 100.0, time, sign * velocity, np.array([1.0, 0.0]))
        column = GroundColumn(layers, [soil, soil], base, mpm.Rayleigh())
        times, velocities, _ = column.advance(0.0, 0.3)
        moved.append(np.trapz(velocities[:, -1, 0], times))
    assert abs(moved[0]) > 1e-4 and moved[0] == pytest.approx(-moved[1], rel=1e-6)


def test_rayleigh_damping_of_the_free_field_is_that_of_the_site():
    damping = mpm.Rayleigh.of_ratio(0.05, (0.25 * SPEED, 1.0 * SPEED))
    until = 3.0 / SPEED

    def let_in(model):
        model.drive(BASE, pulse(2.0 / SPEED), (1.0, 0.0))

    expected = column_motion(24, until, 0, let_in, rayleigh=damping)
    model = site((6, 24), (0.25, 1.0), resting=True)
    let_in(model)
    model.absorb((LEFT, RIGHT), free_field=True)
    moved = motion_of(model, until, [(0.0, 1.0), (0.25, 1.0)], rayleigh=damping)[:, :, 0]
    undamped = column_motion(24, until, 0, let_in)
    assert np.abs(moved - expected[:, None]).max() < 0.01 * np.abs(expected).max()
    assert np.abs(undamped - expected).max() > 0.05 * np.abs(expected).max()


@pytest.mark.parametrize("resting", [False, True])
def test_a_layer_on_a_rigid_base_moves_by_the_waves_that_go_up_and_down(resting):
    # D'Alembert: the surface moves with 2 sum (-1)^n w(t - (2n + 1) H / c) under the velocity w of the base.
    model = site((1, 40), (1.0 / 40, 1.0), laws=(SOFT, SOFT), resting=resting)
    for tag in (LEFT, RIGHT, TOP):
        model.roller(tag, (0, 1))
    motion, until = pulse(2.0 / SPEED), 5.0 / SPEED
    model.drive(BASE, motion, (1, 0))
    moved = motion_of(model, until, [(0.0, 1.0), (0.0, 0.0)])[:, :, 0]
    time = until / 60 * np.arange(1, 61)

    def wave(t):
        return np.interp(t, motion.time, motion.velocity, left=0, right=0)

    exact = 2 * sum((-1) ** n * wave(time - (2 * n + 1) / SPEED) for n in range(3))
    assert np.abs(moved[:, 0] - exact).max() < 0.02 * np.abs(exact).max()
    assert np.abs(moved[:, 1] - wave(time)).max() < 0.005 * AMPLITUDE


def test_a_block_between_four_free_fields_moves_as_a_column():
    # Three dimensions, both horizontal directions and corners where two free fields meet.
    until = 2.5 / SPEED
    model = site((4, 4, 12), (0.4, 0.4, 1.0), resting=True)
    model.drive(5, pulse(2.0 / SPEED), (1.0, 0.5, 0.0))
    model.absorb((1, 2, 3, 4), free_field=True)
    moved = motion_of(model, until, [(0, 0, 1), (0.2, 0.2, 1), (0.4, 0, 1)])

    column = site((1, 1, 12), (0.1, 0.1, 1.0), resting=True)
    for tag in (1, 2, 3, 4, 5, 6):
        column.roller(tag, (0, 0, 1))
        column.roller(tag, (0, 1, 0))
    column.drive(5, pulse(2.0 / SPEED), (1.0, 0.0, 0.0))
    expected = motion_of(column, until, [(0, 0, 1)])[:, 0, 0] / np.hypot(1.0, 0.5)
    peak = np.abs(expected).max()
    assert np.abs(moved[:, :, 0] - expected[:, None]).max() < 0.02 * peak
    assert np.abs(moved[:, :, 1] - 0.5 * expected[:, None]).max() < 0.02 * peak


def test_a_run_beside_free_fields_goes_on_from_a_checkpoint(tmp_path):
    models = []
    for way in ("whole", "resumed"):
        model = site((6, 12), (0.5, 1.0), resting=True)
        model.absorb(BASE, thickness=5.0)
        model.absorb((LEFT, RIGHT), free_field=True)
        model.shake(pulse(0.05), (1.0, 0.2))
        run(model, 0.03, conversion=None)
        if way == "resumed":
            model.save(tmp_path / "sides.h5")
            model = site((6, 12), (0.5, 1.0))
            model.restore(tmp_path / "sides.h5")
        run(model, 0.08, conversion=None)
        models.append(model)
    assert np.abs(models[0].particles.velocity).max() > 0
    for name in ("velocity", "stress", "displacement"):
        np.testing.assert_array_equal(by_id(models[0], name), by_id(models[1], name))


def test_a_run_that_ended_early_goes_on_beside_free_fields():
    """The columns were computed up to the end of the run, ahead of the model; they do not wait for it there."""
    moved = []
    for early in (False, True):
        model = site((6, 12), (0.5, 1.0), resting=True)
        model.absorb(BASE)
        model.absorb((LEFT, RIGHT), free_field=True)
        model.shake(pulse(0.05), (1.0, 0.2))
        if early:
            next(iter(model.explicit(0.08, every_steps=20, conversion=None)))
            assert 0 < model.time < 0.04
        run(model, 0.08, conversion=None)
        moved.append(by_id(model, "velocity"))
    np.testing.assert_allclose(moved[1], moved[0], rtol=0, atol=1e-9 * np.abs(moved[0]).max())


def test_free_fields_keep_the_damping_with_which_they_began(tmp_path):
    def begun():
        model = site((4, 4), (1.0, 1.0), resting=True)
        model.absorb(BASE)
        model.absorb((LEFT, RIGHT), free_field=True)
        model.shake(pulse(1.0), (1, 0))
        return model

    first, other = mpm.Rayleigh(mass=1.0, plastic_strain=np.inf), mpm.Rayleigh(mass=2.0)
    model = begun()
    run(model, 1e-3, rayleigh=first, conversion=None)
    model.save(tmp_path / "damped.h5")
    restored = begun()
    restored.restore(tmp_path / "damped.h5")
    for one in (model, restored):
        with pytest.raises(
            mpm.InputError, match=r"rayleigh is Rayleigh\(mass=2.0, .*, expected Rayleigh\(mass=1.0, .*=inf\), with"
        ):
            one.explicit(2e-3, rayleigh=other)
        with pytest.raises(mpm.InputError, match="free fields have begun to move"):
            one.shake(pulse(1.0), (1, 0))
        run(one, 2e-3, rayleigh=first, conversion=None)
        one.absorb((LEFT, RIGHT), free_field=True)
        run(one, 3e-3, rayleigh=other, conversion=None)


def sloping_side():
    mesh = box((4, 4), place=lambda x: x + np.column_stack([0.3 * x[:, 1], 0 * x[:, 1]]))
    model = mpm.Model(mesh, SOFT)
    model.seed(density=DENSITY, per_cell=10)
    return model


@pytest.mark.parametrize(
    "use, message",
    [
        (lambda model: sloping_side().absorb(LEFT, free_field=True), "facet_tag 1 is not a vertical plane"),
        (lambda model: model.absorb((RIGHT, BASE)) or model.absorb(LEFT, free_field=True), "expected only the base"),
        (lambda model: model.absorb(LEFT, free_field=True) or model.explicit(1.0, damping=0.1), "damping is 0.1 with free"),
        (lambda model: model.absorb(BASE) or model.drive(LEFT, pulse(1.0), (1, 0)), r"sides \[3\] absorb and let waves in"),
        (lambda model: model.drive(BASE, 1.0, (1, 0)), "motion is 1.0, expected a Motion"),
        (
            lambda model: model.fix(BASE) or model.absorb(LEFT, free_field=True) or model.shake(pulse(1.0), (1, 0)),
            "all sides that absorb have free fields",
        ),
        (lambda model: model.drive(BASE, pulse(1.0), (0, 0)), "length of direction is 0.0"),
    ],
)  # fmt: skip
def test_bad_input_is_refused(use, message):
    with pytest.raises(mpm.InputError, match=message):
        use(site((4, 4), (1.0, 1.0)))


def test_a_wave_that_comes_in_later_than_the_free_fields_began_is_refused():
    model = site((4, 4), (1.0, 1.0), resting=True)
    model.absorb(BASE)
    model.absorb((LEFT, RIGHT), free_field=True)
    run(model, 1e-3)
    with pytest.raises(mpm.InputError, match="free fields have begun to move"):
        model.shake(pulse(1.0), (1, 0))
