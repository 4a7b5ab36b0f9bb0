"""Box meshes from arrays, and the small things that the tests of the core share."""

from itertools import permutations, product

import numpy as np

import mpm_core as mpm

DIMS = (2, 3)


def box(counts, lengths=None, *, diagonals="one-way", shake=0.0, body=None, place=None, seed=0):
    """A box of ``counts`` squares or cubes with its low corner at the origin, each cut in D! simplices (Kuhn).

    Args:
        counts: number of squares or cubes along each axis.
        lengths: lengths of the box; 1 along each axis by default.
        diagonals: "one-way", or "alternating" from square to square.
        shake: inner nodes move by up to this share of a square's sides.
        body: (low, high) corners of a box; cells with their centre in there have tag 1, the others 0.
        place: maps the points (n, D) somewhere else, at the end.

    Returns:
        mpm.Mesh; facets have tag 2 axis + 1 on the low side of the box and 2 axis + 2 on the high side.
    """
    counts = np.asarray(counts)
    dim = len(counts)
    sides = counts + 1
    grid = np.indices(sides).reshape(dim, -1).T
    size = np.asarray(np.ones(dim) if lengths is None else lengths) / counts
    inner = ((grid > 0) & (grid < counts)).all(axis=1)
    moves = np.random.default_rng(seed).uniform(-shake, shake, grid.shape) * inner[:, None]
    points = (grid + moves) * size

    squares = np.indices(counts).reshape(dim, -1).T
    turned = squares % 2 if diagonals == "alternating" else np.zeros_like(squares)
    cells = []
    for order in permutations(range(dim)):
        corner = squares + turned
        nodes = [corner.copy()]
        for axis in order:
            corner[:, axis] += 1 - 2 * turned[:, axis]
            nodes.append(corner.copy())
        cells.append(np.stack([np.ravel_multi_index(tuple(n.T), sides) for n in nodes], axis=1))
    cells = np.stack(cells, axis=1).reshape(-1, dim + 1)

    facets, tags = [], []
    for vertex, axis, end in product(range(dim + 1), range(dim), (0, 1)):
        nodes = np.delete(cells, vertex, axis=1)
        on_side = (grid[nodes][:, :, axis] == end * counts[axis]).all(axis=1)
        facets.append(nodes[on_side])
        tags += [2 * axis + 1 + end] * int(on_side.sum())
    centres = points[cells].mean(axis=1)
    low, high = (np.full(dim, -np.inf), np.full(dim, np.inf)) if body is None else np.asarray(body)
    inside = ((centres > low) & (centres < high)).all(axis=1).astype(np.int32)
    return mpm.Mesh(
        points if place is None else place(points),
        cells.astype(np.int32),
        cell_tags=inside,
        facets=np.concatenate(facets).astype(np.int32),
        facet_tags=np.array(tags, dtype=np.int32),
    )


def one_cell(dim):
    """The reference triangle or tetrahedron; tag k + 1 is the facet opposite to vertex k."""
    corners = np.arange(dim + 1, dtype=np.int32)
    facets = np.array([np.delete(corners, k) for k in corners], dtype=np.int32)
    points = np.vstack([np.zeros(dim), np.eye(dim)])
    return mpm.Mesh(points, corners[None], facets=facets, facet_tags=corners + 1)


def sides(dim, axes=None):
    """(facet tag, unit normal) of the sides of a box, those of the given axes only."""
    axes = range(dim) if axes is None else axes
    return [(2 * axis + 1 + end, np.eye(dim)[axis]) for axis in axes for end in (0, 1)]


def rollers(model, axes=None, but=()):
    """Rollers on the sides of a box, except on those with the tags ``but``."""
    for tag, normal in sides(model.mesh.dim, axes):
        if tag not in but:
            model.roller(tag, normal)


def run(model, until, **options):
    """The last report of an explicit run."""
    *_, report = model.explicit(until, **options)
    return report


def by_id(model, name):
    """A field of the particles in the order of their numbers."""
    return getattr(model.particles, name)[np.argsort(model.particles.id)]


def moduli(young, poisson):
    """(lambda, G, modulus of the compression wave K + 4G/3)."""
    shear = young / (2 * (1 + poisson))
    bulk = young / (3 * (1 - 2 * poisson))
    return bulk - 2 * shear / 3, shear, bulk + 4 * shear / 3


def strain_energy(model, young, poisson):
    """Sum over particles of V sigma : C^-1 : sigma / 2 with C^-1 sigma = ((1 + nu) sigma - nu tr(sigma) I) / E."""
    stress, volume = model.particles.stress, model.particles.volume
    trace = stress[:, :3].sum(axis=1)
    squares = (stress[:, :3] ** 2).sum(axis=1) + 2 * (stress[:, 3:] ** 2).sum(axis=1)
    return float(np.sum(volume * ((1 + poisson) * squares - poisson * trace**2)) / (2 * young))


def averaged_over_nodes(model):
    """Change of the mean stress of each particle's cell when it is averaged as volumetric strains are, by id."""
    dim, cells, cell = model.mesh.dim, model.mesh.cells, model.particles.cell
    volume = np.bincount(cell, model.particles.volume, len(cells))
    total = np.bincount(cell, model.particles.volume * model.particles.stress[:, :dim].mean(axis=1), len(cells))
    at_nodes = np.zeros((2, len(model.mesh.points)))
    for vertex in cells.T:
        np.add.at(at_nodes, (slice(None), vertex), [total, volume])
    of_node = at_nodes[0] / np.maximum(at_nodes[1], 1e-300)
    change = of_node[cells].mean(axis=1) - total / np.maximum(volume, 1e-300)
    return change[cell][np.argsort(model.particles.id)]
