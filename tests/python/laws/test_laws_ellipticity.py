"""Whether soil at failure has a strain field that does not depend on the mesh: the acoustic tensor of the tangent.

A band with the normal n may strain alone where det(n D n) is not above zero. In plane strain the least of these determinants over
that of the elastic stiffness is -h / c, with Vermeer and de Borst's (1984) hardening modulus h that soil would need, and c = f D g:

    h = G (sin phi - sin psi)^2 / (8 (1 - nu)),   c = G for psi = 0
"""

import numpy as np
import pytest
from law_cases import Batch

import mpm_core as mpm

YOUNG, PRESSURE, COHESION = 200e3, 20e3, 1e3


def least_ratio(friction, dilation, poisson):
    """Least det(n D n) over the directions n, of the tangent in shear at failure, over that of the elastic stiffness."""
    law = mpm.MohrCoulomb(
        young=YOUNG, poisson=poisson, cohesion=COHESION, friction_angle=friction, dilation_angle=dilation
    )
    radius = PRESSURE * np.sin(np.radians(friction)) + COHESION * np.cos(np.radians(friction))
    stress = np.array([[radius - PRESSURE, -radius - PRESSURE, -PRESSURE, 0.0]])
    shear = 1e-7 * np.array([[1.0, -1.0, 0.0, 0.0]])
    laws = law, mpm.LinearElastic(young=YOUNG, poisson=poisson)
    plastic, elastic = (Batch(each, stress, shear).tangent[0] for each in laws)
    angle = np.radians(np.linspace(0.0, 90.0, 9001))
    zero = np.zeros_like(angle)
    n = np.array([[np.cos(angle), zero, zero, np.sin(angle)], [zero, np.sin(angle), zero, np.cos(angle)]])  # n . stress
    determinants = [np.linalg.det(np.einsum("ika,kl,jla->aij", n, tangent, n)) for tangent in (plastic, elastic)]
    return (determinants[0] / determinants[1]).min()


@pytest.mark.parametrize("poisson", [0.2, 0.33, 0.45])
@pytest.mark.parametrize("friction", [5.0, 25.0, 40.0])
def test_shear_without_dilation_needs_hardening_to_have_one_solution(friction, poisson):
    needed = np.sin(np.radians(friction)) ** 2 / (8 * (1 - poisson))
    assert least_ratio(friction, 0.0, poisson) == pytest.approx(-needed, rel=1e-4)


@pytest.mark.parametrize("friction", [0.0, 25.0])
def test_associated_flow_is_at_the_limit(friction):
    assert least_ratio(friction, friction, 0.33) == pytest.approx(0.0, abs=1e-6)
