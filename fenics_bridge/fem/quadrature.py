"""Stress, state and tangent at the quadrature points of a mesh, updated by a law of `mpm_core`."""

from __future__ import annotations

import numpy as np
from dolfinx import fem
from mpm_core.parameter_fields import differences_of, has_varying

from fenics_bridge import compat
from fenics_bridge.fem.fields import N_STRESS
from fenics_bridge.mesh.tagged import cell_volumes
from mpm_core.mesh import cell_sizes


class QuadraturePoints:
    """The quadrature points of the cells that this rank owns, cell after cell, the cells of each material together.

    n: their number; per_cell: number in a cell; cells: (m,) int32, the cells; material: (m,) int32, of each of them
    off: rows of the points in inactive cells, whose stress is zero
    cell_size: (n,) [m] of the points' cells; time, duration: of the step under trial [s], for laws that depend on rate
    parameters: {name: (n,)}, values of laws' parameters that vary, NaN where the law's number holds
    stress, state: (n, S) [Pa] and (n, n_state) of the last equilibrium; n_state: that of the law with most variables
    deviatoric_strain: (n,) accumulated up to there, the sum of sqrt(2/3 de : de) as the particles have it [-]
    trial_stress, trial_state, tangent: (n, S), (n, n_state), (n, S, S) at the displacement under trial
    """

    def __init__(self, domain, laws, material, degree, axisymmetric=False):
        """laws: by number; material: (owned cells,) int32, number of each cell's law; degree: of the quadrature.

        axisymmetric: whether means over a cell are those of its volume of one radian, r dA
        """
        self.size = N_STRESS[domain.geometry.dim]
        self._domain = domain
        self.degree, self.reference = degree, compat.quadrature_points(domain, degree)
        self.per_cell = len(self.reference)
        # With the points of a law in one piece it works on them in place.
        self.cells = np.argsort(material, kind="stable").astype(np.int32)
        self.n = len(self.cells) * self.per_cell
        self._radii = self.coordinates()[:, 0].reshape(-1, self.per_cell) if axisymmetric else None
        sizes = cell_sizes(cell_volumes(domain)[self.cells], domain.geometry.dim)
        self.cell_size = np.repeat(sizes, self.per_cell)
        self.time, self.duration = 0.0, np.inf
        self.parameters = {}
        self.assign(material, len(laws))
        self.stress = np.zeros((self.n, self.size))
        self.state = np.zeros((self.n, max(law.n_state for law in laws)))
        self.deviatoric_strain = np.zeros(self.n)
        self.trial_stress, self.trial_state = self.stress.copy(), self.state.copy()
        self._trial_strain = np.zeros((self.n, self.size))
        self.tangent = np.zeros((self.n, self.size, self.size))
        self.reset_state(laws)

    def assign(self, material, n_laws):
        """Give each cell the number of its law; -1 for an inactive cell, whose points no law updates.

        material: (owned cells,) int32, in the order of the mesh
        """
        self.material = material[self.cells]
        of_point = self._numbers()
        self._pieces = [_piece(np.flatnonzero(of_point == number)) for number in range(n_laws)]
        self.off = np.flatnonzero(of_point < 0)

    def reset_state(self, laws, points=slice(None)):
        """Initial state variables of the laws: zero, except for parameters that vary.

        points: rows of the points that are reset; all by default
        """
        missing = max(law.n_state for law in laws) - self.state.shape[1]
        if missing > 0:  # a law with more variables has come in
            self.state = np.pad(self.state, ((0, 0), (0, missing)))
            self.trial_state = self.state.copy()
        self.state[points], self.deviatoric_strain[points] = 0.0, 0.0
        for name in self.parameters:
            self._write_parameter(laws, name)

    def set_parameter(self, laws, name, values):
        """Give points their values (n,) of a parameter that varies; those where they are NaN keep theirs.

        Raises InputError for a parameter that varies in no law, and for values out of its range.
        """
        before = self.parameters.get(name, np.full(self.n, np.nan))
        values = np.where(np.isnan(values), before, values)
        differences_of(name, values, laws, self._numbers(), self.state)  # checked before it is kept
        self.parameters[name] = values
        self._write_parameter(laws, name)

    def _write_parameter(self, laws, name):
        if any(has_varying(law, name) for law in laws):
            self.state[:] = differences_of(name, self.parameters[name], laws, self._numbers(), self.state)

    def _numbers(self):
        """Number of each point's law: (n,)."""
        return np.repeat(self.material, self.per_cell)

    def update(self, laws, strain_increment):
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

    def _failure(self, law, point):
        """A point where a law failed, in words: law, place and strain increment."""
        position = ", ".join(f"{x:.6g}" for x in self.coordinates()[point])
        strain = ", ".join(f"{e:.6g}" for e in self._trial_strain[point])
        return f"the law {law.name} failed at ({position}) m for the strain increment ({strain})"

    def add_viscosity(self, laws, factor, strain_increment):
        """Add a factor times the elastic stiffness to the tangent; returns that times the strain increment: (n, S) [Pa].

        The stiffness is the isotropic one of each law's wave moduli, an estimate for laws whose stiffness changes.
        """
        if factor == 0:
            return 0.0
        stress = np.zeros((self.n, self.size))
        for law, piece in zip(laws, self._pieces):
            stiffness = factor * isotropic_stiffness(law, self.size)
            self.tangent[piece] += stiffness
            stress[piece] = strain_increment[piece] @ stiffness
        return stress

    def snapshot(self):
        """Copies of stress, state and accumulated strain, for `restore`."""
        return self.stress.copy(), self.state.copy(), self.deviatoric_strain.copy()

    def restore(self, snapshot):
        """Restore values that were copied before."""
        for values, copied in zip((self.stress, self.state, self.deviatoric_strain), snapshot):
            values[:] = copied

    def accept(self):
        """Accept the trial as the last equilibrium."""
        np.copyto(self.stress, self.trial_stress)
        np.copyto(self.state, self.trial_state)
        self.deviatoric_strain += deviatoric_size(self._trial_strain)

    def coordinates(self):
        """Positions of the points: (n, D) [m]."""
        corners = self._domain.geometry.x[compat.cell_nodes(self._domain)[self.cells], : self._domain.geometry.dim]
        return np.einsum("qk,ckd->cqd", self._linear_shapes(), corners).reshape(self.n, -1)

    def cell_function(self, values, name, degree):
        """Function that is constant (degree 0: the mean by volume) or linear (degree 1: through the points) in each cell.

        The mean of admissible stresses is admissible; the linear function is exact at the points. values: (n, k)
        """
        values = values.reshape(len(self.cells), self.per_cell, -1)
        if degree == 0:
            weights = None if self._radii is None else np.broadcast_to(self._radii[:, :, None], values.shape)
            at_nodes = np.average(values, axis=1, weights=weights)[:, None]
        else:
            at_nodes = np.einsum("kq,cqs->cks", np.linalg.inv(self._linear_shapes()), values)
        space = compat.function_space(self._domain, "DG", degree, values.shape[2])
        function = fem.Function(space, name=name)
        function.x.array.reshape(-1, values.shape[2])[compat.cell_dofs(space)[self.cells]] = at_nodes
        function.x.scatter_forward()
        return function

    def _linear_shapes(self):
        return np.column_stack([1 - self.reference.sum(axis=1), self.reference])


def _piece(rows):
    """Rows in order, as a slice if they are contiguous."""
    if len(rows) == 0:
        return slice(0, 0)
    return slice(rows[0], rows[-1] + 1) if rows[-1] - rows[0] + 1 == len(rows) else rows


def deviatoric_size(strain):
    """sqrt(2/3 e : e) of the deviators e of strains (n, S) with engineering shear: (n,)."""
    deviator = strain[:, :3] - strain[:, :3].mean(axis=1, keepdims=True)
    return np.sqrt(2 / 3 * (np.sum(deviator**2, axis=1) + 0.5 * np.sum(strain[:, 3:] ** 2, axis=1)))


def isotropic_stiffness(law, size):
    """Elastic stiffness (S, S) [Pa] with the wave moduli of a law; S = 4 in plane strain, 6 in three dimensions."""
    shear = law.shear_modulus
    stiffness = shear * np.eye(size)
    stiffness[:3, :3] = law.p_wave_modulus - 2 * shear
    stiffness[[0, 1, 2], [0, 1, 2]] = law.p_wave_modulus
    return stiffness
