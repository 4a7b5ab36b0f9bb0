"""The first quasi-static linear elastic step on filled cells is the finite element solution."""

import numpy as np
import pytest
from core_cases import box
from implicit_cases import LEFT, floor, linear_elastic_solution

import mpm_core as mpm

SOIL = mpm.LinearElastic(young=1e6, poisson=0.3)
DENSITY, G = 2000.0, 9.81


@pytest.mark.parametrize(("dim", "n", "per_cell"), [(2, 8, 3), (2, 8, 10), (3, 4, 4)])
def test_first_step_is_the_finite_element_solution(dim, n, per_cell):
    mesh = box([n] * dim, shake=0.2)
    model = mpm.Model(mesh, SOIL)
    model.seed(density=DENSITY, per_cell=per_cell)
    model.fix(floor(dim))
    model.roller(LEFT, np.eye(dim)[0])
    model.set_gravity([0.0] * (dim - 1) + [-G])
    (report,) = model.implicit(1.0, dt=1.0, quasi_static=True)

    held = np.zeros(mesh.points.shape, dtype=bool)
    held[mesh.points[:, -1] < 1e-9] = True
    held[mesh.points[:, 0] < 1e-9, 0] = True
    expected = linear_elastic_solution(mesh.points, mesh.cells, SOIL, DENSITY * G, held)
    assert report.iterations == 1
    assert np.abs(1.0 * model.nodal("velocity") - expected).max() < 1e-9 * np.abs(expected).max()


def test_rollers_at_an_angle_turn_the_solution():
    """A box turned by 30 degrees with its supports and its gravity moves as the straight one does."""
    turn = np.array([[np.cos(np.pi / 6), -np.sin(np.pi / 6)], [np.sin(np.pi / 6), np.cos(np.pi / 6)]])
    moved = []
    for q in (np.eye(2), turn):
        mesh = box([6, 6], shake=0.2, place=lambda points, q=q: points @ q.T)
        model = mpm.Model(mesh, SOIL)
        model.seed(density=DENSITY, per_cell=3)
        model.roller(floor(2), q @ [0.0, 1.0])
        model.roller(LEFT, q @ [1.0, 0.0])
        model.set_gravity(q @ [1.0, -G])
        list(model.implicit(1.0, dt=1.0, quasi_static=True))
        moved.append(model.nodal("velocity") @ q)
    assert np.abs(moved[1] - moved[0]).max() < 1e-9 * np.abs(moved[0]).max()
