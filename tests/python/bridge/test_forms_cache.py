"""Forms whose compilation a killed run has broken off: the file that it left is named, and after some time it is removed."""

import os
import subprocess
import sys
import time

import pytest
import ufl
from dolfinx import fem
from dolfinx.mesh import create_unit_square
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge.forms import ABANDONED


def area(cache):
    """Area of a square by a form that is compiled in a cache of its own."""
    domain = create_unit_square(MPI.COMM_SELF, 1, 1)
    form = fem.form(fem.Constant(domain, 1.0) * ufl.dx, jit_params={"cache_dir": cache, "timeout": 1})
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


LOADED = """
import sys
import mpm_core as mpm
from mpi4py import MPI
import fenics_bridge as bridge
domain, _, facet_tags = bridge.soil_mesh(*bridge.slope_mesh(MPI.COMM_SELF, height=1.0, angle=45.0, crest=1.0, cell_size=0.5))
law = mpm.LinearElastic(young=1e6, poisson=0.3)
model = bridge.QuasiStatic(domain, law, facet_tags, [bridge.fixed(bridge.BASE)])
tags = [int(tag) for tag in sys.argv[1:]]
model.solve(bridge.Load(1e4, dict.fromkeys(tags, 1e3), traction={tag: (1e2, 0.0) for tag in tags}))
"""


def test_a_form_is_compiled_once_for_all_tags(tmp_path):
    """The tags' numbers are not part of the forms, and a second run finds what the first compiled."""
    environment = {**os.environ, "XDG_CACHE_HOME": str(tmp_path)}
    compiled = []
    for tags in ((bridge.SLOPE,), (bridge.SLOPE,), (bridge.CREST, bridge.LEFT)):
        tags = [str(tag) for tag in tags]
        subprocess.run([sys.executable, "-c", LOADED, *tags], timeout=240, check=True, env=environment)
        compiled.append({path.name for path in (tmp_path / "fenics").glob("libffcx_*.c")})
    assert compiled[0] and compiled[1] == compiled[0] == compiled[2]
