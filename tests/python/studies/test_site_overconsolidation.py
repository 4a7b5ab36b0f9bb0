"""Overconsolidation of the soils of a site: which studies begin with it, what is said of its K0, of moduli and of laws without memory."""

import json
import re

import numpy as np
import pytest
import study_main
from common.consolidation.site import read_consolidation_site
from common.site.file import read_site
from common.site.hardening_doubts import k0_doubt, secant_at_half, secant_doubt
from common.site.laws import idle_doubt, law_at, left_out_doubt
from common.slope.site import read_slope_site
from common.stages.runs import carry_out
from hardening_soil_cases import hyperbola, preloaded, strength
from mpi4py import MPI
from test_site_hardening_soil import MESHES
from test_site_k0 import STAGES, site_in, wet

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water

COMM = MPI.COMM_WORLD
HARDENING = """
material = "hardening-soil"
secant_modulus = 20e6
oedometer_modulus = 20e6
unloading_modulus = 60e6
cohesion = 1e3
friction_angle = 30.0
"""
SITE = f"""
mesh = "ground.geo"
[soils.clay]
unit_weight = 18e3
k0 = 0.9
overconsolidation = 4
{HARDENING}
[soils.sand]
unit_weight = 20e3
k0 = 0.5
{HARDENING}
[soils.fill]
unit_weight = 19e3
material = "elastic"
young = 20e6
poisson = 0.3
"""


def law(**changes):
    parameters = {
        "secant_modulus": 20e6,
        "oedometer_modulus": 20e6,
        "unloading_modulus": 60e6,
        "cohesion": 1e3,
        "friction_angle": 30.0,
    }
    return mpm.HardeningSoil(**(parameters | changes))


def cap_of(stress):
    """The state log_preconsolidation [-] of level ground that has been normally consolidated to a vertical stress [Pa], (n,)."""
    rows = np.zeros((len(stress), 4))
    rows[:, :3] = -0.5 * stress[:, None]
    rows[:, 1] = -stress
    return mpm.hardening_soil_state(law(), rows)["log_preconsolidation"]


def assert_hardened(points, ratio=4.0, sand=20e3, clay=18e3):
    """Clay below 2 m and 1 m of sand; points of soil that is there."""
    there = np.repeat(points.material >= 0, points.per_cell)
    y, caps = points.coordinates()[there, 1], points.state[there, 2]
    depth = 2 - y[y < 2]
    assert np.allclose(caps[y < 2], cap_of(ratio * (sand + clay * depth)), rtol=1e-3)
    assert (caps[(y > 2) & (y < 3)] < cap_of(np.array([1.5 * sand]))).all()


def test_the_soils_of_the_first_stage_come_with_it(tmp_path):
    site = read_site(site_in(tmp_path, SITE + STAGES), COMM)
    assert [stage.overconsolidation for stage in site.stages] == [{"clay": 4}, {}]
    staged = bridge.FemSite(site.finite_elements(2))
    staged.carry_out(site.stages[0])
    assert_hardened(staged.fem.points)


def test_consolidation_begins_with_it(tmp_path):
    """Water at rest up to the ground: effective stresses are those of buoyant soil."""
    site = read_consolidation_site(site_in(tmp_path, wet(SITE + STAGES)), COMM)
    model = site.at_rest(water.Element.TAYLOR_HOOD)
    assert_hardened(model.points, sand=20e3 - 9810.0, clay=18e3 - 9810.0)


def test_the_factor_of_safety_begins_with_it_without_stages_too(tmp_path):
    import safety

    text = SITE.replace("k0", "# k0").replace("overconsolidation = 4", "k0 = 0.5\noverconsolidation = 4")
    site = read_site(site_in(tmp_path, text), COMM)
    fem = site.finite_elements(2)
    safety.site_load(site, fem)
    clay = fem.points.coordinates()[:, 1] < 2
    vertical = -fem.points.stress[clay, 1]
    assert np.allclose(fem.points.state[clay, 2], cap_of(4 * vertical), rtol=1e-3)


def test_a_fill_settles_overconsolidated_ground_by_less(tmp_path):
    """By its oedometer modulus of unloading under 19 kPa: of effective lateral stresses that grow by a quarter of that."""
    found = {}
    for ratio in (1, 4):
        text = SITE.replace("overconsolidation = 4", f"overconsolidation = {ratio}").replace("k0 = 0.9", "k0 = 0.6")
        site = read_site(site_in(tmp_path, text + STAGES), COMM)
        staged = bridge.FemSite(site.finite_elements(2))
        moved = []
        for _ in bridge.carry_out(staged, site.stages):
            moved.append(staged.fem.evaluate_at([(2.0, 2.0)])["displacement"][0, 1])  # of the top of the clay
        found[ratio] = moved[0] - moved[1]
    vertical = 20e3 + 18e3 * np.linspace(0.0, 2.0, 201)
    lateral = 0.6 * vertical[:, None] + 0.25 * np.linspace(0, 19e3, 101)
    attraction = 1e3 / np.tan(np.radians(30.0))
    modulus = 60e6 / 0.9 * np.sqrt((lateral + attraction) / (100e3 + attraction))  # (1 + nu)(1 - 2 nu) / (1 - nu) = 0.9
    assert found[4] == pytest.approx(2.0 * 19e3 * np.mean(1 / modulus), rel=0.01)
    assert found[1] > 2 * found[4]


def test_particles_of_a_slide_take_it_over(tmp_path):
    """In the study slope, in which all soils are there at once."""
    from common.site.slides import _carried

    path = site_in(tmp_path, SITE)
    site = read_site(path, COMM)
    fem = _carried(site, path, averaged=False)
    model = site.particles(3)
    bridge.initialise(model, fem, count_displacement=False, nmd=False)
    p = model.particles
    clay = p.position[:, 1] < 2
    assert np.allclose(model.state("log_preconsolidation")[clay], cap_of(-4 * p.stress[clay, 1]), rtol=1e-3)
    options = [
        "--no-pictures",
        "--no-film",
        "--factor",
        1.0,
        "--time",
        0.01,
        "--frames",
        1,
        "--output",
        tmp_path / "out",
    ]
    assert study_main.main("slope", ["--site", path, *options]) == 0
    found = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert found.get("results", found)["initial_out_of_balance_ratio"] < 1e-6


@pytest.mark.parametrize(
    "old, new, message",
    [
        ("= 4", "= 0.5", "site.toml: soils.clay: overconsolidation is 0.5, expected a ratio from 1 to 100, such as 2"),
        ("= 4", "= 200e3", "site.toml: soils.clay: overconsolidation is 200000.0, expected a ratio from 1 to 100"),
        ("= 4", '= "2"', "site.toml: soils.clay: overconsolidation is '2', expected a ratio from 1 to 100"),
        ("= 4", "= true", "site.toml: soils.clay: overconsolidation is True, expected a ratio from 1 to 100"),
        ('fill = ["clay", "sand"]', 'fill = ["sand"]\n[[stages]]\nname = "late"\nfill = "clay"',
         "soils.clay: overconsolidation is 4, but the stage 'late' places this soil, expected none: only soil that is there from the beginning"),
        ("overconsolidation", "over_consolidation", "unknown key 'over_consolidation'; did you mean overconsolidation"),
    ],
)  # fmt: skip
@pytest.mark.parametrize("read", [read_site, read_consolidation_site])
def test_a_wrong_ratio_is_named(tmp_path, read, old, new, message):
    text = (wet(SITE + STAGES) if read is read_consolidation_site else SITE + STAGES).replace("k0 = 0.9\n", "")
    if "late" in new and read is read_consolidation_site:
        new = new.replace('name = "late"', 'name = "late"\nday = 1.0')
    with pytest.raises(mpm.InputError, match=message):
        read(site_in(tmp_path, text.replace(old, new, 1)), COMM)


def test_a_law_without_memory_has_no_effect_of_it_and_says_so(tmp_path):
    text = SITE.replace('material = "elastic"', 'overconsolidation = 2\nmaterial = "elastic"')
    with pytest.warns(
        RuntimeWarning, match="site.toml: soils.fill: overconsolidation has no effect with the law elastic"
    ):
        site = read_site(site_in(tmp_path, text + STAGES), COMM)
    assert site.overconsolidation == {"clay": 4}


def test_a_variant_of_another_law_leaves_it_out(tmp_path, recwarn):
    site_in(tmp_path, SITE + STAGES)
    (tmp_path / "other.toml").write_text(
        'extends = "site.toml"\n[soils.clay]\nmaterial = "tresca"\nyoung = 5e6\npoisson = 0.4\nshear_strength = 40e3\n'
    )
    assert read_site(tmp_path / "other.toml", COMM).overconsolidation == {}
    assert not [one for one in recwarn if "overconsolidation" in str(one.message)]


def test_a_stage_with_another_law_is_said_to_forget_it(tmp_path):
    text = SITE + f"[laws.later]{HARDENING}" + STAGES + '[[stages]]\nname = "soft"\nlaw = {clay = "later"}\n'
    with pytest.warns(
        RuntimeWarning,
        match="site.toml: a stage gives 'clay' another law, which does not know of its overconsolidation",
    ):
        read_site(site_in(tmp_path, text), COMM)


def test_studies_whose_stresses_begin_at_zero_say_that_they_leave_it_out(tmp_path):
    text = wet(SITE).replace('material = "elastic"\n', "cohesion = 9e3\n").replace("reservoir = 3.0", "reservoir = 4.0")
    with pytest.warns(
        RuntimeWarning, match="k0 of 'clay', 'sand' and overconsolidation of 'clay' are left out, since stresses"
    ):
        read_slope_site(site_in(tmp_path, text), COMM)


def test_its_k0_is_that_of_mayne_and_kulhawy_where_none_is_given(tmp_path, recwarn):
    """0.5 * 4^0.5 = 1 for 30 degrees."""
    with pytest.warns(RuntimeWarning, match=re.escape("soils.clay: overconsolidation is 4 without k0")) as said:
        read_site(site_in(tmp_path, (SITE + STAGES).replace("k0 = 0.9\n", "")), COMM)
    text = next(str(one.message) for one in said if "without k0" in str(one.message))
    assert "K0 = 0.5;" in text and "give k0 = 1," in text
    assert k0_doubt(law(), 1.0, "clay") == "" and k0_doubt(mpm.LinearElastic(young=1e6, poisson=0.3), 4.0, "clay") == ""
    assert "K0 = 0.6;" in k0_doubt(mpm.Undrained(law(normal_k0=0.6), porosity=0.4), 4.0, "clay")


def test_the_secant_modulus_of_a_test_is_that_of_the_law():
    """That of the law's shear hardening alone is the parameter; the cap makes it smaller, the more the softer it is."""
    one = law(oedometer_modulus=10e6)
    point, half = preloaded(one, 100e3), strength(one, 100e3) / 2
    for number in range(1, 41):
        point.step([None] * 3 + [0.0] * 3, stress=[-100e3 - half * number / 40, -100e3, -100e3, 0.0, 0.0, 0.0])
    assert half / -point.strain[0] == pytest.approx(20e6, rel=0.01)
    assert hyperbola(one, half, 100e3) == pytest.approx(half / 20e6)
    found = [secant_at_half(law(oedometer_modulus=modulus)) for modulus in (6e6, 10e6, 20e6)]
    assert found == sorted(found) and found[-1] < 20e6


def test_moduli_that_make_soil_softer_than_its_secant_modulus_are_doubted(tmp_path):
    soft = law(secant_modulus=5e6, oedometer_modulus=2.5e6, unloading_modulus=15e6)
    text = secant_doubt(soft, "soils.clay")
    found = float(re.search(r"gives (\S+) Pa at half", text)[1])
    assert found == pytest.approx(secant_at_half(soft), rel=0.01) and 0.5 * 5e6 < found < 2 / 3 * 5e6
    assert "soils.clay: secant_modulus is 5e+06 Pa" in text and "oedometer_modulus is 2.5e+06 Pa" in text
    assert secant_doubt(law(), "sand") == "" and secant_doubt(mpm.LinearElastic(young=1e6, poisson=0.3), "clay") == ""
    path = site_in(tmp_path, SITE.replace("oedometer_modulus = 20e6", "oedometer_modulus = 8e6", 1) + STAGES)
    with pytest.warns(RuntimeWarning, match="soils.clay: secant_modulus is 2e[+]07 Pa, but a drained triaxial test"):
        read_site(path, COMM)
    options = ["--material", "hardening-soil", "--oedometer-modulus", 12e6, "--steps", 10, "--pressure", 100e3]
    with pytest.warns(RuntimeWarning, match="--material hardening-soil: secant_modulus is 3e[+]07 Pa, but a drained"):
        study_main.main("element_test", [*options, "--output", tmp_path / "out"])


def test_ground_behind_a_wall_settles_by_less_and_presses_less_on_its_strut_where_it_is_overconsolidated(tmp_path):
    """It is sheared as the wall gives way, which is reloading then; the floor rises alike, since the soil below it is unloaded."""
    found = {}
    for ratio in (1, 5):
        soils = "".join(
            f'[soils."{soil}"]\noverconsolidation = {ratio}\n' for soil in ("ground", "cut 1", "cut 2", "cut 3")
        )
        (tmp_path / "site.toml").write_text(f'extends = "{MESHES}/hardening_excavation.toml"\ncell_size = 2.0\n{soils}')
        run = carry_out(read_site(tmp_path / "site.toml", COMM), 2, tmp_path, COMM)
        assert run.rows[0]["largest_displacement_m"] < 1e-9 and run.stopped is None
        last = run.rows[-1]
        found[ratio] = last["settlement_m"], -last["lower_strut_axial_force_N_per_m"], last["heave_m"]
    assert found[5][0] < 0.6 * found[1][0] and found[5][1] < 0.97 * found[1][1]
    assert found[5][2] == pytest.approx(found[1][2], rel=0.02)


def test_cam_clay_has_its_overconsolidation_in_place_of_a_preconsolidation_pressure(tmp_path):
    clay = {"material": "cam-clay", "compression_slope": 0.2, "swelling_slope": 0.04, "critical_slope": 1.0, "void_ratio": 1.0,
            "poisson": 0.2, "attraction": 1e3, "overconsolidation": 1.5}  # fmt: skip
    assert not idle_doubt(clay, "soils.clay")
    assert not left_out_doubt(clay, "soils.clay")
    assert "preconsolidation has no effect" in idle_doubt(clay | {"preconsolidation": 50e3}, "soils.clay")
    assert "preconsolidation = 20000 Pa" in left_out_doubt(
        {key: value for key, value in clay.items() if key != "overconsolidation"}, "soils.clay"
    )
    assert "reference_time has no effect" in idle_doubt(clay | {"reference_time": 3600.0}, "soils.clay")
    assert not idle_doubt(clay | {"reference_time": 3600.0, "creep": 0.01}, "soils.clay")


def test_creep_of_cam_clay_that_no_soil_has_is_doubtful_and_messages_have_the_keys_of_the_site():
    clay = {
        "material": "cam-clay",
        "compression_slope": 0.25,
        "swelling_slope": 0.03,
        "critical_slope": 1.0,
        "void_ratio": 1.5,
    }
    with pytest.raises(
        mpm.InputError, match="compression_slope = 0.25, .* above swelling_slope .*; swelling_slope is 0.3"
    ):
        law_at(clay | {"swelling_slope": 0.3}, None, "soils.clay")
