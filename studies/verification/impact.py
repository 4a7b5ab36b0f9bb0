"""A bar that hits a wall, or is pulled from it: a finite-strain law in a large dynamic motion.

The whole bar moves with the same velocity, about a fifth of its wave speed, when its end is stopped. Between rollers it moves
along its axis only, and its stretch λ determines the stress: Hencky's law has the Cauchy stress M ln λ / λ, M = K + 4G/3.
Compression stiffens it, so that hitting the wall sends a shock into the bar, with the speed U in the undeformed bar that
follows from the balance of momentum across it, ρ U² = [σ] / [λ], and the velocity U (1 - λ). Tension softens it: the wave
spreads into a fan, and dv = c(λ) dλ with c² = (dσ/dλ) / ρ gives the velocity 2/3 c₀ (1 - (1 - ln λ)^(3/2)). Behind the wave
the bar is at rest, with a uniform stretch and stress. A law that is linear in the Cauchy stress would give a stress after the
impact that is a tenth lower.

Particles oscillate behind the shock; a PIC fraction of 20 % damps this motion, so that mean values are not affected. Particles
cross from cell to cell.
"""

import numpy as np
from _case import Check, Result
from _plots import save_comparison
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

LENGTH, DENSITY, YOUNG, POISSON = 1.0, 2000.0, 1e6, 0.3  # m, kg/m3, Pa, -
MODULUS = YOUNG * (1 - POISSON) / ((1 + POISSON) * (1 - 2 * POISSON))
SPEED = np.sqrt(MODULUS / DENSITY)
STRETCHES = {"impact": 0.8, "tension": 1.2}


def wave(stretch: float) -> tuple[float, float]:
    """Velocity of the bar that leads to a stretch at the wall, away from it, and speed of the end of the wave [m/s]."""
    strain = np.log(stretch)
    if stretch < 1:
        front = SPEED * np.sqrt(-strain / stretch / (1 - stretch))
        return front * (stretch - 1), front
    return SPEED * 2 / 3 * (1 - (1 - strain) ** 1.5), SPEED * np.sqrt(1 - strain) / stretch


def run(quick: bool, folder) -> Result:
    squares, comm = 64 if quick else 256, MPI.COMM_WORLD
    cell, checks, computed, exact = LENGTH / squares, [], {}, {}
    for name, stretch in STRETCHES.items():
        # --- 1. A bar between rollers, of which the first end is stopped -------------------------------------------------
        counts = [3 * squares // 2, 2]
        body = ((-1, -1), (LENGTH, LENGTH))
        parts = bridge.box_mesh(comm, [cell * n for n in counts], counts, body=body)
        law = mpm.Hencky(mpm.LinearElastic(young=YOUNG, poisson=POISSON))
        model = mpm.Model(bridge.background_mesh(*parts), law)
        model.seed(density=DENSITY, per_cell=6, cell_tag=bridge.BODY)
        model.roller(1, (1, 0))
        for side in (3, 4):
            model.roller(side, (0, 1))
        velocity, front = wave(stretch)
        model.particles.set("velocity", np.tile([velocity, 0.0], (len(model.particles), 1)))

        # --- 2. Until the wave has passed some sixty per cent of it --------------------------------------------------
        time = 0.6 * LENGTH / max(front, SPEED)
        report = model.explicit(time, integration=mpm.Integration.MIXED, pic=0.2).last()

        # --- 3. The bar behind the wave ------------------------------------------------------------------------------
        p = model.particles
        density = p.mass / p.volume
        own = np.column_stack(
            [p.position[:, 0] - p.displacement[:, 0], p.position[:, 0], p.stress[:, 0], density, p.mass]
        )
        place, position, stress, density, mass = np.concatenate(comm.allgather(own)).T
        behind = place < 0.7 * front * time
        source = "balance of momentum across the shock" if stretch < 1 else "simple wave of tension"
        checks.append(Check(f"stress at the wall, {name}", MODULUS * np.log(stretch) / stretch, source,
                            np.average(stress[behind], weights=mass[behind]), 0.02 if quick else 0.01, "Pa"))  # fmt: skip
        slope = np.polyfit(place[behind], position[behind], 1)[0]
        checks.append(Check(f"stretch at the wall, {name}", stretch, source, slope, 0.005))
        volume = DENSITY * np.sum(mass[behind] / density[behind]) / mass[behind].sum()
        checks.append(Check(f"volume at the wall, {name}", stretch, "mass over density", volume, 0.01, "of the start"))
        checks.append(Check(f"unexplained energy, {name}", 0.0, "energy balance: works, stored energy and losses add up",
                            abs(report.unexplained_fraction), 0.01, scale=1.0, over="the energy at work"))  # fmt: skip

        # --- 4. Means of the particles of each cell, and what the wave leaves behind ---------------------------------
        number = np.floor(place / cell).astype(int)
        sums = np.bincount(number, mass * stress) / np.bincount(number, mass)
        computed[name] = ((np.arange(len(sums)) + 0.5) * cell)[::2], 1e-3 * sums[::2]
        plateau = 1e-3 * MODULUS * np.log(stretch) / stretch
        exact[f"exact, {name}"] = np.array([0.0, front * time]), np.array([plateau, plateau])

    # --- 5. Picture -------------------------------------------------------------------------------------------------
    if comm.rank == 0:
        save_comparison(folder / "stress.png", computed, exact, ("Position in the undeformed bar [m]", "Stress [kPa]"))
    return Result(
        checks, {"stress.png": "Stress along the bar: particles, and the exact solution behind the wave as lines"}
    )
