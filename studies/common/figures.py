"""Figures to files."""

from __future__ import annotations

from pathlib import Path

import matplotlib.pyplot as plt
from matplotlib.figure import Figure

from .files import expendable


def save_figure(figure: Figure, path: Path, **look: object) -> None:
    """Write a picture and close the figure; see `expendable`.

    Args:
        look: as of ``Figure.savefig``.
    """
    with expendable(path) as aside:
        figure.savefig(aside, format=path.suffix[1:], **look)  # type: ignore[arg-type]
    plt.close(figure)
