"""Finding the cell of a point, against trying all cells; and that shape functions add up to one."""

import numpy as np
import pytest
from core_cases import DIMS, box, run
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import Delaunay

import mpm_core as mpm


def delaunay_mesh(dim, seed, stretch):
    """Delaunay's mesh of random points; flat cells at its hull are left out, so it may have dents."""
    points = np.random.default_rng(seed).random((30 if dim == 2 else 40, dim)) * [1.0, stretch, 1.0][:dim]
    cells = Delaunay(points).simplices
    edges = points[cells[:, 1:]] - points[cells[:, :1]]
    volumes = np.abs(np.linalg.det(edges))
    return mpm.Mesh(points, cells[volumes > 1e-6 * volumes.max()].astype(np.int32))


def smallest_shape_functions(mesh, points):
    """Smallest shape function of each cell at each point: (points, cells)."""
    corners = mesh.points[mesh.cells]
    edges = np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2)
    offsets = points[:, None, :, None] - corners[None, :, 0, :, None]
    rest = np.linalg.solve(np.broadcast_to(edges, (len(points), *edges.shape)), offsets)[..., 0]
    return np.minimum(rest.min(axis=2), 1 - rest.sum(axis=2))


@settings(max_examples=25, deadline=None, derandomize=True)
@given(dim=st.sampled_from(DIMS), seed=st.integers(0, 10**6), stretch=st.sampled_from([1.0, 0.05, 30.0]))
def test_search_agrees_with_trying_all_cells(dim, seed, stretch):
    mesh = delaunay_mesh(dim, seed, stretch)
    random = np.random.default_rng(seed + 1)
    points = random.uniform(-0.1, 1.1, (200, dim)) * [1.0, stretch, 1.0][:dim]
    found = mesh.cells_of(points)
    smallest = smallest_shape_functions(mesh, points)
    best = smallest.max(axis=1)
    clear = np.abs(best) > 1e-9  # not on a facet
    assert np.array_equal(found[clear] >= 0, best[clear] > 0)
    held = found >= 0
    assert np.all(smallest[held, found[held]] > -1e-9)
    # Points on facets and vertices are inside of some cell that touches them.
    on_facets = mesh.points[mesh.cells[:, :dim]].mean(axis=1)
    for on_boundary in (on_facets, mesh.points[np.unique(mesh.cells)]):
        found = mesh.cells_of(on_boundary)
        assert np.all(found >= 0)
        assert np.all(smallest_shape_functions(mesh, on_boundary)[np.arange(len(found)), found] > -1e-9)


@settings(max_examples=10, deadline=None, derandomize=True)
@given(dim=st.sampled_from(DIMS), seed=st.integers(0, 10**6))
def test_moving_particles_are_in_the_cell_that_they_say(dim, seed):
    mesh = box([6] * dim, shake=0.15, seed=seed)
    model = mpm.Model(mesh, mpm.LinearElastic(young=1.0, poisson=0.0))
    random = np.random.default_rng(seed)
    model.seed_points(random.uniform(0.1, 0.4, (40, dim)), np.full(40, 1e-3), density=1e6)
    model.particles.set("velocity", random.uniform(0.2, 1.2, (40, dim)))
    run(model, 0.4, dt=0.1, allow_unstable=True)  # far: a walk over several cells in each step
    smallest = smallest_shape_functions(mesh, model.particles.position)
    assert np.all(smallest[np.arange(40), model.particles.cell] > -1e-9)


@pytest.mark.parametrize("dim", DIMS)
def test_nodes_share_the_mass_of_the_particles(dim):
    # sum_i N_i = 1, N_i >= 0: the nodal masses (11) add up, and to the same centre of mass, as sum_i N_i x_i = x.
    mesh = box([4] * dim, shake=0.15)
    model = mpm.Model(mesh, mpm.LinearElastic(young=1.0, poisson=0.0))
    random = np.random.default_rng(6)
    points, volumes = random.random((200, dim)), random.uniform(1, 2, 200)
    model.seed_points(points, volumes, density=3.0)
    run(model, 1e-6, dt=1e-6)
    mass = model.nodal("mass")
    assert mass.min() >= 0
    assert mass.sum() == pytest.approx(3 * volumes.sum(), rel=1e-13)
    assert mass @ mesh.points == pytest.approx(3 * volumes @ points, rel=1e-12)


@pytest.mark.parametrize("dim", DIMS)
def test_points_on_facets_are_found_where_coordinates_are_those_of_a_map(dim):
    # Positions have a round-off of 1e-9 m there, 1e-8 of these cells; particles on a regular grid lie on facets.
    origin = np.array([691000.0, 5335000.0, 700.0])[:dim]
    near = box([8] * dim, [0.8] * dim)
    mesh = mpm.Mesh(near.points + origin, near.cells)
    points = 0.025 * (np.indices([32] * dim).reshape(dim, -1).T + 0.5) + origin
    found = mesh.cells_of(points)
    assert (found >= 0).all()
    step = {2: 7, 3: 61}[dim]  # a table of points and cells
    some = points[::step]
    assert smallest_shape_functions(mesh, some)[np.arange(len(some)), found[::step]].min() > -1e-7
    outside = points[points[:, 0] > origin[0] + 0.78] + 0.025 * np.eye(dim)[0]
    assert (mesh.cells_of(outside) == -1).all()
