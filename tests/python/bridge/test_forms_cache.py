"""Forms whose compilation a killed run has broken off: the file that it left is named, and after some time it is removed."""

import os
import time

import pytest
import ufl
from dolfinx import fem
from dolfinx.mesh import create_unit_square
from mpi4py import MPI

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
