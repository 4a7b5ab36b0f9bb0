"""Ground cut in two along a border: the part near a footing, and the far field."""

import numpy as np
from core_cases import box

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge.mesh.tagged import MeshArrays, distributed_mesh, empty_arrays

BORDER, LOADED = 9, 8
"""Facet tags: of the sides of a part that do not lie on the sides of the box, and of the top of the box where x < 1 m"""
YOUNG, POISSON, DENSITY = 1e7, 0.3, 2000.0
SOIL = mpm.LinearElastic(young=YOUNG, poisson=POISSON)


def part_of_box(comm, counts, lengths, inside, shake=0.0, seed=0):
    """(domain, cell tags, facet tags) of the cells of a box with their centres where `inside`, (n, D) -> bool, says so.

    Facets on the sides of the box have its tags, 2 axis + 1 on the low side and 2 axis + 2 on the high side; the others BORDER.
    """
    dim = len(counts)
    if comm.rank > 0:
        return distributed_mesh(comm, empty_arrays(dim), dim)
    whole = box(counts, lengths, diagonals="alternating")
    kept = whole.cells[inside(whole.points[whole.cells].mean(axis=1))]
    nodes, cells = np.unique(kept, return_inverse=True)
    points, cells = whole.points[nodes], cells.reshape(kept.shape).astype(np.int64)
    every = np.concatenate([np.delete(cells, k, axis=1) for k in range(dim + 1)])
    _, first, times = np.unique(np.sort(every, axis=1), axis=0, return_index=True, return_counts=True)
    facets = every[first[times == 1]]
    inner = np.ones(len(points), dtype=bool)
    inner[facets] = False
    points[inner] += np.random.default_rng(seed).uniform(-shake, shake, (inner.sum(), dim)) * np.divide(lengths, counts)
    tags = np.full(len(facets), BORDER, dtype=np.int32)
    for axis in range(dim):
        for end, place in enumerate((0.0, lengths[axis])):
            tags[np.isclose(points[facets][:, :, axis], place).all(axis=1)] = 2 * axis + 1 + end
    tags[(tags == 2 * dim) & (points[facets][:, :, 0].max(axis=1) < 1 + 1e-9)] = LOADED
    return distributed_mesh(comm, MeshArrays(points, cells, np.ones(len(cells), np.int32), facets, tags), dim)


def particles(parts, gravity=None, law=SOIL, per_cell=None, geometry=None):
    """A model with particles in all cells of a part."""
    mesh = bridge.background_mesh(*parts)
    model = mpm.Model(mesh, law, geometry=geometry)
    model.seed(density=DENSITY, per_cell=per_cell or {2: 3, 3: 4}[mesh.dim])
    if gravity is not None:
        model.set_gravity(gravity)
    return model


def everywhere(x):
    return np.ones(len(x), dtype=bool)


def footing(comm, n, coarse=None, degree=2, reach=(5.0, 4.0), **options):
    """Half of a strip or circular load on ground 20 m wide and 10 m deep, with squares of 10 / n m: (model, far field).

    Args:
        coarse: squares along the depth of the far field; None for particles everywhere, without one.
        reach: width and depth of the part with particles, with a far field.
    """
    wide, deep = 20.0, 10.0

    def near(x):
        return (x[:, 0] < reach[0]) & (x[:, 1] > deep - reach[1])

    model = particles(part_of_box(comm, (2 * n, n), (wide, deep), everywhere if coarse is None else near), **options)
    model.roller(1, (1, 0))
    far = None
    if coarse is None:
        model.roller(2, (1, 0))
        model.fix(3)
    else:
        domain, _, facets = part_of_box(comm, (2 * coarse, coarse), (wide, deep), lambda x: ~near(x))
        supports = [bridge.roller(1, (1, 0)), bridge.roller(2, (1, 0)), bridge.fixed(3)]
        far = bridge.FarField(
            domain,
            facets,
            border=BORDER,
            supports=supports,
            young=YOUNG,
            poisson=POISSON,
            density=DENSITY,
            degree=degree,
            geometry=model.geometry,
        )
        far.attach(model, BORDER)
    return model, far
