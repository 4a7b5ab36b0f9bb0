"""Strip footing: the bearing capacity factors Nc and Nq of weightless ground, and Nγ of sand with weight.

Half of a smooth, flexible strip footing is computed with associated flow. Nc is the ratio of the limit pressure of ground
with cohesion to the cohesion; Nq is the ratio of the limit pressure of ground without cohesion, beside a surcharge, to the
surcharge. Nγ = 2 Q / (γ B²) is that of a rough, rigid footing that is pressed into sand by a fiftieth of its width. Its
error is in proportion to the cells, so that it is extrapolated from cells of 0.1 and 0.05 m below the footing. Finite
elements converge from above; the load steps of Nc and Nq begin with the cohesion or the surcharge and are bisected to 0.2 %
of the pressure.
"""

import numpy as np
from _case import Check, Result
from _plots import save_comparison
from common.files import ROOT
from footing import AXIS, BASE, FAR, FOOTING, footing, parse, prandtl_factor, prandtl_line
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

SURFACE, SURCHARGE, UNIT_WEIGHT = 4, 1e3, 20e3  # facet tag beside the footing, Pa, N/m3
MARTIN = {20.0: 2.839, 30.0: 14.754}
"""Nγ of rough footings, by the friction angle [degrees]"""
QUICK, FULL = "0.1", "0.05"
"""Cell sizes below the footing [m]; a fifth of them at its edge."""


def surcharge_factor(friction: float) -> float:
    """Nq = exp(π tan φ) tan²(45° + φ/2) (Reissner 1924)."""
    phi = np.radians(friction)
    return float(np.exp(np.pi * np.tan(phi)) * np.tan(np.pi / 4 + phi / 2) ** 2)


def nc(friction: float, size: str) -> float:
    """Bearing capacity factor by the study footing, on one mesh."""
    a = parse(["--friction-angle", str(friction), "--cell-size", size, "--meshes", "1"])
    collapse, _ = footing(a, a.cell_size, friction)
    return collapse.value / a.cohesion


def nq(friction: float, size: float) -> float:
    # --- 1. The ground, which reaches beyond Prandtl's slip line -----------------------------------------------------
    half = 0.5
    line = prandtl_line(half, friction)
    parameters = {"half_width": half, "width": 1.6 * line[-1, 0], "depth": -2.0 * line[:, 1].min(),
                  "edge_size": 0.2 * size, "near_size": size, "far_size": 6 * size}  # fmt: skip
    domain, _, facet_tags = bridge.read_mesh(ROOT / "meshes" / "footing.geo", MPI.COMM_WORLD, parameters=parameters)
    soil = mpm.MohrCoulomb(young=100e3, poisson=0.4, cohesion=0.0, friction_angle=friction, dilation_angle=friction)
    supports = [bridge.roller(AXIS, (1, 0)), bridge.roller(FAR, (1, 0)), bridge.fixed(BASE)]
    model = bridge.QuasiStatic(domain, soil, facet_tags, supports, degree=2)

    # --- 2. The surcharge everywhere, then more and more on the footing ---------------------------------------------
    load = lambda pressure: bridge.Load(pressure={FOOTING: pressure, SURFACE: SURCHARGE})  # noqa: E731
    model.solve(load(SURCHARGE))
    last = bridge.collapse_load(model, load, first_step=SURCHARGE, start=SURCHARGE)
    return last.value / SURCHARGE


def ngamma(friction: float, size: float) -> float:
    """Nγ of a rough footing that is pressed into sand, on one mesh."""
    # --- 1. Sand at rest, with hardly any cohesion ------------------------------------------------------------------
    parameters = {"half_width": 0.5, "width": 3.0, "depth": 1.5,
                  "edge_size": 0.2 * size, "near_size": size, "far_size": 6 * size}  # fmt: skip
    domain, _, facet_tags = bridge.read_mesh(ROOT / "meshes" / "footing.geo", MPI.COMM_WORLD, parameters=parameters)
    soil = mpm.MohrCoulomb(
        young=20e6, poisson=0.3, cohesion=1e-4 * UNIT_WEIGHT, friction_angle=friction, dilation_angle=friction
    )
    supports = [bridge.roller(AXIS, (1, 0)), bridge.roller(FAR, (1, 0)), bridge.fixed(BASE),
                bridge.prescribed(FOOTING, (0.0, -0.02))]  # fmt: skip
    # Of 30 degrees the sand at the edge flows on under 1e-4 of the forces; of 20 degrees the factor depends on the tolerance by 3 %.
    solver = bridge.Solver(relaxed_tolerance=5e-5 if friction > 25 else 1e-5)
    model = bridge.QuasiStatic(domain, soil, facet_tags, supports, degree=2, solver=solver)
    at_rest = bridge.k0_stress(model.points.coordinates(), surface=0.0, unit_weight=UNIT_WEIGHT, k0=0.5)
    model.set_initial_stress(at_rest, bridge.Load(unit_weight=UNIT_WEIGHT, displacement=0.0))

    # --- 2. The footing is pressed down by a fiftieth of its width -------------------------------------------------
    for part in (0.1, 0.3, 0.6, 1.0):
        report = model.equilibrate(bridge.Load(unit_weight=UNIT_WEIGHT, displacement=part))
        if not report.converged:
            raise mpm.RunError(f"no equilibrium at {part:g} of the settlement: {report.reason}")
    return 4 * model.reaction(FOOTING)[1] / UNIT_WEIGHT


def run(quick: bool, folder) -> Result:
    # --- 3. The factors over friction angles ------------------------------------------------------------------------
    size = QUICK if quick else FULL
    nc_found = {friction: nc(friction, size) for friction in ((0.0, 20.0) if quick else (0.0, 20.0, 30.0))}
    nq_found = {friction: nq(friction, float(size)) for friction in ((20.0,) if quick else (20.0, 30.0))}
    checks = [Check(f"Nc, φ {friction:g}°", prandtl_factor(friction), "Prandtl 1921", found, 0.05)
              for friction, found in nc_found.items()]  # fmt: skip
    checks += [Check(f"Nq, φ {friction:g}°", surcharge_factor(friction), "Reissner 1924", found, 0.05)
               for friction, found in nq_found.items()]  # fmt: skip
    for friction, exact in () if quick else MARTIN.items():
        extrapolated = 2 * ngamma(friction, float(FULL)) - ngamma(friction, float(QUICK))
        checks.append(
            Check(f"Nγ, φ {friction:g}°", exact, "Martin 2005, method of characteristics", extrapolated, 0.03)
        )

    # --- 4. Picture -------------------------------------------------------------------------------------------------
    if MPI.COMM_WORLD.rank == 0:
        angles = np.linspace(0, 32, 65)
        exact = {
            "$N_c$, Prandtl": [prandtl_factor(a) for a in angles],
            "$N_q$, Reissner": [surcharge_factor(a) for a in angles],
        }
        computed = {"$N_c$, finite elements": nc_found, "$N_q$, finite elements": nq_found}
        save_comparison(folder / "factors.png", {name: (list(found), list(found.values())) for name, found in computed.items()},
                        {name: (angles, values) for name, values in exact.items()},
                        ("Friction angle [degrees]", "Bearing capacity factor [-]"))  # fmt: skip
    return Result(checks, {"factors.png": "Bearing capacity factors: finite elements (marks) and closed forms (lines)"})
