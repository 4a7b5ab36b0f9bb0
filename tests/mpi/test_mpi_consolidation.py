"""Consolidation on several ranks is that on one."""

import numpy as np
import pytest
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water

LEFT, RIGHT, BASE, TOP = 1, 2, 3, 4


FULL = water.AlwaysSaturated()


def layer(comm, element, retention=FULL):
    """A layer of Mohr-Coulomb soil, 4 m by 2 m, under a load that grows, with a seepage face at its right side."""
    domain, _, facet_tags = bridge.box_mesh(comm, (4.0, 2.0), (8, 4))
    soil = mpm.MohrCoulomb(young=10e6, poisson=0.3, cohesion=1e3, friction_angle=20.0, dilation_angle=0.0)
    supports = [bridge.roller(LEFT, (1, 0)), bridge.roller(RIGHT, (1, 0)), bridge.fixed(BASE)]
    boundary = [water.Reservoir(TOP, ((0.0, 2.0), (1e4, 3.0))), water.SeepageFace(RIGHT)]
    load = lambda time: bridge.Load(unit_weight=20e3, pressure={TOP: 1.5 * time})
    return water.Consolidation(
        domain, soil, water.PorousSoil(1e-7, retention=retention), facet_tags, supports, boundary, load=load, element=element
    )  # fmt: skip


@pytest.mark.parametrize("retention", [FULL, water.VanGenuchten(2e-4, 2.0)], ids=["full", "dries"])
@pytest.mark.parametrize("element", list(water.Element))
def test_steps_with_plastic_soil_and_a_seepage_face_do_not_depend_on_the_number_of_ranks(element, retention):
    points, results = np.array([[0.5, 0.3], [2.1, 1.4], [3.9, 0.2]]), []
    for comm in (MPI.COMM_SELF, MPI.COMM_WORLD):
        model = layer(comm, element, retention)
        reports = model.run(3e4, 1e3, growth=2.0)
        assert reports[-1].converged and max(abs(r.water_error) for r in reports) < 1e-12
        assert comm.allreduce(float(model.points.deviatoric_strain.max(initial=0.0)), MPI.MAX) > 1e-3
        there = model.evaluate_at(points)
        results.append(
            [
                *(1e3 * there["displacement"]).ravel(),
                *(1e-3 * there["pressure"]).ravel(),
                *(1e-3 * there["stress"]).ravel(),
                1e7 * model.inflow(RIGHT),
                1e7 * model.inflow(TOP),
                model.stored_water(),
                *(1e-3 * model.reaction(BASE)),
                float(sum(r.iterations for r in reports)),
            ]
        )
    assert results[1] == pytest.approx(results[0], rel=1e-6, abs=1e-6)


def test_a_bad_argument_is_refused_on_all_ranks():
    model = layer(MPI.COMM_WORLD, water.Element.STABILISED)
    with pytest.raises(mpm.InputError, match="dt: got -1.0 s"):
        model.advance(-1.0)
    with pytest.raises(mpm.InputError, match="no facet has the tag 9"):
        model.boundary = [water.Head(9, 1.0)]
        model.advance(1.0)
