"""The slope of several studies: its options, mesh, soil, supports and initial stresses."""

from __future__ import annotations

import argparse
import math
import sys
import warnings
from dataclasses import dataclass

import numpy as np
from mpi4py import MPI
from mpm_core.input_warnings import in_radians
from mpm_core.law_warnings import angles_in_radians
from mpm_core.probes import nearest_particle

import fenics_bridge as bridge
import mpm_core as mpm

from ..checks import check_cells, say
from ..options import add_choice, add_number, check
from ..plots import Scene
from ..quiet import NOT_REACHED, without_warning
from ..scenes import scene_of
from ..schemes import add_particles_per_cell
from ..soils import add_law_options, add_parameter, check_law_options, law_of

GRAVITY = 9.81
"""[m/s2]; unit weights are turned into densities with it."""
SUPPORTS = [bridge.roller(bridge.LEFT, (1, 0)), bridge.fixed(bridge.BASE)]
"""Supports of the finite elements of the slope; those of the particles are the same."""
MANY_CELLS = 20_000
"""Number of triangles above which finite elements may take minutes near the strength of the slope (docs/howto/limits.md)."""


def add_slope_options(parser: argparse.ArgumentParser, **law: str | float | None) -> None:
    """Options of the slope's geometry, mesh, particles and soil; the defaults are the paper's, section 6.

    Args:
        law: of `add_law_options`.
    """
    slope = parser.add_argument_group("slope and soil")
    add_geometry_options(slope, "a tenth")
    add_number(slope, "--runout-length", None, "m", "length of the background mesh beyond the toe (default: twice the height)",
               above=0)  # fmt: skip
    add_number(slope, "--headroom", None, "m", "height of the background mesh above the crest, where soil may bulge (default: one cell)",
               at_least=0)  # fmt: skip
    add_particles_per_cell(slope, 10)
    add_number(slope, "--unit-weight", 80e3, "N/m3", "unit weight of the soil", above=0)
    add_soil_options(slope, dilation_angle=0.0)
    add_law_options(parser, **law)


def add_geometry_options(parser: argparse.ArgumentParser, cell_size: str) -> None:
    """Options of the slope's shape and of the mesh, which `check_slope_options` fills in; `cell_size` says which part of the
    height a cell has by default."""
    add_number(parser, "--height", 1.0, "m", "height of the slope", above=0)
    add_number(parser, "--angle", 45.0, "degrees", "inclination of the slope", above=0, at_most=90)
    add_number(parser, "--crest", None, "m", "length of the level crest (default: 1.1 times the height)", above=0)
    add_number(parser, "--cell-size", None, "m", f"side of the squares or of the triangles (default: {cell_size} of the height)",
               above=0)  # fmt: skip
    add_choice(parser, "--mesh", None, ("crossed", "fitted", "gmsh"),
               "squares divided by their diagonals, the same stretched to fit the slope, or unstructured triangles (default: the "
               "first of these that suits the angle)")  # fmt: skip


def add_soil_options(parser: argparse.ArgumentParser, dilation_angle: float | None) -> None:
    """Options of the soil; without a default for the dilation angle it is the friction angle: associated flow."""
    for name, default in [("young", 200e3), ("poisson", 0.33), ("cohesion", 1e3), ("friction_angle", 25.0)]:
        add_parameter(parser, mpm.MohrCoulomb, name, default)
    associated = "" if dilation_angle is not None else " (default: equal, associated flow)"
    add_number(parser, "--dilation-angle", dilation_angle, "degrees",
               "dilation angle, at most the friction angle" + associated, at_least=0)  # fmt: skip


def check_slope_options(parser: argparse.ArgumentParser, options: argparse.Namespace, cells: int = 10) -> None:
    """Fill in what follows from other options, and end with an error where they do not fit together; by default the slope is
    `cells` cells high."""
    for name, length in [("crest", 1.1), ("runout_length", 2.0), ("cell_size", 1 / cells)]:
        if getattr(options, name, 0.0) is None:
            setattr(options, name, round(length * options.height, 12))
    if options.dilation_angle is None:
        options.dilation_angle = options.friction_angle
    check(parser, options.dilation_angle <= options.friction_angle,
          lambda: f"--dilation-angle is {options.dilation_angle:g}, expected at most --friction-angle, "
                  f"{options.friction_angle:g} degrees")  # fmt: skip
    check(parser, options.cell_size <= min(options.height, options.crest),
          lambda: f"--cell-size is {options.cell_size:g} m, expected at most --height, {options.height:g} m, and --crest, "
                  f"{options.crest:g} m")  # fmt: skip
    _check_mesh(parser, options)
    say(in_radians("--angle", options.angle))
    if getattr(options, "material", None) is not None:
        check_law_options(parser, options)


def _check_mesh(parser: argparse.ArgumentParser, options: argparse.Namespace) -> None:
    """Choose the kind of mesh, and end with an error where the kind or the number of cells does not fit the slope."""
    height, crest, size, angle = options.height, options.crest, options.cell_size, options.angle
    length = crest + height / math.tan(math.radians(angle)) + getattr(options, "runout_length", 0.0)
    headroom = getattr(options, "headroom", None)
    cells = 4 * length * (height + (size if headroom is None else headroom)) / size**2
    check_cells(parser, options, cells, "--cell-size", "--height", "--angle", "--crest")
    kinds = {"crossed": angle in (45, 90), "fitted": 11.4 <= angle <= 78.6 or angle == 90, "gmsh": True}
    options.mesh = options.mesh or next(kind for kind, suits in kinds.items() if suits)
    kinds["crossed"] &= all(abs(round(n) - n) <= 1e-9 * n for n in (height / size, crest / size))
    suited = [kind for kind, suits in kinds.items() if suits]
    check(parser, options.mesh in suited, lambda: f"--mesh is {options.mesh}, expected {' or '.join(suited)} for --angle "
          f"{angle:g}, --height {height:g}, --crest {crest:g} and --cell-size {size:g}: crossed needs 45 or 90 degrees and whole "
          "cells, fitted 11.4 to 78.6 or 90 degrees")  # fmt: skip


def slope_options(arguments: list[str]) -> argparse.Namespace:
    """The options of a slope, given as on a command line, with the defaults of the others."""
    parser = argparse.ArgumentParser()
    add_slope_options(parser)
    options = parser.parse_args(arguments)
    check_slope_options(parser, options)
    return options


@dataclass
class SlopeCase:
    """The slope as a particle model on its background mesh."""

    args: argparse.Namespace
    domain: object
    cell_tags: object
    facet_tags: object
    soil: object
    model: mpm.Model
    fem: bridge.QuasiStatic | None = None
    """Finite elements that the particles had their stresses from."""

    @property
    def toe(self) -> float:
        """Abscissa of the toe before the slide [m]."""
        return self.args.crest + self.args.height / np.tan(np.radians(self.args.angle))

    def scene(self) -> Scene | None:
        """The whole background mesh for pictures, on the first rank; None on the others. Collective."""
        return scene_of(self.model, [bridge.SOIL])

    def crest_particle(self) -> int:
        """Number of the particle that started nearest to the crest, of several as near the highest number. Collective."""
        return nearest_particle(self.model, (self.args.crest, self.args.height))

    @property
    def surface(self) -> np.ndarray:
        """Ground surface before the slide, polyline of points (x, y) [m]."""
        a = self.args
        return np.array([(0.0, a.height), (a.crest, a.height), (self.toe, 0.0)])


def soil_of(args: argparse.Namespace, dilation_angle: float | None = None) -> mpm.MohrCoulomb:
    """The soil that the options describe; with another dilation angle [degrees] if given."""
    return mpm.MohrCoulomb(
        young=args.young,
        poisson=args.poisson,
        cohesion=args.cohesion,
        friction_angle=args.friction_angle,
        dilation_angle=args.dilation_angle if dilation_angle is None else dilation_angle,
    )


def build_slope(args: argparse.Namespace, comm: MPI.Comm) -> SlopeCase:
    """Mesh, particles, supports and gravity; no stresses yet. Collective."""
    soil = law_of(args)
    domain, cell_tags, facet_tags = bridge.slope_mesh(
        comm,
        height=args.height,
        angle=args.angle,
        crest=args.crest,
        cell_size=args.cell_size,
        kind=args.mesh,
        runout=args.runout_length,
        headroom=args.headroom,
    )
    model = mpm.Model(bridge.background_mesh(domain, cell_tags, facet_tags), soil)
    model.seed(density=args.unit_weight / GRAVITY, per_cell=args.particles_per_cell, cell_tag=bridge.SOIL)
    model.roller(bridge.LEFT, normal=(1, 0))
    model.fix(bridge.BASE)
    model.set_gravity((0.0, -GRAVITY))
    return SlopeCase(args, domain, cell_tags, facet_tags, soil, model)


def why_ended(error: mpm.RunError, args: argparse.Namespace) -> str:
    """Why a slide ended early: the text of its error, and the options of a longer or higher mesh where soil has left it."""
    text = str(error)
    if "left the background mesh" not in text:
        return text
    headroom = args.cell_size if args.headroom is None else args.headroom
    return (
        f"{text}; what leaves it beyond the toe needs more --runout-length than {args.runout_length:g} m, what leaves it at its top "
        f"more --headroom than {headroom:g} m"
    )


def initialise(case: SlopeCase, kind: str, unit_weight: float, nmd: bool = False) -> dict[str, float]:
    """Give the particles their initial stresses: "fem", "elastic", "k0" or "zero"; in equilibrium for steps with or without
    averaged forces (``nmd``; implicit steps do not average them).

    Returns its results for the summary, by name: the ratio of out-of-balance to external force under that unit weight [-]
    (1 without stresses) and, after "fem", how the hand-over went. Collective.
    """
    gravity = (0.0, -GRAVITY * unit_weight / case.args.unit_weight)
    if kind == "fem":
        return hand_over(case, unit_weight, gravity, nmd)
    particles = case.model.particles
    if kind == "elastic":
        particles.set("stress", elastic_stress(case, unit_weight, nmd))
    elif kind == "k0":
        k0 = bridge.k0_elastic(case.args.poisson)
        particles.set("stress", bridge.k0_stress(particles.position, case.surface, unit_weight, k0))
    return {"initial_out_of_balance_ratio": case.model.out_of_balance(gravity, nmd=nmd)}


def hand_over(case: SlopeCase, unit_weight: float, gravity: tuple[float, float], nmd: bool) -> dict[str, float]:
    """Stresses and states of elasto-plastic equilibrium under the initial unit weight, brought to rest in the particles.

    Linear triangles, the particles' own soil cells: so the particles balance their weight as soon as they have the stresses.
    Displacements count from the state that is handed over. Collective.
    """
    model = case.model
    case.fem = fem = solved_fem(case, unit_weight, nmd)
    model.set_gravity(gravity)
    report = bridge.initialise(model, fem, count_displacement=False, nmd=nmd)
    model.set_gravity((0.0, -GRAVITY))
    return {
        "initial_out_of_balance_ratio": report.unbalanced_ratio,
        "equilibrated_out_of_balance_ratio": report.equilibrated_ratio,
        "newly_yielded_fraction": report.yielded_fraction,
        "returned_to_strength_fraction": report.returned_fraction,
    }


def solved_fem(case: SlopeCase, unit_weight: float, nmd: bool = False) -> bridge.QuasiStatic:
    """Elasto-plastic equilibrium of the soil body under a unit weight, on the particles' soil cells.

    Raises InputError, on all ranks, when the slope does not carry the unit weight. Collective.
    """
    fem = soil_fem(case, nmd)
    mesh = fem.displacement.function_space.mesh
    cells = mesh.topology.index_map(2).size_global
    if cells > MANY_CELLS and mesh.comm.rank == 0:
        print(
            f"initial stresses: finite elements on {cells:,} triangles under {unit_weight:g} N/m3; near the strength of the slope "
            "this can take half an hour. A smaller --initial-unit-weight or --initial elastic is faster",
            file=sys.stderr,
            flush=True,
        )
    with without_warning(NOT_REACHED):  # said by the error
        fem.solve(bridge.Load(unit_weight=unit_weight))
    if not fem.converged:
        radians = angles_in_radians(fem.laws)
        raise mpm.InputError(
            f"--initial-unit-weight is {unit_weight:g} N/m3, which the slope does not carry: the finite elements found no equilibrium "
            f"above {fem.load.unit_weight:.5g} N/m3; lower --initial-unit-weight, or give the soil more strength"
            + (f". Note that {radians}" if radians else "")
        )
    return fem


def soil_fem(case: SlopeCase, nmd: bool = False, soil: object = None) -> bridge.QuasiStatic:
    """Finite elements, linear triangles, on the particles' soil cells, unloaded; of another soil if given. Collective.

    Particles that take their stresses over are as far out of balance, so the tolerance is a tight one.
    """
    body, _, facet_tags = bridge.soil_mesh(case.domain, case.cell_tags, case.facet_tags, tag=bridge.SOIL)
    with warnings.catch_warnings():  # the equilibrium is that of the particles' cells, which say themselves where they lock
        warnings.simplefilter("ignore", RuntimeWarning)
        return bridge.QuasiStatic(
            body,
            case.soil if soil is None else soil,
            facet_tags,
            SUPPORTS,
            degree=1,
            nmd=nmd,
            solver=bridge.Solver(tolerance=1e-10),
            as_particles=nmd,
        )


def elastic_stress(case: SlopeCase, unit_weight: float, nmd: bool) -> np.ndarray:
    """Stresses at the particles from elastic equilibrium of the soil body under its weight, by FEM: (n, 4) [Pa]. Collective."""
    angles = {name: getattr(case.soil, name, 0.0) for name in ("friction_angle", "dilation_angle")}
    # A strength that is not reached; by which fraction strains are averaged depends on the angles.
    elastic = mpm.MohrCoulomb(
        young=case.args.young, poisson=case.args.poisson, cohesion=1e3 * case.args.young, **angles
    )
    fem = soil_fem(case, nmd, elastic)
    fem.solve(bridge.Load(unit_weight=unit_weight))
    return fem.evaluate_at(case.model.particles.position)["stress"]
