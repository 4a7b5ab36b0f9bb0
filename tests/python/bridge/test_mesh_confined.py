"""A mesh file is a guest: it gets so much time and memory, starts no programs, and does not stay when its host has gone."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from mpi4py import MPI

import fenics_bridge as bridge

COMM = MPI.COMM_SELF
CONFINED = Path(bridge.__file__).parent / "mesh" / "gmsh_confined.py"
SQUARE = """
SetFactory("OpenCASCADE");
Rectangle(1) = {0, 0, 0, 1, 1};
Mesh.MeshSizeMax = 0.5;
"""
FOR_EVER = SQUARE + "n = 0;\nFor i In {1:2000000000}\n n = n + 1;\nEndFor\n"


def geo(tmp_path, text, name="mesh.geo"):
    (tmp_path / name).write_text(text)
    return tmp_path / name


@pytest.mark.parametrize("where", ["itself", "included"])
def test_commands_are_run_only_when_allowed(tmp_path, where):
    sign = tmp_path / "sign"
    call = f'SystemCall "touch {sign}";\n'
    geo(tmp_path, call, "other.geo")
    text = {
        "itself": SQUARE + call,
        "included": SQUARE + 'Include "other.geo";\n',
    }[where]
    path = geo(tmp_path, text)
    with pytest.raises(bridge.InputError, match="it runs commands by SystemCall; allow_commands=True"):
        bridge.read_mesh(path, COMM)
    assert not sign.exists()
    domain, _, _ = bridge.read_mesh(path, COMM, allow_commands=True)
    assert sign.exists() and domain.topology.index_map(2).size_local > 0


@pytest.mark.parametrize(
    ("files", "why"),
    [
        (
            {"mesh.geo": 'Include "a.geo";', "a.geo": 'Merge  "b.pos";', "b.pos": 'SystemCall "x";'},
            "b.pos mentions SystemCall",
        ),
        ({"mesh.geo": 'Include "a.geo";', "a.geo": 'Include "mesh.geo";\nSystem "x";'}, "a.geo mentions"),
        ({"mesh.geo": 'n = Str("a.geo");\nMerge n;'}, "mesh.geo has 'Merge n;', a file that cannot be searched"),
        ({"mesh.geo": 'Include StrCat("a", ".geo");'}, "a file that cannot be searched"),
        ({"mesh.geo": 'Include "a.geo";\nInclude "none.geo";', "a.geo": "SystemTime = 1;"}, None),
    ],
    ids=["merged", "in a circle", "by variable", "by function", "harmless"],
)
def test_files_that_a_geometry_names_are_searched_where_nothing_else_helps(tmp_path, files, why):
    for name, text in files.items():
        geo(tmp_path, text, name)
    code = (
        f"import sys; sys.path.insert(0, {str(CONFINED.parent)!r}); from pathlib import Path; import gmsh_confined\n"
        f"print(gmsh_confined.command_in(Path({str(tmp_path / 'mesh.geo')!r})))"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True).stdout
    assert found.strip() == "None" if why is None else why in found


def test_without_libseccomp_an_included_command_is_refused(tmp_path):
    geo(tmp_path, f'SystemCall "touch {tmp_path}/sign";\n', "other.geo")
    path = geo(tmp_path, SQUARE + 'Include "other.geo";\n')
    code = (
        f"import sys; sys.path.insert(0, {str(CONFINED.parent)!r}); from pathlib import Path; import gmsh_confined as g\n"
        "g.forbid_programs, g.end_with_parent = lambda: False, lambda: None\n"
        f"g.main(Path({str(path)!r}), '2', {str(tmp_path / 'arrays.npz')!r}, '4000000000', 'no')"
    )
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert "it runs commands by SystemCall" in ran.stderr and "other.geo mentions SystemCall" in ran.stderr
    assert ran.returncode != 0 and not (tmp_path / "sign").exists()


def test_time_is_bounded(tmp_path):
    start = time.monotonic()
    with pytest.raises(bridge.InputError, match="gmsh took more than 3 s for .*mesh.geo.*raise time_limit"):
        bridge.read_mesh(geo(tmp_path, FOR_EVER), COMM, time_limit=3.0)
    assert time.monotonic() - start < 20


def test_memory_is_bounded(tmp_path):
    path = geo(tmp_path, SQUARE.replace("0.5", "0.0005"))  # some ten million triangles
    with pytest.raises(bridge.InputError, match="gmsh needs more than 0.2 GB for .*raise memory_limit"):
        bridge.read_mesh(path, COMM, memory_limit=2e8)


def test_the_reader_ends_with_its_parent(tmp_path):
    path = geo(tmp_path, FOR_EVER)
    script = f"import fenics_bridge as b\nfrom mpi4py import MPI\nb.read_mesh({str(path)!r}, MPI.COMM_SELF)"
    parent = subprocess.Popen([sys.executable, "-c", script])
    reader = None
    while reader is None and parent.poll() is None:
        time.sleep(0.1)
        for entry in Path("/proc").iterdir():
            if entry.name.isdigit() and (entry / "cmdline").exists() and str(path).encode() in _command(entry):
                reader = entry if entry.name != str(parent.pid) else reader
    os.kill(parent.pid, signal.SIGKILL)
    parent.wait()
    deadline = time.monotonic() + 10
    while reader.exists() and time.monotonic() < deadline:
        time.sleep(0.1)
    assert not reader.exists()


def _command(entry):
    try:
        words = (entry / "cmdline").read_bytes()
    except OSError:
        return b""
    return words if b"gmsh_confined" in words else b""
