"""Stages that release a part of their out-of-balance forces: against closed forms of tunnels and the same stages at once."""

import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
from dolfinx.mesh import compute_midpoints, meshtags
from mpi4py import MPI
from stage_cases import IN_SITU, ROLLERS, SOILS, carried_out, elastic, oedometer, site_of, weights

import fenics_bridge as bridge
import mpm_core as mpm

sys.path.insert(0, str(Path(__file__).parents[3] / "studies" / "verification"))

from _ground_reaction import Ground  # noqa: E402

GROUND = Ground(3.0, 60.0, 200e3, young=50e6, poisson=0.3, cohesion=30e3, friction_angle=20.0, dilation_angle=10.0)


@pytest.fixture(scope="module")
def disc():
    """A slice of the ground around a tunnel, whose axis is that of the body of revolution: soil 1 is the core."""
    core, cells = 2, 48
    domain, _, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, (core + cells, 1.0), (core + cells, 1))
    numbers = np.arange(bridge.original_cells(domain).size, dtype=np.int32)
    x, inner, outer = compute_midpoints(domain, 2, numbers)[:, 0], GROUND.radius, GROUND.outer
    tags = meshtags(domain, 2, numbers, np.where(x < core, 1, 2).astype(np.int32))
    s = domain.geometry.x[:, 0].copy()
    domain.geometry.x[:, 0] = np.where(
        s <= core, inner * s / core, inner * (outer / inner) ** (np.maximum(s - core, 0) / cells)
    )
    return domain, tags, facet_tags


def tunnel(disc, *deconfinement, cohesion=GROUND.cohesion):
    """The site of a tunnel whose core is dug away in a first stage, and which then is deconfined further."""
    names = ("young", "poisson", "friction_angle", "dilation_angle")
    soil = mpm.MohrCoulomb(cohesion=cohesion, **{name: getattr(GROUND, name) for name in names})
    supports = [bridge.roller(side, axis) for side, axis in ((1, (1, 0)), (2, (1, 0)), (3, (0, 1)), (4, (0, 1)))]
    site = site_of(disc, {1: soil, 2: soil}, supports, geometry=bridge.Geometry.AXISYMMETRIC)
    stress = -GROUND.pressure * np.array([1.0, 1.0, 1.0, 0.0])
    first, *more = deconfinement
    carried_out(
        site,
        bridge.Stage(
            "in situ", fill=[1, 2], unit_weight={1: 0.0, 2: 0.0}, stress=lambda x: np.tile(stress, (len(x), 1))
        ),
        bridge.Stage("core", excavate=1, reset_displacement=True, deconfinement=first),
        *(bridge.Stage("further", deconfinement=one) for one in more),
    )
    return site


def convergence(site):
    """Inward displacement of the wall [m]."""
    return -site.fem.evaluate_at([(GROUND.radius * (1 + 1e-9), 0.5)])["displacement"][0, 0]


@pytest.mark.parametrize(("parts", "released"), [((0.3,), 0.3), ((1.0,), 1.0), ((0.5, 0.4), 0.7)])
def test_the_wall_of_a_tunnel_in_elastic_ground_converges_by_the_part_that_is_released(disc, parts, released):
    """Of what is still held, each stage releases its fraction: 1 - (1 - 0.5) (1 - 0.4) = 0.7."""
    site = tunnel(disc, *parts, cohesion=1e6)
    expected = GROUND.outside(GROUND.radius, (1 - released) * GROUND.pressure)
    kirsch = released * GROUND.pressure * GROUND.radius / (2 * GROUND.shear)
    assert convergence(site) == pytest.approx(expected, rel=5e-4) and expected == pytest.approx(kirsch, rel=0.01)
    assert site.fem.load.held == pytest.approx(1 - parts[-1])


@pytest.mark.parametrize("parts", [(0.7,), (0.9,), (0.5, 0.8)])
def test_the_wall_converges_along_the_ground_reaction_curve(disc, parts):
    support = GROUND.pressure * np.prod([1 - part for part in parts])
    edge = GROUND.plastic_radius(support)
    assert GROUND.intermediate(support) and edge > 1.2 * GROUND.radius
    site = tunnel(disc, *parts)
    assert convergence(site) == pytest.approx(GROUND.wall(support), rel=5e-3)
    assert convergence(site) > 1.1 * GROUND.outside(GROUND.radius, support)


CHANGES = {
    "excavate": ["pit 1", "pit 2"],
    "pressure": {"floor": 5e3},
    "pore_pressure": bridge.hydrostatic(1.0),
    "install": {"bar": mpm.bar([(3.0, 2.5), (8.0, 2.5)], 50e6)},
    "reset_displacement": True,
}


@pytest.mark.parametrize("options", [{"degree": 1}, {"degree": 1, "nmd": True}, {"degree": 2}])
def test_elastic_ground_with_all_that_a_stage_changes_goes_a_part_of_the_way(pit, options):
    """Linear: soil, load, water, K0 and a member; what is left is released by a stage without changes of its own."""
    soils = SOILS["pit"]
    in_situ = bridge.Stage("in situ", fill=soils, unit_weight=weights(soils), k0=dict.fromkeys(soils, 0.8),
                           pore_pressure=bridge.hydrostatic(3.0))  # fmt: skip
    some = bridge.Stage("some", **CHANGES, deconfinement=0.3)
    results = []
    for stages in ([], [some], [some, bridge.Stage("rest")], [bridge.Stage("all", **CHANGES)]):
        site = site_of(pit, elastic(soils), **options)
        carried_out(site, in_situ, *stages)
        there = np.repeat(site.fem.points.material >= 0, site.fem.points.per_cell)
        force = site.fem.member_forces("bar").axial_force if stages else np.zeros(1)
        results.append((site.fem, there, force))
    there = results[1][1]
    (before, *_), (part, _, some), (rest, _, both), (whole, _, all_of_it) = results
    stress = [fem.points.stress[there] for fem in (before, part, rest, whole)]
    assert np.allclose(
        stress[1], stress[0] + 0.3 * (stress[3] - stress[0]), rtol=0, atol=1e-9 * np.abs(stress[0]).max()
    )
    assert np.allclose(stress[2], stress[3], rtol=0, atol=1e-9 * np.abs(stress[0]).max())
    moved = [fem.displacement.x.array for fem in (part, rest, whole)]
    largest = np.abs(moved[2]).max()
    assert np.allclose(moved[0], 0.3 * moved[2], rtol=0, atol=1e-9 * largest)
    assert np.allclose(moved[1], moved[2], rtol=0, atol=1e-9 * largest)
    assert np.abs(all_of_it).max() > 100.0
    assert np.allclose(some, 0.3 * all_of_it, rtol=1e-7) and np.allclose(both, all_of_it, rtol=1e-7)


@pytest.mark.parametrize("options", [{"degree": 1}, {"degree": 1, "nmd": True}, {"degree": 2}])
def test_ground_that_is_partly_unloaded_rises_by_that_part_and_loads_the_base_with_the_rest(column, options):
    """2 m of 16 kN/m3 go: of 32 kPa a quarter is released, the base still carries three quarters, and a fill adds its own."""
    soils, whole = SOILS["column"], 20e3 * 3 + 18e3 * 1 + 16e3 * 2
    site = site_of(column, elastic(soils), **options)
    carried_out(site, bridge.Stage("all", fill=soils, unit_weight=weights(soils)),
                bridge.Stage("dig", excavate="layer 2", deconfinement=0.25, reset_displacement=True))  # fmt: skip
    assert site.fem.reaction("base")[1] == pytest.approx(-(whole - 0.25 * 32e3), rel=1e-9)
    if options["degree"] == 2:  # linear elements do not have the stresses of the weight, which go as linear functions
        rise = 0.25 * 32e3 * (3 / oedometer("ground") + 1 / oedometer("layer 1"))
        assert site.fem.evaluate_at([(0.5, 4.0)])["displacement"][0, 1] == pytest.approx(rise, rel=1e-9)
    carried_out(site, bridge.Stage("fill", fill="layer 2", unit_weight={"layer 2": 10e3}))
    assert site.fem.load.held == 0
    assert site.fem.reaction("base")[1] == pytest.approx(-(whole - 2 * 6e3), rel=1e-9)


def test_a_lining_that_comes_after_deconfinement_carries_the_rest():
    """In elastic ground its forces are 1 - deconfinement of those of a lining that comes with the excavation."""
    meshes = Path(__file__).parents[3] / "meshes"
    parameters = {"size": 3.0, "edge_size": 0.06, "far_size": 0.6}
    domain, cell_tags, facet_tags = bridge.read_mesh(meshes / "pipe.geo", MPI.COMM_WORLD, parameters=parameters)
    soil, supports = mpm.LinearElastic(young=50e6, poisson=0.3), [bridge.roller("axis", (1, 0)), bridge.fixed("far")]
    angle = np.linspace(0.5, -0.5, 37) * np.pi
    line = 0.5 * np.column_stack([np.cos(angle), np.sin(angle)])
    line[[0, -1], 0] = 0.0
    lining = mpm.beam(line, 0.9e9, 0.3e6, clamped_start=True, clamped_end=True)
    forces = []
    for parts in ((1.0,), (0.6, 1.0), (0.4, 0.5, 1.0)):
        site = site_of((domain, cell_tags, facet_tags), soil, supports)
        stress, last = -200e3 * np.array([0.5, 1.0, 0.45, 0.0]), len(parts) - 1
        carried_out(site, bridge.Stage("in situ", fill=["soil", "pipe"], unit_weight={"soil": 0.0, "pipe": 0.0},
                                       stress=lambda x, s=stress: np.tile(s, (len(x), 1))))  # fmt: skip
        for k, part in enumerate(parts):
            core, members = ("pipe",) if k == 0 else (), {"lining": lining} if k == last else {}
            carried_out(site, bridge.Stage(f"part {k}", excavate=core, install=members, deconfinement=part))
        found = site.fem.member_forces("lining")
        forces.append(np.concatenate([found.axial_force, found.moment / 0.5]))
    at_once, after, later = forces
    assert np.allclose(after, 0.4 * at_once, rtol=0, atol=1e-7 * np.abs(at_once).max())
    assert np.allclose(later, 0.6 * 0.5 * at_once, rtol=0, atol=1e-7 * np.abs(at_once).max())


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"excavate": "pit 1", "deconfinement": 40}, "stage 'a': deconfinement is 40, expected a fraction above 0 and up to 1"),
        ({"excavate": "pit 1", "deconfinement": 0.0}, "deconfinement is 0.0, expected a fraction"),
        ({"excavate": "pit 1", "deconfinement": True}, "deconfinement is True, expected a fraction"),
        ({"excavate": "pit 1", "deconfinement": "half"}, "deconfinement is 'half', expected a fraction"),
        ({"excavate": "pit 1", "fill": "pit 3", "deconfinement": 0.4}, "fill: no cell has the name 'pit 3'"),
        ({"install": {"tie": mpm.strut((3.0, 2.0), (8.0, 2.0), 1e8, prestress=1e4)}, "deconfinement": 0.4}, "installs 'tie' with a prestress"),
        ({"install": ["tie"], "deconfinement": 0.4}, "install is .*'tie'"),
        ({"support": bridge.prescribed("floor", (None, -0.01)), "deconfinement": 0.4}, "prescribes displacements, only a part"),
    ],
)  # fmt: skip
def test_a_deconfinement_that_is_not_possible_is_named(pit, wrong, message):
    site = site_of(pit, elastic(SOILS["pit"]))
    carried_out(site, IN_SITU)
    with pytest.raises(bridge.InputError, match=message):
        carried_out(site, bridge.Stage("a", **wrong))
    assert site.number == 1


def test_soil_whose_weight_would_act_in_part_is_refused(pit):
    stage = bridge.Stage("in situ", fill=SOILS["pit"], unit_weight=weights(SOILS["pit"]), deconfinement=0.5)
    with pytest.raises(
        bridge.InputError, match="deconfinement is 0.5 in a stage that fills .*'pit 1'.*expected 1 there"
    ):
        carried_out(site_of(pit, elastic(SOILS["pit"])), stage)


PART = bridge.Stage("part", excavate="pit 1", deconfinement=0.4)


def plastic(soils):
    return dict.fromkeys(soils, mpm.tresca(young=20e6, poisson=0.3, shear_strength=100e3))


def test_a_factor_of_safety_with_forces_that_are_held_is_said_or_refused(pit):
    site, soils = site_of(pit, plastic(SOILS["pit"]), degree=1), SOILS["pit"]
    carried_out(site, IN_SITU, PART)
    with pytest.warns(RuntimeWarning, match="the load holds 0.6 of the out-of-balance forces of the last stage"):
        bridge.factor_of_safety(site.fem, site.fem.load, start=1.0, tolerance=0.2)
    with pytest.raises(bridge.InputError, match="stage 'part': deconfinement is 0.4, expected 1: it is the last one"):
        site_of(pit, plastic(soils), degree=1).place([IN_SITU, PART])
    values = []
    for stages in ([IN_SITU, PART, bridge.Stage("rest")], [IN_SITU, bridge.Stage("whole", excavate="pit 1")]):
        fresh = site_of(pit, plastic(soils), degree=1)
        with warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)
            load = fresh.place(stages)
        assert load.held == 0
        values.append(bridge.factor_of_safety(fresh.fem, load, start=1.0, tolerance=0.05).value)
    assert values[0] == values[1]


def test_particles_do_not_take_over_what_forces_hold(pit):
    laws = elastic(SOILS["pit"])
    site = site_of(pit, laws, degree=1)
    carried_out(site, IN_SITU, PART)
    model = mpm.Model(bridge.background_mesh(*pit), list(laws.values()))
    particles = bridge.ParticleSite(model, {s: k for k, s in enumerate(laws)}, ROLLERS, small_displacements=True)
    with pytest.raises(bridge.InputError, match="holds 0.6 of the out-of-balance forces .* deconfinement = 1"):
        particles.take_over(site)
    assert len(model.particles) == 0
    carried_out(particles, IN_SITU)
    with pytest.raises(
        bridge.InputError, match="stage 'part': deconfinement is 0.4, expected 1: particles release all"
    ):
        particles.carry_out(PART)
    with pytest.raises(bridge.InputError, match="holds 0.6 of the out-of-balance forces"):
        bridge.initialise(model, site.fem)
    carried_out(site, bridge.Stage("rest"))
    numbers, bare = particles._material, mpm.Model(bridge.background_mesh(*pit), list(laws.values()))
    assert bridge.ParticleSite(bare, numbers, ROLLERS).take_over(site).unbalanced_ratio < 1e-8


def test_a_stage_that_fails_after_one_that_held_names_the_part_of_what_was_left(pit):
    """Clay that stands under half of the forces of the cut and not without them: the particles then begin the failure."""
    soils = SOILS["pit"]
    laws = dict.fromkeys(soils, mpm.tresca(young=20e6, poisson=0.3, shear_strength=9e3))
    site = site_of(pit, laws, degree=1)
    in_situ = bridge.Stage("in situ", fill=soils, unit_weight=dict.fromkeys(soils, 20e3), k0=dict.fromkeys(soils, 0.9))
    dig = bridge.Stage("dig", excavate=["pit 1", "pit 2"], deconfinement=0.5)
    carried_out(site, in_situ, dig)
    with pytest.raises(bridge.StageError, match="stage 3 .'rest'. has no equilibrium beyond") as error:
        carried_out(site, bridge.Stage("rest"))
    assert 0 < error.value.fraction < 1 and site.fem.load.held == pytest.approx(1 - error.value.fraction)
    model = mpm.Model(bridge.background_mesh(*pit), list(laws.values()))
    particles = bridge.ParticleSite(model, dict.fromkeys(soils, 0), ROLLERS)
    held = site.fem.load.held
    assert particles.take_over(site).unbalanced_ratio > 1e-3
    assert site.fem.load.held == held and not site.fem.converged


def test_undrained_strength_follows_the_stress_under_the_forces_that_are_held(column):
    """Of 2 m of 16 kN/m3 that are dug away half is held: 0.3 (16 + 18 + 20 d) kPa at a depth of d in the ground."""
    soils, least = SOILS["column"], 1e3
    clay = mpm.Heterogeneous(mpm.tresca(young=20e6, poisson=0.4, shear_strength=least), ["cohesion"])
    site = site_of(column, elastic(soils), degree=2)
    ratio = {"ground": bridge.StrengthRatio(0.3)}
    load = site.place([
        bridge.Stage("all", fill=soils, unit_weight=weights(soils)),
        bridge.Stage("dig", excavate="layer 2", deconfinement=0.5),
        bridge.Stage("undrained", law={"ground": clay}, strength_ratio=ratio),
    ])  # fmt: skip
    points = site.fem.points
    height = points.coordinates()[:, 1]
    rows = height < 3
    expected = 0.3 * (0.5 * 32e3 + 18e3 + 20e3 * (3 - height[rows]))
    assert load.held == 0 and np.allclose(points.state[rows, -1] + least, expected, rtol=1e-9)
