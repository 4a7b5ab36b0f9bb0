"""Warnings of parameters of laws that are probably in other units."""

import pytest
import study_main  # noqa: F401  makes the modules of studies importable
from common.site.hardening_doubts import threshold_doubt
from common.site.law_doubts import creep_doubt
from common.site.laws import unit_doubt
from hardening_soil_cases import sand, small_strain_sand

import mpm_core as mpm


def clay(**changes):
    return mpm.CamClay(**{
        "compression": 0.26, "swelling": 0.04, "critical_slope": 1.0, "poisson": 0.2, "preconsolidation": 50e3, "void_ratio": 1.6, "creep": 0.01,
        **changes,
    })  # fmt: skip


@pytest.mark.parametrize("law", [clay(creep=0.06), mpm.Undrained(clay(creep=2.0), porosity=0.6)])
def test_creep_above_that_of_peat_is_doubted(law):
    """C_alpha / Cc is at most 0.1 (Mesri and Godlewski 1977)."""
    assert "soils.clay: creep is" in creep_doubt(law, "soils.clay")


def test_a_reference_time_in_days_is_doubted():
    assert "clay: reference_time is 1 s, expected how long" in creep_doubt(clay(reference_time=1.0), "clay")


def test_a_threshold_strain_in_percent_is_doubted():
    assert "sand: threshold_strain is 0.01, a fraction: 0.01 % are 0.0001" in threshold_doubt(
        small_strain_sand(threshold_strain=0.01), "sand"
    )


def test_a_preconsolidation_pressure_in_kpa_is_doubted():
    assert "clay: preconsolidation is 150 Pa, which hardly any soil has" in unit_doubt(
        {"preconsolidation": 150}, "clay"
    )


@pytest.mark.parametrize("law", [clay(), clay(creep=0.026), clay(creep=0.0, reference_time=1.0), sand(threshold_strain=0.01),
                                 small_strain_sand(threshold_strain=5e-4), mpm.LinearElastic(young=1e6, poisson=0.3)])  # fmt: skip
def test_usual_values_and_those_without_effect_are_not_doubted(law):
    assert creep_doubt(law, "soil") == "" and threshold_doubt(law, "soil") == ""
