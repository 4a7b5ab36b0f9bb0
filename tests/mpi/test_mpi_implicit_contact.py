"""Contact in implicit steps, tied soil and loads on surfaces on several ranks: the motion and the reactions of one."""

import numpy as np
import pytest
from mpi4py import MPI
from partitions import FIELDS, all_by_id, assert_same, bands, one_does_all, scattered, spread_box

import mpm_core as mpm


def layer(comm, owners_of):
    """A loaded block on rough ground, tied to a plate that turns, across the borders of the ranks."""
    mesh = spread_box((16, 8), (2.0, 1.0), comm, owners_of, diagonals="alternating")
    model = mpm.Model(mesh, mpm.LinearElastic(young=1e6, poisson=0.3))
    grid = 0.0625 * (np.indices((16, 8)).reshape(2, -1).T + 0.5) + (0.513, 0.207)
    model.seed_points(grid, np.full(len(grid), 0.0625**2), density=1000.0)
    model.set_gravity((1.0, -9.0))
    ground = model.add_contact(mpm.Plane((0.0, 0.207 - 1e-9), (0, 1)), friction=0.3)
    plate = model.add_contact(mpm.Box((0.3, 0.3), (0.51, 0.6)), bonded=True, spin=0.02)
    area = model.load_surface(mpm.Polyline([(1.5, 0.707), (0.5, 0.707)]), pressure=500.0)
    return model, ground, plate, area


@pytest.mark.parametrize("owners_of", [bands, scattered, one_does_all])
def test_implicit_contact_is_the_same_on_any_partition(comm, owners_of):
    runs = [layer(comm, owners_of), layer(MPI.COMM_SELF, one_does_all)]
    assert runs[0][3] == pytest.approx(runs[1][3], rel=1e-12)
    for model, *_ in runs:
        list(model.implicit(0.05, dt=0.01, solver=mpm.Newton(tolerance=1e-11)))
    assert_same(all_by_id(runs[0][0], (*FIELDS, "contact_slip_0", "contact_bond_1")),
                all_by_id(runs[1][0], (*FIELDS, "contact_slip_0", "contact_bond_1")))  # fmt: skip
    for one, other in zip(runs[0][1:3], runs[1][1:3], strict=True):
        for name in ("force", "impulse", "moment"):
            value = getattr(other, name)
            assert getattr(one, name) == pytest.approx(value, rel=1e-8, abs=1e-8 * np.abs(value).max())
    assert runs[0][1].impulse[1] < 0  # the ground carries the block


@pytest.mark.parametrize("wet", [False, True])
@pytest.mark.parametrize("owners_of", [bands, scattered, one_does_all])
def test_a_load_settles_alike_on_any_partition(comm, owners_of, wet):
    runs = []
    for ranks in (comm, MPI.COMM_SELF):
        mesh = spread_box((12, 8), (1.2, 0.8), ranks, owners_of)
        model = mpm.Model(mesh, mpm.LinearElastic(young=1e6, poisson=0.45))
        # No point on a diagonal, where it would be in either cell.
        grid = 0.05 * (np.indices((24, 8)).reshape(2, -1).T + 0.5) + (0.0037, 0.0)
        model.seed_points(grid, np.full(len(grid), 0.05**2), density=1000.0)
        model.fix(3)
        servo = mpm.Servo(force=(150.0, -900.0), speed=1.0)
        plate = model.add_contact(mpm.Box((0.31, 0.4), (0.87, 0.6)), friction=0.5, body=servo)
        if wet:
            model.add_water(porosity=0.4, conductivity=1e-5, modulus=np.inf, drained_surface=True)
        list(model.implicit(0.2, dt=0.1, quasi_static=True, nmd=True, solver=mpm.Newton(tolerance=1e-11)))
        runs.append((model, plate))
    names = (*FIELDS, "contact_slip_0", *(["pore_pressure"] if wet else []))
    assert_same(*(all_by_id(model, names) for model, _ in runs))
    assert runs[0][1].displacement == pytest.approx(runs[1][1].displacement, rel=1e-7)
    assert runs[0][1].force == pytest.approx([-150.0, 900.0], rel=1e-6)


@pytest.mark.parametrize("owners_of", [bands, scattered, one_does_all])
def test_a_rotating_body_moves_alike_on_any_partition(comm, owners_of):
    runs = []
    for ranks in (comm, MPI.COMM_SELF):
        mesh = spread_box((12, 8), (1.2, 0.8), ranks, owners_of)
        model = mpm.Model(mesh, mpm.LinearElastic(young=1e6, poisson=0.3))
        grid = 0.05 * (np.indices((24, 8)).reshape(2, -1).T + 0.5) + (0.0037, 0.0)
        model.seed_points(grid, np.full(len(grid), 0.05**2), density=1000.0)
        model.fix(3)
        model.set_gravity((3.0, -9.0))
        disc = model.add_contact(mpm.Disc((0.5, 0.6), 0.2), friction=0.5, body=mpm.FreeBody(mass=60.0))
        list(model.implicit(0.1, dt=0.02, solver=mpm.Newton(tolerance=1e-11)))
        runs.append((model, disc))
    assert_same(*(all_by_id(model, (*FIELDS, "contact_slip_0")) for model, _ in runs))
    for name in ("displacement", "angle", "spin", "force"):
        assert getattr(runs[0][1], name) == pytest.approx(getattr(runs[1][1], name), rel=1e-7), name
    assert runs[0][1].angle[0] < -0.01


@pytest.mark.parametrize("owners_of", [bands, scattered, one_does_all])
def test_a_patch_is_loaded_alike_on_any_partition(comm, owners_of):
    # On sides of tetrahedra whose particles leave gaps, and beyond the end of the soil, x < 0.7.
    corners = np.array([(0.31, 0.27), (0.31, 0.71), (0.93, 0.66), (0.88, 0.3)])
    patch = mpm.Triangles(np.column_stack([corners, np.full(4, 0.5)]), [(0, 1, 2), (0, 2, 3)])
    runs = []
    for ranks in (comm, MPI.COMM_SELF):
        mesh = spread_box((5, 5, 8), (1.0, 1.0, 1.0), ranks, owners_of)
        model = mpm.Model(mesh, mpm.LinearElastic(young=1e6, poisson=0.3))
        model.seed(density=1000.0, per_cell=4)
        model.remove((model.particles.position > (0.7, 1.0, 0.5)).any(axis=1))
        runs.append((model.load_surface(patch, traction=(1.0, 2.0, 3.0)), model))
    assert runs[0][0] == pytest.approx(runs[1][0], rel=1e-12)
    force = comm.allreduce(runs[0][1].particles.traction.sum(axis=0))
    assert force == pytest.approx(runs[0][0] * np.array([1.0, 2.0, 3.0]), rel=1e-12)
