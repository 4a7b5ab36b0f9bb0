"""Collapse loads and factors of safety against limit analysis (associated flow, quadratic elements)."""

import numpy as np
import pytest
from bridge_cases import MESHES, POISSON, YOUNG, slope_model
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm


def weight(unit_weight):
    return bridge.Load(unit_weight=unit_weight)


@pytest.fixture(scope="module")
def coarse():
    """Collapse of the slope on cells of 0.1 m."""
    return bridge.collapse_load(slope_model(0.1), weight, first_step=5e3)


def test_slope_collapses_at_the_load_of_limit_analysis(coarse):
    """Rotational log-spiral: 22.9 kN/m3; finite elements come from above."""
    model, stands = slope_model(0.05), 20e3
    model.solve(weight(stands))
    fine = bridge.collapse_load(model, weight, first_step=3e3, start=stands, tolerance=5e-3)
    assert 22.9e3 < fine.value < coarse.value
    assert fine.value == pytest.approx(22.9e3, rel=0.02)
    assert coarse.failed_at - coarse.value <= 4e-3 * coarse.value
    assert np.all(np.diff(coarse.curve, axis=0) > 0)  # it settles more and more as the load rises
    lengths = np.linalg.norm(coarse.mechanism.x.array.reshape(-1, 2), axis=1)
    assert lengths.max() == pytest.approx(1.0)


def test_factor_of_safety_of_the_slope():
    """At 20 kN/m3 limit analysis gives 1.053."""
    result = bridge.factor_of_safety(slope_model(0.1), weight(20e3))
    assert result.value == pytest.approx(1.053, rel=0.02)


def test_a_factor_of_safety_leaves_the_soil_as_strong_as_it_was():
    """The second factor of one body is the first, to the width of the last steps; its stresses are those of equilibrium."""
    model, load = slope_model(0.2, "fitted"), bridge.Load(unit_weight=15e3)
    law = model.law
    first = bridge.factor_of_safety(model, load)
    assert model.law is law and model.converged and first.value > 1.2
    assert model.equilibrate(load).residuals[0] < 2 * first.residual  # the soil bears the stresses of weaker soil
    again = bridge.factor_of_safety(model, load)
    assert again.value == pytest.approx(first.value, rel=2 * 2e-3)
    steep = slope_model(0.2, "fitted")
    assert bridge.factor_of_safety(steep, bridge.Load(unit_weight=30e3)).value < 1.0
    assert not steep.converged  # the stresses are those of stronger soil
    with pytest.raises(bridge.InputError, match="start"):
        bridge.factor_of_safety(steep, bridge.Load(unit_weight=80e3), start=1.0)
    assert steep.law == law


@pytest.mark.parametrize("tolerance", [0.02, 0.03, 0.05])
def test_a_collapse_load_ends_in_equilibrium_whichever_step_came_last(tolerance):
    model = slope_model(0.2, "fitted")
    found = bridge.collapse_load(model, weight, first_step=5e3, tolerance=tolerance)
    assert model.converged and model.load == weight(found.value)
    assert model.reaction(bridge.BASE)[1] == pytest.approx(-found.value * 1.6, rel=1e-6)  # its area [m2]


def test_flow_without_dilation_collapses_earlier(coarse):
    without = bridge.collapse_load(slope_model(0.1, dilation_angle=0.0), weight, first_step=5e3, tolerance=2e-2).value
    assert 0.8 * coarse.value < without < coarse.value


def test_vertical_cut():
    """gamma H / c = 6.69 for a friction angle of 30 degrees."""
    background = bridge.slope_mesh(MPI.COMM_WORLD, angle=90, cell_size=0.05)
    domain, _, facet_tags = bridge.soil_mesh(*background)
    law = mpm.MohrCoulomb(young=YOUNG, poisson=POISSON, cohesion=1e3, friction_angle=30.0, dilation_angle=30.0)
    supports = [bridge.roller(bridge.LEFT, (1, 0)), bridge.fixed(bridge.BASE)]
    model = bridge.QuasiStatic(domain, law, facet_tags, supports)
    model.solve(weight(6e3))
    result = bridge.collapse_load(model, weight, first_step=800.0, start=6e3, tolerance=1e-2)
    assert result.value / 1e3 == pytest.approx(6.69, rel=0.03)


def strip_footing(friction_angle, degree=2, **sizes):
    """Bearing capacity over cohesion of weightless ground under a smooth, flexible strip, and the number of nodes."""
    domain, _, facet_tags = bridge.read_mesh(MESHES / "footing.geo", MPI.COMM_WORLD, parameters=sizes)
    law = mpm.MohrCoulomb(
        young=1e5, poisson=0.3, cohesion=1e3, friction_angle=friction_angle, dilation_angle=friction_angle
    )
    supports = [bridge.roller(1, (1, 0)), bridge.roller(3, (1, 0)), bridge.fixed(2)]
    model = bridge.QuasiStatic(domain, law, facet_tags, supports, degree=degree)
    result = bridge.collapse_load(model, lambda q: bridge.Load(pressure={5: q}), first_step=2e3)
    return result.value / 1e3, model.displacement.function_space.dofmap.index_map.size_global


@pytest.mark.parametrize(("friction_angle", "factor", "tolerance"), [(0.0, 2 + np.pi, 0.02), (20.0, 14.83, 0.03)])
def test_strip_footing(friction_angle, factor, tolerance):
    """Prandtl's bearing capacity factors; quartic elements are nearer to them with fewer nodes."""
    quadratic, nodes = strip_footing(friction_angle)
    assert quadratic == pytest.approx(factor, rel=tolerance)
    quartic, fewer = strip_footing(friction_angle, 4, near_size=0.4, edge_size=0.1, far_size=1.6)
    assert fewer < 0.7 * nodes and abs(quartic - factor) < abs(quadratic - factor)


def test_soil_that_cannot_fail_has_no_factor_of_safety_but_a_lower_bound():
    """Clay that is confined on all sides takes any weight in compression, whatever its strength."""
    domain, _, sides = bridge.box_mesh(MPI.COMM_WORLD, [1.0, 1.0], [2, 2])
    clay = mpm.tresca(young=1e6, poisson=0.3, shear_strength=10e3)
    supports = [bridge.roller(1, (1, 0)), bridge.roller(2, (1, 0)), bridge.fixed(3)]
    result = bridge.factor_of_safety(bridge.QuasiStatic(domain, clay, sides, supports), weight(20e3))
    assert not result.failed and result.value > 1e4 and result.failed_at == np.inf
    assert "may not be able to fail" in result.reason


def test_slope_that_cannot_stand_is_refused():
    """It carries 3 % of this weight, and would not carry it with a strength times eight either."""
    with pytest.raises(
        bridge.InputError, match="start: with the strength divided by 1.0 only.*mechanism.*smaller start"
    ):
        bridge.factor_of_safety(slope_model(), weight(800e3), start=1.0)


def test_a_start_that_is_too_large_is_halved():
    """The slope carries less than a third of this weight with its strength."""
    model = slope_model()
    found = bridge.factor_of_safety(model, weight(80e3), start=1.0)
    assert found.failed and found.value < 1.0 and not model.converged
    assert found.curve[0, 0] in (0.5, 0.25, 0.125)
    assert found.value == pytest.approx(bridge.factor_of_safety(slope_model(), weight(80e3), start=0.3).value, rel=5e-3)


def test_a_start_just_below_the_factor_is_the_factor():
    """No step beyond it finds an equilibrium; it was an error that advised a smaller first step."""
    model, load = slope_model(), weight(20e3)
    factor = bridge.factor_of_safety(model, load, tolerance=1e-3).value
    found = bridge.factor_of_safety(slope_model(), load, start=0.985 * factor, tolerance=0.04)
    assert found.value == 0.985 * factor and found.failed and factor < found.failed_at <= 1.08 * factor


def test_more_strength_is_not_advised_where_it_would_not_help():
    model = slope_model()
    model.law = mpm.MohrCoulomb(young=YOUNG, poisson=POISSON, cohesion=0.0, friction_angle=0.0)
    with pytest.raises(bridge.InputError, match="only 0.0%.*The soil has no strength there: give it[^,]*$"):
        bridge.factor_of_safety(model, weight(80e3))
