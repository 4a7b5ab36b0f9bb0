"""Maps of hazard from the runs of a sweep over terrain: where slides go, and how thick and fast they are there."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np

from fenics_bridge.terrain import Raster, read_raster, write_raster

from ..figures import Pictures
from ..runout.terrain_plots import save_map
from .runs import Run

QUANTILE = 0.95
LABELS = {
    "reach_probability": "Fraction of the runs that reach a place [-]",
    "most_95_percent": "Largest thickness, 95 % quantile of the runs [m]",
    "speed_95_percent": "Largest speed, 95 % quantile of the runs [m/s]",
}
LIMITS = {"reach_probability": (0.0, 1.0)}


def hazard_maps(runs: Sequence[Run], folder: Path) -> Pictures:
    """Write maps over all runs that have results, as grids like theirs; nothing where runs have no maps of a slide.

    `reach_probability` is the fraction of the runs whose slide has been at a place. `most_95_percent` and `speed_95_percent` are the
    largest thickness and speed that 95 % of the runs do not exceed there, zero in runs that do not reach it; where all of these do not
    reach it there are gaps.

    Returns:
        The pictures of the maps, to be drawn.
    """
    there = [run.folder for run in runs if run.results]
    ending = next((end for end in (".asc", ".tif") if there and (there[0] / f"reached{end}").is_file()), None)
    if len(there) < 2 or ending is None:
        return {}
    maps = {name: [_read(one / f"{name}{ending}") for one in there] for name in ("reached", "most", "speed")}
    first = maps["reached"][0]
    if any(not _same_grid(first, other) for several in maps.values() for other in several):
        return {}  # runs on other ground, or of another spacing
    values = {"reach_probability": np.mean([one.values for one in maps["reached"]], axis=0)}
    for name in ("most", "speed"):
        highest = np.quantile(
            [np.nan_to_num(one.values) for one in maps[name]], QUANTILE, axis=0, method="inverted_cdf"
        )
        values[f"{name}_95_percent"] = np.where(highest > 0, highest, np.nan)
    ground = _read(there[0] / f"ground{ending}")
    pictures = {}
    for name, value in values.items():
        write_raster(folder / f"{name}{ending}", Raster(first.x, first.y, value, first.crs))
        shown = Raster(first.x, first.y, np.where(value > 0, value, np.nan), first.crs)
        path, limits = folder / f"{name}.png", LIMITS.get(name)
        pictures[name] = partial(save_map, path, ground, shown, LABELS[name], limits=limits)
    return pictures


def _read(path: Path) -> Raster:
    return read_raster(path, heights=False)


def _same_grid(one: Raster, other: Raster) -> bool:
    return one.values.shape == other.values.shape and bool(np.all(one.x == other.x) and np.all(one.y == other.y))
