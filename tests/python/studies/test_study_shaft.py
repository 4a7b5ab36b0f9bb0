"""Flow of water in axisymmetric sites: what the whole well or shaft takes, its pictures, and the wall of a shaft in water."""

import json
from pathlib import Path

import numpy as np
import pytest
from axisymmetric_cases import cylinder_particles
from common.movie import areas
from common.site.file import read_site
from common.slope.site import read_slope_site
from common.water.seepage_plots import flow_picture
from common.water.site import read_water_site
from mpi4py import MPI
from study_main import main

import mpm_core as mpm

MESHES = Path(__file__).parents[3] / "meshes"
SHAFT = (MESHES / "shaft.toml").read_text().replace("cell_size = 1.0", "cell_size = 2.0")
WELL = """
axisymmetric = true
mesh = "well.geo"
[soils.sand]
conductivity = 1e-4
porosity = 0.4
unit_weight = 20e3
young = 1e7
poisson = 0.3
cohesion = 1e4
friction_angle = 30.0
[boundaries.well]
head = 3.0
[boundaries.far]
head = 5.0
"""
RADII, THICK = (1.0, 6.0), 2.0
THIEM = 2 * np.pi * 1e-4 * THICK * 2.0 / np.log(RADII[1] / RADII[0])


def well_in(folder, text=WELL):
    lines = ['SetFactory("OpenCASCADE");', f"Rectangle(1) = {{{RADII[0]}, 0, 0, {RADII[1] - RADII[0]}, {THICK}}};",
             'Physical Surface("sand") = {1};', 'Physical Curve("base") = {1};', 'Physical Curve("far") = {2};',
             'Physical Curve("well") = {4};', "Mesh.MeshSizeMax = 0.25;"]  # fmt: skip
    (folder / "well.geo").write_text("\n".join(lines) + "\n")
    (folder / "well.toml").write_text(text)
    return folder / "well.toml"


def shaft_in(folder, text=SHAFT):
    (folder / "dewatered_excavation.geo").write_text((MESHES / "dewatered_excavation.geo").read_text())
    (folder / "shaft.toml").write_text(text)
    return folder / "shaft.toml"


def test_the_study_seepage_has_the_flow_to_a_whole_well(tmp_path, capsys):
    """Thiem: 2 pi k D (h2 - h1) / ln(r2 / r1); 0.4 pi (r2^2 - r1^2) D of water is stored."""
    folder = tmp_path / "out"
    assert main("seepage", ["--site", str(well_in(tmp_path)), "--elements", "P2", "--output", str(folder)]) == 0
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["steady_inflow_far_m3_per_day"] == pytest.approx(86400 * THIEM, rel=1e-4)
    assert summary["steady_inflow_well_m3_per_day"] == pytest.approx(-86400 * THIEM, rel=1e-4)
    assert summary["stored_water_m3"] == pytest.approx(0.4 * np.pi * (RADII[1] ** 2 - RADII[0] ** 2) * THICK, rel=1e-4)
    said = capsys.readouterr().out
    assert f"inflow, far: {86400 * THIEM:.4g}"[:-2] in said and "m3/day all around the axis" in said
    assert not any("m2" in key for key in summary) and "litres" not in said


def test_an_axisymmetric_flow_in_time_has_units_of_the_whole_ring(tmp_path):
    """A confined aquifer whose heads fall: what it releases leaves at the well and far from it, to round-off."""
    text = WELL.replace("head = 3.0", "head = [[0.0, 5.0], [0.001, 3.0]]").replace(
        "porosity = 0.4", "porosity = 0.4\ncompressibility = 1e-6"
    )
    folder = tmp_path / "out"
    arguments = ["--site", str(well_in(tmp_path, text)), "--days", "0.01", "--frames", "2", "--output", str(folder)]
    assert main("seepage", [*arguments, "--no-film"]) == 0
    rows = np.genfromtxt(folder / "history.csv", delimiter=",", names=True)
    entered = np.diff(rows["time_days"]) * (rows["inflow_well_m3_per_day"] + rows["inflow_far_m3_per_day"])[1:]
    assert np.diff(rows["stored_water_m3"]) == pytest.approx(entered, abs=1e-9 * rows["stored_water_m3"][0])
    assert (folder / "inflow.png").exists()


def test_pictures_of_an_axisymmetric_flow_are_half_sections(tmp_path):
    for text, half in ((WELL, True), (WELL.replace("axisymmetric = true", ""), False)):
        flow = read_water_site(well_in(tmp_path, text), MPI.COMM_WORLD).seepage(1)
        flow.solve()
        assert flow_picture(flow, "well").head.half_section == half


def test_a_shaft_takes_what_its_plug_and_the_ground_below_let_through(tmp_path):
    """Through the plug of soil inside the wall, of length L and radius R, then out of its end: as out of a disc in endless ground,
    8 k R, at most, and as out of one at an impervious surface, 4 k R, at least."""
    site = read_site(shaft_in(tmp_path), MPI.COMM_WORLD)
    still, _, shallow, deep = (stage.pore_pressure and stage.pore_pressure.flow for stage in site.stages)
    assert abs(still.inflow("right")) < 1e-12
    for flow, floor, fall, plug in ((shallow, "floor 1", 3.0, 13.0), (deep, "floor 2", 8.0, 8.0)):
        whole = 2 * np.pi * flow.inflow("right")
        assert flow.inflow(floor) == pytest.approx(-flow.inflow("right"), rel=1e-8)
        least, most = (1e-4 * fall / (plug / (np.pi * 4.0**2) + 1 / (part * 4.0)) for part in (4, 8))
        assert least < whole < most


def test_the_study_excavation_has_the_flow_of_a_whole_shaft_and_the_water_on_its_wall(tmp_path, capsys):
    """Soft soil hardly holds the stiff wall, on which water presses from outside: the hoop force is p R."""
    folder = tmp_path / "out"
    assert main("excavation", ["--site", str(shaft_in(tmp_path)), "--elements", "P1", "--output", str(folder)]) == 0
    last = json.loads((folder / "summary.json").read_text())["stages"][-1]
    flow = read_site(tmp_path / "shaft.toml", MPI.COMM_WORLD).stages[-1].pore_pressure.flow
    assert last["inflow_right_m3_per_day"] == pytest.approx(86400 * 2 * np.pi * flow.inflow("right"), rel=1e-9)
    said = capsys.readouterr().out
    assert f"flow of 'dug to 10 m', right: {last['inflow_right_m3_per_day']:.4g} m3/day all around the axis" in said
    assert (folder / "stages_flow.png").exists() and not any("m2_per_day" in key for key in last)
    # At the floor, 8 m below the groundwater, water alone presses by 9.81 (8 - some) kPa on 4 m of radius.
    assert last["wall_hoop_force_N_per_m"] < -0.8 * 9810.0 * 8.0 * 4.0


def test_particles_of_an_axisymmetric_body_are_drawn_by_their_areas():
    """A cylinder of 1 m by 1 m has a section of 1 m2, and half a cubic metre per radian."""
    model = cylinder_particles(per_cell=12)
    volume, position = model.particles.volume, model.particles.position
    assert volume.sum() == pytest.approx(0.5) and areas(model, volume, position).sum() == pytest.approx(1.0, rel=1e-2)


def test_studies_of_plane_slopes_refuse_an_axisymmetric_site(tmp_path):
    with pytest.raises(mpm.InputError, match="axisymmetric is True, expected false: this study has plane sections"):
        read_slope_site(well_in(tmp_path), MPI.COMM_WORLD)
    with pytest.raises(mpm.InputError, match="axisymmetric is 1, expected true or false"):
        read_water_site(well_in(tmp_path, WELL.replace("= true", "= 1", 1)), MPI.COMM_WORLD)
