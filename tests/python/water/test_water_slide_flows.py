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


def column(conductivity, table=4.0, height=8.0):
    """A column of soil on rigid ground in equilibrium, its site, and an instant with a water table; no water above it."""
    cells = 2, round(4 * height) + 2
    mesh = bridge.box_mesh(MPI.COMM_WORLD, (0.5, height + 0.5), cells, body=((0, 0), (0.5, height)))
    model = mpm.Model(bridge.background_mesh(*mesh), [LAW, LAW])
    model.seed(density=2000.0, per_cell=3, cell_tag=bridge.BODY)
    for side in (1, 2):
        model.roller(side, (1, 0))
    model.fix(3)
    model.set_gravity((0.0, -9.81))
    pressure = lambda x: 9810.0 * np.maximum(table - x[:, 1], 0.0)
    depth, p = height - model.particles.position[:, 1], pressure(model.particles.position)
    vertical = p - 2000.0 * 9.81 * depth
    model.particles.set("stress", np.outer(vertical, (3 / 7, 1.0, 3 / 7, 0.0)))
    site = SimpleNamespace(laws={bridge.BODY: LAW}, cell_tags=mesh[1])
    soil = water.PorousSoil(conductivity)
    slope = SimpleNamespace(site=site, porous={bridge.BODY: soil}, boundary=[], body=mesh)
    return model, slope, SimpleNamespace(time=0.0, pore_pressure=pressure)


def test_water_that_enters_raises_the_table_as_a_bend_that_diffuses():
    """c = k M / gamma_w = 0.137 m2/s: after 5 s the head at the table, 4 m below the surface, has risen by sqrt(c t / pi) = 0.47 m."""
    from common.water.slides import let_water_flow, rise_of_water

    model, slope, instant = column(conductivity=1e-4)
    let_water_flow(slope, instant, model)
    for _ in model.implicit(5.0, dt=0.1, quasi_static=True, small_displacements=True):
        pass
    p = model.particles
    near = np.abs(p.position[:, 1] - 4.0) < 0.6
    line = np.polyfit(p.position[near, 1] - 4.0, p.pore_pressure[near], 2)
    rise = rise_of_water(1e-4, LAW.p_wave_modulus, 5.0)
    assert rise == pytest.approx(np.sqrt(1e-4 * 10e6 * 0.7 / (1.3 * 0.4) / 9810 * 5 / np.pi))
    assert line[-1] / 9810 == pytest.approx(rise, rel=0.03)


@pytest.mark.parametrize(
    ("conductivity", "table", "said"), [(1e-4, 4.0, 0.47), (1e-4, 8.0, None), (1e-4, 7.7, 0.3), (1e-7, 4.0, None)]
)
def test_water_that_enters_a_slide_is_said(conductivity, table, said, recwarn):
    """Where it raises the table by more than 2 % of the height, and no farther than to the surface."""
    from common.water.slides import warn_of_entering_water

    model, slope, instant = column(conductivity, table)
    warn_of_entering_water(slope, instant, model, 5.0)
    texts = [str(one.message) for one in recwarn if "--slide-water is flows" in str(one.message)]
    assert len(texts) == (said is not None)
    if said:
        number = float(texts[0].partition("by some ")[2].split(" m ")[0])
        assert number == pytest.approx(said, abs=0.15)
        assert "in the 5 s of the slide" in texts[0] and "--slide-water still" in texts[0]
