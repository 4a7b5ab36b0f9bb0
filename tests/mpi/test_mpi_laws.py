"""Laws with states of their own on several ranks: the same motion and states whoever owns the cells, in every scheme."""

import subprocess
from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI
from partitions import all_by_id, assert_same, bands, scattered, sliding_slope
from sanisand_cases import sand
from test_laws_external import VonMises
from test_laws_failure import Fragile

import fenics_bridge as bridge
import mpm_core as mpm

ELASTIC = {"young": 4e6, "poisson": 0.3}
SOIL = mpm.MohrCoulomb(**ELASTIC, cohesion=1e3, friction_angle=25.0)
SOFTENING = mpm.SofteningMohrCoulomb(
    SOIL, residual_cohesion=300.0, residual_friction_angle=15.0, softening_strain=0.1, reference_length=0.1
)
CLAY = mpm.CamClay(compression=0.2, swelling=0.05, critical_slope=1.0, poisson=0.3, void_ratio=1.0,
                   preconsolidation=4e3, attraction=3e3)  # fmt: skip
SAND = mpm.NorSand(critical_void_ratio=0.9, critical_compression=0.03, critical_slope=1.25, dilatancy=4.0, hardening=100.0,
                   rigidity=200.0, poisson=0.2, void_ratio=0.9, image_pressure=3e3, attraction=3e3)  # fmt: skip
HARDENING = {"secant_modulus": 2e6, "oedometer_modulus": 2e6, "unloading_modulus": 6e6, "cohesion": 1e3, "friction_angle": 25.0,
             "reference_pressure": 20e3}  # fmt: skip
WATER = {"water_modulus": 4e6, "porosity": 0.4}
LAWS = {
    "softening": SOFTENING,
    "Cam-Clay": CLAY,
    "NorSand": SAND,
    "SANISAND": sand(largest_pressure=5e3, attraction=3e3),
    "Hardening Soil": mpm.HardeningSoil(**HARDENING),
    "small-strain Hardening Soil": mpm.HardeningSoil(**HARDENING, small_strain_modulus=10e6),
    "Python": mpm.PythonLaw(VonMises(strength=3e3)),
    "undrained Hencky": mpm.Undrained(mpm.Hencky(SOFTENING), **WATER),
    "viscoplastic": mpm.ViscoplasticMohrCoulomb(**ELASTIC, cohesion=1e3, friction_angle=25.0, viscosity=1e4),
    "heterogeneous": mpm.Heterogeneous(SOIL, ["cohesion"]),
    "layers": [mpm.Undrained(CLAY, **WATER), SOFTENING],
}
STRENGTH = mpm.RandomField(mean=1e3, deviation=300.0, lengths=[0.5, 0.2], seed=4, lognormal=True)


@pytest.fixture(scope="module")
def umat(comm, tmp_path_factory):
    """The Fortran UMAT, compiled on the first rank."""
    library = comm.bcast(str(tmp_path_factory.mktemp("umat") / "umat_von_mises.so"))
    if comm.rank == 0:
        source = Path(__file__).parents[1] / "python" / "umat_von_mises.f90"
        subprocess.run(["gfortran", "-shared", "-fPIC", "-O1", "-o", library, source], check=True)
    comm.barrier()
    return mpm.Umat(library, properties=[4e6, 0.3, 3e3], n_variables=1, plastic_strain_variable=1, p_wave_modulus=6e6)


def slope(comm, owners_of, laws):
    """The slope that slides, of these laws: layers by position, cohesion from a field that a particle takes with it."""
    model = sliding_slope(comm, owners_of, laws=laws)
    particles = model.particles
    if len(model.laws) > 1:
        model.assign((particles.position[:, 1] > 0.2).astype(int))
    if any("cohesion_deviation" in law.state_names for law in model.laws):
        field = np.random.default_rng(11).uniform(-0.3, 0.3, 10_000)  # by the particles' numbers, so alike on all ranks
        model.set_state("cohesion_deviation", field[particles.id])
    if isinstance(model.laws[0], mpm.Heterogeneous):
        model.set_parameter("cohesion", STRENGTH)
    return model


@pytest.fixture(params=[*LAWS, "UMAT"])
def laws(request):
    return request.getfixturevalue("umat") if request.param == "UMAT" else LAWS[request.param]


def test_explicit_run_is_the_same_on_any_partition(comm, laws):
    model, alone = slope(comm, scattered, laws), slope(MPI.COMM_SELF, scattered, laws)
    start = set(model.particles.id)
    for each in (model, alone):
        *_, report = each.explicit(0.3, dt=2e-4, pic=0.01)
    moved, expected = all_by_id(model), all_by_id(alone)
    assert moved["displacement"][:, 0].max() > 0.1 and moved["state"][:, 0].max() > 1e-3
    arrived = comm.allreduce(len(set(model.particles.id) - start))
    assert arrived > 10 if comm.size > 1 else arrived == 0
    assert_same(moved, expected, 1e-7)


def test_a_reproducible_run_is_the_same_to_the_last_bit(comm, laws):
    models = slope(comm, scattered, laws), slope(MPI.COMM_SELF, scattered, laws)
    for model in models:
        model.explicit(0.2, dt=4e-4, pic=0.01, nmd=True, reproducible=True).last()
    moved, expected = map(all_by_id, models)
    assert expected["state"][:, 0].max() > 1e-3
    for name, values in expected.items():
        np.testing.assert_array_equal(moved[name], values, err_msg=name)


def test_implicit_run_is_the_same_on_any_partition(comm, laws):
    model, alone = slope(comm, scattered, laws), slope(MPI.COMM_SELF, scattered, laws)
    for each in (model, alone):
        list(each.implicit(0.06, dt=0.01, solver=mpm.Newton(tolerance=1e-11)))
    moved, expected = all_by_id(model), all_by_id(alone)
    assert moved["state"][:, 0].max() > 1e-4
    for name in ("position", "stress", "state"):
        scale = np.abs(expected[name]).max()
        np.testing.assert_allclose(moved[name], expected[name], rtol=0, atol=1e-6 * scale, err_msg=name)


def test_finite_elements_are_the_same_on_any_number_of_ranks(comm, laws):
    if isinstance(laws, list):
        pytest.skip("a body of finite elements has one law")
    stress = []
    for each in (comm, MPI.COMM_SELF):
        domain, _, tags = bridge.soil_mesh(*bridge.slope_mesh(each, cell_size=0.25, crest=1.0))
        supports = [bridge.roller(bridge.LEFT, (1, 0)), bridge.fixed(bridge.BASE)]
        fem = bridge.QuasiStatic(domain, laws, tags, supports, degree=1)
        if isinstance(laws, mpm.Heterogeneous):
            fem.set_parameter("cohesion", STRENGTH)
        fem.solve(bridge.Load(unit_weight=8e3))
        assert fem.converged
        points = np.random.default_rng(2).uniform(0.05, 0.95, (20, 2))
        values = fem.evaluate_at(points)
        assert values["state"][:, 0].max() >= 0
        stress.append(np.column_stack([values["stress"], values["state"]]))
    np.testing.assert_allclose(stress[0], stress[1], rtol=0, atol=1e-6 * np.abs(stress[1]).max())


def test_a_random_field_stays_with_the_particles(comm):
    model, alone = slope(comm, scattered, LAWS["heterogeneous"]), slope(MPI.COMM_SELF, scattered, LAWS["heterogeneous"])
    strengths = []
    for each in (model, alone):
        before = dict(zip(each.particles.id.tolist(), each.parameter("cohesion").tolist()))
        *_, _ = each.explicit(0.3, dt=2e-4, pic=0.01)
        after = dict(zip(each.particles.id.tolist(), each.parameter("cohesion").tolist()))
        for one in each.comm.allgather(before):
            before |= one
        assert all(after[key] == before[key] for key in after)
        whole = {key: value for one in each.comm.allgather(after) for key, value in one.items()}
        strengths.append([whole[key] for key in sorted(whole)])
    assert strengths[0] == strengths[1] and np.std(strengths[0]) > 100.0
    with pytest.raises(mpm.InputError, match="^cohesion = -1, but it must be at least 0") as raised:
        model.set_parameter("cohesion", lambda x: np.full(len(x), -1.0 if comm.rank == comm.size - 1 else 1e3))
    assert len(set(comm.allgather(str(raised.value)))) == 1


def test_a_law_that_fails_on_one_rank_ends_the_run_on_all(comm):
    for scheme in ("explicit", "implicit"):
        model = slope(comm, bands, mpm.PythonLaw(Fragile(1e-9)))
        with pytest.raises(mpm.RunError, match=r"follows the law PythonLaw of Fragile \(number 0\)") as raised:
            list(model.explicit(0.1) if scheme == "explicit" else model.implicit(0.1, dt=0.1))
        assert len(set(comm.allgather(str(raised.value)))) == 1
