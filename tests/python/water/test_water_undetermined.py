"""Steady seepage whose boundary conditions determine no pressure is refused; where they do without a head, it is found."""

import numpy as np
import pytest
from mpi4py import MPI

import fenics_bridge as bridge
from fenics_bridge import water
from mpm_core import InputError

LEFT, RIGHT, BASE, TOP = 1, 2, 3, 4
LOAM = water.PorousSoil(1e-6, retention=water.VanGenuchten(1e-4, 2.0))


def flow(*boundary, soil=LOAM):
    domain, _, tags = bridge.box_mesh(MPI.COMM_WORLD, (1.0, 2.0), (4, 8))
    return water.Seepage(domain, soil, tags, boundary)


@pytest.mark.parametrize(
    "boundary, words",
    [
        ([], "water can leave nowhere"),
        ([water.Flux(TOP, 1e-8)], "water can leave nowhere"),
        ([water.Reservoir(TOP, 1.0)], "add up to 0 m3/s"),
        ([water.Reservoir(LEFT, -3.0), water.Reservoir(RIGHT, -3.0)], "add up to 0 m3/s"),
        ([water.SeepageFace(TOP)], "add up to 0 m3/s"),
        ([water.Rain(TOP, 0.0)], "add up to 0 m3/s"),
        ([water.SeepageFace(LEFT), water.Flux(TOP, 1e-8), water.Flux(BASE, -1e-8)], "expected water that has to leave"),
        ([water.SeepageFace(LEFT), water.Flux(BASE, -1e-8)], "add up to -1e-08 m3/s"),
    ],
)
@pytest.mark.parametrize("soil", [water.PorousSoil(1e-6), LOAM])
def test_what_is_undetermined_is_refused(boundary, words, soil):
    with pytest.raises(InputError, match=f"steady pressure is undetermined: no head is prescribed.*{words}"):
        flow(*boundary, soil=soil).solve()


@pytest.mark.parametrize("rate", [1e-9, 1e-8, 1e-5])
def test_rain_on_an_impervious_box_fills_it_and_runs_off(rate):
    full = flow(water.Rain(TOP, rate, ponding=0.1))
    full.solve()
    z = full.pressure_head.function_space.tabulate_dof_coordinates()[:, 1]
    assert full.pressure_head.x.array == pytest.approx(2.0 + 0.1 - z, abs=1e-9)  # at rest, up to the pond
    assert full.inflow(TOP) == pytest.approx(0.0, abs=1e-12 * rate)


@pytest.mark.parametrize("face", [water.SeepageFace(TOP), water.Reservoir(TOP, 1.0)])
def test_water_that_enters_below_leaves_at_the_surface(face):
    # Saturated upward flow by Darcy: the head rises from 2 m at the surface by q / k for each metre downwards.
    rising = flow(face, water.Flux(BASE, 1e-7))
    rising.solve()
    z = rising.pressure_head.function_space.tabulate_dof_coordinates()[:, 1]
    assert rising.pressure_head.x.array == pytest.approx((2.0 - z) * (1 + 0.1), abs=1e-9)
    assert rising.inflow(TOP) == pytest.approx(-1e-7, rel=1e-9)


def test_a_level_at_the_lowest_facets_determines_the_pressure():
    still = flow(water.Reservoir(LEFT, 0.5))
    still.solve()
    z = still.pressure_head.function_space.tabulate_dof_coordinates()[:, 1]
    assert still.pressure_head.x.array == pytest.approx(0.5 - z, abs=1e-9)
    assert np.abs(still.inflow(LEFT)) < 1e-15
