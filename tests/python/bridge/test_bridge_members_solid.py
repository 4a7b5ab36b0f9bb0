"""Bars in finite elements of three dimensions, and the solvers of their linear systems."""

import numpy as np
import pytest
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge.fem import linear_solver


def box_with_bar(counts, stiffness, **options):
    """A bar of a stiffness in a box of 2 m and 1 MPa, shortened by 0.5 %, without lateral strain."""
    supports = [bridge.roller(5, (0, 0, 1)), bridge.roller(1, (1, 0, 0)), bridge.roller(3, (0, 1, 0)),
                bridge.prescribed(6, (None, None, -0.01))]  # fmt: skip
    domain, _, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, (1.0, 1.0, 2.0), counts)
    soil = mpm.LinearElastic(young=1e6, poisson=0.0)
    fem = bridge.QuasiStatic(domain, soil, facet_tags, supports, degree=1, **options)
    fem.reconfigure(members={"bar": mpm.bar([(0.3, 0.6, 0.0), (0.3, 0.6, 2.0)], stiffness)})
    return fem


def test_averages_in_three_dimensions_take_members_by_a_factorisation():
    """Also where the stiffness stays in factors without members: in more than 100 nodes."""
    fem = box_with_bar((4, 4, 8), 3e6, nmd=True)
    assert fem._body.solver.direct
    fem.solve(bridge.Load(displacement=1.0))
    assert np.allclose(fem.member_forces("bar").axial_force, -3e6 * 0.005, rtol=1e-8)
    assert fem.reaction(6)[2] == pytest.approx((1e6 + 3e6) * 0.005, rel=1e-8)
    fem.reconfigure(members={})
    assert not fem._body.solver.direct
    fem.solve(bridge.Load(displacement=1.0))
    assert fem.reaction(6)[2] == pytest.approx(2 * 1e6 * 0.005, rel=1e-7)  # shortened a second time


def test_averages_in_a_large_body_name_the_option_by_which_they_take_members(monkeypatch):
    monkeypatch.setattr(linear_solver, "DIRECT_LIMIT", {3: 100})
    with pytest.raises(
        mpm.InputError, match=r"expected a factorisation, by PETSC_OPTIONS='-fem_pc_type lu' in the environment"
    ):
        box_with_bar((4, 4, 8), 3e6, nmd=True)


def test_a_factorisation_takes_the_place_of_multigrid_that_fails_beside_a_stiff_member(monkeypatch):
    """A bar that is stiffer than the soil by eight orders carries its share, as among the matrices that are factorised from the start."""
    monkeypatch.setattr(linear_solver, "DIRECT_LIMIT", {3: 100})
    fem = box_with_bar((4, 4, 8), 1e14)
    assert not fem._body.solver.direct
    with pytest.warns(
        RuntimeWarning,
        match="the iterative solver of linear systems failed beside structural members, .* a factorisation takes its place from now on",
    ):
        fem.solve(bridge.Load(displacement=1.0))
    assert fem.converged and fem._body.solver.direct
    assert np.allclose(fem.member_forces("bar").axial_force, -1e14 * 0.005, rtol=1e-8)


def test_a_bar_in_three_dimensions_carries_its_share():
    fem = box_with_bar((2, 2, 4), 3e6)
    fem.solve(bridge.Load(displacement=1.0))
    assert np.allclose(fem.member_forces("bar").axial_force, -3e6 * 0.005, rtol=1e-8)
    assert fem.reaction(6)[2] == pytest.approx((1e6 + 3e6) * 0.005, rel=1e-8)
