"""Nodal mixed discretisation in finite elements."""

import numpy as np
import pytest
from bridge_cases import MESHES, POISSON, YOUNG, column, slope_model, slope_particles
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm


def strain_of(dim, field):
    """Averaged strain (n, S) of a displacement field given as a function of (3, k) points."""
    domain, facet_tags, supports, _ = column(dim)
    law = mpm.LinearElastic(young=YOUNG, poisson=POISSON)
    model = bridge.QuasiStatic(domain, law, facet_tags, supports, degree=1, nmd=True)
    model.increment.interpolate(field)
    return model._kinematics.strain_increment()


def test_linear_field_is_left_alone():
    strain = strain_of(2, lambda x: np.stack([1e-3 * x[0] + 2e-3 * x[1], -4e-3 * x[0] + 3e-3 * x[1]]))
    assert np.allclose(strain, [1e-3, 3e-3, 0, -2e-3], atol=1e-15)
    strain = strain_of(3, lambda x: np.stack([1e-3 * x[0], 2e-3 * x[1] + 5e-3 * x[2], 3e-3 * x[2] + 1e-3 * x[0]]))
    assert np.allclose(strain, [1e-3, 2e-3, 3e-3, 0, 5e-3, 1e-3], atol=1e-15)


def test_plane_strain_stays_plane():
    strain = strain_of(2, lambda x: np.stack([x[0] ** 2, x[0] * x[1]]))
    assert not strain[:, 2].any()


def test_particles_average_alike():
    """Particles average strains, finite elements the mean stress too: the difference goes away with the cell size."""
    law = mpm.LinearElastic(young=YOUNG, poisson=0.49)
    differences = []
    for cell_size in (0.1, 0.05):
        fem = slope_model(cell_size, degree=1, nmd=True)
        fem.equilibrate(bridge.Load(unit_weight=10e3), law)
        model = slope_particles(10e3, cell_size, law=law)
        for _ in model.implicit(until=1.0, dt=1.0, quasi_static=True, nmd=True):
            pass
        differences.append(bridge.compare(fem, model)["displacement"].l2)
    assert differences[0] < 2e-3 and differences[1] < 0.7 * differences[0]


@pytest.mark.parametrize(("nmd", "low", "high"), [(False, 1.15, 1.5), (True, 1.0, 1.03)])
def test_strip_footing_without_friction_locks_unless_strains_are_averaged(nmd, low, high):
    domain, _, facet_tags = bridge.read_mesh(MESHES / "footing.geo", MPI.COMM_WORLD)
    law = mpm.MohrCoulomb(young=1e5, poisson=0.3, cohesion=1e3, friction_angle=0.0)
    supports = [bridge.roller(1, (1, 0)), bridge.roller(3, (1, 0)), bridge.fixed(2)]
    model = bridge.QuasiStatic(domain, law, facet_tags, supports, degree=1, nmd=nmd)
    result = bridge.collapse_load(model, lambda q: bridge.Load(pressure={5: q}), first_step=2e3)
    assert low < result.value / 1e3 / (2 + np.pi) < high


def test_newton_converges_quadratically():
    model = slope_model(degree=1, nmd=True)
    model.solve(bridge.Load(unit_weight=15e3))
    report = model.equilibrate(bridge.Load(unit_weight=17e3), tolerance=1e-12)
    tail = [r for r in report.residuals if r > 1e-13][-3:]
    assert report.converged and np.log(tail[2] / tail[1]) / np.log(tail[1] / tail[0]) > 1.7


def test_quadratic_elements_are_not_averaged():
    with pytest.raises(bridge.InputError, match="nmd.*degree=2"):
        slope_model(degree=2, nmd=True)
