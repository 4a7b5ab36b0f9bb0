"""Starting a study on one rank or on several, so that signals end it cleanly.

``python -m talus.launch RANKS COMMAND ...`` runs any command on so many ranks.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from types import FrameType

from talus.find import PACKAGE, SHIPPED

ALONE = {"OMPI_MCA_ess_singleton_isolated": "1", "OMPI_MCA_pml": "ob1"}
"""With these Open MPI starts one process in a tenth of a second, without a network and a daemon, otherwise in four."""

RANK_IN_JOB = {"OMPI_COMM_WORLD_RANK", "PMIX_RANK", "PMI_RANK"}
"""Environment variables of which mpirun or srun sets one"""


def environment() -> dict[str, str]:
    """Environment variables of a study: the path to common modules, one thread per rank, and the folder of results."""
    paths = [str(SHIPPED), str(PACKAGE.parent), *filter(None, [os.environ.get("PYTHONPATH")])]
    return {
        "OMP_NUM_THREADS": "1",
        "TALUS_RESULTS": str(Path.cwd() / "results"),
        **os.environ,
        "TALUS_PROGRAM": "talus run",
        "PYTHONPATH": os.pathsep.join(paths),
    }


def run(script: Path, words: list[str], ranks: int | None) -> int:
    """Run a study; returns its exit code.

    Args:
        script: the study.
        words: its arguments.
        ranks: number of ranks; None to replace this process by the study, as under mpirun.
    """
    command = [sys.executable, str(script), *words]
    if ranks is None:
        sys.stdout.flush()
        alone = {} if RANK_IN_JOB & os.environ.keys() else ALONE
        os.execve(sys.executable, command, alone | environment())
    return _watched([*launcher(ranks), *command], environment())


def launcher(ranks: int) -> list[str]:
    """The words that start a command on so many ranks.

    Raises:
        FileNotFoundError: there is no mpirun.
    """
    if shutil.which("mpirun") is None:
        raise FileNotFoundError("mpirun is not on the path")
    words = ["mpirun", "-n", str(ranks)]
    version = subprocess.run(["mpirun", "--version"], capture_output=True, text=True, check=False).stdout
    if "Open MPI" not in version:
        return words
    if os.getuid() == 0:
        words.append("--allow-run-as-root")
    # Open MPI counts cores, not hardware threads; where these are fewer than ranks it must be allowed.
    return [*words, "--oversubscribe"]


def _watched(command: list[str], variables: dict[str, str]) -> int:
    """Run mpirun in a process group of its own, and hand signals on to it as SIGUSR1, which it hands on to its ranks.

    By itself mpirun kills its ranks a second after Ctrl-C or SIGTERM. The second of these ends it. When this process is killed,
    the system sends SIGUSR1 where `setpriv` is there.
    """
    if shutil.which("setpriv"):
        command = ["setpriv", "--pdeathsig", "USR1", *command]
    child = subprocess.Popen(command, stdin=subprocess.DEVNULL, env=variables, start_new_session=True)
    asked = False

    def hand_on(number: int, _: FrameType | None) -> None:
        nonlocal asked
        ends = asked and number in (signal.SIGINT, signal.SIGTERM)
        asked = asked or number in (signal.SIGINT, signal.SIGTERM)
        with contextlib.suppress(ProcessLookupError):
            child.send_signal(signal.SIGTERM if ends else signal.SIGUSR1)

    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGUSR1, signal.SIGUSR2, signal.SIGXCPU, signal.SIGHUP):
        if signal.getsignal(number) != signal.SIG_IGN or number != signal.SIGHUP:  # nohup keeps the last one away
            signal.signal(number, hand_on)
    code = child.wait()
    return code if code >= 0 else 128 - code


if __name__ == "__main__":
    try:
        sys.exit(_watched([*launcher(int(sys.argv[1])), *sys.argv[2:]], dict(os.environ)))
    except FileNotFoundError as error:
        sys.exit(f"talus: {error}")
