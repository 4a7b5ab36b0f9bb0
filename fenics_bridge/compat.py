"""Differences between the supported versions of DOLFINx: 0.5, 0.9 and 0.10.

Every choice depends on the functions of the installed DOLFINx, never on its version string. The rest of the
bridge calls these functions, and otherwise uses only the interface that all versions have in common.
Tested with 0.5.2 and 0.9.0; the functions for 0.10 follow its documentation.
"""

from __future__ import annotations

import inspect
import os
from typing import Any

import dolfinx
import numpy as np
import ufl
from dolfinx import cpp, fem, geometry, graph, io, la, mesh
from dolfinx.mesh import GhostMode
from mpi4py import MPI
from numpy.typing import ArrayLike, NDArray

try:  # newer versions
    from dolfinx.mesh import MeshTags
except ImportError:  # 0.5
    from dolfinx.mesh import MeshTagsMetaClass as MeshTags

try:  # 0.7 and later
    import basix.ufl as basix_ufl
except ModuleNotFoundError:  # 0.5
    basix_ufl = None

SHAPE = {2: "triangle", 3: "tetrahedron"}


def create_mesh(comm: MPI.Comm, points: NDArray[np.float64], cells: NDArray[np.int64], dim: int) -> mesh.Mesh:
    """Mesh of linear simplices, with a new partition, each rank keeping the neighbours of its cells as ghosts. Collective.

    Args:
        comm: the ranks that share the mesh.
        points: this rank's part of the nodes [m], shape (n, dim); nodes are numbered through in order of rank.
        cells: this rank's part of the cells, by those numbers, shape (m, dim + 1).
        dim: 2 for triangles, 3 for tetrahedra.
    """
    # PT-SCOTCH 7 takes all cores of the machine for each rank, and its threads cut a mesh differently each time.
    os.environ.setdefault("SCOTCH_PTHREAD_NUMBER", "1")
    cells = np.ascontiguousarray(cells, dtype=np.int64)
    points = np.ascontiguousarray(points, dtype=np.float64)
    if basix_ufl is not None:
        element = ufl.Mesh(basix_ufl.element("Lagrange", SHAPE[dim], 1, shape=(dim,)))
        return mesh.create_mesh(comm, cells=cells, x=points, e=element, partitioner=_partitioner())
    cell = ufl.Cell(SHAPE[dim], geometric_dimension=dim)
    # FFCx gives the mesh of a form that it compiles this variant: named at once, forms have one name in the cache, not two.
    element = ufl.Mesh(ufl.VectorElement("Lagrange", cell, 1, variant="equispaced"))
    return mesh.create_mesh(comm, cells, points, element, ghost_mode=GhostMode.shared_facet)


def _partitioner() -> Any:
    try:
        return mesh.create_cell_partitioner(GhostMode.shared_facet)
    except TypeError:  # newer ones also ask how many cells share a facet at most
        return mesh.create_cell_partitioner(GhostMode.shared_facet, 2)


def tags_from_nodes(domain: mesh.Mesh, dim: int, entities: NDArray[np.int64], values: NDArray[np.int32]) -> MeshTags:
    """Mesh tags on the entities of dimension `dim` that have the given nodes, wherever these entities live. Collective.

    Ghost entities receive their tag too.

    Args:
        domain: mesh of DOLFINx.
        dim: dimension of the entities.
        entities: node numbers of the entities as they were given to `create_mesh`, on any rank, shape (k, dim + 1).
        values: their tags, shape (k,).
    """
    entities = np.ascontiguousarray(entities, dtype=np.int64).reshape(-1, dim + 1)
    values = np.ascontiguousarray(values, dtype=np.int32)
    owner = domain if hasattr(domain, "_cpp_object") else domain._mesh  # a Python function since 0.8
    local, local_values = io.distribute_entity_data(owner, dim, entities, values)
    tdim = domain.topology.dim
    domain.topology.create_connectivity(dim, 0)
    domain.topology.create_connectivity(dim, tdim)
    if hasattr(graph, "adjacencylist"):
        adjacency = graph.adjacencylist(local)
    else:
        adjacency = cpp.graph.AdjacencyList_int32(local)
    tags = mesh.meshtags_from_entities(domain, dim, adjacency, np.asarray(local_values, dtype=np.int32))
    return mesh.meshtags(domain, dim, tags.indices, tags.values)  # an object of Python, to which names can be given


def are_tags_of(tags: Any, domain: mesh.Mesh) -> bool:
    """Whether tags are those of entities of this mesh, not of another one."""
    topologies = (tags.mesh.topology if hasattr(tags, "mesh") else tags.topology), domain.topology
    one, other = (getattr(topology, "_cpp_object", topology) for topology in topologies)
    return one is other


def cell_nodes(domain: mesh.Mesh) -> NDArray[np.int32]:
    """Geometry nodes of each cell on this rank, ghosts last: (m, D + 1)."""
    nodes = domain.geometry.dofmap
    return nodes if isinstance(nodes, np.ndarray) else nodes.array.reshape(-1, domain.topology.dim + 1)


def facet_nodes(domain: mesh.Mesh, facets: ArrayLike) -> NDArray[np.int32]:
    """Geometry nodes of the given facets: (k, D)."""
    dim = domain.topology.dim
    domain.topology.create_connectivity(dim - 1, dim)
    domain.topology.create_connectivity(dim, dim - 1)
    domain.topology.create_connectivity(dim - 1, 0)
    facets = np.asarray(facets, dtype=np.int32)
    if len(facets) == 0:  # 0.9 divides by their number
        return np.zeros((0, dim), dtype=np.int32)
    if hasattr(mesh, "entities_to_geometry"):
        nodes = mesh.entities_to_geometry(domain, dim - 1, facets)
    else:
        nodes = cpp.mesh.entities_to_geometry(domain._mesh, dim - 1, facets, False)
    return np.asarray(nodes, dtype=np.int32).reshape(-1, dim)


def add_shared(vector: Any) -> None:
    """Sum a vector's ghost entries into their owners, then give the owners' sums to the ghosts. Collective."""
    mode = la.InsertMode.add if hasattr(la, "InsertMode") else la.ScatterMode.add
    vector.scatter_reverse(mode)
    vector.scatter_forward()


def forward(vector: Any) -> None:
    """Give the owners' values to the ghosts. Collective."""
    vector.scatter_forward()


def measure_beside(domain: mesh.Mesh, others: Any) -> Any:
    """Measure dx of a form that is added to others, or to 0: since DOLFINx 0.8 all of a form must have the same cell tags."""
    integrals = others.integrals_by_type("cell") if isinstance(others, ufl.Form) else ()
    tags = next((one.subdomain_data() for one in integrals if one.subdomain_data() is not None), None)
    return ufl.Measure("dx", domain=domain, subdomain_data=tags)


def function_space(domain: mesh.Mesh, family: str, degree: int, size: int | None = None) -> Any:
    """Lagrange space, continuous ("Lagrange") or not ("DG"), with `size` components per node (None: scalar)."""
    if hasattr(fem, "functionspace"):
        element = (family, degree) if size is None else (family, degree, (size,))
        return fem.functionspace(domain, element)
    if size is None:
        return fem.FunctionSpace(domain, (family, degree))
    return fem.VectorFunctionSpace(domain, (family, degree), dim=size)


def displacement_pressure_space(domain: mesh.Mesh, degree: int) -> Any:
    """Displacement, continuous and of degree 1 or 2, with pressure, continuous and linear; degree 2 is Taylor and Hood's."""
    dim = domain.geometry.dim
    if basix_ufl is not None:
        cell = domain.basix_cell()
        parts = [basix_ufl.element("Lagrange", cell, degree, shape=(dim,)), basix_ufl.element("Lagrange", cell, 1)]
        return fem.functionspace(domain, basix_ufl.mixed_element(parts))
    cell = domain.ufl_cell()
    parts = [ufl.VectorElement("Lagrange", cell, degree), ufl.FiniteElement("Lagrange", cell, 1)]
    return fem.FunctionSpace(domain, ufl.MixedElement(parts))


def quadrature_space(domain: mesh.Mesh, degree: int, size: int) -> Any:
    """Space whose values live at the points of the quadrature rule of the given degree, `size` of them per point."""
    if basix_ufl is not None:
        cell = domain.basix_cell()
        element = basix_ufl.quadrature_element(cell, value_shape=(size,), scheme="default", degree=degree)
        return fem.functionspace(domain, element)
    element = ufl.VectorElement("Quadrature", domain.ufl_cell(), degree, dim=size, quad_scheme="default")
    return fem.FunctionSpace(domain, element)


def quadrature_rule(domain: mesh.Mesh, degree: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Points (q, D) and weights (q,) of the quadrature rule of the given degree in the reference cell."""
    if basix_ufl is not None:
        import basix

        return basix.make_quadrature(domain.basix_cell(), degree)
    from ffcx.element_interface import create_quadrature

    return create_quadrature(domain.topology.cell_name(), degree, "default")


def interpolation_points(space: Any) -> NDArray[np.float64]:
    """Points of the reference cell at which a space interpolates: (q, D)."""
    points = space.element.interpolation_points
    return points() if callable(points) else points


def degree_of(space: Any) -> int:
    """Degree of a Lagrange space."""
    degree = space.ufl_element().degree
    return int(degree() if callable(degree) else degree)


def cell_dofs(space: Any) -> NDArray[np.int32]:
    """Blocked degrees of freedom of each cell on this rank, ghosts last: (m, k)."""
    dofs = space.dofmap.list
    if isinstance(dofs, np.ndarray):
        return dofs
    return dofs.array.reshape(dofs.num_nodes, space.dofmap.dof_layout.num_dofs)  # a rank may have no cells


def expression_values(expression: Any, domain: mesh.Mesh, cells: ArrayLike) -> NDArray[np.float64]:
    """Values of a compiled expression in the given cells: (number of cells, points times components)."""
    cells = np.asarray(cells, dtype=np.int32)
    if "mesh" in inspect.signature(expression.eval).parameters:
        values = expression.eval(domain, cells)
        return values.reshape(len(cells), np.prod(values.shape[1:], dtype=int))
    return expression.eval(cells)


def candidate_cells(
    domain: mesh.Mesh, cells: NDArray[np.integer], points: NDArray[np.float64], padding: float
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Cells whose bounding boxes contain the points.

    Args:
        domain: mesh of DOLFINx.
        cells: cells to look at.
        points: positions [m], shape (n, 3).
        padding: by how much the boxes are widened [m].

    Returns:
        Offsets (n + 1,) and cells as in a compressed row format.
    """
    dim = domain.topology.dim
    cells = np.asarray(cells, dtype=np.int32)
    if hasattr(geometry, "bb_tree"):
        tree = geometry.bb_tree(domain, dim, entities=cells, padding=padding)
        found = geometry.compute_collisions_points(tree, points)
    else:
        tree = geometry.BoundingBoxTree(domain, dim, cells, padding)
        found = geometry.compute_collisions(tree, points)
    return found.offsets, found.array


def version() -> str:
    """Version of the installed DOLFINx, for reports."""
    return dolfinx.__version__
