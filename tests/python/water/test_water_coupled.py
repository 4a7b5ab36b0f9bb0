"""Coupled finite elements of plastic soil: the undrained limit, Newton's method, states to begin with, what is refused."""

from pathlib import Path

import numpy as np
import pytest
from consolidation_cases import BASE, ELEMENTS, GRAVITY_OF_WATER, LEFT, RIGHT, TOP, Column
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water
from mpm_core import InputError

comm = MPI.COMM_WORLD
MESHES = Path(__file__).resolve().parents[3] / "meshes"
CLAY = {"cohesion": 10e3, "friction_angle": 0.0, "dilation_angle": 0.0}


def block(n=6):
    """A block, 2 m by 1 m, and supports at its left side and base."""
    domain, _, facet_tags = bridge.box_mesh(comm, (2.0, 1.0), (2 * n, n))
    return domain, facet_tags, [bridge.roller(LEFT, (1, 0)), bridge.roller(BASE, (0, 1))]


# --- the undrained limit ---------------------------------------------------------------------------------------------


def test_soil_that_hardly_drains_fails_as_in_total_stresses():
    # Block under a rough plate that comes down, cohesive soil: the same path as with Taylor-Hood elements in total stresses
    # whose Poisson ratio is nearly 0.5 and whose shear modulus is that of the skeleton.
    domain, facet_tags, supports = block()
    supports = [*supports, bridge.prescribed(TOP, (0.0, -0.01))]
    shear, poisson = 4e6, 0.49999
    skeleton = mpm.MohrCoulomb(young=2 * shear * 1.2, poisson=0.2, **CLAY)
    undrained = mpm.MohrCoulomb(young=2 * shear * (1 + poisson), poisson=poisson, **CLAY)
    coupled = water.Consolidation(
        domain, skeleton, water.PorousSoil(1e-16), facet_tags, supports, [water.Head(RIGHT, 0.0)], water_modulus=np.inf
    )
    total = bridge.MixedQuasiStatic(domain, undrained, facet_tags, supports)
    forces = []
    for part in (0.2, 0.4, 0.7, 1.0):
        coupled.load = bridge.Load(unit_weight=GRAVITY_OF_WATER, displacement=part)
        assert coupled.advance(1.0).converged
        assert total.equilibrate(bridge.Load(unit_weight=GRAVITY_OF_WATER, displacement=part)).converged
        forces.append([model.reaction(TOP)[1] for model in (coupled, total)])
    found, expected = np.transpose(forces)
    assert found == pytest.approx(expected, rel=2e-3)
    assert found[3] - found[2] < 0.25 * (found[0] / 0.2) * 0.3  # it yields


@ELEMENTS
def test_undrained_biaxial_compression_fails_at_twice_the_cohesion(element):
    # Smooth plates and a free side: plane strain at constant volume, sigma_1 - sigma_3 = 2 c, whatever the skeleton's stiffness.
    domain, facet_tags, supports = block(3)
    soil = mpm.MohrCoulomb(young=10e6, poisson=0.3, **CLAY)
    supports = [*supports, bridge.prescribed(TOP, (None, -0.01))]
    model = water.Consolidation(domain, soil, water.PorousSoil(1e-14), facet_tags, supports, [], element=element,
                                unit_weight=1e-6, water_modulus=np.inf)  # fmt: skip
    model.load = lambda time: bridge.Load(displacement=time)
    reports = model.run(1.0, 0.1, growth=1.0)
    assert reports[-1].converged
    assert model.reaction(TOP)[1] == pytest.approx(2.0 * 2 * CLAY["cohesion"], rel=1e-6)


def test_a_strip_footing_on_clay_that_hardly_drains_carries_prandtls_load():
    # q = (2 + pi) c at the limit, reached from above by finite elements; a footing that comes down by 4 % of its half-width.
    parameters = {"width": 4.0, "depth": 2.0, "edge_size": 0.03, "near_size": 0.12, "far_size": 0.6}
    domain, _, facet_tags = bridge.read_mesh(MESHES / "footing.geo", comm, parameters=parameters)
    supports = [bridge.roller("axis", (1, 0)), bridge.roller("far", (1, 0)), bridge.fixed("base"),
                bridge.prescribed("footing", (0.0, -0.02))]  # fmt: skip
    soil = mpm.MohrCoulomb(young=10e6, poisson=0.3, **CLAY)
    model = water.Consolidation(domain, soil, water.PorousSoil(1e-17), facet_tags, supports, [water.Head("surface", 0.0)],
                                unit_weight=1e-3, water_modulus=np.inf)  # fmt: skip
    model.load = lambda time: bridge.Load(displacement=time)
    pressures = []
    for time in (0.8, 1.0):
        assert model.run(time, 0.05, growth=1.3)[-1].converged
        pressures.append(model.reaction("footing")[1] / 0.5)
    limit = (2 + np.pi) * CLAY["cohesion"]
    assert limit < pressures[1] < 1.06 * limit
    assert pressures[1] - pressures[0] < 2e-3 * limit  # it has come to a limit


# --- Newton's method and the balance ---------------------------------------------------------------------------------


@ELEMENTS
@pytest.mark.parametrize(
    "soil, load",
    [
        (mpm.MohrCoulomb(young=10e6, poisson=0.3, cohesion=2e3, friction_angle=25.0, dilation_angle=5.0), 6.1e3),
        (mpm.DruckerPrager(young=10e6, poisson=0.3, strength=3e3, friction=0.25, dilation=0.05), 6.3e3),
    ],
    ids=lambda value: getattr(value, "name", ""),
)
def test_plastic_steps_take_few_iterations_and_keep_the_water(element, soil, load):
    # A block on a rough base, drained at its free side, is loaded on top in small steps; it yields from its corners on.
    domain, facet_tags, supports = block(4)
    model = water.Consolidation(
        domain, soil, water.PorousSoil(1e-14), facet_tags, [supports[0], bridge.fixed(BASE)], [water.Head(RIGHT, 0.0)],
        element=element, unit_weight=1e-3,
    )  # fmt: skip
    model.load = lambda time: bridge.Load(pressure={TOP: load * time / 1e5})
    for _ in range(40):
        report = model.advance(2.5e3)
        assert report.converged and report.iterations <= 6
        assert abs(report.water_error) < 1e-10 * 1e-3  # of a settlement of a millimetre
    assert np.mean(model.points.state[:, 0] > 1e-6) > 0.01  # plastic strains


def test_a_step_that_fails_changes_nothing_and_a_run_gives_up():
    domain, facet_tags, supports = block(2)
    soil = mpm.MohrCoulomb(young=10e6, poisson=0.3, **CLAY)
    model = water.Consolidation(domain, soil, water.PorousSoil(1e-12), facet_tags, supports, [water.Head(RIGHT, 0.0)])
    model.load = bridge.Load(pressure={TOP: 15e3})
    assert model.advance(1.0).converged
    before = (
        model.displacement.x.array.copy(),
        model.pressure.x.array.copy(),
        model.points.stress.copy(),
        model.inflow(RIGHT),
    )
    model.load = bridge.Load(pressure={TOP: 60e3})  # three times what it carries
    reports = model.run(2.0, 1.0)
    assert not reports[-1].converged and reports[-1].reason and model.time == 1.0
    after = model.displacement.x.array, model.pressure.x.array, model.points.stress, model.inflow(RIGHT)
    assert all(np.array_equal(a, b) for a, b in zip(before, after))


# --- water at the boundaries -----------------------------------------------------------------------------------------


@ELEMENTS
def test_water_leaves_at_a_seepage_face_but_does_not_enter(element):
    # A column with a head at its base: above the top it seeps upwards by Darcy's law; below it nothing flows in.
    column = Column(element, cells=6, boundary=[water.Head(BASE, 1.5), water.SeepageFace(TOP)], load=0.0)
    column.model.run(3 * column.period, 0.5 * column.period)
    assert column.model.inflow(TOP) == pytest.approx(-1e-8 * 0.5 * column.width, rel=1e-2)
    column.model.boundary[0] = water.Head(BASE, 0.4)
    column.model.run(8 * column.period, 0.5 * column.period)
    assert column.model.inflow(TOP) == pytest.approx(0.0, abs=1e-8 * 1e-6)
    top = column.model.evaluate_at(column.top[None])["pressure"][0, 0]
    assert top == pytest.approx(-GRAVITY_OF_WATER * 0.6, rel=1e-2)


@ELEMENTS
def test_a_state_of_finite_elements_and_a_flow_is_a_state_at_rest(element):
    # Stresses of QuasiStatic under the pore pressures of Seepage, all under water: nothing moves in the coupled model, whose
    # reservoirs press on the soil as the pore pressures of QuasiStatic do.
    domain, facet_tags, supports = block(4)
    soil = mpm.MohrCoulomb(young=10e6, poisson=0.3, cohesion=20e3, friction_angle=20.0, dilation_angle=0.0)
    boundary = [water.Reservoir(TOP, 1.5), water.Reservoir(RIGHT, 1.5), water.Head(LEFT, 1.8)]
    porous, weight = water.PorousSoil(1e-7), bridge.Load(unit_weight=20e3)
    flow = water.Seepage(domain, porous, facet_tags, boundary)
    flow.solve()
    fem = bridge.QuasiStatic(domain, soil, facet_tags, supports, degree=element.value)
    fem.reconfigure(pore_pressure=flow.pore_pressure())
    fem.solve(weight)
    model = water.Consolidation(domain, soil, porous, facet_tags, supports, boundary, load=weight, element=element)
    model.initialise(fem, flow)
    assert model.advance(1e4).converged
    assert np.abs(model.displacement.x.array).max() < 1e-6 * np.abs(fem.displacement.x.array).max()
    assert model.pressure.x.array == pytest.approx(GRAVITY_OF_WATER * flow.pressure_head.x.array, abs=1e-2)
    assert model.points.stress == pytest.approx(fem.points.stress, abs=1e-2)


# --- what is refused -------------------------------------------------------------------------------------------------


def make(**options):
    domain, facet_tags, supports = block(1)
    given = {
        "law": mpm.LinearElastic(young=1e6, poisson=0.3), "soil": water.PorousSoil(1e-7), "facet_tags": facet_tags,
        "supports": supports, "boundary": [water.Head(TOP, 1.0)],
    }  # fmt: skip
    return water.Consolidation(domain, **{**given, **options})


@pytest.mark.parametrize(
    "options, words",
    [
        ({"element": 2}, "element is 2, expected one of Element.TAYLOR_HOOD"),
        ({"nmd": True}, "nmd is True, expected False with element=Element.TAYLOR_HOOD"),
        ({"boundary": [water.Reservoir(9, 1.0)]}, "no facet has the tag 9"),
        ({"boundary": [water.Head(TOP, np.nan)]}, "level is nan"),
        ({"soil": 1e-7}, "expected a PorousSoil"),
        ({"unit_weight": 0.0}, "unit_weight is 0.0"),
        ({"water_modulus": -1.0}, "water_modulus is -1.0 Pa"),
        (
            {
                "boundary": [water.Flux(TOP, 1e-8)],
                "water_modulus": np.inf,
                "supports": [bridge.fixed(tag) for tag in (LEFT, RIGHT, BASE, TOP)],
            },
            "the pressure is undetermined",
        ),
    ],
)
def test_bad_arguments_are_named(options, words):
    with pytest.raises(InputError, match=words):
        make(**options)


def test_finite_elements_that_carry_no_load_are_no_beginning():
    domain, facet_tags, supports = block(4)
    soil = mpm.MohrCoulomb(young=10e6, poisson=0.3, cohesion=1.0, friction_angle=0.0)
    boundary = [water.Reservoir(TOP, 1.5)]
    model = water.Consolidation(domain, soil, water.PorousSoil(1e-7), facet_tags, supports, boundary)
    fem = bridge.QuasiStatic(domain, soil, facet_tags, [bridge.fixed(LEFT)])
    with pytest.raises(InputError, match="stress is a QuasiStatic that has not been solved"):
        model.initialise(fem)
    with pytest.warns(RuntimeWarning, match="the load was not reached"):
        fem.solve(bridge.Load(unit_weight=20e3))
    with pytest.raises(InputError, match="did not converge"):
        model.initialise(fem)


@pytest.mark.parametrize(
    "call, words",
    [
        (lambda model: model.advance(0.0), "dt is 0.0 s"),
        (lambda model: model.run(-1.0, 1.0), "until is -1.0 s"),
        (lambda model: model.run(1.0, 0.0), "first_step is 0.0 s"),
        (lambda model: model.run(1.0, 0.1, growth=0.5), "growth is 0.5"),
        (lambda model: model.initialise(stress=np.zeros((1, 4))), "stress has shape"),
        (
            lambda model: model.initialise(pore_pressure=lambda x: np.nan),
            "pore_pressure gives values that are not finite",
        ),
    ],
)
def test_bad_calls_are_named(call, words):
    model = make()
    with pytest.raises(InputError, match=words):
        call(model)


def test_a_bank_that_consolidates_gains_strength():
    """The factor of safety under the pore pressures of `Consolidation`: undrained pressures of a load, and none in the end."""
    domain, _, facet_tags = bridge.soil_mesh(*bridge.slope_mesh(MPI.COMM_WORLD, height=2.0, angle=30.0, crest=2.0,
                                                                  cell_size=0.5, kind="fitted"))  # fmt: skip
    soil = mpm.MohrCoulomb(young=20e6, poisson=0.3, cohesion=4e3, friction_angle=28.0)
    supports = [bridge.roller(bridge.LEFT, (1, 0)), bridge.fixed(bridge.BASE)]
    model = water.Consolidation(
        domain, mpm.LinearElastic(young=20e6, poisson=0.3), water.PorousSoil(1e-8), facet_tags, supports,
        [water.SeepageFace(bridge.SLOPE)], load=bridge.Load(unit_weight=20e3), element=water.Element.STABILISED,
    )  # fmt: skip
    factors = []
    for dt in (1.0, 1e9):
        assert model.advance(dt).converged
        fem = bridge.QuasiStatic(domain, soil, facet_tags, supports)
        fem.reconfigure(pore_pressure=model.pore_pressure())
        factors.append(bridge.factor_of_safety(fem, bridge.Load(unit_weight=20e3), tolerance=0.05).value)
    assert factors[1] > 1.2 * factors[0]


def test_a_slope_that_collapses_is_handed_over_and_slides():
    """Its weight grows until it carries no more, when the run ends; particles begin in place with its pressures, and slide."""
    background = bridge.slope_mesh(MPI.COMM_WORLD, height=4.0, angle=45.0, crest=4.0, cell_size=0.8, kind="fitted")
    domain, _, facet_tags = bridge.soil_mesh(*background)
    clay = mpm.MohrCoulomb(young=5e6, poisson=0.3, cohesion=7e3, friction_angle=20.0, dilation_angle=0.0)
    weight = lambda time: 1.9e3 * time
    model = water.Consolidation(
        domain, clay, water.PorousSoil(1e-8), facet_tags, [bridge.roller(bridge.LEFT, (1, 0)), bridge.fixed(bridge.BASE)],
        [water.SeepageFace(bridge.SLOPE)], element=water.Element.STABILISED,
        load=lambda time: bridge.Load(unit_weight=weight(time)),
    )  # fmt: skip
    last = model.run(20.0, 0.5, growth=1.0)[-1]
    assert not last.converged and 4.0 < model.time < 15.0
    assert np.abs(model.displacement.x.array).max() < 1.6  # no step goes anywhere along the mechanism
    body = mpm.Model(bridge.background_mesh(*background), clay)
    body.seed(density=weight(model.time) / 9.81, per_cell=3, cell_tag=bridge.SOIL)
    body.roller(bridge.LEFT, (1, 0))
    body.fix(bridge.BASE)
    body.set_gravity((0.0, -9.81))
    body.add_water(porosity=0.4, conductivity=1e-8, drained_surface=True)
    assert bridge.initialise(body, model, equilibrate=False).unbalanced_ratio < 1e-8
    body.particles.set("mass", 1.1 * body.particles.mass)
    body.implicit(1.0, dt=0.05, nmd=True).last()
    speed, pressure = body.particles.velocity, body.particles.pore_pressure
    assert np.linalg.norm(body.particles.displacement, axis=1).max() > 0.1 and np.isfinite(pressure).all()
    assert np.linalg.norm(speed, axis=1).max() < 9.81
