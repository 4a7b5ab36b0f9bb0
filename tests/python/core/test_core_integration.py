"""Mixed and dual domain integration: forces that add up, exact for a uniform stress, and smooth stresses in a settling column."""

import numpy as np
import pytest
from core_cases import DIMS, box, by_id, moduli, rollers, run
from implicit_cases import slope
from mpm_core.probes import SectionProbe

import mpm_core as mpm
from mpm_core import Integration

MODES = list(Integration.__members__.values())
REMEDIES = [Integration.MIXED, Integration.DUAL_DOMAIN]
YOUNG, POISSON, DENSITY = 1e6, 0.3, 1000.0
ELASTIC = mpm.LinearElastic(young=YOUNG, poisson=POISSON)


def unevenly_filled(dim, **mesh):
    """A box whose particles have been thrown about, over the sides of their cells."""
    model = mpm.Model(box([5] * dim, shake=0.15, **mesh), ELASTIC)
    model.seed(density=DENSITY, per_cell={2: 10, 3: 8}[dim])
    x = model.particles.position
    model.place(np.clip(x + np.random.default_rng(3).uniform(-0.06, 0.06, x.shape), 0.01, 0.99))
    return model


def internal_force(model, integration):
    """At the nodes, of the stresses as they are."""
    run(model, 1e-9, dt=1e-9, integration=integration)
    return model.nodal("internal_force")


@pytest.mark.parametrize("dim", DIMS)
@pytest.mark.parametrize("integration", MODES)
def test_a_section_carries_the_nodal_forces_on_either_side(dim, integration):
    """The forces on the nodes before a plane are those that act across it, since those of each whole cell add up to nothing."""
    model = unevenly_filled(dim)
    model.particles.set("stress", np.random.default_rng(1).uniform(-1, 1, model.particles.stress.shape))
    point, normal = np.full(dim, 0.47), np.array([1.0, 0.4, -0.3])[:dim]
    force = internal_force(model, integration)
    before = (model.mesh.points - point) @ normal > 0
    section = SectionProbe(model, point=point, normal=normal).values()
    across = [section[f"force_{axis}_N"] for axis in "xyz"[:dim]]
    scale = np.abs(force[before]).sum()
    assert across == pytest.approx(force[before].sum(axis=0), abs=1e-9 * scale)
    assert np.abs(across).max() > 1e-3 * scale


def test_a_section_is_the_same_after_a_restart(tmp_path):
    models = unevenly_filled(2), mpm.Model(unevenly_filled(2).mesh, ELASTIC)
    models[0].particles.set("stress", np.random.default_rng(1).uniform(-1, 1, models[0].particles.stress.shape))
    internal_force(models[0], Integration.MIXED)
    models[0].save(tmp_path / "state.h5")
    models[1].restore(tmp_path / "state.h5")
    one, other = (SectionProbe(model, point=(0.47, 0.47), normal=(1.0, 0.4)).values() for model in models)
    assert one["force_normal_N"] != 0.0
    assert one == other


@pytest.mark.parametrize("dim", DIMS)
@pytest.mark.parametrize("integration", MODES)
def test_internal_forces_of_any_stress_add_up_to_nothing(dim, integration):
    model = unevenly_filled(dim)
    model.particles.set("stress", np.random.default_rng(1).uniform(-1, 1, model.particles.stress.shape))
    force = internal_force(model, integration)
    assert np.abs(force).max() > 1e-4
    assert np.abs(force.sum(axis=0)).max() < 1e-13 * np.abs(force).sum()
    x = model.mesh.points  # no moment either
    moment = x[:, 0] * force[:, 1] - x[:, 1] * force[:, 0]
    assert abs(moment.sum()) < 1e-13 * np.abs(moment).sum()


@pytest.mark.parametrize("dim", DIMS)
@pytest.mark.parametrize("integration", MODES)
def test_a_uniform_stress_leaves_inner_nodes_at_rest(dim, integration):
    model = unevenly_filled(dim)
    stress = np.array([-3.0, -1.0, -2.0, 0.7] if dim == 2 else [-3.0, -1.0, -2.0, 0.7, -0.2, 0.4])
    model.particles.set("stress", np.tile(stress, (len(model.particles), 1)))
    force = internal_force(model, integration)
    inner = ((model.mesh.points > 0.01) & (model.mesh.points < 0.99)).all(axis=1)
    unbalanced = np.abs(force[inner]).max() / np.abs(force[~inner]).max()
    if integration == Integration.PARTICLES:
        assert unbalanced > 0.05  # what the others are for
    else:
        assert unbalanced < 1e-12


def settled_column(integration, settlement, rows=16, scheme="explicit"):
    """A column under its weight whose top settles by this share of the height, at rest. Returns the root mean square error of the
    vertical stress over w H: the weight above a particle stays above it, so it is w (H - X) wherever it moved."""
    height, modulus = 1.0, moduli(YOUNG, POISSON)[2]
    gravity = 2 * settlement * modulus / (DENSITY * height)
    side = height / rows
    mesh = box([2, rows + 1], [2 * side, height + side], diagonals="alternating", body=((-1, 0), (1, height)))
    model = mpm.Model(mesh, ELASTIC)
    model.seed(density=DENSITY, per_cell=6, cell_tag=1)
    rollers(model, axes=[0])
    model.fix(3)
    period = 4 * height / np.sqrt(modulus / DENSITY)
    if scheme == "explicit":
        model.set_gravity((0, -gravity), ramp=4 * period)
        run(model, 12 * period, damping=0.7, integration=integration)
    else:
        model.set_gravity((0, -gravity), ramp=1.0)
        list(model.implicit(1.0, dt=0.05, quasi_static=True, integration=integration))
    expected = -DENSITY * gravity * (height - by_id(model, "initial_position")[:, 1])
    error = by_id(model, "stress")[:, 1] - expected
    return np.sqrt(np.mean(error**2)) / (DENSITY * gravity * height)


def test_dual_domains_give_stresses_inside_of_cells():
    # One stress in a cell of height h misses a linear one by h / sqrt(12) in the mean, here of two triangles in a square
    plain = settled_column(Integration.PARTICLES, 1e-4)
    assert plain == pytest.approx(1 / 16 / np.sqrt(12), rel=0.3)
    assert settled_column(Integration.MIXED, 1e-4) == pytest.approx(plain, rel=0.01)
    assert settled_column(Integration.DUAL_DOMAIN, 1e-4) < 0.4 * plain


@pytest.mark.parametrize("settlement", [0.05, 0.15])
def test_stresses_stay_smooth_when_particles_cross_into_other_cells(settlement):
    # The standard method does not converge here: its error is that of the forces of single particles.
    errors = {mode: settled_column(mode, settlement) for mode in MODES}
    assert errors[Integration.PARTICLES] > 0.08
    assert errors[Integration.MIXED] < 0.012
    assert errors[Integration.DUAL_DOMAIN] < 0.01


@pytest.mark.parametrize("integration", REMEDIES)
def test_they_converge_where_the_standard_method_does_not(integration):
    coarse, fine = (settled_column(integration, 0.05, rows) for rows in (8, 32))
    assert fine < 0.5 * coarse
    plain = [settled_column(Integration.PARTICLES, 0.05, rows) for rows in (8, 32)]
    assert plain[1] > 0.8 * plain[0]


def test_mixed_integration_of_the_implicit_scheme():
    assert settled_column(Integration.PARTICLES, 0.05, scheme="implicit") > 0.03
    assert settled_column(Integration.MIXED, 0.05, scheme="implicit") < 0.02


def test_dual_domains_are_explicit_only():
    with pytest.raises(mpm.InputError, match="integration is DUAL_DOMAIN"):
        unevenly_filled(2).implicit(1.0, dt=1.0, integration=Integration.DUAL_DOMAIN)


@pytest.mark.parametrize("transfer", [mpm.Transfer.FLIP, mpm.Transfer.AFFINE])
def test_a_slide_on_a_smooth_base_hardly_depends_on_the_cells(transfer):
    # On a fixed base the soil slides over a layer that is one cell thick, so that run-outs differ by 12 % between these meshes.
    run_outs = []
    for size in (0.1, 0.05):
        fixed = slope(size, weight=60e3, per_cell=6)
        model = mpm.Model(fixed.mesh, fixed.laws)
        model.seed(density=60e3 / 9.81, per_cell=6, cell_tag=1)
        model.roller(1, (1, 0))
        model.roller(2, (0, 1))
        model.set_gravity((0.0, -9.81))
        front = model.particles.position[:, 0].max()
        report = model.explicit(0.6, nmd=True, integration=Integration.MIXED, transfer=transfer).last()
        assert abs(report.unexplained_fraction) < 0.01
        run_outs.append(model.particles.position[:, 0].max() - front)
    assert run_outs[0] > 0.5
    assert run_outs[1] == pytest.approx(run_outs[0], rel=0.03)


# --- the default ------------------------------------------------------------------------------------------------------

CLAY = mpm.tresca(young=YOUNG, poisson=POISSON, shear_strength=2e3)
SAND = mpm.MohrCoulomb(young=YOUNG, poisson=POISSON, cohesion=0.0, friction_angle=30.0)
LOAM = mpm.MohrCoulomb(young=YOUNG, poisson=POISSON, cohesion=1e3, friction_angle=30.0)


@pytest.mark.parametrize(
    ("laws", "mixed"),
    [
        ([CLAY], True),
        ([LOAM], True),
        ([ELASTIC, LOAM], True),
        ([mpm.von_mises(young=YOUNG, poisson=POISSON, yield_stress=2e3)], True),
        ([mpm.Undrained(LOAM, water_modulus=1e8, porosity=0.4)], True),
        ([mpm.Hencky(CLAY)], True),
        ([mpm.CamClay(compression=0.2, swelling=0.04, critical_slope=1.0, poisson=0.3, void_ratio=1.0,
                      preconsolidation=100e3)], True),
        ([mpm.SofteningMohrCoulomb(LOAM, residual_cohesion=0.0, residual_friction_angle=20.0, softening_strain=0.1,
                                   reference_length=0.1)], True),
        ([SAND], False),
        ([mpm.NorSand(critical_void_ratio=0.9, critical_compression=0.03, critical_slope=1.25, dilatancy=4.0, hardening=100.0,
                      rigidity=200.0, poisson=0.2, void_ratio=0.8, image_pressure=100e3)], False),
        ([SAND, CLAY], False),
        ([mpm.DruckerPrager(young=YOUNG, poisson=POISSON, strength=0.0, friction=0.5)], False),
        ([ELASTIC], False),
        ([mpm.Hencky(ELASTIC)], False),
        ([mpm.Undrained(ELASTIC, water_modulus=1e8, porosity=0.4)], False),
    ],
)  # fmt: skip
def test_default_is_mixed_where_all_soil_that_yields_has_cohesion(laws, mixed):
    model = mpm.Model(box([4, 4]), laws)
    model.seed(density=DENSITY, per_cell=6)
    assert mpm.default_integration(model) == (Integration.MIXED if mixed else Integration.PARTICLES)


@pytest.mark.parametrize(("dim", "enough", "too_few"), [(2, 6, 4), (3, 4, 1)])
def test_default_is_mixed_where_enough_particles_fill_a_cell(dim, enough, too_few):
    for per_cell, expected in ((too_few, Integration.PARTICLES), (enough, Integration.MIXED)):
        model = mpm.Model(box([4] * dim), CLAY)
        model.seed(density=DENSITY, per_cell=per_cell)
        assert mpm.default_integration(model) == expected
        model.particles.set(
            "volume", 1.01 * model.particles.volume
        )  # as the hand-over of a body that moves changes them
        assert mpm.default_integration(model) == expected


def test_default_stays_while_particles_gather_and_over_a_restart(tmp_path):
    model = slope(0.2, law=CLAY)
    model.explicit(0.05).last()
    p = model.particles
    model.place(p.initial_position)
    p.set("volume", 3 * p.volume)
    assert mpm.default_integration(model) == Integration.PARTICLES
    model.save(tmp_path / "state.h5")
    other = mpm.Model(model.mesh, CLAY)
    other.restore(tmp_path / "state.h5")
    for each in (model, other):
        each.explicit(0.1, integration=None, energy_limit=None).last()
    named = mpm.Model(model.mesh, CLAY)
    named.restore(tmp_path / "state.h5")
    named.explicit(0.1, integration=Integration.MIXED, energy_limit=None).last()
    for each in (model, other):
        assert np.array_equal(by_id(each, "position"), by_id(named, "position"))


@pytest.mark.parametrize("law", [LOAM, SAND], ids=["loam", "sand"])
def test_a_run_that_names_no_integration_takes_the_default_of_its_laws(law):
    """In a slope that slides, to the last bit; and the two integrations differ there."""
    places = {}
    for integration in (None, Integration.MIXED, Integration.PARTICLES):
        model = slope(0.2, law=law)
        model.explicit(0.3, integration=integration).last()
        places[integration] = by_id(model, "position")
    expected, other = Integration.MIXED, Integration.PARTICLES
    if law is SAND:
        expected, other = other, expected
    assert np.array_equal(places[None], places[expected])
    assert not np.array_equal(places[None], places[other])
