"""Sites in three dimensions: supports, members and random fields that do not fit them, tables of members, and pictures of bodies of any shape."""

import csv
import json

import gmsh
import matplotlib.pyplot as plt
import numpy as np
import pytest
import study_main
from common.plots import DISPLACEMENT, colour_limits
from common.site.file import read_site
from common.solids.plots import CAPTIONS, set_view, thin_numbers
from mpi4py import MPI

import mpm_core as mpm

COMM = MPI.COMM_WORLD
BLOCK = """
mesh = "block.msh"
dimension = 3
[soils.clay]
unit_weight = 18e3
material = "tresca"
young = 10e6
poisson = 0.45
shear_strength = {strength}
"""


def block(folder, up=2, strength="50e3", text=""):
    """A site of a block of 4 by 4 by 3 m of clay, whose height is along the axis `up`; its sides are free."""
    size, name = np.where(np.arange(3) == up, 3.0, 4.0), str(folder / "block.msh")
    gmsh.initialize()
    try:
        gmsh.option.setNumber("General.Verbosity", 1)
        gmsh.option.setNumber("Mesh.MeshSizeMin", 1.5)
        gmsh.model.occ.addBox(0, 0, 0, *size)
        gmsh.model.occ.synchronize()
        sides = [side for _, side in gmsh.model.getEntities(2)]
        base = next(side for side in sides if gmsh.model.occ.getCenterOfMass(2, side)[up] < 1e-9)
        top = next(side for side in sides if gmsh.model.occ.getCenterOfMass(2, side)[up] > 3 - 1e-9)
        for dim, entity, group in ((3, 1, "clay"), (2, base, "base"), (2, top, "top")):
            gmsh.model.setPhysicalName(dim, gmsh.model.addPhysicalGroup(dim, [entity]), group)
        gmsh.model.mesh.generate(3)
        gmsh.write(name)
    finally:
        gmsh.finalize()
    path = folder / "site.toml"
    path.write_text(BLOCK.format(strength=strength) + text)
    return path


@pytest.mark.parametrize("up", [1, 2])
def test_a_base_that_stands_upright_is_warned_of(tmp_path, recwarn, up):
    read_site(block(tmp_path, up), COMM)
    upright = "the boundary 'base' stands upright, but z points up"
    assert [upright in str(one.message) for one in recwarn].count(True) == (up == 1)


def test_members_of_a_section_in_a_body_are_refused_before_any_stage(tmp_path):
    bolt = '[members.bolt]\nkind = "bar"\npoints = [[0.5, 2.0], [3.5, 2.0]]\naxial_stiffness = 1e8\n'
    with pytest.raises(mpm.InputError, match="members.bolt: its points have 2 coordinates, expected 3"):
        read_site(block(tmp_path, text=bolt), COMM)


def test_steady_flow_through_a_body_is_refused(tmp_path):
    stage = '[[stages]]\nname = "in situ"\nfill = ["clay"]\nsteady_flow = true\n'
    text = "conductivity = 1e-6\n[boundaries.top]\nhead = 3.0\n" + stage
    with pytest.raises(
        mpm.InputError, match=r"stages\[0\]: steady_flow is true, but dimension is 3, expected a water_level"
    ):
        read_site(block(tmp_path, text=text), COMM)


def test_correlation_lengths_of_a_body_are_three_and_so_are_those_of_the_example(tmp_path):
    path = block(tmp_path, strength="{value = 50e3, variation = 0.3, lengths = [20.0, 2.0]}")
    with pytest.raises(mpm.InputError, match=r"along each of 3 axes \[m\], such as \[20.0, 20.0, 2.0\]"):
        read_site(path, COMM)


def test_tables_of_members_have_three_coordinates_and_forces_of_a_single_bar(tmp_path):
    """A pressure q shortens an elastic block on smooth sides by q H / M, M its oedometer modulus, and a strut that hardly resists as well."""
    young, poisson, pressure, stiffness = 10e6, 0.25, 20e3, 1e3
    modulus = young * (1 - poisson) / ((1 + poisson) * (1 - 2 * poisson))
    path = block(tmp_path)
    path.write_text(
        f"""
mesh = "block.msh"
dimension = 3
[soils.clay]
unit_weight = 18e3
material = "elastic"
young = {young}
poisson = {poisson}
[supports]
base = "fixed"
[members.strut]
kind = "strut"
points = [[2.0, 2.0, 3.0], [2.0, 2.0, 0.0]]
axial_stiffness = {stiffness}
[[stages]]
name = "in situ"
fill = ["clay"]
[[stages]]
name = "load"
install = ["strut"]
pressure = {{top = {pressure}}}
"""
    )
    assert study_main.main("excavation", ["--site", path, "--no-compare", "--output", tmp_path / "out"]) == 0
    with open(tmp_path / "out" / "members.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert all(None not in row and None not in row.values() for row in rows)
    assert {float(row["z_m"]) for row in rows} == {0.0, 3.0} and {row["x_m"] for row in rows} == {"2"}
    shortened = -float(next(row for row in rows if float(row["z_m"]) == 3.0)["displacement_z_m"])
    assert pressure * 3 / modulus < shortened < pressure * 3 / young  # its sides are free, but rough on the base
    force = float(rows[0]["axial_force_N"])
    assert force == pytest.approx(-stiffness * shortened / 3, rel=1e-4)
    last = json.loads((tmp_path / "out" / "summary.json").read_text())["stages"][-1]
    assert last["strut_axial_force_N"] == pytest.approx(force, rel=1e-4)


def test_particles_find_the_factor_of_safety_of_a_body(tmp_path):
    """A block with free sides is not weaker than a vertical cut in plane strain by lower bounds, 3.77 c / (gamma H) = 3.49 (Pastor et al. 2000)."""
    path = block(tmp_path)
    options = ["--site", path, "--meshes", 1, "--elements", "P1-averaged", "--particles", "--output", tmp_path / "out"]
    assert study_main.main("safety", options) == 0
    found = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert found["factor_of_safety_by_particles"] == pytest.approx(found["factor_of_safety"], rel=0.15)
    assert CAPTIONS["mechanism"] in (tmp_path / "out" / "report.html").read_text()


@pytest.mark.parametrize("strength, text, name", [
    ("50e3", "strength_ratio = 2.0\nk0 = 1.0\n", "undrained_strength"),
    ("{value = 50e3, variation = 0.3, lengths = [2.0, 2.0, 1.0]}", "", "random_cohesion"),
])  # fmt: skip
def test_strengths_of_a_body_that_vary_are_drawn(tmp_path, strength, text, name):
    stage = '[[stages]]\nname = "in situ"\nfill = ["clay"]\n'
    path = block(tmp_path, strength=strength, text=text + stage)
    assert study_main.main("excavation", ["--site", path, "--no-compare", "--output", tmp_path / "out"]) == 0
    assert (tmp_path / "out" / f"{name}.png").stat().st_size > 20_000
    assert CAPTIONS[name] in (tmp_path / "out" / "report.html").read_text()


@pytest.mark.parametrize("size", [(4.0, 4.0, 3.0), (1.0, 1.0, 4.0), (40.0, 6.0, 8.0), (6.0, 40.0, 8.0)])
def test_labels_of_a_body_are_within_the_picture_and_apart_from_its_numbers(size):
    figure = plt.figure(figsize=(7.0, 3.6), layout="constrained")
    try:
        axes = figure.add_subplot(1, 2, 1, projection="3d")
        figure.add_subplot(1, 2, 2)
        set_view(axes, np.array([(0.0, 0.0, 0.0), size]), np.array([-1.0, -1.0]))
        figure.canvas.draw()
        for axis, length in zip((axes.xaxis, axes.yaxis, axes.zaxis), size):
            label = axis.label.get_window_extent()
            assert label.x0 >= 0 and label.y0 >= 0
            numbers = [tick.label1 for tick in axis.get_major_ticks() if 0 <= tick.get_loc() <= length]
            middles = [(box.min + box.max) / 2 for box in (number.get_window_extent() for number in numbers)]
            assert (
                np.linalg.norm(np.array(middles) - (label.min + label.max) / 2, axis=1).min() > 10
            )  # pixels; a digit is 8 high
            assert len(numbers) <= 2 + 4 * length / max(size)
    finally:
        plt.close(figure)


@pytest.mark.parametrize("width, most", [(1.0, 2), (4.0, 5), (40.0, None)])
def test_numbers_below_a_narrow_section_are_few(width, most):
    figure, axes = plt.subplots()
    try:
        axes.set(xlim=(0, width), ylim=(0, 4))
        before = len(axes.get_xticks())
        thin_numbers(axes, np.array([(0.0, 0.0), (width, 4.0001)]))
        assert len(axes.get_xticks()) == before if most is None else len(axes.get_xticks()) <= most
    finally:
        plt.close(figure)


def test_the_scale_of_particles_that_have_not_moved_begins_at_zero():
    assert colour_limits(DISPLACEMENT, [np.zeros(5)]) == (0.0, pytest.approx(1.0, abs=0.25))


SECTION = """
SetFactory("OpenCASCADE");
Rectangle(1) = {{0, 0, 0, 4, 2}};
Physical Surface("clay") = {{1}};
Physical Curve("base") = {{1}}; Physical Curve("{right}") = {{2}}; Physical Curve("top") = {{3}}; Physical Curve("left") = {{4}};
Mesh.MeshSizeMax = 1;
"""


@pytest.mark.parametrize("right, supports, free", [
    ("east", "", True), ("right", "", False), ("east", '[supports]\nbase = "fixed"\n', False),
])  # fmt: skip
def test_a_side_that_no_default_support_holds_is_warned_of(tmp_path, recwarn, right, supports, free):
    (tmp_path / "section.geo").write_text(SECTION.format(right=right))
    soil = '[soils.clay]\nunit_weight = 18e3\nmaterial = "tresca"\nyoung = 5e6\npoisson = 0.4\nshear_strength = 20e3\n'
    (tmp_path / "site.toml").write_text(f'mesh = "section.geo"\n{soil}{supports}')
    read_site(tmp_path / "site.toml", COMM)
    said = [str(one.message) for one in recwarn if "at the side of the mesh is free" in str(one.message)]
    assert len(said) == free and all("the boundary 'east'" in text and "left, right, front" in text for text in said)


@pytest.mark.parametrize("left_out, axisymmetric, place", [
    ("base", "", "y = 0 m"), ("left", "", "x = 0 m"), ("right", "", "x = 4 m"), ("top", "", ""), ("left", "axisymmetric = true\n", ""),
])  # fmt: skip
def test_a_side_of_the_mesh_without_a_name_is_warned_of(tmp_path, recwarn, left_out, axisymmetric, place):
    lines = SECTION.format(right="right").replace("; ", ";\n").splitlines()
    (tmp_path / "section.geo").write_text("\n".join(line for line in lines if f'("{left_out}")' not in line))
    soil = '[soils.clay]\nunit_weight = 18e3\nmaterial = "tresca"\nyoung = 5e6\npoisson = 0.4\nshear_strength = 20e3\n'
    (tmp_path / "site.toml").write_text(f'mesh = "section.geo"\n{axisymmetric}{soil}')
    read_site(tmp_path / "site.toml", COMM)
    said = [str(one.message) for one in recwarn if "boundaries without a name" in str(one.message)]
    assert len(said) == bool(place)
    assert all(f"without a name at {place}, which no support holds" in text for text in said)
