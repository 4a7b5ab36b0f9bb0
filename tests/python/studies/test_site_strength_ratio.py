"""Undrained strengths of the soils of a site that follow the vertical effective stress, of soils and of laws that stages bring."""

import json

import numpy as np
import pytest
import study_main
from common.consolidation.site import read_consolidation_site
from common.results import ROOT
from common.site.file import read_site
from common.slope.site import read_slope_site
from common.stages.runs import carry_out
from mpi4py import MPI
from test_site_k0 import STAGES, site_in, wet

import fenics_bridge as bridge
import mpm_core as mpm

COMM = MPI.COMM_WORLD
SITE = """
mesh = "ground.geo"
[soils.clay]
unit_weight = 18e3
k0 = 0.7
material = "tresca"
young = 5e6
poisson = 0.4
shear_strength = 2e3
strength_ratio = 0.25
[soils.sand]
unit_weight = 20e3
k0 = 0.5
young = 20e6
poisson = 0.3
cohesion = 5e3
friction_angle = 30.0
[soils.fill]
unit_weight = 19e3
material = "elastic"
young = 20e6
poisson = 0.3
"""
LAW = """
[laws.undrained]
material = "viscoplastic"
young = 5e6
poisson = 0.45
viscosity = 1e3
cohesion = 1e3
strength_ratio = 0.2
overconsolidation = 3
strength_exponent = 0.7
"""
UNDRAINED = """
[[stages]]
name = "undrained"
day = 20.0
law = {sand = "undrained"}
"""
TAILINGS = ROOT / "meshes" / "tailings.toml"


def strength_of(fem, low, high):
    """Heights [m] and strengths [Pa] of the points between two heights."""
    y = fem.points.coordinates()[:, 1]
    rows = (y > low) & (y < high)
    return y[rows], fem.points.parameters["cohesion"][rows]


def test_soils_have_it_from_the_beginning_and_laws_from_their_stage_on(tmp_path):
    """1 m of sand on the clay, and then 1 m of fill on both."""
    site = read_site(site_in(tmp_path, SITE + LAW + STAGES + UNDRAINED), COMM)
    assert site.soils_with_strength_ratio == ["clay", "sand"]
    run = carry_out(site, 2, tmp_path, COMM)
    y, clay = strength_of(run.site.fem, 0.0, 2.0)
    assert clay == pytest.approx(0.25 * (20e3 + 18e3 * (2 - y)), rel=1e-6)
    y, sand = strength_of(run.site.fem, 2.0, 3.0)
    assert sand == pytest.approx(0.2 * 3**0.7 * (19e3 + 20e3 * (3 - y)), rel=1e-2)


def test_softening_soil_has_it_as_its_peak(tmp_path, recwarn):
    """With the sensitivity of the table, 5, and no friction, peak or residual."""
    law = LAW.replace(
        'material = "viscoplastic"', 'material = "softening"\nsoftening_strain = 0.1\nreference_length = 0.5'
    )
    law = law.replace("viscosity = 1e3", "residual_cohesion = 200.0")
    site = read_site(site_in(tmp_path, SITE + law + STAGES + UNDRAINED), COMM)
    assert not [one for one in recwarn if "leaves out" in str(one.message) or "no effect" in str(one.message)]
    soft = site.stages[-1].law["sand"]
    assert (
        soft.residual_friction_angle == soft.peak.friction_angle == 0
        and soft.peak.cohesion / soft.residual_cohesion == 5
    )
    run = carry_out(site, 2, tmp_path, COMM)
    y, sand = strength_of(run.site.fem, 2.0, 3.0)
    assert sand == pytest.approx(0.2 * 3**0.7 * (19e3 + 20e3 * (3 - y)), rel=1e-2)


def test_strengths_are_at_least_those_of_the_table_which_may_grow_with_depth(tmp_path):
    """Half of 30 kPa below the surface, and 10 kPa more with each metre."""
    text = SITE.replace(
        "shear_strength = 2e3", "shear_strength = {value = 3e3, per_metre = 6e3, top = 2.0}\nclasses = 40"
    )
    text = text.replace("\nclasses = 40", "").replace('mesh = "ground.geo"', 'mesh = "ground.geo"\nclasses = 40')
    site = read_site(site_in(tmp_path, text + STAGES), COMM)
    run = carry_out(site, 2, tmp_path, COMM)
    y, clay = strength_of(run.site.fem, 0.0, 2.0)
    assert clay == pytest.approx(np.maximum(0.25 * (20e3 + 18e3 * (2 - y)), 3e3 + 6e3 * (2 - y)), abs=6e3)
    assert (clay > 0.25 * (20e3 + 18e3 * (2 - y)) + 1e3).any() and (clay >= 0.25 * (20e3 + 18e3 * (2 - y)) - 1.0).all()


def test_the_factor_of_a_dam_that_liquefies_is_about_that_of_an_infinite_slope(tmp_path):
    """Of the tailings dam, whose stage of liquefaction has no equilibrium; and a ratio twice as large makes it almost twice as large, since the shell has a part in it."""
    found = {}
    for ratio in (0.1, 0.2):
        (tmp_path / "site.toml").write_text(
            f'extends = "{TAILINGS}"\ncell_size = 4.0\n[laws.liquefied]\nstrength_ratio = {ratio}\nshear_strength = 100.0\n'
        )
        options = ["--site", tmp_path / "site.toml", "--meshes", 1, "--output", tmp_path / "out", "--overwrite"]
        assert study_main.main("safety", options) == 0
        found[ratio] = json.loads((tmp_path / "out" / "summary.json").read_text())["factor_of_safety"]
        assert (tmp_path / "out" / "undrained_strength.png").stat().st_size > 10_000
    # An infinite slope of 1:4 has ratio / (sin cos) where it is dry, and the fraction of its buoyant weight of that under water up to its surface.
    infinite = 0.1 * (1 + 0.25**2) / 0.25
    assert (18 - 9.81) / 18 * infinite < found[0.1] < infinite
    assert 1.5 < found[0.2] / found[0.1] < 2.0


def test_particles_follow_a_dam_that_liquefies(tmp_path, capfd):
    """From the strengths that the finite elements have; the particles take them with them."""
    (tmp_path / "site.toml").write_text(f'extends = "{TAILINGS}"\ncell_size = 4.0\n')
    options = ["--factor", 1, "--time", 3, "--frames", 3, "--no-film", "--output", tmp_path / "out"]
    with pytest.warns(
        RuntimeWarning, match="begin from the finite elements, which have the strengths by the vertical stress"
    ):
        assert study_main.main("embankment", ["--site", tmp_path / "site.toml", *options]) == 0
    found = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert "'liquefaction'" in found["stage_without_equilibrium_fem"]
    assert 2.0 < found["largest_displacement_of_slide_m"] < 0.5 * 9.81 * 3**2


def test_all_soils_at_once_begin_with_it(tmp_path):
    import safety

    site = read_site(site_in(tmp_path, SITE), COMM)
    fem = site.finite_elements(2)
    safety.site_load(site, fem)
    y, clay = strength_of(fem, 0.0, 2.0)
    assert clay == pytest.approx(
        0.25 * (39e3 + 18e3 * (2 - y)), rel=0.02
    )  # where K0 changes, it bends the layers a little


@pytest.mark.parametrize(
    "old, new, message",
    [
        ("= 0.25", "= 25", "soils.clay: strength_ratio is 25, expected a number above 0 and up to 2, such as 0.22"),
        ("= 0.25", "= 0.25\nstrength_exponent = -1", "soils.clay: strength_exponent is -1, expected a number from 0 to 1"),
        ("= 0.25", "= 0.25\noverconsolidation = 0.5", "soils.clay: overconsolidation is 0.5, expected a ratio from 1 to 100"),
        ('material = "tresca"', "friction_angle = 20.0", "soils.clay has strength_ratio and friction_angle = 20.0, expected one"),
        ("k0 = 0.7\n", "", r"soils.clay has strength_ratio but no k0, .* in a table \[laws.NAME\]"),
        ("shear_strength = 2e3", "shear_strength = {value = 2e3, variation = 0.3, lengths = [10.0, 1.0]}",
         "soils.clay has strength_ratio, and its strength is a random field, expected one of them"),
        ("overconsolidation = 3", "overconsolidation = 300", "laws.undrained: overconsolidation is 300, expected a ratio"),
        ("strength_exponent = 0.7", "strenght_exponent = 0.7", "laws.undrained: unknown key 'strenght_exponent'; did you mean strength_exp"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_named(tmp_path, old, new, message):
    text = SITE + LAW + STAGES + UNDRAINED
    assert old in text
    with pytest.raises(mpm.InputError, match=message):
        read_site(site_in(tmp_path, text.replace(old, new, 1)), COMM)


def test_another_law_has_no_effect_of_it_and_says_so(tmp_path):
    text = SITE.replace('material = "elastic"', 'strength_ratio = 0.3\noverconsolidation = 2\nmaterial = "elastic"')
    with pytest.warns(
        RuntimeWarning, match="soils.fill: strength_ratio and overconsolidation have no effect with the law elastic"
    ):
        site = read_site(site_in(tmp_path, text + STAGES), COMM)
    assert site.soils_with_strength_ratio == ["clay"]


def test_no_friction_angle_is_missed_of_a_law_that_has_it(tmp_path, recwarn):
    read_site(site_in(tmp_path, SITE + LAW + STAGES + UNDRAINED), COMM)
    assert not [one for one in recwarn if "leaves out" in str(one.message) or "no effect" in str(one.message)]


def test_studies_without_these_stresses_refuse_it(tmp_path):
    refused = (
        "soils.clay has strength_ratio, expected none: the studies safety, excavation, embankment and slope have it"
    )
    with pytest.raises(mpm.InputError, match=refused):
        read_consolidation_site(site_in(tmp_path, wet(SITE + STAGES)), COMM)
    drained = (
        wet(SITE).replace('material = "elastic"\n', "cohesion = 9e3\n").replace("reservoir = 3.0", "reservoir = 4.0")
    )
    with pytest.raises(mpm.InputError, match=refused):
        read_slope_site(site_in(tmp_path, drained), COMM)
    with pytest.raises(mpm.InputError, match=refused):
        study_main.main("collapse", ["--site", site_in(tmp_path, SITE), "--output", tmp_path / "out"])
    with pytest.raises(
        mpm.InputError, match="--particles: .*site.toml has strength_ratio, but these particles begin without"
    ):
        study_main.main("safety", ["--site", site_in(tmp_path, SITE), "--particles", "--output", tmp_path / "out"])


@pytest.mark.parametrize(
    "material, residual",
    [("softening", "residual_cohesion = 50.0\nsoftening_strain = 0.1\nreference_length = 0.5"), ("tresca", "")],
)
def test_soil_beside_a_wall_has_a_fraction_of_the_strength_of_the_ratio(tmp_path, material, residual):
    """Half of 0.3 gamma' z at the points of cells beside the wall; laws other than softening ones divide what their points have themselves."""
    soils = "".join(
        f'[soils.{soil}]\nmaterial = "{material}"\nyoung = 8e6\npoisson = 0.45\nfriction_angle = 0\ndilation_angle = 0\n'
        f"cohesion = 100.0\nstrength_ratio = 0.3\nk0 = 1.0\nunit_weight = 18e3\n{residual}\n"
        for soil in ("ground", '"cut 1"', '"cut 2"', '"cut 3"')
    )
    braced = ROOT / "meshes" / "braced_excavation.toml"
    path = tmp_path / "site.toml"
    wall = "[members.wall]\ninterface_strength = 0.5\n"
    stage = '[[stages]]\nname = "in situ"\nfill = ["ground", "cut 1", "cut 2", "cut 3"]\n[[stages]]\nname = "wall"\ninstall = ["wall"]\n'
    path.write_text(f'extends = "{braced}"\ncell_size = 2.0\n{soils}{wall}{stage}')
    site = read_site(path, COMM)
    assert (
        site.soils_with_strength_ratio == ["cut 1", "cut 2", "cut 3", "ground"]
        or len(site.soils_with_strength_ratio) == 4
    )
    staged = bridge.FemSite(site.finite_elements(2))
    for one in site.stages:
        staged.carry_out(one)
    fem = staged.fem
    laws, tags = staged.fem.law_by_tag(), np.array(fem.soils)[np.repeat(fem.points.material, fem.points.per_cell)]
    top = site.domain.geometry.x[:, 1].max()
    full = np.maximum(0.3 * 18e3 * (top - fem.points.coordinates()[:, 1]), 100.0)
    divided = np.array([getattr(laws[tag], "strength_factor", 1.0) for tag in tags])
    share = fem.points.parameters["cohesion"] / divided / full
    beside = np.abs(share - 0.5) < 1e-3
    assert 0.01 < beside.mean() < 0.3
    assert share[~beside] == pytest.approx(1.0, rel=1e-3)


def test_a_preconsolidation_stress_that_grows_with_depth_gives_the_strength(tmp_path):
    history = "vertical_preconsolidation = {value = 60e3, per_metre = 5e3, top = 4.0}"
    text = SITE.replace("strength_ratio = 0.25", f"strength_ratio = 0.25\nstrength_exponent = 0.5\n{history}")
    site = read_site(site_in(tmp_path, text), COMM)
    ratio = site.strength_ratio["clay"]
    assert ratio(np.array([20e3, 20e3]), np.array([[0.0, 4.0], [0.0, 2.0]])) == pytest.approx(
        [0.25 * np.sqrt(20e3 * 60e3), 0.25 * np.sqrt(20e3 * 70e3)]
    )
    assert len(site.laws) == 3  # one for each soil: the law itself is the same at all heights
    with pytest.raises(mpm.InputError, match="soils.clay: vertical_preconsolidation is {.*}, expected a number or"):
        read_site(site_in(tmp_path, text.replace("top = 4.0", "bottom = 4.0")), COMM)
    with pytest.warns(RuntimeWarning, match="vertical_preconsolidation is 60 Pa"):
        read_site(site_in(tmp_path, text.replace(history, "vertical_preconsolidation = 60.0")), COMM)


def test_a_law_of_a_stage_may_have_a_preconsolidation_stress_that_grows_with_depth(tmp_path):
    history = "vertical_preconsolidation = {value = 60e3, per_metre = 5e3, top = 4.0}\n"
    site = read_site(
        site_in(tmp_path, SITE + LAW.replace("overconsolidation = 3\n", history) + STAGES + UNDRAINED), COMM
    )
    ratio = site.stages[-1].strength_ratio["sand"]
    assert ratio(30e3, np.array([[0.0, 0.0]])) == pytest.approx(0.2 * 30e3**0.3 * 80e3**0.7)
