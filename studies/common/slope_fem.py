"""The slope as a body of finite elements: options, meshes of several sizes, and the model."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable

from mpi4py import MPI

import fenics_bridge as bridge

from .options import add_choice, add_count, check
from .slope_case import SUPPORTS, add_geometry_options, add_soil_options, check_slope_options, soil_of


def add_fem_slope_options(parser: argparse.ArgumentParser) -> None:
    """Options of the slope, without particles, for studies that look for its collapse."""
    add_geometry_options(parser, cell_size=0.025)
    add_count(parser, "--meshes", 3, "meshes, each twice as fine as the one before; the last has --cell-size")
    add_element_options(parser)
    add_soil_options(parser, dilation_angle=None)


def add_element_options(parser: argparse.ArgumentParser) -> None:
    """Options ``--elements`` and ``--equilibrium``."""
    add_choice(parser, "--elements", "P2", ("P1", "P1-averaged", "P2", "P4"),
               "linear triangles, the same with averaged volumetric strains (not for soil with little cohesion and no dilation), "
               "quadratic ones, or those of degree 4, which are the most accurate for their number of nodes")  # fmt: skip
    add_choice(parser, "--equilibrium", "fine", ("fine", "practice"),
               "out-of-balance force that is accepted, over the forces at work: 1e-8 by Newton's method and 1e-5 by "
               "relaxation, or 1e-2 as in practice")  # fmt: skip


def finite_elements(options: argparse.Namespace) -> dict[str, object]:
    """Arguments of `QuasiStatic` that follow from those options."""
    return {
        "degree": int(options.elements[1]),
        "nmd": options.elements.endswith("averaged"),
        "solver": bridge.PRACTICE if options.equilibrium == "practice" else bridge.Solver(),
    }


def check_fem_slope_options(parser: argparse.ArgumentParser, options: argparse.Namespace) -> None:
    """Fill in what follows from other options, and end with an error where they do not fit together."""
    if options.mesh is None and options.angle in (45, 90):
        options.mesh = "fitted"  # as "crossed", for any cell size
    check_slope_options(parser, options)
    check(parser, options.cell_size <= min(options.height, options.crest),
          lambda: f"--cell-size is {options.cell_size:g}, expected at most --height and --crest")  # fmt: skip
    check(parser, options.cohesion > 0, "--cohesion is 0, expected a number above 0: without it no slope stands")


def mesh_sizes(options: argparse.Namespace) -> list[float]:
    """Cell sizes from coarse to fine [m]; those that do not fit into the slope are left out."""
    largest = min(options.height, options.crest) * (1 + 1e-9)
    sizes = [options.cell_size * 2**k for k in reversed(range(options.meshes))]
    return [size for size in sizes if size <= largest]


def slope_fem(
    options: argparse.Namespace, comm: MPI.Comm, cell_size: float, dilation_angle: float | None = None
) -> bridge.QuasiStatic:
    """Finite elements of the slope, unloaded: rollers on the left, fixed base.

    Args:
        dilation_angle: [degrees], instead of that in the options.

    Note:
        Collective.
    """
    background = bridge.slope_mesh(
        comm, height=options.height, angle=options.angle, crest=options.crest, cell_size=cell_size, kind=options.mesh,
        runout=cell_size,
    )  # fmt: skip
    domain, _, facet_tags = bridge.soil_mesh(*background)
    law = soil_of(options, dilation_angle)
    return bridge.QuasiStatic(domain, law, facet_tags, SUPPORTS, **finite_elements(options))


def weight(unit_weight: float) -> bridge.Load:
    """The load by the slope's unit weight [N/m3]."""
    return bridge.Load(unit_weight=unit_weight)


def step_line(title: str) -> Callable[[bridge.LoadStep], None]:
    """A `progress` for load steps, which prints each step on the first rank."""

    def show(step: bridge.LoadStep) -> None:
        if MPI.COMM_WORLD.rank == 0:
            print(f"{title}: ", end="", file=sys.stderr)
        bridge.print_step(step)

    return show
