"""Manufactured solutions: order of accuracy in space (finite elements, particles) and in time (explicit, implicit).

A displacement is chosen, and the body force that belongs to it is applied. The error in space is found with u = A sin(πx)
sin(πy) (1, -1/2) on a square that is fixed on all sides, by linear and quadratic finite elements and by one quasi-static step
of particles that are evenly distributed in each cell. The error in time is found for a triangle with one particle, whose
equation of motion is known exactly and whose load makes it move by u = A (1 - cos ωt)².
"""

import numpy as np
from _case import Check, Kind, Result
from common.field_plots import save_log_log
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

YOUNG, POISSON, DENSITY = 1e6, 0.3, 1000.0
LAME, SHEAR = YOUNG * POISSON / ((1 + POISSON) * (1 - 2 * POISSON)), YOUNG / (2 * (1 + POISSON))
AMPLITUDE = 1e-9  # m: strains so small that the motion of particles does not count
RATIO = -0.5
"""Ratio of the second to the first component of the displacement."""


# --- 1. The solution in space, its stress and its body force -------------------------------------------------------


def displacement(x):
    both = AMPLITUDE * np.sin(np.pi * x[0]) * np.sin(np.pi * x[1])
    return np.array([both, RATIO * both])


def stress(x):
    """(xx, yy, zz, xy), rows of points (4, n)."""
    cs, sc = np.cos(np.pi * x[0]) * np.sin(np.pi * x[1]), np.sin(np.pi * x[0]) * np.cos(np.pi * x[1])
    xx, yy, xy = cs, RATIO * sc, sc + RATIO * cs
    trace = LAME * (xx + yy)
    return AMPLITUDE * np.pi * np.array([trace + 2 * SHEAR * xx, trace + 2 * SHEAR * yy, trace, SHEAR * xy])


def body_force(x):
    """-div σ = -(λ + G) grad div u - G Δu, (2, n) [N/m3]."""
    ss, cc = np.sin(np.pi * x[0]) * np.sin(np.pi * x[1]), np.cos(np.pi * x[0]) * np.cos(np.pi * x[1])
    div_x, div_y = -ss + RATIO * cc, cc - RATIO * ss  # grad div u over A π²
    laplace = np.array([-2 * ss, -2 * RATIO * ss])
    return -AMPLITUDE * np.pi**2 * ((LAME + SHEAR) * np.array([div_x, div_y]) + SHEAR * laplace)


# --- 2. Errors in space: root mean square over points, relative ----------------------------------------------------


def relative(error, exact):
    return float(np.sqrt((error**2).sum() / (exact**2).sum()))


def by_finite_elements(n, degree):
    domain, _, facet_tags = bridge.box_mesh(MPI.COMM_SELF, [1.0, 1.0], [n, n])
    supports = [bridge.fixed(tag) for tag in (1, 2, 3, 4)]
    solution = bridge.solve_elastic(domain, facet_tags, supports, YOUNG, POISSON, 0.0, degree, body_force=body_force)
    points = np.random.default_rng(1).random((4000, 2))
    found = solution.evaluate_at(points)
    return (relative(found["displacement"] - displacement(points.T).T, displacement(points.T)),
            relative(found["stress"] - stress(points.T).T, stress(points.T)))  # fmt: skip


def by_particles(n):
    mesh = bridge.background_mesh(*bridge.box_mesh(MPI.COMM_SELF, [1.0, 1.0], [n, n]))
    model = mpm.Model(mesh, mpm.LinearElastic(young=YOUNG, poisson=POISSON))
    model.seed(density=DENSITY, per_cell=6)
    for tag in (1, 2, 3, 4):
        model.fix(tag)
    x, p = model.particles.position, model.particles
    model.particles.set("traction", body_force(x.T).T * p.volume[:, None])
    list(model.implicit(1.0, dt=1.0, quasi_static=True))
    x = p.initial_position
    return relative(p.displacement - displacement(x.T).T, displacement(x.T)), relative(
        p.stress - stress(x.T).T, stress(x.T)
    )


# --- 3. Errors in time: the particle of one triangle, driven -------------------------------------------------------


def by_steps(steps, scheme):
    """Largest error of the stress over its largest value."""
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    mesh = mpm.Mesh(corners, [[0, 1, 2]], facets=[[1, 2], [0, 2], [0, 1]], facet_tags=[1, 2, 3], comm=MPI.COMM_SELF)
    model = mpm.Model(mesh, mpm.LinearElastic(young=YOUNG, poisson=POISSON))
    model.seed(density=DENSITY, per_cell=1)
    model.fix(3)
    model.roller(2, (1, 0))  # only the vertex at (0, 1) moves, along y, with the velocity of the particle
    modulus, weight = LAME + 2 * SHEAR, 1 / 3  # weight: shape function of that vertex at the particle
    volume, mass = float(model.particles.volume[0]), float(model.particles.mass[0])
    period = 2 * np.pi * np.sqrt(DENSITY / modulus)
    omega, dt, errors = 2 * np.pi / (1.7 * period), period / steps, []
    for k in range(steps):
        at = dt * (k if scheme == "explicit" else k + 1)  # forces act at the start, or at the end, of a step
        c = np.cos(omega * at)
        u, acceleration = AMPLITUDE * (1 - c) ** 2, 2 * AMPLITUDE * omega**2 * ((1 - c**2) + (1 - c) * c)
        model.particles.set("traction", [[0.0, (mass * acceleration + volume * modulus * u) / weight]])
        options = {"dt": dt, "allow_unstable": True} if scheme == "explicit" else {"dt": dt}
        list(getattr(model, scheme)(dt * (k + 1), **options))
        exact = modulus * AMPLITUDE * (1 - np.cos(omega * dt * (k + 1))) ** 2
        errors.append(abs(model.particles.stress[0, 1] - exact) / (4 * modulus * AMPLITUDE))
    return max(errors)


# --- 4. Orders -----------------------------------------------------------------------------------------------------


def run(quick: bool, folder) -> Result:
    counts = [8, 16] if quick else [8, 16, 32, 64]
    steps = [256, 512] if quick else [64, 128, 256, 512, 1024]
    checks, in_space, in_time = [], {}, {}
    cases = {"linear elements": (lambda n: by_finite_elements(n, 1), 1), "particles": (by_particles, 1),
             "quadratic elements": (lambda n: by_finite_elements(n, 2), 2)}  # fmt: skip
    for name, (solve, degree) in cases.items():
        errors = np.array([solve(n) for n in counts])
        for column, (quantity, order) in enumerate((("displacement", degree + 1), ("stress", degree))):
            found = np.log2(errors[-2, column] / errors[-1, column])
            checks.append(Check(f"order in space of the {quantity}, {name}", order, f"interpolation of degree {degree}",
                                found, 0.1, kind=Kind.AT_LEAST))  # fmt: skip
            in_space.setdefault(quantity, {})[name] = errors[:, column]
    for scheme, order in (("explicit", 2), ("implicit", 1)):
        errors = [by_steps(n, scheme) for n in steps]
        source = "second order of central differences" if scheme == "explicit" else "first order of backward Euler"
        found = np.log2(errors[-2] / errors[-1])
        checks.append(Check(f"order in time, {scheme}", order, source, found, 0.1, kind=Kind.AT_LEAST))
        in_time[scheme] = errors

    # --- 5. Pictures ------------------------------------------------------------------------------------------------
    if MPI.COMM_WORLD.rank == 0:
        for quantity, slope in (("displacement", 2.0), ("stress", 1.0)):
            save_log_log(folder / f"{quantity}.png", [1 / n for n in counts], in_space[quantity],
                         f"Relative error of the {quantity} [-]", slope=slope)  # fmt: skip
        save_log_log(folder / "time.png", [1 / n for n in steps], in_time, "Largest error of the stress, relative [-]",
                     axis="Time step over the natural period [-]")  # fmt: skip
    return Result(checks, {
        "displacement.png": "Displacement of a manufactured solution: error over the cell size",
        "stress.png": "Stress of a manufactured solution: error over the cell size",
        "time.png": "A driven particle: error over the time step",
    })  # fmt: skip
