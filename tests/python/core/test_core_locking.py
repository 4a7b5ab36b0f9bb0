"""Cook's membrane, nearly incompressible: linear triangles lock, nodal mixed discretisation (NMD) frees them."""

import numpy as np
import pytest
from core_cases import DIMS, box

import mpm_core as mpm
from mpm_core import _core

# Young's modulus and the shear traction of the benchmark; its answer at (48, 52) is 16.44 with nu = 0.499999975. The
# displacement of a nearly incompressible body differs from the incompressible one by the order of G / K = 0.002 with
# nu = 0.499, for which the critical time step is not yet tiny. The load is scaled down: displacements stay small.
YOUNG, POISSON, TRACTION, SCALE = 1.12499998125, 0.499, 1 / 16, 1e-3
MID_EDGE, BENCHMARK = (48.0, 52.0), 16.44


def membrane(n):
    """The points (0, 0), (48, 44), (48, 60), (0, 44); diagonals all one way."""

    def place(x):
        return np.stack([48 * x[:, 0], 44 * x[:, 0] + x[:, 1] * (44 - 28 * x[:, 0])], axis=1)

    model = mpm.Model(box([n, n], place=place), mpm.LinearElastic(young=YOUNG, poisson=POISSON))
    model.seed(density=1.0, per_cell=3)
    model.fix(1)
    assert model.traction(2, (0.0, SCALE * TRACTION)) == pytest.approx(16.0)
    return model


def deflection(model):
    """Vertical displacement at (48, 52), by an affine fit to the particles next to it, over the scale of the load."""
    offset = model.particles.initial_position - MID_EDGE
    near = np.argsort(np.linalg.norm(offset, axis=1))[:12]
    affine = np.column_stack([np.ones(12), offset[near]])
    return np.linalg.lstsq(affine, model.particles.displacement[near, 1], rcond=None)[0][0] / SCALE


@pytest.fixture(scope="module")
def deflections():
    """At rest, by number of cells along each side and by NMD or not."""
    shear_wave = np.sqrt(YOUNG / (2 * (1 + POISSON)))
    found = {}
    for n, nmd in ((8, False), (8, True), (16, False), (16, True)):
        model = membrane(n)
        reports = model.explicit(900 / shear_wave, every=180 / shear_wave, damping=0.5, nmd=nmd, courant=0.8)
        *_, before, found[n, nmd] = (deflection(model) for report in reports)
        assert found[n, nmd] == pytest.approx(before, rel=0.01)
    return found


def test_plain_triangles_lock(deflections):
    assert deflections[16, False] < 0.6 * BENCHMARK


def test_mixed_discretisation_frees_them(deflections):
    errors = [1 - deflections[n, True] / BENCHMARK for n in (8, 16)]
    assert 0 < errors[1] < 0.12
    assert errors[1] < 0.5 * errors[0]  # and it converges


@pytest.mark.parametrize("integration", [mpm.Integration.PARTICLES, mpm.Integration.MIXED])
@pytest.mark.parametrize("dim", DIMS)
def test_a_uniform_pressure_is_in_equilibrium_where_soils_of_different_averages_meet(dim, integration):
    """Of clay all of the strain is averaged, of sand a part; nodes inside must feel no force of a pressure that both have."""
    clay, sand = mpm.MohrCoulomb(young=3e6, poisson=0.45, cohesion=1e4, friction_angle=0.0), mpm.MohrCoulomb(
        young=2e7, poisson=0.3, cohesion=5e3, friction_angle=32.0, dilation_angle=5.0
    )
    assert _core.fraction_of_averages(clay) != _core.fraction_of_averages(sand)
    upper = np.array([[-1.0] * (dim - 1) + [0.5], [2.0] * dim])
    mesh = box([4] * dim, shake=0.2, body=upper)
    model = mpm.Model(mesh, [clay, sand])
    for tag in (0, 1):
        model.seed(density=2000.0, per_cell=6 if dim == 2 else 10, cell_tag=tag, material=tag)
    pressure = 1e4
    stress = np.zeros_like(model.particles.stress)
    stress[:, :3] = -pressure
    model.particles.set("stress", stress)
    for axis in range(dim):
        for end in (1, 2):
            model.roller(2 * axis + end, np.eye(dim)[axis])
    *_, report = model.explicit(1e-4, dt=1e-4, nmd=True, integration=integration)
    # A pressure on the sides of a cell gives its nodes this velocity in the step, in the order of magnitude.
    scale = 1e-4 * pressure / (2000.0 * 0.25)
    assert np.abs(model.particles.velocity).max() < 1e-10 * scale
