"""Sites whose stages release a part of their forces: tunnels, their trough at the surface and the volume loss."""

import json
from pathlib import Path

import excavation
import numpy as np
import pytest
from common.field_plots import Field
from common.site.file import read_site
from common.stages.plots import StagePicture
from common.stages.runs import carry_out
from common.stages.surface import surface_picture, surface_rows
from mpi4py import MPI
from study_main import ended

MESHES = Path(__file__).parents[3] / "meshes"
pytestmark = pytest.mark.usefixtures("without_pictures")
RADIUS, DEPTH = 3.0, 13.0  # m, of the axis
IN_SITU = '[[stages]]\nname = "in situ"\nfill = ["ground", "core"]\n'


def written(folder, text, constants="parts = 12"):
    path = folder / "site.toml"
    path.write_text(f'extends = "{MESHES}/tunnel.toml"\ncell_size = 0.8\nconstants = {{{constants}}}\n{text}')
    return path


def inward(fem):
    """Volume per metre [m2] by which half of the wall of the tunnel has become smaller."""
    angle = np.radians(np.linspace(-90, 90, 181))
    normal = np.column_stack([np.cos(angle), np.sin(angle)])
    normal[[0, -1], 0] = 0.0
    moved = fem.evaluate_at(RADIUS * (1 + 1e-4) * normal - [0.0, DEPTH])["displacement"]
    along = -np.sum(moved * normal, axis=1)
    return np.sum(np.diff(RADIUS * angle) * (along[1:] + along[:-1]) / 2)


def test_the_trough_of_a_tunnel_in_clay_that_keeps_its_volume_is_the_volume_by_which_the_tunnel_is_smaller(tmp_path):
    path = written(tmp_path, "[soils.ground]\npoisson = 0.4995\n[soils.core]\npoisson = 0.4995\n")
    site = read_site(path, MPI.COMM_WORLD, None, needed=("stages",))
    run = carry_out(site, 2, tmp_path, MPI.COMM_WORLD)
    _, core, lining = surface_rows(run.pictures, 1)
    assert lining["trough_m3_per_m"] == pytest.approx(inward(run.site.fem), rel=0.02)
    assert lining["volume_loss"] == pytest.approx(lining["trough_m3_per_m"] / (np.pi * RADIUS**2 / 2), rel=0.005)
    assert core["surface_settlement_m"] > lining["surface_settlement_m"] > 0.005
    assert run.forces[1].forces == {} and run.forces[2].forces["lining"].axial_force.max() < -100e3


def test_the_study_of_a_tunnel_says_its_volume_loss(tmp_path, capsys):
    code = excavation.main(
        ["--site", str(written(tmp_path, "")), "--elements", "P1", "--output", str(tmp_path / "out")]
    )
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    last = summary["stages"][-1]
    assert code == 0 and 0.005 < last["volume_loss"] < 0.02
    assert f"volume loss {last['volume_loss']:.2%}" in capsys.readouterr().out
    assert "volume_loss" not in summary["stages"][0]
    assert [stage.get("deconfinement") for stage in summary["stages"]] == [None, 0.5, None]


def test_a_pit_has_settlements_beside_it_and_no_volume_loss(tmp_path):
    path = tmp_path / "pit.toml"
    path.write_text(f'extends = "{MESHES}/braced_excavation.toml"\ncell_size = 2.0\n')
    excavation.main(["--site", str(path), "--elements", "P1", "--output", str(tmp_path / "out")])
    last = json.loads((tmp_path / "out" / "summary.json").read_text())["stages"][-1]
    assert "volume_loss" not in last and -0.01 < last["surface_settlement_m"] < 0.01


def sections(height, dug, displaced):
    """Ground 12 m wide of squares of 1 m, below a height in each column, before and after the squares `dug` go and all else moves."""
    x, y = (axis.ravel() for axis in np.meshgrid(np.arange(13.0), np.arange(5.0), indexing="ij"))
    corner = lambda i, j: 5 * i + j  # noqa: E731
    squares = [(i, j) for i in range(12) for j in range(4)]
    halves = [
        [(corner(i, j), corner(i + 1, j), corner(i + 1, j + 1)), (corner(i, j), corner(i + 1, j + 1), corner(i, j + 1))]
        for i, j in squares
    ]
    cells, points = np.array(halves).reshape(-1, 3), np.column_stack([x, y])
    there = np.repeat([j < height(i) for i, j in squares], 2)
    left = there & ~np.repeat([square in dug for square in squares], 2)
    moved = np.column_stack([np.zeros_like(x), -displaced(x)])
    return [StagePicture(name, Field(points, cells, values), alive, np.zeros(len(cells)))
            for name, values, alive in (("in situ", 0 * moved, there), ("tunnel", moved, left))]  # fmt: skip


def test_volume_loss_is_that_of_ground_which_is_level_over_its_whole_width():
    """A trough of 12 m by 0.1 m above a tunnel of 2 m2; below a bank 6 m wide only a part of the trough is at its crest."""
    tunnel = [(5, 1), (6, 1)]
    level = surface_rows(sections(lambda i: 4, tunnel, lambda x: 0.1 + 0 * x), 0)[-1]
    assert level["trough_m3_per_m"] == pytest.approx(1.2) and level["volume_loss"] == pytest.approx(0.6)
    bank = surface_rows(sections(lambda i: 4 if i < 6 else 3, tunnel, lambda x: 0.1 + 0 * x), 0)[-1]
    assert bank == {"surface_settlement_m": pytest.approx(0.1)}


def test_no_settlement_is_drawn_across_a_pit(monkeypatch, tmp_path):
    from common import figures

    figure = []
    monkeypatch.setattr(figures, "save_figure", lambda drawn, path: figure.append(drawn))
    surface_picture(sections(lambda i: 4, [(5, 3), (6, 3)], lambda x: 0.01 * x), tmp_path)["surface"]()
    curve = figure[0].axes[0].lines[1].get_xydata()  # of the points that remain
    assert np.flatnonzero(np.isnan(curve[:, 1])).tolist() == [6]
    assert curve[[5, 7]] == pytest.approx(np.array([(5.0, 50.0), (7.0, 70.0)]))


def test_a_last_stage_that_leaves_forces_held_is_said(tmp_path):
    path = written(tmp_path, IN_SITU + '[[stages]]\nname = "core"\nexcavate = "core"\ndeconfinement = 0.3\n')
    with pytest.warns(
        RuntimeWarning, match="the last stage, 'core', has deconfinement = 0.3, so that forces .* hold 70%"
    ):
        site = read_site(path, MPI.COMM_WORLD, None, needed=("stages",))
    assert [stage.deconfinement for stage in site.stages] == [1.0, 0.3]
    run = ended("safety", tmp_path / "out", "--site", path, "--meshes", "1", "--elements", "P1")
    assert run.returncode == 0 and "these forces support the ground in the factor of safety" in run.stderr
    run = ended("embankment", tmp_path / "slide", "--site", path, "--factor", "1", "--time", "0.01")
    assert (
        run.returncode == 2 and "expected deconfinement = 1 in the last stage before particles take over" in run.stderr
    )


@pytest.mark.parametrize("value", ["30", '"a third"', "true", "0.0"])
def test_a_deconfinement_that_is_no_fraction_is_named(tmp_path, value):
    path = written(tmp_path, f'{IN_SITU}[[stages]]\nname = "core"\nexcavate = "core"\ndeconfinement = {value}\n')
    said = ended("excavation", tmp_path / "out", "--site", path, "--elements", "P1").stderr
    assert "stage 'core': deconfinement is" in said and "expected a fraction above 0 and up to 1" in said


def test_soil_placed_at_once_is_no_comparison_for_stages_that_leave_forces_held(tmp_path):
    text = (MESHES / "excavation.toml").read_text().replace('"excavation.geo"', f'"{MESHES}/excavation.geo"')
    (tmp_path / "site.toml").write_text(text + "deconfinement = 0.5\n")
    with pytest.warns(RuntimeWarning, match="has deconfinement = 0.5"):
        excavation.main(["--site", str(tmp_path / "site.toml"), "--elements", "P1", "--output", str(tmp_path / "out")])
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["finished_run"] and "difference_to_at_once" not in summary
