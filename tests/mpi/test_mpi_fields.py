"""Several velocity fields, and axial symmetry, on several ranks: the same as on one."""

import numpy as np
import pytest
from mpi4py import MPI
from partitions import all_by_id, assert_same, bands, scattered, spread_box

import mpm_core as mpm

SOFT = mpm.LinearElastic(young=1e4, poisson=0.2)


def crossing(comm, owners_of, bodies):
    """Blocks that fly through one another, from the left (0) and from the right (1), over all bands."""
    mesh = spread_box((24, 6), (4.0, 1.0), comm, owners_of)
    model = mpm.Model(mesh, [SOFT, SOFT], velocity_fields=[0, 1] if len(bodies) == 2 else None)
    rng = np.random.default_rng(3)
    velocities = []
    for body in (0, 1):
        points = rng.uniform((0.3, 0.3), (0.7, 0.7), (60, 2)) + (2.5 * body, 0.0)
        if body in bodies:
            model.seed_points(points, np.full(60, 0.16 / 60), density=1000.0 * (1 + body), material=body)
            velocities.append((1.0 - 2 * body) * np.array([3.0, 0.2]) + 0.3 * (points - points.mean(axis=0))[:, ::-1])
    model.particles.set("velocity", np.concatenate(velocities)[model.particles.id].reshape(-1, 2))
    return model


@pytest.mark.parametrize("owners_of", [bands, scattered])
def test_bodies_fall_through_one_another_each_as_if_alone(comm, owners_of):
    both = crossing(comm, owners_of, [0, 1])
    list(both.explicit(0.8, dt=2e-3, nmd=True))
    moved = all_by_id(both)
    for body, rows in ((0, slice(0, 60)), (1, slice(60, 120))):
        alone = crossing(MPI.COMM_SELF, owners_of, [body])
        list(alone.explicit(0.8, dt=2e-3, nmd=True))
        expected = all_by_id(alone)
        assert abs(expected["displacement"][:, 0].mean()) > 2.0
        for name in ("displacement", "velocity", "stress", "volume"):
            np.testing.assert_allclose(moved[name][rows], expected[name], atol=1e-9 * abs(expected[name]).max())


@pytest.mark.parametrize("scheme", ["explicit", "implicit"])
def test_an_axisymmetric_slump_is_the_same_on_any_partition(comm, scheme):
    soil = mpm.MohrCoulomb(young=1e6, poisson=0.3, cohesion=200.0, friction_angle=20.0)

    def slumped(where, owners_of):
        mesh = spread_box((12, 8), (1.5, 1.0), where, owners_of, body=((-1.0, -1.0), (0.75, 0.75)))
        model = mpm.Model(mesh, soil, geometry=mpm.Geometry.AXISYMMETRIC)
        model.seed(density=2000.0, per_cell=6, cell_tag=1)
        model.fix(3)
        model.set_gravity((0.0, -9.81))
        if scheme == "explicit":
            list(model.explicit(0.2, dt=1e-3, damping=0.2, nmd=True))
        else:
            list(model.implicit(0.06, dt=0.01, nmd=True))
        return all_by_id(model)

    moved = slumped(comm, scattered)
    assert moved["displacement"][:, 0].max() > 1e-3
    alone = slumped(MPI.COMM_SELF, bands)
    if scheme == "explicit":
        assert_same(moved, alone)
    else:  # up to the tolerance of Newton's method
        np.testing.assert_allclose(
            moved["displacement"], alone["displacement"], atol=1e-5 * abs(alone["displacement"]).max()
        )
