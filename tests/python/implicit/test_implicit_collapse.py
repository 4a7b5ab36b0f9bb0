"""The quasi-static slope under rising unit weight: the finite elements' displacements below collapse, and their collapse load."""

import numpy as np
import pytest
from bridge_cases import slope_model
from implicit_cases import slope

import fenics_bridge as bridge
import mpm_core as mpm

SOIL = mpm.MohrCoulomb(young=200e3, poisson=0.33, cohesion=1e3, friction_angle=25.0, dilation_angle=25.0)
TOP = 40e3
"""Unit weight at the time 1 s, beyond collapse [N/m3]"""


def rising_slope():
    model = slope(weight=TOP, per_cell=1, law=SOIL)
    model.set_gravity((0, -9.81), ramp=1.0)
    return model


def raised(model, weight, step, nmd, **options):
    """Nodal displacements [m] after raising the unit weight in small displacements, and the last report."""
    u = np.zeros(model.mesh.points.shape)
    run = model.implicit(weight / TOP, dt=step / TOP, quasi_static=True, small_displacements=True, nmd=nmd, **options)
    for report in run:
        u += report.dt * model.nodal("velocity")
    return u, report


@pytest.mark.parametrize("nmd", [False, True])
def test_displacements_and_collapse_load_are_those_of_the_finite_elements(nmd):
    fem, model, weight = slope_model(degree=1, nmd=nmd), rising_slope(), 20e3
    for k in range(1, 11):
        fem.equilibrate(bridge.Load(unit_weight=k * weight / 10))
    start = model.particles.position
    u, report = raised(model, weight, weight / 10, nmd)
    assert report.plastic_fraction > 0.1 and report.unbalanced_ratio < 1e-6
    points = fem.displacement.function_space.tabulate_dof_coordinates()[:, :2]
    order = [int(np.argmin(np.linalg.norm(model.mesh.points - p, axis=1))) for p in points]
    expected = fem.displacement.x.array.reshape(-1, 2)
    assert np.abs(u[order] - expected).max() < 1e-6 * np.abs(expected).max()
    apart = model.particles.displacement - fem.evaluate_at(start)["displacement"]
    assert np.abs(apart).max() < 1e-6 * np.abs(expected).max()

    collapse = bridge.collapse_load(fem, lambda g: bridge.Load(unit_weight=g), 1e3, start=weight)
    with pytest.raises(
        mpm.RunError, match="failed with all step lengths.* iterations; if the soil fails here there is no equilibrium"
    ):
        raised(model, TOP, 1e3, nmd, solver=mpm.Newton(max_iterations=12))
    assert TOP * model.time == pytest.approx(collapse.value, rel=5e-3)
    assert np.array_equal(model.particles.position, start) and np.ptp(model.particles.volume) < 1e-12


def test_small_displacements_are_for_quasi_static_runs():
    with pytest.raises(mpm.InputError, match="small_displacements is True, expected False"):
        rising_slope().implicit(1.0, dt=1.0, small_displacements=True)


def test_steps_that_are_too_long_for_soil_that_fails_are_answered_with_shorter_ones():
    model = rising_slope()
    one = mpm.Newton(max_iterations=1, tolerance=1e-12)  # as no solver finds a slide in steps of minutes
    with pytest.raises(
        mpm.RunError, match="after 1 iterations; if the soil fails here it moves .* a dt that is short for a slide"
    ):
        list(model.implicit(1.0, dt=1.0, solver=one))
