"""Particles with pore water under any gravity: water weighs its density times gravity, and k / gamma_w is of the soil."""

import json
import warnings

import h5py
import numpy as np
import pytest
from consolidation_cases import layer_excess
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water

LEFT, RIGHT, BASE, TOP = 1, 2, 3, 4
LAW = mpm.LinearElastic(young=50e6, poisson=0.3)
GRAVITIES = pytest.mark.parametrize("gravity", [9.80665, 10.0, 490.5])


def column(gravity, density=2000.0, height=1.0, water_density=None, cells=10, air=0, **of_water):
    """Saturated soil between rollers, on a fixed base, below rows of empty cells."""
    size = height / cells
    body = ((0.0, 0.0), (2 * size, height))
    mesh = bridge.box_mesh(MPI.COMM_WORLD, (2 * size, height + air * size), (2, cells + air), body=body)
    model = mpm.Model(bridge.background_mesh(*mesh), LAW)
    model.seed(density=density, per_cell=3, cell_tag=bridge.BODY)
    model.roller(LEFT, (1, 0))
    model.roller(RIGHT, (1, 0))
    model.fix(BASE)
    model.set_gravity((0.0, -gravity))
    if water_density is not None:
        of_water["density"] = water_density
    model.add_water(**{"porosity": 0.4, "conductivity": 1e-3, "modulus": 2e8, **of_water})
    return model


def settle(model, scheme="implicit"):
    if scheme == "implicit":
        return model.implicit(1e5, dt=1e4, quasi_static=True, small_displacements=True).last()
    return model.explicit(1e-3).last()


def set_vertical_stress(model, vertical):
    """Stresses of uniaxial strain [Pa], from the vertical ones of the particles (n,)."""
    stress = np.zeros_like(model.particles.stress)
    stress[:, :3] = (LAW.poisson / (1 - LAW.poisson) * vertical)[:, None]
    stress[:, 1] = vertical
    model.particles.set("stress", stress)


# --- water at rest ----------------------------------------------------------------------------------------------------


@GRAVITIES
@pytest.mark.parametrize("density", [1000.0, 1025.0])
@pytest.mark.parametrize("stands", ["against facets", "over the surface"])
def test_soil_below_a_level_carries_its_buoyant_weight(gravity, density, stands):
    """p = rho_w g (2 - y) and sigma' = -(rho - rho_w) g (1 - y): the base has the load gamma_w h of the water above besides."""
    facets = stands == "against facets"
    model = column(gravity, water_density=density, modulus=np.inf, drained_surface=not facets, air=0 if facets else 2)
    if facets:
        model.hold_pore_pressure(TOP, level=2.0)
    else:
        model.stand_water(2.0)
    settle(model)
    p = model.particles
    depth = 1.0 - p.position[:, 1]
    assert p.pore_pressure == pytest.approx(density * gravity * (1.0 + depth), rel=1e-8)
    rows = np.floor(10 * depth)  # of cells
    for row in np.unique(rows):
        mine = rows == row
        assert p.stress[mine, 1].mean() == pytest.approx((density - 2000.0) * gravity * depth[mine].mean(), rel=1e-6)


@GRAVITIES
def test_soil_and_water_at_rest_remain_at_rest_in_explicit_steps(gravity):
    """Water of modulus K has p = K (exp((p0 + rho_w g z) / K) - 1) at rest, that is p0 + rho_w g z but for (p / K)^2 / 2."""
    modulus = 2.2e9
    model = column(gravity, modulus=modulus)
    model.hold_pore_pressure(TOP, level=2.0)
    model.set_pore_pressure(lambda x: 1000.0 * gravity * (2.0 - x[:, 1]))
    set_vertical_stress(model, -1000.0 * gravity * (1.0 - model.particles.position[:, 1]))
    report = model.explicit(2e-3).last()
    p, largest = model.particles, 2000.0 * gravity / modulus
    assert report.steps > 20
    # water is heavier by p / K, so that it would fall with that part of gravity at most
    assert np.abs(p.velocity).max() < largest * gravity * 2e-3
    mean = 1000.0 * gravity * (2.0 - model.mesh.points[model.mesh.cells[p.cell], 1].mean(axis=1))
    assert p.pore_pressure == pytest.approx(mean, rel=1e-3)


@GRAVITIES
@pytest.mark.parametrize("scheme", ["implicit", "explicit"])
def test_soil_as_heavy_as_water_has_no_effective_stress_under_it(gravity, scheme):
    """Whatever the shape of its surface, which cuts cells."""
    domain, _, tags = bridge.box_mesh(MPI.COMM_WORLD, (2.0, 1.0), (16, 8))
    model = mpm.Model(bridge.background_mesh(domain, None, tags), LAW)
    x, y = (np.arange(64) + 0.5) / 32, (np.arange(32) + 0.5) / 32
    points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2) + [1e-3, 2e-3]
    points = points[points[:, 1] < 0.9 - 0.5 * np.minimum(points[:, 0], 1.2)]
    model.seed_points(points, np.full(len(points), 1 / 32**2), density=1000.0)
    model.roller(LEFT, (1, 0))
    model.roller(RIGHT, (1, 0))
    model.fix(BASE)
    model.set_gravity((0.0, -gravity))
    model.add_water(porosity=0.4, conductivity=1e-3, modulus=2.2e9, drained_surface=True)
    model.set_pore_pressure(lambda x: 1000.0 * gravity * (1.5 - x[:, 1]))
    model.stand_water(1.5)
    if scheme == "implicit":
        model.implicit(1e3, dt=1e2, quasi_static=True, small_displacements=True).last()
        assert np.abs(model.particles.stress).max() < 1e-4 * 1500.0 * gravity
    else:
        model.explicit(5e-3, nmd=True).last()
        assert np.abs(model.particles.stress).max() < 0.02 * 1000.0 * gravity


def test_water_takes_part_in_a_ramp_of_gravity_and_in_its_changes():
    """A level holds, whenever gravity is set: before or after it, or as it rises in a centrifuge."""
    model = column(0.0)
    model.hold_pore_pressure(TOP, level=2.0)
    model.set_gravity((0.0, -490.5), ramp=1e5)
    for part in (0.5, 1.0, 1.2):
        model.implicit(part * 1e5, dt=1e4, quasi_static=True, small_displacements=True).last()
        p, weight = model.particles, 490.5e3 * min(part, 1.0)
        assert p.pore_pressure == pytest.approx(weight * (2.0 - p.position[:, 1]), rel=1e-4)
    model.set_gravity((0.0, -9.81))
    model.implicit(model.time + 1e5, dt=1e4, quasi_static=True, small_displacements=True).last()
    assert p.pore_pressure == pytest.approx(9810.0 * (2.0 - p.position[:, 1]), rel=1e-4)


@GRAVITIES
def test_the_balance_of_forces_takes_the_gravity_that_is_asked_for(gravity):
    model = column(9.81)
    model.hold_pore_pressure(TOP, level=2.0)
    model.set_pore_pressure(lambda x: 1000.0 * gravity * (2.0 - x[:, 1]))
    set_vertical_stress(model, -1000.0 * gravity * (1.0 - model.particles.position[:, 1]))
    assert model.out_of_balance((0.0, -gravity)) < 1e-10
    assert model.out_of_balance((0.0, -1.1 * gravity)) > 1e-2


# --- consolidation and the scaling of models --------------------------------------------------------------------------


@pytest.mark.parametrize("gravity", [0.0, 9.81, 10.0, 490.5])
def test_a_layer_consolidates_in_a_time_that_does_not_depend_on_gravity(gravity):
    """c_v = k M / gamma_w with both k and gamma_w under 9.81 m/s2: k / gamma_w is a property of the soil and of its water."""
    load, conductivity = 10e3, 1e-8
    model = column(gravity, conductivity=conductivity, modulus=np.inf, cells=20)
    height = model.particles.position[:, 1]
    at_rest = 1000.0 * gravity * (1.0 - height)
    model.hold_pore_pressure(TOP, 0.0)
    model.set_pore_pressure(lambda x: 1000.0 * gravity * (1.0 - x[:, 1]))
    set_vertical_stress(model, -at_rest)
    model.press_surface(TOP, load)
    period = 9810.0 / (conductivity * LAW.p_wave_modulus)
    for end, dt in ((0.02, 1e-3), (0.2, 5e-3)):
        list(model.implicit(end * period, dt=dt * period, quasi_static=True, small_displacements=True))
    excess = model.particles.pore_pressure - at_rest
    assert excess / load == pytest.approx(layer_excess(height, 0.2), abs=5e-3)


@pytest.mark.parametrize("size", [1.0, 0.1])
@pytest.mark.parametrize("gravity", [9.81, 490.5])
def test_explicit_soil_and_water_consolidate_so_too(gravity, size):
    """As above, with the compressibility of the water: c_v = k / gamma_w / (1 / M + n / K_w)."""
    load, modulus, conductivity = 10e3, 2.2e9, 2e-4 * size
    model = column(gravity, conductivity=conductivity, modulus=modulus, height=size, cells=20)
    compliance = 1 / LAW.p_wave_modulus + 0.4 / modulus
    first = load / (LAW.p_wave_modulus * compliance)  # shared by stiffness, before any water flows
    model.hold_pore_pressure(TOP, 0.0)
    model.set_pore_pressure(lambda x: 1000.0 * gravity * (size - x[:, 1]) + first)
    set_vertical_stress(model, -1000.0 * gravity * (size - model.particles.position[:, 1]) - (load - first))
    model.press_surface(TOP, load)
    model.explicit(0.2 * size**2 * 9810.0 * compliance / conductivity).last()
    p = model.particles  # each cell has the pressure of its centre
    centre = model.mesh.points[model.mesh.cells[p.cell], 1].mean(axis=1)
    excess = p.pore_pressure - 1000.0 * gravity * (size - centre)
    assert excess / first == pytest.approx(layer_excess(centre / size, 0.2), abs=5e-3)


def submerged_slope(scale, scheme):
    """A slope 4 m / scale high under a level that falls, under a gravity of scale times 9.81 m/s2.

    In quasi-static steps water flows alike in a time that is shorter by scale^2, with the same k. With inertia times are shorter by
    scale, which needs water that is scale times as viscous, that is k / scale.
    """
    size, gravity = 1.0 / scale, 9.81 * scale
    background = bridge.slope_mesh(
        MPI.COMM_SELF, height=4.0 * size, angle=30.0, crest=4.0 * size, cell_size=size, kind="fitted"
    )
    soil = mpm.MohrCoulomb(young=10e6, poisson=0.3, cohesion=5e3, friction_angle=28.0, dilation_angle=0.0)
    model = mpm.Model(bridge.background_mesh(*background), soil)
    model.seed(density=2000.0, per_cell=3, cell_tag=bridge.SOIL)
    model.roller(bridge.LEFT, (1, 0))
    model.fix(bridge.BASE)
    model.set_gravity((0.0, -gravity))
    quasi_static = scheme == "implicit"
    conductivity, unit = (1e-6, 1 / scale**2) if quasi_static else (1e-3 / scale, 1 / scale)
    model.add_water(porosity=0.4, conductivity=conductivity, modulus=2e7, drained_surface=True)
    model.set_pore_pressure(lambda x: 1000.0 * gravity * (4.5 * size - x[:, 1]))
    duration = 1e5 if quasi_static else 0.05
    model.stand_water([(0.0, 4.5 * size), (duration * unit, 2.5 * size)])
    if quasi_static:
        list(model.implicit(duration * unit, dt=0.1 * duration * unit, quasi_static=True))
    else:
        list(model.explicit(duration * unit, nmd=True))
    return model


@pytest.mark.parametrize("scheme", ["implicit", "explicit"])
def test_a_small_model_in_a_centrifuge_has_the_stresses_of_its_prototype(scheme):
    """1/50 of the size under 50 g: the same stresses and pore pressures, displacements of 1/50."""
    prototype, small = submerged_slope(1.0, scheme).particles, submerged_slope(50.0, scheme).particles
    rounded = {"rtol": 0, "atol": 1e-9}
    assert np.abs(prototype.stress).max() > 10e3 and np.ptp(prototype.pore_pressure) > 10e3
    for name in ("stress", "pore_pressure"):
        expected = getattr(prototype, name)
        np.testing.assert_allclose(
            getattr(small, name) / np.abs(expected).max(), expected / np.abs(expected).max(), **rounded
        )
    moved = np.abs(prototype.displacement).max()
    np.testing.assert_allclose(50.0 * small.displacement / moved, prototype.displacement / moved, **rounded)


# --- the argument, checkpoints, soil that is too light ----------------------------------------------------------------


def test_the_unit_weight_of_water_still_gives_its_density():
    with pytest.warns(DeprecationWarning, match="unit_weight of add_water is now density, in kg/m3") as caught:
        model = column(9.81, unit_weight=9810.0)
    assert model._core.water.density == 1000.0
    assert caught[0].filename == __file__
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert column(9.81)._core.water.density == 1000.0


def test_a_restart_knows_the_density_and_the_levels(tmp_path):
    model = column(490.5, water_density=1025.0, drained_surface=True)
    model.hold_pore_pressure(TOP, level=[(0.0, 2.0), (1e5, 3.0)])
    model.press_surface(LEFT, 5e3)
    model.implicit(5e4, dt=1e4, quasi_static=True).last()
    model.save(tmp_path / "wet.h5")
    again = column(490.5)
    again.restore(tmp_path / "wet.h5")
    assert again._core.water.density == 1025.0 and again._water_conditions == model._water_conditions
    for one in (model, again):
        one.implicit(1e5, dt=1e4, quasi_static=True).last()
    np.testing.assert_array_equal(again.particles.pore_pressure, model.particles.pore_pressure)


def test_a_checkpoint_with_a_unit_weight_is_read(tmp_path):
    """Before, it had gamma_w under 9.81 m/s2, and levels as pressures at height zero that fall by gamma_w per metre."""
    path = tmp_path / "wet.h5"
    model = column(9.81, water_density=1025.0)
    model.hold_pore_pressure(TOP, level=[(0.0, 2.0), (1e5, 3.0)])
    model.hold_pore_pressure(LEFT, 7e3)
    model.implicit(5e4, dt=1e4, quasi_static=True).last()
    model.save(path)
    with h5py.File(path, "r+") as file:
        there = json.loads(file["description"][0])
        weight = 9.81 * there["water"].pop("density")
        there["water"]["unit_weight"] = weight
        assert [one[2] for one in there["water"]["conditions"]] == [True, False]
        there["water"]["conditions"] = [
            [TOP, [[0.0, 2.0 * weight], [1e5, 3.0 * weight]], -weight, True, True],
            [LEFT, [[0.0, 7e3]], 0.0, True, False],
        ]
        del file["description"]
        file["description"] = np.array([json.dumps(there).encode()])
    again = column(9.81)
    again.restore(path)
    assert again._core.water.density == pytest.approx(1025.0, rel=1e-12)
    for one in (model, again):
        one.implicit(1e5, dt=1e4, quasi_static=True).last()
    np.testing.assert_allclose(again.particles.pore_pressure, model.particles.pore_pressure, rtol=1e-9)


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
    model = column(9.81, density=450.0, retention=water.VanGenuchten(alpha=1e-3, n=2.0))
    model.hold_pore_pressure(BASE, -20e3)
    model.set_pore_pressure(-20e3)  # S = (1 + 20^2)^(-1/2) = 0.05, so that 70 kg/m3 remain
    assert np.all(model.particles.mass / model.particles.volume < 100.0)
    settle(model)


@pytest.mark.parametrize("conductivity", [1e-3, 1e-2, 1.0])
def test_long_steps_converge_at_once_where_water_flows_far(conductivity):
    """What is left of the balance of the water is round-off of what the pressures of nodes drive to and fro in a step."""
    model = column(9.81, conductivity=conductivity)
    model.hold_pore_pressure(TOP, level=1.0)
    reports = list(model.implicit(5e4, dt=1e4, quasi_static=True, small_displacements=True))
    assert len(reports) == 5 and max(report.iterations for report in reports) <= 3
    depth = 1.0 - model.particles.position[:, 1]
    assert model.particles.pore_pressure == pytest.approx(9810.0 * depth, rel=1e-8)
