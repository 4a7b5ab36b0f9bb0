"""Implicit steps with pore water by a field split: the same as by a direct solver, and how the iterations grow."""

import numpy as np
import pytest
from core_cases import box
from petsc4py import PETSc

import mpm_core as mpm


class Watched(mpm.Newton):
    """Newton's method that keeps the Krylov iterations of each linear system."""

    def solver(self, comm, dim):
        solver = super().solver(comm, dim)
        solve, self.__dict__["krylov"] = solver.solve, []

        def noted(*arguments):
            solution = solve(*arguments)
            self.krylov.extend(solution.linear_iterations)
            return solution

        solver.solve = noted
        return solver


def consolidated(cells, conductivity, prefix, dim=3):
    """Pore pressures and stresses of a block of sides 1 m that drains on top, some time after its weight came on; iterations."""
    model = mpm.Model(box([cells] * dim), mpm.LinearElastic(young=10e6, poisson=0.3))
    model.seed(density=2000.0, per_cell=1)
    for axis in range(dim - 1):
        model.roller(2 * axis + 1, np.eye(dim)[axis])
    model.fix(2 * dim - 1)
    model.set_gravity([0.0] * (dim - 1) + [-9.81])
    model.add_water(porosity=0.4, conductivity=conductivity, modulus=np.inf)
    model.hold_pore_pressure(2 * dim, 0.0)
    newton = Watched(prefix=prefix)
    list(model.implicit(10.0, dt=10.0, quasi_static=True, small_displacements=True, solver=newton))
    return model.particles.pore_pressure, model.particles.stress, newton.krylov


@pytest.fixture
def split():
    """Prefix of options that ask for the field split, however small the system."""
    options = PETSc.Options("split_")
    options["pc_type"] = "fieldsplit"
    yield "split_"
    options.delValue("pc_type")


@pytest.mark.parametrize("dim, cells", [(2, 16), (3, 6)])
@pytest.mark.parametrize("conductivity", [1e-13, 1e-8, 1e-3])
def test_the_field_split_solves_what_the_direct_solver_does(dim, cells, conductivity, split):
    pressure, stress, krylov = consolidated(cells, conductivity, split, dim)
    expected_pressure, expected_stress, direct = consolidated(cells, conductivity, "direct_", dim)
    np.testing.assert_allclose(pressure, expected_pressure, rtol=0, atol=1e-6 * np.abs(expected_pressure).max())
    np.testing.assert_allclose(stress, expected_stress, rtol=0, atol=1e-6 * np.abs(expected_stress).max())
    assert 1 < max(krylov) <= 15 and max(direct) == 1


def test_iterations_hardly_grow_with_the_mesh(split):
    few, many = (max(consolidated(cells, 1e-9, split)[2]) for cells in (4, 10))
    assert many <= 2 * few
