"""Finite elements of seepage and consolidation under any gravity, and particles that go on from them."""

import warnings

import numpy as np
import pytest
from consolidation_cases import BASE, ELEMENTS, LEFT, RIGHT, TOP, layer_excess
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water

LAW = mpm.LinearElastic(young=50e6, poisson=0.3)
GRAVITIES = pytest.mark.parametrize("gravity", [9.80665, 10.0, 490.5])
HELD = [bridge.roller(LEFT, (1, 0)), bridge.roller(RIGHT, (1, 0)), bridge.fixed(BASE)]


def column(gravity, boundary, conductivity=1e-8, element=water.Element.TAYLOR_HOOD, load=0.0, cells=20, **options):
    """A saturated column of 2000 kg/m3, 1 m high, under a pressure on its top; the model and its mesh."""
    mesh = bridge.box_mesh(MPI.COMM_WORLD, (0.2, 1.0), (4, cells))
    return mesh, water.Consolidation(
        mesh[0], LAW, water.PorousSoil(conductivity, porosity=0.4, retention=options.pop("retention", water.AlwaysSaturated())),
        mesh[2], HELD, boundary, load=bridge.Load(unit_weight=2000.0 * gravity, pressure={TOP: load}), element=element,
        gravity=gravity, **options,
    )  # fmt: skip


def at_rest(model, gravity, level=1.0):
    """Begin with water at rest below a level, and with the buoyant weight of the soil."""
    vertical = -1000.0 * gravity * (1.0 - model.points.coordinates()[:, 1])
    stress = np.zeros_like(model.points.stress)
    stress[:, :3] = (LAW.poisson / (1 - LAW.poisson) * vertical)[:, None]
    stress[:, 1] = vertical
    model.initialise(stress, pore_pressure=lambda x: 1000.0 * gravity * (level - x[:, 1]))


# --- water at rest, consolidation -------------------------------------------------------------------------------------


@ELEMENTS
@GRAVITIES
def test_the_base_carries_the_soil_and_the_water_above_it(element, gravity):
    """A reservoir of depth h over a column of height H: rho g H + gamma_w h, of which the soil has its buoyant weight."""
    _, model = column(gravity, [water.Reservoir(TOP, 3.0)], 1e-3, element)
    assert model.advance(1e7).converged
    weight = 1000.0 * gravity
    assert -model.reaction(BASE)[1] == pytest.approx(0.2 * (2.0 * weight + 2.0 * weight), rel=1e-8)
    heights = np.array([0.05, 0.5, 0.95])
    there = model.evaluate_at(np.column_stack([np.full(3, 0.1), heights]))
    assert there["pressure"][:, 0] == pytest.approx(weight * (3.0 - heights), rel=1e-6)
    assert model.points.stress[:, 1].mean() == pytest.approx(-0.5 * weight, rel=1e-6)


@ELEMENTS
@pytest.mark.parametrize("gravity", [9.81, 10.0, 490.5])
def test_a_layer_consolidates_in_a_time_that_does_not_depend_on_gravity(element, gravity):
    """c_v = k M / gamma_w, both k and gamma_w under 9.81 m/s2."""
    load, conductivity = 10e3, 1e-8
    _, model = column(gravity, [water.Head(TOP, 1.0)], conductivity, element, load, cells=30, water_modulus=np.inf)
    at_rest(model, gravity)
    period = 9810.0 / (conductivity * LAW.p_wave_modulus)
    model.run(0.02 * period, 1e-4 * period, growth=1.1)
    model.run(0.2 * period, 5e-3 * period, growth=1.0)
    heights = np.array([0.0, 0.3, 0.7])
    found = model.evaluate_at(np.column_stack([np.full(3, 0.1), heights]))["pressure"][:, 0]
    excess = found - 1000.0 * gravity * (1.0 - heights)
    assert excess / load == pytest.approx(layer_excess(heights, 0.2), abs=1e-2)


@pytest.mark.parametrize("gravity", [10.0, 490.5])
def test_saturated_soil_in_free_fall_has_no_pressure(gravity):
    """The density of the water is its unit weight over the gravity of the model."""
    domain, _, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, (1.0, 1.0), (4, 4))
    model = water.Consolidation(
        domain, LAW, water.PorousSoil(1e-3, density=2000.0), facet_tags, [bridge.roller(LEFT, (1, 0))], [],
        load=bridge.Load(unit_weight=2000.0 * gravity), inertia=water.Newmark(beta=0.25, gamma=0.5), gravity=gravity,
    )  # fmt: skip
    model.motion.acceleration.x.array[1::2] = -gravity
    for _ in range(5):
        assert model.advance(0.1).converged
    fallen = model.evaluate_at(np.array([[0.5, 0.5]]))["displacement"][0, 1]
    assert fallen == pytest.approx(-0.5 * gravity * 0.25, rel=1e-6)
    assert np.abs(model.pressure.x.array).max() < 1e-6 * 1000.0 * gravity


# --- the scaling of models --------------------------------------------------------------------------------------------


def drying_slope(scale):
    """Steady flow in an unsaturated slope, then a fall of its water in a time that is shorter by scale^2; points of nodes."""
    size, gravity = 1.0 / scale, 9.81 * scale
    background = bridge.slope_mesh(
        MPI.COMM_WORLD, height=4.0 * size, angle=30.0, crest=4.0 * size, cell_size=0.8 * size, kind="fitted"
    )
    domain, _, facet_tags = bridge.soil_mesh(*background)
    silt = water.PorousSoil(
        1e-6, porosity=0.4, compressibility=1e-7, retention=water.VanGenuchten(alpha=1.5e-4, n=2.0, residual=0.1)
    )
    pond = ((0.0, 2.0 * size), (86400.0 / scale**2, 0.5 * size))
    boundary = [water.Head(bridge.LEFT, 3.0 * size), water.Reservoir(bridge.SLOPE, pond)]
    loading = water.standing_water(domain, facet_tags, boundary, gravity=gravity)
    flow = water.Seepage(domain, silt, facet_tags, boundary, gravity=gravity, loading=loading)
    flow.solve()
    steady = flow.inflow(bridge.LEFT)
    for _ in range(4):
        assert flow.advance(21600.0 / scale**2)
    return flow, steady


def test_water_flows_through_a_small_model_in_a_centrifuge_as_through_its_prototype():
    """1/50 of the size under 50 g: the same pore pressures, 50 times the velocities, and as much water per metre and second."""
    (prototype, steady), (small, as_steady) = drying_slope(1.0), drying_slope(50.0)
    assert as_steady == pytest.approx(steady, rel=1e-9) and steady > 1e-8
    pressures = [flow.unit_weight * flow.pressure_head.x.array for flow in (prototype, small)]
    assert np.ptp(pressures[0]) > 20e3
    np.testing.assert_allclose(pressures[1], pressures[0], rtol=0, atol=1e-7 * np.abs(pressures[0]).max())
    assert small.inflow(bridge.SLOPE) == pytest.approx(prototype.inflow(bridge.SLOPE), rel=1e-6)


@pytest.mark.parametrize("inertia", [False, True])
def test_a_small_column_in_a_centrifuge_consolidates_as_its_prototype(inertia):
    """As for particles: time over 50^2, and with inertia over 50, by water that is 50 times as viscous (k / 50)."""
    found = []
    for scale in (1.0, 50.0):
        size, gravity = 1.0 / scale, 9.81 * scale
        conductivity, unit = (1e-4 / scale, 1 / scale) if inertia else (1e-7, 1 / scale**2)
        domain, _, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, (0.2 * size, size), (4, 20))
        model = water.Consolidation(
            domain, LAW, water.PorousSoil(conductivity, porosity=0.4, density=2000.0), facet_tags, HELD,
            [water.Reservoir(TOP, 1.5 * size)], load=bridge.Load(unit_weight=2000.0 * gravity, pressure={TOP: 30e3}),
            inertia=water.Newmark() if inertia else None, gravity=gravity, solver=bridge.Solver(tolerance=1e-10),
        )  # fmt: skip
        for _ in range(10):
            assert model.advance((0.01 if inertia else 20.0) * unit).converged
        within = np.column_stack([np.full(5, 0.11), [0.03, 0.27, 0.52, 0.78, 0.96]])  # cells
        there = model.evaluate_at(size * within)
        found.append((there["pressure"], there["stress"], there["displacement"] / size))
    for one, other in zip(*found):
        assert np.ptp(one) > 0
        np.testing.assert_allclose(other, one, rtol=0, atol=1e-6 * np.abs(one).max())


# --- particles that go on ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("gravity", [10.0, 490.5])
@pytest.mark.parametrize("dries", [False, True])
def test_particles_take_over_in_equilibrium_and_go_on_as_the_elements_do(gravity, dries):
    curve = water.VanGenuchten(alpha=4e-4 * 9.81 / gravity, n=2.0) if dries else None
    given = {"retention": curve} if dries else {}
    boundary, load = ([water.Head(BASE, 0.0)], 0.0) if dries else ([water.Reservoir(TOP, 1.5)], 20e3)
    conductivity, duration, dt = (1e-5, 1e5 * 9.81 / gravity, 5e4 * 9.81 / gravity) if dries else (1e-6, 50.0, 20.0)
    mesh, fem = column(
        gravity, boundary, conductivity, water.Element.STABILISED, load, solver=bridge.Solver(tolerance=1e-12), **given
    )
    at_rest(fem, gravity, 1.0 if dries else 1.5)
    assert fem.run(duration, 1e-3 * duration, growth=1.5)[-1].converged
    model = mpm.Model(bridge.background_mesh(mesh[0], None, mesh[2]), LAW)
    model.seed(density=2000.0, per_cell=3)
    bridge.apply_supports(model, HELD)
    model.set_gravity((0.0, -gravity))
    model.add_water(porosity=0.4, conductivity=conductivity, **given)
    if dries:
        model.hold_pore_pressure(BASE, 0.0)
    else:
        water.apply_reservoirs(model, boundary, 0.0)
        model.press_surface(TOP, load)
    assert bridge.initialise(model, fem, equilibrate=False).unbalanced_ratio < 1e-8
    assert (fem.pressure.x.array.min() < -0.5 * 1000.0 * gravity) == dries
    assert fem.advance(dt).converged
    list(model.implicit(dt, dt=dt, quasi_static=True, small_displacements=True))
    there = fem.evaluate_at(model.particles.position)["pressure"][:, 0]
    np.testing.assert_allclose(model.particles.pore_pressure, there, rtol=0, atol=0.01 * 1000.0 * gravity)


def test_other_water_in_the_pores_of_particles_is_said():
    mesh, fem = column(10.0, [water.Head(TOP, 1.0)])
    at_rest(fem, 10.0)
    for density, is_said in ((1000.0, False), (1030.0, True)):
        model = mpm.Model(bridge.background_mesh(mesh[0], None, mesh[2]), LAW)
        model.seed(density=2000.0, per_cell=3)
        bridge.apply_supports(model, HELD)
        model.set_gravity((0.0, -10.0))
        model.add_water(porosity=0.4, conductivity=1e-8, density=density)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            bridge.initialise(model, fem, equilibrate=False)
        text = "particles' water is 10300 N/m3, density times gravity, that of the finite elements 10000 N/m3"
        assert any(text in str(one.message) for one in caught) == is_said


# --- arguments --------------------------------------------------------------------------------------------------------


def test_a_unit_weight_of_another_gravity_is_said():
    """One of 50 g without that gravity, or that gravity with one of 1 g, would be water of 50000 or of 20 kg/m3."""
    for given, density in (({"unit_weight": 490.5e3, "gravity": 9.81}, 50000), ({"unit_weight": 9810.0}, 20)):
        domain, _, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, (1.0, 1.0), (1, 1))
        with pytest.warns(RuntimeWarning, match=f"density of water is {density} kg/m3, expected some 1000") as caught:
            water.Seepage(domain, water.PorousSoil(1e-6), facet_tags, [], **{"gravity": 490.5, **given})
        assert caught[0].filename == __file__
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        water.Seepage(domain, water.PorousSoil(1e-6), facet_tags, [], unit_weight=10e3, gravity=10.0)
        water.Seepage(domain, water.PorousSoil(1e-6), facet_tags, [], gravity=490.5)


@pytest.mark.parametrize("gravity", [0.0, -9.81, np.nan, np.inf, "g"])
def test_gravity_must_be_a_positive_number(gravity):
    domain, _, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, (1.0, 1.0), (1, 1))
    soil, words = water.PorousSoil(1e-6), f"gravity is {gravity!r} m/s2, expected a positive number"
    with pytest.raises(bridge.InputError, match=words):
        water.Seepage(domain, soil, facet_tags, [], gravity=gravity)
    with pytest.raises(bridge.InputError, match=words):
        water.Consolidation(domain, LAW, soil, facet_tags, HELD, [], gravity=gravity)
