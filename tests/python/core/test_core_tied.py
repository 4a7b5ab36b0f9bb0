"""Soil that is tied to rigid surfaces, explicit and implicit: tension, rotation, restart, and what is refused."""

import numpy as np
import pytest
from core_cases import box

import mpm_core as mpm

G = 9.81
pytestmark = pytest.mark.filterwarnings("error:nothing holds the particles")  # a surface does


def block(young=1e5, corner=(0.55, 0.55)):
    model = mpm.Model(box((10, 10), (2.0, 2.0), shake=0.15), mpm.LinearElastic(young=young, poisson=0.3))
    grid = 0.05 * (np.indices((8, 8)).reshape(2, -1).T + 0.5) + corner
    model.seed_points(grid, np.full(len(grid), 0.05**2), density=1000.0)
    return model


@pytest.mark.parametrize("implicit", [False, True])
def test_a_tied_block_hangs_from_a_ceiling(implicit):
    model = block()
    ceiling = model.add_contact(mpm.Plane((0, 0.95), (0, -1)), bonded=True)
    model.set_gravity((0.0, -G), ramp=0.2)
    *_, report = model.implicit(4.0, dt=0.1) if implicit else model.explicit(0.8, damping=0.5)
    weight = report.mass * G
    assert ceiling.force == pytest.approx([0, -weight], abs=0.01 * weight)
    assert ceiling.pressure * 0.4 == pytest.approx(-weight, rel=0.01)
    assert ceiling.sticking_fraction == 1.0


@pytest.mark.parametrize("implicit", [False, True])
def test_a_tied_block_turns_with_its_plate(implicit):
    # Slowly enough to stay stiff: every particle is where the rotation about the plate's centre takes it.
    model = block(young=1e6, corner=(0.8, 0.9))
    model.add_contact(mpm.Box((0.7, 0.7), (1.3, 0.9)), bonded=True, spin=0.5, centre=(1.0, 0.8))
    list(model.implicit(1.0, dt=0.02) if implicit else model.explicit(1.0))
    at = model.particles.position - model.particles.displacement - (1.0, 0.8)
    angle = 0.5
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    assert model.particles.position == pytest.approx(at @ turn.T + (1.0, 0.8), abs=0.01)


def test_no_energy_is_made_in_any_step_and_momentum_is_that_of_the_impulse():
    # Dust without stresses: the work on it and the energy of the springs, which is that at a step's start, never grow together.
    model = block(young=1e-6)
    wall = model.add_contact(mpm.Plane((0.55, 0), (1, 0)), bonded=True)
    model.particles.set("velocity", np.full((64, 2), (1.0, 0.3)))
    mass, rows = model.particles.mass.sum(), []
    for report in model.explicit(0.02, dt=5e-4, every_steps=1, energy_limit=np.inf):
        rows.append((report.external_work, wall.stored_energy))
    work, stored = np.array(rows).T
    assert np.diff([0.0, *(work[:-1] + stored[1:])]).max() <= 1e-14 * mass
    assert work.min() < -0.01 * mass
    change = model.particles.mass @ model.particles.velocity - mass * np.array([1.0, 0.3])
    assert change == pytest.approx(-wall.impulse, abs=1e-10 * mass)


def test_a_run_goes_on_from_a_checkpoint_to_the_last_bit(tmp_path):
    def built():
        model = block()
        model.add_contact(mpm.Plane((0, 0.95), (0, -1)), bonded=True)
        model.set_gravity((1.0, -G))
        return model

    first, second = built(), built()
    list(first.explicit(0.02))
    first.save(tmp_path / "half.h5")
    list(first.explicit(0.04))
    second.restore(tmp_path / "half.h5")
    list(second.explicit(0.04))
    for name in ("position", "stress", "contact_bond_0"):
        assert np.array_equal(getattr(first.particles, name), getattr(second.particles, name))
    assert first.particles.contact_bond_0[:, 0].sum() == 8


def test_soil_inside_of_a_surface_is_refused_with_its_depth():
    with pytest.raises(mpm.InputError, match="has soil as deep as 0.025 m inside, expected it outside"):
        block().add_contact(mpm.Plane((0, 0.9), (0, -1)), bonded=True)
