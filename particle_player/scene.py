"""What is drawn: the background mesh, the size of particles, and quantities with their colours."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

ROUND_TICKS = MaxNLocator(8, steps=[1, 2, 2.5, 5, 10])

AXES = "$x$ [m]", "$y$ [m]"
HALF_SECTION_AXES = "$r$ [m] (half section, axis at the left)", "$z$ [m]"
"""Labels of pictures in the plane of the mesh, in plane strain and of bodies of revolution"""


def axis_labels(half_section: bool) -> tuple[str, str]:
    """Labels of the axes of a picture of a plane body, or of the half section of an axisymmetric one."""
    return HALF_SECTION_AXES if half_section else AXES


@dataclass(frozen=True)
class Quantity:
    """What is drawn in colour.

    Args:
        name: as it stands at the colour bar.
        unit: as shown; "-" for none.
        scale: shown value = value in SI units times this.
        colours: a perceptually uniform colour map of Matplotlib.
        least_range: narrowest colour scale, in the shown unit, of a quantity that varies little about a value far from zero;
            if not given, scales of positive values begin at zero.
    """

    name: str
    unit: str
    scale: float = 1.0
    colours: str = "viridis"
    least_range: float | None = None

    @property
    def label(self) -> str:
        """Name and unit, as at a colour bar."""
        return f"{self.name} [{self.unit}]"


@dataclass
class Scene:
    """The background mesh that particles are drawn in front of.

    Args:
        points: (n, 2), m.
        cells: (m, 3) rows of ``points``.
        is_soil: (m,) true for cells that held soil at the start; all if not given.
        half_section: whether the body is axisymmetric, about the axis x = 0.
        outline: of the soil at the start, segments (k, 2, 2), m; the boundary of its cells if not given.
    """

    points: NDArray[np.float64]
    cells: NDArray[np.integer]
    is_soil: NDArray[np.bool_] | None = None
    half_section: bool = False
    outline: NDArray[np.float64] | None = None
    boundary: NDArray[np.float64] = field(init=False, repr=False)
    initial_outline: NDArray[np.float64] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        soil = self.cells if self.is_soil is None else self.cells[self.is_soil]
        self.boundary = self.points[boundary_edges(self.cells)]
        self.initial_outline = self.points[boundary_edges(soil)] if self.outline is None else self.outline

    def limits(
        self, positions: Iterable[NDArray], bodies: Iterable[NDArray] = ()
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Lower and upper corner of the soil at the start and the given positions, with a margin.

        Args:
            positions: (n, 2), m.
            bodies: segments of rigid surfaces (k, 2, 2), m; what lies beyond the mesh does not count.
        """
        ends = [segments.reshape(-1, 2) for segments in bodies]
        low, high = self.points.min(axis=0), self.points.max(axis=0)
        inside = [points[((points >= low) & (points <= high)).all(axis=1)] for points in ends]
        corners = [self.initial_outline.reshape(-1, 2), *positions, *inside]
        corners = [corner for corner in corners if len(corner)]
        lower = np.min([corner.min(axis=0) for corner in corners], axis=0)
        upper = np.max([corner.max(axis=0) for corner in corners], axis=0)
        margin = 0.04 * (upper - lower).max()
        return lower - margin, upper + margin


def boundary_edges(cells: NDArray[np.integer]) -> NDArray[np.integer]:
    """Edges that belong to one triangle only, (k, 2) node numbers."""
    edges = np.sort(np.concatenate([cells[:, [0, 1]], cells[:, [1, 2]], cells[:, [2, 0]]]), axis=1)
    unique, counts = np.unique(edges, axis=0, return_counts=True)
    return unique[counts == 1]


def colour_limits(quantity: Quantity, values: Iterable[NDArray]) -> tuple[float, float]:
    """One colour scale for a quantity over time, in its shown unit, with round numbers at its ends.

    The hundredth part of particles with the most extreme values is left out at each end, in the frame where they are
    most extreme: in a thin sheet or at a sharp toe single particles carry values that would hide all others.

    Args:
        quantity: what is shown.
        values: per frame, in SI units.
    """
    shown = [quantity.scale * frame for frame in values if len(frame)]
    if not shown:
        return 0.0, 1.0
    low = min(np.percentile(frame, 1) for frame in shown)
    high = max(np.percentile(frame, 99) for frame in shown)
    if quantity.least_range is not None:
        missing = max(0.0, quantity.least_range - (high - low))
        low, high = low - 0.5 * missing, high + 0.5 * missing
    elif all(frame.min() >= 0 for frame in shown):
        low, high = 0.0, high or 1.0  # where nothing has moved, no numbers below zero
    if not high > low:
        low, high = low - 0.5, high + 0.5
    ticks = ROUND_TICKS.tick_values(low, high)
    return float(ticks[0]), float(ticks[-1])


def disc_diameter(volume: NDArray[np.floating]) -> NDArray[np.floating]:
    """Diameter of discs that cover the plane without gaps where each stands for its volume, m.

    A square packing needs sqrt(2 V); the patterns inside triangles are a little looser.
    """
    return 1.15 * np.sqrt(2.0 * volume)
