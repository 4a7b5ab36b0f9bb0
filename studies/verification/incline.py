"""Cylinder on an inclined plane: it slides without friction and rolls without slip.

A solid elastic cylinder is in contact with the plane by the nodes of the background mesh alone: nodes on the plane move along
it only (sliding) or not at all (rolling). The axes are parallel and normal to the plane; gravity is inclined. The centre of
the sliding cylinder moves by g sin(α) t²/2, that of the rolling one by two thirds of this, since its moment of inertia is m
R²/2. The cylinder starts one cell above the plane, where this contact begins; particles that start without stress at fixed
nodes would have to be pulled off them.
"""

import numpy as np
from _case import Check, Result
from _plots import save_comparison
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

RADIUS, ANGLE, GRAVITY, TIME = 0.5, np.radians(30), 10.0, 0.6  # m, -, m/s2, s
PLANE, ACCELERATION = 3, GRAVITY * np.sin(ANGLE)


def run(quick: bool, folder) -> Result:
    cell, checks, curves, exact = RADIUS / (8 if quick else 16), [], {}, {}
    for name, fraction in (("sliding", 1.0), ("rolling", 2 / 3)):
        # --- 1. A cylinder on the plane ------------------------------------------------------------------------------
        counts = [round(3.0 / cell), round(2.4 * RADIUS / cell)]
        lengths = [cell * n for n in counts]
        domain, cell_tags, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, lengths, counts)
        soil = mpm.LinearElastic(young=4e6, poisson=0.3)
        model = mpm.Model(bridge.background_mesh(domain, cell_tags, facet_tags), soil)
        spacing = cell / 3
        side = np.arange(-RADIUS + spacing / 2, RADIUS, spacing)
        grid = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
        disc = grid[np.hypot(*grid.T) < RADIUS] + [1.3 * RADIUS, RADIUS + cell]
        model.seed_points(disc, np.full(len(disc), spacing**2), density=1000.0)
        model.roller(PLANE, (0, 1)) if name == "sliding" else model.fix(PLANE)

        # --- 2. Gravity along the plane from a start at rest --------------------------------------------------------
        model.set_gravity((ACCELERATION, -GRAVITY * np.cos(ANGLE)))
        path, comm = [(0.0, 0.0)], MPI.COMM_WORLD
        for report in model.explicit(TIME, every=TIME / 30):
            moved = comm.allreduce((model.particles.mass[:, None] * model.particles.displacement).sum(axis=0))
            path.append((report.time, moved[0] / report.mass))

        # --- 3. Path of its centre ----------------------------------------------------------------------------------
        time, moved = np.array(path).T
        expected = fraction * ACCELERATION * TIME**2 / 2
        tolerance = 0.005 if name == "sliding" else 0.03
        source = "g sin(α) t² / 2" if name == "sliding" else "2/3 g sin(α) t² / 2, solid cylinder without slip"
        checks.append(Check(f"path of the centre, {name}", expected, source, moved[-1], tolerance, "m"))
        curves[name] = (time, moved)
        exact[f"{name}, exact"] = (time, fraction * ACCELERATION * time**2 / 2)

    # --- 4. Picture -------------------------------------------------------------------------------------------------
    if MPI.COMM_WORLD.rank == 0:
        save_comparison(folder / "path.png", curves, exact, ("Time [s]", "Path of the centre [m]"))
    return Result(
        checks, {"path.png": "Path of the centre of a cylinder that slides and of one that rolls down a plane"}
    )
