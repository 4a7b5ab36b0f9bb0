"""A text that differs between any two objects written in Python, by their loaded code and their values; a number for a mesh.

Loaded code rather than source: the file may have changed since, and a class typed at a prompt has none. Code of libraries
counts by its name.
"""

from __future__ import annotations

import functools
import hashlib
import sys
import sysconfig
import types
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

if TYPE_CHECKING:
    from .mesh import Mesh

_LIBRARIES = tuple(
    {sysconfig.get_path(name) for name in ("stdlib", "platstdlib", "purelib", "platlib")} | {"/usr/lib/python3"}
)
_PLAIN = (type(None), bool, int, float, complex, str, bytes, type(...))
_SKIPPED = {"__dict__", "__weakref__", "__doc__", "__module__", "__firstlineno__", "__static_attributes__"}


def fingerprint(value: Any) -> str:
    """Name of the class, public attributes that are plain numbers or texts, and a hash of all code and values.

    Attributes whose names begin with an underscore do not count: what an object computes as it goes belongs there.
    """
    digest = _Digest()
    digest.take(value)
    plain = {k: v for k, v in sorted(_attributes(value).items()) if isinstance(v, (bool, int, float, str))}
    shown = "".join(f"{name}={value!r}, " for name, value in plain.items())
    version = ".".join(map(str, sys.version_info[:2]))
    return f"{type(value).__qualname__}({shown}code and values of Python {version} {digest.hash.hexdigest()[:32]})"


def _attributes(value: Any) -> dict[str, Any]:
    slots = [name for kind in type(value).__mro__ for name in getattr(kind, "__slots__", ())]
    found = {name: getattr(value, name) for name in slots if hasattr(value, name)} | getattr(value, "__dict__", {})
    return {name: one for name, one in found.items() if not name.startswith("_")}


def _is_library(name: str | None) -> bool:
    """Whether a module is Python's, or installed, or this package."""
    if name is None:
        return True
    file = getattr(sys.modules.get(name), "__file__", None)
    if name == "__main__":
        return False
    return (
        file is None
        and name not in sys.modules
        or name.split(".")[0] == __package__
        or (file.startswith(_LIBRARIES) if file else name in sys.builtin_module_names)
    )


class _Digest:
    """A hash over objects, each taken once."""

    def __init__(self) -> None:
        self.hash = hashlib.sha256()
        self._seen: dict[int, Any] = {}  # the objects too, so that no number is used again

    def _word(self, *words: object) -> None:
        for word in words:
            text = word if isinstance(word, bytes) else str(word).encode("utf-8", "surrogatepass")
            self.hash.update(len(text).to_bytes(8, "little") + text)

    def take(self, value: Any) -> None:
        """Add an object with all that it refers to."""
        if isinstance(value, _PLAIN):
            return self._word(type(value).__name__, repr(value))
        if id(value) in self._seen:
            return self._word("again", list(self._seen).index(id(value)))
        self._seen[id(value)] = value
        self._word(type(value).__qualname__)
        if isinstance(value, (np.ndarray, np.generic)) and value.dtype != object:
            self._word(value.dtype, value.shape, np.ascontiguousarray(value).tobytes())
        elif isinstance(value, (list, tuple)):
            self._word(len(value))
            for one in value:
                self.take(one)
        elif isinstance(value, dict):
            for key in sorted(value, key=repr):
                self.take(key)
                self.take(value[key])
        elif isinstance(value, (set, frozenset)):
            self._word(*sorted(map(repr, value)))
        else:
            self._take_code_or_object(value)

    def _take_code_or_object(self, value: Any) -> None:
        match value:
            case types.CodeType():
                self._word(value.co_code, value.co_names, value.co_varnames, value.co_freevars, value.co_flags)
                self.take(value.co_consts)
            case types.FunctionType():
                self._take_function(value)
            case types.MethodType():
                self.take(value.__func__)
                self.take(value.__self__)
            case staticmethod() | classmethod():
                self.take(value.__func__)
            case property():
                self.take([value.fget, value.fset])
            case functools.partial():
                self.take([value.func, value.args, value.keywords])
            case types.ModuleType():
                self._word(value.__name__, getattr(value, "__version__", ""))
            case type():
                self._take_class(value)
            case _ if hasattr(value, "py_func"):  # compiled by Numba
                self.take(value.py_func)
            case _:
                self._take_object(value)

    def _take_function(self, function: types.FunctionType) -> None:
        self._word(function.__qualname__)
        if _is_library(function.__module__):
            return
        self.take(function.__code__)
        self.take([function.__defaults__, function.__kwdefaults__])
        for cell in function.__closure__ or ():
            self.take(cell.cell_contents)
        for name in sorted(_names(function.__code__)):
            if name in function.__globals__:
                self._word(name)
                self._take_global(function.__globals__[name], _names(function.__code__))

    def _take_global(self, value: Any, names: set[str]) -> None:
        self.take(value)
        if isinstance(value, types.ModuleType) and not _is_library(value.__name__):
            for name in sorted(names & set(vars(value))):
                self.take(getattr(value, name))

    def _take_class(self, kind: type) -> None:
        self._word(kind.__qualname__)
        if _is_library(kind.__module__):
            return
        for base in kind.__bases__:
            self.take(base)
        for name, member in sorted(vars(kind).items()):
            if name not in _SKIPPED:
                self._word(name)
                self.take(member)

    def _take_object(self, value: Any) -> None:
        self.take(type(value))
        attributes = _attributes(value)
        if not attributes and _is_library(type(value).__module__):
            text = repr(value)
            self._word(text if " at 0x" not in text else getattr(value, "__qualname__", ""))
        for name, one in sorted(attributes.items()):
            self._word(name)
            self.take(one)


def _names(code: types.CodeType) -> set[str]:
    """Names that code uses, and code within it."""
    inner = [_names(constant) for constant in code.co_consts if isinstance(constant, types.CodeType)]
    return set(code.co_names).union(*inner)


def mesh_fingerprint(mesh: Mesh) -> int:
    """A hash of points, cells, tags and numbers of a mesh; it does not depend on the partition. Collective."""
    n = mesh.owned_cells
    nodes = np.zeros(len(mesh.points), np.uint64)
    for x in mesh.points.T:
        nodes = _scrambled(nodes ^ _words(x + 0.0))  # + 0.0 makes one zero of the two
    corners = _scrambled(nodes)[mesh.cells[:n]]
    facets = _scrambled(_words(mesh._core.facet_tags[:n].astype(np.int64)))
    # Sums, because neither the order of cells nor that of a cell's vertices is the same on all partitions.
    cells = (corners + _scrambled(nodes[mesh.cells[:n]] ^ facets)).sum(axis=1, dtype=np.uint64)
    cells = _scrambled(cells ^ _words(mesh.cell_tags[:n].astype(np.int64)))
    cells = _scrambled(cells ^ _scrambled(_words(mesh.global_cells[:n])))
    total = np.empty(1, np.uint64)
    mesh.comm.Allreduce(cells.sum(keepdims=True, dtype=np.uint64), total, MPI.SUM)
    return int(total[0])


def _words(values: NDArray[Any]) -> NDArray[np.uint64]:
    return np.ascontiguousarray(values).view(np.uint64)


def _scrambled(z: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """Words each of whose bits depends on all bits of the given one (splitmix64; Steele, Lea & Flood 2014)."""
    z = z + np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))
