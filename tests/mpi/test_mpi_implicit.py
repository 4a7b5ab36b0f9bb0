"""The implicit scheme on several ranks: the finite element solution, and the same motion whoever owns the cells."""

import numpy as np
import pytest
from implicit_cases import LEFT, floor, linear_elastic_solution
from mpi4py import MPI
from partitions import all_by_id, assert_same, bands, one_does_all, scattered, sliding_slope, spread_box

import mpm_core as mpm

SOIL = mpm.LinearElastic(young=1e6, poisson=0.3)
DENSITY, G = 2000.0, 9.81


@pytest.mark.parametrize("owners_of", [bands, scattered, one_does_all])
@pytest.mark.parametrize(("dim", "n", "per_cell"), [(2, 8, 3), (3, 3, 4)])
def test_first_step_is_the_finite_element_solution(comm, owners_of, dim, n, per_cell):
    mesh = spread_box([n] * dim, [1.0] * dim, comm, owners_of)
    model = mpm.Model(mesh, SOIL)
    model.seed(density=DENSITY, per_cell=per_cell)
    model.fix(floor(dim))
    model.roller(LEFT, np.eye(dim)[0])
    model.set_gravity([0.0] * (dim - 1) + [-G])
    (report,) = model.implicit(1.0, dt=1.0, quasi_static=True)

    whole = spread_box([n] * dim, [1.0] * dim, MPI.COMM_SELF)
    held = np.zeros(whole.points.shape, dtype=bool)
    held[whole.points[:, -1] < 1e-9] = True
    held[whole.points[:, 0] < 1e-9, 0] = True
    expected = linear_elastic_solution(whole.points, whole.cells, SOIL, DENSITY * G, held)
    touched = np.unique(mesh.cells[: mesh.owned_cells])
    same = [np.flatnonzero((np.abs(whole.points - x) < 1e-12).all(axis=1))[0] for x in mesh.points[touched]]
    error = model.nodal("velocity")[touched] - expected[same] if len(touched) else np.zeros(1)
    assert report.iterations == 1
    assert np.abs(error).max() < 1e-9 * np.abs(expected).max()


@pytest.mark.parametrize("owners_of", [bands, scattered, one_does_all])
def test_small_displacements_are_the_same_on_any_partition(comm, owners_of):
    """With mean stresses averaged in the forces, whose tangent is a product over ranks, in each of two soils by itself."""
    soft, stiff = (mpm.MohrCoulomb(young=e, poisson=0.3, cohesion=1e3, friction_angle=25.0) for e in (4e6, 12e6))
    model, alone = sliding_slope(comm, owners_of, laws=[soft, stiff]), sliding_slope(MPI.COMM_SELF, laws=[soft, stiff])
    for each in (model, alone):
        each.assign((each.particles.position[:, 1] < 0.15).astype(np.int32))
        each.fix(3)  # without inertia, a body that may slide as a whole would leave the tangent singular
        each.set_gravity((0, -7.0))
        *_, report = each.implicit(1.0, dt=0.5, quasi_static=True, small_displacements=True, nmd=True)
        assert report.cuts == 0 and report.iterations < 8 and report.unbalanced_ratio < 1e-7
    moved, expected = all_by_id(model), all_by_id(alone)
    assert moved["state"].max() > 1e-4  # soil yields
    np.testing.assert_allclose(
        moved["stress"], expected["stress"], rtol=0, atol=1e-7 * np.abs(expected["stress"]).max()
    )


@pytest.mark.parametrize("owners_of", [bands, scattered, one_does_all])
@pytest.mark.parametrize(
    "solver", [mpm.Newton(tolerance=1e-11), mpm.Relaxation(tolerance=1e-11)], ids=["newton", "relaxation"]
)
@pytest.mark.parametrize("nmd", [False, True])
def test_steps_are_the_same_on_any_partition(comm, owners_of, solver, nmd):
    model, alone = sliding_slope(comm, owners_of), sliding_slope(MPI.COMM_SELF)
    for each in (model, alone):
        *_, report = each.implicit(0.2, dt=0.02, damping=0.3, nmd=nmd, solver=solver)
        assert report.cuts == 0
    moved, expected = all_by_id(model), all_by_id(alone)
    assert moved["state"].max() > 1e-3
    for name in ("position", "stress", "state"):
        size = np.abs(expected[name]).max()
        np.testing.assert_allclose(moved[name], expected[name], rtol=0, atol=1e-7 * size, err_msg=name)


@pytest.mark.parametrize("owners_of", [bands, scattered])
def test_a_cylinder_that_spreads_does_so_alike_on_any_partition(comm, owners_of):
    # Half-full cells have ghost penalties on both of their sides, whose radii differ in axial symmetry.
    def spread(comm, owners_of=bands):
        mesh = spread_box((16, 6), (1.6, 0.6), comm, owners_of, diagonals="alternating", body=((0.0, 0.0), (0.5, 0.4)))
        soil = mpm.DruckerPrager(young=4e6, poisson=0.3, strength=300.0, friction=0.3)
        model = mpm.Model(mesh, soil, geometry=mpm.Geometry.AXISYMMETRIC)
        model.seed(density=2000.0, per_cell=6, cell_tag=1)
        model.fix(3)
        model.set_gravity((0.0, -9.81))
        model.implicit(0.3, dt=0.01, integration=mpm.Integration.MIXED).last()
        return model

    moved, expected = all_by_id(spread(comm, owners_of)), all_by_id(spread(MPI.COMM_SELF))
    assert np.abs(expected["displacement"]).max() > 0.05
    assert_same(moved, expected, 1e-7)
