"""The ground of the study levee: its laws, its equilibrium, its sides, and the motion that comes in."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

from ..earthquake.site import rock_impedances
from ..files import ROOT
from ..quiet import NOT_REACHED, without_warning
from ..slope.case import GRAVITY
from ..soils import sanisand_of

comm = MPI.COMM_WORLD
SOILS = ("levee", "sand", "stiff")
"""Names in the mesh"""
LEVEE, SAND, STIFF = range(3)
"""Numbers of the laws of the particles"""
GRAINS, WATER = 2650.0, 1000.0
"""Densities [kg/m3]"""
WATER_MODULUS = 2e8
"""Of water with a little air [Pa]"""
AIR_MODULUS = 1.4e5
"""Of the air in the pores of the levee, which is above the water table [Pa]"""
POROSITY = 0.35
"""Of levee and stiffer layer"""
MOIST = {"saturation": 0.5, "conductivity": 1e-9}
"""Of the levee where water flows through the ground: its own stays where it is"""


def loose_sand(a: Namespace) -> mpm.Sanisand:
    """Toyoura sand, with what ``--sanisand`` changes of it."""
    return sanisand_of([f"void_ratio={a.void_ratio}", *a.sanisand])


def too_loose(a: Namespace) -> str:
    """A warning of sand without strength at critical state, towards which undrained sand shears; empty for denser sand."""
    sand = loose_sand(a)
    if sand.void_ratio < sand.critical_void_ratio:
        return ""
    return (
        f"--void-ratio is {sand.void_ratio:g}, and the critical void ratio of the sand is {sand.critical_void_ratio:g} or less: as long as its "
        "water does not drain, such sand loses all of its strength as it shears, and flows under the weight of the levee; lower --void-ratio"
    )


@contextmanager
def void_ratio_named(a: Namespace) -> Iterator[None]:
    """Let an error of the sand's law name the option that probably causes it."""
    try:
        yield
    except mpm.RunError as error:
        if mpm.Sanisand.__name__ not in str(error):
            raise
        sand = loose_sand(a)
        raise mpm.RunError(
            f"{error}; sand of this --void-ratio, {sand.void_ratio:g}, may be too loose to carry its load: lower it (its critical void ratio "
            f"is {sand.critical_void_ratio:g} or less)"
        ) from None


def unit_weights(a: Namespace) -> dict[str, float]:
    """With water below the surface of the ground [N/m3], by soil."""
    porosity = a.void_ratio / (1 + a.void_ratio)
    saturated = GRAVITY * (GRAINS * (1 - porosity) + WATER * porosity)
    return {"levee": a.unit_weight, "sand": saturated, "stiff": saturated}


def laws_at_rest(a: Namespace) -> dict[str, object]:
    """Laws of effective stresses by which the equilibrium is found; the sand has a friction angle instead of cycles."""
    elastic = {"young": a.young, "poisson": a.poisson}
    return {
        "levee": mpm.MohrCoulomb(
            **elastic, cohesion=a.cohesion, friction_angle=a.friction_angle, dilation_angle=a.dilation_angle
        ),
        "sand": mpm.MohrCoulomb(**elastic, cohesion=2e3, friction_angle=33.0),
        "stiff": mpm.LinearElastic(young=a.stiff_young, poisson=a.poisson),
    }


def porosities(a: Namespace) -> dict[str, float]:
    """By soil."""
    return {"levee": POROSITY, "sand": a.void_ratio / (1 + a.void_ratio), "stiff": POROSITY}


def laws_in_motion(a: Namespace) -> list[object]:
    """Laws of the particles: those at rest, and that of the sand under cycles. Of undrained soil, unless its water flows."""
    laws, cyclic, porosity = laws_at_rest(a), loose_sand(a), porosities(a)
    if a.conductivity is not None:
        return [*laws.values(), cyclic]
    modulus = {"levee": AIR_MODULUS, "sand": WATER_MODULUS, "stiff": WATER_MODULUS}
    undrained = [mpm.Undrained(laws[soil], water_modulus=modulus[soil], porosity=porosity[soil]) for soil in SOILS]
    return [*undrained, mpm.Undrained(cyclic, water_modulus=WATER_MODULUS, porosity=porosity["sand"])]


def add_flowing_water(a: Namespace, model: mpm.Model) -> None:
    """Fill the pores up to the surface of the ground with water that flows, and those of the levee in part."""
    model.add_water(
        porosity=porosities(a),
        conductivity={"levee": MOIST["conductivity"], "sand": a.conductivity, "stiff": a.stiff_conductivity},
        saturation={"levee": MOIST["saturation"], "sand": 1.0, "stiff": 1.0},
        modulus=WATER_MODULUS,
        suction_limit=0.0,
    )
    model.set_pore_pressure(lambda x: WATER * GRAVITY * np.maximum(-x[:, 1], 0.0))


def model_in_equilibrium(a: Namespace, motion: mpm.Motion) -> mpm.Model:
    """Levee and ground at rest in cells that rest, on a base that lets the motion in, between free fields."""
    shape = {name: getattr(a, name) for name in ("height", "slope", "crest", "beside", "cell_size")}
    mesh = bridge.read_mesh(
        ROOT / "meshes" / "levee.geo", comm, parameters={**shape, "sand": a.sand_depth, "stiff": a.stiff_depth}
    )
    body, cells, facets = bridge.soil_mesh(*mesh, tag=SOILS)
    supports = [bridge.roller("left", (1, 0)), bridge.roller("right", (1, 0)), bridge.fixed("base")]
    laws, weights = laws_at_rest(a), unit_weights(a)
    fem = bridge.QuasiStatic(body, laws, facets, supports, degree=1, cell_tags=cells, nmd=True)
    fem.reconfigure(pore_pressure=bridge.hydrostatic(0.0))
    with without_warning(NOT_REACHED):  # said by the error
        fem.solve(bridge.Load(unit_weight=weights))
    if not fem.converged:
        raise mpm.InputError(
            f"--height is {a.height:g} m, expected a levee that the ground carries; lower it, or raise --cohesion or --friction-angle"
        )
    model = mpm.Model(bridge.background_mesh(*mesh), laws_in_motion(a))
    for number, soil in enumerate(SOILS):
        model.seed(density=weights[soil] / GRAVITY, per_cell=a.particles_per_cell, cell_tag=soil, material=number)
    model.set_gravity((0.0, -GRAVITY))
    if a.conductivity is not None:
        add_flowing_water(a, model)
    bridge.initialise(model, fem, count_displacement=False, resting=True)
    material = model.particles.material
    model.assign(np.where(material == SAND, len(SOILS), material))  # the back stress ratio is that of the stresses
    far = 50 * (a.sand_depth + a.stiff_depth)  # springs that hardly resist the motion
    model.absorb("base", impedances=rock_impedances(a), thickness=far)
    model.absorb(("left", "right"), free_field=True, thickness=far)
    model.shake(mpm.Motion(motion.time, 0.5 * motion.velocity), direction=(1, 0))
    return model


def speed_of_sand(a: Namespace) -> float:
    """Of small shear waves in the middle of the sand beside the levee [m/s]."""
    sand, middle = loose_sand(a), 0.5 * a.sand_depth
    buoyant = unit_weights(a)["sand"] - WATER * GRAVITY
    pressure = buoyant * middle * (1 + 2 * a.poisson / (1 - a.poisson)) / 3
    stress = np.array([[-pressure] * 3 + [0.0]])
    shear = sand.wave_moduli(stress, np.zeros((1, sand.n_state)))[0, 1]
    return float(np.sqrt(shear * GRAVITY / unit_weights(a)["sand"]))


def damping_of(a: Namespace) -> mpm.Rayleigh:
    """The damping at small strains, as asked for at the first frequency of the sand and at five times that."""
    first = speed_of_sand(a) / (4 * a.sand_depth)
    return mpm.Rayleigh.of_ratio(a.damping_ratio, (first, 5 * first))


def effective_pressure(model: mpm.Model) -> np.ndarray:
    """Mean effective stress p' of the rows of this rank [Pa], compression positive, averaged over nodes. Collective."""
    pressure = -model.particles.stress[:, :3].mean(axis=1)
    return model.average_over_nodes(pressure if model.has_water else pressure - model.state("excess_pore_pressure"))
