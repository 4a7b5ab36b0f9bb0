"""Motion of bodies of revolution by the explicit scheme: free fall, a vibrating ring, and the energy of a vibrating cylinder.

A cylinder on the axis falls freely through an irregular mesh: it must fall without strain, stress or radial motion. A thin
ring that widens has hoop stresses only and oscillates with the angular frequency √(E/ρ) / R. A cylinder that is released on
rough ground vibrates: the sum of kinetic and stored energy equals the work of its weight at all times.
"""

import numpy as np
from _case import Check, Result
from _plots import save_comparison
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

GRAVITY, DENSITY = 9.81, 1000.0
AXIS, WALL, BASE, TOP = 1, 2, 3, 4


def model_of(lengths, counts, law, *, inner=0.0, shake=0.0, body=None, per_cell=6):
    """Particles in a box of the half section that begins at a radius; shake: of the inner nodes, as a fraction of a cell."""
    domain, cell_tags, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, lengths, counts, body=body)
    x, cell = domain.geometry.x[:, :2], np.asarray(lengths) / counts
    inside = ((x > 1e-9) & (x < np.asarray(lengths) - 1e-9)).all(axis=1)[:, None]
    # By the place, so that it is the same on any number of ranks
    domain.geometry.x[:, :2] += inside * shake * cell * np.sin(7.0 * x[:, ::-1] / cell + x / cell)
    domain.geometry.x[:, 0] += inner
    mesh = bridge.background_mesh(domain, cell_tags, facet_tags)
    model = mpm.Model(mesh, law, geometry=mpm.Geometry.AXISYMMETRIC)
    model.seed(density=DENSITY, per_cell=per_cell, cell_tag=bridge.BODY)
    return model


def largest(model, values):
    return model.comm.allreduce(float(np.abs(values).max(initial=0.0)), MPI.MAX)


# --- 1. Free fall ----------------------------------------------------------------------------------------------------


def fallen(quick, nmd, integration):
    """Checks of a cylinder that has fallen by some cells."""
    law, height, time = mpm.LinearElastic(young=1e6, poisson=0.3), 2.0, 0.3 if quick else 0.45
    model = model_of([1.0, height], [6, 12], law, shake=0.2, body=((-1.0, 1.0), (0.6, height)))
    model.roller(AXIS, (1, 0))
    model.set_gravity((0.0, -GRAVITY))
    start = model.comm.allreduce(model.particles.volume.sum())
    list(model.explicit(time, nmd=nmd, integration=integration))
    p, depth = model.particles, GRAVITY * time**2 / 2
    name = "mixed integration" if integration is mpm.Integration.MIXED else "averaged strains" if nmd else "particles"
    return [
        Check(f"radial motion over the depth of fall, {name}", 0.0, "no radial force acts",
              largest(model, p.displacement[:, 0]) / depth, 1e-9, scale=1.0, over="the depth of fall"),
        Check(f"stress over the unit weight times 1 m, {name}", 0.0, "free fall", largest(model, p.stress) / (DENSITY * GRAVITY),
              1e-6, scale=1.0, over="the unit weight times 1 m"),
        Check(f"velocity, {name}", GRAVITY * time, "g t", largest(model, p.velocity[:, 1]), 1e-9, "m/s"),
        Check(f"change of volume, {name}", 0.0, "free fall without strain", model.comm.allreduce(p.volume.sum()) / start - 1,
              1e-9, scale=1.0, over="the volume"),
    ]  # fmt: skip


# --- 2. A thin ring that breathes -------------------------------------------------------------------------------------


def breathing(periods, thickness):
    """Period of a ring of radius 1 m [s], and that of a thin one."""
    young, speed = 1e4, 1e-4
    law = mpm.LinearElastic(young=young, poisson=0.0)
    model = model_of([thickness, thickness], [2, 2], law, inner=1.0 - thickness / 2)
    model.particles.set("velocity", np.tile([speed, 0.0], (len(model.particles), 1)))
    expected = 2 * np.pi * np.sqrt(DENSITY / young)
    reports = [model.report(), *model.explicit(periods * expected, every=expected / 100)]
    time, momentum = np.array([(r.time, r.momentum[0]) for r in reports]).T
    change = np.flatnonzero(momentum[1:] * momentum[:-1] < 0)
    zeros = time[change] - momentum[change] * np.diff(time)[change] / np.diff(momentum)[change]
    return 2 * (zeros[-1] - zeros[0]) / (len(zeros) - 1), expected, (time / expected, momentum / momentum[0])


# --- 3. A cylinder released on rough ground ---------------------------------------------------------------------------


def vibrating(cells):
    """Time, kinetic and stored energy, and the work of weight and support: (k, 4), per radian [J]; fraction not explained."""
    law = mpm.LinearElastic(young=1e7, poisson=0.3)
    model = model_of([1.25, 1.25], [cells, cells], law, body=((-1.0, -1.0), (1.0, 1.0)))
    model.roller(AXIS, (1, 0))
    model.fix(BASE)
    model.set_gravity((0.0, -GRAVITY))
    reports = list(model.explicit(0.15, every=0.0025))
    rows = [(r.time, r.kinetic_energy, r.internal_work, r.external_work + r.support_work) for r in reports]
    return np.array(rows), max(abs(r.unexplained_fraction) for r in reports)


def run(quick: bool, folder) -> Result:
    checks = []
    plain, mixed = mpm.Integration.PARTICLES, mpm.Integration.MIXED
    for nmd, integration in ((False, plain), (True, plain), (False, mixed)):
        checks += fallen(quick, nmd, integration)
    period, expected, (time, momentum) = breathing(2 if quick else 8, 0.05)
    checks.append(Check("period of the ring", expected, "2π R √(ρ/E), thin ring", period, 2e-3, "s"))
    cells = 10 if quick else 20
    energy, unexplained = vibrating(cells)
    gap = np.abs(energy[:, 1] + energy[:, 2] - energy[:, 3]).max() / energy[:, 2].max()
    source = "kinetic + stored energy = work of the weight"
    checks.append(Check("energy that is missing at the nodes, over the stored energy", 0.0, source, gap, 1e-9, scale=1.0,
                        over="the stored energy"))  # fmt: skip
    checks.append(Check("unexplained energy at the particles, over the energy at work", 0.0, "conservation of energy",
                        unexplained, 0.01, scale=1.0, over="the energy at work"))  # fmt: skip

    # --- 4. Pictures -------------------------------------------------------------------------------------------------
    if MPI.COMM_WORLD.rank == 0:
        labels = "Time over the period [-]", "Momentum over that at the start [-]"
        save_comparison(folder / "ring.png", {"particles": (time[::8], momentum[::8])},
                        {"exact": (time, np.cos(2 * np.pi * time))}, labels, limits=((None, None), (-1.1, 1.5)))  # fmt: skip
        t, kinetic, stored, work = energy.T
        curves = {"kinetic": (t, kinetic), "stored": (t, stored), "kinetic + stored": (t, kinetic + stored)}
        save_comparison(folder / "energy.png", curves, {"work of the weight": (t, work)},
                        ("Time [s]", "Energy per radian [J]"), limits=((None, None), (0.0, 4.6)), joined=True)  # fmt: skip
    return Result(checks, {
        "ring.png": "Radial momentum of a thin ring that vibrates",
        "energy.png": "Energies of an elastic cylinder that is released on rough ground",
    })  # fmt: skip
