"""Strain and stress as vectors of components, in the order of `mpm_core`.

Two dimensions: xx yy zz xy, with zz across the plane, which is the hoop direction of an axisymmetric body; three: xx yy zz xy yz
xz; engineering shear; tension positive.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import ufl
from dolfinx import fem, la
from dolfinx.mesh import Mesh
from numpy.typing import NDArray

from fenics_bridge import compat
from fenics_bridge.fem.geometry import weighted
from fenics_bridge.fem.supports import Support, carried_fractions
from fenics_bridge.types import MeshTags

N_STRESS = {2: 4, 3: 6}
"""Number of components by dimension."""


def strain(u: Any, radius: Any = None) -> Any:
    """Strain components of a displacement as a UFL vector.

    Args:
        u: displacement, UFL.
        radius: radius of an axisymmetric body, a UFL expression; zz is then the hoop strain u_r / r.
    """
    e = ufl.sym(ufl.grad(u))
    if u.ufl_shape[0] == 2:
        return ufl.as_vector([e[0, 0], e[1, 1], 0 if radius is None else u[0] / radius, 2 * e[0, 1]])
    return ufl.as_vector([e[0, 0], e[1, 1], e[2, 2], 2 * e[0, 1], 2 * e[1, 2], 2 * e[0, 2]])


def dilation(u: Any, radius: Any = None) -> Any:
    """Change of volume of a displacement, the trace of its strain, as a UFL expression.

    Args:
        u: displacement, UFL.
        radius: as for `strain`.
    """
    return ufl.div(u) if radius is None else ufl.div(u) + u[0] / radius


def strain_up_to_axis(u: Any, radius: Any = None) -> Any:
    """Strain components where the axis belongs to the points: there the hoop strain is du_r/dr, the limit of u_r / r."""
    components = strain(u, radius)
    if radius is None:
        return components
    hoop = ufl.conditional(ufl.gt(radius, 1e-9 * ufl.CellDiameter(u.ufl_domain())), components[2], components[0])
    return ufl.as_vector([components[0], components[1], hoop, components[3]])


def elastic_stress(strain_components: Any, young: Any, poisson: Any) -> Any:
    """Stress components of an isotropic elastic body as a UFL vector; plane strain keeps its stress zz."""
    shear = young / (2 * (1 + poisson))
    lame = young * poisson / ((1 + poisson) * (1 - 2 * poisson))
    e = strain_components
    volumetric = lame * (e[0] + e[1] + e[2])
    normal = [volumetric + 2 * shear * e[i] for i in range(3)]
    return ufl.as_vector(normal + [shear * e[i] for i in range(3, e.ufl_shape[0])])


def cell_function(domain: Mesh, expression: Any, degree: int, name: str) -> fem.Function:
    """Function that is polynomial in each cell, from a UFL vector expression evaluated there."""
    space = compat.function_space(domain, "DG", degree, expression.ufl_shape[0])
    function = fem.Function(space, name=name)
    function.interpolate(fem.Expression(expression, compat.interpolation_points(space)))
    return function


def part_of(function: fem.Function, collapsed: tuple[Any, Any], name: str) -> fem.Function:
    """A part of a function on a mixed space as a function of its own.

    Args:
        function: function on the mixed space.
        collapsed: space and dofs of the part, as `sub(i).collapse()` of the mixed space returns them.
        name: name of the new function.
    """
    space, dofs = collapsed
    part = fem.Function(space, name=name)
    part.x.array[:] = function.x.array[dofs]
    return part


class SupportedBody:
    """The method of a body in equilibrium that returns the forces on its supports."""

    def _nodal_reactions(self) -> tuple[Any, NDArray[np.float64], MeshTags, Sequence[Support]]:
        """The space of displacements, external less internal forces at its local dofs, the tags of the boundary, its supports."""
        raise NotImplementedError

    def reaction(self, facet_tag: int | str) -> NDArray[np.float64]:
        """Force of the body, including its pore water, on its support at the facets of a tag, summed over them. Collective.

        What a node carries where tags meet is divided between them, see `carried_fractions`, so that the forces of all tags add
        up to the load.

        Args:
            facet_tag: number or name of the tag.

        Returns:
            Shape (D,) [N], [N/m] in plane strain, [N] per radian in an axisymmetric body.

        Raises:
            InputError: no facet has the tag. Raised on all ranks alike.
        """
        space, forces, facet_tags, supports = self._nodal_reactions()
        dim, own = space.mesh.geometry.dim, space.dofmap.index_map.size_local
        carried = carried_fractions(space, facet_tags, supports, facet_tag) * forces.reshape(-1, dim)
        return space.mesh.comm.allreduce(carried[:own].sum(axis=0))


def nodal_average(function: fem.Function, radius: Any = None, active: fem.Function | None = None) -> fem.Function:
    """Average a function at the nodes, by the volume of the cells around each of them. Collective.

    (The lumped L2 projection; it smooths stresses that jump between cells.)

    Args:
        function: vector function on a mesh.
        radius: radius of an axisymmetric body, a UFL expression; None in others.
        active: function that is 1 in the cells that count and 0 in the others; None where all do.

    Returns:
        Continuous, piecewise linear function; 0 at nodes of cells that do not count only.
    """
    domain = function.function_space.mesh
    size = function.ufl_shape[0]
    space = compat.function_space(domain, "Lagrange", 1, size)
    test = ufl.TestFunction(space)
    ones = fem.Constant(domain, np.ones(size))
    there = 1.0 if active is None else active
    sums = assembled(fem.form(weighted(there * ufl.inner(function, test), radius) * ufl.dx), space)
    weights = assembled(fem.form(weighted(there * ufl.inner(ones, test), radius) * ufl.dx), space)
    average = fem.Function(space, name=function.name)
    np.divide(sums.array, weights.array, out=average.x.array, where=weights.array > 0)
    return average


def assembled(form: Any, space: Any, into: Any = None) -> Any:
    """Linear form as a vector (`dolfinx.la`), summed over ranks, ghost entries up to date. Collective."""
    vector = la.vector(space.dofmap.index_map, space.dofmap.index_map_bs) if into is None else into
    vector.array[:] = 0.0
    fem.assemble_vector(vector.array, form)
    compat.add_shared(vector)
    return vector
