"""Every Python block in the README and in docs/ runs, page by page, and every option named there exists."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```", re.DOTALL | re.MULTILINE)


def blocks(page, *languages):
    return [text for language, text in BLOCK.findall(page.read_text()) if language in languages]


def name(page):
    return str(page.relative_to(ROOT))


@pytest.mark.parametrize("page", [page for page in PAGES if blocks(page, "python")], ids=name)
def test_the_blocks_of_a_page_run_one_after_the_other(page, tmp_path):
    script = tmp_path / "page.py"
    script.write_text("\n".join(blocks(page, "python")))
    paths = [str(ROOT), os.environ.get("PYTHONPATH", "")]
    ran = subprocess.run(
        [sys.executable, "-W", "error::DeprecationWarning:__main__", script], cwd=tmp_path, capture_output=True, text=True,
        timeout=120, env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)},
    )  # fmt: skip
    assert ran.returncode == 0, ran.stderr


def named_options(page):
    """(study, option) pairs in the lines of a page that call studies/run."""
    text = "\n".join([*blocks(page, "console", "bash"), *re.findall(r"`(studies/run [^`]+)`", page.read_text())])
    for call in re.findall(r"studies/run (?:--ranks \S+ )?(\w+)( --[^\n&]*)", text.replace("\\\n", " ")):
        for option in re.findall(r"(--[a-z-]+)", call[1]):
            yield call[0], option


@pytest.fixture(scope="module")
def help_of():
    known = {}

    def text(study):
        if study not in known:
            script = next(
                p for p in (ROOT / f"studies/{study}.py", ROOT / f"studies/{study}/__main__.py") if p.exists()
            )
            command = [sys.executable, script, "--help"]
            known[study] = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60).stdout
        return known[study]

    return text


def test_options_named_in_the_pages_exist(help_of):
    named = {pair for page in PAGES for pair in named_options(page) if pair[0].islower()}
    assert ("slope", "--paper") in named
    missing = [(study, option) for study, option in sorted(named) if option not in help_of(study)]
    assert missing == []


def test_files_that_pages_link_to_exist():
    for page in PAGES:
        for target in re.findall(r"\]\((?!http|#)([^)#]+)\)", page.read_text()):
            assert (page.parent / target).exists(), f"{name(page)} links to {target}"
