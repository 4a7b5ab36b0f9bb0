"""Elastic equilibrium, values at points, ground at rest."""

import numpy as np
import pytest
from bridge_cases import POISSON, UNIT_WEIGHT, YOUNG, column, column_settlement, column_stress, interior_points
from mpi4py import MPI
from petsc4py import PETSc

import fenics_bridge as bridge
from mpm_core import InputError


@pytest.mark.parametrize("dim", [2, 3])
def test_self_weight_column_is_exact_with_quadratic_elements(dim):
    domain, facet_tags, supports, height = column(dim)
    solution = bridge.solve_elastic(domain, facet_tags, supports, YOUNG, POISSON, UNIT_WEIGHT, degree=2)
    points = interior_points(200, dim)
    values = solution.evaluate_at(points)
    exact = column_stress(points[:, -1], dim)
    assert np.allclose(values["stress"], exact, atol=1e-8 * UNIT_WEIGHT)
    top = np.full((1, dim), 0.2)
    top[0, -1] = height
    assert solution.evaluate_at(top)["displacement"][0, -1] == pytest.approx(column_settlement(), rel=1e-10)


def test_self_weight_column_with_linear_elements_converges():
    errors = []
    for cell_size in (0.25, 0.125):
        domain, facet_tags, supports, _ = column(2, cell_size)
        solution = bridge.solve_elastic(domain, facet_tags, supports, YOUNG, POISSON, UNIT_WEIGHT)
        points = interior_points(500, 2)
        error = solution.evaluate_at(points)["stress"] - column_stress(points[:, 1], 2)
        errors.append(np.sqrt(np.mean(error**2)))
    assert errors[1] == pytest.approx(errors[0] / 2, rel=0.15)  # constant in each cell: first order
    inner = points[(abs(points - (0.25, 0.5)) < (0.125, 0.375)).all(axis=1)]  # away from the boundary
    smooth = solution.evaluate_at(inner, smooth=True)["stress"] - column_stress(inner[:, 1], 2)
    assert len(inner) > 50 and np.sqrt(np.mean(smooth**2)) < 0.1 * errors[1]


def test_prescribed_displacement_compresses_the_column_evenly():
    domain, facet_tags, supports, height = column(2)
    supports = [*supports, bridge.prescribed(bridge.CREST, (None, -0.01))]
    solution = bridge.solve_elastic(domain, facet_tags, supports, YOUNG, POISSON, unit_weight=0.0)
    oedometer = YOUNG * (1 - POISSON) / ((1 + POISSON) * (1 - 2 * POISSON))
    values = solution.evaluate_at(interior_points(50, 2))
    sideways = POISSON / (1 - POISSON)
    expected = -oedometer * 0.01 / height * np.array([sideways, 1, sideways, 0])
    assert np.allclose(values["stress"], expected, atol=1e-8 * YOUNG)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"young": 0.0}, "young"),
        ({"poisson": 0.5}, "poisson.*0.5"),
        ({"unit_weight": np.nan}, "unit_weight"),
        ({"degree": 3}, "degree.*3"),
        ({"supports": [bridge.fixed(99)]}, "supports.*tag 99"),
        ({"supports": [bridge.prescribed(1, (0.0, 0.0, 0.0))]}, "3 components, expected 2"),
    ],
)
def test_bad_arguments_are_named(change, words):
    domain, facet_tags, supports, _ = column(2)
    arguments = {"supports": supports, "young": YOUNG, "poisson": POISSON, "unit_weight": UNIT_WEIGHT} | change
    with pytest.raises(bridge.InputError, match=words):
        bridge.solve_elastic(domain, facet_tags, **arguments)


def test_options_of_petsc_choose_the_solver():
    domain, facet_tags, supports, _ = column(2)
    options = PETSc.Options("iterative_")
    options["ksp_type"], options["pc_type"], options["ksp_rtol"] = "cg", "jacobi", 1e-12

    def solved(prefix):
        return bridge.solve_elastic(domain, facet_tags, supports, YOUNG, POISSON, UNIT_WEIGHT, options_prefix=prefix)

    direct = solved("elastic_").displacement.x.array
    assert np.allclose(solved("iterative_").displacement.x.array, direct, atol=1e-9 * np.abs(direct).max())
    options["ksp_max_it"] = 2  # a direct solver would not mind
    with pytest.raises(RuntimeError, match="linear solver failed"):
        solved("iterative_")


def test_roller_across_no_axis_is_refused():
    with pytest.raises(bridge.InputError, match="normal.*axis"):
        bridge.roller(1, (1.0, 1.0))


def test_point_outside_is_named():
    domain, facet_tags, supports, _ = column(2)
    solution = bridge.solve_elastic(domain, facet_tags, supports, YOUNG, POISSON, UNIT_WEIGHT)
    with pytest.raises(bridge.InputError, match=r"point 1 .*\(2, 0.5\) m is outside"):
        solution.evaluate_at(np.array([[0.1, 0.5], [2.0, 0.5]]))


def test_points_on_nodes_and_edges_are_found():
    domain, *_ = column(2)
    nodes = domain.geometry.x[:, :2]
    search = bridge.PointSearch(domain, np.vstack([nodes, 0.5 * (nodes[:-1] + nodes[1:])]))
    assert search.found.all()


def test_ground_at_rest():
    points = np.array([[0.5, 0.2], [0.5, 0.9], [3.0, 0.5]])
    level = bridge.k0_stress(points, 1.0, UNIT_WEIGHT, 0.5)
    assert np.allclose(level[:, 1], -UNIT_WEIGHT * np.array([0.8, 0.1, 0.5]))
    assert np.allclose(level[:, [0, 2]], 0.5 * level[:, [1, 1]]) and not level[:, 3].any()
    slope = [(1.1, 1.0), (2.1, 0.0)]
    sloping = bridge.k0_stress(np.array([[0.0, 0.4], [1.6, 0.2], [2.0, 0.5]]), slope, UNIT_WEIGHT, 0.5)
    assert np.allclose(sloping[:, 1], -UNIT_WEIGHT * np.array([0.6, 0.3, 0.0]))
    assert np.allclose(bridge.k0_stress(points, lambda x: 1 + 0 * x, UNIT_WEIGHT, 0.5), level)
    assert bridge.k0_elastic(0.33) == pytest.approx(0.33 / 0.67)
    assert bridge.k0_jaky(30.0) == pytest.approx(0.5)


def test_layered_ground_at_rest():
    """1 m of 16 kN/m3 on 2 m of 20 kN/m3 on the rest of 22 kN/m3."""
    layers = [(-1.0, 16e3, 0.5), (-3.0, 20e3, 0.6), (-np.inf, 22e3, 0.4)]
    points = np.array([[0.0, -0.5], [0.0, -2.0], [0.0, -4.0], [0.0, 0.5]])
    stress = bridge.k0_layered_stress(points, 0.0, layers)
    vertical = -np.array([8e3, 16e3 + 20e3, 16e3 + 40e3 + 22e3, 0.0])
    assert np.allclose(stress[:, 1], vertical)
    assert np.allclose(stress[:, 0], vertical * [0.5, 0.6, 0.4, 0.5]) and np.allclose(stress[:, 2], stress[:, 0])
    half = bridge.k0_layered_stress(points[1:2], lambda x: -1.5 + 0 * x, layers)  # dug down into the second layer
    assert half[0, 1] == pytest.approx(-10e3)


def test_ground_at_rest_is_the_elastic_column():
    points = interior_points(20, 3)
    at_rest = bridge.k0_stress(points, 1.0, UNIT_WEIGHT, bridge.k0_elastic(POISSON))
    assert np.allclose(at_rest, column_stress(points[:, 2], 3))


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: bridge.k0_elastic(0.5), "poisson"),
        (lambda: bridge.k0_jaky(90), "friction_angle"),
        (lambda: bridge.k0_stress(np.zeros(3), 0.0, 1.0, 0.5), "points"),
        (lambda: bridge.k0_stress(np.zeros((1, 2)), 0.0, 1.0, -1), "k0"),
        (lambda: bridge.k0_stress(np.zeros((1, 2)), [(1, 0), (0, 0)], 1.0, 0.5), "surface"),
        (lambda: bridge.k0_stress(np.zeros((1, 2)), 0.0, np.inf, 0.5), "unit_weight"),
        (lambda: bridge.k0_stress(np.zeros((1, 2)), np.nan, 1.0, 0.5), "surface has heights of nan m"),
        (lambda: bridge.k0_stress(np.zeros((1, 2)), lambda x: np.nan * x, 1.0, 0.5), "surface has heights of nan m"),
        (lambda: bridge.k0_layered_stress(np.zeros((1, 2)), 0.0, [(-2, 1, 1), (-1, 1, 1)]), "from the top down"),
        (lambda: bridge.k0_layered_stress(np.zeros((1, 2)), 0.0, []), "layers"),
        (
            lambda: bridge.hydrostatic([[5.0, 1.0], [0.0, 2.0]]),
            r"level has points at x = \[5.0, 0.0\] m, expected x that rises",
        ),
        (lambda: bridge.hydrostatic([0.0, 1.0, 2.0]), r"level has shape \(3,\), expected \(k, 2\) points"),
    ],
)
def test_bad_ground_is_refused(call, words):
    with pytest.raises(bridge.InputError, match=words):
        call()


def test_everything_runs_on_a_mesh_that_dolfinx_made():
    from dolfinx import mesh

    domain = mesh.create_unit_square(MPI.COMM_WORLD, 4, 4)
    facets = mesh.locate_entities_boundary(domain, 1, lambda x: np.isclose(x[1], 0))
    facet_tags = mesh.meshtags(domain, 1, facets, np.full(len(facets), 1, np.int32))
    solution = bridge.solve_elastic(domain, facet_tags, [bridge.fixed(1)], YOUNG, 0.0, UNIT_WEIGHT, degree=2)
    exact = -UNIT_WEIGHT / (2 * YOUNG)
    assert solution.evaluate_at(np.array([[0.5, 1.0]]))["displacement"][0, 1] == pytest.approx(exact)


@pytest.mark.parametrize("traction", [("1", "2"), (1.0,), (0.0, np.nan)], ids=["text", "too short", "not finite"])
def test_wrong_tractions_are_named(traction):
    domain, facet_tags, supports, _ = column(2)
    with pytest.raises(InputError, match="traction is .*expected"):
        bridge.solve_elastic(domain, facet_tags, supports, YOUNG, POISSON, 0.0, traction={bridge.CREST: traction})


def test_angles_in_radians_are_warned_of():
    with pytest.warns(RuntimeWarning, match="friction_angle is 0.5236 degrees.* are 30.0 degrees"):
        bridge.k0_jaky(0.5236)
    slope = {"height": 5.0, "angle": 0.7854, "cohesion": 5e3, "friction_angle": 0.4363}
    with pytest.warns(RuntimeWarning, match="angle is 0.7854 degrees.* are 45.0 degrees"):
        bridge.log_spiral(**slope)
    with pytest.warns(RuntimeWarning, match="friction_angle is 0.4363 degrees.* are 25.0 degrees"):
        bridge.log_spiral_safety(**slope, unit_weight=18e3)
    with pytest.warns(RuntimeWarning, match="angle is 0.7854 degrees.* are 45.0 degrees"):
        bridge.slope_mesh(MPI.COMM_WORLD, height=0.1, angle=0.7854, cell_size=0.05, kind="gmsh")
