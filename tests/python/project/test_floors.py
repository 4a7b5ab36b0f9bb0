"""The layout: which folder of the core may include which, that Python modules import in no circle, which core is imported."""

import ast
import re
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
CORE = ROOT / "mpm_core"


def declared_layers():
    """By folder of the core, the folders below it: what `base/layers.h` lets its namespace use, and what lies below those."""
    below = {}
    header = (CORE / "base" / "layers.h").read_text(encoding="utf-8")
    for name, body in re.findall(r"^namespace (\w+)\n\{\n((?:using namespace \w+;\n)*)\}", header, re.MULTILINE):
        used = re.findall(r"using namespace (\w+);", body)
        below[name] = set(used).union(*(below[layer] for layer in used))
    return {folder_of(name): {folder_of(layer) for layer in layers} for name, layers in below.items()}


def folder_of(namespace):
    return namespace.removesuffix("_scheme")


MAY_SEE = declared_layers()


def includes(source):
    """Names that a source file includes, in either form of brackets."""
    return re.findall(r'^\s*#\s*include\s*["<]([^">]+)[">]', source.read_text(encoding="utf-8"), re.MULTILINE)


def sources(floor):
    return [path for path in (CORE / floor).rglob("*") if path.suffix in {".h", ".cpp"}]


def test_every_folder_with_sources_is_a_layer():
    folders = {path.relative_to(CORE).parts[0] for path in CORE.rglob("*") if path.suffix in {".h", ".cpp"}}
    assert folders == set(MAY_SEE)


@pytest.mark.parametrize("floor", MAY_SEE)
def test_namespaces_follow_folders(floor):
    namespaces = {
        name
        for path in sources(floor)
        for name in re.findall(r"^namespace mpm::(\w+)", path.read_text(encoding="utf-8"), re.MULTILINE)
    }
    assert {folder_of(name) for name in namespaces} == {floor}


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


def imported(module, path, modules):
    """Modules of a package that one of its modules imports when it runs, not only for its types."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for branch in [n for n in ast.walk(tree) if isinstance(n, ast.If) and "TYPE_CHECKING" in ast.unparse(n.test)]:
        branch.body = []
    here = module if path.name == "__init__.py" else module.rpartition(".")[0]
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (one.name for one in node.names if one.name in modules)
        elif isinstance(node, ast.ImportFrom):
            above = ".".join(here.split(".")[: len(here.split(".")) - node.level + 1])
            base = ".".join(filter(None, [above if node.level else "", node.module]))
            for one in node.names:
                if f"{base}.{one.name}" in modules:
                    yield f"{base}.{one.name}"
                elif base in modules and one.name != "_core":
                    yield base


@pytest.mark.parametrize(
    "package", ["mpm_core/python/mpm_core", "fenics_bridge", "studies/common", "particle_player", "talus"]
)
def test_python_modules_import_in_no_circle(package):
    folder = ROOT / package
    modules = {}
    for path in folder.rglob("*.py"):
        parts = path.relative_to(folder.parent).with_suffix("").parts
        modules[".".join(parts[:-1] if path.name == "__init__.py" else parts)] = path
    graph = {name: set(imported(name, path, modules)) - {name} for name, path in modules.items()}
    assert sum(map(len, graph.values())) >= len(graph) - 1  # the imports were found
    list(TopologicalSorter(graph).static_order())  # CycleError names a circle


def test_the_compiled_module_is_imported():
    # The folder mpm_core/ of the repository has no __init__.py: without an installed package it would be imported,
    # in silence, as an empty one.
    import mpm_core._core as core

    import mpm_core

    assert mpm_core.__file__ is not None
    assert Path(core.__file__).suffix == ".so"
    assert Path(mpm_core.__file__).parent == Path(core.__file__).parent
