"""The study liquefaction: a flow slide of sand that does not drain as it moves, and where its front is."""

import importlib
import json

import numpy as np
import pytest

import fenics_bridge as bridge
import mpm_core as mpm

study = importlib.import_module("liquefaction")
COARSE = ["--cell-size", "0.5", "--time", "2.5", "--frames", "5", "--no-pictures"]


def test_the_front_is_beyond_all_but_a_hundredth_of_the_soil():
    x = np.random.default_rng(1).permutation(np.linspace(0.0, 10.0, 100_001))
    assert study.front(x, np.ones_like(x)) == pytest.approx(9.9, abs=1e-3)
    assert study.front(x, np.where(x > 5, 1e-9, 1.0)) == pytest.approx(4.95, abs=1e-3)  # by volume


def slid(folder, *options):
    assert study.main([*COARSE, "--output", str(folder), *options]) == 0
    return json.loads((folder / "summary.json").read_text())


def test_fine_sand_flows_without_losing_water_or_gaining_volume_and_farther_than_coarse_sand(tmp_path):
    fine = slid(tmp_path / "fine")
    coarse = slid(tmp_path / "coarse", "--conductivity", "1e-3", "--air-entry", "0")
    assert fine["water_out_m2"] < 1e-3 * 33 and abs(fine["volume_gain"]) < 2e-3
    assert fine["crest_settlement_m"] > 0.4 and fine["runout_m"] > 0.05
    assert fine["crest_settlement_m"] > 1.3 * coarse["crest_settlement_m"]
    held = slid(tmp_path / "held", "--pressure-ratio", "0", "--time", "1")
    assert abs(held["crest_settlement_m"]) < 0.01 and abs(held["runout_m"]) < 0.01


def test_the_ground_keeps_the_fraction_of_its_effective_stress_that_pore_pressures_leave():
    # Almost level ground whose pore pressures rise by 0.7 of the effective vertical stress keeps 0.3 of it, and half of this to its
    # sides, below its strength (K = 0.5 > (1 - sin 33) / (1 + sin 33) = 0.29): it does not liquefy, and its weight is still carried.
    a = study.parse(["--cell-size", "0.5", "--pressure-ratio", "0.7", "--angle", "2", "--runout-length", "2"])
    model = study.build(a)

    def over_vertical(model):
        p = model.particles
        depth = study.depth(a, p.position)
        buoyant = (study.density(a) - study.WATER) * study.GRAVITY * depth
        excess = p.pore_pressure - study.WATER * study.GRAVITY * depth
        return [np.mean((values / buoyant)[depth > 1.0]) for values in (-p.stress[:, 1], -p.stress[:, 0], excess)]

    assert over_vertical(model) == pytest.approx([0.3, 0.15, 0.7], abs=0.005)
    model.explicit(0.02, nmd=True).last()
    assert over_vertical(model)[:2] == pytest.approx([0.3, 0.15], abs=0.02)


def test_gravel_that_drains_and_carries_its_weight_rests(tmp_path):
    # A slope of 12 degrees with seepage along it has a factor of safety of 1.45 and more: (1 - gamma_w / gamma) tan 33 / tan 12
    result = slid(
        tmp_path,
        "--pressure-ratio",
        "0",
        "--conductivity",
        "0.1",
        "--air-entry",
        "0",
        "--time",
        "1.5",
        "--cell-size",
        "0.4",
    )
    assert abs(result["runout_m"]) < 1e-3 and abs(result["crest_settlement_m"]) < 1e-3
    assert result["water_out_m2"] > 0.05


@pytest.mark.parametrize(
    "options",
    [
        ["--cell-size", "0.5", "--time", "3"],
        ["--cell-size", "0.5", "--material", "nor-sand", "--pressure-ratio", "0.5", "--time", "3"],
    ],
    ids=["Mohr-Coulomb", "NorSand"],
)
def test_soil_that_hardly_drains_runs_out_as_far_as_the_law_of_undrained_soil_lets_it(options):
    """Hardly any water flows through silt in a few seconds: soil and water with velocities of their own, and a law of undrained soil
    that has the same skeleton and the same water, start from the same stresses and run out alike. After 4 s the front of NorSand is
    thinner than a cell, where water leaves it, and loose sand that has lost water is strong."""
    a = study.parse([*options, "--conductivity", "1e-7"])
    model = study.build(a)
    skeleton = model.laws[0]
    undrained = mpm.Model(model.mesh, mpm.Undrained(skeleton, water_modulus=a.water_modulus, porosity=a.porosity))
    wet, whole = model.particles, undrained.particles
    undrained.seed_points(wet.position, wet.volume, density=study.density(a))
    for tag in (bridge.LEFT, bridge.RIGHT):
        undrained.roller(tag, (1, 0))
    undrained.fix(bridge.BASE)
    undrained.set_gravity((0.0, -study.GRAVITY))
    same = whole.id  # in the order in which they were given
    whole.set("stress", wet.stress[same] - wet.pore_pressure[same][:, None] * np.array([1.0, 1.0, 1.0, 0.0]))
    undrained.set_state("excess_pore_pressure", wet.pore_pressure[same])
    for number, name in enumerate(skeleton.state_names):
        undrained.set_state(name, wet.state[same, number])
    runouts = []
    for m in (model, undrained):
        start = study.front(m.particles.position[:, 0], m.particles.volume)
        m.explicit(a.time, pic=a.pic, nmd=True, integration=mpm.Integration.MIXED).last()
        runouts.append(study.front(m.particles.position[:, 0], m.particles.volume) - start)
    assert runouts[0] == pytest.approx(runouts[1], rel=0.1) and runouts[1] > 2.5


def test_loose_sand_flows_where_dense_sand_rests(tmp_path):
    """Pore pressures that take half of the effective stresses leave twice the shear stress over them, tan 12 / (1 - 0.5) = 0.43, below
    the friction of a layer at the critical state in plane strain, M / (sqrt(3) g) = 0.57: only sand that contracts loses the rest of
    its strength. Under the pore pressures of the start loose sand rests as well, since it starts in equilibrium; on cells of half a
    metre noise would set it off.
    """
    nor_sand = ["--material", "nor-sand", "--pressure-ratio", "0.5", "--time", "2.6"]
    loose = slid(tmp_path / "loose", *nor_sand)
    assert loose["runout_m"] > 1.0 and loose["crest_settlement_m"] > 0.4
    dense = slid(tmp_path / "dense", *nor_sand, "--state-parameter", "-0.05")
    assert abs(dense["runout_m"]) < 0.01 and abs(dense["crest_settlement_m"]) < 0.01
    at_rest = slid(tmp_path / "at_rest", *nor_sand, "--pressure-ratio", "0", "--cell-size", "0.4", "--time", "1.5")
    assert abs(at_rest["runout_m"]) < 1e-3 and abs(at_rest["crest_settlement_m"]) < 1e-3


def test_loose_sand_starts_in_equilibrium_with_its_state_parameter():
    """The void ratio is that of the critical state at the mean effective stress at rest plus the state parameter, and equilibrium
    changes the volume by little."""
    a = study.parse(["--material", "nor-sand", "--pressure-ratio", "0", "--cell-size", "0.5"])
    model = study.build(a)
    p, law = model.particles, model.laws[0]
    pressure = law.attraction - p.stress[:, :3].mean(axis=1)
    critical = law.critical_void_ratio - law.critical_compression * np.log(pressure / 1e3)
    specific_volume = (1 + law.void_ratio) * np.exp(p.state[:, law.state_names.index("log_specific_volume")])
    assert specific_volume - 1 - critical == pytest.approx(a.state_parameter, abs=1e-9)
    area = a.height * (a.crest + 0.5 * a.height / np.tan(np.radians(a.angle)))
    assert p.volume.sum() == pytest.approx(area, rel=1e-3)
    assert model.report().unbalanced_ratio < 1e-6


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (
            ["--material", "nor-sand", "--cohesion", "3"],
            "--cohesion is given, expected --material mohr-coulomb with it",
        ),
        (["--state-parameter", "0.1"], "--state-parameter is given, expected --material nor-sand with it"),
        (
            ["--material", "nor-sand", "--angle", "31.3"],
            "--angle is 31.3, expected less than that of --critical-slope, 31.1",
        ),
    ],
)  # sin phi = 3 * 1.25 / (6 + 1.25)
def test_options_of_the_other_law_are_refused(options, words, capsys):
    with pytest.raises(SystemExit):
        study.parse(options)
    assert words in " ".join(capsys.readouterr().err.split())


def test_a_slope_that_does_not_stand_before_it_liquefies_is_named(tmp_path):
    # Seepage along an infinite slope: gamma'/gamma tan(phi) / tan(angle) = 0.5 tan(30) / tan(25) = 0.6
    with pytest.raises(mpm.InputError, match="--angle is 25 degrees, at which the saturated slope does not stand"):
        slid(tmp_path, "--angle", "25", "--friction-angle", "30", "--height", "2", "--runout-length", "10")
