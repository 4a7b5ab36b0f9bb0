"""Walls that hold water back: flow around a sheet pile against its closed form, and the force of the water on walls."""

import warnings

import numpy as np
import pytest
from dolfinx.mesh import compute_midpoints, meshtags
from mpi4py import MPI
from scipy.special import ellipk

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water

pytestmark = [pytest.mark.filterwarnings("ignore:the beam 'wall' " + text) for text in ("ends at", "is as stiff as")]

COMM = MPI.COMM_WORLD
LEFT, RIGHT, BOTTOM, TOP = 1, 2, 3, 4
DEPTH, LENGTH, GAMMA = 10.0, 40.0, 9810.0
SAND = water.PorousSoil(conductivity=1e-5, porosity=0.4)

SHEET_PILE = """
SetFactory("OpenCASCADE");
DefineConstant[ cell_size = 1, pile = 5 ];
Rectangle(1) = {-40, 0, 0, 80, 10};
Point(100) = {0, 10, 0};
Point(101) = {0, 10 - pile, 0};
Line(100) = {100, 101};
BooleanFragments{ Surface{1}; Delete; }{ Curve{100}; Delete; }
Physical Surface("soil") = {Surface{:}};
e = 1e-3;
Physical Curve("upstream") = {Curve In BoundingBox{-40 - e, 10 - e, -e, e, 10 + e, e}};
Physical Curve("downstream") = {Curve In BoundingBox{-e, 10 - e, -e, 40 + e, 10 + e, e}};
Physical Curve("pile") = {Curve In BoundingBox{-e, 10 - pile - e, -e, e, 10 + e, e}};
Mesh.MeshSizeMax = cell_size;
"""


def sheet_pile(tmp_path, cell_size=1.0, pile=5.0, walls=None):
    (tmp_path / "pile.geo").write_text(SHEET_PILE)
    mesh = bridge.read_mesh(tmp_path / "pile.geo", COMM, parameters={"cell_size": cell_size, "pile": pile})
    return bridge.soil_mesh(*mesh, tag="soil", walls=[[(0, DEPTH), (0, DEPTH - pile)]] if walls is None else walls)


def flow_around(mesh, degree=2):
    body, _, facets = mesh
    boundary = [water.Reservoir("upstream", DEPTH + 1.0), water.Reservoir("downstream", DEPTH)]
    flow = water.Seepage(body, SAND, facets, boundary, degree=degree)
    flow.solve()
    return flow


@pytest.mark.parametrize("pile", [2.5, 5.0, 7.5])
def test_the_flow_below_a_sheet_pile_has_its_closed_form(tmp_path, pile):
    """q / (k H) = K' / 2 K of the modulus sin(pi s / 2 T), in a layer of the depth T without an end (Harr 1962, section 5-5)."""
    parameter = np.sin(np.pi * pile / (2 * DEPTH)) ** 2
    exact = ellipk(1 - parameter) / (2 * ellipk(parameter))
    errors = []
    for cell_size in (1.0, 0.5):
        flow = flow_around(sheet_pile(tmp_path, cell_size, pile))
        assert flow.inflow("upstream") == pytest.approx(-flow.inflow("downstream"), rel=1e-9)
        errors.append(flow.inflow("upstream") / SAND.conductivity / exact - 1)
    assert 0 < errors[1] < 0.7 * errors[0] < 0.02  # the flow is singular at the tip: first order
    # At the pile it leaves with i = pi H / (4 K T k), from the same mapping; in a deep layer this is H / (pi s) (Harr 1962).
    exit_at_pile = np.pi / (4 * ellipk(parameter) * DEPTH * np.sqrt(parameter))
    assert water.exit_gradient(flow, "downstream") == pytest.approx(exit_at_pile, rel=0.03)
    assert water.exit_gradient(flow, "downstream", upward=True) == water.exit_gradient(flow, "downstream")
    assert water.exit_gradient(flow, "upstream") == 0.0
    # By symmetry the head below the pile is the mean of both, and those beside it are as far from it on both sides.
    heads = flow.pore_pressure()(np.array([[0.0, 1.0], [-1e-3, 9.0], [1e-3, 9.0]])) / GAMMA + (1.0, 9.0, 9.0) - DEPTH
    assert heads[0] == pytest.approx(0.5, abs=2e-3)
    assert heads[1] + heads[2] == pytest.approx(1.0, abs=2e-3) and heads[1] > heads[2] + 0.15


@pytest.mark.parametrize("degree", [1, 2])
def test_the_upward_part_of_the_gradient_is_that_which_lifts(degree):
    """Water leaves a block sideways with i = 3 / 4, and another upwards with i = 1 / 2."""
    domain, _, facets = bridge.box_mesh(COMM, (4.0, 4.0), (4, 4))
    for heads, out, exact in (
        ((LEFT, 9.0, RIGHT, 6.0), RIGHT, (0.75, 0.0)),
        ((BOTTOM, 6.0, TOP, 4.0), TOP, (0.5, 0.5)),
    ):
        boundary = [water.Head(*heads[:2]), water.Head(*heads[2:])]
        flow = water.Seepage(domain, SAND, facets, boundary, degree=degree)
        flow.solve()
        found = [water.exit_gradient(flow, out, upward) for upward in (False, True)]
        assert found == pytest.approx(exact, abs=1e-12)


def test_a_wall_parts_its_nodes_and_keeps_tags(tmp_path):
    whole, parted = sheet_pile(tmp_path, walls=[]), sheet_pile(tmp_path)
    n = [mesh.geometry.index_map().size_global for mesh, _, _ in (whole, parted)]
    assert n[1] == n[0] + 5  # those of the pile but for its tip
    count = lambda tags, name: len(tags.find(bridge.names_of(tags)[name][0]))
    for name in ("upstream", "downstream"):
        assert count(parted[2], name) == count(whole[2], name) == 40
    assert count(parted[2], "pile") == 2 * count(whole[2], "pile") == 10  # the facets of both sides
    assert flow_around(whole).inflow("upstream") > 3 * flow_around(parted).inflow("upstream")


def test_a_wall_from_side_to_side_parts_the_water():
    mesh = bridge.box_mesh(COMM, (4.0, 4.0), (8, 8))
    ring = [(1, 1), (3, 1), (3, 3), (1, 3), (1, 1)]
    body, _, _ = bridge.soil_mesh(*mesh, tag=bridge.BODY, walls=[ring])
    assert body.geometry.index_map().size_global == mesh[0].geometry.index_map().size_global + 16
    half = bridge.soil_mesh(*mesh, tag=bridge.BODY, walls=[[(2.0, 0.0), (2.0, 4.0)]])
    flow = water.Seepage(half[0], SAND, half[2], [water.Head(LEFT, 6.0), water.Head(RIGHT, 5.0)])
    flow.solve()
    assert np.allclose(flow.pore_pressure()(np.array([[1.9, 1.0], [2.1, 1.0]])), GAMMA * np.array([5.0, 4.0]))
    assert abs(flow.inflow(LEFT)) < 1e-15
    across = water.Seepage(mesh[0], SAND, mesh[2], [water.Head(LEFT, 6.0), water.Head(RIGHT, 5.0)])
    across.solve()
    assert water.exit_gradient(across, RIGHT) == pytest.approx(0.25)
    assert water.exit_gradient(across, RIGHT, upward=True) < 1e-12


@pytest.mark.parametrize(
    "condition", [None, water.SeepageFace(RIGHT), water.Reservoir(RIGHT, -1.0), water.Flux(RIGHT, 1e-6)]
)
@pytest.mark.parametrize("degree", [1, 2])
def test_soil_that_walls_part_from_all_heads_is_refused(condition, degree):
    """Nothing says what the pressure behind the wall is: the matrix is singular there."""
    mesh = bridge.box_mesh(COMM, (4.0, 4.0), (8, 8))
    body, _, facets = bridge.soil_mesh(*mesh, tag=bridge.BODY, walls=[[(2.0, 0.0), (2.0, 4.0)]])
    boundary = [water.Head(LEFT, 6.0), *([condition] if condition else [])]
    flow = water.Seepage(body, SAND, facets, boundary, degree=degree)
    with pytest.raises(
        mpm.InputError, match=r"the steady pressure is undetermined in the soil about \(3, 2\) m, which walls part"
    ):
        flow.solve()
    flow.boundary = [*boundary, water.Head(BOTTOM, 5.0)]
    flow.solve()


@pytest.mark.parametrize(
    ("walls", "message"),
    [
        ([[(1.1, 0.0), (1.1, 2.0)]], r"walls: the line 0 goes through a cell at \(1.1, "),
        ([[(1.0, 0.0), (1.0, 1.7)]], r"walls: the line 0 has the point \(1, 1.7\) m between the nodes of the mesh"),
        ({"pile": [(1.1, 0.0), (1.1, 2.0)]}, r"walls: 'pile' goes through a cell at \(1.1, "),
        ([[(1.0, 0.0)]], "expected two or more finite points"),
        ([[(1.0, 0.0), (1.0, np.nan)]], "expected two or more finite points"),
        ([[(1.0, 0.0, 0.0), (1.0, 1.0, 0.0)]], "expected two or more finite points"),
        ([[(1.0, 0.0), (1.0, 0.0), (1.0, 2.0)]], "expected points that differ from the one before"),
        (mpm.beam([(1.0, 0.0), (1.0, 2.0)], 1e9, 1e6), "expected a list of lines"),
        (3.0, "expected a list of lines"),
    ],
)
def test_walls_that_are_no_lines_of_the_mesh_are_refused(walls, message):
    mesh = bridge.box_mesh(COMM, (4.0, 4.0), (8, 8))
    with pytest.raises(mpm.InputError, match=message):
        bridge.soil_mesh(*mesh, tag=bridge.BODY, walls=walls)


def test_a_wall_that_is_not_in_the_soil_is_said():
    mesh = bridge.box_mesh(COMM, (4.0, 4.0), (8, 8))
    with pytest.warns(RuntimeWarning, match=r"walls: the line 1 from \(20, 0\) to \(20, 2\) m is not in the soil"):
        bridge.soil_mesh(*mesh, tag=bridge.BODY, walls=[[(2.0, 0.0), (2.0, 2.0)], [(20.0, 0.0), (20.0, 2.0)]])


# --- the force of water on walls -------------------------------------------------------------------------------------

LAW = mpm.LinearElastic(young=1e6, poisson=0.25)
MODULUS = 1e6 * 0.75 / (1.25 * 0.5)  # E (1 - nu) / ((1 + nu) (1 - 2 nu))


def halves(degree=2, impervious=True):
    """Two blocks, 2 m long each, on rollers, with a wall between them that has next to no stiffness; and their tags."""
    domain, _, facet_tags = bridge.box_mesh(COMM, (4.0, 1.0), (8, 2))
    cells = np.arange(bridge.original_cells(domain).size, dtype=np.int32)
    right = compute_midpoints(domain, 2, cells)[:, 0] > 2.0
    tags = meshtags(domain, 2, cells, np.where(right, 2, 1).astype(np.int32))
    supports = [
        bridge.roller(LEFT, (1, 0)),
        bridge.roller(RIGHT, (1, 0)),
        bridge.roller(BOTTOM, (0, 1)),
        bridge.roller(TOP, (0, 1)),
    ]
    fem = bridge.QuasiStatic(domain, LAW, facet_tags, supports, degree, cell_tags=tags)
    wall = mpm.beam([(2.0, 0.0), (2.0, 1.0)], 1e-3, 1e-3, spacing=0.5, impervious=impervious)
    return fem, {"wall": wall}


def stepped(left, right):
    return lambda x: np.where(x[:, 0] < 2.0, left, right)


@pytest.mark.parametrize("degree", [1, 2])
def test_a_wall_moves_by_the_difference_of_the_pressures_beside_it(degree):
    """Both blocks are compressed by the same strain: u = L (p_left - p_right) / 2 M; the supports carry total stresses."""
    fem, members = halves(degree)
    fem.reconfigure(members=members, pore_pressure=stepped(20e3, 8e3))
    fem.solve(bridge.Load())
    moved = fem.member_forces("wall").displacement
    assert np.allclose(moved[:, 0], 2.0 * 12e3 / (2 * MODULUS), rtol=1e-8)
    assert fem.reaction(LEFT)[0] == pytest.approx(-(20e3 - 6e3), rel=1e-8)  # the pressure less the effective tension
    assert fem.reaction(RIGHT)[0] == pytest.approx(8e3 + 6e3, rel=1e-8)


@pytest.mark.parametrize("degree", [1, 2])
def test_pressures_that_jump_below_a_wall_too_push_the_soil_there(degree):
    """The wall ends in the soil, and the blocks below are as far out of balance as those beside it: u = L (p_left - p_right) / 2 M."""
    fem, _ = halves(degree)
    wall = mpm.beam([(2.0, 1.0), (2.0, 0.5)], 1e-3, 1e-3, spacing=0.5, impervious=True)
    fem.reconfigure(members={"wall": wall}, pore_pressure=stepped(20e3, 8e3))
    fem.solve(bridge.Load())
    moved = fem.evaluate_at(np.array([[2.0, 0.0], [2.0, 0.5], [2.0, 1.0]]))["displacement"][:, 0]
    assert np.allclose(moved, 2.0 * 12e3 / (2 * MODULUS), rtol=1e-8)
    assert fem.reaction(LEFT)[0] == pytest.approx(-fem.reaction(RIGHT)[0], rel=1e-8)


@pytest.mark.parametrize("beside", [0.0, 8e3])
def test_the_exposed_face_of_a_wall_has_the_water_of_the_pit(beside):
    """u = L (p - p_pit) / M."""
    fem, members = halves()
    fem.reconfigure(off=[2], members=members, pore_pressure=stepped(20e3, beside))
    fem.solve(bridge.Load())
    expected = 2.0 * (20e3 - beside) / MODULUS
    assert np.allclose(fem.member_forces("wall").displacement[:, 0], expected, rtol=1e-8)
    # A later change of the soil keeps the pressures, and so does one that takes the wall away.
    fem.reconfigure(members={})
    fem.solve(bridge.Load())
    moved = fem.evaluate_at(np.array([[2.0, 0.5]]))["displacement"][0, 0]
    assert moved == pytest.approx(expected, rel=1e-8)


def test_water_stands_before_a_wall_that_lets_it_through():
    """The water that presses on the exposed face from outside balances that in the pores."""
    fem, members = halves(impervious=False)
    fem.reconfigure(off=[2], members=members, pore_pressure=lambda x: np.full(len(x), 20e3))
    fem.solve(bridge.Load())
    assert np.allclose(fem.member_forces("wall").displacement, 0.0, atol=1e-12)


def test_the_outer_face_of_a_wall_at_the_boundary_is_dry():
    domain, cell_tags, facet_tags = bridge.box_mesh(COMM, (2.0, 1.0), (4, 2))
    supports = [bridge.roller(LEFT, (1, 0)), bridge.roller(BOTTOM, (0, 1)), bridge.roller(TOP, (0, 1))]
    fem = bridge.QuasiStatic(domain, LAW, facet_tags, supports, cell_tags=cell_tags)
    wall = mpm.beam([(2.0, 0.0), (2.0, 1.0)], 1e-3, 1e-3, spacing=0.5, impervious=True)
    fem.reconfigure(members={"wall": wall}, pore_pressure=lambda x: np.full(len(x), 20e3))
    fem.solve(bridge.Load())
    assert np.allclose(fem.member_forces("wall").displacement[:, 0], 2.0 * 20e3 / MODULUS, rtol=1e-8)


@pytest.mark.parametrize("impervious", [False, True])
def test_a_support_along_a_wall_carries_the_total_stress_once(impervious):
    """Soil that is held all around and does not move leaves its water to the supports."""
    fem, _ = halves()
    wall = mpm.beam([(4.0, 0.0), (4.0, 1.0)], 1e-3, 1e-3, spacing=0.5, impervious=impervious)
    fem.reconfigure(members={"wall": wall}, pore_pressure=lambda x: np.full(len(x), 20e3))
    fem.solve(bridge.Load())
    assert fem.reaction(LEFT)[0] == pytest.approx(-20e3, rel=1e-8)
    assert fem.reaction(RIGHT)[0] == pytest.approx(20e3, rel=1e-8)


def test_suction_beside_a_wall_acts_on_it():
    fem, members = halves()
    fem.reconfigure(off=[2], members=members, pore_pressure=stepped(-5e3, 0.0))
    fem.solve(bridge.Load())
    assert np.allclose(fem.member_forces("wall").displacement[:, 0], -2.0 * 5e3 / MODULUS, rtol=1e-8)


@pytest.mark.parametrize("degree", [1, 2])
def test_water_below_soil_without_water_lifts_it_beside_a_wall(degree):
    """Water in the lower half of a column only: it swells by p h / M, the upper half is lifted, and its base carries no total stress."""
    domain, _, facet_tags = bridge.box_mesh(COMM, (4.0, 2.0), (8, 4))
    supports = [bridge.roller(LEFT, (1, 0)), bridge.roller(RIGHT, (1, 0)), bridge.fixed(BOTTOM)]
    fem = bridge.QuasiStatic(domain, LAW, facet_tags, supports, degree)
    wall = mpm.beam([(2.0, 2.0), (2.0, 1.0)], 1e-3, 1e-3, spacing=0.5, impervious=True)
    fem.reconfigure(members={"wall": wall}, pore_pressure=lambda x: np.where(x[:, 1] < 1.0, 20e3, 0.0))
    fem.solve(bridge.Load())
    heave = fem.evaluate_at(np.array([[0.7, 1.0], [0.7, 2.0], [3.1, 2.0]]))["displacement"][:, 1]
    assert np.allclose(heave, 20e3 * 1.0 / MODULUS, rtol=1e-8)
    assert abs(fem.reaction(BOTTOM)[1]) < 1e-6 * 20e3


def test_an_impervious_wall_beside_the_mesh_is_refused_where_there_is_water():
    fem, _ = halves()
    wall = {"wall": mpm.beam([(2.2, 0.0), (2.2, 1.0)], 1e6, 1e6, spacing=0.5, impervious=True)}
    with pytest.raises(mpm.InputError, match=r"members: the impervious wall 'wall' goes through a cell at \(2.2, "):
        fem.reconfigure(members=wall, pore_pressure=stepped(1e3, 0.0))
    assert not fem.members
    fem.reconfigure(members=wall)  # without water it may be anywhere


def test_soil_that_would_come_apart_is_refused():
    mesh = bridge.box_mesh(COMM, (4.0, 4.0), (8, 8))
    body, cells, facets = bridge.soil_mesh(*mesh, tag=bridge.BODY, walls=[[(2.0, 4.0), (2.0, 2.0)]])
    part = bridge.soil_mesh(body, cells, facets, tag=bridge.BODY)[0]
    for parted in (body, part):
        for use in (
            lambda domain=parted: bridge.QuasiStatic(domain, LAW, facets, []),
            lambda domain=parted: bridge.background_mesh(domain),
            lambda domain=parted: water.Consolidation(domain, LAW, SAND, facets, [], []),
        ):
            with pytest.raises(mpm.InputError, match="domain is parted along walls, where its soil would come apart"):
                use()


@pytest.mark.parametrize("undrained", [True, False])
def test_particles_take_both_sides_of_a_wall_over_and_say_where_water_flows_through(undrained):
    mesh = bridge.box_mesh(COMM, (4.0, 3.0), (16, 12), body=((0.0, 0.0), (4.0, 2.0)))
    body, cells, facets = bridge.soil_mesh(*mesh, tag=bridge.BODY)
    supports = [bridge.roller(LEFT, (1, 0)), bridge.roller(RIGHT, (1, 0)), bridge.fixed(BOTTOM)]
    fem = bridge.QuasiStatic(body, LAW, facets, supports, 1, cell_tags=cells)
    wall = mpm.beam([(2.0, 2.0), (2.0, 1.0)], 1e8, 1e6, impervious=True)
    # From the end of the wall on, at y = 1 m, the pressure on its right falls by half as much again as that on its left.
    slope = lambda x: np.where((x[:, 0] < 2.0) | (x[:, 1] < 1.0), 1.0, 1.5)
    fem.reconfigure(
        members={"wall": wall}, pore_pressure=lambda x: GAMMA * np.maximum(0.75 - slope(x) * (x[:, 1] - 1), 0.0)
    )
    fem.solve(bridge.Load(unit_weight=20e3))
    assert np.abs(fem.member_forces("wall").moment).max() > 10.0
    model = mpm.Model(bridge.background_mesh(*mesh), mpm.Undrained(LAW, porosity=0.4) if undrained else LAW)
    model.seed(density=20e3 / 9.81, per_cell=4, cell_tag=bridge.BODY)
    model.roller(LEFT, (1, 0))
    model.roller(RIGHT, (1, 0))
    model.fix(BOTTOM)
    model.set_gravity((0.0, -9.81))
    if not undrained:
        model.add_water(porosity=0.4, conductivity=1e-5)
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        report = bridge.initialise(model, fem, equilibrate=False)
    assert ("water flows through the beam 'wall'" in " ".join(str(one.message) for one in found)) is not undrained
    assert report.unbalanced_ratio < 1e-3
