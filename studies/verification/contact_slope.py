"""Bodies on a slope: a block of soil that slides or sticks on a rigid plane, and cylinders and spheres that roll on soil.

The slope is modelled by the direction of gravity, which is raised from zero over 0.1 s so that bodies do not bounce. A rigid
body whose acceleration rises linearly to a during the time T has travelled the distance a (T²/6 + T u/2 + u²/2) at the time T
+ u; the leap-frog scheme adds half a step with the last velocity to it. The block slides with a = g (sin θ - μ cos θ) on a
plane that lies along the cells, is inclined to them, or runs through irregular ones; on slopes flatter than the friction angle
it does not move. A cylinder rolls with 2/3 g sin θ where μ ≥ tan θ / 3, a sphere with 5/7 g sin θ where μ ≥ 2/7 tan θ; with
less friction they slide, with angular accelerations of 2 μ g cos θ and 5/2 μ g cos θ over their radius. The plane must not act
on a falling block before the block touches it.
"""

import numpy as np
from _case import Check, Result
from _plots import save_comparison
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

G, RISE, TOLERANCE = 9.81, 0.1, 0.005  # m/s2, s, -
CELL = 0.25  # m
MESHES = {"along cells": (0.0, 0.0), "inclined to cells": (0.3, 0.0), "through irregular cells": (0.0, 0.2)}
"""Angle of the plane to the mesh, and by how much of a cell inner nodes are moved"""
SLIDES = ((30, 0.0), (30, 0.2), (30, 0.3), (30, 0.5), (45, 0.3), (45, 0.5))
STICKS = ((30, 0.62), (45, 1.1))
"""Slopes [degrees] and friction"""
comm = MPI.COMM_WORLD


def way(acceleration, end):
    """Displacement of a body under a force that rises over the time RISE [m]."""
    u = end - RISE
    return acceleration * (RISE**2 / 6 + RISE * u / 2 + u**2 / 2)


def sliding(slope, friction):
    """Acceleration of a body that slides [m/s2]."""
    return G * (np.sin(np.radians(slope)) - friction * np.cos(np.radians(slope)))


def gravity(slope):
    return G * np.sin(np.radians(slope)), -G * np.cos(np.radians(slope))


# --- 1. The block ----------------------------------------------------------------------------------------------------


def block(mesh, drop=0.0):
    """A block of 1 m by 0.5 m over a plane, the plane, and the rotation that turns the axes into those of the plane."""
    angle, shake = MESHES[mesh]
    domain, cell_tags, facet_tags = bridge.box_mesh(comm, [7.0, 3.0], [28, 12])
    x, inner = domain.geometry.x, np.ones(len(domain.geometry.x), bool)
    for axis, length in ((0, 7.0), (1, 3.0)):
        inner &= (x[:, axis] > 1e-9) & (x[:, axis] < length - 1e-9)
    x[inner, :2] += shake * CELL * np.sin(7.0 * x[inner, 1::-1] / CELL + x[inner, :2] / CELL)
    model = mpm.Model(bridge.background_mesh(domain, cell_tags, facet_tags), mpm.LinearElastic(young=2e7, poisson=0.3))
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    side, corner = 1 / 16, np.array([0.5, 0.8])
    points = side * (np.indices((16, 8)).reshape(2, -1).T + 0.5) + (0, drop)
    model.seed_points(corner + points @ turn.T, np.full(len(points), side**2), density=1000.0)
    normal = turn @ (0, 1)
    return model, mpm.Plane(corner - 1e-12 * normal, normal), turn


def moved(model, direction):
    """Mean displacement along a direction [m]; its particles are as heavy as each other."""
    sums = np.array([(model.particles.displacement @ direction).sum(), len(model.particles)])
    total = comm.allreduce(sums)
    return float(total[0] / total[1])


def slid(mesh, slope, friction):
    """The way of the block after 1 s, and the expected one if it slides [m]."""
    model, plane, turn = block(mesh)
    model.set_gravity(turn @ gravity(slope), ramp=RISE)
    model.add_contact(plane, friction=friction)
    report = model.explicit(1.0).last()
    a = sliding(slope, friction)
    return moved(model, turn[:, 0]), way(a, 1.0) + a * (1.0 - RISE / 2) * report.dt / 2


def crept(slope, friction):
    """Displacement of a sticking block once it is at rest, over that of a block without friction [-]."""
    model, plane, _ = block("along cells")
    model.set_gravity(gravity(slope), ramp=0.4)
    model.add_contact(plane, friction=friction)
    model.explicit(0.8).last()
    start = moved(model, (1, 0))
    model.explicit(1.6).last()
    return (moved(model, (1, 0)) - start) / (0.5 * sliding(slope, 0.0) * 0.8**2)


def fallen(drop=0.2):
    """Distance that the block falls before the plane acts on it [m]."""
    model, plane, _ = block("along cells", drop)
    model.set_gravity((0, -G))
    ground, last = model.add_contact(plane), 0.0
    for _ in model.explicit(0.3, every_steps=1):
        if np.any(ground.force):
            return last
        last = -moved(model, (0, 1))
    return last


# --- 2. Cylinders and spheres ----------------------------------------------------------------------------------------


def layer(counts, size, height, per_side):
    """Stiff soil of this height on a fixed base, over the whole length of a box [m]."""
    diagonals = "alternating" if len(counts) == 2 else "one-way"
    mesh = bridge.background_mesh(*bridge.box_mesh(comm, size, counts, diagonals))
    model = mpm.Model(mesh, mpm.LinearElastic(young=1e8, poisson=0.3))
    side = size[0] / counts[0] / per_side
    numbers = [round(length / side) for length in (*size[:-1], height)]
    points = side * (np.indices(numbers).reshape(len(size), -1).T + 0.5)
    model.seed_points(points, np.full(len(points), side ** len(size)), density=2000.0)
    model.fix(2 * len(size) - 1)
    return model


def rolled(shape, slope, friction):
    """The way of a body of 0.5 m radius, that of its circumference, and the expected ones [m]."""
    radius, theta = 0.5, np.radians(slope)
    along, down = gravity(slope)
    if shape == "cylinder":
        model, part, spin, end = layer((48, 4), (3.0, 0.25), 0.125, 6), 2 / 3, 2.0, 0.5
        model.set_gravity((along, down), ramp=RISE)
        surface, mass = mpm.Disc((0.6, 0.125 + radius + 1e-9), radius), 500.0
    else:
        model, part, spin, end = layer((24, 3, 2), (1.5, 0.1875, 0.125), 0.0625, 4), 5 / 7, 2.5, 0.4
        model.set_gravity((along, 0.0, down), ramp=RISE)
        surface, mass = mpm.Sphere((0.4, 0.094, 0.0625 + radius + 1e-9), radius), 20.0  # a heavy one creeps
    body = model.add_contact(surface, friction=friction, body=mpm.FreeBody(mass=mass))
    model.explicit(end, damping=0.7, energy_limit=np.inf).last()
    rolls = friction >= (1 - part) * np.tan(theta)
    a = part * along if rolls else sliding(slope, friction)
    turned = -body.angle[0] if shape == "cylinder" else body.angle[1]
    return (
        body.displacement[0],
        turned * radius,
        way(a, end),
        way(a if rolls else spin * friction * G * np.cos(theta), end),
    )


# --- 3. All together -------------------------------------------------------------------------------------------------


def run(quick: bool, folder) -> Result:
    checks, computed = [], {}
    for mesh in ("through irregular cells",) if quick else MESHES:
        pairs = SLIDES[2:3] if quick else SLIDES
        ways = [slid(mesh, slope, friction) for slope, friction in pairs]
        for (slope, friction), (found, expected) in zip(pairs, ways, strict=True):
            checks.append(Check(f"displacement of a block, θ = {slope}°, μ = {friction:g}, plane {mesh}", expected,
                                "g (sin θ - μ cos θ)", found, TOLERANCE, "m"))  # fmt: skip
        steep = [(friction, found) for (slope, friction), (found, _) in zip(pairs, ways, strict=True) if slope == 30]
        computed[f"plane {mesh}"] = tuple(np.array(steep).T)
    for slope, friction in () if quick else STICKS:
        checks.append(Check(f"creep of a block, θ = {slope}°, μ = {friction:g}, over the displacement without friction", 0.0,
                            "it sticks", crept(slope, friction), TOLERANCE, scale=1.0,
                            over="the displacement without friction"))  # fmt: skip
    checks.append(Check("fall of a block before the plane acts on it", 0.2, "the gap at the start",
                        fallen(), 0.05, "m", scale=CELL, over="the cell size"))  # fmt: skip
    bodies = [
        ("cylinder", 30, 0.3),
        ("cylinder", 30, 0.1),
        ("cylinder", 45, 0.5),
        ("sphere", 30, 0.3),
        ("sphere", 30, 0.1),
    ]
    for shape, slope, friction in bodies[1:2] if quick else bodies:
        found, turned, expected, expected_turn = rolled(shape, slope, friction)
        name, part = f"{shape}, θ = {slope}°, μ = {friction:g}", "2/3" if shape == "cylinder" else "5/7"
        source = f"{part} g sin θ: it rolls" if expected == expected_turn else "g (sin θ - μ cos θ): it slides"
        checks.append(Check(f"displacement of a {name}", expected, source, found, TOLERANCE, "m"))
        checks.append(Check(f"rotation of a {name}, times its radius", expected_turn, source, turned, TOLERANCE, "m"))

    if comm.rank == 0:
        friction = np.linspace(0.0, 0.55, 60)
        exact = {"exact, a = g (sin θ - μ cos θ)": (friction, way(sliding(30, friction), 1.0))}
        save_comparison(folder / "way.png", computed, exact,
                        ("Coefficient of friction μ [-]", "Displacement after 1 s on a slope of 30° [m]"),
                        limits=((0.0, None), (0.0, None)))  # fmt: skip
    return Result(checks, {"way.png": "Displacement of a block on a rigid plane over the coefficient of friction"})
