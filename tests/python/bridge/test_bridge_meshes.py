"""Meshes: files of gmsh, the paper's slope, the arrays for the core, the soil body."""

import gmsh
import numpy as np
import pytest
from bridge_cases import MESHES
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge.mesh.gmsh_reader import gmsh_session
from fenics_bridge.mesh.tagged import owned_cells, tag_values

COMM = MPI.COMM_WORLD


def areas(arrays):
    corners = arrays["points"][arrays["cells"]]
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return 0.5 * np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def soil_cells(mesh):
    domain, cell_tags, _ = mesh
    return int(np.sum(tag_values(domain, cell_tags, 2)[: owned_cells(domain)] == bridge.SOIL))


def test_the_papers_slope_has_640_triangles():
    assert soil_cells(bridge.slope_mesh(COMM)) == 640


@pytest.mark.parametrize(
    ("kind", "angle"),
    [
        ("crossed", 45),
        ("crossed", 90),
        ("fitted", 30),
        ("fitted", 63),
        ("fitted", 90),
        ("gmsh", 45),
        ("gmsh", 63),
        ("gmsh", 90),
    ],
)
@pytest.mark.parametrize("headroom", [0.0, None])
def test_slope_has_the_area_and_the_tags_of_its_outline(kind, angle, headroom):
    domain, cell_tags, facet_tags = bridge.slope_mesh(COMM, angle=angle, kind=kind, headroom=headroom, runout=1.5)
    arrays = bridge.background_arrays(domain, cell_tags, facet_tags)
    run = 1 / np.tan(np.radians(angle))
    top = 1.0 + (0.1 if headroom is None else 0.0)
    area = areas(arrays)
    right = arrays["points"][:, 0].max()
    assert right == pytest.approx(1.1 + run + 1.5)
    assert area[arrays["cell_tags"] == bridge.SOIL].sum() == pytest.approx(1.1 + run / 2)
    assert area.sum() == pytest.approx(right * top)
    lines = {  # tag -> (distance of a point from the tag's line, length)
        bridge.LEFT: (lambda x, y: x, top),
        bridge.BASE: (lambda x, y: y, right),
        bridge.RIGHT: (lambda x, y: x - right, top),
        bridge.TOP: (lambda x, y: y - top, right if headroom is None else right - 1.1),
        bridge.SLOPE: (lambda x, y: x - 1.1 - run * (1 - y), np.hypot(1, run)),
        bridge.CREST: (lambda x, y: np.maximum(abs(y - 1), x - 1.1), 1.1),
    }
    for tag, (distance, length) in lines.items():
        ends = arrays["points"][arrays["facets"][arrays["facet_tags"] == tag]]
        assert np.max(distance(ends[..., 0], ends[..., 1])) == pytest.approx(0, abs=1e-12)
        assert np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum() == pytest.approx(length)


@pytest.mark.parametrize("angle", [45, 63, 90])
def test_ground_below_the_toe_of_a_slope_is_soil_over_the_whole_length(angle):
    domain, cell_tags, facet_tags = bridge.slope_mesh(COMM, angle=angle, kind="fitted", runout=1.5, depth=0.7)
    arrays = bridge.background_arrays(domain, cell_tags, facet_tags)
    run, right = 1 / np.tan(np.radians(angle)), arrays["points"][:, 0].max()
    assert areas(arrays)[arrays["cell_tags"] == bridge.SOIL].sum() == pytest.approx(1.1 + run / 2 + 0.7 * right)
    lengths = {
        bridge.LEFT: 1.8,
        bridge.RIGHT: 1.8,
        bridge.BASE: right,
        bridge.SLOPE: np.hypot(1, run) + 1.5,
        bridge.CREST: 1.1,
    }
    for tag, length in lengths.items():
        ends = arrays["points"][arrays["facets"][arrays["facet_tags"] == tag]]
        assert np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum() == pytest.approx(
            length, abs=0.1001
        )  # headroom of a cell
        assert tag != bridge.BASE or np.all(ends[..., 1] == pytest.approx(-0.7))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"height": 0.95}, "height.*0.95.*multiple.*gmsh"),
        ({"crest": 1.13}, "crest.*1.13.*multiple.*gmsh"),
        ({"angle": 60}, "angle.*60.*gmsh"),
        ({"angle": 89.99}, "angle.*89.99.*gmsh"),
        ({"angle": 80, "kind": "fitted"}, "angle.*80.*gmsh"),
        ({"angle": 0}, "angle.*0 degrees"),
        ({"angle": 91}, "angle.*91 degrees"),
        ({"height": -1.0}, "height.*-1"),
        ({"cell_size": 0.0}, "cell_size.*0.0"),
        ({"cell_size": 2.0}, "cell_size.*2.0"),
        ({"runout": 0.0}, "runout"),
        ({"headroom": float("nan")}, "headroom"),
        ({"depth": -0.5}, "depth.*-0.5"),
        ({"depth": 0.5, "kind": "gmsh"}, "depth.*0.5.*expected 0 with kind='gmsh'"),
        ({"kind": "square"}, "kind.*square"),
    ],
)
def test_slope_that_does_not_fit_is_refused(options, words):
    with pytest.raises(bridge.InputError, match=words):
        bridge.slope_mesh(COMM, **options)


@pytest.mark.parametrize(
    "options, crest",
    [
        ({"kind": "crossed", "cell_size": 2.0}, 12.0),  # 11 m, rounded up to whole cells
        ({"kind": "crossed", "cell_size": 1.0}, 11.0),
        ({"kind": "fitted", "cell_size": 2.0, "angle": 30.0}, 11.0),
        ({"kind": "gmsh", "cell_size": 2.0, "angle": 90.0}, 11.0),
    ],
)
def test_lengths_that_are_not_given_follow_the_height(options, crest):
    arrays = bridge.background_arrays(*bridge.slope_mesh(COMM, height=10.0, **options))
    top = arrays["points"][arrays["facets"][arrays["facet_tags"] == bridge.CREST]]
    assert top[..., 0].max() == pytest.approx(crest)
    slope = 10.0 / np.tan(np.radians(options.get("angle", 45.0)))
    assert arrays["points"][:, 0].max() == pytest.approx(crest + slope + 20.0)


def test_geo_file_gives_the_same_slope_and_takes_parameters():
    slope = bridge.read_mesh(MESHES / "slope.geo", COMM)
    assert soil_cells(slope) == soil_cells(bridge.slope_mesh(COMM, kind="gmsh"))
    finer = bridge.read_mesh(MESHES / "slope.geo", COMM, parameters={"cell_size": 0.05})
    assert soil_cells(finer) > 3 * soil_cells(slope)


def written(path, order=1, quadrilaterals=False, dim=2, z_corner=0.0):
    """A unit square (or cube) without physical groups, meshed and saved."""
    with gmsh_session():
        if dim == 3:
            gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
            gmsh.model.occ.synchronize()
        else:
            corners = [gmsh.model.geo.addPoint(*p, 0.5) for p in [(0, 0, 0), (1, 0, 0), (1, 1, z_corner), (0, 1, 0)]]
            lines = [gmsh.model.geo.addLine(corners[i], corners[(i + 1) % 4]) for i in range(4)]
            gmsh.model.geo.addSurfaceFilling([gmsh.model.geo.addCurveLoop(lines)])
            gmsh.model.geo.synchronize()
        if quadrilaterals:
            gmsh.model.mesh.setTransfiniteSurface(1)
            gmsh.model.mesh.setRecombine(2, 1)
        gmsh.model.mesh.generate(dim)
        gmsh.model.mesh.setOrder(order)
        gmsh.write(str(path))
    return path


def test_msh_without_physical_groups_is_read_untagged(tmp_path):
    domain, cell_tags, facet_tags = bridge.read_mesh(written(tmp_path / "square.msh"), COMM)
    arrays = bridge.background_arrays(domain, cell_tags, facet_tags)
    assert areas(arrays).sum() == pytest.approx(1.0)
    assert not arrays["cell_tags"].any() and len(arrays["facets"]) == 0


def test_three_dimensional_file_is_read():
    domain, cell_tags, facet_tags = bridge.read_mesh(MESHES / "column.geo", COMM, dim=3)
    arrays = bridge.background_arrays(domain, cell_tags, facet_tags)
    corners = arrays["points"][arrays["cells"]]
    volumes = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 6
    assert volumes.sum() == pytest.approx(0.25)
    for tag, axis in ((1, 2), (2, 0), (3, 1), (4, 2)):
        ends = arrays["points"][arrays["facets"][arrays["facet_tags"] == tag]]
        assert np.ptp(ends[..., axis], axis=1).max() < 1e-12


@pytest.mark.parametrize(
    ("file", "make", "dim", "words"),
    [
        ("absent.msh", None, 2, "no file.*absent"),
        ("mesh.vtk", None, 2, "ending in .msh or .geo"),
        ("empty.msh", b"", 2, "MeshFormat"),
        ("noise.msh", bytes(range(256)), 2, "MeshFormat"),
        ("cut.msh", b"$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 5 1", 2, "cut.msh"),
        ("wrong.geo", b"Point(1) = {0, 0", 2, "gmsh cannot read"),
        ("points.geo", b"Point(1) = {0, 0, 0, 1};", 2, "no cells of dimension 2"),
        ("quads.msh", {"quadrilaterals": True}, 2, "Quadrilateral"),
        ("curved.msh", {"order": 2}, 2, "order 2"),
        ("flat.msh", {}, 3, "no cells of dimension 3"),
        ("body.msh", {"dim": 3}, 2, "dimension 3"),
        ("bent.msh", {"z_corner": 0.3}, 2, "different z.* dim=3"),
        ("square.msh", {}, 1, "dim is 1"),
    ],
)
def test_file_that_cannot_be_used_is_refused(tmp_path, file, make, dim, words):
    path = tmp_path / file
    if isinstance(make, bytes):
        path.write_bytes(make)
    elif make is not None:
        written(path, **make)
    with pytest.raises(bridge.InputError, match=words):
        bridge.read_mesh(path, COMM, dim)


def test_unknown_parameters_are_refused(tmp_path):
    with pytest.raises(bridge.InputError, match="no constant 'cellsize'"):
        bridge.read_mesh(MESHES / "slope.geo", COMM, parameters={"cellsize": 0.1})
    with pytest.raises(bridge.InputError, match="only a .geo"):
        bridge.read_mesh(written(tmp_path / "square.msh"), COMM, parameters={"cell_size": 0.1})


def test_background_arrays_are_what_the_core_takes():
    domain, cell_tags, facet_tags = bridge.slope_mesh(COMM)
    arrays = bridge.background_arrays(domain, cell_tags, facet_tags)
    types = {
        "points": "float64",
        "cells": "int32",
        "cell_tags": "int32",
        "facets": "int32",
        "facet_tags": "int32",
        "global_nodes": "int64",
        "global_cells": "int64",
        "cell_owners": "int32",
    }
    assert {name: str(array.dtype) for name, array in arrays.items()} == types
    assert all(array.flags.c_contiguous for array in arrays.values())
    assert sorted(arrays["global_cells"]) == list(range(len(arrays["cells"])))
    original = bridge.original_cells(domain)
    assert sorted(original) == list(range(len(arrays["cells"])))


def test_soil_body_keeps_area_and_facet_tags():
    domain, cell_tags, facet_tags = bridge.slope_mesh(COMM)
    soil = bridge.background_arrays(*bridge.soil_mesh(domain, cell_tags, facet_tags))
    assert len(soil["cells"]) == 640 and np.all(soil["cell_tags"] == bridge.SOIL)
    assert areas(soil).sum() == pytest.approx(1.6)
    counts = {tag: int(np.sum(soil["facet_tags"] == tag)) for tag in set(soil["facet_tags"].tolist())}
    assert counts == {bridge.LEFT: 10, bridge.BASE: 21, bridge.SLOPE: 20, bridge.CREST: 11}


def test_soil_of_a_tag_that_does_not_exist_is_refused():
    domain, cell_tags, facet_tags = bridge.slope_mesh(COMM)
    with pytest.raises(bridge.InputError, match="tag: no cell has the tag 7"):
        bridge.soil_mesh(domain, cell_tags, facet_tags, tag=7)


ELASTIC = mpm.LinearElastic(young=1e6, poisson=0.3)
HELD = [bridge.fixed(bridge.BASE)]
SWAPPED = "facet_tags is tags of entities of dimension 2, expected tags of facets, of dimension 1"


@pytest.mark.parametrize(
    ("use", "message"),
    [
        (lambda d, c, f, body: bridge.QuasiStatic(body[0], ELASTIC, f, HELD), "facet_tags is of another mesh"),
        (lambda d, c, f, body: bridge.QuasiStatic(body[0], ELASTIC, body[2], HELD, cell_tags=c), "cell_tags is of another"),
        (lambda d, c, f, body: bridge.QuasiStatic(d, ELASTIC, c, [bridge.fixed(bridge.SOIL)]), SWAPPED),
        (lambda d, c, f, body: bridge.QuasiStatic(d, {3: ELASTIC}, f, HELD, cell_tags=f), "cell_tags is .* of dimension 1"),
        (lambda d, c, f, body: bridge.QuasiStatic(d, ELASTIC, "base", HELD), "facet_tags is 'base', expected tags"),
        (lambda d, c, f, body: bridge.MixedQuasiStatic(body[0], ELASTIC, f, HELD), "facet_tags is of another mesh"),
        (lambda d, c, f, body: bridge.background_mesh(d, f, c), SWAPPED),
        (lambda d, c, f, body: bridge.background_mesh(d, body[1], f), "cell_tags is of another mesh"),
        (lambda d, c, f, body: bridge.background_mesh(d, c, body[2]), "facet_tags is of another mesh"),
        (lambda d, c, f, body: bridge.soil_mesh(d, body[1], f), "cell_tags is of another mesh"),
        (lambda d, c, f, body: bridge.soil_mesh(d, c, body[2]), "facet_tags is of another mesh"),
    ],
)  # fmt: skip
def test_tags_of_another_mesh_or_of_other_entities_are_refused(use, message):
    domain, cell_tags, facet_tags = bridge.slope_mesh(COMM, height=1.0, cell_size=0.5, kind="fitted")
    body = bridge.soil_mesh(domain, cell_tags, facet_tags)
    with pytest.raises(bridge.InputError, match=message):
        use(domain, cell_tags, facet_tags, body)
