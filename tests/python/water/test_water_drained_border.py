"""Soil that is to drain at its free surface, and ends at the top of the mesh: a run says that nothing drains there."""

import warnings

import numpy as np
import pytest
from core_cases import box

import mpm_core as mpm

LAW = mpm.LinearElastic(young=1e6, poisson=0.0)


def column(dim=2, rows=4, height=1.0, top=None, geometry=None, drained=True):
    """Fresh soil up to a height [m] in a mesh of 1 m, which consolidates; top: what describes the facets above."""
    options = {} if geometry is None else {"geometry": geometry}
    mesh = box([2] * (dim - 1) + [rows], body=([0.0] * dim, [1.0] * (dim - 1) + [height]))
    model = mpm.Model(mesh, LAW, **options)
    model.seed(density=2000.0, per_cell={2: 6, 3: 8}[dim], cell_tag=1)
    for axis in range(dim):
        for end in (1, 2) if axis < dim - 1 else (1,):
            model.roller(2 * axis + end, np.eye(dim)[axis])
    model.add_water(porosity=0.4, conductivity=1e-5, drained_surface=drained)
    model.set_gravity([0.0] * (dim - 1) + [-9.81])
    if top:
        top(model, 2 * dim)
    return model


def said(model):
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        list(model.implicit(10.0, dt=5.0, quasi_static=True, small_displacements=True))
    return [str(one.message) for one in found if "drained_surface" in str(one.message)]


@pytest.mark.parametrize("dim, geometry", [(2, None), (2, mpm.Geometry.AXISYMMETRIC), (3, None)])
def test_a_column_that_fills_its_mesh_does_not_drain_and_says_so(dim, geometry):
    full = column(dim, geometry=geometry)
    (words,) = said(full)
    top = {2: "1 m, between (0, 1) and (1, 1) m", 3: "1 m2, between (0, 0, 1) and (1, 1, 1) m"}[dim]
    assert f"has no effect: over {top}, the soil ends at the top of the mesh" in words
    assert full.water_inflow() == pytest.approx(0.0, abs=1e-12)
    below = column(dim, height=0.75, geometry=geometry)
    assert said(below) == []
    assert below.water_inflow() < -1e-8


def test_nothing_is_said_where_it_was_not_asked_for():
    assert said(column(drained=False)) == []


@pytest.mark.parametrize(
    "top",
    [
        lambda model, tag: model.hold_pore_pressure(tag, 0.0),
        lambda model, tag: model.hold_pore_pressure(tag, level=1.5),
        lambda model, tag: [model.roller(tag, (0, 1)), model.hold_pore_pressure(1, 0.0)],
        lambda model, tag: [model.fix(tag), model.hold_pore_pressure(1, 0.0)],
    ],
    ids=["drained", "standing water", "smooth lid", "rough lid"],
)
def test_a_top_that_is_described_is_left_alone(top):
    assert said(column(top=top)) == []


def test_a_roller_along_the_top_is_no_lid():
    (words,) = said(column(top=lambda model, tag: model.roller(tag, (1, 0))))
    assert "has no effect: over 1 m" in words
    (words,) = said(column(top=lambda model, tag: model.press_surface(tag, 1e3)))
    assert "has no effect: over 1 m" in words


def test_a_lid_over_soil_whose_water_leaves_nowhere():
    (words,) = said(column(top=lambda model, tag: model.fix(tag)))
    assert "has no effect: the soil fills the mesh" in words


def test_a_block_beside_empty_cells_drains_in_part():
    # 8 cells of 0.25 m along 2 m, of which the left half has soil, up to the top of the mesh. Its free surface is the vertical
    # face at x = 1 m, which cuts the cells beside it: these are left out of the length.
    mesh = box([8, 4], (2.0, 1.0), body=((0.0, 0.0), (1.0, 1.0)))
    model = mpm.Model(mesh, LAW)
    model.seed(density=2000.0, per_cell=6, cell_tag=1)
    model.fix(3)
    model.set_gravity((0.0, -9.81))
    model.add_water(porosity=0.4, conductivity=1e-5, drained_surface=True)
    (words,) = said(model)
    assert "does not drain all of the soil: over 0.75 m, between (0, 1) and (0.75, 1) m, the soil ends" in words


@pytest.mark.parametrize("part, drains", [(0.6, True), (0.9, False)])
def test_the_upper_row_of_cells_may_be_filled_in_part(part, drains):
    # A node at the top is in the soil if this fills more than half of its surroundings: (part)^2 in a row filled from below.
    model = mpm.Model(box([4, 4], diagonals="alternating"), LAW)
    x = (np.indices((80, 80)).reshape(2, -1).T + 0.5) / 80
    x = x[x[:, 1] < 0.75 + 0.25 * part]
    model.seed_points(x, np.full(len(x), 1 / 6400), density=2000.0)
    model.fix(3)
    model.set_gravity((0.0, -9.81))
    model.add_water(porosity=0.4, conductivity=1e-5, drained_surface=True)
    assert (said(model) == []) == drains
    assert (model.water_inflow() < -1e-9) == drains
