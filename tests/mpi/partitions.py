"""Meshes cut by hand into parts for several ranks, so that tests choose who owns what."""

import numpy as np
from core_cases import box

import mpm_core as mpm


def bands(centres, size):
    """Owners: bands of equal width along x, one for each rank."""
    low, high = centres[:, 0].min(), centres[:, 0].max()
    return np.minimum((size * (centres[:, 0] - low) / (high - low)).astype(int), size - 1)


def scattered(centres, size):
    """Owners: any cell may be anybody's."""
    return np.random.default_rng(7).integers(0, size, len(centres))


def one_does_all(centres, size):
    """Owners: the last rank has all cells, the others have none."""
    return np.full(len(centres), size - 1)


def spread_box(counts, lengths, comm, owners_of=bands, keep=None, origin=0.0, number_of=lambda node: node, **options):
    """``core_cases.box`` with its cells spread over the ranks, and the cells across their facets as ghosts.

    Args:
        owners_of: gives each cell its rank, from the cells' centres and the number of ranks.
        keep: tells which cells the mesh has, from their centres; all by default.
        origin: position of the box's corner.
        number_of: gives each node its number over all ranks, which meshes of DOLFINx choose by the partition.
    """
    whole = box(counts, lengths, **options)
    lengths = np.asarray(lengths, dtype=float)
    places = whole.points[whole.facets].mean(axis=1)
    on_low, on_high = np.isclose(places, 0), np.isclose(places, lengths)
    facet_tags = np.where(on_low.any(axis=1), 2 * on_low.argmax(axis=1) + 1, 2 * on_high.argmax(axis=1) + 2)
    centres = whole.points[whole.cells].mean(axis=1)
    owners = owners_of(centres, comm.size)
    kept_cells = np.ones(len(centres), dtype=bool) if keep is None else keep(centres)

    own = np.flatnonzero((owners == comm.rank) & kept_cells)
    facets_of = [np.sort(np.delete(whole.cells, k, axis=1), axis=1) for k in range(whole.dim + 1)]
    mine = {tuple(f) for facets in facets_of for f in facets[own]}
    touching = np.array([any(tuple(facets[c]) in mine for facets in facets_of) for c in range(len(owners))], dtype=bool)
    held = np.concatenate([own, np.flatnonzero(touching & (owners != comm.rank) & kept_cells)])
    nodes, cells = np.unique(whole.cells[held], return_inverse=True)
    known = {tuple(f) for facets in facets_of for f in facets[held]}
    kept = np.array([tuple(np.sort(f)) in known for f in whole.facets], dtype=bool)
    local = np.zeros(len(whole.points), dtype=np.int32)
    local[nodes] = np.arange(len(nodes))
    return mpm.Mesh(
        whole.points[nodes] + origin,
        cells.reshape(-1, whole.dim + 1).astype(np.int32),
        cell_tags=whole.cell_tags[held],
        facets=local[whole.facets[kept]],
        facet_tags=facet_tags[kept].astype(np.int32),
        global_nodes=number_of(nodes.astype(np.int64)),
        global_cells=held.astype(np.int64),
        cell_owners=owners[held].astype(np.int32),
        comm=comm,
    )


FIELDS = ("position", "velocity", "stress", "volume", "deviatoric_strain", "state", "displacement")


def all_by_id(model, names=FIELDS):
    """Fields of the particles of all ranks in the order of their numbers, on all ranks; "id" among them."""
    parts = model.comm.allgather({name: getattr(model.particles, name) for name in ("id", *names)})
    whole = {name: np.concatenate([part[name] for part in parts]) for name in ("id", *names)}
    order = np.argsort(whole["id"])
    return {name: values[order] for name, values in whole.items()}


def assert_same(one, other, relative=1e-8):
    """Fields of two runs agree, relative to the largest value of each field."""
    np.testing.assert_array_equal(one["id"], other["id"])
    for name, values in other.items():
        scale = np.abs(values).max(initial=1e-300)
        np.testing.assert_allclose(one[name] / scale, values / scale, rtol=0, atol=relative, err_msg=name)


def sliding_slope(comm, owners_of=bands, per_cell=3, laws=None):
    """A block of soil on a smooth base, on an incline: it slides, yields and spreads over several times its length.

    laws: of the model; a Mohr-Coulomb soil by default.
    """
    mesh = spread_box((24, 6), (2.4, 0.6), comm, owners_of, diagonals="alternating", body=((0.1, 0), (0.6, 0.4)))
    soil = mpm.MohrCoulomb(young=4e6, poisson=0.3, cohesion=1e3, friction_angle=25.0)
    model = mpm.Model(mesh, soil if laws is None else laws)
    model.seed(density=2000.0, per_cell=per_cell, cell_tag=1)
    model.roller(1, (1, 0))
    model.roller(3, (0, 1))
    model.set_gravity((2.5, -9.5))
    return model
