"""Placing particles: in cells, at points, with several materials."""

import numpy as np
import pytest
from core_cases import DIMS, box, by_id, rollers, run

import mpm_core as mpm

LAW = mpm.LinearElastic(young=1e6, poisson=0.3)
# Lattices k (k + 1) / 2 and k (k + 1) (k + 2) / 6, times the 4^s triangles and 8^s tetrahedra that a cell divides into
COUNTS = {
    2: sorted({k * (k + 1) // 2 * 4**s for k in range(1, 9) for s in range(4)}),
    3: sorted({k * (k + 1) * (k + 2) // 6 * 8**s for k in range(1, 9) for s in range(3)}),
}
CASES = [(dim, count) for dim in DIMS for count in COUNTS[dim] if count <= 64]


def test_the_counts_start_as_documented():
    assert COUNTS[2][:10] == [1, 3, 4, 6, 10, 12, 15, 16, 21, 24]
    assert COUNTS[3][:7] == [1, 4, 8, 10, 20, 32, 35]


@pytest.mark.parametrize(("dim", "count"), CASES)
def test_particles_fill_each_cell_evenly(dim, count):
    mesh = box([3] * dim, [2.0, 1.0, 3.0][:dim], shake=0.15)
    model = mpm.Model(mesh, LAW)
    assert model.seed(density=1500.0, per_cell=count) == count * len(mesh.cells) == len(model.particles)
    particles = model.particles
    assert len(np.unique(particles.id)) == len(particles)
    assert np.all(np.bincount(particles.cell, minlength=len(mesh.cells)) == count)
    assert np.all(mesh.cells_of(particles.position) == particles.cell)
    assert np.allclose(np.bincount(particles.cell, particles.volume), mesh.cell_volumes, rtol=1e-13)
    assert np.allclose(particles.mass, 1500.0 * particles.volume, rtol=1e-15)
    for axis in range(dim):
        centre = np.bincount(particles.cell, particles.position[:, axis]) / count
        assert np.allclose(centre, mesh.points[mesh.cells].mean(axis=1)[:, axis], atol=1e-13)
    assert np.array_equal(particles.position, particles.initial_position)
    for name in ("velocity", "stress", "state", "deviatoric_strain", "material"):
        assert not np.any(getattr(particles, name))
    assert particles.traction.shape == (0, dim)


@pytest.mark.parametrize(
    ("dim", "count", "near"),
    [
        (2, 2, "1, 3"),
        (2, 11, "10, 12"),
        (2, 0, "1, 3"),
        (2, -3, "1, 3"),
        (3, 3, "1, 4"),
        (3, 9, "8, 10"),
        (3, 0, "1, 4"),
    ],
)
def test_other_counts_are_refused_and_near_ones_named(dim, count, near):
    model = mpm.Model(box([1] * dim), LAW)
    with pytest.raises(mpm.InputError, match=f"per_cell is {count}, .*{near}"):
        model.seed(density=1000.0, per_cell=count)
    assert len(model.particles) == 0


@pytest.mark.parametrize("dim", DIMS)
def test_only_cells_with_the_tag_are_filled(dim):
    mesh = box([4] * dim, body=([0.0] * dim, [0.5] * dim))
    model = mpm.Model(mesh, [LAW, LAW])
    inner = model.seed(density=1000.0, per_cell=1, cell_tag=1, material=1)
    outer = model.seed(density=2000.0, per_cell=4, cell_tag=0)
    particles = model.particles
    assert len(np.unique(particles.id)) == inner + outer == len(particles)
    assert np.array_equal(particles.material == 1, mesh.cell_tags[particles.cell] == 1)
    assert particles.volume[particles.material == 1].sum() == pytest.approx(0.5**dim)
    assert model.report().mass == pytest.approx(1000.0 * 0.5**dim + 2000.0 * (1 - 0.5**dim))


@pytest.mark.parametrize("dim", DIMS)
def test_particles_at_points(dim):
    mesh = box([3] * dim, shake=0.15)
    model = mpm.Model(mesh, LAW)
    points = np.random.default_rng(2).random((50, dim))
    volumes = np.linspace(0.01, 0.02, 50)
    assert model.seed_points(points, volumes, density=1000.0) == 50
    assert np.array_equal(by_id(model, "position"), points)
    assert np.array_equal(by_id(model, "volume"), volumes)
    assert np.array_equal(by_id(model, "mass"), 1000.0 * volumes)
    assert np.array_equal(by_id(model, "cell"), mesh.cells_of(points))
    model.seed_points(points, volumes, density=1000.0)
    assert len(np.unique(model.particles.id)) == 100


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"points": [[0.5, 0.5], [1.5, 0.5]]}, r"points has \[1.5 0.5\] at row 1.*outside"),
        ({"points": [[0.5, 0.5, 0.5]] * 2}, r"points has shape \(2, 3\)"),
        ({"points": [[0.5, np.nan], [0.5, 0.5]]}, "points is nan"),
        ({"points": [["a", "b"]] * 2}, "points has dtype"),
        ({"volumes": [1.0]}, r"volumes has shape \(1,\)"),
        ({"volumes": [1.0, 0.0]}, "volumes is 0.0"),
        ({"volumes": [1.0, np.inf]}, "volumes is inf"),
        ({"density": -1.0}, "density is -1.0"),
        ({"material": 1}, "material is 1, expected 0 to 0"),
    ],
)
def test_bad_points_are_refused(change, words):
    model = mpm.Model(box([1, 1]), LAW)
    good = {"points": [[0.5, 0.25], [0.25, 0.5]], "volumes": [0.1, 0.1], "density": 1.0, "material": 0}
    with pytest.raises(mpm.InputError, match=words):
        model.seed_points(**(good | change))
    assert len(model.particles) == 0


@pytest.mark.parametrize("dim", DIMS)
def test_one_material_in_two_parts_behaves_as_one(dim):
    def sag(parts):
        mesh = box([4] * dim, body=([0.0] * dim, [0.5] * dim), shake=0.15)
        soil = mpm.MohrCoulomb(young=1e6, poisson=0.3, cohesion=100.0, friction_angle=20.0)
        model = mpm.Model(mesh, [soil] * parts)
        for tag in (0, 1):
            model.seed(density=2000.0, per_cell=4, cell_tag=tag, material=tag % parts)
        rollers(model, axes=range(dim - 1))
        model.fix(2 * dim - 1)
        model.set_gravity([0.0] * (dim - 1) + [-10.0])
        report = run(model, 0.3)
        assert report.plastic_fraction > 0
        return by_id(model, "stress"), by_id(model, "position"), by_id(model, "plastic_strain")

    for one, two in zip(sag(1), sag(2), strict=True):
        assert np.allclose(one, two, rtol=0, atol=1e-9 * np.abs(one).max())
