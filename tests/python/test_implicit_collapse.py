"""The quasi-static slope under rising unit weight: the finite elements' displacements below collapse, and their collapse load."""

import numpy as np
import pytest
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

SOIL = mpm.MohrCoulomb(young=200e3, poisson=0.33, cohesion=1e3, friction_angle=25.0, dilation_angle=25.0)
TOP = 40e3
"""Unit weight at the time 1 s, beyond collapse [N/m3]"""


def slope_mesh():
    return bridge.slope_mesh(MPI.COMM_WORLD, height=1.0, angle=45.0, crest=1.1, cell_size=0.1, runout=0.5)


def finite_elements(nmd):
    domain, cell_tags, facet_tags = slope_mesh()
    body, _, facets = bridge.soil_mesh(domain, cell_tags, facet_tags, tag=bridge.SOIL)
    supports = [bridge.roller(bridge.LEFT, (1, 0)), bridge.fixed(bridge.BASE)]
    return bridge.QuasiStatic(body, SOIL, facets, supports, degree=1, nmd=nmd)


def particles():
    model = mpm.Model(bridge.background_mesh(*slope_mesh()), SOIL)
    model.seed(density=TOP / 9.81, per_cell=1, cell_tag=bridge.SOIL)
    model.roller(bridge.LEFT, (1, 0))
    model.fix(bridge.BASE)
    model.set_gravity((0, -9.81), ramp=1.0)
    return model


@pytest.mark.parametrize("nmd", [False, True])
def test_displacements_and_collapse_load_are_those_of_the_finite_elements(nmd):
    fem, model = finite_elements(nmd), particles()
    weight, u = 20e3, np.zeros(model.mesh.points.shape)
    for k in range(1, 11):
        fem.equilibrate(bridge.Load(unit_weight=k * weight / 10))
    for report in model.implicit(weight / TOP, dt=0.1 * weight / TOP, quasi_static=True, nmd=nmd, hold_positions=True):
        u += report.dt * model.nodal("velocity")
        assert report.cuts == 0
    assert report.plastic_share > 0.1
    points = fem.displacement.function_space.tabulate_dof_coordinates()[:, :2]
    order = [int(np.argmin(np.linalg.norm(model.mesh.points - p, axis=1))) for p in points]
    expected = fem.displacement.x.array.reshape(-1, 2)
    assert np.abs(u[order] - expected).max() < 1e-6 * np.abs(expected).max()

    collapse = bridge.collapse_load(
        fem, lambda value: bridge.Load(unit_weight=value), 1e3, start=weight, tolerance=1e-2
    )
    with pytest.raises(mpm.RunError, match="failed with all lengths"):
        newton = mpm.Newton(max_iterations=15)
        list(model.implicit(1.0, dt=1e3 / TOP, quasi_static=True, nmd=nmd, hold_positions=True, solver=newton))
    assert TOP * model.time == pytest.approx(collapse.value, rel=0.05)
