"""From finite elements of soil and pore water to particles: in equilibrium at once, pressures included."""

import numpy as np
import pytest
from consolidation_cases import BASE, LEFT, RIGHT, TOP
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water

SOIL = mpm.MohrCoulomb(young=5e6, poisson=0.3, cohesion=3e3, friction_angle=25.0, dilation_angle=5.0)
LEVEL, WEIGHT = 1.5, 19e3


def consolidating(element=water.Element.STABILISED):
    """A layer under water and a pressure on its top that it has carried for a while, and particles in its place."""
    domain, _, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, (2.0, 1.0), (8, 4))
    supports = [bridge.roller(LEFT, (1, 0)), bridge.roller(RIGHT, (1, 0)), bridge.fixed(BASE)]
    fem = water.Consolidation(
        domain, SOIL, water.PorousSoil(1e-8, porosity=0.4), facet_tags, supports, [water.Reservoir(TOP, LEVEL)],
        load=bridge.Load(unit_weight=WEIGHT, pressure={TOP: 20e3}), element=element,
    )  # fmt: skip
    at_rest = bridge.k0_stress(fem.points.coordinates(), surface=1.0, unit_weight=WEIGHT - 9810.0, k0=0.4)
    fem.initialise(at_rest, pore_pressure=lambda x: 9810.0 * (LEVEL - x[:, 1]))
    assert fem.run(2e4, 1e3)[-1].converged
    model = mpm.Model(bridge.background_mesh(domain, None, facet_tags), SOIL)
    model.seed(density=WEIGHT / 9.81, per_cell=3)
    model.roller(LEFT, (1, 0))
    model.roller(RIGHT, (1, 0))
    model.fix(BASE)
    model.set_gravity((0.0, -9.81))
    return fem, model


def wet(model):
    model.add_water(porosity=0.4, conductivity=1e-8)
    model.hold_pore_pressure(TOP, level=LEVEL)
    model.press_surface(TOP, 20e3)


def test_particles_take_over_in_equilibrium_and_go_on_as_the_elements_do():
    fem, model = consolidating()
    wet(model)
    excess = fem.pressure.x.array.max() - 9810.0 * LEVEL
    assert excess > 2e3
    result = bridge.initialise(model, fem, equilibrate=False)
    assert result.unbalanced_ratio < 1e-9
    for dt in (2e3, 2e3, 4e3):
        assert fem.advance(dt).converged
        list(model.implicit(model.time + dt, dt=dt, quasi_static=True, small_displacements=True))
    there = fem.evaluate_at(model.particles.position)["pressure"][:, 0]
    # three particles carry the storage of a cell by another rule than one point
    np.testing.assert_allclose(model.particles.pore_pressure, there, rtol=0, atol=2e-3 * excess)


def test_dried_soil_is_taken_over_with_its_suction_and_its_lost_weight():
    curve = water.VanGenuchten(alpha=4e-4, n=2.0)
    domain, _, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, (0.2, 1.0), (4, 20))
    held = [bridge.roller(LEFT, (1, 0)), bridge.roller(RIGHT, (1, 0)), bridge.fixed(BASE)]
    elastic = mpm.LinearElastic(young=5e6, poisson=0.3)
    fem = water.Consolidation(
        domain, elastic, water.PorousSoil(1e-5, porosity=0.4, retention=curve), facet_tags, held, [water.Head(BASE, 0.0)],
        load=bridge.Load(unit_weight=WEIGHT), element=water.Element.STABILISED, solver=bridge.Solver(tolerance=1e-12),
    )  # fmt: skip
    fem.initialise(pore_pressure=lambda x: 9810.0 * (1.0 - x[:, 1]))
    assert fem.run(1e5, 10.0, growth=1.5)[-1].converged
    model = mpm.Model(bridge.background_mesh(domain, None, facet_tags), elastic)
    model.seed(density=WEIGHT / 9.81, per_cell=3)
    for side in (LEFT, RIGHT):
        model.roller(side, (1, 0))
    model.fix(BASE)
    model.set_gravity((0.0, -9.81))
    model.add_water(porosity=0.4, conductivity=1e-5, retention=curve)
    model.hold_pore_pressure(BASE, 0.0)
    result = bridge.initialise(model, fem, equilibrate=False)
    assert result.unbalanced_ratio < 1e-9
    p = model.particles
    np.testing.assert_allclose(p.saturation, curve.saturation(-p.pore_pressure), atol=1e-5)
    assert p.saturation.min() < 0.5
    # their weight is what the base carries
    assert 9.81 * model.comm.allreduce(p.mass.sum()) == pytest.approx(-fem.reaction(BASE)[1], rel=1e-9)
    assert fem.advance(5e4).converged
    list(model.implicit(5e4, dt=5e4, quasi_static=True))
    there = fem.evaluate_at(model.particles.position)["pressure"][:, 0]
    np.testing.assert_allclose(model.particles.pore_pressure, there, atol=0.01 * 9810)


CURVE = water.VanGenuchten(alpha=1.5e-4, n=2.0, residual=0.1)


def rained_on(element=water.Element.STABILISED, per_cell=3, retention=CURVE, cohesion=12e3):
    """A slope under rain that has come to rest, unsaturated above the water table, and particles in its place."""
    background = bridge.slope_mesh(MPI.COMM_WORLD, height=4.0, angle=30.0, crest=4.0, cell_size=0.8, kind="fitted")
    domain, _, facet_tags = bridge.soil_mesh(*background, tag=bridge.SOIL)
    soil = mpm.MohrCoulomb(young=10e6, poisson=0.3, cohesion=cohesion, friction_angle=28.0, dilation_angle=0.0)
    silt = water.PorousSoil(1e-6, porosity=0.4, retention=CURVE)
    boundary = [water.Reservoir(bridge.LEFT, 2.0), water.Rain("crest", 1e-7)]
    flow = water.Seepage(domain, silt, facet_tags, boundary)
    flow.solve()
    fem = water.Consolidation(
        domain, soil, silt, facet_tags, [bridge.roller(bridge.LEFT, (1, 0)), bridge.fixed(bridge.BASE)], boundary,
        load=bridge.Load(unit_weight=WEIGHT), element=element, solver=bridge.Solver(tolerance=1e-12),
    )  # fmt: skip
    fem.initialise(pore_pressure=flow)
    assert fem.advance(1e7).converged
    model = mpm.Model(bridge.background_mesh(*background), soil)
    model.seed(density=WEIGHT / 9.81, per_cell=per_cell, cell_tag=bridge.SOIL)
    model.roller(bridge.LEFT, (1, 0))
    model.fix(bridge.BASE)
    model.set_gravity((0.0, -9.81))
    model.add_water(porosity=0.4, conductivity=1e-6, retention=retention, drained_surface=True)
    model.hold_pore_pressure(bridge.LEFT, level=2.0)
    return fem, model


@pytest.mark.parametrize("element", water.Element)
@pytest.mark.parametrize("per_cell", [3, 10])
def test_a_slope_under_rain_is_taken_over_in_equilibrium(element, per_cell):
    """Its suction and its lost weight are no polynomials, which particles and elements integrate by other points."""
    fem, model = rained_on(element, per_cell)
    assert fem.pressure.x.array.min() < -5e3
    assert bridge.initialise(model, fem, equilibrate=False).unbalanced_ratio < 1e-9
    p = model.particles
    np.testing.assert_allclose(p.pore_pressure, fem.evaluate_at(p.position)["pressure"][:, 0], rtol=1e-12, atol=1e-6)
    np.testing.assert_allclose(p.saturation, CURVE.saturation(-p.pore_pressure), atol=1e-5)
    assert 9.81 * model.comm.allreduce(p.mass.sum()) == pytest.approx(-fem.reaction(bridge.BASE)[1], rel=1e-9)


def test_averaged_forces_of_soil_that_does_not_dilate_are_taken_over_in_equilibrium():
    """By half, as the elements average them, while forces of the pressures are not averaged."""
    background = bridge.slope_mesh(MPI.COMM_WORLD, height=4.0, angle=30.0, crest=4.0, cell_size=0.8, kind="fitted")
    domain, _, facet_tags = bridge.soil_mesh(*background, tag=bridge.SOIL)
    soil = mpm.MohrCoulomb(young=10e6, poisson=0.3, cohesion=20e3, friction_angle=28.0, dilation_angle=0.0)
    fem = water.Consolidation(
        domain, soil, water.PorousSoil(1e-6, porosity=0.4), facet_tags,
        [bridge.roller(bridge.LEFT, (1, 0)), bridge.fixed(bridge.BASE)], [water.Head("crest", 4.0)],
        load=bridge.Load(unit_weight=WEIGHT), element=water.Element.STABILISED, nmd=True,
    )  # fmt: skip
    fem.initialise(pore_pressure=lambda x: 9810.0 * (4.0 - x[:, 1]))
    assert fem.run(1e4, 1e3, growth=2.0)[-1].converged
    model = mpm.Model(bridge.background_mesh(*background), soil)
    model.seed(density=WEIGHT / 9.81, per_cell=3, cell_tag=bridge.SOIL)
    model.roller(bridge.LEFT, (1, 0))
    model.fix(bridge.BASE)
    model.set_gravity((0.0, -9.81))
    model.add_water(porosity=0.4, conductivity=1e-6)
    assert bridge.initialise(model, fem, equilibrate=False).unbalanced_ratio < 1e-9


def test_another_retention_curve_is_refused():
    fem, model = rained_on(retention=water.VanGenuchten(alpha=3e-4, n=2.0, residual=0.1))
    with pytest.raises(mpm.InputError, match="degree of saturation of 0.*expected the same retention curves"):
        bridge.initialise(model, fem)


def test_equilibration_leaves_the_pressures():
    fem, model = consolidating(water.Element.TAYLOR_HOOD)
    wet(model)
    result = bridge.initialise(model, fem)
    assert result.equilibrated_ratio < 5e-4
    there = fem.evaluate_at(model.particles.position)["pressure"][:, 0]
    np.testing.assert_allclose(model.particles.pore_pressure, there, rtol=1e-12)


def test_water_with_a_velocity_of_its_own_is_refused_before_particles_change():
    fem, model = consolidating()
    wet(model)
    model.explicit(1e-5, nmd=True).last()
    before = model.particles.stress.copy(), model.particles.pore_pressure.copy()
    with pytest.raises(
        mpm.InputError, match="equilibrate is True, expected False with pore water with a velocity of its own"
    ):
        bridge.initialise(model, fem)
    np.testing.assert_array_equal(model.particles.stress, before[0])
    np.testing.assert_array_equal(model.particles.pore_pressure, before[1])
    bridge.initialise(model, fem, equilibrate=False)


def test_dry_particles_are_refused():
    fem, model = consolidating()
    with pytest.raises(mpm.InputError, match="fem is a Consolidation, expected particles with pore water"):
        bridge.initialise(model, fem)
    wet(model)
    elastic = bridge.QuasiStatic(fem.domain, SOIL, fem._facet_tags, [bridge.fixed(BASE)])
    elastic.solve(bridge.Load(unit_weight=1e3))
    with pytest.raises(
        mpm.InputError, match="is a QuasiStatic without pore pressures, expected a QuasiStatic with them"
    ):
        bridge.initialise(model, elastic)
