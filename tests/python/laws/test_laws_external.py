"""Laws written in Python, and Abaqus UMATs: a small one in Fortran, compiled here, against the same law of the core."""

import re
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
from core_cases import box, by_id, rollers, run
from implicit_cases import floor
from law_cases import Batch, assert_tangent, random_points

import fenics_bridge as bridge
import mpm_core as mpm
from mpm_core import _core

YOUNG, POISSON, STRENGTH = 20e6, 0.3, 30e3
NATIVE = mpm.von_mises(young=YOUNG, poisson=POISSON, yield_stress=STRENGTH)


class VonMises:
    """The same law in NumPy."""

    n_state = 1
    p_wave_modulus = NATIVE.p_wave_modulus

    def __init__(self, strength=STRENGTH):
        self.strength = strength

    def update(self, strain_increment, stress, state, tangent):
        s = strain_increment.shape[1]
        shear, bulk = YOUNG / (2 * (1 + POISSON)), YOUNG / (3 * (1 - 2 * POISSON))
        normal = np.arange(s) < 3
        volume = np.outer(normal, normal).astype(float)
        projection = np.diag(np.where(normal, 1.0, 0.5)) - volume / 3
        stress += strain_increment @ (bulk * volume + 2 * shear * projection)
        p = stress[:, :3].mean(axis=1, keepdims=True) * normal
        deviator = stress - p
        size = np.sqrt(1.5 * (deviator**2 @ np.where(normal, 1.0, 2.0)))
        ratio = np.minimum(1.0, self.strength / np.maximum(size, 1e-300))
        stress[:] = p + ratio[:, None] * deviator
        state[:, 0] += (1 - ratio) * size / (3 * shear)
        if tangent is not None:
            factor = np.where(ratio < 1, 3 * shear * ratio / np.maximum(size, 1.0) ** 2, 0.0)
            tangent[:] = bulk * volume + ratio[:, None, None] * 2 * shear * projection
            tangent -= factor[:, None, None] * deviator[:, :, None] * deviator[:, None, :]


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    """The Fortran UMAT as a shared library."""
    target = tmp_path_factory.mktemp("umat") / "umat_von_mises.so"
    source = Path(__file__).parents[1] / "umat_von_mises.f90"
    subprocess.run(["gfortran", "-shared", "-fPIC", "-O1", "-o", target, source], check=True)
    return str(target)


def umat(library, **changes):
    parameters = {"properties": [YOUNG, POISSON, STRENGTH], "n_variables": 1, "plastic_strain_variable": 1,
                  "p_wave_modulus": NATIVE.p_wave_modulus}  # fmt: skip
    return mpm.Umat(library, **{**parameters, **changes})


@pytest.fixture(params=["Python", "UMAT"])
def law(request, library):
    return mpm.PythonLaw(VonMises()) if request.param == "Python" else umat(library)


@pytest.mark.parametrize("dim", [2, 3])
def test_points_are_those_of_the_core_law(law, dim):
    # Unlike shear in yz and xz shows whether these two are in the law's order
    stress, strain = random_points(dim, 600, pressure=50e3, deviator=15e3, strain=1e-3)
    here, native = Batch(law, stress, strain), Batch(NATIVE, stress, strain)
    assert 100 < native.report.plastic < 600
    assert np.abs(here.stress - native.stress).max() < 1e-9 * 50e3
    assert np.abs(here.tangent - native.tangent).max() < 1e-9 * YOUNG
    assert np.abs(here.state[:, 0] - native.state[:, 0]).max() < 1e-12
    assert (here.report.plastic, here.report.failed) == (native.report.plastic, 0)
    assert_tangent(here, 1e-8)


def column(law, dim):
    """A box of soil under its own weight, too soft to carry it."""
    model = mpm.Model(box([3] * (dim - 1) + [4], body=([0.0] * dim, [1.0] * (dim - 1) + [0.75])), law)
    model.seed(density=2000.0, per_cell=6 if dim == 2 else 4, cell_tag=1)
    rollers(model, range(dim - 1))
    model.fix(floor(dim))
    model.set_gravity([0.0] * (dim - 1) + [-150.0])
    return model


@pytest.mark.parametrize("dim", [2, 3])
def test_explicit_run_is_that_of_the_core_law(law, dim):
    models = [column(law, dim), column(NATIVE, dim)]
    for model in models:
        run(model, 0.05, damping=0.2, integration=mpm.Integration.PARTICLES)
        assert (model.particles.plastic_strain > 0).mean() > 0.1
    stress = [m.particles.stress[np.argsort(m.particles.id)] for m in models]
    assert np.abs(stress[0] - stress[1]).max() < 1e-6 * np.abs(stress[1]).max()


def test_a_law_that_names_angles_of_zero_is_averaged_as_soil_without_friction(library):
    """In full, as the core's law; one that names nothing, as frictional soil without dilation, by half (docs/howto/law.md)."""
    names = ("strength", "friction angle", "dilation angle")
    python = VonMises()
    python.phi = python.psi = 0.0
    python.strength_parameters = dict(zip(("strength", "phi", "psi"), names))
    named = umat(
        library, properties=[YOUNG, POISSON, STRENGTH, 0.0, 0.0], strength_parameters=dict(zip((3, 4, 5), names))
    )
    models = [column(law, 2) for law in (NATIVE, mpm.PythonLaw(python), named, umat(library))]
    for model in models:
        run(model, 0.05, damping=0.2, nmd=True, integration=mpm.Integration.MIXED)
    native, *others, unnamed = (by_id(model, "stress") for model in models)
    for stress in others:
        assert np.abs(stress - native).max() < 1e-6 * np.abs(native).max()
    assert np.abs(unnamed - native).max() > 0.05 * np.abs(native).max()


def test_implicit_run_is_that_of_the_core_law(law):
    models = [column(law, 2), column(NATIVE, 2)]
    for model in models:
        list(model.implicit(0.05, dt=0.01, integration=mpm.Integration.PARTICLES))
        assert (model.particles.plastic_strain > 0).mean() > 0.1
    assert np.abs(models[0].particles.displacement - models[1].particles.displacement).max() < 1e-9


@pytest.mark.parametrize(
    "member, message",
    [
        ({"n_state": 1.5}, "law has the n_state 1.5, expected a whole number"),
        ({"p_wave_modulus": "stiff"}, r"law has the p_wave_modulus 'stiff', expected a number \[Pa\]"),
        ({"state_names": 3}, "law has the state_names 3, expected a list of names"),
        (
            {"strength_parameters": ["strength"]},
            r"law has the strength_parameters \['strength'\], expected a dictionary",
        ),
        ({"strength_parameters": {"name": "strength"}, "name": "clay"}, "law has the name 'clay', expected a number"),
    ],
)
def test_members_of_a_python_law_that_are_something_else_are_named(member, message):
    law = VonMises()
    vars(law).update(member)
    with pytest.raises(mpm.InputError, match=message):
        mpm.PythonLaw(law)


def test_a_class_in_place_of_a_law_is_refused():
    with pytest.raises(mpm.InputError, match="law is the class VonMises, expected an object of it"):
        mpm.PythonLaw(VonMises)


@pytest.mark.parametrize("said", [0.4, 0.6])
def test_a_law_that_is_stiffer_than_it_says_is_warned_of(library, said):
    python = VonMises()
    python.p_wave_modulus = said * NATIVE.p_wave_modulus
    for law in (mpm.PythonLaw(python), umat(library, p_wave_modulus=said * NATIVE.p_wave_modulus)):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            run(column(law, 2), 1e-4)
        texts = [str(each.message) for each in caught if "the modulus of compression of" in str(each.message)]
        assert len(texts) == (said < 0.5)
        assert all(
            re.search(r"is 2.69e\+07 Pa in some particles, above its p_wave_modulus of 1.08e\+07 Pa", t) for t in texts
        )


class Broken:
    n_state, p_wave_modulus = 1, 1e6

    def __init__(self, harm):
        self.update = harm


def fill(stress, value):
    stress[:] = value


def test_a_python_law_that_fails_ends_the_run_with_the_place(monkeypatch):
    def harm(strain_increment, stress, state, tangent):
        raise ArithmeticError("no root")

    message = "particle .* follows the law PythonLaw of Broken .* failed for the strain increment"
    printed = []
    monkeypatch.setattr(sys, "unraisablehook", lambda problem: printed.append(str(problem.exc_value)))
    with pytest.raises(mpm.RunError, match=message):
        run(column(mpm.PythonLaw(Broken(harm)), 2), 0.1)
    assert printed == ["no root"]
    with pytest.raises(mpm.RunError, match=message):
        run(column(mpm.PythonLaw(Broken(lambda e, stress, state, tangent: fill(stress, np.nan))), 2), 0.1)


def test_a_umat_that_asks_for_a_smaller_step_has_failed(library):
    stress = np.zeros((2, 4))
    strain = np.array([[0, 0, 0, 1e-4], [0, 0, 0, 1e5]])
    batch = Batch(umat(library), stress, strain)
    assert (batch.report.failed, batch.report.first_failed) == (1, 1)
    assert (batch.stress[1] == 0).all() and batch.stress[0, 3] != 0


def test_bad_input_is_named(library):
    with pytest.raises(mpm.InputError, match="library is 'nowhere.so', which cannot be loaded"):
        umat("./nowhere.so".replace("./", ""))
    with pytest.raises(mpm.InputError, match="symbol is 'other_', which .* does not have"):
        umat(library, symbol="other_")
    with pytest.raises(mpm.InputError, match="n_variables = 60, but it must be from 0 to 55"):
        umat(library, n_variables=60)
    with pytest.raises(mpm.InputError, match="plastic_strain_variable = 2, "):
        umat(library, plastic_strain_variable=2)
    with pytest.raises(mpm.InputError, match="p_wave_modulus = 0, "):
        umat(library, p_wave_modulus=0.0)
    with pytest.raises(mpm.InputError, match="properties = nan, but it must be finite"):
        umat(library, properties=[np.nan])
    with pytest.raises(mpm.InputError, match="law is 3, which has no n_state"):
        mpm.PythonLaw(3)
    broken = Broken(None)
    broken.n_state = 0
    with pytest.raises(mpm.InputError, match="n_state 0, expected at least 1"):
        mpm.PythonLaw(broken)


def test_a_umat_has_its_named_properties_reduced(library):
    named = {3: "strength", 1: "friction angle", 2: "dilation angle"}  # of which the law knows nothing: numbers only
    law = umat(library, properties=[30.0, 20.0, STRENGTH], strength_parameters=named)
    assert law.strength_parameters == named and "friction angle" in repr(law)
    angle = np.degrees(np.arctan(np.tan(np.radians(30.0)) / 2))
    weak = bridge.reduced_strength(law, 2.0)
    assert weak.properties == pytest.approx([angle, angle, STRENGTH / 2], rel=1e-14)
    assert weak.strength_parameters == named and law.properties == [30.0, 20.0, STRENGTH]
    fraction = np.tan(np.radians(20.0)) / np.tan(np.radians(30.0))  # on which depends how strains are averaged
    assert _core.associated_fraction(law) == pytest.approx(fraction, rel=1e-14)
    assert _core.associated_fraction(weak) == 1 and np.isnan(_core.associated_fraction(umat(library)))


def test_a_umat_yields_at_its_reduced_strength(library):
    stress, strain = random_points(2, 400, pressure=50e3, deviator=10e3, strain=1e-3)
    weak = bridge.reduced_strength(umat(library, strength_parameters={3: "strength"}), 1.5)
    native = mpm.von_mises(young=YOUNG, poisson=POISSON, yield_stress=STRENGTH / 1.5)
    here, there = Batch(weak, stress, strain), Batch(native, stress, strain)
    assert 100 < there.report.plastic and np.abs(here.stress - there.stress).max() < 1e-9 * 50e3


@pytest.mark.parametrize(
    ("named", "words"),
    [
        ({4: "strength"}, "strength_parameters = 4, but it must be the number of one of the properties"),
        ({0: "strength"}, "strength_parameters = 0, "),
        ({3: "yield"}, "names 'yield', expected 'strength'"),
        ({3: 2.0}, "strength_parameters of Umat is {3: 2.0}, expected a dictionary of numbers of properties"),
        ([3], r"strength_parameters of Umat is \[3\], expected a dictionary"),
    ],
)
def test_properties_that_are_named_wrongly_are_refused(library, named, words):
    with pytest.raises(mpm.InputError, match=words):
        umat(library, strength_parameters=named)
