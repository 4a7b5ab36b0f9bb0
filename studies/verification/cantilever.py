"""A cantilever that swings down under its weight: a finite-strain law in a large deflection with inertia.

Gravity acts at once on a beam of Hencky's law, which swings down by half of its length and back, with logarithmic strains of a
third at the clamp. The reference solution is computed here by quadratic finite elements in a total Lagrangian formulation,
with the strain energy of the same law and the midpoint rule in time. Its cells and steps are so small that halving them
changes the deflection by less than 0.2 %. With the same moduli, a beam whose law is linear in the Cauchy stress would swing
2.5 % less far, which is more than the tolerance.

Linear triangles are stiff in bending; the error falls by a factor of four or more when cells are halved. Particles cross from
cell to cell, and the noise of these crossings makes a beam softer, so that it swings farther and does not return. This noise
decreases only with the number of particles in a cell: with 72 particles the beam returns nearly to its initial position, with
12 it does not. On the finest cells the two errors have opposite signs and partly cancel: with 128 particles the deflection is
0.2 % smaller than with 72. Cells that move with the beam (`moving_cells`) have no crossings: there 4.5 particles in a cell bring it
back to where the finite elements do, and hardly any energy is unexplained.
"""

from typing import NamedTuple

import numpy as np
from _case import Check, Kind, Result
from _hencky_elements import SwingingBeam
from _plots import save_comparison
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

LENGTH, HEIGHT, TIP = 2.0, 1.0, 0.25  # m; the tip is the end whose mean displacement is followed
YOUNG, POISSON, DENSITY, GRAVITY = 5e5, 0.3, 1000.0, 10.0  # Pa, -, kg/m3, m/s2
END, EVERY = 1.32, 0.02  # s: a little more than the period, and the time between samples
PER_SIDE, FEW, FEWEST = 12, 5, 3
"""Particles along the side of a square, which has two cells; the last with cells that move"""
NOISE = (
    "The gradients of linear shape functions jump where particles cross from cell to cell. With few particles in a cell this "
    "noise makes the beam softer and takes strain energy from it, on finer cells too."
)


class Swing(NamedTuple):
    """Motion of the tip, and energy that is not explained over the work of gravity to the lowest place, both over time."""

    time: np.ndarray
    moved: np.ndarray
    unexplained: np.ndarray

    @property
    def lowest(self) -> tuple[float, float]:
        """Time [s] and displacement [m] at the top of the parabola through the three samples around the lowest."""
        k = int(np.argmin(self.moved))
        a, b, c = np.polyfit(self.time[k - 1 : k + 2] - self.time[k], self.moved[k - 1 : k + 2], 2)
        return float(self.time[k] - b / (2 * a)), float(c - b**2 / (4 * a))

    @property
    def returned(self) -> float:
        """Highest displacement after the lowest [m]."""
        return float(self.moved[np.argmin(self.moved) :].max())


# --- 1. By finite elements, and by particles -------------------------------------------------------------------------


def by_elements(squares: int, dt: float) -> Swing:
    beam = SwingingBeam((LENGTH, HEIGHT), squares, (YOUNG, POISSON), DENSITY, GRAVITY, dt, TIP)
    time, moved = beam.swing(END)
    return Swing(time, moved, np.zeros_like(time))


def by_particles(squares: int, per_side: int, implicit: bool = False, moving_cells: bool = False) -> Swing:
    """On each rank alike, which computes all of it."""
    h = HEIGHT / squares
    below, above = round(1.75 * squares), round(0.5 * squares)
    counts = np.array([round(2.5 * squares), below + squares + above])
    parts = bridge.box_mesh(MPI.COMM_SELF, counts * h, counts)
    law = mpm.Hencky(mpm.LinearElastic(young=YOUNG, poisson=POISSON))
    model = mpm.Model(bridge.background_mesh(*parts), law)
    d = h / per_side
    grid = d * (np.indices((round(LENGTH / d), round(HEIGHT / d))).reshape(2, -1).T + 0.5)
    model.seed_points(grid + [0.0, below * h], np.full(len(grid), d**2), density=DENSITY)
    model.fix(1)
    model.set_gravity((0.0, -GRAVITY))

    p = model.particles
    tip = p.id[p.position[:, 0] > LENGTH - TIP]
    rows = [(0.0, 0.0, 0.0, 0.0)]
    if implicit:
        run = model.implicit(END, dt=EVERY, every=EVERY, second_order=True)
    else:
        run = model.explicit(END, every=EVERY, moving_cells=moving_cells)
    for report in run:
        moved = p.displacement[np.isin(p.id, tip), 1].mean()
        rows.append((report.time, moved, report.unexplained_energy, report.external_work))
    time, moved, unexplained, work = np.array(rows).T
    return Swing(time, moved, unexplained / work.max())


# --- 2. Checks -------------------------------------------------------------------------------------------------------


def against(name: str, swing: Swing, expected: Swing, tolerance: float, limit: str = "") -> list[Check]:
    """The way down and back against the finite elements."""
    (time, lowest), (expected_time, expected_lowest) = swing.lowest, expected.lowest
    source = "quadratic finite elements"
    return [
        Check(f"largest deflection of the tip, {name}", -expected_lowest, source, -lowest, tolerance, "m", limit=limit),
        Check(f"time of the largest deflection, {name}", expected_time, source, time, tolerance, "s", limit=limit),
        Check(f"position of the tip after it has swung back, {name}", expected.returned, source,
              swing.returned, 3 * tolerance, "m", scale=-expected_lowest, over="the largest deflection", limit=limit),
    ]  # fmt: skip


def energy(name: str, swing: Swing, tolerance: float = 0.005) -> list[Check]:
    """At the largest deflection, and the largest of the whole way, over the work of gravity."""
    source, size = "energy balance: works, stored energy and losses add up", np.abs(swing.unexplained)
    at_lowest = size[np.argmin(swing.moved)]
    return [
        Check(f"unexplained energy at the largest deflection, {name}", 0.0, source, at_lowest, tolerance, scale=1.0,
              over="the work of gravity"),
        Check(f"largest unexplained energy on the way down and back, {name}", 0.0, source, size.max(), 4 * tolerance, scale=1.0,
              over="the work of gravity"),
    ]  # fmt: skip


def run(quick: bool, folder) -> Result:
    meshes, elements, dt = ((4, 8), 8, 0.02) if quick else ((4, 8, 16), 16, 0.01)
    expected = by_elements(elements, dt)
    coarse = {"cells": by_elements(elements // 2, dt), "steps": by_elements(elements // 2, 2 * dt)}
    found = {squares: by_particles(squares, PER_SIDE) for squares in meshes}
    fine, depth = meshes[-1], -expected.lowest[1]
    checks = []

    # --- 3. The reference has converged ------------------------------------------------------------------------------
    for what, one, other in (("cells", coarse["cells"], expected), ("steps", coarse["steps"], coarse["cells"])):
        checks.append(Check(f"largest deflection by finite elements, {what} halved", -one.lowest[1],
                            "the same computation before halving", -other.lowest[1],
                            0.01 if quick else 0.002, "m"))  # fmt: skip

    # --- 4. Particles ------------------------------------------------------------------------------------------------
    name = f"{fine} squares over the height, explicit"
    checks += against(name, found[fine], expected, 0.03 if quick else 0.01) + energy(name, found[fine])
    errors = [abs(found[squares].lowest[1] + depth) / depth for squares in meshes]
    for before, after, squares in zip(errors, errors[1:], meshes[1:]):
        checks.append(Check(f"error of the largest deflection, {squares} squares", before / 4,
                            "a quarter of the error with half as many squares", after, 0.0, kind=Kind.AT_MOST))  # fmt: skip
    moving = by_particles(fine, FEWEST, moving_cells=True)
    name = f"{fine} squares, {FEWEST**2 / 2:g} particles in a cell, moving cells"
    checks += against(name, moving, expected, 0.01) + energy(name, moving, 0.001)
    if not quick:
        implicit = by_particles(8, PER_SIDE, implicit=True)
        checks.append(Check("largest deflection of the tip, 8 squares, implicit", -found[8].lowest[1],
                            "explicit scheme on the same cells", -implicit.lowest[1], 0.01, "m"))  # fmt: skip
        few = by_particles(fine, FEW)
        checks += against(f"{fine} squares, {FEW**2 / 2:g} particles in a cell", few, expected, 0.01, NOISE)

    # --- 5. Pictures -------------------------------------------------------------------------------------------------
    if MPI.COMM_WORLD.rank == 0:
        curves = {f"{squares} squares over the height": each[:2] for squares, each in found.items()}
        curves[name] = moving[:2]
        if not quick:
            curves[f"{fine} squares, {FEW**2 / 2:g} particles in a cell"] = few[:2]
        save_comparison(folder / "tip.png", curves, {"quadratic finite elements": expected[:2]},
                        ("Time [s]", "Displacement of the tip, upwards [m]"), joined=True)  # fmt: skip
    return Result(checks, {
        "tip.png": f"Displacement of the tip of the cantilever; {PER_SIDE**2 // 2} particles in a cell where nothing else is said"
    })  # fmt: skip
