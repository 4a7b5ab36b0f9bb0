"""Small-strain stiffness of Hardening Soil: modulus and damping by strain, small cycles, and ground from which a load is removed.

A point of soil that stays elastic, with moduli that do not depend on the stress, is strained back and forth. Its secant modulus is compared with
the curve of Santos and Correia (2001), and its damping with the integral of Masing's loops on that curve. Ground 10 m deep, which has come to rest under
a load, rises when the load is removed in two steps: its stiffness falls as it rises, and is back after the load returns.
The methods are quadratic finite elements, and particles in quasi-static stages.
"""

import numpy as np
from _case import Check, Result
from _level_ground import HEIGHT, WIDTH, ground
from _plots import save_comparison
from mpi4py import MPI
from scipy.optimize import brentq

import fenics_bridge as bridge
import mpm_core as mpm

G0, THRESHOLD, POISSON = 150e6, 2e-4, 0.2  # Pa, -, -
UNLOADING = 90e6 / (2 * (1 + POISSON))  # Pa, shear modulus
SLOPE = 0.385
END = THRESHOLD / SLOPE * (np.sqrt(G0 / UNLOADING) - 1)
"""Strain from which on the tangent modulus is that of unloading"""
LOAD, TOP = 300e3, "top"  # Pa
LEFT = (250e3, 150e3, 300e3)  # Pa, of the load, stage by stage
K0 = 1.0
CONSTRAINED = 2 * (1 - POISSON) / (1 - 2 * POISSON)
"""Modulus of vertical strain in wide ground over the shear modulus"""


def soil(**changes):
    return mpm.HardeningSoil(**{
        "secant_modulus": 30e6, "oedometer_modulus": 30e6, "unloading_modulus": 90e6, "cohesion": 1e6, "friction_angle": 35.0,
        "poisson": POISSON, "exponent": 0.0, "vertical_preconsolidation": 10e6, "small_strain_modulus": G0, "threshold_strain": THRESHOLD, **changes,
    })  # fmt: skip


# --- 1. Closed forms ------------------------------------------------------------------------------------------------


def curve(strain):
    """Shear stress of first loading by the strain e1 - e3."""
    bounded = np.minimum(strain, END)
    return G0 * bounded / (1 + SLOPE * bounded / THRESHOLD) + UNLOADING * (strain - bounded)


def area_below(strain):
    """Integral of the curve from zero on."""
    bounded, scale = min(strain, END), THRESHOLD / SLOPE
    beyond = strain - bounded
    return (
        G0 * scale * (bounded - scale * np.log(1 + bounded / scale))
        + curve(END) * beyond
        + 0.5 * UNLOADING * beyond**2
    )


def damping(strain):
    """Damping ratio of Masing's loop with an amplitude: dissipated energy over 4 pi of the elastic one."""
    half = 0.5 * curve(strain) * strain
    return 8 * (area_below(strain) - half) / (4 * np.pi * half)


def rise():
    """Heights by which the surface has risen after each stage [m]: Masing's rule, along a load that turns once."""
    strains, turned = [], 0.0
    for left in LEFT:
        if not strains or left < LEFT[len(strains) - 1]:
            at = brentq(lambda e, left=left: CONSTRAINED * curve(e) - (LOAD - left), 0, 1)
            turned = at
        else:
            back = left - LEFT[len(strains) - 1]
            at = turned - brentq(lambda e, back=back: 2 * CONSTRAINED * curve(e / 2) - back, 0, 1)
        strains.append(at)
    return HEIGHT * np.array(strains)


# --- 2. A point, finite elements and particles -----------------------------------------------------------------------


def strained(law, strains):
    """Shear stresses [Pa] at strains e1 - e3 one after another."""
    stress, state = np.array([[-1e6] * 3 + [0.0] * 3]), np.zeros((1, law.n_state))
    found = []
    for step in np.diff(strains, prepend=0.0):
        law.update(step * np.array([[2 / 3, -1 / 3, -1 / 3, 0, 0, 0]]), stress, state)
        found.append((stress[0, 0] - stress[0, 1]) / 2)
    return np.array(found)


def loop(amplitude, steps):
    """Secant modulus [Pa] and damping ratio [-] of a loop."""
    down = np.linspace(amplitude, -amplitude, steps)
    strains = np.concatenate([down, down[::-1][1:]])
    stress = strained(soil(), strains)
    energy = np.sum(0.5 * (stress[1:] + stress[:-1]) * np.diff(strains))
    return stress[0] / amplitude, energy / (2 * np.pi * stress[0] * amplitude)


def tested(law, small_cycles):
    """Axial strains and q [kPa] of a drained triaxial test with small cycles."""
    stress = np.array([-100e3] * 3 + [0.0] * 3)
    state = np.zeros(law.n_state)
    state[2] = mpm.hardening_soil_state(law, 100 * stress[None])["log_preconsolidation"][0]
    test, rows = mpm.ElementTest(law, stress, state), [(0.0, 0.0)]
    for number in range(150):
        steps = [-2e-5] if number not in small_cycles else [1e-5] * 4 + [-1e-5] * 4
        for step in steps:
            test.step([step, None, None, 0.0, 0.0, 0.0])
            rows.append((-test.strain[0], (-test.stress[0] - 100e3) / 1e3))
    return np.array(rows).T


def stages():
    begin = bridge.Stage("ground", fill="clay", unit_weight={"clay": 20e3}, k0={"clay": K0}, pressure={TOP: LOAD})
    return [begin, *(bridge.Stage(f"{load / 1e3:g} kPa", pressure={TOP: load}) for load in LEFT)]


def finite_elements(cell_size):
    """Heights by which the surface has risen after each stage [m]."""
    (domain, cell_tags, facet_tags), supports = ground(cell_size)
    fem = bridge.QuasiStatic(domain, {"clay": soil()}, facet_tags, supports, degree=2, cell_tags=cell_tags)
    site, top = bridge.FemSite(fem), np.array([[0.5 * WIDTH, HEIGHT]])
    found = [fem.evaluate_at(top)["displacement"][0, 1] for _ in bridge.carry_out(site, stages())]
    return np.array(found[1:]) - found[0]


def particles(cell_size):
    """Likewise: the mean strain of all particles times the height."""
    mesh, supports = ground(cell_size)
    model = mpm.Model(bridge.background_mesh(*mesh), [soil()])
    site = bridge.ParticleSite(model, {"clay": 0}, supports, small_displacements=True)
    found = []
    for _ in bridge.carry_out(site, stages()):
        p = model.particles
        sums = [np.sum(p.displacement[:, 1] / p.position[:, 1]), len(p)]
        total, number = MPI.COMM_WORLD.allreduce(np.array(sums))
        found.append(HEIGHT * total / number)
    return np.array(found[1:]) - found[0]


# --- 3. The case ------------------------------------------------------------------------------------------------------


def run(quick: bool, folder) -> Result:
    steps = 201 if quick else 2001
    checks = [
        Check("secant modulus at the threshold strain", 0.722, "1 / 1.385", loop(THRESHOLD, steps)[0] / G0, 0.01, "G0"),
    ]
    for amplitude in (THRESHOLD, 5 * THRESHOLD):
        checks.append(Check(f"damping ratio of a loop of {amplitude:g}", damping(amplitude), "Masing's rule on the curve",
                            loop(amplitude, steps)[1], 0.03))  # fmt: skip
    for name, found in (("finite elements", finite_elements(1.0)), ("particles", particles(1.0))):
        for left, expected, computed in zip(LEFT, rise(), found, strict=True):
            checks.append(Check(f"rise of the ground when the load is {left / 1e3:g} kPa", 1e3 * expected,
                                "Masing's rule on the curve, in one dimension", 1e3 * computed, 0.03, "mm", method=name))  # fmt: skip
    if MPI.COMM_WORLD.rank == 0:
        amplitudes, line = np.geomspace(1e-6, 1e-2, 9 if quick else 25), np.geomspace(1e-6, 1e-2, 400)
        loops = np.array([loop(amplitude, steps) for amplitude in amplitudes]).T
        save_comparison(
            folder / "curve.png",
            {"$G / G_0$ of the law": (amplitudes, loops[0] / G0), "damping ratio of the law": (amplitudes, loops[1])},
            {
                "Santos and Correia (2001)": (line, curve(line) / line / G0),
                "Masing": (line, [damping(x) for x in line]),
            },
            ("Amplitude of the shear strain [-]", "$G / G_0$ and damping ratio [-]"),
            logarithmic=True,
        )
        law = {"cohesion": 0.0, "exponent": 0.5, "vertical_preconsolidation": 0.0}
        save_comparison(
            folder / "cycles.png",
            {
                "with small-strain stiffness, four small cycles": tested(soil(**law), (30, 60, 90, 120)),
                "without cycles": tested(soil(**law), ()),
                "without small-strain stiffness": tested(soil(**law, small_strain_modulus=0.0), ()),
            },
            {},
            ("Axial strain [-]", "$q$ [kPa]"),
            joined=True,
        )
    return Result(checks, {
        "curve.png": "Secant modulus and damping ratio of loops: a point, and closed forms as lines",
        "cycles.png": "Drained triaxial tests under 100 kPa: small cycles begin stiff and leave no trace",
    })  # fmt: skip
