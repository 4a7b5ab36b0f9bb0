"""Linear elements without averaged strains say that they lock, and only where they do."""

import re
import warnings

import pytest
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

CLAY = mpm.tresca(young=1e6, poisson=0.3, shear_strength=5e3)
SUPPORTS = [bridge.roller(bridge.LEFT, (1, 0)), bridge.fixed(bridge.BASE)]


def sand(dilation_angle):
    return mpm.MohrCoulomb(young=20e6, poisson=0.3, cohesion=5e3, friction_angle=20.0, dilation_angle=dilation_angle)


def said(law, to_collapse=False, **options):
    """Texts of the warnings of a new model, or of the search for its collapse load alone."""
    domain, cells, facets = bridge.slope_mesh(
        MPI.COMM_SELF, height=1.0, angle=45.0, crest=1.0, cell_size=0.5, kind="fitted"
    )
    body, _, facets = bridge.soil_mesh(domain, cells, facets, tag=bridge.SOIL)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        fem = bridge.QuasiStatic(body, law, facets, SUPPORTS, **options)
        if to_collapse:
            caught.clear()
            bridge.collapse_load(fem, lambda weight: bridge.Load(unit_weight=weight), 20e3, tolerance=0.3)
    return [
        str(each.message) for each in caught if "linear" in str(each.message) and "cells high" not in str(each.message)
    ]


@pytest.mark.parametrize(
    "law, reason",
    [
        (CLAY, "friction angle 0"),
        (mpm.LinearElastic(young=1e6, poisson=0.49), "Poisson's ratio 0.49"),
        (mpm.Undrained(sand(0.0), water_modulus=1e8, porosity=0.4), "undrained"),
    ],
)
def test_a_soil_that_keeps_its_volume_is_named(law, reason):
    (text,) = said(law, degree=1)
    assert reason in text and "nmd=True" in text
    assert said(law, degree=1, nmd=True) == said(law, degree=2) == said(sand(0.0), degree=1) == []


def test_a_soil_that_keeps_its_volume_as_it_fails_is_named_before_its_collapse():
    (text,) = said(sand(0.0), to_collapse=True, degree=1)
    assert "dilation angle" in text
    for dilation_angle, options in ((20.0, {"degree": 1}), (0.0, {"degree": 1, "nmd": True})):
        assert said(sand(dilation_angle), to_collapse=True, **options) == []


@pytest.mark.parametrize("reduce, words", [(bridge.reduced_strength, 1), (bridge.davis_reduced_strength, 0)])
def test_a_factor_with_associated_flow_does_not_lock(reduce, words):
    # Davis's strength dilates by its own friction angle, whatever the dilation angle of the soil.
    domain, cells, facets = bridge.slope_mesh(
        MPI.COMM_SELF, height=1.0, angle=45.0, crest=1.0, cell_size=0.5, kind="fitted"
    )
    body, _, facets = bridge.soil_mesh(domain, cells, facets, tag=bridge.SOIL)
    fem = bridge.QuasiStatic(body, sand(0.0), facets, SUPPORTS, degree=1)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        bridge.factor_of_safety(fem, bridge.Load(unit_weight=20e3), tolerance=0.3, reduce=reduce)
    assert sum("dilation angle" in str(each.message) for each in caught) == words


@pytest.mark.parametrize("cell, options, few", [(1.0, {"degree": 1, "nmd": True}, True), (0.5, {"degree": 1, "nmd": True}, False),
                                                (1.0, {"degree": 2}, False)])  # fmt: skip
def test_a_mechanism_of_few_cells_with_averages_is_named(cell, options, few):
    # The bank of docs/fem.md, without its foundation, three and six cells high.
    domain, cells, facets = bridge.slope_mesh(
        MPI.COMM_SELF, height=3.0, angle=26.565, crest=6.0, cell_size=cell, kind="fitted", runout=1.0
    )
    body, _, facets = bridge.soil_mesh(domain, cells, facets, tag=bridge.SOIL)
    soil = mpm.MohrCoulomb(young=20e6, poisson=0.3, cohesion=2e3, friction_angle=34.0, dilation_angle=5.0)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        fem = bridge.QuasiStatic(body, soil, facets, SUPPORTS, **options)
        bridge.factor_of_safety(fem, bridge.Load(unit_weight=20e3), start=1.0, first_step=0.3, tolerance=0.02)
    texts = [str(each.message) for each in caught if "cells high" in str(each.message)]
    assert len(texts) == few
    if few:
        assert 1.0 < float(re.search(r"is ([\d.]+) cells high", texts[0]).group(1)) < 3.0
