"""A pipe that is pulled through clay: the factor of full flow, from smooth to rough.

Half of a rigid pipe is pulled through weightless Tresca soil under a uniform pressure, so that no gap opens behind it.
Randolph and Houlsby (1984) give the load at collapse over the diameter and the shear strength,

N = pi + 2 D + 2 cos D + 4 (cos D/2 + sin D/2), D = asin(alpha)

with the roughness alpha. It is exact for a rough pipe; for a smooth one it is a lower bound, and the upper bound by Martin and
Randolph (2006) is less than one per cent higher. Soil that sticks to a rough pipe must shear within the cells around it, so
that coarse cells give higher loads. Between smooth and rough the shear stress on the pipe is an adhesion of alpha s_u.
"""

import numpy as np
from _case import Check, Kind, Result
from _plots import save_comparison
from common.files import ROOT
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

RADIUS, STRENGTH, RIGIDITY, POISSON, DENSITY = 0.5, 1e3, 300.0, 0.49, 1000.0  # m, Pa, G / s_u, -, kg/m3
PRESSURE, SPEED, WAY = 15.0, 5e-4, 0.04
"""Over the strength; over that of elastic waves; over the diameter"""


ROUGHNESS = {"smooth": 0.0, "half rough": 0.5, "rough": 1.0}
"""alpha"""


def exact(face):
    delta = np.arcsin(ROUGHNESS[face])
    return np.pi + 2 * delta + 2 * np.cos(delta) + 4 * (np.cos(delta / 2) + np.sin(delta / 2))


def pulled(face, cell_size):
    """The factor, and the curve of displacement over the diameter and load over diameter and strength."""
    parameters = {"radius": RADIUS, "size": 8 * RADIUS, "edge_size": cell_size, "far_size": cell_size + 0.6}
    clay = mpm.tresca(young=2 * (1 + POISSON) * RIGIDITY * STRENGTH, poisson=POISSON, shear_strength=STRENGTH)
    mesh = bridge.read_mesh(ROOT / "meshes" / "pipe.geo", MPI.COMM_WORLD, parameters=parameters)
    model = mpm.Model(bridge.background_mesh(*mesh), clay)
    model.seed(density=DENSITY, per_cell=3, cell_tag="soil")
    model.roller("axis", normal=(1, 0))
    model.fix("far")
    pressure = np.array([-1.0, -1.0, -1.0, 0.0]) * PRESSURE * STRENGTH
    model.particles.set("stress", np.tile(pressure, (len(model.particles), 1)))
    radius = RADIUS + model.gap(mpm.Disc((0, 0), RADIUS)) - 1e-9
    speed = SPEED * np.sqrt(clay.p_wave_modulus / DENSITY)
    motion = ([0.0, 0.1 * WAY * 2 * RADIUS / speed], [(0.0, 0.0), (0.0, -speed)])
    # Soil that is pressed on a rough pipe is weaker than the contact, and fails itself.
    between = ROUGHNESS[face] % 1.0
    pipe = model.add_contact(mpm.Disc((0, 0), radius), friction=1.0 if face == "rough" else 0.0,
                             adhesion=between * STRENGTH, velocity=motion)  # fmt: skip
    until, rows = 1.05 * WAY * 2 * RADIUS / speed, [(0.0, 0.0, 0.0)]
    for report in model.explicit(until, every=until / 30, nmd=True, pic=0.01, integration=mpm.Integration.MIXED):
        rows.append((report.time, -pipe.displacement[1], pipe.impulse[1]))
    time, way, impulse = np.array(rows).T
    factor = np.diff(impulse) / np.diff(time) / (radius * STRENGTH)
    return factor[-8:].mean(), np.column_stack([way[1:] / (2 * radius), factor])


def run(quick: bool, folder) -> Result:
    # --- 1. Pipes from smooth to rough -------------------------------------------------------------------------------
    checks, curves, cell_size = [], {}, 0.1 if quick else 0.025
    for face in ("rough",) if quick else ROUGHNESS:
        found, curves[face] = pulled(face, cell_size)
        name = f"factor of a {face} pipe"
        source = "Randolph and Houlsby 1984"
        checks.append(Check(name, exact(face), source, found, 0.3 if quick else 0.05))
    if not quick:
        coarse, fine = pulled("rough", 2 * cell_size)[0], checks[-1].computed
        ratio = abs(fine - exact("rough")) / abs(coarse - exact("rough"))
        checks.append(Check("error of the factor of a rough pipe, over that on cells twice as large", 0.6,
                            "convergence with the cell size", ratio, 0.0, kind=Kind.AT_MOST))  # fmt: skip

    # --- 2. Picture --------------------------------------------------------------------------------------------------
    if MPI.COMM_WORLD.rank == 0:
        ends = np.array([0.0, max(curve[-1, 0] for curve in curves.values())])
        lines = {f"{face}, exact": (ends, np.full(2, exact(face))) for face in curves}
        save_comparison(folder / "load.png", {name: tuple(curve.T) for name, curve in curves.items()}, lines,
                        ("Displacement over the diameter [-]", "Load over diameter and $s_u$ [-]"), joined=True,
                        limits=((0.0, None), (0.0, None)))  # fmt: skip
    return Result(checks, {"load.png": "Load on pipes that are pulled through clay"})
