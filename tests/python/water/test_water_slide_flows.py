"""Slides in which water flows: conductivities that differ with the direction, and the levels of reservoirs."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water

STUDIES = Path(__file__).parents[3] / "studies"
LAW = mpm.LinearElastic(young=10e6, poisson=0.3)
DAY = 86400.0


def filled(conductivity, *boundary):
    """Particles that `let_water_flow` has filled, with two laws for the soil as at a slide."""
    from common.water.slides import let_water_flow

    domain, cell_tags, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, (4.0, 2.0), (8, 4), body=((0.0, 0.0), (4.0, 1.0)))
    model = mpm.Model(bridge.background_mesh(domain, cell_tags, facet_tags), [LAW, LAW])
    model.seed(density=2000.0, per_cell=3, cell_tag=bridge.BODY)
    site = SimpleNamespace(laws={bridge.BODY: LAW}, cell_tags=cell_tags)
    slope = SimpleNamespace(site=site, porous={bridge.BODY: water.PorousSoil(conductivity)}, boundary=list(boundary))
    let_water_flow(slope, SimpleNamespace(time=0.0, pore_pressure=lambda x: 0 * x[:, 0]), model)
    return model


@pytest.mark.parametrize(
    "conductivity", [(1e-5, 1e-7), water.dipping(1e-5, 1e-7, 20.0), water.dipping(1e-5, 1e-6, 5.0), 1e-6]
)
def test_particles_have_the_conductivities_of_the_soil(conductivity):
    model = filled(conductivity)
    expected = water.PorousSoil.tensor(conductivity, 2)
    tensors = model._core.water.anisotropy or [np.eye(3)] * 2
    for tensor in tensors:
        of_particles = model.particles.conductivity[:, None, None] * np.asarray(tensor)[:2, :2]
        assert of_particles == pytest.approx(np.broadcast_to(expected, of_particles.shape), rel=1e-12, abs=1e-20)
    assert len(tensors) == 2


def of_levels(*levels, times=()):
    boundary = [water.Reservoir(name, level) for name, level in zip(("left", "right"), levels)]
    return SimpleNamespace(boundary=boundary, times=lambda end: [time for time in times if time <= end])


def test_reservoirs_of_different_levels_are_refused():
    from common.water.slides import require_one_level

    same = ((0.0, 5.0), (DAY, 3.0))
    require_one_level(of_levels(), DAY)
    require_one_level(of_levels(1.8), DAY)
    require_one_level(of_levels(same, same, times=[DAY]), 2 * DAY)
    with pytest.raises(mpm.InputError, match="1.8 m at 'left', 1.1 m at 'right' after 0 days; expected one level"):
        require_one_level(of_levels(1.8, 1.1), DAY)
    with pytest.raises(mpm.InputError, match="3 m at 'left', 5 m at 'right' after 1 day; expected one level"):
        require_one_level(of_levels(same, 5.0, times=[DAY]), 2 * DAY)


def test_they_are_refused_before_any_work(tmp_path, monkeypatch):
    import drawdown
    from common.slope.site import SlopeSite

    meshes = STUDIES.parent / "meshes"
    text = (meshes / "drawdown.toml").read_text().replace('"bank_on_ground.geo"', f'"{meshes}/bank_on_ground.geo"')
    (tmp_path / "site.toml").write_text(text + "\n[boundaries.crest]\nreservoir = 9.0\n")
    monkeypatch.setattr(SlopeSite, "seepage", lambda *_: pytest.fail("the flow is computed"))
    arguments = f"--cell-size 2 --site {tmp_path}/site.toml --output {tmp_path}/results --slide --slide-water flows"
    with pytest.raises(
        mpm.InputError, match="--slide-water is flows and the reservoirs have different levels, .*9 m at 'crest'"
    ):
        drawdown.main(arguments.split())


def test_a_slide_through_strata_that_dip_begins_in_equilibrium(tmp_path, without_pictures):
    import json

    import drawdown

    meshes = STUDIES.parent / "meshes"
    text = (meshes / "drawdown.toml").read_text().replace('"bank_on_ground.geo"', f'"{meshes}/bank_on_ground.geo"')
    for old, new in (
        ("conductivity = 3e-7", "conductivity = [3e-7, 3e-8]\ndip = 20.0"),
        ("= 4e3", "= 2e3"),
        ("= 27.0", "= 20.0"),
    ):
        assert old in text
        text = text.replace(old, new)
    (tmp_path / "site.toml").write_text(text)
    options = "--cell-size 2 --elements P1 --factor-times 1 --days 3 --slide --slide-from lowest --slide-water flows --time 0.2"
    options += f" --frames 2 --particles-per-cell 3 --no-film --site {tmp_path}/site.toml --output {tmp_path}/results"
    assert drawdown.main(options.split()) == 0
    summary = json.loads((tmp_path / "results" / "summary.json").read_text())
    assert summary["initial_out_of_balance_ratio"] < 1e-9 and summary["largest_displacement_m"] > 1e-3
