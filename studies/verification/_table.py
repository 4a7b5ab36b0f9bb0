"""The table of all checks: as JSON, as a page, and as a page of the documentation that is made from the JSON alone."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from datetime import datetime, timezone
from pathlib import Path

from _case import Check, Result
from common.parameters import Parameter
from common.report import Report, Section, save_report
from common.versions import versions
from PIL import Image

DOCS_WIDTH = 900
COLUMNS = ("Quantity", "Expected", "Computed", "Error", "Tolerance", "Result", "Source of the expected value")


@dataclass
class CheckRow:
    """A check as it stands in the table; ``error`` is None when nothing was computed."""

    quantity: str
    expected: float
    source: str
    computed: float | None
    error: float | None
    tolerance: float
    unit: str
    kind: str
    limit: str
    passed: bool
    method: str = ""

    @property
    def verdict(self) -> str:
        return "pass" if self.passed else "known limit" if self.limit else "FAIL"

    def texts(self) -> dict[str, str]:
        """The row by `COLUMNS`."""
        unit = "" if self.unit == "-" else f" {self.unit}"
        sign = "" if self.kind == "=" else f"{self.kind} "
        error = "none" if self.error is None else percent(self.error)
        computed = "none" if self.computed is None else f"{self.computed:.5g}{unit}"
        expected = f"{sign}{self.expected:.5g}{unit}"
        values = self.quantity, expected, computed, error, percent(self.tolerance), self.verdict, self.source
        return dict(zip(COLUMNS, values, strict=True))


@dataclass
class CaseRow:
    """A case with its checks; ``figures`` are captions by file name, ``seconds`` processor time of the first rank."""

    name: str
    group: str
    title: str
    text: str
    checks: list[CheckRow]
    figures: dict[str, str]
    error: str
    seconds: float

    @property
    def passed(self) -> bool:
        return not self.error and all(check.passed or check.limit for check in self.checks)

    def rows(self) -> tuple[tuple[str, ...], list[list[str]], list[int]]:
        """Columns and rows of the table of the checks, and the numbers of the rows that fail.

        Where methods stand side by side, each has a column with its number and error, and the verdict is the worst one.
        """
        methods = tuple(dict.fromkeys(check.method for check in self.checks if check.method))
        if not methods:
            wrong = [k for k, check in enumerate(self.checks) if check.verdict == "FAIL"]
            return COLUMNS, [list(check.texts().values()) for check in self.checks], wrong
        first, last = COLUMNS[:2], COLUMNS[4:]
        others = ("Computed",) * any(not check.method for check in self.checks)
        groups: dict[tuple[str, ...], dict[str, CheckRow]] = {}
        for check in self.checks:
            key = tuple(check.texts()[name] for name in (*first, "Tolerance", COLUMNS[-1]))
            groups.setdefault(key, {})[check.method or "Computed"] = check
        rows, wrong = [], []
        for k, (key, by_method) in enumerate(groups.items()):
            cells = {name: check.texts() for name, check in by_method.items()}
            shown = [f"{cells[m]['Computed']} ({cells[m]['Error']})" if m in cells else "" for m in (*methods, *others)]
            verdict = max((check.verdict for check in by_method.values()), key=("pass", "known limit", "FAIL").index)
            rows.append([*key[:2], *shown, key[2], verdict, key[3]])
            wrong += [k] * (verdict == "FAIL")
        return (*first, *methods, *others, *last), rows, wrong

    def notes(self) -> list[str]:
        """Reasons of the known limits, each once."""
        return list(dict.fromkeys(f"Known limit: {c.limit}" for c in self.checks if c.limit and not c.passed))


@dataclass
class Table:
    """All cases of a run, when and with which versions."""

    date: str
    versions: dict[str, str]
    ranks: int
    quick: bool
    cases: list[CaseRow] = field(default_factory=list)

    @staticmethod
    def begun(quick: bool, ranks: int) -> Table:
        return Table(datetime.now(timezone.utc).isoformat(timespec="seconds"), versions(), ranks, quick)

    @property
    def passed(self) -> bool:
        return all(case.passed for case in self.cases)

    def summary(self) -> str:
        checks = [check for case in self.cases for check in case.checks]
        verdicts = [check.verdict for check in checks]
        errors = [case.name for case in self.cases if case.error]
        return (
            f"{_number(self.cases, 'case')}, {_number(checks, 'check')}: {verdicts.count('pass')} pass, "
            f"{verdicts.count('FAIL')} fail, {verdicts.count('known limit')} known limits"
            + (f"; errors in {', '.join(errors)}" if errors else "")
        )


def _number(things: Sequence[object], noun: str) -> str:
    """How many there are, in words."""
    return f"{len(things)} {noun}{'' if len(things) == 1 else 's'}"


def percent(fraction: float) -> str:
    """A fraction as a percentage with two digits that count."""
    return f"{100 * fraction:.2g} %" if fraction < 10 else "> 1000 %"


def case_row(name: str, group: str, docstring: str, result: Result, error: str, seconds: float) -> CaseRow:
    """The row of a case; its docstring gives title and text."""
    title, _, text = docstring.strip().partition("\n")
    paragraphs = [" ".join(part.split()) for part in text.strip().split("\n\n")]
    checks = [
        CheckRow(c.quantity, float(c.expected), _with_scale(c), _finite(c.computed), _finite(c.error), float(c.tolerance),
                 c.unit, c.kind.value, c.limit, bool(c.passed), c.method)
        for c in result.checks
    ]  # fmt: skip
    return CaseRow(
        name, group, title.rstrip("."), "\n\n".join(paragraphs), checks, result.figures, error, round(seconds, 1)
    )


def _with_scale(check: Check) -> str:
    """The source of the expected value, and the scale of the error where that is another number."""
    return f"{check.source}; error over {check.over}" if check.over else check.source


def _finite(value: float) -> float | None:
    return float(value) if abs(value) < float("inf") else None


def save_table(path: Path, table: Table) -> None:
    """Write the table as JSON; the file appears as a whole or not at all."""
    aside = path.with_name(path.name + ".part")
    aside.write_text(
        json.dumps({**asdict(table), "passed": table.passed}, indent=1, ensure_ascii=False) + "\n", "utf-8"
    )
    os.replace(aside, path)


def read_table(path: Path) -> Table:
    """The table that `save_table` wrote."""
    data = json.loads(path.read_text("utf-8"))
    cases = [CaseRow(**{**case, "checks": [CheckRow(**check) for check in case["checks"]]}) for case in data["cases"]]
    return Table(data["date"], data["versions"], data["ranks"], data["quick"], cases)


# --- pages ---------------------------------------------------------------------------------------------------------


def save_page(folder: Path, table: Table, parameters: Sequence[Parameter] = ()) -> None:
    """Write report.html; the pictures are in a folder for each case."""
    sections = []
    for case in table.cases:
        text = "\n\n".join(
            [case.text, *([f"The case ended with an error: {case.error}"] if case.error else []), *case.notes()]
        )
        columns, rows, wrong = case.rows()
        figures = {folder / case.name / name: f"{caption}" for name, caption in case.figures.items()}
        sections.append(Section(f"{case.group}: {case.title}", text, columns, rows, wrong, figures))
    rows = [
        [case.group, case.title, f"{len(case.checks)}", f"{sum(c.passed for c in case.checks)}",
         f"{sum(c.verdict == 'known limit' for c in case.checks)}",
         "error" if case.error else f"{sum(c.verdict == 'FAIL' for c in case.checks)}", f"{case.seconds:.0f} s"]
        for case in table.cases
    ]  # fmt: skip
    wrong = [k for k, case in enumerate(table.cases) if not case.passed]
    head = Section(
        "All cases", "", ("Group", "Case", "Checks", "Pass", "Known limits", "Fail", "Processor time"), rows, wrong
    )
    save_report(folder / "report.html", Report(
        "Verification and validation", table.summary(), {"of all checks" if table.passed else "at least one": "pass" if
        table.passed else "FAIL"}, sections=[head, *sections], parameters=parameters, footer=_made(table),
    ))  # fmt: skip


def _made(table: Table) -> str:
    shown = ", ".join(f"{name.replace('_', ' ')} {value}" for name, value in table.versions.items())
    size = "small sizes" if table.quick else "full sizes"
    return (
        f"Computed on {table.date[:10]} with {size} on {table.ranks} rank{'s' * (table.ranks > 1)}. Versions: {shown}."
    )


def save_docs(docs: Path, folder: Path, table: Table, order: Sequence[str]) -> None:
    """Write verification.md, and beside it what it is made from: verification.json and the pictures.

    Cases that this run left out keep their rows and pictures. order: names of all cases there are.
    """
    images = docs / "images" / "verification"
    images.mkdir(parents=True, exist_ok=True)
    rows = {case.name: case for case in read_table(docs / "verification.json").cases}
    rows |= {case.name: case for case in table.cases}
    table = replace(table, cases=[rows[name] for name in order if name in rows])
    for case in table.cases:
        for name in case.figures:
            if (folder / case.name / name).exists():
                save_small(folder / case.name / name, images / f"{case.name}_{name}")
    wanted = {f"{case.name}_{name}" for case in table.cases for name in case.figures}
    for path in images.iterdir():
        if path.name not in wanted:
            path.unlink()
    save_table(docs / "verification.json", table)
    (docs / "verification.md").write_text(docs_page(table), "utf-8")


def save_small(picture: Path, path: Path) -> None:
    """A copy of a PNG file for the repository: at most `DOCS_WIDTH` pixels wide, with a palette."""
    image = Image.open(picture).convert("RGB")
    image.thumbnail((DOCS_WIDTH, 2 * DOCS_WIDTH), Image.Resampling.LANCZOS)
    # Colours that cover thin lines and small marks too, then moved to where most pixels are.
    image.quantize(256, method=Image.Quantize.MAXCOVERAGE, kmeans=1).save(path, optimize=True)


def docs_page(table: Table) -> str:
    """The page of the documentation, from the table alone."""
    parts = [
        "# Verification and validation",
        "`studies/run verification` repeats all of this and writes it as one page; `--cases` chooses cases, "
        f"`--quick` takes small sizes. This page was made by `studies/run verification --docs`.\n\n{_made(table)}\n\n"
        f"**{table.summary()}.** The error is a fraction of the expected value, or of the scale that the source names. "
        "A known limit is a number that the method is known not to reach; it is shown with its reason.",
    ]
    for group in dict.fromkeys(case.group for case in table.cases):
        parts.append(f"## {group}")
        parts += [_docs_case(case) for case in table.cases if case.group == group]
    return "\n\n".join(parts) + "\n"


def _docs_case(case: CaseRow) -> str:
    columns, found, _ = case.rows()
    rows = [columns, ["---"] * len(columns), *found]
    table = "\n".join("| " + " | ".join(text.replace("|", "\\|") for text in row) + " |" for row in rows)
    figures = [
        f"![{caption}](images/verification/{case.name}_{name})\n\n*{caption}*" for name, caption in case.figures.items()
    ]
    error = [f"The case ended with an error: {case.error}"] if case.error else []
    source = f"`studies/verification/{case.name}.py`, {case.seconds:.0f} s of processor time"
    return "\n\n".join([f"### {case.title}", case.text, source, *error, table, *case.notes(), *figures])
