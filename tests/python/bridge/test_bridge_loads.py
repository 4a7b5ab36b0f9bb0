"""Tractions of a load, beside its pressures."""

import warnings

import numpy as np
import pytest
from bridge_cases import POISSON, UNIT_WEIGHT, YOUNG, column, slope_model
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge.fem.loads import warn_of_weight

SHEAR_MODULUS = YOUNG / (2 * (1 + POISSON))


def layer(degree=1):
    """A block on a fixed base whose sides move only sideways: a piece of a layer that is sheared."""
    domain, facet_tags, _, _ = column(2)
    supports = [bridge.roller(tag, (0, 1)) for tag in (bridge.LEFT, bridge.SLOPE)] + [bridge.fixed(bridge.BASE)]
    law = mpm.LinearElastic(young=YOUNG, poisson=POISSON)
    return bridge.QuasiStatic(domain, law, facet_tags, supports, degree)


def column_model(dim):
    domain, facet_tags, supports, _ = column(dim)
    return bridge.QuasiStatic(domain, mpm.LinearElastic(young=YOUNG, poisson=POISSON), facet_tags, supports, 2)


@pytest.mark.parametrize("degree", [1, 2])
def test_a_sheared_layer_moves_by_the_shear_over_its_modulus(degree):
    model, shear = layer(degree), 3e3
    model.solve(bridge.Load(traction={bridge.CREST: (shear, 0.0)}))
    assert np.allclose(model.points.stress, [0, 0, 0, shear], atol=1e-8 * shear)
    x = np.array([[0.2, 0.3], [0.4, 1.0]])
    moved = model.evaluate_at(x)["displacement"]
    assert np.allclose(moved, np.column_stack([shear / SHEAR_MODULUS * x[:, 1], [0, 0]]), atol=1e-9)
    assert np.allclose(model.reaction(bridge.BASE), [0.5 * shear, 0], atol=1e-8 * shear)  # on the base, 0.5 m wide


@pytest.mark.parametrize("dim", [2, 3])
def test_a_traction_against_the_normal_is_a_pressure(dim):
    normal, tag = np.eye(dim)[-1], bridge.CREST if dim == 2 else 4
    pressed, pulled = column_model(dim), column_model(dim)
    pressed.solve(bridge.Load(UNIT_WEIGHT, {tag: 5e3}))
    pulled.solve(bridge.Load(UNIT_WEIGHT, traction={tag: -5e3 * normal}))
    assert np.allclose(pressed.points.stress, pulled.points.stress, atol=1e-8 * UNIT_WEIGHT)


def test_tractions_rise_with_a_load_between_two():
    low, high = bridge.Load(traction={"top": (1.0, 2.0)}), bridge.Load(traction={"top": (3.0, 2.0), "side": (4.0, 0.0)})
    assert low.towards(high, 0.5).traction == {"top": (2.0, 2.0), "side": (2.0, 0.0)}


@pytest.mark.parametrize(
    "traction, message",
    [
        ((1.0, 2.0, 3.0), r"traction is \(1.0, 2.0, 3.0\), expected 2 finite numbers"),
        ((1.0, float("nan")), "traction is .*nan.*, expected finite numbers"),
    ],
)
def test_wrong_tractions_are_named(traction, message):
    with pytest.raises(mpm.InputError, match=message):
        layer().solve(bridge.Load(traction={bridge.CREST: traction}))


def test_an_unknown_tag_of_a_traction_is_named():
    with pytest.raises(mpm.InputError, match="traction"):
        layer().solve(bridge.Load(traction={77: (1.0, 0.0)}))


def test_shear_on_the_crest_lowers_the_collapse_load():
    # A push towards the slope helps it down, a push away from it holds it: a sign error would swap the two
    def carried(push):
        model = slope_model(cell_size=0.2, kind="fitted", comm=MPI.COMM_WORLD)
        load = lambda weight: bridge.Load(weight, traction={bridge.CREST: (push, 0.0)})  # noqa: E731
        model.solve(load(0.0))
        return bridge.collapse_load(model, load, first_step=1e3, tolerance=0.02).value

    assert carried(500.0) < 0.98 * carried(-500.0)


@pytest.mark.parametrize("weight, is_odd", [(80.0, True), ({"soil": 18e3, 7: 20.0}, True), (18e3, False), (0.0, False)])
def test_a_unit_weight_that_no_soil_has_is_said(weight, is_odd):
    """80 N/m3 is a unit weight in another unit; an unloaded body has none."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        warn_of_weight(MPI.COMM_WORLD, bridge.Load(unit_weight=weight))
    assert [("expected from 1000 to 150000 N/m3" in str(one.message)) for one in caught] == [True] * is_odd
