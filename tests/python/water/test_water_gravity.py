"""Pore water under another gravity than the one by which its unit weight is its density, and in soil that is too light."""

import numpy as np
import pytest
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

LEFT, RIGHT, BASE, TOP = 1, 2, 3, 4
LAW = mpm.LinearElastic(young=50e6, poisson=0.3)


def column(gravity, unit_weight=9810.0, density=2000.0, **water):
    """Saturated soil, 1 m high."""
    domain, _, tags = bridge.box_mesh(MPI.COMM_WORLD, (0.2, 1.0), (2, 10))
    model = mpm.Model(bridge.background_mesh(domain, None, tags), LAW)
    model.seed(density=density, per_cell=3)
    model.roller(LEFT, (1, 0))
    model.roller(RIGHT, (1, 0))
    model.fix(BASE)
    model.set_gravity((0.0, -gravity))
    model.add_water(porosity=0.4, conductivity=1e-3, unit_weight=unit_weight, modulus=2e8, **water)
    return model


def settle(model, scheme):
    if scheme == "implicit":
        return model.implicit(1e5, dt=1e4, quasi_static=True, small_displacements=True).last()
    return model.explicit(1e-3).last()


@pytest.mark.parametrize("scheme", ["implicit", "explicit"])
@pytest.mark.parametrize(
    "gravity, weight, heavy", [(10.0, 10e3, 10193.7), (10.0, 9810.0, 10000.0), (490.5, 9810.0, 490500.0)]
)
def test_levels_under_another_gravity_are_refused(gravity, weight, heavy, scheme):
    # The density of the water is its unit weight / 9.81, so that under g its weight is unit_weight g / 9.81.
    assert heavy == pytest.approx(weight * gravity / 9.81, rel=1e-5)
    words = (
        rf"gravity is {gravity:g} m/s2, expected 9.81 .*unit_weight, {weight:g} N/m3.*water that weighs {heavy:g} N/m3"
    )
    model = column(gravity, weight)
    model.hold_pore_pressure(TOP, level=20.0)
    with pytest.raises(mpm.InputError, match=words):
        settle(model, scheme)
    model = column(gravity, weight, drained_surface=True)
    model.stand_water(20.0)
    with pytest.raises(mpm.InputError, match=words):
        settle(model, scheme)


@pytest.mark.parametrize("gravity, weight", [(10.0, 9810.0), (490.5, 9810.0)])
def test_pressures_in_the_place_of_levels_give_buoyant_stresses(gravity, weight):
    # Water at rest below 2 m: p = rho_w g (2 - y), sigma' = -(rho - rho_w) g (1 - y), rho_w = 1000 kg/m3.
    model = column(gravity, weight)
    model.hold_pore_pressure(TOP, 1000.0 * gravity, presses=True)
    model.set_pore_pressure(lambda x: 1000.0 * gravity * (2.0 - x[:, 1]))
    settle(model, "implicit")
    p = model.particles
    depth = 1.0 - p.position[:, 1]
    assert p.pore_pressure == pytest.approx(1000.0 * gravity * (1.0 + depth), rel=1e-6)
    low = depth > 0.9
    assert p.stress[low, 1].mean() == pytest.approx(-1000.0 * gravity * depth[low].mean(), rel=1e-6)


@pytest.mark.parametrize("gravity", [9.78, 9.8, 9.82, 9.832])
def test_gravity_as_on_earth_is_taken(gravity):
    model = column(gravity)
    model.hold_pore_pressure(TOP, level=1.0)
    settle(model, "implicit")


@pytest.mark.parametrize("scheme", ["implicit", "explicit"])
@pytest.mark.parametrize("density", [300.0, 399.9])
def test_soil_lighter_than_its_water_is_refused(scheme, density):
    # A saturated soil with 0.4 m3 of water in a m3 has 400 kg of it, and grains besides.
    model = column(9.81, density=density)
    with pytest.raises(
        mpm.InputError, match=rf"density of a particle is {density:g} kg/m3, expected more than .* 400 kg/m3"
    ):
        settle(model, scheme)


def test_soil_that_has_dried_may_be_as_light_as_its_water_leaves_it():
    from fenics_bridge import water

    model = column(9.81, density=450.0, retention=water.VanGenuchten(alpha=1e-3, n=2.0))
    model.hold_pore_pressure(BASE, -20e3)
    model.set_pore_pressure(-20e3)  # S = (1 + 20^2)^(-1/2) = 0.05, so that 70 kg/m3 remain
    assert np.all(model.particles.mass / model.particles.volume < 100.0)
    settle(model, "implicit")
