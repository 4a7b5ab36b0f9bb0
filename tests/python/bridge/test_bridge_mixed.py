"""Quasi-static Taylor-Hood elements: elastic as the mixed elastic solution, plastic up to collapse without locking."""

import numpy as np
import pytest
from bridge_cases import MESHES
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm


def read(name, divisions):
    domain, _, facet_tags = bridge.read_mesh(
        MESHES / f"{name}.geo", MPI.COMM_WORLD, parameters={"divisions": divisions}
    )
    return domain, facet_tags


def soil(**other):
    return mpm.MohrCoulomb(**{"young": 1e5, "poisson": 0.4999, "cohesion": 1.0, "friction_angle": 0.0} | other)


def test_elastic_body_moves_as_in_the_elastic_solution():
    domain, facet_tags = read("bank", 4)
    supports = [bridge.roller(1, (1, 0)), bridge.fixed(2)]
    model = bridge.MixedQuasiStatic(domain, mpm.LinearElastic(young=2e5, poisson=0.499), facet_tags, supports)
    assert model.equilibrate(bridge.Load(unit_weight=20e3)).converged
    expected = bridge.solve_nearly_incompressible(domain, facet_tags, supports, 2e5, 0.499, 20e3)
    points = np.array([[1.1, 1.0], [0.5, 0.5], [1.9, 0.1]])
    here, there = model.evaluate_at(points)["displacement"], expected.evaluate_at(points)["displacement"]
    assert here == pytest.approx(there, rel=2e-3, abs=1e-3 * np.abs(there).max())
    # Both take the volume lost by an unknown of its own, but weigh it with another modulus.
    mean = expected.evaluate_at(points)["stress"][:, :3].mean(axis=1)
    assert model.pressure_at(points) == pytest.approx(-mean, rel=1e-2, abs=2e-2 * np.abs(mean).max())


def test_weight_goes_to_the_base():
    domain, facet_tags = read("bank", 4)
    model = bridge.MixedQuasiStatic(domain, soil(), facet_tags, [bridge.roller(1, (1, 0)), bridge.fixed(2)])
    model.equilibrate(bridge.Load(unit_weight=3.0))
    area = 0.5 * (1.1 + 2.1)
    assert model.reaction(2)[1] == pytest.approx(-3.0 * area, rel=1e-6)


def pressed_in(divisions):
    """Undrained ground below a rigid footing that moves into it."""
    domain, facet_tags = read("ground", divisions)
    supports = [bridge.roller(1, (1, 0)), bridge.roller(3, (1, 0)), bridge.fixed(2), bridge.prescribed(5, (0, -4e-4))]
    return bridge.MixedQuasiStatic(domain, soil(poisson=0.49), facet_tags, supports)


def test_undrained_ground_yields_below_a_footing_where_prandtl_says():
    """(2 + pi) c, from above as the mesh is refined; the pressure stays as the rigid footing is pressed in further."""
    found = []
    for divisions in (2, 4):
        model = pressed_in(divisions)
        found.append([])
        for share in (0.5, 1.0):
            model.solve(bridge.Load(displacement=share), first_step=0.25)
            assert model.converged
            found[-1].append(model.reaction(5)[1])
    assert found[0][1] > found[1][1] > 2 + np.pi
    assert found[1][1] == pytest.approx(2 + np.pi, rel=0.06)
    assert found[1][1] == pytest.approx(found[1][0], rel=0.01)


@pytest.mark.parametrize("steps", [1, 2, 3])
def test_a_footing_that_is_pushed_far_feels_the_same_in_few_steps(steps):
    """The pressure at collapse does not depend on the way there: a step too long for Newton's method is divided."""
    few, many = pressed_in(2), pressed_in(2)
    for model, number in ((few, steps), (many, 16)):
        for k in range(number):
            assert model.equilibrate(bridge.Load(displacement=(k + 1) / number)).converged
    assert few.reaction(5)[1] == pytest.approx(many.reaction(5)[1], rel=1e-3)


def test_a_divided_step_reports_the_displacement_of_all_of_it():
    model = pressed_in(2)
    report = model.equilibrate(bridge.Load(displacement=1.0))
    assert report.relaxation is None and report.iterations > 25
    assert model.increment.x.array.min() == pytest.approx(-4e-4, rel=1e-9)


@pytest.mark.parametrize("law", [soil(friction_angle=20.0), soil(tension_cutoff=0.0),
                                 mpm.DruckerPrager(young=1e5, poisson=0.3, strength=1.0)])  # fmt: skip
def test_a_law_whose_shear_depends_on_the_mean_stress_is_refused(law):
    domain, facet_tags = read("bank", 2)
    with pytest.raises(bridge.InputError, match="law (is|has)"):
        bridge.MixedQuasiStatic(domain, law, facet_tags, [bridge.fixed(2)])
