"""The parameters that laws declare, for signatures and for the page of the documentation."""

from __future__ import annotations

import inspect
from typing import Any

from ._core import LawParameter, law_types


def signature_of(law: Any) -> inspect.Signature:
    """The signature of a law's constructor: its parts first, then its parameters, by name only."""
    kinds = inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY
    parts = [p for p in law.parameters if p.unit is None]
    # A part that need not be given stands among the parameters by name, since those that are needed follow it
    before = [p for p in parts if p.needed]
    after = [p for p in law.parameters if p.unit is not None] + [p for p in parts if not p.needed]
    return inspect.Signature([_argument(p, kinds[0]) for p in before] + [_argument(p, kinds[1]) for p in after])


def _argument(parameter: LawParameter, kind: Any) -> inspect.Parameter:
    default = inspect.Parameter.empty if parameter.needed else parameter.default
    annotation = inspect.Parameter.empty if parameter.unit is None else float
    return inspect.Parameter(parameter.name, kind, default=default, annotation=annotation)


def parameter_page() -> str:
    """The page of the documentation with the parameters of all laws, as Markdown."""
    lines = [
        "# Parameters of the laws",
        "",
        "All laws with their parameters, as the laws declare them. Written by `python3 -m mpm_core.law_parameters`.",
    ]
    for law in law_types:
        summary = law.__doc__.split("\n\n")[0]
        lines += ["", f"## {law.__name__}", "", summary, "", "| parameter | unit | range | default | meaning |"]
        lines += ["| --- | --- | --- | --- | --- |"]
        lines += [_row(parameter) for parameter in law.parameters]
    return "\n".join(lines) + "\n"


def _row(p: LawParameter) -> str:
    default = "" if p.needed else "no limit" if p.unit is not None and p.default is None else _shown(p.default)
    return f"| `{p.name}` | {p.unit or ''} | {p.range} | {default} | {p.meaning} |"


def _shown(value: float | None) -> str:
    return "" if value is None else f"{value:g}"


if __name__ == "__main__":
    print(parameter_page(), end="")
