"""An undrained slope on a foundation with a thin weak layer, by strength reduction between the bounds of limit analysis.

The third example of Griffiths and Lane (1999), Géotechnique 49, 387–403, is a slope 1:2 with c_u1/γH = 0.25 on a layer of the
same clay as thick as the slope is high, and in it a thin layer of the strength c_u2, which runs parallel to the slope, level
below its toe and up to the ground at 45° beyond. The paper gives no coordinates; those of `meshes/weak_layer_slope.geo` are
the ones that the authors of XSLOPE measured in its figure 6. With c_u2 = c_u1 the slope fails on a deep circle (1.47 by
Taylor's chart). Below a ratio of some 0.6 the soil slides on the layer instead, which no search among circles finds. Undrained
flow is associated, so that both theorems of limit analysis hold: any mechanism is an upper bound, for which the best circle
and the best of three blocks that slide along the layer are computed here, and any stresses in equilibrium are a lower bound,
for which linear programming finds the best.

Triangles of degree 4 on cells of 2.8, 2 and 1.4 m, half of that in the layer, differ by 1.3 % at most, and lie 2 to 4 % above
the lower bound, whose mesh is coarse. They are within 2 % of Taylor's chart, and of the finite elements of XSLOPE on the same
coordinates (its documentation, "Finite-Element Slope Stability (SSRM) Benchmarks": 1.447, 1.41, 1.38, 1.19 and 0.96 at the
ratios 1, 0.8, 0.6, 0.5 and 0.4). At a ratio of 0.2 XSLOPE has 0.453 to 0.478 by finite elements and 0.462 by Spencer's method,
less than the lower bound of 0.481: methods of slices do not take into account that the strong clay must shear where the layer
bends.

The factors of the paper can be read off its figure 7 to 0.05. At ratios from 0.6 they are 1.5 to 2 % above the best circle, an
upper bound; the one for the body of one clay is 1.50 there and 1.45 in figure 10. At ratios of 0.5 and less they are 6 to 21 %
above the finite elements here, which have two cells of degree 4 across the layer where the paper has two of degree 2, and end
by an out-of-balance force where the paper ends by a change of displacements.
"""

from functools import partial

import numpy as np
from _case import Check, Kind, Result
from _plots import save_comparison
from _slip_surfaces import best_circle, least, sliding_blocks
from _static_bound import static_bound
from common.field_plots import mechanism_field, save_mechanism
from common.results import ROOT
from matplotlib.path import Path as Outline
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

HEIGHT, UNIT_WEIGHT = 10.0, 20e3  # m, N/m3
STRENGTH = 0.25 * UNIT_WEIGHT * HEIGHT
SURFACE = HEIGHT * np.array([(0.0, 1.0), (2.0, 1.0), (4.0, 0.0), (6.0, 0.0)])
UPPER = HEIGHT * np.array([(0.8, 1.0), (3.6, -0.4), (4.8, -0.4), (5.2, 0.0)])
LOWER = HEIGHT * np.array([(0.6, 1.0), (3.8, -0.6), (4.8, -0.6), (5.4, 0.0)])
PUBLISHED = {1.0: 1.5, 0.8: 1.45, 0.6: 1.4, 0.5: 1.25, 0.4: 1.05, 0.2: 0.6}
"""Factors of the paper's finite elements by c_u2/c_u1, as read off its figure"""
READ_OFF = (
    "The factors of the paper can be read to 0.05 only, and its meshes have two elements across the layer, as "
    "explained above."
)
XSLOPE = {1.0: 1.447, 0.8: 1.41, 0.6: 1.38, 0.5: 1.19, 0.4: 0.96}
"""Factors of XSLOPE's finite elements on the same coordinates"""


# --- 1. Finite elements ---------------------------------------------------------------------------------------------


def mesh(cell, layer, far):
    """Cells and their sizes on the slope, in the layer and far from them [m]."""
    sizes = {"height": HEIGHT, "cell_size": cell, "layer_size": layer, "far_size": far}
    return bridge.read_mesh(ROOT / "meshes" / "weak_layer_slope.geo", MPI.COMM_WORLD, parameters=sizes)


def safety(cell, ratio):
    """The factor of safety on a mesh, cells in the layer half as large, as a Collapse."""
    domain, cell_tags, facet_tags = mesh(cell, cell / 2, 2 * cell)
    clay, layer = (mpm.tresca(young=100e6, poisson=0.3, shear_strength=part * STRENGTH) for part in (1.0, ratio))
    supports = [bridge.roller("left", (1, 0)), bridge.roller("right", (1, 0)), bridge.fixed("base")]
    model = bridge.QuasiStatic(domain, {"clay": clay, "layer": layer}, facet_tags, supports, 4, cell_tags=cell_tags)
    return bridge.factor_of_safety(
        model, bridge.Load(unit_weight=UNIT_WEIGHT), start=0.25, first_step=0.2, tolerance=2e-3
    )


# --- 2. Bounds ------------------------------------------------------------------------------------------------------


def strength_at(ratio, x, y):
    """c_u [Pa] at points."""
    inside = Outline(np.vstack([UPPER, LOWER[::-1]])).contains_points(np.column_stack([x, y]))
    return np.where(inside, ratio, 1.0) * STRENGTH


def blocks_bound(ratio):
    """Least factor of three blocks on the layer: over where the line crosses it, and where the lines between them end."""

    def factor(values):
        base = UPPER + np.clip(values[:4], 0.0, 1.0)[:, None] * (LOWER - UPPER)
        return min(sliding_blocks(base, values[4:], SURFACE, partial(strength_at, ratio), UNIT_WEIGHT), 1e3)

    first = np.array([0.5, 0.5, 0.5, 0.5, 2.4 * HEIGHT, 5.2 * HEIGHT])
    return least(factor, first, np.array([0.3, 0.3, 0.3, 0.3, 0.6 * HEIGHT, -0.4 * HEIGHT]))


def circle_bound(ratio):
    """Least factor of slip circles."""
    return best_circle(SURFACE, partial(strength_at, ratio), UNIT_WEIGHT, HEIGHT)


def static(ratio):
    """Best stresses in equilibrium on a coarse mesh."""
    strength = {"clay": STRENGTH, "layer": ratio * STRENGTH}
    return static_bound(mesh(3.0, 1.5, 4.0), strength, UNIT_WEIGHT, ["surface", "crest"], ["left", "right"])


# --- 3. All together -------------------------------------------------------------------------------------------------


def run(quick: bool, folder) -> Result:
    ratios = (0.2,) if quick else tuple(PUBLISHED)
    bounds = {ratio: (blocks_bound(ratio), circle_bound(ratio)) for ratio in ratios}
    checks = [] if quick else [Check("best circle, one soil", 1.47, "Taylor's chart", bounds[1.0][1], 5e-3)]
    lower = {ratio: static(ratio) for ratio in ratios}
    found = {}
    for ratio in ratios:
        for cell in (4.0,) if quick else (2.8, 2.0, 1.4):
            found[ratio] = safety(cell, ratio)
            checks += compared(
                f"c_u2/c_u1 = {ratio:g}, cells of {cell:g} m", ratio, found[ratio], lower[ratio], min(bounds[ratio])
            )
    field = mechanism_field(found[0.2].mechanism)
    if field is not None:
        draw(folder, found, bounds, lower)
        save_mechanism(
            folder / "mechanism.png", field, f"$c_{{u2}}/c_{{u1}}$ = 0.2, factor of safety {found[0.2].value:.3f}"
        )
    captions = {"factors.png": "Factor of safety over the ratio of the strengths of layer and clay",
                "mechanism.png": "Mechanism: the soil slides along the weak layer"}  # fmt: skip
    return Result(checks, captions)


def compared(name, ratio, result, lower, upper):
    """The checks of one factor."""
    checks = [
        Check(f"failure shown, {name}", 1.0, "1 if a mechanism is found", float(result.failed), 0.0),
        Check(name, lower, "lower bound by stresses in equilibrium", result.value, 0.0, kind=Kind.AT_LEAST),
        Check(name, upper, "upper bound by blocks or a circle", result.value, 0.0, kind=Kind.AT_MOST),
        # The stresses are those of a coarse mesh, within a polygon of 0.991 of the strength
        Check(name, lower, "lower bound by stresses in equilibrium", result.value, 0.045),
        Check(
            name,
            PUBLISHED[ratio],
            "Griffiths and Lane's figure 7",
            result.value,
            0.035,
            limit="" if ratio > 0.55 else READ_OFF,
        ),
    ]
    if ratio in XSLOPE:
        checks.append(Check(name, XSLOPE[ratio], "XSLOPE", result.value, 0.02))
    if ratio == 1.0:
        checks.append(Check(name, 1.47, "Taylor's chart", result.value, 0.02))
    return checks


def draw(folder, found, bounds, lower):
    """Factors over the ratio of strengths."""
    ratios = np.array(sorted(found))
    computed = {"finite elements": [found[ratio].value for ratio in ratios],
                "Griffiths and Lane": [PUBLISHED[ratio] for ratio in ratios]}  # fmt: skip
    expected = {"three blocks, upper bound": [bounds[ratio][0] for ratio in ratios],
                "best circle, upper bound": [bounds[ratio][1] for ratio in ratios],
                "stresses in equilibrium, lower bound": [lower[ratio] for ratio in ratios]}  # fmt: skip
    save_comparison(
        folder / "factors.png",
        {name: (ratios, np.array(values)) for name, values in computed.items()},
        {name: (ratios, np.array(values)) for name, values in expected.items()},
        ("$c_{u2}/c_{u1}$ [-]", "Factor of safety [-]"),
        limits=((0, 1.05), (0, 1.7)),
    )
