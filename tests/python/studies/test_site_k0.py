"""K0 of the soils of a site: which studies begin with it, and what they say where they do not."""

import json
from pathlib import Path

import numpy as np
import pytest
import study_main  # noqa: F401
from common.consolidation.site import read_consolidation_site
from common.site.file import read_site
from common.site.k0 import begin_at_rest
from common.slope.site import read_slope_site
from common.stages.runs import carry_out
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water

GROUND = """
SetFactory("OpenCASCADE");
DefineConstant[ cell_size = 1.0 ];
Rectangle(1) = {0, 0, 0, 4, 2}; Rectangle(2) = {0, 2, 0, 4, 1}; Rectangle(3) = {0, 3, 0, 4, 1};
Coherence;
Physical Surface("clay") = {1}; Physical Surface("sand") = {2}; Physical Surface("fill") = {3};
e = 0.01;
Physical Curve("base") = {Curve In BoundingBox{-e, -e, -e, 4 + e, e, e}};
Physical Curve("left") = {Curve In BoundingBox{-e, -e, -e, e, 4 + e, e}};
Physical Curve("right") = {Curve In BoundingBox{4 - e, -e, -e, 4 + e, 4 + e, e}};
Physical Curve("ground") = {Curve In BoundingBox{-e, 3 - e, -e, 4 + e, 3 + e, e}};
Physical Curve("top") = {Curve In BoundingBox{-e, 4 - e, -e, 4 + e, 4 + e, e}};
Mesh.MeshSizeMax = cell_size;
"""
SITE = """
mesh = "ground.geo"
[soils.clay]
unit_weight = 18e3
k0 = 1.3
material = "tresca"
young = 5e6
poisson = 0.4
shear_strength = 40e3
[soils.sand]
unit_weight = 20e3
k0 = 0.5
material = "mohr-coulomb"
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
STAGES = """
[[stages]]
name = "in situ"
fill = ["clay", "sand"]
[[stages]]
name = "fill"
day = 10.0
fill = "fill"
"""
WATER = """
[points]
middle = [2.0, 3.0]
[boundaries.ground]
reservoir = 3.0
"""
HOLDS_WATER = {
    f"[soils.{soil}]": f"[soils.{soil}]\nconductivity = 1e-8\nporosity = 0.4" for soil in ("clay", "sand", "fill")
}


def site_in(folder, text):
    (folder / "ground.geo").write_text(GROUND)
    (folder / "site.toml").write_text(text)
    return folder / "site.toml"


def wet(text):
    for old, new in HOLDS_WATER.items():
        text = text.replace(old, new)
    return text + WATER


def at_rest_by_hand(x, sand, clay):
    """Vertical stress and K0 times it of clay and sand with the unit weights, below level ground at 3 m; rows of those points alone."""
    y = x[:, 1]
    vertical = -np.where(y > 2, sand * (3 - y), sand + clay * (2 - y))
    return vertical, np.where(y > 2, 0.5, 1.3) * vertical


def assert_at_rest(stress, x, sand=20e3, clay=18e3):
    vertical, horizontal = at_rest_by_hand(x, sand, clay)
    for axis, expected in ((1, vertical), (0, horizontal), (2, horizontal)):
        np.testing.assert_allclose(stress[:, axis], expected, rtol=0, atol=1e-7 * 60e3)


def test_the_soils_of_the_first_stage_come_with_their_k0(tmp_path):
    site = read_site(site_in(tmp_path, SITE + STAGES), MPI.COMM_WORLD)
    assert site.stages[0].k0 == {"clay": 1.3, "sand": 0.5} and site.stages[1].k0 == {}
    staged = bridge.FemSite(site.finite_elements(2))
    staged.carry_out(site.stages[0])
    there = np.repeat(staged.fem.points.material >= 0, staged.fem.points.per_cell)
    assert_at_rest(staged.fem.points.stress[there], staged.fem.points.coordinates()[there])


def test_soils_that_no_stage_places_come_with_it_before_the_first_day(tmp_path):
    text = SITE + STAGES.replace('name = "in situ"\nfill = ["clay", "sand"]\n[[stages]]\n', "")
    site = read_site(site_in(tmp_path, text), MPI.COMM_WORLD)
    assert [stage.k0 for stage in site.stages] == [{"clay": 1.3, "sand": 0.5}, {}]


def test_without_stages_all_soils_come_at_once_and_members_with_them(tmp_path):
    """The fill without K0 settles under its own weight as it comes, and the wall with it; its weight is in the K0 of the soils below."""
    wall = '[members.wall]\nkind = "beam"\npoints = [[2.0, 4.0], [2.0, 1.0]]\naxial_stiffness = 1e3\nbending_stiffness = 1.0\n'
    site = read_site(site_in(tmp_path, SITE + wall), MPI.COMM_WORLD)
    fem = site.finite_elements(2)
    begin_at_rest(site, fem)
    assert list(fem.members) == ["wall"] and fem.reaction("base")[1] == pytest.approx(-4 * (36e3 + 20e3 + 19e3))
    clay = fem.points.coordinates()[:, 1] < 2
    k0 = fem.points.stress[clay, 0] / fem.points.stress[clay, 1]
    np.testing.assert_allclose(k0, 1.3, rtol=1e-3)  # the soft wall bears next to nothing


def test_a_variant_changes_k0(tmp_path):
    site_in(tmp_path, SITE + STAGES)
    (tmp_path / "other.toml").write_text('extends = "site.toml"\n[soils.sand]\nk0 = 0.8\n')
    site = read_site(tmp_path / "other.toml", MPI.COMM_WORLD)
    assert site.stages[0].k0 == {"clay": 1.3, "sand": 0.8}


@pytest.mark.parametrize(
    "old, new, message",
    [
        ("k0 = 1.3", "k0 = 0", "site.toml: soils.clay: k0 is 0, expected a number above 0"),
        ("k0 = 1.3", 'k0 = "1 - sin(phi)"', r"site.toml: soils.clay: k0 is '1 - sin\(phi\)', expected a number above 0"),
        ("k0 = 1.3", "k0 = 130", "site.toml: soils.clay: k0 is 130, expected a number above 0 and up to 10, such as 0.5"),
        ("k0 = 1.3", "k0 = true", "site.toml: soils.clay: k0 is True, expected a number above 0"),
        ("[soils.fill]", "[soils.fill]\nk0 = 0.6",
         "site.toml: soils.fill: k0 is 0.6, but the stage 'fill' places this soil, expected none: only soil that is there from the beginning"),
        ("k0 = 1.3", "K0 = 1.3", "unknown key 'K0'"),
    ],
)  # fmt: skip
@pytest.mark.parametrize("read", [read_site, read_consolidation_site])
def test_a_wrong_k0_is_named(tmp_path, read, old, new, message):
    path = site_in(tmp_path, wet(SITE + STAGES).replace(old, new, 1))
    with pytest.raises(mpm.InputError, match=message):
        read(path, MPI.COMM_WORLD)


def test_consolidation_begins_with_it(tmp_path):
    """Water at rest up to the ground: effective stresses are those of buoyant soil, before the fill comes."""
    site = read_consolidation_site(site_in(tmp_path, wet(SITE + STAGES)), MPI.COMM_WORLD)
    model = site.at_rest(water.Element.TAYLOR_HOOD)
    there = np.repeat(model.points.material >= 0, model.points.per_cell)
    assert there.any() and not there.all()
    assert_at_rest(model.points.stress[there], model.points.coordinates()[there], 20e3 - 9810.0, 18e3 - 9810.0)


def test_studies_whose_stresses_begin_at_zero_say_that_they_leave_it_out(tmp_path):
    path = site_in(tmp_path, wet(SITE).replace('material = "elastic"\n', "cohesion = 9e3\n").replace("= 3.0", "= 4.0"))
    with pytest.warns(
        RuntimeWarning, match="site.toml: k0 of 'clay', 'sand' is left out, since stresses begin at zero here"
    ):
        read_slope_site(path, MPI.COMM_WORLD)
    with pytest.warns(RuntimeWarning, match="site.toml: k0 of 'clay', 'sand' is left out"):
        study_main.main("collapse", ["--site", path, "--meshes", 1, "--output", tmp_path / "out"])


def test_k0_beyond_the_strength_is_said_with_its_stage(tmp_path):
    site = read_site(site_in(tmp_path, SITE.replace("k0 = 0.5", "k0 = 6.0") + STAGES), MPI.COMM_WORLD)
    with pytest.warns(
        RuntimeWarning, match=r"stage 'in situ': k0: the stresses are beyond the strength of the soil at \d"
    ):
        carry_out(site, 2, tmp_path, MPI.COMM_WORLD)


def test_the_factor_of_safety_begins_from_it(tmp_path):
    """Its stages are carried out, where they are placed at once without K0."""
    import safety

    path = site_in(tmp_path, SITE + STAGES)
    for text, carried in ((SITE + STAGES, True), (SITE.replace("k0", "# k0") + STAGES, False), (SITE, True)):
        path.write_text(text)
        site = read_site(path, MPI.COMM_WORLD)
        fem = site.finite_elements(2)
        load = safety.site_load(site, fem)
        assert (load == fem.load) == carried == bool(np.abs(fem.points.stress).max() > 0)


@pytest.mark.parametrize("study, options", [("slope", ["--factor", 1.0, "--time", 0.01, "--frames", 1]),
                                            ("embankment", ["--factor", 1.0, "--time", 0.01, "--frames", 1])])  # fmt: skip
def test_slides_begin_from_it(tmp_path, study, options):
    """Particles begin in equilibrium, with the stresses of the finite elements."""
    path = site_in(tmp_path, SITE + (STAGES.replace("day = 10.0\n", "") if study == "embankment" else ""))
    folder = tmp_path / "out"
    assert study_main.main(study, ["--site", path, "--no-pictures", "--no-film", "--output", folder, *options]) == 0
    found = json.loads((folder / "summary.json").read_text())
    found = found.get("results", found)
    key = {"slope": "initial_out_of_balance_ratio", "embankment": "stress_difference_of_particles_to_fem"}[study]
    assert found[key] < 1e-6


def test_wall_and_strut_of_the_braced_pit_bear_more_with_a_larger_k0(tmp_path):
    """As of overconsolidated ground, in which the wall bulges by more."""
    base, found = Path(__file__).parents[3] / "meshes" / "braced_excavation.toml", []
    for k0 in (0.5, 1.0):
        soils = "".join(f'[soils."{soil}"]\nk0 = {k0}\n' for soil in ("ground", "cut 1", "cut 2", "cut 3"))
        (tmp_path / "site.toml").write_text(f'extends = "{base}"\ncell_size = 2.0\n{soils}')
        run = carry_out(read_site(tmp_path / "site.toml", MPI.COMM_WORLD), 2, tmp_path, MPI.COMM_WORLD)
        assert run.rows[0]["largest_displacement_m"] < 1e-12
        found.append((run.rows[-1]["sideways_m"], -run.rows[-1]["lower_strut_axial_force_N_per_m"]))
    assert all(more > 1.5 * less for less, more in zip(*found))
