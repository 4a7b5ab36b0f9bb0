"""Column under its own weight, small strains, in plane strain and in 3D.

The column has rollers at its sides and a fixed base. Its particles vibrate under gravity with local damping until they are at
rest. Expected values are stresses and settlement of the elastic column (oedometer). Each linear cell has one stress, so
stresses are compared as means over rows of cells.
"""

import numpy as np
from _case import Check, Result
from _plots import save_comparison
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

HEIGHT, YOUNG, POISSON = 1.0, 1e6, 0.3  # m, Pa, -
WEIGHT, GRAVITY = 200.0, 0.1  # N/m3, m/s2: settles by 0.07 mm, so that cells are not crossed
OEDOMETER = YOUNG * (1 - POISSON) / ((1 + POISSON) * (1 - 2 * POISSON))


def run(quick: bool, folder) -> Result:
    rows, checks, curves = 12 if quick else 16, [], {}
    for dim, nmd in ((2, False), (2, True), (3, False)):
        name = f"{dim}D" + (", NMD" if nmd else "")

        # --- 1. A column of particles between rollers ---------------------------------------------------------------
        across = [2] * (dim - 1)
        lengths = [2 * HEIGHT / rows] * (dim - 1) + [HEIGHT]
        domain, cell_tags, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, lengths, [*across, rows])
        model = mpm.Model(
            bridge.background_mesh(domain, cell_tags, facet_tags), mpm.LinearElastic(young=YOUNG, poisson=POISSON)
        )
        model.seed(density=WEIGHT / GRAVITY, per_cell={2: 3, 3: 4}[dim])
        for axis in range(dim - 1):
            for end in (1, 2):
                model.roller(2 * axis + end, np.eye(dim)[axis])
        model.fix(2 * dim - 1)
        model.set_gravity([0.0] * (dim - 1) + [-GRAVITY])

        # --- 2. Its weight at once, and damping until it is at rest -------------------------------------------------
        period = 4 * HEIGHT / np.sqrt(OEDOMETER * GRAVITY / WEIGHT)
        *_, report = model.explicit(8 * period, damping=0.7, nmd=nmd)

        # --- 3. Settlement: u(y) = -w (H y - y^2 / 2) / E_oed -------------------------------------------------------
        parts = MPI.COMM_WORLD.allgather((model.particles.initial_position[:, -1], model.particles.displacement[:, -1],
                                          model.particles.stress))  # fmt: skip
        y, u, stress = (np.concatenate([part[k] for part in parts]) for k in range(3))
        expected = -WEIGHT * (HEIGHT * y - y**2 / 2) / OEDOMETER
        top = WEIGHT * HEIGHT**2 / (2 * OEDOMETER)
        worst = np.argmax(np.abs(u - expected))
        checks.append(Check(f"settlement, worst particle, {name}", 1e6 * expected[worst],
                            "oedometer, u = -w (H y - y²/2) / E_oed", 1e6 * u[worst], 0.01, "µm", scale=1e6 * top,
                            over="the settlement of the top"))  # fmt: skip

        # --- 4. Stresses of each row: vertical w (H - y), horizontal nu / (1 - nu) of it ----------------------------
        row = np.floor(y / HEIGHT * rows).astype(int)
        mean = np.array([stress[row == k].mean(axis=0) for k in range(rows)])
        middle = (np.arange(rows) + 0.5) * HEIGHT / rows
        vertical = -WEIGHT * (HEIGHT - middle)
        inner = slice(1, -1)  # of NMD, the lowest and highest rows average over one side only
        for label, column, ratio in (("vertical", dim - 1, 1.0), ("horizontal", 0, POISSON / (1 - POISSON))):
            k = 1 + np.argmax(np.abs(mean[inner, column] - ratio * vertical[inner]))
            source = "equilibrium, w (H - y)" + ("" if ratio == 1 else " ν / (1 - ν)")
            checks.append(Check(f"{label} stress, worst row, {name}", ratio * vertical[k], source, mean[k, column], 0.01,
                                "Pa", scale=WEIGHT * HEIGHT, over="w H"))  # fmt: skip
        curves[name] = (mean[:, dim - 1] / (WEIGHT * HEIGHT), middle / HEIGHT)

    # --- 5. Picture -------------------------------------------------------------------------------------------------
    if MPI.COMM_WORLD.rank == 0:
        exact = {"$w (H - y)$": (np.array([-1.0, 0.0]), np.array([0.0, 1.0]))}
        save_comparison(folder / "stress.png", curves, exact, ("Vertical stress over $w H$ [-]", "Height over $H$ [-]"))
    return Result(checks, {"stress.png": "Vertical stress of each row of cells of the column under its weight"})
