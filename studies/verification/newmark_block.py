"""Newmark's sliding block: soil on a shaken rigid plane, with frictional contact.

A block of soil, stiff enough to move as one, lies on a plane that moves in its own direction. On level ground the plane is
accelerated by a rectangular pulse A, which exceeds μ g, up to the velocity V, and the block slips by V² / (2 μ g) (1 - μ g /
A). On a plane inclined by 15° that shakes by band-limited noise the block slides downhill whenever the plane accelerates
uphill by more than g (μ cos β - sin β), until both have the same velocity again; the slip is integrated exactly for a
piecewise linear velocity.

The block's own vibrations are damped in proportion to its stiffness. A rigid block has no such vibrations. Without damping
they would change the pressure on the plane, so that a block that sticks creeps downhill by another tenth of the slip.
"""

import numpy as np
from _case import Check, Result
from _plots import save_comparison
from common.earthquake.motions import as_motion, band_limited_noise
from common.earthquake.newmark import pulse_slip, sliding_block
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

GRAVITY, SETTLED = 9.81, 0.3  # m/s2; time until the block rests under its weight [s]
OPTIONS = {"rayleigh": mpm.Rayleigh(stiffness=3e-4), "integration": mpm.Integration.MIXED}
SIDES, FLOOR, START = (1.0, 0.5), 0.6, 1.0  # of the block, height of the plane, left end of the block [m]
TOLERANCE = 0.03


def slips(friction: float, slope: float, time: np.ndarray, velocity: np.ndarray, cells: int) -> np.ndarray:
    """Slip of the block relative to the plane, downhill, at the times of the motion, of which the first is 0."""
    # --- 1. A block on a plane along x; gravity is inclined -----------------------------------------------------------
    comm, size = MPI.COMM_WORLD, SIDES[1] / cells
    lengths = (5.0, 1.8)
    mesh = bridge.box_mesh(comm, lengths, [round(length / size) for length in lengths])
    model = mpm.Model(bridge.background_mesh(*mesh), mpm.LinearElastic(young=5e7, poisson=0.2))
    spacing = size / 2
    counts = [round(side / spacing) for side in SIDES]
    grid = spacing * (np.indices(counts).reshape(2, -1).T + 0.5) + (START, FLOOR)
    model.seed_points(grid, np.full(len(grid), spacing**2), density=2000.0)
    model.set_gravity((GRAVITY * np.sin(slope), -GRAVITY * np.cos(slope)), ramp=0.5 * SETTLED)

    # --- 2. It comes to rest; then the plane moves along x ------------------------------------------------------------
    moves = np.column_stack([np.append(0.0, velocity), np.zeros(len(velocity) + 1)])
    plane = mpm.Plane((0.0, FLOOR - 1e-9), normal=(0, 1))
    ground = model.add_contact(plane, friction=friction, velocity=(np.append(0.0, SETTLED + time), moves))
    model.explicit(SETTLED, damping=0.5, energy_limit=None, **OPTIONS).last()

    def moved() -> float:
        p = model.particles
        sums = comm.allreduce(np.array([(p.mass * p.displacement[:, 0]).sum(), p.mass.sum()]))
        return float(sums[0] / sums[1] - ground.displacement[0])

    start, found = moved(), [0.0]
    for _ in model.explicit(SETTLED + time[-1], every=time[-1] / (len(time) - 1), energy_limit=None, **OPTIONS):
        found.append(moved() - start)
    return np.array(found)


def run(quick: bool, folder) -> Result:
    cells, checks, curves, exact = (4 if quick else 8), [], {}, {}

    # --- A rectangular pulse on level ground --------------------------------------------------------------------------
    friction, acceleration, length, end = 0.25, 8.0, 0.25, 1.25
    time = np.linspace(0.0, end, 101)
    velocity = acceleration * np.minimum(time, length)
    slip = -slips(friction, 0.0, time, velocity, cells)
    expected = pulse_slip(velocity[-1], acceleration, friction * GRAVITY)
    checks.append(Check("slip by a rectangular pulse", expected, "V² / (2 μ g) (1 - μ g / A), Newmark 1965", slip[-1],
                        TOLERANCE, "m"))  # fmt: skip
    curves["rectangular pulse"] = (time, slip)
    exact["rigid block, pulse"] = (time, -sliding_block(time, velocity, friction * GRAVITY, friction * GRAVITY)[1])

    # --- Noise on a slope ---------------------------------------------------------------------------------------------
    friction, slope = 0.4, np.radians(15.0)
    motion = as_motion(*band_limited_noise((0.5, 3.0), 5.0, 4.0, 0.01, seed=1))
    begins = GRAVITY * (friction * np.cos(slope) - np.sin(slope)), GRAVITY * (friction * np.cos(slope) + np.sin(slope))
    slip = slips(friction, slope, motion.time, motion.velocity, cells)
    path = sliding_block(motion.time, motion.velocity, *begins)[1]
    checks.append(Check("slip of an inclined block by noise", path[-1], "sliding rigid block, integrated exactly", slip[-1],
                        TOLERANCE, "m"))  # fmt: skip
    curves["noise, inclined by 15°"] = (motion.time, slip)
    exact["rigid block, noise"] = (motion.time, path)

    if MPI.COMM_WORLD.rank == 0:
        save_comparison(folder / "slip.png", curves, exact, ("Time [s]", "Slip [m]"), joined=True)
    return Result(checks, {"slip.png": "Slip of a block of soil on a plane that shakes, and of a rigid block"})
