"""Vibrating bar: period and energy of the lowest mode, in plane strain and in 3D.

The bar is fixed at one end, free at the other, and has rollers at its sides, so that it moves along its axis only. It starts
with the velocity of its lowest mode, without damping or load.
"""

import numpy as np
from _case import Check, Result
from _plots import save_comparison
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

LENGTH, DENSITY, YOUNG, POISSON = 4.0, 1000.0, 1e6, 0.3  # m, kg/m3, Pa, -
SPEED = np.sqrt(YOUNG * (1 - POISSON) / ((1 + POISSON) * (1 - 2 * POISSON)) / DENSITY)
PERIOD = 4 * LENGTH / SPEED
AMPLITUDE = 1e-3  # m/s


def run(quick: bool, folder) -> Result:
    squares, periods, checks, curves = 16 if quick else 32, 2 if quick else 8, [], {}
    for dim in (2, 3):
        # --- 1. A bar of particles between rollers, in its lowest mode -----------------------------------------------
        lengths = [LENGTH] + [2 * LENGTH / squares] * (dim - 1)
        domain, cell_tags, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, lengths, [squares] + [2] * (dim - 1))
        model = mpm.Model(
            bridge.background_mesh(domain, cell_tags, facet_tags), mpm.LinearElastic(young=YOUNG, poisson=POISSON)
        )
        model.seed(density=DENSITY, per_cell={2: 3, 3: 4}[dim])
        model.fix(1)
        for axis in range(1, dim):
            for end in (1, 2):
                model.roller(2 * axis + end, np.eye(dim)[axis])
        velocity = np.zeros_like(model.particles.position)
        velocity[:, 0] = AMPLITUDE * np.sin(np.pi * model.particles.position[:, 0] / (2 * LENGTH))
        model.particles.set("velocity", velocity)

        # --- 2. Some periods of free vibration ----------------------------------------------------------------------
        start = model.report()
        reports = [start, *model.explicit(periods * PERIOD, every=PERIOD / 100)]
        time, momentum, energy = np.array([(r.time, r.momentum[0], r.kinetic_energy) for r in reports]).T

        # --- 3. The period, from the times at which the momentum is zero --------------------------------------------
        change = np.flatnonzero(momentum[1:] * momentum[:-1] < 0)
        zeros = time[change] - momentum[change] * np.diff(time)[change] / np.diff(momentum)[change]
        found = 2 * (zeros[-1] - zeros[0]) / (len(zeros) - 1)
        checks.append(Check(f"period, {dim}D", PERIOD, "4 L / c, c² = (K + 4G/3) / ρ", found, 0.01, "s"))

        # --- 4. The energy of the last period: all of it kinetic twice in it ----------------------------------------
        last = energy[time > (periods - 1) * PERIOD].max()
        checks.append(Check(f"kinetic energy in period {periods}, {dim}D", 1.0, "conservation of energy",
                            last / start.kinetic_energy, 0.02, "of the start"))  # fmt: skip
        curves[f"{dim}D"] = momentum / momentum[0]

    # --- 5. Picture -------------------------------------------------------------------------------------------------
    if MPI.COMM_WORLD.rank == 0:
        phases = {"2D": slice(0, None, 12), "3D": slice(6, None, 12)}  # marks side by side, for the curves are the same
        computed = {name: (time[phases[name]], curve[phases[name]]) for name, curve in curves.items()}
        exact = {"exact": (time, np.cos(2 * np.pi * time / PERIOD))}
        save_comparison(folder / "momentum.png", computed, exact, ("Time [s]", "Momentum over that at the start [-]"),
                        limits=((None, None), (-1.1, 1.7)))  # fmt: skip
    return Result(checks, {"momentum.png": "Momentum of the vibrating bar"})
