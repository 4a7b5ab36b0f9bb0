"""Thick-walled cylinder of Mohr-Coulomb soil under internal pressure: plastic ring, expansion, and limit pressure.

A quarter of the cylinder is computed in plane strain, with plastic flow without dilation, under the pressure at which the ring
between the inner wall and a chosen radius is plastic. The methods are quadratic finite elements, and particles in quasi-static
steps with nodal mixed discretisation. On particles the pressure acts over the width of the innermost cells, so that stresses
there are not compared. Finite elements also find the limit pressure, by load steps that begin with the cohesion and are
bisected down to 0.2 %.
"""

import numpy as np
from _case import Check, Result
from _plots import save_comparison
from common.files import ROOT
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

INNER, OUTER, PLASTIC = 1.0, 2.0, 1.5  # m: walls, and the radius up to which the soil is to yield
YOUNG, POISSON, COHESION, FRICTION = 200e6, 0.3, 10e3, 20.0  # Pa, -, Pa, degrees: strains of some 1e-4
BOTTOM, LEFT, WALL = 1, 2, 100
"""Facet tags of meshes/cylinder.geo; each chord of the inner wall has its own from WALL on."""


# --- 1. Closed form: Yu (2000), Cavity expansion methods in geomechanics, ch. 3; here from equilibrium, σ_r = N σ_θ

N = (1 + np.sin(np.radians(FRICTION))) / (1 - np.sin(np.radians(FRICTION)))
Y = 2 * COHESION * np.sqrt(N)


def elastic_constant(plastic):
    """B of σ_r = B (b²/r² - 1), σ_θ = -B (b²/r² + 1) outside of the plastic ring, compression positive; yields at its edge."""
    square = (OUTER / plastic) ** 2
    return Y / ((square - 1) + N * (square + 1))


def pressure_for(plastic):
    """Inside the ring d σ_r / dr = -(σ_r - σ_θ) / r gives σ_r + Y / (N - 1) ~ r^-(1 - 1/N)."""
    at_edge = elastic_constant(plastic) * ((OUTER / plastic) ** 2 - 1)
    return (at_edge + Y / (N - 1)) * (plastic / INNER) ** (1 - 1 / N) - Y / (N - 1)


def radial_stress(r):
    """Tension positive."""
    b, k = elastic_constant(PLASTIC), Y / (N - 1)
    in_ring = (pressure_for(PLASTIC) + k) * (np.asarray(r) / INNER) ** (1 / N - 1) - k
    return -np.where(r < PLASTIC, in_ring, b * ((OUTER / r) ** 2 - 1))


def hoop_stress(r):
    """Tension positive."""
    in_ring = (-radial_stress(r) - Y) / N
    return -np.where(r < PLASTIC, in_ring, -elastic_constant(PLASTIC) * ((OUTER / r) ** 2 + 1))


WIDENING = 2 * (1 - POISSON**2) / YOUNG * elastic_constant(PLASTIC) * OUTER
"""Displacement of the outer wall, Lamé [m]."""


# --- 2. Finite elements and particles ------------------------------------------------------------------------------


def cylinder(rings):
    """(mesh with tags, tags of the wall, outward directions of its chords)."""
    arcs = round(1.5 * rings)
    parameters = {"inner": INNER, "outer": OUTER, "rings": rings, "arcs": arcs}
    angles = np.pi / 2 * (np.arange(arcs) + 0.5) / arcs
    mesh = bridge.read_mesh(ROOT / "meshes" / "cylinder.geo", MPI.COMM_WORLD, parameters=parameters)
    return mesh, WALL + np.arange(arcs), np.column_stack([np.cos(angles), np.sin(angles)])


def finite_elements(rings, dilation):
    (domain, _, facet_tags), wall, _ = cylinder(rings)
    soil = mpm.MohrCoulomb(
        young=YOUNG, poisson=POISSON, cohesion=COHESION, friction_angle=FRICTION, dilation_angle=dilation
    )
    supports = [bridge.roller(BOTTOM, (0, 1)), bridge.roller(LEFT, (1, 0))]
    model = bridge.QuasiStatic(domain, soil, facet_tags, supports, degree=2)
    return model, lambda pressure: bridge.Load(pressure={int(tag): pressure for tag in wall})


def particles(rings, pressure):
    (domain, cell_tags, facet_tags), wall, outward = cylinder(rings)
    soil = mpm.MohrCoulomb(young=YOUNG, poisson=POISSON, cohesion=COHESION, friction_angle=FRICTION)
    model = mpm.Model(bridge.background_mesh(domain, cell_tags, facet_tags), soil)
    model.seed(density=2000.0, per_cell=3)
    model.roller(BOTTOM, (0, 1))
    model.roller(LEFT, (1, 0))
    for tag, direction in zip(wall, outward):
        model.traction(int(tag), pressure * direction)
    steps = 8
    whole = {}  # traction by number, on all ranks: particles may change ranks
    for part in MPI.COMM_WORLD.allgather(dict(zip(model.particles.id, model.particles.traction))):
        whole |= part
    for k in range(1, steps + 1):
        model.particles.set("traction", np.array([k / steps * whole[i] for i in model.particles.id]).reshape(-1, 2))
        list(model.implicit(float(k), dt=1.0, quasi_static=True, nmd=True))
    return model


# --- 3. What they give: widening, radius of the plastic ring, stresses ---------------------------------------------


def polar(position, stress):
    """Radius, radial and hoop stress."""
    r = np.hypot(*position.T)
    c, s = position.T / r
    xx, yy, xy = stress[:, 0], stress[:, 1], stress[:, 3]
    return r, c * c * xx + s * s * yy + 2 * c * s * xy, s * s * xx + c * c * yy - 2 * c * s * xy


def compared(name, r, radial, hoop, yields, widening, size, tolerance):
    """Checks of one method; size: of its cells over the wall's thickness."""
    scale = pressure_for(PLASTIC)
    off = np.sqrt(np.mean((radial - radial_stress(r)) ** 2)), np.sqrt(np.mean((hoop - hoop_stress(r)) ** 2))
    return [
        Check(f"displacement of the outer wall, {name}", 1e6 * WIDENING, "Lamé's solution outside the plastic ring",
              1e6 * widening, tolerance, "µm"),
        Check(f"radius of the plastic ring, {name}", PLASTIC, "chosen radius, from which the pressure follows", r[yields].max(),
              size, "m", scale=OUTER - INNER, over="the thickness of the wall"),
        Check(f"error of the radial stress, {name}", 0.0, "equilibrium and Mohr-Coulomb criterion", off[0], tolerance,
              "Pa", scale=scale, over="the pressure"),
        Check(f"error of the hoop stress, {name}", 0.0, "equilibrium and Mohr-Coulomb criterion", off[1], tolerance,
              "Pa", scale=scale, over="the pressure"),
    ]  # fmt: skip


def run(quick: bool, folder) -> Result:
    # --- 4. The ring by finite elements ------------------------------------------------------------------------------
    rings, comm, checks = 6 if quick else 16, MPI.COMM_WORLD, []
    pressure = pressure_for(PLASTIC)

    fem, load = finite_elements(rings, 0.0)
    fem.solve(load(pressure))
    parts = comm.allgather((fem.points.coordinates(), fem.points.stress, fem.points.state))
    x, stress, state = (np.concatenate([part[k] for part in parts]) for k in range(3))
    own = np.array([[OUTER, 0.0]]) if comm.rank == 0 else np.empty((0, 2))
    widening = comm.bcast(bridge.evaluate_at(own, displacement=fem.displacement)["displacement"][:1, 0])[0]
    r, radial, hoop = polar(x, stress)
    checks += compared("finite elements", r, radial, hoop, state[:, 0] > 1e-9, widening, 1 / rings, 0.01)

    # --- 5. And by particles; the inner cells, over which the pressure is spread, are left out -----------------------
    model = particles(rings, pressure)
    p = model.particles
    parts = comm.allgather((p.initial_position, p.stress, p.plastic_strain, p.displacement))
    x, stress, plastic, moved = (np.concatenate([part[k] for part in parts]) for k in range(4))
    at = np.hypot(*x.T)
    edge = (
        at > OUTER - (OUTER - INNER) / rings
    )  # u r is the same at both radii to first order in the thickness of a cell
    widening = np.mean((moved * x).sum(axis=1)[edge] / OUTER)
    r_p, radial_p, hoop_p = polar(x, stress)
    behind = r_p > INNER + (OUTER - INNER) / rings
    r_p, radial_p, hoop_p, plastic = r_p[behind], radial_p[behind], hoop_p[behind], plastic[behind]
    checks += compared(
        "particles", r_p, radial_p, hoop_p, plastic > 1e-9, widening, 1.5 / rings, 0.1 if quick else 0.03
    )

    # --- 6. The largest pressure: the ring reaches the outer wall ---------------------------------------------------
    model, load = finite_elements(rings, FRICTION)
    limit = pressure_for(OUTER)
    found = bridge.collapse_load(model, load, first_step=COHESION).value
    source = "Y / (N - 1) ((b/a)^(1 - 1/N) - 1), associated flow"
    checks.append(Check("largest pressure, finite elements", limit / 1e3, source, found / 1e3, 0.01, "kPa"))

    # --- 7. Picture -------------------------------------------------------------------------------------------------
    if comm.rank == 0:
        line = np.linspace(INNER, OUTER, 200)
        some = np.argsort(r_p)[:: max(1, len(r_p) // 300)]
        curves = {
            "radial, particles": (r_p[some], radial_p[some] / 1e3),
            "hoop, particles": (r_p[some], hoop_p[some] / 1e3),
        }
        exact = {"radial, exact": (line, radial_stress(line) / 1e3), "hoop, exact": (line, hoop_stress(line) / 1e3)}
        save_comparison(folder / "stress.png", curves, exact, ("Radius [m]", "Stress [kPa]"))
    return Result(checks, {"stress.png": "Stresses in the wall: particles, and the closed form as lines"})
