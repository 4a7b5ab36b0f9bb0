"""A slide over ground on several ranks: the same mesh, particles, maps and forces as on one."""

import numpy as np
import pytest
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import terrain


def slide(comm):
    """A cap on a hollow slope."""
    x, y = np.arange(0.0, 41.0, 2.0), np.arange(0.0, 25.0, 2.0)
    u, v = np.meshgrid(x, y)
    left = terrain.Raster(x, y, 10.0 * np.exp(-u / 15.0) + 0.02 * (v - 12.0) ** 2)
    cap = np.maximum(1 - ((u - 10.0) / 6.0) ** 2 - ((v - 12.0) / 6.0) ** 2, 0.0)
    domain, _, tags = terrain.terrain_mesh(comm, left, cell_size=3.0, height=7.0, fine=((4, 6), (30, 18)))
    soil = mpm.MohrCoulomb(young=1e6, poisson=0.3, cohesion=500.0, friction_angle=30.0, dilation_angle=0.0)
    model = mpm.Model(bridge.background_mesh(domain, facet_tags=tags), soil)
    before = terrain.Raster(x, y, left.values + 3.0 * cap)
    ground, lift = terrain.seed_slide(model, before, left, spacing=1.0, density=1800.0, friction=0.3)
    model.outflow("sides")
    model.set_gravity((0.0, 0.0, -9.81))
    maps = terrain.SlideMaps(model, left)
    for _ in model.explicit(0.5, dt=5e-3, every=0.25, energy_limit=np.inf):
        maps.record()
    return maps.maps(), ground, lift


def test_a_slide_is_the_same_on_any_number_of_ranks(comm):
    (maps, ground, lift), (alone, other, same) = slide(comm), slide(MPI.COMM_SELF)
    assert lift == same
    for name, raster in alone.items():
        assert np.array_equal(np.isnan(raster.values), np.isnan(maps[name].values)), name
        assert maps[name].values == pytest.approx(raster.values, rel=1e-8, nan_ok=True), name
    for name in ("impulse", "force", "area"):
        value = getattr(other, name)
        assert getattr(ground, name) == pytest.approx(value, rel=1e-8, abs=1e-8 * np.abs(value).max()), name
    assert other.impulse[2] < 0


def test_wrong_sizes_are_refused_on_all_ranks(comm):
    ground = terrain.Raster(np.arange(5.0), np.arange(5.0), np.zeros((5, 5)))
    with pytest.raises(bridge.InputError, match="coarse_size is 0.1 m"):
        terrain.terrain_mesh(comm, ground, cell_size=1.0, height=1.0, fine=((1, 1), (2, 2)), coarse_size=0.1)
