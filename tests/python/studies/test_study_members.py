"""Studies of sites with walls and struts."""

import csv
import importlib
import json
import math
from pathlib import Path
from types import SimpleNamespace

import pytest
from mpi4py import MPI

import mpm_core as mpm

ROOT = Path(__file__).parents[3]
SITE = (ROOT / "meshes" / "braced_excavation.toml").read_text()
site_file = importlib.import_module("common.site.file")


def site_in(folder, text=SITE):
    (folder / "braced_excavation.geo").write_text((ROOT / "meshes" / "braced_excavation.geo").read_text())
    (folder / "site.toml").write_text(text)
    return folder / "site.toml"


@pytest.fixture(scope="module")
def braced(tmp_path_factory):
    folder = tmp_path_factory.mktemp("braced")
    excavation = importlib.import_module("excavation")
    options = f"--site {site_in(folder)} --cell-size 2 --output {folder / 'out'}"
    assert excavation.main(options.split()) == 0
    with open(folder / "out" / "members.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    return folder / "out", rows


def test_the_table_has_the_forces_of_each_member_after_each_stage(braced):
    folder, rows = braced
    summary = json.loads((folder / "summary.json").read_text())
    last = summary["stages"][-1]
    struts = {row["member"]: float(row["axial_force_N_per_m"]) for row in rows if row["name"] == "cut to 6 m"}
    assert struts["lower strut"] == pytest.approx(last["lower_strut_axial_force_N_per_m"], rel=1e-5)
    at_once = [float(row["axial_force_N_per_m"]) for row in rows if row["name"] == row["member"] == "upper strut"]
    assert at_once == pytest.approx([-20e3, -20e3])  # its prestress, at the end of its stage
    moments = [
        float(row["moment_N_m_per_m"]) for row in rows if row["member"] == "wall" and row["name"] == "cut to 6 m"
    ]
    assert max(moments, key=abs) == pytest.approx(last["wall_moment_N_m_per_m"], rel=1e-5)
    assert moments[0] == moments[-1] == 0.0
    # The summary has the largest shear force of a segment, which is that beside the lower strut; nodes have means of two segments.
    wall = [row for row in rows if row["member"] == "wall" and row["name"] == "cut to 6 m"]
    heights = [float(row["y_m"]) for row in wall]
    slopes = [(b - a) / (y0 - y1) for a, b, y0, y1 in zip(moments, moments[1:], heights, heights[1:])]
    shear = last["wall_shear_force_N_per_m"]
    assert shear == pytest.approx(max(slopes, key=abs), rel=1e-3)
    assert abs(shear) > max(abs(float(row["shear_force_N_per_m"])) for row in wall)
    assert (folder / "members.xdmf").exists()


def test_struts_carry_the_earth_pressure_that_the_ground_below_does_not(braced):
    """Active pressure on 6 m of wall with K_a of 33 degrees and 1 kPa, of which the ground below the pit carries a part."""
    _, rows = braced
    struts = {row["member"]: -float(row["axial_force_N_per_m"]) for row in rows if row["name"] == "cut to 6 m"}
    ka = 0.295
    active = ka * 19e3 * 6**2 / 2 - 2 * 1e3 * ka**0.5 * 6
    assert 0.6 * active < struts["upper strut"] + struts["lower strut"] < 1.5 * active


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('kind = "beam"', 'kind = "pile"', r"members.wall: kind is 'pile', expected one of 'bar', 'strut', 'beam'"),
        ("bending_stiffness = 79e6", "bending_stifness = 79e6", "members.wall: .*bending_stifness.*bending_stiffness"),
        ("fixed_end = true", "spacing = 1.0", "upper strut: .*'spacing', expected some of kind, points, axial_stiffness"),
        ("axial_stiffness = 2.9e9", "", "members.wall has no axial_stiffness, expected the beam's own"),
        ("bending_stiffness = 79e6", "", "members.wall has no bending_stiffness, expected the beam's own"),
        ('[members."lower strut"]', "[members.upper_strut]", "'upper strut' and 'upper_strut' would have the same columns"),
        ("axial_stiffness = 2.9e9", "axial_stiffness = -1.0", "members.wall: axial_stiffness is -1.0 N/m"),
        ("points = [[5.0, 20.0], [5.0, 9.0]]", "", "members.wall has no points"),
        ("points = [[5.0, 19.0], [0.0, 19.0]]", "points = [[5.0, 19.0]]", "upper strut: points is .*, expected the two ends"),
        ('install = ["wall"]', 'install = ["pile"]', r"stages\[1\]: 'pile' is not among the tables \[members.NAME\]: wall"),
        ('install = ["wall"]', "install = 3", r"stages\[1\]: install is 3, expected names"),
    ],
)  # fmt: skip
def test_a_mistake_in_a_member_is_named(tmp_path, old, new, message):
    assert old in SITE
    with pytest.raises(mpm.InputError, match=message):
        site_file.read_site(site_in(tmp_path, SITE.replace(old, new)), MPI.COMM_WORLD, 4.0)


def test_studies_that_have_all_soils_at_once_say_that_they_leave_members_out(tmp_path):
    site = site_file.read_site(site_in(tmp_path), MPI.COMM_WORLD, 4.0)
    assert "install of 'wall'" in site.left_out_at_once()


def test_a_braced_pit_has_a_factor_of_safety_and_fails_without_its_members(tmp_path):
    safety = importlib.import_module("safety")
    options = f"--site {site_in(tmp_path)} --cell-size 3 --meshes 1 --start 0.8 --output {tmp_path / 'with'}"
    assert safety.main(options.split()) == 0
    found = json.loads((tmp_path / "with" / "summary.json").read_text())
    assert found["factor_of_safety"] > 1.5
    forces = found["members_in_last_equilibrium"]
    assert forces["lower_strut_axial_force_N_per_m"] < -50e3  # it holds the wall
    with open(tmp_path / "with" / "members.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert {row["member"] for row in rows} == {"wall", "upper strut", "lower strut"}
    assert min(float(row["axial_force_N_per_m"]) for row in rows if row["member"] == "lower strut") == pytest.approx(
        forces["lower_strut_axial_force_N_per_m"], rel=1e-4
    )
    assert {"member_wall.png", "axial_forces.png"} <= {path.name for path in (tmp_path / "with").iterdir()}
    without = site_in(tmp_path, "".join(line for line in SITE.splitlines(True) if not line.startswith("install")))
    options = f"--site {without} --cell-size 3 --meshes 1 --start 0.8 --output {tmp_path / 'without'}"
    assert safety.main(options.split()) == 0
    assert json.loads((tmp_path / "without" / "summary.json").read_text())["factor_of_safety"] < 0.8


NAILED = (ROOT / "meshes" / "nailed_slope.toml").read_text()


def nailed_in(folder, text=NAILED):
    (folder / "nailed_slope.geo").write_text((ROOT / "meshes" / "nailed_slope.geo").read_text())
    (folder / "nailed.toml").write_text(text)
    return folder / "nailed.toml"


def history_of(folder):
    with open(folder / "history.csv", newline="") as file:
        return list(csv.DictReader(file))


def test_nails_of_a_site_without_stages_hold_its_slope_and_move_with_it(tmp_path):
    """The cut fails without nails; with them particles begin in equilibrium, and nails carry more as the soil weakens."""
    slope = importlib.import_module("slope")
    run = "--cell-size 1.5 --factor 1.7 --time 0.3 --frames 3 --no-pictures --no-film"
    assert slope.main(f"--site {nailed_in(tmp_path)} {run} --output {tmp_path / 'nailed'}".split()) == 0
    summary = json.loads((tmp_path / "nailed" / "summary.json").read_text())
    assert (
        summary["initial_out_of_balance_ratio"] < 0.01
    )  # the facing is at the surface, where nodes have unlike masses
    rows = history_of(tmp_path / "nailed")
    first, last = (float(rows[k]["nail_5_axial_force_N_per_m"]) for k in (0, -1))
    assert 0 < first < last <= 163e3
    assert abs(float(rows[-1]["facing_moment_N_m_per_m"])) <= 15e3 * (1 + 1e-9)
    without = nailed_in(tmp_path, NAILED[: NAILED.index("[members.facing]")])
    options = f"--site {without} --cell-size 1.5 --meshes 1 --start 0.9 --output {tmp_path / 'without'}"
    assert importlib.import_module("safety").main(options.split()) == 0
    assert json.loads((tmp_path / "without" / "summary.json").read_text())["factor_of_safety"] < 1.0


def test_a_factor_by_particles_has_the_members_of_a_site_without_stages(tmp_path, monkeypatch):
    safety, seen = importlib.import_module("safety"), []

    def found(weakened, **_):
        seen.append(weakened(1.1))
        return SimpleNamespace(value=1.2, failed_at=1.3, failed=True, reason="")

    monkeypatch.setattr(safety.bridge, "particle_safety", found)
    site = site_file.read_site(nailed_in(tmp_path), MPI.COMM_WORLD, 3.0)
    safety.site_by_particles(SimpleNamespace(start=1.0, unreduced=[], seismic_coefficient=0.0, elements="P2"), site)
    assert list(seen[0].members) == list(site.members) and len(site.members) == 6


@pytest.mark.parametrize(
    ("new", "said"),
    [
        ("prestress = 20e3", True),
        ("prestress = 20e3\ncompressive_strength = 0.0", False),  # a cable
        ("prestress = -20e3", False),
    ],
)
def test_a_strut_that_pulls_at_its_wall_is_doubted(new, said, recwarn, tmp_path):
    text = SITE.replace("tensile_strength = 0.0  # it is only pressed against the wall\nprestress = -20e3", new)
    site_file.read_site(site_in(tmp_path, text), MPI.COMM_WORLD, 2.0)
    found = [str(one.message) for one in recwarn if "by which the strut pulls" in str(one.message)]
    assert len(found) == said and all(
        "members.upper strut: prestress is 20000 N/m, a tension" in text for text in found
    )


def test_a_strut_in_soil_is_the_free_length_of_an_anchor(recwarn, tmp_path):
    line = "points = [[5.0, 19.0], [0.0, 19.0]]\naxial_stiffness = 0.7e9  # N/m\ntensile_strength = 0.0  # it is only pressed against the wall\nprestress = -20e3"
    anchor = line.replace("[0.0, 19.0]", "[12.0, 14.0]").replace(
        "tensile_strength = 0.0  # it is only pressed against the wall\nprestress = -", "prestress = "
    )
    assert line in SITE
    site_file.read_site(site_in(tmp_path, SITE.replace(line, anchor)), MPI.COMM_WORLD, 2.0)
    assert not [one for one in recwarn if "by which the strut pulls" in str(one.message)]


def test_a_member_that_no_stage_installs_is_named(tmp_path):
    text = SITE.replace('install = ["lower strut"]\n', "")
    with pytest.warns(RuntimeWarning, match="no stage installs 'lower strut', which therefore is not there"):
        site_file.read_site(site_in(tmp_path, text), MPI.COMM_WORLD, 4.0)


@pytest.mark.parametrize("strength", ["12e3", "3e3"])
def test_particles_of_an_embankment_take_its_geotextile_over(tmp_path, strength):
    """Also where the clay is so soft that a stage fails: its slide begins from there."""
    text = (ROOT / "meshes" / "embankment.toml").read_text()
    text = text.replace("shear_strength = {value = 12e3", f"shear_strength = {{value = {strength}")
    geotextile = '[members.geotextile]\nkind = "bar"\npoints = [[0, 3], [11, 3]]\naxial_stiffness = 2e6\ncompressive_strength = 0\n\n'
    text = text.replace('[[stages]]\nname = "1 m"\n', geotextile + '[[stages]]\nname = "1 m"\ninstall = "geotextile"\n')
    (tmp_path / "embankment.geo").write_text((ROOT / "meshes" / "embankment.geo").read_text())
    (tmp_path / "site.toml").write_text(text)
    embankment = importlib.import_module("embankment")
    options = f"--site {tmp_path / 'site.toml'} --cell-size 1 --time 0.2 --frames 2 --no-pictures --no-film"
    assert embankment.main([*options.split(), "--output", str(tmp_path / "out")]) == 0
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert (summary["stage_without_equilibrium_fem"] is None) == (strength == "12e3")
    assert summary["factor"] == (1.5 if strength == "12e3" else 1.0)
    with open(tmp_path / "out" / "members.csv", newline="") as file:
        last = list(csv.DictReader(file))[-1]["stage"]
        file.seek(0)
        staged = [float(row["axial_force_N_per_m"]) for row in csv.DictReader(file) if row["stage"] == last]
    started = float(history_of(tmp_path / "out")[0]["geotextile_axial_force_N_per_m"])
    if strength == "12e3":
        assert started == pytest.approx(max(staged), rel=0.05)  # the table has means of segments at the nodes
    assert started > 1e3


def test_studies_of_drawdown_and_rain_say_that_they_leave_members_out(tmp_path):
    text = (ROOT / "meshes" / "dike.toml").read_text()
    member = (
        '[members.wall]\nkind = "beam"\npoints = [[0, 4], [0, 1]]\naxial_stiffness = 3e9\nbending_stiffness = 40e6\n\n'
    )
    (tmp_path / "bank_on_ground.geo").write_text((ROOT / "meshes" / "bank_on_ground.geo").read_text())
    (tmp_path / "dike.toml").write_text(text.replace("[[stages]]", member + "[[stages]]", 1))
    read = importlib.import_module("common.slope.site").read_slope_site
    with pytest.warns(RuntimeWarning, match="the structural members 'wall' are left out here"):
        read(tmp_path / "dike.toml", MPI.COMM_WORLD, 3.0)


@pytest.mark.usefixtures("without_pictures")
def test_the_lining_of_a_shaft_has_hoop_forces(tmp_path):
    """An axisymmetric pit between a stiff cylinder, which the ground presses with about K0 times its weight: N = p r."""
    start, end = SITE.index('[members."upper strut"]'), SITE.index("[[stages]]")
    stages = SITE[end:]
    for strut in ("upper strut", "lower strut"):
        stages = stages.replace(f'[[stages]]\nname = "{strut}"\ninstall = ["{strut}"]\n\n', "")
    text = (SITE[:start] + stages).replace("cell_size = 1.0", "axisymmetric = true\ncell_size = 2.0")
    excavation = importlib.import_module("excavation")
    assert excavation.main(["--site", str(site_in(tmp_path, text)), "--output", str(tmp_path / "out")]) == 0
    with open(tmp_path / "out" / "members.csv", newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["name"] == "cut to 6 m"]
    middle = next(row for row in rows if float(row["y_m"]) == pytest.approx(16.0, abs=0.3))
    weight, radius = 19e3 * 4.0, 5.0
    active, at_rest = math.tan(math.radians(45 - 33 / 2)) ** 2, 1 - math.sin(math.radians(33))
    assert -1.2 * at_rest * weight * radius < float(middle["hoop_force_N_per_m"]) < -0.5 * active * weight * radius
    assert all(abs(float(row["hoop_moment_N_m_per_m"])) < 1.0 for row in rows)
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["stages"][-1]["wall_hoop_force_N_per_m"] < float(middle["hoop_force_N_per_m"])


@pytest.mark.usefixtures("without_pictures")
@pytest.mark.parametrize(("elements", "warns"), [("P1", True), ("P2", False)])
def test_linear_elements_of_an_excavation_in_sand_that_dilates_little_are_a_warning(elements, warns, recwarn, tmp_path):
    """The wall of a pit in sand of 32 degrees has four fifths of the moment and two thirds of the displacement in them."""
    options = f"--site {site_in(tmp_path)} --cell-size 4 --elements {elements} --output {tmp_path / 'out'}"
    importlib.import_module("excavation").main(options.split())
    said = [
        str(one.message)
        for one in recwarn
        if "are too strong for soil whose dilation angle is below" in str(one.message)
    ]
    assert bool(said) == warns
