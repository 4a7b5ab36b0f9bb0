"""Expansion of a cylindrical cavity in undrained clay: the limit pressure s_u (1 + ln I_r).

The inner wall of a ring of Tresca soil between smooth plates is pushed outwards; the ring is computed as a half section. Since
the soil keeps its volume, its motion is known: r² - r0² = a² - a0². With the rigidity index I_r = G / s_u the soil yields up
to the radius c, where c² = I_r (a² - a0²). In ground with a free boundary at the radius b the pressure on the wall is

p = s_u (1 + ln(I_r (1 - (a0/a)²)) - c²/b²)

(Gibson and Anderson 1961; the last term is the influence of the finite radius of the ground). Particles expand the cavity to
four times its radius in quasi-static steps, on a mesh that moves with them, because background nodes at a wall that moves away
have no soil. At this expansion the exact pressure is 0.065 s_u below its limit, and the outer radius of 500 a0 reduces it by
0.003 to 0.03 s_u. The pressure is computed from the nodal forces at the wall and, for comparison, from the stresses in the
ground, of which equilibrium requires that the pressure is the integral of (σ_θ - σ_r) / r.

For finite elements with small strains p = s_u (1 + ln(2 I_r u / a) - c²/b²), which is the limit pressure at 2 u = a.
"""

import numpy as np
from _case import Check, Result
from _moving_mesh import on_moved_mesh
from _plots import save_comparison
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

STRENGTH, RADIUS, OUTER, HEIGHT = 1.0, 1.0, 500.0, 0.5  # Pa, m, m, m
WALL, FREE, BELOW, ABOVE = 1, 2, 3, 4
STEP = 0.1
"""Motion of the wall in a step, over the cell behind it, which becomes thin; no particle leaves its cell within a step"""
NEARLY = 0.499
"""Poisson's ratio: the ground keeps its volume but for 0.2 % of the pressure"""


def clay(rigidity, poisson):
    return mpm.tresca(young=2 * (1 + poisson) * rigidity * STRENGTH, poisson=poisson, shear_strength=STRENGTH)


def limit(rigidity):
    """Over the strength."""
    return 1 + np.log(rigidity)


def pressure(rigidity, radius, outer=OUTER):
    """Over the strength, of a cavity that was widened to a radius; the outer wall has moved as well."""
    squares = radius**2 - RADIUS**2
    return 1 + np.log(rigidity * (1 - (RADIUS / radius) ** 2)) - rigidity * squares / (outer**2 + squares)


# --- 1. Large strains: particles on a mesh that moves with them, computed by each rank alike ---------------------------


def empty_model(mesh, law):
    """Function of the nodes that makes the model on them. mesh: where they begin."""
    x, y = mesh.points.T
    sides = [np.isclose(x, x.min()), np.isclose(x, x.max()), np.isclose(y, 0), np.isclose(y, HEIGHT)]
    edges = np.sort(mesh.cells[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    on_side = [edges[side[edges].all(axis=1)] for side in sides]
    facets = np.concatenate(on_side).astype(np.int32)
    tags = np.repeat([WALL, FREE, BELOW, ABOVE], [len(side) for side in on_side]).astype(np.int32)

    def build(nodes):
        model = mpm.Model(
            mpm.Mesh(nodes, mesh.cells, facets=facets, facet_tags=tags), law, geometry=mpm.Geometry.AXISYMMETRIC
        )
        for plate in (BELOW, ABOVE):
            model.roller(plate, (0, 1))
        return model

    return build, np.flatnonzero(sides[0])


def expanded(rigidity, cells, end):
    """Radius of the cavity, pressure of the nodes at the wall and by equilibrium of the ground's stresses: (k, 3)."""
    mesh = bridge.background_mesh(*bridge.box_mesh(MPI.COMM_SELF, [1.0, HEIGHT], [cells, 1]))
    nodes = mesh.points.copy()
    nodes[:, 0] = RADIUS * (OUTER / RADIUS) ** nodes[:, 0]
    mesh = mpm.Mesh(nodes, mesh.cells)
    build, wall = empty_model(mesh, clay(rigidity, NEARLY))
    model, a, found = build(nodes), RADIUS, []
    model.seed(density=1.0, per_cell=3)
    while a < end * (1 - 1e-9):
        # --- 2. A step of the wall: a tenth of the cell behind it ---------------------------------------------------
        thickness = np.unique(nodes[:, 0].round(12))[1] - a
        step = min(STEP * thickness, end - a)
        model.prescribe(WALL, (step, 0.0))
        for report in model.implicit(model.time + 1.0, dt=1.0, quasi_static=True, nmd=True):
            nodes = nodes + report.dt * model.nodal("velocity")
        a += step
        force = model.nodal("internal_force")[wall, 0].sum()
        model = on_moved_mesh(model, nodes, build)

        # --- 3. What it takes: dV = r dA, so that the integral of (σ_θ - σ_r) / r is a sum over V / r² -----------------
        p = model.particles
        ground = np.sum(p.volume * (p.stress[:, 2] - p.stress[:, 0]) / p.position[:, 0] ** 2)
        found.append((a, force / (a * HEIGHT), ground / HEIGHT))
    return np.array(found)


# --- 4. Small strains: finite elements -------------------------------------------------------------------------------


def by_finite_elements(rigidity, cells):
    """Pressure where the wall has moved by half of the radius, plus what the finite ground takes away."""
    domain, _, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, [1.0, HEIGHT], [cells, 1])
    x = domain.geometry.x
    x[:, 0] = RADIUS * (OUTER / RADIUS) ** x[:, 0]
    plates = [bridge.roller(tag, (0, 1)) for tag in (BELOW, ABOVE)]
    supports = [*plates, bridge.prescribed(WALL, (0.5 * RADIUS, None))]
    fem = bridge.QuasiStatic(
        domain, clay(rigidity, 0.49), facet_tags, supports, degree=2, geometry=bridge.Geometry.AXISYMMETRIC
    )
    fem.solve(bridge.Load(displacement=1.0), first_step=0.02)
    return abs(fem.reaction(WALL)[0]) / (RADIUS * HEIGHT) + rigidity * RADIUS**2 / OUTER**2


def run(quick: bool, folder) -> Result:
    # --- 5. Over the rigidity ----------------------------------------------------------------------------------------
    rigidities, cells, end = ((100.0,), 56, 2.0) if quick else ((50.0, 100.0, 200.0, 500.0), 78, 4.0)
    checks, curves, exact = [], {}, {}
    for rigidity in rigidities:
        name = f"I_r = {rigidity:g}"
        curve = curves[f"$I_r$ = {rigidity:g}"] = expanded(rigidity, cells, end)
        theory = pressure(rigidity, end)
        source = f"Gibson and Anderson 1961, at a = {end:g} a0"
        checks.append(Check(f"pressure of the wall over s_u, {name}, particles", theory, source, curve[-1, 1], 0.01))
        checks.append(
            Check(f"pressure by the ground's stresses over s_u, {name}, particles", theory, source, curve[-1, 2], 0.005)
        )
        if not quick:
            checks.append(
                Check(f"limit pressure over s_u, {name}, particles", limit(rigidity), "1 + ln I_r", curve[-1, 1], 0.02)
            )
        found = by_finite_elements(rigidity, cells // 2)
        checks.append(
            Check(f"limit pressure over s_u, {name}, finite elements", limit(rigidity), "1 + ln I_r", found, 0.02)
        )
        radii = np.linspace(1.02, end, 100)
        exact["exact" if rigidity == rigidities[0] else f"_{name}"] = (radii, pressure(rigidity, radii))

    # --- 6. Picture --------------------------------------------------------------------------------------------------
    if MPI.COMM_WORLD.rank == 0:
        thin = {name: curve[:: max(1, len(curve) // 25)] for name, curve in curves.items()}
        save_comparison(folder / "pressure.png", {name: (curve[:, 0], curve[:, 1]) for name, curve in thin.items()}, exact,
                        ("Radius of the cavity over that at the start [-]", "Pressure over $s_u$ [-]"))  # fmt: skip
    return Result(
        checks, {"pressure.png": "Pressure at the wall of the cavity: particles (marks), and the closed form (lines)"}
    )
