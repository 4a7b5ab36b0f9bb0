"""The layout of the core: which folder may include which, and that the compiled module is the one imported."""

import re
from pathlib import Path

import pytest

CORE = Path(__file__).parents[2] / "mpm_core"

# The folders of the core from the lowest floor up, and what each may include besides itself; an include points down, never up.
BELOW_STEPS = {"base", "mesh", "materials", "particles", "parallel", "transfer"}
MAY_SEE = {
    "base": set(),
    "mesh": {"base"},
    "materials": {"base"},
    "particles": {"base", "mesh"},
    "parallel": {"base", "mesh", "particles"},
    "transfer": {"base", "mesh", "materials", "particles", "parallel"},
    "model": BELOW_STEPS,
    "explicit": BELOW_STEPS | {"model"},
    "implicit": BELOW_STEPS | {"model", "explicit"},
    "io": BELOW_STEPS,
    "python": BELOW_STEPS | {"model", "explicit", "implicit", "io"},
}


def includes(source):
    """Names that a source file includes, in either form of brackets."""
    return re.findall(r'^\s*#\s*include\s*["<]([^">]+)[">]', source.read_text(encoding="utf-8"), re.MULTILINE)


def sources(floor):
    return [path for path in (CORE / floor).rglob("*") if path.suffix in {".h", ".cpp"}]


def test_every_folder_with_sources_is_a_known_floor():
    folders = {path.relative_to(CORE).parts[0] for path in CORE.rglob("*") if path.suffix in {".h", ".cpp"}}
    assert folders <= set(MAY_SEE)


@pytest.mark.parametrize("floor", MAY_SEE)
def test_includes_point_down(floor):
    wrong = []
    for source in sources(floor):
        for name in includes(source):
            folder = name.split("/")[0]
            if "/" in name and folder in MAY_SEE and folder not in MAY_SEE[floor] | {floor}:
                wrong.append(f"{source.relative_to(CORE)} includes {name}")
    assert not wrong


@pytest.mark.parametrize("floor", MAY_SEE)
def test_includes_of_the_core_name_their_floor(floor):
    own = {path.name for folder in MAY_SEE for path in sources(folder)}
    bare = [(source.name, name) for source in sources(floor) for name in includes(source) if name in own]
    assert not bare


def test_only_io_includes_hdf5():
    users = {floor for floor in MAY_SEE for source in sources(floor) if any("hdf5" in n for n in includes(source))}
    assert users <= {"io"}


def test_the_compiled_module_is_imported():
    # The folder mpm_core/ of the repository has no __init__.py: without an installed package it would be imported,
    # in silence, as an empty one.
    import mpm_core._core as core

    import mpm_core

    assert mpm_core.__file__ is not None
    assert Path(core.__file__).suffix == ".so"
    assert Path(mpm_core.__file__).parent == Path(core.__file__).parent
