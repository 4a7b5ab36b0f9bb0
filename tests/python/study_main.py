"""Studies by their functions `main`, in the process of the test."""

import contextlib
import importlib
import importlib.util
import io
import os
import subprocess
import sys
import warnings
from pathlib import Path
from typing import NamedTuple

import mpm_core as mpm

STUDIES = Path(__file__).parents[2] / "studies"
sys.path.insert(0, str(STUDIES))
NAMES = sorted(
    [path.stem for path in STUDIES.glob("*.py")] + [path.parent.name for path in STUDIES.glob("*/__main__.py")]
)
ON_TWO_RANKS = ("balance",)


def main(name, arguments):
    """Run a study in this process, or on two ranks if it needs them."""
    if name in ON_TWO_RANKS and "--help" not in arguments:
        launch = ["mpirun", "-n", "2", "--oversubscribe", "--mca", "mpi_yield_when_idle", "1", sys.executable]
        # What MPI has put into the environment of this process, past os.environ, is not for another run of it.
        root = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
        command = [*launch, STUDIES / f"{name}.py", *map(str, arguments)]
        return subprocess.run(command, timeout=120, env={**os.environ, **root}).returncode
    if (STUDIES / f"{name}.py").exists():
        module = importlib.import_module(name)
    else:
        sys.path.insert(0, str(STUDIES / name))
        spec = importlib.util.spec_from_file_location(f"{name}_main", STUDIES / name / "__main__.py")
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
    program, sys.argv[0] = sys.argv[0], f"{name}.py"
    try:
        return module.main([str(word) for word in arguments])
    finally:
        sys.argv[0] = program


class Ended(NamedTuple):
    returncode: int
    stdout: str
    stderr: str


def ended(name, folder, *options):
    """How a study ends and what it says, as its script does (`common.ranks.run_study`), which takes a second more to start."""
    files = importlib.import_module("common.files")
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err), warnings.catch_warnings():
        for kind in (UserWarning, RuntimeWarning):
            warnings.simplefilter("default", kind)
        warnings.showwarning = lambda text, *_, **__: print(f"warning: {text}", file=err)
        files.NOT_WRITTEN.clear()
        try:
            code = main(name, ["--output", folder, *options])
        except SystemExit as end:
            code = end.code
        except (mpm.InputError, mpm.RunError, files.OutputError) as error:
            print(error, file=err)
            code = 2
        for reason in files.NOT_WRITTEN:
            print(reason, file=err)
    return Ended(code or (1 if files.NOT_WRITTEN else 0), out.getvalue(), err.getvalue())
