"""Whole explicit steps: particle-steps per second on one core, beside what memory and arithmetic allow.

Times are the processor's (not the clock on the wall), the best of several repetitions; ratios are worth more than numbers.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

import mpm_core as mpm

MOVED_BYTES = {2: 8 * (2 * (2 + 2 + 4 + 1 + 1 + 1) + 1), 3: 8 * (2 * (3 + 3 + 6 + 1 + 1 + 1) + 1)}
"""Bytes that a particle-step must move: position, velocity, stress, volume, accumulated deviatoric and plastic strain are read
and written, mass is read."""

OPERATIONS = {2: 38 + 23 + 44 + 6, 3: 73 + 77 + 75 + 12}
"""Additions and multiplications of a particle-step that stays elastic, counted from the kernels: motion with the check of the
cell, rotation of the stress and growth, Mohr-Coulomb's trial and check, and the sum of stresses. What cells and nodes need is
shared by their particles and left out."""


SINCE = {2: 0.2, 3: 0.4}
"""Time at which the measurement begins [s]: waves have been through all of the soil, and it slides."""


def bounds(kernels: Path) -> tuple[float, float]:
    """Bytes per second of the STREAM triad, and additions and multiplications per second, of one core, as the benchmark of the
    kernels measures them."""
    command = [str(kernels), "--benchmark_filter=stream_triad|peak_arithmetic", "--benchmark_format=json"]
    run = subprocess.run([*command, "--benchmark_min_time=1"], capture_output=True, text=True, check=True)
    triad, peak = json.loads(run.stdout)["benchmarks"]
    return triad["bytes_per_second"], peak["items_per_second"]


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


def rate(model: mpm.Model, since: float, particle_steps: float, repetitions: int, **options):
    """Particle-steps per second of processor time, the best of the repetitions, the last report, and the shares of the phases in
    the time. What happens before `since` [s] is not measured: soil at rest that nothing has reached yet is cheaper."""
    list(model.explicit(since, damping=0.75, **options))
    dt = 0.5 * model.critical_time_step()
    steps = max(64, round(particle_steps / len(model.particles)))
    best = 0.0
    before = model._core.phase_seconds()
    for _ in range(repetitions):
        steps_before, start = model.report().particle_steps, time.process_time()
        (report,) = model.explicit(model.time + dt * steps, damping=0.75, **options)
        best = max(best, (report.particle_steps - steps_before) / (time.process_time() - start))
    phases = {name: seconds - before[name] for name, seconds in model._core.phase_seconds().items()}
    return best, report, {name: seconds / sum(phases.values()) for name, seconds in phases.items()}


def on_ranks(rounds: int = 3, cell_size: float = 0.01, steps: int = 20) -> dict[str, float]:
    """How much faster two ranks are than one, each the best of several rounds in turns."""
    allowed = {**os.environ, "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    seconds = {1: np.inf, 2: np.inf}
    particles = 0
    for _ in range(rounds):
        for ranks in seconds:
            command = [
                "mpirun",
                "--oversubscribe",
                "-n",
                str(ranks),
                sys.executable,
                str(Path(__file__).with_name("ranks.py")),
            ]
            run = subprocess.run(
                [*command, str(cell_size), str(steps)], env=allowed, capture_output=True, text=True, check=True
            )
            took, particles = run.stdout.split()[-2:]
            seconds[ranks] = min(seconds[ranks], float(took))
    return {"particles": int(particles), "one": seconds[1], "two": seconds[2], "ratio": seconds[1] / seconds[2]}


def start_up() -> dict[str, float]:
    """Seconds of processor time: to import the package in a new interpreter, and to set up 640,000 particles."""
    code = "import time; t = time.process_time(); import mpm_core; print(time.process_time() - t)"
    importing = min(
        float(subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout)
        for _ in range(3)
    )
    start = time.process_time()
    slope(0.01, mpm.LinearElastic(young=200e3, poisson=0.33)).critical_time_step()
    return {"import": importing, "set_up": time.process_time() - start}


def machine() -> dict:
    """What the figures belong to."""
    cpu = next((line.split(":")[1].strip() for line in open("/proc/cpuinfo") if "model name" in line), "unknown")
    return {
        "processor": cpu,
        "architecture": platform.machine(),
        "cores": os.cpu_count(),
        "system": platform.platform(),
        "compiler": mpm.compiler,
        "talus": mpm.__version__,
    }


def other_laws(soil: mpm.MohrCoulomb) -> dict[str, object]:
    """Laws of like stiffness and strength as the soil."""
    elastic = {"young": soil.young, "poisson": soil.poisson}
    clay = mpm.CamClay(compression=0.2, swelling=0.04, critical_slope=1.0, poisson=0.33, void_ratio=1.0,
                       preconsolidation=5e3, attraction=2e3)  # fmt: skip
    tresca = mpm.tresca(**elastic, shear_strength=5e3)
    return {
        "Tresca": tresca, "von Mises": mpm.von_mises(**elastic, yield_stress=9e3),
        "Drucker-Prager": mpm.matched_drucker_prager(**elastic, cohesion=1e3, friction_angle=25.0),
        "softening": mpm.SofteningMohrCoulomb(soil, residual_cohesion=500.0, residual_friction_angle=20.0,
                                              softening_strain=0.1, reference_length=0.05),
        "softening Tresca": mpm.SofteningMohrCoulomb(tresca, residual_cohesion=2.5e3, residual_friction_angle=0.0,
                                                     softening_strain=0.1, reference_length=0.05),
        "Cam-Clay": clay, "Hencky of Mohr-Coulomb": mpm.Hencky(soil),
        "undrained Mohr-Coulomb": mpm.Undrained(soil, water_modulus=1e6, porosity=0.4),
    }  # fmt: skip


def table_row(name: str, row: dict) -> str:
    phases = " ".join(f"{share:5.0%}" for share in row["phases"].values())
    return (
        f"{name:32} {row['particles']:9d} {row['particle_steps_per_second'] / 1e6:9.1f} {row['share_of_bandwidth']:9.0%} "
        f"{row['share_of_arithmetic']:10.0%} {row['plastic_fraction']:8.0%} {row['bytes_held']:6.0f}  {phases}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kernels", type=Path, help="the benchmark of the kernels, mpm_bench")
    parser.add_argument("--json", type=Path, help="file for the results")
    parser.add_argument("--small", action="store_true", help="only the small cases, on one rank")
    a = parser.parse_args()
    elastic = mpm.LinearElastic(young=200e3, poisson=0.33)
    soil = mpm.MohrCoulomb(young=200e3, poisson=0.33, cohesion=1e3, friction_angle=25.0)
    mud = mpm.MohrCoulomb(young=200e3, poisson=0.33, cohesion=10.0, friction_angle=0.0)
    cases = [("slope 2D, Mohr-Coulomb", lambda s=s: slope(s, soil), {}) for s in (0.1, 0.05, 0.025, 0.01, 0.005)]
    cases[2:2] = [
        ("slope 2D, linear elastic", lambda: slope(0.05, elastic), {}),
        ("slope 2D, nearly all yields", lambda: slope(0.05, mud), {}),
        ("slope 2D, Mohr-Coulomb, NMD", lambda: slope(0.05, soil), {"nmd": True}),
        ("slope 2D, Mohr-Coulomb, PIC 1 %", lambda: slope(0.05, soil), {"pic": 0.01}),
        ("block 3D, linear elastic", lambda: block(16, elastic), {}),
        ("block 3D, Mohr-Coulomb", lambda: block(16, soil), {}),
    ]
    cases += [(f"slope 2D, {name}", lambda law=law: slope(0.05, law), {}) for name, law in other_laws(soil).items()]
    if a.small:
        cases = [case for case in cases if case[1]().mesh.cells.shape[0] < 20000]
    bandwidth, peak = bounds(a.kernels)
    print(f"one core: streaming bandwidth (triad) {bandwidth / 1e9:.1f} GB/s, arithmetic {peak / 1e9:.1f} Gflop/s")
    for dim in (2, 3):
        print(f"a particle-step in {dim}D must move {MOVED_BYTES[dim]} bytes and needs {OPERATIONS[dim]} operations")
    print(
        f"\n{'case':32} {'particles':>9} {'million/s':>9} {'of memory':>9} {'of flop/s':>10} {'plastic':>8} {'bytes':>6}  phases"
    )
    rows = []
    for name, make, options in cases:
        model = make()
        dim = model.mesh.dim
        speed, report, phases = rate(model, SINCE[dim], 8e6, 3, **options)
        row = {
            "case": name,
            "particles": report.particles,
            "particle_steps_per_second": speed,
            "share_of_bandwidth": speed * MOVED_BYTES[dim] / bandwidth,
            "share_of_arithmetic": speed * OPERATIONS[dim] / peak,
            "plastic_fraction": report.plastic_fraction,
            "bytes_held": model._core.bytes_per_particle(),
            "phases": phases,
        }
        rows.append(row)
        print(table_row(name, row), flush=True)
    print(f"phases: {', '.join(rows[0]['phases'])}")
    start = start_up()
    print(f"import {start['import']:.2f} s; mesh and particles, 640,000: {start['set_up']:.2f} s")
    ranks = None if a.small else on_ranks()
    if ranks:
        print(f"slope 2D, {ranks['particles']} particles: two ranks are {ranks['ratio']:.2f} times as fast as one")
    if a.json:
        results = {"machine": machine(), "bandwidth": bandwidth, "operations": peak, "cases": rows, "start_up": start,
                   "ranks": ranks}  # fmt: skip
        a.json.write_text(json.dumps(results, indent=2) + "\n")


if __name__ == "__main__":
    main()
