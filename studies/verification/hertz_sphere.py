"""A rigid sphere pressed on an elastic half space: force and contact radius of Hertz (1882).

The sphere of radius R is a contact body, the half space a half section of 40 contact radii that is finest where they touch.
For an indentation d the contact radius is a = sqrt(R d), and the force F = 4/3 E* sqrt(R) d^1.5 with E* = E / (1 - nu^2).
The ground that is missing beyond 40 a takes 1 to 2 % more force; the springs of contact, which let particles sink in by
a part of the pressure over the stiffness of a cell, take about as much less.
"""

import numpy as np
from _case import Check, Result, run_alone
from _plots import save_comparison
from mpi4py import MPI
from mpm_core.surfaces import distances

import fenics_bridge as bridge
import mpm_core as mpm

RADIUS, INDENTATION, YOUNG, POISSON, DENSITY = 1.0, 0.01, 1e7, 0.3, 1000.0  # m, m, Pa, -, kg/m3
HERTZ = "Hertz 1882"
AXIS, FAR, BASE = 1, 2, 3


def contact_radius(indentation):
    return np.sqrt(RADIUS * indentation)


def force(indentation):
    """[N]."""
    return 4 / 3 * YOUNG / (1 - POISSON**2) * np.sqrt(RADIUS) * indentation**1.5


def graded(cells):
    """Coordinates from 0 outwards: even over two contact radii, then growing up to 40 of them."""
    a = contact_radius(INDENTATION)
    size = a / cells
    steps = [size] * (2 * cells)
    while sum(steps) < 40 * a:
        steps.append(1.15 * steps[-1])
    return np.concatenate([[0.0], np.cumsum(steps)])


def half_space(cells):
    """The ground under two rows of empty cells, with four particles in a square; each rank has all of it."""
    x = graded(cells)
    y = np.concatenate([-x[:0:-1], x[:3]])
    counts = [len(x) - 1, len(y) - 1]
    box = bridge.background_mesh(*bridge.box_mesh(MPI.COMM_SELF, np.array(counts, dtype=float), counts))
    number = np.rint(box.points).astype(int)
    nodes = np.column_stack([x[number[:, 0]], y[number[:, 1]]])
    edges = np.sort(box.cells[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    sides = {AXIS: nodes[:, 0] == 0, FAR: nodes[:, 0] == x[-1], BASE: nodes[:, 1] == y[0]}
    facets = [edges[side[edges].all(axis=1)] for side in sides.values()]
    tags = np.repeat(list(sides), [len(rows) for rows in facets]).astype(np.int32)
    mesh = mpm.Mesh(nodes, box.cells, facets=np.concatenate(facets).astype(np.int32), facet_tags=tags)
    model = mpm.Model(mesh, mpm.LinearElastic(young=YOUNG, poisson=POISSON), geometry=mpm.Geometry.AXISYMMETRIC)
    (r, width), (z, height) = (halves(nodes) for nodes in (x, y[:-2]))
    points = np.stack(np.meshgrid(r, z, indexing="ij"), axis=-1).reshape(-1, 2)
    model.seed_points(points, np.outer(r * width, height).ravel(), density=DENSITY)
    model.roller(AXIS, (1, 0))
    model.roller(FAR, (1, 0))
    model.fix(BASE)
    return model


def halves(nodes):
    """Centres and lengths of the halves of all intervals."""
    lengths = np.repeat(0.5 * np.diff(nodes), 2)
    return nodes[0] + np.cumsum(lengths) - 0.5 * lengths, lengths


def pressed(cells):
    """Indentations, forces [N], and the contact radius in the end."""
    model = half_space(cells)
    wave = np.sqrt(model.laws[0].p_wave_modulus / DENSITY)
    until = 20 * 40 * contact_radius(INDENTATION) / wave
    speed = INDENTATION / (0.9 * until)  # it begins slowly, and rests in the end
    motion = (
        [0.0, 0.2 * until, 0.8 * until, 0.9 * until],
        [(0.0, v) for v in (0.0, -speed / 0.7 * 0.9, -speed / 0.7 * 0.9, 0.0)],
    )
    ball = model.add_contact(mpm.Disc((0.0, RADIUS + 1e-9), RADIUS), velocity=motion, penalty=1.0)
    rows = [(0.0, 0.0, 0.0)]
    for report in model.explicit(until, every=until / 40, damping=0.3, integration=mpm.Integration.MIXED):
        rows.append((report.time, -ball.displacement[1], ball.impulse[1]))
    time, way, impulse = np.array(rows).T
    particles = model.particles
    size = np.sqrt(particles.volume / particles.position[:, 0])
    sphere = mpm.Disc((0.0, RADIUS + 1e-9 - way[-1]), RADIUS)
    touching = distances(sphere, particles.position) < 0.5 * size
    radius = float((particles.position[:, 0] + 0.5 * size)[touching].max())
    return way[1:], 2 * np.pi * np.diff(impulse) / np.diff(time), radius


def run(quick: bool, folder) -> Result:
    # --- 1. The sphere -----------------------------------------------------------------------------------------------
    cells = 6 if quick else 12  # in a contact radius
    way, load, radius = pressed(cells)
    tolerance = 0.1 if quick else 0.04
    checks = [
        Check("force", force(way[-1]), HERTZ, load[-1], tolerance, unit="N"),
        Check("contact radius", contact_radius(way[-1]), HERTZ, radius, 1.0 / cells, unit="m"),
    ]
    half = int(np.argmin(np.abs(way - 0.5 * way[-1])))
    slope = np.log(load[-1] / load[half]) / np.log(way[-1] / way[half])
    checks.append(Check("exponent of the indentation in the force", 1.5, HERTZ, slope, tolerance))

    # --- 2. Picture --------------------------------------------------------------------------------------------------
    if MPI.COMM_WORLD.rank == 0:
        depth = np.linspace(0, way[-1], 60)
        exact = {HERTZ: (1e3 * depth, 1e-3 * force(depth))}
        save_comparison(folder / "force.png", {"particles": (1e3 * way, 1e-3 * load)}, exact,
                        ("Indentation [mm]", "Force [kN]"), limits=((0.0, None), (0.0, None)))  # fmt: skip
    return Result(checks, {"force.png": "Force on a sphere of 1 m that is pressed on an elastic half space"})


if __name__ == "__main__":
    run_alone(run)
