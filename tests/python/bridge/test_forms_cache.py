"""The cache of forms: what a killed run leaves there is named and removed in time, and forms of other values are found there."""

import os
import subprocess
import sys
import time
from inspect import signature

import pytest
import ufl
from dolfinx import fem
from dolfinx.mesh import create_unit_square
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge.forms import ABANDONED

JIT_OPTIONS = next(name for name in signature(fem.form).parameters if name.startswith("jit_"))  # by version of DOLFINx


def area(cache):
    """Area of a square by a form that is compiled in a cache of its own."""
    domain = create_unit_square(MPI.COMM_SELF, 1, 1)
    form = fem.form(fem.Constant(domain, 1.0) * ufl.dx, **{JIT_OPTIONS: {"cache_dir": cache, "timeout": 1}})
    return fem.assemble_scalar(form)


@pytest.fixture
def broken_off(tmp_path):
    """A cache with the file of a form without its library, and this file."""
    assert area(tmp_path) == pytest.approx(1.0)
    (source,) = tmp_path.glob("libffcx_forms_*.c")
    for path in tmp_path.glob(f"{source.stem}.*"):
        if path != source:
            path.unlink()
    return tmp_path, source


def test_the_file_that_is_in_the_way_is_named(broken_off):
    cache, source = broken_off
    with pytest.raises(mpm.RunError, match=f"not compiled after 1 s.*remove {source}"):
        area(cache)
    assert source.exists()


def test_an_old_file_is_removed_and_the_form_compiled(broken_off):
    cache, source = broken_off
    before = time.time() - ABANDONED - 1.0
    os.utime(source, (before, before))
    assert area(cache) == pytest.approx(1.0)
    assert source.with_suffix(".c.cached").exists()


def test_a_form_that_was_loaded_is_not_looked_for_again(tmp_path):
    """A cache has thousands of files, which FFCx would list for each form."""
    for _ in ("compiled", "loaded"):
        assert area(tmp_path) == pytest.approx(1.0)
    for path in tmp_path.iterdir():
        path.unlink()
    assert area(tmp_path) == pytest.approx(1.0)
    assert not list(tmp_path.iterdir())


BODY = """
import sys
import mpm_core as mpm
from mpi4py import MPI
import fenics_bridge as bridge
from fenics_bridge import water
domain, _, facets = bridge.soil_mesh(*bridge.slope_mesh(MPI.COMM_SELF, height=1.0, angle=45.0, crest=1.0, cell_size=0.5))
law, base = mpm.LinearElastic(young=1e6, poisson=0.3), [bridge.fixed(bridge.BASE)]
"""
LOADED = """
tags = [int(tag) for tag in sys.argv[1:]]
model = bridge.QuasiStatic(domain, law, facets, base)
model.solve(bridge.Load(1e4, dict.fromkeys(tags, 1e3), traction={tag: (1e2, 0.0) for tag in tags}))
"""
WET = """
alpha, n, conductivity = map(float, sys.argv[1:])
soil = water.PorousSoil(conductivity, 0.4, 1e-7, water.VanGenuchten(alpha, n, n / 10))
outside = [water.Reservoir(bridge.LEFT, 0.8), water.SeepageFace(bridge.SLOPE)]
flow = water.Seepage(domain, soil, facets, outside)
flow.solve()
assert flow.advance(60.0)
body = water.Consolidation(domain, law, soil, facets, base, outside, bridge.Load(2e4), water.Element.STABILISED)
body.initialise(pore_pressure=flow.pore_pressure(suction=True))
body.advance(60.0)
"""


@pytest.mark.parametrize(
    "study, arguments",
    [
        pytest.param(LOADED, [(bridge.SLOPE,), (bridge.CREST, bridge.LEFT)], id="tags"),
        pytest.param(WET, [(2e-4, 1.6, 1e-5), (3e-4, 2.3, 4e-6)], id="soils"),
    ],
)
def test_a_form_is_compiled_once_for_all_values(study, arguments, tmp_path):
    """Numbers of tags and parameters of soils are not part of the forms, and later runs find what the first compiled."""
    environment = {**os.environ, "XDG_CACHE_HOME": str(tmp_path)}
    compiled = []
    for values in arguments:
        run = [sys.executable, "-c", BODY + study, *map(str, values)]
        subprocess.run(run, timeout=240, check=True, env=environment)
        compiled.append({path.name for path in (tmp_path / "fenics").glob("libffcx_*.c")})
    assert compiled[0] and all(later == compiled[0] for later in compiled)
