"""How a notebook shows meshes, models and reports, and particles as pandas and meshio take them."""

import meshio
import numpy as np
import pytest
from core_cases import box

import mpm_core as mpm


@pytest.fixture
def model():
    model = mpm.Model(box((4, 8)), mpm.LinearElastic(young=1e6, poisson=0.3))
    model.seed(density=2000.0, per_cell=3)
    model.fix(3)
    model.set_gravity((0.0, -9.81))
    list(model.explicit(0.01))
    return model


def test_texts_have_sizes_units_and_laws(model):
    mesh, lengths = model.mesh, np.ptp(model.mesh.points, axis=0)
    assert repr(mesh).startswith(f"<Mesh: {mesh.owned_cells} triangles and {len(mesh.points)} nodes")
    assert f"{lengths[0]:.4g} m x {lengths[1]:.4g} m" in repr(mesh)
    assert f"{len(model.particles)} on this rank" in repr(model.particles) and "velocity [m/s]" in repr(model.particles)
    assert "plane strain, t = 0.01 s" in repr(model) and repr(model.laws[0]) in repr(model)
    report = model.report()
    assert f"{report.mass:.6g} kg" in repr(report) and f"kinetic energy {report.kinetic_energy:.4g} J" in repr(report)


def test_a_table_has_a_column_for_each_component_with_its_unit(model):
    p = model.particles
    table = p.to_dataframe("position", "stress", "volume", "displacement")
    assert list(table) == [
        "position_x", "position_y", "stress_xx", "stress_yy", "stress_zz", "stress_xy", "volume", "displacement_x",
        "displacement_y",
    ]  # fmt: skip
    np.testing.assert_array_equal(table.index, p.id)
    np.testing.assert_array_equal(table[["stress_xx", "stress_yy", "stress_zz", "stress_xy"]], p.stress)
    np.testing.assert_array_equal(table["displacement_y"], p.position[:, 1] - p.initial_position[:, 1])
    assert table.attrs["units"]["stress_xy"] == "Pa" and table.attrs["units"]["displacement_x"] == "m"
    assert len(p[p.position[:, 1] < 0.5].to_dataframe()) == (p.position[:, 1] < 0.5).sum()
    with pytest.raises(AttributeError, match="weight"):
        p.to_dataframe("weight")


def test_meshio_has_particles_as_points_with_fields(model, tmp_path):
    p = model.particles
    p.to_meshio("velocity", "volume").write(tmp_path / "particles.vtu")
    read = meshio.read(tmp_path / "particles.vtu")
    np.testing.assert_array_equal(read.points[:, :2], p.position)
    np.testing.assert_array_equal(read.point_data["volume"], p.volume)
    assert len(read.cells_dict["vertex"]) == len(p)
