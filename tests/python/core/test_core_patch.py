"""Constant strain and uniform stress on irregular meshes."""

import numpy as np
import pytest
from core_cases import DIMS, box, by_id, moduli, rollers, run

import mpm_core as mpm

YOUNG, POISSON, DENSITY = 1e6, 0.3, 2000.0
ELASTIC = mpm.LinearElastic(young=YOUNG, poisson=POISSON)


def filled_box(dim, per_cell):
    model = mpm.Model(box([4] * dim, shake=0.15), ELASTIC)
    model.seed(density=DENSITY, per_cell=per_cell)
    return model


@pytest.mark.parametrize("dim", DIMS)
@pytest.mark.parametrize("per_cell", [1, 4, 10])
def test_uniform_stress_gives_no_force_at_inner_nodes(dim, per_cell):
    model = filled_box(dim, per_cell)
    stress = np.array([3e3, -2e3, 1e3, 4e3, -5e3, 6e3])[: 4 if dim == 2 else 6]
    model.particles.set("stress", np.broadcast_to(stress, (len(model.particles), len(stress))).copy())
    run(model, 1e-9)
    force, x = model.nodal("internal_force"), model.mesh.points
    inner = ((x > 1e-12) & (x < 1 - 1e-12)).all(axis=1)
    scale = np.abs(stress).max() * 0.25 ** (dim - 1)
    assert np.abs(force[inner]).max() < 1e-13 * scale
    # and no force in all; on the side x = 1, of unit area, that of the stress
    assert np.abs(force.sum(axis=0)).max() < 1e-12 * scale
    on_side = stress[[0, 3]] if dim == 2 else stress[[0, 3, 5]]
    assert force.T @ x[:, 0] == pytest.approx(on_side, rel=1e-12)  # virtual work of v = x e_k: sigma_xk V


@pytest.mark.parametrize("dim", DIMS)
@pytest.mark.parametrize("nmd", [False, True])
def test_stretched_block_is_strained_evenly(dim, nmd):
    # One side is pulled between rollers, then held until all is at rest: eps_xx = e alone, sigma_xx = (K + 4G/3) e and
    # lambda e in the other two directions, in plane strain too.
    model = filled_box(dim, per_cell=4)
    rollers(model, but=(2,))
    pull, time = 1e-4, 0.5
    model.prescribe(2, [pull] + [0.0] * (dim - 1))
    run(model, time, damping=0.5, nmd=nmd)
    model.prescribe(2, [0.0] * dim)
    run(model, 4 * time, damping=0.5, nmd=nmd)
    lame, _, confined = moduli(YOUNG, POISSON)
    strain = pull * time
    expected = np.zeros(model.particles.stress.shape[1])
    expected[:3] = [confined * strain, lame * strain, lame * strain]
    error = np.abs(model.particles.stress - expected).max()
    assert error < strain * confined * strain  # small strain: exact but for the square of it
    start, moved = by_id(model, "initial_position"), by_id(model, "displacement")
    assert np.abs(moved[:, 0] - strain * start[:, 0]).max() < strain**2
    assert np.abs(moved[:, 1:]).max() < strain**2


@pytest.mark.parametrize("dim", DIMS)
def test_nodes_have_values_before_the_first_step(dim):
    # A body in a larger box, moving as a whole, without stress: all of its weight is out of balance.
    low, high = np.full(dim, 0.25), np.full(dim, 0.75)
    model = mpm.Model(box([4] * dim, body=(low, high)), mpm.LinearElastic(young=1e6, poisson=0.3))
    model.seed(density=1000.0, per_cell=dim + 1, cell_tag=1)
    velocity = np.arange(1.0, dim + 1)
    model.particles.set("velocity", np.tile(velocity, (len(model.particles), 1)))
    model.set_gravity([0.0] * (dim - 1) + [-10.0])
    report = model.report()
    mass, x = model.nodal("mass"), model.mesh.points
    assert mass.sum() == pytest.approx(1000.0 * 0.5**dim) == model.particles.mass.sum()
    soil = ((x >= low) & (x <= high)).all(axis=1)
    np.testing.assert_array_equal(mass > 0, soil)
    np.testing.assert_allclose(model.nodal("velocity"), soil[:, None] * velocity, rtol=1e-14)
    np.testing.assert_array_equal(model.nodal("internal_force"), 0)
    assert report.unbalanced_ratio == pytest.approx(1)
