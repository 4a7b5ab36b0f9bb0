"""Consolidation of a layer, Mandel's slab, Cryer's ball and the ground under a strip load, by elements and particles.

Displacement and pore pressure are coupled; water and grains are incompressible. A layer under a load (Terzaghi) drains at its
top. Between the rigid plates of Mandel's slab, and inside Cryer's ball, the pressure first rises above its initial value,
because the soil at the drained surface consolidates and becomes softer: uncoupled flow does not have this effect. The motion
of Mandel's plates is prescribed, and the force on them is compared. The ball is axisymmetric. A strip load acts on a layer
that is so deep and wide that it represents a half-plane.

Three methods are compared: finite elements with quadratic displacement and linear pressure (Taylor-Hood), finite elements with
linear displacement and pressure and the polynomial pressure projection, and implicit particles, three per cell, on the nodes
of the latter. The pressure below the strip immediately after loading is also computed with averaged volumetric strains (NMD).
Time is integrated by backward Euler with steps that grow with the time.
"""

from __future__ import annotations

import numpy as np
from _case import Check, Kind, Result
from _particle_body import ParticleBody
from _plots import save_comparison
from common.consolidation.theory import (
    ball_pressure,
    layer_pressure,
    layer_settlement,
    mandel_pressure,
    mandel_settlement,
    strip_pressure,
)
from common.results import ROOT
from dolfinx.mesh import locate_entities_boundary, meshtags
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water

comm = MPI.COMM_WORLD
YOUNG, MOBILITY, LOAD = 10e6, 1e-12, 10e3  # Pa, k / gamma_w [m2/(Pa s)], Pa
WEIGHT = 1e-3
"""Unit weight of the pore water [N/m3]: nearly zero, as in the closed forms"""
LEFT, RIGHT, BASE, TOP, STRIP = 1, 2, 3, 4, 5
PARTICLES = "particles"
NAMES = {water.Element.TAYLOR_HOOD: "P2-P1", water.Element.STABILISED: "P1-P1", PARTICLES: "particles"}


class Body:
    """A body of weightless soil and water, drained at parts of its surface."""

    def __init__(self, mesh, supports, drained, load, element, poisson, length, geometry=None, nmd=False):
        """length: that of the time factor c t / length^2 [m]."""
        domain, _, facet_tags = mesh
        self.law = mpm.LinearElastic(young=YOUNG, poisson=poisson)
        self.period = length**2 / (MOBILITY * self.law.p_wave_modulus)
        soil = water.PorousSoil(MOBILITY * WEIGHT)
        self.model = water.Consolidation(domain, self.law, soil, facet_tags, supports,
                                         [water.Head(tag, 0.0) for tag in drained], load=load,
                                         element=element, geometry=geometry, unit_weight=WEIGHT,
                                         water_modulus=np.inf, nmd=nmd)  # fmt: skip

    def follow(self, factor, first=1e-4, growth=1.1):
        """Go to a time factor, with steps that grow with the time."""
        start = self.model.time / self.period
        reports = self.model.run(
            factor * self.period, max(first, 0.08 * start) * self.period, growth, 0.04 * self.period
        )
        if not reports[-1].converged:
            raise mpm.RunError(f"no equilibrium in the step from a time factor of {start:.3g}: {reports[-1].reason}")

    def advance(self, dt):
        """Take one step of dt [s]."""
        self.model.advance(dt)

    @property
    def plate_force(self):
        """Force on a plate on top that supports move [N/m]."""
        return self.model.reaction(TOP)[1]

    def pressures(self, points):
        """Pore pressures at points [Pa], shape (n,)."""
        own = points if comm.rank == 0 else points[:0]
        return comm.bcast(self.model.evaluate_at(own)["pressure"][:, 0])

    def drain(self, tags):
        """Let water leave at these parts of the surface, and nowhere else."""
        self.model.boundary = [water.Head(tag, 0.0) for tag in tags]

    def at(self, point):
        """Displacement [m], and pore pressure [Pa], at a point."""
        own = np.array([point]) if comm.rank == 0 else np.empty((0, len(point)))
        there = self.model.evaluate_at(own)
        return comm.bcast((there["displacement"], there["pressure"][:, 0]))


def body_of(mesh, supports, drained, load, element, poisson, length, geometry=None, nmd=False):
    """A Body, or a ParticleBody."""
    if element != PARTICLES:
        return Body(mesh, supports, drained, load, element, poisson, length, geometry, nmd)
    law = mpm.LinearElastic(young=YOUNG, poisson=poisson)
    return ParticleBody(mesh, supports, drained, load, law, MOBILITY, length, geometry, WEIGHT, nmd)


def layer(element, n):
    mesh = bridge.box_mesh(comm, (0.2, 1.0), (2, n))
    supports = [bridge.roller(LEFT, (1, 0)), bridge.roller(RIGHT, (1, 0)), bridge.fixed(BASE)]
    return body_of(mesh, supports, (TOP,), bridge.Load(pressure={TOP: LOAD}), element, 0.3, 1.0)


def slab(element, n, poisson):
    """A quarter of Mandel's slab, 1 m to its drained side and 0.5 m high, under F = LOAD [N/m] on its half of the plate."""
    mesh = bridge.box_mesh(comm, (1.0, 0.5), (n, n // 2))
    shear, height = YOUNG / (2 * (1 + poisson)), 0.5
    unit = LOAD * height / (2 * shear)
    supports = [bridge.roller(LEFT, (1, 0)), bridge.roller(BASE, (0, 1)), bridge.prescribed(TOP, (None, -unit))]
    moved = lambda time: bridge.Load(displacement=mandel_settlement(time / body.period, poisson))
    body = body_of(mesh, supports, (RIGHT,), moved, element, poisson, 1.0)
    return body


def ball(element, n):
    mesh = bridge.read_mesh(ROOT / "meshes" / "ball.geo", comm, parameters={"cell_size": 1.0 / n})
    supports = [bridge.roller("axis", (1, 0)), bridge.roller("equator", (0, 1))]
    load = bridge.Load(pressure={"surface": LOAD})
    return body_of(mesh, supports, ("surface",), load, element, 0.2, 1.0, bridge.Geometry.AXISYMMETRIC)


def strip(element, size, poisson):
    """A strip load, 2 m wide, on a layer 40 m deep, still sealed; half of it, 80 m wide."""
    parameters = {
        "half_width": 1.0,
        "width": 80.0,
        "depth": 40.0,
        "edge_size": size,
        "near_size": 2 * size,
        "far_size": 60 * size,
    }
    mesh = bridge.read_mesh(ROOT / "meshes" / "footing.geo", comm, parameters=parameters)
    supports = [bridge.roller("axis", (1, 0)), bridge.roller("far", (1, 0)), bridge.fixed("base")]
    return body_of(mesh, supports, (), bridge.Load(pressure={"footing": LOAD}), element, poisson, 1.0)


# --- checks --------------------------------------------------------------------------------------------------------


def layer_checks(element, n, tolerance):
    body, name, checks = layer(element, n), NAMES[element], []
    for factor in (0.05, 0.1, 0.2, 0.5, 1.0):
        body.follow(factor)
        moved, _ = body.at((0.1, 1.0))
        settled = -moved[0, 1] * body.law.p_wave_modulus / LOAD
        checks.append(Check(f"layer, settlement over the final one at T = {factor:g}", layer_settlement(factor),
                            "Terzaghi (1923)",
                            settled, tolerance, scale=1.0, over="the final settlement", method=name))  # fmt: skip
    _, p = body.at((0.1, 0.0))
    checks.append(Check("layer, pressure at the base over the load at T = 1", layer_pressure([0.0], 1.0)[0], "Terzaghi (1923)",
                        p[0] / LOAD, tolerance, scale=1.0, over="the load", method=name))  # fmt: skip
    return checks


def slab_checks(element, n, poisson, tolerance):
    """Checks, and the pressure in the middle over time."""
    body, name, checks, curve = slab(element, n, poisson), NAMES[element], [], []
    for factor in (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0):
        body.follow(factor)
        _, p = body.at((0.0, 0.0))
        curve.append((factor, 2 * p[0] / LOAD))
        if factor in (0.05, 0.1, 0.5):
            expected = mandel_pressure([0.0], factor, poisson)[0]
            checks.append(Check(f"slab, pressure in the middle over F / 2a at T = {factor:g}, ν = {poisson:g}", expected,
                                "Mandel (1953)", curve[-1][1], tolerance, scale=1.0, over="F / 2a", method=name))  # fmt: skip
    force = body.plate_force
    checks.append(Check(f"slab, force on the plate at T = 1, ν = {poisson:g}", LOAD / 1e3,
                        "the constant force of Mandel's problem", force / 1e3, tolerance, "kN/m", method=name))  # fmt: skip
    return checks, np.array(curve).T


def ball_checks(element, n, tolerance):
    body, name, checks, curve = ball(element, n), NAMES[element], [], []
    for factor in (0.01, 0.02, 0.05, 0.1, 0.2, 0.5):
        body.follow(factor)
        _, p = body.at((0.0, 0.0))
        curve.append((factor, p[0] / LOAD))
        if factor in (0.05, 0.2):
            checks.append(Check(f"ball, pressure at the centre over the load at T = {factor:g}, ν = 0.2",
                                ball_pressure(factor, 0.2), "Cryer (1963)", curve[-1][1], tolerance, scale=1, over="the load",
                                method=name))  # fmt: skip
    return checks, np.array(curve).T


def strip_checks(element, size, tolerance):
    body, name, checks, poisson = strip(element, size, 0.2), NAMES[element], [], 0.2
    body.advance(1e-7 * body.period)
    for depth in (0.5, 1.0, 2.0):
        _, p = body.at((0.0, -depth))
        checks.append(Check(f"strip, initial pressure {depth:g} m below its middle over the load",
                            strip_pressure(depth, 1.0), "q α / π on a half-plane", p[0] / LOAD, tolerance,
                            scale=1.0, over="the load", method=name))  # fmt: skip
    at_once = dip(body)
    body.drain(("surface", "footing"))
    body.advance(1e8 * body.period)
    checks.append(Check("strip, immediate settlement over the final one, ν = 0.2", 1 / (2 * (1 - poisson)),
                        "1 / (2 (1 - ν)) on a half-plane", at_once / dip(body), tolerance, scale=1.0, over="the final settlement",
                        method=name))  # fmt: skip
    return checks


def alternation(element, cells_high, nmd=False):
    """How much the pressure at once below a strip alternates from node to node of a mesh of squares cut in two.

    Root mean square of p less its mean over the four neighbours, over that of p, within the width and a depth of the strip.
    """
    domain, _, sides = bridge.box_mesh(comm, (4.0, 4.0), (cells_high, cells_high))
    under = locate_entities_boundary(domain, 1, lambda x: np.isclose(x[1], 4.0) & (x[0] < 1.0 + 1e-9))
    facets = np.concatenate([sides.indices[sides.values != TOP], under]).astype(np.int32)
    tags = np.concatenate([sides.values[sides.values != TOP], np.full(len(under), STRIP)]).astype(np.int32)
    order = np.argsort(facets)
    supports = [bridge.roller(LEFT, (1, 0)), bridge.roller(RIGHT, (1, 0)), bridge.fixed(BASE)]
    body = body_of((domain, None, meshtags(domain, 1, facets[order], tags[order])), supports, (),
                   bridge.Load(pressure={STRIP: LOAD}), element, 0.2, 1.0, nmd=nmd)  # fmt: skip
    body.advance(1e-7 * body.period)
    size = 4.0 / cells_high
    x, y = np.meshgrid(np.arange(size, 2.0, size), np.arange(4.0 - size, 2.0, -size), indexing="ij")
    p = body.pressures(np.column_stack([x.ravel(), y.ravel()])).reshape(x.shape)
    around = (p[2:, 1:-1] + p[:-2, 1:-1] + p[1:-1, 2:] + p[1:-1, :-2]) / 4
    return np.sqrt(np.mean((p[1:-1, 1:-1] - around) ** 2) / np.mean(p**2))


def alternation_checks(cells_high):
    found = {name: alternation(element, cells_high) for element, name in NAMES.items()}
    for element in (water.Element.STABILISED, PARTICLES):
        found[f"{NAMES[element]}, NMD"] = alternation(element, cells_high, nmd=True)
    return [
        Check("strip, alternation of the initial pressure from node to node", found["P2-P1"],
              "alternation in the P2-P1 elements", value, 0.1, kind=Kind.AT_MOST, method=name)
        for name, value in found.items() if name != "P2-P1"
    ]  # fmt: skip


def dip(body):
    """Settlement of the middle of the strip over that 4 m away [m], which the depth of the layer hardly changes."""
    return body.at((4.0, 0.0))[0][0, 1] - body.at((0.0, 0.0))[0][0, 1]


def run(quick: bool, folder) -> Result:
    checks, slabs, balls = [], {}, {}
    for element, name in NAMES.items():
        checks += layer_checks(element, 20 if quick else 40, 0.015)
        for poisson in (0.0,) if quick else (0.0, 0.2):
            found, curve = slab_checks(element, 12 if quick else 24, poisson, 0.02 if quick else 0.015)
            checks, slabs[f"slab, ν = {poisson:g}, {name}"] = checks + found, curve
        found, balls[f"ball, ν = 0.2, {name}"] = ball_checks(element, 10 if quick else 20, 0.03 if quick else 0.02)
        checks += found
        checks += strip_checks(element, 0.1 if quick else 0.04, 0.03 if quick else 0.015)
    checks += alternation_checks(32 if quick else 64)
    if comm.rank == 0:
        times = np.linspace(0.005, 1.0, 300)
        exact = {f"exact, slab, ν = {nu:g}": (times, np.array([mandel_pressure([0.0], t, nu)[0] for t in times]))
                 for nu in ((0.0,) if quick else (0.0, 0.2))}  # fmt: skip
        exact["exact, ball, ν = 0.2"] = times, np.array([ball_pressure(t, 0.2) for t in times])
        labels = "Time factor $ct/a^2$ [-]", "Pressure in the middle over its first value [-]"
        save_comparison(folder / "pressure.png", slabs | balls, exact, labels, limits=((0, 1), (0, 1.5)))
    caption = "Pore pressure in the middle of Mandel's slab and of Cryer's ball: it rises first. Points: computed"
    return Result(checks, {"pressure.png": caption})
