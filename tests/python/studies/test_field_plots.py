"""Fields of finite elements on the triangles of pictures."""

import numpy as np
import pytest
from dolfinx.mesh import meshtags
from mpi4py import MPI

import fenics_bridge as bridge
from studies.common.field_plots import gathered, mechanism_field
from studies.common.site.outlines import soil_outlines
from studies.common.stages.plots import StagePicture


def of_degree(degree):
    """A displacement (y^2, x y) on four by two cells of a unit square, in a space of a degree."""
    domain, _, _ = bridge.box_mesh(MPI.COMM_SELF, [1.0, 1.0], [4, 2])
    space = bridge.compat.function_space(domain, "Lagrange", degree, 2)
    function = bridge.compat.fem.Function(space)
    function.interpolate(lambda x: np.array([x[1] ** 2, x[0] * x[1]]))
    return function


@pytest.mark.parametrize("degree", [1, 2, 4])
def test_a_mechanism_is_shown_at_all_nodes_of_its_elements(degree):
    field = mechanism_field(of_degree(degree))
    assert field.points.shape == ((4 * degree + 1) * (2 * degree + 1), 2)
    assert field.cells.shape == (16 * degree**2, 3)
    x, y = field.points.T
    assert np.allclose(field.values, np.column_stack([y**2, x * y]), atol=1e-12)
    corners = field.points[field.cells]
    areas = 0.5 * np.linalg.det(corners[:, 1:] - corners[:, :1])
    assert np.allclose(np.abs(areas), 1 / (16 * degree**2))
    assert len(field.outline) == 2 * (4 + 2) * degree  # sides within are shared, those of the square are not
    # The shear of a triangle is that of its corners, so (eyy - exx)^2 + gxy^2 = x^2 + 9 y^2 at some point within it
    error = np.abs(field.shear() - np.hypot(*(corners.mean(axis=1) * [1, 3]).T)).max()
    assert error < 1.0 / degree


def test_a_field_keeps_the_cells_of_the_mesh():
    function = of_degree(2)
    field = gathered(function)
    assert len(field.cells) == function.function_space.mesh.topology.index_map(2).size_local


def test_borders_of_soils_are_the_sides_around_them(tmp_path):
    domain, _, _ = bridge.box_mesh(MPI.COMM_SELF, [1.0, 1.0], [4, 4])
    middle = bridge.background_arrays(domain)
    middle = middle["points"][middle["cells"]].mean(axis=1)
    tags = np.where(middle[:, 1] > 0.5, np.where(middle[:, 0] > 0.5, 3, 2), 1).astype(np.int32)
    soils = meshtags(domain, 2, np.arange(len(tags), dtype=np.int32), tags)
    bridge.name_tags(soils, {"clay": 1, "sand": (2, 3)})
    lengths = {name: np.linalg.norm(np.diff(edges, axis=1)[:, 0], axis=1).sum()
               for name, edges in soil_outlines(domain, soils).items()}  # fmt: skip
    # Each soil is 1 m by 0.5 m, and the border between the classes of sand is none
    assert lengths == pytest.approx({"clay": 3.0, "sand": 3.0})
    assert list(soil_outlines(domain, soils, off=[2, 3])) == ["clay"]


def test_a_mechanism_is_not_shown_where_the_soil_was_dug_away():
    function = of_degree(2)
    domain = function.function_space.mesh
    soils = meshtags(domain, 2, np.arange(16, dtype=np.int32), np.repeat(np.array([1, 2], np.int32), 8))
    bridge.name_tags(soils, {"ground": 1, "cut": 2})
    whole, left = (mechanism_field(function, False, soils, off) for off in ((), [2]))
    mesh = bridge.background_arrays(domain, soils)
    ground = mesh["points"][mesh["cells"][mesh["cell_tags"] == 1]]
    assert len(whole.cells) == 16 * 4 and len(left.cells) == 8 * 4
    corners = left.points[left.cells].reshape(-1, 2)
    assert np.allclose(
        corners.mean(axis=0), ground.reshape(-1, 2).mean(axis=0)
    )  # the middle of the cells that are there
    assert list(whole.soils) == ["ground", "cut"] and list(left.soils) == ["ground"]
    assert np.array_equal(left.soils["ground"], whole.soils["ground"])


def test_displacements_of_a_stage_are_those_of_its_points():
    """As means of cells those of triangles with two corners on a fixed base and of others alternate in a picture."""
    field = gathered(of_degree(1))
    there = field.points[field.cells][..., 1].max(axis=1) < 0.6
    stage = StagePicture("half", field, there, np.zeros(len(field.cells)))
    assert len(stage.field().cells) == 8
    x, y = field.points.T
    assert np.allclose(stage.moved(), np.hypot(y**2, x * y))
