"""The ground of the study earthquake: its laws, its equilibrium, its sides, and the motion that comes in."""

from __future__ import annotations

from argparse import Namespace
from dataclasses import replace
from pathlib import Path

import numpy as np
from dolfinx.mesh import meshtags
from mpi4py import MPI
from mpm_core.motion import says_its_unit

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import compat
from mpm_core.mesh import cell_sizes

from ..checks import say
from ..followed import FollowedNodes
from ..quiet import NOT_REACHED, without_warning
from ..slope.case import GRAVITY
from .motions import STEP, as_motion, band_limited_noise, ricker

comm = MPI.COMM_WORLD
STIFF = 3
"""Cell tag of the lower layer"""
LARGEST_RECORDED = 25.0
"""Acceleration of rock [m/s2] above which a motion is a mistake in its unit"""
STRONG = 1.0
"""Largest acceleration [m/s2] below which a record whose unit is not named is more probably one in g"""
GAP = 5.0
"""Time between two values of a record, over the usual one, from which on values are missing"""
CELLS_OF_WAVE = 8
"""Least number of cells in a shear wave (Kuhlemeyer and Lysmer 1973, J. Soil Mech. Found. Div. 99)"""
FIELDS = ("displacement", "velocity", "stress", "plastic_strain", "volume", "resting")
"""Of particles and resting cells in the files for ParaView"""


def outcrop_motion(a: Namespace) -> tuple[np.ndarray, np.ndarray, mpm.Motion]:
    """Times [s], accelerations [m/s2] as given, and the motion of the rock's outcrop after the baseline correction."""
    if a.accelerogram is not None:
        time, acceleration = recorded(a)
    elif a.motion == "ricker":
        time, acceleration = ricker(a.frequency, a.peak, a.duration, STEP)
    else:
        time, acceleration = band_limited_noise(
            (0.5 * a.frequency, a.highest_frequency), a.peak, a.duration, STEP, a.seed
        )
    largest = float(np.abs(acceleration).max())
    where = "the unit of --accelerogram (--unit)" if a.accelerogram is not None else "--peak"
    say(f"the largest acceleration of the outcrop is {largest:.3g} m/s2, more than any that was recorded in rock: check {where}"
        if largest > LARGEST_RECORDED else "")  # fmt: skip
    return time, acceleration, as_motion(time, acceleration)


def doubt_record(path: Path, time: np.ndarray, acceleration: np.ndarray, unit_named: bool) -> None:
    """Warn of a gap in a record [s, m/s2], and of a weak one whose unit is not named."""
    largest, steps = float(np.abs(acceleration).max()), np.diff(time)
    say(f"the largest acceleration of --accelerogram {path} is {largest:.3g} m/s2, as its values are taken in m/s2 without --unit; name "
        "their unit" if largest < STRONG and not unit_named else "")  # fmt: skip
    longest, usual = int(steps.argmax()), float(np.median(steps))
    say(f"--accelerogram {path} has no values from {time[longest]:.6g} to {time[longest + 1]:.6g} s, between steps of {usual:.3g} s: its "
        "acceleration is taken as linear there" if steps[longest] > GAP * usual else "")  # fmt: skip


def recorded(a: Namespace) -> tuple[np.ndarray, np.ndarray]:
    """Times from the first on [s] and accelerations [m/s2] in the file of ``--accelerogram``.

    Without ``--unit`` they are in that of a PEER file, or in m/s2.
    """
    path = a.accelerogram
    if not any(line.split("#")[0].strip() for line in path.read_text(errors="replace").splitlines()):
        raise mpm.InputError(f"--accelerogram {path} is empty")
    try:
        unit_named = a.unit is not None or says_its_unit(path)
        time, acceleration = mpm.read_acceleration(path, unit=a.unit if unit_named else "m/s2")
    except mpm.InputError as error:
        raise mpm.InputError(f"--accelerogram: {error}") from None
    doubt_record(path, time, acceleration, unit_named)
    return time - time[0], acceleration


def wave_speeds(a: Namespace) -> tuple[float, float]:
    """Of shear waves in soil and stiffer layer [m/s]."""
    soil, stiff = (
        float(np.sqrt(young / (2 * (1 + a.poisson)) * GRAVITY / a.unit_weight)) for young in (a.young, a.stiff_young)
    )
    return soil, stiff


def first_frequency(a: Namespace) -> float:
    """Of the soil below the crest, on a rigid base [Hz]."""
    return wave_speeds(a)[0] / (4 * (a.height + a.soil_depth))


def damping_of(a: Namespace) -> mpm.Rayleigh:
    """The damping at small strains: as asked for at the first frequency of the soil below the crest, and at five times that."""
    first = first_frequency(a)
    return mpm.Rayleigh.of_ratio(a.damping_ratio, (first, 5 * first))


def band_of(a: Namespace) -> tuple[float, float]:
    """Lowest and highest frequency at which the motion is looked at [Hz]."""
    return 0.5 * a.frequency, a.highest_frequency if a.motion == "noise" else 2 * a.frequency


def too_coarse(a: Namespace, speed: float, soil: str = "the softer soil") -> str:
    """A warning of cells that are too large for shear waves of the highest frequency; empty for others.

    Args:
        speed: of shear waves in a soil [m/s], and its name.
    """
    highest, option = band_of(a)[1], "--highest-frequency" if a.motion == "noise" else "--frequency"
    length = speed / highest
    if a.cell_size <= length / CELLS_OF_WAVE * (1 + 1e-9):
        return ""
    return (
        f"--cell-size is {a.cell_size:g} m, expected {length / CELLS_OF_WAVE:.3g} m at most, an eighth of a shear wave of {highest:g} Hz in "
        f"{soil}: higher frequencies hardly pass through larger cells; lower it or {option}"
    )


def ground(a: Namespace) -> tuple:
    """Mesh, cell tags and facet tags: the slope, with the stiffer layer below."""
    domain, cells, facets = bridge.slope_mesh(
        comm, a.height, a.angle, a.level, a.cell_size, "fitted", runout=a.level, depth=a.soil_depth + a.stiff_depth
    )
    middle = domain.geometry.x[compat.cell_nodes(domain)].mean(axis=1)[cells.indices, 1]
    values = np.where((cells.values == bridge.SOIL) & (middle < -a.soil_depth), STIFF, cells.values).astype(np.int32)
    names = {"soil": bridge.SOIL, "empty": bridge.EMPTY, "stiff": STIFF}
    return domain, bridge.name_tags(meshtags(domain, domain.topology.dim, cells.indices, values), names), facets


def laws_of(a: Namespace) -> dict[int, object]:
    """Laws of soil and stiffer layer, by cell tag."""
    soil = mpm.MohrCoulomb(young=a.young, poisson=a.poisson, cohesion=a.cohesion, friction_angle=a.friction_angle,
                           dilation_angle=a.dilation_angle)  # fmt: skip
    return {bridge.SOIL: soil, STIFF: mpm.LinearElastic(young=a.stiff_young, poisson=a.poisson)}


def rock_impedances(a: Namespace) -> tuple[float, float]:
    """For compression and shear waves, at a Poisson's ratio of a quarter [kg/(m2 s)]."""
    shear = a.rock_density * a.rock_speed
    return np.sqrt(3.0) * shear, shear


def model_in_equilibrium(a: Namespace, motion: mpm.Motion) -> mpm.Model:
    """The ground at rest in cells that rest, on a base that lets the motion in, between free fields."""
    mesh = ground(a)
    body, body_cells, body_facets = bridge.soil_mesh(*mesh, tag=("soil", "stiff"))
    supports = [bridge.roller(bridge.LEFT, (1, 0)), bridge.roller(bridge.RIGHT, (1, 0)), bridge.fixed(bridge.BASE)]
    laws = laws_of(a)
    fem = bridge.QuasiStatic(body, laws, body_facets, supports, degree=1, cell_tags=body_cells,
                             solver=bridge.Solver(tolerance=1e-10))  # fmt: skip
    with without_warning(NOT_REACHED):  # said by the error
        fem.solve(bridge.Load(unit_weight=a.unit_weight))
    if not fem.converged:
        raise mpm.InputError(
            f"--unit-weight is {a.unit_weight:g} N/m3, which the slope does not carry; lower it or raise --cohesion"
        )
    model = mpm.Model(bridge.background_mesh(*mesh), fem.laws)
    for tag, law in laws.items():
        model.seed(
            density=a.unit_weight / GRAVITY, per_cell=a.particles_per_cell, cell_tag=tag, material=fem.laws.index(law)
        )
    model.set_gravity((0.0, -GRAVITY))
    bridge.initialise(model, fem, count_displacement=False, resting=True)
    far = 50 * a.height  # springs that hardly resist the motion, but what a slide changes in the forces at the sides
    model.absorb(bridge.BASE, impedances=rock_impedances(a), thickness=far)
    model.absorb((bridge.LEFT, bridge.RIGHT), free_field=True, thickness=far)
    model.shake(mpm.Motion(motion.time, 0.5 * motion.velocity), direction=(1, 0))
    return model


def column_layers(a: Namespace) -> tuple[float, float]:
    """Thickness of soil and of the stiffer layer behind the crest, of whole cells [m]."""
    soil, stiff = (a.cell_size * round(depth / a.cell_size) for depth in (a.height + a.soil_depth, a.stiff_depth))
    return soil, stiff


def linear_column(
    a: Namespace, motion: mpm.Motion, until: float, remains: float = np.inf
) -> tuple[np.ndarray, np.ndarray]:
    """Times and velocities at the surface of a linear column of the ground behind the crest, one cell wide.

    Args:
        until: time of the end, in whole intervals of 2 `STEP`, or the next one [s].
        remains: part of the largest velocity below which the last fifth has to be; otherwise the column is followed up to ten times
            as long.
    """
    soil, stiff = column_layers(a)
    size, height, counts = (a.cell_size, soil + stiff), stiff, round((soil + stiff) / a.cell_size)
    mesh = bridge.box_mesh(MPI.COMM_SELF, size, (1, counts), body=((-1, height), (2 * a.cell_size, size[1] + 1)))
    model = mpm.Model(bridge.background_mesh(*mesh), [mpm.LinearElastic(young=young, poisson=a.poisson)
                                                      for young in (a.young, a.stiff_young)])  # fmt: skip
    for material, tag in enumerate((bridge.BODY, 0)):
        model.seed(density=a.unit_weight / GRAVITY, per_cell=a.particles_per_cell, cell_tag=tag, material=material)
    for side in range(1, 5):
        model.roller(side, normal=(0, 1))
    model.rest()
    model.absorb(3, impedances=rock_impedances(a))
    model.shake(mpm.Motion(motion.time, 0.5 * motion.velocity), direction=(1, 0))
    top, rows = FollowedNodes(model, np.array([(0.0, size[1])])), [(0.0, 0.0)]
    every = 2 * STEP
    until = every * np.ceil(until / every - 1e-9)
    for end in until * np.arange(1, 11):
        for report in model.explicit(end, every=every, rayleigh=damping_of(a), conversion=None):
            rows.append((report.time, top.velocity()[0, 0]))
        time, velocity = np.array(rows).T
        if np.abs(velocity[time > end - 0.2 * until]).max() <= remains * np.abs(velocity).max():
            break
    return time, velocity


def conversion_of(a: Namespace, model: mpm.Model, motion: mpm.Motion) -> mpm.Conversion:
    """Criteria by which cells turn into particles: displacements count beyond those of level linear ground. Collective.

    Otherwise a motion of more than a tenth of a cell turns all of the ground into particles, which then leave the mesh at its sides.
    """
    time, velocity = linear_column(a, motion, float(motion.time[-1]))
    moved = np.cumsum(velocity) * (time[1] - time[0])
    smallest = model.comm.allreduce(float(cell_sizes(model.cell_volumes, 2).min(initial=np.inf)), MPI.MIN)
    usual = mpm.Conversion()
    return replace(usual, displacement=usual.displacement + float(np.abs(moved).max()) / smallest)
