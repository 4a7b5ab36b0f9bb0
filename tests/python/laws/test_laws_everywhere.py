"""Every law in the explicit scheme, the implicit scheme and finite elements: an oedometer test is that of a single point."""

import numpy as np
import pytest
from bridge_cases import column
from core_cases import box, rollers, run
from sanisand_cases import sand

import fenics_bridge as bridge
import mpm_core as mpm

ELASTIC = {"young": 20e6, "poisson": 0.3}
SOIL = mpm.MohrCoulomb(**ELASTIC, cohesion=10e3, friction_angle=25.0, dilation_angle=5.0)
SOFTENING = mpm.SofteningMohrCoulomb(
    SOIL, residual_cohesion=2e3, residual_friction_angle=15.0, softening_strain=0.01, reference_length=0.1
)
CLAY = mpm.CamClay(
    compression=0.2, swelling=0.04, critical_slope=1.0, poisson=0.25, void_ratio=1.0, preconsolidation=60e3
)
SAND = mpm.NorSand(
    critical_void_ratio=0.9, critical_compression=0.03, critical_slope=1.25, dilatancy=4.0, hardening=100.0, rigidity=200.0,
    poisson=0.2, void_ratio=0.84, image_pressure=25e3,
)  # fmt: skip
HARDENING = mpm.HardeningSoil(
    secant_modulus=20e6, oedometer_modulus=20e6, unloading_modulus=60e6, cohesion=1e3, friction_angle=33.0, dilation_angle=3.0,
    vertical_preconsolidation=60e3,
)  # fmt: skip
SMALL_STRAIN = mpm.HardeningSoil(
    **{p.name: getattr(HARDENING, p.name) for p in mpm.HardeningSoil.parameters}
    | {"small_strain_modulus": 100e6, "threshold_strain": 1e-4}
)
ROCK = mpm.HoekBrown(
    young=20e6,
    poisson=0.3,
    intact_strength=1e6,
    geological_strength_index=20.0,
    intact_constant=4.0,
    dilation_ratio=0.2,
)
LAWS = {
    "elastic": mpm.LinearElastic(**ELASTIC),
    "Mohr-Coulomb": SOIL,
    "softening": SOFTENING,
    "Tresca": mpm.tresca(**ELASTIC, shear_strength=10e3),
    "von Mises": mpm.von_mises(**ELASTIC, yield_stress=20e3),
    "Drucker-Prager": mpm.matched_drucker_prager(**ELASTIC, cohesion=5e3, friction_angle=20.0, dilation_angle=5.0),
    "Cam-Clay": CLAY,
    "undrained": mpm.Undrained(SOIL, water_modulus=2e8, porosity=0.4),
    "undrained Cam-Clay": mpm.Undrained(CLAY, water_modulus=2e8, porosity=0.5),
    "NorSand": SAND,
    "undrained NorSand": mpm.Undrained(SAND, water_modulus=2e8, porosity=0.5),
    "SANISAND": sand(),
    "undrained SANISAND": mpm.Undrained(sand(), water_modulus=2e8, porosity=0.45),
    "Hencky SANISAND": mpm.Hencky(sand()),
    "Hardening Soil": HARDENING,
    "undrained Hardening Soil": mpm.Undrained(HARDENING, water_modulus=2e8, porosity=0.45),
    "Hencky Hardening Soil": mpm.Hencky(HARDENING),
    "small-strain Hardening Soil": SMALL_STRAIN,
    "undrained small-strain Hardening Soil": mpm.Undrained(SMALL_STRAIN, water_modulus=2e8, porosity=0.45),
    "Hencky small-strain Hardening Soil": mpm.Hencky(SMALL_STRAIN),
    "Hoek-Brown": ROCK,
    "Hencky Hoek-Brown": mpm.Hencky(ROCK),
    "Hencky": mpm.Hencky(SOIL),
    "viscoplastic": mpm.ViscoplasticMohrCoulomb(
        **ELASTIC, cohesion=10e3, friction_angle=25.0, dilation_angle=5.0, viscosity=1e-6
    ),
    "heterogeneous": mpm.Heterogeneous(SOIL, ["cohesion"]),
    "undrained Hencky": mpm.Undrained(mpm.Hencky(SOFTENING), water_modulus=2e8, porosity=0.4),
}
STEPS, STRAIN, PRESSURE = 10, 2e-4, 50e3
START = np.array([-PRESSURE] * 3 + [0.0])


@pytest.fixture(params=LAWS.values(), ids=LAWS.keys())
def law(request):
    return request.param


def single_point(law, cell_size):
    """Stress and state of one point after the same compression."""
    test = mpm.ElementTest(law, START, cell_size=cell_size)
    for _ in range(STEPS):
        test.step([0, -STRAIN, 0, 0])
    return test.stress, test.state


@pytest.mark.parametrize("scheme", ["explicit", "implicit"])
def test_particles(law, scheme):
    squares = 1 if scheme == "explicit" else 2  # with one square every node moves as prescribed, without waves
    model = mpm.Model(box([squares] * 2), law)
    model.seed(density=2000.0, per_cell=3)
    rollers(model, [0])
    model.roller(3, (0, 1))
    model.particles.set("stress", np.tile(START, (len(model.particles), 1)))
    dt = 1e-4
    model.prescribe(4, (0, -STRAIN / dt))
    if scheme == "explicit":
        run(model, STEPS * dt, dt=dt, allow_unstable=True)
    else:
        list(model.implicit(STEPS * dt, dt=dt, quasi_static=True))
    stress, state = single_point(law, 1 / squares)  # triangles that halve squares
    assert np.abs(model.particles.stress - stress).max() < 1e-6 * np.abs(stress).max()
    assert np.abs(model.particles.state - state).max() <= 1e-6 * np.abs(state).max()


@pytest.mark.parametrize("degree", [1, 2])
def test_finite_elements(law, degree):
    domain, facet_tags, supports, height = column(2)
    moved = (None, -STRAIN * STEPS * height)
    supports = [*supports[:2], bridge.roller(bridge.BASE, (0, 1)), bridge.prescribed(bridge.CREST, moved)]
    fem = bridge.QuasiStatic(domain, law, facet_tags, supports, degree=degree)
    fem.set_initial_stress(np.tile(START, (fem.points.n, 1)), bridge.Load())
    for step in range(1, STEPS + 1):
        assert fem.equilibrate(bridge.Load(displacement=step / STEPS)).converged
    stress, state = single_point(law, fem.points.cell_size[0])
    assert np.abs(fem.points.stress - stress).max() < 1e-6 * np.abs(stress).max()
    assert np.abs(fem.points.state - state).max() <= 1e-6 * np.abs(state).max()


def test_layers_and_random_fields():
    # Two layers by position, the lower one with a cohesion from a random field
    model = mpm.Model(box([4, 4]), [SOIL, SOFTENING])
    model.seed(density=2000.0, per_cell=3)
    y = model.particles.position[:, 1]
    model.assign(np.where(y < 0.5, 1, 0))
    field = np.random.default_rng(4).uniform(-0.5, 0.5, len(y))
    model.set_state("cohesion_deviation", field)
    assert (model.particles.material == (y < 0.5)).all()
    found = model.state("cohesion_deviation")
    assert (found[y < 0.5] == field[y < 0.5]).all() and np.isnan(found[y > 0.5]).all()
    ids = model.particles.id
    rollers(model)
    model.set_gravity((0.0, -10.0))
    run(model, 0.01)
    order, before = np.argsort(model.particles.id), np.argsort(ids)
    assert (model.state("cohesion_deviation")[order] == np.where(y < 0.5, field, np.nan)[before])[
        (y < 0.5)[before]
    ].all()


def test_another_law_takes_over_the_state_variables_that_it_has_too():
    model = mpm.Model(box([1, 1]), [SOFTENING, SOIL, CLAY])
    model.seed(density=2000.0, per_cell=3)
    assert SOFTENING.state_names == ["plastic_strain", "band_strain", "cohesion_deviation", "separation"]
    assert SOIL.state_names == ["plastic_strain", "separation"]
    n = len(model.particles)
    for name, value in {"plastic_strain": 0.3, "band_strain": 0.2, "separation": 0.1}.items():
        model.set_state(name, np.full(n, value))
    model.assign(np.arange(n) % 3)
    softening, soil, clay = (model.particles.state[number] for number in range(3))
    assert softening.tolist() == [0.3, 0.2, 0.0, 0.1]
    assert soil[:2].tolist() == [0.3, 0.1] and not soil[2:].any()
    assert clay[0] == 0.3 and not clay[1:].any()


def test_bad_layers_and_fields_are_named():
    model = mpm.Model(box([1, 1]), [SOIL, SOFTENING])
    model.seed(density=2000.0, per_cell=3)
    with pytest.raises(mpm.InputError, match="material is 2, expected 0 to 1"):
        model.assign(np.full(6, 2))
    with pytest.raises(mpm.InputError, match="expected one whole number each"):
        model.assign(np.zeros(3, dtype=int))
    with pytest.raises(mpm.InputError, match="name is 'suction', expected a state variable of the laws: band_strain, "):
        model.state("suction")
    with pytest.raises(mpm.InputError, match="values has shape"):
        model.set_state("cohesion_deviation", np.zeros(2))
