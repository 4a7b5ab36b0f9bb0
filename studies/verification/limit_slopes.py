"""Slopes at collapse: stability factors over slope angle and friction angle, against those of limit analysis.

The stability factor is γH/c at collapse. Limit analysis with associated flow minimises it over all rotational mechanisms along
a logarithmic spiral through the toe (Chen 1975); this is repeated here for each slope. On flat slopes with little friction the
spiral dips below the level of the toe before it rises to it. If it does so by more than a hundredth of the height, the ground
below and in front of the toe is of the same soil; otherwise it is rigid. Quadratic finite elements raise the weight to the
last equilibrium, in steps that begin with c/H and are bisected to 0.5 % of the weight. Both are upper bounds: finite elements
converge from above and may end below the spiral where another mechanism is more critical. A slope of 30° with a friction angle
of 30° carries any weight.

Flat slopes of clay without friction fail deep below the toe: the spirals are circles that end in front of the toe and reach
down to the rigid base of the ground. Their factors are the inverse of Taylor's stability numbers (1937, Stability of earth
slopes).
"""

import numpy as np
from _case import Check, Result
from common.figures import curve_figure
from common.plots import CURVES
from common.slope.fem import slope_on_ground
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

HEIGHT, COHESION = 1.0, 1e3  # m, Pa
ANGLES, FRICTION = (30.0, 45.0, 60.0, 75.0, 90.0), (10.0, 20.0, 30.0)  # degrees
QUICK = ((90.0, 30.0), (45.0, 20.0), (30.0, 10.0))
DEEP = {(30.0, 0.5): 0.164, (30.0, 1.0): 0.172}
"""Taylor's stability number by the angle of a slope of clay and the depth of the ground below its toe over its height"""
KNOWN = {(90.0, 30.0): (6.69, "Chen 1975, vertical cut"), (45.0, 25.0): (22.9, "limit analysis of the paper's slope")}


def soil_body(angle, spiral, cell, depth=None):
    """(mesh, facet tags, supports): with as much soil behind the shoulder as the spiral needs, and below the toe.

    depth: of the ground below the toe over the height, where it is given
    """
    behind = -spiral.curve[0, 0]
    shape = {"height": HEIGHT, "angle": angle, "crest": cell * max(4, round((1.5 * behind + 0.5 * HEIGHT) / cell))}
    supports = [bridge.roller(bridge.LEFT, (1, 0)), bridge.fixed(bridge.BASE)]
    if depth is not None:
        toe = HEIGHT / np.tan(np.radians(angle))
        before = spiral.curve[-1, 0] - toe + 0.5 * HEIGHT
        return slope_on_ground(MPI.COMM_WORLD, **shape, cell_size=cell, depth=depth * HEIGHT, runout=before)
    if spiral.curve[:, 1].min() > -0.01 * HEIGHT:
        background = bridge.slope_mesh(MPI.COMM_WORLD, **shape, cell_size=cell, kind="fitted", runout=cell)
        domain, _, facet_tags = bridge.soil_mesh(*background)
        return domain, facet_tags, supports
    return slope_on_ground(MPI.COMM_WORLD, **shape, cell_size=cell, depth=0.5 * HEIGHT, runout=HEIGHT)


def by_finite_elements(angle, friction, spiral, cell, depth=None):
    """Stability factor of the last equilibrium."""
    # --- 1. The slope ------------------------------------------------------------------------------------------------
    domain, facet_tags, supports = soil_body(angle, spiral, cell, depth)
    soil = mpm.MohrCoulomb(young=1e6, poisson=0.3, cohesion=COHESION, friction_angle=friction, dilation_angle=friction)
    model = bridge.QuasiStatic(domain, soil, facet_tags, supports, degree=2)

    # --- 2. Its unit weight, raised to the last equilibrium ---------------------------------------------------------
    first = COHESION / HEIGHT  # from the strength alone, not from the expected result
    load = lambda unit_weight: bridge.Load(unit_weight=unit_weight)  # noqa: E731
    return bridge.collapse_load(model, load, first_step=first, tolerance=5e-3).value * HEIGHT / COHESION


def run(quick: bool, folder) -> Result:
    cell = HEIGHT / (7 if quick else 20)
    checks, found = [], {}

    # --- 3. The mechanism itself against known factors --------------------------------------------------------------
    for (angle, friction), (expected, source) in KNOWN.items():
        factor = bridge.log_spiral(HEIGHT, angle, COHESION, friction).unit_weight * HEIGHT / COHESION
        checks.append(Check(f"spiral, slope {angle:g}°, φ {friction:g}°", expected, source, factor, 0.003))

    # --- 4. The grid of slopes --------------------------------------------------------------------------------------
    for angle, friction in QUICK if quick else [(a, f) for f in FRICTION for a in ANGLES if a > f]:
        spiral = bridge.log_spiral(HEIGHT, angle, COHESION, friction)
        expected = spiral.unit_weight * HEIGHT / COHESION
        found[angle, friction] = by_finite_elements(angle, friction, spiral, cell), expected
        checks.append(Check(f"stability factor, slope {angle:g}°, φ {friction:g}°", expected, "log-spiral, minimised here",
                            found[angle, friction][0], 0.1 if quick else 0.05))  # fmt: skip

    # --- 5. Slopes of clay on ground of the same clay ----------------------------------------------------------------
    for (angle, depth), number in DEEP.items():
        spiral = bridge.log_spiral(HEIGHT, angle, COHESION, 0.0, depth=depth * HEIGHT)
        name = f"slope {angle:g}°, φ 0°, ground {depth:g} H deep"
        factor = spiral.unit_weight * HEIGHT / COHESION
        checks.append(Check(f"circle, {name}", 1 / number, f"Taylor 1937, 1 / {number}", factor, 0.004))
        if not quick:
            computed = by_finite_elements(angle, 0.0, spiral, cell, depth)
            checks.append(Check(f"stability factor, {name}", factor, "circle, minimised here", computed, 0.02))

    # --- 6. Picture -------------------------------------------------------------------------------------------------
    if MPI.COMM_WORLD.rank == 0:
        save_factors(folder / "factors.png", found)
    return Result(checks, {"factors.png": "Stability factors γH/c: finite elements (marks) and limit analysis (lines)"})


def save_factors(path, found):
    """Stability factors over the angle of the slope."""
    with curve_figure(path, (4.9, 3.4)) as axes:
        for k, friction in enumerate(sorted({f for _, f in found})):
            angles = sorted(a for a, f in found if f == friction)
            computed, expected = zip(*(found[a, friction] for a in angles))
            axes.semilogy(angles, expected, "-", color=CURVES[k], label=f"$\\phi$ = {friction:g}°")
            axes.semilogy(angles, computed, "os^"[k % 3], color=CURVES[k], markersize=4)
        axes.set(xlabel="Angle of the slope [degrees]", ylabel=r"Stability factor $\gamma H / c$ [-]", xticks=ANGLES)
        axes.set_yticks([5, 10, 20, 50], ["5", "10", "20", "50"])
        axes.minorticks_off()
        axes.legend()
