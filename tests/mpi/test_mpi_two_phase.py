"""Soil and water with a velocity each on several ranks: the same as on one, and restarts to the last bit."""

import numpy as np
import pytest
from mpi4py import MPI
from partitions import all_by_id, assert_same, bands, one_does_all, scattered, sliding_slope, spread_box

import mpm_core as mpm

FIELDS = (
    "position",
    "velocity",
    "stress",
    "volume",
    "state",
    "pore_pressure",
    "porosity",
    "conductivity",
    "water_velocity",
    "water_mass",
)
DAMPING = mpm.Rayleigh(mass=5.0, stiffness=2e-4)


def wet_slope(comm, owners_of=bands):
    """A block that slides on an incline, while its water drains at its surface and at its left side."""
    model = sliding_slope(comm, owners_of)
    model.add_water(porosity=0.4, conductivity=1e-3, modulus=2.2e7, kozeny_carman=True, suction_limit=1e3)
    model.set_pore_pressure(lambda x: 9810.0 * (0.4 - x[:, 1]))
    model.hold_pore_pressure(1, level=0.3)
    return model


def slide(model, until=0.05, **options):
    *_, report = model.explicit(until, every=0.01, since=0.0, nmd=True, **options)
    return report


@pytest.mark.parametrize("rayleigh", [None, DAMPING], ids=["undamped", "damped"])
@pytest.mark.parametrize("owners_of", [bands, scattered, one_does_all])
def test_a_slide_of_two_phases_is_the_same_on_any_partition(comm, owners_of, rayleigh):
    model, alone = wet_slope(comm, owners_of), wet_slope(MPI.COMM_SELF)
    report, expected = slide(model, rayleigh=rayleigh), slide(alone, rayleigh=rayleigh)
    assert report.plastic_fraction > 0
    assert_same(all_by_id(model, FIELDS), all_by_id(alone, FIELDS), 1e-8)
    assert model.water_inflow() == pytest.approx(alone.water_inflow(), rel=1e-8)
    squared = [(one.averaged_pore_pressure() ** 2).sum() for one in (model, alone)]
    assert comm.allreduce(squared[0]) == pytest.approx(squared[1], rel=1e-8)
    for name in ("mass", "kinetic_energy", "drag_work", "damping_work", "support_work", "unbalanced_ratio"):
        assert getattr(report, name) == pytest.approx(getattr(expected, name), rel=1e-8)
    assert (report.damping_work > 0) == (rayleigh is not None)


def test_a_repartition_changes_nothing(comm):
    model, alone = wet_slope(comm, one_does_all), wet_slope(MPI.COMM_SELF)
    slide(model, 0.02)
    model.rebalance()
    slide(model)
    slide(alone)
    assert model.repartitions == (comm.size > 1)
    assert_same(all_by_id(model, FIELDS), all_by_id(alone, FIELDS), 1e-8)


@pytest.mark.parametrize("rayleigh", [None, DAMPING], ids=["undamped", "damped"])
def test_a_restart_is_the_run_that_never_stopped(comm, tmp_path, rayleigh):
    path = comm.bcast(str(tmp_path / "wet.h5"))
    model = wet_slope(comm)
    slide(model, 0.02, rayleigh=rayleigh)
    model.save(path)
    slide(model, rayleigh=rayleigh)
    again = wet_slope(comm)
    again.restore(path)
    slide(again, rayleigh=rayleigh)
    for name, values in all_by_id(model, FIELDS).items():
        np.testing.assert_array_equal(all_by_id(again, FIELDS)[name], values, err_msg=name)
    for name in ("drag_work", "damping_work"):
        assert getattr(again.report(), name) == getattr(model.report(), name)


def wet_block(comm, geometry, owners_of=bands):
    """A saturated block that slides, or a ring that spreads, on a polyline towards a disc, across the borders of the ranks."""
    mesh = spread_box((24, 10), (6.0, 2.5), comm, owners_of, diagonals="alternating")
    soil = mpm.MohrCoulomb(young=1e6, poisson=0.3, cohesion=500.0, friction_angle=25.0)
    model = mpm.Model(mesh, soil, geometry=geometry)
    grid = 0.0625 * (np.indices((16, 8)).reshape(2, -1).T + 0.5) + (1.013, 1.007)
    radius = grid[:, 0] if geometry == mpm.Geometry.AXISYMMETRIC else np.ones(len(grid))
    model.seed_points(grid, 0.0625**2 * radius, density=2000.0)
    model.set_gravity((0.0 if geometry == mpm.Geometry.AXISYMMETRIC else 4.0, -9.0))
    ground = model.add_contact(mpm.Polyline([(0.5, 0.99), (3.0, 0.95), (5.5, 0.7)]), friction=0.2)
    disc = model.add_contact(mpm.Disc((2.4, 1.2), 0.25), friction=0.4, velocity=(-0.5, 0.0))
    model.add_water(porosity=0.4, conductivity=1e-3, modulus=4e6, suction_limit=0.0)
    model.set_pore_pressure(lambda x: 9810.0 * (1.5 - x[:, 1]))
    return model, ground, disc


@pytest.mark.parametrize("geometry", [mpm.Geometry.PLANE_STRAIN, mpm.Geometry.AXISYMMETRIC])
def test_two_phases_on_rigid_surfaces_are_the_same_on_any_partition(comm, geometry, shared_path):
    runs = [wet_block(comm, geometry, scattered), wet_block(MPI.COMM_SELF, geometry)]
    for model, *_ in runs:
        slide(model, 0.15)
    names = (*FIELDS, "contact_slip_0", "contact_slip_1")
    assert_same(all_by_id(runs[0][0], names), all_by_id(runs[1][0], names), 1e-7)
    for one, other in zip(runs[0][1:], runs[1][1:], strict=True):
        assert one.impulse == pytest.approx(other.impulse, rel=1e-7)
    path = shared_path / "wet.h5"
    runs[0][0].save(path)
    slide(runs[0][0], 0.2)
    again, *_ = wet_block(comm, geometry, scattered)
    again.restore(path)
    slide(again, 0.2)
    for name, values in all_by_id(runs[0][0], names).items():
        np.testing.assert_array_equal(all_by_id(again, names)[name], values, err_msg=name)


def shaken_site(comm, owners_of=bands):
    """Saturated ground between free fields over an absorbing base, through which a wave comes."""
    mesh = spread_box((16, 10), (1.6, 1.0), comm, owners_of, diagonals="alternating")
    model = mpm.Model(mesh, mpm.MohrCoulomb(young=4e6, poisson=0.3, cohesion=200.0, friction_angle=25.0))
    model.seed(density=2000.0, per_cell=3)
    model.add_water(porosity=0.4, conductivity=1e-4, modulus=2.2e7)
    model.set_pore_pressure(1e3)
    model.absorb(3, thickness=20.0)
    model.absorb((1, 2), free_field=True, thickness=20.0)
    time = np.linspace(0.0, 0.05, 51)
    model.shake(mpm.Motion(time, 0.1 * np.sin(np.pi * time / 0.05) ** 2), (1.0, 0.3))
    return model


@pytest.mark.parametrize("rayleigh", [None, DAMPING], ids=["undamped", "damped"])
def test_a_shaken_site_of_two_phases_is_the_same_on_any_partition(comm, shared_path, rayleigh):
    options = {"damping": 0.0, "rayleigh": rayleigh}
    model, alone = shaken_site(comm, scattered), shaken_site(MPI.COMM_SELF)
    report, _ = slide(model, 0.06, **options), slide(alone, 0.06, **options)
    assert report.plastic_fraction > 0 and report.kinetic_energy > 0.1
    assert_same(all_by_id(model, FIELDS), all_by_id(alone, FIELDS), 1e-8)
    path = shared_path / "shaken.h5"
    model.save(path)
    slide(model, 0.08, **options)
    again = shaken_site(comm, scattered)
    again.restore(path)
    slide(again, 0.08, **options)
    for name, values in all_by_id(model, FIELDS).items():
        np.testing.assert_array_equal(all_by_id(again, FIELDS)[name], values, err_msg=name)
