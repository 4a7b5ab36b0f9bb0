"""Seepage by finite elements against closed forms: a dam, a sheet pile, infiltration, drainage; its balance of water."""

import math
from itertools import permutations

import numpy as np
import pytest
import ufl
from dolfinx import mesh
from mpi4py import MPI

import fenics_bridge as bridge
from fenics_bridge import water
from fenics_bridge.compat import facet_nodes
from mpm_core import InputError

comm = MPI.COMM_WORLD
WEIGHT = 9810.0
LEFT, RIGHT, BASE, TOP = 1, 2, 3, 4


def box(lengths, counts):
    domain, _, facet_tags = bridge.box_mesh(comm, lengths, counts)
    return domain, facet_tags


def dam(fringe=500.0):
    domain, facet_tags = box((16.0, 10.0), (32, 20))
    soil = water.PorousSoil(1e-5, retention=water.FreeSurface(fringe))
    flow = water.Seepage(domain, soil, facet_tags, [water.Reservoir(LEFT, 10.0), water.Reservoir(RIGHT, 2.0)])
    flow.solve()
    return flow


# --- steady flow -----------------------------------------------------------------------------------------------------


def test_a_dam_with_vertical_faces_lets_through_what_dupuit_says():
    # q = k (h1^2 - h2^2) / (2 L), exact in spite of the seepage face (Charny 1951); the fringe above the water table, 5 cm of
    # water, adds about its height to the one through which water flows.
    flow = dam()
    exact = 1e-5 * (10.0**2 - 2.0**2) / (2 * 16.0)
    assert flow.inflow(LEFT) == pytest.approx(exact, rel=0.01)
    assert flow.inflow(RIGHT) == pytest.approx(-flow.inflow(LEFT), rel=1e-10)


def test_the_water_table_of_a_dam_ends_above_the_tail_water():
    flow = dam()
    heights = np.linspace(0.05, 9.95, 199)
    at_exit = bridge.evaluate_at(np.column_stack([np.full(199, 16.0), heights]), p=flow.pressure_head)["p"][:, 0]
    wet = heights[at_exit > -0.01]
    assert 2.4 < wet.max() < 5.0  # a seepage face above 2 m, and dry soil above it
    assert np.all(at_exit[heights > 2.0] <= 1e-12)  # atmospheric at most
    dry = heights > wet.max() + 0.5
    assert np.all(at_exit[dry] < 0)


@pytest.mark.parametrize("depth, exact", [(0.25, 0.7346), (0.5, 0.5)])
def test_flow_under_a_sheet_pile_is_that_of_conformal_mapping(depth, exact):
    # q / (k h) = K' / (2 K), modulus sin(pi s / 2T); half of the ground, with the mean head below the pile. The singular point
    # at its tip leaves an error in proportion to the size of the cells, so that two meshes give the limit.
    thickness, found = 4.0, []
    for n in (16, 32):
        domain, _ = box((4 * thickness, thickness), (4 * n, n))
        ground = mesh.locate_entities_boundary(domain, 1, lambda x: np.isclose(x[1], thickness))
        gap = mesh.locate_entities_boundary(
            domain, 1, lambda x: np.isclose(x[0], 0) & (x[1] <= thickness * (1 - depth) + 1e-9)
        )
        facets, tags = np.concatenate([ground, gap]), np.repeat([1, 2], [len(ground), len(gap)]).astype(np.int32)
        order = np.argsort(facets)
        facet_tags = mesh.meshtags(domain, 1, facets[order], tags[order])
        boundary = [water.Head(1, thickness + 1.0), water.Head(2, thickness + 0.5)]
        flow = water.Seepage(domain, water.PorousSoil(1.0), facet_tags, boundary, degree=2)
        flow.solve()
        found.append(flow.inflow(1))
    assert 2 * found[1] - found[0] == pytest.approx(exact, rel=5e-3)
    assert found[0] > found[1] > exact  # finite elements let more through


def test_two_layers_in_a_row_share_the_head_by_their_resistances():
    domain, facet_tags = box((3.0, 1.0), (12, 4))
    second = mesh.locate_entities(domain, 2, lambda x: x[0] >= 1.0 - 1e-9)
    tags = np.ones(domain.topology.index_map(2).size_local + domain.topology.index_map(2).num_ghosts, dtype=np.int32)
    tags[second] = 2
    cell_tags = mesh.meshtags(domain, 2, np.arange(len(tags), dtype=np.int32), tags)
    soils = {1: water.PorousSoil(1e-5), 2: water.PorousSoil(4e-5)}
    boundary = [water.Head(LEFT, 5.0), water.Head(RIGHT, 2.0)]
    flow = water.Seepage(domain, soils, facet_tags, boundary, cell_tags=cell_tags)
    flow.solve()
    resistance = 1.0 / 1e-5 + 2.0 / 4e-5
    assert flow.inflow(LEFT) == pytest.approx(3.0 / resistance, rel=1e-9)
    velocity = bridge.evaluate_at(np.array([[0.5, 0.5], [2.0, 0.3]]), q=flow.velocity())["q"]
    assert velocity == pytest.approx(np.tile([3.0 / resistance, 0.0], (2, 1)), abs=1e-9 * 1e-5)


def test_an_inclined_anisotropy_turns_the_flow():
    # Under a uniform gradient along x the flow has the components k_xx and k_xy of the tensor.
    tensor = [[3e-5, 1e-5], [1e-5, 2e-5]]
    domain, facet_tags = box((2.0, 2.0), (4, 4))
    soil = water.PorousSoil(tensor)
    given = [water.Head(tag, 10.0) for tag in (LEFT,)]
    flow = water.Seepage(domain, soil, facet_tags, given)
    points = flow.pressure_head.function_space.tabulate_dof_coordinates()
    flow.pressure_head.x.array[:] = 10.0 - 0.1 * points[:, 0] - points[:, 1]
    velocity = bridge.evaluate_at(np.array([[1.0, 0.9]]), q=flow.velocity())["q"][0]
    assert velocity == pytest.approx([3e-6, 1e-6], rel=1e-9)


def test_strata_that_dip_conduct_along_and_across_themselves():
    angle = np.radians(30.0)
    tensor = water.dipping(5e-6, 1e-7, 30.0)
    down, across = np.array([np.cos(angle), -np.sin(angle)]), np.array([np.sin(angle), np.cos(angle)])
    assert tensor @ down == pytest.approx(5e-6 * down) and tensor @ across == pytest.approx(1e-7 * across)
    tensor = water.dipping(5e-6, 1e-7, 30.0, direction=90.0)  # they fall along y
    assert tensor @ [0, *down] == pytest.approx(5e-6 * np.array([0, *down]))
    assert tensor @ [1, 0, 0] == pytest.approx([5e-6, 0, 0]) and tensor @ [0, *across] == pytest.approx(
        1e-7 * np.array([0, *across])
    )
    with pytest.raises(InputError, match="across is 0.0 m/s, expected a positive number"):
        water.dipping(1e-6, 0.0, 30.0)


@pytest.mark.parametrize("degree, order", [(1, 1.8), (2, 2.8)])
def test_steady_infiltration_follows_gardners_closed_form(degree, order):
    # alpha psi = ln(r - (r - 1) exp(-alpha z)) above a water table, r = q / k (0.5 here)
    alpha, z = 1.0, np.array([0.5, 1.0, 2.0])
    exact = np.log(0.5 + 0.5 * np.exp(-alpha * z)) / alpha
    errors = []
    for n in (16, 32):
        domain, facet_tags = box((0.5, 4.0), (2, n))
        soil = water.PorousSoil(1e-6, retention=water.Gardner(alpha / WEIGHT))
        flow = water.Seepage(domain, soil, facet_tags, [water.Head(BASE, 0.0), water.Rain(TOP, 0.5e-6)], degree=degree)
        flow.solve()
        got = bridge.evaluate_at(np.column_stack([np.full(3, 0.25), z]), p=flow.pressure_head)["p"][:, 0]
        errors.append(np.abs(got - exact).max())
        assert flow.inflow(BASE) == pytest.approx(-0.25e-6, rel=1e-9)
    assert np.log2(errors[0] / errors[1]) > order
    assert errors[1] < 1e-3


def test_soil_takes_no_more_rain_than_it_can_conduct():
    domain, facet_tags = box((0.5, 4.0), (2, 16))
    soil = water.PorousSoil(1e-6, retention=water.Gardner(1.0 / WEIGHT))
    flow = water.Seepage(domain, soil, facet_tags, [water.Head(BASE, 0.0), water.Rain(TOP, 3e-6)])
    flow.solve()
    # Saturated from top to base: pressure nil everywhere, gradient one.
    assert flow.inflow(TOP) == pytest.approx(0.5 * 1e-6, rel=1e-9)
    assert np.abs(flow.pressure_head.x.array).max() < 1e-9


def test_curves_fall_from_one_and_are_those_of_their_authors():
    suction = np.array([0.0, 1e2, 1e3, 1e4, 1e5])
    curves = [water.VanGenuchten(2e-4, 1.3, 0.1), water.VanGenuchten(2e-4, 1.3, 0.1, air_entry=200.0), water.Gardner(1e-4),
              water.FreeSurface(), water.Tabulated((0, 1e3, 1e4), (1, 0.8, 0.3), (1, 0.2, 0.01))]  # fmt: skip
    for curve in curves:
        for values in (curve.saturation(suction), curve.relative_permeability(suction)):
            assert values[0] == pytest.approx(1.0, abs=1e-3) and np.all(np.diff(values) <= 1e-15) and values[-1] >= 0
    # van Genuchten 1980, eq. 3 and 8, written out at alpha s = 2, n = 2, m = 1/2
    curve = water.VanGenuchten(2e-4, 2.0)
    assert curve.saturation(1e4) == pytest.approx(5**-0.5)
    assert curve.relative_permeability(1e4) == pytest.approx(5**-0.25 * (1 - (1 - 1 / 5) ** 0.5) ** 2, abs=2e-8)
    assert curves[1].saturation(199.0) == 1.0


# --- flow in time ----------------------------------------------------------------------------------------------------


def test_water_is_conserved_in_every_step_of_a_draining_column():
    domain, facet_tags = box((0.2, 2.0), (2, 30))
    retention = water.VanGenuchten(2.0 / WEIGHT, 2.0, residual=0.05)
    soil = water.PorousSoil(1e-5, porosity=0.4, compressibility=1e-8, retention=retention)
    flow = water.Seepage(domain, soil, facet_tags, [water.Head(BASE, ((0.0, 2.0), (60.0, 0.0)))])
    flow.solve()
    start, drained, dt = flow.stored_water(), 0.0, 10.0
    for _ in range(50):
        before = flow.stored_water()
        assert flow.advance(dt)
        drained -= dt * flow.inflow(BASE)
        assert flow.stored_water() - before == pytest.approx(dt * flow.inflow(BASE), abs=1e-10 * start)
        dt = min(1.5 * dt, 1e6)
    # At rest suction is hydrostatic: the closed form of the water that remains, by fine sums over the height.
    z = np.linspace(0.0, 2.0, 20001)
    content = retention.saturation(WEIGHT * z) * (soil.porosity - soil.compressibility * WEIGHT * z)
    rest = 0.2 * np.trapz(content, z)
    assert flow.stored_water() == pytest.approx(rest, rel=2e-3)
    assert start - drained == pytest.approx(flow.stored_water(), rel=1e-8)


def test_coarse_sand_drains_where_the_head_at_its_base_falls_at_once():
    """In steps that each converge, with no water lost; after a day as much is left as where the head falls within a minute."""

    def drained(head, first, growth):
        domain, facet_tags = box((0.2, 5.0), (2, 50))
        sand = water.PorousSoil(1e-3, porosity=0.4, retention=water.VanGenuchten(1.5e-3, 4.0, residual=0.05))
        flow = water.Seepage(domain, sand, facet_tags, [water.Head(BASE, 5.0)])
        flow.solve()
        flow.boundary[0] = water.Head(BASE, head)
        held, dt = flow.stored_water(), first
        while flow.time < 86400.0:
            before = flow.stored_water()
            dt = min(dt, 86400.0 - flow.time)
            assert flow.advance(dt), flow.reason
            assert flow.stored_water() - before == pytest.approx(dt * flow.inflow(BASE), abs=1e-10 * held)
            dt *= growth
        return flow.stored_water() / held

    slowly = drained(((0.0, 5.0), (60.0, 0.0)), 5.0, 1.2)
    assert slowly < 0.2 and drained(0.0, 600.0, 1.2) == pytest.approx(slowly, rel=0.02)


def test_pressure_in_a_saturated_layer_diffuses_as_terzaghi_says():
    # c_v = k / (gamma_w (n / K_w + m_v)); the degree of consolidation at T = 0.1, 0.2, 0.5
    k, storage = 1e-8, 1e-7
    domain, facet_tags = box((0.1, 1.0), (1, 40))
    soil = water.PorousSoil(k, porosity=0.4, compressibility=storage - 0.4 / water.soils.WATER_MODULUS)
    flow = water.Seepage(domain, soil, facet_tags, [water.Head(TOP, 1.0)])
    height = flow.pressure_head.function_space.tabulate_dof_coordinates()[:, 1]
    flow.pressure_head.x.array[:] = 1.0 - height + 1.0  # an excess head of 1 m
    consolidation = k / (WEIGHT * storage)
    start, fell = flow.stored_water(), []
    rest = start - 0.1 * storage * WEIGHT * 1.0
    for _ in range(500):
        assert flow.advance(1e-3 / consolidation)
        fell.append((start - flow.stored_water()) / (start - rest))
    assert [fell[99], fell[199], fell[499]] == pytest.approx([0.3568, 0.5041, 0.7640], abs=4e-3)


def test_conditions_may_be_changed_between_steps():
    # A column drained at its base takes the rain that falls now, not the one before; the balance holds under each.
    domain, facet_tags = box((0.5, 2.0), (2, 16))
    soil = water.PorousSoil(1e-5, retention=water.VanGenuchten(2.0 / WEIGHT, 2.0))
    flow = water.Seepage(domain, soil, facet_tags, [water.Head(BASE, 0.0), water.Rain(TOP, 1e-6)])
    flow.solve()
    assert flow.inflow(TOP) == pytest.approx(0.5e-6, rel=1e-9)
    flow.boundary[1] = water.Rain(TOP, [[0.0, 3e-6], [1e4, 3e-6]])
    before = flow.stored_water()
    assert flow.advance(100.0)
    assert flow.inflow(TOP) == pytest.approx(1.5e-6, rel=1e-9)
    assert flow.stored_water() - before == pytest.approx(100.0 * (flow.inflow(TOP) + flow.inflow(BASE)), abs=1e-10)
    flow.boundary[1] = water.Rain(TOP, -1e-6)
    with pytest.raises(InputError, match="rate is -1e-06"):
        flow.advance(100.0)


def test_a_step_that_fails_leaves_the_flow_as_it_was(monkeypatch):
    flow = dam()
    before = flow.time, flow.inflow(LEFT), flow.pressure_head.x.array.copy()
    monkeypatch.setattr(water.complementarity, "MOST_ITERATIONS", 1)
    flow.boundary[0] = water.Reservoir(LEFT, 3.0)
    assert not flow.advance(1.0)
    assert "after 1 iterations" in flow.reason and "take steps shorter than 1 s" in flow.reason
    assert (flow.time, flow.inflow(LEFT)) == before[:2]
    assert np.array_equal(flow.pressure_head.x.array, before[2])


# --- to finite elements of the soil ----------------------------------------------------------------------------------


def test_pore_pressures_reach_points_inside_and_outside_of_the_soil():
    flow = dam()
    at = flow.pore_pressure(outside=lambda x: 1.0 + 0 * x[:, 0])
    points = np.array([[0.0, 4.0], [8.0, 9.9], [30.0, 5.0]])
    assert at(points) == pytest.approx([WEIGHT * 6.0, 0.0, 1.0], rel=1e-9)
    with_suction = flow.pore_pressure(suction=True)(points[:2])
    assert with_suction[0] == pytest.approx(WEIGHT * 6.0)
    assert with_suction[1] <= 0


# --- what is refused -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "make, words",
    [
        (lambda: water.PorousSoil(0.0), "conductivity is 0.0"),
        (lambda: water.PorousSoil(-1e-5), "conductivity"),
        (lambda: water.PorousSoil([[1.0, 2.0], [2.0, 1.0]]), "positive principal values"),
        (lambda: water.PorousSoil(1e-5, porosity=1.0), "porosity is 1.0"),
        (lambda: water.VanGenuchten(1e-4, 1.0), "n is 1.0"),
        (lambda: water.VanGenuchten(1e-4, 2.0, residual=1.0), "residual is 1.0"),
        (lambda: water.Gardner(float("nan")), "alpha is nan"),
        (
            lambda: water.Tabulated((0, 10, 20), (1, 0.4, 0.5), (1, 0.1, 0.05)),
            "saturation_values rises from 0.4 to 0.5",
        ),
        (lambda: water.Tabulated((0, 10, 5), (1, 0.5, 0.4), (1, 0.1, 0.05)), "suction"),
        (lambda: water.FreeSurface(fringe=0.0), "fringe is 0.0"),
    ],
)
def test_wrong_soils_are_named(make, words):
    with pytest.raises(InputError, match=words):
        make()


@pytest.mark.parametrize(
    "boundary, words",
    [
        ([water.Head(9, 1.0)], "boundary: no facet has the tag 9"),
        ([water.Head(LEFT, float("inf"))], "level is inf"),
        ([water.Rain(TOP, -1e-6)], "rate is -1e-06"),
        ([water.Rain(TOP, 1e-6, ponding=-1.0)], "ponding is -1.0"),
        ([water.Head(LEFT, ((1.0, 2.0), (0.0, 3.0)))], "rising times"),
        (["left"], "expected Head"),
    ],
)
def test_wrong_boundary_conditions_are_named(boundary, words):
    domain, facet_tags = box((1.0, 1.0), (2, 2))
    with pytest.raises(InputError, match=words):
        water.Seepage(domain, water.PorousSoil(1e-5), facet_tags, boundary)


def test_steady_flow_without_a_head_is_refused():
    domain, facet_tags = box((1.0, 1.0), (2, 2))
    flow = water.Seepage(domain, water.PorousSoil(1e-5), facet_tags, [water.Flux(TOP, 1e-7)])
    with pytest.raises(InputError, match="undetermined"):
        flow.solve()


def test_cells_without_a_soil_are_named():
    domain, cell_tags, facet_tags = bridge.box_mesh(comm, (3.0, 1.0), (6, 2), body=((0.0, 0.0), (1.0, 1.0)))
    with pytest.raises(InputError, match="none for cells with tag 0"):
        soils = {bridge.BODY: water.PorousSoil(1e-5)}
        water.Seepage(domain, soils, facet_tags, [water.Head(LEFT, 1.0)], cell_tags=cell_tags)


class Rising(water.AlwaysSaturated):
    """A curve of one's own: wetter, or more conductive, with suction, or not conductive at all."""

    def __init__(self, saturation, permeability):
        self.saturation, self.relative_permeability = saturation, permeability


@pytest.mark.parametrize(
    "saturation, permeability, message",
    [
        (lambda s: np.where(s < 1e3, 1.0, 1.0 + 1e-6 * s), np.ones_like, "saturation goes from 1 to 1.001"),
        (np.ones_like, lambda s: np.exp(-s), "relative_permeability goes from 1 to 0, expected from 1 to more than 0"),
        (lambda s: 0.5 + 0 * s, np.ones_like, "saturation goes from 0.5 to 0.5, expected from 1"),
    ],
    ids=["rises", "lets nothing through", "does not begin saturated"],
)
def test_curves_of_ones_own_that_are_not_possible_are_refused(saturation, permeability, message):
    with pytest.raises(InputError, match=message):
        water.PorousSoil(1e-6, retention=Rising(saturation, permeability))


class PowerLaw:
    """A curve of one's own, after Brooks and Corey, whose parameter is a number for Python's math."""

    def __init__(self, entry, exponent):
        self.entry, self.exponent = entry, math.exp(math.log(exponent))

    def effective(self, suction):
        ratio = suction / self.entry
        if isinstance(suction, (float, np.ndarray)):
            return np.maximum(ratio, 1.0) ** -self.exponent
        return ufl.max_value(ratio, 1.0) ** -self.exponent

    saturation = relative_permeability = effective


def test_a_curve_of_ones_own_serves_as_one_of_the_package():
    """A column drains under a table of its boundary; at rest saturation follows from hydrostatic suction."""
    curve, height = PowerLaw(4e3, 2.0), 2.0
    domain, facet_tags = box((0.2, height), (2, 40))
    soil = water.PorousSoil(1e-4, porosity=0.4, retention=curve)
    flow = water.Seepage(domain, soil, facet_tags, [water.Head(BASE, ((0.0, height), (60.0, 0.0)))], water_modulus=1e12)
    flow.solve()
    assert flow.stored_water() == pytest.approx(0.4 * 0.2 * height, rel=1e-6)
    dt = 10.0
    for _ in range(40):
        assert flow.advance(dt)
        dt = min(1.5 * dt, 1e6)
    # Integral of 0.4 S over the height, S = 1 up to the entry height h and (h / z)^2 above it: 0.4 (h + h - h^2 / H).
    entry = curve.entry / WEIGHT
    assert flow.stored_water() == pytest.approx(0.4 * 0.2 * (2 * entry - entry**2 / height), rel=2e-3)


@pytest.mark.parametrize("dt", [None, 0.0, -1.0, np.nan])
def test_a_step_needs_a_length(dt):
    domain, facet_tags = box((1.0, 1.0), (2, 2))
    flow = water.Seepage(domain, water.PorousSoil(1e-6), facet_tags, [water.Head(LEFT, 1.0)])
    with pytest.raises(InputError, match=f"dt is {dt}.*expected a positive number"):
        flow.advance(dt)


def test_the_saturation_is_that_of_each_soils_curve():
    """Hydrostatic suction above a water table in the middle of a block; soil that is always full beside it."""
    domain, _, facets = bridge.box_mesh(MPI.COMM_WORLD, (1.0, 2.0), (4, 8))
    cells = np.arange(len(bridge.mesh.tagged.tag_values(domain, None, 2)), dtype=np.int32)
    left = mesh.compute_midpoints(domain, 2, cells)[:, 0] < 0.5
    tags = mesh.meshtags(domain, 2, cells, np.where(left, 1, 2).astype(np.int32))
    curve = water.VanGenuchten(2e-4, 1.8, 0.1)
    soils = {1: water.PorousSoil(1e-6, retention=curve), 2: water.PorousSoil(1e-6)}
    flow = water.Seepage(domain, soils, facets, [water.Head(3, 1.0)], cell_tags=tags)
    flow.solve()
    points = np.array([[0.25, 0.5], [0.25, 1.5], [0.25, 2.0], [0.75, 1.5]])
    found = bridge.evaluate_at(points, s=flow.saturation())["s"][:, 0]
    expected = [1.0, *(float(curve.saturation(WEIGHT * height)) for height in (0.5, 1.0)), 1.0]
    np.testing.assert_allclose(found, expected, rtol=1e-6)


def test_inflows_do_not_depend_on_the_order_of_the_conditions():
    """Below a weir from x = 3 m to 5 m, at whose ends most of the water enters and leaves; nothing passes through its base."""
    domain, _, facet_tags = bridge.box_mesh(comm, (8.0, 2.0), (16, 4))
    domain.topology.create_connectivity(1, 0)
    facets = mesh.exterior_facet_indices(domain.topology)
    middles = domain.geometry.x[facet_nodes(domain, facets)].mean(axis=1)
    values = np.where(middles[:, 1] < 2.0 - 1e-9, 0, 1 + np.searchsorted((3.0, 5.0), middles[:, 0])).astype(np.int32)
    tags = bridge.name_tags(
        mesh.meshtags(domain, 1, facets[values > 0], values[values > 0]), dict(up=1, weir=2, down=3)
    )
    found = []
    conditions = [water.Flux("weir", 0.0), water.Reservoir("up", 5.0), water.SeepageFace("down")]
    for given in permutations(conditions):
        flow = water.Seepage(domain, water.PorousSoil(1e-5), tags, list(given))
        flow.solve()
        found.append([flow.inflow(name) for name in ("up", "weir", "down", None)])
    assert np.allclose(found, found[0], rtol=1e-9, atol=1e-14)
    up, weir, down, total = found[0]
    assert weir == 0.0 and up > 0 and up == pytest.approx(-down, rel=1e-9) and abs(total) < 1e-9 * up
