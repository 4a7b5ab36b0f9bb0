"""Factors of safety are the same on 1, 2 and 3 ranks, by finite elements without dilation and by particles."""

import warnings

import numpy as np
import pytest
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

COMM = MPI.COMM_WORLD
SUPPORTS = [bridge.roller(bridge.LEFT, (1, 0)), bridge.fixed(bridge.BASE)]
LOAM = mpm.MohrCoulomb(young=20e6, poisson=0.33, cohesion=1e3, friction_angle=25.0)


def slope(comm):
    return bridge.slope_mesh(comm, crest=1.0, cell_size=0.5)


def by_particles(comm, geometry, gravity=9.81, start=0.7):
    background = bridge.background_mesh(*slope(comm))

    def weakened(factor):
        model = mpm.Model(background, bridge.reduced_strength(LOAM, factor), geometry=geometry)
        model.seed(density=20e3 / 9.81, per_cell=3, cell_tag=bridge.SOIL)
        bridge.apply_supports(model, SUPPORTS)
        model.set_gravity((0.0, -gravity))
        return model

    return bridge.particle_safety(weakened, start=start, first_step=0.2, tolerance=0.05)


@pytest.mark.parametrize("geometry", [None, mpm.Geometry.AXISYMMETRIC])
def test_particles_have_the_same_factor_on_all_numbers_of_ranks(geometry):
    together, alone = by_particles(COMM, geometry), by_particles(MPI.COMM_SELF, geometry)
    assert together.failed and (together.value, together.failed_at) == (alone.value, alone.failed_at)
    assert np.allclose(together.curve, alone.curve, rtol=1e-6)


def test_what_is_wrong_with_particles_is_said_on_all_ranks():
    for options, words in (({"start": 3.0}, "start: .*do not come to rest"), ({"gravity": 0.0}, "without gravity")):
        with pytest.raises(bridge.InputError, match=words) as error:
            by_particles(COMM, None, **options)
        assert len(set(COMM.allgather(str(error.value)))) == 1


@pytest.mark.parametrize(("nmd", "solver"), [(False, None), (True, None), (False, bridge.PRACTICE)])
def test_relaxed_elements_have_the_same_factor_on_all_numbers_of_ranks(nmd, solver):
    def found(comm):
        body, _, facet_tags = bridge.soil_mesh(*slope(comm))
        fem = bridge.QuasiStatic(body, LOAM, facet_tags, SUPPORTS, degree=1, nmd=nmd, solver=solver)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            result = bridge.factor_of_safety(fem, bridge.Load(unit_weight=20e3), first_step=0.2)
        texts = [str(each.message) for each in caught if "cells high" in str(each.message)]
        return result, texts

    (together, told), (alone, told_alone) = found(COMM), found(MPI.COMM_SELF)
    assert any(step.report.relaxation for step in together.steps)
    assert together.failed and together.value == pytest.approx(alone.value, rel=2e-3)
    assert together.missing == pytest.approx(alone.missing, rel=1e-3)
    # Two cells are few for averages, which the first rank says of the whole mechanism.
    assert len(told_alone) == nmd and told == (told_alone if COMM.rank == 0 else [])
