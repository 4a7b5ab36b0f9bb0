"""Figures to files."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
from matplotlib.figure import Figure

from .files import NOT_WRITTEN, expendable
from .progress import counted

FEW = 12
"""Points of a curve below which they are marked"""
STYLE = Path(__file__).with_name("paper.mplstyle")
Pictures = Mapping[str, Callable[[], object]]
"""Functions that draw pictures, by the names of their files; called on the first rank only, so without collective calls"""


def draw_pictures(pictures: Pictures) -> None:
    """Draw pictures one by one, showing how far it is. One that fails costs only itself; the run takes note of the reason."""
    for name, draw in counted("figures", list(pictures.items())):
        try:
            draw()
        except Exception as error:  # whatever a drawing library fails with, the results are worth more
            _note(name, error)
            plt.close("all")


def _note(name: str, error: Exception) -> None:
    NOT_WRITTEN.append(f"cannot draw {name}: {type(error).__name__}: {error} ({_where(error)})")


def _where(error: BaseException) -> str:
    """The line of code that raised an error."""
    trace = error.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    return f"{Path(trace.tb_frame.f_code.co_filename).name}:{trace.tb_lineno}" if trace is not None else "unknown"


def save_figure(figure: Figure, path: Path) -> None:
    """Write a picture and close the figure. If that fails, the run records the reason and continues without it."""
    try:
        with expendable(path) as aside:
            figure.savefig(aside, format=path.suffix[1:])
    except Exception as error:  # as in `draw_pictures`; also for studies that draw while they run
        _note(path.name, error)
    finally:
        plt.close(figure)


def paper_style() -> AbstractContextManager[None]:
    """Fonts and lines of all pictures, as a context."""
    return plt.style.context(STYLE)


@contextmanager
def curve_figure(path: Path, size: tuple[float, float] = (4.6, 3.2), panels: int = 1, rows: int = 1) -> Iterator[Any]:
    """Axes for curves, with a grid and ticks on all sides; in the end the picture is written, see `save_figure`.

    Args:
        path: of the picture.
        size: width and height [inches].
        panels: axes side by side; rows: axes above one another, over one horizontal axis. Several are given as an array.
    """
    with paper_style(), plt.rc_context({"axes.grid": True, "xtick.top": True, "ytick.right": True}):
        figure, axes = plt.subplots(rows, panels, figsize=size, sharex=rows > 1, layout="constrained")
        figure.get_layout_engine().set(wspace=0.05 * (panels > 1))
        yield axes
        mark_few(figure)
        save_figure(figure, path)


def panel_figure(count: int, aspect: float, tall: float = 5.8) -> tuple[Figure, Any]:
    """Equal panels (rows, columns) with common axes: above one another, or side by side where the body is higher than wide.

    Args:
        count: of the panels.
        aspect: height of what they show over its width.
        tall: height of a panel above others over its aspect [inches].
    """
    rows, columns, size = count, 1, (6.9, count * (tall * aspect + 0.4) + 0.5)
    if aspect > 1:
        rows, columns, size = 1, count, (count * max(4.0 / aspect + 0.5, 1.25) + 1.2, 4.8)
    figure, panels = plt.subplots(
        rows, columns, figsize=size, sharex=True, sharey=True, squeeze=False, layout="constrained"
    )
    for axes in panels.ravel() if aspect > 4 else ():
        axes.tick_params(axis="x", labelrotation=90)  # else numbers lie on one another
    return figure, panels


def label_axes(panels: Any, labels: tuple[str, str]) -> None:
    """Name the horizontal axes of the lowest panels and the vertical ones of the panels on the left."""
    for axes in panels[-1]:
        axes.set_xlabel(labels[0])
    for axes in panels[:, 0]:
        axes.set_ylabel(labels[1])


def mark_few(figure: Figure) -> None:
    """Mark the points of curves that have one, which no line shows, or so few that the line between them says little.

    Lines of two points are those of a constant or a slope.
    """
    for line in (line for axes in figure.axes for line in axes.lines):
        if len(line.get_xdata()) in (1, *range(3, FEW)) and line.get_marker() == "None":
            line.set(marker="o", markersize=2.5)
