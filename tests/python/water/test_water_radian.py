"""In axial symmetry water is counted per radian."""

import numpy as np
import pytest
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water


def test_the_flow_to_a_well_is_per_radian():
    # Thiem: 2 pi k D (h2 - h1) / ln(R / r) flow to the whole well.
    domain, _, tags = bridge.box_mesh(MPI.COMM_WORLD, (2.5, 0.25), (40, 2))
    domain.geometry.x[:, 0] += 0.5
    supports = [bridge.roller(3, (0, 1)), bridge.roller(4, (0, 1))]
    heads = [water.Head(1, 1.0), water.Head(2, 3.0)]
    soil = water.PorousSoil(1e-5, porosity=0.4)
    well = water.Consolidation(domain, mpm.LinearElastic(young=20e6, poisson=0.25), soil, tags, supports, heads,
                               geometry=mpm.Geometry.AXISYMMETRIC)  # fmt: skip
    assert well.stored_water() == pytest.approx(
        0.4 * 0.25 * (3.0**2 - 0.5**2) / 2, rel=1e-6
    )  # pi (R2 - r2) D n / 2 pi
    assert well.advance(1e9).converged and well.advance(1e9).converged
    whole = 2 * np.pi * 1e-5 * 0.25 * (3.0 - 1.0) / np.log(3.0 / 0.5)
    assert 2 * np.pi * well.inflow(2) == pytest.approx(whole, rel=1e-3)
    assert "radian" in water.Consolidation.inflow.__doc__ and "radian" in water.Consolidation.stored_water.__doc__
