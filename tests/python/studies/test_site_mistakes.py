"""Mistakes in the file of a site are named with the file, the key, its value and what was expected, before anything is computed."""

import importlib

import pytest
from mpi4py import MPI
from site_cases import SITE, site_in

import mpm_core as mpm

site_file = importlib.import_module("common.site.file")
water_site = importlib.import_module("common.water.site")
runs = importlib.import_module("common.stages.runs")

NO_TOP = "no boundary of the mesh 'block.geo' has the name 'top'; it has 'base', 'left'"
FIRST = "cell_size = 0.5\n"
STAGED = SITE + '[[stages]]\nfill = ["lower", "upper"]\n[[stages]]\n'


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ('supports = {base = "fixed", top = "fixed"}', f"supports.top: {NO_TOP}"),
        ('supports = {top = "roller"}', f"supports.top: {NO_TOP}"),
        ("boundaries = {top = {head = 1.0}}", f"boundaries.top: {NO_TOP}"),
        ("pressures = {top = 1e3}", f"pressures.top: {NO_TOP}"),
        ('supports = "fixed"', "supports is 'fixed', expected a table such as supports = {name = value}"),
        ("constants = 3", "constants is 3, expected a table such as"),
        ('constants = {width = "8 m"}', "constants.width is '8 m', expected a number"),
        ("air = 3", "air is 3, expected names of groups of the mesh"),
        ("classes = 2.5", "classes is 2.5, expected a whole number from 1 on"),
        ('classes = "a"', "classes is 'a', expected a whole number from 1 on"),
    ],
)
def test_a_mistake_at_the_top_of_the_file_is_named(tmp_path, line, message):
    path = site_in(tmp_path, SITE.replace(FIRST, FIRST + line + "\n"))
    with pytest.raises(mpm.InputError) as caught:
        site_file.read_site(path, MPI.COMM_WORLD)
    assert str(caught.value).startswith(f"{path}: {message}")


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ('release = "top"', f"stages[1]: release: {NO_TOP}"),
        ("release = 3", "stages[1]: release is 3, expected names of boundaries"),
        ("pressure = {top = 1e3}", f"stages[1].pressure.top: {NO_TOP}"),
        ('support = {top = "roller"}', f"stages[1].support.top: {NO_TOP}"),
        ("steady_flow = true\nboundaries.top.head = 1.0", f"stages[1].boundaries.top: {NO_TOP}"),
        ("unit_weight = {sand = 1e3}", "stages[1]: unit_weight: soil 'sand' is not among the soils lower, upper"),
        ('excavate = ["sand"]', "stages[1]: excavate: soil 'sand' is not among the soils lower, upper"),
        ("excavate = 3", "stages[1]: excavate is 3, expected names of soils"),
        ("fill = {lower = 1}", "stages[1]: fill is {'lower': 1}, expected names of soils"),
        ("fill = 3", "stages[1]: fill is 3, expected names of soils"),
    ],
)
def test_a_mistake_in_a_stage_is_named(tmp_path, line, message):
    path = site_in(tmp_path, f"{STAGED}{line}\n")
    with pytest.raises(mpm.InputError) as caught:
        site_file.read_site(path, MPI.COMM_WORLD)
    assert str(caught.value).startswith(f"{path}: {message}")


def test_a_head_that_is_no_number_is_named():
    with pytest.raises(mpm.InputError, match="boundaries.left: head is nan, expected a number or rows"):
        importlib.import_module("common.site.flow").boundary_of(
            {"boundaries": {"left": {"head": float("nan")}}}, "site.toml"
        )


def test_the_flow_of_water_names_a_boundary_that_the_mesh_does_not_have(tmp_path):
    path = site_in(
        tmp_path, SITE.replace(FIRST, FIRST + "boundaries = {top = {head = 1.0}}\n") + "conductivity = 1e-6\n"
    )
    with pytest.raises(mpm.InputError) as caught:
        water_site.read_water_site(path, MPI.COMM_WORLD)
    assert str(caught.value).startswith(f"{path}: boundaries.top: {NO_TOP}")


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ('name = "cut"\nfill = "upper"', "stage 'cut': fill: the soil 'upper' is there already"),
        ('name = "cut"\nrelease = "left"\n[[stages]]\nname = "late"\nrelease = "left"', "stage 'late': release: "),
        (
            'name = "cut"\npressure = {left = "1e3"}',
            "stage 'cut': pressure is '1e3' for 'left', expected a finite number",
        ),
    ],
)
def test_a_stage_that_cannot_follow_names_the_file(tmp_path, line, message):
    path = site_in(tmp_path, f"{STAGED}{line}\n")
    site = site_file.read_site(path, MPI.COMM_WORLD)
    with pytest.raises(mpm.InputError) as caught:
        runs.carry_out(site, 1, tmp_path, MPI.COMM_WORLD)
    assert str(caught.value).startswith(f"{path}: {message}")


def test_a_member_outside_the_mesh_names_the_file(tmp_path):
    strut = 'members = {prop = {kind = "strut", points = [[0.0, 5.0], [1.0, 5.0]], axial_stiffness = 1e6}}\n'
    path = site_in(tmp_path, SITE.replace(FIRST, FIRST + strut))
    site = site_file.read_site(path, MPI.COMM_WORLD)
    with pytest.raises(mpm.InputError) as caught:
        site.finite_elements(1)
    assert str(caught.value).startswith(f"{path}: ") and "'prop'" in str(caught.value)


def test_unreduced_soils_that_the_site_does_not_have_are_named(tmp_path):
    path = site_in(tmp_path)
    options = ["--site", str(path), "--unreduced", "sand", "--output", str(tmp_path / "out")]
    with pytest.raises(mpm.InputError, match="--unreduced, .*: soil 'sand' is not among the soils lower, upper"):
        importlib.import_module("safety").main(options)
