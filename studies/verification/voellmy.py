"""A sheet of soil on ground with Voellmy's resistance: the velocity that it approaches on a slope, and where it stops on level ground.

Between the sheet and the ground acts the shear stress μ σ_n + ρ g v² / ξ (Voellmy 1955, Über die Zerstörungskraft von Lawinen,
Schweiz. Bauzeitung 73). A sheet of the thickness h then moves on a slope as v = v_t tanh(a t / v_t), with a = g (sin θ - μ cos θ)
and v_t² = a ξ h / g, and stops on level ground after ξ h / 2g ln(1 + v² / (ξ μ h)). The ground is a plane; gravity turns from the
slope to level ground. The soil is firm enough not to spread.
"""

import numpy as np
from _case import Check, Result
from _plots import save_comparison
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

THICKNESS, LENGTH, SLOPE, FRICTION, TURBULENCE = 1.0, 8.0, np.radians(25.0), 0.2, 100.0  # m, m, rad, -, m/s2
DENSITY, GRAVITY, DURATION = 1800.0, 9.81, 4.0  # kg/m3, m/s2, s on the slope
ACCELERATION = GRAVITY * (np.sin(SLOPE) - FRICTION * np.cos(SLOPE))
LIMIT = np.sqrt(ACCELERATION * TURBULENCE * THICKNESS / GRAVITY)
SOURCE = "Voellmy (1955), dv/dt = g (sin θ - μ cos θ) - g v² / (ξ h)"


def speed_on_slope(time: np.ndarray) -> np.ndarray:
    """[m/s]"""
    return LIMIT * np.tanh(ACCELERATION * time / LIMIT)


def run(quick: bool, folder) -> Result:
    comm, cell = MPI.COMM_WORLD, 0.5 if quick else 0.25
    # --- 1. A sheet at rest on a plane -------------------------------------------------------------------------------
    width, height = 30.0, 2.0
    counts = [round(width / cell), round(height / cell)]
    body = ((1.0, 0.0), (1.0 + LENGTH, THICKNESS))
    soil = mpm.MohrCoulomb(young=5e6, poisson=0.3, cohesion=50e3, friction_angle=30.0, dilation_angle=0.0)
    model = mpm.Model(bridge.background_mesh(*bridge.box_mesh(comm, (width, height), counts, body=body)), soil)
    model.seed(density=DENSITY, per_cell=6, cell_tag=bridge.BODY)
    level = model.gap(mpm.Plane((0.0, 0.0), (0.0, 1.0)))
    plane = mpm.Plane((0.0, level - 1e-9), (0.0, 1.0))
    model.add_contact(plane, friction=FRICTION, drag=GRAVITY / TURBULENCE)

    # --- 2. Down the slope, and on to rest ---------------------------------------------------------------------------
    p = model.particles

    def mean(values: np.ndarray) -> float:
        sums = comm.allreduce(np.array([p.mass @ values, p.mass.sum()]))
        return float(sums[0] / sums[1])

    rows = []
    options = {"every": 0.1, "integration": mpm.Integration.MIXED, "nmd": True, "pic": 0.01}
    for gravity, until in (((np.sin(SLOPE), -np.cos(SLOPE)), DURATION), ((0.0, -1.0), DURATION + 4.0)):
        model.set_gravity(GRAVITY * np.array(gravity))
        for report in model.explicit(until, **options):
            rows.append((report.time, mean(p.displacement[:, 0]), mean(p.velocity[:, 0])))
    time, path, speed = np.array(rows).T
    bottom = np.searchsorted(time, DURATION - 1e-6)

    # --- 3. Speed and paths against the closed form ------------------------------------------------------------------
    factor = ACCELERATION * DURATION / LIMIT
    fall = LIMIT**2 / ACCELERATION * np.log(np.cosh(factor))
    reached = speed_on_slope(DURATION)
    stop = TURBULENCE * THICKNESS / (2 * GRAVITY) * np.log1p(reached**2 / (TURBULENCE * FRICTION * THICKNESS))
    tolerance = 0.02
    checks = [
        Check("velocity at the end of the slope", reached, SOURCE, speed[bottom], tolerance, "m/s"),
        Check("path on the slope", fall, SOURCE, path[bottom], tolerance, "m"),
        Check("path on level ground", stop, SOURCE, path[-1] - path[bottom], tolerance, "m"),
        Check("velocity in the end", 0.0, "at rest", abs(speed[-1]), 0.01, "m/s", scale=reached, over="that at the end of the slope"),
    ]  # fmt: skip
    if comm.rank == 0:
        down = np.linspace(0.0, DURATION, 50)
        # dv/dt = -μ g - g v² / (ξ h)
        rate, root = GRAVITY * FRICTION, np.sqrt(FRICTION * TURBULENCE * THICKNESS)
        until = root / rate * np.arctan(reached / root)
        after = np.linspace(0.0, until, 50)
        slower = root * np.tan(np.arctan(reached / root) - rate * after / root)
        exact = {"closed form": (np.append(down, DURATION + after), np.append(speed_on_slope(down), slower))}
        save_comparison(
            folder / "speed.png", {"particles": (time[::2], speed[::2])}, exact, ("Time [s]", "Velocity [m/s]")
        )
    return Result(
        checks, {"speed.png": "Mean velocity of the sheet over time, on the slope for 4 s and then on level ground"}
    )
