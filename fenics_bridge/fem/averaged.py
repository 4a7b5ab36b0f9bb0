"""Nodal mixed discretisation: volumetric strains of linear simplices averaged over nodes, against locking."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import ufl
from dolfinx import fem, la
from numpy.typing import NDArray
from petsc4py import PETSc

from fenics_bridge import compat
from fenics_bridge.fem.averaged_stiffness import AssembledStiffness, FactoredStiffness
from fenics_bridge.fem.averaged_strain import AveragedStrain
from fenics_bridge.fem.fields import assembled as assembled_form
from fenics_bridge.fem.geometry import Geometry
from fenics_bridge.fem.kinematics import Kinematics
from fenics_bridge.fem.stiffness import Stiffness
from fenics_bridge.mesh.background import global_numbers
from fenics_bridge.types import Law
from mpm_core import _core


class AveragedKinematics:
    """Strain of linear simplices whose volumetric part is averaged over nodes (paper, section 5; Detournay, Dzik).

    With theta_c = div u in a cell, theta_i the mean by volume over the cells around a node, and thetabar_c the mean of
    theta_i over a cell's nodes, the in-plane normal strains are raised by (thetabar_c - theta_c) / d; all three of them,
    with d = 3, in 3D and in axisymmetric bodies, whose hoop strain is that at the centroid.
    Strain is then a constant matrix times displacement, over two rings of cells, and the internal forces are its
    transpose times stress: the mean stress is averaged too, and the tangent is symmetric where the law's is.

    A node between soils of different stiffness has a mean for each of them (`stiffness_groups` in
    materials/laws/stiffness_groups.h), so that the strain of the softer soil does not become stress of the stiffer one.

    Soil with friction whose flow dilates less than associated flow is an exception. Forces that are averaged in full do not feel
    pressures that alternate from cell to cell, and where flow does not change the volume a mechanism would pass through the cells
    of low pressure; forces that are not averaged at all let tension alternate instead (docs/fem.md). So in cells of such soil the
    forces are averaged by the fraction (1 + tan(psi) / tan(phi)) / 2, as those of particles in small displacements. Explicit
    steps average strains and forces of such soil by half, and so do elements that are handed over to them.

    Args:
        increment: displacement function of degree 1 whose strain is taken.
        points: the quadrature points.
        constraints: the boundary conditions.
        laws: the laws, by number; see `follow`.
        geometry: plane strain, axial symmetry or a solid.
        as_particles: average by the fractions of explicit steps.
        assembled: whether `stiffness` is a matrix of PETSc, for a direct solver; else it stays in factors, for an iterative one.
        further: on a mixed space as for `Kinematics`; `stiffness` is then a matrix.
    """

    def __init__(
        self,
        increment: fem.Function,
        points: Any,
        constraints: Any,
        laws: Sequence[Law],
        geometry: Geometry | None = None,
        as_particles: bool = False,
        assembled: bool = True,
        further: Callable[[Any, Any], tuple[Any, Any]] | None = None,
    ) -> None:
        self._increment, self._points, self._constraints = increment, points, constraints
        self._as_particles = as_particles
        self._space = increment.function_space
        index_map, block = self._space.dofmap.index_map, self._space.dofmap.index_map_bs
        self._n_dofs = index_map.size_local * block
        self._forces = la.vector(index_map, block)
        displacements, dofs = self._displacements(further is not None)
        dofs, nodes, gradients, volumes, radii = self._cells(displacements, dofs, geometry == Geometry.AXISYMMETRIC)
        n_own = self._n_dofs, displacements.dofmap.index_map.size_local
        self._cells_of_strain = n_own, dofs, nodes, gradients, volumes, radii
        self.factored = not assembled
        """Whether `stiffness` stays in factors, to which nothing can be added"""
        self._groups: list[int] = []
        self._without = None if assembled else Kinematics(increment, points, constraints, geometry)
        self._more: tuple[Any, Stiffness] | None = None
        if further is not None:
            test, trial = ufl.TestFunction(self._space), ufl.TrialFunction(self._space)
            forces, stiffness = further(test, trial)
            # A matrix without a place on the diagonal takes no boundary condition; the terms need not be in all cells.
            dx = compat.measure_beside(self._space.mesh, stiffness)
            nothing = fem.Constant(self._space.mesh, 0.0) * ufl.inner(trial, test) * dx(degree=1)
            self._more = fem.form(forces), Stiffness(stiffness + nothing, constraints)
        self.follow(laws)

    def follow(self, laws: Sequence[Law]) -> None:
        """Average as the laws ask for: soils of unlike stiffness apart, forces of soil that dilates little by less. Collective.

        Args:
            laws: the laws, by number.
        """
        number = np.maximum(self._points.material, 0)
        self._group(_core.stiffness_groups(list(laws)), number)
        if self._as_particles:
            fractions = np.array([_core.fraction_of_averages(law) for law in laws])[number]
            self._strain.of_strains = self._strain.of_forces = fractions
        else:
            self._strain.of_forces = np.array([_core.fraction_of_averaged_forces(law) for law in laws])[number]

    def _group(self, groups: list[int], number: NDArray[np.integer]) -> None:
        """Average the soils of each group by themselves. Collective.

        Args:
            groups: number of the group of each law.
            number: number of the law of each cell.
        """
        if groups == self._groups:
            return
        self._groups = groups
        comm, present = self._space.mesh.comm, self._points.material >= 0
        of_cells = np.array(groups)[number]
        self._strain = AveragedStrain(comm, *self._cells_of_strain, present, of_cells, max(groups) + 1)
        self._assembled = AssembledStiffness(self._strain) if not self.factored else None

    def strain_increment(self) -> NDArray[np.float64]:
        """Averaged strain of the increment in each cell: (n, S)."""
        return self._strain.of(self._increment.x.array[: self._n_dofs])

    def internal_forces(self, stress: NDArray[np.float64]) -> Any:
        """Nodal forces of a stress (n, S) as a vector (`dolfinx.la`), ghosts up to date. Collective."""
        if self._more is not None:
            assembled_form(self._more[0], self._space, self._forces)
        else:
            self._forces.array[:] = 0.0
        self._forces.array[: self._n_dofs] += self._strain.forces(stress)
        compat.forward(self._forces)
        return self._forces

    def carried_stress(self) -> NDArray[np.float64]:
        """The stress (n, S) [Pa] of the points as the nodal forces have it, without alternation of its mean from cell to cell. Collective."""
        return self._strain.averaged_stress(self._points.stress)

    def stiffness(self) -> PETSc.Mat | FactoredStiffness:
        """Stiffness of the cells' present tangent, without the rows and columns of the supports. Collective."""
        dofs = self._constraints.dofs
        held = dofs[dofs < self._n_dofs]
        if self._assembled is None:
            return FactoredStiffness(self._strain, held, self._without, self._points.tangent)
        more = self._more[1].assembled() if self._more is not None else None
        return self._assembled.with_tangent(self._points.tangent, held, more)

    def _displacements(self, mixed: bool) -> tuple[Any, NDArray[np.integer]]:
        """Space of the displacement, and its dofs in the space of the increment, (nodes, D), ghosts included."""
        dim = self._space.mesh.geometry.dim
        if mixed:
            space, dofs = self._space.sub(0).collapse()
            return space, np.asarray(dofs).reshape(-1, dim)
        index_map = self._space.dofmap.index_map
        return self._space, np.arange((index_map.size_local + index_map.num_ghosts) * dim).reshape(-1, dim)

    def _cells(self, space: Any, dofs: NDArray[np.integer], axisymmetric: bool) -> tuple[Any, ...]:
        """Degrees of freedom, nodes, gradients of shape functions, volumes and radii of the owned cells.

        Args:
            space: space of the displacement.
            dofs: its dofs in the space of the increment, (nodes, D).
            axisymmetric: whether the body is.

        Returns:
            Global dofs (m, D + 1, D), global nodes (m, D + 1), gradients (m, D + 1, D) [1/m], volumes (m,), those of one radian
            in an axisymmetric body, and the radii (m,) of the centroids in such a body, else None.
        """
        dim, block = space.mesh.geometry.dim, self._space.dofmap.index_map_bs
        local = compat.cell_dofs(space)[self._points.cells]
        corners = space.tabulate_dof_coordinates()[local][:, :, :dim]
        edges = corners[:, 1:] - corners[:, :1]
        inner = np.swapaxes(np.linalg.inv(edges), 1, 2)
        gradients = np.concatenate([-inner.sum(axis=1, keepdims=True), inner], axis=1)
        numbers, nodes = (_numbers(each) for each in (self._space, space))
        columns = block * numbers[dofs[local] // block] + dofs[local] % block
        volumes = np.abs(np.linalg.det(edges)) / (2 if dim == 2 else 6)
        if not axisymmetric:
            return columns, nodes[local], gradients, volumes, None
        radii = corners[:, :, 0].mean(axis=1)
        return columns, nodes[local], gradients, radii * volumes, radii


def _numbers(space: Any) -> NDArray[np.integer]:
    """Global numbers of the nodes of a space on this rank, ghosts included."""
    index_map = space.dofmap.index_map
    return global_numbers(index_map, index_map.size_local + index_map.num_ghosts)
