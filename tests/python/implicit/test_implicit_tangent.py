"""The tangent is the derivative of the residual: central differences, for each law, with rotation and averaging."""

import numpy as np
import pytest
from core_cases import box
from implicit_cases import LEFT, difference_of_residual, floor, tangent

import mpm_core as mpm
from mpm_core import _core

ELASTIC = mpm.LinearElastic(young=1e6, poisson=0.3)
PLASTIC = mpm.MohrCoulomb(young=1e6, poisson=0.3, cohesion=2e3, friction_angle=25.0, dilation_angle=5.0)
STIFFER = mpm.MohrCoulomb(young=3e6, poisson=0.3, cohesion=2e3, friction_angle=25.0, dilation_angle=5.0)


def started_step(dim, law, *, nmd=False, quasi_static=False, damping=0.0, mixed=False, small=False, round=False):
    """A step of a box with random velocities and stresses, half of it filled, one side on inclined rollers."""
    offset = [0.5 if round else 0.0] + [0.0] * (dim - 1)  # a hollow cylinder has an inner radius
    mesh = box([3 if dim == 2 else 2] * dim, shake=0.2, place=lambda x: x + offset)
    geometry = mpm.Geometry.AXISYMMETRIC if round else None
    laws = law if isinstance(law, list) else [law]
    model = mpm.Model(mesh, laws, geometry=geometry)
    rng = np.random.default_rng(1)
    points = rng.uniform(0.02, 0.98, (120, dim)) * ([0.6] + [1.0] * (dim - 1)) + offset
    model.seed_points(points, np.full(120, 0.6 / 120), density=2000.0)
    model.assign((model.particles.position[:, -1] > 0.5).astype(np.int32) % len(laws))
    stress = rng.normal(0.0, 5e3, model.particles.stress.shape)
    stress[:, :3] -= 3e4
    model.particles.set("stress", stress)
    model.particles.set("velocity", rng.normal(0.0, 0.3, (120, dim)))
    model.fix(floor(dim))
    model.roller(LEFT, [1.0] + [0.3] * (dim - 1))
    model.set_gravity([0.0] * (dim - 1) + [-9.81])
    options = _core.ImplicitOptions()
    options.nmd, options.quasi_static, options.damping = nmd, quasi_static, damping
    options.hold_positions, options.average_stress = small, small and nmd
    options.integration = mpm.Integration.MIXED if mixed else mpm.Integration.PARTICLES
    step = getattr(_core, type(model._core).__name__.replace("Model", "ImplicitStep"))(model._core)
    step.start(options, 0.02)
    return step, rng


def free(step, dim, direction):
    """The part of a direction that the supports of `started_step` leave free."""
    direction = direction.reshape(-1, dim).copy()
    normal = np.array([1.0] + [0.3] * (dim - 1))
    normal /= np.linalg.norm(normal)
    on_left = step.points[:, 0] < step.points[:, 0].min() + 1e-9
    direction[on_left] -= np.outer(direction[on_left] @ normal, normal)
    direction[step.points[:, -1] < 1e-9] = 0.0
    return direction.ravel()


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("law", [ELASTIC, PLASTIC, [ELASTIC, STIFFER]], ids=["elastic", "plastic", "averaged apart"])
@pytest.mark.parametrize(
    "options",
    [
        {},
        {"nmd": True},
        {"damping": 0.75},
        {"quasi_static": True},
        {"mixed": True, "nmd": True},
        {"quasi_static": True, "small": True},
        {"quasi_static": True, "small": True, "nmd": True},
    ],
    ids=str,
)
def test_tangent_is_the_derivative_of_the_residual(dim, law, options):
    check_tangent(dim, law, options)


@pytest.mark.parametrize(
    "options",
    [{}, {"nmd": True}, {"mixed": True, "nmd": True}, {"quasi_static": True, "small": True, "nmd": True}],
    ids=str,
)
def test_tangent_in_axial_symmetry_is_the_derivative_of_the_residual(options):
    for law in (ELASTIC, PLASTIC, [ELASTIC, STIFFER]):
        check_tangent(2, law, {**options, "round": True})


def check_tangent(dim, law, options):
    dt = 0.02
    step, rng = started_step(dim, law, **options)
    v = step.iterate + 0.3 * free(step, dim, rng.normal(0.0, 1.0, len(step.iterate)))
    step.iterate = v
    report = step.trial(tangents=True)
    assert report["failed"] == 0
    assert report["plastic"] == 0 if law is ELASTIC else report["plastic"] > 10
    step.assemble()
    j = tangent(step, dim)
    for _ in range(4):
        direction = free(step, dim, rng.normal(0.0, 1.0, len(v)))
        difference = difference_of_residual(step, v, direction, dt)
        assert np.abs(j @ direction - difference).max() < 2e-6 * np.abs(difference).max()
