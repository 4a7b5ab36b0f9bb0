"""The explicit scheme over time: its options, and the times at which it reports."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI

from . import _core
from ._core import InputError, Integration, StressUpdate, Transfer
from .checks import flag, member, positive, within
from .energy import ADVICE, ADVICE_FOR, EnergyWatch
from .failure_watch import FailureWatch
from .load_watch import LoadWatch
from .partition import keep_balance
from .penetration import PenetrationWatch
from .rayleigh import Rayleigh
from .report import Report
from .space import SpaceWatch, count_parts, swollen
from .two_phase import of_suction

if TYPE_CHECKING:
    from .model import Model


def explicit_options(
    damping: float,
    nmd: bool,
    integration: Integration,
    stress_update: Any,
    rayleigh: Rayleigh,
    reproducible: bool,
    transfer: Any,
    moving_cells: bool,
) -> Any:
    """The core's options of the scheme; see `Model.explicit`."""
    options = _core.ExplicitOptions()
    options.damping = within("damping", damping, 0, 1, open_above=True)
    options.nmd = flag("nmd", nmd)
    options.transfer = member("transfer", transfer, Transfer)
    options.integration = integration
    options.moving_cells = flag("moving_cells", moving_cells)
    options.stress_update = member("stress_update", stress_update, StressUpdate)
    options.reproducible = flag("reproducible", reproducible)
    options.rayleigh = rayleigh._as_core()
    return options


def warn_of_parts(model: Model) -> None:
    """Warn where a body whose cells are to move with it consists of several parts. Collective."""
    count = count_parts(model)
    if count > 1 and model.comm.rank == 0:
        warnings.warn(
            f"the body consists of {count} parts, between which no force acts while cells move with them (moving_cells=True)",
            RuntimeWarning,
            stacklevel=3,
        )


def run_options(dt: float | None, courant: float, pic: float, allow_unstable: bool) -> Any:
    """The core's options of the time step; see `Model.explicit`."""
    run = _core.RunOptions()
    run.dt = None if dt is None else positive("dt", dt, "s")
    if not 0 < positive("courant", courant, "(a ratio)") <= 1:
        raise InputError(f"courant is {courant}, expected 0 < courant <= 1")
    run.courant = courant
    run.pic = within("pic", pic, 0, 1)
    run.allow_unstable = flag("allow_unstable", allow_unstable)
    return run


def require_particles(model: Model) -> None:
    """Raise InputError if no rank has particles. Collective."""
    if model.comm.allreduce(len(model.particles)) == 0:
        raise InputError("the model has no particles, seed some first")


def report_times(model: Model, until: float, every: float | None, since: float | None) -> list[float]:
    """Remaining times at which a run reports [s]; see `Model.explicit`."""
    if not (isinstance(until, (int, float, np.number)) and np.isfinite(until) and until >= model.time):
        raise InputError(f"until is {until!r} s, expected a time not before the present, {model.time} s")
    start = model.time if since is None else float(since)
    if not start <= model.time:
        raise InputError(f"since is {since} s, expected a time not after the present, {model.time} s")
    interval = until - start if every is None else positive("every", every, "s")
    if until == start:
        return []
    count = max(1, int(np.ceil((until - start) / interval - 1e-9)))
    done = int(np.floor((model.time - start) / interval + 1e-9))
    return [until if k == count else start + k * interval for k in range(done + 1, count + 1)]


def steps_to_report(model: Model, every: int | None) -> int:
    """Steps until the next report that is due after a number of steps since the model was made."""
    return sys.maxsize if every is None else every - model.steps % every


def is_report_due(model: Model, every: int | None) -> bool:
    """Whether a report is due after this number of steps."""
    return every is not None and model.steps % every == 0


def steps_between(every_steps: int | None) -> int | None:
    """Check the number of steps that a caller gives."""
    if every_steps is not None and (int(every_steps) != every_steps or every_steps < 1):
        raise InputError(f"every_steps is {every_steps}, expected a whole number from 1")
    return None if every_steps is None else int(every_steps)


def run_explicit(
    model: Model,
    options: Any,
    run: Any,
    times: Sequence[float],
    watch: Callable[[], bool] | None,
    rebalance: float,
    every_steps: int | None,
    energy_limit: float | None,
    rayleigh: Rayleigh,
) -> Iterator[Report]:
    """Step to each of the times; yields a report there, and after every ``every_steps`` steps."""
    # Python must run from time to time, for Ctrl-C. The pauses do not change the steps, which are chosen again
    # after each control interval anyway.
    most = max(1, model.comm.allreduce(len(model.particles), MPI.MAX))
    pauses = 1 if watch is not None or rebalance < np.inf else max(1, 2_000_000 // most // _core.control_interval)
    advice = ADVICE_FOR.get(options.integration, ADVICE)
    rests = run.conversion is None and model.comm.allreduce(bool(model.particles.is_resting.all()), MPI.LAND)
    # Particles do not cross cells, or have no motion against their nodes.
    smooth = options.moving_cells or options.transfer == Transfer.AFFINE or rests
    energy = EnergyWatch(
        energy_limit,
        model.comm.rank == 0,
        lambda generated: swollen(model) or advice + (of_suction(model) if generated else ""),
        noisy=smooth,
        damped=run.pic == 0,
    )
    failure = FailureWatch(model, options)
    penetration, loads = PenetrationWatch(model), LoadWatch(model)
    if model._space_watch is None:
        model._space_watch = SpaceWatch(model)

    def report() -> Report:
        now = model.report()
        energy.look(now)
        failure.look(now)
        penetration.look()
        loads.look()
        return now

    for until in times:
        run.until = until
        model._advance_free_fields(until, rayleigh)
        while model.time < until:
            keep_balance(model, rebalance)
            run.max_steps = min(pauses * _core.control_interval, steps_to_report(model, every_steps))
            model._core.run_explicit(options, run)
            ends = watch is not None and watch()
            if ends or (model.time < until and is_report_due(model, every_steps)):
                yield report()
            if ends:
                return
        if until == times[-1]:
            model._space_watch.look()
        yield report()
