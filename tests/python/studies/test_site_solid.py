"""Sites in three dimensions: their factor of safety, stages and slides, and the pictures of them."""

import json

import numpy as np
import pytest
import study_main
from common.consolidation.site import read_consolidation_site
from common.results import ROOT
from common.site.file import read_site
from common.solids.plots import sharp_edges
from common.solids.site import Solid, section_of
from common.water.site import read_water_table
from mpi4py import MPI

import mpm_core as mpm

COMM = MPI.COMM_WORLD
ABUTMENT = ROOT / "meshes" / "abutment.toml"
CUBE = np.array([(x, y, z) for z in (0.0, 1.0) for y in (0.0, 1.0) for x in (0.0, 1.0)])
TETRAHEDRA = np.array([(0, 1, 3, 7), (0, 1, 7, 5), (0, 5, 7, 4), (0, 3, 2, 7), (0, 6, 7, 2), (0, 4, 7, 6)])


def variant(folder, text):
    path = folder / "site.toml"
    path.write_text(f'extends = "{ABUTMENT}"\n{text}')
    return path


def cube():
    """A cube of six tetrahedra, whose displacement is linear; every other one is turned inside out."""
    cells = TETRAHEDRA.copy()
    cells[::2, :2] = cells[::2, 1::-1]
    return Solid(
        CUBE, cells, np.column_stack([CUBE[:, 0] + 2 * CUBE[:, 2], 0 * CUBE[:, 0], 0 * CUBE[:, 0]]), np.arange(6.0)
    )


def test_the_surface_of_a_cube_has_outward_normals_and_twelve_edges():
    solid = cube()
    triangles, behind = solid.surface()
    corners = solid.points[triangles]
    area = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert len(triangles) == 12 and np.linalg.norm(area, axis=1).sum() == pytest.approx(6.0)
    assert (np.einsum("kd,kd->k", area, corners.mean(axis=1) - 0.5) > 0).all()
    assert sorted(set(behind)) == list(range(6))
    normal = area / np.linalg.norm(area, axis=1)[:, None]
    seen = sharp_edges(triangles, normal, np.array([1.0, 1.0, 1.0]))
    lengths = np.linalg.norm(np.diff(solid.points[seen], axis=1), axis=2)
    assert len(seen) == 9 and lengths == pytest.approx(1.0)  # those of the three sides that are seen; no diagonals


@pytest.mark.parametrize("axis, at", [(0, 0.3), (1, 0.5), (1, 0.0), (0, 1.0)])
def test_a_section_has_the_area_of_the_body_and_its_linear_displacement(axis, at):
    section = section_of(cube(), axis, at)
    corners = section.points[section.triangles]
    edges = corners[:, 1:] - corners[:, :1]
    assert 0.5 * np.abs(np.linalg.det(edges)).sum() == pytest.approx(1.0)
    x = section.points[:, 0] if axis == 1 else section.at
    assert section.lengths == pytest.approx(x + 2 * section.points[:, 1])
    assert section.at == pytest.approx(at, abs=1.001e-3)
    assert len(np.unique(np.round(section.points, 9), axis=0)) == len(section.points)  # cells share them


def test_a_part_of_a_solid_has_its_own_points():
    part = cube().part(np.array([True, False, False, False, False, False]))
    assert len(part.points) == 4 and part.cells.shape == (1, 4) and part.values == pytest.approx([0.0])
    assert part.moved[:, 0] == pytest.approx(part.points[:, 0] + 2 * part.points[:, 2])


def test_a_body_is_seen_from_where_it_moves_to_and_a_floor_that_heaves_from_its_corner():
    solid = cube()
    assert solid.section_axis() == 1 and solid.side_to_see().tolist() == [1.0, 0.0]
    up = np.zeros_like(CUBE)
    up[2, 2] = 1.0  # at (0, 1, 0)
    assert Solid(CUBE, TETRAHEDRA, up, np.zeros(6)).side_to_see().tolist() == [-1.0, 1.0]


def test_the_factor_of_safety_grows_between_abutments_that_are_close(tmp_path):
    """A slice on rollers is the plane section, whose factor is 1.10 to 1.13 on cells of 1 and 2 m; rough abutments 8 m apart hold the bank."""
    found = {}
    for name, support in (("plane", "roller"), ("held", "fixed")):
        path = variant(tmp_path, f'cell_size = 3.0\n[constants]\nwidth = 4\n[supports]\nabutment = "{support}"\n')
        options = ["--site", path, "--meshes", 1, "--output", tmp_path / name]
        assert study_main.main("safety", options) == 0
        found[name] = json.loads((tmp_path / name / "summary.json").read_text())["factor_of_safety"]
        assert (tmp_path / name / "mechanism.png").stat().st_size > 20_000
    assert 1.1 < found["plane"] < 1.25  # coarse tetrahedra are a little too strong
    assert 1.15 < found["held"] / found["plane"] < 1.4


def test_stages_and_the_slide_of_a_body(tmp_path):
    """By finite elements, and by particles whose stages have the same stresses; with a film, and the player of the page."""
    path = variant(tmp_path, "cell_size = 3.0\n")
    options = ["--factor", 1.8, "--time", 1, "--frames", 2, "--output", tmp_path / "out"]
    assert study_main.main("embankment", ["--site", path, *options]) == 0
    found = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert found["stress_difference_of_particles_to_fem"] < 1e-2  # the water table crosses cells
    assert 0.3 < found["largest_displacement_of_slide_m"] < 0.5 * 9.81
    for name in ("slide_displacement", "slide_strain", "stages_displacement", "stages_strain"):
        assert (tmp_path / "out" / f"{name}.png").stat().st_size > 20_000
    assert "kinetic_energy_J," in (tmp_path / "out" / "history.csv").read_text().splitlines()[0] + ","
    assert [path.stat().st_size > 5000 for path in (tmp_path / "out").glob("slide.*")] == [True]  # the film
    assert '"view":[[' in (tmp_path / "out" / "report.html").read_text()


@pytest.mark.parametrize("text, message", [
    ("dimension = 4", "site.toml: dimension is 4, expected 2 or 3"),
    ("axisymmetric = true", "has axisymmetric = true and dimension = 3, expected one of them"),
    ("dimension = 2", "of tetrahedra it needs dimension = 3 in the file of the site"),
])  # fmt: skip
def test_a_dimension_that_cannot_be_is_named(tmp_path, text, message):
    with pytest.raises(mpm.InputError, match=message):
        read_site(variant(tmp_path, text), COMM)


def test_studies_of_the_flow_of_water_refuse_a_body(tmp_path):
    refused = "dimension is 3, expected 2: the studies safety, collapse, excavation, embankment and slope"
    path = variant(
        tmp_path, "[boundaries.left]\nhead = 4.0\n[points]\na = [0.0, 1.0]\n[soils.ground]\nconductivity = 1e-6\n"
    )
    with pytest.raises(mpm.InputError, match=refused):
        read_water_table(path, needed=())
    with pytest.raises(mpm.InputError, match=refused):
        read_consolidation_site(path, COMM)
    with pytest.raises(mpm.InputError, match=refused):
        study_main.main("seepage", ["--site", path, "--output", tmp_path / "out"])
