"""Structural members in finite elements are the same on 1, 2 and 3 ranks."""

import numpy as np
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

COMM = MPI.COMM_WORLD


def retained(comm):
    """Ground that a wall and a strut retain while its left part is loaded and the wall yields."""
    domain, cell_tags, facet_tags = bridge.box_mesh(comm, (6.0, 3.0), (24, 12))
    soil = mpm.MohrCoulomb(young=10e6, poisson=0.3, cohesion=5e3, friction_angle=30.0, dilation_angle=10.0)
    supports = [bridge.fixed(3), bridge.roller(1, (1, 0)), bridge.roller(2, (1, 0))]
    fem = bridge.QuasiStatic(domain, soil, facet_tags, supports, cell_tags=cell_tags)
    site = bridge.FemSite(fem)
    soils = fem.soils
    members = {
        "wall": mpm.beam([(3.1, 3.0), (3.1, 0.8)], 1e9, 2e6, plastic_moment=2e3),
        "strut": mpm.strut((3.1, 2.7), (5.9, 2.9), 50e6, prestress=-5e3),
        "tie": mpm.strut((3.1, 2.5), (-4.0, 2.5), 50e6, fixed_end=True),
    }
    site.carry_out(bridge.Stage("ground", fill=soils, unit_weight=dict.fromkeys(soils, 18e3)))
    site.carry_out(bridge.Stage("members", install=members, reset_displacement=True))
    site.carry_out(bridge.Stage("load", pressure={4: 40e3}))
    return {name: fem.member_forces(name) for name in members}, fem.reaction(3)


def test_members_carry_the_same_on_all_numbers_of_ranks():
    together, reaction = retained(COMM)
    alone, expected = retained(MPI.COMM_SELF)
    assert np.abs(alone["wall"].moment).max() > 500.0
    assert np.abs(alone["strut"].axial_force).max() > 1e3
    assert np.allclose(reaction, expected, rtol=1e-6)
    for name, forces in together.items():
        for part in ("positions", "displacement", "axial_force", "moment"):
            values, exact = getattr(forces, part), getattr(alone[name], part)
            assert np.allclose(values, exact, rtol=0, atol=1e-6 * max(np.abs(exact).max(), 1e-9))
