"""A column under its own weight, between rollers on a fixed base."""

import numpy as np
import pytest
from core_cases import averaged_over_nodes, box, by_id, moduli, rollers, run

import mpm_core as mpm

YOUNG, POISSON, DENSITY, GRAVITY = 1e6, 0.3, 2000.0, 0.1
HEIGHT, ROWS = 1.0, 10


@pytest.fixture(scope="module", params=[(2, False), (2, True), (3, False)], ids=["2D", "2D NMD", "3D"])
def column(request):
    """The column after its vibrations have been damped out."""
    dim, nmd = request.param
    base = 2 * dim - 1
    model = mpm.Model(
        box([2] * (dim - 1) + [ROWS], [0.2] * (dim - 1) + [HEIGHT], diagonals="alternating"),
        mpm.LinearElastic(young=YOUNG, poisson=POISSON),
    )
    model.seed(density=DENSITY, per_cell={2: 3, 3: 4}[dim])
    rollers(model, axes=range(dim - 1))
    model.fix(base)
    model.set_gravity([0.0] * (dim - 1) + [-GRAVITY])
    period = 4 * HEIGHT / np.sqrt(moduli(YOUNG, POISSON)[2] / DENSITY)
    report = run(model, 8 * period, damping=0.7, nmd=nmd)
    assert report.unbalanced_ratio < 1e-3
    return model, nmd


def test_stresses_of_the_column(column):
    # sigma_v = gamma (H - y), sigma_h = nu / (1 - nu) sigma_v. Each linear cell has one stress; equilibrium asks a row
    # of cells for the weight above the row's middle, with NMD for stresses whose mean is averaged.
    model, nmd = column
    dim = model.mesh.dim
    stress, y = by_id(model, "stress"), by_id(model, "initial_position")[:, -1]
    if nmd:
        stress[:, :dim] += averaged_over_nodes(model)[:, None]
    row = np.floor(y / HEIGHT * ROWS).astype(int)
    mean = np.array([stress[row == k].mean(axis=0) for k in range(ROWS)])
    vertical = -DENSITY * GRAVITY * (HEIGHT - (np.arange(ROWS) + 0.5) * HEIGHT / ROWS)
    expected = np.zeros_like(mean)
    expected[:, :3] = POISSON / (1 - POISSON) * vertical[:, None]
    expected[:, dim - 1] = vertical
    error = np.abs(mean - expected) / (DENSITY * GRAVITY * HEIGHT)
    assert error[:, dim - 1].max() < 0.01
    assert error[1:-1].max() < 0.01  # the averages of NMD have one side only in the lowest and the highest row


def test_settlement_of_the_column(column):
    # u(y) = -gamma / E_oed (H y - y^2 / 2), at the top -gamma H^2 / (2 E_oed)
    oedometer = YOUNG * (1 - POISSON) / ((1 + POISSON) * (1 - 2 * POISSON))
    model, _ = column
    y = by_id(model, "initial_position")[:, -1]
    settlement = -DENSITY * GRAVITY / oedometer * (HEIGHT * y - y**2 / 2)
    top = -DENSITY * GRAVITY * HEIGHT**2 / (2 * oedometer)
    measured = by_id(model, "displacement")
    assert np.abs(measured[:, -1] - settlement).max() < 0.01 * abs(top)
    assert np.abs(measured[:, :-1]).max() < 0.01 * abs(top)
