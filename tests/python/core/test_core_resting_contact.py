"""Rigid surfaces on ground of resting cells: those that they come near to turn into particles before they are touched."""

import numpy as np
import pytest
from core_cases import box, by_id, rollers
from mpm_core.surfaces import distances

import mpm_core as mpm

ELASTIC = mpm.LinearElastic(young=1e6, poisson=0.3)
SOFT = mpm.MohrCoulomb(young=1e6, poisson=0.3, cohesion=2e3, friction_angle=20.0, dilation_angle=20.0)
DEPTH = 1.0


def ground(dim=2, *, rest, law=ELASTIC, geometry=None):
    """A layer of soil 4 m wide under air, on rollers."""
    counts, low = {2: (16, 8), 3: (8, 8, 8)}[dim], (0.0,) * dim
    lengths = (4.0, 2.0) if dim == 2 else (4.0, 4.0, 2.0)
    mesh = box(counts, lengths, diagonals="alternating", body=(low, (*lengths[:-1], DEPTH)))
    model = mpm.Model(mesh, law, **({} if geometry is None else {"geometry": geometry}))
    rollers(model, range(dim - 1))
    model.roller(2 * dim - 1, np.eye(dim)[-1])
    model.seed(density=1800.0, per_cell={2: 6, 3: 8}[dim], cell_tag=1)
    if rest:
        model.rest()
    return model


def punch(dim, depth):
    """A block whose lower face is at a depth."""
    low = {2: (1.6, DEPTH - depth), 3: (1.6, 1.6, DEPTH - depth)}[dim]
    high = {2: (2.4, 1.9), 3: (2.4, 2.4, 1.9)}[dim]
    return mpm.Box(low, high)


def nearest_resting(model, surface):
    """Distance of the nearest vertex of a resting cell, over the size of the cells."""
    cells = model.mesh.cells[: model.mesh.owned_cells][model.resting_cells]
    return distances(surface, model.mesh.points[np.unique(cells)]).min(initial=np.inf) / 0.25


@pytest.mark.parametrize("dim", [2, 3])
def test_the_gap_is_that_of_the_particles_that_cells_stand_for(dim):
    at_rest, particles = ground(dim, rest=True), ground(dim, rest=False)
    assert at_rest.gap(punch(dim, 0.0)) == pytest.approx(particles.gap(punch(dim, 0.0)), rel=1e-12)
    with pytest.raises(mpm.InputError, match="overlaps the soil by"):
        at_rest.add_contact(punch(dim, 0.1))


@pytest.mark.parametrize(
    "dim, geometry", [(2, mpm.Geometry.PLANE_STRAIN), (2, mpm.Geometry.AXISYMMETRIC), (3, mpm.Geometry.SOLID)]
)
def test_a_punch_feels_the_same_force_over_resting_cells(dim, geometry):
    # While displacements are small against the cells, resting cells are what their particles are.
    forces, rows = [], []
    for rest in (True, False):
        model = ground(dim, rest=rest, geometry=geometry)
        depth = model.gap(punch(dim, 0.0))
        velocity = -1e-4 * np.eye(dim)[-1]
        contact = model.add_contact(punch(dim, min(depth, 0.0)), friction=0.3, velocity=velocity)
        forces.append([contact.force for _ in model.explicit(0.1, every=0.02)])
        rows.append(len(model.particles))
    assert abs(np.array(forces[1])[-1, -1]) > 1
    np.testing.assert_allclose(forces[0], forces[1], rtol=0, atol=1e-3 * np.abs(forces[1]).max())
    assert rows[0] < 0.7 * rows[1]


def test_cells_turn_into_particles_as_a_surface_passes():
    model = ground(rest=True)
    disc = model.add_contact(mpm.Disc((0.3, DEPTH + 0.32), 0.3), velocity=(4.0, 0.0))
    resting = []
    for _ in model.explicit(0.8, every_steps=20, conversion=None):
        resting.append(model.resting_cells.sum())
        assert nearest_resting(model, mpm.Disc(np.array([0.3, DEPTH + 0.32]) + disc.displacement, 0.3)) > 0.5
    assert disc.displacement[0] == pytest.approx(3.2)
    assert np.all(np.diff(resting) <= 0) and resting[0] > 1.5 * resting[-1] > 0  # those below stay


def test_cells_that_are_let_rest_beside_a_surface_do_not_rest_in_a_run():
    model = ground(rest=False)
    model.add_contact(mpm.Plane((0.0, DEPTH + 0.1), (0.0, -1.0)))
    assert model.rest() == 16 * 4 * 2
    model.set_gravity((0.0, -9.81))
    list(model.explicit(1e-3, conversion=None))
    assert nearest_resting(model, mpm.Plane((0.0, DEPTH + 0.1), (0.0, -1.0))) > 1 and model.resting_cells.any()


def test_soil_of_resting_cells_is_tied_to_a_surface():
    # Pulled up by 1 mm, the soil hangs on the plate as if it had been particles from the start.
    forces = []
    for rest in (True, False):
        model = ground(rest=rest)
        surface = mpm.Plane((0.0, DEPTH), (0.0, -1.0))
        tied = model.add_contact(surface, velocity=(0.0, 0.01), bonded=True)
        assert model.resting_cells.any() == rest
        model.implicit(0.1, dt=0.1, quasi_static=True, conversion=None).last()
        forces.append(tied.force)
    modulus = 1e6 * 0.7 / (1.3 * 0.4)  # of compression without lateral strain
    assert forces[1][1] == pytest.approx(-4.0 * modulus * 1e-3, rel=0.1)  # the tied layer is stiffer than soil
    np.testing.assert_allclose(forces[0], forces[1], rtol=0, atol=1e-8 * np.abs(forces[1]).max())


@pytest.mark.parametrize("dim", [2, 3])
def test_an_implicit_step_presses_resting_cells_as_it_presses_particles(dim):
    forces = []
    for rest in (True, False):
        model = ground(dim, rest=rest)
        surface = punch(dim, min(model.gap(punch(dim, 0.0)), 0.0))
        contact = model.add_contact(surface, friction=0.3, velocity=-0.02 * np.eye(dim)[-1])
        model.implicit(0.5, dt=0.5, quasi_static=True, conversion=None).last()
        forces.append(contact.force)
        assert model.resting_cells.any() == rest
    assert forces[1][-1] > 100
    np.testing.assert_allclose(forces[0], forces[1], rtol=0, atol=1e-7 * np.abs(forces[1]).max())


def test_a_run_goes_on_from_a_checkpoint_to_the_last_bit(tmp_path):
    def made():
        model = ground(rest=True, law=SOFT)
        surface = punch(2, min(model.gap(punch(2, 0.0)), 0.0))
        model.add_contact(surface, friction=0.3, velocity=(0.5, -1.0))
        return model

    straight, first, resumed = made(), made(), made()
    list(straight.explicit(0.2, every=0.1, energy_limit=None))
    list(first.explicit(0.1, energy_limit=None))
    first.save(tmp_path / "half.h5")
    resumed.restore(tmp_path / "half.h5")
    last = resumed.explicit(0.2, energy_limit=None).last()
    assert last.resting_cells > 0 and last.converted_cells > 20
    for name in ("position", "velocity", "stress", "resting", "contact_slip_0"):
        np.testing.assert_array_equal(by_id(resumed, name), by_id(straight, name))
    np.testing.assert_array_equal(resumed.contacts[0].force, straight.contacts[0].force)
