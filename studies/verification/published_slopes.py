"""Factors of safety of published slopes, without dilation, by strength reduction.

The examples of Griffiths and Lane (1999), Géotechnique 49, 387–403, are computed with a Poisson's ratio of 0.3 and without
dilation. They are a slope 1:2 with c'/γH = 0.05 and φ' = 20°, on rock and on a layer of the same soil of half its height, and
an undrained slope with c_u/γH = 0.25 on a foundation layer as thick as the slope is high, whose strength varies. The factors
that they found by quadratic quadrilaterals with a loose tolerance are 1.4 for the first two slopes (1.380 by Bishop and
Morgenstern, 1960). For the undrained slope 1.448 (one soil) and 2.032 (a foundation 1.5 and 4 times as strong) are the values
that Code_Aster's validation V6.03.507 takes from limit equilibrium; it names them as the reference values of their fourth
example. Undrained flow is associated, so that the best slip circle, found here, is an upper bound. A slope on a stronger
foundation slides along its surface, in a shear band that is as wide as a cell: quadratic triangles of 2, 1 and 0.5 m, a fifth
to a twentieth of the height, then give 2.222, 2.113 and 2.062. The undrained slope is therefore computed by triangles of
degree 4, whose sizes are a fifth, a seventh and a tenth of the height. No theorem makes the factor unique for flow without
dilation: it falls by 1 to 2 % as the cells are halved, since shear bands become thinner, and it depends on the steps by some
0.5 %.
"""

import numpy as np
from _case import Check, Kind, Result
from _slip_surfaces import best_circle
from common.field_plots import mechanism_field, save_mechanism
from common.results import ROOT
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

HEIGHT, UNIT_WEIGHT = 10.0, 20e3  # m, N/m3
ANGLE = float(np.degrees(np.arctan(0.5)))
SURFACE = HEIGHT * np.array([(0.0, 1.0), (2.0, 1.0), (4.0, 0.0), (6.0, 0.0)])
ELASTIC = {"young": 100e6, "poisson": 0.3}
UNDRAINED = {1.0: 1.448, 1.5: 2.032, 4.0: 2.032}
"""Factor of safety by the strength of the foundation, as a fraction of that of the slope"""


def slope_on_rock(cell, runout):
    """The mesh of the first example with space to move [m], its soil and supports."""
    background = bridge.slope_mesh(
        MPI.COMM_WORLD, height=HEIGHT, angle=ANGLE, crest=1.2 * HEIGHT, cell_size=cell, kind="fitted", runout=runout
    )
    soil = mpm.MohrCoulomb(**ELASTIC, cohesion=0.05 * UNIT_WEIGHT * HEIGHT, friction_angle=20.0)
    return background, soil, [bridge.roller(bridge.LEFT, (1, 0)), bridge.fixed(bridge.BASE)]


def drained_on_rock(cell):
    """The first example."""
    background, soil, supports = slope_on_rock(cell, runout=cell)
    domain, _, facet_tags = bridge.soil_mesh(*background)
    return bridge.QuasiStatic(domain, soil, facet_tags, supports)


def on_ground(cell, depth, beside, slope, foundation, degree=2):
    """A slope on ground of a depth, with two laws, by elements of a degree."""
    shape = {"height": HEIGHT, "angle": ANGLE, "crest": beside, "runout": beside, "depth": depth,
             "cell_size": cell, "far_size": 2 * cell}  # fmt: skip
    mesh = ROOT / "meshes" / "layered_slope.geo"
    domain, cell_tags, facet_tags = bridge.read_mesh(mesh, MPI.COMM_WORLD, parameters=shape)
    supports = [bridge.roller("left", (1, 0)), bridge.roller("right", (1, 0)), bridge.fixed("base")]
    laws = {"slope": slope, "foundation": foundation}
    return bridge.QuasiStatic(domain, laws, facet_tags, supports, degree, cell_tags=cell_tags)


def drained_on_soil(cell):
    """The second example: half of the slope's height of the same soil below it."""
    soil = mpm.MohrCoulomb(**ELASTIC, cohesion=0.05 * UNIT_WEIGHT * HEIGHT, friction_angle=20.0)
    return on_ground(cell, 0.5 * HEIGHT, 1.2 * HEIGHT, soil, soil)


def undrained(cell, strength):
    """The fourth example: a foundation as thick as the slope is high, of a strength as a fraction of that of the slope."""
    slope, foundation = (
        mpm.tresca(**ELASTIC, shear_strength=fraction * 0.25 * UNIT_WEIGHT * HEIGHT) for fraction in (1.0, strength)
    )
    return on_ground(cell, HEIGHT, 2 * HEIGHT, slope, foundation, degree=4)


def circle_bound(strength):
    """The factor of the best slip circle of the fourth example."""

    def undrained_strength(x, y):
        return np.where(y < -1e-9 * HEIGHT, strength, 1.0) * 0.25 * UNIT_WEIGHT * HEIGHT

    return best_circle(SURFACE, undrained_strength, UNIT_WEIGHT, HEIGHT)


def safety(model):
    """The factor of safety under the weight, as a Collapse."""
    return bridge.factor_of_safety(
        model, bridge.Load(unit_weight=UNIT_WEIGHT), start=0.4, first_step=0.2, tolerance=1e-3
    )


def run(quick: bool, folder) -> Result:
    checks, published = [], "Griffiths and Lane 1999; 1.38 by Bishop and Morgenstern 1960"

    # --- 1. Drained soil without dilation, on several meshes --------------------------------------------------------
    for name, model_of in (("on rock", drained_on_rock), ("on half its height of soil", drained_on_soil)):
        for cell in (2.0,) if quick else (2.0, 1.0, 0.5):
            found = safety(model_of(cell))
            title = f"{name}, cells of {cell:g} m"
            # 2 % beside the range from 1.38 to 1.4
            checks.append(Check(f"φ' 20°, ψ 0, {title}", 1.39, published, found.value, 0.0275))
            checks.append(Check(f"failure shown, {title}", 1.0, "1 if a mechanism is found", float(found.failed), 0.0))

    # --- 2. Undrained soil on an equal and a stronger foundation ----------------------------------------------------
    for strength, expected in UNDRAINED.items():
        for cell in (2.0,) if quick else (2.0, 1.4, 1.0):
            result = safety(undrained(cell, strength))
            name = f"undrained, foundation of {strength:g} times the strength, cells of {cell:g} m"
            checks.append(Check(name, expected, "Code_Aster V6.03.507", result.value, 0.02))
            checks.append(Check(f"failure shown, {name}", 1.0, "1 if a mechanism is found", float(result.failed), 0.0))
        checks.append(Check(name, circle_bound(strength), "upper bound by the best slip circle", result.value,
                            0.03 if quick else 0.01, kind=Kind.AT_MOST))  # fmt: skip

    # --- 3. Pictures ------------------------------------------------------------------------------------------------
    for picture, last, flow in (("drained", found, "$\\psi$ = 0"), ("undrained", result, "strong foundation")):
        field = mechanism_field(last.mechanism)
        if field is not None:
            save_mechanism(folder / f"{picture}.png", field, f"Factor of safety {last.value:.3f}, {flow}")
    return Result(checks, {
        "drained.png": "Mechanism of the slope on a layer of soil at the smallest factor for which failure was shown",
        "undrained.png": "The undrained slope slides along the strong foundation, in triangles of degree 4",
    })  # fmt: skip
