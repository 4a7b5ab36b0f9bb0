"""Every law in the four laboratory tests by closed form, on random walks, and from an initial stress."""

import subprocess
from pathlib import Path

import numpy as np
import pytest
from law_cases import Batch, assert_tangent, mean_and_radius, principal, random_points, walk
from test_laws_external import POISSON, STRENGTH, YOUNG, VonMises

import mpm_core as mpm

ELASTIC = {"young": YOUNG, "poisson": POISSON}
SHEAR, BULK = YOUNG / (2 * (1 + POISSON)), YOUNG / (3 * (1 - 2 * POISSON))
PRESSURE = 50e3
PYRAMIDS = {
    "elastic": mpm.LinearElastic(**ELASTIC),
    "Mohr-Coulomb": mpm.MohrCoulomb(**ELASTIC, cohesion=5e3, friction_angle=20.0),
    "Tresca": mpm.tresca(**ELASTIC, shear_strength=12e3),
    "softening": mpm.SofteningMohrCoulomb(
        mpm.MohrCoulomb(**ELASTIC, cohesion=15e3, friction_angle=20.0),
        residual_cohesion=3e3, residual_friction_angle=12.0, softening_strain=0.03, reference_length=0.1,
    ),
}  # fmt: skip
"""No dilation: the closed forms are those of constant plastic volume."""
CONES = {
    "von Mises": mpm.von_mises(**ELASTIC, yield_stress=STRENGTH),
    "Drucker-Prager": mpm.DruckerPrager(**ELASTIC, strength=8e3, friction=0.25),
}
CLAY = mpm.CamClay(
    compression=0.2, swelling=0.04, critical_slope=1.0, poisson=0.25, void_ratio=1.0, preconsolidation=100e3
)
SAND = mpm.NorSand(
    critical_void_ratio=0.9, critical_compression=0.03, critical_slope=1.25, dilatancy=4.0, hardening=100.0, rigidity=200.0,
    poisson=0.2, void_ratio=0.84, image_pressure=100e3,
)  # fmt: skip
WATER = {"water_modulus": 2e8, "porosity": 0.4}
SKELETONS = {**PYRAMIDS, **CONES, "Cam-Clay": CLAY, "NorSand": SAND}
TESTS = ("oedometer", "drained", "undrained", "shear")


@pytest.fixture(scope="module")
def external(tmp_path_factory):
    library = tmp_path_factory.mktemp("umat") / "umat.so"
    source = Path(__file__).parents[1] / "umat_von_mises.f90"
    subprocess.run(["gfortran", "-shared", "-fPIC", "-O1", "-o", library, source], check=True)
    modulus = CONES["von Mises"].p_wave_modulus
    umat = mpm.Umat(str(library), properties=[YOUNG, POISSON, STRENGTH], n_variables=1, plastic_strain_variable=1,
                    p_wave_modulus=modulus)  # fmt: skip
    return {"Python": mpm.PythonLaw(VonMises()), "UMAT": umat}


def increment(kind, size):
    return {
        "oedometer": [-size, 0, 0, 0, 0, 0],
        "drained": [-size, None, None, 0, 0, 0],
        "undrained": [-size, size / 2, size / 2, 0, 0, 0],
        "shear": [0, 0, 0, size, 0, 0],
    }[kind]


def path_of(law, kind, strain=0.06, steps=60):
    """The point after each step of a test from an isotropic pressure: (strain, stress, state) rows."""
    test = mpm.ElementTest(law, [-PRESSURE] * 3 + [0.0] * 3)
    rows = []
    for _ in range(steps):
        test.step(increment(kind, strain / steps))
        rows.append((test.strain.copy(), test.stress.copy(), test.state.copy()))
    return tuple(np.array(column) for column in zip(*rows, strict=True))


def pyramid_strength(law, kind, p, state):
    """q at failure in triaxial compression (tau in shear) at the mean stress p, or at the side stress if drained."""
    if isinstance(law, mpm.LinearElastic):
        return np.inf
    now = law.softened(state[1]) if isinstance(law, mpm.SofteningMohrCoulomb) else law
    sine, cosine = np.sin(np.radians(now.friction_angle)), np.cos(np.radians(now.friction_angle))
    if kind == "shear":
        return p * sine + now.cohesion * cosine
    if kind == "drained":
        return 2 * (PRESSURE * sine + now.cohesion * cosine) / (1 - sine)
    return 6 * (p * sine + now.cohesion * cosine) / (3 - sine)


def cone_strength(law, kind, p, state):
    friction, strength = getattr(law, "friction", 0.0), getattr(law, "strength", STRENGTH / np.sqrt(3))
    if kind == "shear":
        return strength + friction * p
    if kind == "drained":
        return (strength + friction * PRESSURE) / (1 / np.sqrt(3) - friction / 3)
    return np.sqrt(3) * (strength + friction * p)


def assert_closed_form(law, kind, strength):
    """Elastic up to the strength, then at the strength; the plastic strain is what elasticity leaves over."""
    strains, stresses, states = path_of(law, kind)
    failed = 0
    for strain, stress, state in zip(strains, stresses, states, strict=True):
        volume, p = -strain[:3].sum(), -stress[:3].mean()
        axial = -strain[0] - volume / 3
        elastic = {"shear": SHEAR * strain[3], "drained": -YOUNG * strain[0]}.get(kind, 3 * SHEAR * axial)
        limit = strength(law, kind, p, state)
        found = stress[3] if kind == "shear" else stress[1] - stress[0]
        assert found == pytest.approx(min(elastic, limit), rel=1e-7)
        if kind != "drained":
            assert p == pytest.approx(PRESSURE + BULK * volume, rel=1e-9)
        plastic = (strain[3] - found / SHEAR) / np.sqrt(3) if kind == "shear" else axial - found / (3 * SHEAR)
        assert state[0] == pytest.approx(plastic, rel=1e-6, abs=1e-12)
        failed += elastic > limit
    assert failed > 20 or isinstance(law, mpm.LinearElastic)


@pytest.mark.parametrize("kind", TESTS)
@pytest.mark.parametrize("name", PYRAMIDS)
def test_pyramids_follow_their_closed_form(name, kind):
    assert_closed_form(PYRAMIDS[name], kind, pyramid_strength)


@pytest.mark.parametrize("kind", TESTS)
@pytest.mark.parametrize("name", [*CONES, "Python", "UMAT"])
def test_cones_follow_their_closed_form(name, kind, external):
    assert_closed_form({**CONES, **external}[name], kind, cone_strength)


@pytest.mark.parametrize("kind", ["oedometer", "undrained", "shear"])
@pytest.mark.parametrize("name", SKELETONS)
def test_wrapped_laws_follow_the_skeleton(name, kind):
    # Under the same strains: sigma' is that of the skeleton and u = -K_w/n e_v; J sigma is that of the law
    strains, stresses, _ = path_of(SKELETONS[name], kind)
    _, total, state = path_of(mpm.Undrained(SKELETONS[name], **WATER), kind)
    pore = -2e8 / 0.4 * strains[:, :3].sum(axis=1)
    assert state[:, -1] == pytest.approx(pore, rel=1e-9, abs=1e-6)
    effective = total + pore[:, None] * np.array([1, 1, 1, 0, 0, 0])
    assert np.abs(effective - stresses).max() < 1e-7 * np.abs(total).max()
    _, cauchy, state = path_of(mpm.Hencky(SKELETONS[name]), kind)
    growth = np.cumsum(np.log1p(np.diff(strains[:, :3].sum(axis=1), prepend=0.0)))
    assert state[:, -1] == pytest.approx(growth, rel=1e-9, abs=1e-14)
    assert np.abs(np.exp(growth)[:, None] * cauchy - stresses).max() < 1e-7 * np.abs(stresses).max()


@pytest.mark.parametrize("name", ["Mohr-Coulomb", "Tresca", "softening"])
def test_drained_strength_of_hencky_is_that_of_the_kirchhoff_stress(name):
    # sigma_1 = N sigma_3 + 2 (c / J) sqrt(N): the side stress is kept, the cohesion works on J sigma
    law = PYRAMIDS[name]
    _, stresses, states = path_of(mpm.Hencky(law), "drained", strain=0.06)
    for stress, state in list(zip(stresses, states, strict=True))[-20:]:
        now = law.softened(state[1]) if name == "softening" else law
        n = (1 + np.sin(np.radians(now.friction_angle))) / (1 - np.sin(np.radians(now.friction_angle)))
        expected = n * PRESSURE + 2 * now.cohesion * np.exp(-state[-1]) * np.sqrt(n)
        assert -stress[0] == pytest.approx(expected, rel=1e-7)


def admissible_excess(law, stress, state):
    """How far stresses are outside of the strength, as a fraction of their size."""
    if isinstance(law, mpm.Undrained):
        effective = stress + state[:, -1:] * (np.arange(stress.shape[1]) < 3)
        return admissible_excess(law.skeleton, effective, state[:, :-1])
    if isinstance(law, mpm.Hencky):
        return admissible_excess(law.law, stress * np.exp(state[:, -1:]), state[:, :-1])
    p, radius = mean_and_radius(stress)
    if isinstance(law, mpm.CamClay):
        pc = law.preconsolidation * np.exp(state[:, 1])
        return (3 * radius**2 / law.critical_slope**2 - p * (-p - pc)) / (pc**2 + p**2)
    if isinstance(law, mpm.MohrCoulomb):
        s, phi = principal(stress), np.radians(law.friction_angle)
        f = (s[:, 0] - s[:, 2]) / 2 + (s[:, 0] + s[:, 2]) / 2 * np.sin(phi) - law.cohesion * np.cos(phi)
        return f / np.abs(s).max(axis=1)
    friction, strength = getattr(law, "friction", 0.0), getattr(law, "strength", STRENGTH / np.sqrt(3))
    return (radius + friction * p - strength) / (radius + np.abs(p))


def wrapped_laws():
    soil, cone = PYRAMIDS["Mohr-Coulomb"], CONES["Drucker-Prager"]
    return {
        "Mohr-Coulomb": soil, "Tresca": PYRAMIDS["Tresca"], "Hencky Mohr-Coulomb": mpm.Hencky(soil),
        "Hencky Cam-Clay": mpm.Hencky(CLAY), "undrained Mohr-Coulomb": mpm.Undrained(soil, **WATER),
        "undrained Cam-Clay": mpm.Undrained(CLAY, **WATER),
        "undrained Hencky Drucker-Prager": mpm.Undrained(mpm.Hencky(cone), **WATER),
    }  # fmt: skip


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("name", [*wrapped_laws(), "Python", "UMAT"])
def test_stress_stays_admissible_on_random_walks(name, dim, external):
    law = {**wrapped_laws(), **external}[name]
    stress, _ = random_points(dim, 1000, pressure=60e3, deviator=5e3, strain=0.0)
    stress, state = walk(law, stress, 1e-3, 100)  # 10^5 updates
    assert admissible_excess(law, stress, state).max() < 1e-8
    assert np.mean(state[:, 0] > 0) > 0.5


@pytest.mark.parametrize("name", [*SKELETONS, "Hencky Mohr-Coulomb", "undrained Mohr-Coulomb", "Python", "UMAT"])
def test_initial_stress_is_honoured(name, external):
    # Without strain nothing happens; with little strain the answer is elastic, beginning at the stress
    law = {**SKELETONS, **wrapped_laws(), **external}[name]
    stress, strain = random_points(3, 300, pressure=50e3, deviator=1e3, strain=1e-7)
    still, moved = Batch(law, stress, 0 * strain), Batch(law, stress, strain)
    assert still.report.plastic == moved.report.plastic == 0
    assert np.abs(still.stress - stress).max() < 1e-10 * 50e3
    answer = np.einsum("nij,nj->ni", still.tangent, strain)
    assert np.abs(moved.stress - stress - answer).max() < 1e-4 * np.abs(answer).max()


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("name", ["elastic", "Mohr-Coulomb", "Tresca"])
def test_tangent_is_the_derivative_of_the_stress(name, dim):
    stress, strain = random_points(dim, 400, pressure=50e3, deviator=10e3, strain=1e-3)
    batch = Batch(PYRAMIDS[name], stress, strain)
    assert batch.report.plastic > 100 or name == "elastic"
    assert_tangent(batch, 1e-8)


def test_increments_of_cam_clay_may_be_large():
    # One increment against a thousand: the secant return is of first order, and never leaves the surface
    errors = {}
    for strain in (1e-3, 5e-3, 2e-2):
        once, often = (mpm.ElementTest(CLAY, [-80e3] * 3 + [0.0] * 3) for _ in range(2))
        total = strain * np.array([-1.0, 0.3, 0.2, 0.4, 0, 0])
        once.step(total)
        for _ in range(1000):
            often.step(total / 1000)
        errors[strain] = np.abs(once.stress - often.stress).max() / np.abs(often.stress).max()
    assert errors[1e-3] < 0.01 and errors[5e-3] < 0.03 and errors[2e-2] < 0.1


@pytest.mark.parametrize("steps", [1, 3, 100])
def test_triaxial_extension_in_one_increment_or_many(steps):
    """At failure the pressure p = -s3 on the sides is the largest principal stress: s1 = -(p - 2 c sqrt(K)) / K."""
    cohesion, k = 10e3, 3.0  # (1 + sin phi) / (1 - sin phi) of 30 degrees
    test = mpm.ElementTest(
        mpm.MohrCoulomb(**ELASTIC, cohesion=cohesion, friction_angle=30.0), [-PRESSURE] * 3 + [0.0] * 3
    )
    yield_strain = (PRESSURE * (1 - 1 / k) + 2 * cohesion / np.sqrt(k)) / YOUNG
    for _ in range(steps):
        test.step([5 * yield_strain / steps, None, None, 0.0, 0.0, 0.0])
    axial = -(PRESSURE - 2 * cohesion * np.sqrt(k)) / k
    assert test.stress == pytest.approx([axial, -PRESSURE, -PRESSURE, 0, 0, 0], abs=1e-6 * PRESSURE)
