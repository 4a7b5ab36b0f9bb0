"""Whole explicit steps: particle-steps per second on one core, beside what memory and arithmetic allow.

Times are the processor's (not the clock on the wall), the best of several repetitions; ratios are worth more than numbers.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import time
from pathlib import Path

import numpy as np

import mpm_core as mpm

MOVED_BYTES = {2: 8 * (2 * (2 + 2 + 4 + 1 + 1 + 1) + 1), 3: 8 * (2 * (3 + 3 + 6 + 1 + 1 + 1) + 1)}
"""Bytes that a particle-step must move: position, velocity, stress, volume, accumulated deviatoric and plastic strain are read
and written, mass is read."""


def triad_bandwidth(entries: int = 1 << 24, repetitions: int = 5) -> float:
    """Bytes per second of a = b + c by NumPy, one core: what a streaming pass reaches here (STREAM's count of 24 bytes)."""
    a, b, c = np.zeros(entries), np.ones(entries), np.full(entries, 2.0)
    best = np.inf
    for _ in range(repetitions):
        start = time.process_time()
        np.add(b, c, out=a)
        best = min(best, time.process_time() - start)
    return 24 * entries / best


def crossed(nx: int, ny: int, size: float) -> tuple[np.ndarray, np.ndarray]:
    """Squares cut in four by their diagonals."""
    i, j = (a.ravel() for a in np.meshgrid(np.arange(nx), np.arange(ny)))
    x, y = np.meshgrid(np.arange(nx + 1.0), np.arange(ny + 1.0))
    points = np.vstack([np.column_stack([x.ravel(), y.ravel()]), np.column_stack([i + 0.5, j + 0.5])]) * size
    a = j * (nx + 1) + i
    ring, centre = np.stack([a, a + 1, a + nx + 2, a + nx + 1]), (nx + 1) * (ny + 1) + np.arange(nx * ny)
    cells = [np.column_stack([ring[k], ring[(k + 1) % 4], centre]) for k in range(4)]
    return points, np.stack(cells, axis=1).reshape(-1, 3)


def slope(size: float, law) -> mpm.Model:
    """The paper's slope, 10 particles per triangle, sliding from zero stress under 80 kN/m3."""
    points, cells = crossed(round(4.1 / size), round(1.1 / size), size)
    soil = (points[cells].mean(axis=1).sum(axis=1) < 2.1) & (points[cells].mean(axis=1)[:, 1] < 1)
    edges = np.sort(cells[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    x, y = points[edges].mean(axis=1).T
    tags = np.where(x == 0, 1, np.where(y == 0, 2, 0))
    edges, first = np.unique(edges[tags > 0], axis=0, return_index=True)
    mesh = mpm.Mesh(points, cells, cell_tags=soil.astype(np.int32), facets=edges, facet_tags=tags[tags > 0][first])
    model = mpm.Model(mesh, law)
    model.seed(density=80e3 / 9.81, per_cell=10, cell_tag=1)
    model.roller(1, (1, 0))
    model.fix(2)
    model.set_gravity((0, -9.81))
    return model


def block(n: int, law) -> mpm.Model:
    """A box of n^3 small cubes, six tetrahedra each with 8 particles; soil on one side of it slumps to the other."""
    side = n + 1
    axis = np.arange(side) / n
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    i, j, k = (a.ravel() for a in np.meshgrid(*[np.arange(n)] * 3, indexing="ij"))
    first, steps = (i * side + j) * side + k, (side * side, side, 1)
    orders = [(0, 1, 2), (0, 2, 1), (1, 0, 2), (1, 2, 0), (2, 0, 1), (2, 1, 0)]
    cells = np.concatenate([np.cumsum([first] + [np.full_like(first, steps[a]) for a in o], axis=0).T for o in orders])
    faces = np.sort(cells[:, [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]]].reshape(-1, 3), axis=1)
    walls = [np.unique(faces[(points[faces][:, :, a] == end).all(axis=1)], axis=0) for a in range(3) for end in (0, 1)]
    tags = np.repeat(np.arange(6, dtype=np.int32), [len(wall) for wall in walls])
    centres = points[cells].mean(axis=1)
    soil = ((centres[:, 0] < 0.6) & (centres[:, 2] < 0.6)).astype(np.int32)
    mesh = mpm.Mesh(points, cells, cell_tags=soil, facets=np.concatenate(walls), facet_tags=tags)
    model = mpm.Model(mesh, law)
    model.seed(density=80e3 / 9.81, per_cell=8, cell_tag=1)
    for tag in range(4):
        model.roller(tag, np.eye(3)[tag // 2])
    model.fix(4)
    model.set_gravity((0, 0, -9.81))
    return model


def rate(model: mpm.Model, particle_steps: float, repetitions: int, **options) -> tuple[float, mpm.Report]:
    """Particle-steps per second of processor time, the best of the repetitions."""
    dt = 0.5 * model.critical_time_step()
    steps = max(4, round(particle_steps / len(model.particles)))
    best = 0.0
    for _ in range(repetitions):
        before, start = model.report().particle_steps, time.process_time()
        (report,) = model.explicit(model.time + dt * steps, damping=0.75, **options)
        best = max(best, (report.particle_steps - before) / (time.process_time() - start))
    return best, report


def other_laws(soil: mpm.MohrCoulomb) -> dict[str, object]:
    """Laws of like stiffness and strength as the soil."""
    elastic = {"young": soil.young, "poisson": soil.poisson}
    clay = mpm.CamClay(compression=0.2, swelling=0.04, critical_slope=1.0, poisson=0.33, void_ratio=1.0,
                       preconsolidation=5e3, attraction=2e3)  # fmt: skip
    return {
        "Tresca": mpm.tresca(**elastic, shear_strength=5e3), "von Mises": mpm.von_mises(**elastic, yield_stress=9e3),
        "Drucker-Prager": mpm.matched_drucker_prager(**elastic, cohesion=1e3, friction_angle=25.0),
        "softening": mpm.SofteningMohrCoulomb(soil, residual_cohesion=500.0, residual_friction_angle=20.0,
                                              softening_strain=0.1, reference_length=0.05),
        "Cam-Clay": clay, "Hencky of Mohr-Coulomb": mpm.Hencky(soil),
        "undrained Mohr-Coulomb": mpm.Undrained(soil, water_modulus=1e6, porosity=0.4),
    }  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path, help="file for the results")
    parser.add_argument("--small", action="store_true", help="only the small cases")
    a = parser.parse_args()
    elastic = mpm.LinearElastic(young=200e3, poisson=0.33)
    soil = mpm.MohrCoulomb(young=200e3, poisson=0.33, cohesion=1e3, friction_angle=25.0)
    cases = [("slope 2D, Mohr-Coulomb", lambda s=s: slope(s, soil), {}) for s in (0.1, 0.05, 0.025, 0.01, 0.005)]
    cases[2:2] = [
        ("slope 2D, linear elastic", lambda: slope(0.05, elastic), {}),
        ("slope 2D, Mohr-Coulomb, NMD", lambda: slope(0.05, soil), {"nmd": True}),
        ("slope 2D, Mohr-Coulomb, PIC 1 %", lambda: slope(0.05, soil), {"pic": 0.01}),
        ("block 3D, linear elastic", lambda: block(16, elastic), {}),
        ("block 3D, Mohr-Coulomb", lambda: block(16, soil), {}),
    ]
    cases += [(f"slope 2D, {name}", lambda law=law: slope(0.05, law), {}) for name, law in other_laws(soil).items()]
    if a.small:
        cases = [case for case in cases if case[1]().mesh.cells.shape[0] < 20000]
    bandwidth = triad_bandwidth()
    print(f"streaming bandwidth of one core (triad): {bandwidth / 1e9:.1f} GB/s")
    print(f"bytes that a particle-step must move: {MOVED_BYTES[2]} in 2D, {MOVED_BYTES[3]} in 3D\n")
    print(f"{'case':34} {'particles':>10} {'million/s':>10} {'of bandwidth':>13} {'plastic':>8} {'bytes held':>11}")
    rows = []
    for name, make, options in cases:
        model = make()
        speed, report = rate(model, 8e6, 3, **options)
        share = speed * MOVED_BYTES[model.mesh.dim] / bandwidth
        held = model._core.bytes_per_particle()
        rows.append({"case": name, "particles": report.particles, "particle_steps_per_second": speed,
                     "share_of_bandwidth": share, "plastic_share": report.plastic_share, "bytes_held": held})  # fmt: skip
        print(
            f"{name:34} {report.particles:10d} {speed / 1e6:10.1f} {share:13.0%} {report.plastic_share:8.0%} {held:11.0f}"
        )
    if a.json:
        machine = {"processor": platform.processor() or platform.machine(), "cores": os.cpu_count(),
                   "compiler": mpm.compiler, "program": mpm.__version__}  # fmt: skip
        a.json.write_text(json.dumps({"machine": machine, "bandwidth": bandwidth, "cases": rows}, indent=2) + "\n")


if __name__ == "__main__":
    main()
