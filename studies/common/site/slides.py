"""Slide of the particles of a site whose soils are too weak: the run by the explicit scheme, its history and pictures."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from time import perf_counter

import numpy as np
from mpi4py import MPI
from mpm_core.output import ModelOutput

import fenics_bridge as bridge
import mpm_core as mpm
from particle_player import Movie

from ..animation import save_animation
from ..checks import say
from ..figures import Pictures
from ..history import History
from ..interrupt import Interrupt
from ..lengths import metres
from ..movie import particle_frame, particle_movie
from ..options import add_count, add_number, add_switch
from ..output_options import add_picture_options
from ..page import Page
from ..plots import DISPLACEMENT, SHEAR_STRAIN, Quantity, Scene, save_history, save_particles
from ..progress import Progress
from ..quiet import NOT_REACHED, without_warning
from ..results import open_results
from ..scenes import scene_of
from ..schemes import add_particles_per_cell, add_pic
from ..solids.film import save_solid_film
from ..solids.movie import ground_of as solid_ground
from ..solids.movie import solid_movie
from ..solids.particles import body_of, save_solid_particles, solid_frame
from ..solids.plots import captions_for, outline_of
from ..solids.site import Solid
from ..summary import write_summary
from .field_plots import CAPTIONS as STRENGTHS
from .field_plots import strength_pictures
from .file import Site, read_site
from .k0 import begin_at_rest
from .member_results import axial_column, axial_label, force_columns, force_row

comm = MPI.COMM_WORLD
COLUMNS = ["time_s", "largest_displacement_m", "plastic_fraction"]
WITHOUT_AVERAGES = (
    "linear elements that average strains, as particles do, do not carry the weight of this site, as in steep slopes with little cohesion, for which "
    "they are too weak. The slide goes on without averages (as with --no-nmd), with which linear cells are some 20 % too strong: compare with the factor "
    "of studies/run safety"
)
"""What is said where elements that average strains do not carry the weight of a site"""
IN_TETRAHEDRON = 4
"""Particles in a tetrahedron unless an option says how many"""
CAPTIONS = {
    "slide_displacement": "Displacement at the end of the slide",
    "slide_strain": "Accumulated plastic shear strain at the end of the slide",
    "largest_displacement": "Largest displacement of a particle during the slide",
    "member_forces": "Largest axial force of each structural member during the slide; tension is positive",
}


def add_strength_factor(parser: ArgumentParser) -> None:
    """Option ``--factor``."""
    add_number(
        parser,
        "--factor",
        1.5,
        "-",
        "factor by which the strength of all soils of a site is divided before the slide",
        at_least=1,
    )


def add_slide_options(parser: ArgumentParser, damping: float, pic: float) -> None:
    """Options of a slide of particles, with the defaults of local damping and PIC."""
    p = parser
    add_particles_per_cell(p, 6)
    add_number(p, "--damping", damping, "-", "local damping of the slide", at_least=0, below=1)
    add_pic(p, pic)
    add_switch(p, "--nmd", True, "average volumetric strains over nodes in the slide, against locking")
    add_number(p, "--time", 10.0, "s", "duration of the slide", above=0)
    add_count(p, "--frames", 60, "number of times at which particles are stored and drawn")
    add_picture_options(p)


@dataclass
class Slide:
    """Result of the slide."""

    model: mpm.Model
    history: History
    files: ModelOutput
    frames: list[dict] = field(default_factory=list)

    def look(self, report: mpm.Report) -> None:
        """Note how far the particles have moved, and keep a frame. Collective."""
        moved = np.linalg.norm(self.model.particles.displacement, axis=1).max(initial=0.0)
        forces = {name: self.model.member_forces(name) for name in self.model.members}
        self.history.add(
            time_s=report.time, largest_displacement_m=comm.allreduce(float(moved), MPI.MAX), plastic_fraction=report.plastic_fraction,
            **{energy_column(self.model): whole_energy(self.model, report.kinetic_energy)}, **force_row(self.model.members, forces),
        )  # fmt: skip
        self.files.write()
        solid = self.model.mesh.dim == 3
        frame = (solid_frame if solid else particle_frame)(self.model, report.time)
        if frame is not None:
            for before in self.frames[-1:]:
                before.pop("moved", None)  # of a body that of the last frame says from where it is seen
            self.frames.append(frame)


def ground_of(model: mpm.Model, soil_tags: Iterable[int]) -> Scene | Solid | None:
    """The soil at the start: the mesh of a section, or the body; None but on the first rank. Collective."""
    return (solid_ground if model.mesh.dim == 3 else scene_of)(model, sorted(soil_tags))


def slide_movie(title: str, ground: Scene | Solid | None, result: Slide) -> Movie | None:
    """The slide for the player of the page; None but on the first rank."""
    if isinstance(ground, Solid):
        return solid_movie(title, ground, result.frames)
    return particle_movie(title, ground, result.frames)


def energy_column(model: mpm.Model) -> str:
    """Column of the kinetic energy, which in plane strain is that of a slice 1 m thick."""
    return "kinetic_energy_J_per_m" if model.geometry == mpm.Geometry.PLANE_STRAIN else "kinetic_energy_J"


def whole_energy(model: mpm.Model, energy: float) -> float:
    """An energy of a model for its column: that of an axisymmetric body all around the axis, where a model has that of one radian."""
    return 2 * np.pi * energy if model.geometry == mpm.Geometry.AXISYMMETRIC else energy


def particles_per_cell(a: Namespace, site: Site) -> int:
    """Particles in each cell of a site: as an option says, else its default in triangles and `IN_TETRAHEDRON` in tetrahedra."""
    given = site.dimension == 2 or "--particles-per-cell" in a.given
    return int(a.particles_per_cell) if given else IN_TETRAHEDRON


def slide(
    a: Namespace, model: mpm.Model, folder: Path, interrupt: Interrupt, update: Callable[[], None] = lambda: None,
    step: float | None = None,
) -> tuple[Slide, str | None]:  # fmt: skip
    """Follow the particles by the explicit scheme; returns also why the run ended early if it did. Collective.

    Args:
        a: options with time, frames, damping, pic and nmd.
        update: called after each frame, such as for loads that change with the shape of the body.
        step: of the implicit scheme, in the place of the explicit one [s].
    """
    options = {"every": a.time / a.frames, "damping": a.damping, "pic": a.pic, "nmd": a.nmd}
    scheme = model.explicit if step is None else partial(model.implicit, dt=step)
    with (
        History(
            folder / "history.csv", [*COLUMNS, energy_column(model), *force_columns(model.members)], comm
        ) as history,
        ModelOutput(model, folder / "particles", folder / "mesh") as files,
        Progress("slide", a.time, comm) as progress,
    ):
        result = Slide(model, history, files)
        result.look(model.report())
        try:
            for report in scheme(model.time + a.time, **options):
                result.look(report)
                update()
                progress.show(report.time, report.steps, largest=metres(history["largest_displacement_m"][-1]))
                if interrupt.requested():
                    return result, f"interrupted at {report.time:g} s"
        except mpm.RunError as error:
            return result, str(error)
    return result, None


def slide_pictures(a: Namespace, result: Slide, ground: Scene | Solid | None, folder: Path) -> Pictures:
    """Displacement and strain in the end, the largest displacement over time, and a film: of a section by strain, of a body by displacement.

    Args:
        a: options with pictures and film.
        ground: as `ground_of` gives it.
    """
    if ground is None or not a.pictures:
        return {}
    last, history = result.frames[-1], result.history
    largest = history["largest_displacement_m"]

    def particles(name: str, key: str, quantity: Quantity) -> None:
        if isinstance(ground, Solid):
            save_solid_particles(folder / f"{name}.png", last, key, quantity)
        else:
            save_particles(folder / f"{name}.png", ground, last["position"], last["volume"], last[key], quantity,
                       title=f"$t$ = {last['time']:.1f} s", bodies=last.get("bodies"))  # fmt: skip

    pictures: dict[str, Callable] = {
        "slide_displacement": lambda: particles("slide_displacement", "displacement", DISPLACEMENT),
        "slide_strain": lambda: particles("slide_strain", "shear_strain", SHEAR_STRAIN),
        "largest_displacement": lambda: save_history(
            folder / "largest_displacement.png", history["time_s"], {"largest": largest}, "Largest displacement [m]",
            limits=(0, max(0.1, 1.05 * largest.max()))),
    }  # fmt: skip
    if axial := {name: 1e-3 * history[axial_column(name, member.dim)] for name, member in result.model.members.items()}:
        pictures["member_forces"] = lambda: save_history(
            folder / "member_forces.png", history["time_s"], axial, axial_label(result.model.mesh.dim)
        )
    if a.film:
        pictures["film"] = lambda: _save_film(folder / "slide", ground, result.frames)
    return pictures


def _save_film(path: Path, ground: Scene | Solid, frames: list[dict]) -> Path:
    if isinstance(ground, Scene):
        return save_animation(path, ground, frames, "shear_strain", SHEAR_STRAIN)
    side = body_of(frames[-1]).side_to_see()
    return save_solid_film(path, frames, "displacement", DISPLACEMENT, side, outline_of(ground, side))


def _carried(site: Site, path: Path, averaged: bool) -> bridge.QuasiStatic:
    """Elements in equilibrium under the weight of all soils of a site. Collective.

    Args:
        site: the site.
        path: of its file, for the error.
        averaged: whether they average strains, as particles do.

    Raises:
        InputError: the soils do not carry their weight.
    """
    fem = site.finite_elements(1, nmd=averaged, solver=bridge.Solver(tolerance=1e-10), as_particles=averaged)
    with without_warning(NOT_REACHED):  # said by the error
        if site.begins_at_rest:
            try:
                begin_at_rest(site, fem)
            except bridge.StageError as error:
                raise mpm.InputError(f"{path}: its soils do not carry their weight: {error}") from error
            return fem
        steps = fem.solve(site.load())
    if not fem.converged:
        reason = next(step.report.reason for step in reversed(steps) if not step.converged)
        carried = max((step.value for step in steps if step.converged), default=0.0)
        raise mpm.InputError(f"{path}: its soils carry {carried:.1%} of their weight only: {reason}")
    return fem


def _start(site: Site, path: Path, nmd: bool | None) -> tuple[bridge.QuasiStatic, bool]:
    """Elements of a site in equilibrium, and whether they average strains. Collective.

    Linear cells are some 20 % too strong without averages, for any dilation angle, so that what fails would stand. With them, as particles
    have them, steep slopes with little cohesion are too weak.

    Args:
        site: the site.
        path: of its file.
        nmd: whether to average; None to do so where the soils then carry their weight.

    Raises:
        InputError: the soils do not carry their weight.
    """
    if nmd is not None:
        return _carried(site, path, nmd), nmd
    try:
        return _carried(site, path, averaged=True), True
    except mpm.InputError:
        fem = _carried(site, path, averaged=False)
        say(WITHOUT_AVERAGES)
        return fem, False


def site_slide(a: Namespace) -> int:
    """A site in elasto-plastic equilibrium under its weight, whose soils then lose strength and slide; returns its exit code.

    Finite elements on the particles' own cells find the equilibrium, particles take it over, and the strength of all soils is
    divided by the factor. Stages of the site are left out: all its soils are there at once. Collective.

    Args:
        a: options with site, factor, particles_per_cell and those of `slide`.
    """
    start = perf_counter()
    site = read_site(a.site, comm, a.cell_size)
    folder = open_results(a, comm)
    say(site.left_out_at_once())
    fem, a.nmd = _start(site, a.site, a.nmd)
    random = strength_pictures(site, fem, folder) if a.pictures else {}
    model = site.particles(particles_per_cell(a, site), more=site.weaker_laws(a.factor))
    handover = bridge.initialise(model, fem, count_displacement=False, nmd=a.nmd, equilibrate=not fem.members)
    model.assign(model.particles.material + len(site.laws))
    with Interrupt(comm) as interrupt:
        result, stopped = slide(a, model, folder, interrupt)
    moved = result.history["largest_displacement_m"][-1]
    summary = {
        "finished_run": stopped is None, "stopped_because": stopped, "factor": a.factor,
        "initial_out_of_balance_ratio": handover.unbalanced_ratio, "newly_yielded_fraction": handover.yielded_fraction,
        "largest_displacement_m": moved, "particles": comm.allreduce(len(model.particles)),
        "wall_seconds": perf_counter() - start,
    }  # fmt: skip
    ground = ground_of(model, site.laws)
    movies = [slide_movie(f"strength divided by {a.factor:g}", ground, result)]
    said = f"strength divided by {a.factor:g}: largest displacement {metres(moved)} after {result.history['time_s'][-1]:.3g} s"
    page, pictures = Page(
        movies=movies, captions=captions_for({**CAPTIONS, **STRENGTHS}, site.dimension)
    ), slide_pictures(a, result, ground, folder)
    code = write_summary(folder, a, summary, comm, page, {**pictures, **random}, said)
    return interrupt.exit_code or code
