"""Cook's membrane, nearly incompressible: linear triangles lock, nodal mixed discretisation (NMD) frees them."""

import numpy as np
import pytest
from core_cases import DIMS, box

import mpm_core as mpm
from mpm_core import _core

# Young's modulus and the shear traction of the benchmark; its answer at (48, 52) is 16.44 with nu = 0.499999975. The
# displacement of a nearly incompressible body differs from the incompressible one by the order of G / K = 0.002 with
# nu = 0.499, for which the critical time step is not yet tiny. The load is scaled down: displacements stay small.
YOUNG, POISSON, TRACTION, SCALE = 1.12499998125, 0.499, 1 / 16, 1e-3
MID_EDGE, BENCHMARK = (48.0, 52.0), 16.44


def membrane(n):
    """The points (0, 0), (48, 44), (48, 60), (0, 44); diagonals all one way."""

    def place(x):
        return np.stack([48 * x[:, 0], 44 * x[:, 0] + x[:, 1] * (44 - 28 * x[:, 0])], axis=1)

    model = mpm.Model(box([n, n], place=place), mpm.LinearElastic(young=YOUNG, poisson=POISSON))
    model.seed(density=1.0, per_cell=3)
    model.fix(1)
    assert model.traction(2, (0.0, SCALE * TRACTION)) == pytest.approx(16.0)
    return model


def deflection(model):
    """Vertical displacement at (48, 52), by an affine fit to the particles next to it, over the scale of the load."""
    offset = model.particles.initial_position - MID_EDGE
    near = np.argsort(np.linalg.norm(offset, axis=1))[:12]
    affine = np.column_stack([np.ones(12), offset[near]])
    return np.linalg.lstsq(affine, model.particles.displacement[near, 1], rcond=None)[0][0] / SCALE


@pytest.fixture(scope="module")
def deflections():
    """At rest, by number of cells along each side and by NMD or not."""
    shear_wave = np.sqrt(YOUNG / (2 * (1 + POISSON)))
    found = {}
    for n, nmd in ((8, True), (16, False), (16, True)):
        model = membrane(n)
        reports = model.explicit(800 / shear_wave, every=100 / shear_wave, damping=0.5, nmd=nmd, courant=0.8)
        *_, before, found[n, nmd] = (deflection(model) for report in reports)
        assert found[n, nmd] == pytest.approx(before, rel=0.01)
    return found


def test_plain_triangles_lock(deflections):
    assert deflections[16, False] < 0.6 * BENCHMARK


def test_mixed_discretisation_frees_them(deflections):
    errors = [1 - deflections[n, True] / BENCHMARK for n in (8, 16)]
    assert 0 < errors[1] < 0.12
    assert errors[1] < 0.5 * errors[0]  # and it converges


@pytest.mark.parametrize("integration", [mpm.Integration.PARTICLES, mpm.Integration.MIXED])
@pytest.mark.parametrize("dim", DIMS)
def test_a_uniform_pressure_is_in_equilibrium_where_soils_of_different_averages_meet(dim, integration):
    """Of clay all of the strain is averaged, of sand a part; nodes inside must feel no force of a pressure that both have."""
    clay, sand = mpm.MohrCoulomb(young=3e6, poisson=0.45, cohesion=1e4, friction_angle=0.0), mpm.MohrCoulomb(
        young=2e7, poisson=0.3, cohesion=5e3, friction_angle=32.0, dilation_angle=5.0
    )
    assert _core.fraction_of_averages(clay) != _core.fraction_of_averages(sand)
    upper = np.array([[-1.0] * (dim - 1) + [0.5], [2.0] * dim])
    mesh = box([4] * dim, shake=0.2, body=upper)
    model = mpm.Model(mesh, [clay, sand])
    for tag in (0, 1):
        model.seed(density=2000.0, per_cell=6 if dim == 2 else 10, cell_tag=tag, material=tag)
    pressure = 1e4
    stress = np.zeros_like(model.particles.stress)
    stress[:, :3] = -pressure
    model.particles.set("stress", stress)
    for axis in range(dim):
        for end in (1, 2):
            model.roller(2 * axis + end, np.eye(dim)[axis])
    *_, report = model.explicit(1e-4, dt=1e-4, nmd=True, integration=integration)
    # A pressure on the sides of a cell gives its nodes this velocity in the step, in the order of magnitude.
    scale = 1e-4 * pressure / (2000.0 * 0.25)
    assert np.abs(model.particles.velocity).max() < 1e-10 * scale


def elastic_of(p_wave_modulus):
    return mpm.LinearElastic(young=p_wave_modulus * 1.3 * 0.4 / 0.7, poisson=0.3)


def test_soils_are_averaged_together_while_their_stiffness_rises_in_small_steps():
    graded = [elastic_of(5e6 * 1.2**k) for k in range(12)]
    assert _core.stiffness_groups(graded) == [0] * 8 + [1] * 4  # 1.2^7 < 4 < 1.2^8
    soft, next_one, stiff = elastic_of(5e6), elastic_of(6e6), elastic_of(7.6e6)
    laws = [stiff, soft, stiff, next_one]
    assert _core.stiffness_groups(laws) == [1, 0, 1, 0]
    assert _core.stiffness_groups([*laws, elastic_of(7e6)]) == [0] * 5  # 5, 6, 7, 7.6
    # The water makes undrained soils alike, of whatever skeleton; sand counts at 100 kPa, whatever pressure it may reach.
    undrained = [mpm.Undrained(law, water_modulus=2e9, porosity=0.4) for law in laws[:3]]
    assert _core.stiffness_groups(undrained) == [0] * 3
    clays = [
        mpm.CamClay(compression=0.2, swelling=0.04, critical_slope=1.0, poisson=0.3, void_ratio=1.0, preconsolidation=p)
        for p in (50e3, 70e3, 100e3)
    ]
    assert _core.stiffness_groups(clays) == [0] * 3
    assert _core.stiffness_groups([]) == []


@pytest.mark.parametrize("integration", [mpm.Integration.PARTICLES, mpm.Integration.MIXED])
@pytest.mark.parametrize("dim", DIMS)
def test_strains_of_soft_soil_are_no_stresses_of_the_stiff_soil_beside_it(dim, integration):
    """A column of two soils is compressed: uniform strains in each, by equilibrium in proportion to 1 / E_oed."""
    young, height, rows = (20e6, 2e6), 1.0, 8
    mesh = box([2] * (dim - 1) + [rows], [0.25] * (dim - 1) + [height], body=([-1.0] * dim, [2.0] * (dim - 1) + [0.5]))
    model = mpm.Model(mesh, [mpm.LinearElastic(young=e, poisson=0.3) for e in young])
    for material, tag in enumerate((1, 0)):
        model.seed(density=2000.0, per_cell={2: 3, 3: 4}[dim], cell_tag=tag, material=material)
    for axis in range(dim - 1):
        for end in (1, 2):
            model.roller(2 * axis + end, np.eye(dim)[axis])
    model.fix(2 * dim - 1)
    model.prescribe(2 * dim, [0.0] * (dim - 1) + [-1e-3])
    model.implicit(1.0, dt=1.0, quasi_static=True, small_displacements=True, nmd=True, integration=integration).last()
    oedometer = np.array(young) * 0.7 / (1.3 * 0.4)
    expected = -1e-3 / (0.5 * height * (1 / oedometer).sum())
    assert np.allclose(model.particles.stress[:, dim - 1], expected, rtol=1e-6)


def block_of_two_soils(dim):
    mesh = box([4] * dim, shake=0.15, body=([-1.0] * dim, [2.0] * (dim - 1) + [0.5]))
    model = mpm.Model(mesh, [mpm.LinearElastic(young=e, poisson=0.3) for e in (20e6, 2e6)])
    for material, tag in enumerate((1, 0)):
        model.seed(density=2000.0, per_cell={2: 3, 3: 4}[dim], cell_tag=tag, material=material)
    return model


@pytest.mark.parametrize("dim", DIMS)
def test_values_of_particles_are_averaged_over_nodes_in_each_soil_by_itself(dim):
    model = block_of_two_soils(dim)
    p = model.particles
    values = np.random.default_rng(2).normal(size=(len(p), 2))
    # By the definition: means by volume of the cells of a soil around a node, and the mean of a cell's nodes.
    expected = np.empty_like(values)
    for soil in (0, 1):
        own = p.material == soil
        cells = model.mesh.cells[p.cell[own]]
        sums, volumes = np.zeros((len(model.mesh.points), 2)), np.zeros(len(model.mesh.points))
        for corner in cells.T:
            np.add.at(sums, corner, p.volume[own, None] * values[own])
            np.add.at(volumes, corner, p.volume[own])
        expected[own] = (sums / np.maximum(volumes, 1e-300)[:, None])[cells].mean(axis=1)
    averaged = model.average_over_nodes(values)
    assert averaged == pytest.approx(expected, rel=1e-12, abs=1e-14)
    assert np.array_equal(model.average_over_nodes(values[:, 0]), averaged[:, 0])
    assert p.volume @ averaged == pytest.approx(p.volume @ values, rel=1e-10)
    assert model.average_over_nodes(np.where(p.material == 0, 3.0, -7.0)) == pytest.approx(
        np.where(p.material == 0, 3.0, -7.0)
    )


@pytest.mark.parametrize(
    "values, said",
    [([1.0, 2.0], "shape"), (np.nan, "not finite"), ("text", "real numbers")],
)
def test_values_that_cannot_be_averaged_are_refused(values, said):
    model = block_of_two_soils(2)
    given = np.full(len(model.particles), values) if np.isscalar(values) else values
    with pytest.raises(mpm.InputError, match=f"(?s)values.*{said}"):
        model.average_over_nodes(given)
