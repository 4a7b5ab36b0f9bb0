"""Runs that are the same to the last bit on any number of ranks, however the mesh is partitioned."""

import numpy as np
import pytest
from mpi4py import MPI
from partitions import FIELDS, all_by_id, bands, scattered, sliding_slope, spread_box

import fenics_bridge as bridge
import mpm_core as mpm


def assert_identical(one, other):
    for name, values in other.items():
        np.testing.assert_array_equal(one[name], values, err_msg=name)


@pytest.mark.parametrize("owners_of", [bands, scattered])
@pytest.mark.parametrize(
    "options",
    [
        {},
        {"integration": mpm.Integration.MIXED},
        {"nmd": True},
        {"integration": mpm.Integration.MIXED, "nmd": True, "damping": 0.3, "pic": 0.01},
    ],
)
def test_a_slide_is_the_same_to_the_last_bit(comm, owners_of, options):
    models = sliding_slope(comm, owners_of), sliding_slope(MPI.COMM_SELF)
    for model in models:
        model.traction(3, (0.0, 10.0))
        model.explicit(until=0.5, reproducible=True, **options).last()
    spread, alone = (all_by_id(model, (*FIELDS, "traction")) for model in models)
    assert np.abs(alone["displacement"]).max() > 0.2  # further than a cell
    assert_identical(spread, alone)


CLAY = mpm.tresca(young=4e6, poisson=0.45, shear_strength=1.5e3)
RESIDUAL = dict(residual_cohesion=300.0, residual_friction_angle=0.0, softening_strain=0.1, reference_length=0.1)


@pytest.mark.parametrize(
    "law",
    [
        CLAY,
        mpm.SofteningMohrCoulomb(CLAY, **RESIDUAL),
        mpm.Hencky(CLAY),
        mpm.DruckerPrager(young=4e6, poisson=0.3, strength=1.2e3, friction=0.5),
    ],
    ids=["clay", "softening", "hencky", "drucker-prager"],
)
def test_other_laws_are_the_same_to_the_last_bit(comm, law):
    models = [sliding_slope(of, scattered, laws=law) for of in (comm, MPI.COMM_SELF)]
    for model in models:
        model.explicit(until=0.3, reproducible=True, nmd=True, integration=mpm.Integration.MIXED).last()
    assert_identical(*map(all_by_id, models))


def test_soils_that_are_averaged_apart_are_the_same_to_the_last_bit(comm):
    models = [
        sliding_slope(of, scattered, laws=[CLAY, mpm.LinearElastic(young=20e6, poisson=0.3)])
        for of in (comm, MPI.COMM_SELF)
    ]
    for model in models:
        model.assign((model.particles.position[:, 1] < 0.15).astype(np.int32))  # the boundary is within cells
        model.explicit(until=0.3, reproducible=True, nmd=True, integration=mpm.Integration.MIXED).last()
    assert_identical(*map(all_by_id, models))


def test_a_heap_in_space_is_the_same_to_the_last_bit_though_it_is_rebalanced(comm):
    models = []
    for of in (comm, MPI.COMM_SELF):
        mesh = spread_box((8, 3, 4), (0.8, 0.3, 0.4), of, body=((0, 0, 0), (0.3, 0.3, 0.3)))
        model = mpm.Model(mesh, mpm.MohrCoulomb(young=1e6, poisson=0.3, cohesion=100.0, friction_angle=30.0))
        model.seed(density=2000.0, per_cell=4, cell_tag=1)
        for wall, normal in ((1, (1, 0, 0)), (3, (0, 1, 0)), (4, (0, 1, 0)), (5, (0, 0, 1))):
            model.roller(wall, normal)
        model.set_gravity((5.0, 0.0, -8.5))
        model.explicit(until=0.15, reproducible=True, integration=mpm.Integration.MIXED, rebalance=1.2).last()
        models.append(model)
    assert np.abs(models[1].particles.displacement).max() > 0.02
    assert_identical(*map(all_by_id, models))


def test_an_axisymmetric_slump_is_the_same_to_the_last_bit(comm):
    soil = mpm.MohrCoulomb(young=1e6, poisson=0.3, cohesion=200.0, friction_angle=20.0)
    models = []
    for of, owners_of in ((comm, scattered), (MPI.COMM_SELF, bands)):
        mesh = spread_box((12, 8), (1.5, 1.0), of, owners_of, body=((-1.0, -1.0), (0.75, 0.75)))
        model = mpm.Model(mesh, soil, geometry=mpm.Geometry.AXISYMMETRIC)
        model.seed(density=2000.0, per_cell=6, cell_tag=1)
        model.fix(3)
        model.set_gravity((0.0, -9.81))
        model.explicit(0.2, reproducible=True, nmd=True, integration=mpm.Integration.MIXED).last()
        models.append(model)
    assert models[1].particles.displacement[:, 0].max() > 0.02
    assert_identical(*map(all_by_id, models))


def test_a_slope_on_a_mesh_of_dolfinx_is_the_same_to_the_last_bit(comm):
    models = []
    for of in (comm, MPI.COMM_SELF):
        tagged = bridge.slope_mesh(of, height=1.0, angle=45.0, crest=1.1, cell_size=0.1)
        soil = mpm.MohrCoulomb(young=200e3, poisson=0.33, cohesion=1e3, friction_angle=25.0)
        model = mpm.Model(bridge.background_mesh(*tagged), soil)
        model.seed(density=80e3 / 9.81, per_cell=6, cell_tag=bridge.SOIL)
        model.roller(bridge.LEFT, normal=(1, 0))
        model.fix(bridge.BASE)
        model.set_gravity((0.0, -9.81))
        model.explicit(until=0.6, reproducible=True, damping=0.75).last()
        models.append(model)
    assert_identical(*map(all_by_id, models))


def test_what_reproducible_runs_do_not_cover_is_refused(comm):
    for options, named in (
        ({"integration": mpm.Integration.DUAL_DOMAIN}, "DUAL_DOMAIN"),
        ({"stress_update": mpm.StressUpdate.FIRST}, "FIRST"),
        ({"stress_update": mpm.StressUpdate.LAST}, "LAST"),
        ({"rayleigh": mpm.Rayleigh(mass=1.0)}, "rayleigh"),
    ):
        with pytest.raises(mpm.InputError, match=f"reproducible is True with .*{named}"):
            sliding_slope(comm).explicit(until=0.1, reproducible=True, **options).last()
