"""A block of soil on a layer of soil, for the tests of contact between velocity fields."""

import numpy as np
from core_cases import box

import mpm_core as mpm

GRAVITY, SIDE, HEIGHT, THICKNESS, LENGTH = 10.0, 0.05, 0.3, 0.2, 0.5  # m/s2; cells, layer, block [m]
DENSITY = 1000.0  # of the block; the layer has twice that


def fill(model, low, high, *, density, material, spacing=0.5 * SIDE):
    """Particles on a grid in a box."""
    low, high = np.array(low, float), np.array(high, float)
    counts = np.maximum(1, np.round((high - low) / spacing).astype(int))
    centres = (np.indices(counts).reshape(len(counts), -1).T + 0.5) / counts * (high - low) + low
    volumes = np.full(len(centres), np.prod((high - low) / counts))
    model.seed_points(centres, volumes, density=density, material=material)


def block_on_layer(angle, friction, *, mesh=None, shift=0.0, adhesion=0.0, contact=True, interface=(0.0, 1.0)):
    """A block on a layer that is held at its base and ends, with gravity at an angle to the vertical [degrees].

    Args:
        shift: of the interface, so that it cuts the cells [m].
        contact: whether the two touch; else they pass through one another.

    Returns:
        The model and the contact; both bodies start with the stress that balances their weight where the block sticks.
    """
    mesh = box((28, 14), (1.4, 0.7), diagonals="alternating", shake=0.2) if mesh is None else mesh
    soil = mpm.LinearElastic(young=1e7, poisson=0.2)
    model = mpm.Model(mesh, [soil, soil], velocity_fields=[0, 1])
    top = HEIGHT + shift
    fill(model, (0.0, 0.0), (1.4, top), density=2 * DENSITY, material=0)
    fill(model, (0.3, top), (0.3 + LENGTH, top + THICKNESS), density=DENSITY, material=1)
    for tag in (1, 2, 3):
        model.fix(tag)
    slope = np.radians(angle)
    model.set_gravity((GRAVITY * np.sin(slope), -GRAVITY * np.cos(slope)))
    touch = None
    if contact:
        touch = model.add_field_contact(interface, friction=friction, adhesion=adhesion)
    particles = model.particles
    block, (x, y) = particles.material == 1, particles.position.T
    above = np.where(block, top + THICKNESS - y, np.where((x > 0.3) & (x < 0.3 + LENGTH), THICKNESS, 0.0))
    stress = np.zeros_like(particles.stress)
    pressure = DENSITY * GRAVITY * (above + np.where(block, 0.0, 2 * (top - y)))
    stress[:, 1], stress[:, 3] = -pressure * np.cos(slope), pressure * np.sin(slope)
    stress[:, 0] = stress[:, 2] = 0.25 * stress[:, 1]
    particles.set("stress", stress)
    return model, touch


def weight(angle):
    """Components of the block's weight along the interface and normal to it [N/m]."""
    slope = np.radians(angle)
    return DENSITY * GRAVITY * LENGTH * THICKNESS * np.array([np.sin(slope), np.cos(slope)])


def velocity_of(model, material):
    """Mean velocity of the particles of a law [m/s]."""
    mine = model.particles[model.particles.material == material]
    return (mine.mass[:, None] * mine.velocity).sum(axis=0) / mine.mass.sum()
