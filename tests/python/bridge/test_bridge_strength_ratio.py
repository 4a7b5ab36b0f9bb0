"""Undrained strengths in proportion to the vertical effective stress, which stages give their soils."""

import warnings
from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI
from stage_cases import ROLLERS, SOILS, carried_out, mesh_of, site_of, weights

import fenics_bridge as bridge
import mpm_core as mpm

HEIGHT, WEIGHT, WATER = 6.0, 17e3, 9.81e3
LEAST = 2e3  # cohesion of the law itself
RATIO = bridge.StrengthRatio(0.22, overconsolidation=2.0, exponent=0.8)
DRAINED = mpm.MohrCoulomb(young=10e6, poisson=0.3, cohesion=1e3, friction_angle=30.0, dilation_angle=30.0)
SOIL = "clay"
MESHES = Path(__file__).parents[3] / "meshes"
OVER = -1  # state variable: by what the cohesion exceeds that of the law


def undrained(least=LEAST):
    return mpm.Heterogeneous(mpm.tresca(young=10e6, poisson=0.49, shear_strength=least), ["cohesion"])


@pytest.fixture(scope="module")
def ground():
    parameters = {"height": HEIGHT, "width": 1.0, "cell_size": 0.5}
    return bridge.read_mesh(MESHES / "layer.geo", MPI.COMM_WORLD, parameters=parameters)


def beginning(**options):
    return bridge.Stage("in situ", fill=SOIL, unit_weight={SOIL: WEIGHT}, **options)


def expected(depth, level=HEIGHT, pressure=0.0):
    """s_u = max(LEAST, 0.22 sigma_v' 2^0.8) below level ground with its water table at a height [m]."""
    vertical = pressure + WEIGHT * depth - WATER * np.maximum(depth - (HEIGHT - level), 0.0)
    return np.maximum(LEAST, 0.22 * 2**0.8 * vertical)


def particles_of(mesh, laws, materials, **options):
    model = mpm.Model(bridge.background_mesh(*mesh), laws)
    return bridge.ParticleSite(model, materials, ROLLERS, small_displacements=True, tolerance=1e-8, **options)


def test_a_formula_of_shansep():
    assert RATIO(np.array([100e3, 0.0, -5e3])) == pytest.approx([0.22 * 2**0.8 * 100e3, 0.0, 0.0])
    assert bridge.StrengthRatio(0.06)(50e3) == pytest.approx(3e3)


def test_strength_grows_slowly_up_to_the_preconsolidation_and_in_proportion_beyond():
    ratio = bridge.StrengthRatio(0.25, exponent=0.8, vertical_preconsolidation=100e3)
    assert ratio(np.array([50e3, 100e3, 200e3, 0.0])) == pytest.approx(
        [0.25 * 50e3 * 2**0.8, 0.25 * 100e3, 0.25 * 200e3, 0.0]
    )
    growing = bridge.StrengthRatio(0.25, exponent=0.8, vertical_preconsolidation=lambda x: 10e3 * x[:, 0])
    assert growing([50e3, 50e3], np.array([[10.0, 0.0], [1.0, 0.0]])) == pytest.approx(
        [0.25 * 50e3 * 2**0.8, 0.25 * 50e3]
    )
    with pytest.raises(bridge.InputError, match="vertical_preconsolidation is -1.0, expected a stress from 0 on"):
        bridge.StrengthRatio(0.25, vertical_preconsolidation=-1.0)


def in_order(particles, name):
    return getattr(particles, name)[np.argsort(particles.id)]


@pytest.mark.parametrize("method", ["elements", "particles"])
def test_strength_follows_the_consolidation_under_a_fill(ground, method):
    """Named again after the fill has consolidated: nothing is forgotten of a preconsolidation stress that grows with depth."""
    law, fill = undrained(least=1.0), 40e3

    def before(x):
        return 60e3 + 5e3 * (HEIGHT - x[:, -1])

    ratio = {SOIL: bridge.StrengthRatio(0.25, exponent=0.8, vertical_preconsolidation=before)}
    stages = (
        beginning(),
        bridge.Stage("undrained", law={SOIL: law}, strength_ratio=ratio),
        bridge.Stage("fill", law={SOIL: DRAINED}, pressure={"top": fill}),
        bridge.Stage("consolidated", law={SOIL: law}, strength_ratio=ratio),
    )
    if method == "elements":
        site = site_of(ground, {SOIL: DRAINED}, degree=2)
    else:
        site = particles_of(ground, [DRAINED, law], {SOIL: 0})
    for number, stage in enumerate(stages):
        stress = None if method == "elements" else in_order(site.model.particles, "stress")
        site.carry_out(stage)
        if number not in (1, 3):
            continue
        if method == "elements":
            place, strength = site.fem.points.coordinates(), site.fem.points.state[:, OVER] + 1.0
            vertical = WEIGHT * (HEIGHT - place[:, 1]) + (fill if number == 3 else 0.0)
        else:
            place, state = (in_order(site.model.particles, name) for name in ("position", "state"))
            strength, vertical = state[:, OVER] + 1.0, -stress[:, 1]  # of their cells, before the change of the law
        largest = np.maximum(vertical, before(place))
        assert strength == pytest.approx(0.25 * vertical**0.2 * largest**0.8, rel=1e-3)
        assert 0.1 < (largest > vertical).mean() < 0.9


def test_level_ground_has_it_from_its_weight_and_water_table(ground):
    """In elements, whose stresses under the weight are exact at the points of quadratic ones, and in particles."""
    law, table = undrained(), bridge.hydrostatic(4.0)
    stages = beginning(pore_pressure=table), bridge.Stage("undrained", law={SOIL: law}, strength_ratio={SOIL: RATIO})
    site = site_of(ground, {SOIL: DRAINED}, degree=2)
    carried_out(site, *stages)
    points = site.fem.points
    z = HEIGHT - points.coordinates()[:, 1]
    # the water table is on a line of nodes, where the pore pressure of a cell is exact as well
    assert points.parameters["cohesion"] == pytest.approx(expected(z, 4.0), rel=1e-3)
    assert points.state[:, OVER] == pytest.approx(points.parameters["cohesion"] - LEAST)
    own = particles_of(ground, [DRAINED, law], {SOIL: 0})
    taken = particles_of(ground, [DRAINED, law], {SOIL: 0})
    carried_out(own, *stages)
    linear = site_of(ground, {SOIL: DRAINED}, degree=1)
    carried_out(linear, *stages)
    taken.take_over(linear)
    for particles in (own, taken):
        p = particles.model.particles
        assert (p.material == 1).all()
        found = linear.fem.evaluate_at(p.position)["state"][:, OVER]
        assert p.state[:, OVER] == pytest.approx(found, rel=1e-5, abs=1e-5 * found.max())
        # constant in a cell of 0.5 m, whose middle is up to a third of it above or below
        assert p.state[:, OVER] + LEAST == pytest.approx(
            expected(HEIGHT - p.position[:, 1], 4.0), abs=0.4 * 0.5 * WEIGHT * 0.5
        )


@pytest.mark.parametrize("degree, nmd", [(1, False), (1, True), (2, False)])
def test_soil_that_comes_with_k0_has_it_from_the_beginning(ground, degree, nmd):
    """By elements and particles alike; in quadratic elements also under the pressure of the stage."""
    law, pressure = undrained(), 20e3 if degree == 2 else 0.0
    stage = beginning(k0={SOIL: 0.8}, strength_ratio={SOIL: RATIO}, pressure={"top": pressure})
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "linear cells lock")
        site = site_of(ground, {SOIL: law}, degree=degree, nmd=nmd)
    carried_out(site, stage)
    points = site.fem.points
    depth, tolerance = HEIGHT - points.coordinates()[:, 1], 1e-6 * 1e5
    if degree == 1:  # that of the middle of a row of cells, but for a third of the row
        depth, tolerance = 0.5 * np.floor(depth / 0.5) + 0.25, 0.22 * 2**0.8 * WEIGHT * 0.17
    assert points.parameters["cohesion"] == pytest.approx(expected(depth, 0.0, pressure), abs=tolerance)
    if degree == 1:
        particles = particles_of(ground, [law], {SOIL: 0}, nmd=nmd)
        carried_out(particles, stage)
        p = particles.model.particles
        found = site.fem.evaluate_at(p.position)["state"][:, OVER]
        assert p.state[:, OVER] == pytest.approx(found, abs=1e-5 * found.max())


def test_ground_gains_strength_as_it_consolidates(ground):
    """A pressure of 30 kPa that has acted before the second strength ratio is given raises it by 0.22 of that."""
    law, ratio = undrained(), bridge.StrengthRatio(0.22)
    site = site_of(ground, {SOIL: law}, degree=2)
    carried_out(site, beginning(k0={SOIL: 0.8}, strength_ratio={SOIL: ratio}))
    before = site.fem.points.parameters["cohesion"].copy()
    carried_out(site, bridge.Stage("load", pressure={"top": 30e3}))
    assert np.array_equal(site.fem.points.parameters["cohesion"], before)
    carried_out(site, bridge.Stage("consolidated", strength_ratio={SOIL: ratio}))
    z = HEIGHT - site.fem.points.coordinates()[:, 1]
    assert site.fem.points.parameters["cohesion"] == pytest.approx(
        np.maximum(LEAST, 0.22 * (30e3 + WEIGHT * z)), rel=1e-6
    )


def test_stresses_of_the_drained_soil_are_brought_back_to_the_strength(ground):
    """K0 = 0.3 needs a strength of 0.35 sigma_v; with half of it the horizontal stress rises to sigma_v - 2 s_u."""
    ratio = bridge.StrengthRatio(0.175)
    site = site_of(ground, {SOIL: DRAINED}, degree=2)
    stages = beginning(k0={SOIL: 0.35}), bridge.Stage("weak", law={SOIL: undrained(1.0)}, strength_ratio={SOIL: ratio})
    carried_out(site, *stages)
    stress = site.fem.points.stress
    assert stress[:, 1] - stress[:, 0] == pytest.approx(2 * 0.175 * stress[:, 1], rel=1e-6)


def test_softening_clay_has_it_as_its_peak_and_keeps_its_sensitivity(ground):
    """By elements and particles; cohesion and residual cohesion of the law are its least strength and its sensitivity, 4."""
    peak = mpm.MohrCoulomb(young=10e6, poisson=0.45, cohesion=LEAST, friction_angle=0.0)
    law = mpm.SofteningMohrCoulomb(
        peak, residual_cohesion=LEAST / 4, residual_friction_angle=0.0, softening_strain=0.1, reference_length=0.5
    )
    stage = bridge.Stage("undrained", law={SOIL: law}, strength_ratio={SOIL: RATIO})
    site = site_of(ground, {SOIL: DRAINED}, degree=2)
    carried_out(site, beginning(), stage)
    points = site.fem.points
    strength = expected(HEIGHT - points.coordinates()[:, 1], 0.0)
    deviation = points.state[:, law.state_names.index("cohesion_deviation")]
    assert LEAST * (1 + deviation) == pytest.approx(strength, rel=1e-6)
    weakest = law.softened(np.inf, float(deviation.max())).cohesion
    assert weakest == pytest.approx(strength.max() / 4, rel=1e-6)
    own = particles_of(ground, [DRAINED, law], {SOIL: 0})
    linear = site_of(ground, {SOIL: DRAINED}, degree=1)
    for each in (own, linear):
        carried_out(each, beginning(), stage)
    p = own.model.particles
    found = linear.fem.evaluate_at(p.position)["state"][:, law.state_names.index("cohesion_deviation")]
    assert own.model.parameter("cohesion") == pytest.approx(LEAST * (1 + found), rel=1e-5)


@pytest.mark.parametrize("degree, cell_size, tolerance", [(1, 0.75, 5e-3), (2, 0.9, 2e-3)])
def test_a_cut_in_normally_consolidated_clay_has_a_factor_that_no_weight_changes(degree, cell_size, tolerance):
    """Gibson and Morgenstern (1962): as with s_u in proportion to the depth, whose factor is the same under any weight.

    The stability number F / ratio of this cut, 1:1.5 and as deep below as above its floor, is 5.04 by the best slip circle (verification case
    `strength_ratio`). The strength of linear elements, averaged over nodes, is off by some cells at the surface.
    """
    size = {"cell_size": cell_size, "below": 4.5, "half_width": 5.0, "width": 22.0}
    mesh = bridge.read_mesh(MESHES / "excavation.geo", MPI.COMM_WORLD, parameters=size)
    soils, ratio = ["ground", "cut 1", "cut 2", "cut 3"], bridge.StrengthRatio(0.3)
    supports = [bridge.fixed("base"), bridge.roller("axis", (1, 0)), bridge.roller("right", (1, 0))]
    found = []
    for weight in (18e3, 9e3):
        site = site_of(mesh, dict.fromkeys(soils, undrained(1.0)), supports, degree=degree, nmd=degree == 1)
        stages = [
            bridge.Stage("level", soils, unit_weight=dict.fromkeys(soils, weight), k0=dict.fromkeys(soils, 0.6),
                         strength_ratio=dict.fromkeys(soils, ratio)),
            bridge.Stage("cut", excavate=soils[1:]),
        ]  # fmt: skip
        found.append(bridge.factor_of_safety(site.fem, site.place(stages), start=1.0).value)
    assert found[1] == pytest.approx(found[0], rel=3e-3)
    fem = site_of(mesh, dict.fromkeys(soils, undrained(1.0)), supports, degree=degree, nmd=degree == 1).fem
    fem.set_parameter("cohesion", lambda x: 0.3 * 18e3 * (9.0 - x[:, 1]))
    fem.reconfigure(off=soils[1:])
    by_depth = bridge.factor_of_safety(fem, bridge.Load(unit_weight=18e3), start=1.0).value
    assert found[0] == pytest.approx(by_depth, rel=tolerance + 3e-3)
    assert found[0] == pytest.approx(0.3 * 5.04, rel=0.015)


def test_without_equilibrium_of_its_stage_the_factor_is_found_at_once(tmp_path):
    """What a pit stands with after its stages, times what its strength is divided by in them, with a factor below 1 too."""
    mesh, soils = mesh_of("pit", tmp_path), SOILS["pit"]
    strong, weak = (
        bridge.factor_of_safety(site.fem, site.place(pit(soils, ratio)), start=0.2)
        for ratio in (0.6, 0.15)
        for site in [site_of(mesh, dict.fromkeys(soils, DRAINED), degree=2)]
    )
    assert weak.value < 1 < strong.value
    assert strong.value / weak.value == pytest.approx(4.0, rel=0.01)
    stood = site_of(mesh, dict.fromkeys(soils, DRAINED), degree=2)
    carried_out(stood, *pit(soils, 0.6))
    assert bridge.factor_of_safety(stood.fem, stood.fem.load).value == pytest.approx(strong.value, rel=5e-3)
    with pytest.raises(bridge.StageError):
        carried_out(site_of(mesh, dict.fromkeys(soils, DRAINED), degree=2), *pit(soils, 0.15))


def pit(soils, ratio):
    """A pit is dug in drained ground, which then ceases to drain."""
    law = undrained(1.0)
    return [
        bridge.Stage("in situ", fill=soils, unit_weight=weights(soils), k0=dict.fromkeys(soils, 0.5)),
        bridge.Stage("undrained", law=dict.fromkeys(soils, law),
                     strength_ratio=dict.fromkeys(soils, bridge.StrengthRatio(ratio))),
        bridge.Stage("dig", excavate=["pit 1", "pit 2"]),
    ]  # fmt: skip


@pytest.mark.parametrize(
    "arguments, message",
    [
        ((0.0,), "ratio is 0.0, expected a number above 0 and up to 2, such as 0.22"),
        ((22.0,), "ratio is 22.0, expected"),
        ((np.nan,), "ratio is nan"),
        ((0.22, 0.5), "overconsolidation is 0.5, expected a ratio from 1 to 100"),
        ((0.22, 2.0, 1.2), "exponent is 1.2, expected a number from 0 to 1"),
    ],
)
def test_wrong_numbers(arguments, message):
    with pytest.raises(bridge.InputError, match=message):
        bridge.StrengthRatio(*arguments)


@pytest.mark.parametrize(
    "law, changes, message",
    [
        (undrained(), {"strength_ratio": 0.22}, "stage 'b': strength_ratio is 0.22, expected a dictionary by soil"),
        (undrained(), {"strength_ratio": {"ground": 0.22}}, "stage 'b': strength_ratio is 0.22 for 'ground', expected a StrengthRatio"),
        (undrained(), {"strength_ratio": {"rock": RATIO}}, "stage 'b': strength_ratio: .*'rock'"),
        (undrained(), {"strength_ratio": {"layer 1": RATIO}}, "stage 'b': strength_ratio: the soil 'layer 1' is not there"),
        (undrained(), {"fill": "layer 1", "strength_ratio": {"layer 1": RATIO}},
         "strength_ratio: the soil 'layer 1' comes without stress, expected k0 for it, or its strength_ratio in a later stage"),
        (DRAINED, {"strength_ratio": {"ground": RATIO}},
         r"strength_ratio: the law of the soil 'ground' is MohrCoulomb, expected one without friction .*Heterogeneous\(tresca"),
        (mpm.Heterogeneous(DRAINED, ["cohesion"]), {"strength_ratio": {"ground": RATIO}}, "expected one without friction"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused_and_nothing_changes(tmp_path, law, changes, message):
    mesh, soils = mesh_of("column", tmp_path), SOILS["column"]
    sites = site_of(mesh, dict.fromkeys(soils, law)), particles_of(mesh, [law], dict.fromkeys(soils, 0))
    first = bridge.Stage("a", fill="ground", unit_weight=weights(soils), k0={"ground": 0.95})
    for site in sites:
        carried_out(site, first)
        with pytest.raises(bridge.InputError, match=message):
            site.carry_out(bridge.Stage("b", **changes))
        assert site.number == 1
