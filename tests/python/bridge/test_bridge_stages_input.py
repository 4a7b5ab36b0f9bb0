"""Stages that cannot be carried out, and how it is said."""

import numpy as np
import pytest
from stage_cases import DIG, IN_SITU, ROLLERS, SOILS, carried_out, elastic, site_of

import fenics_bridge as bridge
import mpm_core as mpm


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (bridge.Stage("a", fill="pit 3"), "stage 'a': fill: no cell has the name 'pit 3'; the mesh has 'pit 1'"),
        (bridge.Stage("a", fill="pit 1"), "stage 'a': fill: .*pit 1.* is there already"),
        (bridge.Stage("a", excavate=["ground", "pit 1", "pit 2"]), "no soil is left"),
        (bridge.Stage("a", pressure={"wall": 1.0}), "stage 'a': pressure: no facet has the name 'wall'"),
        (bridge.Stage("a", release="floor"), "release: .*floor.* names a boundary without support"),
        (bridge.Stage("a", support=bridge.fixed("wall")), "stage 'a': support: no facet has the name 'wall'"),
        (bridge.Stage("a", unit_weight={"sand": 1.0}), "stage 'a': unit_weight: no cell has the name 'sand'"),
        (bridge.Stage("a", unit_weight={"ground": np.nan}), "unit_weight is nan for 'ground', expected a finite"),
        (bridge.Stage("a", pore_pressure=lambda x: x[:, 0] * np.nan), "pore_pressure gives values that are not finite"),
        (bridge.Stage("a", law={"ground": 5}), "stage 'a': law is 5 for 'ground', expected a constitutive law"),
    ],
)
def test_a_stage_that_asks_for_what_is_not_there_changes_nothing(pit, wrong, message):
    site = site_of(pit, elastic(SOILS["pit"]))
    carried_out(site, IN_SITU)
    before, load = site.fem.points.stress.copy(), site.fem.load
    with pytest.raises(bridge.InputError, match=message):
        carried_out(site, wrong)
    assert np.array_equal(site.fem.points.stress, before) and site.fem.load == load
    carried_out(site, DIG[0])  # and the site can go on


@pytest.mark.parametrize(
    "second, message",
    [
        (bridge.Stage("b", excavate="pit 1"), "stage 'b': excavate: the soil 'pit 1' is not there"),
        (bridge.Stage("b", excavate=["ground", "pit 1"]), "stage 'b': excavate: the soil 'pit 1' is not there"),
        (bridge.Stage("b", fill="ground"), "stage 'b': fill: the soil 'ground' is there already"),
        (bridge.Stage("b", release="wall"), "stage 'b': release: no facet has the name 'wall'"),
    ],
)
def test_a_stage_that_cannot_follow_is_named_before_the_first_is_computed(pit, second, message):
    site = site_of(pit, elastic(SOILS["pit"]))
    carried_out(site, IN_SITU)
    before, load = site.fem.points.stress.copy(), site.fem.load
    with pytest.raises(bridge.InputError, match=message):
        carried_out(site, DIG[0], second)
    assert np.array_equal(site.fem.points.stress, before) and site.fem.load == load
    with pytest.raises(bridge.InputError, match=message):  # one after the other, as they come
        list(bridge.carry_out(site, iter([DIG[0], second])))
    assert not np.array_equal(site.fem.points.stress, before)


def test_soil_without_unit_weight_is_named(pit):
    with pytest.raises(bridge.InputError, match="unit_weight: the soil 'ground' has none"):
        carried_out(site_of(pit, elastic(SOILS["pit"])), bridge.Stage("in situ", fill="ground"))


def test_a_body_that_is_loaded_already_is_refused(pit):
    site = site_of(pit, elastic(SOILS["pit"]))
    carried_out(site, IN_SITU)
    with pytest.raises(bridge.InputError, match="fem is loaded already"):
        bridge.FemSite(site.fem)


def failure(pit, laws, *stages, supports=ROLLERS):
    site = site_of(pit, laws, supports, degree=1)
    with pytest.raises(bridge.StageError) as error:
        carried_out(site, *stages)
    return str(error.value), error.value.fraction, site


def test_a_cut_that_does_not_stand_is_named_with_place_and_law(pit):
    """A vertical cut in clay, 2 m deep, fails where 4 c / gamma is far less (c = 2 kPa: 0.4 m)."""
    laws = elastic(SOILS["pit"])
    laws["ground"] = mpm.tresca(young=20e6, poisson=0.4, shear_strength=2e3)
    k0 = bridge.Stage("in situ", fill=SOILS["pit"], unit_weight=dict.fromkeys(SOILS["pit"], 20e3),
                      stress=lambda x: bridge.k0_stress(x, 6.0, 20e3, 1.0))  # fmt: skip
    message, share, site = failure(pit, laws, k0, DIG[0])
    assert "stage 2 ('dig 1') has no equilibrium beyond 0." in message and 0 < share < 0.9
    assert "soil 'ground' near (" in message and "the law MohrCoulomb" in message and "more strength" in message
    assert site.fem.load.held == pytest.approx(1 - share)


def test_a_body_that_is_not_held_is_said_so(pit):
    message, _, _ = failure(pit, elastic(SOILS["pit"]), IN_SITU, supports=[ROLLERS[0]])
    assert "Nothing holds the soil that is there against moving along y: give it supports" in message


def test_soil_without_strength_is_said_so(pit):
    sand = mpm.MohrCoulomb(young=20e6, poisson=0.3, cohesion=0.0, friction_angle=0.0)
    message, share, _ = failure(pit, dict.fromkeys(SOILS["pit"], sand), IN_SITU, DIG[0])
    assert "soil" in message and "MohrCoulomb" in message and share < 1


def test_soil_under_tension_is_said_so(column):
    """Sand hanging from its roof bears no tension."""
    sand = mpm.MohrCoulomb(young=20e6, poisson=0.3, cohesion=0.0, friction_angle=30.0)
    laws = {**elastic(SOILS["column"]), "ground": sand}
    site = site_of(column, laws, [*ROLLERS[:2], bridge.roller("surface", (0, 1))])
    with pytest.raises(bridge.StageError, match="'ground' near .* the law MohrCoulomb"):
        carried_out(site, bridge.Stage("hanging", fill="ground", unit_weight={"ground": 20e3}))
