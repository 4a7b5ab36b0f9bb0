"""Free fields beside soil whose water has a velocity of its own: it flows up and down through them, and they settle."""

from dataclasses import asdict

import numpy as np
import pytest
from core_cases import box
from mpm_core.free_field import layers_at, layers_of
from mpm_core.ground_column import GroundColumn, Layers
from two_phase_cases import BASE, DENSITY, ELASTIC, GAMMA, LEFT, OEDOMETER, POROSITY, RIGHT, WATER

import mpm_core as mpm

HEIGHT, MODULUS, CONDUCTIVITY = 1.0, 6e7, 5e-4
EXCESS = 20e3
SPEED_OF_CONSOLIDATION = CONDUCTIVITY * OEDOMETER * MODULUS / POROSITY / (OEDOMETER + MODULUS / POROSITY) / GAMMA
"""c_v [m2/s] with the compression of the water"""


def consolidated(factor):
    """Mean of the excess pressure that is left of a uniform one, for a time factor (Terzaghi); all flows off at the surface."""
    m = 0.5 * np.pi * (2 * np.arange(200) + 1)
    return (2 / m**2 * np.exp(-(m**2) * factor)).sum()


def properties(standing=()):
    water = mpm._core.PoreWater()
    water.modulus, water.suction_limit, water.standing = MODULUS, 0.0, list(standing)
    return water


def layers(excess, count=12):
    """Elastic ground at rest under its weight, with an excess of its pore pressures."""
    heights = np.linspace(0, HEIGHT, count + 1)
    pressure = GAMMA * (HEIGHT - 0.5 * (heights[1:] + heights[:-1])) + excess
    content = WATER * POROSITY * (1 + pressure / MODULUS)
    return Layers(
        heights=heights.tolist(), law=[0] * count, density=[DENSITY] * count, stress=np.zeros((count, 4)).tolist(),
        state=[[0.0]] * count, cell_size=[HEIGHT / count] * count, coupled_mass=[1 / 6] * count, normal=[1.0, 0.0], time=0.0,
        pores=[[POROSITY, CONDUCTIVITY, CONDUCTIVITY, m, p] for m, p in zip(content, pressure)], gravity=9.81,
    )  # fmt: skip


def column(excess, standing=()):
    """That ground on a base at rest, where its vibrations fade."""
    return GroundColumn(layers(excess), [ELASTIC], None, mpm.Rayleigh(mass=200.0), properties(standing))


def excess_of(ground):
    p = ground._water.pressure - GAMMA * (HEIGHT - 0.5 * (ground.heights[1:] + ground.heights[:-1]))
    return p.mean()


@pytest.mark.parametrize("factor", [0.1, 0.3])
def test_a_column_consolidates_as_terzaghi_found(factor):
    ground = column(EXCESS)
    water = ground._water.mass.sum()
    ground.advance(0.0, factor * HEIGHT**2 / SPEED_OF_CONSOLIDATION)
    assert excess_of(ground) / EXCESS == pytest.approx(consolidated(factor), abs=0.01)
    # what flows off is the volume by which the soil is compressed and the water expands
    lost = -ground.stress[:, 1].mean() / OEDOMETER + (EXCESS - excess_of(ground)) * POROSITY / MODULUS
    assert (water - ground._water.mass.sum()) / WATER == pytest.approx(lost * HEIGHT, rel=1e-3)


def test_water_at_rest_stays_at_rest():
    ground = column(0.0)
    ground.advance(0.0, 200 * ground.dt)
    assert abs(ground._water.relative).max() < 1e-9 and abs(ground.velocity).max() < 1e-9
    assert abs(ground._water.pressure_change).max() < 1e-4


def test_water_that_rises_over_the_ground_presses_its_water_but_hardly_its_soil():
    """In a short time as soil and water share a load by their stiffness, in a long one not at all."""
    rise, metres = 0.2, 0.5
    ground = column(0.0, standing=[(0.0, HEIGHT), (rise, HEIGHT + metres)])
    share = OEDOMETER / (OEDOMETER + MODULUS / POROSITY)
    for until, most in ((1.5 * rise, share), (5 * rise, 0.5 * share)):
        ground.advance(ground.time, until)
        total = ground.stress[:, 1] - ground._water.pressure_change
        assert total == pytest.approx(-GAMMA * metres, rel=5e-3)
        assert abs(ground.stress[:, 1]).max() < most * GAMMA * metres


def test_layers_of_older_checkpoints_have_water_that_moves_with_the_soil():
    entry = asdict(layers(0.0))
    del entry["pores"], entry["gravity"]
    stiffness = MODULUS / POROSITY
    older = layers_of({**entry, "water": [stiffness] * 12}, properties())
    ground = GroundColumn(older, [ELASTIC], None, mpm.Rayleigh(), properties())
    ground.velocity[:, 1] = -1e-3 * ground.heights  # a uniform strain
    ground._strain()
    strain = -1e-3 * ground.dt
    assert ground._water.pressure_change == pytest.approx(-stiffness * strain, rel=1e-3)
    assert ground.stress[:, 1] == pytest.approx(OEDOMETER * strain, rel=1e-9)
    for dry in ({"water": [0.0] * 12}, {"water": []}, {}):
        assert layers_of({**entry, **dry}, None).pores == []


def level_site(across, up, excess, standing=None):
    """Elastic ground in resting cells, whose pores have an excess of pressure, between free fields; water may stand over it."""
    model = mpm.Model(box((across, up), (2.0, HEIGHT)), ELASTIC)
    model.seed(density=DENSITY, per_cell=3)
    model.set_gravity((0.0, -9.81))
    model.add_water(
        porosity=POROSITY,
        conductivity=CONDUCTIVITY,
        modulus=MODULUS,
        suction_limit=0.0,
        drained_surface=standing is not None,
    )
    if standing is not None:
        model.stand_water(standing)
    model.set_pore_pressure(lambda x: GAMMA * (HEIGHT - x[:, 1]) + excess)
    buoyant = -9.81 * (DENSITY - WATER) * (HEIGHT - centres(model)[:, 1]) + excess  # so that the weight is carried
    model.particles.set("stress", np.column_stack([buoyant, buoyant, buoyant, 0 * buoyant]))
    model.rest()
    model.fix(BASE)
    model.absorb((LEFT, RIGHT), free_field=True)
    return model


def centres(model):
    return np.asarray(model.mesh.points)[model.mesh.cells[model.particles.cell]].mean(axis=1)


@pytest.mark.parametrize("nmd", [False, True])
def test_a_level_site_settles_alike_at_its_sides_and_in_its_middle(nmd):
    model = level_site(12, 12, EXCESS)
    factor = 0.3
    model.explicit(factor * HEIGHT**2 / SPEED_OF_CONSOLIDATION, nmd=nmd, damping=0.0, conversion=None).last()
    pressure = model.averaged_pore_pressure() if nmd else model.particles.pore_pressure
    left = (pressure - GAMMA * (HEIGHT - centres(model)[:, 1])) / EXCESS
    middle = abs(centres(model)[:, 0] - 1.0) < 0.2
    side = centres(model)[:, 0] < 0.2
    assert left[middle].mean() == pytest.approx(consolidated(factor), abs=0.02)
    assert left[side].mean() == pytest.approx(left[middle].mean(), abs=0.01)


def test_water_that_rises_over_a_level_site_moves_it_as_little_at_its_sides_as_in_its_middle():
    """It presses on the sides as on the surface, and by the stresses of the free fields: one of the two counts."""
    rise, metres = 0.1, 1.0
    model = level_site(8, 8, 0.0, standing=[(0.0, HEIGHT), (rise, HEIGHT + metres)])
    model.explicit(2 * rise, nmd=True, damping=0.0, rayleigh=mpm.Rayleigh(mass=100.0), conversion=None).last()
    by_soil = GAMMA * metres * HEIGHT / OEDOMETER  # where the soil carried the water by itself
    assert abs(model.particles.displacement[:, 0]).max() < 0.02 * by_soil
    top, x = centres(model)[:, 1] > HEIGHT - 0.1, centres(model)[:, 0]
    settled = [-model.particles.displacement[top & beside, 1].mean() for beside in (x < 0.2, abs(x - 1) < 0.2)]
    assert settled[0] == pytest.approx(settled[1], abs=0.02 * by_soil)


def test_free_fields_are_at_rest_where_the_pressures_of_the_site_are_hydrostatic():
    """Cells at a side have their pressures at centroids, which are no middles of layers."""
    model = level_site(4, 8, 0.0)
    ground = GroundColumn(layers_at(model, LEFT), [ELASTIC], None, mpm.Rayleigh(), model._core.water)
    ground.advance(0.0, 200 * ground.dt)
    assert abs(ground._water.relative).max() < 1e-9
    assert abs(ground._water.pressure_change).max() < 1e-3


def test_a_run_from_a_checkpoint_has_the_free_fields_of_the_run(tmp_path):
    whole = level_site(4, 8, EXCESS)
    whole.explicit(0.02, nmd=True, damping=0.0, conversion=None).last()
    whole.save(tmp_path / "half.h5")
    whole.explicit(0.04, nmd=True, damping=0.0, conversion=None).last()
    again = mpm.Model(whole.mesh, ELASTIC)
    again.restore(tmp_path / "half.h5")
    again.explicit(0.04, nmd=True, damping=0.0, conversion=None).last()
    assert np.array_equal(again.particles.pore_pressure, whole.particles.pore_pressure)
    assert np.array_equal(again._columns[0]._water.mass, whole._columns[0]._water.mass)
