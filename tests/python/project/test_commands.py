"""The commands studies/run and tests/run: what they do before any study or test starts."""

import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
COMMANDS = [ROOT / "studies" / "run", ROOT / "tests" / "run", ROOT / ".ci" / "run"]


def call(command, *arguments, folder=ROOT):
    return subprocess.run([command, *arguments], cwd=folder, capture_output=True, text=True, timeout=60)


@pytest.mark.parametrize("command", COMMANDS, ids=lambda path: path.parent.name)
def test_help_from_another_folder_and_through_a_symlink(command, tmp_path):
    link = tmp_path / "link"
    link.symlink_to(command)
    direct = call(command, "--help", folder="/")
    linked = call(link, "--help", folder=tmp_path)
    assert direct.returncode == linked.returncode == 0
    assert direct.stdout.startswith("Usage:")
    assert linked.stdout == direct.stdout


def test_list_names_every_study():
    listed = call(COMMANDS[0], "--list")
    studies = [path.stem for path in (ROOT / "studies").glob("*.py")]
    names = [line.split()[0] for line in listed.stdout.splitlines()]
    assert listed.returncode == 0
    assert set(studies) <= set(names)
    assert "common" not in names


def test_every_listed_study_says_what_it_is():
    assert all(len(line.split()) > 1 for line in call(COMMANDS[0], "--list").stdout.splitlines())


@pytest.mark.parametrize("name", ["nosuchstudy", "common", "../studies/slope", "common/plots"])
def test_unknown_study_is_refused_and_the_others_are_named(name):
    refused = call(COMMANDS[0], name)
    assert refused.returncode == 2
    assert f"there is no study '{name}'" in refused.stderr
    assert call(COMMANDS[0], "--list").stdout in refused.stderr


@pytest.mark.parametrize("ranks", ["0", "-1", "two", ""])
def test_ranks_must_be_a_positive_whole_number(ranks):
    refused = call(COMMANDS[0], "--ranks", ranks, "slope")
    assert refused.returncode == 2
    assert f"--ranks needs a whole number from 1, not '{ranks}'" in refused.stderr


def test_no_study_named():
    refused = call(COMMANDS[0])
    assert refused.returncode == 2
    assert "no study named" in refused.stderr
