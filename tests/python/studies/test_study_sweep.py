"""Sweeps of a study: results in closed form, what is kept of an earlier sweep, changed sites, and what is refused."""

import csv
import importlib
import json
import math
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from study_main import STUDIES, ended

Q = "--steps", "40"  # a drained triaxial test, which ends beyond the peak


def table(folder):
    with open(folder / "sweep.csv", newline="") as file:
        return list(csv.DictReader(file))


def peak(cohesion, angle=25.0, lateral=20e3):
    """Deviator stress at failure of a triaxial test by Mohr and Coulomb [Pa]."""
    phi = math.radians(angle)
    return 2 * (cohesion * math.cos(phi) + lateral * math.sin(phi)) / (1 - math.sin(phi))


def test_a_sweep_of_strength_gives_the_peaks_of_mohr_and_coulomb_and_goes_on(tmp_path, without_pictures):
    folder = tmp_path / "sweep"
    words = ["--vary", "cohesion=uniform:500:1500", "--limit", f"q_Pa={peak(1000)}", "--output", folder]
    run = ["element_test", *Q, "--friction-angle", "25"]
    first = ended("sweep", tmp_path, *words, "--samples", "2", *run)
    assert first.returncode == 0, first.stderr
    times = {row["run"]: row["seconds"] for row in table(folder)}
    more = ended("sweep", tmp_path, *words, "--samples", "3", "--resume", *run)
    assert "resume = false" in (folder / "parameters.toml").read_text()  # which repeats it in a new folder
    assert more.returncode == 0 and "3 runs of element_test, of which 2 are there" in more.stdout
    rows = table(folder)
    assert [row["run"] for row in rows] == ["1", "2", "3"] and all(
        rows[int(k) - 1]["seconds"] == t for k, t in times.items()
    )
    for row in rows:
        assert float(row["q_Pa"]) == pytest.approx(peak(float(row["cohesion"])), rel=1e-6)
    summary = json.loads((folder / "summary.json").read_text())
    below = sum(float(row["cohesion"]) < 1000 for row in rows)
    assert summary["probabilities"]["q_Pa"]["runs_below"] == below
    assert summary["rank_correlations"]["q_Pa"]["cohesion"] == pytest.approx(1)
    other = ended("sweep", tmp_path, *words, "--samples", "3", "--resume", "--seed", "2", *run)
    assert other.returncode == 2 and "run 1 in" in other.stderr and "has other values than this sweep" in other.stderr


def test_a_run_that_fails_is_named_and_left_out(tmp_path, without_pictures):
    # The law needs a preconsolidation pressure of at least the pressure at the start; the first value has it.
    run = ["element_test", "--material", "cam-clay", "--steps", "20"]
    end = ended(
        "sweep", tmp_path, "--vary", "preconsolidation=30e3,-1", "--jobs", "1", "--output", tmp_path / "s", *run
    )
    assert end.returncode == 1
    assert (
        "1 of 2 runs have results" in end.stdout
        and "run 2 failed:" in end.stdout
        and "--preconsolidation is '-1" in end.stdout
    )
    assert table(tmp_path / "s")[1]["exit_code"] == "2"


def test_a_site_is_changed_by_files_that_extend_it(tmp_path, without_pictures):
    site = tmp_path / "site.toml"
    site.write_text(
        (study_site()).read_text().replace('"embankment.geo"', f'"{study_site().with_name("embankment.geo")}"')
    )
    end = ended("sweep", tmp_path, "--vary", "soils.clay.shear_strength=6e3,12e3", "--vary", "soils.layer*.cohesion=0.0,0.1",
                "--one-at-a-time", "--jobs", "1", "--output", tmp_path / "s",
                "collapse", "--site", site, "--cell-size", "2", "--meshes", "1", "--elements", "P1", "--strength", "nothing")  # fmt: skip
    assert end.returncode == 2  # the study refuses its unknown option
    assert "run 1 was refused" in end.stderr and "--strength" in end.stderr
    changed = (tmp_path / "s" / "runs" / "002.toml").read_text()
    assert '"soils" = {"clay" = {"shear_strength" = 6000.0}}' in changed and f'"extends" = "{site}"' in changed


def test_parameters_of_the_command_line_replace_those_of_a_file(tmp_path):
    sweep = importlib.import_module("sweep")
    file = tmp_path / "parameters.toml"
    file.write_text(
        'vary = ["cohesion=1,2", "young=1e5,2e5"]\nlimit = ["q_Pa=3"]\nrun = ["element_test", "--steps", "5"]\n'
    )
    a = sweep.parse(["--parameters", str(file)])
    assert (a.vary, a.limit, a.run) == (["cohesion=1,2", "young=1e5,2e5"], ["q_Pa=3"], ["element_test", "--steps", "5"])
    a = sweep.parse(["--parameters", str(file), "--vary", "poisson=0.2,0.3", "element_test"])
    assert (a.vary, a.limit, a.run) == (["poisson=0.2,0.3"], ["q_Pa=3"], ["element_test"])


def study_site():
    """The site of an embankment, as it is shipped."""
    return STUDIES.parent / "meshes" / "embankment.toml"


@pytest.mark.parametrize("words, expected", [
    (["--vary", "cohesion=1,2"], "no study is named"),
    (["--vary", "cohesion=1,2", "element_test", "--output=there"], "--output is given after the study, expected it before"),
    (["element_test"], "--vary is not given"),
    (["--vary", "cohesion=1,2", "element_test", "--help"], "--help is given after the study, expected it without the sweep"),
    (["--vary", "cohesion=1,2", "elements_test"], "there is no study 'elements_test'"),
    (["--vary", "cohesin=1,2", "element_test"], "which is no option of element_test; did you mean cohesion?"),
    (["--vary", "soils.a.young=1,2", "safety"], "a key of a site, expected --site FILE"),
    (["--vary", "soils.rock.young=1,2", "safety", "--site", study_site()], "has no 'rock' there; it has clay, layer 1"),
    (["--vary", "soils.clay.yong=1,2", "safety", "--site", study_site()], "unknown key 'yong'; did you mean young?"),
    (["--limit", "q_Pa=nan", "--vary", "cohesion=1,2", "element_test"], "--limit is 'q_Pa=nan', expected NAME=X"),
    (["--no-pictures", "--vary", "cohesion=1,2", "element_test"], "unrecognized arguments: --no-pictures"),
    (["--limit", "q_Pa", "--vary", "cohesion=1,2", "element_test"], "--limit is 'q_Pa', expected NAME=X"),
])  # fmt: skip
def test_impossible_sweeps_are_refused_before_anything_runs(tmp_path, words, expected):
    end = ended("sweep", tmp_path, *words)
    assert end.returncode == 2 and expected in end.stderr
    assert not list(tmp_path.glob("**/*.log"))


def test_a_result_that_the_study_does_not_have_is_named_after_the_first_run(tmp_path, without_pictures):
    end = ended("sweep", tmp_path, "--vary", "cohesion=1e3,2e3,3e3,4e3", "--result", "q", "--jobs", "1", "--output", tmp_path / "s",
                "element_test", *Q)  # fmt: skip
    assert end.returncode == 2 and "q is no result of the study, expected one of" in end.stderr and "q_Pa" in end.stderr
    assert len(list((tmp_path / "s" / "runs").glob("*.log"))) == 1


SLOW = """
import sys, time
from pathlib import Path
folder = Path(sys.argv[sys.argv.index("--output") + 1])
folder.with_suffix(".began").touch()
time.sleep(60)
"""


def test_runs_end_with_a_sweep_that_is_killed(tmp_path):
    """What goes on would keep its folder from the sweep that resumes."""
    if shutil.which("setpriv") is None:
        pytest.skip("setpriv is not there")
    (tmp_path / "slow.py").write_text(SLOW)
    text = f"""
import sys
sys.path[:0] = {[str(STUDIES), str(STUDIES.parent)]}
from pathlib import Path
from common.sweep.runs import Study, carry_out, runs_of
study = Study(Path({str(tmp_path / "slow.py")!r}), [], 1, {{}})
list(carry_out(runs_of(study, [{{}}], Path({str(tmp_path)!r})), study, 1, lambda: False))
"""
    sweep = subprocess.Popen([sys.executable, "-c", text])
    until(lambda: (tmp_path / "runs" / "001.began").exists())
    children = Path(f"/proc/{sweep.pid}/task/{sweep.pid}/children").read_text().split()
    assert children and all(
        os.getsid(int(child)) == int(child) for child in children
    )  # Ctrl-C comes by the sweep alone
    sweep.kill()
    sweep.wait()
    until(lambda: not any(alive(child) for child in children))


def alive(process):
    """Whether a process runs; one that has ended may still be in the table of processes."""
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    except OSError:
        return False


def until(condition, seconds=30.0):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.05)


def test_an_interrupted_sweep_keeps_what_has_ended_and_says_so_by_its_exit_code(tmp_path, without_pictures):
    folder = tmp_path / "s"
    words = [
        "sweep.py",
        "--vary",
        "young=1e5:2e5:50",
        "--jobs",
        "1",
        "--output",
        folder,
        "element_test",
        "--steps",
        "5",
    ]
    command = [sys.executable, STUDIES / words[0], *words[1:]]
    child = subprocess.Popen([str(word) for word in command], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    limit = time.monotonic() + 120
    while not (folder / "runs" / "001" / "summary.json").exists() and time.monotonic() < limit:
        time.sleep(0.1)
    child.send_signal(signal.SIGINT)
    assert child.wait(timeout=60) == 128 + signal.SIGINT
    summary = json.loads((folder / "summary.json").read_text())
    assert 1 <= summary["runs_with_results"] < 50 and "--resume --output" in summary["stopped_because"]
