"""The folder of a run: none writes over another's results unasked, and no two write to one at once."""

import signal
import subprocess
import sys

import pytest

from studies.common import results
from studies.common.files import NOT_WRITTEN, OutputError, expendable, written_whole
from studies.common.options import add_number, study_parser
from studies.common.results import MARK, note_what_was_written, open_results


@pytest.fixture(autouse=True)
def own_place(tmp_path, monkeypatch):
    """The repository's folder results/ stays as it is."""
    monkeypatch.setattr(results, "ROOT", tmp_path)
    yield
    for lock in results._locks.values():
        lock.close()
    results._locks.clear()


def options(*words):
    parser = study_parser("A study.")
    parser.prog = "studies/run slope"
    add_number(parser, "--height", 1.0, "m", "height", above=0)
    return parser.parse_args(list(map(str, words)))


def run(*words, ended=True):
    """A run with one result, in this process; returns its folder."""
    folder = open_results(options(*words))
    (folder / "history.csv").write_text("time_s\n0\n")
    if ended:
        (folder / "summary.json").write_text("{}")
        note_what_was_written(folder)
        results._locks.pop(folder).close()
    return folder


def names(folder):
    return {path.name for path in folder.iterdir()} - {MARK}


def test_parameters_are_there_before_anything_else(tmp_path):
    folder = open_results(options("--output", tmp_path / "a" / "b", "--height", "3"))
    assert folder == tmp_path / "a" / "b" and names(folder) == {"parameters.toml"}
    assert "height = 3.0" in (folder / "parameters.toml").read_text()


def test_runs_without_a_folder_of_their_own_are_numbered(tmp_path, capsys):
    assert [run() for _ in range(3)] == [tmp_path / "results" / name for name in ("slope", "slope-2", "slope-3")]
    told = capsys.readouterr().out
    assert f"{tmp_path}/results/slope holds a run; this one writes to {tmp_path}/results/slope-2" in told
    assert run("--overwrite") == tmp_path / "results" / "slope"


def test_a_run_that_computed_nothing_leaves_its_folder_to_the_next(tmp_path):
    first = open_results(options())
    results._locks.pop(first).close()
    assert open_results(options()) == first


@pytest.mark.parametrize("ended", [True, False])
def test_results_in_a_named_folder_are_replaced_only_when_asked(tmp_path, ended):
    place = tmp_path / "own"
    place.mkdir()
    (place / "log").write_text("before the run")
    run("--output", place, ended=ended)
    (place / "particles").mkdir()
    (place / "particles" / "0.h5").touch()
    if ended:
        (place / "summary.json").unlink()
        run("--output", place, "--overwrite")
        (place / "notes.txt").write_text("after the run")
    else:
        results._locks.pop(place).close()  # as when it is killed
    with pytest.raises(OutputError, match="own holds the results of an earlier run; replace them by --overwrite"):
        open_results(options("--output", place))
    open_results(options("--output", place, "--overwrite"))
    left = {"log", "parameters.toml", *(["notes.txt", "particles"] if ended else [])}
    assert names(place) == left and (place / "log").read_text() == "before the run"


def test_a_folder_of_an_earlier_version_is_never_emptied(tmp_path):
    (tmp_path / "summary.json").write_text("{}")
    for words in ([], ["--overwrite"]):
        with pytest.raises(OutputError, match="holds"):
            open_results(options("--output", tmp_path, *words))
    assert (tmp_path / "summary.json").exists()


HOLDING = """
import sys, time
from pathlib import Path
from studies.common import results
from studies.common.options import study_parser
results.ROOT = Path(sys.argv[1])
parser = study_parser("A study.")
parser.prog = "studies/run slope"
folder = results.open_results(parser.parse_args(sys.argv[2:]))
print(folder.name, file=sys.stderr, flush=True)
time.sleep(60)
"""


def holding(*words):
    """A process that holds the folder of a run."""
    return subprocess.Popen([sys.executable, "-c", HOLDING, *map(str, words)], stderr=subprocess.PIPE, text=True)


def test_the_second_run_is_refused_until_the_first_is_gone_however_it_ends(tmp_path):
    for number in (signal.SIGKILL, signal.SIGTERM):
        first = holding(tmp_path, "--output", tmp_path / "a")
        assert first.stderr.readline() == "a\n"
        for words in ([], ["--overwrite"]):
            with pytest.raises(OutputError, match=f"another run writes to {tmp_path}/a: process {first.pid} on "):
                open_results(options("--output", tmp_path / "a", *words))
        first.send_signal(number)
        first.communicate()
        folder = open_results(options("--output", tmp_path / "a"))
        results._locks.pop(folder).close()


def test_runs_that_start_together_take_different_folders(tmp_path):
    children = [holding(tmp_path) for _ in range(4)]
    found = sorted(child.stderr.readline().strip() for child in children)
    for child in children:
        child.kill()
        child.communicate()
    assert found == ["slope", "slope-2", "slope-3", "slope-4"]


def test_a_folder_that_cannot_be_made_is_named(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(OutputError, match=f"cannot write results to {tmp_path}/file/results: Not a directory"):
        open_results(options("--output", tmp_path / "file" / "results"))


def test_a_file_appears_as_a_whole_or_not_at_all(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text("old")
    with pytest.raises(OutputError, match="cannot write .*a.txt: No space left"), written_whole(path) as aside:
        aside.write_text("ne")
        raise OSError(28, "No space left on device")
    assert names(tmp_path) == {"a.txt"} and path.read_text() == "old"
    with expendable(path):
        raise OSError(28, "No space left on device")
    assert NOT_WRITTEN.pop() == f"cannot write {path}: No space left on device"
