"""Volumetric locking of linear triangles: Cook's membrane, nearly incompressible, by particles against Taylor-Hood elements.

All diagonals of the mesh run one way, the arrangement in which linear triangles lock. One quasi-static step of the material
point method with plain triangles and with nodal mixed discretisation (NMD), for Poisson ratios up to 0.499999975.
"""

from __future__ import annotations

import sys
from argparse import ArgumentParser
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from common.field_plots import save_log_log
from common.options import add_count, study_parser
from common.plots import WIDTH, Quantity, Scene, colour_limits, discs, draw_bar, draw_scene, paper_style
from common.ranks import end_all_on_error
from common.summary import ROOT, OutputError, results_folder, write_summary
from matplotlib.colors import Normalize
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

comm = MPI.COMM_SELF
SHEAR = 0.375
"""Shear modulus of the benchmark [Pa]; the same for all Poisson ratios."""
TRACTION = 1 / 16
SCALE = 1e-4
"""Of the load, so that the displacements stay small; results are divided by it."""
MID_EDGE = np.array([[48.0, 52.0]])
POISSON = (1 / 3, 0.49, 0.4999, 0.499999975)
PRESSURE = Quantity("Mean stress over shear modulus", "-", scale=1 / (SHEAR * SCALE), colours="viridis")


# --- 1. Options ------------------------------------------------------------------------------------------------------


def parser() -> ArgumentParser:
    """All options; units stand in the help."""
    p = study_parser(__doc__)
    add_count(p, "--divisions", 8, "cells along each side on the coarsest mesh")
    add_count(p, "--meshes", 4, "meshes, each twice as fine as the one before")
    add_count(p, "--reference-divisions", 64, "Taylor-Hood elements along each side, for the reference")
    return p


# --- 2. One mesh -----------------------------------------------------------------------------------------------------


def membrane(divisions: int) -> tuple:
    """Cook's membrane: mesh, cell tags and facet tags, clamped edge 1, loaded edge 2."""
    return bridge.read_mesh(ROOT / "meshes" / "cook.geo", comm, parameters={"divisions": divisions})


def reference(divisions: int, poisson: float) -> float:
    """Deflection at the middle of the loaded edge by Taylor-Hood elements [m]."""
    domain, _, facet_tags = membrane(divisions)
    solution = bridge.solve_nearly_incompressible(
        domain, facet_tags, [bridge.fixed(1)], 2 * SHEAR * (1 + poisson), poisson, 0.0, traction={2: (0.0, TRACTION)}
    )
    return float(solution.evaluate_at(MID_EDGE)["displacement"][0, 1])


def by_particles(divisions: int, poisson: float, nmd: bool) -> tuple[float, mpm.Model]:
    """Deflection at the middle of the loaded edge by one quasi-static step [m], and the model after it."""
    mesh = bridge.background_mesh(*membrane(divisions))
    model = mpm.Model(mesh, mpm.LinearElastic(young=2 * SHEAR * (1 + poisson), poisson=poisson))
    model.seed(density=1.0, per_cell=3)
    model.fix(1)
    model.traction(2, (0.0, SCALE * TRACTION))
    # K / G of 2e7 leaves a residual of some 1e-8 from round-off, the default tolerance.
    for _ in model.implicit(1.0, dt=1.0, quasi_static=True, nmd=nmd, solver=mpm.Newton(tolerance=1e-6)):
        pass
    nearest = np.argmin(np.linalg.norm(mesh.points - MID_EDGE, axis=1))
    return float(model.nodal("velocity")[nearest, 1]) / SCALE, model


# --- 3. Pictures -----------------------------------------------------------------------------------------------------


def save_pressures(path: Path, models: dict[str, mpm.Model]) -> None:
    """Mean stress of the particles on the finest mesh, side by side, in one colour scale."""
    mean = {name: model.particles.stress[:, :3].mean(axis=1) for name, model in models.items()}
    limits = colour_limits(PRESSURE, [mean["NMD"]])  # that of locked triangles is larger by orders
    with paper_style():
        figure, panels = plt.subplots(1, len(models), figsize=(WIDTH, 4.4), sharey=True)
        figure.subplots_adjust(left=0.07, right=0.98, bottom=0.25, top=0.94, wspace=0.05)
        for axes, (name, model) in zip(panels, models.items()):
            p, scene = model.particles, Scene(model.mesh.points, model.mesh.cells)
            lower, upper = scene.limits([p.position])
            axes.set(xlim=(lower[0], upper[0]), ylim=(lower[1], upper[1]), aspect="equal", xlabel="$x$ [m]")
            draw_scene(axes, scene)
            drawn = discs(axes, p.position, p.volume, cmap=PRESSURE.colours, norm=Normalize(*limits), linewidths=0)
            drawn.set_array(PRESSURE.scale * mean[name])
            axes.set_title(name, loc="left")
        panels[0].set_ylabel("$y$ [m]")
        draw_bar(figure, figure.add_axes((0.25, 0.12, 0.5, 0.025)), PRESSURE, limits)
        figure.savefig(path)
        plt.close(figure)


# --- 4. All together -------------------------------------------------------------------------------------------------


def main(arguments: list[str] | None = None) -> int:
    a = parser().parse_args(arguments)
    folder = results_folder("locking", a.output, comm)
    divisions = [a.divisions * 2**k for k in range(a.meshes)]
    rows, models, curves = [], {}, {}
    for poisson in POISSON:
        expected = reference(a.reference_divisions, poisson)
        for name, nmd in (("plain", False), ("NMD", True)):
            for n in divisions:
                found, models[name] = by_particles(n, poisson, nmd)
                rows.append({"poisson": poisson, "elements": name, "divisions": n, "deflection_m": found,
                             "reference_m": expected, "error": abs(found / expected - 1)})  # fmt: skip
                print(f"nu {poisson:<12.9g} {name:5} {n:4} cells a side: {found:8.4f} m, Taylor-Hood {expected:8.4f} m, "
                      f"error {rows[-1]['error']:.2%}", flush=True)  # fmt: skip
            if poisson in (POISSON[0], POISSON[-1]):
                curves[f"{name}, $\\nu$ = {poisson:.9g}"] = [row["error"] for row in rows[-len(divisions) :]]
    save_log_log(
        folder / "error.png", [44 / n for n in divisions], curves, "Relative error of the deflection [-]", slope=1.0
    )
    save_pressures(folder / "pressure.png", models)
    write_summary(folder, a, {"cook": rows}, comm)
    print(f"results in {folder}")
    return 0


if __name__ == "__main__":
    end_all_on_error(MPI.COMM_WORLD)
    if MPI.COMM_WORLD.size > 1:
        print("studies/run locking: runs on one rank", file=sys.stderr)
        sys.exit(2)
    try:
        sys.exit(main())
    except (mpm.InputError, mpm.RunError, OutputError) as error:
        print(f"studies/run locking: {error}", file=sys.stderr)
        sys.exit(2)
