"""A new study of the user's own, from a commented script and a geometry that run as they are."""

from __future__ import annotations

import keyword
from pathlib import Path

from talus.find import PACKAGE, SHIPPED

TEMPLATE = PACKAGE / "template"


def begin(name: str, folder: Path) -> str:
    """Write NAME.py and NAME.geo into a folder; returns what to do with them.

    Raises:
        ValueError: the name cannot be that of a script, or is that of a study of Talus.
        FileExistsError: one of the files is there.
    """
    if not name.isidentifier() or keyword.iskeyword(name):
        raise ValueError(f"the name is '{name}', expected letters, digits and underscores, as for a variable in Python")
    if (SHIPPED / f"{name}.py").exists() or (SHIPPED / name).exists():
        raise ValueError(f"the name is '{name}', which is that of a study of Talus; expected another one")
    files = {folder / f"{name}{suffix}": TEMPLATE / f"study{suffix}.txt" for suffix in (".py", ".geo")}
    for path in files:
        if path.exists():
            raise FileExistsError(f"{path} is there already; it has been left as it is")
    for path, template in files.items():
        path.write_text(template.read_text(encoding="utf-8").replace("NAME", name), encoding="utf-8")
    return (f"{name}.py and {name}.geo are written. Next:\n  talus run {name} --help\n  talus run {name}\n"
            f"  talus run --ranks 2 {name}")  # fmt: skip
