"""Wrong arguments of constitutive laws, in words instead of the overloads of the binding."""

from __future__ import annotations

import functools
import re
from difflib import get_close_matches
from typing import Any

from ._core import InputError


def _parameters(law: Any) -> tuple[dict[str, bool], list[str]]:
    """Names of the parameters and whether each must be given; and those that may be given without a name."""
    signature = str(law.__init__.__doc__).split("\n", 1)[0]
    positional, _, keywords = signature.partition("*, ")
    names = r"(\w+): (.*?)(?=, \w+: |, $|\) -> )"
    before = re.findall(names, positional.partition(", ")[2])
    return {name: " = " not in rest for name, rest in before + re.findall(names, keywords)}, [
        name for name, _ in before
    ]


def _complaint(
    name: str, known: dict[str, bool], positional: list[str], args: tuple[Any, ...], given: dict[str, Any]
) -> str | None:
    """What is wrong with the arguments; None where it is neither their names nor their number."""
    everything = f"{name} has {', '.join(known)}"
    for unknown in (key for key in given if key not in known):
        near = get_close_matches(unknown, known, n=1)
        meant = f"; did you mean {near[0]}?" if near else "."
        return f"{unknown} is no parameter of {name}{meant} {everything}"
    if len(args) > len(positional):
        first = args[len(positional)]
        return f"{name} got {first!r} without a name, expected parameters by name, such as {[*known][len(positional)]}=. {everything}"
    missing = [
        key for key, needed in known.items() if needed and key not in given and key not in positional[: len(args)]
    ]
    if missing:
        return f"{name} lacks {', '.join(missing)}. {everything}"
    for key, value in given.items():
        if isinstance(value, str):
            return f"{key} of {name} is {value!r}, expected a number"
    return None


def explain_arguments(law: Any) -> None:
    """Let a law's constructor raise InputError that names the parameter that is unknown, missing or without a name."""
    (known, positional), construct = _parameters(law), law.__init__

    @functools.wraps(construct)
    def checked(self: Any, *args: Any, **given: Any) -> None:
        try:
            construct(self, *args, **given)
        except TypeError:
            complaint = _complaint(law.__name__, known, positional, args, given)
            if complaint is None:
                raise
            raise InputError(complaint) from None

    if len(known) > len(positional):
        law.__init__ = checked
