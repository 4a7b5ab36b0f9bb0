"""What a model warns of before its first step."""

import re
import warnings

import numpy as np
import pytest
from core_cases import box, rollers

import mpm_core as mpm

SOIL = mpm.MohrCoulomb(young=1e6, poisson=0.3, cohesion=1e3, friction_angle=30.0)


def model_of(law=SOIL, density=2000.0, held=True, gravity=9.81):
    model = mpm.Model(box([2, 2]), law)
    model.seed(density=density, per_cell=3)
    if held:
        rollers(model)
    model.set_gravity((0.0, -gravity))
    return model


def said(model, **options):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        model.explicit(1e-4, dt=1e-4, energy_limit=None, **options).last()
    return [str(each.message) for each in caught if "energy" not in str(each.message)]


def test_a_sound_model_says_nothing():
    assert said(model_of()) == []


def test_a_surface_that_moves_acts_on_the_particles():
    for velocity in ((0.0, 0.0), (0.0, -0.1)):
        model = model_of(gravity=0.0)
        model.add_contact(mpm.Plane((0, 1 + 1e-3 - model.gap(mpm.Plane((0, 1), (0, -1)))), (0, -1)), velocity=velocity)
        assert any("nothing acts" in text for text in said(model)) == (velocity == (0.0, 0.0))


@pytest.mark.parametrize(
    "options, text",
    [
        ({"held": False}, "nothing holds the particles"),
        ({"density": 80 / 9.81}, "unit weight of particles is 80 N/m3"),
        ({"density": 80e6 / 9.81}, "unit weight of particles is 8e.07 N/m3"),
        ({"density": 18e3}, "unit weight of particles is 1.766e.05 N/m3"),  # a unit weight in place of the density
        ({"gravity": 0.0}, "nothing acts on the particles"),
        ({"gravity": -9.81}, "gravity acts upwards, 9.81 m/s2 along the last axis"),
        # M = E (1 - nu) / ((1 + nu) (1 - 2 nu)) = 27 Pa, under 2000 x 9.81 Pa from 1 m of soil but for the half cell at each end
        (
            {"law": mpm.LinearElastic(young=20.0, poisson=0.3)},
            "modulus is 26.92 Pa at most, .* base 1.[4-9].*e.04 Pa; moduli are in",
        ),
        (
            {"law": mpm.MohrCoulomb(young=1e6, poisson=0.3, cohesion=1e3, friction_angle=0.52)},
            "0.52 degrees; angles are in degrees, and 0.52 rad are 29.8 degrees",
        ),
    ],
)
def test_what_has_been_forgotten_or_is_of_the_wrong_size_is_said(options, text):
    (one,) = said(model_of(**options))
    assert re.search(text, one)


def test_an_angle_in_place_of_a_coefficient_of_friction_is_said():
    ground = mpm.Plane((0.0, -0.1), (0.0, 1.0))
    with pytest.warns(RuntimeWarning, match="friction is 30, .* the tangent .* for an angle of 30 degrees give 0.5774"):
        model_of().add_contact(ground, friction=30.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        model_of().add_contact(ground, friction=1.0)


def test_xi_in_place_of_the_coefficient_of_drag_is_said():
    line = mpm.Polyline([(-9.0, -1.0), (0.0, -1.0), (9.0, -1.0)])
    for drag in (500.0, [0.0, 500.0]):
        with pytest.warns(RuntimeWarning, match="drag is 500, .* C = g / xi .* for his xi of 500 m/s2 give 0.01962"):
            model_of().add_contact(line, drag=drag)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        model_of().add_contact(line, drag=9.81 / 100)


def test_an_angle_in_place_of_the_friction_of_a_collision_is_said():
    model = model_of()
    ground = model.add_contact(mpm.Plane((0.0, -3.0), (0, 1)))
    ball = model.add_contact(mpm.Disc((0.0, -1.5), 0.5), body=mpm.FreeBody(mass=100.0))
    with pytest.warns(RuntimeWarning, match="friction is 30, .* for an angle of 30 degrees give 0.5774"):
        ball.add_collision(ground, friction=30.0)


@pytest.mark.parametrize("density", [1.0, 9810.0])
def test_a_density_of_water_in_other_units_is_said(density):
    with pytest.warns(RuntimeWarning, match=f"the density of water is {density:g} kg/m3, expected some 1000"):
        model_of().add_water(porosity=0.4, conductivity=1e-5, density=density)


@pytest.mark.parametrize("modulus, conductivity, words", [
    (2.2, 1e-5, ["modulus is 2.2 Pa, less than that of air; moduli are in Pa, 2.2e9 for water"]),  # GPa
    (2.2e9, 8.64, ["conductivity is 8.64 m/s, more than that of gravel; .* 8.64 m/day are 0.0001 m/s"]),
    (1e5, 1.0, []), (np.inf, 1e-12, []),
])  # fmt: skip
def test_a_modulus_of_water_and_a_conductivity_in_other_units_are_said(modulus, conductivity, words):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        model_of().add_water(porosity=0.4, conductivity=conductivity, modulus=modulus)
    assert len(caught) == len(words) and all(one.filename == __file__ for one in caught)
    for one, text in zip(caught, words):
        assert re.match(text, str(one.message))


@pytest.mark.parametrize("across", [0.0, 1.0])
@pytest.mark.parametrize("water", ["held", "standing", "pressure"])
def test_levels_of_water_under_tilted_gravity_are_warned_of(across, water):
    model = model_of()
    model.set_gravity((across, -9.81))
    model.add_water(porosity=0.4, conductivity=1e-3, modulus=1e7, drained_surface=water == "standing")
    if water == "held":
        model.hold_pore_pressure(4, level=1.5)
    elif water == "standing":
        model.stand_water(1.5)
    else:
        model.hold_pore_pressure(4, 0.0)
    found = [text for text in said(model) if "gravity has a component of 1 m/s2 across the last axis" in text]
    assert len(found) == (across > 0 and water != "pressure")


def test_soil_in_a_centrifuge_has_a_usual_density():
    assert said(model_of(gravity=490.5, law=mpm.LinearElastic(young=100e6, poisson=0.3))) == []
    (one,) = said(model_of(gravity=490.5, density=18e3, law=mpm.LinearElastic(young=100e6, poisson=0.3)))
    assert "unit weight of particles is 1.8e+05 N/m3, density times 10 m/s2" in one


@pytest.mark.parametrize(
    "law, reason",
    [
        (mpm.MohrCoulomb(young=1e6, poisson=0.3, cohesion=1e3, friction_angle=0.0), "friction angle 0"),
        (mpm.LinearElastic(young=1e6, poisson=0.49), "Poisson's ratio 0.49"),
        (mpm.Undrained(SOIL, water_modulus=1e8, porosity=0.4), "undrained"),
        (mpm.Hencky(mpm.LinearElastic(young=1e6, poisson=0.48)), "Poisson's ratio 0.48"),
    ],
)
def test_laws_that_lock_are_named_unless_strains_are_averaged(law, reason):
    (one,) = said(model_of(law))
    assert reason in one and "nmd=True" in one
    assert said(model_of(law), nmd=True) == []


@pytest.mark.parametrize("dilation_angle, nmd", [(0.0, False), (0.0, True), (30.0, False)])
def test_soil_that_keeps_its_volume_as_it_fails_is_named_unless_strains_are_averaged(dilation_angle, nmd):
    # A weight that is many times what the cohesion carries, on a smooth base without walls.
    soil = mpm.MohrCoulomb(young=1e6, poisson=0.3, cohesion=6e3, friction_angle=30.0, dilation_angle=dilation_angle)
    model = mpm.Model(box([12, 4], lengths=(3.0, 1.0), diagonals="alternating", body=((1.0, 0.0), (2.0, 1.0))), soil)
    model.seed(density=5000.0, per_cell=3, cell_tag=1)
    model.roller(3, (0, 1))
    model.set_gravity((0.0, -9.81))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        reports = list(model.explicit(0.3, every=0.1, nmd=nmd, integration=mpm.Integration.MIXED, energy_limit=None))
    assert reports[-1].plastic_work > 0.3 * reports[-1].energy_scale
    said = [str(each.message) for each in caught if "the soil fails" in str(each.message)]
    assert len(said) == (dilation_angle == 0 and not nmd)
    assert not any("integration" in text for text in said)  # it is mixed already


def shaken(hold, motion=((0.0, 1.0, 2.0), (0.0, 1e-3, 0.0)), let_in="shake", direction=(1, 0), **options):
    """Warnings of a model whose base, the facets of tag 3, lets a wave in and has further boundary conditions."""
    model = mpm.Model(box([2, 2]), mpm.LinearElastic(young=1e6, poisson=0.3))
    model.seed(density=2000.0, per_cell=3)
    hold(model)
    if let_in == "drive":
        model.drive(3, mpm.Motion(*motion), direction)
    else:
        model.absorb(3)
    if let_in == "shake":
        model.shake(mpm.Motion(*motion), direction)
    return said(model, **options)


@pytest.mark.parametrize("let_in", ["shake", "drive"])
def test_a_wave_that_boundary_conditions_keep_out_is_warned_of(let_in):
    for hold in (
        lambda model: model.fix(3),
        lambda model: model.roller(3, (2, 0)),
        lambda model: model.prescribe(3, (0.0, None)),
    ):
        assert any("the wave does not enter through the side 3" in text for text in shaken(hold, let_in=let_in))
    oblique = {"direction": (1, 1), "let_in": let_in}
    in_part = shaken(lambda model: rollers(model, axes=(0, 1)), **oblique)
    assert not any("does not enter" in text for text in in_part)
    assert any("does not enter" in text for text in shaken(lambda model: model.fix(3), **oblique))
    for hold in (lambda model: model.roller(3, (0, 1)), lambda model: model.fix(1), lambda model: None):
        assert shaken(hold, let_in=let_in) == []


def test_a_side_that_is_held_and_absorbs_is_warned_of():
    assert any("the side 3 absorbs nothing" in text for text in shaken(lambda model: model.fix(3), let_in=None))
    assert not any("absorbs nothing" in text for text in shaken(lambda model: model.roller(3, (1, 0)), let_in=None))


def test_a_side_that_is_held_against_its_free_field_is_warned_of():
    text = (
        "the side 1 does not move with the free field beside it: boundary conditions of the same facets hold it against"
    )

    def beside(normal, direction):
        def hold(model):
            model.absorb(3)
            model.absorb((1, 2), free_field=True)
            model.roller(1, normal)

        return any(text in each for each in shaken(hold, let_in="shake", direction=direction))

    assert beside((1, 0), (1, 0)) and beside((1, 0), (1, 1)) and beside((0, 1), (0, 1))
    assert not beside((0, 1), (1, 0)) and not beside((1, 0), (0, 1))


def test_a_far_field_that_boundary_conditions_hold_is_warned_of():
    def warned(hold):
        model = model_of(mpm.LinearElastic(young=1e6, poisson=0.3), held=False)
        rollers(model, [0])
        hold(model)
        base = np.flatnonzero(model.mesh.points[:, 1] == 0)
        model.attach_far_field(base, 1e6 * np.eye(2 * len(base)))
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            model.implicit(1.0, dt=1.0, quasi_static=True).last()
        return any("hold 3 of the 3 nodes of the far field" in str(each.message) for each in caught)

    assert warned(lambda model: model.fix(3))
    assert warned(lambda model: model.roller(3, (0, 1)) or model.roller(3, (1, 0)))
    assert not warned(lambda model: None) and not warned(lambda model: model.roller(3, (1, 0)))


@pytest.mark.parametrize("stressed", [True, False])
@pytest.mark.parametrize("carried", ["side", "side and roller", "springs"])
def test_weight_that_sides_did_not_hold_as_they_began_to_absorb_is_warned_of(stressed, carried):
    model = model_of(mpm.LinearElastic(young=1e6, poisson=0.3), held=False)
    x = model.mesh.points[model.mesh.cells].mean(axis=1)[model.particles.cell]
    vertical = (
        -2000.0 * 9.81 * (1 - (np.floor(2 * x[:, 1]) + 0.5) / 2) * stressed
    )  # of the middle of each row of squares
    model.particles.set("stress", np.column_stack([0 * vertical, vertical, 0 * vertical, 0 * vertical]))
    model.absorb(3, thickness=100.0 if carried == "springs" else np.inf)
    if carried == "side and roller":
        model.roller(2, (0, 1))
    warned = any("nothing carries the soil: the sides that absorb held" in text for text in said(model))
    assert warned == (not stressed and carried == "side")


def test_a_motion_that_is_cut_off_is_warned_of():
    free = lambda model: None  # noqa: E731
    assert any("ends at 100% of its" in text for text in shaken(free, motion=((0.0, 1.0), (0.0, 1e-3))))
    assert any("begins at 6% of its" in text for text in shaken(free, motion=((0.0, 1.0, 2.0), (-6e-5, 1e-3, 0.0))))
    assert shaken(free, motion=((0.0, 1.0, 2.0), (4e-5, 1e-3, -4e-5))) == []


@pytest.mark.parametrize("let_in", ["shake", "drive", None])
def test_local_damping_where_a_motion_enters_is_warned_of(let_in):
    free = lambda model: model.roller(1, (0, 1)) or model.set_gravity((0.0, -9.81))  # noqa: E731
    found = [
        text for text in shaken(free, let_in=let_in, damping=0.05) if "damping is 0.05 where a motion enters" in text
    ]
    assert len(found) == (let_in is not None) and all("rayleigh=" in text for text in found)
    assert shaken(free, let_in=let_in, rayleigh=mpm.Rayleigh(mass=1.0)) == []


WRAPPERS = [lambda law: law, mpm.Hencky, lambda law: mpm.Undrained(law, water_modulus=1e7, porosity=0.5)]


def stresses_after_the_first_step(law, pressure, state, value):
    """(warnings of stresses outside of the yield surface, fraction of the total stress that is left) of soil without strain."""
    model = model_of(law, gravity=0.0)
    model.particles.set("stress", np.tile([-pressure] * 3 + [0.0], (len(model.particles), 1)))
    model.set_state(state, np.full(len(model.particles), value))
    words = "100.0% of the particles of"
    return [text for text in said(model) if words in text], model.particles.stress[:, 1].mean() / -pressure


@pytest.mark.parametrize("wrapped", WRAPPERS)
@pytest.mark.parametrize("pressure, known, warned", [(99e3, 1.0, False), (300e3, 3.0, False), (300e3, 1.0, True)])
def test_clay_with_stresses_beyond_its_preconsolidation_is_warned_of(wrapped, pressure, known, warned):
    # A preconsolidation pressure of 100 kPa, or of `known` times that: an isotropic pressure beyond it cannot be carried.
    clay = mpm.CamClay(
        compression=0.2, swelling=0.04, critical_slope=1.0, poisson=0.25, preconsolidation=100e3, void_ratio=1.0
    )
    found, kept = stresses_after_the_first_step(wrapped(clay), pressure, "log_preconsolidation", np.log(known))
    assert bool(found) == warned == (kept < 0.99)
    assert all("particles of CamClay lie beyond their preconsolidation pressure" in text for text in found)


@pytest.mark.parametrize("wrapped", WRAPPERS)
@pytest.mark.parametrize("pressure, known, warned", [(250e3, 1.0, False), (750e3, 3.0, False), (750e3, 1.0, True)])
def test_sand_with_stresses_outside_of_its_yield_surface_is_warned_of(wrapped, pressure, known, warned):
    # An image pressure of 100 kPa, or of `known` times that: an isotropic pressure beyond 2.718 times it cannot be carried.
    sand = mpm.NorSand(
        critical_void_ratio=0.9, critical_compression=0.03, critical_slope=1.25, dilatancy=4.0, hardening=100.0, rigidity=200.0,
        poisson=0.2, void_ratio=0.8, image_pressure=100e3,
    )  # fmt: skip
    found, kept = stresses_after_the_first_step(wrapped(sand), pressure, "log_image_pressure", np.log(known))
    assert bool(found) == warned == (kept < 0.99)
    assert all("particles of NorSand lie outside of the yield surface" in text for text in found)
