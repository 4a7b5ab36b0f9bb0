"""Saturated soil with weight: consolidation, upward flow, large strains, and the limits of no drainage and of full drainage.

A fresh fill settles under its own weight as its water drains at the top (the linear limit of Gibson's theory). Water that
flows up through a layer reduces the effective stress in proportion to its gradient, to zero at the critical gradient. A slope
that hardly drains moves as undrained soil does in total stresses, and a submerged slope that drains at once moves as soil does
under its buoyant weight; both are compared with quadratic elements without flow. Each problem is computed by finite elements
with quadratic displacement and linear pressure (P2-P1), by finite elements with linear displacement and pressure and the
polynomial pressure projection (P1-P1), and by implicit particles, three per cell.

A layer that is compressed by up to 39 % has a closed form if stress follows a rate law and the conductivity is proportional
to the square of the stretch (Xie and Leo 2004). Particles cross up to six rows of cells in this case, with mixed integration,
and water leaves at the free surface as it moves.
"""

from __future__ import annotations

import numpy as np
from _case import Check, Result
from _plots import save_comparison
from _wet_bodies import GRAVITY, PARTICLES, POROSITY, WATER, dry, wet
from _wet_layer import closed_form, follow, large_layer
from common.results import ROOT
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water

comm = MPI.COMM_WORLD
METHODS = {water.Element.TAYLOR_HOOD: "P2-P1", water.Element.STABILISED: "P1-P1", PARTICLES: "particles"}
LEFT, RIGHT, BASE, TOP = 1, 2, 3, 4
SOIL = mpm.LinearElastic(young=10e6, poisson=0.3)
WEIGHT = 2000.0 * GRAVITY
BUOYANT = WEIGHT - WATER


# --- 1. A layer under its own weight, and under upward flow --------------------------------------------------------


def fill_settled(factor: float) -> float:
    """Settlement over the final one, u = buoyant weight times depth at once: 1 - sum 4 sin(m) / m^3 exp(-m^2 T)."""
    m = np.pi * (np.arange(200) + 0.5)
    return float(1 - np.sum(4 * np.sin(m) / m**3 * np.exp(-(m**2) * factor)))


def layer(method, n, levels):
    """A layer 1 m high under water; levels: of the heads at its boundaries [m], by tag."""
    mesh = bridge.box_mesh(comm, (0.2, 1.0), (2, n))
    held = [bridge.roller(LEFT, (1, 0)), bridge.roller(RIGHT, (1, 0)), bridge.fixed(BASE)]
    return wet(method, mesh, SOIL, 1e-8, held, levels, WEIGHT, start=1.0)


def own_weight_checks(method, n):
    body, name, checks = layer(method, n, {TOP: 1.0}), METHODS[method], []
    period = WATER / (1e-8 * SOIL.p_wave_modulus)
    final, dt = 0.5 * BUOYANT / SOIL.p_wave_modulus, 1e-4
    for factor in (0.1, 0.2, 0.5, 1.0):
        while body.time < factor * period * (1 - 1e-9):
            body.advance(min(dt * period, factor * period - body.time))
            dt = min(1.1 * dt, 0.02)
        settled = -body.displacement((0.1, 1.0))[1] / final
        checks.append(Check(f"fresh fill, settlement over the final one at T = {factor:g}", fill_settled(factor),
                            "linear consolidation under own weight: series in sin(m) / m³", settled,
                            0.012, scale=1.0, over="the final settlement", method=name))  # fmt: skip
    return checks


def upward_flow_checks(method, n):
    checks, critical = [], BUOYANT / WATER
    for part in (0.5, 1.0):
        body = layer(method, n, {TOP: 1.0, BASE: 1.0 + part * critical})
        for _ in range(3):
            body.advance(1e9)
        found = body.mean_stress()[1] / (-0.5 * BUOYANT)
        checks.append(Check(f"upward flow at {part:g} of the critical gradient, effective stress over that at rest", 1 - part,
                            "1 - i / i_c, i_c = (G_s - 1)(1 - n)", found, 1e-5, scale=1.0,
                            over="the effective stress at rest", method=METHODS[method]))  # fmt: skip
    return checks


# --- 2. A slope without drainage, and with all of it ---------------------------------------------------------------


def slope_mesh(size):
    parameters = {"cell_size": size, "far_size": 1.5 * size}
    return bridge.read_mesh(ROOT / "meshes" / "hillside.geo", comm, parameters=parameters)


HELD = [bridge.roller("left", (1, 0)), bridge.roller("right", (1, 0)), bridge.fixed("base")]
CREST = (1.1, 1.0)


def slope_checks(method, size, tolerance):
    mesh, name, checks = slope_mesh(size), METHODS[method], []
    modulus, porosity = 2.2e9, POROSITY
    undrained = mpm.Undrained(SOIL, water_modulus=modulus, porosity=porosity)
    body = wet(method, mesh, SOIL, 1e-16, HELD, {}, WEIGHT, modulus=modulus)
    body.advance(1.0)
    expected = 1e3 * np.linalg.norm(dry(mesh, undrained, HELD, WEIGHT, CREST))
    checks.append(Check("slope that does not drain, displacement of its crest", expected,
                        "quadratic elements, undrained law of total stresses",
                        1e3 * np.linalg.norm(body.displacement(CREST)), tolerance, "mm", method=name))  # fmt: skip
    surface = {"slope": 2.0, "crest": 2.0}
    body = wet(method, mesh, SOIL, 1e-2, HELD, surface, WEIGHT, start=2.0)
    body.advance(1e4)
    expected = 1e3 * np.linalg.norm(dry(mesh, SOIL, HELD, BUOYANT, CREST))
    checks.append(Check("slope under water that drains at once, displacement of its crest", expected,
                        "quadratic elements under the buoyant weight",
                        1e3 * np.linalg.norm(body.displacement(CREST)), tolerance, "mm", method=name))  # fmt: skip
    return checks


# --- 3. Large strains ----------------------------------------------------------------------------------------------


def large_checks(cells, tolerances):
    """Checks, and curves of the settlement over time: found and exact."""
    checks, found, exact = [], {}, {}
    factors = (0.1, 0.2, 0.5, 1.0)
    for ratio, tolerance in zip((0.1, 0.5), tolerances):
        settled, base = follow(large_layer(cells, ratio), factors)
        expected, expected_base = closed_form(ratio, factors)
        for k, factor in enumerate(factors):
            checks.append(Check(f"large strains, q / M = {ratio:g}, settlement over the height at T = {factor:g}", expected[k],
                                "Xie and Leo (2004)", settled[k], tolerance, method="particles"))  # fmt: skip
            checks.append(Check(f"large strains, q / M = {ratio:g}, pressure at the base over the load at T = {factor:g}",
                                expected_base[k], "Xie and Leo (2004)", base[k], 0.01, scale=1, over="the load",
                                method="particles"))  # fmt: skip
        found[f"q / M = {ratio:g}, particles"] = np.array(factors), settled
        times = np.linspace(0.001, 1.0, 200)
        exact[f"q / M = {ratio:g}, exact"] = times, closed_form(ratio, times)[0]
    return checks, found, exact


def run(quick: bool, folder) -> Result:
    checks = []
    for method in METHODS:
        checks += own_weight_checks(method, 20)
        checks += upward_flow_checks(method, 10)
        checks += slope_checks(method, 0.1 if quick else 0.05, 0.01)
    more, found, exact = large_checks(20, (0.015, 0.025))
    if comm.rank == 0:
        labels = "Time factor $T = k_0 M t / (\\gamma_w H^2)$ [-]", "Settlement over the height [-]"
        save_comparison(folder / "large_strains.png", found, exact, labels, limits=((0, 1), (0, 0.4)))
    caption = "Settlement of a layer in large strains: particles (points), Xie and Leo (lines)"
    return Result(checks + more, {"large_strains.png": caption})
