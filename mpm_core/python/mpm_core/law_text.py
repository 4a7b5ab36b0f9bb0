"""Laws as texts, by which two of them are compared."""

from __future__ import annotations

from typing import Any

from . import _core
from .fingerprint import fingerprint

WITHOUT_STEPS = ("needs_cell_size", "strength_parameters", "library", "symbol")
"""Properties on which no step depends beside the others"""


def law_text(law: Any, skipped: tuple[str, ...] = WITHOUT_STEPS) -> str:
    """Text with the name and the parameters of a law and the laws within it, which differs between any two laws.

    Args:
        law: the law.
        skipped: names of properties that are left out.
    """
    texts = parameter_texts(law, skipped).items()
    return f"{type(law).__name__}({', '.join(f'{name}={text}' for name, text in texts)})"


def parameter_texts(law: Any, skipped: tuple[str, ...] = ()) -> dict[str, str]:
    """The parameters of a law by name, as texts; of one that is written in Python its code and values.

    Args:
        law: the law.
        skipped: names of properties that are left out.
    """
    names = sorted(name for name, value in vars(type(law)).items() if isinstance(value, property))
    return {name: _text(law, getattr(law, name), skipped) for name in names if name not in skipped}


def _text(law: Any, value: Any, skipped: tuple[str, ...]) -> str:
    if isinstance(value, tuple(_core.law_types)):
        return law_text(value, skipped)
    is_python = isinstance(law, _core.PythonLaw) and value is law.law
    return fingerprint(value) if is_python else repr(value)
