"""The study consolidation with structural members that stages install and remove."""

import csv
import json

import numpy as np
import pytest
from mpi4py import MPI

from mpm_core import InputError

STIFFNESS, PRESTRESS, HEIGHT, OEDOMETER = 1e6, -800.0, 2.0, 4.8e6
GEO = """
SetFactory("OpenCASCADE");
Rectangle(1) = {0, 0, 0, 0.4, 2};
Physical Surface("clay") = {1};
Physical Curve("base") = {1}; Physical Curve("right") = {2}; Physical Curve("top") = {3}; Physical Curve("left") = {4};
Mesh.MeshSizeMax = 0.2;
"""
SITE = f"""mesh = "layer.geo"
[soils.clay]
unit_weight = 18e3
conductivity = 1e-9
material = "elastic"
young = 4e6
poisson = 0.25
[boundaries.top]
reservoir = 2.0
[pressures]
top = [[0.0, 0.0], [10.0, 20e3]]
[points]
middle = [0.2, 2.0]
[members.bar]
kind = "bar"
points = [[0.2, 0.0], [0.2, 2.0]]
axial_stiffness = {STIFFNESS}
[members.prop]
kind = "strut"
points = [[0.2, 2.0], [0.2, 3.0]]
axial_stiffness = {STIFFNESS}
prestress = {PRESTRESS}
fixed_end = true
"""
STAGES = """
[[stages]]
day = 20.0
install = ["bar", "prop"]
[[stages]]
day = 100.0
duration = 10.0
remove = "prop"
install = "prop"
name = "stressed anew"
[[stages]]
day = 200.0
remove = "bar"
"""


def site_in(folder, stages):
    (folder / "layer.geo").write_text(GEO)
    (folder / "layer.toml").write_text(SITE + stages)
    return folder / "layer.toml"


def read(path):
    from common.consolidation.site import read_consolidation_site

    return read_consolidation_site(path, MPI.COMM_SELF)


def rows_of(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


@pytest.fixture(scope="module")
def consolidated(tmp_path_factory):
    import consolidation

    folder = tmp_path_factory.mktemp("members")
    arguments = ["--site", site_in(folder, STAGES), "--days", 300, "--first-step", 2, "--growth", 1.5, "--no-film",
                 "--output", folder / "out"]  # fmt: skip
    assert consolidation.main([str(word) for word in arguments]) == 0
    return folder / "out", rows_of(folder / "out" / "history.csv")


def at_day(rows, day, column):
    return next(float(row[column]) for row in rows if np.isclose(float(row["time_days"]), day))


def test_members_are_in_the_history_from_their_installation_to_their_removal(consolidated):
    _, rows = consolidated
    for column, start, end in (("bar_axial_force_N_per_m", 20, 200), ("prop_axial_force_N_per_m", 20, np.inf)):
        there = [start < float(row["time_days"]) <= end + 1e-6 for row in rows]
        assert [np.isfinite(float(row[column])) for row in rows] == there


def test_a_bar_follows_the_settlement_since_it_was_installed(consolidated):
    """The mean axial force is the stiffness times the settlement over the height of the bar, whatever the pore pressures."""
    folder, history = consolidated
    rows = [row for row in rows_of(folder / "members.csv") if row["member"] == "bar"]
    days = sorted({float(row["time_days"]) for row in rows})
    assert days == pytest.approx([110.0, 200.0])  # at the ends of the stages
    for day in days:
        values = np.array([float(row["axial_force_N_per_m"]) for row in rows if float(row["time_days"]) == day])
        mean = (values[1:-1].sum() + (values[0] + values[-1]) / 2) / (len(values) - 1)
        settled = at_day(history, day, "settlement_middle_m") - at_day(history, 20, "settlement_middle_m")
        assert settled > 1e-3
        assert mean == pytest.approx(-STIFFNESS * settled / HEIGHT, rel=1e-4)


def test_a_prop_has_its_prestress_when_it_is_stressed_and_follows_the_ground(consolidated):
    """Between two times its force changes by its stiffness times the settlement of its foot over its length of 1 m."""
    _, rows = consolidated
    force = lambda day: at_day(rows, day, "prop_axial_force_N_per_m")
    settled = lambda day: at_day(rows, day, "settlement_middle_m")
    first = min(float(row["time_days"]) for row in rows if float(row["time_days"]) > 20 + 1e-6)
    assert force(first) == pytest.approx(PRESTRESS)
    assert force(100) == pytest.approx(PRESTRESS + STIFFNESS * (settled(100) - settled(first)), rel=1e-6)
    assert abs(force(100) - PRESTRESS) > 100.0
    anew = [row for row in rows if 100 + 1e-6 < float(row["time_days"]) < 110 + 1e-6]
    assert len(anew) > 1
    assert all(float(row["prop_axial_force_N_per_m"]) == pytest.approx(PRESTRESS) for row in anew)
    assert force(300) == pytest.approx(PRESTRESS + STIFFNESS * (settled(300) - settled(110)), rel=1e-6)


def test_the_summary_and_pictures_have_the_largest_forces(consolidated):
    folder, rows = consolidated
    summary = json.loads((folder / "summary.json").read_text())
    forces = [float(row["bar_axial_force_N_per_m"]) for row in rows]
    assert summary["largest_bar_axial_force_N_per_m"] == pytest.approx(np.nanmin(forces))
    assert (folder / "axial_forces.png").exists() and (folder / "members.xdmf").exists()
    assert not (folder / "moments.png").exists()


@pytest.mark.parametrize(
    ("stages", "there"),
    [
        ("", [["bar", "prop"]]),
        ("[[stages]]\nfill = 'clay'\ninstall = 'bar'", [["bar"]]),
        ("[[stages]]\nfill = 'clay'\ninstall = 'bar'\n[[stages]]\nday = 1\nremove = 'bar'\ninstall = 'prop'", [["bar"], ["prop"]]),
        ("[[stages]]\nday = 0.0\ninstall = ['bar', 'prop']", [[], ["bar", "prop"]]),
    ],
)  # fmt: skip
@pytest.mark.filterwarnings("ignore:.*no stage installs")
def test_members_are_there_from_the_stage_that_installs_them(stages, there, tmp_path):
    site = read(site_in(tmp_path, stages))
    assert [sorted(stage.members) for stage in site.stages] == there


@pytest.mark.filterwarnings("ignore:.*no stage installs")
def test_members_of_the_beginning_are_in_equilibrium_with_the_ground(tmp_path):
    from fenics_bridge import water

    model = read(site_in(tmp_path, "[[stages]]\nfill = 'clay'\ninstall = 'bar'")).at_rest(water.Element.STABILISED)
    before = model.member_forces("bar").axial_force
    # Clay, 0.4 m wide, and bar share the buoyant weight, which comes while the bar is there, by their stiffness.
    share = STIFFNESS / (OEDOMETER + STIFFNESS / 0.4)
    assert before.mean() == pytest.approx(-share * (18e3 - 9810.0) * HEIGHT / 2, rel=0.02)
    model.load = model.load_at(0.0)
    assert model.advance(86400.0).converged
    assert np.abs(model.member_forces("bar").axial_force - before).max() < 1e-8 * np.abs(before).max()


@pytest.mark.parametrize(
    ("stages", "words"),
    [
        (
            "[[stages]]\nday = 1\ninstall = 'pile'",
            r"stages\[0\]: 'pile' is not among the tables \[members.NAME\]: bar, prop",
        ),
        (
            "[[stages]]\nday = 1\nremove = 'bar'",
            r"stages\[0\]: remove names the member 'bar', which is not there before",
        ),
        (
            "[[stages]]\nday = 1\ninstall = 'bar'\n[[stages]]\nday = 2\ninstall = 'bar'",
            r"stages\[1\]: install names the member 'bar', which is there before this stage",
        ),
        ("[[stages]]\nday = 1\ninstall = 3", "install is 3, expected names of members"),
        ("[[stages]]\nday = 1", r"stages\[0\] has neither fill nor excavate, .*or members to install or to remove"),
    ],
)
@pytest.mark.filterwarnings("ignore:.*no stage installs")
def test_wrong_members_of_stages_are_named(stages, words, tmp_path):
    with pytest.raises(InputError, match=words):
        read(site_in(tmp_path, stages))


@pytest.mark.filterwarnings("ignore:.*no stage installs")
def test_a_member_outside_of_the_soil_is_named_before_the_first_step(tmp_path):
    from fenics_bridge import water

    path = site_in(tmp_path, "[[stages]]\nday = 50\ninstall = 'bar'\nname = 'late'")
    path.write_text(path.read_text().replace("[[0.2, 0.0], [0.2, 2.0]]", "[[0.2, 0.0], [0.2, 2.5]]"))
    with pytest.raises(InputError, match=r"stage 'late': the member 'bar': the point \(0.2, 2.\d+\) m is in no soil"):
        read(path).at_rest(water.Element.STABILISED)


@pytest.mark.filterwarnings("ignore:.*no stage installs")
def test_particles_have_no_members(tmp_path):
    from fenics_bridge import water

    site = read(site_in(tmp_path, "[[stages]]\nday = 50\ninstall = 'bar'"))
    fem = site.at_rest(water.Element.STABILISED)
    with pytest.raises(InputError, match="particles: there is the member 'bar', expected none"):
        site.particles(fem, 3)
