"""Cook's membrane in plane strain: which elements lock."""

import numpy as np
import pytest
from bridge_cases import MESHES
from mpi4py import MPI

import fenics_bridge as bridge

COMPRESSIBLE = {"young": 70.0, "poisson": 1 / 3, "unit_weight": 0.0, "traction": {2: (0.0, 6.25)}}
INCOMPRESSIBLE = {"young": 1.12499998125, "poisson": 0.499999975, "unit_weight": 0.0, "traction": {2: (0.0, 1 / 16)}}


def deflection(solve, point, divisions, material, **options):
    domain, _, facet_tags = bridge.read_mesh(MESHES / "cook.geo", MPI.COMM_WORLD, parameters={"divisions": divisions})
    solution = solve(domain, facet_tags, [bridge.fixed(1)], **material, **options)
    return solution.evaluate_at(np.array([point], dtype=float))["displacement"][0, 1]


def test_corner_of_the_compressible_membrane():
    """32.29 at (48, 60)."""
    quadratic = deflection(bridge.solve_elastic, (48, 60), 32, COMPRESSIBLE, degree=2)
    mixed = deflection(bridge.solve_nearly_incompressible, (48, 60), 32, COMPRESSIBLE)
    assert quadratic == pytest.approx(32.29, rel=5e-3)
    assert mixed == pytest.approx(32.29, rel=5e-3)


def test_taylor_hood_does_not_lock_where_linear_triangles_do():
    """16.44 at (48, 52), volume kept."""
    mixed = [deflection(bridge.solve_nearly_incompressible, (48, 52), n, INCOMPRESSIBLE) for n in (8, 16, 32)]
    linear = deflection(bridge.solve_elastic, (48, 52), 32, INCOMPRESSIBLE)
    assert mixed[0] < mixed[1] < mixed[2] == pytest.approx(16.44, rel=5e-3)
    assert linear < 0.3 * 16.44


def test_tag_and_material_are_checked():
    with pytest.raises(bridge.InputError, match="traction.*tag 7"):
        deflection(bridge.solve_elastic, (48, 52), 4, COMPRESSIBLE | {"traction": {7: (0.0, 1.0)}})
    with pytest.raises(bridge.InputError, match="poisson.*0"):
        deflection(bridge.solve_nearly_incompressible, (48, 52), 4, COMPRESSIBLE | {"poisson": 0.0})
