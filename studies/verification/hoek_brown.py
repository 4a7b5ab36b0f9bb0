"""Rock masses by the criterion of Hoek and Brown: a tunnel, a strip footing, and a slope.

The tunnel is a circle in a ring of rock under a pressure from all sides. As the pressure on its wall falls, a ring around it
becomes plastic; radial stresses there follow from equilibrium, and the displacements of the wall from the elastic strains of
rock that does not dilate. The strip footing is smooth and stands on weightless rock whose flow is associated; its collapse load
follows from the method of characteristics, in which the mean stress grows along a fan of a right angle by
dC / dθ = 2 R / cos φ with the radius R and the slope sin φ = dR/dC of Mohr's circles at failure. Half of that load has a factor of
safety by which the shear strengths under all normal stresses are divided; the characteristics of the divided envelope
find the same factor. The slope is the first example of Hammah, Yacoub, Corkum and Curran (2005), The shear strength
reduction method for the generalized Hoek-Brown criterion, Alaska Rocks.
"""

import numpy as np
from _case import Check, Kind, Result
from _plots import save_comparison
from common.field_plots import mechanism_field, save_mechanism
from common.files import ROOT
from mpi4py import MPI
from scipy.integrate import cumulative_trapezoid, quad, trapezoid
from scipy.optimize import brentq

import fenics_bridge as bridge
import mpm_core as mpm

# --- 1. The tunnel: equilibrium in the plastic ring, Lamé's solution outside of it ------------------------------------

ROCK = mpm.HoekBrown(young=5e9, poisson=0.3, intact_strength=30e6, geological_strength_index=50.0, intact_constant=4.0)
# m, m, Pa: the rock between them yields without flow along the axis of the tunnel
WALL, OUTER, FAR_STRESS = 1.0, 3.0, 2.5e6
BOTTOM, LEFT, OUTSIDE, CHORDS = 1, 2, 3, 100
"""Facet tags of meshes/cylinder.geo; each chord of the wall has its own from CHORDS on."""


def allowed(rock, stress):
    """Difference of the extreme principal stresses at failure under the smallest one."""
    q = rock.intact_strength
    return q * (rock.m_b * stress / q + rock.s) ** rock.a


def radial_stress(r, inside):
    """In the plastic ring: dσ_r / dr = (σ_θ - σ_r) / r, compression positive; ``inside`` is the pressure on the wall."""
    q, rest = ROCK.intact_strength, 1 - ROCK.a
    power = (ROCK.m_b * inside / q + ROCK.s) ** rest + rest * ROCK.m_b * np.log(r / WALL)
    return (power ** (1 / rest) - ROCK.s) * q / ROCK.m_b


def lame(plastic, inside):
    """A and B of σ_r = A - B / r², σ_θ = A + B / r² outside of a plastic ring, and what its stress at OUTER is too large by."""
    at_edge = radial_stress(plastic, inside)
    b = allowed(ROCK, at_edge) / 2 * plastic**2
    a = at_edge + b / plastic**2
    return a, b, a - b / OUTER**2 - FAR_STRESS


def convergence(inside):
    """How far the wall has come inwards [m], and the radius of the plastic ring [m]."""
    young, poisson = ROCK.young, ROCK.poisson
    b = (FAR_STRESS - inside) / (1 / WALL**2 - 1 / OUTER**2)
    a, plastic = inside + b / WALL**2, WALL
    if 2 * b / WALL**2 > allowed(ROCK, inside):
        plastic = brentq(lambda r: lame(r, inside)[2], WALL, OUTER)
        a, b, _ = lame(plastic, inside)
    shear = (1 + poisson) / young
    at_edge = shear * ((1 - 2 * poisson) * (a - FAR_STRESS) * plastic + b / plastic)

    def volume(r):  # elastic strain of the ring, in which the stress along the axis is the intermediate one
        radial = radial_stress(r, inside)
        return shear * (1 - 2 * poisson) * (2 * radial + allowed(ROCK, radial) - 2 * FAR_STRESS) * r

    ring = quad(volume, WALL, plastic, epsabs=0)[0] if plastic > WALL else 0.0
    return (plastic * at_edge - ring) / WALL, plastic


def tunnel(rings, pressures):
    """Convergence of the wall [m] and radius of the plastic ring [m] by finite elements as the pressure inside falls."""
    arcs, comm = round(1.5 * rings), MPI.COMM_WORLD
    parameters = {"inner": WALL, "outer": OUTER, "rings": rings, "arcs": arcs}
    domain, _, facet_tags = bridge.read_mesh(ROOT / "meshes" / "cylinder.geo", comm, parameters=parameters)
    supports = [bridge.roller(BOTTOM, (0, 1)), bridge.roller(LEFT, (1, 0))]
    fem = bridge.QuasiStatic(domain, ROCK, facet_tags, supports, degree=2)

    def load(pressure):
        return bridge.Load(pressure={CHORDS + k: pressure for k in range(arcs)} | {OUTSIDE: FAR_STRESS})

    fem.set_initial_stress(np.tile([-FAR_STRESS] * 3 + [0.0], (fem.points.n, 1)), load(FAR_STRESS))
    found = []
    for pressure in pressures:
        fem.solve(load(pressure))
        own = np.array([[WALL, 0.0]]) if comm.rank == 0 else np.empty((0, 2))
        moved = comm.bcast(bridge.evaluate_at(own, displacement=fem.displacement)["displacement"][:1, 0])[0]
        yields = fem.points.state[:, 0] > 1e-9
        radius = np.hypot(*fem.points.coordinates()[yields].T).max(initial=WALL)
        found.append((-moved, comm.allreduce(radius, MPI.MAX)))
    return np.array(found)


# --- 2. The footing: characteristics -------------------------------------------------------------------------------------

HALF_WIDTH, AXIS, BASE, FAR, FOOTING = 0.5, 1, 2, 3, 5  # m, and the facet tags of meshes/footing.geo


def circles(rock, factor):
    """Centres C, radii R [Pa] and friction angles [radians] of Mohr's circles that touch the divided envelope, rising."""
    stress = np.geomspace(1e-6, 1, 200_001) * 10 * rock.intact_strength - rock.s * rock.intact_strength / rock.m_b
    q = rock.intact_strength
    slope = rock.a * rock.m_b * (rock.m_b * stress / q + rock.s) ** (rock.a - 1)
    normal = stress + allowed(rock, stress) / (2 + slope)
    shear = allowed(rock, stress) * np.sqrt(1 + slope) / (2 + slope) / factor
    phi = np.arctan(slope / (2 * np.sqrt(1 + slope)) / factor)
    return normal + shear * np.tan(phi), shear / np.cos(phi), phi


def bearing_capacity(rock, factor=1.0):
    """Pressure [Pa] below the footing at collapse, and the length [m] of ground beside it that fails."""
    centre, radius, phi = circles(rock, factor)
    first = np.searchsorted(centre - radius, 0.0)  # the smallest stress is zero at the surface
    centre, radius, phi = centre[first:], radius[first:], phi[first:]
    turned = cumulative_trapezoid(np.cos(phi) / (2 * radius), centre, initial=0.0)
    at_footing = np.interp(np.pi / 2, turned, np.arange(len(turned)))
    value = [np.interp(at_footing, np.arange(len(turned)), v) for v in (centre, radius, phi)]
    in_fan = turned < np.pi / 2
    growth = np.exp(trapezoid(np.tan(phi[in_fan]), turned[in_fan]))
    beside = 2 * HALF_WIDTH / np.cos(np.pi / 4 + value[2] / 2) * growth * np.cos(np.pi / 4 - phi[0] / 2)
    return value[0] + value[1], beside


def footing(rock, size):
    """Finite elements of the ground, and its load for a pressure below the footing."""
    _, beside = bearing_capacity(rock)
    parameters = {"half_width": HALF_WIDTH, "width": 1.5 * beside, "depth": 0.75 * beside,
                  "edge_size": 0.2 * size, "near_size": size, "far_size": 8 * size}  # fmt: skip
    domain, _, facet_tags = bridge.read_mesh(ROOT / "meshes" / "footing.geo", MPI.COMM_WORLD, parameters=parameters)
    supports = [bridge.roller(AXIS, (1, 0)), bridge.roller(FAR, (1, 0)), bridge.fixed(BASE)]
    fem = bridge.QuasiStatic(domain, rock, facet_tags, supports, degree=2)
    return fem, lambda pressure: bridge.Load(pressure={FOOTING: pressure})


# --- 3. The slope ----------------------------------------------------------------------------------------------------------


def slope(size, ratio):
    """Factor of safety of the slope."""
    domain, cell_tags, facet_tags = bridge.slope_mesh(MPI.COMM_WORLD, 10.0, 45.0, 20.0, size, runout=20.0, depth=5.0)
    rock = mpm.HoekBrown(
        young=5e9, poisson=0.3, intact_strength=30e6, geological_strength_index=5.0, intact_constant=2.0, dilation_ratio=ratio
    )  # fmt: skip
    body, _, body_facets = bridge.soil_mesh(domain, cell_tags, facet_tags, tag=bridge.SOIL)
    supports = [bridge.roller(bridge.LEFT, (1, 0)), bridge.roller(bridge.RIGHT, (1, 0)), bridge.fixed(bridge.BASE)]
    fem = bridge.QuasiStatic(body, rock, body_facets, supports, degree=2)
    return bridge.factor_of_safety(fem, bridge.Load(unit_weight=25e3), tolerance=0.005)


def run(quick: bool, folder) -> Result:
    # --- 4. The tunnel: the wall comes inwards as its pressure falls -------------------------------------------------
    pressures = FAR_STRESS * np.array([0.5, 0.0] if quick else [0.75, 0.5, 0.3, 0.2, 0.1, 0.05, 0.0])
    found = tunnel(16 if quick else 32, pressures)
    expected = np.array([convergence(p) for p in pressures])
    source = "equilibrium, Hoek-Brown criterion, no dilation"
    checks = [
        Check(
            f"convergence of the wall under {p / 1e3:.0f} kPa",
            1e3 * u,
            source,
            1e3 * moved,
            0.01 if quick else 0.002,
            "mm",
        )
        for p, (u, _), (moved, _) in zip(pressures, expected, found)
    ]
    checks.append(Check("radius of the plastic ring, no pressure", expected[-1, 1], source, found[-1, 1],
                        0.03 if quick else 0.01, "m"))  # fmt: skip

    # --- 5. The footing: its collapse load, and the factor of safety of half of it --------------------------------------
    rock = mpm.HoekBrown(young=5e9, poisson=0.3, intact_strength=20e6, geological_strength_index=30.0, intact_constant=8.0,
                         dilation_ratio=1.0)  # fmt: skip
    exact, _ = bearing_capacity(rock)
    model, load = footing(rock, 0.1 if quick else 0.05)
    collapse = bridge.collapse_load(model, load, first_step=0.5e6).value
    checks.append(Check("bearing capacity of a strip footing", exact / 1e6, "method of characteristics, associated flow",
                        collapse / 1e6, 0.02 if quick else 0.01, "MPa"))  # fmt: skip
    divided = brentq(lambda factor: bearing_capacity(rock, factor)[0] - 0.5 * exact, 1.0, 5.0)
    model, load = footing(rock, 0.1 if quick else 0.05)
    safety = bridge.factor_of_safety(model, load(0.5 * exact), tolerance=0.002)
    checks.append(Check("factor of safety under half of that", divided, "characteristics of the divided envelope",
                        safety.value, 0.02 if quick else 0.01))  # fmt: skip

    # --- 6. The slope ------------------------------------------------------------------------------------------------
    by_slope = slope(1.0 if quick else 0.5, 1.0)
    checks.append(Check("factor of safety of a slope of 10 m, 45°", 1.15,
                        "Hammah et al. 2005, finite elements; 1.153 by Bishop's slices", by_slope.value, 0.03))  # fmt: skip
    if not quick:
        checks.append(Check("the same without dilation, at most", by_slope.value, "the slope with associated flow",
                            slope(0.5, 0.0).value, 0.0, kind=Kind.AT_MOST))  # fmt: skip

    # --- 7. Pictures ---------------------------------------------------------------------------------------------------
    picture = mechanism_field(by_slope.mechanism)
    if picture is not None:
        save_mechanism(folder / "rock_slope.png", picture, f"Factor of safety {by_slope.value:.3f}")
    if MPI.COMM_WORLD.rank == 0:
        line = np.linspace(0, FAR_STRESS, 200)
        save_comparison(
            folder / "tunnel.png", {"finite elements": (1e3 * found[:, 0], pressures / 1e6)},
            {"closed form": (1e3 * np.array([convergence(p)[0] for p in line]), line / 1e6)},
            ("Convergence of the wall [mm]", "Pressure on the wall [MPa]"),
        )  # fmt: skip
    return Result(checks, {
        "tunnel.png": "Ground reaction curve of a tunnel: the wall comes inwards as the pressure on it falls",
        "rock_slope.png": "Mechanism of the slope of Hammah et al. (2005) with associated flow",
    })  # fmt: skip
