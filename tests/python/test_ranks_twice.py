"""One number of ranks twice: two runs of a program are the same to the last bit, from the cut of the mesh to the last step.

So are equilibria of finite elements, and what particles take over from them."""

import os
import subprocess
import sys

# Prints a number for everything on all ranks after each stage.
PROGRAM = """
import hashlib
from mpi4py import MPI
import fenics_bridge as bridge
import mpm_core as mpm
comm = MPI.COMM_WORLD

def tell(*arrays):
    bits = hashlib.sha256(repr(comm.allgather([a.tobytes() for a in arrays])).encode()).hexdigest()
    if comm.rank == 0:
        print(bits)

soil = mpm.MohrCoulomb(young=200e3, poisson=0.33, cohesion=1e3, friction_angle=25.0)
parts = bridge.slope_mesh(comm, cell_size=0.1)
model = mpm.Model(bridge.background_mesh(*parts), soil)
tell(model.mesh.points, model.mesh.cells, model.mesh.global_cells)
model.seed(density=18e3 / 9.81, per_cell=3, cell_tag=bridge.SOIL)
model.roller(bridge.LEFT, (1, 0))
model.fix(bridge.BASE)
model.set_gravity((0, -9.81))
p = model.particles
body, _, facets = bridge.soil_mesh(*parts)
held = [bridge.roller(bridge.LEFT, (1, 0)), bridge.fixed(bridge.BASE)]
for elements in ({"degree": 1, "nmd": True}, {"degree": 2}):
    fem = bridge.QuasiStatic(body, soil, facets, held, **elements)
    assert fem.solve(bridge.Load(unit_weight=18e3))[-1].converged
    tell(fem.displacement.x.array, fem.points.stress)
undrained = bridge.solve_nearly_incompressible(body, facets, held, 200e3, 0.499, 20e3)
tell(undrained.displacement.x.array, undrained.stress_function(smooth=True).x.array)
bridge.initialise(model, fem)
tell(p.id, p.position, p.stress)
model.set_gravity((0, -4.4 * 9.81))
next(iter(model.explicit(1.0, every_steps=200, damping=0.5, rebalance=1.1)))
assert model.cuts > 0
tell(p.id, p.position, p.stress)
list(model.implicit(model.time + 0.004, dt=0.002, damping=0.5))
tell(p.id, p.position, p.stress)
"""


def test_two_runs_are_the_same_to_the_last_bit():
    root = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    launch = ["mpirun", "-n", "4", "--oversubscribe", "--mca", "mpi_yield_when_idle", "1"]
    runs = [
        subprocess.run([*launch, sys.executable, "-c", PROGRAM], capture_output=True, text=True, timeout=120,
                       env={**os.environ, **root})
        for _ in range(2)
    ]  # fmt: skip
    assert all(run.returncode == 0 for run in runs), runs[0].stderr + runs[1].stderr
    assert len(runs[0].stdout.split()) == 7
    assert runs[0].stdout == runs[1].stdout
