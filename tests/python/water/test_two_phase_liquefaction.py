"""Level sand that liquefies in an earthquake, soil and water with a velocity each, and settles as its water drains."""

import numpy as np
import pytest
from sanisand_cases import TOYOURA

import mpm_core as mpm

DEPTH, WIDTH, VOID_RATIO, WEIGHT = 10.0, 2.0, 0.85, 9810.0
POROSITY = VOID_RATIO / (1 + VOID_RATIO)
DENSITY = 2650.0 * (1 - POROSITY) + 1000.0 * POROSITY
BUOYANT = (DENSITY - 1000.0) * 9.81
LEFT, RIGHT, BASE = 1, 2, 3


def site(conductivity):
    """Resting cells of sand with the water table at the surface, between free fields over rock, shaken for 4 s."""
    across, up = 2, 10
    x, y = np.meshgrid(np.linspace(0, WIDTH, across + 1), np.linspace(0, DEPTH, up + 1))
    points = np.column_stack([x.ravel(), y.ravel()])
    low = (np.arange(up)[:, None] * (across + 1) + np.arange(across)).ravel()
    cells = np.concatenate(
        [np.column_stack([low, low + 1, low + across + 2]), np.column_stack([low, low + across + 2, low + across + 1])]
    )
    base = np.column_stack([np.arange(across), np.arange(1, across + 1)])
    side = (across + 1) * np.column_stack([np.arange(up), np.arange(1, up + 1)])
    mesh = mpm.Mesh(
        points, cells, facets=np.concatenate([base, side, side + across]),
        facet_tags=across * [BASE] + up * [LEFT] + up * [RIGHT],
    )  # fmt: skip
    sand = mpm.Sanisand(**TOYOURA, void_ratio=VOID_RATIO, largest_pressure=100e3, attraction=1e3)
    model = mpm.Model(mesh, sand)
    model.seed(density=DENSITY, per_cell=3)
    model.set_gravity((0.0, -9.81))
    model.add_water(porosity=POROSITY, conductivity=conductivity, modulus=2e8, suction_limit=0.0)
    model.set_pore_pressure(lambda place: WEIGHT * (DEPTH - place[:, 1]))
    depth = DEPTH - points[cells[model.particles.cell], 1].mean(axis=1)
    model.particles.set("stress", -BUOYANT * depth[:, None] * np.array([0.5, 1.0, 0.5, 0.0]))
    model.rest()
    model.absorb(BASE, impedances=(5.3e6, 2.9e6), thickness=200.0)
    model.absorb((LEFT, RIGHT), free_field=True, thickness=200.0)
    time = np.linspace(0, 4, 401)
    motion = mpm.motion_of_acceleration(
        time, 2.0 * np.sin(4 * np.pi * time) * np.minimum(1, time) * np.minimum(1, 4 - time)
    )
    model.shake(mpm.Motion(motion.time, 0.5 * motion.velocity), direction=(1, 0))
    return model


def excess_ratio(model):
    """Excess pore pressure over the effective vertical stress of the start, of the rows between 3 and 8 m of depth."""
    p = model.particles
    depth = DEPTH - model.mesh.points[model.mesh.cells[p.cell], 1].mean(axis=1)
    ratio = (model.averaged_pore_pressure() - WEIGHT * depth) / (BUOYANT * depth)
    return ratio[(depth > 3) & (depth < 8)]


def test_sand_liquefies_and_settles_by_the_volume_that_its_pores_lose():
    model = site(conductivity=1e-2)
    steps = model.explicit(12.0, every=0.5, damping=0.0, nmd=True, conversion=None)
    ratios = [excess_ratio(model).mean() for _ in steps]
    assert abs(ratios[0]) < 0.3 and max(ratios) > 0.85
    assert abs(excess_ratio(model)).max() < 0.03  # hydrostatic again
    p = model.particles
    compressed = -(p.volume * model.state("log_specific_volume")).sum()  # of the pores [m2]
    assert 0.003 < compressed / p.volume.sum() < 0.03
    assert -model.water_inflow() == pytest.approx(compressed, rel=0.02)
    surface = model.mesh.points[model.mesh.cells[p.cell], 1].mean(axis=1) > DEPTH - 0.5
    settled = -p.displacement[surface, 1]
    assert settled == pytest.approx(
        compressed / WIDTH, rel=0.1
    )  # free fields settle as well, so that all parts do alike
