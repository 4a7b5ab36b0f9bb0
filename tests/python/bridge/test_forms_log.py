"""Forms are compiled without dozens of the compiler's lines between those of the run."""

import os
import subprocess
import sys

COMPILE = """
import logging, sys, warnings
import ufl
from dolfinx.fem import form
import fenics_bridge as bridge
from fenics_bridge import compat
from mpi4py import MPI
if len(sys.argv) > 1:
    logging.getLogger("fenics_bridge.forms").addHandler(logging.FileHandler(sys.argv[1]))
domain, _, _ = bridge.slope_mesh(MPI.COMM_SELF, height=1.0, angle=45.0, crest=1.0, cell_size=0.5)
form(ufl.TestFunction(compat.function_space(domain, "DG", 0)) * ufl.dx)
logging.getLogger().setLevel(logging.INFO)
logging.info("a line of the user")
warnings.warn("a warning of the user")
"""


def test_one_line_stands_for_the_compilers(tmp_path):
    environment = {**os.environ, "XDG_CACHE_HOME": str(tmp_path / "cache")}
    runs = [
        subprocess.run([sys.executable, "-c", COMPILE, tmp_path / "forms.log"], capture_output=True, text=True,
                       timeout=120, check=True, env=environment)
        for _ in range(2)
    ]  # fmt: skip
    first, second = (run.stderr.splitlines() for run in runs)
    said = f"compiling forms of finite elements; later runs find them in {tmp_path / 'cache' / 'fenics'}"
    assert [line for line in first if "of the user" not in line] == [said]
    assert said not in second and len(second) == 2 and "a line of the user" in second[0]
    assert second[1] == "<string>:14: UserWarning: a warning of the user"  # not as a line of FFCx's log
    log = (tmp_path / "forms.log").read_text()
    assert (
        "Calling JIT C compiler" in log or "gcc" in log
    )  # newer versions of FFCx keep the compiler's own lines in their cache
