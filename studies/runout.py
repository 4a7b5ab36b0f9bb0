"""A slide runs out over terrain in three dimensions: over a valley given by formulas, or over a raster of elevations.

Particles fill the body between the ground before the slide and the slip surface; between them and the remaining ground act
friction, adhesion and Voellmy's turbulent resistance, which maps may give from place to place. Maps of the deposit, of the largest thickness and speed, and of the area that the slide has covered are
written as ESRI ASCII grids or GeoTIFF and drawn over a hillshade; so are the thickness and the speed over time at given places,
and the forces on rigid structures.
"""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from time import perf_counter

import numpy as np
from common.checks import check_effect, check_file, say
from common.figures import Pictures
from common.history import History
from common.interrupt import Interrupt
from common.lengths import metres
from common.options import add_choice, add_count, add_number, check, study_parser
from common.output_options import add_picture_options
from common.progress import Progress
from common.quiet import without_warning
from common.ranks import run_study
from common.results import open_results
from common.runout.endings import left_the_mesh, still_moving, too_fast
from common.runout.ground import add_ground_options, check_ground, ground_strength
from common.runout.places import Places, draw_places, read_places, results_at
from common.runout.structures import Structure, add_structures, draw_forces, horizontal_force, read_structures
from common.runout.terrain_plots import save_map
from common.site.laws import unit_doubt
from common.soils import add_law_options, check_law_options, law_of
from common.summary import write_summary
from mpi4py import MPI
from mpm_core.input_warnings import in_radians
from mpm_core.output import ModelOutput

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import terrain
from fenics_bridge.terrain.slide import THINNEST

comm = MPI.COMM_WORLD
COLUMNS = ["time_s", "front_m", "centre_x_m", "centre_y_m", "centre_z_m", "fastest_m_per_s", "kinetic_energy_J",
           "ground_force_N", "dt_s"]  # fmt: skip
UNSTRESSED = ("cam-clay", "nor-sand", "sanisand")
"""Laws that cannot begin without stress, as a slide does"""
LABELS = {"deposit": "Thickness of the deposit [m]", "most": "Largest thickness [m]", "speed": "Largest speed [m/s]"}


# --- 1. Options ------------------------------------------------------------------------------------------------------


def parser() -> ArgumentParser:
    """Parser of all options; the help shows their units."""
    p = study_parser(__doc__)
    p.add_argument("--terrain", type=Path, default=None, metavar="FILE",
                   help="elevations of the ground before the slide: .asc, .tif, .xyz (default: a valley by formulas)")  # fmt: skip
    p.add_argument(
        "--rupture",
        type=Path,
        default=None,
        metavar="FILE",
        help="elevations of the slip surface",
    )
    p.add_argument(
        "--crs",
        default=None,
        metavar="TEXT",
        help="coordinate reference system of files that name none; 'local' for metres on a plane",
    )
    add_number(p, "--height", 60.0, "m", "height of the valley's side where it is given by formulas", above=0)
    add_number(p, "--thickness", 8.0, "m", "largest thickness of the slide in that valley", above=0)
    add_number(p, "--cell-size", 4.0, "m", "size of the cells where the slide runs", above=0)
    add_number(p, "--spacing", 1.33, "m", "distance between particles", above=0)
    add_number(p, "--headroom", 20.0, "m", "height of the background mesh above the ground", above=0)
    add_number(p, "--density", 1900.0, "kg/m3", "density of the slide", above=0)
    add_number(p, "--young", 5e6, "Pa", "Young's modulus; stiffer soil needs shorter steps", above=0)
    add_number(p, "--poisson", 0.3, "-", "Poisson's ratio", above=-1, below=0.5)
    add_number(p, "--friction-angle", 28.0, "degrees", "friction angle of the slide", at_least=0, below=60)
    add_number(p, "--dilation-angle", 0.0, "degrees", "dilation angle of the slide", at_least=0, below=60)
    add_number(p, "--cohesion", 500.0, "Pa", "cohesion of the slide, or its undrained shear strength", at_least=0)
    add_law_options(p)
    add_ground_options(p)
    ways = p.add_argument_group("in the way of the slide")
    ways.add_argument("--places", type=Path, default=None, metavar="FILE",
                      help="CSV file of places, a name, x and y [m] in each row, at which thickness and speed are recorded")  # fmt: skip
    ways.add_argument("--structure", type=Path, nargs="*", default=[], metavar="FILE",
                      help="closed surfaces of rigid structures (STL, OBJ and others) that stand in the ground; their forces are recorded")  # fmt: skip
    add_number(
        ways,
        "--structure-friction-angle",
        15.0,
        "degrees",
        "friction angle between slide and structures",
        at_least=0,
        below=90,
    )
    add_number(p, "--pic", 0.01, "-", "PIC fraction in a critical time step", at_least=0, at_most=1)
    add_number(p, "--time", 20.0, "s", "duration", above=0)
    add_count(p, "--frames", 80, "times at which maps and particles are stored")
    add_choice(p, "--grids", "asc", ("asc", "tif"), "files of the maps: ESRI ASCII grids, or GeoTIFF by rasterio")
    add_picture_options(p)
    return p


def parse(arguments: list[str] | None = None) -> Namespace:
    p = parser()
    options = p.parse_args(arguments)
    check(
        p,
        (options.terrain is None) == (options.rupture is None),
        "--terrain and --rupture are both needed, or none of them",
    )
    check_effect(p, options, options.terrain is None, ("--height", "--thickness"), "no --terrain")
    check_effect(p, options, options.terrain is not None, ("--crs",), "--terrain and --rupture")
    check_file(p, options.terrain, "--terrain")
    check_file(p, options.rupture, "--rupture")
    check_file(p, options.places, "--places")
    for path in options.structure:
        check_file(p, path, "--structure")
    check_effect(p, options, bool(options.structure), ("--structure-friction-angle",), "--structure")
    check_law_options(p, options)
    check(p, options.material not in UNSTRESSED, lambda: f"--material is {options.material}, expected a law that can begin without "
          f"stress, as a slide does; {', '.join(UNSTRESSED)} cannot")  # fmt: skip
    check(p, options.dilation_angle <= options.friction_angle, lambda: f"--dilation-angle is {options.dilation_angle:g} degrees, expected "
          f"at most --friction-angle, {options.friction_angle:g} degrees")  # fmt: skip
    check_ground(p, options)
    say(unit_doubt(vars(options), "the slide"))
    say(in_radians("--structure-friction-angle", options.structure_friction_angle))
    check(p, options.spacing <= options.cell_size, lambda: f"--spacing is {options.spacing:g} m, expected --cell-size, "
          f"{options.cell_size:g} m, at most")  # fmt: skip
    return options


# --- 2. Ground -------------------------------------------------------------------------------------------------------


def valley(a: Namespace) -> tuple[terrain.Raster, terrain.Raster]:
    """Ground before and after: a side that flattens out, H exp(-x / L), with a channel, and a cap on it."""
    spacing, length = a.cell_size, 1.25 * a.height
    x = np.arange(-0.5 * length, 3.0 * length + spacing, spacing)
    y = np.arange(-0.8 * length, 0.8 * length + spacing, spacing)
    u, v = np.meshgrid(x, y)
    channel = 0.15 * a.height * np.minimum((v / (0.5 * length)) ** 2, 1.5) * np.exp(-((u / (1.5 * length)) ** 2))
    rupture = a.height * np.exp(-u / length) + channel
    cap = 1 - ((u - 0.15 * length) / (0.35 * length)) ** 2 - (v / (0.35 * length)) ** 2
    return terrain.Raster(x, y, rupture + a.thickness * np.maximum(cap, 0)), terrain.Raster(x, y, rupture)


def extent(raster: terrain.Raster) -> str:
    """The area of a raster, in words."""
    (x0, x1), (y0, y1) = ((along[0], along[-1]) for along in (raster.x, raster.y))
    return f"x {x0:.8g} to {x1:.8g} m and y {y0:.8g} to {y1:.8g} m"


def grounds(a: Namespace) -> tuple[terrain.Raster, terrain.Raster]:
    """Ground before and after the slide."""
    if a.terrain is None:
        return valley(a)
    before, rupture = (terrain.read_raster(path, crs=a.crs) for path in (a.terrain, a.rupture))
    low = max(before.x[0], rupture.x[0]), max(before.y[0], rupture.y[0])
    high = min(before.x[-1], rupture.x[-1]), min(before.y[-1], rupture.y[-1])
    if low[0] >= high[0] or low[1] >= high[1]:
        raise mpm.InputError(f"--rupture covers {extent(rupture)}, expected a part of --terrain, {extent(before)}")
    return before.window(low, high), rupture.window(low, high)


def body_between(a: Namespace, before: terrain.Raster, rupture: terrain.Raster) -> np.ndarray:
    """Which points of the ground before the slide are so far above the slip surface that particles fill the space.

    Two surveys of the same ground differ a little, at the edge of the rasters by up to half of the distance of particles.
    """
    x, y = np.meshgrid(before.x, before.y)
    thickness = before.values - rupture.at(np.column_stack([x.ravel(), y.ravel()])).reshape(x.shape)
    body: np.ndarray = thickness > THINNEST * a.spacing
    if not body.any():
        raise mpm.InputError(
            "--terrain is nowhere higher than --rupture, expected a body between them" if a.terrain is not None else
            f"--thickness is {a.thickness:g} m with --height {a.height:g} m and --cell-size {a.cell_size:g} m, expected a slide "
            f"thicker than {THINNEST * a.spacing:.3g} m and longer than some cells: it is 0.7 --height long")  # fmt: skip
    inside = np.zeros_like(body)
    inside[1:-1, 1:-1] = True
    at_edge = float(thickness[~inside].max())
    if at_edge > 0.5 * a.spacing:
        raise mpm.InputError(
            f"--terrain is up to {at_edge:.3g} m above --rupture at the edge of the rasters, expected the same "
            "ground around the slide: elevations in metres from the same datum, and rasters larger than the slide")  # fmt: skip
    return body


def fine_part(before: terrain.Raster, body: np.ndarray) -> tuple[tuple[float, float], tuple[float, float]]:
    """Region of the fine mesh: the slide, and the ground lower than its top within four of its lengths.

    Args:
        before: ground before the slide.
        body: which of its points belong to the slide, see ``body_between``.
    """
    x, y = np.meshgrid(before.x, before.y)
    reach = 4 * max(np.ptp(x[body]), np.ptp(y[body]))
    lower = (before.values < before.values[body].max()) & (x > x[body].min() - reach) & (x < x[body].max() + reach)
    lower &= (y > y[body].min() - reach) & (y < y[body].max() + reach)
    near = body | lower
    return (float(x[near].min()), float(y[near].min())), (float(x[near].max()), float(y[near].max()))


def build(a: Namespace, before: terrain.Raster, rupture: terrain.Raster) -> tuple[mpm.Model, mpm.RigidContact, float]:
    """Mesh, particles and contact; and by how much the slide was lifted [m]. Collective."""
    domain, _, facet_tags = terrain.terrain_mesh(
        comm, rupture, cell_size=a.cell_size, height=a.headroom + float((before.values - rupture.values).max()),
        fine=fine_part(before, body_between(a, before, rupture)),
    )  # fmt: skip
    model = mpm.Model(bridge.background_mesh(domain, facet_tags=facet_tags), law_of(a))
    strength = ground_strength(a, rupture)
    with without_warning("drag is"):  # said of --turbulence
        ground, lift = terrain.seed_slide(model, before, rupture, spacing=a.spacing, density=a.density, **strength)
    model.outflow("sides")
    model.set_gravity((0.0, 0.0, -9.81))
    model.rebalance()
    return model, ground, lift


# --- 3. The slide ----------------------------------------------------------------------------------------------------


def centre(model: mpm.Model) -> np.ndarray:
    """Centre of mass [m]. Collective."""
    p = model.particles
    sums = comm.allreduce(np.array([*(p.mass @ p.position), p.mass.sum()]))
    return sums[:3] / sums[3]


@dataclass
class Watched:
    """What the history of a slide follows: its maps, the ground, places and structures."""

    maps: terrain.SlideMaps
    ground: mpm.RigidContact
    places: Places
    structures: list[Structure]

    @property
    def columns(self) -> list[str]:
        return [*COLUMNS, *self.places.columns, *(name for one in self.structures for name in one.columns)]


def look(model: mpm.Model, watched: Watched, start: np.ndarray, report: mpm.Report) -> dict[str, float]:
    """A row of the history. Collective."""
    forces = {name: force for one in watched.structures for name, force in one.row(report.time).items()}
    p, x = model.particles, centre(model)
    away = np.linalg.norm(p.position[:, :2] - start[:2], axis=1)
    fastest = np.linalg.norm(p.velocity, axis=1).max(initial=0.0)
    return {
        "time_s": report.time, "front_m": comm.allreduce(float(away.max(initial=0.0)), MPI.MAX), "centre_x_m": x[0],
        "centre_y_m": x[1], "centre_z_m": x[2], "fastest_m_per_s": comm.allreduce(float(fastest), MPI.MAX),
        "kinetic_energy_J": report.kinetic_energy, "ground_force_N": float(np.linalg.norm(watched.ground.force)), "dt_s": report.dt,
        **watched.places.row(watched.maps), **forces,
    }  # fmt: skip


def run(a: Namespace, model: mpm.Model, watched: Watched, folder: Path) -> tuple[History, str | None]:
    """The slide, with its frames; its history, and why it ended early if it did. Collective."""
    start, stopped = centre(model), None
    with (
        Interrupt(comm) as interrupt,
        History(folder / "history.csv", watched.columns, comm) as history,
        ModelOutput(
            model,
            folder / "particles",
            particle_fields=("velocity", "displacement", "volume", "id"),
            bodies=folder / "bodies",
            background=True,
        ) as output,
        Progress("slide", a.time, comm) as progress,
    ):
        history.add(**look(model, watched, start, model.report()))
        try:
            for report in model.explicit(a.time, every=a.time / a.frames, pic=a.pic, nmd=True, rebalance=1.3):
                if comm.allreduce(len(model.particles)) == 0:
                    stopped = (
                        f"all of the slide has left the mesh by {report.time:g} s, expected rasters beyond its reach"
                    )
                    break
                watched.maps.record()
                history.add(**look(model, watched, start, report))
                output.write()
                progress.show(report.time, report.steps, front=f"{history['front_m'][-1]:.1f} m")
                if interrupt.requested():
                    stopped = f"interrupted at {report.time:g} s"
                    break
            output.close()  # waits for the last frame
        except mpm.RunError as error:
            stopped = str(error)
            if "left the background mesh" in stopped:
                stopped += f"; what leaves it at its top needs more --headroom than {a.headroom:g} m"
    return history, stopped


# --- 4. All together -------------------------------------------------------------------------------------------------


def write_maps(
    a: Namespace, found: dict[str, terrain.Raster], rupture: terrain.Raster, watched: Watched, folder: Path
) -> Pictures:
    """Maps as grids, the ground as a surface for ParaView, and pictures to draw. On the first rank."""
    for name, raster in {**found, "ground": rupture}.items():
        terrain.write_raster(folder / f"{name}.{a.grids}", raster)
    rupture.triangles().write(folder / "ground.obj")
    marks = {"bodies": [one.body for one in watched.structures], "places": watched.places}
    return {
        name: partial(save_map, folder / f"{name}.png", rupture, found[name], label, **marks)
        for name, label in LABELS.items()
    }


def curves(watched: Watched, history: History, folder: Path) -> Pictures:
    """Pictures over time, to draw."""
    pictures: dict[str, Callable[[], object]] = {}
    if watched.places.names:
        pictures["places"] = partial(draw_places, folder / "places.png", watched.places, history)
    if watched.structures:
        pictures["structures"] = partial(draw_forces, folder / "structures.png", watched.structures, history)
    return pictures


def main(arguments: list[str] | None = None) -> int:
    a = parse(arguments)
    begin = perf_counter()
    folder = open_results(a, comm)
    before, rupture = grounds(a)
    places = Places() if a.places is None else read_places(a.places, rupture)
    bodies = read_structures(a.structure, rupture)
    model, ground, lift = build(a, before, rupture)
    structures = add_structures(model, bodies, a.structure_friction_angle, a.cell_size)
    watched = Watched(terrain.SlideMaps(model, rupture), ground, places, structures)
    particles, volume = comm.allreduce(len(model.particles)), comm.allreduce(float(model.particles.volume.sum()))
    top = comm.allreduce(float(model.particles.position[:, 2].max(initial=-np.inf)), MPI.MAX)
    if comm.rank == 0:
        print(f"{particles} particles, {volume:.4g} m3, lifted by {metres(lift)}", file=sys.stderr)
    start = perf_counter()
    history, stopped = run(a, model, watched, folder)
    seconds, report = perf_counter() - start, model.report()
    found = watched.maps.maps()
    low = comm.allreduce(float(model.particles.position[:, 2].min(initial=np.inf)), MPI.MIN)
    x = np.array([history[f"centre_{axis}_m"] for axis in "xyz"])
    fall, travel = float(x[2, 0] - x[2, -1]), float(np.linalg.norm(x[:2, -1] - x[:2, 0]))
    summary = {
        "finished_run": stopped is None, "stopped_because": stopped, "particles": particles, "volume_m3": volume, "lift_m": lift,
        "front_m": float(history["front_m"][-1]), "fall_height_m": top - low, "centre_travel_m": travel,
        "angle_of_travel_degrees": float(np.degrees(np.arctan2(fall, travel))) if travel > 0 else None,
        "fastest_m_per_s": float(history["fastest_m_per_s"].max()),
        "largest_deposit_m": float(np.nanmax(found["deposit"].values)),
        "reached_area_m2": float(found["reached"].values.sum() * rupture.spacing**2), "outflow_mass_kg": report.outflow_mass,
        "places": results_at(places, history),
        "largest_horizontal_force_N": {one.name: float(horizontal_force(one, history).max()) for one in structures},
        "particle_steps_per_second": report.particle_steps / seconds, "wall_seconds": perf_counter() - begin,
    }  # fmt: skip
    pictures = (
        {**write_maps(a, found, rupture, watched, folder), **curves(watched, history, folder)} if comm.rank == 0 else {}
    )
    said = (
        f"front {summary['front_m']:.1f} m from the initial centre of mass; the centre of mass fell {fall:.1f} m over "
        f"{travel:.1f} m; fastest {summary['fastest_m_per_s']:.1f} m/s; {summary['particle_steps_per_second'] / 1e6:.1f} million "
        "particle-steps per second"
        + still_moving(history, a.density * volume - report.outflow_mass) * (stopped is None)
        + left_the_mesh(report.outflow_mass / (a.density * volume))
        + too_fast(summary["fastest_m_per_s"], top - float(rupture.values.min()))
    )
    return write_summary(folder, a, summary, comm, pictures=pictures if a.pictures else {}, said=said)


if __name__ == "__main__":
    run_study(main)
