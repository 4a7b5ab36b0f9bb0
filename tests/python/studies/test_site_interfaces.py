"""Interfaces of the walls of a site: soil beside them is weaker while they are there."""

from pathlib import Path

import pytest
import study_main  # noqa: F401
from common.site.file import read_site
from common.site.interfaces import Interfaces, in_stages
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

ROOT = Path(__file__).parents[3]
BRACED, NAILED = ROOT / "meshes" / "braced_excavation.toml", ROOT / "meshes" / "nailed_slope.toml"


def site_in(folder, text, base=BRACED):
    path = folder / "site.toml"
    path.write_text(f'extends = "{base}"\ncell_size = 2.0\n{text}')
    return read_site(path, MPI.COMM_WORLD)


def after(site, name):
    """The laws by cell tag after the stage of a name."""
    laws = dict(site.laws)
    for stage in site.stages:
        laws |= {
            tag: law
            for key, law in stage.law.items()
            for tag in ([key] if isinstance(key, int) else site.tags_of([key]))
        }
        if stage.name == name:
            return laws
    raise AssertionError(name)


def test_soil_beside_a_wall_is_weaker_from_the_stage_on_that_installs_it(tmp_path):
    site = site_in(tmp_path, "[members.wall]\ninterface_strength = 0.5\n")
    plain = site_in(tmp_path, "")
    names, before = bridge.names_of(site.cell_tags), bridge.names_of(plain.cell_tags)
    new = {soil: set(names[soil]) - set(before[soil]) for soil in site.soils}
    assert all(new.values())  # the wall is 11 m long: beside it are the ground and all three cuts
    assert after(site, "in situ") == site.laws
    for soil, tags in new.items():
        for tag in tags:
            full, weak = site.laws[tag], after(site, "wall")[tag]
            assert full in [plain.laws[old] for old in before[soil]]
            assert weak == bridge.reduced_strength(full, 2.0) and weak in site.further_laws
            assert weak == after(site, "cut to 6 m")[tag]
    old = set(before["ground"])
    assert all(after(site, "wall")[tag] is site.laws[tag] for tag in old)


def test_a_law_of_a_stage_is_weaker_beside_walls_too_and_walls_that_go_leave_it_as_it_is(tmp_path):
    text = """
        [members.wall]
        interface_strength = 0.5
        [laws.grouted]
        young = 50e6
        poisson = 0.3
        cohesion = 100e3
        friction_angle = 35.0
        [[stages]]
        name = "in situ"
        fill = ["ground", "cut 1", "cut 2", "cut 3"]
        [[stages]]
        name = "wall"
        install = ["wall"]
        [[stages]]
        name = "grout"
        law = {"cut 3" = "grouted"}
        [[stages]]
        name = "no wall"
        remove = ["wall"]
    """
    site = site_in(tmp_path, text)
    plain, weak = set(site_in(tmp_path, "").tags_of(["cut 3"])), {law.cohesion for law in after(site, "grout").values()}
    beside = set(site.tags_of(["cut 3"])) - plain
    assert {after(site, "grout")[tag].cohesion for tag in plain} == {100e3}
    assert {after(site, "grout")[tag].cohesion for tag in beside} == {50e3} and 50e3 in weak
    assert {after(site, "no wall")[tag].cohesion for tag in beside} == {100e3}


def test_without_stages_the_wall_and_its_interface_are_there_from_the_beginning(tmp_path):
    facing = site_in(tmp_path, "[members.facing]\ninterface_strength = 0.8\n", NAILED)
    plain = site_in(tmp_path, "", NAILED)
    weaker = [tag for tag in facing.laws if tag not in plain.laws]
    assert weaker and all(
        facing.laws[tag] == bridge.reduced_strength(next(iter(plain.laws.values())), 1 / 0.8) for tag in weaker
    )


def test_two_walls_in_one_place_leave_no_law_without_cells(tmp_path):
    """All cells beside the short wall are beside the long one too."""
    text = "[members.sheet]\nkind = 'beam'\npoints = [[5.0, 20.0], [5.0, 14.0]]\naxial_stiffness = 1e9\nbending_stiffness = 1e7\n"
    walls = "interface_strength = 0.8\n[members.wall]\ninterface_strength = 0.5\n"
    stages = "[[stages]]\nfill = ['ground', 'cut 1', 'cut 2', 'cut 3']\n[[stages]]\nname = 'first'\ninstall = ['sheet']\n[[stages]]\n"
    site = site_in(tmp_path, text + walls + stages + "name = 'second'\nremove = ['sheet']\ninstall = ['wall']\n")
    there = set(site.cell_tags.values.tolist())
    assert set(site.laws) == set(site.tags_of(site.soils)) == there
    assert all(set(stage.law) <= there for stage in site.stages)
    both = [tag for tag in there if after(site, "first")[tag] != site.laws[tag]]
    assert both and all(after(site, "first")[tag] == bridge.reduced_strength(site.laws[tag], 1 / 0.8) for tag in both)
    assert all(after(site, "second")[tag] == bridge.reduced_strength(site.laws[tag], 2.0) for tag in both)


def test_elastic_soil_beside_a_wall_has_no_strength_that_could_be_less(tmp_path):
    site = site_in(tmp_path, '[members.wall]\ninterface_strength = 0.5\n[soils."cut 3"]\nmaterial = "elastic"\n')
    laws = after(site, "wall")
    assert all(isinstance(laws[tag], mpm.LinearElastic) for tag in site.tags_of(["cut 3"]))
    assert any(laws[tag] != site.laws[tag] for tag in site.tags_of(["cut 2"]))


def test_a_law_with_memory_that_comes_in_by_a_stage_is_weaker_beside_the_wall():
    """It cannot change once it is there, also when the wall comes later."""
    sand = mpm.MohrCoulomb(young=20e6, poisson=0.3, cohesion=1e3, friction_angle=33.0)
    clay = mpm.CamClay(
        compression=0.2, swelling=0.04, critical_slope=1.0, poisson=0.3, void_ratio=1.0, preconsolidation=100e3
    )
    stages = [
        bridge.Stage("fill", fill=["soil"], unit_weight={"soil": 18e3}),
        bridge.Stage("clay", law={"soil": clay}),
        bridge.Stage("wall", install={"wall": None}),
        bridge.Stage("no wall", remove=["wall"]),
    ]
    beside = Interfaces({"wall": 0.5}, {2: ("wall",)})
    changed, further = in_stages(stages, {1: sand, 2: sand}, beside, lambda _: (1, 2))
    weak = bridge.reduced_strength(clay, 2.0)
    assert changed[1].law == {1: clay, 2: weak} and further == [weak]
    assert not changed[2].law and not changed[3].law


@pytest.mark.parametrize("member, expected", [
    ("[members.wall]\ninterface_strength = 0", "members.wall: interface_strength is 0, expected a number above 0 and at most 1"),
    ("[members.wall]\ninterface_strength = 1.2", "is 1.2, expected a number above 0 and at most 1"),
    ('[members."upper strut"]\ninterface_strength = 0.5', "unknown key 'interface_strength'"),
])  # fmt: skip
def test_impossible_interfaces_are_refused_by_name(tmp_path, member, expected):
    with pytest.raises(mpm.InputError, match=expected):
        site_in(tmp_path, member)


def test_the_moment_of_a_wall_grows_with_a_weaker_interface(tmp_path):
    """Less friction on the wall gives more active and less passive pressure."""
    moments = []
    for fraction in (1.0, 0.5):
        site = site_in(tmp_path, f"[members.wall]\ninterface_strength = {fraction}\n")
        fem = bridge.FemSite(site.finite_elements(2))
        for _ in bridge.carry_out(fem, site.stages):
            pass
        moments.append(abs(fem.fem.member_forces("wall").moment).max())
    assert moments[1] > 1.05 * moments[0]


def test_a_wall_with_an_interface_that_the_mesh_does_not_follow_is_an_error_that_names_it(tmp_path):
    """Its line is on the mesh from 20 to 9 m; the level of a strut between two nodes is not one of them."""
    text = "[members.wall]\ninterface_strength = 0.7\npoints = [[5.0, 20.0], [5.0, 17.77], [5.0, 9.0]]\n"
    place = r"members.wall: interface_strength: wall has the point \(5, 17.77\) m between the nodes of the mesh"
    with pytest.raises(mpm.InputError, match=place):
        site_in(tmp_path, text)


def test_a_message_names_a_soil_whose_cells_beside_a_wall_have_a_tag_of_their_own(tmp_path):
    text = (
        '[members.wall]\ninterface_strength = 0.5\n[[stages]]\nname = "in situ"\nfill = ["ground", "cut 1", "cut 2"]\n'
    )
    with pytest.warns(RuntimeWarning, match="no stage fills the cells of 'cut 3'"):
        site = site_in(tmp_path, text + '[[stages]]\nname = "dig"\ninstall = ["wall"]\nexcavate = "cut 3"\n')
    with pytest.raises(mpm.InputError, match="stage 'dig': excavate: the soil 'cut 3' is not there"):
        list(bridge.carry_out(bridge.FemSite(site.finite_elements(1)), site.stages))
