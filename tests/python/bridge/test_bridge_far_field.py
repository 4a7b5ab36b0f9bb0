"""A far field condensed to the border of the particles' mesh: patch test, identities, deep ground, work, restart, errors."""

import numpy as np
import pytest
import ufl
from dolfinx import fem
from far_field_cases import BORDER, DENSITY, LOADED, POISSON, SOIL, YOUNG, everywhere, footing, part_of_box, particles
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge.fem.fields import elastic_stress, strain

COMM = MPI.COMM_WORLD
SIDES = [2, 4, LOADED]
"""Tags of the right side and of the upper one"""
BLOCK = {2: ((3, 2), (4.0, 3.0)), 3: ((3, 2, 2), (4.0, 3.0, 2.0))}
"""Squares or cubes, and lengths, of a block on a fixed base"""


def block_on_mesh(dim, degree, squares):
    """A block on a fixed base as far field, on the nodes of another mesh along its free sides; and that mesh."""
    counts, lengths = BLOCK[dim]
    domain, _, facets = part_of_box(COMM, counts, lengths, everywhere, shake=0.2)
    sides = [LOADED] + [tag for tag in range(1, 2 * dim + 1) if tag != 2 * dim - 1]  # all but the base
    far = bridge.FarField(
        domain, facets, border=np.intersect1d(sides, facets.values), supports=[bridge.fixed(2 * dim - 1)],
        young=YOUNG, poisson=POISSON, degree=degree,
    )  # fmt: skip
    parts = part_of_box(COMM, squares, lengths, everywhere)
    mesh = bridge.background_mesh(*parts)
    return far.on_mesh(mesh, np.intersect1d(sides, parts[2].values).tolist()), mesh


def nodal_forces(mesh, stress):
    """Integral of N t over all sides of a block but its base, under a constant stress (D, D): (nodes, D)."""
    forces = np.zeros(mesh.points.shape)
    for facet in mesh.facets:
        corners = mesh.points[facet]
        axis = np.argmin(np.ptp(corners, axis=0))
        outwards = 1.0 if corners[0, axis] > 1e-9 else -1.0
        if axis == mesh.dim - 1 and outwards < 0:
            continue
        normal = outwards * np.eye(mesh.dim)[axis]
        edges = corners[1:] - corners[0]
        area = np.sqrt(np.linalg.det(edges @ edges.T)) / (mesh.dim - 1)
        forces[facet] += area / mesh.dim * stress @ normal
    return forces


@pytest.mark.parametrize(
    ("dim", "degree", "squares"), [(2, 1, (7, 5)), (2, 2, (5, 7)), (2, 3, (2, 2)), (3, 1, (4, 3, 3)), (3, 2, (2, 3, 1))]
)
def test_constant_stress_passes_the_border_whose_nodes_do_not_match(dim, degree, squares):
    """Patch test, with supports that hold the ends of the border: a linear displacement, zero at the base."""
    border, mesh = block_on_mesh(dim, degree, squares)
    slope = 1e-3 * np.array([0.5, -1.0, 0.3])[-dim:]
    moved = mesh.points[border.nodes][:, -1:] * slope
    gradient = np.outer(slope, np.eye(dim)[-1])
    e = 0.5 * (gradient + gradient.T)
    shear, lame = YOUNG / (2 * (1 + POISSON)), YOUNG * POISSON / ((1 + POISSON) * (1 - 2 * POISSON))
    stress = lame * np.trace(e) * np.eye(dim) + 2 * shear * e
    forces = (border.stiffness @ moved.ravel()).reshape(-1, dim)
    expected = nodal_forces(mesh, stress)[border.nodes]
    assert np.abs(forces - expected).max() < 1e-9 * np.abs(expected).max()


@pytest.mark.parametrize(("degree", "squares"), [(1, (7, 5)), (2, (5, 7))])
def test_constant_stress_passes_the_border_of_a_body_of_revolution(degree, squares):
    """Patch test in axial symmetry: u = (a r, b y) of a cylinder on a smooth base has one stress, along the axis too."""
    counts, lengths = BLOCK[2]
    domain, _, facets = part_of_box(COMM, counts, lengths, everywhere, shake=0.2)
    far = bridge.FarField(
        domain, facets, border=np.intersect1d(SIDES, facets.values),
        supports=[bridge.roller(1, (1, 0)), bridge.roller(3, (0, 1))],
        young=YOUNG, poisson=POISSON, density=DENSITY, degree=degree, geometry=mpm.Geometry.AXISYMMETRIC,
    )  # fmt: skip
    parts = part_of_box(COMM, squares, lengths, everywhere)
    mesh = bridge.background_mesh(*parts)
    border = far.on_mesh(mesh, np.intersect1d(SIDES, parts[2].values).tolist())
    a, b = 1e-3, -2e-3
    shear, lame = YOUNG / (2 * (1 + POISSON)), YOUNG * POISSON / ((1 + POISSON) * (1 - 2 * POISSON))
    stress = lame * (2 * a + b) + 2 * shear * np.array([a, b])
    expected = np.zeros(mesh.points.shape)  # integrals of N t r
    for facet in mesh.facets:
        r, y = mesh.points[facet].T
        for axis, end in ((0, r), (1, y)):
            if np.ptp(end) < 1e-9 and end[0] > lengths[axis] - 1e-9:
                length = np.hypot(np.ptp(r), np.ptp(y))
                expected[facet, axis] += stress[axis] * length * (r + r.sum()) / 6
    forces = (border.stiffness @ (mesh.points[border.nodes] * (a, b)).ravel()).reshape(-1, 2)
    moves = mesh.points[border.nodes] > 1e-9  # where supports hold the ground, their forces are in the balance too
    difference = np.where(moves, forces - expected[border.nodes], 0.0)
    assert np.abs(difference).max() < 1e-9 * np.abs(expected).max()
    assert border.mass[:, 1, 1].sum() < DENSITY * lengths[0] ** 2 / 2 * lengths[1]  # the base carries the rest


@pytest.mark.parametrize(("dim", "degree"), [(2, 2), (3, 1)])
def test_a_rigid_motion_of_free_ground_needs_no_force_and_weight_is_complete(dim, degree):
    counts, lengths = BLOCK[dim]
    domain, _, facets = part_of_box(COMM, counts, lengths, everywhere)
    far = bridge.FarField(
        domain, facets, border=1, supports=[], young=YOUNG, poisson=POISSON, density=DENSITY, degree=degree
    )
    mesh = bridge.background_mesh(*part_of_box(COMM, [2 * n + 1 for n in counts], lengths, everywhere))
    border = far.on_mesh(mesh, 1)
    points = mesh.points[border.nodes]
    motions = [np.broadcast_to(axis, points.shape) for axis in np.eye(dim)]
    turned = np.zeros_like(points)
    turned[:, 0], turned[:, 1] = -points[:, 1], points[:, 0]
    for motion in [*motions, turned]:
        assert np.abs(border.stiffness @ motion.ravel()).max() < 1e-9 * np.abs(border.stiffness).max()
    total = np.prod(lengths) * DENSITY
    assert border.mass.sum(axis=0) == pytest.approx(total * np.eye(dim), abs=1e-9 * total)
    moments = np.einsum("na,nad->d", turned, border.mass)  # the weight of a body acts at its centroid
    centre = np.array(lengths) / 2
    expected = np.zeros(dim)
    expected[:2] = total * np.array([-centre[1], centre[0]])
    assert moments == pytest.approx(expected, abs=1e-9 * total)


def loaded(model, pressure=1e3, **options):
    model.traction(LOADED, (0.3 * pressure, -pressure))
    return model.implicit(1.0, dt=1.0, quasi_static=True, **options).last()


def displacement_at(model, points):
    nearest = np.argmin(np.linalg.norm(model.mesh.points[None] - np.asarray(points)[:, None], axis=2), axis=1)
    return model.nodal("velocity")[nearest]


PLACES = [(0.0, 10.0), (1.0, 10.0), (3.0, 10.0), (5.0, 10.0), (5.0, 8.0), (2.0, 6.0)]


def test_elements_that_match_give_what_particles_everywhere_give():
    """Static condensation is exact: linear elements on the same nodes, under loads and weight."""
    moved = []
    for model, _ in (footing(COMM, 20, gravity=(0.0, -1.0)), footing(COMM, 20, 20, 1, gravity=(0.0, -1.0))):
        loaded(model)
        moved.append(displacement_at(model, PLACES))
    assert np.abs(moved[1] - moved[0]).max() < 1e-10 * np.abs(moved[0]).max()


@pytest.mark.parametrize(
    ("coarse", "degree", "geometry"),
    [(10, 2, None), (10, 3, None), (20, 2, None), (20, 2, mpm.Geometry.AXISYMMETRIC)],
)
def test_a_footing_on_deep_ground_settles_as_with_particles_everywhere(coarse, degree, geometry):
    whole, _ = footing(COMM, 40, geometry=geometry)
    cut, _ = footing(COMM, 40, coarse, degree, geometry=geometry)
    assert len(cut.particles) < 0.2 * len(whole.particles)
    moved = []
    for model in (whole, cut):
        loaded(model)
        moved.append(displacement_at(model, PLACES))
    assert np.abs(moved[1] - moved[0])[:3].max() < 5e-3 * np.abs(moved[0]).max()
    assert np.abs(moved[1] - moved[0]).max() < 1e-2 * np.abs(moved[0]).max()


def test_the_border_does_the_work_that_the_ground_stores():
    model, far = footing(COMM, 20, 5, 2, (4.0, 4.0))
    report = loaded(model)
    moved = far.displacement(model)
    stress = elastic_stress(strain(moved), YOUNG, POISSON)
    stored = fem.assemble_scalar(fem.form(0.5 * ufl.inner(stress, strain(moved)) * ufl.dx))
    border = far.on_mesh(model.mesh, BORDER)
    u = model.far_field_displacement.ravel()
    assert stored == pytest.approx(0.5 * u @ border.stiffness @ u, rel=1e-10)
    # Work of the load, of its end value in one step, is what the soil's stresses did and twice what the ground stores
    nodes = model.nodal("velocity")
    applied = report.external_work + 2 * stored
    assert report.internal_work + 2 * stored == pytest.approx(applied, rel=1e-9)
    assert stored > 0.2 * applied / 2 and np.isfinite(nodes).all()


def test_displacements_of_the_ground_are_those_of_particles_there():
    whole, _ = footing(COMM, 20, gravity=(0.0, -1.0))
    model, far = footing(COMM, 20, 20, 1, gravity=(0.0, -1.0))
    for each in (whole, model):
        loaded(each)
    places = np.array([(10.0, 10.0), (15.0, 5.0), (2.0, 3.0), (5.0, 5.5)])
    found = bridge.evaluate_at(places, displacement=far.displacement(model))["displacement"]
    expected = displacement_at(whole, places)
    assert np.abs(found - expected).max() < 1e-9 * np.abs(expected).max()


def test_a_balanced_far_field_holds_the_soil_as_it_is(tmp_path):
    """In equilibrium nothing moves; a load then adds what it does without weight."""
    held, _ = footing(COMM, 20, 5, reach=(4.0, 4.0), gravity=(0.0, -1.0))
    held.detach_far_field()
    held.roller(BORDER, (1, 0))
    held.fix(BORDER)
    held.equilibrate(small_displacements=True)
    held.release(BORDER)
    _, far = footing(COMM, 20, 5, reach=(4.0, 4.0))
    far.attach(held, BORDER, balanced=True)
    report = held.implicit(1.0, dt=1.0, quasi_static=True, small_displacements=True).last()
    assert np.abs(held.nodal("velocity")).max() < 1e-12 and report.unbalanced_ratio < 1e-6
    held.traction(LOADED, (300.0, -1000.0))
    held.implicit(2.0, dt=1.0, quasi_static=True, small_displacements=True).last()
    free, _ = footing(COMM, 20, 5, reach=(4.0, 4.0))
    loaded(free, small_displacements=True)
    moved, expected = (displacement_at(model, PLACES) for model in (held, free))
    assert np.abs(moved - expected).max() < 1e-8 * np.abs(expected).max()
    beyond = far.displacement(held).x.array
    assert np.abs(beyond).max() == pytest.approx(np.abs(moved[3:]).max(), rel=0.5)

    # After a restart, whatever the gravity was as the far field was attached there
    held.save(tmp_path / "loaded.h5")
    resumed, same = footing(COMM, 20, 5, reach=(4.0, 4.0))
    resumed.restore(tmp_path / "loaded.h5")
    assert np.array_equal(same.displacement(resumed).x.array, beyond)
    assert resumed.far_field_gravity.tolist() == [0.0, -1.0] and free.far_field_gravity.tolist() == [0.0, 0.0]


@pytest.mark.parametrize("solver", [mpm.Newton(), mpm.Relaxation(tolerance=1e-9)])
def test_steps_with_inertia_have_one_root_whichever_solver_finds_it(solver):
    model, _ = footing(COMM, 10, 5, reach=(4.0, 4.0), gravity=(0.0, -1.0))
    list(model.implicit(0.02, dt=0.01, solver=solver))
    other, _ = footing(COMM, 10, 5, reach=(4.0, 4.0), gravity=(0.0, -1.0))
    list(other.implicit(0.02, dt=0.01, solver=mpm.Newton(tolerance=1e-11)))
    expected = other.particles.velocity
    assert np.abs(model.particles.velocity - expected).max() < 1e-6 * np.abs(expected).max()


def test_a_run_goes_on_from_a_checkpoint_to_the_last_bit(tmp_path):
    def begun():
        return footing(COMM, 10, 5, reach=(4.0, 4.0), gravity=(0.0, -1.0))[0]

    model, resumed = begun(), begun()
    list(model.implicit(0.05, dt=0.01))
    model.save(tmp_path / "half.h5")
    list(model.implicit(0.1, dt=0.01))
    resumed.restore(tmp_path / "half.h5")
    list(resumed.implicit(0.1, dt=0.01))
    assert np.array_equal(resumed.far_field_displacement, model.far_field_displacement)
    for name in ("position", "velocity", "stress"):
        assert np.array_equal(getattr(resumed.particles, name), getattr(model.particles, name))
    bare = begun()
    bare.detach_far_field()
    with pytest.raises(mpm.InputError, match="half.h5 is of a run with a far field, the model has none"):
        bare.restore(tmp_path / "half.h5")
    other, _ = footing(COMM, 10, 10, reach=(4.0, 4.0))
    with pytest.raises(mpm.InputError, match="the model has another one"):
        other.restore(tmp_path / "half.h5")


def one_far_field(**changes):
    domain, _, facets = part_of_box(COMM, (4, 2), (4.0, 2.0), everywhere)
    given = dict(border=1, supports=[bridge.fixed(3)], young=YOUNG, poisson=POISSON)
    return bridge.FarField(domain, facets, **{**given, **changes})


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"young": -1.0}, "young is -1.0 Pa"),
        ({"poisson": 0.5}, "poisson is 0.5"),
        ({"density": np.nan}, "density is nan"),
        ({"degree": 0}, "degree is 0, expected a whole number from 1"),
        ({"border": 77}, "border: no facet has the tag 77"),
        ({"supports": [bridge.prescribed(3, (0.0, -0.1))]}, "supports: .*moves, expected displacements of zero"),
    ],
)
def test_what_a_far_field_refuses(changes, words):
    with pytest.raises(bridge.InputError, match=words):
        one_far_field(**changes)


def test_a_border_elsewhere_is_refused_with_both_lengths():
    model = particles(part_of_box(COMM, (4, 2), (4.0, 2.0), everywhere))
    with pytest.raises(bridge.InputError, match="facets have 4 m.*border of the far field 2.*0 lie on each other"):
        one_far_field().attach(model, 3)


def test_what_a_model_refuses():
    far = one_far_field()
    model = particles(part_of_box(COMM, (4, 2), (4.0, 2.0), everywhere))
    far.attach(model, 1)
    with pytest.raises(mpm.InputError, match="explicit scheme does not support far fields"):
        model.explicit(0.1)
    with pytest.raises(mpm.InputError, match="stiffness is not symmetric"):
        model.attach_far_field([0], [[1.0, 2.0], [0.0, 1.0]])
    with pytest.raises(mpm.InputError, match="nodes has shape .2,. .*expected different"):
        model.attach_far_field([0, 0], np.eye(4))
    with pytest.raises(mpm.InputError, match=r"mass has shape \(2, 2\), expected \(1, 2, 2\)"):
        model.attach_far_field([0], np.eye(2), np.eye(2))
    domain, cells, facets = part_of_box(COMM, (4, 2), (4.0, 2.0), everywhere)
    empty = mpm.Model(bridge.background_mesh(domain, cells, facets), SOIL)
    with pytest.raises(mpm.InputError, match="border of the far field has no soil around it"):
        far.attach(empty, 1)
    round_body = mpm.Model(empty.mesh, SOIL, geometry=mpm.Geometry.AXISYMMETRIC)
    round_body.seed(density=DENSITY, per_cell=3)
    with pytest.raises(
        mpm.InputError, match="geometry of the finite elements is PLANE_STRAIN, that of the particles is AXISYMMETRIC"
    ):
        far.attach(round_body, 1)
