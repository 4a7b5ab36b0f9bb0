"""The warning of soil that does not drain where it ends at the top of the mesh is the same on any partition, and comes once."""

import warnings

import pytest
from mpi4py import MPI
from partitions import bands, one_does_all, scattered, spread_box

import mpm_core as mpm


def said(comm, owners_of=bands, body=((0.0, 0.0), (1.0, 1.0))):
    """Warnings of a block in a box of 2 m by 1 m, from all ranks."""
    mesh = spread_box((8, 4), (2.0, 1.0), comm, owners_of, body=body)
    model = mpm.Model(mesh, mpm.LinearElastic(young=1e6, poisson=0.0))
    model.seed(density=2000.0, per_cell=6, cell_tag=1)
    model.fix(3)
    model.set_gravity((0.0, -9.81))
    model.add_water(porosity=0.4, conductivity=1e-5, drained_surface=True)
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        list(model.implicit(10.0, dt=5.0, quasi_static=True))
    of_ranks = comm.allgather([str(one.message) for one in found if "drained_surface" in str(one.message)])
    return [text for texts in of_ranks for text in texts]


@pytest.mark.parametrize("owners_of", [bands, scattered, one_does_all])
@pytest.mark.parametrize(
    "body, words",
    [
        (((0.0, 0.0), (2.0, 1.0)), "has no effect: over 2 m, between (0, 1) and (2, 1) m"),
        (((0.0, 0.0), (1.0, 1.0)), "does not drain all of the soil: over 0.75 m, between (0, 1) and (0.75, 1) m"),
        (((0.0, 0.0), (2.0, 0.75)), None),
    ],
)
def test_the_warning_does_not_depend_on_the_partition(comm, owners_of, body, words):
    found = said(comm, owners_of, body)
    assert found == said(MPI.COMM_SELF, body=body)
    assert len(found) == (words is not None) and all(words in text for text in found)
