"""Warnings of the library in the words of a study: its options in the place of arguments."""

from __future__ import annotations

import re
from argparse import ArgumentParser

OPTIONS = {
    "nmd=True": "--nmd",
    "nmd=False": "--no-nmd",
    "integration=MIXED": "--integration mixed",
    "integration=PARTICLES": "--integration particles",
    "second_order=True": "--second-order",
    "a smaller start": "a smaller --start",
    "a longer first_step": "a longer --first-step",
    "name it by crs=, for instance crs='EPSG:25832', or crs='local'": "name it by --crs EPSG:25832 for instance, or --crs local",
    "more steps of relaxation (max_steps of Solver), a tolerance as in practice (PRACTICE)": "--equilibrium practice",
}
"""Words of the library, and those of studies that have the option in them"""


def in_options(text: str, parser: ArgumentParser | None) -> str:
    """A message of the library with the options of a study in the place of arguments, as far as the study has them.

    Args:
        text: the message.
        parser: of the study; None leaves the message as it is.
    """
    if parser is None:
        return text
    options = {option: action for action in parser._actions for option in action.option_strings}
    words = {here: there for here, there in OPTIONS.items() if options.keys() & set(there.split())}
    elements = str(options["--elements"].metavar).split("|") if "--elements" in options else []
    quadratic = [name for name in ("P2", "P4") if name in elements]
    if "degree=" in text and quadratic:  # it is about elements, whose averages --nmd may not choose
        of_degree = "--elements " + " or ".join(quadratic)
        averaged = "P1-averaged" in elements
        words |= {
            "nmd=True, or elements of degree=2 or 4": f"--elements P1-averaged, or {of_degree}"
            if averaged
            else of_degree,
            "elements of degree=2 or 4": of_degree,
            "degree=2": f"--elements {quadratic[0]}",
            "degree=4": "--elements P4" if "P4" in elements else "degree=4",
            "nmd=True": "--elements P1-averaged" if averaged else "nmd=True",
        }
    if not words:
        return text
    longest_first = sorted(words, key=len, reverse=True)
    return re.sub("|".join(map(re.escape, longest_first)), lambda found: words[found.group()], text)
