"""Consolidation by coupled finite elements against closed forms, its balance of water, and pressures that do not oscillate."""

from pathlib import Path

import numpy as np
import pytest
from consolidation_cases import (
    ELEMENTS,
    GRAVITY_OF_WATER,
    TOP,
    Column,
    layer_excess,
    layer_settled,
)
from mpi4py import MPI
from mpm_core.newton import NewtonReport

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water
from fenics_bridge.water.consolidation_step import accepted

AVERAGED = pytest.mark.parametrize("nmd", [False, True], ids=["", "nmd"])
MESHES = Path(__file__).resolve().parents[3] / "meshes"


# --- a layer under a load (Terzaghi) ---------------------------------------------------------------------------------


@ELEMENTS
def test_a_layer_settles_and_its_excess_pressure_falls_as_terzaghi_says(element):
    column = Column(element, cells=30)
    column.model.run(0.02 * column.period, 1e-4 * column.period, growth=1.1)
    for factor in (0.05, 0.1, 0.2, 0.5):
        column.model.run(factor * column.period, 5e-3 * column.period, growth=1.0)
        assert column.settled() == pytest.approx(layer_settled(factor), abs=6e-3)
        height = np.array([0.0, 0.3, 0.7])
        assert column.excess(height) == pytest.approx(layer_excess(height, factor), abs=1e-2)


@ELEMENTS
def test_the_error_falls_with_the_step_as_eulers_does(element):
    found = []
    for n in (20, 40, 80):
        column = Column(element, cells=20)
        column.model.run(0.5 * column.period, 0.5 / n * column.period, growth=1.0)
        found.append(column.excess(np.array([0.0]))[0])
    exact = layer_excess(np.array([0.0]), 0.5)[0]
    assert (found[0] - found[1]) / (found[1] - found[2]) == pytest.approx(2.0, abs=0.1)
    assert 2 * found[2] - found[1] == pytest.approx(exact, abs=1e-3)


@ELEMENTS
@pytest.mark.parametrize("modulus", [0.22e9, 2.2e9])
def test_water_and_soil_share_a_load_by_their_stiffness_before_any_flows(element, modulus):
    # p / q = (K_w / n) / (K_w / n + E_oed), the same everywhere while nothing drains
    column = Column(element, cells=4, boundary=[], water_modulus=modulus)
    assert column.model.advance(1.0).converged
    by_water = modulus / column.porosity
    excess = column.excess(np.linspace(0.0, 1.0, 5))
    assert excess == pytest.approx(np.full(5, by_water / (by_water + column.oedometer)), rel=1e-8)


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.45])
@pytest.mark.parametrize(  # in the plane also two, four and eight times as long as high, in space twice
    "dim, cells, across", [(2, 12, 2), (2, 20, 2), (2, 40, 8), (2, 40, 2), (2, 40, 1), (3, 12, 2), (3, 20, 2)]
)
@AVERAGED
def test_stabilised_elements_do_not_overshoot_in_the_first_step(dim, cells, across, poisson, nmd):
    column = Column(water.Element.STABILISED, cells, dim, poisson=poisson, nmd=nmd, across=across)
    for ratio in (1e-6, 1e-2, 0.1, 0.25, 0.5, 1.0, 10.0):
        column.start_again()
        column.model.advance(ratio * column.period / cells**2)
        assert column.nodal_excess().max() <= 1 + 1e-6
        assert column.nodal_excess().min() >= -1e-6


@ELEMENTS
def test_water_enters_at_the_level_of_a_reservoir_whatever_rounding_makes_of_the_heights(element):
    # Soil that is relieved swells. Above the level water could leave only.
    column = Column(element, cells=12, load=-10e3, boundary=[water.Reservoir(TOP, np.nextafter(1.0, 0.0))])
    column.model.run(0.2 * column.period, 1e-3 * column.period, growth=1.05)
    assert column.settled() == pytest.approx(layer_settled(0.2), abs=0.01)


RECTANGLE = """Point(1) = {0, 0, 0, 0.1}; Point(2) = {0.5, 0, 0, 0.1}; Point(3) = {0.5, 1, 0, 0.1}; Point(4) = {0, 1, 0, 0.1};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 1}; Curve Loop(1) = {1, 2, 3, 4}; Plane Surface(1) = {1};
Physical Surface("soil") = {1};
Physical Curve("base") = {1};
Physical Curve("sides_x") = {2, 4};
Physical Curve("top") = {3};
"""


@pytest.mark.parametrize("ratio", [1e-6, 1e-2, 0.2, 1.0])
@pytest.mark.parametrize("dim", [2, 3])
@AVERAGED
def test_nor_do_they_on_unstructured_meshes(dim, ratio, nmd, tmp_path):
    (tmp_path / "rectangle.geo").write_text(RECTANGLE)
    path, size = (tmp_path / "rectangle.geo", 0.1) if dim == 2 else (MESHES / "column.geo", 0.2)
    domain, _, facet_tags = bridge.read_mesh(path, MPI.COMM_WORLD, dim, {"cell_size": size} if dim == 3 else None)
    axes = np.eye(dim)
    supports = [bridge.fixed("base"), bridge.roller("sides_x", axes[0])]
    supports += [bridge.roller("sides_y", axes[1])] if dim == 3 else []
    soil = mpm.LinearElastic(young=10e6, poisson=0.3)
    mobility, weight, load = 1e-12, 1e-3, 10e3  # of water with next to no weight
    model = water.Consolidation(
        domain, soil, water.PorousSoil(mobility * weight), facet_tags, supports, [water.Head("top", 1.0)], unit_weight=weight,
        load=bridge.Load(pressure={"top": load}), element=water.Element.STABILISED, nmd=nmd, water_modulus=np.inf,
    )  # fmt: skip
    model.advance(ratio * size**2 / (mobility * soil.p_wave_modulus))
    assert model.pressure.x.array.max() < 1.02 * load
    assert model.pressure.x.array.min() > -0.02 * load


def test_elements_of_equal_order_overshoot_without_the_projection(monkeypatch):
    # In uniaxial strain the first node below a drained surface takes 2 q, as p / 4 [1 1; 1 1] of a layer says.
    monkeypatch.setattr(water.projection, "MARGIN", 0)
    column = Column(water.Element.STABILISED, cells=12)
    column.model.advance(1e-6 * column.period / 12**2)
    assert column.nodal_excess().max() > 1.5


@ELEMENTS
def test_the_water_that_leaves_is_the_settlement(element):
    column = Column(element, cells=10)
    left = 0.0
    for dt in (1e-3, 1e-2, 1e-1, 1.0):
        report = column.model.advance(dt * column.period)
        assert abs(report.water_error) <= 1e-10 * column.width * column.settlement
        left -= dt * column.period * column.model.inflow(TOP)
        assert left == pytest.approx(column.volume_lost(), rel=1e-9)
        assert report.iterations == 1  # of a linear problem


@ELEMENTS
def test_water_that_is_pressed_in_lifts_the_surface_by_its_volume(element):
    # Incompressible water and soil: what enters at the sealed surface makes room for itself.
    column = Column(element, cells=4, boundary=[water.Flux(TOP, 1e-7)], load=0.0)
    assert column.model.advance(1000.0).converged
    assert column.volume_lost() == pytest.approx(-1e-4 * column.width, rel=1e-9)


# --- soil under its own weight ---------------------------------------------------------------------------------------


@ELEMENTS
def test_fresh_fill_consolidates_under_its_own_weight(element):
    # All of the buoyant weight is carried by water at first, u0 = gamma' (H - y). In multiples of gamma' H the excess at the
    # base is a series in cos(m y), from u_t = c_v u_yy, u_y = 0 at the base, u = 0 on top.
    column = Column(element, cells=30, load=0.0, buoyant=10e3)
    column.model.run(0.02 * column.period, 1e-4 * column.period, growth=1.1)
    for factor in (0.1, 0.2, 0.5):
        column.model.run(factor * column.period, 5e-3 * column.period, growth=1.0)
        k = np.arange(200)
        m = np.pi * (2 * k + 1) / 2
        # coefficients of 1 - y in cos(m y): 2 int_0^1 (1 - y) cos(m y) dy = 2 (1 - cos m) / m^2 = 2 / m^2
        base = np.sum(2 / m**2 * np.exp(-(m**2) * factor))
        settled = 1 - np.sum(2 / m**2 * (np.sin(m) / m) * np.exp(-(m**2) * factor)) / 0.5
        assert column.excess(np.array([0.0]))[0] == pytest.approx(base, abs=1e-2)
        assert column.settled() == pytest.approx(settled, abs=1e-2)


# --- water levels ----------------------------------------------------------------------------------------------------


@ELEMENTS
@pytest.mark.parametrize("conductivity", [1e-4, 1e-12])
def test_drawdown_over_level_ground_changes_no_effective_stress(element, conductivity):
    # The water presses on the ground and in its pores alike.
    level = [(0.0, 6.0), (1000.0, 1.5)]
    column = Column(
        element, cells=6, boundary=[water.Reservoir(TOP, level)], load=0.0, buoyant=10e3, conductivity=conductivity
    )
    buoyant_at_rest(column)
    for _ in range(5):
        assert column.model.advance(400.0).converged
    assert np.abs(column.model.displacement.x.array).max() <= 1e-9 * column.settlement
    assert column.model.points.stress == pytest.approx(column.stress_at_rest(), abs=1e-6)
    base = column.model.evaluate_at(np.array([column.base]))["pressure"][0, 0]
    assert base == pytest.approx(GRAVITY_OF_WATER * 1.5, rel=1e-9)


def buoyant_at_rest(column):
    """Start with the effective stresses of the buoyant weight under hydrostatic pressure below a level of 6 m."""
    column.model.initialise(column.stress_at_rest(), lambda x: GRAVITY_OF_WATER * (6.0 - x[:, -1]))


@pytest.mark.parametrize("last, solver, taken", [
    (3e-8, bridge.Solver(), True),
    (9e-6, bridge.Solver(), True),
    (2e-5, bridge.Solver(), False),
    (np.inf, bridge.Solver(), False),
    (3e-8, bridge.Solver(relaxation=False), False),
    (9e-6, bridge.Solver(relaxed_tolerance=1e-6), False),
])  # fmt: skip
def test_forces_that_newton_brings_no_further_are_balanced_up_to_the_tolerance_of_relaxations(last, solver, taken):
    given = NewtonReport(False, [1.0, 1e-7, last], "residual after 25 iterations")
    report = accepted(given, solver)
    assert report.converged is taken and (report.reason == "") is taken and report.residuals == given.residuals
