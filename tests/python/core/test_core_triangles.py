"""Triangulated rigid surfaces: distances, search, contact, files, checkpoints, and wrong input."""

import time

import meshio
import numpy as np
import pytest
from core_cases import box

import mpm_core as mpm

RADIUS = 0.5e-4  # of a particle of 1e-12 m3


def one_particle():
    model = mpm.Model(box((2, 2, 2), (4.0, 4.0, 4.0)), mpm.LinearElastic(young=1e6, poisson=0.3))
    model.seed_points([(1.0, 1.0, 1.0)], [1e-12], density=1.0)
    return model


def distance(model, surface, x):
    model.place(np.asarray(x)[None])
    return model.gap(surface) + RADIUS


def sheet(counts, corner, along, across):
    """A parallelogram in two triangles for each of its counts[0] by counts[1] parts; its normal is along x across."""
    i, j = np.meshgrid(np.arange(counts[0] + 1), np.arange(counts[1] + 1), indexing="ij")
    points = np.asarray(corner) + np.multiply.outer(i.ravel() / counts[0], along)
    points = points + np.multiply.outer(j.ravel() / counts[1], across)
    numbers = np.arange(len(points)).reshape(i.shape)
    a, b, c, d = (part.ravel() for part in (numbers[:-1, :-1], numbers[1:, :-1], numbers[1:, 1:], numbers[:-1, 1:]))
    return points, np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def joined(*sheets):
    """One surface of several sheets, with common vertices."""
    points = np.concatenate([one for one, _ in sheets])
    starts = np.cumsum([0, *(len(one) for one, _ in sheets[:-1])])
    triangles = np.concatenate([t + start for (_, t), start in zip(sheets, starts, strict=True)])
    unique, numbers = np.unique(np.round(points, 12), axis=0, return_inverse=True)
    return unique, numbers.reshape(-1)[triangles]


def cuboid(lower, upper, n=4):
    """Vertices and triangles of a box, with normals that point out of it."""
    low, (x, y, z) = np.asarray(lower, float), np.diag(np.asarray(upper, float) - lower)
    return joined(
        sheet((n, n), low, y, x), sheet((n, n), low + z, x, y), sheet((n, n), low, x, z), sheet((n, n), low + y, z, x),
        sheet((n, n), low, z, y), sheet((n, n), low + x, y, z),
    )  # fmt: skip


def torus(n, m, radius, thickness):
    u, v = np.meshgrid(2 * np.pi * np.arange(n) / n, 2 * np.pi * np.arange(m) / m, indexing="ij")
    width = radius + thickness * np.cos(v)
    points = np.stack([width * np.cos(u), width * np.sin(u), thickness * np.sin(v)], axis=-1).reshape(-1, 3) + 2.0
    i, j = np.meshgrid(np.arange(n), np.arange(m), indexing="ij")
    at = lambda a, b: ((a % n) * m + b % m).ravel()  # noqa: E731
    a, b, c, d = at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)
    return points, np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def test_a_triangulated_box_has_the_distances_of_a_box():
    model, lower, upper = one_particle(), np.array([1.0, 1.2, 1.5]), np.array([3.0, 2.0, 2.5])
    triangles, solid = mpm.Triangles(*cuboid(lower, upper)), mpm.Box(lower, upper)
    places = np.random.default_rng(1).uniform(0.1, 3.9, (200, 3))
    places[:60] = np.random.default_rng(2).uniform(lower, upper, (60, 3))  # inside of it
    for x in places:
        assert distance(model, triangles, x) == pytest.approx(distance(model, solid, x), abs=1e-12)


def sampled(points, triangles, n=12):
    """Points densely on all triangles."""
    i, j = (part.ravel() for part in np.meshgrid(np.arange(n + 1), np.arange(n + 1), indexing="ij"))
    weights = np.stack([i, j, n - i - j], axis=1)[i + j <= n] / n
    return np.einsum("kc,tcx->tkx", weights, points[triangles]).reshape(-1, 3)


def solid_angle(points, triangles, x):
    """Of the surface as seen from x, over 4 pi: 1 inside of it, 0 outside (van Oosterom & Strackee 1983)."""
    a, b, c = (points[triangles[:, k]] - x for k in range(3))
    la, lb, lc = (np.linalg.norm(one, axis=1) for one in (a, b, c))
    triple = np.einsum("ij,ij->i", a, np.cross(b, c))
    ab, bc, ca = (np.einsum("ij,ij->i", *pair) for pair in ((a, b), (b, c), (c, a)))
    return np.arctan2(triple, la * lb * lc + ab * lc + bc * la + ca * lb).sum() / (2 * np.pi)


def test_distance_and_sign_of_a_torus_are_right():
    model, (points, triangles) = one_particle(), torus(24, 12, 1.1, 0.5)
    ring, dense = mpm.Triangles(points, triangles), sampled(points, triangles)
    for x in np.random.default_rng(3).uniform((0.3, 0.3, 1.2), (3.7, 3.7, 2.8), (150, 3)):
        found, inside = distance(model, ring, x), solid_angle(points, triangles, x)
        nearest = np.linalg.norm(dense - x, axis=1).min()
        assert nearest - 0.02 <= abs(found) <= nearest + 1e-12  # of samples that are up to 0.02 m apart
        assert inside == pytest.approx(1.0 if found < 0 else 0.0, abs=1e-9)


def test_ground_goes_on_straight_beyond_its_border():
    model = one_particle()
    corner, along, across = np.array([1.5, 1.5, 1.0]), np.array([1.0, 0.0, 0.3]), np.array([0.0, 1.0, -0.2])
    ground, plane = mpm.Triangles(*sheet((5, 4), corner, along, across)), mpm.Plane(corner, np.cross(along, across))
    for x in np.random.default_rng(4).uniform(0.1, 3.9, (100, 3)):
        assert distance(model, ground, x) == pytest.approx(distance(model, plane, x), abs=1e-12)


def sliding(surface, end=0.3):
    model = mpm.Model(box((6, 4, 3), (3.0, 2.0, 1.5)), mpm.LinearElastic(young=2e6, poisson=0.3))
    grid = 0.125 * (np.indices((6, 6, 4)).reshape(3, -1).T + 0.5) + (0.3, 0.6, 0.3)
    model.seed_points(grid, np.full(len(grid), 0.125**3), density=1000.0)
    model.set_gravity((5.0, 0.0, -8.5))
    ground = model.add_contact(surface, friction=0.3, centre=(0, 0, 0.3))
    list(model.explicit(end, dt=5e-4))
    return model, ground


def test_a_block_slides_on_triangles_as_on_a_plane():
    level = 0.3 - 1e-12
    triangles = mpm.Triangles(*sheet((40, 30), (-0.5, -0.5, level), (4.0, 0, 0), (0, 3.0, 0)))
    (model, ground), (other, plane) = sliding(triangles), sliding(mpm.Plane((0, 0, level), (0, 0, 1)))
    assert model.particles.position == pytest.approx(other.particles.position, abs=1e-9)
    assert ground.impulse == pytest.approx(plane.impulse, rel=1e-8) and ground.moment == pytest.approx(plane.moment)


def test_a_triangulated_cube_falls_and_rolls_as_a_box():
    results = []
    lower, upper = np.array([1.0, 0.6, 0.51]), np.array([1.5, 1.1, 0.9])
    for surface in (mpm.Box(lower, upper), mpm.Triangles(*cuboid(lower, upper))):
        model = mpm.Model(box((6, 4, 3), (3.0, 2.0, 1.5)), mpm.LinearElastic(young=2e6, poisson=0.3))
        grid = 0.125 * (np.indices((24, 16, 4)).reshape(3, -1).T + 0.5)
        model.seed_points(grid, np.full(len(grid), 0.125**3), density=1000.0)
        model.fix(5)
        model.set_gravity((0.0, 0.0, -9.81))
        body = mpm.FreeBody(mass=150.0, inertia=(4.0, 4.0, 5.0))
        stone = model.add_contact(surface, friction=0.4, velocity=(0.5, 0, 0), spin=(1.0, 2.0, 0.5), body=body)
        list(model.explicit(0.2, dt=5e-4, energy_limit=np.inf))
        results.append(np.concatenate([stone.displacement, stone.angle, stone.impulse]))
    assert results[0][-1] > 0  # it has hit the ground
    assert results[1] == pytest.approx(results[0], rel=1e-6, abs=1e-8)


def test_the_search_takes_logarithmic_time():
    # 128 times as many triangles take less than 8 times as long; a search through all of them would take 128 times.
    model = mpm.Model(box((2, 2, 2), (4.0, 4.0, 4.0)), mpm.LinearElastic(young=1e6, poisson=0.3))
    points = np.random.default_rng(5).uniform((0.1, 0.1, 1.2), (3.9, 3.9, 3.9), (20000, 3))
    model.seed_points(points, np.full(len(points), 1e-12), density=1.0)
    seconds = []
    for n in (32, 362):
        ground = mpm.Triangles(*sheet((n, n), (0, 0, 1.0), (4.0, 0, 0), (0, 4.0, 0)))
        assert model.gap(ground) == pytest.approx(points[:, 2].min() - 1.0 - RADIUS, abs=1e-9)
        laps = []
        for _ in range(3):
            start = time.process_time()
            model.gap(ground)
            laps.append(time.process_time() - start)
        seconds.append(min(laps))
    assert seconds[1] < 8 * seconds[0]


@pytest.mark.parametrize("name", ["body.stl", "body.obj", "body.ply"])
def test_files_are_read(tmp_path, name):
    points, triangles = cuboid((1, 1, 1), (2, 2, 2), n=2)
    if name.endswith("stl"):  # which has the corners of each triangle for itself
        points, triangles = points[triangles].reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3)
    meshio.write(tmp_path / name, meshio.Mesh(points, [("triangle", triangles)]))
    body = mpm.Triangles.read(tmp_path / name)
    assert len(body.triangles) == 48 and len(body.vertices) == 26
    assert distance(one_particle(), body, (1.5, 1.5, 2.25)) == pytest.approx(0.25, abs=1e-6)


def test_a_written_surface_is_read_again(tmp_path):
    body = mpm.Triangles(*cuboid((1, 1, 1), (2, 2.5, 2)))
    body.write(tmp_path / "body.obj")
    again = mpm.Triangles.read(tmp_path / "body.obj")
    corners = [np.sort(one.vertices[one.triangles].reshape(-1, 9), axis=0) for one in (body, again)]
    assert corners[1] == pytest.approx(corners[0], rel=1e-8)


def test_files_without_triangles_are_named(tmp_path):
    meshio.write(tmp_path / "line.vtk", meshio.Mesh([(0.0, 0, 0), (1.0, 0, 0)], [("line", [[0, 1]])]))
    with pytest.raises(mpm.InputError, match="expected triangles in it, found line"):
        mpm.Triangles.read(tmp_path / "line.vtk")
    with pytest.raises(mpm.InputError, match="nowhere.stl, expected a mesh that meshio reads"):
        mpm.Triangles.read(tmp_path / "nowhere.stl")


def test_a_checkpoint_needs_the_triangles(tmp_path):
    surface = mpm.Triangles(*sheet((100, 100), (-0.5, -0.5, 0.29), (4.0, 0, 0), (0, 3.0, 0)))
    model, ground = sliding(surface, end=0.1)
    model.save(tmp_path / "there.h5")

    def fresh():
        new = mpm.Model(box((6, 4, 3), (3.0, 2.0, 1.5)), mpm.LinearElastic(young=2e6, poisson=0.3))
        new.seed_points([(1.0, 1.0, 1.0)], [1e-3], density=1000.0)
        return new

    with pytest.raises(mpm.InputError, match="a surface of 20000 triangles that the model does not have"):
        fresh().restore(tmp_path / "there.h5")
    resumed = fresh()
    resumed.add_contact(surface)
    resumed.restore(tmp_path / "there.h5")
    for each in (model, resumed):
        list(each.explicit(0.2, dt=5e-4))
    assert np.array_equal(model.particles.position, resumed.particles.position)
    assert len(resumed.contacts) == 1 and resumed.contacts[0].values() == ground.values()


def spoiled(change):
    points, triangles = cuboid((1, 1, 1), (2, 2, 2))
    return points, change(triangles)


def inverted(triangles):
    triangles[17] = triangles[17][::-1]
    return triangles


@pytest.mark.parametrize(
    "points, triangles, message",
    [
        (*spoiled(inverted), r"triangle 17 at \(.*\) m runs the other way"),
        (*spoiled(lambda t: np.concatenate([t, t[:1]])), "triangle 0 has a side that 3 triangles share"),
        (*spoiled(lambda t: np.concatenate([t, [[0, 1, 1]]])), "triangle 192 .* has no area"),
        (*spoiled(lambda t: np.concatenate([t, [[0, 1, 999]]])), r"triangle 192 has the vertices \[0, 1, 999\]"),
        (*spoiled(lambda t: t[:, :2]), "triangles has shape"),
        (*spoiled(lambda t: t * 1.0), "triangles has shape .* dtype float64"),
        (*spoiled(lambda t: t[:0]), "triangles has shape"),
        (np.full((3, 3), np.nan), np.array([[0, 1, 2]]), "vertices is nan"),
    ],
)
def test_wrong_triangles_are_named(points, triangles, message):
    with pytest.raises(mpm.InputError, match=message):
        mpm.Triangles(points, triangles)


def test_a_hole_is_named_by_a_triangle_beside_it():
    points, triangles = sheet((8, 8), (0, 0, 0), (1, 0, 0), (0, 1, 0))
    gone = 27
    with pytest.raises(mpm.InputError, match="a hole beside triangle .* with 3 sides") as error:
        mpm.Triangles(points, np.delete(triangles, gone, axis=0))
    number = int(str(error.value).split("triangle ")[1].split()[0])
    beside = np.delete(triangles, gone, axis=0)[number]
    assert len(set(beside) & set(triangles[gone])) == 2
    mpm.Triangles(points, triangles[1:])  # at the border: no hole


def test_a_body_with_a_hole_is_not_taken_for_ground():
    corners = np.array([(x, y, z) for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))], dtype=float)
    faces = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    cube = np.array([t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))])
    mpm.Triangles(corners, cube)
    with pytest.raises(mpm.InputError, match="a hole beside triangle .* with 3 sides"):
        mpm.Triangles(corners, np.delete(cube, 3, axis=0))
    mpm.Triangles(corners, np.delete(cube, [2, 3], axis=0)[:, ::-1])  # a bin that is open above, with the soil inside


def test_triangles_are_for_three_dimensions():
    model = mpm.Model(box((2, 2)), mpm.LinearElastic(young=1e6, poisson=0.3))
    model.seed_points([(0.5, 0.5)], [1e-3], density=1000.0)
    with pytest.raises(mpm.InputError, match="surface is Triangles"):
        model.add_contact(mpm.Triangles(*cuboid((1, 1, 1), (2, 2, 2))))
