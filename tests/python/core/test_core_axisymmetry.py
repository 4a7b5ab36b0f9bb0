"""Axial symmetry: half a section of a body of revolution, per radian; r = x, the axis is x = 0."""

import numpy as np
import pytest
from core_cases import box
from mpm_core.output import ModelOutput
from mpm_core.probes import PointProbe

import mpm_core as mpm

YOUNG, POISSON = 1000.0, 0.3
LEFT, RIGHT, BOTTOM, TOP = 1, 2, 3, 4


def ring(inner, outer, counts, law=None, *, height=0.25, per_cell=6, density=1.0, shake=0.0):
    """A hollow cylinder between smooth plates, filled with particles."""
    width = outer - inner
    mesh = box(counts, (width, height), diagonals="alternating", shake=shake, place=lambda x: x + (inner, 0.0))
    law = law or mpm.LinearElastic(young=YOUNG, poisson=POISSON)
    model = mpm.Model(mesh, law, geometry=mpm.Geometry.AXISYMMETRIC)
    model.seed(density=density, per_cell=per_cell)
    return model


def between_plates(model):
    for tag in (BOTTOM, TOP):
        model.roller(tag, (0, 1))
    return model


@pytest.mark.parametrize("inner", [0.0, 0.7])
def test_volume_mass_and_loaded_area_are_those_of_a_radian(inner):
    model = ring(inner, 2.0, (6, 3), shake=0.2)
    section = 0.5 * (2.0**2 - inner**2)
    assert model.particles.volume.sum() == pytest.approx(section * 0.25, rel=1e-12)
    assert model.particles.mass.sum() == pytest.approx(section * 0.25, rel=1e-12)
    assert model.traction(RIGHT, (1.0, 0.0)) == pytest.approx(2.0 * 0.25, rel=1e-12)
    assert model.traction(TOP, (0.0, 3.0)) == pytest.approx(section, rel=1e-12)
    np.testing.assert_allclose(model.particles.traction.sum(axis=0), [2.0 * 0.25, 3.0 * section], rtol=1e-12)


@pytest.mark.parametrize("nmd", [False, True])
@pytest.mark.parametrize("integration", [mpm.Integration.PARTICLES, mpm.Integration.MIXED])
@pytest.mark.parametrize("inner", [0.0, 0.5])
def test_an_expansion_in_proportion_to_the_radius_is_exact(inner, nmd, integration):
    # u_r = a r, u_y = 0: strains a, 0, a everywhere, whatever the mesh; stresses 2 (lambda + G) a, 2 lambda a.
    model = between_plates(ring(inner, 1.5, (5, 3), shake=0.2))
    a = 1e-3
    if inner > 0:
        model.prescribe(LEFT, (a * inner, 0.0))
    model.prescribe(RIGHT, (a * 1.5, 0.0))
    list(model.implicit(1.0, dt=1.0, quasi_static=True, nmd=nmd, integration=integration, small_displacements=True))
    lame, shear = YOUNG * POISSON / ((1 + POISSON) * (1 - 2 * POISSON)), YOUNG / (2 * (1 + POISSON))
    in_plane, axial = 2 * (lame + shear) * a, 2 * lame * a
    expected = np.tile([in_plane, axial, in_plane, 0.0], (len(model.particles), 1))
    np.testing.assert_allclose(model.particles.stress, expected, atol=1e-9 * in_plane)


def lame(r):
    """Radial displacement, radial and hoop stress of a cylinder from r = 1 to 2 under a pressure of 1 within, between plates."""
    return (
        (1 + POISSON) / YOUNG * ((1 - 2 * POISSON) * r / 3 + 4 / (3 * r)),
        1 / 3 - 4 / 3 / r**2,
        1 / 3 + 4 / 3 / r**2,
    )


def thick_cylinder(cells):
    """Errors (rms) of the radial displacement at the nodes, and of the means of radial and hoop stress, for u(1) given."""
    model = between_plates(ring(1.0, 2.0, (cells, max(cells // 4, 2)), per_cell=3))
    model.prescribe(LEFT, (lame(1.0)[0], 0.0))
    list(model.implicit(1.0, dt=1.0, quasi_static=True, small_displacements=True))
    stress, (_, *exact) = model.particles.stress, lame(model.particles.position[:, 0])
    means = [np.average(stress[:, k] - e, weights=model.particles.volume) for k, e in zip((0, 2), exact, strict=True)]
    u = lame(model.mesh.points[:, 0])[0]
    return np.sqrt(np.mean((model.nodal("velocity")[:, 0] - u) ** 2)) / u.mean(), *np.abs(means)


def test_a_thick_cylinder_converges_to_lame_with_second_order():
    assert lame(1.0)[0] == pytest.approx(1.906667e-3, rel=1e-6) and lame(2.0)[0] == pytest.approx(1.213333e-3, rel=1e-6)
    errors = np.array([thick_cylinder(cells) for cells in (8, 16, 32)])
    assert errors[-1].max() < 1e-3
    assert (np.log2(errors[:-1] / errors[1:]) > 1.7).all()


def test_a_thick_cylinder_under_pressure_is_that_of_lame():
    model = between_plates(ring(1.0, 2.0, (32, 4), per_cell=3))
    model.traction(LEFT, (1.0, 0.0))
    list(model.implicit(1.0, dt=1.0, quasi_static=True, small_displacements=True))
    velocity, points = model.nodal("velocity"), model.mesh.points
    for radius in (1.0, 2.0):
        # The pressure acts on the particles next to the surface, some third of a cell within it.
        assert velocity[np.isclose(points[:, 0], radius), 0].mean() == pytest.approx(lame(radius)[0], rel=0.02)


def test_a_body_on_the_axis_falls_without_strain():
    mesh = box((6, 8), (1.0, 2.0), shake=0.2, body=((-1, 1.0), (0.5, 2.0)))
    model = mpm.Model(mesh, mpm.LinearElastic(young=1e5, poisson=0.3), geometry=mpm.Geometry.AXISYMMETRIC)
    model.seed(density=1000.0, per_cell=6, cell_tag=1)
    model.set_gravity((0.0, -9.81))
    volume = model.particles.volume
    list(model.explicit(0.2, nmd=True))
    particles = model.particles
    np.testing.assert_allclose(particles.displacement[:, 0], 0.0, atol=1e-12)
    np.testing.assert_allclose(particles.velocity, np.tile([0.0, -9.81 * 0.2], (len(particles), 1)), atol=1e-10)
    np.testing.assert_allclose(np.sort(particles.volume), np.sort(volume), rtol=1e-10)
    assert abs(particles.stress).max() < 1e-6


@pytest.mark.parametrize("integration", [mpm.Integration.PARTICLES, mpm.Integration.MIXED])
def test_a_thin_ring_breathes_at_its_frequency(integration):
    # With nu = 0 only the hoop strain u/R resists: omega = sqrt(E / rho) / R, but for (thickness / R)^2 / 12.
    model = ring(0.95, 1.05, (2, 2), mpm.LinearElastic(young=1e4, poisson=0.0), height=0.1, density=1000.0)
    omega = np.sqrt(1e4 / 1000.0)
    model.particles.set("velocity", np.tile([1e-4, 0.0], (len(model.particles), 1)))
    energy = 0.5 * model.particles.mass.sum() * 1e-8
    times, means = [], []
    for report in model.explicit(np.pi / omega, every_steps=5, integration=integration):
        times.append(report.time)
        means.append(np.average(model.particles.velocity[:, 0], weights=model.particles.mass))
        assert report.kinetic_energy + report.internal_work == pytest.approx(energy, rel=0.01)
    np.testing.assert_allclose(means, 1e-4 * np.cos(omega * np.array(times)), atol=2e-6)


def test_explicit_runs_keep_the_balance_of_energy():
    mesh = box((10, 10), (1.25, 1.25), body=((-1.0, -1.0), (1.0, 1.0)))
    model = mpm.Model(mesh, mpm.LinearElastic(young=1e3, poisson=0.3), geometry=mpm.Geometry.AXISYMMETRIC)
    model.seed(density=1000.0, per_cell=6, cell_tag=1)
    model.fix(BOTTOM)
    model.set_gravity((0.0, -0.02))
    *_, report = model.explicit(2.0, courant=0.3)
    stored = report.kinetic_energy + report.internal_work
    assert report.external_work > 0
    assert stored == pytest.approx(report.external_work + report.support_work, rel=1e-4)


def test_implicit_and_explicit_runs_agree():
    soil = mpm.MohrCoulomb(young=1e6, poisson=0.3, cohesion=500.0, friction_angle=20.0)
    moved = []
    for scheme in ("explicit", "implicit"):
        model = ring(0.0, 1.0, (8, 8), soil, height=1.0, density=2000.0)
        model.fix(BOTTOM)
        model.set_gravity((0.0, -2.0), ramp=0.1)
        dt = model.critical_time_step() * (0.3 if scheme == "explicit" else 1.0)
        list(getattr(model, scheme)(0.15, dt=dt))
        order = np.argsort(model.particles.id)
        moved.append(model.particles.displacement[order])
    assert np.linalg.norm(moved[0] - moved[1]) < 0.05 * np.linalg.norm(moved[0])


def test_filled_space_is_that_of_rings():
    mesh = box((10, 10), (1.25, 1.25), body=((-1.0, -1.0), (1.0, 1.0)))
    model = mpm.Model(mesh, mpm.LinearElastic(young=1e3, poisson=0.3), geometry=mpm.Geometry.AXISYMMETRIC)
    model.seed(density=1000.0, per_cell=6, cell_tag=1)
    assert model.cell_volumes.sum() == pytest.approx(1.25**3 / 2, rel=1e-12)
    assert mpm.space(model) == pytest.approx((0.5, 0.5), rel=1e-12)
    shares = [v for k, v in PointProbe(model, [[0.55, 0.52], [1.1, 1.1]]).values().items() if k.startswith("filled")]
    assert shares == pytest.approx([1.0, 0.0], abs=1e-12)


def test_files_name_the_hoop_stress(tmp_path):
    h5py = pytest.importorskip("h5py")
    model = ring(0.0, 1.0, (2, 2))
    stress = np.arange(4.0 * len(model.particles)).reshape(-1, 4)
    model.particles.set("stress", stress)
    model.report()
    with ModelOutput(model, str(tmp_path / "particles"), str(tmp_path / "mesh")) as output:
        output.write()
    with h5py.File(tmp_path / "particles" / "000000.h5") as file:
        assert {name for name in file if name.startswith("stress")} == {
            f"stress_{c}" for c in ("xx", "yy", "hoop", "xy")
        }
        order = np.argsort(np.array(file["id"]))
        hoop = np.array(file["stress_hoop"])[order]
    np.testing.assert_array_equal(hoop, stress[np.argsort(model.particles.id), 2])
    assert 'Name="stress_hoop"' in (tmp_path / "particles.xdmf").read_text()


def test_what_axial_symmetry_does_not_have_is_refused():
    law = mpm.LinearElastic(young=YOUNG, poisson=POISSON)
    axisymmetric = mpm.Geometry.AXISYMMETRIC
    with pytest.raises(mpm.InputError, match="node at x = -1 m, expected radii from 0"):
        mpm.Model(box((2, 2), place=lambda x: x - (1.0, 0.0)), law, geometry=axisymmetric)
    with pytest.raises(mpm.InputError, match="geometry is AXISYMMETRIC, but the mesh has 3 dimensions"):
        mpm.Model(box((1, 1, 1)), law, geometry=axisymmetric)
    with pytest.raises(mpm.InputError, match="geometry is 'axisymmetric', expected Geometry"):
        mpm.Model(box((2, 2)), law, geometry="axisymmetric")
    model = ring(0.0, 1.0, (2, 2))
    model.set_gravity((0.0, -1.0))
    with pytest.raises(mpm.InputError, match="integration is DUAL_DOMAIN, expected PARTICLES or MIXED"):
        list(model.explicit(0.1, integration=mpm.Integration.DUAL_DOMAIN))


def test_a_checkpoint_of_another_geometry_is_refused_and_one_of_its_own_goes_on(tmp_path):
    path = tmp_path / "state.h5"
    model, same = ring(0.0, 1.0, (4, 4)), ring(0.0, 1.0, (4, 4))
    for each in (model, same):
        each.set_gravity((0.0, -1.0))
    list(model.explicit(0.05))
    model.save(path)
    same.restore(path)
    for each in (model, same):
        list(each.explicit(0.1))
    np.testing.assert_array_equal(model.particles.stress, same.particles.stress)
    plane = mpm.Model(model.mesh, model.laws)
    with pytest.raises(mpm.InputError, match="another geometry: it has AXISYMMETRIC, the model has PLANE_STRAIN"):
        plane.restore(path)
