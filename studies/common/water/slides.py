"""The slide of a slope that its water brings to failure.

Particles take over from finite elements, under the pore pressures of failure.
"""

from __future__ import annotations

import sys
import warnings
from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import ArrayLike

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge.water import Reservoir
from fenics_bridge.water.boundary import value_at
from fenics_bridge.water.soils import WATER_WEIGHT
from particle_player import Movie

from ..checks import check_effect, say
from ..figures import Pictures
from ..interrupt import Interrupt
from ..lengths import metres
from ..movie import particle_movie
from ..options import add_choice, add_flag, add_number
from ..scenes import scene_of
from ..site.doubts import ends_of_height
from ..site.slides import add_slide_options, slide, slide_pictures
from ..slope.site import SlopeSite
from .site import DAY, by_law, directions_of, time_in_words, vertical_conductivity
from .slopes import Instant, lowest

comm = MPI.COMM_WORLD
HOLDING = 0.9, 0.75, 0.6
"""Parts of the factor of safety by which the strength is divided in the equilibrium that particles take over: the first one with
which linear cells, of averaged strains or without, stand"""

SLIDE_OPTIONS = (
    "--slide-from",
    "--slide-water",
    "--slide-step",
    "--particles-per-cell",
    "--damping",
    "--pic",
    "--nmd",
    "--no-nmd",
    "--time",
)
"""Options that have an effect in a slide only"""

MOST_ENTERING = 0.02
"""Rise of the water in a slide, by water that enters at the surface, over the height of the mesh, above which it is said"""

COME_TO_REST = 0.1
"""Of the largest displacement, that comes in the second half of a slide that ends at rest"""


def add_optional_slide(parser: ArgumentParser) -> None:
    """Option ``--slide``, and those of the slide."""
    p = parser
    add_flag(p, "--slide", "compute the slide by particles if the slope fails")
    add_choice(p, "--slide-from", "failure", ("failure", "lowest"),
               "begin the slide at the first factor of safety below 1, or at the lowest one")  # fmt: skip
    add_choice(p, "--slide-water", "still", ("still", "flows"), "still: pore pressures remain fixed in space as they are at "
               "failure; flows: water flows through the particles and drains at their surface, by implicit steps")  # fmt: skip
    add_number(p, "--slide-step", 0.02, "s", "longest time step of a slide in which water flows", above=0)
    add_slide_options(p, damping=0.0, pic=0.002)


def check_slide(p: ArgumentParser, a: Namespace) -> None:
    """End with an error where the command line names options of a slide that is not computed, or in which water does not flow."""
    check_effect(p, a, a.slide, SLIDE_OPTIONS, "--slide")
    check_effect(p, a, a.slide_water == "flows", ("--slide-step",), "--slide-water flows")


def slide_of(
    a: Namespace, slope: SlopeSite, instants: list[Instant], folder: Path
) -> tuple[dict, list[Movie | None], Pictures, int]:
    """The slide of a slope that fails: entries of the summary, movies, pictures, exit code. Collective.

    Args:
        a: options of `add_optional_slide`.
        instants: of which at least one has a factor below 1.
    """
    failing = [instant for instant in instants if instant.safety.value < 1.0]
    instant = failing[0] if a.slide_from == "failure" else lowest(failing)
    try:
        model, handover, act = handed_over(a, slope, instant)
    except mpm.RunError as error:  # the factors of safety remain
        reason = f"no start of the slide from {time_in_words(instant.time)} on: {error}"
        if comm.rank == 0:
            print(f"{reason}; another --slide-from or --cell-size may have one", file=sys.stderr)
        return {"slide_stopped_because": reason}, [], {}, 1
    scene = scene_of(model, sorted(slope.site.laws))
    step = None
    if a.slide_water == "flows":
        step, act = a.slide_step, lambda: None
        warn_of_entering_water(slope, instant, model, a.time)
        let_water_flow(slope, instant, model)
    unbalanced = model.out_of_balance(nmd=a.slide_water == "still" and a.nmd)
    with Interrupt(comm) as interrupt:
        result, stopped = slide(a, model, folder, interrupt, act, step)
    moved = result.history["largest_displacement_m"][-1]
    if comm.rank == 0:
        print(f"slide from {time_in_words(instant.time)} on: largest displacement {metres(moved)} after "
              f"{result.history['time_s'][-1]:.3g} s")  # fmt: skip
        if stopped:
            print(f"the slide ended early: {stopped}", file=sys.stderr)
    summary = {
        "slide_from_days": instant.time / DAY, "slide_stopped_because": stopped, "largest_displacement_m": moved,
        "slide_comes_to_rest": stopped is None and comes_to_rest(result.history),
        "initial_out_of_balance_ratio": max(handover.unbalanced_ratio, unbalanced),
        "newly_yielded_fraction": handover.yielded_fraction,
        "particles": comm.allreduce(len(model.particles)),
    }  # fmt: skip
    movies = [particle_movie(f"slide after {time_in_words(instant.time)}", scene, result.frames)]
    code = interrupt.exit_code or (1 if stopped else 0)
    return summary, movies, slide_pictures(a, result, scene, folder), code


def comes_to_rest(history: Mapping[str, np.ndarray]) -> bool:
    """Whether the largest displacement hardly grows in the second half of a slide."""
    time, displacement = history["time_s"], history["largest_displacement_m"]
    return bool(displacement[-1] - np.interp(0.5 * time[-1], time, displacement) <= COME_TO_REST * displacement[-1])


def let_water_flow(slope: SlopeSite, instant: Instant, model: mpm.Model) -> None:
    """Fill the pores of the particles with the water of an instant, and let what stands beside the slope stand over it.

    Collective. The soil is saturated: water leaves, and may enter, at its surface without pressure.
    """
    model.particles.set("traction", np.zeros_like(model.particles.position))
    soils = slope.porous
    directions = directions_of(by_law(soils, slope.site))
    model.add_water(
        porosity={name: soil.porosity for name, soil in soils.items()},
        conductivity={name: vertical_conductivity(soil) for name, soil in soils.items()},
        anisotropy=directions and 2 * directions,  # `handed_over` has two laws for each soil
        drained_surface=True,
    )
    model.set_pore_pressure(lambda points: np.maximum(instant.pore_pressure(points), 0.0))
    reservoirs = [condition for condition in slope.boundary if isinstance(condition, Reservoir)]
    if reservoirs:
        model.stand_water(value_at(reservoirs[0].level, instant.time))


def rise_of_water(conductivity: ArrayLike, modulus: ArrayLike, time: float) -> Any:
    """Head [m] by which water that enters at the surface of saturated soil without pressure raises that at the water table below.

    The head is the height down to the water table, and level below it. Consolidation smooths this bend, at which it then has
    sqrt(c t / pi), c = k M / gamma_w (Carslaw & Jaeger 1959, Conduction of heat in solids, ch. 2).

    Args:
        conductivity: k [m/s]; modulus: oedometric modulus M [Pa], of one soil or of each particle.
        time: t [s].
    """
    return np.sqrt(np.multiply(conductivity, modulus) / WATER_WEIGHT * time / np.pi)


def warn_of_entering_water(slope: SlopeSite, instant: Instant, model: mpm.Model, time: float) -> None:
    """Warn of soil above the water table into which much water would enter at its surface within the time [s] of a slide. Collective.

    Args:
        model: the particles, as yet without water, each soil of which has two laws.
    """
    soils, p = by_law(slope.porous, slope.site), model.particles
    dry, height = instant.pore_pressure(p.position) <= 0, p.position[:, -1]
    conductivity = np.array([vertical_conductivity(soil) for soil in 2 * soils])[p.material]
    rise = np.where(dry, rise_of_water(conductivity, model.wave_moduli()[:, 0], time), 0.0).max(initial=0.0)
    ends = [height[rows].max(initial=-np.inf) for rows in (dry, ~dry)]
    largest, top, table = (comm.allreduce(float(value), MPI.MAX) for value in (rise, *ends))
    low, high = ends_of_height(slope.body[0])
    if min(largest, top - table) > MOST_ENTERING * (high - low):
        say(f"--slide-water is flows: soil above the water table is taken as saturated, and water enters at its surface as fast as it can flow, which "
            f"raises the head there by some {min(largest, top - table):.2g} m in the {time:g} s of the slide, sqrt(k M t / pi gamma_w), and the slide "
            "goes too far; take --slide-water still, or a shorter --time")  # fmt: skip


def require_one_level(slope: SlopeSite, end: float) -> None:
    """Require that all reservoirs have one level up to a time [s], since flowing water stands over particles up to one.

    Raises:
        InputError: they have different ones.
    """
    reservoirs = [condition for condition in slope.boundary if isinstance(condition, Reservoir)]
    for time in (0.0, *slope.times(end), end):
        levels = {condition.facet_tag: value_at(condition.level, time) for condition in reservoirs}
        if levels and np.ptp(list(levels.values())) > 1e-9 * max(1.0, *map(abs, levels.values())):
            texts = ", ".join(f"{level:g} m at {name!r}" for name, level in levels.items())
            raise mpm.InputError(f"--slide-water is flows and the reservoirs have different levels, {texts} after {time_in_words(time)}; "
                                 "expected one level, or --slide-water still")  # fmt: skip


def handed_over(
    a: Namespace, slope: SlopeSite, instant: Instant
) -> tuple[mpm.Model, bridge.Handover, Callable[[], None]]:
    """Particles at an instant of failure: in equilibrium with a strength with which the slope stands, then with their own.

    Collective. Pore pressures stay in space as they are at this instant, without suction, while the soil moves through them; the
    function that is returned too lets them act on the particles where these are now.
    """
    site = slope.site

    def pressure(points: np.ndarray) -> np.ndarray:
        return np.maximum(instant.pore_pressure(points), 0.0)

    # Implicit steps, where water flows, average strains only.
    nmd = a.nmd and a.slide_water == "still"
    for part in HOLDING:
        stronger = bridge.reduced_strength(site.laws, part * instant.safety.value)
        fem = slope.elements(1, pressure, stronger, nmd=nmd, solver=bridge.Solver(tolerance=1e-10), as_particles=nmd)
        with warnings.catch_warnings():  # of a load that is not reached: said below
            warnings.simplefilter("ignore", RuntimeWarning)
            fem.solve(site.load())
        if fem.converged:
            break
    else:
        raise mpm.RunError(f"the particles find no initial equilibrium at {time_in_words(instant.time)}")
    model = site.particles(a.particles_per_cell, stronger, more=list(site.laws.values()))
    nodal = pressure(model.mesh.points)

    def act() -> None:
        model.particles.set("traction", bridge.seepage_forces(model, lambda points: nodal))

    act()
    handover = bridge.initialise(model, fem, count_displacement=False, nmd=nmd)
    model.assign(model.particles.material + len(site.laws))
    return model, handover, act
