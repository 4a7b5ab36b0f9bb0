"""An undrained slope on a foundation with a thin weak layer, by strength reduction against limit analysis.

The third example of Griffiths and Lane (1999), Géotechnique 49, 387–403: a slope 1:2 with c_u1/γH = 0.25 on a layer of
the same clay as thick as the slope is high, and in it a thin layer of the strength c_u2, which runs parallel to the
slope, level below its toe and up to the ground at 45° beyond. The paper gives no coordinates; those of
`meshes/weak_layer_slope.geo` are as the authors of XSLOPE measured them in its figure 6. With c_u2 = c_u1 the slope
fails on a deep circle (1.47 by Taylor's chart). Below a ratio of some 0.6 the soil slides on the layer instead, which
no search among circles finds. Undrained flow is associated, so that any mechanism is an upper bound: the best circle
and the best of three blocks that slide along the layer are computed here, beside the paper's own factors, which are
read off its figure 7 to the nearest 0.05. Blocks have to shear the strong clay between them where the layer bends,
which the paper's wedges by Janbu's method leave out (0.48 at a ratio of 0.2): finite elements lie between the two.
Cells are of 2 m, and of 1 m in the layer, as in the paper; halved, they give 1.461, 1.428, 1.369, 1.194, 0.972 and
0.513 at the ratios 1, 0.8, 0.6, 0.5, 0.4 and 0.2. Triangles of degree 4 on the coarser mesh give 1.454, 1.419, 1.358, 1.177,
0.950 and 0.497.
"""

from functools import partial

import numpy as np
from _case import Check, Kind, Result, run_alone
from _plots import save_comparison
from _slip_surfaces import best_circle, least, sliding_blocks
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
COARSE = "the paper's factors are read to 0.05, and finer meshes have less where the layer decides"


# --- 1. Finite elements ---------------------------------------------------------------------------------------------


def safety(cell, ratio):
    """The factor of safety on a mesh, cells in the layer half as large, as a Collapse."""
    sizes = {"height": HEIGHT, "cell_size": cell, "layer_size": cell / 2, "far_size": 2 * cell}
    mesh = ROOT / "meshes" / "weak_layer_slope.geo"
    domain, cell_tags, facet_tags = bridge.read_mesh(mesh, MPI.COMM_WORLD, parameters=sizes)
    clay, layer = (mpm.tresca(young=100e6, poisson=0.3, shear_strength=part * STRENGTH) for part in (1.0, ratio))
    supports = [bridge.roller("left", (1, 0)), bridge.roller("right", (1, 0)), bridge.fixed("base")]
    model = bridge.QuasiStatic(domain, {"clay": clay, "layer": layer}, facet_tags, supports, cell_tags=cell_tags)
    return bridge.factor_of_safety(
        model, bridge.Load(unit_weight=UNIT_WEIGHT), start=0.25, first_step=0.2, tolerance=3e-3
    )


# --- 2. Upper bounds ------------------------------------------------------------------------------------------------


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


# --- 3. All together -------------------------------------------------------------------------------------------------


def run(quick: bool, folder) -> Result:
    ratios = (1.0, 0.2) if quick else tuple(PUBLISHED)
    circles = {ratio: best_circle(SURFACE, partial(strength_at, ratio), UNIT_WEIGHT, HEIGHT) for ratio in ratios}
    bounds = {ratio: (blocks_bound(ratio), circles[ratio]) for ratio in ratios}
    checks = [Check("best circle, one soil", 1.47, "Taylor's chart", bounds[1.0][1], 5e-3)]
    found = {}
    for ratio in ratios:
        found[ratio] = safety(2.0, ratio)
        checks += compared(ratio, found[ratio], min(bounds[ratio]))
    field = mechanism_field(found[0.2].mechanism)
    if field is not None:
        draw(folder, found, bounds)
        save_mechanism(
            folder / "mechanism.png", field, f"$c_{{u2}}/c_{{u1}}$ = 0.2, factor of safety {found[0.2].value:.3f}"
        )
    captions = {"factors.png": "Factor of safety over the strength of the layer",
                "mechanism.png": "The soil slides on the layer"}  # fmt: skip
    return Result(checks, captions)


def compared(ratio, result, bound):
    """The checks of one factor."""
    name = f"c_u2/c_u1 = {ratio:g}"
    checks = [
        Check(f"failure shown, {name}", 1.0, "a mechanism", float(result.failed), 0.0),
        # Cells of 2 m are too stiff by some per cent; half as large, they are above no bound by more than 0.2 %.
        Check(name, bound, "best block or circle mechanism", result.value, 0.02, kind=Kind.AT_MOST),
        Check(
            name,
            PUBLISHED[ratio],
            "Griffiths and Lane's figure 7",
            result.value,
            0.03,
            limit="" if ratio > 0.55 else COARSE,
        ),
    ]
    if ratio == 1.0:
        checks.append(Check(name, 1.47, "Taylor's chart", result.value, 0.02))
    if ratio == 0.2:
        checks.append(Check(name, 0.48, "the paper's wedges by Janbu", result.value, 0.0, kind=Kind.AT_LEAST))
    return checks


def draw(folder, found, bounds):
    """Factors over the ratio of strengths."""
    ratios = np.array(sorted(found))
    computed = {"finite elements": [found[ratio].value for ratio in ratios],
                "Griffiths and Lane": [PUBLISHED[ratio] for ratio in ratios]}  # fmt: skip
    expected = {"three blocks, upper bound": [bounds[ratio][0] for ratio in ratios],
                "best circle, upper bound": [bounds[ratio][1] for ratio in ratios]}  # fmt: skip
    save_comparison(
        folder / "factors.png",
        {name: (ratios, np.array(values)) for name, values in computed.items()},
        {name: (ratios, np.array(values)) for name, values in expected.items()},
        ("$c_{u2}/c_{u1}$ [-]", "Factor of safety [-]"),
        limits=((0, 1.05), (0, 1.7)),
    )


if __name__ == "__main__":
    run_alone(run)
