"""Parameters of a study as a TOML file: read in place of command line options, and written so that a run can be repeated."""

from __future__ import annotations

import argparse
import json
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import tomllib

from .files import PROGRAM, write_text

NOT_PARAMETERS = ("help", "output", "overwrite", "parameters_file", "restart", "allow_code")
"""Options that say where things are, or what a run may do, not what is computed; they do not belong into a file of parameters."""


class ParameterError(ValueError):
    """A file of parameters cannot be used; the message names the file, the key and what was expected."""


@dataclass(frozen=True)
class Parameter:
    """An option as a table shows it."""

    name: str
    value: object
    unit: str
    meaning: str


def described(actions: Sequence[argparse.Action], values: argparse.Namespace) -> list[Parameter]:
    """The options that say what is computed, with their values."""
    return [
        Parameter(name, getattr(values, a.dest), getattr(a, "unit", "-"), getattr(a, "meaning", a.help or ""))
        for name, a in _named(actions).items()
    ]


def read_parameters(path: Path, actions: Sequence[argparse.Action]) -> dict[str, object]:
    """Values by the options' names in Python (``dest``), checked as the command line checks them.

    Raises:
        ParameterError: the file cannot be read or is not TOML; an unknown key; a value of another type or out of bounds.
    """
    try:
        with open(path, "rb") as file:
            table = tomllib.load(file)
    except OSError as error:
        raise ParameterError(f"cannot read --parameters {path}: {error.strerror}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ParameterError(f"--parameters {path} is not TOML: {error}") from None
    return checked_values(str(path), table, actions)


def checked_values(source: str, table: Mapping[str, Any], actions: Sequence[argparse.Action]) -> dict[str, object]:
    """Values of a table, by the options' names, by their names in Python, checked as the command line checks them.

    Args:
        source: of the table, for messages.
        table: by the options' names, or as ``summary.json`` has them, ``friction_angle`` for ``friction-angle``. None stands for an
            option that was not named.

    Raises:
        ParameterError: an unknown key; a value of another type or out of bounds.
    """
    known = _named(actions)
    values: dict[str, object] = {}
    for name, value in table.items():
        key = present_name(name.replace("_", "-"), actions)
        if key not in known:
            raise ParameterError(f"{source}: {unknown_key(key, known)}")
        if known[key].dest in values:
            raise ParameterError(f"{source}: {key} is given twice, as {key} and as {key.replace('-', '_')}")
        try:
            values[known[key].dest] = None if value is None else _from_toml(known[key], value)
        except (argparse.ArgumentTypeError, ValueError) as error:
            raise ParameterError(f"{source}: {name} {error}") from None
    return values


def present_name(name: str, actions: Sequence[argparse.Action]) -> str:
    """The name of an option that is given by its name in an earlier version, of which it warns; any other name as it is."""
    for action in actions:
        if getattr(action, "former", None) == name.removeprefix("--"):
            present = action.option_strings[0]
            note = f"the option --{action.former} is now called {present}; the old name will be removed in the next version"
            warnings.warn(note, FutureWarning, stacklevel=2)
            return present if name.startswith("--") else present.removeprefix("--")
    return name


def did_you_mean(word: str, names: Iterable[str]) -> str:
    """What a message adds for a word that is nearly one of some names, or the beginning of some; empty where it is not."""
    names = list(names)
    near = get_close_matches(word, names, cutoff=0.8) or [name for name in names if name.startswith(f"{word}_")]
    return f"; did you mean {' or '.join(near)}?" if near else ""


def unknown_key(key: str, known: Iterable[str]) -> str:
    """What a message says of a key that is not among those that are known."""
    known = list(known)
    return f"unknown key '{key}'{did_you_mean(key, known) or ', expected some of ' + ', '.join(known)}"


def plain_values(parameters: Sequence[Parameter]) -> dict[str, Any]:
    """Values by the options' names, as JSON has them and `checked_values` takes them."""
    return {p.name: str(p.value.resolve()) if isinstance(p.value, Path) else p.value for p in parameters}


def write_parameters(
    path: Path, parameters: Sequence[Parameter], study: str, restarts: Sequence[Mapping[str, Any]] = ()
) -> None:
    """Write a file that `read_parameters` reads, with units and meanings as comments. Call it on one rank.

    What is None is left out: TOML has no form for it, and it is what an option is when it is not named.

    Args:
        restarts: rows of ``Options.restarts``; what they changed stands in comments.

    Raises:
        OutputError: with path and reason.
    """
    lines = [f"# To repeat this run: {PROGRAM} {study} --parameters {path.name}"]
    for restart in restarts:
        changed = f"; changed then: {restart['changed']}" if restart["changed"] else ""
        lines.append(f"# Restarted from a checkpoint at {restart['time_s']:.9g} s{changed}")
    lines.append("")
    for parameter in parameters:
        if parameter.value is not None:
            unit = "" if parameter.unit == "-" else f" [{parameter.unit}]"
            lines.append(f"{parameter.name} = {to_toml(parameter.value)}  # {parameter.meaning}{unit}")
    write_text(path, "\n".join(lines) + "\n")


def _named(actions: Sequence[argparse.Action]) -> dict[str, argparse.Action]:
    """Options by their names without dashes in front; of a pair --name and --no-name by the first."""
    shown = [action for action in actions if action.option_strings and action.dest not in NOT_PARAMETERS]
    return {action.option_strings[0].removeprefix("--"): action for action in shown}


def to_toml(value: object) -> str:
    """A value as TOML has it; of a mapping an inline table."""
    # A JSON text is a TOML text, and Python's shortest form of a number is TOML and is read back as the same number.
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(to_toml, value)) + "]"
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{json.dumps(key)} = {to_toml(one)}" for key, one in value.items()) + "}"
    if isinstance(value, Path):
        value = str(value.resolve())
    return repr(value) if isinstance(value, (int, float)) and not isinstance(value, bool) else json.dumps(value)


def is_repeated(action: argparse.Action) -> bool:
    """Whether an option may be repeated, and is a list of all that was given."""
    return isinstance(action, argparse._AppendAction)


def _from_toml(action: argparse.Action, value: object) -> Any:
    """A value of a file as the command line would give it."""
    if action.nargs == 0:
        if not isinstance(value, bool):
            raise ValueError(f"is {value!r}, expected true or false")
        return value
    if isinstance(value, list) and (action.nargs is not None or is_repeated(action)):
        return [_single(action, one) for one in value]
    return _single(action, value)


def _single(action: argparse.Action, value: object) -> Any:
    takes = getattr(action.type, "takes", "a number or a text in quotes")
    if isinstance(value, bool) or not isinstance(value, (int, float, str)):
        raise ValueError(f"is {value!r}, expected {takes}")
    if isinstance(value, str) and takes == "a number":
        raise ValueError(f"is '{value}', expected a number")
    return action.type(str(value)) if callable(action.type) else str(value)
