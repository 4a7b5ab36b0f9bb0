"""The same number of ranks twice: explicit steps are the same to the last bit, implicit ones and finite elements to 1e-10.

MUMPS adds up what ranks send in the order in which it arrives.
"""

import os
import subprocess
import sys

import numpy as np
import pytest

# Writes arrays of all ranks after each stage: BITS are to be the same to the last bit, others nearly.
PROGRAM = """
import sys
import numpy as np
from mpi4py import MPI
import fenics_bridge as bridge
import mpm_core as mpm
from mpm_core import petsc
petsc.ALONE_LIMIT[2] = 0  # all ranks factorise together
comm = MPI.COMM_WORLD
found = {}

def keep(name, *arrays):
    for k, parts in enumerate(zip(*comm.allgather([np.array(a) for a in arrays]))):
        found[f"{name}{k}"] = np.concatenate([part.ravel() for part in parts])

soil = mpm.MohrCoulomb(young=200e3, poisson=0.33, cohesion=1e3, friction_angle=25.0)
parts = bridge.slope_mesh(comm, cell_size=0.2)
model = mpm.Model(bridge.background_mesh(*parts), soil)
keep("BITS mesh", model.mesh.points, model.mesh.cells, model.mesh.global_cells)
model.seed(density=18e3 / 9.81, per_cell=3, cell_tag=bridge.SOIL)
model.roller(bridge.LEFT, (1, 0))
model.fix(bridge.BASE)
p = model.particles
model.set_gravity((0, -4.4 * 9.81))
next(iter(model.explicit(1.0, every_steps=200, damping=0.5, rebalance=1.1)))
assert model.repartitions > 0
keep("BITS explicit", p.id, p.position, p.stress)
list(model.implicit(model.time + 0.004, dt=0.002, damping=0.5))
order = np.argsort(p.id)
keep("implicit", p.id[order], p.position[order], p.stress[order])
body, _, facets = bridge.soil_mesh(*parts)
held = [bridge.roller(bridge.LEFT, (1, 0)), bridge.fixed(bridge.BASE)]
for elements in ({"degree": 1, "nmd": True}, {"degree": 2}):
    fem = bridge.QuasiStatic(body, soil, facets, held, **elements)
    assert fem.solve(bridge.Load(unit_weight=18e3))[-1].converged
    keep(f"elements {elements}", fem.displacement.x.array, fem.points.stress)
undrained = bridge.solve_nearly_incompressible(body, facets, held, 200e3, 0.499, 20e3)
keep("undrained", undrained.displacement.x.array, undrained.stress_function(smooth=True).x.array)
fresh = mpm.Model(bridge.background_mesh(*parts), soil)
fresh.seed(density=18e3 / 9.81, per_cell=3, cell_tag=bridge.SOIL)
fresh.roller(bridge.LEFT, (1, 0))
fresh.fix(bridge.BASE)
fresh.set_gravity((0, -9.81))
bridge.initialise(fresh, fem)
keep("hand-over", fresh.particles.id, fresh.particles.position, fresh.particles.stress)
if comm.rank == 0:
    np.savez(sys.argv[1], **found)
"""


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """What two runs on 3 ranks found."""
    root = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    launch = ["mpirun", "-n", "3", "--oversubscribe", "--mca", "mpi_yield_when_idle", "1"]
    files = [tmp_path_factory.mktemp("twice") / f"{number}.npz" for number in range(2)]
    for file in files:
        run = subprocess.run([*launch, sys.executable, "-c", PROGRAM, str(file)], capture_output=True, text=True,
                             timeout=240, env={**os.environ, **root})  # fmt: skip
        assert run.returncode == 0, run.stderr
    return [dict(np.load(file)) for file in files]


def test_the_cut_and_explicit_steps_are_the_same_to_the_last_bit(runs):
    names = [name for name in runs[0] if name.startswith("BITS")]
    assert len(names) == 6
    for name in names:
        assert runs[0][name].tobytes() == runs[1][name].tobytes(), name


def test_equilibria_and_implicit_steps_are_the_same_to_a_ten_billionth(runs):
    names = [name for name in runs[0] if not name.startswith("BITS")]
    assert len(names) == 12
    for name in names:
        first, second = (run[name] for run in runs)
        assert first.shape == second.shape, name
        assert np.abs(first - second).max() <= 1e-10 * np.abs(first).max(), name
