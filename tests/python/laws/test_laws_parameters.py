"""Each law declares its parameters once; checks, constructor, representation, help and the page in docs/ follow from it."""

import inspect
import math
from pathlib import Path

import pytest
from mpm_core.law_parameters import parameter_page

import mpm_core as mpm
from mpm_core import _core

SOIL = mpm.MohrCoulomb(young=1e7, poisson=0.3, cohesion=1e4, friction_angle=30.0)
PARTS = {
    "SofteningMohrCoulomb": {"peak": SOIL},
    "Heterogeneous": {"law": SOIL, "varying": ["cohesion"]},
    "Hencky": {"law": SOIL},
    "Undrained": {"skeleton": SOIL},
}
RELATED = {"HardeningSoil": {"oedometer_modulus": 0.5, "small_strain_modulus": 2.0}}
"""Values that others of the same law bound"""
CODE = {"PythonLaw", "Umat"}
"""Laws that call code of the user; what they need is tested with them."""
LAWS = [law for law in _core.law_types if law.__name__ not in CODE]


def numbers(law):
    return [p for p in law.parameters if p.unit is not None]


def allowed(law):
    """Values of the numbers of a law, each in its range: the middle, or 1 above or below its one bound."""
    values = {}
    for p in numbers(law):
        low, high = p.lower, p.upper
        if p.range.startswith(("in [0, ", "in (0, ")) and high is None:
            values[p.name] = 0.0  # up to another parameter
        elif low is not None and high is not None:
            values[p.name] = 0.5 * (low + high)
        else:
            values[p.name] = 1.0 if low == 0 else 2.0 if low is None else low + 1.0
    return values | RELATED.get(law.__name__, {})


def outside(p):
    """Values that a parameter must not have."""
    step = 1.0
    refused = [math.nan]
    if p.lower is not None:
        refused += [p.lower - step] + ([] if p.lower_included else [p.lower])
    if p.upper is not None:
        refused += [p.upper + step] + ([] if p.upper_included else [p.upper])
    elif not p.upper_included:
        refused.append(math.inf)
    return refused


@pytest.fixture(params=LAWS, ids=lambda law: law.__name__)
def law(request):
    return request.param


def test_every_law_takes_what_it_declares(law):
    parts, values = PARTS.get(law.__name__, {}), allowed(law)
    made = law(**parts, **values)
    for name, value in values.items():
        assert getattr(made, name) == value
    assert made == law(**parts, **values)
    needed = {p.name: values[p.name] for p in numbers(law) if p.needed}
    standard = law(**parts, **needed)
    for p in numbers(law):
        if not p.needed:
            assert getattr(standard, p.name) == (math.inf if p.default is None else p.default)


def test_every_value_outside_a_range_is_refused_by_name_value_and_range(law):
    parts, values = PARTS.get(law.__name__, {}), allowed(law)
    for p in numbers(law):
        for value in outside(p):
            with pytest.raises(mpm.InputError) as error:
                law(**parts, **{**values, p.name: value})
            assert str(error.value).startswith(f"{p.name} = ")
            assert f"but it must be {p.range}" in str(error.value)


def test_every_parameter_that_is_missing_unknown_or_no_number_is_named(law):
    parts, values = PARTS.get(law.__name__, {}), allowed(law)
    for p in law.parameters:
        given = {name: value for name, value in {**parts, **values}.items() if name != p.name}
        if p.needed:
            with pytest.raises(mpm.InputError, match=f"^{law.__name__} lacks {p.name}"):
                law(**given)
        if p.unit is not None:
            with pytest.raises(mpm.InputError, match=f"^{p.name} of {law.__name__} is 'soft', expected a number"):
                law(**given, **{p.name: "soft"})
    with pytest.raises(mpm.InputError, match=f"^tilt is no parameter of {law.__name__}"):
        law(**parts, **values, tilt=1.0)


def test_every_parameter_is_in_help_signature_and_representation(law):
    made = law(**PARTS.get(law.__name__, {}), **allowed(law))
    for p in law.parameters:
        unit = f" [{p.unit}], {p.range}" if p.unit is not None else ""
        assert f"{p.name}: {p.meaning}{unit}" in law.__doc__
        default = inspect.signature(law).parameters[p.name].default
        assert default == (inspect.Parameter.empty if p.needed else p.default)
        assert f"{p.name}=" in repr(made)
    assert repr(SOIL).startswith(
        "MohrCoulomb(young=1e+07 Pa, poisson=0.3, cohesion=10000 Pa, friction_angle=30 degrees,"
    )


def test_a_bound_that_is_another_parameter_holds():
    with pytest.raises(
        mpm.InputError,
        match=r"^dilation_angle = 31, but it must be in \[0, friction_angle\] \[degrees\]; friction_angle is 30$",
    ):
        mpm.MohrCoulomb(young=1e7, poisson=0.3, cohesion=1e4, friction_angle=30.0, dilation_angle=31.0)
    clay = allowed(mpm.CamClay)
    with pytest.raises(
        mpm.InputError, match="^compression = 0.5, but it must be above swelling and finite; swelling is 0.5$"
    ):
        mpm.CamClay(**{**clay, "swelling": 0.5, "compression": 0.5})


def test_options_of_studies_have_the_ranges_that_laws_declare():
    import argparse

    from studies.common.soils import add_parameter

    for law in LAWS:
        for p in numbers(law):
            parser = argparse.ArgumentParser()
            add_parameter(parser, law, p.name, None)
            option, values = "--" + p.name.replace("_", "-"), allowed(law)
            assert vars(parser.parse_args([option, repr(values[p.name])]))[p.name] == values[p.name]
            help_text = " ".join(parser.format_help().split())
            assert p.meaning.split()[0] in help_text and (p.unit == "-" or f"[{p.unit}]" in help_text)
            for value in (v for v in outside(p) if math.isfinite(v)):
                with pytest.raises(SystemExit):
                    parser.parse_args([f"{option}={value!r}"])


def test_the_page_of_the_documentation_is_up_to_date():
    page = Path(__file__).parents[3] / "docs/api/law_parameters.md"
    assert page.read_text(encoding="utf-8") == parameter_page()
