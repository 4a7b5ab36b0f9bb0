"""The tangent of a step with pore water is the derivative of its residual: central differences, in all geometries."""

import numpy as np
import pytest
from core_cases import box
from implicit_cases import floor, tangent

import mpm_core as mpm
from fenics_bridge.water import VanGenuchten
from mpm_core import _core

ELASTIC = mpm.LinearElastic(young=1e6, poisson=0.3)
PLASTIC = mpm.MohrCoulomb(young=1e6, poisson=0.3, cohesion=2e3, friction_angle=25.0, dilation_angle=5.0)
DT = 0.02


def started_step(dim, law, *, quasi_static, round=False, mixed=False, nmd=False, averaged=False, dries=False):
    """A step of a box of which 0.6 are filled with wet soil, or soil that dries: random velocities, stresses and pressures."""
    offset = [0.5 if round else 0.0] + [0.0] * (dim - 1)
    mesh = box([3 if dim == 2 else 2] * dim, shake=0.2, place=lambda x: x + offset)
    model = mpm.Model(mesh, law, geometry=mpm.Geometry.AXISYMMETRIC if round else None)
    rng = np.random.default_rng(1)
    model.seed_points(rng.uniform(0.02, 0.98, (120, dim)) * ([0.6] + [1.0] * (dim - 1)) + offset,
                      np.full(120, 0.6 / 120), density=2000.0)  # fmt: skip
    stress = rng.normal(0.0, 5e3, model.particles.stress.shape)
    stress[:, :3] -= 3e4
    model.particles.set("stress", stress)
    model.particles.set("velocity", rng.normal(0.0, 0.3, (120, dim)))
    model.fix(floor(dim))
    model.set_gravity([0.0] * (dim - 1) + [-9.81])
    retention = VanGenuchten(alpha=4e-4, n=2.0, residual=0.1) if dries else None
    model.add_water(porosity=0.4, conductivity=lambda x: 1e-3 * (1 + x[:, 0]), modulus=1e7, drained_surface=True,
                    retention=retention, anisotropy=np.diag(np.linspace(3.0, 0.5, dim)) + 0.4)  # fmt: skip
    model.set_pore_pressure(lambda x: 5e3 * (1.0 - x[:, -1]) + 1e3 * x[:, 0] - (4e3 if dries else 0.0))
    model.stand_water(0.4)
    model.hold_pore_pressure(2 * dim, 100.0)
    options = _core.ImplicitOptions()
    options.quasi_static = quasi_static
    options.integration = mpm.Integration.MIXED if mixed else mpm.Integration.PARTICLES
    options.nmd, options.average_stress = nmd, averaged
    step = getattr(_core, type(model._core).__name__.replace("Model", "ImplicitStep"))(model._core)
    step.start(options, DT)
    return step, rng


def free(step, dim, direction):
    """The part of a direction that support and prescribed pressures leave free."""
    direction = direction.reshape(-1, dim + 1).copy()
    direction[step.points[:, -1] < 1e-9, :dim] = 0.0
    direction[step.points[:, -1] > 1 - 1e-9, dim] = 0.0
    return direction.ravel()


@pytest.mark.parametrize("law", [ELASTIC, PLASTIC], ids=["elastic", "plastic"])
@pytest.mark.parametrize(
    "dim, options",
    [
        (2, {}),
        (2, {"round": True}),
        (2, {"mixed": True}),
        (3, {}),
        (2, {"nmd": True}),
        (2, {"nmd": True, "averaged": True}),
        (3, {"nmd": True}),
        (2, {"dries": True}),
        (2, {"dries": True, "round": True}),
        (3, {"dries": True}),
        (2, {"dries": True, "nmd": True}),
        (2, {"dries": True, "nmd": True, "averaged": True, "round": True}),
        (3, {"dries": True, "nmd": True}),
    ],
    ids=str,
)
@pytest.mark.parametrize("quasi_static", [True, False], ids=["quasi-static", "dynamic"])
def test_tangent_is_the_derivative_of_the_residual(dim, options, law, quasi_static):
    step, rng = started_step(dim, law, quasi_static=quasi_static, **options)
    assert step.unknowns == dim + 1
    start = step.iterate
    start += 0.1 * free(step, dim, rng.normal(0.0, 1.0, len(start)))
    step.iterate = start
    assert step.trial(tangents=True)["failed"] == 0
    step.assemble()
    j = tangent(step, dim)
    if (
        quasi_static and law is ELASTIC and "dries" not in options
    ):  # of such a step all is linear but the rotation of stresses
        pressures = np.arange(dim, j.shape[0], dim + 1)
        assert abs(j[pressures][:, pressures] - j[pressures][:, pressures].T).max() < 1e-12 * abs(j).max()
    for _ in range(4):
        direction = free(step, dim, rng.normal(0.0, 1.0, len(start)))
        h, forces = 1e-7, []
        for side in (1, -1):
            step.iterate = start + side * h / DT * direction
            step.trial()
            forces.append(step.residual.reshape(-1, dim + 1))
        difference = (forces[1] - forces[0]) / (2 * h)
        found = (j @ direction).reshape(-1, dim + 1)
        for rows in (slice(0, dim), slice(dim, dim + 1)):
            assert np.abs((found - difference)[:, rows]).max() < 5e-6 * np.abs(difference[:, rows]).max()
