"""Thick-walled elastic cylinder as a half section of one radian: Lamé's solution, and the order of convergence of each method.

A ring from r = a to b = 2a lies between smooth plates under a pressure from inside. Finite elements with linear, averaged and
quadratic displacements are loaded by this pressure on the wall. Particles in quasi-static steps, on the nodes of linear
elements, are driven by the displacement of the wall, and their stresses are compared as means over rings as thick as a cell;
a pressure would act on the particles a third of a cell inside of the wall, which is an error of first order.
"""

import numpy as np
from _case import Check, Kind, Result
from _plots import save_comparison, save_refinement
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

INNER, OUTER, HEIGHT, PRESSURE = 1.0, 2.0, 0.25, 1.0  # m, m, m, Pa
YOUNG, POISSON = 1000.0, 0.3  # Pa, -
LAW = mpm.LinearElastic(young=YOUNG, poisson=POISSON)
WALL, OUTSIDE, BELOW, ABOVE = 1, 2, 3, 4
ELEMENTS = {
    "linear elements": ({"degree": 1}, 2),
    "averaged elements": ({"degree": 1, "nmd": True}, 2),
    "quadratic elements": ({"degree": 2}, 3),
}
"""Options, and order in which displacements should converge."""

# --- 1. Closed form: Lamé, in plane strain ----------------------------------------------------------------------------

MEAN = PRESSURE * INNER**2 / (OUTER**2 - INNER**2)


def displacement(r):
    return (1 + POISSON) / YOUNG * MEAN * ((1 - 2 * POISSON) * r + OUTER**2 / r)


def radial_stress(r):
    return MEAN * (1 - OUTER**2 / r**2)


def hoop_stress(r):
    return MEAN * (1 + OUTER**2 / r**2)


# --- 2. Finite elements and particles ---------------------------------------------------------------------------------


def ring(cells):
    """(domain, cell_tags, facet_tags) with some cells over the thickness."""
    rows = max(2, round(cells * HEIGHT / (OUTER - INNER)))
    mesh = bridge.box_mesh(MPI.COMM_WORLD, [OUTER - INNER, HEIGHT], [cells, rows])
    mesh[0].geometry.x[:, 0] += INNER
    return mesh


def nodal_error(comm, r, u):
    """Root mean square over the nodes of the error of the radial displacement, over that of the wall."""
    r, u = (np.concatenate(comm.allgather(part)) for part in (r, u))
    return float(np.sqrt(np.mean((u - displacement(r)) ** 2))) / displacement(INNER)


def element_error(cells, options):
    domain, _, facet_tags = ring(cells)
    plates = [bridge.roller(tag, (0, 1)) for tag in (BELOW, ABOVE)]
    fem = bridge.QuasiStatic(domain, LAW, facet_tags, plates, geometry=bridge.Geometry.AXISYMMETRIC, **options)
    fem.solve(bridge.Load(pressure={WALL: PRESSURE}))
    r = fem.displacement.function_space.tabulate_dof_coordinates()[:, 0]
    return nodal_error(domain.comm, r, fem.displacement.x.array.reshape(-1, 2)[:, 0])


def particles(cells, pressed):
    """Particles in equilibrium with the wall pressed, or moved by Lamé's displacement."""
    mesh = bridge.background_mesh(*ring(cells))
    model = mpm.Model(mesh, LAW, geometry=mpm.Geometry.AXISYMMETRIC)
    model.seed(density=2000.0, per_cell=3)
    for tag in (BELOW, ABOVE):
        model.roller(tag, (0, 1))
    if pressed:
        model.traction(WALL, (PRESSURE, 0.0))
    else:
        model.prescribe(WALL, (displacement(INNER), 0.0))
    list(model.implicit(1.0, dt=1.0, quasi_static=True, small_displacements=True))
    return model


def particle_error(model):
    return nodal_error(model.comm, model.mesh.points[:, 0], model.nodal("velocity")[:, 0])  # over one second


def ring_means(model, cells):
    """Radii of the middle of rings, and the means of radial and hoop stress there by volume."""
    p = model.particles
    rows = np.concatenate(
        model.comm.allgather(
            np.column_stack([p.position[:, 0], p.volume, p.volume * p.stress[:, 0], p.volume * p.stress[:, 2]])
        )
    )
    number = np.floor((rows[:, 0] - INNER) / (OUTER - INNER) * cells).astype(int)
    volume, radial, hoop = (np.bincount(number, rows[:, k], cells) for k in (1, 2, 3))
    return INNER + (np.arange(cells) + 0.5) * (OUTER - INNER) / cells, radial / volume, hoop / volume


def ring_mean(exact, r, cells):
    """Mean by volume of a closed form in rings as thick as a cell, by Gauss quadrature."""
    at, weights = np.polynomial.legendre.leggauss(4)
    places = r[:, None] + 0.5 * (OUTER - INNER) / cells * at
    return np.sum(exact(places) * places * weights, axis=1) / np.sum(places * weights, axis=1)


def order(errors):
    """Order by which the last error decreased when the cell size was halved."""
    return float(np.log2(errors[-2] / errors[-1]))


def run(quick: bool, folder) -> Result:
    # --- 3. Finer and finer ------------------------------------------------------------------------------------------
    sizes, checks = (4, 8, 16) if quick else (4, 8, 16, 32), []
    errors = {name: [element_error(n, options) for n in sizes] for name, (options, _) in ELEMENTS.items()}
    moved, pressed = ([particles(n, how) for n in sizes] for how in (False, True))
    errors["particles, wall moved"] = [particle_error(model) for model in moved]
    errors["particles, wall pressed"] = [particle_error(model) for model in pressed]
    stress_errors = {"radial": [], "hoop": []}
    for model, n in zip(moved, sizes):
        r, radial, hoop = ring_means(model, n)
        for name, got, exact in (("radial", radial, radial_stress), ("hoop", hoop, hoop_stress)):
            stress_errors[name].append(float(np.sqrt(np.mean((got - ring_mean(exact, r, n)) ** 2))) / PRESSURE)

    # --- 4. Against Lamé, and the order --------------------------------------------------------------------------------
    orders = {name: expected for name, (_, expected) in ELEMENTS.items()}
    orders |= {"particles, wall moved": 2, "particles, wall pressed": 1}
    for name, expected in orders.items():
        source = "Lamé, root mean square over the nodes"
        checks.append(Check(f"error of the displacement, {sizes[-1]} cells, {name}", 0.0, source, errors[name][-1],
                            0.02 if expected == 1 else 2e-3, scale=1.0, over="the wall's displacement"))  # fmt: skip
        source = (
            "approximation by linear or quadratic functions"
            if expected > 1
            else "the load acts a third of a cell inside the wall"
        )
        checks.append(
            Check(f"order of the displacement, {name}", expected, source, order(errors[name]), 0.15, kind=Kind.AT_LEAST)
        )
    for name, values in stress_errors.items():
        source = "Lamé, mean of each ring"
        checks.append(
            Check(
                f"error of the {name} stress, {sizes[-1]} cells, particles",
                0.0,
                source,
                values[-1],
                2e-3,
                scale=1.0,
                over="the pressure",
            )
        )
        checks.append(
            Check(
                f"order of the {name} stress, particles",
                2,
                "approximation by means over rings",
                order(values),
                0.15,
                kind=Kind.AT_LEAST,
            )
        )

    # --- 5. Pictures -------------------------------------------------------------------------------------------------
    r, radial, hoop = ring_means(moved[-2], sizes[-2])
    if MPI.COMM_WORLD.rank == 0:
        save_refinement(folder / "error.png", sizes, "Cells over the wall",
                        {"Error of the displacement": errors, "Error of the particles' stress": stress_errors})  # fmt: skip
        line = np.linspace(INNER, OUTER, 100)
        save_comparison(folder / "stress.png", {"radial, particles": (r, radial), "hoop, particles": (r, hoop)},
                        {"radial, Lamé": (line, radial_stress(line)), "hoop, Lamé": (line, hoop_stress(line))},
                        ("Radius $r$ [m]", "Stress over the pressure [-]"))  # fmt: skip
    return Result(checks, {
        "error.png": "Errors over the number of cells: finite elements, and particles whose wall is moved or pressed",
        "stress.png": "Means of the particles' stresses in rings as thick as a cell, and Lamé's solution",
    })  # fmt: skip
