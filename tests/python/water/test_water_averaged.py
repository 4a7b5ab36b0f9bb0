"""Linear elements of soil and pore water with averaged volumetric strains: they fail as those of total stresses, and do not lock."""

from pathlib import Path

import numpy as np
import pytest
from consolidation_cases import BASE, LEFT, RIGHT, TOP
from dolfinx.mesh import compute_midpoints, meshtags
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water

COHESION = 1e3
CLAY = mpm.MohrCoulomb(young=10e6, poisson=0.3, cohesion=COHESION, friction_angle=0.0)
UNDRAINED = mpm.Undrained(CLAY, water_modulus=2.2e9, porosity=0.4)
TIGHT = water.PorousSoil(1e-17, porosity=0.4)
MESHES = Path(__file__).parents[3] / "meshes"
LINEAR = {"element": water.Element.STABILISED, "nmd": True}


def test_a_footing_on_soil_that_does_not_drain_carries_the_load_of_total_stresses():
    parameters = {"width": 4.0, "depth": 2.0, "edge_size": 0.03, "near_size": 0.12, "far_size": 0.6}
    domain, _, facets = bridge.read_mesh(MESHES / "footing.geo", MPI.COMM_WORLD, parameters=parameters)
    supports = [bridge.roller("axis", (1, 0)), bridge.roller("far", (1, 0)), bridge.fixed("base"),
                bridge.prescribed("footing", (0.0, -0.02))]  # fmt: skip
    soil = water.Consolidation(
        domain, CLAY, TIGHT, facets, supports, [water.Head("surface", 0.0)], unit_weight=1e-3, **LINEAR
    )
    linear, quadratic = (
        bridge.QuasiStatic(domain, UNDRAINED, facets, supports, degree, nmd=degree == 1) for degree in (1, 2)
    )
    for part in np.linspace(0.05, 1.0, 20):
        soil.load = bridge.Load(displacement=part)
        assert soil.advance(0.05).converged
        for one in (linear, quadratic):
            assert one.equilibrate(soil.load).converged
    loads = [one.reaction("footing")[1] for one in (soil, linear, quadratic)]
    assert loads[0] == pytest.approx(loads[1], rel=2e-3)
    assert loads[0] == pytest.approx(loads[2], rel=0.02)


def test_a_slope_that_does_not_drain_collapses_under_the_weight_of_total_stresses():
    background = bridge.slope_mesh(MPI.COMM_WORLD, height=1.0, angle=45.0, crest=1.2, cell_size=0.15, kind="fitted")
    domain, _, facets = bridge.soil_mesh(*background)
    supports = [bridge.roller(bridge.LEFT, (1, 0)), bridge.fixed(bridge.BASE)]
    dry = bridge.QuasiStatic(domain, UNDRAINED, facets, supports, degree=1, nmd=True)
    with pytest.warns(RuntimeWarning):
        dry.solve(bridge.Load(unit_weight=20 * COHESION), first_step=0.2, tolerance=1e-3)
    carried = dry.load.unit_weight
    weights = lambda time: bridge.Load(unit_weight=carried * (1 - 0.02 + 0.01 * max(time - 3.0, time / 3.0 - 1.0)))
    wet = water.Consolidation(domain, CLAY, TIGHT, facets, supports, [], weights, unit_weight=1e-3, **LINEAR)
    for _ in range(4):
        assert wet.advance(1.0).converged  # up to 0.99 of it
    wet.advance(1.0)
    wet.advance(1.0)
    assert not wet.advance(1.0).converged  # at 1.02


def body(geometry):
    """A block between a side that is held and a free one on a rough base: domain, facet tags, supports, tag of the top."""
    dim = 3 if geometry == mpm.Geometry.SOLID else 2
    domain, _, facets = bridge.box_mesh(MPI.COMM_WORLD, [1.0] * dim, [4] * dim if dim == 2 else [3] * dim)
    supports = [bridge.roller(2 * axis + 1, np.eye(dim)[axis]) for axis in range(dim - 1)]
    return domain, facets, [*supports, bridge.fixed(2 * dim - 1)], 2 * dim


@pytest.mark.parametrize("geometry", [mpm.Geometry.PLANE_STRAIN, mpm.Geometry.AXISYMMETRIC, mpm.Geometry.SOLID])
@pytest.mark.parametrize("dilation_angle, pressure", [(0.0, 6.2e3), (25.0, 6.5e3)])
def test_drained_soil_is_that_of_linear_elements_without_water(geometry, dilation_angle, pressure):
    """Without dilation strains and forces are averaged by half, as those of particles."""
    domain, facets, supports, top = body(geometry)
    soil = mpm.MohrCoulomb(young=10e6, poisson=0.3, cohesion=2e3, friction_angle=25.0, dilation_angle=dilation_angle)
    given = {} if geometry == mpm.Geometry.SOLID else {"geometry": geometry}
    dry = bridge.QuasiStatic(domain, soil, facets, supports, degree=1, nmd=True, as_particles=True, **given)
    wet = water.Consolidation(
        domain, soil, water.PorousSoil(1e-3, porosity=0.4), facets, supports, [water.Head(top, 1.0)],
        unit_weight=1e-6, **LINEAR, **given,
    )  # fmt: skip
    for part in (0.5, 0.8, 0.9, 1.0):
        wet.load = bridge.Load(pressure={top: part * pressure})
        report = wet.advance(1e6)
        assert report.converged and report.iterations <= 7  # the tangent is consistent
        assert dry.equilibrate(wet.load).converged
    assert wet.points.state.max() > 0  # it yields
    np.testing.assert_allclose(wet.points.stress, dry.points.stress, atol=1e-5 * pressure)
    moved = [np.sort(one.displacement.x.array) for one in (wet, dry)]
    np.testing.assert_allclose(*moved, atol=1e-6 * np.abs(moved[1]).max())


def test_soil_is_placed_and_removed_as_without_water():
    domain, _, facets = bridge.box_mesh(MPI.COMM_WORLD, (2.0, 1.5), (8, 6))
    cells = np.arange(len(bridge.mesh.tagged.tag_values(domain, None, 2)), dtype=np.int32)
    x, y = compute_midpoints(domain, 2, cells)[:, :2].T
    tags = meshtags(domain, 2, cells, np.where(y < 1.0, 1, np.where(x < 1.0, 2, 3)).astype(np.int32))
    laws = {tag: mpm.LinearElastic(young=1e6 * tag, poisson=0.3) for tag in (1, 2, 3)}
    supports = [bridge.roller(LEFT, (1, 0)), bridge.roller(RIGHT, (1, 0)), bridge.fixed(BASE)]
    load = bridge.Load(unit_weight=dict.fromkeys(laws, 20e3))
    dry = bridge.QuasiStatic(domain, laws, facets, supports, degree=1, nmd=True, cell_tags=tags)
    porous = water.PorousSoil(1e-3, porosity=0.4)
    wet = water.Consolidation(
        domain, laws, {1: porous, 2: None, 3: None}, facets, supports, [water.Head(BASE, 0.0)], load, cell_tags=tags,
        unit_weight=1e-6, **LINEAR,
    )  # fmt: skip
    for off in ([2, 3], [3], [2]):
        dry.reconfigure(off=off)
        dry.solve(load)
        wet.reconfigure(off=off)
        assert wet.advance(1e6).converged
    np.testing.assert_allclose(wet.points.stress, dry.points.stress, atol=1e-6 * 20e3)
    assert np.abs(dry.points.stress).max() > 20e3


def test_particles_with_averaged_strains_go_on_as_the_elements_do():
    domain, _, facets = bridge.box_mesh(MPI.COMM_WORLD, (2.0, 1.0), (8, 4))
    supports = [bridge.roller(LEFT, (1, 0)), bridge.roller(RIGHT, (1, 0)), bridge.fixed(BASE)]
    soil = mpm.LinearElastic(young=5e6, poisson=0.3)
    fem = water.Consolidation(
        domain, soil, water.PorousSoil(1e-8, porosity=0.4), facets, supports, [water.Reservoir(TOP, 1.5)],
        load=bridge.Load(unit_weight=19e3, pressure={TOP: 20e3}), **LINEAR,
    )  # fmt: skip
    fem.initialise(pore_pressure=lambda x: 9810.0 * (1.5 - x[:, 1]))
    assert fem.run(2e4, 1e3)[-1].converged
    model = mpm.Model(bridge.background_mesh(domain, None, facets), soil)
    model.seed(density=19e3 / 9.81, per_cell=1)
    bridge.apply_supports(model, supports)
    model.set_gravity((0.0, -9.81))
    model.add_water(porosity=0.4, conductivity=1e-8)
    model.hold_pore_pressure(TOP, level=1.5)
    model.press_surface(TOP, 20e3)
    bridge.initialise(model, fem, equilibrate=False)
    options = {"quasi_static": True, "small_displacements": True, "nmd": True}
    for dt in (2e3, 2e3, 4e3):
        assert fem.advance(dt).converged
        list(model.implicit(model.time + dt, dt=dt, **options))
    there = fem.evaluate_at(model.particles.position)
    excess = fem.pressure.x.array.max() - 9810.0 * 1.5
    assert excess > 2e3
    np.testing.assert_allclose(model.particles.pore_pressure, there["pressure"][:, 0], rtol=0, atol=2e-4 * excess)
    np.testing.assert_allclose(model.particles.stress, there["stress"], rtol=0, atol=1e-3 * 20e3)


def test_linear_elements_without_averages_say_that_they_lock():
    domain, facets, supports, top = body(mpm.Geometry.PLANE_STRAIN)
    with pytest.warns(RuntimeWarning, match="friction angle 0.*nmd=True.*TAYLOR_HOOD"):
        water.Consolidation(domain, CLAY, TIGHT, facets, supports, [water.Head(top, 1.0)], element=LINEAR["element"])
