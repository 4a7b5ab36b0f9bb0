"""Bearing capacity of a strip footing on weightless ground, by elasto-plastic FEM against Prandtl's solution.

Half of a smooth, flexible strip is loaded by a uniform pressure until there is no equilibrium any more, on several meshes.
The pressure at collapse is cohesion x Nc; with associated flow (the default) Nc converges from above to that of Prandtl.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path
from time import perf_counter

import numpy as np
from common.checks import check_cells, say
from common.collapse_runs import CAPTIONS, CollapseRuns, Target, add_flow_options, dilation_angles
from common.figures import Pictures
from common.options import add_count, add_number, check, study_parser
from common.page import Page
from common.ranks import run_study
from common.results import ROOT, open_results
from common.site.laws import unit_doubt
from common.slope.case import soil_of
from common.slope.fem import add_element_options, finite_elements, step_line
from common.summary import write_summary
from mpi4py import MPI

import fenics_bridge as bridge

comm = MPI.COMM_WORLD
AXIS, BASE, FAR, FOOTING = 1, 2, 3, 5
"""Facet tags of meshes/footing.geo."""


# --- 1. Options ------------------------------------------------------------------------------------------------------


def parser() -> ArgumentParser:
    """Parser of all options; the help shows their units."""
    p = study_parser(__doc__)
    add_number(p, "--friction-angle", 0.0, "degrees", "friction angle", at_least=0, below=45)
    add_number(p, "--dilation-angle", None, "degrees",
               "dilation angle, at most the friction angle (default: equal, associated flow)", at_least=0)  # fmt: skip
    add_number(p, "--cohesion", 1e3, "Pa", "cohesion", above=0)
    add_number(p, "--young", 100e3, "Pa", "Young's modulus", above=0)
    add_number(p, "--poisson", 0.3, "-", "Poisson's ratio", above=-1, below=0.5)
    add_number(p, "--half-width", 0.5, "m", "half of the footing's width", above=0)
    add_number(
        p,
        "--cell-size",
        0.05,
        "m",
        "size of the triangles below the footing; a fifth of it at the edge, larger far away",
        above=0,
    )
    add_count(p, "--meshes", 3, "meshes, each twice as fine as the one before; the last has --cell-size")
    add_element_options(p)
    add_flow_options(p)
    return p


def parse(arguments: list[str] | None = None) -> Namespace:
    p = parser()
    options = p.parse_args(arguments)
    if options.dilation_angle is None:
        options.dilation_angle = options.friction_angle
    check(p, options.dilation_angle <= options.friction_angle,
          lambda: f"--dilation-angle is {options.dilation_angle:g}, expected at most --friction-angle, "
                  f"{options.friction_angle:g} degrees")  # fmt: skip
    check(p, options.cell_size <= options.half_width,
          lambda: f"--cell-size is {options.cell_size:g}, expected at most --half-width")  # fmt: skip
    say(unit_doubt({"young": options.young, "cohesion": options.cohesion}, "the ground"))
    check_cells(p, options, 10 * (options.half_width / options.cell_size) ** 2, "--cell-size", "--half-width")
    return options


# --- 2. Prandtl ------------------------------------------------------------------------------------------------------


def prandtl_factor(friction_angle: float) -> float:
    """Nc of weightless ground (Prandtl 1921): (Nq - 1) cot(phi), Nq = exp(pi tan(phi)) tan^2(45 + phi/2); 2 + pi for 0."""
    if friction_angle == 0:
        return 2 + np.pi
    phi = np.radians(friction_angle)
    return float((np.exp(np.pi * np.tan(phi)) * np.tan(np.pi / 4 + phi / 2) ** 2 - 1) / np.tan(phi))


def prandtl_line(half_width: float, friction_angle: float) -> np.ndarray:
    """Slip line below the right half: wedge, logarithmic spiral about the footing's edge, wedge; (k, 2) [m]."""
    phi = np.radians(friction_angle)
    steep = np.pi / 4 + phi / 2
    turned = np.linspace(0, np.pi / 2, 61)
    radius = half_width / np.cos(steep) * np.exp(turned * np.tan(phi))
    direction = np.pi + steep + turned
    spiral = np.column_stack([half_width + radius * np.cos(direction), radius * np.sin(direction)])
    end = half_width + 2 * radius[-1] * np.cos(np.pi / 4 - phi / 2)
    return np.vstack([spiral, [end, 0.0]])


# --- 3. Collapse on each mesh ----------------------------------------------------------------------------------------


def target(a: Namespace) -> Target:
    """The bearing capacity factor: pressure at collapse over cohesion."""
    return Target(
        "bearing_capacity_factor_Nc", "failed_at_factor_Nc", "prandtl_bearing_capacity_factor_Nc",
        prandtl_factor(a.friction_angle), unit=a.cohesion,
        title="Collapse at $N_c$ = {:.2f}", line="Nc = {:6.3f}", label="Bearing capacity factor $N_c$ [-]",
    )  # fmt: skip


def footing(a: Namespace, cell_size: float, dilation_angle: float) -> tuple[bridge.Collapse, np.ndarray]:
    """Raise the pressure to the last equilibrium on one mesh that reaches well beyond Prandtl's slip line.

    Returns also the curve of pressure [Pa] and settlement of the footing's centre [m], (k, 2).
    """
    line = prandtl_line(a.half_width, a.friction_angle)
    parameters = {"half_width": a.half_width, "width": 1.6 * line[-1, 0], "depth": -2.0 * line[:, 1].min(),
                  "edge_size": 0.2 * cell_size, "near_size": cell_size, "far_size": 6 * cell_size}  # fmt: skip
    domain, _, facet_tags = bridge.read_mesh(ROOT / "meshes" / "footing.geo", comm, parameters=parameters)
    supports = [bridge.roller(AXIS, (1, 0)), bridge.roller(FAR, (1, 0)), bridge.fixed(BASE)]
    model = bridge.QuasiStatic(domain, soil_of(a, dilation_angle), facet_tags, supports, **finite_elements(a))
    show = step_line(f"cells of {cell_size:g} m, dilation angle {dilation_angle:g} degrees", "pressure [Pa]")
    curve, centre = [(0.0, 0.0)], np.zeros((1, 2))

    def look(step: bridge.LoadStep) -> None:
        show(step)
        moved = bridge.evaluate_at(centre, displacement=model.displacement)["displacement"]
        if step.converged:
            curve.append((step.value, -moved[0, 1]))

    load = lambda pressure: bridge.Load(pressure={FOOTING: pressure})  # noqa: E731
    return bridge.collapse_load(model, load, first_step=a.cohesion, progress=look), np.array(curve)


# --- 4. Pictures -----------------------------------------------------------------------------------------------------


def drawn(a: Namespace, found: CollapseRuns, folder: Path) -> Pictures:
    """Mechanism, load-settlement curves and convergence. Collective."""
    line = prandtl_line(a.half_width, a.friction_angle)
    box = ((0.0, 1.3 * line[:, 1].min()), (1.15 * line[-1, 0], 0.0))
    labels = "Settlement of the centre [mm]", "Pressure over cohesion [-]"
    return {
        **found.mechanism_pictures(folder, line, "slip line of Prandtl", box=box),
        **found.curve_pictures(folder, "load_settlement", labels),
    }


# --- 5. All together -------------------------------------------------------------------------------------------------


def main(arguments: list[str] | None = None) -> int:
    a = parse(arguments)
    start = perf_counter()
    folder = open_results(a, comm)
    sizes = [
        a.cell_size * 2**k for k in reversed(range(a.meshes)) if a.cell_size * 2**k <= a.half_width * (1 + 1e-9)
    ]
    both = {angle: [footing(a, size, angle) for size in sizes] for angle in dilation_angles(a)}
    runs, curves = ({angle: [pair[k] for pair in pairs] for angle, pairs in both.items()} for k in (0, 1))
    found = CollapseRuns(target(a), a.friction_angle, sizes, runs, curves)

    curve = found.finest_curve()
    summary = {
        **found.summary(),
        "collapse_pressure_Pa": curve[-1, 0],
        "curve_pressure_Pa": curve[:, 0],
        "curve_settlement_m": curve[:, 1],
        "wall_seconds": perf_counter() - start,
    }
    said = f"Prandtl: Nc = {found.target.reference:.3f}\n{found.lines()}"
    write_summary(folder, a, summary, comm, Page(captions=CAPTIONS), drawn(a, found, folder), said)
    return found.exit_code()


if __name__ == "__main__":
    run_study(main)
