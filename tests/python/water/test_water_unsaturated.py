"""Coupled deformation and flow of soil that dries: flow in stiff soil, effective stresses, weight and balance of the water."""

import numpy as np
import pytest
from consolidation_cases import BASE, GRAVITY_OF_WATER, LEFT, RIGHT, TOP
from dolfinx.mesh import compute_midpoints, meshtags
from mpi4py import MPI
from scipy.optimize import brentq

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water
from fenics_bridge.mesh.tagged import tag_values

comm = MPI.COMM_WORLD
ELEMENTS = pytest.mark.parametrize("element", list(water.Element))
CURVE = water.VanGenuchten(alpha=4e-4, n=2.0, residual=0.1)
GEOMETRIES = pytest.mark.parametrize("geometry", [None, bridge.Geometry.AXISYMMETRIC], ids=["plane", "axisymmetric"])
POROSITY, WEIGHT, CONDUCTIVITY = 0.4, 19e3, 1e-5


def column(element, young, curve=CURVE, boundary=None, n=20, dim=2, geometry=None):
    """A column 1 m high, saturated at rest under water at its surface, that drains at its base from then on; about its left side
    in axial symmetry."""
    domain, _, facet_tags = bridge.box_mesh(comm, [0.2] * (dim - 1) + [1.0], [2] * (dim - 1) + [n])
    held = [bridge.roller(2 * axis + end, np.eye(dim)[axis]) for axis in range(dim - 1) for end in (1, 2)]
    base = 2 * dim - 1
    soil = mpm.LinearElastic(young=young, poisson=0.3)
    model = water.Consolidation(
        domain, soil, water.PorousSoil(CONDUCTIVITY, porosity=POROSITY, retention=curve), facet_tags,
        [*held, bridge.fixed(base)], boundary or [water.Head(base, 0.0)], load=bridge.Load(unit_weight=WEIGHT), element=element,
        geometry=geometry,
    )  # fmt: skip
    depth = 1.0 - model.points.coordinates()[:, -1]
    stress = np.zeros((len(depth), 4 if dim == 2 else 6))
    stress[:, :3] = (
        -(WEIGHT - GRAVITY_OF_WATER) * depth[:, None] * np.array([3 / 7, 1, 3 / 7] if dim == 2 else [3 / 7, 3 / 7, 1])
    )
    model.initialise(stress, lambda x: GRAVITY_OF_WATER * (1.0 - x[:, -1]))
    return model


@ELEMENTS
@GEOMETRIES
def test_in_stiff_soil_the_flow_is_that_of_seepage(element, geometry):
    model = column(element, 1e14, geometry=geometry)
    flow = water.Seepage(model.domain, water.PorousSoil(CONDUCTIVITY, porosity=POROSITY, retention=CURVE), model._facet_tags,
                         [water.Head(BASE, 0.0)], geometry=geometry)  # fmt: skip
    flow.pressure_head.interpolate(lambda x: 1.0 - x[1])
    for dt in (50.0, 100.0, 400.0, 2e3, 1e4):
        assert model.advance(dt).converged and flow.advance(dt)
        found = model.pressure.x.array
        expected = GRAVITY_OF_WATER * flow.pressure_head.x.array
        np.testing.assert_allclose(found, expected, atol=2e-3 * np.abs(expected).max())
        assert model.inflow(BASE) == pytest.approx(flow.inflow(BASE), rel=3e-3)
    assert found.min() < -0.25 * GRAVITY_OF_WATER


@ELEMENTS
@pytest.mark.parametrize(
    ("dim", "geometry"), [(2, None), (3, None), (2, bridge.Geometry.AXISYMMETRIC)], ids=["2", "3", "axisymmetric"]
)
def test_a_drained_column_carries_its_weight_by_suction_and_soil(element, dim, geometry):
    """In the end the water hangs from the water table at the base, p = -gamma_w z; above z lies the weight of soil without the
    water that has left, and sigma'_v = sigma_v + S_e p. Settlements are those of the change of effective stress."""
    model = column(element, 5e6, n=16 if dim == 2 else 10, dim=dim, geometry=geometry)
    for _ in range(4):
        report = model.run(model.time + 1e8, 100.0, growth=3.0)[-1]
        assert report.converged and report.iterations <= 6
    z = np.linspace(0, 1, 2001)
    lost = POROSITY * (1 - CURVE.saturation(GRAVITY_OF_WATER * z)) * GRAVITY_OF_WATER
    above = np.concatenate([[0], np.cumsum(0.5 * (lost[1:] + lost[:-1]) * np.diff(z))])
    total = -(WEIGHT * (1 - z) - (above[-1] - above))
    effective = total - CURVE.effective(GRAVITY_OF_WATER * z) * GRAVITY_OF_WATER * z
    x = model.points.coordinates()[:, -1]
    found = model.points.stress[:, dim - 1 if dim == 3 else 1]
    inside = (x > 0.15) & (x < 0.85)
    np.testing.assert_allclose(found[inside], np.interp(x[inside], z, effective), atol=0.03 * np.abs(effective).max())
    change = effective + (WEIGHT - GRAVITY_OF_WATER) * (1 - z)
    settled = np.sum(0.5 * (change[1:] + change[:-1]) * np.diff(z)) / model.laws[0].p_wave_modulus
    there = model.evaluate_at(np.array([[0.1] * (dim - 1) + [1.0]]))
    assert there["displacement"][0, -1] == pytest.approx(settled, rel=0.02)
    assert there["pressure"][0, 0] == pytest.approx(-GRAVITY_OF_WATER, rel=1e-3)


@ELEMENTS
@GEOMETRIES
def test_water_that_leaves_is_water_that_was_stored(element, geometry):
    model = column(element, 1e6, geometry=geometry)
    before = model.stored_water()
    reports = model.run(2e4, 10.0, growth=1.4)
    assert reports[-1].converged
    assert max(abs(report.water_error) for report in reports) < 1e-10 * before
    assert max(report.iterations for report in reports) <= 8
    assert model.stored_water() < 0.9 * before


@ELEMENTS
def test_rain_seeps_to_the_water_table_as_gardner_has_it(element):
    """Steadily, k_r = e^(alpha psi): alpha psi = ln(r + (1 - r) e^(-alpha z)), r the rain over the conductivity (Srivastava and
    Yeh 1991)."""
    part, alpha = 0.5, 2.0  # -, 1/m
    curve = water.Gardner(alpha / GRAVITY_OF_WATER)
    boundary = [water.Head(BASE, 0.0), water.Flux(TOP, part * CONDUCTIVITY)]
    model = column(element, 5e6, curve, boundary, n=40)
    for _ in range(4):
        assert model.run(model.time + 1e7, 100.0, growth=3.0)[-1].converged
    z = np.array([0.25, 0.5, 1.0])
    psi = model.evaluate_at(np.column_stack([np.full(3, 0.1), z]))["pressure"][:, 0] / GRAVITY_OF_WATER
    np.testing.assert_allclose(alpha * psi, np.log(part + (1 - part) * np.exp(-alpha * z)), atol=2e-3)


SAND = water.VanGenuchten(alpha=14.5 / GRAVITY_OF_WATER, n=2.68, residual=0.1)
"""Retention of sand (Carsel and Parrish 1988)"""


def green_and_ampt(curve, dry, time):
    """Water [m] that enters soil under ponded water in a time [s]: t k / d = z - f ln(1 + z / f), of which d z has entered (Green and Ampt 1911).

    The head f [m] that draws the front is the integral of k_r over the suction (Neuman 1976); d is what the pores lack at the suction of the dry
    soil [Pa].
    """
    suction = np.linspace(0.0, 5e4, 50001)
    relative = curve.relative_permeability(suction)
    front = np.sum(0.5 * (relative[1:] + relative[:-1]) * np.diff(suction)) / GRAVITY_OF_WATER
    lacking = POROSITY * (1 - curve.saturation(dry))
    depth = np.linspace(0.0, 2.0, 200001)
    return lacking * np.interp(time * CONDUCTIVITY / lacking, depth - front * np.log1p(depth / front), depth)


@pytest.mark.parametrize("flow", ["seepage", *water.Element])
@pytest.mark.parametrize("n", [10, 20])
def test_rain_that_ponds_enters_dry_sand(flow, n):
    """No less enters than by gravity alone, k t, as long as the front is in the sand, and about what Green and Ampt have, whose front is sharp."""
    boundary, end = [
        water.Head(BASE, -3.0),
        water.Rain(TOP, 10 * CONDUCTIVITY),
    ], 1e4  # a water table 3 m below the base
    model = column(water.Element.STABILISED if flow == "seepage" else flow, 1e14, SAND, boundary, n=n)
    if flow == "seepage":
        porous = water.PorousSoil(CONDUCTIVITY, porosity=POROSITY, retention=SAND)
        model = water.Seepage(model.domain, porous, model._facet_tags, boundary)
        model.pressure_head.interpolate(lambda x: -3.0 - x[1])
    else:
        model.initialise(np.zeros((len(model.points.coordinates()), 4)), lambda x: -GRAVITY_OF_WATER * (3.0 + x[:, -1]))
    before, dt = model.stored_water(), 125.0
    while model.time < end - 1e-6:
        report = model.advance(min(dt, end - model.time))
        dt *= 1.0 if (report if flow == "seepage" else report.converged) else 0.5
        assert dt > 1.0
    entered = (model.stored_water() - before) / 0.2  # over the width of the column
    assert entered > CONDUCTIVITY * end
    assert entered == pytest.approx(green_and_ampt(SAND, 3.5 * GRAVITY_OF_WATER, end), rel=0.15)


@ELEMENTS
def test_a_cylinder_that_is_squeezed_without_a_flow_keeps_its_water(element):
    """Under a suction of its water, whose saturation is S, it is stretched along the radius by u = e r: its volume grows by 2 e,
    and S (n + 2 e + n p / K_w) stays, which says what p and S have become. Nothing flows, since all has the same pressure.
    """
    stretch, pressure, modulus = 2e-3, -2e3, 2.2e9
    domain, _, facet_tags = bridge.box_mesh(comm, (1.0, 1.0), (4, 4))
    supports = [bridge.roller(LEFT, (1, 0)), bridge.prescribed(RIGHT, (stretch, None)), bridge.roller(BASE, (0, 1)),
                bridge.roller(TOP, (0, 1))]  # fmt: skip
    model = water.Consolidation(
        domain, mpm.LinearElastic(young=1e6, poisson=0.0), water.PorousSoil(1e-30, porosity=POROSITY, retention=CURVE),
        facet_tags, supports, [], element=element, geometry=bridge.Geometry.AXISYMMETRIC, unit_weight=1e-6,
    )  # fmt: skip
    model.initialise(None, lambda x: np.full(len(x), pressure))
    held = lambda p, volume: CURVE.saturation(-p) * (POROSITY + volume + POROSITY * p / modulus)
    before = model.stored_water()
    assert before == pytest.approx(held(pressure, 0.0) / 2, rel=1e-9)
    model.load = lambda time: bridge.Load(displacement=time)
    assert model.advance(1.0).converged
    expected = brentq(lambda p: held(p, 2 * stretch) - held(pressure, 0.0), -1e6, 0.0, xtol=1e-9)
    np.testing.assert_allclose(model.pressure.x.array, expected, rtol=1e-5)
    assert model.stored_water() == pytest.approx(before, rel=1e-10)


@ELEMENTS
@GEOMETRIES
def test_soil_that_is_placed_has_the_water_of_its_pores_whatever_moved_before(element, geometry):
    """The upper half comes when the lower one has been stretched by 2 %, which moves the nodes between them."""
    domain, _, facet_tags = bridge.box_mesh(comm, (1.0, 1.0), (4, 4))
    cells = np.arange(len(tag_values(domain, None, 2)), dtype=np.int32)
    above = compute_midpoints(domain, 2, cells)[:, 1] > 0.5
    cell_tags = meshtags(domain, 2, cells, np.where(above, 2, 1).astype(np.int32))
    supports = [bridge.roller(LEFT, (1, 0)), bridge.prescribed(RIGHT, (0.02, None)), bridge.roller(BASE, (0, 1))]
    soil = water.PorousSoil(1e-5, porosity=POROSITY, retention=CURVE)
    model = water.Consolidation(
        domain, mpm.LinearElastic(young=1e6, poisson=0.0), soil, facet_tags, supports, [water.Head(BASE, 0.0)],
        element=element, cell_tags=cell_tags, geometry=geometry, unit_weight=1e-6,
    )  # fmt: skip
    model.reconfigure(off=[2])
    model.load = lambda time: bridge.Load(displacement=min(time / 100.0, 1.0))
    assert model.advance(100.0).converged
    before = model.stored_water()
    model.reconfigure(off=[])
    area = 0.25 if geometry else 0.5
    assert before > 1.01 * area * POROSITY  # saturated, and wider
    assert model.stored_water() - before == pytest.approx(area * POROSITY, rel=1e-6)
