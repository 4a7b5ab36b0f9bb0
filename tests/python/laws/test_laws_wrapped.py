"""Laws made of others: undrained soil in effective stresses, and finite strains (Hencky)."""

import numpy as np
import pytest
from core_cases import box, rollers, run
from law_cases import Batch, assert_tangent, principal, random_points, triaxial, walk

import mpm_core as mpm

SOIL = mpm.MohrCoulomb(young=10e6, poisson=0.3, cohesion=10e3, friction_angle=25.0, dilation_angle=5.0)
CLAY = mpm.CamClay(
    compression=0.2, swelling=0.04, critical_slope=1.0, poisson=0.25, void_ratio=1.0, preconsolidation=100e3
)
SAND = mpm.NorSand(
    critical_void_ratio=0.9, critical_compression=0.03, critical_slope=1.25, dilatancy=4.0, hardening=100.0, rigidity=200.0,
    poisson=0.2, void_ratio=0.84, image_pressure=100e3,
)  # fmt: skip
WATER, POROSITY = 2e8, 0.4
WRAPPED = {
    "undrained elastic": mpm.Undrained(mpm.LinearElastic(young=10e6, poisson=0.3), water_modulus=WATER, porosity=0.4),
    "undrained Mohr-Coulomb": mpm.Undrained(SOIL, water_modulus=WATER, porosity=POROSITY),
    "undrained Cam-Clay": mpm.Undrained(CLAY, water_modulus=WATER, porosity=0.5),
    "undrained NorSand": mpm.Undrained(SAND, water_modulus=WATER, porosity=0.5),
    "Hencky NorSand": mpm.Hencky(SAND),
    "Hencky": mpm.Hencky(mpm.LinearElastic(young=10e6, poisson=0.3)),
    "Hencky Mohr-Coulomb": mpm.Hencky(SOIL),
    "undrained Hencky": mpm.Undrained(mpm.Hencky(SOIL), water_modulus=WATER, porosity=POROSITY),
}


@pytest.fixture(params=WRAPPED.values(), ids=WRAPPED.keys())
def law(request):
    return request.param


def named(batch, name):
    return batch.state[:, batch.law.state_names.index(name)]


@pytest.mark.parametrize("dim", [2, 3])
def test_tangent_is_the_derivative_of_the_stress(law, dim):
    stress, strain = random_points(dim, 300, pressure=60e3, deviator=10e3, strain=2e-4)
    state = np.zeros((300, law.n_state))
    state[:, -1] = np.random.default_rng(3).uniform(0, 0.1, 300)  # ln J, or a pore pressure next to nothing
    assert_tangent(Batch(law, stress, strain, state), 1e-7, tolerance=1e-4)


def test_the_drained_law_is_inside_the_undrained_one():
    stress, strain = random_points(3, 300, pressure=60e3, deviator=10e3, strain=2e-4)
    pressure = np.random.default_rng(3).uniform(0, 50e3, 300)
    whole = stress - pressure[:, None] * np.array([1, 1, 1, 0, 0, 0])
    undrained = Batch(WRAPPED["undrained Mohr-Coulomb"], whole, strain, np.column_stack([np.zeros((300, 2)), pressure]))
    drained = Batch(SOIL, stress, strain)
    u = pressure - WATER / POROSITY * strain[:, :3].sum(axis=1)
    assert named(undrained, "excess_pore_pressure") == pytest.approx(u, rel=1e-12)
    effective = undrained.stress + u[:, None] * np.array([1, 1, 1, 0, 0, 0])
    assert np.abs(effective - drained.stress).max() < 1e-6
    assert undrained.report.plastic == drained.report.plastic > 20


def test_effective_stress_stays_admissible():
    stress, _ = random_points(3, 1000, pressure=60e3, deviator=10e3, strain=0.0)
    stress, state = walk(WRAPPED["undrained Mohr-Coulomb"], stress, 1e-4, 100)
    s = principal(stress) + state[:, -1:]
    phi = np.radians(25.0)
    f = (s[:, 0] - s[:, 2]) / 2 + (s[:, 0] + s[:, 2]) / 2 * np.sin(phi) - 10e3 * np.cos(phi)
    assert np.max(f / np.abs(s).max(axis=1)) < 1e-8


def test_undrained_oedometer_is_carried_by_the_water():
    # du / d sigma = K_w/n / (K_w/n + E_oed): Skempton's B in one dimension
    law = WRAPPED["undrained elastic"]
    test = mpm.ElementTest(law, [0.0] * 6)
    test.step([-1e-4, 0, 0, 0, 0, 0])
    stiff = WATER / 0.4
    oedometer = 10e6 * 0.7 / (1.3 * 0.4)
    assert test.state[-1] == pytest.approx(stiff * 1e-4)
    assert test.stress[0] == pytest.approx(-(stiff + oedometer) * 1e-4)


def test_undrained_triaxial_follows_the_effective_path():
    # Elastic: dp' = 0 at constant volume, so u rises by a third of the deviator. At failure without dilation
    # (s1 - s3)/2 = c cos(phi) - (s1 + s3)/2 sin(phi) with s1 + 2 s3 = 3 p0 (stiff water)
    soil = mpm.MohrCoulomb(young=10e6, poisson=0.3, cohesion=10e3, friction_angle=25.0)
    test = mpm.ElementTest(mpm.Undrained(soil, water_modulus=2e9, porosity=0.4), [-100e3] * 3 + [0.0] * 3)
    test.step([-1e-3, None, None, 0, 0, 0])
    q = -(test.stress[0] - test.stress[1])
    assert test.stress[1] == pytest.approx(-100e3, rel=1e-8)
    assert test.state[-1] == pytest.approx(q / 3, rel=1e-2)
    triaxial(test, -0.02, 40)
    phi, p = np.radians(25.0), 100e3
    q = 6 * (p * np.sin(phi) + 10e3 * np.cos(phi)) / (3 - np.sin(phi))
    assert -(test.stress[0] - test.stress[1]) == pytest.approx(q, rel=1e-2)


@pytest.mark.parametrize("nmd", [False, True])
def test_pore_pressure_of_a_loaded_column(nmd):
    # At rest the total stress balances the weight: sigma_y = -g rho (H - y); u = B |sigma_y|
    law = mpm.Undrained(mpm.LinearElastic(young=10e6, poisson=0.3), water_modulus=2e7, porosity=0.4)
    model = mpm.Model(box([2, 20], [1.0, 10.0], diagonals="alternating"), law)
    model.seed(density=2000.0, per_cell=3)
    rollers(model, [0])
    model.fix(3)
    model.set_gravity([0.0, -10.0])
    report = run(model, 3.0, damping=0.7, nmd=nmd)
    assert report.unbalanced_ratio < 1e-3
    depth = 10.0 - model.particles.position[:, 1]
    stiff, oedometer = 5e7, 10e6 * 0.7 / (1.3 * 0.4)
    expected = stiff / (stiff + oedometer) * 2000.0 * 10.0 * depth
    # The pressure is constant in a cell 0.5 m high, or a mean over its neighbours
    assert np.abs(model.state("excess_pore_pressure") - expected).max() < 2000.0 * 10.0 * (1.0 if nmd else 0.5)
    assert np.abs((model.state("excess_pore_pressure") - expected).mean()) < 0.01 * 2000.0 * 10.0 * 10.0


def test_hencky_in_uniaxial_stretch():
    # tau = M ln(l), J = l
    law = WRAPPED["Hencky"]
    test = mpm.ElementTest(law, [0.0] * 6)
    length, steps = 1.0, 4000
    for _ in range(steps):
        increment = 0.5 / steps
        test.step([increment / length, 0, 0, 0, 0, 0])
        length += increment
    modulus = 10e6 * 0.7 / (1.3 * 0.4)
    assert test.stress[0] == pytest.approx(modulus * np.log(1.5) / 1.5, rel=1e-4)
    assert test.state[-1] == pytest.approx(np.log(1.5), rel=1e-12)


@pytest.mark.parametrize("hencky, top", [(True, -0.962009), (False, -0.986801)])
def test_column_at_finite_strain(hencky, top):
    # nu = 0, 50 m high, rho g = 800 N/m3, E = 1 MPa: at the height Y the stress is -rho g (H - Y), and the top moves by the
    # integral of l - 1. Kirchhoff stress linear in the logarithmic strain, against the rate law in Cauchy stress
    law = mpm.LinearElastic(young=1e6, poisson=0.0)
    law = mpm.Hencky(law) if hencky else law
    points, weights = np.polynomial.legendre.leggauss(5)
    displacement = 0.0
    for x, weight in zip(points, weights, strict=True):
        stress, steps = -800.0 * 25.0 * (1 - x), 200
        test, length = mpm.ElementTest(law, [0.0] * 6), 1.0
        for step in range(1, steps + 1):
            before = test.strain[1]
            test.step([0, None, 0, 0, 0, 0], [0, stress * step / steps, 0, 0, 0, 0])
            length *= 1 + test.strain[1] - before
        displacement += 25.0 * weight * (length - 1)
    assert displacement == pytest.approx(top, rel=5e-4)


def test_bad_parameters_are_named_with_value_and_range():
    with pytest.raises(mpm.InputError, match="^water_modulus = 0, but it must be positive"):
        mpm.Undrained(SOIL, water_modulus=0.0, porosity=0.4)
    with pytest.raises(mpm.InputError, match="^porosity = 1, but it must be in"):
        mpm.Undrained(SOIL, porosity=1.0)
