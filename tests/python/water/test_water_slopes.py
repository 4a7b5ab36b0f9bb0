"""Pore pressures of seepage on the effective stresses of slopes: reservoirs that fall, suction, factors of safety."""

import numpy as np
import pytest
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water

comm = MPI.COMM_WORLD
WEIGHT = 9810.0
LEFT, RIGHT, BASE, TOP = 1, 2, 3, 4
SUPPORTS = [bridge.roller(LEFT, (1, 0)), bridge.roller(RIGHT, (1, 0)), bridge.fixed(BASE)]


def layer(soil, boundary, **options):
    """A level layer, 4 m wide and 3 m high, and the flow in it."""
    domain, _, facet_tags = bridge.box_mesh(comm, (4.0, 3.0), (8, 6))
    return domain, facet_tags, water.Seepage(domain, soil, facet_tags, boundary, **options)


# --- drawdown over level ground --------------------------------------------------------------------------------------


@pytest.mark.parametrize("conductivity", [1e-3, 1e-7, 1e-11])
def test_lowering_water_over_level_ground_changes_no_effective_stress(conductivity):
    # The load of the water falls by as much as the pore pressure: with an incompressible water at once, whatever k.
    soil = water.PorousSoil(conductivity, porosity=0.4, compressibility=1e-7)
    boundary = [water.Reservoir(TOP, ((0.0, 9.0), (3600.0, 4.0)))]
    domain, _, facet_tags = bridge.box_mesh(comm, (4.0, 3.0), (8, 6))
    standing = water.standing_water(domain, facet_tags, boundary)
    flow = water.Seepage(domain, soil, facet_tags, boundary, water_modulus=1e30, loading=standing)
    flow.solve()
    clay = mpm.MohrCoulomb(young=5e6, poisson=0.3, cohesion=5e3, friction_angle=25.0)
    fem = bridge.QuasiStatic(domain, clay, facet_tags, SUPPORTS)
    fem.reconfigure(pore_pressure=flow.pore_pressure())
    fem.solve(bridge.Load(unit_weight=18e3))
    before, buoyant = fem.points.stress.copy(), 18e3 - WEIGHT
    vertical = -buoyant * (3.0 - fem.points.coordinates()[:, 1])
    assert before[:, 1] == pytest.approx(vertical, abs=1e-6 * buoyant * 3.0)
    fem.reset_displacement()
    for level in (6.5, 4.0):
        assert flow.advance(1800.0)
        height = flow.pressure_head.function_space.tabulate_dof_coordinates()[:, 1]
        assert flow.pressure_head.x.array == pytest.approx(level - height, abs=1e-9)
        fem.reconfigure(pore_pressure=flow.pore_pressure())
        fem.solve(bridge.Load(unit_weight=18e3))
        assert fem.points.stress == pytest.approx(before, abs=1e-8 * buoyant * 3.0)
        assert np.abs(fem.displacement.x.array).max(initial=0.0) < 1e-12


def test_peat_takes_a_load_that_is_larger_than_its_modulus():
    """m_v w is 0.5 after the step, more than the porosity of 0.4: undrained, the water still takes m_v / (m_v + n / K_w) of the load."""
    soil = water.PorousSoil(1e-12, porosity=0.4, compressibility=1e-5)
    loading = lambda x, time: 50.0 * time + 0 * x[:, 0]
    _, _, flow = layer(soil, [water.Head(TOP, 3.0)], water_modulus=2.2e9, loading=loading)
    flow.solve()
    assert flow.advance(1000.0)
    height = flow.pressure_head.function_space.tabulate_dof_coordinates()[:, 1]
    rise = 9810.0 * (flow.pressure_head.x.array - (3.0 - height))[height < 2.0]
    assert rise == pytest.approx(50e3 * 1e-5 / (1e-5 + 0.4 / 2.2e9), rel=1e-3)


def test_a_modulus_in_the_place_of_a_compressibility_is_named():
    soil = water.PorousSoil(1e-6, porosity=0.4, compressibility=2e7)
    _, _, flow = layer(soil, [water.Head(BASE, -1.0)])
    flow.solve()
    with pytest.raises(
        mpm.InputError, match=r"largest compressibility is 2e\+07 1/Pa, .* less than no water; expected the inverse"
    ):
        flow.advance(10.0)


def test_compressible_water_takes_the_load_that_the_skeleton_leaves_it():
    # Undrained, by the storages: a load w raises the pore pressure by m_v / (m_v + n / K_w) of it (van der Kamp and Gale 1983).
    soil = water.PorousSoil(1e-9, porosity=0.4, compressibility=1e-7)
    _, _, flow = layer(
        soil, [water.Head(TOP, 3.0)], water_modulus=2e6, loading=lambda x, time: 20.0 * time + 0 * x[:, 0]
    )
    flow.solve()
    assert flow.advance(1000.0)
    rise = bridge.evaluate_at(np.array([[2.0, 0.5]]), p=flow.pressure_head)["p"][0, 0] - 2.5
    assert WEIGHT * rise == pytest.approx(20e3 * 1e-7 / (1e-7 + 0.4 / 2e6), rel=1e-6)


def test_water_is_conserved_under_a_load_that_changes_and_a_step_that_fails_leaves_it(monkeypatch):
    soil = water.PorousSoil(1e-8, porosity=0.4, compressibility=1e-7)
    _, _, flow = layer(soil, [water.Head(TOP, 3.0)], loading=lambda x, time: 10.0 * time + 0 * x[:, 0])
    flow.solve()
    for _ in range(3):
        before = flow.stored_water()
        assert flow.advance(1000.0)
        assert flow.stored_water() - before == pytest.approx(1000.0 * flow.inflow(TOP), rel=1e-8)
    stored = flow.stored_water()
    monkeypatch.setattr(water.complementarity, "MOST_ITERATIONS", 0)
    assert not flow.advance(1000.0)
    assert flow.stored_water() == stored


def test_standing_water_is_that_above_the_ground():
    domain, _, facet_tags = bridge.soil_mesh(*bridge.slope_mesh(comm, height=2.0, angle=45.0, crest=2.0, cell_size=0.5,
                                                                kind="fitted"))  # fmt: skip
    at = water.standing_water(domain, facet_tags, [water.Reservoir(bridge.SLOPE, ((0.0, 3.0), (10.0, 1.0)))])
    points = np.array([[1.0, 0.5], [2.5, 0.1], [2.5, 1.5], [3.75, 0.1]])  # the slope goes from (2, 2) to (4, 0)
    assert at(points, 0.0) == pytest.approx(WEIGHT * np.array([0.0, 1.5, 1.5, 2.75]))
    assert at(points, 10.0) == pytest.approx(WEIGHT * np.array([0.0, 0.0, 0.0, 0.75]), abs=1e-9)
    with pytest.raises(mpm.InputError, match="boundary has no Reservoir"):
        water.standing_water(domain, facet_tags, [water.Rain(bridge.SLOPE, 0.0)])


# --- suction ---------------------------------------------------------------------------------------------------------


def test_suction_adds_to_effective_stress_and_does_not_pull_at_the_surface():
    # Gardner's curve, steady rain r k on a water table at the base: sigma' = -(gamma (H - z) + S_e s), S_e = exp(-alpha s)
    # and exp(-alpha s) = r + (1 - r) exp(-alpha gamma_w z).
    alpha, r, height = 0.5 / WEIGHT, 0.4, 3.0
    soil = water.PorousSoil(1e-6, retention=water.Gardner(alpha))
    errors = []
    for n in (12, 24):
        domain, _, facet_tags = bridge.box_mesh(comm, (1.0, height), (2, n))
        flow = water.Seepage(domain, soil, facet_tags, [water.Head(BASE, 0.0), water.Rain(TOP, r * 1e-6)])
        flow.solve()
        fem = bridge.QuasiStatic(domain, mpm.LinearElastic(young=5e6, poisson=0.3), facet_tags, SUPPORTS)
        fem.reconfigure(pore_pressure=flow.pore_pressure(suction=True))
        fem.solve(bridge.Load(unit_weight=18e3))
        z = fem.points.coordinates()[:, 1]
        effective = r + (1 - r) * np.exp(-alpha * WEIGHT * z)
        exact = -(18e3 * (height - z) - effective * np.log(effective) / alpha)
        errors.append(np.abs(fem.points.stress[:, 1] - exact).max() / 18e3)
    assert errors[1] < 0.1 * height / 24 and errors[0] / errors[1] > 1.8


def test_suction_presses_particles_at_the_surface_as_it_does_finite_elements():
    # Under a uniform suction s the pores of a block push on its free surface alone: s times its width from above, and nothing
    # on the whole of a block that is free all around.

    domain, cell_tags, facet_tags = bridge.box_mesh(comm, (4.0, 3.0), (8, 6), body=((1.0, 1.0), (3.0, 2.0)))
    model = mpm.Model(bridge.background_mesh(domain, cell_tags, facet_tags), mpm.LinearElastic(young=5e6, poisson=0.3))
    model.seed(density=2e3, per_cell=6, cell_tag=bridge.BODY)
    force, y = bridge.seepage_forces(model, lambda x: -7e3 + 0 * x[:, 0]), model.particles.position[:, 1]
    assert force.sum(axis=0) == pytest.approx([0.0, 0.0], abs=1e-6)
    assert force[y > 1.5, 1].sum() == pytest.approx(-7e3 * 2.0)
    assert not bridge.seepage_forces(model, lambda x: 7e3 + 0 * x[:, 0]).any()


# --- factors of safety -----------------------------------------------------------------------------------------------

FRICTION, COHESION, SATURATED, SLOPE = np.radians(30.0), 1e3, 20e3, np.radians(20.0)
SUCTION = 0.8 * WEIGHT  # Pa, uniform, of which half is effective


@pytest.mark.parametrize(
    "water_pressure, unit_weight",
    [
        (lambda d: 0.0 * d, 18e3),
        (lambda d: WEIGHT * np.cos(SLOPE) ** 2 * d, SATURATED),
        (lambda d: -0.5 * SUCTION + 0 * d, 18e3),
    ],
    ids=["dry", "seepage parallel to the slope", "suction"],
)
def test_an_infinite_slope_has_the_factor_of_its_closed_form(water_pressure, unit_weight):
    # F = [c + (gamma d cos^2 b - p) tan(phi)] / (gamma d sin b cos b) at the base, d below the surface; for p = gamma_w d cos^2 b
    # and no cohesion that is gamma' tan(phi) / (gamma tan b). The ends add what falls with the length: two
    # lengths give the limit.
    depth, found = 1.0, []
    for length in (20.0, 40.0):
        domain, _, facet_tags = bridge.box_mesh(comm, (length, depth), (int(2 * length), 4))
        domain.geometry.x[:, 1] -= np.tan(SLOPE) * domain.geometry.x[:, 0]
        law = mpm.MohrCoulomb(young=20e6, poisson=0.3, cohesion=COHESION, friction_angle=30.0, dilation_angle=30.0)
        fem = bridge.QuasiStatic(domain, law, facet_tags, SUPPORTS)
        fem.reconfigure(pore_pressure=lambda x: water_pressure(depth - x[:, 1] - np.tan(SLOPE) * x[:, 0]))
        safety = bridge.factor_of_safety(fem, bridge.Load(unit_weight=unit_weight), start=0.4, tolerance=1e-3)
        assert safety.failed
        found.append(0.5 * (safety.value + safety.failed_at))
    weight = unit_weight * depth
    normal = weight * np.cos(SLOPE) ** 2 - water_pressure(depth)
    exact = (COHESION + normal * np.tan(FRICTION)) / (weight * np.sin(SLOPE) * np.cos(SLOPE))
    assert found[0] > found[1] > exact
    assert 2 * found[1] - found[0] == pytest.approx(exact, rel=0.02)
