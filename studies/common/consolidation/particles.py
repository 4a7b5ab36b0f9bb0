"""Implicit particles that consolidate beside finite elements: the same ground, loads and steps."""

from __future__ import annotations

from pathlib import Path
from types import TracebackType

import numpy as np
from mpm_core.output import PARTICLE_FIELDS, ModelOutput

from fenics_bridge import water

from ..movie import PORE, areas, frame_of
from ..scenes import scene_of
from ..slope.case import GRAVITY
from ..water.wet_particles import SmallMotion
from .site import ConsolidationSite
from .stages import GroundStage

WATER_FIELDS = ("pore_pressure", "excess_pore_pressure", "porosity", "conductivity")


class ParticleGround:
    """Particles in the place of finite elements at rest, in small displacements as these; a context manager.

    Args:
        site: the ground; fem: its finite elements at the beginning.
        per_cell: particles per cell.
        nmd: average volumetric strains over nodes.
        folder: where the particles are written to.

    Note:
        Collective, as its methods are.
    """

    def __init__(
        self, site: ConsolidationSite, fem: water.Consolidation, per_cell: int, nmd: bool, folder: Path
    ) -> None:
        self.model = site.particles(fem, per_cell, nmd)
        self._site, self._steps, self._per_cell = site, SmallMotion(self.model, nmd), per_cell
        self._stage = site.stages[0]
        # First number of particles, and part of their weight that is held at first
        self._held: list[tuple[int, float]] = []
        self._places = np.array(list(site.points.values()))
        self.model.add_field("initial_pore_pressure", unit="Pa", meaning="Pore pressure at the beginning")
        self.model.add_field("excess_pore_pressure", unit="Pa", meaning="Pore pressure above that at the beginning")
        self.model.particles.set("initial_pore_pressure", self.model.particles.pore_pressure)
        self._files = ModelOutput(self.model, folder / "particles", particle_fields=(*PARTICLE_FIELDS, *WATER_FIELDS))
        self.scene = scene_of(self.model, np.unique(self.model.mesh.cell_tags))
        """The mesh behind the particles, on the first rank"""
        self.count = self.model.comm.allreduce(len(self.model.particles))
        """Number of the particles, at most"""
        self.frames: list[dict[str, np.ndarray] | None] = []
        self.iterations = 0
        """Most iterations of a step"""

    def follow(self, time: float, dt: float) -> None:
        """Go to the time [s] that the finite elements have reached by a step of dt [s].

        Raises:
            RunError: the particles cannot.
        """
        self._site.load_particles(self.model, time, self._stage)
        self._hold(time)
        for report in self._steps.advance(time, dt):
            self.iterations = max(self.iterations, report.iterations)

    def begin(self, stage: GroundStage) -> None:
        """Place and dig away the soil of a stage."""
        model, site, p = self.model, self._site, self.model.particles
        gone = [tag for soil in stage.off if soil not in self._stage.off for tag in model.mesh.tags_of("cell", soil)]
        model.remove(np.isin(model.mesh.cell_tags[p.cell], gone))
        held = self._still_held(stage.start)
        self._held = [(number, part * held) for number, part in self._held] + [(model._next_id, 1.0)]
        for soil in self._stage.off:
            if soil not in stage.off:
                first = model._next_id
                site.seed(model, soil, self._per_cell)
                new = p.id >= first
                for name, value in zip(("porosity", "conductivity"), site.pores(soil)):
                    p.set(name, np.where(new, value, getattr(p, name)))
        self.count = max(self.count, model.comm.allreduce(len(p)))
        self._stage = stage

    def _still_held(self, time: float) -> float:
        """Part of what was held when the stage began that is held at a time [s]."""
        stage = self._stage
        return max(0.0, 1 - (time - stage.start) / stage.duration) if stage.duration > 0 else 0.0

    def _hold(self, time: float) -> None:
        """Let the weight of soil that is placed come in equal parts over the time that the stage takes."""
        p, part = self.model.particles, np.zeros(len(self.model.particles))
        for number, held in self._held:  # by rising number
            part[p.id >= number] = held
        force = np.zeros_like(p.position)
        force[:, 1] = self._still_held(time) * part * GRAVITY * p.mass
        p.set("traction", force)

    def settlements(self) -> np.ndarray:
        """Settlements of the points of the site [m], shape (n,)."""
        return -self._steps.at(self._places)[0][:, 1]

    def largest_excess(self) -> float:
        """Largest pore pressure of a particle above that at the beginning [Pa]."""
        return max(self.model.comm.allgather(float(self._excess().max(initial=-np.inf))))

    def frame(self, time: float) -> None:
        """Write the particles, and keep them for pictures; time: as shown there."""
        model, excess, moved = self.model, self._excess(), self._steps.of_particles()
        p = model.particles
        p.set("excess_pore_pressure", excess)
        self._files.write()
        self.frames.append(frame_of(model, time, {
            "position": p.position + moved, "volume": areas(model, p.volume, p.position), "id": p.id,
            "displacement": np.linalg.norm(moved, axis=1), PORE: excess,
        }))  # fmt: skip

    def _excess(self) -> np.ndarray:
        return self.model.particles.pore_pressure - self.model.particles.initial_pore_pressure

    def __enter__(self) -> ParticleGround:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._files.close()


def near_line(frame: dict[str, np.ndarray], x: float) -> tuple[np.ndarray, np.ndarray]:
    """Heights [m] and excess pressures [Pa] of the particles of a frame next to a vertical line: (n,) each."""
    position, width = frame["position"], np.sqrt(frame["volume"])
    rows = np.abs(position[:, 0] - x) <= width
    return position[rows, 1], frame[PORE][rows]
