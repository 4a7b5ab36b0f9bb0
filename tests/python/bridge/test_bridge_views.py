"""How a notebook shows finite elements and their results: in a line or two, with sizes and units."""

import inspect

import mpm_core.output
import mpm_core.probes
import numpy as np
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water

SOIL = mpm.MohrCoulomb(young=20e6, poisson=0.3, cohesion=5e3, friction_angle=20.0)
SUPPORTS = [bridge.roller(bridge.LEFT, (1, 0)), bridge.fixed(bridge.BASE)]


def slope():
    domain, cells, facets = bridge.slope_mesh(
        MPI.COMM_SELF, height=1.0, angle=45.0, crest=1.0, cell_size=0.5, kind="fitted"
    )
    return bridge.soil_mesh(domain, cells, facets, tag=bridge.SOIL)


def test_finite_elements_show_their_size_load_and_laws():
    body, _, facets = slope()
    cells = body.topology.index_map(2).size_local
    fem = bridge.QuasiStatic(body, SOIL, facets, SUPPORTS, degree=1)
    assert repr(fem).startswith(
        f"<QuasiStatic: plane strain, {cells} triangles, displacement of degree 1, Load(), not in"
    )
    steps = fem.solve(bridge.Load(unit_weight=20e3))
    assert "Load(unit_weight=20000.0 N/m3), in equilibrium\n" in repr(fem) and repr(SOIL) in repr(fem)
    last = steps[-1].report
    assert repr(last) == (f"<EquilibriumReport: equilibrium after {last.iterations} linear systems, out-of-balance ratio "
                          f"{last.residuals[-1]:.2g}>")  # fmt: skip
    assert repr(steps[-1]).startswith(f"<LoadStep {len(steps)}: to 1 by ")


def test_a_collapse_shows_numbers_and_no_arrays():
    body, _, facets = slope()
    fem = bridge.QuasiStatic(body, SOIL, facets, SUPPORTS, degree=1, solver=bridge.PRACTICE)
    fem.solve(bridge.Load(unit_weight=20e3))
    found = bridge.collapse_load(fem, lambda weight: bridge.Load(unit_weight=weight), 60e3, start=20e3, tolerance=0.2)
    text = repr(found)
    assert text.startswith(f"<Collapse: {found.value:.6g} at the last equilibrium") and f"{found.failed_at:.6g}" in text
    assert "array" not in text and len(text) < 250


def test_seepage_and_consolidation_show_their_time():
    body, _, facets = slope()
    sand = water.PorousSoil(conductivity=1e-5, retention=water.AlwaysSaturated())
    head = water.Head(bridge.LEFT, 2.0)
    flow = water.Seepage(body, sand, facets, [head])
    assert "Seepage: " in repr(flow) and "t = 0 s" in repr(flow) and repr(head) in repr(flow)
    consolidation = water.Consolidation(body, SOIL, sand, facets, SUPPORTS, [head])
    assert "Consolidation: plane strain" in repr(consolidation) and repr(SOIL) in repr(consolidation)
    report = consolidation.advance(60.0)
    assert repr(report) == f"<ConsolidationReport: t = 60 s, step of 60 s, {report.iterations} iterations>"
    assert np.isfinite(report.residuals).all()


def test_a_hand_over_and_far_ground_show_ratios_and_sizes():
    body, cells, facets = slope()
    fem = bridge.QuasiStatic(body, SOIL, facets, SUPPORTS, degree=1)
    fem.solve(bridge.Load(unit_weight=20e3))
    model = mpm.Model(bridge.background_mesh(body, cells, facets), SOIL)
    model.seed(density=20e3 / 9.81, per_cell=3)
    model.roller(bridge.LEFT, normal=(1, 0))
    model.fix(bridge.BASE)
    model.set_gravity((0.0, -9.81))
    found = bridge.initialise(model, fem)
    assert repr(found).startswith(f"<Handover: out-of-balance ratio {found.unbalanced_ratio:.2g}, ")
    assert f"{found.yielded_fraction:.2%} newly yielded>" in repr(found)
    far = bridge.FarField(
        body, facets, border=bridge.LEFT, supports=[bridge.fixed(bridge.BASE)], young=1e9, poisson=0.3
    )
    assert "triangles, displacement of degree 2, linear elastic, E = 1e+09 Pa" in repr(far)
    assert f"border of {len(far.nodes)} nodes with {len(far.stiffness)} degrees of freedom" in repr(far)


def test_every_public_class_says_what_it_is():
    default = []
    for module in (mpm, mpm_core.output, mpm_core.probes, bridge, water):
        for name, one in inspect.getmembers(module, inspect.isclass):
            shown = getattr(one.__repr__, "__qualname__", "")
            own = one.__module__.startswith(("mpm_core", "fenics_bridge")) and not issubclass(one, BaseException)
            if own and not name.startswith("_") and shown.startswith(("object.", "pybind11_object.")):
                default.append(name)
    assert sorted(set(default) - {"Series", "Probe"}) == []  # the inside of an output, and a protocol
