"""Every Python block in the README and in docs/ runs, page by page, and every option named there exists."""

import functools
import importlib
import inspect
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from study_main import main

import fenics_bridge.water
import mpm_core

ROOT = Path(__file__).parents[3]
SHIPPED = {path.stem for path in (ROOT / "studies").glob("*.py")}
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```", re.DOTALL | re.MULTILINE)


def blocks(page, *languages):
    return [text for language, text in BLOCK.findall(page.read_text()) if language in languages]


def name(page):
    return str(page.relative_to(ROOT))


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """The folder results/ with a short run of the study slope in it, for pages that read from there."""
    folder = tmp_path_factory.mktemp("results")
    assert main("slope", ["--time", "0.1", "--frames", "2", "--output", folder / "slope"]) == 0
    return folder


@pytest.mark.parametrize("page", [page for page in PAGES if blocks(page, "python")], ids=name)
def test_the_blocks_of_a_page_run_one_after_the_other(page, tmp_path, results):
    script = tmp_path / "page.py"
    script.write_text("\n".join(blocks(page, "python")))
    if "results/" in script.read_text():
        (tmp_path / "results").symlink_to(results)
    paths = [str(ROOT), os.environ.get("PYTHONPATH", "")]
    ran = subprocess.run(
        [sys.executable, "-W", "error::DeprecationWarning:__main__", script], cwd=tmp_path, capture_output=True, text=True,
        timeout=120, env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)},
    )  # fmt: skip
    assert ran.returncode == 0, ran.stderr


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_every_block_says_what_it_is(page):
    """So that no Python block escapes: each fence is closed and of a kind that is run, or checked, or shows output; none is
    an indented block."""
    fences = re.findall(r"^\s*(```|~~~|:::)(\S*)", page.read_text(), re.MULTILINE)
    kinds = [kind for _, kind in fences[::2]]
    assert all(end == "" for _, end in fences[1::2]) and len(fences) % 2 == 0
    assert {fence for fence, _ in fences} <= {"```"}
    assert set(kinds) <= {"python", "console", "bash", "toml", "text", "{toctree}", "{eval-rst}"}
    assert kinds.count("python") == len(blocks(page, "python"))
    assert re.findall(r"\n\n {4}\S.*", BLOCK.sub("", page.read_text())) == []


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_no_line_of_a_page_begins_with_a_per_cent_sign(page):
    """MyST takes such a line for a comment and leaves it out."""
    assert re.findall(r"^\s*%.*", BLOCK.sub("", page.read_text()), re.MULTILINE) == []


@pytest.mark.parametrize("page", [page for page in PAGES if blocks(page, "toml")], ids=name)
def test_toml_blocks_are_parameters_of_the_study_that_the_page_runs_with_them(page, tmp_path, capsys):
    for shipped in (ROOT / "meshes").iterdir():  # files of sites that a block extends
        (tmp_path / shipped.name).symlink_to(shipped)
    for block in blocks(page, "toml"):
        file = tmp_path / re.match(r"# (\w+\.toml)", block).group(1)
        assert not file.exists(), f"a file of this name is shipped, or is on the page twice: {file.name}"
        file.write_text(block)
        if "extends" in block:
            importlib.import_module("common.site.keys").read_site_table(file)
            continue
        study = re.search(rf"studies/run (\w+) --parameters {file.name}", page.read_text()).group(1)
        with pytest.raises(SystemExit) as ended:
            main(study, ["--parameters", file, "--help"])
        assert ended.value.code == 0, capsys.readouterr().err


def named_options(page):
    """(study, option) pairs in the lines of a page that call studies/run; after a study within a sweep the options are its own."""
    text = "\n".join([*blocks(page, "console", "bash"), *re.findall(r"`(studies/run [^`]+)`", page.read_text())])
    for call in re.findall(r"studies/run (?:--ranks \S+ )?(\w+)( --[^\n&]*)", text.replace("\\\n", " ")):
        study = call[0]
        for word in call[1].split():
            study = word if call[0] == "sweep" and word in SHIPPED else study
            if re.match("--[a-z-]+", word):
                yield study, re.match("--[a-z-]+", word).group()


def test_options_named_in_the_pages_exist(capsys):
    named = {pair for page in PAGES for pair in named_options(page) if pair[0].islower()}
    assert {("slope", "--paper"), ("sweep", "--vary"), ("safety", "--meshes")} <= named
    help_of = {}
    for study in {study for study, _ in named}:
        with pytest.raises(SystemExit) as ended:
            main(study, ["--help"])
        assert ended.value.code == 0
        help_of[study] = capsys.readouterr().out
    missing = [(study, option) for study, option in sorted(named) if option not in help_of[study]]
    assert missing == []


def test_files_that_pages_link_to_exist():
    for page in PAGES:
        for target in re.findall(r"\]\((?!http|#)([^)#]+)\)", page.read_text()):
            assert (page.parent / target).exists(), f"{name(page)} links to {target}"


def test_files_that_pages_name_are_there():
    sources = ("h", "cpp", "py", "toml", "md", "geo", "yaml", "cff")
    for page in (*PAGES, ROOT / "CONTRIBUTING.md", ROOT / "meshes/README.md"):
        for path in re.findall(rf"`([\w/*.]+/[\w*.]+\.(?:{'|'.join(sources)}))`", page.read_text()):
            if not path.startswith("results/") and "NAME" not in path:
                found = [hit for folder in (ROOT, ROOT / "mpm_core") for hit in folder.glob(path)]
                assert found, f"{name(page)} names {path}"


def test_every_equation_has_a_number_and_those_that_the_code_cites_are_there():
    text = (ROOT / "docs/guide/theory.md").read_text()
    numbers = [re.findall(r"\\tag\{(.*?)\}", equation) for equation in re.findall(r"\$\$(.*?)\$\$", text, re.DOTALL)]
    assert all(
        len(found) == 1 for found in numbers
    ), "an equation without \\tag{...}: T and a number if it is not in the paper"
    there = {number.strip() for (found,) in numbers for number in found.split(",")}
    sources = [path.read_text() for path in (ROOT / "mpm_core").rglob("*.h")]
    cited = {number for source in sources for number in re.findall(r"\((1[1-9]|2\d)\)", source)}
    assert {"11", "18", "24"} <= cited <= there


def test_every_public_name_of_the_core_is_in_the_reference():
    reference = (ROOT / "docs/api/mpm_core.md").read_text()
    missing = [one for one in mpm_core.__all__ if one != "__version__" and f"mpm_core.{one}" not in reference]
    assert missing == []


def named_in_the_glossary():
    """(module, dotted name, argument or None) of each name in the column of names of the glossary."""
    rows = re.findall(r"^\|(.*?)\|(.*?)\|(.*?)\|(.*?)\|$", (ROOT / "docs/guide/glossary.md").read_text(), re.MULTILINE)
    names = [name for _, _, names, _ in rows for name in re.findall(r"`([^`]+)`", names)]
    return [re.fullmatch(r"(mpm|bridge)\.([\w.]+)(?:\((\w+)=\))?", name).groups() for name in names]


def attribute(owner, name):
    """An attribute of a class, or None for one that only its objects have."""
    declared = inspect.get_annotations(owner) if inspect.isclass(owner) else {}
    return None if name in declared else getattr(owner, name)


@pytest.mark.parametrize(("module", "name", "argument"), named_in_the_glossary())
def test_names_in_the_glossary_exist(module, name, argument):
    found = functools.reduce(attribute, name.split("."), {"mpm": mpm_core, "bridge": fenics_bridge}[module])
    assert argument is None or argument in inspect.signature(found).parameters


def test_no_term_of_the_glossary_stands_there_twice():
    rows = re.findall(r"^\| (.+?) \|", (ROOT / "docs/guide/glossary.md").read_text(), re.MULTILINE)
    terms = [term for row in rows if row not in ("term", "---") for term in row.split(", ")]
    assert len(terms) > 50 and len(terms) == len(set(terms))


def test_the_diagonals_of_the_grid_in_the_page_on_contact_alternate():
    """With one direction sand behind a smooth wall has three quarters of Rankine's active pressure (docs/howto/mesh.md)."""
    names = {}
    exec(blocks(ROOT / "docs/contact.md", "python")[0].split("\nsand = ")[0], names)
    mesh = names["grid"](2.0, 1.0, 0.25)
    assert mesh.cell_volumes.sum() == pytest.approx(2.0) and len(mesh.cells) == 64
    corners = mesh.points[mesh.cells]
    edges = corners - corners[:, [1, 2, 0]]
    rising = np.sign((edges[..., 0] * edges[..., 1]).sum(axis=1))  # of the diagonal: the other edges are along the axes
    assert np.count_nonzero(rising > 0) == np.count_nonzero(rising < 0) == 32
