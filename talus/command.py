"""The command line of ``talus``."""

from __future__ import annotations

import argparse
import importlib.util
import signal
import sys
from collections.abc import Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from talus import find
from talus.about import about, version
from talus.begin import begin
from talus.completion import SCRIPTS
from talus.launch import run

NEEDED = ("dolfinx", "h5py", "matplotlib", "PIL", "tqdm", "jinja2", "scipy")
"""Modules without which a study ends while it is imported"""


class _Version(argparse.Action):
    """Prints the version, which the core is asked for only then."""

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        print(f"talus {version()}")
        parser.exit()


def parser() -> argparse.ArgumentParser:
    """Parser of all commands."""
    p = argparse.ArgumentParser(prog="talus", description="Slopes from rest to large deformation, by FEM and MPM.")
    p.add_argument("--version", action=_Version, nargs=0, help="print the version and end")
    commands = p.add_subparsers(dest="command", required=True, metavar="COMMAND")
    commands.add_parser("run", help="run a study; see `talus run --help`")  # `run_study` takes its arguments
    commands.add_parser("list", help="list all studies, including your own")
    new = commands.add_parser("new", help="begin a study of your own: a commented script, and a geometry for gmsh")
    new.add_argument("name", help="name of the study: NAME.py and NAME.geo are written to the current folder")
    commands.add_parser("info", help="print versions, linear solvers and processors")
    shell = commands.add_parser("completion", help="print the script by which a shell completes commands and studies")
    shell.add_argument("shell", choices=SCRIPTS)
    return p


def main(arguments: Sequence[str] | None = None) -> int:
    """Do what the command line says; returns the exit code."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    if not words:
        parser().print_help(sys.stderr)
        return 2
    runs = words[:1] == ["run"]
    a = parser().parse_args(words[:1] if runs else words)
    try:
        if runs:
            return run_study(words[1:])
        signal.signal(signal.SIGPIPE, signal.SIG_DFL)  # `talus list | head` ends without a word
        if a.command == "list":
            print(listed())
        elif a.command == "new":
            print(begin(a.name, Path.cwd()))
        elif a.command == "info":
            print(about())
        else:
            print(SCRIPTS[a.shell])
    except (OSError, ValueError) as error:
        print(f"talus {a.command}: {error}", file=sys.stderr)
        return 2
    return 0


def run_study(words: list[str]) -> int:
    """``talus run``: its own options come before the study's name, and all after it are the study's.

    Raises:
        ValueError: no study, or none of that name, or no number of ranks; says what was expected.
    """
    ranks = None
    if words[:1] in (["-h"], ["--help"]):
        print("usage: talus run [--ranks N] STUDY [options of the study]\n\n"
              f"`talus run STUDY --help` lists the options of a study. Studies:\n{listed()}")  # fmt: skip
        return 0
    if words[:1] == ["--ranks"]:
        text = words[1] if len(words) > 1 else ""
        if not text.isdecimal() or int(text) < 1:
            raise ValueError(f"--ranks is '{text}', expected a whole number from 1 on")
        ranks, words = int(text), words[2:]
    if not words:
        raise ValueError(f"no study is named, expected one of these:\n{listed()}")
    script = find.study_path(words[0])
    if script is None:
        near = get_close_matches(words[0], find.studies())
        hint = f"did you mean {' or '.join(near)}? `talus list` lists all" if near else \
            f"expected one of these, or the path of a script:\n{listed()}"  # fmt: skip
        raise ValueError(f"there is no study '{words[0]}'; {hint}")
    missing = [name for name in NEEDED if importlib.util.find_spec(name) is None]
    if missing:
        raise ValueError(f"{sys.executable} cannot import {', '.join(missing)}, which studies need: dolfinx and h5py come with "
                         "DOLFINx, the others with `pip install '.[studies]'` (docs/guide/installation.md)")  # fmt: skip
    return run(script, words[1:], ranks)


def listed() -> str:
    """A line for each study; those of the user come first."""
    found = sorted(find.studies().items(), key=lambda item: item[1].is_relative_to(find.SHIPPED))
    return "\n".join(f"  {name:<16} {find.purpose(path)}" for name, path in found)
