"""What all tests of studies need."""

import re
from pathlib import Path

import pytest

NAMES_FILES_OR_COMMANDS = re.compile(rb"\b(?:Include|Merge\w*|Open|\w*System\w*|OnelabRun)\b")


def text_of(path):
    """The text of a file for gmsh; where constants stand before the file that they are for, with it in its place."""
    text = path.read_bytes()
    with_constants = re.fullmatch(rb'((?:\w+ = \S+;\n)+)Include "(.*)";\n', text)
    return with_constants[1] + Path(with_constants[2].decode()).read_bytes() if with_constants else text


@pytest.fixture(scope="session", autouse=True)
def meshes_are_read_once():
    """A process of gmsh takes a quarter of a second, and most tests of a file have their site on one mesh."""
    # Not above: a process that hands tests out to others, which start mpirun, must not begin MPI itself.
    from fenics_bridge.mesh import meshes

    known, read = {}, meshes.read_apart

    def read_or_known(path, dim, result, name, limits):
        text = text_of(path)
        if NAMES_FILES_OR_COMMANDS.search(text):
            return read(path, dim, result, name, limits)
        key = text, path.suffix, dim, limits
        if key not in known:
            known[key] = read(path, dim, result, name, limits)
        return {name: array.copy() for name, array in known[key].items()}

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(meshes, "read_apart", read_or_known)
        yield
