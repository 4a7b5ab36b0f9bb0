"""Strength reduction of each law, and the strength of Davis."""

from dataclasses import dataclass

import numpy as np
import pytest
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from mpm_core import _core

ELASTIC = {"young": 10e6, "poisson": 0.3}


def sand(**options):
    values = {"cohesion": 10.0, "friction_angle": 30.0, "dilation_angle": 20.0, **options}
    return mpm.MohrCoulomb(**ELASTIC, **values)


def tangent(degrees):
    return np.tan(np.radians(degrees))


def test_mohr_coulomb():
    weak = bridge.reduced_strength(sand(), 2.0)
    assert weak.cohesion == 5.0
    assert tangent(weak.friction_angle) == pytest.approx(tangent(30.0) / 2)
    assert weak.dilation_angle == weak.friction_angle  # 16.1 degrees: no longer 20
    assert bridge.reduced_strength(sand(), 1.2).dilation_angle == 20.0


def test_tresca_has_its_strength_divided():
    weak = bridge.reduced_strength(mpm.tresca(**ELASTIC, shear_strength=30e3), 1.5)
    assert weak.cohesion == pytest.approx(20e3) and weak.friction_angle == 0


def test_softening_soil_has_both_strengths_divided():
    law = mpm.SofteningMohrCoulomb(
        sand(), residual_cohesion=4.0, residual_friction_angle=20.0, softening_strain=0.1, reference_length=0.5
    )
    weak = bridge.reduced_strength(law, 2.0)
    assert weak.peak == bridge.reduced_strength(sand(), 2.0)
    assert weak.residual_cohesion == 2.0
    assert tangent(weak.residual_friction_angle) == pytest.approx(tangent(20.0) / 2)
    assert (weak.softening_strain, weak.reference_length) == (0.1, 0.5)


def shear_strength(law, pressure):
    """Deviatoric stress q [Pa] at which a triaxial compression under constant mean pressure fails."""
    strain, stress = np.zeros((1, 6)), np.zeros((1, 6))
    stress[0, :3] = -pressure
    state = np.zeros((1, law.n_state))
    if "log_preconsolidation" in law.state_names:
        state[0, law.state_names.index("log_preconsolidation")] = mpm.log_preconsolidation(law, stress)[0]
    for _ in range(4000):
        strain[0] = 1e-4 * np.array([0.5, 0.5, -1, 0, 0, 0])
        law.update(strain, stress, state)
        mean = stress[0, :3].mean()
        strain[0] = np.array([1, 1, 1, 0, 0, 0]) * (-pressure - mean) / (3 * law.p_wave_modulus)
        law.update(strain, stress, state)
    return stress[0, 0] - stress[0, 2]


def test_drucker_prager_fails_at_the_divided_stress():
    law = mpm.matched_drucker_prager(**ELASTIC, cohesion=10e3, friction_angle=25.0)
    strong, weak = (shear_strength(one, 100e3) for one in (law, bridge.reduced_strength(law, 1.6)))
    assert weak == pytest.approx(strong / 1.6, rel=1e-3)


CRITICAL_STATE_LAWS = [
    mpm.CamClay(
        compression=0.2, swelling=0.04, critical_slope=1.2, poisson=0.3, preconsolidation=100e3, void_ratio=1.0
    ),
    mpm.NorSand(
        critical_void_ratio=0.9, critical_compression=0.03, critical_slope=1.2, dilatancy=4.0, hardening=100.0, rigidity=200.0,
        poisson=0.2, void_ratio=0.8, image_pressure=100e3,
    ),
]  # fmt: skip


@pytest.mark.parametrize("law", CRITICAL_STATE_LAWS)
def test_the_friction_angle_of_the_critical_state_is_reduced(law):
    weak = bridge.reduced_strength(law, 1.5)
    sines = [3 * one.critical_slope / (6 + one.critical_slope) for one in (law, weak)]
    assert np.tan(np.arcsin(sines[1])) == pytest.approx(np.tan(np.arcsin(sines[0])) / 1.5)
    for name in (p.name for p in law.parameters if p.name != "critical_slope"):
        assert getattr(weak, name) == getattr(law, name)


def test_laws_made_of_others():
    assert bridge.reduced_strength(mpm.Hencky(sand()), 2.0).law == bridge.reduced_strength(sand(), 2.0)
    soaked = bridge.reduced_strength(mpm.Undrained(sand(), porosity=0.4), 2.0)
    assert soaked.skeleton == bridge.reduced_strength(sand(), 2.0) and soaked.porosity == 0.4


def test_some_soils_stay_as_they_are():
    rock = mpm.LinearElastic(**ELASTIC)
    laws = {1: sand(), 2: sand(cohesion=20.0), 3: rock}
    weak = bridge.reduced_strength(laws, 2.0, unreduced=[2])
    assert weak[1].cohesion == 5.0 and weak[2] == laws[2] and weak[3] == rock
    with pytest.raises(bridge.InputError, match="unreduced.*no law is left"):
        bridge.reduced_strength(laws, 2.0, unreduced=[1, 2])
    with pytest.raises(bridge.InputError, match=r"unreduced.*7.*\[1, 2, 3\]"):
        bridge.reduced_strength(laws, 2.0, unreduced=[7])
    with pytest.raises(bridge.InputError, match="unreduced is 'rock', expected a list of cell tags or names"):
        bridge.reduced_strength(laws, 2.0, unreduced="rock")  # no law of 'r'
    for reduce in (bridge.reduced_strength, bridge.davis_reduced_strength):
        with pytest.raises(bridge.InputError, match=r"unreduced is \[1\] with one law .* expected laws by cell tag"):
            reduce(laws[1], 2.0, [1])


class Frictional:
    """The Mohr-Coulomb law of the core, called from Python, which names its strength."""

    n_state = sand().n_state
    p_wave_modulus = sand().p_wave_modulus
    strength_parameters = {"c": "strength", "phi": "friction angle", "psi": "dilation angle"}

    def __init__(self, c=10.0, phi=30.0, psi=20.0):
        self.c, self.phi, self.psi = c, phi, psi

    def update(self, strain_increment, stress, state, tangent):
        law = sand(cohesion=self.c, friction_angle=self.phi, dilation_angle=self.psi)
        law.update(strain_increment, stress, state, tangent)


@dataclass(frozen=True)
class Prepared(Frictional):
    """The same as a dataclass that cannot be changed and computes numbers when it is constructed."""

    c: float = 10.0
    phi: float = 30.0
    psi: float = 20.0

    def __post_init__(self):
        object.__setattr__(self, "slope", tangent(self.phi))


@pytest.mark.parametrize("kind", [Frictional, Prepared])
@pytest.mark.parametrize("factor", [1.2, 2.0])
def test_a_law_in_python_that_names_its_strength(kind, factor):
    law = mpm.PythonLaw(kind())
    weak, expected = bridge.reduced_strength(law, factor).law, bridge.reduced_strength(sand(), factor)
    assert (weak.c, weak.phi, weak.psi) == (expected.cohesion, expected.friction_angle, expected.dilation_angle)
    assert getattr(weak, "slope", tangent(weak.phi)) == tangent(weak.phi)
    assert (law.law.c, law.law.phi, law.law.psi) == (10.0, 30.0, 20.0)  # the law itself stays as it is
    wet = bridge.reduced_strength(mpm.Undrained(mpm.Hencky(law), porosity=0.4), factor).skeleton.law.law
    assert (wet.c, wet.phi) == (weak.c, weak.phi)


@pytest.mark.parametrize(("phi", "psi"), [(30.0, 0.0), (30.0, 5.0), (30.0, 30.0), (30.0, 40.0), (0.0, 0.0)])
def test_dilation_of_a_law_in_python_that_names_it_is_that_of_the_core_law(phi, psi):
    """Over that of associated flow: on it depends how strains are averaged."""
    native = sand(friction_angle=phi, dilation_angle=min(psi, phi))
    found = _core.associated_fraction(mpm.PythonLaw(Frictional(phi=phi, psi=psi)))
    assert found == pytest.approx(_core.associated_fraction(native), abs=0)
    unknown = Frictional(phi=phi)
    unknown.strength_parameters = {"phi": "friction angle"}
    assert np.isnan(_core.associated_fraction(mpm.PythonLaw(unknown)))


def test_a_law_in_python_has_the_factor_of_safety_of_the_core_law():
    body, _, facets = bridge.soil_mesh(*bridge.slope_mesh(MPI.COMM_WORLD, crest=1.0, cell_size=0.25))
    held = [bridge.roller(bridge.LEFT, (1, 0)), bridge.fixed(bridge.BASE)]
    strength = {"c": 4e3, "phi": 25.0, "psi": 25.0}
    native = sand(cohesion=4e3, friction_angle=25.0, dilation_angle=25.0)
    found = [
        bridge.factor_of_safety(
            bridge.QuasiStatic(body, law, facets, held), bridge.Load(unit_weight=20e3), start=1.5, tolerance=0.02
        )
        for law in (native, mpm.PythonLaw(Frictional(**strength)))
    ]
    assert found[0].failed and found[1].failed
    assert found[1].value == found[0].value and found[1].curve == pytest.approx(found[0].curve, rel=1e-9)


@pytest.mark.parametrize(
    ("named", "words"),
    [
        ({"cohesion": "strength"}, "names cohesion in strength_parameters, but has no such attribute"),
        ({"c": "shear"}, "names 'shear', expected 'strength', 'friction angle' or 'dilation angle'"),
        ({"psi": "dilation angle", "phi": "friction angle"}, "expected the friction angle that limits it before it"),
    ],
)
def test_strength_that_is_named_wrongly_is_refused(named, words):
    law = Frictional()
    law.strength_parameters = named
    with pytest.raises(mpm.InputError, match=words):
        mpm.PythonLaw(law)


@pytest.mark.parametrize("factor", [0.0, -1.0, np.nan, np.inf])
def test_bad_factors_are_refused(factor):
    with pytest.raises(bridge.InputError, match="factor"):
        bridge.reduced_strength(sand(), factor)


def test_laws_of_unknown_strength_are_refused_with_advice():
    unknown = Frictional()
    unknown.strength_parameters = {}
    for law, name in ((mpm.LinearElastic(**ELASTIC), "LinearElastic"), (mpm.PythonLaw(unknown), "Frictional")):
        with pytest.raises(bridge.InputError, match=f"{name}.*strength_parameters.*reduce"):
            bridge.reduced_strength(law, 1.0)


def test_strength_of_davis_of_soil_whose_cohesion_varies_is_that_of_each_point():
    law = sand(dilation_angle=5.0)
    varying = mpm.Heterogeneous(law, ["cohesion"])
    strain = np.array([[-1e-3, 2e-3, 0.0, 1e-3]] * 2)
    for factor in (1.0, 1.3):
        reduced = bridge.davis_reduced_strength(varying, factor)
        for k, cohesion in enumerate((law.cohesion, 3 * law.cohesion)):
            alone = bridge.davis_reduced_strength(sand(dilation_angle=5.0, cohesion=cohesion), factor)
            stress, expected = np.full((1, 4), -10.0), np.full((1, 4), -10.0)
            stress[:, 3] = expected[:, 3] = 0.0
            state = np.zeros((1, reduced.n_state))
            state[:, -1] = cohesion - law.cohesion
            reduced.update(strain[k : k + 1], stress, state)
            alone.update(strain[k : k + 1], expected, np.zeros((1, alone.n_state)))
            assert stress == pytest.approx(expected, rel=1e-12)
    with pytest.raises(bridge.InputError, match="law is Heterogeneous in friction_angle, expected the same angles"):
        bridge.davis_strength({1: mpm.Heterogeneous(law, ["friction_angle"])})


def test_strength_of_davis():
    """Without dilation c* = c cos(phi), tan(phi*) = sin(phi); with associated flow nothing changes."""
    davis = bridge.davis_strength(sand(dilation_angle=0.0))
    assert davis.cohesion == pytest.approx(10 * np.cos(np.radians(30)))
    assert tangent(davis.friction_angle) == pytest.approx(0.5)
    assert davis.dilation_angle == davis.friction_angle
    associated = sand(dilation_angle=30.0)
    assert bridge.davis_strength(associated).cohesion == pytest.approx(associated.cohesion)
    assert bridge.davis_strength(associated).friction_angle == pytest.approx(30.0)
    once = bridge.davis_reduced_strength({1: sand()}, 1.3)[1]
    assert once == bridge.davis_strength(bridge.reduced_strength(sand(), 1.3))


def test_a_factor_of_safety_is_not_that_of_particles():
    domain, cell_tags, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, (1.0, 1.0), (2, 2))
    model = mpm.Model(
        bridge.background_mesh(domain, cell_tags, facet_tags), mpm.tresca(young=1e6, poisson=0.3, shear_strength=1e3)
    )
    with pytest.raises(bridge.InputError, match="model is Model, expected a QuasiStatic .* particle_safety"):
        bridge.factor_of_safety(model, bridge.Load(unit_weight=18e3))
    for supports in (None, bridge.fixed(3)):
        with pytest.raises(bridge.InputError, match="supports is .*, expected a list"):
            bridge.apply_supports(model, supports)
