"""Nodal mixed discretisation in finite elements."""

import numpy as np
import pytest
from bridge_cases import CLAY, MESHES, POISSON, YOUNG, clay_block, column, slope_model, slope_particles
from dolfinx.mesh import compute_midpoints, meshtags
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge.fem import linear_solver

LAYERS = [f"layer {k}" for k in (1, 2, 3, 4)]


def strain_of(dim, field):
    """Averaged strain (n, S) of a displacement field given as a function of (3, k) points."""
    domain, facet_tags, supports, _ = column(dim)
    law = mpm.LinearElastic(young=YOUNG, poisson=POISSON)
    model = bridge.QuasiStatic(domain, law, facet_tags, supports, degree=1, nmd=True)
    model.increment.interpolate(field)
    return model._kinematics.strain_increment()


def test_linear_field_is_left_alone():
    strain = strain_of(2, lambda x: np.stack([1e-3 * x[0] + 2e-3 * x[1], -4e-3 * x[0] + 3e-3 * x[1]]))
    assert np.allclose(strain, [1e-3, 3e-3, 0, -2e-3], atol=1e-15)
    strain = strain_of(3, lambda x: np.stack([1e-3 * x[0], 2e-3 * x[1] + 5e-3 * x[2], 3e-3 * x[2] + 1e-3 * x[0]]))
    assert np.allclose(strain, [1e-3, 2e-3, 3e-3, 0, 5e-3, 1e-3], atol=1e-15)


def test_plane_strain_stays_plane():
    strain = strain_of(2, lambda x: np.stack([x[0] ** 2, x[0] * x[1]]))
    assert not strain[:, 2].any()


@pytest.mark.parametrize("as_particles", [False, True])
@pytest.mark.parametrize("dim", [2, 3])
def test_a_uniform_pressure_is_in_equilibrium_where_soils_of_different_averages_meet(dim, as_particles):
    """Forces of clay are averaged in full, those of sand by half or a little more: inside they add up to zero."""
    domain, facet_tags, supports, _ = column(dim)
    clay, sand = mpm.MohrCoulomb(young=3e6, poisson=0.45, cohesion=1e4, friction_angle=0.0), loam(2.0)
    heights = domain.geometry.x[domain.geometry.dofmap.array.reshape(-1, dim + 1)].mean(axis=1)[:, dim - 1]
    number = (heights > 0.5).astype(np.int32)
    assert 0 < number.sum() < len(number)
    tags = meshtags(domain, dim, np.arange(len(number), dtype=np.int32), number)
    options = {"degree": 1, "nmd": True, "as_particles": as_particles, "cell_tags": tags}
    kinematics = bridge.QuasiStatic(domain, {0: clay, 1: sand}, facet_tags, supports, **options)._kinematics
    n = len(kinematics._strain.volumes)
    stress = np.zeros((n, 4 if dim == 2 else 6))
    stress[:, :3] = -1e4
    forces = np.array(kinematics.internal_forces(stress).array).reshape(-1, dim)
    x = kinematics._space.tabulate_dof_coordinates()[:, :dim]
    inside = ((x > x.min(axis=0) + 1e-9) & (x < x.max(axis=0) - 1e-9)).all(axis=1)
    assert inside.any() and np.abs(forces[inside]).max() < 1e-12 * np.abs(forces).max()


def halves(domain, height):
    """Tags of cells: 0 in the lower half, 1 in the upper one."""
    middle = compute_midpoints(domain, 2, np.arange(len(domain.geometry.dofmap.array) // 3, dtype=np.int32))[:, 1]
    return meshtags(domain, 2, np.arange(len(middle), dtype=np.int32), (middle > height / 2).astype(np.int32))


def layers(rows, young):
    """(settlement, mean stress of the soil over its exact one by row of cells from below) of soil on soil under its weight.

    young: Young's moduli of the lower and the upper half [Pa].
    """
    height, weight, poisson = 1.0, 20e3, 0.3
    domain, _, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, (0.25, height), (rows // 4, rows))
    tags = halves(domain, height)
    middle = compute_midpoints(domain, 2, tags.indices)[:, 1]
    laws = {k: mpm.LinearElastic(young=e, poisson=poisson) for k, e in enumerate(young)}
    supports = [bridge.roller(1, (1, 0)), bridge.roller(2, (1, 0)), bridge.fixed(3)]
    model = bridge.QuasiStatic(domain, laws, facet_tags, supports, degree=1, nmd=True, cell_tags=tags)
    model.solve(bridge.Load(unit_weight=weight))
    vertical = -weight * (height - middle)
    ratio = model.points.stress[:, :3].mean(axis=1) / (vertical * (1 + poisson) / (3 * (1 - poisson)))
    row = (middle * rows / height).astype(int)
    return -model.displacement.x.array.min(), np.bincount(row, ratio) / np.bincount(row)


@pytest.mark.parametrize("young", [(20e6, 2e6), (2e6, 20e6)], ids=["soft on stiff", "stiff on soft"])
def test_strains_of_soft_soil_are_no_stresses_of_the_stiff_soil_beside_it(young):
    """Means over both gave the nearest row of the stiff soil 2.5 times its stress, and an error of first order."""
    height, weight = 1.0, 20e3
    oedometer = np.array(young) * 0.7 / (1.3 * 0.4)
    exact = weight * height**2 / 8 * (3 / oedometer[0] + 1 / oedometer[1])
    errors = []
    for rows in (8, 16):
        settlement, ratio = layers(rows, young)
        assert ratio[rows // 2 - 2 : rows // 2 + 2] == pytest.approx(1.0, abs=0.06)
        errors.append(abs(settlement / exact - 1))
    assert errors[0] < 0.01 and errors[1] < 0.3 * errors[0]


def embankment(degree):
    """A bank of sand with little dilation on soft clay, 1:1.5, and its weight."""
    domain, cell_tags, facet_tags = bridge.read_mesh(
        MESHES / "embankment.geo", MPI.COMM_WORLD, parameters={"width": 18}
    )
    supports = [bridge.fixed("base"), bridge.roller("axis", (1, 0)), bridge.roller("right", (1, 0))]
    body, tags, facets = bridge.soil_mesh(domain, cell_tags, facet_tags, tag=["clay", *LAYERS])
    clay = mpm.MohrCoulomb(young=3e6, poisson=0.45, cohesion=15e3, friction_angle=0.0)
    sand = mpm.MohrCoulomb(young=20e6, poisson=0.3, cohesion=5e3, friction_angle=32.0, dilation_angle=5.0)
    laws = {"clay": clay, **{layer: sand for layer in LAYERS}}
    model = bridge.QuasiStatic(body, laws, facets, supports, degree, cell_tags=tags, nmd=degree == 1)
    return model, bridge.Load(unit_weight=19e3)


def test_clay_below_sand_settles_as_in_quadratic_elements():
    """Forces that did not balance where the soils meet moved it by twice as much."""
    moved = {}
    for degree in (1, 2):
        model, weight = embankment(degree)
        model.solve(weight)
        assert model.converged
        moved[degree] = np.abs(model.displacement.x.array).max()
    assert moved[1] == pytest.approx(moved[2], rel=0.05)


def test_particles_in_small_displacements_follow_elements_in_soil_with_little_dilation():
    """Averages as those of the elements: the same stresses, by as many iterations; with strains and forces averaged by half they would
    alternate at edges of the strength, and take 45 iterations and more."""
    mesh = bridge.read_mesh(MESHES / "embankment.geo", MPI.COMM_WORLD)
    clay = mpm.MohrCoulomb(young=3e6, poisson=0.45, cohesion=15e3, friction_angle=0.0)
    sand = mpm.MohrCoulomb(young=20e6, poisson=0.3, cohesion=5e3, friction_angle=32.0, dilation_angle=5.0)
    soils = ["clay", *LAYERS]
    laws = {soil: clay if soil == "clay" else sand for soil in soils}
    held = {"base": bridge.fixed("base")} | {side: bridge.roller(side, (1, 0)) for side in ("axis", "right")}
    stages = [bridge.Stage(soil, fill=soil, unit_weight={soil: 19e3}) for soil in soils[:4]]
    body, tags, facets = bridge.soil_mesh(*mesh, tag=soils)
    fem = bridge.FemSite(
        bridge.QuasiStatic(body, laws, facets, list(held.values()), 1, cell_tags=tags, nmd=True), first_step=1.0
    )
    model = mpm.Model(bridge.background_mesh(*mesh), list(laws.values()))
    numbers = {soil: k for k, soil in enumerate(laws)}
    options = {"small_displacements": True, "nmd": True, "solver": mpm.Newton(tolerance=1e-10), "tolerance": 1e-8}
    particles = bridge.ParticleSite(model, numbers, list(held.values()), **options)
    for stage in stages:
        fem.carry_out(stage)
        assert particles.carry_out(stage).iterations < 20
    p = particles.model.particles
    expected = fem.fem.evaluate_at(p.position)["stress"]
    assert np.allclose(p.stress, expected, rtol=0, atol=1e-6 * np.abs(expected).max())
    assert p.plastic_strain.max() > 1e-3


def test_sand_with_little_dilation_does_not_fail_too_early_in_tension():
    """Where forces of sand are not averaged at all, tension alternates at the crest: the factor was 4 % too low, and fell with
    the cells."""
    search = {"start": 1.14, "first_step": 0.03, "tolerance": 4e-3}
    linear, quadratic = (bridge.factor_of_safety(*embankment(degree), **search) for degree in (1, 2))
    assert linear.failed and quadratic.failed
    assert quadratic.value < linear.value < 1.03 * quadratic.value


def test_particles_average_alike():
    """Particles average strains, finite elements the mean stress too: the difference goes away with the cell size."""
    law = mpm.LinearElastic(young=YOUNG, poisson=0.49)
    differences = []
    for cell_size in (0.1, 0.05):
        fem = slope_model(cell_size, degree=1, nmd=True)
        fem.equilibrate(bridge.Load(unit_weight=10e3), law)
        model = slope_particles(10e3, cell_size, law=law)
        for _ in model.implicit(until=1.0, dt=1.0, quasi_static=True, nmd=True):
            pass
        differences.append(bridge.compare(fem, model)["displacement"].l2)
    assert differences[0] < 2e-3 and differences[1] < 0.7 * differences[0]


@pytest.mark.parametrize(("nmd", "low", "high"), [(False, 1.15, 1.5), (True, 1.0, 1.03)])
def test_strip_footing_without_friction_locks_unless_strains_are_averaged(nmd, low, high):
    domain, _, facet_tags = bridge.read_mesh(MESHES / "footing.geo", MPI.COMM_WORLD)
    law = mpm.MohrCoulomb(young=1e5, poisson=0.3, cohesion=1e3, friction_angle=0.0)
    supports = [bridge.roller(1, (1, 0)), bridge.roller(3, (1, 0)), bridge.fixed(2)]
    model = bridge.QuasiStatic(domain, law, facet_tags, supports, degree=1, nmd=nmd)
    result = bridge.collapse_load(model, lambda q: bridge.Load(pressure={5: q}), first_step=2e3)
    assert low < result.value / 1e3 / (2 + np.pi) < high


def loam(dilation_angle, cohesion=2e3, friction_angle=34.0):
    return mpm.MohrCoulomb(
        young=30e6, poisson=0.3, cohesion=cohesion, friction_angle=friction_angle, dilation_angle=dilation_angle
    )


def bank(cell_size, law, **options):
    """A bank of 3 m, 1:2, in the middle of a body of 30 m."""
    shape = {"height": 3.0, "angle": 26.565, "crest": 12.0, "runout": 12.0, "depth": 6.0}
    sizes = {"cell_size": cell_size, "far_size": 2 * cell_size}
    domain, _, facet_tags = bridge.read_mesh(MESHES / "hillside.geo", MPI.COMM_WORLD, parameters=shape | sizes)
    supports = [bridge.roller("left", (1, 0)), bridge.roller("right", (1, 0)), bridge.fixed("base")]
    return bridge.QuasiStatic(domain, law, facet_tags, supports, **options)


def factor_of_bank(model):
    return bridge.factor_of_safety(model, bridge.Load(unit_weight=20e3), start=1.6, first_step=0.2)


def test_soil_without_dilation_fails_no_earlier_than_in_quadratic_elements():
    """Both come down to the same factor; forces that are averaged in full would give 1.45 and 1.48 in place of 2.0."""

    def found(cell_size, **options):
        return factor_of_bank(bank(cell_size, loam(0.0), **options))

    linear, quadratic = (
        [found(size, **o) for size in (2.0, 0.75)] for o in ({"degree": 1, "nmd": True}, {"degree": 2})
    )
    assert all(one.failed for one in linear + quadratic)
    excess = [one.value / other.value - 1 for one, other in zip(linear, quadratic)]
    assert -0.01 < excess[1] < 0.6 * excess[0]


def test_soil_that_hardly_dilates_is_right_at_its_reduced_strength():
    """tan(psi) / tan(phi) is 0.08 at the start and 0.15 in failure; averaged forces would give 1.82."""
    model, reference = bank(0.75, loam(3.0), degree=1, nmd=True), bank(0.75, loam(3.0), degree=2)
    linear, quadratic = factor_of_bank(model), factor_of_bank(reference)
    assert linear.failed and quadratic.failed
    assert linear.value == pytest.approx(quadratic.value, rel=0.02)


def test_forces_are_conjugate_to_strain_in_associated_flow_and_averaged_by_half_without_dilation():
    plain, averaged = (bank(2.0, loam(0.0), degree=1, nmd=nmd) for nmd in (False, True))
    stress = 1e3 * np.random.default_rng(7).normal(size=plain.points.stress.shape)

    def forces(model):
        return np.array(model._kinematics.internal_forces(stress).array)

    by_half = forces(averaged)
    averaged._kinematics.follow([loam(34.0)])
    mean = 0.5 * (forces(plain) + forces(averaged))
    assert np.allclose(by_half, mean, rtol=0, atol=1e-12 * np.abs(mean).max())
    averaged.increment.x.array[:] = 1e-3 * np.random.default_rng(8).normal(size=len(averaged.increment.x.array))
    volumes = averaged._kinematics._strain.volumes
    work = np.sum(volumes[:, None] * stress * averaged._kinematics.strain_increment())
    assert forces(averaged) @ averaged.increment.x.array == pytest.approx(work, rel=1e-12)


def test_forces_follow_a_law_that_changes():
    """Davis' strength of soil without dilation is that of soil with associated flow."""
    model = bank(2.0, loam(0.0), degree=1, nmd=True)
    associated = bank(2.0, bridge.davis_strength(loam(0.0)), degree=1, nmd=True)
    weight = bridge.Load(unit_weight=20e3)
    assert model.equilibrate(weight, bridge.davis_strength(loam(0.0))).converged
    assert associated.equilibrate(weight).converged
    assert np.allclose(model.displacement.x.array, associated.displacement.x.array, rtol=0, atol=1e-12)


@pytest.mark.parametrize("dilation_angle", [0.0, 34.0])
@pytest.mark.parametrize("dim", [2, 3, "axisymmetric"])
def test_stiffness_in_factors_is_the_matrix_that_is_multiplied_out(dim, dilation_angle, monkeypatch):
    """The product of both with the same vector, also with a part of another tangent added; soil that yields."""
    products = []
    for limit in (10**6, 0):
        monkeypatch.setattr(linear_solver, "AVERAGED_LIMIT", limit)
        monkeypatch.setattr(linear_solver, "DIRECT_LIMIT", {2: limit, 3: limit})
        geometry = mpm.Geometry.AXISYMMETRIC if dim == "axisymmetric" else None
        domain, facet_tags, supports, _ = column(2 if geometry else dim)
        model = bridge.QuasiStatic(
            domain, loam(dilation_angle, cohesion=1.0), facet_tags, supports, degree=1, nmd=True, geometry=geometry
        )
        assert model._body.solver.direct == (limit > 0)
        strain = 1e-3 * np.random.default_rng(3).normal(size=model.points.stress.shape)
        model.points.update(model.laws, 0.0 * strain)
        elastic = model._kinematics.stiffness().copy()
        model.points.update(model.laws, strain)
        assert (model.points.trial_state[:, 0] > 0).any()
        stiffness = model._kinematics.stiffness()
        operator = stiffness if limit else stiffness.operator
        x, b = elastic.createVecs()
        x.array[:] = np.random.default_rng(4).normal(size=len(x.array))
        operator.mult(x, b)
        products.append(np.array(b.array))
        stiffness.axpy(0.1, elastic)
        operator = stiffness if limit else stiffness.operator
        x.array[model._body.constraints.dofs] = 0.0
        operator.mult(x, b)
        products.append(np.array(b.array))
    assert np.allclose(products[2], products[0], rtol=0, atol=1e-12 * np.abs(products[0]).max())
    assert np.allclose(products[3], products[1], rtol=0, atol=1e-12 * np.abs(products[1]).max())
    assert not np.allclose(products[1], products[0], rtol=0, atol=1e-3 * np.abs(products[0]).max())


def test_newton_converges_quadratically():
    model = slope_model(degree=1, nmd=True)
    model.solve(bridge.Load(unit_weight=15e3))
    report = model.equilibrate(bridge.Load(unit_weight=17e3), tolerance=1e-12)
    tail = [r for r in report.residuals if r > 1e-13][-3:]
    assert report.converged and np.log(tail[2] / tail[1]) / np.log(tail[1] / tail[0]) > 1.7


def test_quadratic_elements_are_not_averaged():
    with pytest.raises(bridge.InputError, match="nmd.*degree=2"):
        slope_model(degree=2, nmd=True)


SAND = {"young": 1e6, "poisson": 0.3, "cohesion": 6e3, "friction_angle": 20.0, "dilation_angle": 0.0}


@pytest.mark.parametrize(
    "soil, below",
    [(CLAY, CLAY), (SAND, SAND), (CLAY, SAND | {"young": 20e6})],
    ids=["clay", "sand", "clay on stiff sand"],
)
@pytest.mark.parametrize("geometry", [mpm.Geometry.PLANE_STRAIN, mpm.Geometry.AXISYMMETRIC, mpm.Geometry.SOLID])
def test_averaged_elements_go_on_as_averaged_particles_in_equilibrium(geometry, soil, below):
    """The forces of the hand-over are those of the steps that follow: they are in balance, and nothing moves."""
    laws = {"law": mpm.MohrCoulomb(**soil), "below": mpm.MohrCoulomb(**below)}
    fem, model = clay_block(geometry, **laws, as_particles=True)
    assert bridge.initialise(model, fem, count_displacement=False, equilibrate=False).unbalanced_ratio < 1e-9
    assert model.out_of_balance() > 1e-3  # of forces that the steps do not have
    report = model.explicit(0.02, nmd=True, courant=0.25).last()
    settlement = np.abs(fem.displacement.x.array).max()
    assert np.abs(model.particles.displacement).max() < 1e-6 * settlement and report.unbalanced_ratio < 1e-6


def test_soil_whose_averages_differ_between_both_is_brought_to_equilibrium_for_the_steps():
    """Elements average the forces of soil that dilates by more than half, explicit steps by half: equilibrium is of the latter."""
    fem, model = clay_block(mpm.Geometry.PLANE_STRAIN, law=mpm.MohrCoulomb(**SAND | {"dilation_angle": 10.0}))
    report = bridge.initialise(model, fem, count_displacement=False)
    assert report.equilibrated_ratio < 5e-4 < report.unbalanced_ratio
    assert model.out_of_balance(nmd=True) == pytest.approx(report.equilibrated_ratio, rel=1e-6)
    before = model.particles.displacement.copy()
    model.explicit(0.05, nmd=True).last()
    settlement = np.abs(fem.displacement.x.array).max()
    assert np.abs(model.particles.displacement - before).max() < 2e-3 * settlement


def test_particles_equilibrate_by_the_forces_of_the_steps_that_follow():
    """Explicit steps average forces, implicit ones that move particles do not; either is at rest after its own equilibrium."""
    for averaged in (True, False):
        _, model = clay_block(mpm.Geometry.PLANE_STRAIN)
        model.equilibrate(nmd=True, tolerance=1e-9, averaged_forces=averaged, solver=mpm.Newton(tolerance=1e-10))
        assert model.out_of_balance(nmd=averaged) < 1e-8 < 1e-4 < model.out_of_balance(nmd=not averaged)


def test_soils_are_averaged_apart_as_soon_as_their_stiffness_differs():
    """Another law in the same elements: as in elements that had it from the beginning."""
    soft, stiff = (mpm.LinearElastic(young=e, poisson=0.3) for e in (2e6, 20e6))
    domain, _, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, (1.0, 1.0), (6, 6))
    tags = halves(domain, 1.0)
    moved = []
    for before in ({0: soft, 1: stiff}, {0: soft, 1: soft}):
        model = bridge.QuasiStatic(domain, before, facet_tags, [bridge.fixed(3)], degree=1, nmd=True, cell_tags=tags)
        assert model.equilibrate(bridge.Load(unit_weight=20e3), law={0: soft, 1: stiff}).converged
        moved.append(model.displacement.x.array.copy())
    assert np.allclose(moved[0], moved[1], rtol=0, atol=1e-9 * np.abs(moved[0]).max())


def test_particles_with_further_laws_average_as_elements_without_them():
    soft, stiff, unused = (mpm.LinearElastic(young=e, poisson=0.3) for e in (2.0e6, 2.4e6, 1.8e6))
    fem, model = clay_block(mpm.Geometry.PLANE_STRAIN, law=soft, below=stiff, more=[unused])
    assert bridge.initialise(model, fem, count_displacement=False, equilibrate=False).unbalanced_ratio < 1e-9
