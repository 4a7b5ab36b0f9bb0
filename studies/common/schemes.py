"""The time schemes that studies can choose from on the command line, and their runs."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Iterator, Sequence

from mpm_core.integration import LEAST_IN_CELL
from mpm_core.law_warnings import dilates, keeps_volume, locks_at_failure

import mpm_core as mpm

from .checks import check_effect
from .options import add_choice, add_count, add_number, add_switch, check

SCHEMES = ("explicit", "implicit", "quasi-static")
SOLVERS = ("newton", "relaxation")
INTEGRATIONS = {
    "particles": mpm.Integration.PARTICLES,
    "mixed": mpm.Integration.MIXED,
    "dual-domain": mpm.Integration.DUAL_DOMAIN,
}
TRANSFERS = {"flip": mpm.Transfer.FLIP, "affine": mpm.Transfer.AFFINE}

# fmt: off
PER_CELL = (1, 3, 4, 6, 8, 10, 12, 15, 16, 20, 21, 24, 28, 32, 35, 36, 40, 45, 48, 55, 56, 60, 64, 66, 78, 80, 84, 91, 96)
"""Numbers of particles, up to a hundred, that fill a triangle or a tetrahedron evenly"""
# fmt: on
IMPLICIT_STEP = 20.0
"""Default step of the implicit schemes over the critical one."""


def add_scheme_options(parser: argparse.ArgumentParser, integration: str | None = "particles") -> None:
    """Options ``--scheme``, ``--solver``, ``--second-order``, ``--integration``, ``--transfer`` and ``--dt``.

    Args:
        integration: default of ``--integration``; None for that of `stable_integration`.
    """
    add_choice(parser, "--scheme", "explicit", SCHEMES,
               "time scheme; quasi-static neglects inertia and raises the unit weight from zero over --time")  # fmt: skip
    add_choice(parser, "--solver", "newton", SOLVERS, "solver of an implicit or quasi-static step")
    add_discretisation(parser, integration)
    add_number(parser, "--dt", None, "s", "largest time step (default: half of the critical one; 20 times the critical "
               "one where implicit or quasi-static)", above=0)  # fmt: skip


def add_particles_per_cell(parser: argparse.ArgumentParser, default: int) -> None:
    """Option ``--particles-per-cell``."""
    text = "particles in each soil cell at the start: 1, 3, 4, 6, 10, 12, ...; in a tetrahedron 1, 4, 8, 10, ..."
    add_count(parser, "--particles-per-cell", default, text, choices=PER_CELL)


def add_pic(parser: argparse.ArgumentParser, default: float | None, about: str = "") -> None:
    """Option ``--pic``; ``about`` says what it is by default where that depends on others."""
    add_number(parser, "--pic", default, "-",
               "PIC fraction: fraction of a particle's velocity that is replaced by the nodal one in a critical time step "
               f"(0 is FLIP{about})",
               at_least=0, at_most=1)  # fmt: skip


def add_damping(parser: argparse.ArgumentParser) -> None:
    """Options ``--damping``, ``--mass-damping`` and ``--pic``, which `choose_damping` fills in."""
    add_number(parser, "--damping", None, "-", "local damping (default: 0; 0.75 for the paper's run and quasi-static steps, 0.01 "
               "for a site)", at_least=0, below=1)  # fmt: skip
    add_number(parser, "--mass-damping", None, "1/s", "mass-proportional damping; results depend less on the mesh than with "
               "local damping (default: 5 for a height of 1 m, in inverse "
               "proportion to its square root; 0 with local damping or affine transfer, for the paper's run, a site and "
               "quasi-static steps)", at_least=0)  # fmt: skip
    add_pic(parser, None, about="; default: 0.02 with mass damping, 0.002 for a site, otherwise 0")


def rayleigh_of(options: argparse.Namespace) -> mpm.Rayleigh | None:
    """The damping by ``--mass-damping``, in yielding soil too."""
    return mpm.Rayleigh(mass=options.mass_damping, plastic_strain=math.inf) if options.mass_damping > 0 else None


def choose_damping(parser: argparse.ArgumentParser, options: argparse.Namespace, local: bool, mass: float) -> None:
    """Fill in ``damping``, ``mass_damping`` and ``pic``, and end with an error where ``mass_damping`` does not fit.

    Args:
        local: local damping by default, as in the paper.
        mass: mass damping by default where there is no local damping [1/s].
    """
    if options.mass_damping is None:
        options.mass_damping = 0.0 if local or options.damping is not None or options.transfer == "affine" else mass
    if options.damping is None:
        options.damping = 0.75 if local and options.mass_damping == 0 else 0.0
    if options.pic is None:
        options.pic = 0.02 if options.mass_damping > 0 else 0.0
    check(parser, options.mass_damping == 0 or (options.scheme != "quasi-static" and options.transfer == "flip"),
          lambda: f"--mass-damping is {options.mass_damping:g}, expected --scheme explicit or implicit and --transfer flip "
                  "with it")  # fmt: skip
    check(parser, options.mass_damping == 0 or options.site is None,
          lambda: f"--mass-damping is {options.mass_damping:g}, expected 0 with --site")  # fmt: skip


def stable_integration(per_cell: int, cohesive: bool) -> str:
    """Name of the integration whose runs keep their energy: mixed, but for few particles in a cell and for dry grains, which
    loosen (docs/integration.md)."""
    return "mixed" if cohesive and per_cell >= LEAST_IN_CELL[2] else "particles"


def averages_strains(scheme: str, laws: Sequence[object]) -> bool:
    """Whether a run averages strains by default: where linear cells lock in the soil. Implicit steps do not average forces,
    and lose their equilibrium or generate energy where averaged soil dilates (docs/guide/theory.md): there they do not average.
    """
    return keeps_volume(laws) or (locks_at_failure(laws) and (scheme == "explicit" or not dilates(laws)))


def add_discretisation(parser: argparse.ArgumentParser, integration: str | None = "particles") -> None:
    """Options ``--second-order``, ``--integration`` and ``--transfer``."""
    add_switch(parser, "--second-order", False, "implicit steps of second order in time instead of backward Euler's")
    add_choice(
        parser,
        "--integration",
        integration,
        tuple(INTEGRATIONS),
        "how stresses are integrated over a cell to nodal forces"
        + (
            ""
            if integration
            else f" (default: mixed; particles with --paper, or if the soil has no cohesion, or with fewer than "
            f"{LEAST_IN_CELL[2]} particles per cell)"
        ),
    )
    add_choice(
        parser, "--transfer", "flip", tuple(TRANSFERS), "which velocities particles carry from step to step (explicit)"
    )


def check_scheme_options(parser: argparse.ArgumentParser, options: argparse.Namespace) -> None:
    """Fill in ``initial`` (default: fem, or zero where quasi-static), and end with an error where options do not fit."""
    if options.initial is None:
        options.initial = "zero" if options.scheme == "quasi-static" else "fem"
    check(parser, options.scheme != "quasi-static" or options.initial == "zero",
          lambda: f"--initial is {options.initial}, expected zero with --scheme quasi-static, which raises the unit weight "
                  "from zero")  # fmt: skip
    check(parser, not options.second_order or options.scheme == "implicit",
          lambda: f"--second-order is given, expected --scheme implicit with it, not {options.scheme}")  # fmt: skip
    explicit = options.scheme == "explicit"
    check_effect(parser, options, not explicit, ("--solver",), "--scheme implicit or quasi-static")
    check_effect(parser, options, explicit, ("--transfer",), "--scheme explicit")
    check_effect(parser, options, options.initial != "zero", ("--initial-unit-weight",), "--initial fem, elastic or k0")
    check(parser, not options.second_order or options.damping == 0,
          lambda: f"--second-order is given with --damping {options.damping:g}, expected --damping 0 with it: such steps do not "
                  "bring a slope to rest")  # fmt: skip
    check(parser, options.integration != "dual-domain" or options.scheme == "explicit",
          lambda: f"--integration is dual-domain, expected particles or mixed with --scheme {options.scheme}")  # fmt: skip
    check(parser, options.transfer == "flip" or (options.scheme == "explicit" and options.integration != "dual-domain"),
          lambda: "--transfer is affine, expected --scheme explicit and --integration particles or mixed")  # fmt: skip


def solver_named(name: str) -> mpm.Newton | mpm.Relaxation:
    """The solver of an implicit step by its name on the command line."""
    return mpm.Newton() if name == "newton" else mpm.Relaxation()


def time_step(options: argparse.Namespace, model: mpm.Model) -> float | None:
    """The step asked for or the scheme's default [s]; None leaves it to the explicit scheme. A run that goes on keeps the one
    it began with. Collective."""
    if options.dt is not None or options.scheme == "explicit":
        return options.dt
    return model.resumed_dt or IMPLICIT_STEP * model.critical_time_step()


def run_scheme(
    options: argparse.Namespace,
    model: mpm.Model,
    every: float,
    watch: Callable[[], bool],
    *,
    rebalance: float | None = None,
    every_steps: int | None = None,
) -> Iterator[mpm.Report]:
    """Run a model to ``--time`` by the scheme asked for; yields reports.

    Args:
        options: with those of `add_scheme_options` and time, damping, mass_damping, pic and nmd.
        every: time between reports, counted from zero [s].
        watch: called between steps; true ends the run after a report.
        rebalance: see ``Model.explicit``.
        every_steps: steps between further reports.

    Raises:
        RunError: see ``Model.explicit`` and ``Model.implicit``; quasi-static, beyond the collapse load.
    """
    a, dt = options, time_step(options, model)
    common = {
        "every": every,
        "every_steps": every_steps,
        "rebalance": rebalance,
        "since": 0.0,
        "watch": watch,
        "damping": a.damping,
        "rayleigh": rayleigh_of(a),
        "pic": a.pic,
        "nmd": a.nmd,
        "integration": INTEGRATIONS[a.integration],
    }
    if a.scheme == "explicit":
        return model.explicit(a.time, dt=dt, transfer=TRANSFERS[a.transfer], **common)
    return model.implicit(
        a.time,
        dt=dt,
        solver=solver_named(a.solver),
        quasi_static=a.scheme == "quasi-static",
        second_order=a.second_order and a.scheme == "implicit",
        **common,
    )
