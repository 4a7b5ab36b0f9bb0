"""Stages of construction by finite elements, against the same geometry built at once and against sums by hand."""

import numpy as np
import pytest
from stage_cases import (
    DIG,
    IN_SITU,
    POISSON,
    ROLLERS,
    SOILS,
    at_once,
    carried_out,
    elastic,
    mesh_of,
    oedometer,
    site_of,
    weights,
)

import fenics_bridge as bridge
import mpm_core as mpm


def there_of(points):
    """Stress of the points that are there, and their depths below the surface of the column's ground."""
    there = np.repeat(points.material >= 0, points.per_cell)
    return points.stress[there], 3 - points.coordinates()[there, 1]


def assert_same(staged, direct, moved_before=None):
    """Stress and displacement at the quadrature points of the body built at once, to 1e-9."""
    x = direct.points.coordinates()
    values, expected = staged.evaluate_at(x), direct.evaluate_at(x)
    displacement = values["displacement"] + (0 if moved_before is None else moved_before(x))
    for got, exact in ((values["stress"], expected["stress"]), (displacement, expected["displacement"])):
        assert np.allclose(got, exact, rtol=0, atol=1e-9 * np.abs(exact).max())


@pytest.mark.parametrize("degree", [1, 2, 4])
def test_staged_excavation_is_the_remaining_ground_built_at_once(pit, degree):
    """Elastic stress is that of the total displacement, which meets all conditions of the remaining body at the end."""
    laws = elastic(SOILS["pit"])
    site = site_of(pit, laws, degree=degree)
    carried_out(site, IN_SITU, *DIG)
    direct = at_once(pit, ["ground"], laws, bridge.Load(20e3, pressure={"floor": 5e3}), degree=degree)
    assert_same(site.fem, direct)


def test_displacements_that_are_reset_are_those_from_there_on(pit):
    laws = elastic(SOILS["pit"])
    site, before = site_of(pit, laws), site_of(pit, laws)
    carried_out(before, IN_SITU)
    carried_out(site, IN_SITU, bridge.Stage("dig 1", excavate="pit 1", reset_displacement=True), DIG[1])
    direct = at_once(pit, ["ground"], laws, bridge.Load(20e3, pressure={"floor": 5e3}))
    assert_same(site.fem, direct, lambda x: before.fem.evaluate_at(x)["displacement"])


def test_a_pit_that_is_filled_again_has_the_weight_of_the_fill(pit):
    """What is placed again is free of stress at first, and the ground carries it: reaction of the base."""
    site = site_of(pit, elastic(SOILS["pit"]))
    carried_out(site, IN_SITU, *DIG, bridge.Stage("fill", fill=["pit 2", "pit 1"], pressure={"floor": 0.0}))
    assert site.fem.reaction("base")[1] == pytest.approx(-20e3 * (54 - 9) - 18e3 * 6 - 19e3 * 3)
    x = np.array([(1.5, 5.9)])
    assert -3 * 18e3 * 0.1 < site.fem.evaluate_at(x)["stress"][0, 1] < 0


def test_a_support_taken_away_leaves_the_body_without_it(pit):
    laws = elastic(SOILS["pit"])
    site = site_of(pit, laws)
    carried_out(site, IN_SITU, bridge.Stage("free", release="right"))
    load = bridge.Load(weights(SOILS["pit"]))
    assert_same(site.fem, at_once(pit, SOILS["pit"], laws, load, [ROLLERS[0], ROLLERS[2]]))


def test_one_of_several_sides_of_a_support_is_released(tmp_path):
    """Rollers at "sides" of which one goes are the roller at the other; 1e-9, as if there had been two supports."""
    pit = mesh_of("pit", tmp_path)  # of its own, whose boundaries are given a new name
    domain, cell_tags, facet_tags = pit
    names = bridge.names_of(facet_tags)
    bridge.name_tags(facet_tags, {**names, "sides": names["left"] + names["right"]})
    laws = elastic(SOILS["pit"])
    site = site_of(pit, laws, [bridge.roller("sides", (1, 0)), ROLLERS[2]])
    carried_out(site, IN_SITU, bridge.Stage("free", release="right"))
    direct = at_once(pit, SOILS["pit"], laws, bridge.Load(weights(SOILS["pit"])), [ROLLERS[0], ROLLERS[2]])
    assert_same(site.fem, direct)
    assert np.abs(site.fem.reaction("right")[0]) < 1e-9 * np.abs(site.fem.reaction("base")[1])


def test_a_support_that_comes_holds_the_nodes_where_they_are(column):
    """A plate on the surface of the ground, then load above it: nothing below the plate notices."""
    soils = SOILS["column"]
    site = site_of(column, elastic(soils))
    carried_out(site, bridge.Stage("ground", fill="ground", unit_weight=weights(soils)))
    x = np.array([(0.5, 3.0 - 1e-6), (0.3, 1.0)])
    before = site.fem.evaluate_at(x)
    carried_out(site, bridge.Stage("plate", support=bridge.fixed("surface")), bridge.Stage("load", fill="layer 1"))
    after = site.fem.evaluate_at(x)
    assert np.allclose(after["displacement"], before["displacement"], rtol=0, atol=1e-12)
    assert np.allclose(after["stress"], before["stress"], rtol=0, atol=1e-9 * 60e3)


def test_settlement_of_layers_is_the_sum_by_hand(column):
    """One-dimensional: each layer is compressed by its own weight from when it is placed, and by all placed later."""
    soils, heights = SOILS["column"], {"ground": 3.0, "layer 1": 1.0, "layer 2": 2.0}
    site = site_of(column, elastic(soils))
    reports = carried_out(site, *(bridge.Stage(s, fill=s, unit_weight=weights([s])) for s in soils))
    weight = [weights(soils)[s] * heights[s] for s in soils]
    flexibility = [heights[s] / oedometer(s) for s in soils]

    def compression(layer, stage):
        """of a layer in a stage: by what the stage places above it, or by half of its own weight in its own stage"""
        return flexibility[layer] * weight[stage] * (0.5 if layer == stage else 1.0)

    for k, top in enumerate(np.cumsum([heights[s] for s in soils])):
        # Displacements of a layer count from when it is placed.
        expected = sum(compression(layer, stage) for stage in range(k, 3) for layer in range(k + 1))
        moved = site.fem.evaluate_at([(0.5, top)])["displacement"][0, 1]
        assert moved == pytest.approx(-expected, rel=1e-9)
    assert [r.number for r in reports] == [1, 2, 3] and reports[0].name == "ground"
    y = site.fem.points.coordinates()[:, 1]
    above = np.select([y > 4, y > 3], [16e3 * (6 - y), 16e3 * 2 + 18e3 * (4 - y)], 16e3 * 2 + 18e3 + 20e3 * (3 - y))
    assert np.allclose(site.fem.points.stress[:, 1], -above, atol=1e-4)


def test_layers_at_once_settle_as_one_body(column):
    """All placed at once: every layer is compressed by half of itself and all above, the top by the sum."""
    soils = SOILS["column"]
    site = site_of(column, elastic(soils))
    carried_out(site, bridge.Stage("all", fill=soils, unit_weight=weights(soils)))
    direct = at_once(column, soils, elastic(soils), bridge.Load(weights(soils)))
    assert_same(site.fem, direct)


def test_a_preload_leaves_horizontal_stress_in_plastic_soil(column):
    """Weightless Tresca ground between rollers: under q it yields, sigma_h = q - 2c; unloading is elastic by K0 q."""
    q, strength = 32e3, 5e3
    laws = {**elastic(SOILS["column"]), "ground": mpm.tresca(young=20e6, poisson=POISSON, shear_strength=strength)}
    site = site_of(column, laws, degree=2)
    weight = {"ground": 0.0, "layer 1": q}
    carried_out(site, bridge.Stage("preload", fill=["ground", "layer 1"], unit_weight=weight),
                bridge.Stage("away", excavate="layer 1"))  # fmt: skip
    stress = site.fem.points.stress[site.fem.points.coordinates()[:, 1] < 3]
    k0 = POISSON / (1 - POISSON)
    assert q - k0 * q > 2 * strength > abs(q - 2 * strength - k0 * q)  # it yields under the load, not when it goes
    assert np.allclose(stress[:, 0], -(q - 2 * strength - k0 * q), atol=1e-3)
    assert np.allclose(stress[:, 1], 0, atol=1e-3)


def test_another_law_takes_over_the_stress(column):
    """Ten times stiffer ground: nothing moves when it is improved, and a load then compresses it by a tenth."""
    soils = SOILS["column"]
    site = site_of(column, elastic(soils))
    stiff = mpm.LinearElastic(young=200e6, poisson=POISSON)
    carried_out(site, bridge.Stage("ground", fill="ground", unit_weight=weights(soils)))
    before, top = site.fem.points.stress.copy(), [(0.5, 3.0)]
    settled = site.fem.evaluate_at(top)["displacement"]
    carried_out(site, bridge.Stage("improved", law={"ground": stiff}))
    assert np.allclose(site.fem.points.stress, before, atol=1e-6)
    assert np.allclose(site.fem.evaluate_at(top)["displacement"], settled, rtol=1e-9)
    carried_out(site, bridge.Stage("load", pressure={"surface": 50e3}, reset_displacement=True))
    expected = -50e3 * 3 / (10 * oedometer("ground"))
    assert site.fem.evaluate_at(top)["displacement"][0, 1] == pytest.approx(expected, rel=1e-9)


def test_what_is_not_reconfigured_stays(column):
    """Stiffer ground under water, below a pit: as before it carries gamma' z, and the base the weight of the saturated ground."""
    soils = SOILS["column"]
    site = site_of(column, elastic(soils))
    wet = bridge.Stage("wet", fill=soils, unit_weight={s: 20e3 for s in soils}, pore_pressure=bridge.hydrostatic(3.0))
    carried_out(site, wet, bridge.Stage("dig", excavate=soils[1:]))
    fem, off = site.fem, site.fem.off
    fem.reconfigure(law={soil: mpm.LinearElastic(young=200e6, poisson=POISSON) for soil in soils})
    fem.solve(bridge.Load({"ground": 20e3}))
    stress, depth = there_of(fem.points)
    assert fem.off == off and len(off) == 2
    assert np.allclose(stress[:, 1], -10.19e3 * depth, atol=1e-3)
    assert fem.reaction("base")[1] == pytest.approx(-20e3 * 3, rel=1e-9)
    fem.reconfigure(off=(), pore_pressure=lambda x: 0 * x[:, 0])
    fem.solve(bridge.Load(20e3))
    assert fem.off == () and fem.reaction("base")[1] == pytest.approx(-20e3 * 6, rel=1e-9)


@pytest.mark.parametrize("load", [{"pressure": {"surface": 5e3}}, {"traction": {"surface": (0.0, -5e3)}}])
def test_loads_inside_of_the_soil_are_refused(column, load):
    """A pressure inside acts on both sides, and a traction needs a surface; where the soil above is away, both load the ground."""
    laws, kind = elastic(SOILS["column"]), next(iter(load))
    with pytest.raises(mpm.InputError, match=rf"{kind}: no facet with the tag 'surface' is on the surface of the soil"):
        at_once(column, SOILS["column"], laws, bridge.Load(**load))
    assert at_once(column, ["ground"], laws, bridge.Load(**load)).reaction("base")[1] == pytest.approx(-5e3)


def test_a_pressure_that_is_filled_over_is_taken_away(column):
    soils = SOILS["column"]
    site = site_of(column, elastic(soils))
    pressed = bridge.Stage("pressed", fill="ground", unit_weight=weights(soils), pressure={"surface": 5e3})
    carried_out(site, pressed, bridge.Stage("over it", fill="layer 1"), bridge.Stage("more", fill="layer 2"))
    assert site.fem.reaction("base")[1] == pytest.approx(-(3 * 20e3 + 18e3 + 2 * 16e3))
    covered = site_of(column, elastic(soils))
    with pytest.raises(mpm.InputError, match="pressure: no facet with the tag 'surface' is on the surface of the soil"):
        covered.carry_out(bridge.Stage("all", fill=soils, unit_weight=weights(soils), pressure={"surface": 5e3}))


def test_one_law_for_all_soils_is_that_of_each(column):
    """Stages as with the same law for each soil; a stage may then give one of them another."""
    one, soils = mpm.LinearElastic(young=20e6, poisson=POISSON), SOILS["column"]
    stages = [bridge.Stage("ground", fill="ground", unit_weight=weights(soils)), bridge.Stage("layer", fill="layer 1")]
    sites = [site_of(column, laws) for laws in (one, dict.fromkeys(soils, one))]
    for site in sites:
        carried_out(site, *stages)
    assert np.array_equal(*(site.fem.displacement.x.array for site in sites))
    stiff = bridge.Stage("stiff", law={"layer 1": elastic(soils)["ground"]}, pressure={"surface": 0.0})
    carried_out(sites[0], stiff)
    assert len(set(map(id, sites[0].fem.laws))) == 2


def test_a_weaker_law_brings_the_stress_inside_its_strength(column):
    laws = elastic(SOILS["column"])
    site = site_of(column, laws, degree=2)
    soft = mpm.tresca(young=20e6, poisson=POISSON, shear_strength=5e3)
    carried_out(site, bridge.Stage("ground", fill="ground", unit_weight=weights(["ground"])),
                bridge.Stage("softened", law={"ground": soft}))  # fmt: skip
    points = site.fem.points
    stress, _ = there_of(points)
    assert (stress[:, 0] - stress[:, 1]).max() == pytest.approx(2 * 5e3, rel=1e-6)  # at depth it yields
    assert site.fem.reaction("base")[1] == pytest.approx(-20e3 * 3, rel=1e-6)


@pytest.mark.parametrize(("level", "effective"), [(3.0, 10.19), (5.0, 10.19), (0.0, 20.0)])
def test_ground_under_water_has_its_buoyant_weight(column, level, effective):
    """Effective stress is gamma' times the depth, also with water standing 2 m above the ground."""
    site = site_of(column, elastic(SOILS["column"]))
    carried_out(site, bridge.Stage("dry", fill="ground", unit_weight={"ground": 20e3}),
                bridge.Stage("water", pore_pressure=bridge.hydrostatic(level)))  # fmt: skip
    stress, depth = there_of(site.fem.points)
    assert np.allclose(stress[:, 1], -effective * 1e3 * depth, atol=1e-3)


def test_lowering_the_water_settles_the_ground(column):
    """From the surface to the base: the effective stress rises by gamma_w z, 3 m of ground by gamma_w 1.5 m on average."""
    site = site_of(column, elastic(SOILS["column"]), degree=2)
    wet = bridge.Stage("wet", fill="ground", unit_weight={"ground": 20e3}, pore_pressure=bridge.hydrostatic(3.0))
    carried_out(site, wet, bridge.Stage("low", pore_pressure=bridge.hydrostatic(0.0), reset_displacement=True))
    settlement = 9.81e3 * 3 * 1.5 / oedometer("ground")
    moved = site.fem.evaluate_at([(0.5, 3.0)])["displacement"][0, 1]
    assert moved == pytest.approx(-settlement, rel=1e-9)


def test_ground_placed_with_k0_stress_does_not_move(column):
    site = site_of(column, elastic(SOILS["column"]))
    at_rest = bridge.Stage("at rest", fill="ground", unit_weight={"ground": 20e3},
                           stress=lambda x: bridge.k0_stress(x, 3.0, 20e3, 0.8))  # fmt: skip
    (report,) = carried_out(site, at_rest)
    stress, depth = there_of(site.fem.points)
    assert report.largest_displacement < 1e-9
    assert np.allclose(stress[:, 0], -0.8 * 20e3 * depth, atol=1e-3)


def test_averaged_strains_leave_out_what_is_not_there(column):
    site = site_of(column, elastic(SOILS["column"]), degree=1, nmd=True)
    carried_out(site, bridge.Stage("ground", fill="ground", unit_weight={"ground": 20e3}))
    soil = elastic(["ground"])
    direct = at_once(column, ["ground"], soil, bridge.Load(20e3), degree=1, nmd=True)
    assert_same(site.fem, direct)


def test_particles_take_over_what_is_there_after_a_stage(pit):
    laws = elastic(SOILS["pit"])
    site = site_of(pit, laws, degree=1)
    carried_out(site, IN_SITU, DIG[0], bridge.Stage("dig 2", excavate="pit 2"))
    model = mpm.Model(bridge.background_mesh(*pit), list(site.fem.laws))
    model.seed(density=2000.0, per_cell=3, cell_tag="ground", material=0)
    for name, normal in (("left", (1, 0)), ("right", (1, 0))):
        model.roller(name, normal)
    model.fix("base")
    model.set_gravity((0, -10))
    assert bridge.initialise(model, site.fem, equilibrate=False).unbalanced_ratio < 1e-9
    model.seed(density=2000.0, per_cell=3, cell_tag="pit 1", material=1)
    with pytest.raises(bridge.InputError, match=".* particles lie where the finite elements have no soil"):
        bridge.initialise(model, site.fem)


@pytest.mark.parametrize("geometry", [None, bridge.Geometry.AXISYMMETRIC])
@pytest.mark.parametrize("level", [2.0, 3.0, 4.5])
def test_reactions_are_those_of_soil_and_water(column, level, geometry):
    """By hand, of the saturated ground with free water above it; excavated soil leaves a surface on which water stands.

    The base carries all weight, soil's and standing water's. A side carries the effective stress nu / (1 - nu) sigma'_v of the
    soil and the pressure of the water.
    """
    soils, water = SOILS["column"], 9.81e3
    site = site_of(column, elastic(soils), [*ROLLERS[:2], bridge.roller("base", (0, 1))], geometry=geometry)
    filled = bridge.Stage(
        "all", fill=soils, unit_weight={soil: 20e3 for soil in soils}, pore_pressure=bridge.hydrostatic(level)
    )
    carried_out(site, filled, bridge.Stage("dig", excavate=soils[1:]))
    standing = water * max(level - 3.0, 0.0)
    area = 1.0 if geometry is None else 0.5  # of the base, 1 m wide; of one radian
    assert site.fem.reaction("base")[1] == pytest.approx(-(20e3 * 3 + standing) * area, rel=1e-9)
    total_vertical = 20e3 * 3**2 / 2 + standing * 3  # integrals over the height of the side
    pressed = water * (min(level, 3.0) * level - min(level, 3.0) ** 2 / 2)
    ratio = POISSON / (1 - POISSON)
    # Pressures that are linear in cells of h = 0.5 m miss those of a level within cells by up to gamma_w h / 4 there.
    error = 1e-4 if level >= 3 else water * 0.5**2 / 4
    assert site.fem.reaction("right")[0] == pytest.approx(ratio * (total_vertical - pressed) + pressed, abs=error)
    assert np.abs(site.fem.reaction("surface")).max() == 0  # nothing holds it


def test_a_prescribed_displacement_is_applied_by_a_stage_and_refused_before(column):
    """The top of the column is pushed down by u: strain u / H, and in layers of one stiffness the stress M u / H."""
    push = -0.012
    laws = {soil: mpm.LinearElastic(young=20e6, poisson=POISSON) for soil in SOILS["column"]}
    pushed = bridge.prescribed("surface", (None, push))
    with pytest.raises(
        mpm.InputError, match=r"supports: .*'surface'.* prescribes a displacement, expected it in a stage"
    ):
        site_of(column, laws, [*ROLLERS, pushed])
    site = site_of(column, laws)
    carried_out(site, bridge.Stage("push", fill="ground", unit_weight={"ground": 0.0}, support=pushed))
    stress, _ = there_of(site.fem.points)
    assert stress[:, 1] == pytest.approx(oedometer("ground") * push / 3, rel=1e-9)


@pytest.mark.parametrize("degree", [1, 2])
def test_smooth_stresses_and_points_on_the_border_are_those_of_the_soil_that_is_there(pit, degree):
    """A removed cell has no stress; neither averages nor points on its border take it. The walls and floor of the pit."""
    laws = elastic(SOILS["pit"])
    site = site_of(pit, laws, degree=degree)
    carried_out(site, IN_SITU, *DIG)
    direct = at_once(pit, ["ground"], laws, bridge.Load(20e3, pressure={"floor": 5e3}), degree=degree)
    border = np.array([(3.0, y) for y in (3.3, 4.6, 5.5)] + [(x, 3.0) for x in (0.4, 1.7, 2.9)])
    depth = np.array([2.7, 1.4, 0.5, 3.0, 3.0, 3.0])
    for smooth in (False, True):
        got, expected = (fem.evaluate_at(border, smooth=smooth)["stress"] for fem in (site.fem, direct))
        assert np.allclose(got, expected, rtol=0, atol=1e-9 * np.abs(expected).max())
        assert (got[:3, 1] < -0.2 * 20e3 * depth[:3]).all() and (got[3:, 0] != 0).all()
