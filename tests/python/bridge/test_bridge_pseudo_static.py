"""Body forces of a load, and inertia forces of an earthquake that act for good."""

import numpy as np
import pytest
from bridge_cases import POISSON, YOUNG
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

COHESION, FRICTION_ANGLE = 2.5e3, 25.0
SLOPE = 1.0, 45.0, COHESION, FRICTION_ANGLE, 20e3  # height, angle, strength, unit weight
SHEAR_MODULUS = YOUNG / (2 * (1 + POISSON))
LEFT, RIGHT, BASE = 1, 2, 3


def two_layers():
    """A block of quadratic elements, 1 m high, on a fixed base, whose sides move only sideways; BODY is its upper half."""
    domain, cell_tags, facet_tags = bridge.box_mesh(MPI.COMM_SELF, (0.5, 1.0), (2, 4), body=((-1.0, 0.5), (1.0, 2.0)))
    supports = [bridge.roller(LEFT, (0, 1)), bridge.roller(RIGHT, (0, 1)), bridge.fixed(BASE)]
    law = mpm.LinearElastic(young=YOUNG, poisson=POISSON)
    return bridge.QuasiStatic(domain, law, facet_tags, supports, 2, cell_tags=cell_tags)


def test_a_body_force_shears_a_layer():
    model = two_layers()
    model.solve(bridge.Load(body_force={None: (3e3, 0.0)}))
    x = np.array([[0.1, 0.3], [0.25, 0.7], [0.4, 1.0]])
    moved = 3e3 / SHEAR_MODULUS * x[:, 1] * (1 - 0.5 * x[:, 1])  # G u'' = -f, without shear at the top
    assert model.evaluate_at(x)["displacement"][:, 0] == pytest.approx(moved, rel=1e-6)
    assert model.reaction(BASE) == pytest.approx([0.5 * 3e3, 0.0], abs=1e-6)


def test_body_forces_of_cell_tags_stand_in_the_place_of_that_of_all_others():
    model = two_layers()
    model.solve(bridge.Load(body_force={None: (3e3, 0.0), bridge.BODY: (1e3, 0.0)}))  # of the upper half
    assert model.reaction(BASE) == pytest.approx([0.25 * (3e3 + 1e3), 0.0], abs=1e-6)


def test_inertia_is_a_part_of_the_unit_weight_of_each_soil():
    weights = {None: 20e3, bridge.BODY: 16e3}
    load = bridge.pseudo_static(bridge.Load(weights, body_force={bridge.BODY: (500.0, 0.0)}), (0.2, 0.1))
    assert load.unit_weight == weights
    assert load.body_force == {None: (4e3, 2e3), bridge.BODY: (3.7e3, 1.6e3)}
    model = two_layers()
    model.solve(load)
    across, up = 0.25 * (4e3 + 3.7e3), 0.25 * (0.9 * 20e3 + 0.9 * 16e3)
    walls = sum(model.reaction(tag)[1] for tag in (LEFT, RIGHT))
    assert model.reaction(BASE)[0] == pytest.approx(across, rel=1e-9)
    assert model.reaction(BASE)[1] + walls == pytest.approx(-up, rel=1e-9)
    again = bridge.pseudo_static(load, (0.1, 0.0))
    assert again.body_force[None] == (6e3, 2e3)


def test_body_forces_rise_with_a_load_between_two():
    low, high = bridge.Load(20e3), bridge.pseudo_static(bridge.Load(20e3), (0.2, 0.0))
    assert low.towards(high, 0.25).body_force == {None: (1e3, 0.0)}
    assert "body_force={None: (4000.0, 0.0)} N/m3" in repr(high)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ((1.0, 0.0), "body_force is \\(1.0, 0.0\\), expected a dictionary by cell tag or name"),
        ({None: (1.0, 0.0, 0.0)}, "body_force is .*, expected 2 finite numbers"),
        ({None: (np.nan, 0.0)}, "body_force is .*nan.*, expected finite numbers"),
        ({77: (1.0, 0.0)}, "body_force: .*77"),
    ],
)
def test_body_forces_that_no_soil_can_have(given, message):
    with pytest.raises(bridge.InputError, match=message):
        two_layers().solve(bridge.Load(body_force=given))


@pytest.mark.parametrize("coefficients", [0.2, (0.2,), (np.inf, 0.0), "much"])
def test_coefficients_that_are_none(coefficients):
    with pytest.raises(bridge.InputError, match="coefficients is"):
        bridge.pseudo_static(bridge.Load(20e3), coefficients)


@pytest.mark.parametrize(
    ("load", "message"),
    [
        (20e3, "load is 20000.0, expected a Load"),
        (bridge.Load("20e3"), "unit_weight is '20e3', expected real numbers"),
        (bridge.Load([20e3, 18e3]), "unit_weight is \\[20000.0, 18000.0\\], expected a number"),
        (
            bridge.Load(20e3, body_force=(1.0, 0.0)),
            "body_force is \\(1.0, 0.0\\), expected a dictionary by cell tag or name",
        ),
        (bridge.Load(20e3, body_force={None: (1.0, 0.0, 0.0)}), "body_force is .*, expected 2 finite numbers"),
    ],
)
def test_loads_that_inertia_cannot_be_added_to(load, message):
    with pytest.raises(bridge.InputError, match=message):
        bridge.pseudo_static(load, (0.2, 0.0))


# --- hand-over to particles ---


def particles_of(body, gravity):
    """Particles of 20 kN/m3 under 9.81 m/s2 in the cells of a body on a fixed base."""
    model = mpm.Model(bridge.background_mesh(*body), mpm.LinearElastic(young=YOUNG, poisson=POISSON))
    model.seed(density=20e3 / 9.81, per_cell=3)
    model.fix(BASE)
    model.set_gravity(gravity)
    return model


def shaken_body(coefficients):
    body = bridge.box_mesh(MPI.COMM_SELF, (1.0, 1.0), (4, 4))
    fem = bridge.QuasiStatic(body[0], mpm.LinearElastic(young=YOUNG, poisson=POISSON), body[2], [bridge.fixed(BASE)], 1)
    fem.solve(bridge.pseudo_static(bridge.Load(20e3), coefficients))
    return body, fem


def test_particles_under_tilted_gravity_are_in_the_equilibrium_of_inertia_without_a_warning(recwarn):
    body, fem = shaken_body((0.2, 0.0))
    found = bridge.initialise(particles_of(body, (0.2 * 9.81, -9.81)), fem)
    assert found.unbalanced_ratio < 1e-9
    assert not [one for one in recwarn if "finite elements" in str(one.message)]


def test_particles_without_the_inertia_of_the_finite_elements_are_warned_of():
    body, fem = shaken_body((0.2, 0.0))
    with pytest.warns(RuntimeWarning, match="finite elements carry body force across gravity.*by set_gravity"):
        bridge.initialise(particles_of(body, (0.0, -9.81)), fem, equilibrate=False)
    body, fem = shaken_body((0.0, 0.1))
    with pytest.warns(RuntimeWarning, match="unit weight of particles is 20000 N/m3.*18000 N/m3"):
        bridge.initialise(particles_of(body, (0.0, -9.81)), fem, equilibrate=False)


def test_particles_without_the_body_force_of_a_consolidation_are_warned_of():
    body = bridge.box_mesh(MPI.COMM_SELF, (1.0, 1.0), (4, 4))
    law = mpm.LinearElastic(young=YOUNG, poisson=POISSON)
    load = bridge.pseudo_static(bridge.Load(20e3), (0.2, 0.0))
    fem = bridge.water.Consolidation(
        body[0], law, bridge.water.PorousSoil(1e-4, porosity=0.4), body[2], [bridge.fixed(BASE)], [bridge.water.Head(4, 1.0)],
        load=load,
    )  # fmt: skip
    fem.initialise(pore_pressure=lambda x: 9810.0 * (1.0 - x[:, 1]))
    fem.advance(1.0)
    model = particles_of(body, (0.0, -9.81))
    model.add_water(porosity=0.4, conductivity=1e-4)
    with pytest.warns(RuntimeWarning, match="finite elements carry body force across gravity"):
        bridge.initialise(model, fem, equilibrate=False)


def test_finite_elements_that_carry_no_weight_are_said_and_not_stumbled_over():
    body, _ = shaken_body((0.0, 0.0))
    law = mpm.LinearElastic(young=YOUNG, poisson=POISSON)
    fem = bridge.QuasiStatic(body[0], law, body[2], [bridge.fixed(BASE)], 1)
    fem.solve(bridge.Load({}))
    with pytest.warns(
        RuntimeWarning, match="unit weight of particles is 20000 N/m3, .* that of the finite elements 0 N/m3"
    ):
        bridge.initialise(particles_of(body, (0.0, -9.81)), fem, equilibrate=False)


# --- slopes -----------------------------------------------------------------------------------------------------------


def slope():
    background = bridge.slope_mesh(MPI.COMM_SELF, height=1.0, angle=45.0, crest=2.0, cell_size=0.1, runout=0.1)
    domain, _, facet_tags = bridge.soil_mesh(*background)
    soil = mpm.MohrCoulomb(
        young=200e3, poisson=0.33, cohesion=COHESION, friction_angle=FRICTION_ANGLE, dilation_angle=FRICTION_ANGLE
    )
    return bridge.QuasiStatic(
        domain, soil, facet_tags, [bridge.roller(bridge.LEFT, (1, 0)), bridge.fixed(bridge.BASE)], degree=2
    )


def test_a_shaken_slope_has_the_factor_of_limit_analysis():
    """From above, to 3 % on cells of a tenth of the height."""
    load = bridge.pseudo_static(bridge.Load(20e3), (0.2, 0.0))
    found = bridge.factor_of_safety(slope(), load, start=1.0, first_step=0.1, tolerance=5e-3)
    limit = bridge.log_spiral_safety(*SLOPE, seismic=0.2, depth=0.0)
    assert limit < 0.8 * bridge.log_spiral_safety(*SLOPE, depth=0.0)
    assert found.failed and 0.99 * limit < found.value < 1.03 * limit


def test_a_slope_fails_at_its_critical_coefficient():
    """From above, to 4 % on these cells."""
    model = slope()
    model.solve(bridge.Load(20e3))
    shaken = lambda k: bridge.pseudo_static(bridge.Load(20e3), (k, 0.0))  # noqa: E731
    found = bridge.collapse_load(model, shaken, first_step=0.2, tolerance=1e-2)
    limit = bridge.log_spiral_seismic(*SLOPE, depth=0.0)
    assert found.failed and 0.98 * limit < found.value < 1.04 * limit


@pytest.mark.parametrize("depth", [None, 0.5])
def test_with_its_critical_coefficient_a_slope_has_the_factor_one(depth):
    critical = bridge.log_spiral_seismic(*SLOPE, depth=depth)
    assert 0.2 < critical < 0.6
    assert bridge.log_spiral_safety(*SLOPE, seismic=critical, depth=depth) == pytest.approx(1.0, abs=1e-4)
    assert bridge.log_spiral(*SLOPE[:4], seismic=critical, depth=depth).unit_weight == pytest.approx(20e3, rel=1e-4)


@pytest.mark.parametrize("angle", [10.0, 20.0, 28.0])
def test_a_slope_flatter_than_the_friction_angle_fails_by_inertia(angle):
    """A long one without cohesion does so at tan(phi - beta) of gravity, one with little cohesion at hardly more."""
    critical = bridge.log_spiral_seismic(1.0, angle, 1.0, 32.0, 20e3)
    infinite = np.tan(np.radians(32.0 - angle))
    assert infinite < critical < infinite + 0.02


def test_slopes_that_limit_analysis_has_no_coefficient_for():
    with pytest.raises(
        bridge.InputError, match="unit_weight is 40000.0 N/m3, expected a slope that stands without inertia"
    ):
        bridge.log_spiral_seismic(1.0, 45.0, 1e3, 10.0, 40e3)
    with pytest.raises(bridge.InputError, match="seismic is -0.1, expected a number of at least 0"):
        bridge.log_spiral_safety(*SLOPE, seismic=-0.1)
    with pytest.raises(bridge.InputError, match="friction_angle < angle \\+ atan\\(0.1\\)"):
        bridge.log_spiral(1.0, 20.0, 1e3, 30.0, seismic=0.1)


def test_inertia_beyond_friction_needs_the_depth_of_the_ground():
    """Level ground of height h slides on its base at (k - tan(phi)) gamma h = c, at nothing where h may be as large as it likes."""
    with pytest.raises(
        bridge.InputError, match="depth is None with seismic=0.1 above tan.friction_angle=0.0., expected the depth"
    ):
        bridge.log_spiral(1.0, 45.0, 1e3, 0.0, seismic=0.1)
    with pytest.raises(bridge.InputError, match="depth is None with seismic=0.1 without friction, expected the depth"):
        bridge.log_spiral_safety(1.0, 45.0, 10e3, 0.0, 20e3, seismic=0.1)
    with pytest.raises(bridge.InputError, match="depth is None with friction_angle=0, expected the depth"):
        bridge.log_spiral_seismic(1.0, 45.0, 10e3, 0.0, 20e3)
    strong = 1.0, 45.0, 100e3, 20.0, 20e3
    tangent = np.tan(np.radians(20.0))
    assert bridge.log_spiral_seismic(*strong) == pytest.approx(tangent, rel=1e-4)
    assert bridge.log_spiral_safety(*strong, seismic=0.3) == pytest.approx(tangent / 0.3, rel=1e-4)
    assert bridge.log_spiral_seismic(*strong, depth=0.0) > 2 * tangent


@pytest.mark.parametrize("friction_angle", [0.0, 20.0])
@pytest.mark.parametrize("seismic", [0.1, 0.5])
def test_spirals_are_no_stronger_than_the_best_plane_through_the_toe_of_a_cut(friction_angle, seismic):
    """The weight W above a plane at theta drives by W (sin(theta - phi) + k cos(theta - phi)), cohesion holds by c L cos(phi)."""
    theta, phi = np.radians(np.linspace(1.0, 89.0, 2000)), np.radians(friction_angle)
    driving = 0.5 / np.tan(theta) * (np.sin(theta - phi) + seismic * np.cos(theta - phi))
    planes = np.where(driving > 0, np.cos(phi) / np.sin(theta) / np.where(driving > 0, driving, 1.0), np.inf)
    spiral = bridge.log_spiral(1.0, 90.0, 1.0, friction_angle, seismic=seismic, depth=0.0).unit_weight
    assert 0.9 * planes.min() < spiral < planes.min()


@pytest.mark.parametrize("seismic", ["0.1", None, True, (0.1, 0.2)])
def test_seismic_coefficients_that_are_no_number(seismic):
    with pytest.raises(bridge.InputError, match="seismic is"):
        bridge.log_spiral(*SLOPE[:4], seismic=seismic)
    with pytest.raises(bridge.InputError, match="seismic is"):
        bridge.log_spiral_safety(*SLOPE, seismic=seismic)
