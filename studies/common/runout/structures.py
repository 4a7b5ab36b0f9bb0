"""Rigid structures in the way of a run-out, such as dams and walls, and the forces of the slide on them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

import mpm_core as mpm
from fenics_bridge.terrain import Raster

from ..checks import say
from ..figures import curve_figure
from ..history import History
from ..plots import CURVES


@dataclass
class Structure:
    """A structure, its contact with the slide, and the impulse at the last row of the history."""

    name: str
    body: mpm.Triangles
    contact: mpm.RigidContact
    before: tuple[float, np.ndarray]
    """Time [s] and impulse [N s]"""

    @property
    def columns(self) -> list[str]:
        """Columns of a history."""
        return [f"force_{self.name}_{axis}_N" for axis in "xyz"]

    def row(self, time: float) -> dict[str, float]:
        """Mean force since the row before, by column. Collective."""
        impulse = self.contact.impulse
        passed = time - self.before[0]
        force = (impulse - self.before[1]) / passed if passed > 0 else np.zeros(3)
        self.before = (time, impulse)
        return dict(zip(self.columns, force, strict=True))


def read_structures(paths: list[Path], ground: Raster) -> dict[str, mpm.Triangles]:
    """Closed surfaces by the names of their files.

    Raises:
        InputError: a file that cannot be read, a surface that is not closed, is inside out or beside the ground, or two of one name.
    """
    bodies: dict[str, mpm.Triangles] = {}
    for path in paths:
        if path.stem in bodies:
            raise mpm.InputError(f"--structure names two files {path.stem}, expected different names")
        try:
            body = mpm.Triangles.read(path)
        except mpm.InputError as error:
            raise mpm.InputError(f"--structure: {path}: {error}") from None
        sides = np.sort(body.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        if 2 * len(np.unique(sides, axis=0)) != len(sides):
            raise mpm.InputError(f"--structure: {path} has a border, expected a closed surface")
        if volume_of(body) <= 0:
            raise mpm.InputError(
                f"--structure: {path} is inside out, expected triangles that run counterclockwise as seen from outside"
            )
        require_on_ground(path.stem, body, ground)
        bodies[path.stem] = body
    return bodies


def volume_of(body: mpm.Triangles) -> float:
    """Volume within a closed surface [m3], negative where it is inside out."""
    a, b, c = np.moveaxis(body.vertices[body.triangles] - body.vertices[0], 1, 0)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


def require_on_ground(name: str, body: mpm.Triangles, ground: Raster) -> None:
    """Warn of a structure that is above or below the ground.

    Raises:
        InputError: it is beside the ground.
    """
    low, high = body.vertices.min(axis=0), body.vertices.max(axis=0)
    if low[0] > ground.x[-1] or high[0] < ground.x[0] or low[1] > ground.y[-1] or high[1] < ground.y[0]:
        raise mpm.InputError(
            f"--structure {name} is at x {low[0]:.10g} to {high[0]:.10g} m, y {low[1]:.10g} to {high[1]:.10g} m, expected a place on "
            f"the ground, x {ground.x[0]:.10g} to {ground.x[-1]:.10g} m and y {ground.y[0]:.10g} to {ground.y[-1]:.10g} m"
        )
    height = body.vertices[:, 2] - ground.at(body.vertices)
    if height.min() > 0:
        say(
            f"--structure {name} is {height.min():.3g} m above the ground at least, expected one that reaches into it: soil passes below"
        )
    if height.max() <= 0:
        say(
            f"--structure {name} is {-height.max():.3g} m below the ground at least, expected one that stands in its way"
        )


def add_structures(
    model: mpm.Model, bodies: dict[str, mpm.Triangles], friction_angle: float, cell_size: float
) -> list[Structure]:
    """Let the slide touch structures. Collective.

    Args:
        friction_angle: between slide and structures [degrees].
        cell_size: of the mesh where the slide runs [m].

    Raises:
        InputError: a structure that overlaps the slide.
    """
    structures = []
    for name, body in bodies.items():
        thinnest = float(np.ptp(body.vertices, axis=0).min())
        say(f"--structure {name} is {thinnest:.3g} m thick, expected at least two cells of --cell-size {cell_size:g} m: soil on both of "
            "its sides is in the same cells and feels the other side" if thinnest < 2 * cell_size else "")  # fmt: skip
        try:
            contact = model.add_contact(body, friction=float(np.tan(np.radians(friction_angle))))
        except mpm.InputError as error:
            raise mpm.InputError(f"--structure {name}: {error}") from None
        structures.append(Structure(name, body, contact, (0.0, np.zeros(3))))
    return structures


def horizontal_force(structure: Structure, history: History) -> np.ndarray:
    """Magnitude of the horizontal force in each row [N]."""
    return np.hypot(*(history[column] for column in structure.columns[:2]))


def draw_forces(path: Path, structures: list[Structure], history: History) -> None:
    """Horizontal forces on all structures over time."""
    forces = {one.name: horizontal_force(one, history) for one in structures}
    scale, unit = (1e-6, "MN") if max(force.max() for force in forces.values()) >= 10e6 else (1e-3, "kN")
    with curve_figure(path) as axes:
        for k, (name, force) in enumerate(forces.items()):
            axes.plot(history["time_s"], scale * force, color=CURVES[k % len(CURVES)], label=name)
        axes.set(xlabel="Time [s]", ylabel=f"Horizontal force of the slide [{unit}]", xlim=(0, None), ylim=(0, None))
        axes.legend(fontsize=8)
