"""An error on one rank ends all ranks with its message, in whatever phase of a run; none waits for ever."""

import sys
from contextlib import nullcontext

import numpy as np
import pytest
from mpm_core.output import ParticleOutput
from partitions import scattered, sliding_slope
from test_laws_failure import Fragile

import fenics_bridge as bridge
import mpm_core as mpm


class Case:
    """A sliding slope, and on the last rank something wrong."""

    def __init__(self, comm, folder):
        self.comm, self.folder = comm, folder
        self.wrong = comm.rank == comm.size - 1
        self.model = sliding_slope(comm, scattered)  # so that all ranks have particles

    def law(self):
        """Raises an error of Python on the last rank."""
        return mpm.PythonLaw(Fragile(-1.0 if self.wrong else np.inf, raises=True))


def set_up(case):
    model = mpm.Model(case.model.mesh, case.model.laws)
    model.seed(density=-1.0 if case.wrong else 1.0, per_cell=3, cell_tag=1)


def search(case):
    # The soil flies upwards as a whole, so that no cell is compressed; one rank has the particle that leaves the mesh first.
    case.model.particles.set("velocity", np.tile((0.0, 100.0), (len(case.model.particles), 1)))
    list(case.model.explicit(0.1, dt=1e-4, allow_unstable=True))


def explicit_step(case):
    model = sliding_slope(case.comm, scattered, laws=case.law())
    list(model.explicit(0.1))


def migration(case):
    # Particles that cross to other ranks, if the soil between them is not compressed to nothing before.
    velocity = np.tile((500.0, 0.0), (len(case.model.particles), 1))
    if case.wrong:
        case.model.particles.set("velocity", velocity)
    list(case.model.explicit(0.5, dt=1e-3, allow_unstable=True))


def rebalance(case):
    list(case.model.explicit(0.1, rebalance=0.5 if case.wrong else 1.2))


def output(case):
    with ParticleOutput(case.folder / "particles", case.comm) as series:
        position = case.model.particles.position
        series.write(0.0, {"position": position, "mass": np.zeros(len(position) + case.wrong)})


def checkpoint(case):
    case.model.save(case.folder / ("nowhere/state.h5" if case.wrong else "state.h5"))


def restart(case):
    case.model.save(case.folder / "state.h5")
    case.model.restore(case.folder / ("nothing.h5" if case.wrong else "state.h5"))


def implicit_solve(case):
    model = sliding_slope(case.comm, scattered, laws=case.law())
    list(model.implicit(0.1, dt=0.1))


def singular_tangent(case):
    # Nothing holds the soil along its base, and the one rank that factorises is alone in knowing.
    model = mpm.Model(case.model.mesh, case.model.laws)
    model.seed(density=2000.0, per_cell=3, cell_tag=1)
    model.roller(3, (0, 1))
    model.set_gravity((2.5, -9.5))
    model.equilibrate()


def body(case, law):
    soil, _, facet_tags = bridge.soil_mesh(*bridge.slope_mesh(case.comm, cell_size=0.2))
    supports = [bridge.roller(bridge.LEFT, (1, 0)), bridge.fixed(bridge.BASE)]
    return bridge.QuasiStatic(soil, law, facet_tags, supports, degree=1)


def finite_elements(case):
    fem = body(case, case.model.laws[0])
    fem.solve(bridge.Load(unit_weight=np.nan if case.wrong else 15e3))


def law_in_finite_elements(case):
    # A load that is not reached is no error; all ranks must know that it was not.
    fem = body(case, case.law())
    steps = fem.solve(bridge.Load(unit_weight=15e3))
    assert not fem.converged
    raise mpm.RunError(f"{len(steps)} steps: {steps[-1].report.reason}")


PHASES = {
    set_up: "density",
    search: "left the background mesh",
    explicit_step: "failed for the strain increment",
    migration: "left the background mesh|failed for the strain increment|would lose its volume",
    rebalance: "rebalance is 0.5, expected a number above 1",
    output: "mass has .* rows, expected",
    checkpoint: "path is not the same on all ranks|nowhere",
    restart: "nothing.h5",
    implicit_solve: "follows the law PythonLaw of Fragile",
    singular_tangent: "no equilibrium at t = 0 s",
    finite_elements: "unit_weight is nan",
    law_in_finite_elements: "1[0-9]? steps: ",
}


@pytest.mark.parametrize("phase", PHASES, ids=lambda phase: phase.__name__)
def test_one_rank_fails_and_all_end(comm, shared_path, phase, monkeypatch):
    monkeypatch.setattr(sys, "unraisablehook", lambda problem: None)  # prints what a law raises
    case = Case(comm, shared_path)
    with pytest.raises((mpm.InputError, mpm.RunError), match=PHASES[phase]) as raised:
        phase(case)
    assert len(set(comm.allgather(str(raised.value)))) == 1


def test_frames_of_one_run_have_one_path(comm, shared_path):
    path = shared_path / ("others" if comm.rank == 1 else "particles")
    expected = (
        pytest.raises(mpm.InputError, match="path is not the same on all ranks") if comm.size > 1 else nullcontext()
    )
    with expected, ParticleOutput(path, comm):
        pass
