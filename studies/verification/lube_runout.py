"""Run-out of granular columns over their aspect ratio: the scaling of Lube et al. (2005).

A column of sand, a times as high as it is wide, is released on one side on rough ground. Lube et al. found for channels,
whatever the sand, a run-out past its foot of 1.2 a widths where a < 1.8 and of 1.9 a^(2/3) widths where a > 2.8.

Sand whose angle of repose is 31° slides on its layers with the friction tan 31°. In plane strain and without dilation a layer
of Mohr-Coulomb soil that shears carries the fraction sin φ of the pressure on it (Davis 1968), so that φ is arcsin(tan 31°) =
36.9°. With φ = 31° it would slide as sand of 27° and run out a fifth to a third farther.

There is no damping except the PIC fraction, 0.4 % in a critical time step, which is the one number that is calibrated. What
counts is the fraction per second: the run-out is the same for Courant numbers from 0.1 to 0.5, and for four times the modulus,
whose critical step is half as long, with half the fraction. (With the same fraction the column of a = 1.5 then runs 1.75
instead of 1.92 widths.) With 0.2 and 0.8 % the column of a = 1 runs 1.42 and 1.08 widths instead of 1.17, and that of a = 1.5
runs 2.00 and 1.75 widths. These are places of the foot, which single particles decide; the distance that 99 % of them have not
passed is 1.06 and 0.91 instead of 0.97 widths for a = 1, and is what runs with other steps are compared by. Without a PIC
fraction particles that have separated do not come to rest. With smaller cells, in which the fraction has less influence,
columns run somewhat farther (see the picture). The tolerance is a tenth plus the size
of a cell, to which the position of the foot is known, and a fifth at most. A tenth is the scatter of experiments: Balmforth
and Kerswell (2005, J. Fluid Mech. 538, 399-428) give run-outs that grow as a^(0.65 ± 0.05) in narrow channels and as a^(0.9 ±
0.1) in wide ones, with a factor that depends on the material; the uncertainty of the first exponent alone is 9 % of the
run-out at a = 6. Half or twice the PIC fraction has about the same influence. Kumar (2015, Multi-scale multiphase modelling of
granular flows, Cambridge, ch. 4) found particles of Mohr-Coulomb soil to run out farther than discrete elements above a = 1.7:
where a column first falls freely, friction alone dissipates less energy than colliding grains do.
"""

import numpy as np
from _case import Check, Result
from _plots import save_comparison
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

WIDTH, REPOSE = 0.1, 31.0  # m, degrees: sand
FRICTION = np.degrees(np.arcsin(np.tan(np.radians(REPOSE))))
YOUNG = 0.5e6  # Pa
SAND = mpm.MohrCoulomb(young=YOUNG, poisson=0.3, cohesion=0.0, friction_angle=FRICTION)
STIFF_SAND = mpm.MohrCoulomb(young=4 * YOUNG, poisson=0.3, cohesion=0.0, friction_angle=FRICTION)
PIC_FRACTION, LARGER_FRACTION = 0.004, 0.02  # of a critical time step
SIDE, GROUND, GRAVITY = 1, 3, 9.81
RATIOS = (0.5, 1.0, 1.5, 3.0, 4.5, 6.0)


def scaling(ratio):
    """Run-out over the width."""
    return 1.2 * ratio if ratio < 1.8 else 1.9 * ratio ** (2 / 3)


def tolerance(run_out, cells):
    """A tenth, and the size of a cell, over the run-out; cells: over the same length as the run-out."""
    return min(0.2, 0.1 + 1 / (cells * run_out))


def layer_friction():
    """Shear stress over pressure of a layer that shears under constant pressure."""
    layer = mpm.ElementTest(SAND, stress=[-500.0, -1000.0, -500.0, 0.0])
    for _ in range(200):
        layer.step([0.0, None, 0.0, 1e-3])
    return -layer.stress[3] / layer.stress[1]


def column(ratio, cells, reach, sand, **options):
    """A column as wide as WIDTH and `ratio` times as high, on rough ground as long as `reach` [m]; cells: over the width."""
    cell = WIDTH / cells
    counts = [round(reach / cell), round(1.05 * ratio * WIDTH / cell) + 1]
    body = ((-1.0, -1.0), (WIDTH, ratio * WIDTH))
    parts = bridge.box_mesh(MPI.COMM_WORLD, [cell * n for n in counts], counts, body=body)
    model = mpm.Model(bridge.background_mesh(*parts), sand, **options)
    model.seed(density=2000.0, per_cell=6, cell_tag=bridge.BODY)
    model.roller(SIDE, (1, 0))
    model.fix(GROUND)
    model.set_gravity((0.0, -GRAVITY))
    return model


def run_out(ratio, cells, pic, courant=0.5, sand=SAND):
    """Run-out of the foot, and of 99 % of the particles, over the width; cells: over the width."""
    comm, cell = MPI.COMM_WORLD, WIDTH / cells
    # --- 1. The column on rough ground, against a smooth wall --------------------------------------------------------
    model = column(ratio, cells, WIDTH * (2.0 + 1.6 * scaling(ratio)), sand)

    # --- 2. Let go, until well after it has come to rest ------------------------------------------------------------
    fall = np.sqrt(2 * ratio * WIDTH / GRAVITY)
    list(model.explicit(5 * fall + 2 * np.sqrt(WIDTH / GRAVITY), pic=pic, courant=courant))

    # --- 3. The foot: the end of the strips of a cell's width that hold two particles or more -----------------------
    x = np.concatenate(comm.allgather(model.particles.position[:, 0]))
    strips = np.bincount(np.floor(x / cell).astype(int))
    return cell * (np.argmax(np.append(strips, 0) < 2)) / WIDTH - 1, np.quantile(x, 0.99) / WIDTH - 1


def run(quick: bool, folder) -> Result:
    # --- 4. The friction of the sand, and its columns ---------------------------------------------------------------
    checks = [Check("friction of a layer that shears", np.tan(np.radians(REPOSE)), f"angle of repose of {REPOSE:g}°",
                    layer_friction(), 1e-3)]  # fmt: skip
    series = [(f"PIC {PIC_FRACTION:.1%}", (1.0,) if quick else RATIOS, 1, PIC_FRACTION)]
    if not quick:
        series += [
            ("cells half as large", RATIOS[:3], 2, PIC_FRACTION),
            (f"PIC {LARGER_FRACTION:.1%}", RATIOS, 1, LARGER_FRACTION),
        ]
    source, found = "experiments, Lube et al. 2005", {}
    for name, ratios, finer, pic in series:
        cells = [finer * (12 if ratio < 1.8 else 8) for ratio in ratios]
        found[name] = [run_out(ratio, n, pic)[0] for ratio, n in zip(ratios, cells)], ratios
        if pic == PIC_FRACTION:
            checks += [Check(f"run-out over the width, a = {ratio:g}, {name}", scaling(ratio), source, got,
                             tolerance(scaling(ratio), n)) for got, ratio, n in zip(*found[name], cells)]  # fmt: skip

    # --- 5. The same with a fifth of the time step, and with stiffer sand and the same rate of PIC ------------------
    usual, small = (run_out(1.0, 12, PIC_FRACTION, courant)[1] for courant in (0.5, 0.1))
    name = "run-out of 99 % of the particles over the width, a = 1"
    checks.append(Check(f"{name}, Courant number 0.1", usual, "the same column with Courant number 0.5", small, 0.05))
    _, stiff = run_out(1.0, 12, PIC_FRACTION / 2, sand=STIFF_SAND)
    checks.append(Check(f"{name}, four times the modulus, half the PIC fraction", usual,
                        "the usual sand with the same PIC fraction per second", stiff, 0.05))  # fmt: skip

    # --- 6. Picture -------------------------------------------------------------------------------------------------
    if MPI.COMM_WORLD.rank == 0:
        low, high = np.linspace(0.4, 1.8, 40), np.linspace(2.8, 6.5, 40)
        lines = {"$1.2 a$": (low, 1.2 * low), "$1.9 a^{2/3}$": (high, 1.9 * high ** (2 / 3))}
        save_comparison(folder / "run_out.png", {name: (ratios, got) for name, (got, ratios) in found.items()},
                        lines, ("Aspect ratio $a$ [-]", "Run-out over the width [-]"))  # fmt: skip
    return Result(checks, {"run_out.png": "Run-out of columns over their aspect ratio, and the scaling of experiments"})
