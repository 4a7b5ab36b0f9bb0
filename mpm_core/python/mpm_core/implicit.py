"""The implicit scheme over time: steps are shortened when they fail and grow again when they converge easily."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _core
from ._core import InputError, Integration, RunError
from .checks import flag, positive, within
from .energy import ADVICE, LEAST_STEPS, EnergyWatch
from .explicit import is_report_due
from .failure_watch import FailureWatch
from .ghost import GhostPenalty
from .law_warnings import dilates
from .load_watch import LoadWatch
from .partition import keep_balance
from .rayleigh import Rayleigh, implicit_mass_damping
from .report import ImplicitReport
from .solution import Solution
from .space import swollen
from .step_control import StepControl

if TYPE_CHECKING:
    from .model import Model

LEAST_EULER_STEPS = 4
"""Steps of backward Euler after which a warning may give the energy that a run dissipates"""

AVERAGED = "implicit steps with nmd=True generate energy where soil dilates, since they do not average its forces: take nmd=False"
"""Advice for implicit runs that average strains of soil that dilates"""

STRAINS_ALONE = (
    "implicit steps with nmd=True average strains but not forces, which generates energy as soil fails, whatever the step, and more "
    "from an equilibrium of averaged forces: give bridge.initialise nmd=False, and Model.equilibrate averaged_forces=False "
    "(docs/howto/limits.md)"
)
"""Advice for implicit runs that average strains and generate energy"""


def implicit_options(
    damping: float,
    pic: float,
    nmd: bool,
    integration: Integration,
    quasi_static: bool,
    ghost: GhostPenalty | None,
    small_displacements: bool = False,
    second_order: bool = False,
    rayleigh: Rayleigh | None = None,
    averaged_forces: bool = False,
) -> Any:
    """The core's options of the scheme; see `Model.implicit` and `Model.equilibrate`."""
    options = _core.ImplicitOptions()
    options.damping = within("damping", damping, 0, 1, open_above=True)
    options.mass_damping = implicit_mass_damping(rayleigh)
    options.pic = within("pic", pic, 0, 1)
    options.nmd = flag("nmd", nmd)
    if integration == Integration.DUAL_DOMAIN:
        raise InputError("integration is DUAL_DOMAIN, expected PARTICLES or MIXED, which the implicit scheme has")
    options.integration = integration
    options.quasi_static = flag("quasi_static", quasi_static)
    if second_order and quasi_static:
        raise InputError("second_order is True, expected False where quasi_static is True: there is no inertia")
    if second_order and damping:
        raise InputError(
            f"second_order is True with damping {damping:g}, expected damping 0: such steps do not bring a body to rest; those of "
            "backward Euler (second_order False) do"
        )
    options.second_order = flag("second_order", second_order)
    if not isinstance(ghost, (GhostPenalty, type(None))):
        raise InputError(f"ghost is {ghost!r}, expected a GhostPenalty or None")
    options.ghost = (ghost or GhostPenalty()).options()
    if small_displacements and not quasi_static:
        raise InputError("small_displacements is True, expected False unless quasi_static is True")
    options.hold_positions = flag("small_displacements", small_displacements)
    options.average_stress = bool(nmd and (small_displacements or averaged_forces))
    options.as_elements = bool(nmd and small_displacements)
    return options


def _least_steps(options: Any) -> int:
    """Number of steps from which the energy of an implicit run is checked."""
    return LEAST_STEPS if options.second_order or options.damping else LEAST_EULER_STEPS


def energy_advice(model: Model, options: Any, generated: bool) -> str:
    """Advice on energy that an implicit run does not explain. Collective.

    Args:
        model: soil without pore water may take steps of second order.
        options: the core's.
        generated: the scheme has generated that energy; otherwise it has dissipated it.
    """
    strains_alone = options.nmd and not options.average_stress
    if strains_alone and dilates(model.laws):
        return f"{AVERAGED}; {_usual_advice(model, options, generated)}"
    return swollen(model) or (
        STRAINS_ALONE if strains_alone and generated else _usual_advice(model, options, generated)
    )


def _usual_advice(model: Model, options: Any, generated: bool) -> str:
    """Advice on the scheme itself, of which backward Euler dissipates energy and generates none."""
    if generated or options.second_order or options.damping:
        return ADVICE
    less = "shorter steps" if model.has_water else "second_order=True with integration=MIXED, or shorter steps,"
    return (
        "steps of backward Euler dissipate motion that they resolve, and a slide ends too early: "
        f"{less} dissipate less (docs/implicit.md)"
    )


def checked_accuracy(accuracy: float | None, second_order: bool) -> float | None:
    """See `Model.implicit`."""
    if accuracy is None:
        return None
    if not second_order:
        raise InputError(f"accuracy is {accuracy} m, expected None unless second_order is True")
    return positive("accuracy", accuracy, "m")


class Stepper:
    """Implicit steps of a model, with counts of iterations and cutbacks since the last report.

    Args:
        model: the model.
        solver: how to solve a step, such as ``Newton()``.
        options: the core's options of the scheme.
        dt: longest step [s].
        accuracy: largest error in displacement [m] of a step of second order; None for no limit.
    """

    def __init__(self, model: Model, solver: Any, options: Any, dt: float, accuracy: float | None = None) -> None:
        self._accuracy, self._growth = accuracy, 2.0
        self._model, self._core = model, model._core
        self._options, self._method = options, solver
        self.begin_anew()
        self.control = StepControl(dt, dt)
        self.last = Solution()
        """Solution of the last step that was tried"""

    def begin_anew(self) -> None:
        """Discard the data of the nodes of this rank, after these have changed."""
        dim = self._model.mesh.dim
        self._step = getattr(_core, type(self._core).__name__.replace("Model", "ImplicitStep"))(self._core)
        self._solver = self._method.solver(self._model.comm, dim)
        self._changed = True

    def advance(self, until: float) -> None:
        """Make one step towards a time, shortened until it converges.

        Raises:
            RunError: the shortest step failed too; the message has the reason. The particles are unchanged.
        """
        while True:
            left = until - self._core.time
            dt = left / max(1, int(np.ceil(left / self.control.length - 1e-6)))
            reason = self.attempt(dt)
            if not reason:
                break
            self.control.cut(dt)
            if self.control.is_too_short:
                raise RunError(
                    f"the implicit step at t = {self._core.time:.9g} s failed with all step lengths from "
                    f"{self.control.longest:.3g} s down to {dt:.3g} s: {reason}{self._advice(reason)}"
                )
        if self.last.easy:
            self.control.grow(self._growth)

    def _advice(self, reason: str) -> str:
        """What helps where the solver of a step gave up, which it often does as the soil fails."""
        if not reason.endswith("iterations"):
            return ""
        if self._options.quasi_static:
            return "; if the soil fails here there is no equilibrium, and it moves in steps with inertia (quasi_static=False)"
        return "; if the soil fails here it moves much faster than before: take a dt that is short for a slide, such as 0.05 s"

    def attempt(self, dt: float) -> str:
        """Try one step; the particles change only if it succeeds. Returns the reason of a failure, or an empty text."""
        self._changed |= self._step.start(self._options, dt)
        self._solve()
        if self._options.second_order and self.last.converged:
            first = self.last
            self._step.start_second_stage()
            self._solve()
            self.last.easy = self.last.easy and first.easy
            reason = self._too_coarse() if self.last.converged else ""
            if reason:
                return reason
        return self._step.finish() if self.last.converged else self.last.reason

    def _solve(self) -> None:
        """Solve one stage."""
        self.last = self._solver.solve(self._step, self._step.dt, self._changed)
        self._changed = False
        self.control.iterations += self.last.iterations

    def _too_coarse(self) -> str:
        """Reason to shorten the step, or an empty text; sets the growth of the next one."""
        if self._accuracy is None:
            return ""
        error = self._step.displacement_error()
        self._growth = float(np.clip(0.9 * np.sqrt(self._accuracy / max(error, 1e-300)), 0.5, 2.0))
        return f"an error of {error:.3g} m in displacement" if error > 2 * self._accuracy else ""

    def report(self) -> ImplicitReport:
        """State of the run; resets the counts of iterations and cutbacks."""
        report = ImplicitReport(
            **vars(self._model.report()),
            iterations=self.control.iterations,
            cuts=self.control.cuts,
            residual=self.last.residuals[-1],
        )
        self.control.iterations = self.control.cuts = 0
        return report


def run_implicit(
    model: Model,
    solver: Any,
    options: Any,
    *,
    times: Sequence[float],
    dt: float,
    every_steps: int | None,
    watch: Callable[[], bool] | None,
    rebalance: float,
    energy_limit: float | None,
    accuracy: float | None,
    conversion: Any,
) -> Iterator[ImplicitReport]:
    """Step to each of the times; yields a report there, and after every ``every_steps`` steps."""
    stepper = Stepper(model, solver, options, dt, accuracy)
    resumed, model._resumed = model._resumed, None
    if resumed is not None:
        stepper.control = replace(resumed, longest=dt, length=min(dt, resumed.length))
    model._control = stepper.control
    advice = partial(energy_advice, model, options)
    energy = EnergyWatch(energy_limit, model.comm.rank == 0, advice, _least_steps(options))
    failure = FailureWatch(model, options)
    loads = LoadWatch(model)

    def report() -> ImplicitReport:
        now = stepper.report()
        if not options.quasi_static:  # without inertia what a sudden load does beyond the stresses' work goes nowhere
            energy.look(now)
            failure.look(now)
        loads.look()
        return now

    for until in times:
        close = 1e-9 * abs(until)
        while until - model.time > close:
            if keep_balance(model, rebalance):
                stepper.begin_anew()
            model._core.convert_near_surfaces(dt)
            stepper.advance(until)
            if conversion is not None:
                model._core.convert_failing(conversion)
            if until - model.time <= close:
                model._core.time = until
            ends = watch is not None and watch()
            if ends or (model.time < until and is_report_due(model, every_steps)):
                yield report()
            if ends:
                return
        yield report()
