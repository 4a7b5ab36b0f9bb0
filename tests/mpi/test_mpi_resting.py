"""Resting cells on several ranks: they fail, turn into particles and are repartitioned as on one."""

import numpy as np
import pytest
from mpi4py import MPI
from partitions import all_by_id, assert_same, bands, one_does_all, scattered, spread_box

import mpm_core as mpm

FIELDS = ("position", "velocity", "stress", "volume", "state", "displacement", "resting", "velocity_gradient")


def steep_block(comm, owners_of=bands):
    """A block that rests, taller than it stands: it fails at its foot."""
    mesh = spread_box((24, 8), (2.4, 0.8), comm, owners_of, diagonals="alternating", body=((0, 0), (1.2, 0.6)))
    soil = mpm.MohrCoulomb(young=4e6, poisson=0.3, cohesion=1.5e3, friction_angle=20.0)
    model = mpm.Model(mesh, soil)
    model.seed(density=2000.0, per_cell=10, cell_tag=1)
    model.roller(1, (1, 0))
    model.roller(3, (0, 1))
    model.set_gravity((0.0, -9.81))
    model.rest()
    return model


@pytest.mark.parametrize("rebalance", [None, 1.1])
@pytest.mark.parametrize("owners_of", [bands, scattered, one_does_all])
def test_cells_turn_into_particles_on_all_ranks_as_on_one(comm, owners_of, rebalance):
    model, alone = steep_block(comm, owners_of), steep_block(MPI.COMM_SELF)
    if rebalance and comm.size > 1 and owners_of is one_does_all:
        pytest.skip("covered by the bands")
    options = dict(
        until=0.2, every=0.05, damping=0.1, energy_limit=None, conversion=mpm.Conversion(plastic_strain=0.01)
    )
    reports, expected = list(model.explicit(**options, rebalance=rebalance)), list(alone.explicit(**options))
    for report, other in zip(reports, expected, strict=True):
        assert (report.resting_cells, report.converted_cells, report.particles) == (
            other.resting_cells, other.converted_cells, other.particles)  # fmt: skip
        assert report.kinetic_energy == pytest.approx(other.kinetic_energy, rel=1e-8)
    assert expected[0].converted_cells < expected[-1].converted_cells and expected[-1].resting_cells > 0
    assert_same(all_by_id(model, FIELDS), all_by_id(alone, FIELDS))


def test_a_checkpoint_of_both_kinds_goes_on_on_another_partition(comm, shared_path):
    model, alone = steep_block(comm, scattered), steep_block(MPI.COMM_SELF)
    for each in (model, alone):
        list(each.explicit(0.1, energy_limit=None))
    model.save(shared_path / "both.h5")
    resumed = mpm.Model(steep_block(comm, bands).mesh, model.laws)
    resumed.restore(shared_path / "both.h5")
    assert resumed.comm.allreduce(int(resumed.resting_cells.sum())) == alone.resting_cells.sum() > 0
    reports = [each.explicit(0.2, energy_limit=None).last() for each in (resumed, alone)]
    assert reports[0].converted_cells == reports[1].converted_cells > 0
    assert_same(all_by_id(resumed, FIELDS), all_by_id(alone, FIELDS))


def test_a_resting_cell_weighs_as_much_as_one_particle(comm):
    # Particles on the left, resting cells on the right: after a repartition all ranks have about as many rows.
    mesh = spread_box((24, 4), (2.4, 0.4), comm, bands, diagonals="alternating")
    model = mpm.Model(mesh, mpm.LinearElastic(young=1e6, poisson=0.3))
    model.seed(density=2000.0, per_cell=10)
    model.rest(where=lambda x: x[:, 0] > 1.2)
    rows = model.comm.allreduce(len(model.particles))
    assert rows == 12 * 4 * 2 * (10 + 1)
    if comm.size > 1:
        assert model.imbalance() > 1.4
        assert model.rebalance() < 1.15
    assert model.comm.allreduce(int(model.resting_cells.sum())) == 12 * 4 * 2
    before = model.report()
    model.convert()
    assert model.report().mass == pytest.approx(before.mass, rel=1e-13)
    assert np.all(model.comm.allreduce(len(model.particles)) == 24 * 4 * 2 * 10)


@pytest.mark.parametrize("owners_of", [bands, scattered])
@pytest.mark.parametrize("quasi_static", [False, True])
def test_implicit_steps_turn_cells_into_particles_on_all_ranks_as_on_one(comm, owners_of, quasi_static):
    models = steep_block(comm, owners_of), steep_block(MPI.COMM_SELF)
    reports = []
    for model in models:
        model.set_gravity((0.0, -9.81 if not quasi_static else -3.0), ramp=0.1)
        model.convert(where=lambda x: x[:, 0] < 0.3)
        conversion = mpm.Conversion(displacement=2e-3 if quasi_static else 0.02, layers=1)
        steps = model.implicit(0.1, dt=0.02, quasi_static=quasi_static, conversion=conversion)
        reports.append([(r.resting_cells, r.converted_cells, r.particles) for r in steps])
    assert reports[0] == reports[1]
    assert reports[1][0] != reports[1][-1] and reports[1][-1][0] > 0
    assert_same(*(all_by_id(model, FIELDS) for model in models))


@pytest.mark.parametrize("owners_of", [bands, scattered])
def test_pore_water_flows_through_resting_cells_on_all_ranks_as_on_one(comm, owners_of):
    models = steep_block(comm, owners_of), steep_block(MPI.COMM_SELF)
    for model in models:
        model.add_water(porosity=0.4, conductivity=1e-3, modulus=1e7)
        model.convert(where=lambda x: x[:, 0] < 0.3)
        report = model.implicit(0.06, dt=0.02, conversion=mpm.Conversion(displacement=0.02, layers=1)).last()
        assert report.converted_cells > 0 and report.resting_cells > 0
    fields = (*FIELDS, "pore_pressure", "pressure_gradient", "porosity")
    assert_same(*(all_by_id(model, fields) for model in models))


@pytest.mark.parametrize("owners_of", [bands, scattered])
def test_water_with_its_own_velocity_is_the_same_in_resting_cells_on_all_ranks(comm, owners_of):
    models = steep_block(comm, owners_of), steep_block(MPI.COMM_SELF)
    for model in models:
        model.add_water(porosity=0.4, conductivity=1e-3, modulus=1e7)
        model.convert(where=lambda x: x[:, 0] < 0.3)
        conversion = mpm.Conversion(displacement=0.02, layers=1)
        report = model.explicit(0.06, energy_limit=None, conversion=conversion).last()
        assert report.converted_cells > 0 and report.resting_cells > 0
    fields = (*FIELDS, "pore_pressure", "porosity", "water_velocity", "water_mass", "water_gradient")
    assert_same(*(all_by_id(model, fields) for model in models))


def pressed_block(comm, owners_of=bands):
    """A disc rolls over a block that rests, and presses on it."""
    model = steep_block(comm, owners_of)
    model.add_contact(mpm.Disc((0.2, 0.712), 0.1), friction=0.3, velocity=(2.0, -0.5), spin=-20.0)
    return model


@pytest.mark.parametrize("owners_of", [bands, scattered])
def test_cells_turn_into_particles_under_a_body_on_all_ranks_as_on_one(comm, owners_of):
    models = pressed_block(comm, owners_of), pressed_block(MPI.COMM_SELF)
    reports = [model.explicit(0.1, energy_limit=None).last() for model in models]
    assert reports[0].converted_cells == reports[1].converted_cells > 0 and reports[1].resting_cells > 0
    assert_same(*(all_by_id(model, (*FIELDS, "contact_slip_0")) for model in models))
    force, reference = (model.contacts[0].force for model in models)
    assert abs(reference[1]) > 1
    np.testing.assert_allclose(force, reference, rtol=0, atol=1e-8 * np.abs(reference).max())


def test_loads_on_resting_cells_are_refused_on_all_ranks(comm):
    # The loaded cells are those of one rank at most; the others refuse too, instead of waiting for it.
    model = steep_block(comm)
    top = mpm.Box((0.0, 0.6), (0.1, 0.7))
    with pytest.raises(mpm.InputError, match="surface Box.* would load .* resting cells"):
        model.load_surface(top, pressure=1e3)
    forces = np.zeros((len(model.particles), 2))
    forces[model.particles.id == 0] = 1.0
    with pytest.raises(mpm.InputError, match="traction would load 1 resting cells"):
        model.particles.set("traction", forces)
