"""Soil that is placed and removed while the ground below it consolidates."""

from __future__ import annotations

import numpy as np
import pytest
from consolidation_cases import ELEMENTS, layer_settled
from dolfinx.mesh import compute_midpoints, locate_entities, meshtags
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water

LEFT, RIGHT, BASE, GROUND, UPPER = 1, 2, 3, 9, 10
CLAY, FIRST, SECOND = 1, 2, 3
LAYER, WEIGHT, OF_WATER = 0.2, 20e3, 9810.0
LAW = mpm.LinearElastic(young=10e6, poisson=0.3)
M = LAW.p_wave_modulus
SETTLES = LAYER * WEIGHT / M
"""Final settlement of the clay under a layer"""
PERIOD = OF_WATER / (1e-8 * M)
"""H^2 / c_v of 1 m of clay that drains upwards [s]"""


def _ground(width=0.2, columns=1, rows=20, beside=0):
    """Clay, 1 m, below two layers of fill; facets at height 1 and between the layers have tags too.

    beside: columns of cells beside the fill
    """
    domain, _, facets = bridge.box_mesh(
        MPI.COMM_WORLD, (width, 1.0 + 2 * LAYER), (columns, round(rows * (1 + 2 * LAYER)))
    )
    cells = np.arange(len(bridge.mesh.tagged.tag_values(domain, None, 2)), dtype=np.int32)
    x, y = compute_midpoints(domain, 2, cells)[:, :2].T
    tags = np.where(y < 1.0, CLAY, np.where((y < 1.0 + LAYER) & (x < width * (1 - beside / columns)), FIRST, SECOND))
    values = dict(zip(facets.indices, facets.values))
    for tag, height in ((GROUND, 1.0), (UPPER, 1.0 + LAYER)):
        values |= dict.fromkeys(locate_entities(domain, 1, lambda p: np.abs(p[1] - height) < 1e-9), tag)
    indices = np.array(sorted(values), dtype=np.int32)
    numbers = np.array([values[i] for i in indices], dtype=np.int32)
    return domain, meshtags(domain, 2, cells, tags.astype(np.int32)), meshtags(domain, 1, indices, numbers)


def _model(mesh, element, fill=None, boundary=None):
    domain, cell_tags, facets = mesh
    soils = {CLAY: water.PorousSoil(1e-8, porosity=0.5), FIRST: fill, SECOND: None}
    supports = [bridge.roller(LEFT, (1, 0)), bridge.roller(RIGHT, (1, 0)), bridge.fixed(BASE)]
    model = water.Consolidation(
        domain, {tag: LAW for tag in soils}, soils, facets, supports, boundary or [water.Reservoir(GROUND, 1.0)],
        load=bridge.Load(unit_weight={CLAY: OF_WATER, FIRST: WEIGHT, SECOND: WEIGHT}), element=element, cell_tags=cell_tags,
        water_modulus=np.inf,
    )  # fmt: skip
    model.reconfigure(off=[FIRST, SECOND])
    model.initialise(pore_pressure=lambda x: OF_WATER * (1.0 - x[:, 1]))
    return model


def _settled(model):
    return -model.evaluate_at([[0.1, 1.0]])["displacement"][0, 1]


def _run(model, factor, first=1e-3, growth=1.1):
    reports = model.run(until=factor * PERIOD, first_step=first * PERIOD, growth=growth)
    assert all(report.converged and abs(report.water_error) < 1e-10 for report in reports)


@ELEMENTS
def test_layers_of_fill_settle_as_the_sum_of_loads_on_terzaghis_layer(element):
    model = _model(_ground(), element)
    model.reconfigure(off=[SECOND])
    _run(model, 0.2)
    assert _settled(model) == pytest.approx(SETTLES * layer_settled(0.2), rel=0.01)
    model.reconfigure()  # changes nothing, nor what is not there
    assert _settled(model) == pytest.approx(SETTLES * layer_settled(0.2), rel=0.01) and len(model.off) == 1
    model.reconfigure(off=())
    _run(model, 0.5)
    assert _settled(model) == pytest.approx(SETTLES * (layer_settled(0.5) + layer_settled(0.3)), rel=0.01)
    model.reconfigure(off=[SECOND])  # it is taken away again
    _run(model, 0.6)
    expected = SETTLES * (layer_settled(0.6) + layer_settled(0.4) - layer_settled(0.1))
    assert _settled(model) == pytest.approx(expected, rel=0.01)


def _settled_slowly(step):
    """Settlements at T = 0.16 and 0.5 of a layer that is placed until T = 0.3, in equal steps."""
    model, found = _model(_ground(columns=4), water.Element.STABILISED), []
    model.reconfigure(off=[SECOND], duration=0.3 * PERIOD)
    for factor in (0.16, 0.5):
        _run(model, factor, step, 1.0)
        found.append(_settled(model) / SETTLES)
    return np.array(found)


def test_a_layer_that_is_placed_slowly_settles_as_under_a_load_that_rises():
    """Olson (1977), Journal of the Geotechnical Engineering Division 103, GT1; from two steps, whose error is of first order."""
    m = np.pi * (2 * np.arange(200) + 1) / 2
    rising = lambda factor: (factor - np.sum(2 / m**4 * (1 - np.exp(-(m**2) * factor)))) / 0.3
    found = 2 * _settled_slowly(0.01) - _settled_slowly(0.02)
    assert found == pytest.approx([rising(0.16), rising(0.5) - rising(0.2)], rel=5e-3)


def test_clay_that_is_dug_away_under_water_lets_the_ground_heave():
    """What goes is its buoyant weight; water flows in, and stands on the new surface."""
    clay = water.PorousSoil(1e-8, porosity=0.5)
    level = 1.0 + LAYER
    model = _model(_ground(), water.Element.TAYLOR_HOOD, clay, [water.Reservoir(UPPER, level)])
    model.reconfigure(off=[SECOND])
    buoyant = WEIGHT - OF_WATER
    stress = np.zeros_like(model.points.stress)
    stress[:, 1] = -buoyant * np.clip(level - model.points.coordinates()[:, 1], 0.0, LAYER)
    model.initialise(stress, pore_pressure=lambda x: OF_WATER * (level - x[:, 1]))
    _run(model, 0.1, 0.05)
    assert abs(_settled(model)) < 1e-9 * SETTLES
    model.boundary = [water.Reservoir(GROUND, level)]
    model.reconfigure(off=[FIRST, SECOND])
    _run(model, 0.4)
    assert _settled(model) == pytest.approx(-buoyant * LAYER / M * layer_settled(0.3), rel=0.01)


@ELEMENTS
@pytest.mark.parametrize("fill", [False, True])
def test_level_ground_rests_while_the_water_over_it_rises_in_a_stage_that_takes_time(element, fill):
    """Pores below follow the water at once, and so does its weight, which is not held as that of a fill far away is."""
    columns = 40
    model = _model(_ground(8.0, columns, 10, 30), element, boundary=[water.Reservoir(GROUND, 3.0)])
    model.initialise(pore_pressure=lambda x: OF_WATER * (3.0 - x[:, 1]))
    _run(model, 0.05, 0.05)
    model.boundary = [water.Reservoir(GROUND, 1.5)]
    model.reconfigure(off=[SECOND] if fill else [FIRST, SECOND], duration=2 * PERIOD)
    _run(model, 0.2, 0.05)
    far = abs(model.evaluate_at([[7.9, 1.0]])["displacement"]).max()
    assert far < (3e-3 if fill else 1e-12) * 1.5 * OF_WATER / M  # the fill moves the ground beside it a little


def test_a_fill_that_dries_weighs_what_its_water_leaves():
    loam = water.VanGenuchten(alpha=5e-4, n=2.0, residual=0.1)
    fill = water.PorousSoil(1e-6, porosity=0.4, retention=loam)
    model = _model(_ground(), water.Element.STABILISED, fill)
    model.reconfigure(off=[SECOND], pore_pressure=lambda x: OF_WATER * (1.0 - x[:, 1]))
    _run(model, 20.0, 0.1, 2.0)
    heights = (np.arange(200) + 0.5) * LAYER / 200
    dried = [1 - loam.saturation(OF_WATER * z) for z in heights]
    expected = LAYER * (WEIGHT - 0.4 * OF_WATER * np.mean(dried)) / M
    assert np.mean(dried) > 0.1
    assert _settled(model) == pytest.approx(expected, rel=2e-3)


def test_ground_settles_in_the_end_as_quasi_static_elements_do():
    """A fill over a part of the ground; what drains away leaves the displacements of the soil alone."""
    mesh = _ground(width=2.0, columns=8, rows=5, beside=5)
    domain, cell_tags, facets = mesh
    model = _model(mesh, water.Element.TAYLOR_HOOD)
    model.reconfigure(off=[SECOND])
    _run(model, 100.0, 1.0, 4.0)
    supports = [bridge.roller(LEFT, (1, 0)), bridge.roller(RIGHT, (1, 0)), bridge.fixed(BASE)]
    fem = bridge.QuasiStatic(domain, {tag: LAW for tag in (CLAY, FIRST, SECOND)}, facets, supports, cell_tags=cell_tags)
    fem.reconfigure(off=[SECOND])
    fem.solve(bridge.Load(unit_weight={FIRST: WEIGHT}))
    places = [[0.1, 1.0], [0.7, 1.0], [0.5, 1.2], [1.5, 1.0], [0.7, 0.5]]
    there, expected = (one.evaluate_at(places)["displacement"] for one in (model, fem))
    assert there == pytest.approx(expected, abs=1e-6 * np.abs(expected).max())


def test_refuses_what_cannot_be_placed():
    model = _model(_ground(rows=5), water.Element.STABILISED)
    with pytest.raises(mpm.InputError, match="off: no soil with water is left"):
        model.reconfigure(off=[CLAY, SECOND])
    with pytest.raises(mpm.InputError, match="duration is -1.0 s"):
        model.reconfigure(duration=-1.0)
    with pytest.raises(mpm.InputError, match="off"):
        model.reconfigure(off=["peat"])
    with pytest.raises(mpm.InputError, match="pore_pressure has shape"):
        model.reconfigure(pore_pressure=lambda x: x)


def test_particles_take_over_the_soil_that_is_there():
    """A fill that drains at once is saturated soil at zero pressure to them."""
    mesh = _ground(rows=10)
    model = _model(mesh, water.Element.STABILISED)
    model.reconfigure(off=[SECOND])
    _run(model, 0.2, 0.05)
    particles = mpm.Model(bridge.background_mesh(*mesh), LAW)
    for tag, weight in ((CLAY, OF_WATER), (FIRST, WEIGHT)):
        particles.seed(density=weight / 9.81, per_cell=3, cell_tag=tag)
    for side in (LEFT, RIGHT):
        particles.roller(side, (1, 0))
    particles.fix(BASE)
    particles.set_gravity((0.0, -9.81))
    particles.add_water(porosity=0.5, conductivity=1e-8, modulus=np.inf)
    particles.hold_pore_pressure(GROUND, level=1.0)
    assert bridge.initialise(particles, model, equilibrate=False).unbalanced_ratio < 1e-9
    p = particles.particles
    in_fill = p.position[:, 1] > 1.0
    excess = p.pore_pressure[~in_fill] - OF_WATER * (1.0 - p.position[~in_fill, 1])
    assert np.abs(p.pore_pressure[in_fill]).max() < 1e-6 * OF_WATER and excess.max() > 0.5 * LAYER * WEIGHT


def test_smooth_stresses_are_those_of_the_soil_that_is_there():
    """Not halved by the stress of zero of cells that are not there: below the surface of the first layer of fill."""
    model = _model(_ground(), water.Element.STABILISED)
    model.reconfigure(off=[SECOND])
    _run(model, 0.01)
    stress = model.stress_function().x.array.reshape(-1, 4)
    smooth = model.stress_function(smooth=True)
    border = model.evaluate_at([[x, 1.0 + LAYER] for x in (0.05, 0.1, 0.15)])["stress"]
    assert (border[:, 1] < -100).all()
    domain, cell_tags, _ = _ground()
    height = compute_midpoints(domain, 2, np.arange(len(stress), dtype=np.int32))[:, 1]
    top = (height > 1.15) & (height < 1.0 + LAYER)
    nodes = smooth.function_space.tabulate_dof_coordinates()[:, 1]
    found = smooth.x.array.reshape(-1, 4)[np.abs(nodes - 1.0 - LAYER) < 1e-9, 1]
    assert found.size and top.any() and stress[top, 1].max() < 0
    assert (stress[top, 1].min() <= found).all() and (found <= stress[top, 1].max()).all()
