"""The beam of the verification case elastica, half of which begins with resting cells."""

import importlib
import sys
from pathlib import Path

import numpy as np
import pytest

VERIFICATION = Path(__file__).parents[3] / "studies" / "verification"


@pytest.fixture
def case(monkeypatch):
    monkeypatch.syspath_prepend(str(VERIFICATION))
    monkeypatch.syspath_prepend(str(VERIFICATION.parent))
    yield importlib.import_module("elastica")
    for name in ("elastica", "_case", "_plots", "_moving_mesh"):
        sys.modules.pop(name, None)


def deflection_error(case, resting_part):
    """Of the tip across the beam; and the cells that rest at first and in the end."""
    beam = case.Beam(4, False)
    model = beam.model
    loaded = np.sort(model.particles.id)[beam.tip]  # particles that come from resting cells have the numbers of before
    at_first = model.rest(where=lambda x: x[:, 0] < resting_part) if resting_part else 0
    for step in range(1, case.STEPS + 1):
        load = case.LOADS[-1] * step / case.STEPS
        traction = np.zeros((len(model.particles), 2))
        carries = np.isin(model.particles.id, loaded)
        traction[carries, 1] = -load * case.BENDING / beam.arm**2 / len(loaded)
        model.particles.set("traction", traction)
        report = model.implicit(model.time + 1.0, dt=1.0, quasi_static=True).last()
    moved = -model.particles.displacement[np.isin(model.particles.id, loaded), 1].mean() / beam.arm
    expected = case.elastica(case.LOADS[-1])(1.0)[3]
    return abs(moved / expected - 1), at_first, report.resting_cells


def test_a_beam_that_begins_with_resting_cells_bends_no_worse_than_one_of_particles(case):
    alone, *_ = deflection_error(case, 0.0)
    half, at_first, left = deflection_error(case, 0.5)
    assert at_first == 160 and left < 0.1 * at_first  # what bends by more than a tenth of a cell has become particles
    assert half <= alone + 1e-4 and alone < 0.02
