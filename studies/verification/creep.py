"""Creep of soft clay: settlement by the logarithm of time, strength by the rate, and a layer that consolidates and creeps.

The law is modified Cam-Clay with isotaches. A point creeps under a constant pressure and under shear stresses up to the critical state, relaxes at a constant
volume, and is sheared without drainage at several rates. The layer of `meshes/soft_clay.toml`, 5 m thick, settles under a wide fill by finite elements, with three
conductivities. Once the water is out, it settles by creep / v for each factor e of time, and where its water leaves more slowly it has crept as much by then as in
the other cases: the final settlement hardly depends on the conductivity (hypothesis B of Leroueil 2006).
"""

import numpy as np
from _case import Check, Result
from _plots import save_comparison
from common.consolidation.site import read_consolidation_site
from common.files import ROOT
from mpi4py import MPI

import mpm_core as mpm
from fenics_bridge import water

comm = MPI.COMM_WORLD
LAMBDA, KAPPA, CREEP, SLOPE, VOLUME, DAY = 0.26, 0.04, 0.01, 1.0, 2.6, 86400.0
PRESSURE = 50e3  # Pa, and preconsolidation pressure of the point
EXPONENT = (LAMBDA - KAPPA) / CREEP
CONDUCTIVITIES = (1e-6, 1e-8, 1e-9)  # m/s
YEAR = 365.25  # days
HEIGHT = 5.0  # m


def clay():
    return mpm.CamClay(
        compression=LAMBDA, swelling=KAPPA, critical_slope=SLOPE, poisson=0.2, void_ratio=VOLUME - 1, preconsolidation=PRESSURE, creep=CREEP
    )  # fmt: skip


# --- 1. A point --------------------------------------------------------------------------------------------------------


def crept(days, steps):
    """Specific volume that a point has lost under its preconsolidation pressure."""
    test, time = mpm.ElementTest(clay(), [-PRESSURE] * 3 + [0.0] * 3), 0.0
    for end in np.geomspace(1e-3, days, steps) * DAY:
        test.step([None, None, None, 0, 0, 0], [-PRESSURE] * 3 + [0.0] * 3, dt=end - time)
        time = end
    return VOLUME * (1 - np.exp(test.strain[:3].sum()))


def sheared(ratio, days, steps):
    """Volumetric and shear strain by creep under a constant q / p, on the ellipse of the preconsolidation pressure."""
    p = PRESSURE / (1 + (ratio / SLOPE) ** 2)
    stress = [-p * (1 + 2 / 3 * ratio), -p * (1 - ratio / 3), -p * (1 - ratio / 3), 0.0, 0.0, 0.0]
    test, time = mpm.ElementTest(clay(), stress), 0.0
    for end in np.geomspace(1e-3, days, steps) * DAY:
        test.step([None, None, None, 0, 0, 0], stress, dt=end - time)
        time = end
    return -test.strain[:3].sum(), 2 / 3 * (test.strain[1] - test.strain[0])


def sheared_by_hand(ratio, days):
    """v falls by creep ln(1 + a t / day), a = 1 - (q / (M p))^2, and the shear strain is 2 r / (M^2 - r^2) times that of volume; at q = M p it has a constant rate."""
    a = 1 - (ratio / SLOPE) ** 2
    if a == 0:
        return 0.0, 2 * CREEP * days / (SLOPE * VOLUME)
    volumetric = -np.log(1 - CREEP * np.log(1 + a * days) / VOLUME)
    return volumetric, volumetric * 2 * ratio / (SLOPE**2 - ratio**2)


def relaxed(days, steps):
    """Pressure that is left at a constant volume [Pa]."""
    test, time = mpm.ElementTest(clay(), [-PRESSURE] * 3 + [0.0] * 3), 0.0
    for end in np.geomspace(1e-3, days, steps) * DAY:
        test.step([0.0] * 6, dt=end - time)
        time = end
    return -test.stress[:3].mean()


def relaxed_by_hand(days):
    """d ln(p / p_c) / dt = -creep (1 / kappa + 1 / (lambda - kappa)) / day (p / p_c)^exponent; kappa ln p + (lambda - kappa) ln p_c stays."""
    rate = CREEP * (1 / KAPPA + 1 / (LAMBDA - KAPPA))
    return PRESSURE * np.exp(-np.log(1 + EXPONENT * rate * days) / EXPONENT * (LAMBDA - KAPPA) / LAMBDA)


def strength(rate, steps):
    """Undrained shear strength q / 2 [Pa] at an axial strain rate [1/s]."""
    test, axial = mpm.ElementTest(clay(), [-PRESSURE] * 3 + [0.0] * 3), 0.3 / steps
    for _ in range(steps):
        test.step([-axial, axial / 2, axial / 2, 0, 0, 0], dt=axial / rate)
    return (test.stress[1] - test.stress[0]) / 2


def strength_by_hand(rate):
    """In the critical state 2 p = R p_c, where R^exponent = rate M v day / (2 creep); kappa ln p + (lambda - kappa) ln p_c stays."""
    ratio = (rate * SLOPE * VOLUME * DAY / (2 * CREEP)) ** (1 / EXPONENT)
    return SLOPE / 2 * PRESSURE * (ratio / 2) ** ((LAMBDA - KAPPA) / LAMBDA)


# --- 2. The layer ------------------------------------------------------------------------------------------------------


def layer(folder, conductivity, creep, days, growth):
    """Times [days] and settlements [m] of the layer."""
    path = folder / "soft_clay.toml"
    if comm.rank == 0:
        example = ROOT / "meshes" / "soft_clay.toml"
        path.write_text(f'extends = "{example}"\n[soils.clay]\nconductivity = {conductivity}\ncreep = {creep}\n')
    comm.barrier()
    site = read_consolidation_site(path, comm)
    model = site.at_rest(water.Element.TAYLOR_HOOD)
    rows = []

    def made(report):
        top = model.displacement.x.array
        if report.converged:
            rows.append((model.time / DAY, comm.allreduce(-top.min(initial=0.0), MPI.MAX)))

    for time in (30.0, days):  # the fill is complete after 30 days
        model.run(DAY * time, DAY, growth, progress=made, accuracy=0.01)
    return np.array(rows).T


def slope(times, settlements, first, last):
    """Settlement for each factor e of time [m], between two times."""
    return np.diff(np.interp([first, last], times, settlements))[0] / np.log(last / first)


# --- 3. The case -------------------------------------------------------------------------------------------------------


def run(quick: bool, folder) -> Result:
    steps, growth, days = (300, 1.5, 100 * YEAR) if quick else (1500, 1.1, 100 * YEAR)
    checks = [
        Check("volume lost under the preconsolidation pressure in 100 days", CREEP * np.log(101), "creep ln(1 + t / day)", crept(100, steps), 0.02),
        Check("pressure left at constant volume after 100 days", relaxed_by_hand(100) / 1e3, "isotaches", relaxed(100, steps) / 1e3, 5e-3, "kPa"),
    ]  # fmt: skip
    for ratio in (0.5 * SLOPE, 0.9 * SLOPE):
        for name, hand, one in zip(
            ("volumetric", "shear"), sheared_by_hand(ratio, 100), sheared(ratio, 100, steps), strict=True
        ):
            checks.append(
                Check(
                    f"{name} strain under a constant q / p of {ratio:g} in 100 days",
                    hand,
                    "isotaches, flow normal to the ellipse",
                    one,
                    0.02,
                )
            )
    checks.append(Check(f"shear strain under a constant q / p of {SLOPE:g} in 10 days", sheared_by_hand(SLOPE, 10)[1], "2 creep / (M v) for each day",
                        sheared(SLOPE, 10, steps)[1], 1e-3))  # fmt: skip
    rates = np.array([1e-8, 1e-6, 1e-4])
    found = np.array([strength(rate, steps) for rate in rates])
    checks += [
        Check(f"undrained strength at a strain rate of {rate:g}/s", strength_by_hand(rate) / 1e3, "critical state on its isotache", one / 1e3, 5e-3, "kPa")
        for rate, one in zip(rates, found, strict=True)
    ]  # fmt: skip
    curves = {
        f"conductivity {conductivity:g} m/s": layer(folder, conductivity, CREEP, days, growth)
        for conductivity in CONDUCTIVITIES
    }
    plain = layer(folder, 1e-8, 0.0, days, growth)
    fast = next(iter(curves.values()))
    for first, last in ((5 * YEAR, 20 * YEAR), (20 * YEAR, 100 * YEAR)):
        strain = np.interp(np.sqrt(first * last), *fast) / HEIGHT
        checks.append(
            Check(f"settlement by creep from {first / YEAR:g} to {last / YEAR:g} years, for each factor e of time",
                  1e3 * CREEP / (VOLUME * np.exp(-strain)) * HEIGHT, "creep / v times the height", 1e3 * slope(*fast, first, last), 0.03, "mm")
        )  # fmt: skip
    ends = [settlements[-1] for _, settlements in curves.values()]
    checks.append(
        Check(
            "settlement after 100 years, conductivity 1e-9 over 1e-6 m/s", 1.0, "one isotache", ends[-1] / ends[0], 0.02
        )
    )
    if comm.rank == 0:
        lines = curves | {"conductivity 1e-08 m/s, without creep": plain}
        save_comparison(
            folder / "layer.png",
            {name: (times, -1e3 * settlements) for name, (times, settlements) in lines.items()},
            {},
            ("Time [days]", "Vertical displacement of the surface [mm]"),
            joined=True,
            logarithmic=True,
        )
        line = np.geomspace(rates[0], rates[-1], 50)
        save_comparison(
            folder / "strength.png",
            {"a point": (rates, found / 1e3)},
            {"critical state on its isotache": (line, strength_by_hand(line) / 1e3)},
            ("Axial strain rate [1/s]", "Undrained shear strength [kPa]"),
            logarithmic=True,
        )
    return Result(checks, {
        "layer.png": "Settlement of a layer of soft clay under a fill that is complete after 30 days",
        "strength.png": "Undrained shear strength in triaxial compression by the strain rate",
    })  # fmt: skip
