"""From finite elements to particles: the equilibrium is preserved, and the load rises further.

A part of the paper's slope yields under 16 kN/m³. It is computed by linear and by quadratic elements on the cells of the
particles. Their stresses balance the weight of the particles exactly, whatever the law, so that nothing moves in explicit
steps without damping. Then the weight rises to 19 kN/m³: in quasi-static steps with small displacements, particles are
equivalent to the finite elements and must have the same stresses, also where the soil yields. Stresses from elements on
another, unstructured mesh balance only up to the error of both meshes; one step without a change of load restores equilibrium.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from _case import Check, Kind, Result
from _plots import save_comparison
from common.slope.case import GRAVITY, SUPPORTS, SlopeCase, build_slope, slope_options
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

WEIGHT, RAISED = 16e3, 19e3  # N/m3
REST = 0.5  # s
SOLVER = bridge.Solver(tolerance=1e-11)
IDENTITY = "identity on the same cells"


def slope(cell: float) -> SlopeCase:
    """Particles in the cells of the slope, whose gravity is that of WEIGHT. Collective."""
    options = ["--cell-size", str(cell), "--particles-per-cell", "6", "--unit-weight", str(WEIGHT), "--mesh", "crossed"]
    return build_slope(slope_options(options), MPI.COMM_WORLD)


def finite_elements(case: SlopeCase, degree: int, mesh=None) -> bridge.QuasiStatic:
    """The slope's body under WEIGHT, on the cells of its particles or on another mesh. Collective."""
    parts = (case.domain, case.cell_tags, case.facet_tags) if mesh is None else mesh
    body, _, facet_tags = bridge.soil_mesh(*parts, tag=bridge.SOIL)
    fem = bridge.QuasiStatic(body, case.soil, facet_tags, SUPPORTS, degree=degree, solver=SOLVER)
    fem.solve(bridge.Load(unit_weight=WEIGHT))
    return fem


def moved(case: SlopeCase, since: np.ndarray) -> float:
    """Largest displacement of a particle since then [m]. Collective."""
    own = np.linalg.norm(case.model.particles.displacement - since, axis=1).max(initial=0.0)
    return case.model.comm.allreduce(float(own), MPI.MAX)


def at_rest(cell: float, degree: int) -> list[Check]:
    """Checks of a hand-over on the same cells: balance, no new yielding, no motion. Collective."""
    case = slope(cell)
    fem = finite_elements(case, degree)
    report = bridge.initialise(case.model, fem, count_displacement=False, equilibrate=False)
    scale = case.model.comm.allreduce(float(np.abs(fem.displacement.x.array).max()), MPI.MAX)
    list(case.model.explicit(REST, courant=0.5))
    name = "linear elements" if degree == 1 else "quadratic elements"
    drift = moved(case, np.zeros_like(case.model.particles.displacement)) / scale
    return [
        Check(f"out-of-balance ratio, {name}", 0.0, IDENTITY, report.unbalanced_ratio, 1e-8, scale=1.0,
              over="the external forces"),
        Check(f"motion in {REST:g} s without damping, {name}", 0.0, IDENTITY, drift, 1e-5, scale=1.0,
              over="the largest displacement of the elements"),
    ]  # fmt: skip


def raised(cell: float, steps: int) -> tuple[list[Check], np.ndarray, np.ndarray]:
    """Checks of the weight that rises after the hand-over, and both changes of shear stress [Pa]. Collective."""
    case = slope(cell)
    fem, model = finite_elements(case, 1), case.model
    bridge.initialise(model, fem, count_displacement=False, equilibrate=False)
    places, before = model.particles.position, model.particles.stress
    for number, weight in enumerate(np.linspace(WEIGHT, RAISED, steps + 1)[1:], 1):
        fem.equilibrate(bridge.Load(unit_weight=float(weight)))
        model.set_gravity((0.0, -GRAVITY * weight / WEIGHT))
        solver = mpm.Newton(tolerance=1e-10)
        list(model.implicit(float(number), dt=1.0, solver=solver, quasi_static=True, small_displacements=True))
    expected, found = fem.evaluate_at(places)["stress"] - before, model.particles.stress - before
    comm = model.comm
    apart, scale = (comm.allreduce(float(np.abs(a).max(initial=0.0)), MPI.MAX) for a in (found - expected, expected))
    check = Check(f"largest difference of stresses under {RAISED / 1e3:g} kN/m³", 0.0, IDENTITY,
                  apart, 1e-5, "Pa", scale=scale, over="the largest change of stress")  # fmt: skip
    yielded = comm.allreduce(int((model.particles.state[:, 0] > 0).sum())) / comm.allreduce(len(places))
    part = Check(
        "fraction of the particles that have yielded by then",
        0.02,
        "otherwise the case would be elastic",
        yielded,
        0.0,
        kind=Kind.AT_LEAST,
    )
    return [check, part], *(np.concatenate(comm.allgather(a[:, 3])) for a in (expected, found))


def other_mesh(cell: float) -> list[Check]:
    """Checks of a hand-over from quadratic elements on an unstructured mesh. Collective."""
    case = slope(cell)
    mesh = bridge.slope_mesh(MPI.COMM_WORLD, cell_size=cell, kind="gmsh")
    # Mixed integration gives cells other weights once the first step has moved their particles.
    report = bridge.initialise(
        case.model, finite_elements(case, 2, mesh), count_displacement=False, integration=mpm.Integration.PARTICLES
    )
    of_cells = "no yielding, up to the error of both meshes"
    return [
        Check(
            "out-of-balance ratio after a step without load, another mesh",
            0.0,
            "equilibrium of the particles",
            report.equilibrated_ratio,
            1e-5,
            scale=1.0,
            over="the external forces",
        ),
        Check(
            "fraction of the particles that yielded in this step",
            0.0,
            of_cells,
            report.yielded_fraction,
            0.1,
            scale=1.0,
            over="the number of particles",
        ),
    ]


def run(quick: bool, folder: Path) -> Result:
    cell = 0.1 if quick else 0.05
    checks = [*at_rest(cell, 1), *at_rest(cell, 2)]
    rising, expected, found = raised(cell, 4)
    checks += rising + other_mesh(cell)
    if MPI.COMM_WORLD.rank == 0:
        line = 1e-3 * np.array([expected.min(), expected.max()])
        labels = ("Change of shear stress, finite elements [kPa]", "Particles [kPa]")
        save_comparison(
            folder / "raised.png", {"particles": (1e-3 * expected, 1e-3 * found)}, {"equal": (line, line)}, labels
        )
    return Result(
        checks, {"raised.png": "Change of shear stresses as the weight rises from 16 to 19 kN/m³ after the hand-over"}
    )
