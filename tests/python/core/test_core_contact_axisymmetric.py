"""Contact in axial symmetry: forces and areas per radian on surfaces that are inclined to the axis."""

import numpy as np
import pytest
from core_cases import box

import mpm_core as mpm

G = 9.81


def ring_in_funnel(slope, friction):
    """An elastic ring on a cone that opens upwards: 16 by 8 particles along and normal to its face, from the radius 0.6 m.

    Returns:
        Model, funnel, and the area of the ring on it per radian.
    """
    mesh = box((12, 10), (1.5, 1.25), diagonals="alternating")
    model = mpm.Model(mesh, mpm.LinearElastic(young=2e7, poisson=0.3), geometry=mpm.Geometry.AXISYMMETRIC)
    side, corner = 1 / 32, np.array([0.6, 0.2])
    along, out = (np.cos(slope), np.sin(slope)), np.array([-np.sin(slope), np.cos(slope)])
    points = corner + side * (np.indices((16, 8)).reshape(2, -1).T + 0.5) @ (along, out)
    model.seed_points(points, side**2 * points[:, 0], density=1000.0)
    foot = corner - 1e-12 * out
    funnel = model.add_contact(mpm.Polyline([foot, foot + along]), friction=friction)
    outer = corner[0] + 0.5 * np.cos(slope)
    return model, funnel, 0.5 * (outer**2 - corner[0] ** 2) / np.cos(slope)


@pytest.mark.parametrize("slope, friction", [(0, 0.0), (30, 0.0), (45, 0.0), (60, 0.0), (30, 0.3)])
def test_hoop_stresses_hold_a_ring_in_a_funnel(slope, friction):
    # Smooth, the face gives W tan(slope) inwards with the weight W, and the hoop force, the integral of the hoop stress
    # over the section, is as large: per radian, sum sigma V / r. Friction takes over a part of it.
    theta = np.radians(slope)
    model, funnel, area = ring_in_funnel(theta, friction)
    model.set_gravity((0.0, -G), ramp=0.1)
    *_, report = model.explicit(0.6, damping=0.3)
    weight, particles = report.mass * G, model.particles
    hoop = np.sum(particles.stress[:, 2] * particles.volume / particles.position[:, 0])
    assert funnel.force[1] == pytest.approx(-weight, rel=1e-5)
    assert hoop == pytest.approx(-funnel.force[0], abs=2e-2 * weight)
    assert funnel.area == pytest.approx(area, rel=2.5e-2)
    if friction == 0:
        assert funnel.force[0] == pytest.approx(weight * np.tan(theta), abs=1e-5 * weight)
        assert funnel.pressure * funnel.area == pytest.approx(weight / np.cos(theta), rel=1e-5)
    else:
        assert 0 < funnel.force[0] < weight * np.tan(theta) and funnel.sticking_fraction == 1.0


@pytest.mark.parametrize("scheme", ["explicit", "implicit"])
@pytest.mark.parametrize("inside", [False, True])
def test_the_area_of_a_shaft_is_its_radius_times_its_length(scheme, inside):
    """Per radian, also where the shaft is hardly thicker than a particle; so is the force of adhesion over its strength."""
    radius, length, side, adhesion = 0.2 if inside else 0.05, 0.6, 0.025, 1000.0
    model = mpm.Model(
        box((16, 12), (0.8, length), diagonals="alternating"), mpm.LinearElastic(young=1e7, poisson=0.0),
        geometry=mpm.Geometry.AXISYMMETRIC,
    )  # fmt: skip
    columns = round((radius if inside else 0.8 - radius) / side)
    points = (np.indices((columns, round(length / side))).reshape(2, -1).T + 0.5) * side
    points[:, 0] += 0 if inside else radius
    model.seed_points(points, side**2 * points[:, 0], density=1000.0)
    for tag in (3, 4):
        model.roller(tag, (0, 1))
    if not inside:
        model.fix(2)
    stress = model.particles.stress.copy()
    stress[:, :3] = -20e3
    model.particles.set("stress", stress)
    surface = mpm.Plane((radius + 1e-9, 0), (-1, 0)) if inside else mpm.Box((-1, -1), (radius - 1e-9, 2))
    shaft = model.add_contact(surface, adhesion=adhesion, velocity=(0, 0.2))
    mixed = mpm.Integration.MIXED
    if scheme == "explicit":
        list(model.explicit(0.04, damping=0.5, integration=mixed))
    else:
        list(model.implicit(0.04, dt=0.02, quasi_static=True, integration=mixed))
    sunk = 1 + shaft._state()["penetration"] / (0.5 * side) if scheme == "explicit" else 1.0  # see docs/contact.md
    assert shaft.area == pytest.approx(sunk * radius * length, rel=2e-3)
    assert abs(shaft.force[1]) == pytest.approx(sunk * adhesion * radius * length, rel=2e-3)
