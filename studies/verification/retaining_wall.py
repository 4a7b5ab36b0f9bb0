"""Rigid walls that move away from sand and into it: active and passive pressure, smooth and rough.

This case runs the study wall: sand with a friction angle of 30 degrees lies on rock beside walls that are contact bodies.
Behind smooth walls Rankine's coefficients are exact. Behind rough walls they lie between the lower bound of a stress field and
the upper bound of a mechanism. For the active pressure these are 2 % apart. For the passive pressure a plane wedge is far too
high, and a body that rotates on a log-spiral is a much closer upper bound. Both theorems hold for sand that dilates by its
friction angle. The friction angle that this sand mobilises on the wall is 17 to 20 of the 20 degrees available, and less at
the foot, where the rock restrains the sand.

For sand that does not dilate there is no exact coefficient. Such sand cannot resist more than the same sand with associated
flow (Radenkovic 1961), so that the log-spiral remains an upper bound; the stress field with the full strength is no longer a
lower bound. Sand that shears at constant volume has the strength tan(phi*) = sin(phi) on its slip lines (Davis 1968): the
stress field for phi* is the other end of the interval. Such sand hardly rises along the lower half of the wall and does not
mobilise its friction there, so that its passive pressure is also compared with the stress field for the mobilised wall
friction.
"""

import numpy as np
import wall
from _case import Check, Kind, Result
from _log_spiral import log_spiral
from _plots import save_comparison
from _rows import followed
from common.earth_pressure import stress_field
from mpi4py import MPI

ROUGH = 20.0  # degrees
RANKINE, LANCELLOTTA, COULOMB = "Rankine 1857", "stress field, Lancellotta 2002", "plane wedge, Coulomb 1776"
SPIRAL = "soil that rotates on a log-spiral"
DAVIS = "stress field, strength at constant volume, Davis 1968"
RADENKOVIC = "log-spiral, sand that dilates, Radenkovic 1961"


def moved(motion, friction_angle, quick, dilation_angle=0.0):
    """The options, and the rows of the study's history."""
    size = ["--cell-size", "0.1", "--speed", "0.02"] if quick else []
    a = wall.parse(["--motion", motion, "--wall-friction-angle", str(friction_angle), "--dilation-angle",
                    str(dilation_angle), *size])  # fmt: skip
    until = wall.end(a)
    return a, followed(a, wall.build(a), until, (until - wall.at_rest(a)) / 20, wall.row)


def run(quick: bool, folder) -> Result:
    # --- 1. Walls ----------------------------------------------------------------------------------------------------
    tolerance = 0.12 if quick else 0.05
    runs, checks = {}, []
    for motion in ("active", "passive"):
        for friction in (0.0,) if quick else (0.0, ROUGH):
            a, rows = runs[f"{motion}, {'rough' if friction else 'smooth'}"] = moved(motion, friction, quick)
            name = f"coefficient of {motion} pressure, {'rough' if friction else 'smooth'} wall"
            found, (field, wedge) = wall.in_the_end(a, rows, "coefficient"), wall.bounds(a)
            if friction == 0:
                checks.append(Check(name, field, RANKINE, found, tolerance))
            elif motion == "active":
                checks.append(Check(f"{name}: at most", field, LANCELLOTTA, found, tolerance, kind=Kind.AT_MOST))
                checks.append(Check(f"{name}: at least", wedge, COULOMB, found, tolerance, kind=Kind.AT_LEAST))
            else:
                delta = np.arctan(wall.in_the_end(a, rows, "wall_friction"))
                acting = stress_field(np.radians(a.friction_angle), delta, passive=True)
                source = f"{LANCELLOTTA}, for the {np.degrees(delta):.1f} degrees that are mobilised"
                checks.append(Check(name, acting, source, found, tolerance))
                angles = np.radians([a.friction_angle, ROUGH])
                least = stress_field(np.arctan(np.sin(angles[0])), angles[1], passive=True)
                checks.append(Check(f"{name}: at least", least, DAVIS, found, 0.0, kind=Kind.AT_LEAST))
                checks.append(Check(f"{name}: at most", log_spiral(*angles), RADENKOVIC, found, 0.0, kind=Kind.AT_MOST))

    if not quick:
        a, rows = runs["passive, rough, dilating"] = moved("passive", ROUGH, quick, dilation_angle=30.0)
        name, found = "coefficient of passive pressure, rough wall, sand that dilates", wall.in_the_end(
            a, rows, "coefficient"
        )
        field, spiral = wall.bounds(a)[0], log_spiral(*np.radians([a.friction_angle, ROUGH]))
        checks.append(Check(f"{name}: at least", field, LANCELLOTTA, found, tolerance, kind=Kind.AT_LEAST))
        checks.append(Check(f"{name}: at most", spiral, SPIRAL, found, tolerance, kind=Kind.AT_MOST))
        checks.append(Check(f"{name}: against the closer bound", spiral, SPIRAL, found, tolerance))

    # --- 2. Pictures -------------------------------------------------------------------------------------------------
    if MPI.COMM_WORLD.rank == 0:
        for motion in ("active", "passive"):
            chosen = {name: pair for name, pair in runs.items() if name.startswith(motion)}
            curves = {
                name: (np.abs(rows["wall_displacement_m"]) / a.height, rows["coefficient"])
                for name, (a, rows) in chosen.items()
            }
            ends = np.array([0.0, max(x.max() for x, _ in curves.values())])
            lines = {
                f"{name}, stress field": (ends, np.full(2, wall.bounds(a)[0]))
                for name, (a, _) in chosen.items()
                if a.dilation_angle == 0
            }
            if motion == "passive" and not quick:
                lines["rough, log-spiral"] = (ends, np.full(2, spiral))
            save_comparison(folder / f"{motion}.png", curves, lines,
                            ("Displacement of the wall over its height [-]", "Coefficient of earth pressure [-]"),
                            joined=True, limits=((0.0, None), (0.0, None)))  # fmt: skip
    return Result(checks, {
        "active.png": "Coefficient of the pressure on walls that move away from sand",
        "passive.png": "Coefficient of the pressure on walls that move into sand",
    })  # fmt: skip
