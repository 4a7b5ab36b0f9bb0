"""A cantilever of Hencky's law that swings under gravity, by finite elements: the reference of the case cantilever.

Independent of the particles in everything but DOLFINx's mesh: a total Lagrangian formulation, quadratic triangles, the law as an
energy of the deformation gradient, and the midpoint rule in time.
"""

from __future__ import annotations

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.fem import petsc
from mpi4py import MPI
from petsc4py import PETSc

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import compat


def hencky_energy(gradient, bulk_term: float, shear: float):
    """λ/2 (ln J)² + G (ln λ1)² + G (ln λ2)² per initial volume, in plane strain; a form of UFL.

    (ln λ1)² + (ln λ2)² = ((ln J)² + a²) / 2 with a = ln(λ1 / λ2), and cosh(a) = F:F / (2 J). Close to a = 0 the first terms of
    the series replace arcosh, whose derivative is 0/0 there; the next term is below 1e-10 of the sum.
    """
    jacobian = ufl.det(gradient)
    x, close = ufl.inner(gradient, gradient) / (2 * jacobian) - 1, 0.01
    away = ufl.conditional(ufl.gt(x, close), x, close)
    apart = ufl.ln(1 + away + ufl.sqrt(away * (away + 2))) ** 2
    squared = ufl.conditional(ufl.gt(x, close), apart, 2 * x - x**2 / 3 + 4 * x**3 / 45 - x**4 / 35)
    return bulk_term / 2 * ufl.ln(jacobian) ** 2 + shear / 2 * (ufl.ln(jacobian) ** 2 + squared)


class SwingingBeam:
    """A beam from (0, 0) to `size`, clamped at its left end, that gravity pulls down from the time 0; of one rank.

    Args:
        size: length and height [m].
        squares: over the height, of two triangles each.
        law: Young's modulus [Pa] and Poisson's ratio.
        density: at first [kg/m3]; gravity: downwards [m/s2].
        dt: step [s].
        tip: length of the end whose mean displacement is followed [m], of whole squares.
    """

    def __init__(self, size, squares: int, law, density: float, gravity: float, dt: float, tip: float) -> None:
        counts = [round(side * squares / size[1]) for side in size]
        domain, _, tags = bridge.box_mesh(MPI.COMM_SELF, size, counts)
        space = compat.function_space(domain, "Lagrange", 2, 2)
        self._now, self._before, self._velocity = (fem.Function(space) for _ in range(3))
        self._dt, (young, poisson) = dt, law
        shear = young / (2 * (1 + poisson))
        test, dx = ufl.TestFunction(space), ufl.Measure("dx", domain, metadata={"quadrature_degree": 4})
        gradient = ufl.variable(ufl.Identity(2) + ufl.grad((self._now + self._before) / 2))
        stress = ufl.diff(hencky_energy(gradient, 2 * shear * poisson / (1 - 2 * poisson), shear), gradient)
        acceleration = 2 / dt**2 * (self._now - self._before - dt * self._velocity)
        residual = (
            ufl.inner(stress, ufl.grad(test)) + density * ufl.inner(acceleration, test) + density * gravity * test[1]
        ) * dx
        self._residual, self._tangent = fem.form(residual), fem.form(ufl.derivative(residual, self._now))
        clamped = fem.locate_dofs_topological(space, 1, tags.find(1))
        self._clamp = fem.dirichletbc(np.zeros(2), clamped, space)
        at_tip = ufl.conditional(ufl.gt(ufl.SpatialCoordinate(domain)[0], size[0] - tip), 1.0, 0.0)
        self._tip = fem.form(at_tip / (tip * size[1]) * self._now[1] * dx)
        self._solver = PETSc.KSP().create(MPI.COMM_SELF)
        self._solver.setType("preonly")
        self._solver.getPC().setType("lu")

    def step(self) -> None:
        """Newton's iterations from the motion without forces, until the last moves nothing by more than a micrometre."""
        now, before, velocity = (each.x.array for each in (self._now, self._before, self._velocity))
        now[:] = before + self._dt * velocity
        for _ in range(20):
            matrix = petsc.assemble_matrix(self._tangent, bcs=[self._clamp])
            matrix.assemble()
            vector = petsc.assemble_vector(self._residual)
            petsc.set_bc(vector, [self._clamp], scale=0.0)
            self._solver.setOperators(matrix)
            moved = vector.duplicate()
            self._solver.solve(vector, moved)
            now -= moved.array
            largest = abs(moved.array).max()
            for each in (matrix, vector, moved):
                each.destroy()
            if largest < 1e-6:
                break
        else:
            raise mpm.RunError(
                f"the finite elements of the swinging beam did not converge with steps of {self._dt:g} s"
            )
        velocity[:] = 2 / self._dt * (now - before) - velocity
        before[:] = now

    def swing(self, until: float) -> tuple[np.ndarray, np.ndarray]:
        """Times [s] and mean displacements of the tip, upwards [m], from the start."""
        moved = [0.0]
        for _ in range(round(until / self._dt)):
            self.step()
            moved.append(fem.assemble_scalar(self._tip))
        return self._dt * np.arange(len(moved)), np.array(moved)
