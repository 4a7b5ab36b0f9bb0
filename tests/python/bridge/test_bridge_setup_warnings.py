"""Mistakes of input that finite elements would take in silence: each is said, with the way out."""

import warnings

import numpy as np
import pytest
from dolfinx.mesh import CellType, create_rectangle, locate_entities_boundary, meshtags
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water
from fenics_bridge.fem.loads import warn_of_weight

LEFT, RIGHT, BASE, TOP = 1, 2, 3, 4
HELD = [bridge.roller(LEFT, (1, 0)), bridge.roller(RIGHT, (1, 0)), bridge.fixed(BASE)]
ELASTIC = mpm.LinearElastic(young=1e7, poisson=0.3)


def body(law=ELASTIC, supports=HELD, domain=None, **options):
    domain, facet_tags = domain or bridge.box_mesh(MPI.COMM_WORLD, (2.0, 1.0), (4, 2))[::2]
    return bridge.QuasiStatic(domain, law, facet_tags, supports, **options)


def test_sound_input_says_nothing():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        body().solve(bridge.Load(unit_weight=20e3, pressure={TOP: 1e3}))
        water.VanGenuchten(alpha=15.0 / 9810, n=2.7)  # gravel
        bridge.hydrostatic(1.0)


def test_a_body_that_may_move_along_an_axis_is_named():
    model = body(supports=[bridge.roller(BASE, (0, 1))])
    with pytest.warns(RuntimeWarning, match="nothing holds the body against moving along x.*give it supports"):
        model.solve(bridge.Load(unit_weight=20e3))


def test_displacements_larger_than_the_body_are_named():
    # gamma H^2 / 2 M with M = E (1 - nu) / ((1 + nu) (1 - 2 nu)) = 26.9 Pa in place of MPa
    with pytest.warns(
        RuntimeWarning, match="largest displacement is 371 m, more than the size of the body, 2 m.*Moduli are in Pa"
    ):
        body(mpm.LinearElastic(young=20.0, poisson=0.3)).solve(bridge.Load(unit_weight=20e3))


def site(particles=False):
    domain, cell_tags, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, (2.0, 1.0), (4, 2))
    if particles:
        return bridge.ParticleSite(
            mpm.Model(bridge.background_mesh(domain, cell_tags, facet_tags), ELASTIC), {1: 0}, HELD
        )
    return bridge.FemSite(bridge.QuasiStatic(domain, ELASTIC, facet_tags, HELD, cell_tags=cell_tags))


def quadrilaterals():
    domain = create_rectangle(MPI.COMM_WORLD, [[0, 0], [1, 1]], [2, 2], CellType.quadrilateral)
    facets = locate_entities_boundary(domain, 1, lambda x: np.isclose(x[1], 0))
    return domain, meshtags(domain, 1, np.sort(facets), np.full(len(facets), BASE, np.int32))


def placed(particles=False, **stage):
    return site(particles).carry_out(bridge.Stage("a", fill=1, **{"unit_weight": {1: 20e3}, **stage}))


def without_particles():
    fem, mesh = body(), bridge.box_mesh(MPI.COMM_WORLD, (2.0, 1.0), (4, 2))
    fem.solve(bridge.Load(unit_weight=20e3))
    bridge.initialise(mpm.Model(bridge.background_mesh(*mesh), ELASTIC), fem)


def without_material():
    mesh = bridge.background_mesh(*bridge.box_mesh(MPI.COMM_WORLD, (2.0, 1.0), (4, 2)))
    bridge.ParticleSite(mpm.Model(mesh, ELASTIC), {}, HELD).carry_out(bridge.Stage("a", fill=1, unit_weight={1: 20e3}))


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (lambda: bridge.prescribed(TOP, -0.01), "displacement is -0.01, expected its components"),
        (lambda: body(supports=[bridge.prescribed(TOP, ("a", 0))]), "supports: .*'a'.* no finite number"),
        (lambda: body().solve(bridge.Load(unit_weight=[0, -20e3])), r"unit_weight is \[0, -20000.0\], expected finite numbers"),
        (lambda: body().solve(bridge.Load(pressure={TOP: (0, 5e3)})), r"pressure is \(0, 5000.0\), expected finite numbers"),
        (lambda: placed(unit_weight=20e3), "stage 'a': unit_weight is 20000.0, expected a dictionary by soil"),
        (lambda: placed(support="base"), "stage 'a': support is 'base', expected what `fixed`"),
        (lambda: placed(stress=np.zeros((8, 4))), "(?s)stage 'a': stress is .*, expected a function of positions"),
        (lambda: placed(pore_pressure=lambda x: x), r"pore_pressure gives values of shape \(15, 2\), expected \(15,\)"),
        (lambda: placed(True, pore_pressure=lambda x: x), r"pore_pressure gives values of shape \(15, 2\)"),
        (lambda: placed(True, stress=lambda x: x), r"stress has shape \(48, 2\), expected finite \(48, 4\)"),
        (without_material, "materials has no law for the soil 1, expected one"),
        (lambda: list(bridge.carry_out(site(), bridge.Stage("a"))), "site is a FemSite and stages a Stage, expected"),
        (lambda: list(bridge.carry_out(body(), [])), "site is a QuasiStatic and stages a list, expected"),
        (lambda: body(domain=quadrilaterals()), "cells of the kind quadrilateral in 2 dimensions, expected triangles"),
        (without_particles, "model has no particles, expected some"),
    ],
)  # fmt: skip
def test_values_of_another_kind_are_errors_that_name_them(wrong, words):
    with pytest.raises(mpm.InputError, match=words):
        wrong()


def test_displacements_that_a_load_leaves_out_are_named():
    """Also where a later load would take them back; with displacement=1 the top moves, and nothing is said."""
    model = body(supports=[*HELD, bridge.prescribed(TOP, (None, -0.01))])
    words = r"displacement of the load is 0, so that .*facet_tag=4.* is held at zero; Load\(displacement=1.0\)"
    with pytest.warns(RuntimeWarning, match=words):
        model.solve(bridge.Load(unit_weight=20e3))
    top, moved = [[1.0, 1.0]], {"displacement": 1.0}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        model.solve(bridge.Load(unit_weight=20e3, **moved))
        assert model.evaluate_at(top)["displacement"][0, 1] == pytest.approx(-0.01)
    with pytest.warns(RuntimeWarning, match=words):
        model.solve(bridge.Load(unit_weight=18e3))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (
            lambda: body(mpm.MohrCoulomb(young=1e7, poisson=0.3, cohesion=1e3, friction_angle=0.52)),
            "friction angle is 0.52 degrees; .* 0.52 rad are 29.8 degrees",
        ),
        (lambda: body().solve(bridge.Load(unit_weight=-20e3)), "unit weight is -2e.04 N/m3, so that it acts upwards"),
        (lambda: bridge.hydrostatic(1.0, 9.81), "unit weight of water is 9.81 N/m3; unit weights are in N/m3"),
        (lambda: water.VanGenuchten(alpha=1.5, n=2.0), r"alpha is 1.5 1/Pa.* a value in 1/m .*\(0.000153 1/Pa\)"),
        (lambda: water.Gardner(alpha=0.2), "alpha is 0.2 1/Pa, so that soil dries at a suction of 5 Pa"),
    ],
)
def test_other_units_and_directions_are_named(make, words):
    with pytest.warns(RuntimeWarning, match=words):
        make()


@pytest.mark.parametrize("weight", [20.0, 18e3 * 9.81, 20e6])  # in kN/m3, taken for a density, in mN/m3
def test_unit_weights_that_no_soil_has_are_named(weight):
    with pytest.warns(RuntimeWarning, match=r"unit weight is .* 20e3 for most soils, and n times that in a centrifuge"):
        body().solve(bridge.Load(unit_weight=weight))


def test_a_unit_weight_of_a_centrifuge_is_one():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        body().solve(bridge.Load(unit_weight=50 * 18e3))


@pytest.mark.parametrize(
    ("load", "words"),
    [
        ({"traction": {TOP: 1e3}}, "traction is 1000.0, expected 2 finite numbers"),
        ({"traction": (0.0, 1e3)}, r"traction is \(0.0, 1000.0\), expected a dictionary by facet tag or name"),
        ({"pressure": 1e3}, "pressure is 1000.0, expected a dictionary by facet tag or name"),
        ({"unit_weight": "20e3"}, "unit_weight is '20e3', expected finite numbers"),
        ({"pressure": {TOP: None}}, "pressure is None, expected finite numbers"),
    ],
)
def test_loads_of_another_kind_are_refused(load, words):
    with pytest.raises(bridge.InputError, match=words):
        body().solve(bridge.Load(**load))


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: body(supports=bridge.fixed(BASE)), r"supports is Support\(facet_tag=3.*expected a list"),
        (lambda: body([ELASTIC, ELASTIC]), r"law is \[.*expected a law such as MohrCoulomb"),
        (lambda: body("clay"), "law is 'clay', expected a law"),
        (lambda: body(solver="newton"), "solver is 'newton', expected a Solver, or None"),
        (lambda: body().solve(20e3), "load is 20000.0, expected a Load"),
        (lambda: body().reconfigure(pore_pressure=1e4), "pore_pressure is 10000.0, expected a function of positions"),
        (lambda: flow(water.Head(LEFT, 1.0)), r"boundary is Head\(facet_tag=1.*expected a list of conditions"),
        (lambda: flow([water.Head(LEFT, "high")]), "level is 'high', expected a number, a function of time or a table"),
    ],
)
def test_arguments_of_another_kind_are_refused(call, words):
    with pytest.raises(bridge.InputError, match=words):
        call()


def flow(boundary):
    domain, _, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, (2.0, 1.0), (4, 2))
    return water.Seepage(domain, water.PorousSoil(1e-6), facet_tags, boundary)


def test_a_factor_of_safety_without_a_limit_says_so():
    soil = mpm.MohrCoulomb(young=1e7, poisson=0.3, cohesion=1e3, friction_angle=30.0)
    found = bridge.factor_of_safety(body(soil), bridge.Load(), first_step=1e3)
    assert np.isinf(found.failed_at) and not found.failed
    assert repr(found).startswith(f"<Collapse: no failure, in equilibrium at every value up to {found.value:.6g}")


def test_a_warning_of_the_unit_weight_names_the_soil():
    with pytest.warns(RuntimeWarning, match="unit weight of 'fill' is 19 N/m3"):
        warn_of_weight(MPI.COMM_SELF, bridge.Load(unit_weight={"ground": 20e3, "fill": 19.0}))
