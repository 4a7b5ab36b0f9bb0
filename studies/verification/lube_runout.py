"""Run-out of granular columns over their aspect ratio: the scaling of Lube et al. (2005).

A column of sand, a times as high as it is wide, is let go on one side on rough ground. Lube et al. found for
channels, whatever the sand, a run-out past its foot of 1.2 a widths where a < 1.8 and of 1.9 a^(2/3) widths where a
> 2.8. Cohesionless Mohr-Coulomb soil, no damping but a PIC share of 0.3 %.
"""

import numpy as np
from _case import Check, Result, run_alone
from _plots import save_comparison
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

WIDTH, FRICTION = 0.1, 31.0  # m, degrees: sand at repose
DISSIPATION = (
    "a continuum of constant friction loses less energy than grains that collide where a column first falls freely, and runs out"
    " farther; Kumar (2014, Cambridge) found the same with this method, and not with discrete elements."
)
SIDE, GROUND, GRAVITY = 1, 3, 9.81
RATIOS = (0.5, 1.0, 1.5, 3.0, 4.5, 6.0)


def scaling(ratio):
    """Run-out over the width."""
    return 1.2 * ratio if ratio < 1.8 else 1.9 * ratio ** (2 / 3)


def run_out(ratio, cells):
    comm, cell = MPI.COMM_WORLD, WIDTH / cells
    # --- 1. The column on rough ground, against a smooth wall --------------------------------------------------------
    reach = WIDTH * (2.0 + 1.6 * scaling(ratio))
    counts = [round(reach / cell), round(1.05 * ratio * WIDTH / cell) + 1]
    body = ((-1, -1), (WIDTH, ratio * WIDTH))
    mesh = bridge.background_mesh(*bridge.box_mesh(comm, [cell * n for n in counts], counts, body=body))
    model = mpm.Model(mesh, mpm.MohrCoulomb(young=0.5e6, poisson=0.3, cohesion=0.0, friction_angle=FRICTION))
    model.seed(density=2000.0, per_cell=6, cell_tag=bridge.BODY)
    model.roller(SIDE, (1, 0))
    model.fix(GROUND)

    # --- 2. Let go, until well after it has come to rest ------------------------------------------------------------
    model.set_gravity((0.0, -GRAVITY))
    fall = np.sqrt(2 * ratio * WIDTH / GRAVITY)
    list(model.explicit(5 * fall + 2 * np.sqrt(WIDTH / GRAVITY), pic=0.003))

    # --- 3. The foot: the end of the strips of a cell's width that hold two particles or more -----------------------
    x = np.concatenate(comm.allgather(model.particles.position[:, 0]))
    strips = np.bincount(np.floor(x / cell).astype(int))
    return cell * (np.argmax(np.append(strips, 0) < 2)) / WIDTH - 1


def run(quick: bool, folder) -> Result:
    ratios, checks, found = (0.5,) if quick else RATIOS, [], []
    for ratio in ratios:
        found.append(run_out(ratio, 12 if ratio < 1.8 else 8))
        checks.append(Check(f"run-out over the width, a = {ratio:g}", scaling(ratio), "experiments, Lube et al. 2005",
                            found[-1], 0.2, limit=DISSIPATION if ratio > 1 else ""))  # fmt: skip
    if MPI.COMM_WORLD.rank == 0:
        low, high = np.linspace(0.4, 1.8, 40), np.linspace(2.8, 6.5, 40)
        lines = {"$1.2 a$": (low, 1.2 * low), "$1.9 a^{2/3}$": (high, 1.9 * high ** (2 / 3))}
        save_comparison(folder / "run_out.png", {"particles": (np.array(ratios), np.array(found))}, lines,
                        ("Aspect ratio $a$ [-]", "Run-out over the width [-]"))  # fmt: skip
    return Result(checks, {"run_out.png": "Run-out of columns over their aspect ratio, and the scaling of experiments"})


if __name__ == "__main__":
    run_alone(run)
