"""The warning of cells at a drained boundary that are too large for the first step: settlements are off with it and right without it."""

import re
import warnings

import numpy as np
import pytest
from consolidation_cases import BASE, ELEMENTS, GRAVITY_OF_WATER, LEFT, RIGHT, TOP, Column, layer_settled
from dolfinx.mesh import compute_midpoints, meshtags
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water

CELLS = 20
WARNING = "the cells at the drained boundary"


def warned(run):
    """How many warnings of large cells something gives, and the first of them."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        run()
    texts = [str(one.message) for one in caught if WARNING in str(one.message)]
    return len(texts), texts[0] if texts else ""


def numbers(text):
    """Height of cells [m], length [m] and first step [s] of a warning."""
    found = re.search(r"are (\S+) m high, more than the sqrt\(c_v dt\) = (\S+) m .* days \((\S+) s\), or", text)
    return [float(number) for number in found.groups()]


def first_step(column, ratio):
    """The step [s] in which a part of the column consolidates over which cells have this ratio: sqrt(c_v dt) = h / ratio."""
    return column.period / (CELLS * ratio) ** 2


@ELEMENTS
@pytest.mark.parametrize("nmd", [False, True])
@pytest.mark.parametrize("ratio", [0.5, 0.95, 2.5, 4.0])
def test_settlements_are_off_where_the_warning_appears_and_right_elsewhere(element, nmd, ratio):
    """The column settles by sqrt(4 T / pi) of the whole (Terzaghi): after three steps the error of backward Euler is below 5 %."""
    if nmd and element is water.Element.TAYLOR_HOOD:
        pytest.skip("quadratic elements have no averages")
    column = Column(element, CELLS, nmd=nmd)
    dt = first_step(column, ratio)
    count, text = warned(lambda: column.model.run(5 * dt, dt, growth=1.0))
    assert count == (ratio > 1)
    fine = Column(element, 5 * CELLS, nmd=nmd, across=10)  # with the same steps, so that their error does not count
    fine.model.run(dt, dt, growth=1.0)
    coarse = Column(element, CELLS, nmd=nmd)
    coarse.model.advance(dt)
    assert (abs(coarse.settled() / fine.settled() - 1) > 0.2) == (ratio > 1)
    if ratio < 1:
        assert column.settled() == pytest.approx(layer_settled(5 * dt / column.period), rel=0.05)
    else:
        height, length, needed = numbers(text)
        assert height == pytest.approx(1 / CELLS)
        assert length == pytest.approx(height / ratio, rel=0.1) and length <= height / ratio
        assert needed == pytest.approx(dt * ratio**2, rel=0.1) and needed >= dt * ratio**2


@ELEMENTS
def test_the_warning_comes_once_and_no_more_with_the_step_that_it_names(element):
    column = Column(element, CELLS)
    dt = first_step(column, 3.0)
    count, text = warned(lambda: [column.model.run(time * dt, dt) for time in (2, 4, 8)])
    assert count == 1
    named = numbers(text)[2]
    assert warned(lambda: Column(element, CELLS).model.run(3 * named, named)) == (0, "")


def test_ground_on_which_no_load_comes_is_not_warned_of():
    column = Column(water.Element.STABILISED, CELLS, load=0.0)
    dt = first_step(column, 3.0)
    column.model.initialise(column.stress_at_rest(), column._hydrostatic)
    assert warned(lambda: column.model.run(2 * dt, dt)) == (0, "")
    column.model.load = bridge.Load(unit_weight=GRAVITY_OF_WATER, pressure={TOP: 10e3})
    assert warned(lambda: column.model.run(4 * dt, dt))[0] == 1


def test_a_boundary_that_drains_elsewhere_than_under_the_load_counts():
    column = Column(water.Element.STABILISED, CELLS, boundary=[water.Head(BASE, 1.0)])
    dt = first_step(column, 3.0)
    count, text = warned(lambda: column.model.run(2 * dt, dt))
    assert count == 1 and f"boundary {BASE}" in text


@ELEMENTS
@pytest.mark.parametrize("ratio", [0.95, 3.0])
def test_a_head_that_falls_below_the_ground_settles_it_as_a_load_does(element, ratio):
    """The strip of the ground that settles in the first step is as high as under a load: water is pumped from its base."""
    settled = {}
    for cells in (CELLS, 10 * CELLS):
        column = Column(element, cells, boundary=[water.Head(BASE, lambda t: 1.0 if t == 0 else 0.0)], load=0.0)
        dt = column.period / (CELLS * ratio) ** 2
        count, text = warned(lambda: column.model.run(dt, dt))
        settled[cells] = column.volume_lost()
        if cells == CELLS:
            assert count == (ratio > 1) and (f"boundary {BASE}" in text) == (ratio > 1)
        else:
            assert count == 0
    assert (abs(settled[CELLS] / settled[10 * CELLS] - 1) > 0.2) == (ratio > 1)


@pytest.mark.parametrize(
    "soil, count",
    [
        (water.PorousSoil((1e-8, 1e-8)), 0),
        (water.PorousSoil((1e-8, 1e-10)), 1),  # what flows along the boundary does not count
        (water.PorousSoil((1e-8, 1e-10), retention=water.VanGenuchten(1e-5, 1.5)), 0),  # it may dry
    ],
)
def test_the_conductivity_across_the_boundary_of_saturated_soil_counts(soil, count):
    domain, _, facets = bridge.box_mesh(MPI.COMM_WORLD, (0.2, 1.0), (2, CELLS))
    law = mpm.LinearElastic(young=10e6, poisson=0.3)
    supports = [bridge.roller(LEFT, (1, 0)), bridge.roller(RIGHT, (1, 0)), bridge.fixed(BASE)]
    model = water.Consolidation(
        domain, law, soil, facets, supports, [water.Head(TOP, 1.0)], bridge.Load(pressure={TOP: 10e3}),
        element=water.Element.STABILISED,
    )  # fmt: skip
    model.initialise(pore_pressure=lambda x: GRAVITY_OF_WATER * (1.0 - x[:, -1]))
    dt = 1.1 * GRAVITY_OF_WATER / (1e-8 * law.p_wave_modulus) / CELLS**2
    assert warned(lambda: model.run(2 * dt, dt))[0] == count


def test_the_warning_points_to_the_line_that_runs():
    column = Column(water.Element.STABILISED, CELLS)
    dt = first_step(column, 3.0)

    def run():
        column.model.run(dt, dt)

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        run()
    assert [(one.filename, one.lineno) for one in caught] == [(__file__, run.__code__.co_firstlineno + 1)]


@ELEMENTS
@pytest.mark.parametrize("load", [0.0, 10e3])
def test_water_that_rises_over_level_ground_is_not_warned_of_as_the_ground_does_not_settle(element, load):
    level = lambda t: 3.0 + t
    column = Column(element, CELLS, boundary=[water.Reservoir(TOP, level)], load=load)
    column.model.initialise(pore_pressure=lambda x: GRAVITY_OF_WATER * (3.0 - x[:, -1]))
    dt = first_step(column, 3.0)
    assert warned(lambda: column.model.run(dt, dt))[0] == (load > 0)
    moved = abs(column.model.displacement.x.array).max()
    assert (moved > 1e-6) if load else (moved < 1e-12)


@ELEMENTS
@pytest.mark.parametrize("duration", [None, 0.0, 1e3])
@pytest.mark.parametrize("level", [1.5, 5.0])
def test_a_reservoir_in_the_place_of_another_is_not_warned_of_but_the_load_after_it_is(element, duration, level):
    column = Column(element, CELLS, boundary=[water.Reservoir(TOP, 3.0)], load=0.0)
    column.model.initialise(pore_pressure=lambda x: GRAVITY_OF_WATER * (3.0 - x[:, -1]))
    dt = first_step(column, 3.0)
    column.model.run(dt, dt)
    column.model.boundary = [water.Reservoir(TOP, level)]
    if duration is not None:
        column.model.reconfigure(duration=duration)
    assert warned(lambda: column.model.run(2 * dt, dt)) == (0, "")
    column.model.load = bridge.Load(unit_weight=GRAVITY_OF_WATER, pressure={TOP: 10e3})
    assert warned(lambda: column.model.run(3 * dt, dt))[0] == 1


@pytest.mark.parametrize("ratio, count", [(3.0, 1), (0.95, 0)])
def test_a_run_that_ends_within_its_first_step_asks_for_no_load_beyond_and_is_judged_by_this_step(ratio, count):
    """As runs from one output to the next do while a load grows: it is not the step that is too short."""
    column = Column(water.Element.STABILISED, CELLS)
    load, dt = column.model.load, first_step(column, ratio)

    def until_the_end(time):
        assert time <= 0.01 * dt, "a load is asked for at times of its steps only"
        return load

    column.model.load = until_the_end
    assert warned(lambda: column.model.run(0.01 * dt, dt))[0] == count


@pytest.mark.parametrize("level", [float("nan"), None, "high"])
def test_a_level_that_is_none_is_refused_before_cells_are_looked_at(level):
    column = Column(water.Element.STABILISED, CELLS, boundary=[water.Head(TOP, lambda t: level if t > 0 else 1.0)])
    with warnings.catch_warnings(), pytest.raises(mpm.InputError, match="level is a function that returns"):
        warnings.simplefilter("error")
        column.model.run(2.0, 1.0)


@pytest.mark.parametrize("more", [0.0, 1e3])
def test_what_an_equilibrium_of_a_coarse_tolerance_leaves_is_no_load(more):
    domain, _, facets = bridge.box_mesh(MPI.COMM_WORLD, (4.0, 2.0), (40, 20))
    middle = compute_midpoints(domain, 1, facets.indices)
    under = meshtags(domain, 1, facets.indices, np.where((facets.values == TOP) & (middle[:, 0] < 1), 9, facets.values))
    law = mpm.MohrCoulomb(young=10e6, poisson=0.3, cohesion=1e3, friction_angle=20.0, dilation_angle=0.0)
    supports = [bridge.roller(LEFT, (1, 0)), bridge.roller(RIGHT, (1, 0)), bridge.fixed(BASE)]
    weight = 18e3 - GRAVITY_OF_WATER
    model = water.Consolidation(
        domain, law, water.PorousSoil(1e-8), under, supports, [water.Head(tag, 2.0) for tag in (TOP, 9)],
        bridge.Load(unit_weight=18e3, pressure={9: 9e3}), water.Element.STABILISED, solver=bridge.Solver(tolerance=1e-4),
    )  # fmt: skip
    at_rest = bridge.k0_stress(model.points.coordinates(), surface=2.0, unit_weight=weight, k0=0.6)
    model.initialise(at_rest, lambda x: GRAVITY_OF_WATER * (2.0 - x[:, 1]))
    short = (0.1 / 3.0) ** 2 * GRAVITY_OF_WATER / (1e-8 * law.p_wave_modulus)
    assert warned(lambda: model.run(200 * short, 50 * short)) == (0, "")
    model.load = bridge.Load(unit_weight=18e3, pressure={9: 9e3 + more})
    assert warned(lambda: model.run(201 * short, short))[0] == (more > 0)


@pytest.mark.parametrize("carries, count", [(0.0, 0), (20e3, 1)])
def test_soil_without_a_stiffness_before_its_first_load_is_left_out(carries, count):
    """The stiffness of clay is that of its pressure: of one that carries nothing no length of consolidation is known."""
    domain, _, facets = bridge.box_mesh(MPI.COMM_WORLD, (1.0, 1.0), (5, 5))
    clay = mpm.CamClay(
        compression=0.2, swelling=0.04, critical_slope=1.0, poisson=0.3, void_ratio=1.0, preconsolidation=100e3
    )
    supports = [bridge.roller(LEFT, (1, 0)), bridge.roller(RIGHT, (1, 0)), bridge.fixed(BASE)]
    model = water.Consolidation(
        domain, clay, water.PorousSoil(1e-8), facets, supports, [water.Head(TOP, 0.0)],
        bridge.Load(pressure={TOP: carries + 1e3}), element=water.Element.STABILISED,
    )  # fmt: skip
    model.initialise(-carries * np.repeat([[1.0, 1.0, 1.0, 0.0]], len(model.points.stress), axis=0))
    assert warned(lambda: model.run(1.0, 1.0))[0] == count
