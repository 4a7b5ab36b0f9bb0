"""The space that particles take, and the pieces of a body that has come apart."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from core_cases import DIMS, box, run
from mpm_core.energy import EnergyWatch
from mpm_core.space import swollen

import mpm_core as mpm

SOIL = mpm.LinearElastic(young=1e5, poisson=0.3)


def blocks(dim, *bodies, cells=8):
    """Particles in boxes, each (low, high), of a unit box of cells."""
    model = mpm.Model(box([cells] * dim), SOIL)
    centres = (np.indices([4 * cells] * dim).reshape(dim, -1).T + 0.5) / (4 * cells)
    for low, high in bodies:
        inside = ((centres > np.array(low)) & (centres < np.array(high))).all(axis=1)
        model.seed_points(centres[inside], np.full(inside.sum(), (0.25 / cells) ** dim), density=1000.0)
    return model


@pytest.mark.parametrize("dim", DIMS)
def test_a_full_body_fills_its_volume_and_one_twice_in_place_half_of_it(dim):
    low, high = [0.25] * dim, [0.75] * dim
    once, twice = blocks(dim, (low, high)), blocks(dim, (low, high), (low, high))
    filled = mpm.space(once)
    assert filled.particles == pytest.approx(0.5**dim, rel=1e-9)
    assert filled.filled <= filled.particles
    doubled = mpm.space(twice)
    assert doubled.particles == pytest.approx(2 * 0.5**dim, rel=1e-9)
    assert doubled.filled <= 0.5**dim * (1 + 1e-9)


@pytest.mark.parametrize("dim", DIMS)
def test_bodies_are_parts_when_no_node_is_common_to_their_cells(dim):
    rest = [1.0] * (dim - 1)
    zero = [0.0] * (dim - 1)
    apart = blocks(dim, ([0.0, *zero], [0.25, *rest]), ([0.5, *zero], [1.0, *rest]))
    assert mpm.parts(apart) == pytest.approx([500.0, 250.0])
    # One empty row of cells between them is one without common nodes; without it the two sides share those of the border.
    touching = blocks(dim, ([0.0, *zero], [0.25, *rest]), ([0.25, *zero], [1.0, *rest]))
    assert mpm.parts(touching) == pytest.approx([1000.0])


def test_a_body_that_is_pulled_apart_is_said_to_be_in_parts():
    model = blocks(2, ([0.25, 0.0], [0.75, 1.0]), cells=16)
    x = model.particles.position[:, 0]
    model.particles.set("velocity", np.column_stack([np.where(x < 0.5, -0.2, 0.2), 0 * x]))
    soft = mpm.Model(model.mesh, mpm.LinearElastic(young=1.0, poisson=0.0))
    soft.seed_points(model.particles.position, model.particles.volume, density=1000.0)
    soft.particles.set("velocity", model.particles.velocity)
    with pytest.warns(RuntimeWarning, match="2 parts"):
        run(soft, 1.0, dt=1 / 300, energy_limit=None)
    assert len(mpm.parts(soft)) == 2


def test_particles_that_crowd_are_said_to_lose_space():
    model = blocks(2, ([0.25, 0.25], [0.75, 0.75]), ([0.25, 0.25], [0.75, 0.75]))
    with pytest.warns(RuntimeWarning, match="fill 50 % of their volume at t = 0.001 s: they did so at the start"):
        run(model, 1e-3, dt=1e-3 / 256)
    once = blocks(2, ([0.25, 0.25], [0.75, 0.75]))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        once.particles.set("velocity", np.full((len(once.particles), 2), 1e-3))
        run(once, 1e-3, dt=1e-3 / 256)
    once.place(0.5 + 0.5 * (once.particles.position - 0.5))  # four times as many in each cell, which keep their volumes
    with pytest.warns(RuntimeWarning, match="of their volume at t = 0.002 s: they accumulate in some cells"):
        run(once, 2e-3, dt=1e-3 / 256)


def test_particles_that_crowd_more_than_at_the_start_are_said_to_accumulate():
    model = blocks(2, ([0.25, 0.25], [0.75, 0.75]), ([0.25, 0.25], [0.75, 0.75]))
    with pytest.warns(RuntimeWarning, match="fill 50 % of their volume at t = 0.001 s: they did so at the start"):
        run(model, 1e-3, dt=1e-3 / 256)
    model.place(0.5 + 0.5 * (model.particles.position - 0.5))  # a quarter of the area
    text = "fill 1. % of .*: they filled 50 % at the start, .* Since then they accumulate in some cells"
    with pytest.warns(RuntimeWarning, match=text):
        run(model, 2e-3, dt=1e-3 / 256)


def test_energy_that_swollen_particles_may_generate_is_reported_with_their_size():
    """A quarter of a cell in each direction, blown up to three cells; others than the largest do not matter."""
    model = blocks(2, ([0.25, 0.25], [0.75, 0.75]))
    assert not swollen(model)
    volume = model.particles.volume.copy()
    volume[3] = 3.0 * model.cell_volumes[model.particles.cell[3]]
    model.particles.set("volume", volume)
    assert "a particle has 3 times the volume of its cell" in swollen(model) and "penalty=1" in swollen(model)
    report = replace(model.report(), steps=100, unexplained_energy=-1.0, energy_scale=2.0)
    with pytest.raises(mpm.RunError, match="50 % .* generated .* a particle has 3 times the volume of its cell"):
        EnergyWatch(0.2, True, lambda generated: swollen(model)).look(report)
