"""Pictures of stages of finite elements in three dimensions: the body, and a section through it, after each stage."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

import fenics_bridge as bridge

from ..figures import Pictures
from ..stages.plots import MOVED, SHEAR, first_shown, movement_picture, own_cell_values
from .plots import save_solid_stages
from .site import Solid, gathered_solid, member_lines


@dataclass
class SolidStage:
    """A stage for pictures, on the first rank.

    name: of the stage; solid: displacement and accumulated deviatoric strain of all cells; there: whether each holds soil (m,)
    """

    name: str
    solid: Solid
    there: np.ndarray


def solid_stage(site: bridge.FemSite, name: str) -> SolidStage | None:
    """The site as it is now; None but on the first rank. Collective."""
    material, strain, _ = (values[:, 0] for values in own_cell_values(site.fem))
    found = gathered_solid(site.fem.displacement, strain, material >= 0)
    if found is None:
        return None
    solid, there = found
    return SolidStage(name, replace(solid, members=member_lines(site.fem)), there)


def solid_stage_pictures(
    stages: Sequence[bridge.Stage], rows: Sequence[Mapping[str, Any]], pictures: Sequence[SolidStage], folder: Path
) -> Pictures:
    """The body after each stage by displacement and by strain, and movements over the stages; as `stage_pictures` has them in a plane."""
    if not pictures:
        return {}
    first = first_shown(stages, rows)
    before = pictures[first - 1].solid.values if first else 0.0
    shown = [replace(one.solid, values=one.solid.values - before).part(one.there) for one in pictures[first:]]
    names = [row["stage"] for row in rows[first:]]

    def save(name: str, quantity: Any, by_cell: bool) -> None:
        save_solid_stages(folder / f"{name}.png", names, shown, quantity, by_cell)

    return {
        "stages_displacement": lambda: save("stages_displacement", MOVED, False),
        "stages_strain": lambda: save("stages_strain", SHEAR, True),
        "movements": movement_picture(rows[first:], folder),
    }
