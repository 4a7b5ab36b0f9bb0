"""How a notebook shows meshes, models and reports; particles for pandas, meshio and matplotlib."""

import h5py
import matplotlib
import meshio
import numpy as np
import pytest
from core_cases import box
from mpm_core.output import ModelOutput
from mpm_core.views import COVER

import mpm_core as mpm

matplotlib.use("Agg")


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


def test_the_text_of_a_model_has_its_gravity_and_boundary_conditions(model):
    assert "gravity (0, -9.81) m/s2" in repr(model) and "facet tag 3: fixed" in repr(model)
    model.roller(1, normal=(1, 0))
    assert "facet tag 1: roller, normal (1, 0)" in repr(model)
    model.prescribe(4, (None, -0.1))
    assert "facet tag 4: velocity (free, -0.1) m/s" in repr(model)
    model.release(3)
    assert "facet tag 3" not in repr(model)


def test_texts_of_volumes_and_runs(model):
    assert "volume [m2]" in repr(model.particles)
    solid = mpm.Model(box((1, 1, 1)), model.laws[0])
    assert "volume [m3]" in repr(solid.particles)
    revolved = mpm.Model(box((2, 2)), model.laws[0], geometry=mpm.Geometry.AXISYMMETRIC)
    assert "volume [m3]" in repr(revolved.particles)
    run = model.explicit(0.02)
    assert repr(run) == "<Reports: Model.explicit from t = 0.01 s to 0.02 s; iterate over it, or call last()>"
    run.last()


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


def test_components_of_tensors_have_their_names(model, tmp_path):
    # v = (x, y) -> (3 y, 5 x) has the gradient dv_x/dy = 3, dv_y/dx = 5, rows by component and columns by axis.
    p = model.particles
    p.set("velocity_gradient", np.tile([0.0, 3.0, 5.0, 0.0], (len(p), 1)))
    table = p.to_dataframe("velocity_gradient")
    assert table.iloc[0].to_dict() == {
        "velocity_gradient_xx": 0.0, "velocity_gradient_xy": 3.0, "velocity_gradient_yx": 5.0, "velocity_gradient_yy": 0.0
    }  # fmt: skip
    with ModelOutput(model, tmp_path / "particles", particle_fields=["velocity_gradient"]) as output:
        output.write()
    with h5py.File(tmp_path / "particles/000000.h5") as file:
        assert file["velocity_gradient_xy"][0] == 3.0 and file["velocity_gradient_yx"][0] == 5.0
    revolved = mpm.Model(box((2, 2)), model.laws[0], geometry=mpm.Geometry.AXISYMMETRIC)
    revolved.seed(density=1.0, per_cell=3)
    stresses = ["stress_xx", "stress_yy", "stress_hoop", "stress_xy"]
    assert list(revolved.particles.to_dataframe("stress")) == stresses
    fields = revolved.particles.to_meshio("stress", "velocity", "volume").point_data
    assert list(fields) == [*stresses, "velocity", "volume"]
    assert fields["velocity"].shape == (len(revolved.particles), 3)  # a vector, also for ParaView


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("variables", [1, 2, 3, 4, 6, 9])
def test_state_variables_are_numbered_however_many_there_are(dim, variables, tmp_path):
    """Two are no vector in the plane, three none in space, four, six and nine no tensor."""

    class Elastic:
        n_state, p_wave_modulus = variables, 1e6

        def update(self, *points):
            pass

    model = mpm.Model(box((2,) * dim), mpm.PythonLaw(Elastic()))
    model.seed(density=2000.0, per_cell=dim + 1)
    p = model.particles
    state = np.arange(1.0, len(p) * variables + 1).reshape(-1, variables)
    p.set("state", state)
    names = [f"state_{number}" for number in range(variables)]
    table = p.to_dataframe("state")
    assert list(table) == names
    np.testing.assert_array_equal(table, state)
    assert list(p.to_meshio("state").point_data) == names
    drawn = p.plot(names[-1]).collections[0].get_array()
    np.testing.assert_array_equal(drawn, state[:, -1])
    with pytest.raises(mpm.InputError, match="'state', expected one of state_0"):
        p.plot("state")
    with ModelOutput(model, tmp_path / "particles", particle_fields=["state"]) as output:
        output.write()
    with h5py.File(tmp_path / "particles/000000.h5") as file:
        assert {name for name in file if name.startswith("state")} == set(names)
        for name, column in zip(names, state.T, strict=True):
            np.testing.assert_array_equal(file[name], column)


def test_a_field_that_no_particle_has_yet_is_named(model):
    p = model.particles
    assert len(p.velocity_gradient) == 0 < len(p)
    for show in (p.to_dataframe, p.to_meshio, lambda name: p.plot(f"{name}_xx")):
        with pytest.raises(mpm.InputError, match="'velocity_gradient', but no particle carries one"):
            show("velocity_gradient")


def test_a_picture_has_a_circle_for_each_particle_coloured_by_the_field(model):
    p = model.particles
    axes = p.plot("displacement")
    (circles,) = axes.collections
    np.testing.assert_allclose(circles.get_array(), np.linalg.norm(p.displacement, axis=1))
    np.testing.assert_allclose(circles.get_offsets(), p.position)
    np.testing.assert_allclose((2 * circles._widths) ** 2, COVER**2 * p.volume)  # matplotlib keeps half of a width
    assert axes.figure.axes[1].get_ylabel() == "displacement [m]" and axes.get_aspect() == 1
    again = p.plot("stress_yy", axes)
    np.testing.assert_array_equal(again.collections[1].get_array(), p.stress[:, 1])
    with pytest.raises(mpm.InputError, match="'stress', expected one of stress_xx, stress_yy"):
        p.plot("stress")
    with pytest.raises(mpm.InputError, match="'weight', expected a field or a component of it: .*velocity"):
        p.plot("weight")


def test_circles_of_a_half_section_have_the_area_of_the_particles_in_it():
    model = mpm.Model(box((4, 2)), mpm.LinearElastic(young=1e6, poisson=0.3), geometry=mpm.Geometry.AXISYMMETRIC)
    model.seed(density=2000.0, per_cell=3)
    (circles,) = model.particles.plot("position_x").collections
    areas = (2 * circles._widths / COVER) ** 2
    assert areas.sum() == pytest.approx(
        np.prod(np.ptp(model.mesh.points, axis=0)), rel=1e-3
    )  # volumes per radian are r A


def test_a_picture_of_a_solid_is_three_dimensional():
    model = mpm.Model(box((2, 2, 2)), mpm.LinearElastic(young=1e6, poisson=0.3))
    model.seed(density=2000.0, per_cell=1)
    axes = model.particles.plot("position_z")
    np.testing.assert_allclose(np.asarray(axes.collections[0]._offsets3d[2]), model.particles.position[:, 2])
    assert axes.get_zlabel() == "z [m]"
    long = mpm.Model(box((8, 2, 2), (4.0, 1.0, 1.0)), model.laws[0])
    long.seed(density=2000.0, per_cell=1)
    axes = long.particles.plot("position_z")
    axes.figure.canvas.draw()
    shown = np.diff([axes.get_xlim(), axes.get_ylim(), axes.get_zlim()])[:, 0]
    assert shown[0] > 3 * shown[1] and shown[1] == pytest.approx(shown[2])  # and not a cube with empty space
    sides = axes._box_aspect / shown
    assert np.allclose(sides, sides[0])  # a metre is as long along each axis


@pytest.mark.parametrize("per_cell", [1, 3, 6, 10])
def test_circles_of_a_picture_leave_hardly_any_gaps(per_cell):
    """Of the points of a fine raster; of three particles the pattern in a triangle is loosest. As squares they would leave a fifth."""
    model = mpm.Model(box((4, 4)), mpm.LinearElastic(young=1e6, poisson=0.3))
    model.seed(density=2000.0, per_cell=per_cell)
    (circles,) = model.particles.plot("position_x").collections
    inside = np.indices((60, 60)).reshape(2, -1).T / 59 * 0.5 + 0.25  # away from the boundary
    distance = np.linalg.norm(inside[:, None] - model.particles.position, axis=2)
    assert (distance <= circles._widths).any(axis=1).mean() > 0.98


def test_a_thin_side_of_a_picture_in_space_has_few_numbers():
    model = mpm.Model(box((7, 1, 2), (14.0, 1.6, 4.0)), mpm.LinearElastic(young=1e6, poisson=0.3))
    model.seed(density=2000.0, per_cell=8)
    axes = model.particles.plot("displacement")
    low, high = axes.get_ylim()
    assert 1 <= ((axes.get_yticks() >= low) & (axes.get_yticks() <= high)).sum() <= 2
    assert len(axes.get_xticks()) >= 6


def test_the_text_of_a_model_has_its_water_and_its_rigid_surfaces():
    model = mpm.Model(box((4, 4)), mpm.LinearElastic(young=1e6, poisson=0.3))
    model.seed(density=2000.0, per_cell=3)
    assert "water" not in repr(model)
    model.add_water(porosity=0.4, conductivity=1e-6, modulus=1e8, drained_surface=True)
    model.hold_pore_pressure(1, level=[(0.0, 1.0), (10.0, 0.5)])
    model.hold_pore_pressure(3, 5e3)
    model.stand_water(1.2)
    for words in ("pore water of 1000 kg/m3, modulus 1e+08 Pa, free surface drained", "facet tag 1: water level 1 to 0.5 m",
                  "facet tag 3: pore pressure 5000 Pa", "water stands up to 1.2 m"):  # fmt: skip
        assert words in repr(model)
    model.add_contact(mpm.Plane((0, 1.2), (0, -1)), friction=0.3)
    assert "RigidContact 0: Plane" in repr(model) and "friction 0.3" in repr(model)


def test_the_text_of_a_rigid_surface_says_how_it_moves():
    model = mpm.Model(box((4, 4)), mpm.LinearElastic(young=1e6, poisson=0.3))
    model.seed(density=2000.0, per_cell=3)
    rest, stone, plate, blade = (
        model.add_contact(mpm.Disc((k, 9.0), 0.4), **motion)
        for k, motion in enumerate([
            {}, {"body": mpm.FreeBody(mass=300.0), "velocity": (1.0, 0.0)},
            {"body": mpm.Servo(force=([0.0, 1.0], [(0.0, 0.0), (0.0, -5e3)]), speed=0.1)}, {"spin": 0.2},
        ])
    )  # fmt: skip
    assert repr(rest).endswith("friction 0, adhesion 0 Pa>")
    assert repr(stone).endswith("free body of 300 kg/m, velocity (1, 0) m/s>")
    assert repr(plate).endswith("servo of (0, 0) to (0, -5000) N/m>")
    assert repr(blade).endswith("spin (0.2) rad/s>")
    assert "free body of 300 kg/m" in repr(model)


def test_the_plastic_work_of_a_law_in_python_is_unknown():
    class Law:
        n_state, p_wave_modulus = 1, 1e6

        def update(self, strain_increment, stress, state, tangent):
            stress += 1e6 * strain_increment

    model = mpm.Model(box((4, 4)), mpm.PythonLaw(Law()))
    model.seed(density=2000.0, per_cell=3)
    assert "plastic work unknown; " in repr(model.explicit(0.01).last())


def test_a_bar_shows_the_simulated_time(model, capsys):
    reports = list(model.explicit(0.03, every=0.01).with_progress())
    assert [round(report.time, 9) for report in reports] == [0.02, 0.03]
    shown = capsys.readouterr().err
    assert "explicit:  33%" in shown and "100%" in shown and "0.03/0.03 s" in shown
