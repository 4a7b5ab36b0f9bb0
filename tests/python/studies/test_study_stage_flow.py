"""Steady flow in the stages of a site: around walls, through the soils that are there, under the conditions at their surface."""

import json
import warnings
from pathlib import Path

import numpy as np
import pytest
from common.site.file import read_site
from common.site.flow_doubts import warn_of_sealed_ground
from common.stages.flow import StageFlow, upward_exits, warn_of_heave
from common.stages.plots import stage_picture
from mpi4py import MPI
from study_main import main

import fenics_bridge as bridge
import mpm_core as mpm

MESHES = Path(__file__).parents[3] / "meshes"
TEXT = (MESHES / "dewatered_excavation.toml").read_text().replace("cell_size = 1.0", "cell_size = 3.0")
GAMMA = 9810.0


def site_in(folder, text=TEXT):
    (folder / "dewatered_excavation.geo").write_text((MESHES / "dewatered_excavation.geo").read_text())
    (folder / "site.toml").write_text(text)
    return folder / "site.toml"


def pressures(site, points):
    """Pore pressures [Pa] of each stage that has its own."""
    return [stage.pore_pressure(np.array(points)) for stage in site.stages if stage.pore_pressure is not None]


def test_water_flows_below_the_wall_to_the_floor_that_is_there(tmp_path):
    site = read_site(site_in(tmp_path), MPI.COMM_WORLD)
    flows = [stage.pore_pressure for stage in site.stages]
    assert [type(flow) for flow in flows] == [StageFlow, type(None), StageFlow, StageFlow]
    still, shallow, deep = (flow.flow for flow in (flows[0], flows[2], flows[3]))
    conditions = [[one.facet_tag for one in flow.boundary] for flow in (still, shallow, deep)]
    assert conditions == [["right"], ["right", "floor 1"], ["right", "floor 2"]]  # those at the surface of the soil
    assert abs(still.inflow("right")) < 1e-15
    for flow, floor in ((shallow, "floor 1"), (deep, "floor 2")):
        assert flow.inflow("right") == pytest.approx(-flow.inflow(floor), rel=1e-8) and flow.inflow("right") > 0
    # The head falls from 23 to 18 m; both sides of the wall are on the way, and water below the floor pushes up.
    at_rest, _, behind = pressures(site, [(6.05, 16.0), (5.95, 16.0)])
    assert np.allclose(at_rest, GAMMA * 7.0, rtol=1e-6)
    assert GAMMA * 4.5 < behind[0] < GAMMA * 6.5 and GAMMA * 2.0 < behind[1] < GAMMA * 3.0
    assert pressures(site, [(3.0, 20.0)])[2] == 0.0  # in the pit


def test_a_flooded_pit_has_its_water_on_the_wall(tmp_path):
    """With the water of the pit as high as the groundwater nothing flows, and the water on both sides of the wall is the same."""
    flooded = TEXT.replace('[boundaries."floor 2"]\nseepage_face = true', '[boundaries."floor 2"]\nreservoir = 23.0')
    site = read_site(site_in(tmp_path, flooded), MPI.COMM_WORLD)
    points = [(5.99, 20.0), (6.01, 20.0), (3.0, 22.0), (3.0, 23.5), (40.0, 10.0)]
    assert np.allclose(pressures(site, points)[-1], GAMMA * np.array([3.0, 3.0, 1.0, 0.0, 13.0]), atol=1.0)
    assert abs(site.stages[-1].pore_pressure.flow.inflow("right")) < 1e-12


def test_the_study_excavation_has_the_flow_of_each_stage(tmp_path):
    out = tmp_path / "out"
    assert main("excavation", ["--site", str(site_in(tmp_path)), "--output", str(out)]) == 0
    summary = json.loads((out / "summary.json").read_text())
    first, _, _, last = summary["stages"]
    assert summary["finished_run"] and (out / "stages_flow.png").exists()
    assert last["inflow_right_m2_per_day"] == pytest.approx(-last["inflow_floor 2_m2_per_day"], rel=1e-8)
    assert first["largest_exit_gradient"] < 1e-9 and 0.2 < last["largest_exit_gradient"] < 0.6


def test_the_picture_of_a_stage_asks_no_rank_alone_for_its_flow(tmp_path, monkeypatch):
    """Only the first rank draws: pressures of a flow, which all ranks find together, would let it wait for the others for ever."""
    site = read_site(site_in(tmp_path), MPI.COMM_WORLD)
    staged = bridge.FemSite(site.finite_elements(1))
    staged.carry_out(site.stages[0])
    monkeypatch.setattr("common.stages.plots.level_line", lambda *_: pytest.fail("the flow is asked on one rank"))
    picture = stage_picture(staged, "in situ")
    assert picture.flow is not None and np.allclose(picture.water[:, :, 1], 23.0, atol=0.01)


def test_a_floor_that_is_lifted_is_said(tmp_path):
    """A wall that ends 1 m below the floor leaves the water a gradient of 0.75 there; that of the light soil must be below 0.63."""
    short = TEXT.replace("[6.0, 11.0]", "[6.0, 17.0]").replace(
        "cell_size = 3.0", "cell_size = 2.0\nconstants = {wall = 7}"
    )
    short = short.replace("cohesion = 1e3", "cohesion = 30e3").replace("unit_weight = 20e3", "unit_weight = 16e3")
    with pytest.warns(
        RuntimeWarning, match="stage 'cut to 6 m': water leaves the ground upwards with a gradient of .*hydraulic heave"
    ):
        main("excavation", ["--site", str(site_in(tmp_path, short)), "--output", str(tmp_path / "out"), "--no-compare"])


def test_a_head_beside_soil_without_water_is_named(tmp_path):
    """Behind a wall of soil without conductivity no head reaches the cuts, whose floors let water out only."""
    text = TEXT.replace("conductivity = 1e-4  # m/s\nporosity = 0.4\n", "", 1)
    with pytest.raises(
        mpm.InputError, match=r"steady_flow: .*not at the surface of the soils .* conductivity: 'right', "
    ):
        read_site(site_in(tmp_path, text), MPI.COMM_WORLD)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("steady_flow = true", "steady_flow = 1", r"stages\[0\]: steady_flow is 1, expected true or false"),
        ("steady_flow = true", "steady_flow = true\nwater_level = 2.0", r"stages\[0\] has steady_flow and water_level"),
        (
            "head = 23.0",
            "head = 23.0\n[boundaries.wall]\nhead = 3.0",
            r"boundaries.wall: no boundary of the mesh .* has the name 'wall'",
        ),
        ("conductivity = 1e-4", "", r"stages\[0\]: steady_flow is true, but no soil with a conductivity is there"),
        (
            "[boundaries.right]  # the groundwater far from the pit\nhead = 23.0",
            "",
            r"steady_flow: no boundary with a condition",
        ),
    ],
)
def test_mistakes_in_a_steady_flow_are_named(tmp_path, old, new, message):
    assert old in TEXT
    text = TEXT.replace("porosity = 0.4\n", "") if old.startswith("conductivity") else TEXT
    with pytest.raises(mpm.InputError, match=message):
        read_site(site_in(tmp_path, text.replace(old, new)), MPI.COMM_WORLD)


LAST = 'excavate = "cut 2"\nsteady_flow = true'
FLOOR = '[boundaries."floor 2"]\nseepage_face = true'
OUT = '\n[[stages]]\nname = "out"\nremove = "wall"\n'


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (LAST, 'excavate = "cut 2"', r"stages\[3\] \('cut to 6 m'\) digs 'cut 2', but keeps the pore pressures"),
        (LAST, LAST + "\n" + OUT, r"stages\[4\] \('out'\) removes 'wall', but keeps the pore pressures"),
        # Nothing flows, so that the head of 23 m is that below the floor at 18 m.
        (FLOOR, "", r"stages\[3\]: .* the ground at x = .* m, y = 18 m, where the water has a pressure of 49(\.0|\.1)? kPa"),
        (FLOOR, FLOOR.replace("seepage_face = true", "reservoir = 16.0"),
         r"stages\[3\]: .*reservoir of 'floor 2' is at 16 m, below this boundary, which is at 18 m and above"),
    ],
)  # fmt: skip
def test_what_is_probably_a_mistake_in_a_flow_is_said(tmp_path, old, new, message):
    assert old in TEXT
    with pytest.warns(RuntimeWarning, match=message) as said:
        read_site(site_in(tmp_path, TEXT.replace(old, new)), MPI.COMM_WORLD)
    assert len([one for one in said if issubclass(one.category, RuntimeWarning)]) == 1


def test_an_aquifer_below_clay_and_a_pit_without_water_are_no_mistakes(tmp_path):
    """Water under pressure below soil without a conductivity is no open ground, and dry soil may be dug without another flow."""
    dry = TEXT.replace("conductivity = 1e-4\nporosity = 0.4\n", "")  # that of the cuts
    assert dry.count("conductivity") == 1
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        read_site(site_in(tmp_path, TEXT), MPI.COMM_WORLD)
        covered = dry.replace(LAST, 'excavate = "cut 2"').replace(FLOOR, "")
        read_site(site_in(tmp_path, covered.replace("head = 23.0", "head = 20.5")), MPI.COMM_WORLD)


def test_ground_below_an_impervious_slab_is_not_open():
    body, _, tags = bridge.box_mesh(MPI.COMM_WORLD, (4.0, 2.0), (4, 2))
    tags = bridge.name_tags(tags, {"left": 1})
    flow = bridge.water.Seepage(body, bridge.water.PorousSoil(1e-4), tags, [bridge.water.Head("left", 5.0)])
    flow.solve()
    slab = mpm.beam([(0.0, 2.0), (4.0, 2.0)], 1e9, 1e7, impervious=True)
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        warn_of_sealed_ground(flow, body, [np.array(slab.points)], "here")
    half = mpm.beam([(0.0, 2.0), (2.0, 2.0)], 1e9, 1e7, impervious=True)
    with pytest.warns(
        RuntimeWarning, match=r"here: .* at x = [23]\.5 m, y = 2 m, where the water has a pressure of 29\.4 kPa"
    ):
        warn_of_sealed_ground(flow, body, [np.array(half.points)], "here")


def test_the_study_seepage_flows_around_walls(tmp_path):
    """A cutoff through half of the layer takes a fifth of the flow below it."""
    inflows = []
    for wall in ("", '[members.wall]\nkind = "beam"\npoints = [[6.0, 24.0], [6.0, 11.0]]\naxial_stiffness = 3e9\n'
                     'bending_stiffness = 1e8\nimpervious = true\n'):  # fmt: skip
        text = TEXT[: TEXT.index("[members.wall]")].replace(
            '[boundaries."floor 1"]', '[boundaries.axis]\nhead = 20.0\n[boundaries."floor 1"]'
        )
        text = text[: text.index('[boundaries."floor 1"]')] + wall
        out = tmp_path / f"out {len(inflows)}"
        assert main("seepage", ["--site", str(site_in(tmp_path, text)), "--output", str(out)]) == 0
        inflows.append(json.loads((out / "summary.json").read_text())["steady_inflow_right_m2_per_day"])
    assert 0 < inflows[1] < 0.85 * inflows[0]


@pytest.mark.parametrize(("upward", "said"), [(0.2, False), (1.0, False), (1.1, True)])
def test_soil_is_lifted_above_its_critical_gradient(upward, said, recwarn):
    """That of soil of 20 kN/m3 is 20 / 9.81 - 1 = 1.04."""
    warn_of_heave("cut", {"floor": (upward, 20e3)})
    assert any("at 'floor', above the critical one of 1.04" in str(one.message) for one in recwarn) == said


@pytest.mark.parametrize("weight", [300.0, 0.0])
def test_no_water_that_leaves_upwards_lifts_no_soil_that_is_lighter_than_water(weight, recwarn):
    """Weightless soil of a hand calculation, or blocks of foam of 0.3 kN/m3 in a dry fill, have a critical gradient below 0."""
    warn_of_heave("load", {"floor": (0.0, weight)})
    assert not [one for one in recwarn if "hydraulic heave" in str(one.message)]


def test_the_soil_at_the_floor_is_what_water_lifts_there(tmp_path):
    """Soil that is lighter elsewhere does not count: the peat of the first cut is gone from the floor of the second."""
    text = TEXT.replace('[soils."cut 1"]\nunit_weight = 20e3', '[soils."cut 1"]\nunit_weight = 11e3')
    site = read_site(site_in(tmp_path, text), MPI.COMM_WORLD)
    weights = {tag: site.unit_weight[soil] for soil in site.soils for tag in site.tags_of([soil])}
    exits = [upward_exits(stage.pore_pressure, weights) for stage in site.stages]
    assert [list(one) for one in exits] == [["right"], [], ["right", "floor 1"], ["right", "floor 2"]]
    assert exits[0]["right"] == (pytest.approx(0.0, abs=1e-9), 20e3)
    assert exits[2]["floor 1"][1] == 20e3 and exits[3]["floor 2"][1] == 20e3
    assert 0.2 < exits[3]["floor 2"][0] < 0.6
