"""Soils that stages place with an overconsolidation ratio: settlements by closed form, and ground that really was loaded before."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hardening_soil_cases import REFERENCE, clay, isotropic, sand
from mpi4py import MPI
from scipy.integrate import quad
from stage_cases import ROLLERS, SOILS, carried_out, mesh_of, site_of, weights

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge.fem.overconsolidation import hardened

HEIGHT, WEIGHT, SURCHARGE, RATIO = 6.0, 20e3, 40e3, 2.0
NORMAL = 1 - np.sin(np.radians(35.0))
PER_VERTICAL = 0.2 / 0.8  # nu / (1 - nu): what the lateral stress changes by as the vertical one does, in elastic soil
UNLOADED = NORMAL * RATIO - PER_VERTICAL * (
    RATIO - 1
)  # K0 of ground that was normally consolidated to twice its stress
SOIL = "clay"


@pytest.fixture(scope="module")
def ground():
    parameters = {"height": HEIGHT, "width": 1.0, "cell_size": 0.5}
    return bridge.read_mesh(Path(__file__).parents[3] / "meshes" / "layer.geo", MPI.COMM_WORLD, parameters=parameters)


def beginning(pressure=SURCHARGE, weight=WEIGHT, **options):
    return bridge.Stage("in situ", fill=SOIL, unit_weight={SOIL: weight}, pressure={"top": pressure}, **options)


def settlements(site, *stages):
    """Of the surface [m] after each stage but the first."""
    top = np.array([[0.5, HEIGHT]])
    found = [-site.fem.evaluate_at(top)["displacement"][0, 1] for _ in bridge.carry_out(site, stages)]
    return np.diff(found)


def reloaded(before, after):
    """Strain from one vertical stress to another in elastic soil that began with K0 of unloading: E_ur follows the lateral stress."""
    law = sand()
    constrained = law.unloading_modulus * (1 - 0.2) / ((1 + 0.2) * (1 - 2 * 0.2))
    first = UNLOADED * before
    last = first + PER_VERTICAL * (after - before)
    return np.sqrt(REFERENCE) / constrained * 2 * (np.sqrt(last) - np.sqrt(first)) / PER_VERTICAL


def first_loaded(before, after):
    """Strain in first loading in the oedometer, whose modulus follows the vertical stress."""
    return 2 * np.sqrt(REFERENCE) / sand().oedometer_modulus * (np.sqrt(after) - np.sqrt(before))


def settlement(load):
    """Of the surface under a further load [Pa]: as in reloading up to the preconsolidation at each depth, then as in first loading."""

    def strain(depth):
        vertical = SURCHARGE + WEIGHT * depth
        most = max(vertical + load, RATIO * vertical)
        return reloaded(vertical, min(vertical + load, RATIO * vertical)) + first_loaded(RATIO * vertical, most)

    return quad(strain, 0, HEIGHT, epsrel=1e-6, limit=200)[0]


def test_ground_settles_by_its_unloading_modulus_up_to_its_preconsolidation_and_by_the_oedometer_modulus_beyond(ground):
    """The preconsolidation is 80 kPa at the surface, 40 kPa more than what acts, and 320 kPa at the base, 160 kPa more."""
    loads = (35e3, 100e3, 300e3)
    site = site_of(ground, {SOIL: sand()})
    begin = beginning(k0={SOIL: UNLOADED}, overconsolidation={SOIL: RATIO})
    stages = (bridge.Stage(f"{load:g}", pressure={"top": SURCHARGE + load}) for load in loads)
    found = np.cumsum(settlements(site, begin, *stages))
    assert found == pytest.approx([settlement(load) for load in loads], rel=1e-3)
    normal = site_of(ground, {SOIL: sand()})
    [soft] = settlements(
        normal, beginning(k0={SOIL: NORMAL}), bridge.Stage("35", pressure={"top": SURCHARGE + loads[0]})
    )
    expected = quad(lambda z: first_loaded(SURCHARGE + WEIGHT * z, SURCHARGE + loads[0] + WEIGHT * z), 0, HEIGHT)[0]
    assert soft == pytest.approx(expected, rel=1e-3) and soft > 2 * found[0]


def test_it_is_the_ground_that_was_loaded_by_so_much_and_unloaded(ground):
    """By soil and surcharge of twice the weight, which then lose half of it: K0 and hardening, and what a further load does."""
    begin = beginning(k0={SOIL: UNLOADED}, overconsolidation={SOIL: RATIO})
    before = beginning(RATIO * SURCHARGE, RATIO * WEIGHT, k0={SOIL: NORMAL})
    lighter = bridge.Stage("unload", unit_weight={SOIL: WEIGHT}, pressure={"top": SURCHARGE})
    load = bridge.Stage("load", pressure={"top": SURCHARGE + 100e3})
    site, unloaded = (site_of(ground, {SOIL: sand()}) for _ in range(2))
    carried_out(site, begin)
    carried_out(unloaded, before, lighter)
    one, other = site.fem.points, unloaded.fem.points
    assert np.allclose(one.stress, other.stress, rtol=0, atol=2e-3 * 160e3)
    assert np.allclose(one.state[:, 1:], other.state[:, 1:], rtol=5e-3)
    deep = [site.fem.displacement.x.array.copy() for site in (site, unloaded)]
    carried_out(site, load)
    carried_out(unloaded, load)
    change = [each.fem.displacement.x.array - past for each, past in zip((site, unloaded), deep)]
    assert np.allclose(*change, rtol=0, atol=5e-3 * np.abs(change[0]).max())


def test_without_k0_soil_is_overconsolidated_under_the_stresses_of_its_first_loading(ground):
    site = site_of(ground, {SOIL: sand()})
    carried_out(site, beginning(overconsolidation={SOIL: RATIO}))
    p = site.fem.points
    assert np.allclose(p.stress[:, 0] / p.stress[:, 1], NORMAL, rtol=0.02)
    expected = mpm.hardening_soil_state(sand(), p.stress, RATIO)
    assert np.allclose(p.state[:, 1], expected["shear_hardening"], rtol=1e-3)
    assert np.allclose(p.state[:, 2], expected["log_preconsolidation"], rtol=1e-3)


@pytest.mark.parametrize("size", [4, 6])
def test_the_vertical_stress_counts_where_the_horizontal_one_is_larger(size):
    law, up = clay(), size // 2 - 1
    stress, usual = np.zeros((1, size)), np.zeros((1, size))
    stress[0, :3], usual[0, :3] = -75e3, -30e3
    stress[0, up] = usual[0, up] = -50e3
    expected = mpm.hardening_soil_state(law, usual, 4.0)  # by the largest principal stress
    found = hardened(law, stress, np.zeros((1, 3)), 4.0)
    assert found[0, 1:] == pytest.approx([expected["shear_hardening"][0], expected["log_preconsolidation"][0]])


def test_hardening_is_never_less_than_the_stress_itself_needs_or_there_was_before():
    law, stress = clay(), isotropic(100e3)[None]
    itself = mpm.hardening_soil_state(law, stress)
    found = hardened(law, stress, np.array([[0.1, 0.2, 0.0]]), 1.0)
    assert found[0] == pytest.approx([0.1, 0.2, itself["log_preconsolidation"][0]])
    assert itself["log_preconsolidation"][0] > mpm.hardening_soil_state(law, stress / 2)["log_preconsolidation"][0] > 0


@pytest.mark.parametrize("wrap", [lambda law: mpm.Undrained(law, porosity=0.4), mpm.Hencky,
                                  lambda law: mpm.Undrained(mpm.Hencky(law), porosity=0.4)])  # fmt: skip
def test_laws_made_of_it_have_it_in_effective_stresses(wrap):
    law = wrap(clay())
    state, stress = np.zeros((1, law.n_state)), isotropic(100e3)[None]
    if "excess_pore_pressure" in law.state_names:
        state[0, -1] = 30e3
        stress[0, :3] -= 30e3
    expected = hardened(clay(), isotropic(100e3)[None], np.zeros((1, 3)), 3.0)
    assert hardened(law, stress, state, 3.0)[0, :3] == pytest.approx(expected[0])


def test_particles_have_the_hardening_of_the_finite_elements(tmp_path):
    """Of a pit beside ground, by own stages and by a hand-over; what is dug away then lifts both alike."""
    mesh, soils = mesh_of("pit", tmp_path), SOILS["pit"]
    laws = dict.fromkeys(soils, sand(cohesion=5e3))
    stage = bridge.Stage("in situ", fill=soils, unit_weight=weights(soils), k0=dict.fromkeys(soils, 0.8),
                         overconsolidation={"ground": 3.0, "pit 2": 1.5}, pore_pressure=bridge.hydrostatic(2.0))  # fmt: skip
    fem = site_of(mesh, laws, first_step=1.0, degree=1)
    particles, taken = (
        bridge.ParticleSite(
            mpm.Model(bridge.background_mesh(*mesh), [laws["ground"]]), dict.fromkeys(soils, 0), ROLLERS,
            small_displacements=True, tolerance=1e-8,
        ) for _ in range(2)
    )  # fmt: skip
    fem.carry_out(stage)
    particles.carry_out(stage)
    taken.take_over(fem)
    for site in (particles, taken):
        expected = fem.fem.evaluate_at(site.model.particles.position)["state"]
        assert np.abs(site.model.particles.state - expected).max() < 1e-6 * np.abs(expected).max()
    normal = site_of(mesh, laws, first_step=1.0, degree=1)
    normal.carry_out(replace(stage, overconsolidation={}))
    more = fem.fem.points.state - normal.fem.points.state
    grown = np.bincount(np.repeat(fem.fem.points.material, fem.fem.points.per_cell), (more[:, 2] > 0.1).astype(float))
    assert (grown > 0).tolist() == [soil != "pit 1" for soil in soils]
    dig = bridge.Stage("dig", excavate="pit 1")
    fem.carry_out(dig)
    report = particles.carry_out(dig)
    p = particles.model.particles
    expected = fem.fem.evaluate_at(p.position)
    assert np.abs(p.stress - expected["stress"]).max() < 1e-5 * np.abs(expected["stress"]).max()
    assert report.largest_displacement > 1e-5


@pytest.mark.parametrize(
    "values, message",
    [
        ({"overconsolidation": 2.0}, "stage 'a': overconsolidation is 2.0, expected a dictionary by soil"),
        ({"overconsolidation": {"ground": 0.9}}, "stage 'a': overconsolidation is 0.9 for 'ground', expected a ratio from 1 to 100"),
        ({"overconsolidation": {"ground": 200e3}}, "overconsolidation is 200000.0 for 'ground', expected a ratio from 1 to 100"),
        ({"overconsolidation": {"ground": np.nan}}, "stage 'a': overconsolidation is nan for 'ground', expected a ratio"),
        ({"overconsolidation": {"rock": 2.0}}, "stage 'a': overconsolidation: .*'rock'"),
        ({"overconsolidation": {"pit 1": 2.0}}, "stage 'a': overconsolidation is given for 'pit 1', expected a soil of fill"),
    ],
)  # fmt: skip
def test_wrong_ratios_change_nothing(tmp_path, values, message):
    mesh = mesh_of("pit", tmp_path)
    site = site_of(mesh, dict.fromkeys(SOILS["pit"], sand()))
    with pytest.raises(bridge.InputError, match=message):
        site.carry_out(bridge.Stage("a", fill="ground", unit_weight=weights(SOILS["pit"]), **values))
    assert site.number == 0 and site.state.there == ()


@pytest.mark.parametrize("law", [mpm.MohrCoulomb(young=20e6, poisson=0.3, cohesion=5e3, friction_angle=30.0),
                                 mpm.Heterogeneous(sand(), ["cohesion"])])  # fmt: skip
def test_a_law_without_memory_or_that_varies_is_refused(tmp_path, law):
    mesh, soils = mesh_of("pit", tmp_path), SOILS["pit"]
    model = mpm.Model(bridge.background_mesh(*mesh), [law])
    stage = bridge.Stage("a", fill="ground", unit_weight=weights(soils), overconsolidation={"ground": 2.0})
    for site in (
        site_of(mesh, dict.fromkeys(soils, law)),
        bridge.ParticleSite(model, dict.fromkeys(soils, 0), ROLLERS),
    ):
        with pytest.raises(
            bridge.InputError,
            match="overconsolidation is 2 for the soil 'ground', whose law is .*, expected HardeningSoil",
        ):
            site.carry_out(stage)
        assert site.number == 0 and site.state.there == ()


CLAY = mpm.CamClay(
    compression=0.2,
    swelling=0.04,
    critical_slope=1.0,
    poisson=0.2,
    preconsolidation=1e3,
    void_ratio=1.0,
    attraction=1e3,
)


def compressed_clay(before, after):
    """Vertical strain of clay by the law itself, in an oedometer, from one vertical stress to another."""
    jaky = 1 - 3 / 7  # sin(phi) = 3 M / (6 + M) of the critical state
    at_rest = -before * np.array([jaky, 1.0, jaky, 0.0])
    history = -RATIO * before * np.array([jaky, 1.0, jaky, 0.0])
    state = np.zeros(CLAY.n_state)
    state[1] = mpm.log_preconsolidation(CLAY, history[None])[0]
    test = mpm.ElementTest(CLAY, at_rest, state)
    for vertical in np.linspace(before, after, 201)[1:]:
        test.step([0.0, None, 0.0, 0.0], stress=[0.0, -vertical, 0.0, 0.0])
    return -test.strain[1]


@pytest.mark.parametrize("method", ["elements", "particles"])
def test_cam_clay_keeps_its_stress_at_rest_and_settles_by_its_overconsolidation(ground, method):
    """Its `preconsolidation` of 1 kPa, far below its stress, is no matter."""
    stages = (
        beginning(weight=10.0, k0={SOIL: 1 - 3 / 7}, overconsolidation={SOIL: RATIO}),
        *(bridge.Stage(f"{p:g}", pressure={"top": p}) for p in np.linspace(1, 4, 41)[1:] * SURCHARGE),
    )
    if method == "elements":
        site = site_of(ground, {SOIL: CLAY})
    else:
        model = mpm.Model(bridge.background_mesh(*ground), [CLAY])
        site = bridge.ParticleSite(model, {SOIL: 0}, ROLLERS, small_displacements=True)
    moved = [site.carry_out(stage).largest_displacement for stage in stages]
    if method == "particles":
        p = model.particles
        moved[-1] = HEIGHT * np.mean(-p.displacement[:, 1] / p.position[:, 1])  # the surface is above all particles
    assert moved[0] < 1e-8
    strain = compressed_clay(SURCHARGE, 4 * SURCHARGE)
    assert strain > 0.05
    assert moved[-1] == pytest.approx(strain * HEIGHT, rel=0.01)


@pytest.mark.parametrize("method", ["elements", "particles"])
def test_cam_clay_is_elastic_under_stresses_that_a_stage_gives_with_an_overconsolidation(ground, method):
    """As clay whose preconsolidation pressure is far above all stresses."""
    at_rest = -SURCHARGE * np.array([1 - 3 / 7, 1.0, 1 - 3 / 7, 0.0])
    stage = beginning(weight=2e3, stress=lambda x: np.tile(at_rest, (len(x), 1)))
    hard = mpm.CamClay(**{p.name: getattr(CLAY, p.name) for p in CLAY.parameters} | {"preconsolidation": 10e6})
    moved = []
    for law, ratios in ((CLAY, {SOIL: RATIO}), (hard, {})):
        model = mpm.Model(bridge.background_mesh(*ground), [law])
        particles = bridge.ParticleSite(model, {SOIL: 0}, ROLLERS, small_displacements=True)
        site = particles if method == "particles" else site_of(ground, {SOIL: law})
        moved.append(site.carry_out(replace(stage, overconsolidation=ratios)).largest_displacement)
    assert moved[0] == pytest.approx(moved[1], rel=1e-6)


def test_an_overconsolidation_of_cam_clay_that_comes_free_of_stress_is_refused(ground):
    """K0nc OCR^sin(phi), where sin(phi) = 3 M / (6 + M) = 3/7 and K0nc = 4/7, is 0.77 for a ratio of 2."""
    model = mpm.Model(bridge.background_mesh(*ground), [CLAY])
    for site in (site_of(ground, {SOIL: CLAY}), bridge.ParticleSite(model, {SOIL: 0}, ROLLERS)):
        with pytest.raises(
            bridge.InputError, match=r"the soil 'clay', which comes free of stress, expected k0 .* k0 is about 0.77"
        ):
            site.carry_out(beginning(overconsolidation={SOIL: RATIO}))
        assert site.number == 0 and site.state.there == ()
