"""Parameters that vary from point to point: on points, particles and finite elements, with strength reduction."""

import numpy as np
import pytest
from core_cases import box, by_id, rollers, run
from hardening_soil_cases import sand
from law_cases import random_points
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

ELASTIC = {"young": 10e6, "poisson": 0.3}
SOIL = {**ELASTIC, "cohesion": 10e3, "friction_angle": 25.0}
LAWS = {
    "Mohr-Coulomb": (mpm.MohrCoulomb, SOIL, {"cohesion": (2e3, 30e3), "friction_angle": (20.0, 40.0)}),
    "viscoplastic": (mpm.ViscoplasticMohrCoulomb, {**SOIL, "viscosity": 1e6}, {"viscosity": (1e5, 1e7)}),
    "Drucker-Prager": (mpm.DruckerPrager, {**ELASTIC, "strength": 10e3}, {"strength": (1e3, 20e3)}),
    "Cam-Clay": (
        mpm.CamClay,
        {"compression": 0.2, "swelling": 0.04, "critical_slope": 1.0, "poisson": 0.25, "preconsolidation": 80e3,
         "void_ratio": 1.0},
        {"critical_slope": (0.8, 1.4)},
    ),
    "NorSand": (
        mpm.NorSand,
        {"critical_void_ratio": 0.9, "critical_compression": 0.03, "critical_slope": 1.25, "dilatancy": 4.0, "hardening": 100.0,
         "rigidity": 200.0, "poisson": 0.2, "void_ratio": 0.84, "image_pressure": 60e3},
        {"critical_slope": (1.1, 1.4), "hardening": (50.0, 200.0)},
    ),
    "elastic": (mpm.LinearElastic, ELASTIC, {"young": (1e6, 10e6)}),
}  # fmt: skip


@pytest.fixture(params=LAWS.values(), ids=LAWS.keys())
def case(request):
    return request.param


def differences(law, columns):
    """States of points of a Heterogeneous law with these values of its parameters."""
    state = np.zeros((len(columns[0]), law.n_state))
    for k, (name, values) in enumerate(zip(law.varying, columns)):
        state[:, law.law.n_state + k] = values - getattr(law.law, name)
    return state


def random_values(ranges, count, seed=7):
    """Values of parameters in their ranges, some of them the same for several points in a row."""
    rng = np.random.default_rng(seed)
    return [np.repeat(rng.uniform(*limits, count // 2), 2) for limits in ranges.values()]


@pytest.mark.parametrize("dim", [2, 3])
def test_each_point_follows_the_law_with_its_own_values(case, dim):
    kind, numbers, ranges = case
    law = mpm.Heterogeneous(kind(**numbers), list(ranges))
    assert law.state_names[-len(ranges) :] == [f"{name}_difference" for name in ranges]
    stress, strain = random_points(dim, 60, pressure=50e3, deviator=15e3, strain=1e-3)
    values = random_values(ranges, 60)
    state = differences(law, values)
    new, tangent = stress.copy(), np.zeros((60, *2 * stress.shape[1:]))
    report = law.update(strain, new, state, tangent, dt=0.1)
    plastic = 0
    for i in range(60):
        one = kind(**{**numbers, **{name: column[i] for name, column in zip(ranges, values)}})
        s, q, t = stress[[i]].copy(), np.zeros((1, one.n_state)), np.zeros((1, *tangent.shape[1:]))
        plastic += one.update(strain[[i]], s, q, t, dt=0.1).plastic
        scale = np.abs(s).max()
        assert np.abs(new[i] - s[0]).max() < 1e-9 * scale and np.abs(tangent[i] - t[0]).max() < 1e-6 * 1e7
        assert state[i, : one.n_state] == pytest.approx(q[0], abs=1e-12)
    assert report.plastic == plastic and (plastic > 5 or kind is mpm.LinearElastic)


def test_points_without_values_have_those_of_the_law():
    law = mpm.Heterogeneous(mpm.MohrCoulomb(**SOIL), ["cohesion"])
    stress, strain = random_points(3, 100, pressure=50e3, deviator=15e3, strain=1e-3)
    ours, theirs = stress.copy(), stress.copy()
    law.update(strain, ours, np.zeros((100, law.n_state)))
    law.law.update(strain, theirs, np.zeros((100, law.law.n_state)))
    assert np.array_equal(ours, theirs)


def test_strength_reduction_weakens_every_point():
    law = mpm.Heterogeneous(mpm.MohrCoulomb(**SOIL), ["cohesion", "friction_angle"])
    weak = bridge.reduced_strength(bridge.reduced_strength(law, 1.2), 1.25)
    assert weak.strength_factor == pytest.approx(1.5) and weak.law == law.law
    values = [np.array([5e3, 20e3]), np.array([30.0, 35.0])]
    stress, strain = random_points(2, 2, pressure=30e3, deviator=20e3, strain=3e-3)
    ours = stress.copy()
    weak.update(strain, ours, differences(law, values))
    for i in range(2):
        one = mpm.MohrCoulomb(**ELASTIC, cohesion=values[0][i], friction_angle=values[1][i])
        s = stress[[i]].copy()
        bridge.reduced_strength(one, 1.5).update(strain[[i]], s, np.zeros((1, one.n_state)))
        assert ours[i] == pytest.approx(s[0], rel=1e-9)
    inside = bridge.reduced_strength(mpm.Undrained(mpm.Hencky(law), porosity=0.4), 1.5)
    assert inside.skeleton.law.strength_factor == 1.5


def layered_model(law):
    model = mpm.Model(box([4, 4], body=([0.0, 0.0], [1.0, 0.5])), law)
    model.seed(density=2000.0, per_cell=3)
    return model


@pytest.mark.parametrize("wrap", [lambda law: law, mpm.Hencky, lambda law: mpm.Undrained(law, porosity=0.4)])
def test_values_of_particles_by_every_way_and_as_they_move(wrap, tmp_path):
    law = wrap(mpm.Heterogeneous(mpm.MohrCoulomb(**SOIL), ["cohesion"]))
    model = layered_model(law)
    assert (model.parameter("cohesion") == 10e3).all()
    y = model.particles.position[:, 1]
    model.set_parameter("cohesion", 7e3)
    assert model.parameter("cohesion") == pytest.approx(7e3)
    model.set_parameter("cohesion", {1: 4e3})
    assert model.parameter("cohesion") == pytest.approx(np.where(y < 0.5, 4e3, 7e3))
    model.set_parameter("cohesion", lambda x: 2e3 + 9e3 * (1 - x[:, 1]))
    expected = 2e3 + 9e3 * (1 - y)
    assert model.parameter("cohesion") == pytest.approx(expected)
    model.set_parameter("cohesion", expected / 2)
    half = model.parameter("cohesion")[np.argsort(model.particles.id)]
    rollers(model)
    model.set_gravity((0.0, -10.0))
    run(model, 0.02)
    assert model.parameter("cohesion")[np.argsort(model.particles.id)] == pytest.approx(half)
    model.save(tmp_path / "state.h5")
    again = layered_model(law)
    again.restore(tmp_path / "state.h5")
    assert np.array_equal(again.parameter("cohesion"), model.parameter("cohesion"))


def test_strength_from_the_stress_at_the_start():
    model = layered_model(mpm.Heterogeneous(mpm.tresca(**ELASTIC, shear_strength=1.0), ["cohesion"]))
    stress = np.zeros((len(model.particles), 4))
    stress[:, :3] = -20e3 * (1 - model.particles.position[:, [1]])
    model.particles.set("stress", stress)
    model.set_parameter("cohesion", -0.25 * model.particles.stress[:, 1])
    assert model.parameter("cohesion") == pytest.approx(5e3 * (1 - model.particles.position[:, 1]))


@pytest.mark.parametrize("wrap", [lambda law: law, mpm.Hencky, lambda law: mpm.Undrained(law, porosity=0.4)])
def test_the_cohesion_of_softening_soil_varies_with_its_residual_one(wrap):
    soft = mpm.SofteningMohrCoulomb(
        mpm.MohrCoulomb(**SOIL),
        residual_cohesion=2e3,
        residual_friction_angle=20.0,
        softening_strain=0.1,
        reference_length=0.1,
    )
    model = layered_model(wrap(soft))
    assert (model.parameter("cohesion") == 10e3).all()
    model.set_parameter("cohesion", lambda x: 5e3 + 20e3 * x[:, 1])
    expected = 5e3 + 20e3 * model.particles.position[:, 1]
    assert model.parameter("cohesion") == pytest.approx(expected)
    deviation = float(model.state("cohesion_deviation")[0])
    assert soft.softened(0.0, deviation).cohesion == pytest.approx(expected[0])
    assert soft.softened(np.inf, deviation).cohesion == pytest.approx(expected[0] / 5)
    with pytest.raises(mpm.InputError, match="cohesion = -1 of a point, expected at least 0"):
        model.set_parameter("cohesion", -1.0)
    with pytest.raises(mpm.InputError, match="name is 'friction_angle', but what varies in the laws is cohesion"):
        model.set_parameter("friction_angle", 20.0)
    without = mpm.SofteningMohrCoulomb(
        mpm.MohrCoulomb(**{**SOIL, "cohesion": 0.0}), residual_cohesion=0.0, residual_friction_angle=20.0, softening_strain=0.1,
        reference_length=0.1,
    )  # fmt: skip
    with pytest.raises(mpm.InputError, match="cohesion of the law SofteningMohrCoulomb is 0 Pa, expected more than 0"):
        layered_model(wrap(without)).set_parameter("cohesion", 1e3)


def test_wrong_parameters_are_named():
    soil = mpm.MohrCoulomb(**SOIL)
    with pytest.raises(mpm.InputError, match="varying has 'colour', expected parameters .* young, poisson, cohesion"):
        mpm.Heterogeneous(soil, ["colour"])
    with pytest.raises(mpm.InputError, match="varying is empty"):
        mpm.Heterogeneous(soil, [])
    with pytest.raises(mpm.InputError, match="varying has 'cohesion' twice"):
        mpm.Heterogeneous(soil, ["cohesion", "cohesion"])
    with pytest.raises(
        mpm.InputError, match="varying has 'tension_cutoff', which is infinite in the law, expected a law"
    ):
        mpm.Heterogeneous(soil, ["tension_cutoff"])
    model = layered_model([soil, mpm.Heterogeneous(soil, ["cohesion", "dilation_angle", "young"])])
    model.assign(np.ones(len(model.particles), dtype=int))
    with pytest.raises(
        mpm.InputError, match="name is 'poisson', but what varies in the laws is cohesion, dilation_angle"
    ):
        model.set_parameter("poisson", 0.2)
    with pytest.raises(mpm.InputError, match="^cohesion = -1, but it must be at least 0"):
        model.set_parameter("cohesion", -1.0)
    with pytest.raises(mpm.InputError, match=r"^dilation_angle = 26, but it must be in \[0, friction_angle\]"):
        model.set_parameter("dilation_angle", 26.0)
    with pytest.raises(mpm.InputError, match="cohesion has dtype .*, expected real numbers"):
        model.set_parameter("cohesion", "large")
    with pytest.raises(mpm.InputError, match="cohesion is nan at index"):
        model.set_parameter("cohesion", lambda x: np.full(len(x), np.nan))
    with pytest.raises(mpm.InputError, match="which bounds the time step; give the law the largest stiffness"):
        model.set_parameter("young", 20e6)
    with pytest.raises(mpm.InputError, match="shape"):
        model.set_parameter("cohesion", np.zeros(3))
    with pytest.raises(mpm.InputError, match="9"):
        model.set_parameter("cohesion", {9: 1.0})
    assert (model.particles.state[:, -3:] == 0).all()


def cut(degree=2, n=6):
    """A vertical cut of height 1 m: ground on a fixed base, whose strength grows from zero at its surface."""
    domain, cell_tags, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, [1.5, 1.0], [3 * n // 2, n])
    law = mpm.Heterogeneous(mpm.tresca(young=1e6, poisson=0.3, shear_strength=1e3), ["cohesion"])
    supports = [bridge.roller(1, (1, 0)), bridge.fixed(3)]
    return bridge.QuasiStatic(domain, law, facet_tags, supports, degree=degree, cell_tags=cell_tags)


def test_vertical_cut_with_strength_that_grows_with_depth():
    # s_u = k z: Rankine's field (sigma_v = gamma z, sigma_h = 0 needs s_u = gamma z / 2) and a wedge at 45 degrees, whose
    # sliding force gamma H^2 / 2 cos(45) meets k H^2 / (2 sin(45)), both give the factor of safety 2 k / gamma
    fem, unit_weight, growth = cut(), 20e3, 15e3
    fem.set_parameter("cohesion", lambda x: growth * (1.0 - x[:, 1]))
    found = bridge.factor_of_safety(fem, bridge.Load(unit_weight=unit_weight), start=1.0, tolerance=5e-3)
    exact = 2 * growth / unit_weight
    assert found.failed and exact * 0.98 < found.value < found.failed_at < exact * 1.03


def test_finite_elements_take_values_by_every_way_and_hand_them_over():
    domain, cell_tags, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, [1.0, 1.0], [4, 4], body=([0.0, 0.0], [1.0, 0.5]))
    law = mpm.Heterogeneous(mpm.MohrCoulomb(**SOIL), ["cohesion"])
    supports = [bridge.roller(1, (1, 0)), bridge.roller(2, (1, 0)), bridge.fixed(3)]
    fem = bridge.QuasiStatic(domain, law, facet_tags, supports, cell_tags=cell_tags)
    column = law.state_names.index("cohesion_difference")
    y = fem.points.coordinates()[:, 1]
    fem.set_parameter("cohesion", {bridge.BODY: 4e3})
    assert fem.points.state[:, column] == pytest.approx(np.where(y < 0.5, -6e3, 0.0))
    fem.set_parameter("cohesion", lambda x: 3e3 + 8e3 * (1 - x[:, 1]))
    profile = 3e3 + 8e3 * (1 - y) - 10e3
    assert fem.points.state[:, column] == pytest.approx(profile)
    fem.set_initial_stress(np.zeros_like(fem.points.stress), bridge.Load())  # which resets states
    assert fem.points.state[:, column] == pytest.approx(profile)
    with pytest.raises(bridge.InputError, match="^cohesion = -1, but it must be at least 0"):
        fem.set_parameter("cohesion", -1.0)
    assert fem.points.state[:, column] == pytest.approx(profile)
    fem.solve(bridge.Load(unit_weight=2000.0 * 9.81))
    model = mpm.Model(bridge.background_mesh(domain, cell_tags, facet_tags), law)
    model.seed(density=2000.0, per_cell=3)
    model.roller(1, (1, 0))
    model.roller(2, (1, 0))
    model.fix(3)
    model.set_gravity((0.0, -9.81))
    bridge.initialise(model, fem)
    # Cells are constant: the value of a particle is that of its cell's centre, at most two thirds of a cell away
    here = 3e3 + 8e3 * (1 - model.particles.position[:, 1])
    assert np.abs(model.parameter("cohesion") - here).max() <= 8e3 * 0.25 * 2 / 3
    assert np.mean(model.parameter("cohesion") - here) == pytest.approx(0.0, abs=1e-9 * 8e3)


@pytest.mark.parametrize("correlation", ["gaussian", "markov"])
def test_random_fields_have_the_wanted_mean_deviation_and_correlation(correlation):
    # 2000 fields at points some correlation lengths apart: sampled moments within five of their standard errors
    x = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [0.0, 0.5], [1.0, 0.5], [5.0, 3.0]])
    lengths, count = np.array([2.0, 0.5]), 2000
    fields = np.array([
        mpm.RandomField(mean=20.0, deviation=4.0, lengths=lengths, seed=k, correlation=correlation, waves=50)(x)
        for k in range(count)
    ])  # fmt: skip
    distance = np.abs(x[:, None] - x[None]) / lengths
    wanted = np.exp(-(distance**2 if correlation == "gaussian" else distance).sum(axis=2))
    sampled = np.cov(fields.T) / 16.0
    assert np.abs(fields.mean(axis=0) - 20.0).max() < 5 * 4.0 / np.sqrt(count)
    assert np.abs(sampled - wanted).max() < 5 * np.sqrt(2 / count)


def test_lognormal_fields_are_positive_with_the_wanted_moments():
    x = 100.0 * np.random.default_rng(0).random((4000, 2))
    field = mpm.RandomField(mean=20.0, deviation=10.0, lengths=[1.0, 1.0], seed=2, lognormal=True)(x)
    assert field.min() > 0
    assert np.log(field).mean() == pytest.approx(np.log(20.0) - 0.5 * np.log(1.25), abs=0.05)
    assert np.log(field).std() == pytest.approx(np.sqrt(np.log(1.25)), rel=0.05)
    assert field.mean() == pytest.approx(20.0, rel=0.05) and field.std() == pytest.approx(10.0, rel=0.15)


def test_a_random_field_is_a_function_of_position_only():
    field = mpm.RandomField(mean=1.0, deviation=0.2, lengths=[1.0, np.inf], seed=5)
    x = np.random.default_rng(1).random((100, 2))
    assert np.array_equal(field(x)[30:40], field(x[30:40]))
    assert np.array_equal(field(x), mpm.RandomField(mean=1.0, deviation=0.2, lengths=[1.0, np.inf], seed=5)(x))
    assert np.array_equal(field(x), field(x * [1, 0]))  # constant along the second axis
    for changed, words in [({"lengths": [1.0, 0.0]}, "lengths is"), ({"deviation": -1.0}, "deviation is -1"),
                           ({"correlation": "white"}, "correlation is 'white'"), ({"waves": 0}, "waves is 0"),
                           ({"mean": 0.0, "lognormal": True}, "mean is 0"), ({"mean": np.nan}, "mean is nan, expected a finite"),
                           ({"mean": "20e3"}, "mean is '20e3'"), ({"deviation": np.nan}, "deviation is nan"),
                           ({"seed": -1}, "seed is -1, expected a whole number"), ({"waves": 1.5}, "waves is 1.5")]:  # fmt: skip
        with pytest.raises(mpm.InputError, match=words):
            mpm.RandomField(**{"mean": 1.0, "deviation": 0.2, "lengths": [1.0, 1.0], **changed})


def test_soil_with_a_random_field_moves_by_its_own_strengths():
    law = mpm.Heterogeneous(mpm.tresca(**ELASTIC, shear_strength=5e3), ["cohesion"])
    model = mpm.Model(box([2, 4], [1.0, 2.0]), law)
    model.seed(density=2000.0, per_cell=3)
    model.set_parameter("cohesion", mpm.RandomField(mean=5e3, deviation=1e3, lengths=[1.0, 0.5], lognormal=True))
    rollers(model, but=(2,))
    model.set_gravity((0.0, -10.0))
    run(model, 0.15)
    stress, strength = by_id(model, "stress"), model.parameter("cohesion")[np.argsort(model.particles.id)]
    radius = np.hypot(0.5 * (stress[:, 0] - stress[:, 1]), stress[:, 3])
    yielded = by_id(model, "plastic_strain") > 0
    assert (radius <= strength * (1 + 1e-9)).all() and yielded.mean() > 0.2
    assert np.abs(radius / strength - 1)[yielded].min() < 1e-9


def test_states_that_no_point_of_the_law_can_have_are_refused():
    law = mpm.Heterogeneous(sand(small_strain_modulus=100e6), ["small_strain_modulus"])
    model = mpm.Model(box([2, 2], [1.0, 1.0]), law)
    model.seed(density=2000.0, per_cell=3)
    for modulus, message in (
        (-99e6, "small_strain_modulus = 1e[+]06, but it must be 0 for none, or above"),
        (12e6, "a point has the modulus .* above that of the law"),
    ):
        with pytest.raises(bridge.InputError, match=message):
            model.set_state("small_strain_modulus_difference", np.full(len(model.particles), modulus))
    assert (model.state("small_strain_modulus_difference") == 0).all()
