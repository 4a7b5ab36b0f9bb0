"""Unsaturated soil: drainage of a sand column (Liakopoulos), and steady rain above a water table.

In the experiment of Liakopoulos (1965) water first seeped through a column of Del Monte sand, 1 m high, under its weight
alone; then the inflow at the top was closed, and the column drained at its base. Its retention curve and relative permeability
are S = 1 - 1.9722e-11 s^2.4279 (suction s in Pa) and k_r = 1 - 2.207 (1 - S)^1.0121; k = 4.41e-6 m/s, n = 0.2975, and, as is
customary, E = 1.3 MPa and ν = 0.4 (Lewis and Schrefler 1998). The expected values are those of OpenGeoSys with quadratic
displacement, linear pressure and lumped storage, whose test RichardsMechanics/LiakopoulosHM gives the smallest pressure and
the largest displacement after 600 and 7,200 s. Both programs use backward Euler with the same time steps. The air stays at
atmospheric pressure, and effective stresses are defined after Bishop.

Steady rain of half the conductivity above a water table, with k_r = e^(αψ), has a closed form (Gardner 1958; Srivastava and
Yeh 1991). In the computation with particles the rain falls on their free surface.
"""

from __future__ import annotations

import numpy as np
from _case import Check, Result
from _plots import save_comparison
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water

comm = MPI.COMM_WORLD
GRAVITY, WATER = 9.81, 9810.0  # m/s2, N/m3
LEFT, RIGHT, BASE, TOP = 1, 2, 3, 4
METHODS = {water.Element.TAYLOR_HOOD: "P2-P1", water.Element.STABILISED: "P1-P1"}
POROSITY, CONDUCTIVITY = (
    0.2975,
    4.5e-13 * WATER / 1e-3,
)  # -, m/s from an intrinsic permeability [m2] and a viscosity [Pa s]
STEPS = ((1, 0.06), (9, 1), (5, 10), (1, 0.94), (3, 10), (1, 30), (1, 100), (1, 80), (9, 100), (2, 200), (3, 400), (3, 600),
         (1, 200), (3, 600), (1, 0.06), (9, 1), (5, 10), (1, 0.94), (3, 10), (1, 30), (1, 100), (1, 80), (3, 100))  # fmt: skip
"""Numbers of steps and their lengths [s]"""
PUBLISHED = {600: (-5170.6, -0.76202), 7200: (-9171.7, -1.54702)}
"""Pressure [Pa] and displacement [mm] of the top, by time [s]"""


def del_monte_sand():
    """Points of the measured curves, joined; closer ones where the sand is nearly full."""
    dry = (1 / 1.9722e-11) ** (1 / 2.4279)
    suction = np.concatenate([[0.0], np.linspace(250.0, 12e3, 48), [dry]])
    saturation = np.clip(1 - 1.9722e-11 * suction**2.4279, 0.0, 1.0)
    permeability = np.maximum(1 - 2.207 * (1 - saturation) ** 1.0121, 0.0)
    saturation[-1] = 0.0
    return water.Tabulated(tuple(suction), tuple(saturation), tuple(permeability))


def column(element, cells, law, soil, boundary, weight):
    """A column 1 m high and 0.1 m wide between rollers."""
    domain, _, facet_tags = bridge.box_mesh(comm, (0.1, 1.0), (2, cells))
    held = [bridge.roller(LEFT, (1, 0)), bridge.roller(RIGHT, (1, 0)), bridge.fixed(BASE)]
    return water.Consolidation(domain, law, soil, facet_tags, held, boundary, load=bridge.Load(unit_weight=weight),
                               element=element, unit_weight=WATER, water_modulus=2e9)  # fmt: skip


def at(model, points):
    """Displacements [m] and pressures [Pa] at points, on all ranks."""
    own = np.asarray(points) if comm.rank == 0 else np.empty((0, 2))
    there = model.evaluate_at(own)
    return comm.bcast((there["displacement"], there["pressure"][:, 0]))


def drainage(element, cells):
    """Checks; suctions over the height at times, and the outflow over time."""
    name, weight = METHODS[element], ((1 - POROSITY) * 2000.0 + POROSITY * 1000.0) * GRAVITY
    soil = water.PorousSoil(CONDUCTIVITY, porosity=POROSITY, retention=del_monte_sand())
    law = mpm.LinearElastic(young=1.3e6, poisson=0.4)
    model = column(element, cells, law, soil, [water.Head(BASE, 0.0)], weight)
    stress = np.zeros_like(model.points.stress)
    stress[:, 1] = -weight * (1.0 - model.points.coordinates()[:, 1])
    model.initialise(stress, lambda x: 0.0 * x[:, 0])  # water under atmospheric pressure seeps with the gradient 1
    heights, profiles, checks = np.linspace(0.0, 1.0, 21), {}, []
    for count, dt in STEPS:
        for _ in range(count):
            report = model.advance(dt)
            if not report.converged:
                raise mpm.RunError(f"no equilibrium in the step from {model.time:.4g} s: {report.reason}")
            time = round(model.time)
            if abs(model.time - time) < 1e-6 and time in (300, 600, 1200, 7200):
                moved, pressure = at(model, np.column_stack([np.full(21, 0.05), heights]))
                profiles[f"{time / 60:g} min, {name}"] = pressure / 1e3, heights
            if abs(model.time - time) < 1e-6 and time in PUBLISHED:
                published, moved_there = PUBLISHED[time]
                checks.append(Check(f"pressure of the water at the top after {time} s", published / 1e3, "OpenGeoSys",
                                    pressure[-1] / 1e3, 0.01, "kPa", method=name))  # fmt: skip
                checks.append(Check(f"displacement of the top after {time} s", moved_there, "OpenGeoSys",
                                    1e3 * moved[-1, 1], 0.01, "mm", method=name))  # fmt: skip
                checks.append(Check(f"error of the water balance of the step to {time} s, over the volume of the pores", 0.0,
                                    "conservation of the water's volume",
                                    report.water_error / (0.1 * POROSITY), 1e-8, scale=1.0,
                                    over="the volume of the pores", method=name))  # fmt: skip
    return checks, profiles


def rain(element, cells):
    part, alpha = 0.5, 2.0  # of the conductivity; 1/m
    soil = water.PorousSoil(1e-5, porosity=0.4, retention=water.Gardner(alpha / WATER))
    boundary = [water.Head(BASE, 0.0), water.Flux(TOP, part * 1e-5)]
    model = column(element, cells, mpm.LinearElastic(young=5e6, poisson=0.3), soil, boundary, 20e3)
    report = model.run(1e8, 100.0, growth=2.0)[-1]
    if not report.converged:
        raise mpm.RunError(f"no steady rain was found: {report.reason}")
    heights = np.array([0.25, 0.5, 1.0])
    found = alpha * at(model, np.column_stack([np.full(3, 0.05), heights]))[1] / WATER
    exact = np.log(part + (1 - part) * np.exp(-alpha * heights))
    return [
        Check(f"steady rain, α times the pressure head at α z = {alpha * z:g}", e, "ln(r + (1 - r) exp(-α z))", f, 0.005,
              method=METHODS[element])
        for z, e, f in zip(heights, exact, found)
    ]  # fmt: skip


def particles(cells, law, porosity, conductivity, curve, weight, air=0):
    """The column as particles, with rows of empty cells above it."""
    size = 1.0 / cells
    domain, cell_tags, facet_tags = bridge.box_mesh(
        comm, (0.1, 1.0 + air * size), (2, cells + air), body=((0.0, 0.0), (0.1, 1.0))
    )
    model = mpm.Model(bridge.background_mesh(domain, cell_tags, facet_tags), law)
    model.seed(density=weight / GRAVITY, per_cell=3, cell_tag=bridge.BODY)
    model.roller(LEFT, (1, 0))
    model.roller(RIGHT, (1, 0))
    model.fix(BASE)
    model.set_gravity((0.0, -GRAVITY))
    model.add_water(
        porosity=porosity,
        conductivity=conductivity,
        modulus=np.inf,
        retention=curve,
        drained_surface=air > 0,
    )
    model.hold_pore_pressure(BASE, 0.0)
    stress = np.zeros_like(model.particles.stress)
    stress[:, 1] = -weight * (1.0 - model.particles.position[:, 1])
    model.particles.set("stress", stress)
    return model


def line_at(model, values, heights):
    """Values of particles at heights, from straight lines through those of a layer of 0.1 m around each, on all ranks."""
    y = np.concatenate(comm.allgather(model.particles.position[:, 1]))
    values = np.concatenate(comm.allgather(values))
    lines = [np.polyfit(y[near] - h, values[near], 1) for h in heights for near in [np.abs(y - h) < 0.05]]
    return np.array([line[1] for line in lines])


def march(model, dt):
    """A step."""
    for _ in model.implicit(model.time + dt, dt=dt, quasi_static=True):
        pass


def drainage_of_particles(cells):
    """The checks of the column by particles."""
    weight = ((1 - POROSITY) * 2000.0 + POROSITY * 1000.0) * GRAVITY
    law = mpm.LinearElastic(young=1.3e6, poisson=0.4)
    model, checks, name = particles(cells, law, POROSITY, CONDUCTIVITY, del_monte_sand(), weight), [], "particles"
    for count, dt in STEPS:
        for _ in range(count):
            held, entered = model.water_volume(), model.water_inflow()
            march(model, dt)
            time = round(model.time)
            if abs(model.time - time) < 1e-6 and time in PUBLISHED:
                published, moved_there = PUBLISHED[time]
                pressure, moved = (line_at(model, values, [1.0])[0] for values in
                                   (model.particles.pore_pressure, model.particles.displacement[:, 1]))  # fmt: skip
                checks.append(Check(f"pressure of the water at the top after {time} s", published / 1e3, "OpenGeoSys",
                                    pressure / 1e3, 0.01, "kPa", method=name))  # fmt: skip
                checks.append(Check(f"displacement of the top after {time} s", moved_there, "OpenGeoSys",
                                    1e3 * moved, 0.01, "mm", method=name))  # fmt: skip
                error = model.water_volume() - held - (model.water_inflow() - entered)
                checks.append(Check(f"error of the water balance of the step to {time} s, over the volume of the pores", 0.0,
                                    "conservation of the water's volume", error / (0.1 * POROSITY), 1e-8, scale=1.0,
                                    over="the volume of the pores", method=name))  # fmt: skip
    return checks


def rain_on_particles(cells):
    part, alpha = 0.5, 2.0
    law = mpm.LinearElastic(young=5e6, poisson=0.3)
    model = particles(cells, law, 0.4, 1e-5, water.Gardner(alpha / WATER), 20e3, air=2)
    model.rain(part * 1e-5)
    dt = 100.0
    while model.time < 1e7:
        march(model, dt)
        dt *= 2
    heights = np.array([0.25, 0.5, 1.0])
    found = alpha * line_at(model, model.particles.pore_pressure, heights) / WATER
    exact = np.log(part + (1 - part) * np.exp(-alpha * heights))
    return [
        Check(f"steady rain, α times the pressure head at α z = {alpha * z:g}", e, "ln(r + (1 - r) exp(-α z))", f, 0.005,
              method="particles")
        for z, e, f in zip(heights, exact, found)
    ]  # fmt: skip


def run(quick: bool, folder) -> Result:
    checks, profiles = [], {}
    for element in METHODS:
        found, curves = drainage(element, 20 if quick else 40)
        checks, profiles = checks + found + rain(element, 20 if quick else 40), profiles | curves
    checks += drainage_of_particles(20 if quick else 40) + rain_on_particles(20 if quick else 40)
    if comm.rank == 0:
        shown = {name: curve for name, curve in profiles.items() if "P1-P1" in name}
        rest = {"at rest in the end": (np.array([0.0, -WATER / 1e3]), np.array([0.0, 1.0]))}
        save_comparison(folder / "pressure.png", shown, rest, ("Pressure of the water [kPa]", "Height [m]"))
    return Result(checks, {"pressure.png": "Pressure of the water in Liakopoulos's column as it drains"})
