"""Hardening Soil in finite elements and among particles: settlement of a column by closed form, factor of safety, hand-over."""

import numpy as np
import pytest
from bridge_cases import column, slope_model, top_of_column
from hardening_soil_cases import sand, small_strain_sand
from mpi4py import MPI
from stage_cases import ROLLERS, SOILS, mesh_of, site_of

import fenics_bridge as bridge
import mpm_core as mpm

UNIT_WEIGHT, REFERENCE = 20e3, 100e3


@pytest.mark.parametrize("dim", [2, 3])
def test_a_column_settles_by_its_oedometer_modulus_and_rises_by_that_of_unloading(dim):
    # First loading: e(s) = 2 sqrt(s reference) / Eoed for m = 1/2, so with s = w (H - y) + load the top settles by
    # 4/3 sqrt(reference) (s1^1.5 - s0^1.5) / (w Eoed)
    law, load = sand(), 200e3
    domain, facet_tags, supports, height = column(dim)
    crest = bridge.CREST if dim == 2 else 4
    fem = bridge.QuasiStatic(domain, law, facet_tags, supports, degree=2)
    fem.solve(bridge.Load(unit_weight=UNIT_WEIGHT))
    fem.solve(bridge.Load(unit_weight=UNIT_WEIGHT, pressure={crest: load}))
    assert fem.converged
    base = load + UNIT_WEIGHT * height
    expected = 4 / 3 * np.sqrt(REFERENCE) * (base**1.5 - load**1.5) / (UNIT_WEIGHT * law.oedometer_modulus)
    settled = -top_of_column(fem)
    assert settled == pytest.approx(expected, rel=0.02)
    k0 = fem.points.stress[:, 0] / fem.points.stress[:, dim - 1]
    assert k0 == pytest.approx(1 - np.sin(np.radians(35.0)), rel=0.02)
    # unloading to half: elastic, with E_ur of a lateral stress that falls by nu / (1 - nu) of the vertical one
    fem.solve(bridge.Load(unit_weight=UNIT_WEIGHT, pressure={crest: load / 2}))
    rise = settled + top_of_column(fem)
    nu = law.poisson
    vertical = np.linspace(base, base - load / 2, 2001)
    lateral = (1 - np.sin(np.radians(35.0))) * (load + UNIT_WEIGHT * height / 2) - nu / (1 - nu) * (base - vertical)
    constrained = law.unloading_modulus * (1 - nu) / ((1 + nu) * (1 - 2 * nu)) * np.sqrt(lateral / REFERENCE)
    assert rise == pytest.approx(np.mean(1 / constrained) * load / 2 * height, rel=0.03)


def test_the_factor_of_safety_is_that_of_mohr_and_coulomb():
    factors = {}
    for kind in ("hardening", "perfect"):
        model = slope_model(0.2)
        if kind == "hardening":
            law = mpm.HardeningSoil(
                secant_modulus=2e6, oedometer_modulus=2e6, unloading_modulus=6e6, cohesion=1e3, friction_angle=25.0,
                dilation_angle=25.0,
            )  # fmt: skip
            model.reconfigure(law=law)
        factors[kind] = bridge.factor_of_safety(model, bridge.Load(unit_weight=20e3)).value
    assert factors["hardening"] == pytest.approx(factors["perfect"], rel=3e-3)


def test_particles_take_over_stresses_and_hardening():
    domain, cell_tags, facet_tags = bridge.slope_mesh(
        MPI.COMM_WORLD, height=4.0, angle=30.0, crest=4.0, cell_size=0.5, kind="fitted"
    )
    law = sand(cohesion=1e3)
    body, _, sides = bridge.soil_mesh(domain, cell_tags, facet_tags)
    supports = [bridge.roller(bridge.LEFT, (1, 0)), bridge.fixed(bridge.BASE)]
    fem = bridge.QuasiStatic(body, law, sides, supports, degree=1, nmd=True)
    fem.solve(bridge.Load(unit_weight=UNIT_WEIGHT))
    assert fem.converged
    model = mpm.Model(bridge.background_mesh(domain, cell_tags, facet_tags), law)
    model.seed(density=UNIT_WEIGHT / 9.81, per_cell=6, cell_tag=bridge.SOIL)
    model.roller(bridge.LEFT, normal=(1, 0))
    model.fix(bridge.BASE)
    model.set_gravity((0.0, -9.81))
    handover = bridge.initialise(model, fem, count_displacement=False)
    assert handover.unbalanced_ratio < 0.02 and handover.equilibrated_ratio < 1e-5
    assert model.state("log_preconsolidation").min() > 0 and model.state("shear_hardening").max() > 1e-4
    before = model.particles.stress.copy()
    report = model.explicit(until=0.2, nmd=True).last()
    assert report.kinetic_energy < 1e-9 * model.particles.mass.sum() * 9.81
    assert model.particles.stress == pytest.approx(before, abs=1e-3 * np.abs(before).max())


@pytest.mark.parametrize("fem", [True, False], ids=["elements", "particles"])
def test_ground_forgets_the_small_strains_of_its_first_stage_alone(fem, tmp_path):
    mesh, soils = mesh_of("column", tmp_path), SOILS["column"]
    laws = dict.fromkeys(soils, small_strain_sand(cohesion=1e3))
    if fem:
        site = site_of(mesh, laws)
    else:
        model = mpm.Model(bridge.background_mesh(*mesh), list(laws.values())[:1])
        site = bridge.ParticleSite(model, dict.fromkeys(soils, 0), ROLLERS, small_displacements=True)
    largest = []
    for stage in (
        bridge.Stage("ground", fill="ground", unit_weight={"ground": 20e3}),
        bridge.Stage("load", pressure={"surface": 1e3}),
    ):
        site.carry_out(stage)
        there = (site.fem.points if fem else model.particles).state
        largest.append(there[:, laws["ground"].state_names.index("largest_small_strain")].max())
        assert (largest[-1] > 0) == (np.abs(there[:, 4:]).max() > 0)
    assert largest[0] == 0.0
    assert 1e-6 < largest[1] < 1e-4


def test_first_loading_of_ground_with_a_small_strain_stiffness_settles_as_its_points(tmp_path):
    """Points of level ground, which are compressed in 400 increments, have the settlement of stages by default steps.

    In a single step for the whole weight it would be 30 % larger.
    """
    soils, weight, k0 = SOILS["column"], 20e3, 1 - np.sin(np.radians(35.0))
    law = sand(small_strain_modulus=112.5e6)
    stages = [
        bridge.Stage("in situ", fill=soils, unit_weight=dict.fromkeys(soils, weight), k0=dict.fromkeys(soils, k0)),
        bridge.Stage("heavier", unit_weight=dict.fromkeys(soils, 1.5 * weight)),
    ]
    expected, depths = 0.0, 6.0 * (np.arange(12) + 0.5) / 12
    for vertical in weight * depths:
        test = mpm.ElementTest(law, -vertical * np.array([k0, 1.0, k0, 0.0]))
        for factor in np.linspace(1.0, 1.5, 401)[1:]:
            test.step([0.0, None, 0.0, 0.0], stress=[0.0, -factor * vertical, 0.0, 0.0])
        expected -= 6.0 / len(depths) * test.strain[1]
    mesh = mesh_of("column", tmp_path)
    site = site_of(mesh, dict.fromkeys(soils, law), first_step=None)
    list(bridge.carry_out(site, stages))
    assert -site.fem.displacement.x.array.min() == pytest.approx(expected, rel=0.02)
    model = mpm.Model(bridge.background_mesh(*mesh), law)
    particles = bridge.ParticleSite(model, dict.fromkeys(soils, 0), ROLLERS, small_displacements=True)
    list(bridge.carry_out(particles, stages))
    assert -model.particles.displacement[:, 1].min() == pytest.approx(expected, rel=0.05)
