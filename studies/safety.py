"""Factor of safety of the slope: strength reduction with elasto-plastic FEM, against limit analysis.

Cohesion and tan(friction angle) are divided by a rising factor until there is no equilibrium under the unit weight any more
(strength reduction), on several meshes. Flow is associated unless a dilation angle is given; results without dilation are
reported as well. With --seismic-coefficient a part of the weight acts out of the slope besides, as the inertia of an earthquake
(pseudo-static analysis); --critical-seismic finds the coefficient at which the slope fails, for Newmark's method.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Iterable
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from common.checks import say
from common.collapse_runs import CAPTIONS, CollapseRuns, Target, add_flow_options, dilation_angles
from common.figures import Pictures
from common.options import add_flag, add_number, check, study_parser
from common.page import Page
from common.quiet import NOT_REACHED, without_warning
from common.ranks import run_study
from common.results import open_results
from common.site.file import Site
from common.site.k0 import all_at_rest, begin_at_rest, say_left_out
from common.site.names import mistakes_in, require_soils
from common.site.runs import add_site_option, check_site_options, site_study
from common.site.slides import IN_TETRAHEDRON
from common.slope.case import GRAVITY, SUPPORTS, soil_of
from common.slope.fem import (
    add_fem_slope_options,
    add_ground_option,
    check_fem_slope_options,
    finite_elements,
    mesh_sizes,
    outside_line,
    slope_fem,
    step_line,
    weight,
)
from common.summary import write_summary
from mpi4py import MPI
from mpm_core.law_warnings import keeps_volume, with_inner_laws

import fenics_bridge as bridge
import mpm_core as mpm

comm = MPI.COMM_WORLD


# --- 1. Options ------------------------------------------------------------------------------------------------------


def parser() -> ArgumentParser:
    """Parser of all options; the help shows their units."""
    p = study_parser(__doc__)
    add_fem_slope_options(p)
    add_ground_option(p)
    add_number(p, "--unit-weight", 20e3, "N/m3", "unit weight of the soil", above=0)
    add_number(
        p,
        "--seismic-coefficient",
        0.0,
        "-",
        "horizontal inertia force over the weight, out of the slope; of a site along the first axis",
    )
    add_flag(
        p,
        "--critical-seismic",
        "also find the seismic coefficient at which soil of full strength fails; of a site "
        "against the first axis where --seismic-coefficient is below 0",
    )
    add_number(
        p,
        "--start",
        0.5,
        "-",
        "first factor of safety to try; it is halved, up to three times, where the slope does not stand with it",
        above=0,
    )
    add_flow_options(p)
    add_site_option(p)
    p.add_argument(
        "--unreduced", nargs="*", default=[], metavar="SOIL", help="soils of the site whose strength is not reduced"
    )
    add_flag(
        p,
        "--particles",
        "also find the factor by particles on the same cells, which come to rest or flow; strains are averaged as "
        "in linear elements, and beside others where these would lock",
    )
    return p


def parse(arguments: list[str] | None = None) -> Namespace:
    p = parser()
    options = p.parse_args(arguments)
    if options.site is None:
        check_fem_slope_options(p, options)
    check(p, options.site is not None or not options.unreduced,
          lambda: f"--unreduced names {', '.join(options.unreduced)}, expected --site: the slope has one soil")  # fmt: skip
    check(p, options.depth == 0 or not options.particles,
          lambda: f"--depth is {options.depth:g}, expected 0 with --particles, which stand on a rigid base")  # fmt: skip
    check(p, options.site is not None or options.seismic_coefficient >= 0,
          lambda: f"--seismic-coefficient is {options.seismic_coefficient:g}, expected at least 0: out of the slope")  # fmt: skip
    say(
        f"--seismic-coefficient is {options.seismic_coefficient:g}, more than the weight: it is the horizontal acceleration over that of "
        "gravity, such as 0.15" * (abs(options.seismic_coefficient) > 1)
    )
    check_site_options(p, options, {"unreduced", "start", "meshes", "elements", "equilibrium", "particles", "seismic-coefficient",
                                    "critical-seismic"})  # fmt: skip
    return options


# --- 2. Strength reduction on each mesh ------------------------------------------------------------------------------


def target(factor: float, coefficient: float) -> Target:
    """The factor of safety; `factor` is that of limit analysis under a seismic coefficient."""
    under = f", $k_h$ = {coefficient:g}" if coefficient else ""
    return Target(
        "factor_of_safety", "failed_at_factor", "limit_analysis_factor_of_safety", factor,
        title="Factor of safety {:.3f}" + under, line="{:.3f}", label="Factor of safety [-]",
    )  # fmt: skip


def safety(a: Namespace, cell_size: float, dilation_angle: float) -> bridge.Collapse:
    """Weaken the soil to the last equilibrium on one mesh."""
    model = slope_fem(a, comm, cell_size, dilation_angle, a.depth)
    progress = step_line(f"cells of {cell_size:g} m, dilation angle {dilation_angle:g} degrees", "factor")
    load = shaken(weight(a.unit_weight), a.seismic_coefficient)
    return bridge.factor_of_safety(model, load, start=a.start, progress=progress)


def shaken(load: bridge.Load, coefficient: float, dim: int = 2) -> bridge.Load:
    """The load with inertia along the first axis."""
    return bridge.pseudo_static(load, [coefficient] + [0.0] * (dim - 1)) if coefficient else load


def critical_seismic(model: bridge.QuasiStatic, load: bridge.Load, where: str, along: int = 1) -> dict[str, object]:
    """Raise the inertia on finite elements until they fail; entries of the summary, printed on the first rank. Collective.

    Args:
        along: 1 or -1, along or against the first axis.
    """
    progress = step_line(where, "seismic coefficient")
    model.solve(load, progress=progress)
    if not model.converged:  # what else was found is kept
        if comm.rank == 0:
            print("critical seismic coefficient: none, the soil does not carry its weight without inertia")
        return {"critical_seismic_coefficient": None, "failed_at_seismic_coefficient": 0.0,
                "failure_shown_by_seismic_coefficient": False}  # fmt: skip
    dim = model.domain.geometry.dim
    found = bridge.collapse_load(model, lambda k: shaken(load, along * k, dim), first_step=0.05, progress=progress)
    if comm.rank == 0:
        end = f"failure at {found.failed_at:.3f}" if found.failed else f"at least: {found.reason}"
        print(f"critical seismic coefficient on the finest mesh: {found.value:.3f}, {end}")
    return {"critical_seismic_coefficient": found.value, "failed_at_seismic_coefficient": found.failed_at,
            "failure_shown_by_seismic_coefficient": found.failed}  # fmt: skip


def averages(a: Namespace, laws: Iterable[Any]) -> bool:
    """Whether particles average strains: as linear elements do, and beside other elements where they would lock."""
    return a.elements == "P1-averaged" or (a.elements != "P1" and keeps_volume(laws))


def slope_by_particles(a: Namespace) -> bridge.ParticleSafety:
    """The slope's factor by particles on the finest mesh, so stiff that they settle by a hundredth of a cell. Collective."""
    mesh = bridge.slope_mesh(comm, height=a.height, angle=a.angle, crest=a.crest, cell_size=a.cell_size, kind=a.mesh,
                             runout=a.height)  # fmt: skip
    background = bridge.background_mesh(*mesh)
    stiff = Namespace(**{**vars(a), "young": max(a.young, 100 * a.unit_weight * a.height**2 / a.cell_size)})

    def weakened(factor: float) -> mpm.Model:
        model = mpm.Model(background, bridge.reduced_strength(soil_of(stiff), factor))
        model.seed(density=a.unit_weight / GRAVITY, per_cell=3, cell_tag=bridge.SOIL)
        bridge.apply_supports(model, SUPPORTS)
        model.set_gravity((a.seismic_coefficient * GRAVITY, -GRAVITY))
        return model

    nmd = averages(a, [soil_of(a)])
    return bridge.particle_safety(weakened, start=a.start, nmd=nmd, progress=step_line("particles", "factor"))


def site_by_particles(a: Namespace, site: Site) -> bridge.ParticleSafety:
    """The factor of a site by particles. Collective."""

    def weakened(factor: float) -> mpm.Model:
        model = site.particles(
            IN_TETRAHEDRON if site.dimension == 3 else 3,
            bridge.reduced_strength(site.laws, factor, site.tags_of(a.unreduced)),
        )
        gravity = model.gravity
        gravity[0] += a.seismic_coefficient * GRAVITY
        model.set_gravity(gravity)
        if not site.stages:
            model.install(site.members)
        return model

    return bridge.particle_safety(
        weakened,
        start=a.start,
        nmd=averages(a, site.laws.values()),
        progress=step_line("particles", "factor"),
    )


def particle_summary(found: bridge.ParticleSafety) -> dict[str, object]:
    """Results of the particles, which are printed on the first rank as well."""
    if comm.rank == 0:
        end = f"flow at {found.failed_at:.3f}" if found.failed else f"at least: {found.reason}"
        print(f"particles on the finest mesh: {found.value:.3f}, {end}")
    return {"factor_of_safety_by_particles": found.value, "failed_at_factor_by_particles": found.failed_at,
            "failure_shown_by_particles": found.failed}  # fmt: skip


def critical_slope(a: Namespace) -> dict[str, object]:
    """The critical seismic coefficient of the slope on the finest mesh, and by limit analysis. Collective."""
    soil = a.height, a.angle, a.cohesion, a.friction_angle, a.unit_weight
    angle = dilation_angles(a)[0]
    found = critical_seismic(
        slope_fem(a, comm, a.cell_size, angle, a.depth), weight(a.unit_weight), f"cells of {a.cell_size:g} m"
    )
    if found["critical_seismic_coefficient"] is None or bridge.log_spiral_safety(*soil, depth=a.depth) <= 1:
        return found | {"limit_analysis_seismic_coefficient": None}
    limit = bridge.log_spiral_seismic(*soil, depth=a.depth)
    if comm.rank == 0:
        curve = bridge.log_spiral(*soil[:4], a.crest, depth=a.depth, seismic=limit).curve
        print(
            f"critical seismic coefficient by limit analysis, associated flow: {limit:.3f}\n{outside_line(a, curve)}",
            end="",
        )
    return found | {"limit_analysis_seismic_coefficient": limit}


def site_load(site: Site, model: bridge.QuasiStatic) -> bridge.Load:
    """Its load, after its stages if it has some. Collective.

    They are placed at once, since the factor hardly depends on stresses before failure. But soil with friction whose water does not
    drain has the strength of its effective stress when it ceases to drain: stages in which that happens are carried out, as are those of
    a site with K0 or overconsolidation. Of a site with strength ratios those before the last stage that gives one are.

    Raises:
        RunError: a stage that is carried out has no equilibrium.
    """
    undrains = any(keeps_effective_stress(law) for stage in site.stages for law in stage.law.values())
    try:
        if site.soils_with_strength_ratio and not undrains:
            return bridge.FemSite(model).place(site.stages or [all_at_rest(site)])
        if not (undrains or site.begins_at_rest):
            return bridge.FemSite(model).place(site.stages) if site.stages else site.load()
        if site.stages:
            list(bridge.carry_out(bridge.FemSite(model), site.stages))
        else:
            begin_at_rest(site, model)
    except bridge.StageError as error:
        raise mpm.RunError(
            f"there is no equilibrium to find a factor of safety of, which is below 1: {error}"
        ) from error
    return model.load


def keeps_effective_stress(law: Any) -> bool:
    """Whether soil of a law has friction but water that does not drain, so that its strength hardly depends on what loads it later."""
    each = list(with_inner_laws(law))
    friction = [one.friction_angle for one in each if hasattr(one, "friction_angle")]
    return any(hasattr(one, "water_modulus") for one in each) and bool(
        np.max(friction, initial=1.0 - bool(friction)) > 0
    )


def warn_of_undrained_weight(site: Site) -> None:
    """Warn of soil with friction that is placed undrained, so that its own weight presses on its water only, but for soil with K0. Collective."""
    names = [name for name, tags in bridge.names_of(site.cell_tags).items() if name not in site.k0
             and any(keeps_effective_stress(site.laws[tag]) for tag in tags if tag in site.laws)]  # fmt: skip
    if names:
        say(f"the water of {', '.join(map(repr, names))} bears the weight of this soil, too, which is placed undrained: its friction gives hardly "
            "any strength. Ground that has drained under its weight has k0, or the law of drained soil first, and by `law` of a later stage that of "
            "undrained soil (docs/howto/stages.md)")  # fmt: skip


def slip_line(a: Namespace, factor: float) -> np.ndarray | None:
    """Slip line of limit analysis with the strength divided by the factor of safety; None where the surface slides."""
    reduced = float(np.degrees(np.arctan(np.tan(np.radians(a.friction_angle)) / factor)))
    if reduced >= a.angle + np.degrees(np.arctan(a.seismic_coefficient)):
        return None
    return bridge.log_spiral(
        a.height, a.angle, a.cohesion / factor, reduced, a.crest, depth=a.depth, seismic=a.seismic_coefficient
    ).curve


# --- 3. Pictures -----------------------------------------------------------------------------------------------------


def drawn(a: Namespace, found: CollapseRuns, line: np.ndarray | None, folder: Path) -> Pictures:
    """Mechanism, displacement over the factor, and convergence. Collective."""
    labels = "Largest displacement [mm]", "Factor that divides the strength [-]"
    return {
        **found.mechanism_pictures(folder, line, "log-spiral, limit analysis"),
        **found.curve_pictures(folder, "factor_displacement", labels, lowest=0.98 * a.start),
    }


# --- 4. All together -------------------------------------------------------------------------------------------------


@without_warning(NOT_REACHED)  # said by the error of a factor of safety
def main(arguments: list[str] | None = None) -> int:
    a = parse(arguments)
    if a.site is not None:

        def require(site):
            require_soils(a.unreduced, site.soils, f"--unreduced, {a.site}")
            if site.axisymmetric and (a.seismic_coefficient or a.critical_seismic):
                given = (
                    f"--seismic-coefficient is {a.seismic_coefficient:g}"
                    if a.seismic_coefficient
                    else "--critical-seismic is given"
                )
                raise mpm.InputError(f"{given}, but {a.site} is axisymmetric: inertia along the radius would push its soil "
                                     "away from the axis on all sides; expected a plane section or a body in three dimensions")  # fmt: skip
            if a.particles and site.soils_with_strength_ratio:
                raise mpm.InputError(f"--particles: {a.site} has strength_ratio, but these particles begin without the stresses that it needs; leave "
                                     "the option out, or follow the particles of the site by the study embankment")  # fmt: skip

        def factor(site, model, progress):
            unreduced = site.tags_of(a.unreduced)
            warn_of_undrained_weight(site)
            with mistakes_in(a.site):
                load = shaken(site_load(site, model), a.seismic_coefficient, model.domain.geometry.dim)
            return bridge.factor_of_safety(model, load, start=a.start, progress=progress, unreduced=unreduced)

        def more(site):
            if a.particles:
                say_left_out(site.k0, site.overconsolidation, "particles")
            found = particle_summary(site_by_particles(a, site)) if a.particles else {}
            if a.critical_seismic:
                model = site.finite_elements(**finite_elements(a))
                found |= critical_seismic(model, site_load(site, model), "site", -1 if a.seismic_coefficient < 0 else 1)
            return found

        return site_study(
            a, factor, "factor_of_safety", "Factor of safety [-]", more, at_once=a.particles, require=require
        )
    start = perf_counter()
    folder = open_results(a, comm)
    soil = a.height, a.angle, a.cohesion, a.friction_angle, a.unit_weight
    limit = bridge.log_spiral_safety(*soil, depth=a.depth, seismic=a.seismic_coefficient)
    sizes = mesh_sizes(a)
    runs = {angle: [safety(a, size, angle) for size in sizes] for angle in dilation_angles(a)}
    found = CollapseRuns(target(limit, a.seismic_coefficient), a.friction_angle, sizes, runs)

    curve = found.finest_curve()
    summary = {
        **found.summary(),
        **(particle_summary(slope_by_particles(a)) if a.particles else {}),
        **(critical_slope(a) if a.critical_seismic else {}),
        "curve_factor": curve[:, 0],
        "curve_largest_displacement_m": curve[:, 1],
        "wall_seconds": perf_counter() - start,
    }
    line = slip_line(a, limit)
    outside = "" if line is None else outside_line(a, line)
    said = f"limit analysis, associated flow: {limit:.3f}\n{outside}{found.lines()}"
    write_summary(folder, a, summary, comm, Page(captions=CAPTIONS), drawn(a, found, line, folder), said)
    return found.exit_code()


if __name__ == "__main__":
    run_study(main)
