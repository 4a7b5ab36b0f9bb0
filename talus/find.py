"""Folders of studies: those of Talus, and those of the user."""

from __future__ import annotations

import ast
import os
import tokenize
from pathlib import Path
from tokenize import COMMENT, NL, STRING

PACKAGE = Path(__file__).parent
SHIPPED = PACKAGE / "studies" if (PACKAGE / "studies").is_dir() else PACKAGE.parent / "studies"
"""The studies of Talus, in the installed package or in the source tree"""


def folders() -> list[Path]:
    """Folders with studies: the present one, those that ``TALUS_STUDIES`` names, and that of Talus; the first one wins."""
    named = [Path(word) for word in os.environ.get("TALUS_STUDIES", "").split(os.pathsep) if word]
    return [Path.cwd(), *named, SHIPPED]


def studies() -> dict[str, Path]:
    """Scripts of all studies by name. A script of the user counts when it makes its options by ``study_parser``."""
    found: dict[str, Path] = {}
    for folder in folders():
        scripts = sorted([*folder.glob("*.py"), *folder.glob("*/__main__.py")])
        for path in scripts:
            name = path.parent.name if path.stem == "__main__" else path.stem
            if folder == SHIPPED or "study_parser(" in path.read_text(encoding="utf-8", errors="replace"):
                found.setdefault(name, path)
    return found


def study_path(name: str) -> Path | None:
    """The script of a study by its name, or by its path; None where there is none."""
    if name.endswith(".py"):
        return Path(name) if Path(name).is_file() else None
    return studies().get(name)


def purpose(path: Path) -> str:
    """The first line of a script's docstring; to parse all of each script would take most of the time of ``talus list``."""
    with open(path, encoding="utf-8") as file:
        try:
            first = next(t for t in tokenize.generate_tokens(file.readline) if t.type not in (COMMENT, NL))
            return str(ast.literal_eval(first.string)).split("\n")[0] if first.type == STRING else ""
        except (SyntaxError, ValueError, tokenize.TokenError, UnicodeDecodeError, StopIteration):
            return ""
