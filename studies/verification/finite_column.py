"""Column under its own weight, finite strains: a column 50 m high that settles by one metre.

The Cauchy stress follows a rate law with ν = 0, so that σ = E ln(stretch), and equilibrium requires σ = -w (H - X) at the
point that was at the height X before the deformation. Hence u(X) = ∫ exp(-w (H - s) / E) ds - X, which is -0.986801 m at the
top. The weight rises in ten implicit steps without inertia.

Smaller cells do not make the particles more accurate: they are crossed more often, and each crossing moves the fraction 1 /
(particles in a cell) of the cell's force to its neighbour, which strains both cells. The error therefore grows with the number
of cells crossed and with the number of steps, and decreases with the number of particles per cell. Mixed integration removes
it: a full cell integrates its mean stress over its own volume, whichever particles are in it. With a mesh that moves with the
particles there are no crossings, and only the error of the step length remains.
"""

import numpy as np
from _case import Check, Result
from _moving_mesh import in_order, on_moved_mesh
from _plots import save_refinement
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

HEIGHT, WEIGHT, YOUNG, GRAVITY = 50.0, 800.0, 1e6, 10.0  # m, N/m3, Pa, m/s2
STEPS = 10
CROSSING = (
    "Particles that cross from cell to cell shift forces between the cells. More particles per cell reduce this error, more"
    " cells do not; mixed integration removes it."
)
PLAIN, MIXED = mpm.Integration.PARTICLES, mpm.Integration.MIXED


def exact(x: np.ndarray) -> np.ndarray:
    """Displacement of the place that was x above the base [m]."""
    base = np.exp(-WEIGHT * HEIGHT / YOUNG)
    return YOUNG / WEIGHT * (np.exp(-WEIGHT * (HEIGHT - x) / YOUNG) - base) - x


def settled(
    cells: int, per_cell: int, steps: int, integration: mpm.Integration, moving_mesh: bool
) -> tuple[float, float]:
    """Displacement of the highest particle, and what it should be [m]; on each rank alike, which computes all of it."""
    # --- 1. A column one cell wide between rollers -------------------------------------------------------------------
    width = HEIGHT / cells
    mesh = bridge.background_mesh(*bridge.box_mesh(MPI.COMM_SELF, [width, HEIGHT], [1, cells], diagonals="one-way"))
    sides = [
        np.abs(mesh.points[:, 0]) < 1e-9,
        np.abs(mesh.points[:, 0] - width) < 1e-9,
        np.abs(mesh.points[:, 1]) < 1e-9,
    ]

    def build(nodes: np.ndarray) -> mpm.Model:
        facets = [(tag, np.sort(edge)) for tag, side in enumerate(sides, 1)
                  for edge in mesh.cells[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2) if side[edge].all()]  # fmt: skip
        tagged = mpm.Mesh(nodes, mesh.cells, facets=np.array([edge for _, edge in facets], np.int32),
                          facet_tags=np.array([tag for tag, _ in facets], np.int32))  # fmt: skip
        model = mpm.Model(tagged, mpm.LinearElastic(young=YOUNG, poisson=0.0))
        for tag in (1, 2):
            model.roller(tag, (1, 0))
        model.fix(3)
        return model

    nodes = mesh.points
    model = build(nodes)
    model.seed(density=WEIGHT / GRAVITY, per_cell=per_cell)
    start = in_order(model, "position")

    # --- 2. Its weight step by step; the mesh moves with it, or does not ---------------------------------------------
    for k in range(1, steps + 1):
        model.set_gravity((0.0, -GRAVITY * k / steps))
        for _ in model.implicit(model.time + 1.0, dt=1.0, quasi_static=True, integration=integration):
            pass
        if moving_mesh:
            nodes = nodes + model.nodal("velocity")  # times one second
            model = on_moved_mesh(model, nodes, build)

    # --- 3. The highest particle -------------------------------------------------------------------------------------
    top = np.argmax(start[:, 1])
    return float((in_order(model, "position") - start)[top, 1]), float(exact(start[top, 1]))


def run(quick: bool, folder) -> Result:
    # --- 4. Finer meshes: without crossings, with them mixed, and with them by the standard method -------------------
    meshes = (5, 10) if quick else (10, 20, 40)
    checks, errors = [], {}
    for name, per_cell, steps, integration, moving in (
        ("mesh moves with them", 3, STEPS, PLAIN, True),
        ("mixed, 24 particles a cell", 24, STEPS, MIXED, False),
        ("mixed, 24 particles a cell, 40 steps", 24, 40, MIXED, False),
        ("66 particles a cell", 66, STEPS, PLAIN, False),
        ("24 particles a cell", 24, STEPS, PLAIN, False),
        ("24 particles a cell, 40 steps", 24, 40, PLAIN, False),
    ):
        limit = CROSSING if per_cell == 24 and integration is PLAIN else ""
        errors[name] = []
        for cells in meshes:
            found, expected = settled(cells, per_cell, steps, integration, moving)
            errors[name].append(abs(found / expected - 1))
            checks.append(Check(f"settlement of the top, {cells} cells, {name}", expected,
                                "σ = E ln(stretch), integrated over the height", found,
                                0.005 if not quick else 0.01, "m", limit=limit))  # fmt: skip

    # --- 5. Picture --------------------------------------------------------------------------------------------------
    if MPI.COMM_WORLD.rank == 0:
        save_refinement(
            folder / "error.png", meshes, "Cells over the height", {"Error of the top's settlement": errors}
        )
    return Result(
        checks, {"error.png": "Error of the settlement over the number of cells: with crossings, and without"}
    )
