"""Theory of the studies cone and piezocone: limit pressures, cone factors, strength and drainage of clay."""

import importlib

import numpy as np
import pytest
from common.cone_theory import drained_part, lu, spherical_limit_pressure, teh_houlsby, undrained_strength

import mpm_core as mpm


@pytest.mark.parametrize("rigidity", [50, 100, 500])
def test_without_friction_the_limit_pressure_is_that_of_clay(rigidity):
    # Incompressible Tresca soil: 4/3 s_u (1 + ln(G / s_u)) (Bishop, Hill and Mott 1945); small elastic strains of the
    # paper leave a difference of the order of s_u / G, and the hundredth of a degree one of the order of N phi.
    nearly = {"poisson": 0.49999, "friction_angle": 0.01, "dilation_angle": 0.0}
    young = 2 * 1.49999 * rigidity
    exact = 4 / 3 * (1 + np.log(rigidity))
    assert spherical_limit_pressure(young=young, cohesion=1.0, **nearly) == pytest.approx(
        exact, rel=0.2 / rigidity + exact * np.radians(0.01)
    )


@pytest.mark.parametrize("dilation", [0.0, 10.0])
def test_the_limit_pressure_solves_the_steady_cavity(dilation):
    # The limit is that of a cavity that grows from nothing, where everything depends on r / a: with the velocity w in units
    # of the border, the rates of plastic strains in the ratio of the dilation are integrated from the elastic border inwards.
    young, poisson, cohesion, phi = 260.0, 0.3, 1.0, np.radians(30.0)
    psi = np.radians(dilation)
    alpha, beta = (1 + np.sin(phi)) / (1 - np.sin(phi)), (1 + np.sin(psi)) / (1 - np.sin(psi))
    limit = spherical_limit_pressure(
        young=young, poisson=poisson, cohesion=cohesion, friction_angle=30.0, dilation_angle=dilation
    )
    shift = cohesion / np.tan(phi)  # stresses counted from the apex, compression positive
    shear = young / (2 * (1 + poisson))
    # At the border r = 1: sigma_r - 0 = 2 (0 - sigma_theta), and failure: sigma_r + shift = alpha (sigma_theta + shift)
    radial = 2 * (alpha - 1) * shift / (2 + alpha)
    border, exponent = radial + shift, 2 * (alpha - 1) / alpha
    # Equilibrium: sigma_r + shift = border r^-exponent. Elastic strains follow the stresses of a soil particle:
    # with the border at r = 1 moving at speed 1 and soil at w, d/dt = (w - r) d/dr. At the border w = 3 radial / (4 G).
    w, r = 3 * radial / (4 * shear), 1.0
    steps, low = 20_000, None
    end = 1e-3
    ratio = (end / r) ** (1 / steps)
    for _ in range(steps):
        rate = -exponent * border * r ** (-exponent - 1)
        e_r = (1 - 2 * poisson / alpha) / young * rate  # d(strain)/dr of the elastic parts, compression positive
        e_t = ((1 - poisson) / alpha - poisson) / young * rate
        # Plastic flow: (dw/dr + (w - r) e_r) + 2 / beta (w/r + (w - r) e_t) = 0
        slope = -(w - r) * e_r - 2 / beta * (w / r + (w - r) * e_t)
        h = r * (1 - ratio)
        w, r = w - h * slope, r - h
        if w >= r:  # soil moves with the border of the cavity, which grows with it
            low = r
            break
    assert low is not None
    assert border * low**-exponent - shift == pytest.approx(limit, rel=2e-2)


def test_cone_factors_are_those_of_the_papers():
    # Table of Teh & Houlsby for a smooth cone, and the formula of Lu et al. with K0 = 1
    assert [teh_houlsby(i, 0.0) for i in (50, 100, 200, 500)] == pytest.approx([8.35, 9.72, 11.34, 14.43], abs=6e-3)
    assert [lu(i, 0.0) for i in (50, 100, 200, 500)] == pytest.approx([9.66, 10.77, 11.88, 13.34], abs=6e-3)
    assert teh_houlsby(100, 1.0) - teh_houlsby(100, 0.0) == pytest.approx(2.4)


@pytest.mark.parametrize("overconsolidation", [1.0, 3.0])
def test_the_undrained_strength_of_clay_is_that_of_a_triaxial_test(overconsolidation):
    clay = mpm.CamClay(
        compression=0.2, swelling=0.04, critical_slope=0.92, poisson=0.25, void_ratio=1.5, attraction=2e3,
        preconsolidation=overconsolidation * 100e3 * (1 + 1e-9),
    )  # fmt: skip
    test = mpm.ElementTest(clay, stress=[-100e3, -100e3, -100e3, 0, 0, 0])
    for _ in range(4000):
        test.step([1e-4 / 2, -1e-4, 1e-4 / 2, 0, 0, 0])
    strength = 0.5 * (test.stress[0] - test.stress[1])
    assert strength == pytest.approx(undrained_strength(clay, 100e3), rel=5e-3)  # increments are of first order


def test_a_slow_cone_has_drained_clay_around_it():
    assert [drained_part(v) for v in (0.0, 3.0, 30.0)] == pytest.approx([1.0, 0.5, 1 / 11])


@pytest.mark.parametrize(
    ("options", "doubted"), [("50", False), ("500", False), ("20", True), ("20 --friction-angle 30", False)]
)
def test_a_rigidity_without_cone_factors_is_named(options, doubted, recwarn):
    importlib.import_module("cone").parse(["--rigidity", *options.split()])
    said = [str(w.message) for w in recwarn if w.category is RuntimeWarning]
    assert any("the rigidity index is 20, beyond the 50 to 500" in text for text in said) == doubted
