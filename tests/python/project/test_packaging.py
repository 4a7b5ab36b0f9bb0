"""What the packages say about themselves agrees, as far as it can be seen without building them."""

import re
from pathlib import Path

import pytest
import tomllib

import mpm_core

ROOT = Path(__file__).parents[3]
VERSION = mpm_core.__version__


def text(path):
    return (ROOT / path).read_text()


@pytest.fixture(scope="module")
def recipe():
    """The recipe of conda as conda-build would read it on Linux: its template filled, its selectors taken away."""
    jinja2 = pytest.importorskip("jinja2")
    yaml = pytest.importorskip("yaml")
    filled = jinja2.Template(text("packaging/conda/meta.yaml")).render(
        PYTHON="python", compiler=lambda language: f"gxx_{language}", stdlib=lambda language: f"sysroot_{language}"
    )
    return yaml.safe_load(re.sub(r".*# \[win.*\n", "", filled))


def test_the_version_is_the_same_everywhere():
    assert tomllib.loads(text("pyproject.toml"))["project"]["version"] == VERSION
    assert f"project(talus VERSION {VERSION} " in text("CMakeLists.txt")
    assert f"\nversion: {VERSION}\n" in text("CITATION.cff")
    assert f"\n## {VERSION}" in text("CHANGELOG.md")


def test_recipe_is_one(recipe):
    assert recipe["package"] == {"name": "talus-mpm", "version": VERSION}
    assert (ROOT / "packaging/conda" / recipe["source"]["path"]).resolve() == ROOT
    assert "TALUS_NATIVE=OFF" in recipe["build"]["script"][0]
    assert {"imports"} == set(recipe["test"])
    assert (ROOT / recipe["about"]["license_file"]).exists()


def test_recipe_needs_what_pip_needs(recipe):
    project = tomllib.loads(text("pyproject.toml"))
    needs = {word.split()[0] for kind in recipe["requirements"].values() for word in kind}
    wanted = [*project["build-system"]["requires"], *project["project"]["dependencies"]]
    assert {re.split(r"[>=<]", need)[0] for need in wanted} <= needs


def test_pip_brings_no_hdf5_beside_that_of_dolfinx():
    project = tomllib.loads(text("pyproject.toml"))["project"]
    wanted = [
        *project["dependencies"],
        *(need for extra in project["optional-dependencies"].values() for need in extra),
    ]
    assert not {"h5py", "netcdf4", "tables"} & {re.split(r"[>=<]", need)[0].lower() for need in wanted}


def test_dockerfile_names_files_and_options_that_there_are():
    dockerfile = text("packaging/Dockerfile")
    options = set(re.findall(r"-D(TALUS_\w+)=", dockerfile))
    assert options and all(f"option({option} " in text("CMakeLists.txt") for option in options)
    assert '"name": "release"' in text("CMakePresets.json") and "--preset release" in dockerfile
