"""Options of the files for ParaView: which fields, how exact, how small."""

from __future__ import annotations

import argparse
from collections.abc import Sequence


def add_output_options(parser: argparse.ArgumentParser, names: Sequence[str]) -> None:
    """Options ``--fields``, ``--float64`` and ``--compression``.

    Args:
        names: fields of particles that there are; positions are always written.
    """

    def fields(text: str) -> str:
        wrong = [name for name in text.split(",") if name not in names]
        if wrong:
            raise argparse.ArgumentTypeError(f"has '{wrong[0]}', expected some of {','.join(names)}")
        return text

    def level(text: str) -> int:
        if text not in list("0123456789"):
            raise argparse.ArgumentTypeError(f"is '{text}', expected a whole number from 0 to 9")
        return int(text)

    level.takes = "a number"  # type: ignore[attr-defined]
    parser.add_argument(
        "--fields", type=fields, default=",".join(names), metavar="A,B,...",
        help="particle fields to store, beside the position (default: all)",
    )  # fmt: skip
    parser.add_argument("--float64", action="store_true", help="store fields in double precision")
    parser.add_argument(
        "--compression",
        type=level,
        default=0,
        metavar="N",
        help="level of compression of the files, 0 to 9 (default: 0)",
    )
