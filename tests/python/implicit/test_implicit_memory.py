"""Memory of runs by implicit steps."""

import resource
from pathlib import Path

from core_cases import box

import mpm_core as mpm


def resident():
    """Memory of this process [bytes]."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize()


def test_a_run_frees_the_matrices_of_the_run_before():
    """PETSc keeps matrices that Python has dropped until it is told to free them; ten systems of 10,000 nodes are 400 MB."""
    model = mpm.Model(box((100, 100)), mpm.LinearElastic(young=10e6, poisson=0.3))
    model.seed(density=2000.0, per_cell=1)
    model.fix(3)

    def run(loads):
        for load in loads:
            model.set_gravity((0.0, -load))
            list(model.implicit(model.time + 1.0, dt=1.0, quasi_static=True, small_displacements=True))

    run([1.0, 2.0, 3.0])
    before = resident()
    run(range(4, 14))
    grown = resident() - before
    print(grown)
    assert grown < 50e6
