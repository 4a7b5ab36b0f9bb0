"""Coupled deformation and flow of soil that dries: flow in stiff soil, effective stresses, weight and balance of the water."""

import numpy as np
import pytest
from consolidation_cases import BASE, GRAVITY_OF_WATER, LEFT, RIGHT, TOP
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water

comm = MPI.COMM_WORLD
ELEMENTS = pytest.mark.parametrize("element", list(water.Element))
CURVE = water.VanGenuchten(alpha=4e-4, n=2.0, residual=0.1)
POROSITY, WEIGHT, CONDUCTIVITY = 0.4, 19e3, 1e-5


def column(element, young, curve=CURVE, boundary=None, n=20, dim=2):
    """A column 1 m high, saturated at rest under water at its surface, that drains at its base from then on."""
    domain, _, facet_tags = bridge.box_mesh(comm, [0.2] * (dim - 1) + [1.0], [2] * (dim - 1) + [n])
    held = [bridge.roller(2 * axis + end, np.eye(dim)[axis]) for axis in range(dim - 1) for end in (1, 2)]
    base = 2 * dim - 1
    soil = mpm.LinearElastic(young=young, poisson=0.3)
    model = water.Consolidation(
        domain, soil, water.PorousSoil(CONDUCTIVITY, porosity=POROSITY, retention=curve), facet_tags,
        [*held, bridge.fixed(base)], boundary or [water.Head(base, 0.0)], load=bridge.Load(unit_weight=WEIGHT), element=element,
    )  # fmt: skip
    depth = 1.0 - model.points.coordinates()[:, -1]
    stress = np.zeros((len(depth), 4 if dim == 2 else 6))
    stress[:, :3] = (
        -(WEIGHT - GRAVITY_OF_WATER) * depth[:, None] * np.array([3 / 7, 1, 3 / 7] if dim == 2 else [3 / 7, 3 / 7, 1])
    )
    model.initialise(stress, lambda x: GRAVITY_OF_WATER * (1.0 - x[:, -1]))
    return model


@ELEMENTS
def test_in_stiff_soil_the_flow_is_that_of_seepage(element):
    model = column(element, 1e14)
    flow = water.Seepage(model.domain, water.PorousSoil(CONDUCTIVITY, porosity=POROSITY, retention=CURVE), model._facet_tags,
                         [water.Head(BASE, 0.0)])  # fmt: skip
    flow.pressure_head.interpolate(lambda x: 1.0 - x[1])
    for dt in (50.0, 100.0, 400.0, 2e3, 1e4):
        assert model.advance(dt).converged and flow.advance(dt)
        found = model.pressure.x.array
        expected = GRAVITY_OF_WATER * flow.pressure_head.x.array
        np.testing.assert_allclose(found, expected, atol=2e-3 * np.abs(expected).max())
        assert model.inflow(BASE) == pytest.approx(flow.inflow(BASE), rel=3e-3)
    assert found.min() < -0.25 * GRAVITY_OF_WATER


@ELEMENTS
@pytest.mark.parametrize("dim", [2, 3])
def test_a_drained_column_carries_its_weight_by_suction_and_soil(element, dim):
    """In the end the water hangs from the water table at the base, p = -gamma_w z; above z lies the weight of soil without the
    water that has left, and sigma'_v = sigma_v + S_e p. Settlements are those of the change of effective stress."""
    model = column(element, 5e6, n=16 if dim == 2 else 10, dim=dim)
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
def test_water_that_leaves_is_water_that_was_stored(element):
    model = column(element, 1e6)
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


def test_an_axisymmetric_body_that_may_dry_is_refused():
    domain, _, facet_tags = bridge.box_mesh(comm, (1.0, 1.0), (2, 2))
    with pytest.raises(bridge.InputError, match="VanGenuchten.*expected AlwaysSaturated in an axisymmetric body"):
        water.Consolidation(domain, mpm.LinearElastic(young=1e6, poisson=0.3), water.PorousSoil(1e-6, retention=CURVE),
                            facet_tags, [bridge.fixed(BASE), bridge.roller(LEFT, (1, 0)), bridge.roller(RIGHT, (1, 0))],
                            [water.Head(TOP, 0.0)], geometry=bridge.Geometry.AXISYMMETRIC)  # fmt: skip
