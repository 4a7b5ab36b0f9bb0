"""The command ``talus``: it finds studies, begins new ones, runs them, and hands signals on to all ranks."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import tomllib

import mpm_core

ROOT = Path(__file__).parents[3]
BUILD = Path(mpm_core.__file__).parents[2]
ENVIRONMENT = {
    **os.environ,
    "PYTHONPATH": os.pathsep.join([str(ROOT), *filter(None, sys.path)]),
    "OMPI_ALLOW_RUN_AS_ROOT": "1",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
}
ENVIRONMENT.pop("TALUS_STUDIES", None)
SMALL = ["--cell-size", "1", "--time", "0.05", "--frames", "2"]


def talus(folder, *words, **more):
    return subprocess.run([sys.executable, "-m", "talus", *map(str, words)], cwd=folder, capture_output=True, text=True,
                          timeout=120, env={**ENVIRONMENT, **more})  # fmt: skip


def test_without_a_command_it_prints_its_help(tmp_path):
    refused = talus(tmp_path)
    assert refused.returncode == 2 and refused.stdout == ""
    assert refused.stderr.startswith("usage: talus") and "begin a study of your own" in refused.stderr


@pytest.fixture
def begun(tmp_path):
    """A folder with a new study."""
    assert talus(tmp_path, "new", "mine").returncode == 0
    return tmp_path


def test_all_studies_are_listed_with_their_purpose(tmp_path):
    listed = talus(tmp_path, "list").stdout.splitlines()
    names = {line.split()[0] for line in listed}
    assert {path.stem for path in (ROOT / "studies").glob("*.py")} | {"verification"} == names
    assert all(len(line.split()) > 3 for line in listed)


@pytest.mark.parametrize(
    "words, message",
    [
        (["run"], "no study is named, expected one of these"),
        (["run", "nosuch"], "there is no study 'nosuch'; expected one of these"),
        (["run", "slop"], "there is no study 'slop'; did you mean slope?"),
        (["run", "nosuch.py"], "there is no study 'nosuch.py'"),
        (["run", "--ranks", "0", "slope"], "--ranks is '0', expected a whole number from 1 on"),
        (["run", "--ranks"], "--ranks is '', expected a whole number from 1 on"),
        (["new", "my-slope"], "the name is 'my-slope', expected letters, digits and underscores"),
        (["new", "slope"], "the name is 'slope', which is that of a study of Talus"),
        (["completion", "csh"], "invalid choice: 'csh'"),
        (["sing"], "invalid choice: 'sing'"),
    ],
)
def test_wrong_words_are_named(tmp_path, words, message):
    done = talus(tmp_path, *words)
    assert done.returncode == 2 and message in done.stderr and "Traceback" not in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_a_new_study_leaves_what_is_there(begun):
    (begun / "mine.py").write_text("mine")
    done = talus(begun, "new", "mine")
    assert (
        done.returncode == 2 and "mine.py is there already" in done.stderr and (begun / "mine.py").read_text() == "mine"
    )


def test_a_new_study_runs_as_it_is(begun):
    done = talus(begun, "run", "mine", *SMALL)
    assert done.returncode == 0, done.stderr
    summary = json.loads((begun / "results" / "mine" / "summary.json").read_text())
    assert summary["finished_run"] and 0 < summary["largest_displacement_m"] < 9.81 * 0.05**2
    assert summary["initial_out_of_balance_ratio"] < 1e-6
    assert "talus run mine --parameters" in (begun / "results" / "mine" / "parameters.toml").read_text()
    assert (begun / "results" / "mine" / "report.html").exists() and (
        begun / "results" / "mine" / "particles.xdmf"
    ).exists()


def test_the_slide_of_a_new_study_is_without_warnings_on_coarse_cells(begun):
    done = talus(begun, "run", "mine", "--cell-size", "0.5", "--time", "1", "--frames", "5")
    assert done.returncode == 0 and "warning" not in done.stderr


def test_studies_of_another_folder(begun, tmp_path_factory):
    elsewhere = tmp_path_factory.mktemp("elsewhere")
    (begun / "notes.py").write_text('"""No study."""')
    assert " mine " not in talus(elsewhere, "list").stdout
    listed = talus(elsewhere, "list", TALUS_STUDIES=str(begun)).stdout
    assert listed.split()[0] == "mine" and "notes" not in listed
    for name, more in (("mine", {"TALUS_STUDIES": str(begun)}), (begun / "mine.py", {})):
        helped = talus(elsewhere, "run", name, "--help", **more)
        assert helped.returncode == 0 and "usage: talus run mine" in helped.stdout


def test_ctrl_c_reaches_all_ranks(begun):
    child = subprocess.Popen([sys.executable, "-m", "talus", "run", "--ranks", "2", "mine", *SMALL, "--time", "1e4", "--frames",
                              "1000000"], cwd=begun, env=ENVIRONMENT, stderr=subprocess.PIPE, text=True)  # fmt: skip
    rows, deadline = begun / "results" / "mine" / "history.csv", time.monotonic() + 90
    while (
        not (rows.exists() and rows.read_text().count("\n") > 2)
        and time.monotonic() < deadline
        and child.poll() is None
    ):
        time.sleep(0.1)
    child.send_signal(signal.SIGINT)
    _, errors = child.communicate(timeout=90)
    assert child.returncode == 128 + signal.SIGUSR1, errors
    summary = json.loads((begun / "results" / "mine" / "summary.json").read_text())
    assert summary["ranks"] == 2 and summary["stopped_because"].startswith("interrupted at")
    checkpoint = begun / "results" / "mine" / "checkpoint.h5"
    assert f"--restart {checkpoint} continues from there" in summary["stopped_because"]
    before = rows.read_text()
    reached = float(before.split()[-1].split(",")[0])
    refused = talus(begun, "run", "mine", "--restart", checkpoint, "--factor", "2")
    assert refused.returncode == 2 and "A restart may change: checkpoint-every, frames, time" in refused.stderr
    done = talus(begun, "run", "mine", "--restart", checkpoint, "--time", reached + 0.01, "--frames", "10")
    assert done.returncode == 0, done.stderr
    again = json.loads((begun / "results" / "mine" / "summary.json").read_text())
    assert again["finished_run"] and again["restarts"][0]["time_s"] == pytest.approx(reached)
    assert again["initial_out_of_balance_ratio"] == summary["initial_out_of_balance_ratio"]
    assert rows.read_text().startswith(before)  # with the row of the moment of the interruption
    times = [float(line.split(",")[0]) for line in rows.read_text().split()[1:]]
    assert times[0] == 0 and times == sorted(set(times)) and times[-1] == pytest.approx(reached + 0.01)


def test_info_names_versions_and_solvers(tmp_path):
    lines = dict(line.split(":", 1) for line in talus(tmp_path, "info").stdout.splitlines())
    assert lines["talus"].strip() == mpm_core.__version__
    assert {"dolfinx", "petsc", "gmsh", "linear solvers", "processors", "studies"} <= set(lines)


def test_version_is_that_of_the_core(tmp_path):
    done = talus(tmp_path, "--version")
    assert (done.returncode, done.stdout) == (0, f"talus {mpm_core.__version__}\n")


def test_info_names_what_is_missing_or_cannot_be_loaded(tmp_path):
    """It is asked for where an installation does not work, and must answer there."""
    for name, error in (("dolfinx", "ModuleNotFoundError('No module', name='dolfinx')"), ("matplotlib", "OSError('libfree')"),
                        ("h5py", "ModuleNotFoundError('no numpy.core', name='numpy.core')")):  # fmt: skip
        (tmp_path / f"{name}.py").write_text(f"raise {error}")
    done = talus(tmp_path, "info", PYTHONPATH=os.pathsep.join([str(tmp_path), ENVIRONMENT["PYTHONPATH"]]))
    lines = {name: text.strip() for name, text in (line.split(":", 1) for line in done.stdout.splitlines())}
    assert done.returncode == 0 and lines["talus"] == mpm_core.__version__
    assert lines["dolfinx"] == "not found" and lines["matplotlib"] == "not loaded: libfree"
    assert lines["h5py"] == "not loaded: no numpy.core"


def test_a_study_is_not_started_without_what_it_imports(tmp_path):
    """As where talus is installed without the extra `studies`."""
    (tmp_path / "sitecustomize.py").write_text("import sys\nsys.modules['jinja2'] = sys.modules['tqdm'] = None\n")
    path = os.pathsep.join([str(tmp_path), ENVIRONMENT["PYTHONPATH"]])
    done = talus(tmp_path, "run", "slope", "--help", PYTHONPATH=path)
    assert done.returncode == 2 and "cannot import tqdm, jinja2, which studies need" in done.stderr
    assert "pip install '.[studies]'" in done.stderr


def test_a_reader_may_end_before_the_list(tmp_path):
    script = f"{sys.executable} -m talus list | head -n 1"
    done = subprocess.run(["bash", "-c", script], cwd=tmp_path, capture_output=True, text=True, env=ENVIRONMENT)
    assert len(done.stdout.splitlines()) == 1 and done.stderr == ""


@pytest.mark.skipif(shutil.which("bash") is None, reason="needs bash")
def test_the_shell_completes_studies(tmp_path):
    script = "\n".join([
        f'talus() {{ {sys.executable} -m talus "$@"; }}', 'source <(talus completion bash)',
        'COMP_WORDS=(talus run slo) COMP_CWORD=2; _talus; echo "${COMPREPLY[@]}"',
        'COMP_WORDS=(talus in) COMP_CWORD=1; _talus; echo "${COMPREPLY[@]}"',
        'COMP_WORDS=(talus run footing --half) COMP_CWORD=3; _talus; echo "${COMPREPLY[@]}"',
        'COMP_WORDS=(talus run --ranks 2 footing --without) COMP_CWORD=5; _talus; echo "${COMPREPLY[@]}"',
    ])  # fmt: skip
    done = subprocess.run(
        ["bash", "-c", script], cwd=tmp_path, capture_output=True, text=True, timeout=60, env=ENVIRONMENT
    )
    assert done.stdout.split() == ["slope", "slope_schemes", "info", "--half-width", "--without-dilation"], done.stderr


def test_zsh_takes_the_completion_without_further_preparation(tmp_path):
    if shutil.which("zsh") is None:
        pytest.skip("needs zsh")
    script = f'talus() {{ {sys.executable} -m talus "$@" }}; source <(talus completion zsh); echo $_comps[talus]'
    done = subprocess.run(
        ["zsh", "-fc", script], cwd=tmp_path, capture_output=True, text=True, timeout=60, env=ENVIRONMENT
    )
    assert done.stdout.split()[-2:] == ["-F", "_talus"] and done.stderr == ""


def test_fish_completes_commands_and_studies(tmp_path):
    if shutil.which("fish") is None:
        pytest.skip("needs fish")
    lines = [
        "talus in",
        "talus run slo",
        "talus completion f",
        "talus run --r",
        "talus run footing --half",
        "talus run --ranks 2 footing --half",
    ]
    script = "\n".join([f"function talus; {sys.executable} -m talus $argv; end", "talus completion fish | source",
                        *(f"complete -C '{line}'" for line in lines)])  # fmt: skip
    done = subprocess.run(
        ["fish", "-c", script], cwd=tmp_path, capture_output=True, text=True, timeout=60, env=ENVIRONMENT
    )
    words = [line.split("\t")[0] for line in done.stdout.splitlines()]
    assert words == ["info", "slope", "slope_schemes", "fish", "--ranks", "--half-width", "--half-width"], done.stderr


def test_the_installed_package_holds_all_that_studies_need(tmp_path):
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    assert project["project"]["scripts"] == {"talus": "talus.command:main"}
    if shutil.which("cmake") is None or not (BUILD / "cmake_install.cmake").exists():
        pytest.skip("needs the build folder")
    subprocess.run(["cmake", "--install", BUILD, "--prefix", tmp_path], check=True, capture_output=True, timeout=60)
    for package in project["tool"]["scikit-build"]["wheel"]["packages"]:  # which pip adds to what CMake installs
        shutil.copytree(ROOT / package, tmp_path / Path(package).name, dirs_exist_ok=True)
    work = tmp_path / "work"
    work.mkdir()
    done = talus(work, "run", "element_test", "--steps", "5", PYTHONPATH=str(tmp_path))
    assert done.returncode == 0, done.stderr
    summary = json.loads((work / "results" / "element_test" / "summary.json").read_text())
    assert summary["finished_run"] and summary["versions"]["git_revision"] == "none, installed package"
    assert (tmp_path / "talus" / "meshes" / "embankment.toml").exists()
    assert str(tmp_path / "talus" / "studies") in talus(work, "info", PYTHONPATH=str(tmp_path)).stdout
