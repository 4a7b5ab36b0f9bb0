"""Command line options of a study: the help shows their units, and errors give the value and what was expected.

Example:
    >>> parser = study_parser(__doc__)
    >>> add_number(parser, "--height", 1.0, "m", "height of the slope", above=0.0)
    >>> add_number(parser, "--friction-angle", 25.0, "degrees", "friction angle", at_least=0.0, below=90.0)
    >>> add_count(parser, "--particles-per-cell", 10, "particles in each cell at the start", choices=(1, 3, 4, 6, 10, 12))
    >>> options = parser.parse_args()

Every option may also be given in a TOML file, ``--parameters FILE``, under its name without the leading dashes; the command
line takes precedence.
"""

from __future__ import annotations

import argparse
import math
import re
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NoReturn

from mpi4py import MPI

from .files import PROGRAM
from .notes import checkpoint_notes
from .parameters import (
    Parameter,
    ParameterError,
    checked_values,
    described,
    did_you_mean,
    is_repeated,
    present_name,
    read_parameters,
)


class Options(argparse.Namespace):
    """Options as parsed; ``vars`` gives their values, `parameters` also their units and meanings.

    ``given`` has the options that the command line names, ``--no-name`` where it says so. ``notes`` are those of the checkpoint
    of ``--restart``, and ``restarts`` has a row for each time that the run went on from one; see ``checkpoint.py``. ``unused`` has
    the names in Python of those that a run leaves out, such as a run of a site the shape of the slope.
    """

    __slots__ = ("actions", "description", "given", "study", "notes", "restarts", "unused")
    actions: list[argparse.Action]
    description: str
    given: set[str]
    study: str
    notes: Mapping[str, Any]
    restarts: list[dict[str, Any]]
    unused: set[str]

    def parameters(self) -> list[Parameter]:
        """All options that say what is computed, with the values that are in force."""
        return described(self.actions, self)


class _Help(argparse.RawDescriptionHelpFormatter):
    """Shows the default of an option behind its meaning and unit."""

    def _get_help_string(self, action: argparse.Action) -> str:
        text, default = action.help or "", action.default
        if not hasattr(action, "meaning") or default is None:
            return text
        text = re.sub(r" \(default: [^()]*\)", "", text)  # that of studies where it follows from other options
        if isinstance(action, argparse.BooleanOptionalAction):
            default = action.option_strings[0 if default else 1]
        return f"{text} (default: {default:g})" if isinstance(default, float) else f"{text} (default: {default})"


class _Parser(argparse.ArgumentParser):
    """A parser that also reads a file of parameters and, on several ranks, prints on the first one only."""

    def parse_args(self, args: Sequence[str] | None = None, namespace: None = None) -> Options:  # type: ignore[override]
        args = [self._present_word(word) for word in (sys.argv[1:] if args is None else args)]
        options = Options()
        options.actions, options.study = self._actions, self.prog.split()[-1]
        options.description = self.description or options.study
        options.given = {word.split("=")[0] for word in args if word[:2] == "--"}
        options.notes, options.restarts, options.unused = {}, [], set()
        try:
            self._take_defaults_from_files(args, options)
        except ParameterError as error:
            self.error(str(error))
        return super().parse_args(args, options)

    def _present_word(self, word: str) -> str:
        name, equals, value = word.partition("=")
        return present_name(name, self._actions) + equals + value if name[:2] == "--" else word

    def _take_defaults_from_files(self, args: Sequence[str], options: Options) -> None:
        """Values of a checkpoint, overridden by those of a file of parameters, become the defaults of the command line."""
        first = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
        names = ["parameters", *(["restart"] if any(action.dest == "restart" for action in self._actions) else [])]
        for name in names:
            first.add_argument(f"--{name}", nargs="?")
        given = first.parse_known_args(args)[0]
        values: dict[str, object] = {}
        if getattr(given, "restart", None) is not None:
            options.notes = checkpoint_notes(Path(given.restart), options.study)
            values |= checked_values(f"checkpoint {given.restart}", options.notes["options"], self._actions)
        if given.parameters is not None:
            values |= read_parameters(Path(given.parameters), self._actions)
        self._refuse_code(options.given, values)
        for action in self._actions:  # which would add to the list of the file
            if is_repeated(action) and options.given.intersection(action.option_strings):
                values.pop(action.dest, None)
        self.set_defaults(**values)

    def _refuse_code(self, words: set[str], values: Mapping[str, object]) -> None:
        """Refuse code that only a file names: the command line must name it too, or allow it."""
        for action in self._actions:
            if not getattr(action, "runs_code", False) or values.get(action.dest) is None:
                continue
            if not words & {"--allow-code", *action.option_strings}:
                raise ParameterError(
                    f"{action.option_strings[0]} is {values[action.dest]}, code that a file names and the command line does "
                    "not; repeat the option, or say --allow-code, if you trust it"
                )

    def _print_message(self, message: str, file=None) -> None:
        if MPI.COMM_WORLD.rank == 0:
            super()._print_message(message, file)

    def error(self, message: str) -> NoReturn:
        message = re.sub(r"^argument ([^:]+): (is|has) ", r"\1 \2 ", message)
        wrong = re.search(r"unrecognized arguments: (--[\w-]+)", message)
        if wrong:
            before = f"; it comes before the study: {PROGRAM} --ranks N {self.prog.split()[-1]}"
            message += before if wrong[1] == "--ranks" else did_you_mean(wrong[1], self._option_string_actions)
        self.exit(2, f"{self.prog}: {message}\n(--help lists the options)\n")


def study_parser(description: str | None) -> argparse.ArgumentParser:
    """A parser with the option ``--output`` for the results folder.

    Args:
        description: the study's docstring; shown as it is.
    """
    parser = _Parser(description=description, formatter_class=_Help, allow_abbrev=False)
    parser.prog = f"{PROGRAM} {Path(parser.prog).stem}"
    results = parser.add_argument_group("results and parameters")
    results.add_argument(
        "--output", type=Path, default=None, metavar="DIR",
        help="folder for the results; a folder with results is refused (default: results/NAME, or results/NAME-2 and so on if "
        "that has results)",
    )  # fmt: skip
    add_flag(results, "--overwrite", "remove the results of the earlier run in the folder")
    results.add_argument(
        "--parameters", type=Path, default=None, metavar="FILE", dest="parameters_file",
        help="TOML file with options, such as parameters.toml of an earlier run; the command line takes precedence",
    )  # fmt: skip
    return parser


def _add(
    parser: argparse.ArgumentParser, name: str, default: object, text: str, unit: str = "", **kind: object
) -> None:
    shown = (f"{text} [{unit}]" if unit else text).replace("%", "%%")
    action = parser.add_argument(name, default=default, help=shown, **kind)  # type: ignore[arg-type]
    action.meaning, action.unit = text, unit or "-"  # type: ignore[attr-defined]


def add_number(
    parser: argparse.ArgumentParser,
    name: str,
    default: float | None,
    unit: str,
    text: str,
    *,
    above: float | None = None,
    at_least: float | None = None,
    below: float | None = None,
    at_most: float | None = None,
) -> None:
    """Add an option that takes a finite real number between bounds.

    Args:
        unit: shown in the help; "-" for a number without unit.
        text: what the number means.
        above, at_least, below, at_most: bounds; ``above`` and ``below`` exclude the bound itself.
    """
    bounds = [(above, "above", lambda x, b: x > b), (at_least, "at least", lambda x, b: x >= b)]
    bounds += [(below, "below", lambda x, b: x < b), (at_most, "at most", lambda x, b: x <= b)]
    given = [(bound, word, holds) for bound, word, holds in bounds if bound is not None]
    kind = "ratio" if text.startswith("ratio ") else "number"
    expected = " and ".join([f"{word} {bound:g}" for bound, word, _ in given])
    label = "" if unit == "-" else f" {unit}"

    def number(value: str) -> float:
        try:
            result = float(value)
        except ValueError:
            result = math.nan
        if not math.isfinite(result) or not all(holds(result, bound) for bound, _, holds in given):
            raise argparse.ArgumentTypeError(f"is '{value}', expected a {kind} {expected}{label}".replace("  ", " "))
        return result

    number.takes = "a number"  # type: ignore[attr-defined]
    _add(parser, name, default, text, unit, type=number, metavar="X")


def add_count(
    parser: argparse.ArgumentParser, name: str, default: int | None, text: str, *, choices: Sequence[int] | None = None
) -> None:
    """Add an option that takes a whole number from 1 on, or one of ``choices``."""
    expected = "a whole number from 1 on" if choices is None else "one of " + ", ".join(map(str, choices))

    def count(value: str) -> int:
        result = int(value) if value.isdecimal() else 0
        if result < 1 or (choices is not None and result not in choices):
            raise argparse.ArgumentTypeError(f"is '{value}', expected {expected}")
        return result

    count.takes = "a number"  # type: ignore[attr-defined]
    _add(parser, name, default, text, type=count, metavar="N")


def add_choice(
    parser: argparse.ArgumentParser, name: str, default: str | None, choices: Sequence[str], text: str
) -> None:
    """Add an option that takes one of some words."""

    def choice(value: str) -> str:
        if value not in choices:
            near = did_you_mean(value, choices)
            raise argparse.ArgumentTypeError(f"is '{value}', expected one of {', '.join(choices)}{near}")
        return value

    _add(parser, name, default, text, type=choice, metavar="|".join(choices))


def add_switch(parser: argparse.ArgumentParser, name: str, default: bool, text: str) -> None:
    """Add a pair of options, ``--name`` and ``--no-name``."""
    _add(parser, name, default, text, action=argparse.BooleanOptionalAction)


def add_flag(parser: argparse.ArgumentParser, name: str, text: str) -> None:
    """Add an option that is off unless it is named."""
    parser.add_argument(name, action="store_true", help=text)


def add_code(parser: argparse.ArgumentParser, name: str, metavar: str, text: str) -> None:
    """Add an option that names a file with code to run, and ``--allow-code``, without which only the command line may name it."""

    def existing(value: str) -> str:
        file, colon, rest = value.rpartition(":") if ":" in metavar else (value, "", "")
        return (
            f"{Path(file).resolve()}{colon}{rest}" if Path(file).is_file() else value
        )  # so that a restart elsewhere finds it

    action = parser.add_argument(name, type=existing, metavar=metavar, help=text)
    action.runs_code = True  # type: ignore[attr-defined]
    if "--allow-code" not in parser._option_string_actions:
        add_flag(
            parser,
            "--allow-code",
            "run the code that a file of parameters or a checkpoint names; see docs/howto/trust.md",
        )


def formerly(parser: argparse.ArgumentParser, old: str, name: str) -> None:
    """Accept an option by its name in an earlier version too, without dashes in front, with a warning."""
    next(action for action in parser._actions if name in action.option_strings).former = old  # type: ignore[attr-defined]


def check(parser: argparse.ArgumentParser, holds: bool, message: Callable[[], str] | str) -> None:
    """End with an error when options that depend on each other do not fit together.

    Example:
        >>> check(parser, options.dilation_angle <= options.friction_angle,
        ...       f"--dilation-angle is {options.dilation_angle:g}, expected at most --friction-angle")
    """
    if not holds:
        parser.error(message if isinstance(message, str) else message())
