"""The slope as a body of finite elements: options, meshes of several sizes, and the model."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Callable

import numpy as np
from dolfinx.mesh import Mesh
from mpi4py import MPI

import fenics_bridge as bridge
from fenics_bridge.types import MeshTags

from ..checks import say
from ..files import ROOT
from ..options import add_choice, add_count, add_number, check
from ..site.laws import unit_doubt
from .case import SUPPORTS, add_geometry_options, add_soil_options, check_slope_options, soil_of

NO_COHESION = (
    "--cohesion is 0, expected a number above 0: without cohesion soil at the surface of a slope has no strength; the factor of safety "
    "of such a slope is tan(friction angle) / tan(angle) where it is dry"
)


def add_fem_slope_options(parser: argparse.ArgumentParser) -> None:
    """Options of the slope, without particles, for studies that look for its collapse."""
    add_geometry_options(parser, "a fortieth")
    add_count(parser, "--meshes", 3, "meshes, each twice as fine as the one before; the last has --cell-size")
    add_element_options(parser)
    add_soil_options(parser, dilation_angle=None)


def add_ground_option(parser: argparse.ArgumentParser) -> None:
    """Option ``--depth``."""
    add_number(parser, "--depth", 0.0, "m", "depth of the rigid base below the toe, in ground of the same soil that reaches "
               "beyond the toe by the slope's height plus twice this depth; 0: the base is at the toe", at_least=0)  # fmt: skip


def add_element_options(parser: argparse.ArgumentParser) -> None:
    """Options ``--elements`` and ``--equilibrium``."""
    add_choice(parser, "--elements", "P2", ("P1", "P1-averaged", "P2", "P4"),
               "triangles: linear, linear with averaged volumetric strains, quadratic, or of degree 4, which are the most "
               "accurate for a given number of nodes")  # fmt: skip
    add_choice(parser, "--equilibrium", "fine", ("fine", "practice"),
               "tolerance of equilibrium: fine accepts an out-of-balance force of 1e-8 of the acting forces by Newton's method "
               "and 1e-5 by relaxation, practice an error of 1 % of the stress in cells that yield")  # fmt: skip


def finite_elements(options: argparse.Namespace) -> dict[str, object]:
    """Arguments of `QuasiStatic` that follow from those options."""
    return {
        "degree": int(options.elements[1]),
        "nmd": options.elements.endswith("averaged"),
        "solver": bridge.PRACTICE if options.equilibrium == "practice" else bridge.Solver(),
    }


def warn_of_linear_elements(options: argparse.Namespace) -> None:
    """Warn of elements with which soil that flows is too strong."""
    say("--elements is P1: linear triangles are too stiff where soil flows, and factors of safety are too high, by some 20 % on cells "
        "of a tenth of the height of a slope; take P2 but for quick looks" if options.elements == "P1" else "")  # fmt: skip


def check_fem_slope_options(parser: argparse.ArgumentParser, options: argparse.Namespace) -> None:
    """Fill in what follows from other options, and end with an error where they do not fit together."""
    if options.mesh is None and options.angle in (45, 90):
        options.mesh = "fitted"  # as "crossed", for any cell size
    check_slope_options(parser, options, cells=40)
    check(parser, options.cohesion > 0, NO_COHESION)
    say(unit_doubt(vars(options), "the slope"))


def mesh_sizes(options: argparse.Namespace) -> list[float]:
    """Cell sizes from coarse to fine [m]; those that do not fit into the slope are left out."""
    largest = min(options.height, options.crest) * (1 + 1e-9)
    sizes = [options.cell_size * 2**k for k in reversed(range(options.meshes))]
    return [size for size in sizes if size <= largest]


def slope_on_ground(
    comm: MPI.Comm, height: float, angle: float, crest: float, cell_size: float, depth: float, runout: float
) -> tuple[Mesh, MeshTags, list[bridge.Support]]:
    """Unstructured mesh of a slope with ground below and before its toe [m], with its tags and supports. Collective."""
    shape = {"height": height, "angle": angle, "crest": crest, "depth": depth, "runout": runout}
    sizes = {"cell_size": cell_size, "far_size": 4 * cell_size}
    domain, _, facet_tags = bridge.read_mesh(ROOT / "meshes" / "hillside.geo", comm, parameters=shape | sizes)
    return domain, facet_tags, [*SUPPORTS, bridge.roller(bridge.RIGHT, (1, 0))]


def slope_fem(
    options: argparse.Namespace,
    comm: MPI.Comm,
    cell_size: float,
    dilation_angle: float | None = None,
    depth: float = 0.0,
) -> bridge.QuasiStatic:
    """Finite elements of the slope, unloaded: rollers at the sides, fixed base. Collective.

    Args:
        dilation_angle: [degrees], instead of that in the options.
        depth: of the ground below the toe [m].
    """
    a = options
    if depth > 0:
        shape = a.height, a.angle, a.crest, cell_size, depth, _runout(a.height, depth)
        domain, facet_tags, supports = slope_on_ground(comm, *shape)
    else:
        background = bridge.slope_mesh(
            comm, height=a.height, angle=a.angle, crest=a.crest, cell_size=cell_size, kind=a.mesh, runout=cell_size
        )
        domain, _, facet_tags = bridge.soil_mesh(*background)
        supports = SUPPORTS
    return bridge.QuasiStatic(domain, soil_of(a, dilation_angle), facet_tags, supports, **finite_elements(a))


def _runout(height: float, depth: float) -> float:
    """Length of the ground before the toe [m]."""
    return height + 2 * depth


def outside_line(options: argparse.Namespace, slip_line: np.ndarray) -> str:
    """Says on a line where the slip line of limit analysis leaves the mesh; empty where it does not.

    Args:
        slip_line: (k, 2) from the crest [m].
    """
    a = options
    behind = -float(slip_line[0, 0])
    toe = a.crest + (a.height / math.tan(math.radians(a.angle)) if a.angle < 90 else 0.0)
    before = float(slip_line[-1, 0]) - toe - _runout(a.height, a.depth)
    said = (
        f"its slip line starts {behind:.2g} m behind the mesh: --crest is too short to compare\n" if behind > 0 else ""
    )
    return said + (
        f"its slip line ends {before:.2g} m before the mesh, whose side holds the soil up\n" if before > 0 else ""
    )


def weight(unit_weight: float) -> bridge.Load:
    """The load by the slope's unit weight [N/m3]."""
    return bridge.Load(unit_weight=unit_weight)


def step_line(where: str, quantity: str = "") -> Callable[[bridge.LoadStep], None]:
    """A `progress` for load steps, which prints each step on the first rank.

    Args:
        where: what is computed.
        quantity: what the value of its steps is, but for those that apply the load.
    """

    def show(step: bridge.LoadStep) -> None:
        if MPI.COMM_WORLD.rank == 0:
            print(f"{where}, {quantity}: " if step.quantity == "value" else f"{where}: ", end="", file=sys.stderr)
        bridge.print_step(step)

    return show
