"""The bridge gives the same on 1, 2 and 3 ranks: `mpirun -n N python3 -m pytest tests/mpi`."""

from collections import Counter

import numpy as np
import pytest
from axisymmetric_cases import cylinder_fem, cylinder_particles
from bridge_cases import (
    MESHES,
    POISSON,
    UNIT_WEIGHT,
    YOUNG,
    clay_block,
    column,
    column_stress,
    interior_points,
    slope_model,
    slope_particles,
)
from mpi4py import MPI
from partitions import all_by_id, assert_same

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge.mesh.tagged import owned_cells

COMM = MPI.COMM_WORLD
SUPPORTS = [bridge.roller(bridge.LEFT, (1, 0)), bridge.fixed(bridge.BASE)]


def slope():
    return bridge.slope_mesh(COMM)


def gathered(array):
    return np.concatenate(COMM.allgather(array))


def test_every_cell_has_one_owner_and_ghosts_carry_their_tags():
    domain, cell_tags, facet_tags = slope()
    arrays = bridge.background_arrays(domain, cell_tags, facet_tags)
    n_owned = owned_cells(domain)
    mine = arrays["cell_owners"] == COMM.rank
    assert mine[:n_owned].all() and not mine[n_owned:].any()
    cells = gathered(arrays["global_cells"][:n_owned])
    tags = gathered(arrays["cell_tags"][:n_owned])
    assert sorted(cells) == list(range(len(cells)))
    assert np.sum(tags == bridge.SOIL) == 640 and not np.any(tags == 0)
    tag_of = dict(zip(cells, tags))
    assert all(tag_of[c] == t for c, t in zip(arrays["global_cells"], arrays["cell_tags"]))
    originals = gathered(bridge.original_cells(domain))
    assert sorted(originals) == list(range(len(cells)))


def test_shared_nodes_agree():
    arrays = bridge.background_arrays(*slope())
    numbers, points = gathered(arrays["global_nodes"]), gathered(arrays["points"])
    reference = np.zeros((numbers.max() + 1, 2))
    reference[numbers] = points
    assert np.array_equal(reference[numbers], points)


@pytest.mark.parametrize(
    ("body", "expected"),
    [("background", {1: 11, 2: 41, 3: 11, 4: 41, 5: 20, 6: 11}), ("soil", {1: 10, 2: 21, 5: 20, 6: 11})],
)
def test_facet_tags_do_not_depend_on_the_partition(body, expected):
    arrays = bridge.background_arrays(*(slope() if body == "background" else bridge.soil_mesh(*slope())))
    middle = gathered(arrays["points"][arrays["facets"]].mean(axis=1)).round(9)
    facets = {(int(tag), *x) for tag, x in zip(gathered(arrays["facet_tags"]), middle.tolist())}
    assert Counter(tag for tag, *_ in facets) == expected


def test_soil_body_far_from_some_ranks_is_shared_by_all():
    domain, cell_tags, facet_tags = bridge.slope_mesh(COMM, runout=20.0)
    soil, _, _ = bridge.soil_mesh(domain, cell_tags, facet_tags)
    counts = COMM.allgather(owned_cells(soil))
    assert sum(counts) == 640 and min(counts) > 0


@pytest.mark.parametrize("degree", [1, 2])
def test_slope_does_not_depend_on_the_number_of_ranks(degree):
    points = np.array([[1.1, 1.0], [0.53, 0.45], [1.62, 0.31]])
    results = []
    for comm in (COMM, MPI.COMM_SELF):
        soil, _, facet_tags = bridge.soil_mesh(*bridge.slope_mesh(comm))
        solution = bridge.solve_elastic(soil, facet_tags, SUPPORTS, YOUNG, POISSON, UNIT_WEIGHT, degree)
        results.append((solution.evaluate_at(points), solution.evaluate_at(points[1:], smooth=True)["stress"]))
    (here, here_smooth), (alone, alone_smooth) = results
    assert np.allclose(here["displacement"], alone["displacement"], rtol=1e-9)
    assert np.allclose(here["stress"][1:], alone["stress"][1:], rtol=1e-8)
    assert np.allclose(here_smooth, alone_smooth, rtol=1e-8)


@pytest.mark.parametrize("dim", [2, 3])
def test_points_are_found_on_whatever_rank_they_are(dim):
    domain, facet_tags, supports, _ = column(dim)
    solution = bridge.solve_elastic(domain, facet_tags, supports, YOUNG, POISSON, UNIT_WEIGHT, degree=2)
    points = interior_points(100 * COMM.rank, dim, seed=COMM.rank)  # none on rank 0
    values = solution.evaluate_at(points)
    assert np.allclose(values["stress"], column_stress(points[:, -1], dim), atol=1e-8 * UNIT_WEIGHT)


def test_errors_reach_every_rank():
    with pytest.raises(bridge.InputError, match="no file"):
        bridge.read_mesh("nowhere.msh", COMM)
    domain, _, facet_tags = bridge.soil_mesh(*slope())
    last = COMM.size - 1
    points = np.array([[9.0, 9.0]]) if COMM.rank == last else np.array([[0.5, 0.5]])
    with pytest.raises(bridge.InputError, match=rf"point 0 on rank {last} at \(9, 9\)"):
        bridge.PointSearch(domain, points).require_all()
    with pytest.raises(bridge.InputError, match="tag 99"):
        bridge.solve_elastic(domain, facet_tags, [bridge.fixed(99)], YOUNG, POISSON, UNIT_WEIGHT)


@pytest.mark.parametrize(
    ("dilation_angle", "options"), [(25.0, {}), (0.0, {}), (0.0, {"degree": 1, "nmd": True}), (0.0, {"degree": 4})]
)
def test_plastic_slope_does_not_depend_on_the_number_of_ranks(dilation_angle, options):
    points = np.array([[1.1, 1.0], [0.53, 0.45], [1.62, 0.31]])
    results = []
    for comm in (COMM, MPI.COMM_SELF):
        solver = bridge.Solver(tolerance=1e-12)
        model = slope_model(0.2, dilation_angle=dilation_angle, comm=comm, solver=solver, **options)
        model.solve(bridge.Load(unit_weight=18e3))
        assert model.converged
        values = model.evaluate_at(points)
        results.append((values["displacement"], values["stress"], model.reaction(bridge.BASE)))
    for here, alone in zip(*results):
        assert np.allclose(here, alone, rtol=0, atol=1e-8 * np.abs(alone).max())


@pytest.mark.parametrize("dilation_angle", [25.0, 0.0])
def test_factor_of_safety_does_not_depend_on_the_number_of_ranks(dilation_angle):
    models = (slope_model(0.2, "fitted", dilation_angle, comm) for comm in (COMM, MPI.COMM_SELF))
    here, alone = (bridge.factor_of_safety(model, bridge.Load(unit_weight=20e3)) for model in models)
    assert here.failed and alone.failed
    assert here.value == pytest.approx(alone.value, rel=1e-2)  # rounding decides which of the last steps fails


def test_relaxation_does_not_depend_on_the_number_of_ranks():
    models = [slope_model(0.2, "fitted", 0.0, comm) for comm in (COMM, MPI.COMM_SELF)]
    here, alone = (model.equilibrate(bridge.Load(unit_weight=18e3), max_iterations=1) for model in models)
    assert here.relaxation is not None and here.iterations == alone.iterations
    assert np.allclose(here.relaxation.growth, alone.relaxation.growth, rtol=1e-8)
    assert np.allclose(here.relaxation.carried, alone.relaxation.carried, rtol=1e-8)
    assert models[0].reaction(bridge.BASE) == pytest.approx(models[1].reaction(bridge.BASE), rel=1e-8, abs=1e-8)


def test_a_slope_on_a_mesh_of_gmsh_slides_alike_on_any_number_of_ranks():
    """A thousand steps without damping, on DOLFINx's partition and after a repartition."""
    runs = []
    for comm, threshold in ((COMM, 1.2), (MPI.COMM_SELF, None)):
        parts = bridge.read_mesh(MESHES / "slope.geo", comm, 2, {"cell_size": 0.1})
        soil = mpm.MohrCoulomb(young=YOUNG, poisson=POISSON, cohesion=1e3, friction_angle=25.0)
        model = mpm.Model(bridge.background_mesh(*parts), soil)
        model.seed(density=80e3 / 9.81, per_cell=3, cell_tag=bridge.SOIL)
        model.roller(bridge.LEFT, (1, 0))
        model.fix(bridge.BASE)
        model.set_gravity((0, -9.81))
        *_, report = model.explicit(1.0, dt=1e-3, pic=0.01, rebalance=threshold)
        assert report.steps == 1000
        runs.append(all_by_id(model))
    assert np.abs(runs[1]["displacement"]).max() > 0.5 and runs[1]["state"].max() > 0.1
    assert_same(*runs)


def test_the_damped_slope_of_the_paper_slides_alike_on_any_number_of_ranks():
    """Three seconds with the damping of 0.75: slow nodes do not chatter, so that round-off stays round-off."""
    runs = []
    for comm in (COMM, MPI.COMM_SELF):
        model = slope_particles(80e3, cell_size=0.1, comm=comm)
        list(model.explicit(3.0, damping=0.75))
        runs.append(all_by_id(model, ("displacement",)))
    assert np.abs(runs[1]["displacement"]).max() > 0.15
    assert_same(*runs)


def by_id(model, *names):
    """Fields of all particles, by rising id."""
    order = np.argsort(gathered(model.particles.id))
    return [gathered(getattr(model.particles, name))[order] for name in names]


HANDED_OVER = ("stress", "state", "volume", "position", "deviatoric_strain")


def handed_over(model, comm):
    """Fields that particles take over, of all of them by rising id."""
    return (by_id if comm is COMM else in_order)(model, *HANDED_OVER)


def assert_same_hand_over(results, absolute):
    """Out-of-balance ratios and fields on all ranks, and on one alone."""
    (here, fields_here), (alone, fields_alone) = results
    assert here == pytest.approx(alone, rel=1e-3, abs=absolute)
    for mine, whole in zip(fields_here, fields_alone):
        assert np.allclose(mine, whole, rtol=0, atol=1e-6 * np.abs(whole).max())


@pytest.mark.parametrize(
    ("degree", "fem_size", "cell_size", "options"),
    [
        (2, 0.1, 0.1, {}),
        (2, 0.2, 0.1, {"smooth": True}),
        (1, 0.1, 0.1, {"move": True}),
        (2, 0.2, 0.1, {"move": True}),
    ],
)
def test_hand_over_between_different_partitions(degree, fem_size, cell_size, options):
    """Alone or shared, particles get the same from the finite elements, and come into equilibrium."""
    results = []
    for comm in (COMM, MPI.COMM_SELF):
        fem = slope_model(fem_size, dilation_angle=0.0, degree=degree, comm=comm)
        fem.solve(bridge.Load(unit_weight=18e3))
        model = slope_particles(18e3, cell_size=cell_size, comm=comm)
        report = bridge.initialise(model, fem, equilibrate=False, **options)
        if not options:
            assert report.unbalanced_ratio < 1e-10 and report.returned_fraction == 0
        results.append((report.unbalanced_ratio, handed_over(model, comm)))
    assert_same_hand_over(results, 1e-10)
    fem = slope_model(fem_size, dilation_angle=0.0, degree=degree)
    fem.solve(bridge.Load(unit_weight=18e3))
    report = bridge.initialise(slope_particles(18e3, cell_size=cell_size), fem, **options)
    assert report.equilibrated_ratio < 1e-3 and report.yielded_fraction < 0.01


def in_order(model, *names):
    order = np.argsort(model.particles.id)
    return [getattr(model.particles, name)[order] for name in names]


@pytest.mark.parametrize("options", [{"degree": 1, "nmd": True}, {"degree": 2}, {"degree": 4}])
def test_axisymmetric_elements_are_the_same_on_any_number_of_ranks(options):
    """A cylinder of clay under a rigid plate that yields in part, and an elastic ring around it."""
    found = []
    for comm in (COMM, MPI.COMM_SELF):
        domain, _, facet_tags = bridge.box_mesh(comm, [1.0, 1.0], [6, 6])
        law = mpm.MohrCoulomb(young=1e6, poisson=0.3, cohesion=5e3, friction_angle=20.0)
        supports = [bridge.roller(1, (1, 0)), bridge.fixed(3), bridge.prescribed(4, (0.0, -0.02))]
        geometry = bridge.Geometry.AXISYMMETRIC
        fem = bridge.QuasiStatic(domain, law, facet_tags, supports, geometry=geometry, **options)
        fem.solve(bridge.Load(unit_weight=18e3, displacement=1.0))
        assert fem.converged
        points = np.random.default_rng(2).uniform(0.05, 0.95, (20, 2))
        values = fem.evaluate_at(points, smooth=True)
        found.append((fem.reaction(4)[1], values["stress"], values["displacement"]))
        assert comm.allreduce(int((fem.points.state[:, 0] > 0).sum())) > 10
    for here, alone in zip(*found):
        np.testing.assert_allclose(here, alone, rtol=0, atol=1e-6 * np.abs(alone).max())


@pytest.mark.parametrize(("degree", "options"), [(1, {}), (2, {"smooth": True}), (1, {"move": True})])
def test_axisymmetric_hand_over_between_different_partitions(degree, options):
    """Stresses with the hoop, state, places and volumes of one radian; in place the linear elements are in balance at once."""
    results = []
    for comm in (COMM, MPI.COMM_SELF):
        elements = cylinder_fem(8, comm, degree=degree)
        model = cylinder_particles(8, comm, headroom=0.25)
        report = bridge.initialise(model, elements, equilibrate=False, **options)
        if degree == 1 and not options:
            assert report.unbalanced_ratio < 1e-8
        results.append((report.unbalanced_ratio, handed_over(model, comm)))
    assert_same_hand_over(results, 1e-8)
    report = bridge.initialise(cylinder_particles(8, headroom=0.25), cylinder_fem(8, degree=degree), **options)
    assert report.equilibrated_ratio < 1e-3


@pytest.mark.parametrize(
    "geometry", [bridge.Geometry.PLANE_STRAIN, bridge.Geometry.AXISYMMETRIC, bridge.Geometry.SOLID]
)
def test_averaged_elements_hand_over_in_equilibrium_for_averaged_steps(geometry):
    """Means over nodes that ranks share are the same in elements and particles: nothing moves in the steps that follow."""
    fem, model = clay_block(geometry, COMM, below=mpm.LinearElastic(young=20e6, poisson=0.3))
    report = bridge.initialise(model, fem, count_displacement=False, equilibrate=False)
    assert report.unbalanced_ratio < 1e-9
    settlement = COMM.allreduce(float(np.abs(fem.displacement.x.array).max(initial=0.0)), MPI.MAX)
    model.explicit(0.01, nmd=True).last()
    moved = COMM.allreduce(float(np.abs(model.particles.displacement).max(initial=0.0)), MPI.MAX)
    assert moved < 1e-6 * settlement


@pytest.mark.parametrize("dim", [2, 3])
def test_averaged_elements_on_ranks_without_cells(dim):
    """Of two triangles a third rank has none; six tetrahedra are for comparison."""
    points, moved = np.array([[0.5] * dim, [0.9] * dim]), []
    for comm in (MPI.COMM_SELF, MPI.COMM_WORLD):
        domain, _, facet_tags = bridge.box_mesh(comm, [1.0] * dim, [1] * dim)
        supports = [bridge.roller(1, tuple(np.eye(dim)[0])), bridge.fixed(2 * dim - 1)]
        law = mpm.MohrCoulomb(young=2e6, poisson=0.3, cohesion=9e3, friction_angle=20.0)
        fem = bridge.QuasiStatic(domain, law, facet_tags, supports, degree=1, nmd=True)
        fem.solve(bridge.Load(unit_weight=18e3))
        moved.append(fem.evaluate_at(points)["displacement"])
    assert np.allclose(moved[0], moved[1], rtol=0, atol=1e-9 * np.abs(moved[0]).max()) and np.abs(moved[0]).max() > 0
