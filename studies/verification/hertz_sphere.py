"""A rigid sphere pressed on an elastic half-space: force, contact radius and pressure after Hertz (1882).

The sphere of radius R is a rigid contact body; the half-space is a half section of 40 contact radii, whose cells are smallest
under the sphere. For an indentation d the contact radius is a = sqrt(R d), and the force F = 4/3 E* sqrt(R) d^1.5 with E* = E
/ (1 - nu^2). The ground beyond 40 a, which is missing, would reduce the force by 1 to 2 %. The penalty stiffness of contact,
which lets particles penetrate the sphere slightly, reduces the computed force by about as much.

The pressure p_0 sqrt(1 - (r / a)^2), p_0 = 2 E* a / (pi R), is compared in implicit steps with a hundredth of the indentation,
since Hertz's theory assumes small strains. Contact forces of neighbouring particles are distributed by their common nodes, so
that pressures are compared as means over rings.
"""

import numpy as np
from _case import Check, Kind, Result
from _plots import save_comparison
from mpi4py import MPI
from mpm_core.surfaces import distances

import fenics_bridge as bridge
import mpm_core as mpm

RADIUS, INDENTATION, YOUNG, POISSON, DENSITY = 1.0, 0.01, 1e7, 0.3, 1000.0  # m, m, Pa, -, kg/m3
SLIGHT, PENALTY, RINGS = 1e-4, 0.2, 6
"""Indentation [m], beta and rings of the implicit steps"""
HERTZ = "Hertz 1882"
AXIS, FAR, BASE = 1, 2, 3


def contact_radius(indentation):
    return np.sqrt(RADIUS * indentation)


def force(indentation):
    """[N]."""
    return 4 / 3 * YOUNG / (1 - POISSON**2) * np.sqrt(RADIUS) * indentation**1.5


def graded(cells, a):
    """Coordinates from 0 outwards: even over two contact radii, then growing up to 40 of them."""
    size = a / cells
    steps = [size] * (2 * cells)
    while sum(steps) < 40 * a:
        steps.append(1.15 * steps[-1])
    return np.concatenate([[0.0], np.cumsum(steps)])


def half_space(cells, indentation):
    """The ground under two rows of empty cells, with four particles in a square; each rank has all of it."""
    x = graded(cells, contact_radius(indentation))
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
    model = half_space(cells, INDENTATION)
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


def pressure(cells):
    """Radii of rings over that of the contact, mean pressures over p_0, those of Hertz, and the force over his."""
    model = half_space(cells, SLIGHT)
    ball = model.add_contact(mpm.Disc((0.0, RADIUS + 1e-9), RADIUS), velocity=(0.0, -SLIGHT), penalty=PENALTY)
    model.implicit(1.0, dt=0.1, quasi_static=True, integration=mpm.Integration.MIXED).last()
    particles, a = model.particles, contact_radius(SLIGHT)
    r = particles.position[:, 0]
    size = np.sqrt(particles.volume / r)
    sphere = mpm.Disc((0.0, RADIUS + 1e-9 - SLIGHT), RADIUS)
    depth = np.maximum(0.5 * size - distances(sphere, particles.position), 0.0)
    load = 2 * np.pi * r * 50 * PENALTY * model.laws[0].p_wave_modulus * depth  # of a particle's spring, all around
    touching = np.flatnonzero(depth)
    order = touching[np.argsort(r[touching])]
    rings = np.linspace(0, 1, RINGS + 1)
    within = np.interp(rings * a, np.r_[0.0, (r + 0.5 * size)[order]], np.r_[0.0, np.cumsum(load[order])])
    area = np.pi * a**2 * np.diff(rings**2)
    greatest = 2 * YOUNG / (1 - POISSON**2) * a / (np.pi * RADIUS)
    hertz = -np.diff((1 - rings**2) ** 1.5) * force(SLIGHT) / (area * greatest)
    return rings, np.diff(within) / area / greatest, hertz, 2 * np.pi * ball.force[1] / force(SLIGHT)


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

    rings, found, hertz, load_ratio = pressure(max(cells, 8))
    spread = float(np.sqrt(np.mean((found - hertz) ** 2)))
    checks.append(Check("force, implicit steps", force(SLIGHT), HERTZ, load_ratio * force(SLIGHT), tolerance, unit="N"))
    checks.append(
        Check("pressure at the centre over p_0, mean within a/6", hertz[0], HERTZ, found[0], 0.2 if quick else 0.05)
    )
    checks.append(Check("root mean square error of the pressure in six rings, over p_0", 0.0, HERTZ, spread,
                        0.15 if quick else 0.05, scale=1.0, over="p_0", kind=Kind.AT_MOST))  # fmt: skip

    # --- 2. Pictures --------------------------------------------------------------------------------------------------
    if MPI.COMM_WORLD.rank == 0:
        depth = np.linspace(0, way[-1], 60)
        exact = {HERTZ: (1e3 * depth, 1e-3 * force(depth))}
        save_comparison(folder / "force.png", {"particles": (1e3 * way, 1e-3 * load)}, exact,
                        ("Indentation [mm]", "Force [kN]"), limits=((0.0, None), (0.0, None)))  # fmt: skip
        middle, r = 0.5 * (rings[1:] + rings[:-1]), np.linspace(0, 1, 100)
        save_comparison(folder / "pressure.png", {"particles, mean over rings": (middle, found)},
                        {HERTZ: (r, np.sqrt(1 - r**2))}, ("Distance from the axis over a [-]", "Pressure over $p_0$ [-]"),
                        limits=((0.0, 1.0), (0.0, None)))  # fmt: skip
    return Result(checks, {
        "force.png": "Force on a sphere of 1 m that is pressed on an elastic half-space",
        "pressure.png": "Pressure between sphere and half-space",
    })  # fmt: skip
