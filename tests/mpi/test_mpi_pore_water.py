"""Soil and pore water coupled on several ranks: the same as on one, and restarts to the last bit."""

import numpy as np
import pytest
from mpi4py import MPI
from partitions import all_by_id, assert_same, bands, one_does_all, scattered, sliding_slope
from petsc4py import PETSc

import mpm_core as mpm
from fenics_bridge.water import VanGenuchten

FIELDS = (
    "position",
    "velocity",
    "stress",
    "volume",
    "state",
    "pore_pressure",
    "pressure_gradient",
    "porosity",
    "conductivity",
)


def wet_slope(comm, owners_of=bands, dries=False):
    """A block that slides on an incline, whose water drains at its free surface and at its left side.

    Where it dries, rain falls on it, and the level of water that stands before it falls.
    """
    model = sliding_slope(comm, owners_of)
    model.add_water(porosity=0.4, conductivity=1e-4, modulus=2.2e8, kozeny_carman=True, drained_surface=True,
                    retention=VanGenuchten(alpha=4e-4, n=2.0) if dries else None)  # fmt: skip
    model.set_pore_pressure(lambda x: 9810.0 * (0.4 - x[:, 1]))
    model.hold_pore_pressure(1, level=0.3)
    if dries:
        model.rain(1e-5)
        model.stand_water([(0.0, 0.3), (0.1, 0.2)])
    return model


def slide(model, until=0.1):
    *_, report = model.implicit(until, dt=0.02, every=0.02, since=0.0)
    return report


@pytest.mark.parametrize("dries", [False, True], ids=["saturated", "dries"])
@pytest.mark.parametrize("owners_of", [bands, scattered, one_does_all])
def test_a_wet_slide_is_the_same_on_any_partition(comm, owners_of, dries):
    model, alone = wet_slope(comm, owners_of, dries), wet_slope(MPI.COMM_SELF, dries=dries)
    report, expected = slide(model), slide(alone)
    assert report.iterations == expected.iterations and report.plastic_fraction > 0
    assert_same(all_by_id(model, FIELDS), all_by_id(alone, FIELDS), 1e-10)
    assert model.water_inflow() == pytest.approx(alone.water_inflow(), rel=1e-10)
    assert model.water_inflow() != 0
    for name in ("external_work", "drag_work", "stress_work", "stored_energy", "unexplained_energy"):
        assert getattr(report, name) == pytest.approx(getattr(expected, name), rel=1e-8), name
    assert report.drag_work > 0


def consolidating_bank(comm, owners_of=bands):
    """Soft soil on a rough base that settles and spreads while its water leaves at the free surface."""
    soil = mpm.MohrCoulomb(young=3e5, poisson=0.3, cohesion=2.5e3, friction_angle=25.0, dilation_angle=0.0)
    model = sliding_slope(comm, owners_of, laws=soil)
    model.fix(3)
    model.set_gravity((0.0, -9.81))
    model.add_water(porosity=0.5, conductivity=1e-7, modulus=np.inf, kozeny_carman=True, drained_surface=True)
    return model


@pytest.mark.parametrize("nmd", [False, True])
@pytest.mark.parametrize("owners_of", [scattered, one_does_all])
def test_a_bank_consolidates_alike_on_any_partition(comm, owners_of, nmd):
    model, alone = consolidating_bank(comm, owners_of), consolidating_bank(MPI.COMM_SELF)
    for time in (2e3, 8e3):
        report, expected = (
            one.implicit(time, dt=time / 4, quasi_static=True, nmd=nmd).last() for one in (model, alone)
        )
        assert report.iterations == expected.iterations
        assert_same(all_by_id(model, FIELDS), all_by_id(alone, FIELDS), 1e-10)
    assert alone.water_inflow() < -1e-3 * alone.water_volume()
    assert model.water_inflow() == pytest.approx(alone.water_inflow(), rel=1e-10)


@pytest.mark.parametrize("owners_of", [scattered, one_does_all])
def test_the_field_split_works_on_any_partition(comm, owners_of):
    """Also where ranks have no nodes; it ends at the tolerance of Newton's method."""
    options = PETSc.Options("split_")
    options["pc_type"] = "fieldsplit"
    model, alone = consolidating_bank(comm, owners_of), consolidating_bank(MPI.COMM_SELF)
    list(model.implicit(4e3, dt=1e3, quasi_static=True, solver=mpm.Newton(tolerance=1e-10, prefix="split_")))
    list(alone.implicit(4e3, dt=1e3, quasi_static=True, solver=mpm.Newton(tolerance=1e-10)))
    options.delValue("pc_type")
    assert_same(all_by_id(model, FIELDS), all_by_id(alone, FIELDS), 1e-6)


def test_a_restart_is_the_run_that_never_stopped(comm, tmp_path):
    path = comm.bcast(str(tmp_path / "wet.h5"))
    model = wet_slope(comm)
    slide(model, 0.04)
    model.save(path)
    slide(model)
    again = wet_slope(comm)
    again.hold_pore_pressure(2, 0.0)
    again.restore(path)
    assert again._water_conditions == model._water_conditions
    slide(again)
    for name, values in all_by_id(model, FIELDS).items():
        np.testing.assert_array_equal(all_by_id(again, FIELDS)[name], values, err_msg=name)
    assert again.water_inflow() == model.water_inflow()


def test_repartition_keeps_the_conditions_of_the_water(comm):
    model, alone = wet_slope(comm), wet_slope(MPI.COMM_SELF)
    slide(model, 0.04)
    model.rebalance()
    slide(model), slide(alone, 0.04), slide(alone)
    assert_same(all_by_id(model, FIELDS), all_by_id(alone, FIELDS), 1e-10)


def test_mistakes_of_one_rank_are_errors_on_all(comm):
    model = wet_slope(comm)
    with pytest.raises(mpm.InputError, match="porosity is 2.0"):
        model.add_water(porosity=lambda x: np.full(len(x), 2.0), conductivity=1e-6)
    model.particles.set("conductivity", np.full(len(model.particles), -1.0 if comm.rank == 0 else 1e-6))
    if comm.allreduce(len(model.particles) if comm.rank == 0 else 0):
        with pytest.raises(mpm.InputError, match="conductivity is -1.0"):
            slide(model)
