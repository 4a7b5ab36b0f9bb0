"""Finite elements and particles side by side; limit analysis."""

import numpy as np
import pytest
from bridge_cases import POISSON, YOUNG, slope_model, slope_particles
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm


@pytest.mark.parametrize("cell_size", [0.1, 0.05])
def test_first_quasi_static_step_of_the_particles_is_the_finite_element_solution(cell_size):
    """On the same linear cells, all of the soil's filled, both solve the same equations."""
    law = mpm.LinearElastic(young=YOUNG, poisson=POISSON)
    fem = slope_model(cell_size, degree=1)
    fem.equilibrate(bridge.Load(unit_weight=10e3), law)
    model = slope_particles(10e3, cell_size, law=law)
    for _ in model.implicit(until=1.0, dt=1.0, quasi_static=True):
        pass
    difference = bridge.compare(fem, model)
    assert difference["displacement"].l2 < 1e-9 and difference["displacement"].maximum < 1e-9
    # the particles' stress turns with the body, that of small strains does not
    assert difference["stress"].l2 < 0.02


def test_difference_is_relative_to_the_finite_elements():
    fem = slope_model(dilation_angle=0.0)
    fem.solve(bridge.Load(unit_weight=15e3))
    model = slope_particles(15e3)
    bridge.initialise(model, fem, equilibrate=False)
    places = model.particles.position
    same = bridge.compare(fem, model, places=places)
    assert same["displacement"].l2 < 1e-12 and same["stress"].maximum < 1e-12
    model.particles.set("stress", 1.1 * model.particles.stress)
    more = bridge.compare(fem, model, places=places)
    assert more["stress"].l2 == pytest.approx(0.1) and more["stress"].maximum == pytest.approx(0.1)


def test_particle_that_started_outside_is_named():
    fem = slope_model(dilation_angle=0.0)
    model = slope_particles(15e3)
    model.seed_points([[3.0, 0.5]], [1e-3], density=2000.0)
    with pytest.raises(bridge.InputError, match=r"particles: point .* at \(3, 0.5\) m is outside"):
        bridge.compare(fem, model)


@pytest.mark.parametrize(
    ("angle", "friction_angle", "number"),
    [(45, 25, 22.9), (90, 30, 6.69), (90, 0, 3.83), (60, 20, 10.39), (30, 25, 119.9), (30, 10, 13.50)],
)
def test_log_spiral_gives_the_stability_numbers_of_the_literature(angle, friction_angle, number):
    """gamma H / c after Chen (1975), table 9.1."""
    spiral = bridge.log_spiral(2.0, angle, 1e3, friction_angle, crest=1.0)
    assert (
        repr(spiral).startswith(f"<LogSpiral: collapse at {spiral.unit_weight:.6g} N/m3, from (")
        and len(repr(spiral)) < 150
    )
    assert spiral.unit_weight * 2.0 / 1e3 == pytest.approx(number, rel=2e-3)
    run = 2.0 / np.tan(np.radians(angle))
    assert np.allclose(spiral.curve[-1], (1.0 + run, 0.0)) and spiral.curve[0, 1] == pytest.approx(2.0)
    assert spiral.curve[0, 0] < 1.0
    radius = np.linalg.norm(spiral.curve - spiral.pole, axis=1)
    assert radius[-1] >= radius[0] * (1 - 1e-12)


def test_spiral_of_a_flat_slope_with_little_friction_dips_below_the_toe():
    assert bridge.log_spiral(1.0, 30, 1e3, 10.0).curve[:, 1].min() < -0.01
    assert bridge.log_spiral(1.0, 60, 1e3, 10.0).curve[:, 1].min() == 0.0


@pytest.mark.parametrize(
    ("angle", "depth", "number"),
    [
        (15, 500, 0.181),
        (30, 500, 0.181),
        (30, 1, 0.172),
        (30, 0.5, 0.164),
        (30, 0, 0.133),
        (60, 500, 0.191),
        (90, 500, 0.261),
    ],
)
def test_circles_give_the_stability_numbers_of_taylor(angle, depth, number):
    """c / (gamma H) without friction after Taylor (1937), to the three digits that he gives."""
    spiral = bridge.log_spiral(2.0, angle, 1e3, 0.0, crest=1.0, depth=2.0 * depth)
    assert 1e3 / (spiral.unit_weight * 2.0) == pytest.approx(number, abs=8e-4)
    toe = 1.0 + 2.0 / np.tan(np.radians(angle))
    end = spiral.curve[-1]
    if angle >= 60:
        assert end == pytest.approx((toe, 0.0))
    elif depth == 0:  # on the slope, above ground that cannot fail
        assert end[0] < toe and end[1] == pytest.approx((toe - end[0]) * np.tan(np.radians(angle)), rel=1e-6)
        assert spiral.curve[:, 1].min() == pytest.approx(0.0, abs=1e-9)
    else:
        assert end[0] > toe and end[1] == pytest.approx(0.0, abs=1e-6)
        assert spiral.pole[0] == pytest.approx(0.5 * (1.0 + toe))  # Taylor's midpoint circle
        assert spiral.curve[:, 1].min() == pytest.approx(-2.0 * depth, rel=1e-3)
    factor = bridge.log_spiral_safety(2.0, angle, 1e3, 0.0, spiral.unit_weight, depth=2.0 * depth)
    assert factor == pytest.approx(1.0, rel=1e-5)


def test_the_ground_limits_the_depth_of_spirals():
    depths = (0.0, 0.2, 0.5, 1.0, 3.0)
    loads = [bridge.log_spiral(1.0, 30, 1e3, 0.0, depth=depth).unit_weight for depth in depths]
    assert (np.diff(loads) < 0).all() and loads[0] > bridge.log_spiral(1.0, 30, 1e3, 0.0).unit_weight > loads[2]
    through_toe = bridge.log_spiral(1.0, 45, 1e3, 25.0)  # with so much friction, whatever the ground
    for depth in (0.0, 1.0):
        spiral = bridge.log_spiral(1.0, 45, 1e3, 25.0, depth=depth)
        assert spiral.unit_weight == through_toe.unit_weight and (spiral.curve == through_toe.curve).all()


def test_factor_of_safety_of_the_log_spiral():
    assert bridge.log_spiral_safety(1.0, 45, 1e3, 25.0, 20e3) == pytest.approx(1.053, rel=1e-3)
    at_collapse = bridge.log_spiral(1.0, 45, 1e3, 25.0).unit_weight
    assert bridge.log_spiral_safety(1.0, 45, 1e3, 25.0, at_collapse) == pytest.approx(1.0, rel=1e-5)


@pytest.mark.parametrize(
    "arguments",
    [
        (1.0, 20, 1e3, 25.0),
        (1.0, 95, 1e3, 25.0),
        (0.0, 45, 1e3, 25.0),
        (1.0, 45, 0.0, 25.0),
        (1.0, 25.00001, 1e3, 25.0),
    ],
)
def test_slope_without_a_mechanism_is_refused(arguments):
    with pytest.raises(bridge.InputError, match="angle|height"):
        bridge.log_spiral(*arguments)


@pytest.mark.parametrize("depth", [-1.0, float("inf"), float("nan")])
def test_ground_without_a_depth_is_refused(depth):
    with pytest.raises(bridge.InputError, match=f"depth is {depth} m, expected a number of at least 0, or None"):
        bridge.log_spiral_safety(1.0, 45, 1e3, 25.0, 20e3, depth=depth)


def test_soil_without_weight_has_no_factor_of_safety():
    with pytest.raises(bridge.InputError, match="unit_weight is 0.0 N/m3, expected a positive number"):
        bridge.log_spiral_safety(1.0, 45, 1e3, 25.0, 0.0)


def test_finite_elements_and_particles_in_the_wrong_order_are_refused():
    domain, cell_tags, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, (1.0, 1.0), (2, 2))
    law = mpm.LinearElastic(young=1e6, poisson=0.3)
    fem = bridge.QuasiStatic(domain, law, facet_tags, [bridge.fixed(3)])
    with pytest.raises(bridge.InputError, match="(?s)fem is <Model.*expected a QuasiStatic or a ElasticSolution"):
        bridge.compare(mpm.Model(bridge.background_mesh(domain, cell_tags, facet_tags), law), fem)
