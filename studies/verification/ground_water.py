"""Ground water: a dam, a sheet pile, slopes with seepage, and a water level that falls above level ground.

Dupuit's discharge of a dam with vertical faces, k (h₁² - h₂²) / 2L, is exact in spite of the seepage face (Charny 1951);
conformal mapping gives the flow under a sheet pile of the depth s in a layer of the thickness T, q / (k h) = K' / 2K with
complete elliptic integrals K of the modulus sin(π s / 2T) (Polubarinova-Kochina 1962). The singularity at the tip of the pile
causes an error in proportion to the cell size, and the ends of a slope cause one in inverse proportion to its length; both
limits are therefore extrapolated from two sizes. When water that stands above level ground is lowered, effective stresses and
displacements do not change, whatever the conductivity, because the load on the surface falls by the same amount as the pore
pressure.
"""

from __future__ import annotations

import numpy as np
from _case import Check, Result
from _plots import save_comparison
from _wet_bodies import GRAVITY, PARTICLES, POROSITY, WATER, wet
from dolfinx import mesh
from mpi4py import MPI
from scipy.special import ellipk

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water

comm = MPI.COMM_WORLD
METHODS = {water.Element.TAYLOR_HOOD: "P2-P1", water.Element.STABILISED: "P1-P1", PARTICLES: "particles"}
LEFT, RIGHT, BASE, TOP = 1, 2, 3, 4
IMPLICIT, EXPLICIT = "particles, implicit", "particles, explicit"
RATIO = 0.5
"""Pore pressure over the weight above it, of the slope that slides"""
HELD = [bridge.roller(LEFT, (1, 0)), bridge.roller(RIGHT, (1, 0)), bridge.fixed(BASE)]


# --- 1. Flow -------------------------------------------------------------------------------------------------------


def dam(cells_high):
    """Discharge over k of a dam 16 m long between 10 m and 2 m of water [m]."""
    domain, _, facet_tags = bridge.box_mesh(comm, (16.0, 10.0), (8 * cells_high // 5, cells_high))
    soil = water.PorousSoil(1.0, porosity=0.4, retention=water.FreeSurface(fringe=0.1 * WATER))
    flow = water.Seepage(domain, soil, facet_tags, [water.Reservoir(LEFT, 10.0), water.Reservoir(RIGHT, 2.0)])
    flow.solve()
    return flow.inflow(LEFT)


def sheet_pile(part, cells_high):
    """Flow over k h under a pile that goes down to a part of a layer; half of the ground, of which the gap has the mean head."""
    thickness = 4.0
    domain, _, _ = bridge.box_mesh(comm, (4 * thickness, thickness), (4 * cells_high, cells_high))
    ground = mesh.locate_entities_boundary(domain, 1, lambda x: np.isclose(x[1], thickness))
    below = thickness * (1 - part) + 1e-9
    gap = mesh.locate_entities_boundary(domain, 1, lambda x: np.isclose(x[0], 0) & (x[1] <= below))
    facets, tags = np.concatenate([ground, gap]), np.repeat([1, 2], [len(ground), len(gap)]).astype(np.int32)
    order = np.argsort(facets)
    facet_tags = mesh.meshtags(domain, 1, facets[order], tags[order])
    boundary = [water.Head(1, thickness + 1.0), water.Head(2, thickness + 0.5)]
    flow = water.Seepage(domain, water.PorousSoil(1.0), facet_tags, boundary, degree=2)
    flow.solve()
    return flow.inflow(1)


def under_pile(part):
    """K' / 2K, of the modulus sin(pi s / 2T)."""
    squared = np.sin(np.pi * part / 2) ** 2
    return ellipk(1 - squared) / (2 * ellipk(squared))


def flow_checks(quick):
    """Checks, and the flow under a sheet pile over its depth."""
    discharge = dam(20 if quick else 40)
    checks = [Check("discharge of a dam over k, h₁ 10 m, h₂ 2 m, L 16 m", 3.0, "k (h₁² - h₂²) / 2L", discharge, 0.01, "m",
                    method="linear elements")]  # fmt: skip
    n, curve = 8 if quick else 16, []
    for part in (0.25, 0.5, 0.75):
        coarse, fine = sheet_pile(part, n), sheet_pile(part, 2 * n)
        curve.append((part, 2 * fine - coarse))
        checks.append(Check(f"flow under a sheet pile over k h, s/T = {part:g}", under_pile(part), "K' / 2K, sin(π s / 2T)",
                            curve[-1][1], 0.01, method="quadratic elements"))  # fmt: skip
    return checks, np.array(curve).T


# --- 2. A long slope -----------------------------------------------------------------------------------------------


LINEAR_SLOPE = (
    "Linear elements converge from above with the cell size: with seepage the error is 10, 4 and 2 % with four, eight and sixteen "
    "of them over the depth."
)


def slope_factor(length, angle, unit_weight, seeps, degree):
    """Factor of safety of a layer 1 m deep on an incline, with cohesion c = 1 kPa, φ = ψ = 30°; linear elements in half the size."""
    rows = 4 if degree == 2 else 8
    tangent = np.tan(angle)
    domain, _, facet_tags = bridge.box_mesh(comm, (length, 1.0), (int(0.5 * rows * length), rows))
    domain.geometry.x[:, 1] -= tangent * domain.geometry.x[:, 0]
    law = mpm.MohrCoulomb(young=20e6, poisson=0.3, cohesion=1e3, friction_angle=30.0, dilation_angle=30.0)
    fem = bridge.QuasiStatic(domain, law, facet_tags, HELD, degree, nmd=degree == 1)
    if seeps:
        fem.reconfigure(pore_pressure=lambda x: WATER * np.cos(angle) ** 2 * (1.0 - x[:, 1] - tangent * x[:, 0]))
    found = bridge.factor_of_safety(fem, bridge.Load(unit_weight=unit_weight), start=0.4, tolerance=1e-3)
    return 0.5 * (found.value + found.failed_at)


def slope_checks(quick):
    angle, checks = np.radians(20.0), []
    lengths = (10.0, 20.0) if quick else (20.0, 40.0)
    for name, unit_weight, seeps in (("dry", 18e3, False), ("seepage parallel to it", 20e3, True)):
        normal = (unit_weight - WATER * seeps) * np.cos(angle) ** 2
        exact = (1e3 + normal * np.tan(np.radians(30.0))) / (unit_weight * np.sin(angle) * np.cos(angle))
        for degree, method in ((2, "quadratic elements"), (1, "linear elements, NMD")):
            short, long = (slope_factor(length, angle, unit_weight, seeps, degree) for length in lengths)
            checks.append(Check(f"factor of safety of an infinite slope of 20°, {name}", exact,
                                "[c + (γ d cos²β - p) tan φ] / (γ d sin β cos β)", 2 * long - short, 0.02,
                                limit=LINEAR_SLOPE if degree == 1 else "", method=method))  # fmt: skip
    return checks


def sliding_layer(method, length, cells_high):
    """Acceleration of a layer 1 m deep with pressures r_u γ d, in axes along and across it, in the middle of a length [m/s2].

    The waves from the ends do not come there. Without dilation soil shears along the layer at τ = σ' sin φ.
    """
    angle = np.radians(20.0)
    weight = WATER * np.cos(angle) ** 2 / RATIO
    friction = np.degrees(np.arcsin(np.tan(np.radians(30.0))))
    law = mpm.MohrCoulomb(young=10e6, poisson=0.3, cohesion=0.0, friction_angle=friction, dilation_angle=0.0)
    mesh = bridge.box_mesh(comm, (length, 1.0), (int(length) * cells_high, cells_high))
    model = mpm.Model(bridge.background_mesh(*mesh), law)
    model.seed(density=weight / GRAVITY, per_cell=3)
    bridge.apply_supports(model, HELD)
    model.set_gravity((GRAVITY * np.sin(angle), -GRAVITY * np.cos(angle)))
    model.add_water(porosity=POROSITY, conductivity=1e-4, modulus=2.2e7)
    across = WATER * np.cos(angle)
    model.set_pore_pressure(lambda x: across * (1 - x[:, 1]))
    model.hold_pore_pressure(TOP, 0.0)
    effective = (across - weight * np.cos(angle)) * (1 - model.particles.position[:, 1])
    model.particles.set("stress", effective[:, None] * np.array([1.0, 1.0, 1.0, 0.0]))
    end, rows = 0.003 * length, []
    how = {"nmd": True, "every": end / 24}
    for report in model.implicit(end, dt=end / 30, **how) if method == IMPLICIT else model.explicit(end, **how):
        x, v = model.particles.position, model.particles.velocity
        middle = (np.abs(x[:, 0] - 0.5 * length) < 1) & (x[:, 1] > 0.5)
        sums = comm.allreduce(np.array([middle.sum(), v[middle, 0].sum()]))
        rows.append((report.time, sums[1] / sums[0]))
    times, speeds = np.array(rows)[12:].T
    return np.polyfit(times, speeds, 1)[0]


def acceleration_checks(quick):
    angle, checks = np.radians(20.0), []
    resisting = (1 - RATIO / np.cos(angle) ** 2) * np.cos(angle) * np.tan(np.radians(30.0))
    exact = GRAVITY * (np.sin(angle) - resisting)
    for method, cells in ((IMPLICIT, 4), (EXPLICIT, 8 if quick else 12)):
        checks.append(Check(f"acceleration of an infinite slope of 20° that fails, r_u = {RATIO:g}", exact,
                            "g [sin β - (1 - r_u / cos²β) cos β tan φ]", sliding_layer(method, 40.0, cells), 0.01, "m/s²",
                            method=method))  # fmt: skip
    return checks


# --- 3. Water that falls over level ground -------------------------------------------------------------------------


def level_ground_checks(method, conductivity):
    """The water level falls by 5 m within an hour, and nothing happens."""
    soil = mpm.LinearElastic(young=5e6, poisson=0.3)
    ground = bridge.box_mesh(comm, (2.0, 3.0), (4, 6))
    weight = 2000.0 * GRAVITY
    body = wet(method, ground, soil, conductivity, HELD, {TOP: 9.0}, weight, start=9.0)
    for _ in range(
        4
    ):  # its weight comes on, and a step of backward Euler leaves 1 / 250 of what is not yet consolidated
        body.advance(100 * 3.0**2 * WATER / (conductivity * soil.p_wave_modulus))
    stress, moved = body.mean_stress()[1], body.displacement((1.0, 3.0))[1]
    for level in np.linspace(9.0, 4.0, 6)[1:]:
        if method == PARTICLES:
            body.model.hold_pore_pressure(TOP, level=level)
        else:
            body.model.boundary = [water.Reservoir(TOP, level)]
        body.advance(720.0)
    elastic = 5.0 * WATER * 3.0 / soil.p_wave_modulus
    name, where = METHODS[method], f"water level falls by 5 m over level ground, k = {conductivity:g} m/s"
    return [
        Check(f"{where}: change of the effective stress over that of the water's load", 0.0,
              "the load and the pore pressure fall by the same amount",
              (body.mean_stress()[1] - stress) / (5.0 * WATER), 1e-5, scale=1.0, over="the change of the water's load",
              method=name),
        Check(f"{where}: settlement over that of dry ground under this change of load", 0.0,
              "the load and the pore pressure fall by the same amount",
              (body.displacement((1.0, 3.0))[1] - moved) / elastic, 1e-5, scale=1.0, over="the settlement of dry ground",
              method=name),
    ]  # fmt: skip


def run(quick: bool, folder) -> Result:
    checks, piles = flow_checks(quick)
    checks += slope_checks(quick)
    checks += acceleration_checks(quick)
    for method in METHODS:
        for conductivity in (1e-3, 1e-7, 1e-11):
            checks += level_ground_checks(method, conductivity)
    if comm.rank == 0:
        parts = np.linspace(0.05, 0.95, 91)
        expected = {"conformal mapping": (parts, under_pile(parts))}
        labels = "Depth of the pile over that of the layer [-]", "Flow over $k h$ [-]"
        save_comparison(folder / "sheet_pile.png", {"quadratic elements": tuple(piles)}, expected, labels)
    return Result(checks, {"sheet_pile.png": "Flow under a sheet pile"})
