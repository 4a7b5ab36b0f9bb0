"""A pressure on facets acts on the soil behind them: a run says once where the soil has left them."""

import warnings

import numpy as np
import pytest
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

LEFT, RIGHT, BASE, TOP = 1, 2, 3, 4
LAW = mpm.LinearElastic(young=1e6, poisson=0.0)


def column(cells, load):
    """A column 1 m high, drained at its top, which is loaded: it settles to exp(-q / E) of its height."""
    domain, _, tags = bridge.box_mesh(MPI.COMM_SELF, (0.2, 1.0), (2, cells))
    model = mpm.Model(bridge.background_mesh(domain, None, tags), LAW)
    model.seed(density=2000.0, per_cell=3)
    model.roller(LEFT, (1, 0))
    model.roller(RIGHT, (1, 0))
    model.fix(BASE)
    model.add_water(porosity=0.5, conductivity=1e-6, modulus=np.inf)
    model.hold_pore_pressure(TOP, 0.0)
    model.press_surface(TOP, load)
    return model


def said(model, until=1e5, **options):
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        list(model.implicit(until, dt=1e3, quasi_static=True, every=5e3, **options))
    return [str(one.message) for one in found if "has left facets" in str(one.message)]


def test_a_load_that_is_lost_is_said_once():
    # The column would settle by 1 - exp(-0.1) = 95 mm, but its cells are 50 mm high: it leaves the uppermost ones.
    model = column(20, 100e3)
    words = said(model)
    assert len(words) == 1 and f"facets with tag {TOP}, on which a pressure acts (press_surface" in words[0]
    assert not np.any(np.isin(model.particles.cell, top_cells(model)))
    low = model.particles.position[:, 1] < 0.1
    assert abs(model.particles.stress[low, 1].mean()) < 0.9 * 100e3  # the load is lost


def top_cells(model):
    at_top = np.abs(model.mesh.points[model.mesh.cells, 1] - 1.0) < 1e-9
    return np.flatnonzero(at_top.sum(axis=1) == 2)


@pytest.mark.parametrize("cells, load", [(20, 10e3), (10, 10e3)])
def test_nothing_is_said_where_soil_stays_behind_the_facets(cells, load):
    model = column(cells, load)
    assert said(model) == []
    low = model.particles.position[:, 1] < 0.1
    assert model.particles.stress[low, 1].mean() == pytest.approx(-load, rel=0.02)


def test_nothing_is_said_of_facets_without_pressure():
    model = column(20, 100e3)
    model.press_surface(LEFT, 0.0)
    assert len(said(model)) == 1
    model = column(20, 0.0)
    model.particles.set("traction", np.tile([0.0, -0.2 * 100e3 / len(model.particles)], (len(model.particles), 1)))
    assert said(model) == []
