"""Soil and pore water with separate velocities, by explicit steps: waves, consolidation, critical gradient.

A saturated column stands on a fixed base between rollers. Without drag it oscillates in its first mode by either of the two
compression waves (Verruijt, Soil Dynamics, 2010, section 5): det(K - c² M) = 0 with K = [E + (1-n)² K_w/n, (1-n) K_w; (1-n)
K_w, n K_w] and M = diag((1-n) rho_s, n rho_w). With large drag soil and water move together, and a load travels through the
column as one front; the implicit scheme, in which water and soil have one velocity, must give this wave too. Slow
consolidation follows Terzaghi's theory with the coefficient of consolidation for compressible water, c_v = k / gamma_w / (1/E
+ n/K_w). With strains averaged over nodes (NMD), the averaged pressures are compared, which are those that act.
"""

import numpy as np
from _case import Check, Kind, Result
from _plots import save_comparison
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water

HEIGHT, LOAD, GRAVITY, UNIT_WEIGHT = 1.0, 10e3, 9.81, 9810.0  # m, Pa, m/s2, N/m3
POROSITY, GRAINS, WATER = 0.4, 2650.0, 1000.0  # -, kg/m3
DENSITY = (1 - POROSITY) * GRAINS + POROSITY * WATER
SOIL = mpm.LinearElastic(young=10e6, poisson=0.3)
OEDOMETER = SOIL.p_wave_modulus
BASE, TOP = 3, 4
COMM = MPI.COMM_WORLD


def column(cells, conductivity, modulus, law=SOIL, headroom=0.0):
    """The column, two cells wide, under empty cells up to a headroom [m]."""
    size = HEIGHT / cells
    rows = cells + round(headroom / size)
    mesh = bridge.box_mesh(
        COMM, (2 * size, rows * size), (2, rows), body=((0.0, 0.0), (2 * size, HEIGHT)) if headroom else None
    )
    model = mpm.Model(bridge.background_mesh(*mesh), law)
    model.seed(density=DENSITY, per_cell=3, cell_tag=bridge.BODY if headroom else None)
    model.roller(1, (1, 0))
    model.roller(2, (1, 0))
    model.fix(BASE)
    model.add_water(porosity=POROSITY, conductivity=conductivity, modulus=modulus)
    return model


def gathered(model, *names):
    """Fields of all particles, on all ranks."""
    parts = COMM.allgather([getattr(model.particles, name) for name in names])
    return [np.concatenate([part[k] for part in parts]) for k in range(len(names))]


def cell_pressures(model, averaged):
    """Heights of the centres of all cells [m], and the means of their particles' pore pressures [Pa], by height: (n,) each.

    The pressure follows from the volume of a cell, which has one strain, so that it is that of its centre. Where strains are
    averaged, so are the pressures that act.
    """
    p, acting = model.particles, model.averaged_pore_pressure()
    _, cell, count = np.unique(p.cell, return_inverse=True, return_counts=True)
    pressure = acting if averaged else p.pore_pressure
    means = np.array([np.bincount(cell, values) / count for values in (p.position[:, 1], pressure)])
    heights, pressures = np.concatenate(COMM.allgather(means), axis=1)
    order = np.argsort(heights)
    return heights[order], pressures[order]


def modes(modulus):
    """Speeds of the slow and the fast wave without drag [m/s], and their velocities (v, w) in columns."""
    n = POROSITY
    coupling = (1 - n) * modulus
    stiffness = np.array([[OEDOMETER + (1 - n) ** 2 * modulus / n, coupling], [coupling, n * modulus]])
    masses = np.array([(1 - n) * GRAINS, n * WATER])
    squared, shapes = np.linalg.eigh(stiffness / np.sqrt(np.outer(masses, masses)))
    return np.sqrt(squared), shapes / np.sqrt(masses)[:, None]


def speed_of_swing(cells, modulus, which):
    """4 H / T of the first mode [m/s], the period T from two zeros of the momentum."""
    speeds, shapes = modes(modulus)
    model = column(cells, 1e3, modulus)
    model.explicit(1e-9).last()
    p = model.particles
    shape = 1e-4 * np.sin(0.5 * np.pi * p.position[:, 1] / HEIGHT)
    p.set("velocity", np.column_stack([0 * shape, shapes[0, which] * shape]))
    p.set("water_velocity", np.column_stack([0 * shape, shapes[1, which] * shape]))
    rows = [(report.time, report.momentum[1]) for report in model.explicit(4.2 / speeds[which], every_steps=1)]
    return 2 * HEIGHT / zero_spacing(*np.array(rows).T)


def implicit_waves(speed, quick):
    """Waves by implicit particles: speed of the first mode, less the error of backward Euler; pressure behind a front over q."""
    model = column(20, 1e-12, 2.2e8)
    height = model.particles.position[:, 1]
    model.particles.set("velocity", np.column_stack([0 * height, 1e-4 * np.sin(0.5 * np.pi * height / HEIGHT)]))
    dt = 4 * HEIGHT / speed / 400
    steps = model.implicit(3.2 * HEIGHT / speed, dt=dt, every_steps=1)
    times, momentum = np.array([(report.time, report.momentum[1]) for report in steps]).T
    turned = 2 * np.pi / 400  # of the mode in a step; backward Euler turns it by arctan
    found = 2 * HEIGHT / zero_spacing(times, momentum) * turned / np.arctan(turned)

    model = column(50 if quick else 100, 1e-12, 2.2e8)
    model.traction(TOP, (0.0, -LOAD))
    model.implicit(0.6 * HEIGHT / speed, dt=0.6 * HEIGHT / speed / 120).last()
    x, p = gathered(model, "position", "pore_pressure")
    behind = (x[:, 1] > 0.65) & (x[:, 1] < 0.95)
    return found, p[behind].mean() / LOAD


def pressure_behind_front(element, cells):
    """Mean pore pressure behind a front in undrained soil over the load, by finite elements with inertia."""
    size, stiff = HEIGHT / cells, 2.2e8 / POROSITY
    domain, _, facet_tags = bridge.box_mesh(COMM, (size, HEIGHT), (1, cells))
    soil = water.PorousSoil(1e-12, porosity=POROSITY, density=DENSITY)
    supports = [bridge.roller(1, (1, 0)), bridge.roller(2, (1, 0)), bridge.fixed(BASE)]
    model = water.Consolidation(
        domain, SOIL, soil, facet_tags, supports, [], load=bridge.Load(pressure={TOP: LOAD}), element=element,
        water_modulus=2.2e8, inertia=water.Newmark(),
    )  # fmt: skip
    end = 0.6 * HEIGHT / np.sqrt((OEDOMETER + stiff) / DENSITY)
    for _ in range(120):
        report = model.advance(end / 120)
        if not report.converged:
            raise mpm.RunError(f"the step from {model.time:g} s did not converge: {report.reason}")
    height = np.linspace(0.65, 0.95, 31)
    return model.evaluate_at(np.column_stack([np.full(31, 0.5 * size), height]))["pressure"].mean() / LOAD


def zero_spacing(times, values):
    """Between the first two zeros of a swing."""
    k = np.flatnonzero(values[:-1] * values[1:] < 0)[:2]
    return np.diff(times[k] - values[k] * (times[k + 1] - times[k]) / (values[k + 1] - values[k]))[0]


def terzaghi(z, factor):
    m = np.pi * (np.arange(200) + 0.5)
    return np.sin(m * (1 - z / HEIGHT)[:, None]) @ (2 / m * np.exp(-(m**2) * factor))


def run(quick: bool, folder) -> Result:
    checks, curves, exact = [], {}, {}

    # --- 1. Both waves without drag ----------------------------------------------------------------------------------
    modulus = 2.2e8
    for which, name in ((0, "slow"), (1, "fast")):
        speed = modes(modulus)[0][which]
        found = speed_of_swing(20 if quick else 40, modulus, which)
        checks.append(Check(f"speed of the {name} wave", speed, "det(K - c² M) = 0", found, 0.01, "m/s"))

    # --- 2. A front in undrained soil ---------------------------------------------------------------------------------
    stiff = modulus / POROSITY
    undrained, ratio = np.sqrt((OEDOMETER + stiff) / DENSITY), stiff / (OEDOMETER + stiff)
    model = column(100 if quick else 200, 1e-8, modulus)
    model.traction(TOP, (0.0, -LOAD))
    fronts = []
    for part in (0.3, 0.7):
        model.explicit(part * HEIGHT / undrained, nmd=True).last()
        x, p = gathered(model, "position", "pore_pressure")
        z = x[:, 1]
        fronts.append(1 - z[p > 0.5 * ratio * LOAD].min())
    behind = (z > 0.5) & (z < 0.85)
    speed = (fronts[1] - fronts[0]) / 0.4 * undrained
    swing, pressure = implicit_waves(undrained, quick)
    checks.append(Check("speed of the first mode, undrained", undrained, "√((E + K_w/n) / ρ)", swing, 0.01, "m/s",
                        method="particles, implicit"))  # fmt: skip
    checks.append(Check("pore pressure behind a front over the load", ratio, "K_w/n / (E + K_w/n)", pressure, 0.02,
                        method="particles, implicit"))  # fmt: skip
    for name, element in (("P2-P1", water.Element.TAYLOR_HOOD), ("P1-P1", water.Element.STABILISED)):
        pressure = pressure_behind_front(element, 50 if quick else 100)
        checks.append(Check("pore pressure behind a front over the load", ratio, "K_w/n / (E + K_w/n)", pressure, 0.02,
                            method=name))  # fmt: skip
    checks.append(Check("speed of the front, undrained", undrained, "√((E + K_w/n) / ρ)", speed, 0.02, "m/s"))
    checks.append(
        Check("pore pressure behind it over the load", ratio, "K_w/n / (E + K_w/n)", p[behind].mean() / LOAD, 0.01)
    )

    # --- 3. Consolidation, from the undrained equilibrium --------------------------------------------------------------
    modulus, conductivity = 2.2e7, 2e-4
    stiff = modulus / POROSITY
    first = LOAD * stiff / (OEDOMETER + stiff)
    c_v = conductivity / UNIT_WEIGHT / (1 / OEDOMETER + 1 / stiff)
    for nmd in (False, True):
        model = column(20, conductivity, modulus)
        model.traction(TOP, (0.0, -LOAD))
        model.set_pore_pressure(first)
        stress = (first - LOAD) * np.array([3 / 7, 1.0, 3 / 7, 0.0])
        model.particles.set("stress", np.tile(stress, (len(model.particles), 1)))
        for factor in (0.05, 0.1, 0.2, 0.5):
            model.explicit(factor * HEIGHT**2 / c_v, nmd=nmd).last()
            height, p = cell_pressures(model, averaged=nmd)
            expected = first * terzaghi(height, factor)
            worst = np.argmax(np.abs(p - expected))
            checks.append(Check(f"pore pressure over the load, worst cell, T = {factor:g}", expected[worst] / LOAD,
                                "Terzaghi 1925", p[worst] / LOAD, 0.02, scale=1.0, over="the load",
                                method="explicit, NMD" if nmd else "explicit"))  # fmt: skip
            if not nmd:
                curves[f"$T = {factor:g}$"] = (p / LOAD, height)
                line = np.linspace(0, HEIGHT, 101)
                exact[f"Terzaghi, $T = {factor:g}$"] = (first * terzaghi(line, factor) / LOAD, line)

    # --- 4. Flow upwards through sand without cohesion: rest below the critical gradient, lift-off above ---------------
    critical = (GRAINS / WATER - 1) * (1 - POROSITY)
    sand = mpm.MohrCoulomb(young=10e6, poisson=0.3, cohesion=0.0, friction_angle=30.0, dilation_angle=0.0)
    for fraction in (0.9, 1.1):
        model = column(10, 1e-2, 2.2e7, law=sand, headroom=0.5)
        model.set_gravity((0.0, -GRAVITY))
        head = UNIT_WEIGHT * HEIGHT * (1 + fraction * critical)
        model.hold_pore_pressure(BASE, head, presses=False)
        p = model.particles
        model.set_pore_pressure(lambda x, head=head: head * (1 - x[:, 1] / HEIGHT))
        vertical = min(0.0, fraction - 1) * critical * UNIT_WEIGHT * (HEIGHT - p.position[:, 1])
        p.set("stress", vertical[:, None] * np.array([0.5, 1.0, 0.5, 0.0]))
        model.explicit(0.2, nmd=True).last()
        rise = gathered(model, "displacement")[0][:, 1].mean()
        name = f"mean rise in 0.2 s at {fraction:g} of the critical gradient"
        kind, bound = (Kind.AT_MOST, 0.2) if fraction < 1 else (Kind.AT_LEAST, 2.0)
        source = "(G_s - 1) (1 - n): at rest below, lifts off above"
        checks.append(Check(name, bound, source, 1e3 * rise, 0.0, "mm", kind=kind))

    # --- 5. Picture ----------------------------------------------------------------------------------------------------
    if COMM.rank == 0:
        save_comparison(folder / "pressure.png", curves, exact, ("Pore pressure over load [-]", "Height over $H$ [-]"))
    return Result(
        checks, {"pressure.png": "Pore pressure of the cells of a column that consolidates, by explicit steps"}
    )
