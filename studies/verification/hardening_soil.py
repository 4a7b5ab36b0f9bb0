"""Hardening Soil: drained triaxial tests, and the settlement of level ground in first loading and in unloading.

Triaxial tests are those of a point, whose cap is so large that the soil hardens by shear alone. The ground, 10 m of sand, is at
rest with K0 = 1 - sin(phi) under its weight, and then carries a load at its surface that rises and falls again. The methods are
quadratic finite elements, and particles in quasi-static stages.
"""

import numpy as np
from _case import Check, Result
from _level_ground import HEIGHT, WIDTH, ground
from _plots import save_comparison
from mpi4py import MPI
from scipy.integrate import quad

import fenics_bridge as bridge
import mpm_core as mpm

REFERENCE, EXPONENT, FAILURE_RATIO, POISSON = 100e3, 0.5, 0.9, 0.2  # Pa, -, -, -
SECANT, OEDOMETER, UNLOADING, FRICTION = 30e6, 30e6, 90e6, 35.0  # Pa, degrees
PRESSURES = (50e3, 100e3, 200e3)  # Pa, of triaxial tests
UNIT_WEIGHT = 20e3  # N/m3
LOADS = (50e3, 100e3, 150e3, 200e3, 150e3, 100e3)  # Pa, at the surface of the ground
TOP = "top"
K0 = 1 - np.sin(np.radians(FRICTION))


def sand():
    return mpm.HardeningSoil(
        secant_modulus=SECANT, oedometer_modulus=OEDOMETER, unloading_modulus=UNLOADING, cohesion=0.0,
        friction_angle=FRICTION, exponent=EXPONENT, poisson=POISSON, failure_ratio=FAILURE_RATIO,
    )  # fmt: skip


# --- 1. Closed forms: Schanz, Vermeer, Bonnier (1999), eqs. (1) to (4); (3) integrated in the oedometer -------------


def axial_strain(q, pressure):
    """Hyperbola of a drained triaxial test: q / (E_i (1 - R_f q / q_f)), where q_f / 2 has the secant modulus."""
    factor = (pressure / REFERENCE) ** EXPONENT
    strength = 2 * np.sin(np.radians(FRICTION)) / K0 * pressure
    return q * (2 - FAILURE_RATIO) / (2 * SECANT * factor * (1 - FAILURE_RATIO * q / strength))


def first_settlement(load, depth):
    """At a depth, in first loading: the strain is (s^(1-m)) reference^m / ((1 - m) Eoed), with s the vertical stress."""
    power = 2 - EXPONENT
    scale = REFERENCE**EXPONENT / ((1 - EXPONENT) * power * OEDOMETER * UNIT_WEIGHT)
    bottom, here = UNIT_WEIGHT * HEIGHT, UNIT_WEIGHT * depth
    return scale * ((bottom + load) ** power - (here + load) ** power - bottom**power + here**power)


def rise(load, depth):
    """At a depth, from the largest load to another one: elastic, with s3 less nu / (1 - nu) of what s1 loses."""
    lost, per_vertical = max(LOADS) - load, POISSON / (1 - POISSON)
    constrained = UNLOADING * (1 - POISSON) / ((1 + POISSON) * (1 - 2 * POISSON))

    def strain(z):
        most = K0 * (UNIT_WEIGHT * z + max(LOADS))
        power = 1 - EXPONENT
        integral = (most**power - (most - per_vertical * lost) ** power) / (power * per_vertical)
        return REFERENCE**EXPONENT / constrained * integral

    return quad(strain, depth, HEIGHT)[0]


PEAK = LOADS.index(max(LOADS))


def settlement(number, depth):
    """At a depth under a load of this number."""
    load = LOADS[number]
    return first_settlement(load, depth) if number <= PEAK else first_settlement(max(LOADS), depth) - rise(load, depth)


# --- 2. A point, finite elements and particles ---------------------------------------------------------------------


def triaxial(pressure, steps):
    """Axial strains and q of a drained test."""
    law, stress = sand(), np.array([-pressure] * 3 + [0.0] * 3)
    state = np.zeros(law.n_state)
    state[2] = mpm.hardening_soil_state(law, 100 * stress[None])["log_preconsolidation"][0]
    test, rows = mpm.ElementTest(law, stress, state), [(0.0, 0.0)]
    for _ in range(steps):
        test.step([-0.04 / steps, None, None, 0.0, 0.0, 0.0])
        rows.append((-test.strain[0], -test.stress[0] - pressure))
    return np.array(rows).T


def stages():
    begin = bridge.Stage("ground", fill="clay", unit_weight={"clay": UNIT_WEIGHT}, k0={"clay": K0})
    return [begin, *(bridge.Stage(f"{load / 1e3:g} kPa", pressure={TOP: load}) for load in LOADS)]


def finite_elements(cell_size):
    """Depth of a place and its settlement after each load [m]: of the surface."""
    (domain, cell_tags, facet_tags), supports = ground(cell_size)
    fem = bridge.QuasiStatic(domain, {"clay": sand()}, facet_tags, supports, degree=2, cell_tags=cell_tags)
    site, top = bridge.FemSite(fem), np.array([[0.5 * WIDTH, HEIGHT]])
    found = [-fem.evaluate_at(top)["displacement"][0, 1] for _ in bridge.carry_out(site, stages())]
    return 0.0, np.array(found[1:]) - found[0]


def particles(cell_size):
    """Likewise, of the uppermost particles."""
    mesh, supports = ground(cell_size)
    model = mpm.Model(bridge.background_mesh(*mesh), [sand()])
    site = bridge.ParticleSite(model, {"clay": 0}, supports, small_displacements=True)
    found, highest = [], 0.0
    for _ in bridge.carry_out(site, stages()):
        p = model.particles
        highest = MPI.COMM_WORLD.allreduce(p.position[:, 1].max(initial=-np.inf), MPI.MAX)
        moved = p.displacement[p.position[:, 1] > highest - 1e-6, 1]
        total, number = MPI.COMM_WORLD.allreduce(np.array([moved.sum(), len(moved)]))
        found.append(-total / number)
    return HEIGHT - highest, np.array(found[1:]) - found[0]


# --- 3. The case ------------------------------------------------------------------------------------------------------


def run(quick: bool, folder) -> Result:
    checks, computed, expected = [], {}, {}
    for pressure in PRESSURES:
        strain, q = triaxial(pressure, 100 if quick else 400)
        name = f"{pressure / 1e3:g} kPa"
        half = np.sin(np.radians(FRICTION)) / K0 * pressure
        checks.append(Check(f"secant modulus of a triaxial test under {name}", SECANT * (pressure / REFERENCE) ** EXPONENT / 1e6,
                            "E50 (σ3 / p_ref)^m", half / np.interp(half, q, strain) / 1e6, 0.01, "MPa"))  # fmt: skip
        before = q < 1.9 * half
        computed[name] = strain[before][:: len(strain) // 30 or 1], q[before][:: len(strain) // 30 or 1] / 1e3
        line = np.linspace(0, 1.9 * half, 200)
        expected[f"hyperbola, {name}"] = axial_strain(line, pressure), line / 1e3
    cell_size, tolerance = (1.0, 0.02) if quick else (0.5, 0.01)
    methods = {"finite elements": finite_elements(cell_size), "particles": particles(cell_size)}
    for name, (depth, found) in methods.items():
        where = f"surface, {name}" if depth == 0 else f"uppermost {name}"
        checks.append(Check(f"settlement of the {where}, under 200 kPa", 1e3 * settlement(PEAK, depth),
                            "first loading in the oedometer", 1e3 * found[PEAK], tolerance, "mm"))  # fmt: skip
        checks.append(Check(f"rise of the {where}, as half of it is removed", 1e3 * rise(LOADS[-1], depth),
                            "elastic, with E_ur of σ3", 1e3 * (found[PEAK] - found[-1]), tolerance, "mm"))  # fmt: skip
    if MPI.COMM_WORLD.rank == 0:
        save_comparison(folder / "triaxial.png", computed, expected, ("Axial strain [-]", "$q$ [kPa]"))
        loads = np.array([0.0, *LOADS]) / 1e3
        save_comparison(
            folder / "ground.png",
            {name: (loads, -1e3 * np.array([0.0, *found])) for name, (_, found) in methods.items()},
            {"closed form, surface": (loads, -1e3 * np.array([0.0, *(settlement(k, 0.0) for k in range(len(LOADS)))]))},
            ("Load at the surface [kPa]", "Vertical displacement [mm]"),
        )
    return Result(checks, {
        "triaxial.png": "Drained triaxial tests under three pressures: a point, and the hyperbolas as lines",
        "ground.png": "Ground that is loaded to 200 kPa and unloaded to 100 kPa: displacement of its surface",
    })  # fmt: skip
