"""Stresses while particles cross cells: the standard method does not converge; mixed and dual domain integration do.

A column settles under its weight by a twentieth of its height and comes to rest. The weight above a particle does not change,
so its vertical stress is w (H - X) wherever it moves. The standard method integrates forces by particles, with gradients that
jump at the sides of cells: each crossing causes an error in the order of a particle's stress, on fine meshes as on coarse
ones. In a second part the paper's slope slides: its vertical stress is fitted by a plane through the nearest particles, and
the distance from it is its roughness.
"""

import matplotlib.pyplot as plt
import numpy as np
from _case import Check, Kind, Result
from common.field_plots import save_log_log
from common.figures import save_figure
from common.plots import VERTICAL_STRESS, WIDTH, Scene, colour_limits, discs, draw_bar, draw_scene, paper_style
from matplotlib.colors import Normalize
from mpi4py import MPI
from scipy.spatial import cKDTree

import fenics_bridge as bridge
import mpm_core as mpm

HEIGHT, YOUNG, POISSON, DENSITY, SETTLEMENT = 1.0, 1e6, 0.3, 1000.0, 0.05  # m, Pa, -, kg/m3, of the height
MODULUS = YOUNG * (1 - POISSON) / ((1 + POISSON) * (1 - 2 * POISSON))
MODES = {
    "standard": mpm.Integration.PARTICLES,
    "mixed": mpm.Integration.MIXED,
    "dual domains": mpm.Integration.DUAL_DOMAIN,
}
NEIGHBOURS = 12
NOT_CONVERGING = (
    "With linear shape functions the standard method has errors from particles that cross cells, which finer cells do not reduce "
    "(Steffen, Kirby & Berzins 2008); use Integration.MIXED or DUAL_DOMAIN where stresses matter."
)


# --- 1. A column that settles --------------------------------------------------------------------------------------


def column_error(rows, integration):
    """Root mean square error of the vertical stress over w H."""
    gravity, side = 2 * SETTLEMENT * MODULUS / (DENSITY * HEIGHT), HEIGHT / rows
    body = ((-1, 0), (1, HEIGHT))
    mesh = bridge.background_mesh(*bridge.box_mesh(MPI.COMM_SELF, [2 * side, HEIGHT + side], [2, rows + 1], body=body))
    model = mpm.Model(mesh, mpm.LinearElastic(young=YOUNG, poisson=POISSON))
    model.seed(density=DENSITY, per_cell=6, cell_tag=bridge.BODY)
    for tag in (1, 2):
        model.roller(tag, (1, 0))
    model.fix(3)
    period = 4 * HEIGHT / np.sqrt(MODULUS / DENSITY)
    model.set_gravity((0.0, -gravity), ramp=4 * period)
    list(model.explicit(12 * period, damping=0.7, integration=integration))
    expected = -DENSITY * gravity * (HEIGHT - model.particles.initial_position[:, 1])
    return np.sqrt(np.mean((model.particles.stress[:, 1] - expected) ** 2)) / (DENSITY * gravity * HEIGHT)


# --- 2. A slope that slides ----------------------------------------------------------------------------------------


def sliding_slope(integration, time):
    """The paper's slope, its weight at once; on one rank."""
    soil = mpm.MohrCoulomb(young=200e3, poisson=0.33, cohesion=1e3, friction_angle=25.0)
    model = mpm.Model(bridge.background_mesh(*bridge.slope_mesh(MPI.COMM_SELF)), soil)
    model.seed(density=80e3 / 9.81, per_cell=10, cell_tag=bridge.SOIL)
    model.roller(bridge.LEFT, (1, 0))
    model.fix(bridge.BASE)
    model.set_gravity((0.0, -9.81))
    list(model.explicit(time, damping=0.75, integration=integration))
    return model


def roughness(model):
    """Distance of the vertical stress from planes through its neighbours, over its size; root mean squares."""
    x, stress = model.particles.position, model.particles.stress[:, 1]
    _, near = cKDTree(x).query(x, NEIGHBOURS)
    planes = np.concatenate([np.ones((*near.shape, 1)), x[near] - x[:, None]], axis=2)
    fit = np.einsum("pij,pj->pi", np.linalg.pinv(planes), stress[near])
    return np.sqrt(np.mean((stress - fit[:, 0]) ** 2) / np.mean(stress**2))


def run(quick: bool, folder) -> Result:
    # --- 3. Errors in the column on finer and finer meshes -----------------------------------------------------------
    counts, checks = (8, 16) if quick else (8, 16, 32, 64), []
    errors = {name: [column_error(rows, mode) for rows in counts] for name, mode in MODES.items()}
    for name, found in errors.items():
        standard = name == "standard"
        checks += [
            Check(f"stress error in the column, {name}", 0.0, "w (H - X), root mean square over the particles", found[-1],
                  0.02 if quick else 0.01, scale=1.0, over="w H", limit=NOT_CONVERGING if standard else ""),
            Check(f"its order of convergence, {name}", 1.0, "approximation by constant strains in cells",
                  np.log2(found[0] / found[-1])
                  / np.log2(counts[-1] / counts[0]), 0.35, kind=Kind.AT_LEAST, limit=NOT_CONVERGING if standard else ""),
        ]  # fmt: skip

    # --- 4. Roughness of the slope's vertical stress, over that of the standard method ------------------------------
    models = {name: sliding_slope(mode, 2.0 if quick else 10.0) for name, mode in MODES.items()}
    rough = {name: roughness(model) for name, model in models.items()}
    for name in ("mixed", "dual domains"):
        checks.append(Check(f"roughness of the slope's stress over the standard method's, {name}", 0.8,
                            "the method should reduce the roughness by a fifth at least", rough[name] / rough["standard"], 0.0,
                            kind=Kind.AT_MOST))  # fmt: skip

    # --- 5. Pictures ------------------------------------------------------------------------------------------------
    if MPI.COMM_WORLD.rank == 0:
        save_log_log(folder / "column.png", [HEIGHT / n for n in counts], errors, "Error of the vertical stress over $wH$ [-]",
                     slope=1.0)  # fmt: skip
        save_stresses(folder / "slope.png", models, rough)
    return Result(checks, {
        "column.png": "Stress error of a column whose particles have crossed cells, by method of integration",
        "slope.png": "Vertical stress of the sliding slope by the three methods; roughness above",
    })  # fmt: skip


def save_stresses(path, models, rough):
    """Vertical stress of the particles one below the other, in one colour scale."""
    limits = colour_limits(VERTICAL_STRESS, [model.particles.stress[:, 1] for model in models.values()])
    with paper_style():
        figure, panels = plt.subplots(len(models), 1, figsize=(0.8 * WIDTH, 6.6), sharex=True)
        figure.subplots_adjust(left=0.09, right=0.98, bottom=0.13, top=0.96, hspace=0.2)
        for axes, (name, model) in zip(panels, models.items()):
            p, mesh = model.particles, model.mesh
            scene = Scene(mesh.points, mesh.cells, mesh.cell_tags == bridge.SOIL)
            lower, upper = scene.limits([p.position])
            axes.set(xlim=(lower[0], upper[0]), ylim=(lower[1], upper[1]), aspect="equal", ylabel="$y$ [m]")
            draw_scene(axes, scene)
            drawn = discs(
                axes, p.position, p.volume, cmap=VERTICAL_STRESS.colours, norm=Normalize(*limits), linewidths=0
            )
            drawn.set_array(VERTICAL_STRESS.scale * p.stress[:, 1])
            axes.set_title(f"{name}, $t$ = {model.time:g} s, roughness {rough[name]:.1%}", loc="left")
        panels[-1].set_xlabel("$x$ [m]")
        draw_bar(figure, figure.add_axes((0.25, 0.06, 0.5, 0.015)), VERTICAL_STRESS, limits)
        save_figure(figure, path)
