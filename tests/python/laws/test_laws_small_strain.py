"""Small-strain stiffness of Hardening Soil: its curve, Masing's rule, memory of cycles, first loading, tangents."""

import numpy as np
import pytest
from hardening_soil_cases import isotropic, preloaded, sand, small_strain_sand, strength
from law_cases import Batch, assert_tangent, random_points, triaxial

import mpm_core as mpm

G0, THRESHOLD = 150e6, 2e-4
UNLOADING = 90e6 / (2 * 1.2)
END = THRESHOLD / 0.385 * (np.sqrt(G0 / UNLOADING) - 1)
"""Strain at which the tangent modulus of the curve is that of unloading"""


def elastic(law):
    """A point whose strength and hardening are far above the stresses of a test."""
    state = np.zeros(law.n_state)
    state[1], state[2] = 1.0, 10.0
    return isotropic(1e6)[None], state[None]


def sheared(law, strains, direction=(2 / 3, -1 / 3, -1 / 3, 0, 0, 0)):
    """Shear stress of a law with constant moduli at strains `gamma` one after another: half of s1 - s3 in triaxial directions."""
    stress, state = elastic(law)
    result = []
    for increment in np.diff(strains, prepend=0.0):
        assert law.update(increment * np.array([direction]), stress, state).failed == 0
        result.append((stress[0, 0] - stress[0, 1]) / 2)
    return np.array(result)


def curve(gamma):
    """Santos and Correia (2001) up to the strain at which the tangent modulus is that of unloading, and on along its tangent."""
    bounded = np.minimum(gamma, END)
    return G0 * bounded / (1 + 0.385 * bounded / THRESHOLD) + UNLOADING * (gamma - bounded)


LAW = {"cohesion": 1e6, "exponent": 0.0}


def test_first_loading_follows_the_curve_of_the_modulus():
    law, strains = small_strain_sand(**LAW), np.geomspace(1e-7, 3e-3, 200)
    stress = sheared(law, strains)
    above = stress / curve(strains) - 1  # tangents are above the curve; the two first ones meet at 3 % above it
    assert above.min() > -1e-9
    assert above.max() < 0.03
    roots = np.linspace(1, np.sqrt(UNLOADING / G0), 11)  # 1 / (1 + 0.385 gamma / gamma_0.7) where the tangents touch
    touching = THRESHOLD / 0.385 * (1 / roots[1:] - 1)
    assert sheared(law, touching) == pytest.approx(curve(touching), rel=1e-9)
    assert sheared(law, np.array([THRESHOLD]))[0] / THRESHOLD == pytest.approx(0.722 * G0, rel=0.01)


def test_many_increments_and_one_have_the_same_stress():
    law = small_strain_sand(**LAW)
    assert sheared(law, np.linspace(1e-6, 1e-3, 1000))[-1] == pytest.approx(sheared(law, [1e-3])[0], rel=1e-9)


@pytest.mark.parametrize("largest", [5e-5, 2e-4, 1e-3])
def test_unloading_and_reloading_are_masings_loop(largest):
    law, n = small_strain_sand(**LAW), 40
    down = np.linspace(largest, -largest, n + 1)[1:]
    first = sheared(law, [largest])[0]
    loop = sheared(law, np.concatenate([[largest], down, down[::-1][1:], [largest]]))[1:]
    half = np.array([sheared(law, [(largest - strain) / 2])[0] for strain in down])
    assert loop[:n] == pytest.approx(first - 2 * half, abs=1e-6 * first)
    assert loop[-1] == pytest.approx(first, rel=1e-9)


def test_the_damping_of_a_loop_is_that_of_the_curve():
    """Brinkgreve, Kappert, Bonnier (2007): dissipated energy of a loop in closed form, below the strain of the end of the curve."""
    law, a, amplitude = small_strain_sand(**LAW), 0.385, 0.8 * END
    strains = np.concatenate([np.linspace(amplitude, -amplitude, 2001), np.linspace(-amplitude, amplitude, 2001)[1:]])
    loop = sheared(law, strains)
    dissipated = np.trapezoid(loop, strains) if hasattr(np, "trapezoid") else np.trapz(loop, strains)
    scale = THRESHOLD / a
    closed = (
        4
        * G0
        * scale
        * (2 * amplitude - amplitude / (1 + scale / amplitude) - 2 * scale * np.log(1 + amplitude / scale))
    )
    assert dissipated == pytest.approx(closed, rel=0.03)


def test_a_small_cycle_leaves_no_trace():
    """Unlike with a strain history that each reversal deletes: the stress would go up as if the soil were at rest."""
    law = small_strain_sand(**LAW)
    strains = np.linspace(1e-5, 6e-4, 60)
    straight = sheared(law, strains)
    turned = np.concatenate([strains[:30], [strains[29] - 2e-5], strains[29:]])
    assert sheared(law, turned)[31:] == pytest.approx(straight[29:], rel=1e-9)


def test_the_invariant_is_that_of_triaxial_tests_in_any_direction():
    """In simple shear sqrt(3/2 e : e) is sqrt(3)/2 of the engineering strain."""
    law, gamma = small_strain_sand(**LAW), 1.5e-4
    stress, state = elastic(law)
    law.update(np.array([[0, 0, 0, gamma, 0, 0]]), stress, state)
    size = np.sqrt(3) / 2 * gamma
    expected = sheared(law, [size])[0] / size * gamma
    assert stress[0, 3] == pytest.approx(expected, rel=1e-9)


def test_plane_strain_is_that_of_three_dimensions():
    law, random = small_strain_sand(), np.random.default_rng(0)
    plane, space = isotropic(100e3)[None, :4].copy(), isotropic(100e3)[None]
    states = np.zeros((1, law.n_state)), np.zeros((1, law.n_state))
    for _ in range(30):
        strain = 1e-4 * random.normal(size=(1, 4)) * [1, 1, 0, 1]
        law.update(strain, plane, states[0])
        law.update(np.pad(strain, ((0, 0), (0, 2))), space, states[1])
    assert plane[0] == pytest.approx(space[0, :4], rel=1e-9)
    assert states[0] == pytest.approx(states[1], rel=1e-9, abs=1e-15)


def test_first_loading_begins_with_the_small_strain_modulus_and_comes_to_the_hyperbola():
    """Drained triaxial test: at first elastic strains by G0, and plastic ones of the hyperbola over H_i = (G0 / G_ur)^(1 + E_ur / (2 E50))."""
    law, plain, pressure = small_strain_sand(dilation_angle=0.0), sand(dilation_angle=0.0), 100e3
    strain, stress = triaxial(preloaded(law, pressure), -2e-6, 10)
    q = -stress[:, 0] - pressure
    initial = 2 * law.secant_modulus / (2 - law.failure_ratio)
    slowed = (G0 / UNLOADING) ** -(1 + 90 / (2 * 30))
    assert -strain[-1, 0] / q[-1] == pytest.approx(1 / (2 * 1.2 * G0) + slowed * (1 / initial - 1 / 90e6), rel=5e-3)
    strain, stress = triaxial(preloaded(law, pressure), -0.06, 1200)
    q = -stress[:, 0] - pressure
    assert q[-1] == pytest.approx(strength(law, pressure), rel=1.5e-3)  # the edge of the hexagon is round
    inside = (q > 0.5 * q[-1]) & (q < 0.9 * q[-1])
    usual, load = triaxial(preloaded(plain, pressure), -0.06, 1200)
    saved = strain[inside, 0] - np.interp(q[inside], -load[:, 0] - pressure, usual[:, 0])  # compression is negative
    assert inside.sum() > 20
    assert (saved > 0).all()
    assert np.ptp(saved) < 0.02 * saved.mean()  # past the end of the curve both laws are as stiff


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("strain", [1e-6, 1e-5, 1e-4, 1e-3])
def test_tangent_of_points_that_have_been_strained(dim, strain):
    law, random = small_strain_sand(), np.random.default_rng(5)
    stress, increment = random_points(dim, 300, pressure=60e3, deviator=10e3, strain=strain)
    state = np.zeros((300, law.n_state))
    for size in (1e-4, 3e-5):
        law.update(random.normal(0.0, size, stress.shape), stress, state)
    batch = Batch(law, stress, increment, state)
    assert batch.report.failed == 0
    assert_tangent(batch, 1e-5 * strain, tolerance=1e-4)


def test_modulus_below_that_of_unloading_is_refused():
    with pytest.raises(mpm.InputError, match="small_strain_modulus = 3e\\+07, .* above the shear modulus of unloading"):
        small_strain_sand(small_strain_modulus=30e6)
    assert small_strain_sand(small_strain_modulus=0.0).n_state == sand().n_state == 3


def test_the_modulus_varies_from_point_to_point_where_the_law_has_one():
    base = small_strain_sand(**LAW)
    law, stress = mpm.Heterogeneous(base, ["small_strain_modulus"]), np.tile(isotropic(1e6), (2, 1))
    state = np.zeros((2, law.n_state))
    state[:, 1:3] = 1.0, 10.0
    state[1, -1] = 50e6
    law.update(np.tile(1e-7 * np.array([2 / 3, -1 / 3, -1 / 3, 0, 0, 0]), (2, 1)), stress, state)
    moduli = (stress[:, 0] - stress[:, 1]) / 2e-7
    assert moduli == pytest.approx([G0, G0 + 50e6], rel=1e-6)
    with pytest.raises(mpm.InputError, match="varying has 'small_strain_modulus', which is 0 in the law"):
        mpm.Heterogeneous(sand(), ["small_strain_modulus"])


def test_states_have_names():
    names = small_strain_sand().state_names
    assert names[3] == "largest_small_strain"
    assert names[4] == "brick_1_xx"
    assert names[-1] == "brick_10_xz"
    assert len(names) == len(set(names)) == 54


@pytest.mark.parametrize("modulus", [150e6, 300e6])
def test_first_compression_in_ten_increments_is_that_in_a_thousand(modulus):
    """Its stiffness falls while plastic strains begin, so that their means over an increment must not be multiplied."""
    k0, ends = 1 - np.sin(np.radians(35.0)), []
    for steps in (1000, 10):
        test = mpm.ElementTest(small_strain_sand(small_strain_modulus=modulus), [-100e3 * k0, -100e3, -100e3 * k0, 0.0])
        for _ in range(steps):
            test.step([0.0, -1e-3 / steps, 0.0, 0.0])
        ends.append(test.stress[1] + 100e3)
    assert ends[1] == pytest.approx(ends[0], rel=5e-3)
