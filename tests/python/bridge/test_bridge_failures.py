"""What is said of a body without equilibrium: load, place, soil, law and what to try."""

import re

import numpy as np
import pytest
from dolfinx import mesh
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

BODY, _, FACETS = bridge.soil_mesh(*bridge.slope_mesh(MPI.COMM_WORLD, crest=1.0, cell_size=0.25))
HELD = [bridge.roller(bridge.LEFT, (1, 0)), bridge.fixed(bridge.BASE)]
WEIGHT = bridge.Load(unit_weight=20e3)


def soil(cohesion=1e3, friction_angle=25.0, **options):
    return mpm.MohrCoulomb(young=20e6, poisson=0.3, cohesion=cohesion, friction_angle=friction_angle, **options)


def failed_step(law, supports, load):
    """The last attempted step without equilibrium on the way to a load that is not reached."""
    fem = bridge.QuasiStatic(BODY, law, FACETS, supports)
    steps = fem.solve(load, tolerance=0.02)
    assert not fem.converged
    return next(step for step in reversed(steps) if not step.converged)


@pytest.mark.parametrize(
    ("law", "supports", "load", "outcome", "advice"),
    [
        (soil(), HELD[:1], WEIGHT, "undecided", "against moving along y: give it supports"),
        (soil(), [bridge.roller(bridge.BASE, (0, 1))], WEIGHT, "failure", "against moving along x: give it supports"),
        (soil(), HELD, bridge.Load(unit_weight=80e3), "failure", "take less load, more strength or more support"),
        (soil(0.0), HELD, WEIGHT, "failure", "has no cohesion, .* carries hardly anything"),
        (soil(0.0, 0.0), HELD, WEIGHT, "failure", "has no strength there: give it cohesion or a friction angle"),
        (soil(tension_cutoff=0.0), HELD, bridge.Load(pressure={bridge.SLOPE: -20e3}), "failure", "comes under tension there"),
    ],
    ids=["nothing below", "frictionless base", "above collapse", "no cohesion", "no strength", "pulled"],
)  # fmt: skip
def test_a_failure_names_load_place_law_and_what_to_try(law, supports, load, outcome, advice):
    report = failed_step(law, supports, load).report
    assert report.outcome == outcome and re.search(advice, report.reason)
    weight, place = (
        re.search(pattern, report.reason)
        for pattern in (r"under (?:unit weight|pressure) (\S+) (?:N/m3|Pa)",
                        r"near \((\S+), (\S+)\) m, which follows the law MohrCoulomb")
    )  # fmt: skip
    assert 0 < abs(float(weight[1])) <= 80e3
    x, y = map(float, place.groups())
    assert -1e-3 <= x <= 2 and -1e-3 <= y <= 1


def test_the_load_that_is_named_is_above_the_last_one_carried():
    fem = bridge.QuasiStatic(BODY, soil(), FACETS, HELD)
    with pytest.warns(RuntimeWarning, match="the load was not reached") as warned:
        steps = fem.solve(bridge.Load(unit_weight=80e3), tolerance=0.02)
    failed = min(step.value for step in steps if not step.converged)
    reached = max(step.value for step in steps if step.converged)
    assert f"{reached:.3%} of the way" in str(warned[0].message) and f"at {failed:.3%}" in str(warned[0].message)
    named = [re.search(r"under unit weight (\S+) N/m3", step.report.reason) for step in steps if step.value == failed]
    assert float(named[0][1]) == pytest.approx(80e3 * failed, rel=1e-4) and fem.load.unit_weight < 80e3 * failed


def test_a_soil_is_named_by_its_mesh():
    tags = bridge.name_tags(mesh_tags(), {"fill": 1})
    fem = bridge.QuasiStatic(BODY, {"fill": soil()}, FACETS, HELD, cell_tags=tags)
    steps = fem.solve(bridge.Load(unit_weight={"fill": 80e3}), tolerance=0.1)
    reason = next(step.report.reason for step in steps if not step.converged)
    assert re.search(r"under unit weight \S+ N/m3 of 'fill'; most moved the soil 'fill' near", reason)


def mesh_tags():
    cells = BODY.topology.index_map(2)
    every = np.arange(cells.size_local + cells.num_ghosts, dtype=np.int32)
    return mesh.meshtags(BODY, 2, every, np.ones_like(every))


def test_the_classes_of_a_soil_have_its_name_in_messages():
    domain, cell_tags, facet_tags = bridge.slope_mesh(MPI.COMM_WORLD, crest=1.0, cell_size=0.25)
    body, tags, facets = bridge.soil_mesh(domain, cell_tags, facet_tags)
    tags, heights = bridge.graded_tags(body, bridge.name_tags(tags, {"clay": bridge.SOIL}), "clay", lambda x: x[:, 1])
    laws = {tag: soil(cohesion=1e3 + 100 * height) for tag, height in heights.items()}
    fem = bridge.QuasiStatic(body, laws, facets, HELD, cell_tags=tags)
    with pytest.warns(RuntimeWarning) as warned:
        fem.solve(bridge.Load(unit_weight={"clay": 200e3}), tolerance=0.02)
    texts = [str(one.message) for one in warned]
    assert any(text.startswith("the unit weight of 'clay' is 2e+05 N/m3") for text in texts)
    reason = next(text for text in texts if "the load was not reached" in text)
    assert re.search(r"under unit weight \S+ N/m3 of 'clay'; most moved the soil 'clay' near", reason), reason
