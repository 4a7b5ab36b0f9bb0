"""Input of the water that cannot be right is named before anything is computed."""

import numpy as np
import pytest
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water

LEFT, RIGHT, BASE, TOP = 1, 2, 3, 4


def box():
    domain, _, tags = bridge.box_mesh(MPI.COMM_WORLD, (1.0, 1.0), (2, 2))
    return domain, tags


@pytest.mark.parametrize(
    "changes, words",
    [
        ({"porosity": None}, "porosity is None, expected more than 0 and less than 1"),
        ({"porosity": "0.4"}, "porosity is '0.4', expected"),
        ({"porosity": np.nan}, "porosity is nan, expected"),
        ({"compressibility": "1e-8"}, "compressibility is '1e-8' 1/Pa, expected 0 or more"),
        ({"density": "2000"}, "density is '2000' kg/m3, expected a positive number"),
        ({"conductivity": "fast"}, "conductivity is 'fast' m/s, expected positive numbers"),
    ],
)
def test_values_of_a_soil_that_are_no_numbers(changes, words):
    with pytest.raises(mpm.InputError, match=words):
        water.PorousSoil(**{"conductivity": 1e-6, **changes})


def test_a_table_of_a_soil_that_never_dries():
    with pytest.raises(mpm.InputError, match="saturation_values stay 1, expected values that fall.*AlwaysSaturated"):
        water.Tabulated((0.0, 1e4), (1.0, 1.0), (1.0, 0.1))
    water.Tabulated((0.0, 1e4), (1.0, 0.9), (1.0, 1.0))


WRONG = [
    (water.Head(BASE, lambda time: np.nan if time > 5 else 1.0), "level is a function that returns nan at t = 10 s"),
    (
        water.Reservoir(BASE, lambda time: None if time > 5 else 1.0),
        "level is a function that returns None at t = 10 s",
    ),
    (
        water.Head(BASE, lambda time: np.ones(2) if time > 5 else 1.0),
        r"level is a function that returns array\(\[1., 1.\]\)",
    ),
    (water.Flux(TOP, lambda time: np.inf if time > 5 else 0.0), "rate is a function that returns inf at t = 10 s"),
    (
        water.Rain(TOP, lambda time: -1e-3 if time > 5 else 0.0),
        "rate is a function that returns -0.001 m/s at t = 10 s, .*0 or more",
    ),
]


@pytest.mark.parametrize("wrong, words", WRONG)
def test_functions_of_time_that_return_no_number(wrong, words):
    domain, tags = box()
    flow = water.Seepage(domain, water.PorousSoil(1e-6), tags, [water.Head(LEFT, 1.0), wrong])
    flow.solve()
    before = flow.pressure_head.x.array.copy()
    with pytest.raises(mpm.InputError, match=words):
        flow.advance(10.0)
    assert flow.time == 0.0 and np.array_equal(flow.pressure_head.x.array, before)
    flow.time = 10.0
    with pytest.raises(mpm.InputError, match=words):
        flow.solve()

    law, supports = mpm.LinearElastic(young=1e6, poisson=0.3), [bridge.fixed(BASE)]
    model = water.Consolidation(domain, law, water.PorousSoil(1e-6), tags, supports, [water.Head(LEFT, 1.0), wrong])
    with pytest.raises(mpm.InputError, match=words):
        model.advance(10.0)
    assert model.time == 0.0


@pytest.mark.parametrize("rate", [5.0, ((0.0, 0.0), (3600.0, 5.0))])
def test_a_rate_of_rain_in_millimetres_per_hour_is_warned_of(rate):
    """5 mm/h are 1.39e-6 m/s; at 5 m/s it would pond and run off, without a word."""
    words = "rate of the rain is 5 m/s.* 5 mm/h are 1.39e-06 m/s"
    domain, tags = box()
    flow = [water.Head(BASE, 0.0), water.Rain(TOP, rate)]
    with pytest.warns(RuntimeWarning, match=words):
        water.Seepage(domain, water.PorousSoil(1e-6, porosity=0.4), tags, flow)
    model = mpm.Model(bridge.background_mesh(domain, facet_tags=tags), mpm.LinearElastic(young=1e6, poisson=0.3))
    model.seed(density=2000.0, per_cell=3)
    curve = water.VanGenuchten(alpha=1e-4, n=2.0)
    model.add_water(porosity=0.4, conductivity=1e-6, retention=curve, drained_surface=True)
    with pytest.warns(RuntimeWarning, match=words):
        model.rain(rate)


def test_functions_of_positions_that_return_values_of_another_shape():
    """Two columns, as of a function that takes y where it should take one value for each point."""
    domain, tags = box()
    soil, two = water.PorousSoil(1e-6, porosity=0.4), lambda x, *_: 0.0 * x
    flow = water.Seepage(domain, soil, tags, [water.Head(LEFT, 1.0)])
    flow.solve()
    with pytest.raises(mpm.InputError, match=r"loading gives values of shape \(\d+, 2\), expected \(\d+,\)"):
        water.Seepage(domain, soil, tags, [water.Head(LEFT, 1.0)], loading=two)
    with pytest.raises(mpm.InputError, match=r"outside gives values of shape \(1, 2\), expected \(1,\)"):
        flow.pore_pressure(outside=two)(np.array([[99.0, 0.0]]))
    law, supports = mpm.LinearElastic(young=1e6, poisson=0.3), [bridge.fixed(BASE)]
    model = water.Consolidation(domain, law, soil, tags, supports, [water.Head(LEFT, 1.0)])
    with pytest.raises(mpm.InputError, match=r"pore_pressure gives values of shape \(\d+, 2\), expected \(\d+,\)"):
        model.initialise(pore_pressure=two)
    with pytest.raises(mpm.InputError, match=r"surface gives heights of shape \(3, 2\), expected \(3,\)"):
        bridge.k0_stress(np.zeros((3, 2)), lambda x: np.zeros((3, 2)), 1e4, 0.5)
    particles = mpm.Model(bridge.background_mesh(domain, facet_tags=tags), law)
    particles.seed(density=2000.0, per_cell=3)
    count = len(particles.particles)
    with pytest.raises(mpm.InputError, match=rf"porosity has shape \(2,\), expected a number or shape \({count},\)"):
        particles.add_water(porosity=[0.4, 0.5], conductivity=1e-6)
    particles.add_water(porosity=0.4, conductivity=1e-6)
    with pytest.raises(mpm.InputError, match=r"pressure has shape \(\d+, 2\), expected a number or shape"):
        particles.set_pore_pressure(two)
    with pytest.raises(mpm.InputError, match="pore_pressure is 3.0, expected a function of positions"):
        bridge.seepage_forces(particles, 3.0)
    with pytest.raises(mpm.InputError, match="model is .*Mesh.*, expected"):
        bridge.seepage_forces(domain, two)
