"""Layer of soil on a weak plane: two bodies with friction between them, by contact between velocity fields.

A layer 0.2 m thick and 0.6 m long lies on firm soil, and the coefficient of friction on the plane between them is μ = tan 20°;
the slope is made steeper by the direction of gravity. Up to 20° the layer does not move, and the shear force equals the
component of its weight along the plane. On steeper slopes it slides against a shear force of μ times the normal force. Three
meshes are compared: in the first the plane lies along sides of cells, in the second it is parallel to them and cuts the cells,
and the third has irregular cells, whose inner nodes are moved by up to a fifth of the cell size. Both bodies start with the
stresses that balance their weight if the layer does not move; waves of the settlement of the firm soil are damped for 0.1 s.
Forces and accelerations are then means over 0.3 s. Half a degree below 20° the layer must not move; half a degree above 20°
its acceleration must be g (sin β - μ cos β).
"""

import numpy as np
from _case import Check, Result
from _plots import save_comparison
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

CELL, LAYER, LENGTH, FIRM = 0.05, 0.2, 0.6, 0.3  # m: cells; thickness and length of the layer, thickness below it
DENSITY, GRAVITY, FRICTION = 1800.0, 9.81, np.tan(np.radians(20.0))  # kg/m3, m/s2, -
MESHES = {"along cells": (0.0, 0.0), "through cells": (0.017, 0.0), "irregular": (0.0, 0.2)}
"""Distance of the plane from sides of cells [m], and by how much of a cell inner nodes are moved"""
START, END = 0.1, 0.4  # s
comm = MPI.COMM_WORLD


def layer_on_plane(angle, mesh):
    """The model of a slope [degrees], and its contact."""
    # --- 1. Two bodies on one mesh ----------------------------------------------------------------------------------
    shift, shake = MESHES[mesh]
    domain, cell_tags, facet_tags = bridge.box_mesh(comm, [1.4, 0.7], [28, 14])
    x, inner = domain.geometry.x, np.ones(len(domain.geometry.x), bool)
    for axis, length in ((0, 1.4), (1, 0.7)):
        inner &= (x[:, axis] > 1e-9) & (x[:, axis] < length - 1e-9)
    x[inner, :2] += shake * CELL * np.sin(7.0 * x[inner, 1::-1] / CELL + x[inner, :2] / CELL)
    firm = mpm.LinearElastic(young=20e6, poisson=0.3)
    soil = mpm.MohrCoulomb(young=20e6, poisson=0.3, cohesion=5e3, friction_angle=35.0)
    model = mpm.Model(bridge.background_mesh(domain, cell_tags, facet_tags), [firm, soil], velocity_fields=[0, 1])
    plane, spacing = FIRM + shift, 0.5 * CELL
    for material, (left, right, low, high) in enumerate(
        ((0.0, 1.4, 0.0, plane), (0.3, 0.3 + LENGTH, plane, plane + LAYER))
    ):
        counts = np.round([(right - left) / spacing, (high - low) / spacing]).astype(int)
        size = np.array([right - left, high - low]) / counts
        points = (left, low) + (np.indices(counts).reshape(2, -1).T + 0.5) * size
        model.seed_points(points, np.full(len(points), size.prod()), density=DENSITY, material=material)

    # --- 2. Supports, gravity along the slope, and the stresses that balance it -------------------------------------
    for tag in (1, 2, 3):
        model.fix(tag)
    slope = np.radians(angle)
    model.set_gravity((GRAVITY * np.sin(slope), -GRAVITY * np.cos(slope)))
    particles = model.particles
    (x, y), below = particles.position.T, particles.material == 0
    loaded = (x > 0.3) & (x < 0.3 + LENGTH)
    weight = DENSITY * GRAVITY * np.where(below, plane - y + LAYER * loaded, plane + LAYER - y)
    stress = np.zeros_like(particles.stress)
    stress[:, 1], stress[:, 3] = -weight * np.cos(slope), weight * np.sin(slope)
    stress[:, 0] = stress[:, 2] = 0.43 * stress[:, 1]
    particles.set("stress", stress)

    # --- 3. The weak plane ------------------------------------------------------------------------------------------
    return model, model.add_field_contact((0.0, 1.0), friction=FRICTION)


def velocity_of_layer(model):
    """Mean velocity of the layer along the plane [m/s]."""
    mine = model.particles.material == 1
    mass, speed = model.particles.mass[mine], model.particles.velocity[mine, 0]
    return comm.allreduce(mass @ speed) / comm.allreduce(mass.sum())


def slide(angle, mesh):
    """Mean shear and normal force of the plane on the layer [N/m], and the layer's acceleration [m/s2]."""
    model, contact = layer_on_plane(angle, mesh)
    list(model.explicit(START, pic=0.05, damping=0.5))
    impulse, velocity = contact.impulse, velocity_of_layer(model)
    list(model.explicit(END, pic=0.05))
    shear, normal = (contact.impulse - impulse) / (END - START)
    return -shear, normal, (velocity_of_layer(model) - velocity) / (END - START)


def run(quick: bool, folder) -> Result:
    checks, curves = [], {}
    for mesh in ("irregular",) if quick else MESHES:
        # --- 4. Shear over normal force as the slope is steepened -----------------------------------------------------
        angles = np.array([10.0, 30.0] if quick else [5.0, 10.0, 15.0, 25.0, 30.0, 35.0, 40.0])
        forces = [slide(angle, mesh)[:2] for angle in angles]
        ratios = np.array([shear / normal for shear, normal in forces])
        curves[f"plane {mesh}" if mesh != "irregular" else "irregular cells"] = (angles, ratios)
        for angle in (10.0, 30.0):
            expected, source = (
                (np.tan(np.radians(angle)), "tan β, the layer stays")
                if angle < 20
                else (FRICTION, "μ, the layer slides")
            )
            checks.append(Check(f"shear over normal force at β = {angle:g}°, plane {mesh}", expected, source,
                                ratios[angles == angle][0], 0.005))  # fmt: skip

        # --- 5. The angle at which it fails ---------------------------------------------------------------------------
        for angle in (19.5, 20.5):
            driving = GRAVITY * np.sin(np.radians(angle))
            left = max(0.0, driving - FRICTION * GRAVITY * np.cos(np.radians(angle)))
            source = "the layer stays" if left == 0 else "g (sin β - μ cos β)"
            checks.append(Check(f"acceleration at β = {angle:g}°, plane {mesh}", left, source, slide(angle, mesh)[2], 0.005,
                                "m/s²", scale=driving, over="g sin β"))  # fmt: skip

    # --- 6. Picture -------------------------------------------------------------------------------------------------
    if comm.rank == 0:
        beta = np.linspace(0.0, 42.0, 85)
        expected = {"least of tan β and μ": (beta, np.minimum(np.tan(np.radians(beta)), FRICTION))}
        save_comparison(
            folder / "friction.png", curves, expected, ("Angle β of the slope [degrees]", "Shear over normal force [-]")
        )
    return Result(
        checks,
        {"friction.png": "Force of a weak plane on a layer of soil that stays up to 20° and slides on steeper slopes"},
    )
