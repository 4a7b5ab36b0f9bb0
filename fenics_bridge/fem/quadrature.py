"""Stress, state and tangent at the quadrature points of a mesh, updated by a law of `mpm_core`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from dolfinx import fem
from dolfinx.mesh import Mesh
from mpm_core.parameter_fields import differences_of, has_varying
from numpy.typing import NDArray

from fenics_bridge import compat
from fenics_bridge.fem.fields import N_STRESS
from fenics_bridge.mesh.tagged import cell_volumes
from fenics_bridge.types import Law
from mpm_core.mesh import cell_sizes


class QuadraturePoints:
    """The quadrature points of the cells that this rank owns, cell after cell, the cells of each material together.

    Args:
        domain: mesh of the body.
        laws: the laws, by number.
        material: number of each cell's law, shape (owned cells,).
        degree: degree of the quadrature.
        axisymmetric: whether means over a cell are those of its volume of one radian, r dA.
    """

    def __init__(
        self, domain: Mesh, laws: Sequence[Law], material: NDArray[np.int32], degree: int, axisymmetric: bool = False
    ) -> None:
        self.size = N_STRESS[domain.geometry.dim]
        self._domain = domain
        self.degree = degree
        self.reference, self._weights = compat.quadrature_rule(domain, degree)
        self.per_cell = len(self.reference)
        """Number of points in a cell"""
        # With the points of a law in one piece it works on them in place.
        self.cells = np.argsort(material, kind="stable").astype(np.int32)
        """The cells, shape (m,), int32, those of a material together"""
        self.n = len(self.cells) * self.per_cell
        """Number of points"""
        self._radii = self.coordinates()[:, 0].reshape(-1, self.per_cell) if axisymmetric else None
        sizes = cell_sizes(cell_volumes(domain)[self.cells], domain.geometry.dim)
        self.cell_size = np.repeat(sizes, self.per_cell)
        """Size of the points' cells [m], shape (n,)"""
        self.time = 0.0
        """Time at the start of the step under trial [s], for laws that depend on rate"""
        self.duration = np.inf
        """Duration of that step [s]"""
        self.parameters: dict[str, NDArray[np.float64]] = {}
        """Values (n,) of laws' parameters that vary, by name; NaN where the law's number holds"""
        self.assign(material, len(laws))
        self.stress = np.zeros((self.n, self.size))
        """Stress of the last equilibrium [Pa], shape (n, S), tension positive"""
        self.state = np.zeros((self.n, max(law.n_state for law in laws)))
        """State variables of the last equilibrium, shape (n, n_state), n_state being that of the law with most variables"""
        self.deviatoric_strain = np.zeros(self.n)
        """Accumulated deviatoric strain [-], shape (n,): the sum of sqrt(2/3 de : de), as the particles have it"""
        self.trial_stress = self.stress.copy()
        """Stress at the displacement under trial [Pa], shape (n, S)"""
        self.trial_state = self.state.copy()
        """State variables at the displacement under trial, shape (n, n_state)"""
        self._trial_strain = np.zeros((self.n, self.size))
        self.tangent = np.zeros((self.n, self.size, self.size))
        """Tangent at the displacement under trial [Pa], shape (n, S, S)"""
        self.reset_state(laws)

    def assign(self, material: NDArray[np.int32], n_laws: int) -> None:
        """Give each cell the number of its law.

        Args:
            material: numbers, shape (owned cells,), in the order of the mesh; -1 for an inactive cell, whose points no law
                updates.
            n_laws: number of laws.
        """
        self.material = material[self.cells]
        """Number of the law of each of the cells, shape (m,), int32"""
        of_point = self._numbers()
        self._pieces = [_piece(np.flatnonzero(of_point == number)) for number in range(n_laws)]
        self.off = np.flatnonzero(of_point < 0)
        """Rows of the points in inactive cells, whose stress is zero"""

    def reset_state(self, laws: Sequence[Law], points: Any = slice(None)) -> None:
        """Give points the initial state variables of the laws: zero, except for parameters that vary.

        Args:
            laws: the laws, by number.
            points: rows of the points; all by default.
        """
        missing = max(law.n_state for law in laws) - self.state.shape[1]
        if missing > 0:  # a law with more variables has come in
            self.state = np.pad(self.state, ((0, 0), (0, missing)))
            self.trial_state = self.state.copy()
        self.state[points], self.deviatoric_strain[points] = 0.0, 0.0
        for name in self.parameters:
            self._write_parameter(laws, name)

    def set_parameter(self, laws: Sequence[Law], name: str, values: NDArray[np.float64]) -> None:
        """Give points their values of a parameter that varies.

        Args:
            laws: the laws, by number.
            name: name of the parameter.
            values: values, shape (n,); points where they are NaN keep theirs.

        Raises:
            InputError: a parameter that varies in no law, or values out of its range.
        """
        before = self.parameters.get(name, np.full(self.n, np.nan))
        values = np.where(np.isnan(values), before, values)
        differences_of(name, values, laws, self._numbers(), self.state)  # checked before it is kept
        self.parameters[name] = values
        self._write_parameter(laws, name)

    def _write_parameter(self, laws: Sequence[Any], name: str) -> None:
        if any(has_varying(law, name) for law in laws):
            self.state[:] = differences_of(name, self.parameters[name], laws, self._numbers(), self.state)

    def _numbers(self) -> Any:
        """Number of each point's law: (n,)."""
        return np.repeat(self.material, self.per_cell)

    def update(self, laws: Sequence[Law], strain_increment: NDArray[np.float64]) -> str:
        """Trial stress, state and tangent by one call of each law; returns where and why one failed, empty if none did."""
        np.copyto(self.trial_stress, self.stress)
        np.copyto(self.trial_state, self.state)
        self._trial_strain, failure = strain_increment, ""
        self._trial_strain[self.off] = 0.0
        self.tangent[self.off] = 0.0
        for law, piece in zip(laws, self._pieces):
            state = np.ascontiguousarray(self.trial_state[piece, : law.n_state])  # the columns themselves if it has all
            stress, tangent = self.trial_stress[piece], self.tangent[piece]  # views, unless the piece is scattered
            context = {"time": self.time, "dt": self.duration, "cell_size": self.cell_size[piece]}
            report = law.update(strain_increment[piece], stress, state, tangent, **context)
            self.trial_state[piece, : law.n_state] = state
            if not isinstance(piece, slice):
                self.trial_stress[piece], self.tangent[piece] = stress, tangent
            if report.failed and not failure:
                failure = self._failure(law, np.arange(self.n)[piece][report.first_failed])
        return failure

    def _failure(self, law: Any, point: int) -> Any:
        """A point where a law failed, in words: law, place and strain increment."""
        position = ", ".join(f"{x:.6g}" for x in self.coordinates()[point])
        strain = ", ".join(f"{e:.6g}" for e in self._trial_strain[point])
        return f"the law {law.name} failed at ({position}) m for the strain increment ({strain})"

    def wave_moduli(self, laws: Sequence[Law]) -> NDArray[np.float64]:
        """Moduli of compression and shear waves of the last equilibrium (n, 2) [Pa]; 0 in inactive cells."""
        moduli = np.zeros((self.n, 2))
        for law, piece in zip(laws, self._pieces):
            state = np.ascontiguousarray(self.state[piece, : law.n_state])
            moduli[piece] = law.wave_moduli(self.stress[piece], state)
        return moduli

    def add_viscosity(self, laws: Sequence[Law], factor: float, strain_increment: NDArray[np.float64]) -> Any:
        """Add a factor times the elastic stiffness to the tangent; returns that times the strain increment: (n, S) [Pa].

        The stiffness is the isotropic one of each law's wave moduli, an estimate for laws whose stiffness changes.
        """
        if factor == 0:
            return 0.0
        for law, piece in zip(laws, self._pieces):
            self.tangent[piece] += factor * isotropic_stiffness(law, self.size)
        return factor * self.elastic_stress(laws, strain_increment)

    def elastic_stress(self, laws: Sequence[Law], strain: NDArray[np.float64]) -> NDArray[np.float64]:
        """Stress of a strain by the isotropic stiffness of each law: (n, S) [Pa]."""
        stress = np.zeros((self.n, self.size))
        for law, piece in zip(laws, self._pieces):
            stress[piece] = strain[piece] @ isotropic_stiffness(law, self.size)
        return stress

    def snapshot(self) -> tuple[NDArray[np.float64], ...]:
        """Copies of stress, state and accumulated strain, for `restore`."""
        return self.stress.copy(), self.state.copy(), self.deviatoric_strain.copy()

    def restore(self, snapshot: tuple[NDArray[np.float64], ...]) -> None:
        """Restore values that were copied before."""
        for values, copied in zip((self.stress, self.state, self.deviatoric_strain), snapshot):
            values[:] = copied

    def accept(self) -> None:
        """Accept the trial as the last equilibrium."""
        np.copyto(self.stress, self.trial_stress)
        np.copyto(self.state, self.trial_state)
        self.deviatoric_strain += deviatoric_size(self._trial_strain)

    def coordinates(self) -> NDArray[np.float64]:
        """Positions of the points: (n, D) [m]."""
        dim = self._domain.geometry.dim
        corners = self._domain.geometry.x[compat.cell_nodes(self._domain)[self.cells], :dim]
        return np.einsum("qk,ckd->cqd", self._linear_shapes(), corners).reshape(self.n, dim)

    def sum_over_cells(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Weighted sums of values (n,) at the points of each cell, over the volume of the cell but for a factor: (m,)."""
        values = values.reshape(-1, self.per_cell)
        return (values if self._radii is None else values * self._radii) @ self._weights

    def cell_function(self, values: NDArray, name: str, degree: int) -> fem.Function:
        """Function in the cells that follows from values at the points.

        The mean of admissible stresses is admissible; the linear function is exact at as many points as the cell has corners.

        Args:
            values: values at the points, shape (n,) or (n, k).
            name: name of the function.
            degree: 0 for the mean by volume, constant in each cell; 1 for the linear function in each cell that is nearest to the
                values at its points (least squares, by the weights of the points).
        """
        values = values.reshape(len(self.cells), self.per_cell, 1 if values.ndim == 1 else values.shape[1])
        if degree == 0:
            weights = (
                np.broadcast_to(self._weights, values.shape[:2]) if self._radii is None else self._weights * self._radii
            )
            at_nodes = np.einsum("cq,cqs->cs", weights / weights.sum(axis=1, keepdims=True), values)[:, None]
        else:
            root = np.sqrt(self._weights)
            at_nodes = np.einsum("kq,cqs->cks", np.linalg.pinv(root[:, None] * self._linear_shapes()) * root, values)
        space = compat.function_space(self._domain, "DG", degree, values.shape[2])
        function = fem.Function(space, name=name)
        function.x.array.reshape(-1, values.shape[2])[compat.cell_dofs(space)[self.cells]] = at_nodes
        function.x.scatter_forward()
        return function

    def _linear_shapes(self) -> Any:
        return np.column_stack([1 - self.reference.sum(axis=1), self.reference])


def _piece(rows: NDArray[Any]) -> Any:
    """Rows in order, as a slice if they are contiguous."""
    if len(rows) == 0:
        return slice(0, 0)
    return slice(rows[0], rows[-1] + 1) if rows[-1] - rows[0] + 1 == len(rows) else rows


def deviatoric_size(strain: NDArray[np.float64]) -> NDArray[np.float64]:
    """sqrt(2/3 e : e) of the deviators e of strains (n, S) with engineering shear: (n,)."""
    deviator = strain[:, :3] - strain[:, :3].mean(axis=1, keepdims=True)
    return np.sqrt(2 / 3 * (np.sum(deviator**2, axis=1) + 0.5 * np.sum(strain[:, 3:] ** 2, axis=1)))


def isotropic_stiffness(law: Law, size: int) -> NDArray[np.float64]:
    """Elastic stiffness (S, S) [Pa] with the wave moduli of a law; S = 4 in plane strain, 6 in three dimensions."""
    shear = law.shear_modulus
    stiffness = shear * np.eye(size)
    stiffness[:3, :3] = law.p_wave_modulus - 2 * shear
    stiffness[[0, 1, 2], [0, 1, 2]] = law.p_wave_modulus
    return stiffness
