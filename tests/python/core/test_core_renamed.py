"""Old names of public attributes return the new ones, with a warning at the place that uses them."""

import pytest
from core_cases import box

import fenics_bridge as bridge
import mpm_core as mpm


def old_name(owner, old):
    with pytest.warns(DeprecationWarning, match=f"{old} is now called") as caught:
        value = getattr(owner, old)
    assert caught[0].filename == __file__
    return value


def test_old_names_of_a_report_and_a_model():
    model = mpm.Model(box([1, 1]), mpm.LinearElastic(young=1e6, poisson=0.3))
    model.seed(density=2000.0, per_cell=1)
    model.repartitions = 3
    assert old_name(model, "cuts") == 3
    report = model.report()
    assert old_name(report, "plastic_share") is report.plastic_fraction
    assert old_name(report, "unexplained_share") == report.unexplained_fraction


def test_old_names_of_the_bridge():
    handover = bridge.Handover(0.1, 0.2, 0.3, 0.4)
    assert old_name(handover, "settled_ratio") == 0.2
    assert old_name(handover, "returned_share") == 0.3
    assert old_name(handover, "yielded_share") == 0.4
    assert old_name(bridge.StageError("no equilibrium", 0.5), "share") == 0.5
