"""Studies by their functions `main`, in the process of the test."""

import importlib
import importlib.util
import os
import subprocess
import sys
from pathlib import Path

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
