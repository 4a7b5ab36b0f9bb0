"""Seepage in axial symmetry against closed forms: wells, a disc, a cylinder of water that rises, and the balance of water."""

import numpy as np
import pytest
import ufl
from dolfinx import fem
from dolfinx.mesh import compute_midpoints, meshtags
from mpi4py import MPI
from scipy.special import exp1

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water
from fenics_bridge.fem.fields import assembled
from fenics_bridge.fem.geometry import lumped_radius, nodal_radius
from mpm_core import InputError

AXISYMMETRIC = bridge.Geometry.AXISYMMETRIC
INNER, OUTER, BASE, TOP = 1, 2, 3, 4
WEIGHT = 9810.0
SAND = water.VanGenuchten(2.0 / WEIGHT, 2.0, residual=0.05)


def ring(inner, outer, height, counts, growth=1.0):
    """Half section of a ring; rows of cells grow along the radius by a power of it where growth is above 1."""
    domain, _, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, (1.0, height), counts)
    x = domain.geometry.x
    x[:, 0] = inner * (outer / inner) ** x[:, 0] if growth != 1.0 else inner + (outer - inner) * x[:, 0]
    return domain, facet_tags


def seepage(mesh, soil, boundary, **options):
    domain, facet_tags = mesh
    return water.Seepage(domain, soil, facet_tags, boundary, geometry=AXISYMMETRIC, **options)


# --- steady flow -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("degree, order", [(1, 1.9), (2, 2.9)])
def test_flow_to_a_well_in_a_confined_aquifer_is_thiems(degree, order):
    # (r h')' = 0: h = h1 + (h2 - h1) ln(r / r1) / ln(r2 / r1), and 2 pi k D (h2 - h1) / ln(r2 / r1) flows to the whole well.
    inner, outer, thick, k = 1.0, 4.0, 2.0, 1e-5
    errors, flows = [], []
    for n in (16, 32, 64):
        heads = [water.Head(INNER, 5.0), water.Head(OUTER, 8.0)]
        flow = seepage(ring(inner, outer, thick, (n, n // 4)), water.PorousSoil(k), heads, degree=degree)
        flow.solve()
        r, y = ufl.SpatialCoordinate(flow.domain)
        error = flow.pressure_head + y - 5.0 - 3.0 * ufl.ln(r / inner) / np.log(outer / inner)
        errors.append(np.sqrt(fem.assemble_scalar(fem.form(error**2 * ufl.dx(metadata={"quadrature_degree": 8})))))
        whole = 2 * np.pi * k * thick * 3.0 / np.log(outer / inner)
        flows.append(abs(2 * np.pi * flow.inflow(OUTER) / whole - 1))
        assert flow.inflow(INNER) == pytest.approx(-flow.inflow(OUTER), rel=1e-10)
    assert np.log2(errors[1] / errors[2]) > order
    assert np.log2(flows[1] / flows[2]) > 2 * degree - 0.3  # the flow is an energy, which converges twice as fast
    assert flows[2] < 1e-3


@pytest.mark.parametrize("level", [2.0, 0.0])
def test_a_well_in_an_unconfined_aquifer_takes_what_dupuit_and_forchheimer_say(level):
    # Q = pi k (H^2 - h^2) / ln(R / r) is exact in spite of the seepage face in the well (Charny 1951): with Phi(r), the integral
    # over the saturated height of the head less half its square, 2 pi r k Phi' = Q, and Phi is H^2 / 2 and h^2 / 2 at the ends.
    # The fringe above the water table lets its share through, half of that where it is half as high.
    inner, outer, full, k, found = 1.0, 20.0, 10.0, 1e-5, []
    for fringe in (1000.0, 500.0):
        soil = water.PorousSoil(k, retention=water.FreeSurface(fringe))
        at_well = [water.Reservoir(INNER, level), water.Reservoir(OUTER, full)]
        flow = seepage(ring(inner, outer, full, (40, 40), growth=2.0), soil, at_well)
        flow.solve()
        assert flow.inflow(INNER) == pytest.approx(-flow.inflow(OUTER), rel=1e-9)
        found.append(2 * np.pi * flow.inflow(OUTER))
    exact = np.pi * k * (full**2 - level**2) / np.log(outer / inner)
    assert 2 * found[1] - found[0] == pytest.approx(exact, rel=0.01)


def test_flow_from_a_disc_into_deep_ground_is_that_of_a_potential():
    # In oblate coordinates r = a cosh(m) cos(n), z = -a sinh(m) sin(n) the head depends on m alone: h0 (1 - g(m) / g(M)) with
    # g = atan(sinh m), where it is h0 on the disc m = 0 and zero at m = M; Q = 2 pi k a h0 / g(M), or 4 k a h0 for M without end.
    # At the edge of the disc the map is singular, so that the error is h^2 ln(1 / h), of the order 1.7 for such cells.
    a, k, head, end, found = 0.5, 1e-4, 2.0, 3.0, []
    for n in (16, 32, 64):
        domain, _, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, (end, np.pi / 2), (2 * n, n))
        m, angle = domain.geometry.x[:, 0].copy(), domain.geometry.x[:, 1].copy()
        domain.geometry.x[:, 0] = np.maximum(a * np.cosh(m) * np.cos(angle), 0.0)
        domain.geometry.x[:, 1] = -a * np.sinh(m) * np.sin(angle)
        heads = [water.Head(1, head), water.Head(2, 0.0)]
        flow = seepage((domain, facet_tags), water.PorousSoil(k), heads)
        flow.solve()
        found.append(2 * np.pi * flow.inflow(1))
    exact = 2 * np.pi * k * a * head / np.arctan(np.sinh(end))
    errors = np.array(found) / exact - 1
    assert np.log2(errors[1] / errors[2]) > 1.7 and 0 < errors[2] < 1e-3


def test_water_rises_through_a_cylinder_as_along_a_line():
    # Through a cylinder of radius R under a gradient i: k i R^2 / 2 in one radian, the head being linear, on the axis too.
    flow = seepage(ring(0.0, 1.5, 2.0, (6, 5)), water.PorousSoil(1e-5), [water.Head(BASE, 3.0), water.Head(TOP, 2.0)])
    flow.solve()
    assert flow.inflow(BASE) == pytest.approx(1e-5 * 0.5 * 1.5**2 / 2, rel=1e-10)
    x = flow.pressure_head.function_space.tabulate_dof_coordinates()
    np.testing.assert_allclose(flow.pressure_head.x.array + x[:, 1], 3.0 - 0.5 * x[:, 1], rtol=1e-12)
    for upward in (False, True):
        assert water.exit_gradient(flow, TOP, upward) == pytest.approx(0.5, rel=1e-9)


def test_rain_on_a_ring_enters_over_its_area():
    flow = seepage(ring(1.0, 3.0, 1.0, (8, 4)), water.PorousSoil(1e-5, retention=SAND),
                   [water.Rain(TOP, 2e-7), water.Head(BASE, 0.0)])  # fmt: skip
    flow.solve()
    assert flow.inflow(TOP) == pytest.approx(2e-7 * (3.0**2 - 1.0**2) / 2, rel=1e-9)
    assert flow.inflow(BASE) == pytest.approx(-flow.inflow(TOP), rel=1e-9)


def test_far_from_the_axis_flow_around_a_wall_is_plane():
    # Ground of 8 m by 4 m with a wall in its middle that is 2 m deep: of a circular cofferdam with the radius R, the flow over R
    # differs from that of the plane section by the ends of the section over R, 4 / R at most.
    flows = []
    for radius in (0.0, 4e4):
        domain, cells, facets = bridge.box_mesh(MPI.COMM_WORLD, (8.0, 4.0), (32, 16))
        domain.geometry.x[:, 0] += radius
        wall = mpm.beam([(radius + 4.0, 4.0), (radius + 4.0, 2.0)], 1e9, 1e8, impervious=True)
        body, _, tags = bridge.soil_mesh(domain, cells, facets, walls={"wall": wall})
        geometry = AXISYMMETRIC if radius else None
        boundary = [water.Head(INNER, 3.0), water.Head(OUTER, 4.0)]
        flow = water.Seepage(body, water.PorousSoil(1e-5), tags, boundary, geometry=geometry)
        flow.solve()
        assert flow.inflow(INNER) == pytest.approx(-flow.inflow(OUTER), rel=1e-9)
        flows.append(flow.inflow(OUTER) / ((radius + 4.0) if radius else 1.0))
    assert flows[1] == pytest.approx(flows[0], rel=4 / 4e4)
    assert flows[0] < 0.9 * 1e-5 * 4.0 / 8.0  # the wall stands in the way


# --- flow in time ----------------------------------------------------------------------------------------------------


def test_a_pumped_well_draws_the_heads_down_as_theis_says():
    # s = Q / (4 pi k D) E1(r^2 S_s / (4 k t)), S_s = gamma_w (m_v + n / K_w), of a well as thin as a line in endless ground.
    # Steps grow with the time, so that errors are in proportion to log(growth), and two runs give the limit.
    k, storage, thick, pumped, found = 1e-4, 1e-5, 2.0, 1e-3, []
    soil = water.PorousSoil(k, porosity=0.4, compressibility=storage / WEIGHT - 0.4 / water.soils.WATER_MODULUS)
    radii, times = np.array([1.0, 5.0, 20.0]), (2.0, 20.0, 100.0)
    for growth in (1.1**2, 1.1):
        boundary = [water.Flux(INNER, -pumped / (2 * np.pi * 0.02 * thick)), water.Head(OUTER, thick)]
        flow = seepage(ring(0.02, 2000.0, thick, (320, 1), growth=2.0), soil, boundary)
        flow.pressure_head.x.array[:] = thick - flow.pressure_head.function_space.tabulate_dof_coordinates()[:, 1]
        dt, start = 1e-4, flow.stored_water()
        found.append([])
        for time in times:
            while flow.time < time * (1 - 1e-9):
                assert flow.advance(min(dt, time - flow.time))
                dt *= growth
            at = bridge.evaluate_at(np.column_stack([radii, np.ones(3)]), p=flow.pressure_head)["p"][:, 0]
            found[-1].append(thick - 1.0 - at)
        assert 2 * np.pi * (start - flow.stored_water()) == pytest.approx(pumped * times[-1], rel=1e-2)
    unit = pumped / (4 * np.pi * k * thick)
    exact = unit * exp1(radii**2 * storage / (4 * k * np.array(times)[:, None]))
    coarse, fine = found
    assert 2 * np.array(fine) - coarse == pytest.approx(exact, abs=5e-3 * unit)
    assert exact[-1].min() > 0.1 * unit  # every radius sees the well in the end


@pytest.mark.parametrize("degree", [1, 2])
def test_water_is_conserved_in_a_cylinder_that_drains_about_its_axis(degree):
    """A disc at its bottom, about the axis, lets the water out, while rain falls; no water is lost, nor does any node swing."""
    domain, facet_tags = ring(0.0, 1.0, 1.0, (10, 10))
    base = facet_tags.find(BASE)
    middles = compute_midpoints(domain, 1, base)
    tags = facet_tags.values.copy()
    tags[np.isin(facet_tags.indices, base[middles[:, 0] < 0.3])] = 7
    facet_tags = meshtags(domain, 1, facet_tags.indices, tags)
    soil = water.PorousSoil(1e-5, porosity=0.4, compressibility=1e-8, retention=SAND)
    boundary = [water.Head(7, ((0.0, 1.0), (60.0, 0.1))), water.Rain(TOP, 2e-7)]
    flow = seepage((domain, facet_tags), soil, boundary, degree=degree)
    flow.solve()
    held, dt = flow.stored_water(), 10.0
    assert held == pytest.approx(0.5 * 0.4, rel=1e-2)
    for _ in range(30):
        before = flow.stored_water()
        assert flow.advance(dt), flow.reason
        assert flow.stored_water() - before == pytest.approx(dt * flow.inflow(None), abs=1e-10 * held)
        dt *= 1.4
    assert flow.inflow(TOP) == pytest.approx(2e-7 / 2, rel=1e-9)
    assert flow.stored_water() < 0.9 * held


def test_stored_water_is_exact_where_the_pressure_is_linear():
    # The integral of (n + s p) r over a cylinder of 1 m by 1 m for the head p = r: n / 2 + s gamma_w / 3.
    storage = 1e-6
    soil = water.PorousSoil(1e-5, porosity=0.4, compressibility=storage - 0.4 / water.soils.WATER_MODULUS)
    flow = seepage(ring(0.0, 1.0, 1.0, (4, 3)), soil, [water.Head(TOP, 1.0)])
    flow.pressure_head.x.array[:] = flow.pressure_head.function_space.tabulate_dof_coordinates()[:, 0]
    assert flow.stored_water() == pytest.approx(0.4 / 2 + storage * WEIGHT / 3, rel=1e-12)


def test_a_load_on_a_sealed_cylinder_presses_on_its_water_up_to_the_axis():
    """Nothing flows: everywhere the water takes m_v / (m_v + n / K_w) of the load (van der Kamp and Gale 1983)."""
    soil = water.PorousSoil(1e-7, porosity=0.4, compressibility=1e-9)
    flow = seepage(ring(0.0, 1.0, 1.0, (5, 4)), soil, [water.Flux(TOP, 0.0)],
                   loading=lambda x, time: np.full(len(x), 1e4 * time))  # fmt: skip
    flow.pressure_head.x.array[:] = 1.0 - flow.pressure_head.function_space.tabulate_dof_coordinates()[:, 1]
    before = flow.pressure_head.x.array.copy()
    assert flow.advance(1.0)
    rise = 1e4 / WEIGHT * 1e-9 / (1e-9 + 0.4 / water.soils.WATER_MODULUS)
    assert flow.pressure_head.x.array - before == pytest.approx(np.full(len(before), rise), rel=1e-8)


# --- what is refused -------------------------------------------------------------------------------------------------


def test_no_water_crosses_the_axis():
    for condition in (water.Head(INNER, 1.0), water.SeepageFace(INNER), water.Flux(INNER, -1e-6)):
        with pytest.raises(InputError, match=f"{type(condition).__name__}.*holds on the axis, where the radius is 0"):
            seepage(ring(0.0, 1.0, 1.0, (3, 3)), water.PorousSoil(1e-5), [condition, water.Head(OUTER, 1.0)])


def test_radii_are_not_below_zero():
    with pytest.raises(InputError, match="domain has the radius -1 m, expected radii from 0 on"):
        seepage(ring(-1.0, 1.0, 1.0, (3, 3)), water.PorousSoil(1e-5), [water.Head(OUTER, 1.0)])


# --- weights of integrals --------------------------------------------------------------------------------------------


def test_the_radius_at_the_nodes_stands_beside_integrals_of_degree_one():
    """FFCx 0.5 takes the radius of the integral of degree 1 for all others of a form: these have that of the nodes instead."""
    domain, _ = ring(0.0, 1.0, 1.0, (3, 3))
    space = bridge.compat.function_space(domain, "Lagrange", 1)
    test, given = ufl.TestFunction(space), fem.Function(space)
    given.interpolate(lambda x: x[0] * x[1])
    at_points, at_nodes = ufl.SpatialCoordinate(domain)[0], nodal_radius(domain, AXISYMMETRIC)
    parts = [at_points * test * ufl.dx(metadata={"quadrature_degree": 1}),
             at_nodes * given * test * ufl.dx(metadata={"quadrature_degree": 4})]  # fmt: skip
    together, *alone = (assembled(fem.form(form), space).array.copy() for form in (sum(parts), *parts))
    np.testing.assert_allclose(together, sum(alone), atol=1e-15)
    exact = fem.assemble_scalar(fem.form(at_points * given * ufl.dx(metadata={"quadrature_degree": 4})))
    assert alone[1].sum() == pytest.approx(exact, rel=1e-12)


def test_lumped_weights_are_the_integrals_of_the_shape_functions():
    domain, _ = ring(0.0, 1.0, 1.0, (3, 3))
    test = ufl.TestFunction(bridge.compat.function_space(domain, "Lagrange", 1))
    rule = {"quadrature_rule": "vertex", "quadrature_degree": 1}
    forms = (
        lumped_radius(domain, AXISYMMETRIC) * test * ufl.dx(metadata=rule),
        ufl.SpatialCoordinate(domain)[0] * test * ufl.dx,
    )
    lumped, exact = (assembled(fem.form(form), test.ufl_function_space()).array.copy() for form in forms)
    np.testing.assert_allclose(lumped, exact, rtol=1e-12)
    assert lumped.min() > 0 and lumped.sum() == pytest.approx(0.5)
