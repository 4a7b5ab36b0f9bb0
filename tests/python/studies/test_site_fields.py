"""Random fields of the soils of a site: their values at points and particles, and what is refused."""

import importlib
import re
from pathlib import Path

import numpy as np
import pytest
import study_main
from common.site.field_plots import strength_pictures
from common.site.file import read_site
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

SITE = Path(__file__).parents[3] / "meshes" / "embankment.toml"
FIELD = "{value = 12e3, per_metre = 2e3, top = 3.0, variation = 0.4, lengths = [8.0, 1.0], seed = 3}"


def site_in(folder, clay, more=""):
    """The embankment with other keys of its clay."""
    path = folder / "site.toml"
    path.write_text(f'extends = "{SITE}"\ncell_size = 1.0\n[soils.clay]\n{clay}\n{more}\n')
    return path


def expected(position):
    """Values of FIELD at positions (n, 2) [m]."""
    field = mpm.RandomField(mean=1.0, deviation=0.4, lengths=[8.0, 1.0], seed=3, lognormal=True, correlation="markov")
    return (12e3 + 2e3 * np.maximum(3.0 - position[:, 1], 0.0)) * field(position)


@pytest.mark.parametrize("degree", [1, 2])
def test_points_and_particles_have_the_values_of_the_field(tmp_path, degree):
    site = read_site(site_in(tmp_path, f"shear_strength = {FIELD}"), MPI.COMM_WORLD)
    fem = site.finite_elements(degree)
    clay = np.isin(np.array(fem.soils)[np.repeat(fem.points.material, fem.points.per_cell)], site.tags_of(["clay"]))
    assert 0 < clay.sum() < len(clay)
    assert fem.points.parameters["cohesion"][clay] == pytest.approx(expected(fem.points.coordinates()[clay]), rel=1e-12)
    model = site.particles(3)
    strength, position = model.parameter("cohesion"), model.particles.position
    inside = position[:, 1] < 3.0
    assert strength[inside] == pytest.approx(expected(position[inside]), rel=1e-12)
    assert np.isnan(strength[~inside]).all()  # the cohesion of the layers does not vary
    assert np.ptp(np.log(strength[inside])) > 1


def test_softening_soil_has_a_field_of_its_own_and_none_of_its_neighbour(tmp_path):
    """Beside the clay that varies, the softening layer 1 keeps its cohesion, unless it has a field itself."""
    layer = '[soils."layer 1"]\nmaterial = "softening"\nsoftening_strain = 0.1\nreference_length = 0.5\nresidual_cohesion = 1e3\n'
    layer += "residual_friction_angle = 25.0\n"
    for cohesion in ("5e3", "{value = 5e3, variation = 0.3, lengths = [8.0, 1.0]}"):
        site = read_site(
            site_in(tmp_path, f"shear_strength = {FIELD}", f"{layer}cohesion = {cohesion}"), MPI.COMM_WORLD
        )
        model = site.particles(3)
        strength, tags = model.parameter("cohesion"), np.array(list(site.laws))[model.particles.material]
        assert np.ptp(strength[np.isin(tags, site.tags_of(["clay"]))]) > 1e3
        of_layer = strength[np.isin(tags, site.tags_of(["layer 1"]))]
        fem = site.finite_elements(1)
        rows = np.isin(
            np.array(fem.soils)[np.repeat(fem.points.material, fem.points.per_cell)], site.tags_of(["layer 1"])
        )
        for values in (of_layer, fem.points.parameters["cohesion"][rows]):
            assert (np.ptp(values) > 1e3) == ("variation" in cohesion)
            assert np.ptp(values) > 0 or values == pytest.approx(5e3)


def test_particles_of_weaker_softening_soil_have_the_field_divided_as_its_law_is(tmp_path):
    """Its peak is a number of each point, which is that of the soil over the factor; half of the field for a factor of 2."""
    layer = '[soils."layer 1"]\nmaterial = "softening"\nsoftening_strain = 0.1\nreference_length = 0.5\nresidual_cohesion = 1e3\n'
    layer += "residual_friction_angle = 25.0\ncohesion = {value = 5e3, variation = 0.3, lengths = [8.0, 1.0]}"
    site = read_site(site_in(tmp_path, "shear_strength = 20e3", layer), MPI.COMM_WORLD)
    full, weak = (site.particles(3, bridge.reduced_strength(site.laws, factor)) for factor in (1.0, 2.0))
    rows = np.isin(np.array(list(site.laws))[full.particles.material], site.tags_of(["layer 1"]))
    assert np.ptp(full.parameter("cohesion")[rows]) > 1e3
    assert weak.parameter("cohesion")[rows] == pytest.approx(0.5 * full.parameter("cohesion")[rows], rel=1e-12)


def test_soil_that_does_not_vary_is_the_soil_without_a_field(tmp_path):
    factors = []
    for clay in (
        "shear_strength = {value = 20e3, per_metre = 0.0, variation = 0.0, lengths = [8.0, 1.0]}",
        "shear_strength = 20e3",
    ):
        site = read_site(site_in(tmp_path, f"young = 4e6\n{clay}"), MPI.COMM_WORLD)
        fem = site.finite_elements(1)
        fem.solve(site.load())
        assert fem.converged
        factors.append(fem.displacement.x.array.copy())
    assert factors[0] == pytest.approx(factors[1], rel=1e-9, abs=1e-12)


def test_the_factor_of_safety_follows_the_field_and_its_picture_is_drawn(tmp_path):
    weak, strong = (
        study_main.ended("safety", tmp_path / str(factor), "--site", site_in(tmp_path, f"shear_strength = {FIELD.replace('12e3', text)}"),
                         "--meshes", "1", "--elements", "P1", "--start", "0.3")
        for factor, text in ((1, "12e3"), (2, "24e3"))
    )  # fmt: skip
    found = [float(end.stdout.split("factor of safety ")[1].split()[0]) for end in (weak, strong)]
    assert found[1] > 1.2 * found[0]
    assert (tmp_path / "1" / "random_cohesion.png").stat().st_size > 10_000


def test_particles_of_an_embankment_begin_with_the_field_and_slide_with_less_of_it(tmp_path, without_pictures):
    """Those of linear elements on the same cells have the values of the elements' points, which are the cells' centroids."""
    embankment = importlib.import_module("embankment")
    site = read_site(site_in(tmp_path, f"shear_strength = {FIELD.replace('12e3', '24e3')}"), MPI.COMM_WORLD)
    fem = bridge.FemSite(site.finite_elements(1, nmd=True, as_particles=True))
    for _ in bridge.carry_out(fem, site.stages):
        pass
    particles, failed = embankment.build(site, 3, 1.5, True, fem)
    assert failed is None
    model = particles.model
    p, strength = model.particles, model.parameter("cohesion")
    clay = particles.rows_of("clay")
    corners = np.array([model.mesh.points[cell] for cell in model.mesh.cells[p.cell[clay]]])
    field = mpm.RandomField(mean=1.0, deviation=0.4, lengths=[8.0, 1.0], seed=3, lognormal=True, correlation="markov")
    centre = corners.mean(axis=1)
    assert strength[clay] == pytest.approx((24e3 + 2e3 * (3.0 - centre[:, 1])) * field(centre), rel=1e-9)
    embankment.weaken(site, model, 1.5)
    assert model.laws[p.material[clay][0]] in site.weaker_laws(1.5)
    assert model.parameter("cohesion")[clay] == pytest.approx(strength[clay], rel=1e-12)


def test_the_law_of_undrained_soil_keeps_its_pore_water(tmp_path):
    clay = "undrained = true\nporosity = 0.5\nmaterial = 'mohr-coulomb'\nfriction_angle = 25.0\n"
    clay += "cohesion = {value = 3e3, variation = 0.2, lengths = [5, 1]}\n"
    site = read_site(site_in(tmp_path, clay + "young = 3e6"), MPI.COMM_WORLD)
    law = site.laws[site.tags_of(["clay"])[0]]
    assert isinstance(law, mpm.Undrained) and law.porosity == 0.5
    assert isinstance(law.skeleton, mpm.Heterogeneous) and law.skeleton.varying == ["cohesion"]


@pytest.mark.parametrize("clay, message", [
    ("young = {value = 3e6, variation = 0.2, lengths = [5, 1]}", "young is a random field, expected one of cohesion"),
    ("shear_strength = {value = 3e3, variation = 0.2}", "lengths is None, expected a correlation length along each of 2 axes"),
    ("shear_strength = {value = 3e3, variation = 0.2, lengths = [5]}", r"lengths is \[5\], expected a correlation length"),
    ("shear_strength = {value = 3e3, variation = 0.2, lengths = [5, 0]}", r"lengths is \[5, 0\], expected a positive number"),
    ("shear_strength = {value = 3e3, lengths = [5, 1]}", "variation is None, expected a coefficient of variation"),
    ("shear_strength = {value = 3e3, variation = -1, lengths = [5, 1]}", "variation is -1, expected a coefficient"),
    ("cohesion = {value = 3e3, top = 3, variation = 0.1, lengths = [5, 1]}", "expected value, or value, per_metre and top"),
    ("shear_strength = {value = 3e3, variation = 0.1, lengths = [5, 1], sed = 3}", "unknown key 'sed'; did you mean seed?"),
    ("shear_strength = {value = 3e3, variation = 0.1, lengths = [5, 1], seed = 1.5}", "seed is 1.5, expected a whole number"),
    ("shear_strength = {value = 3e3, variation = 0.1, lengths = [5, 1], lognormal = 1}", "lognormal is 1, expected true or false"),
    ("shear_strength = {value = 3e3, variation = 0.1, lengths = [5, 1], correlation = 'white'}", "correlation is 'white'"),
])  # fmt: skip
def test_impossible_fields_are_refused_by_name(tmp_path, clay, message):
    with pytest.raises(mpm.InputError, match=f"soils.clay: .*{message}"):
        read_site(site_in(tmp_path, clay), MPI.COMM_WORLD)


DRAWDOWN = "--cell-size 3 --elements P1 --days 1 --factor-times 1 --no-pictures".split()


def drawn_down(folder, bank, *options):
    """How the study drawdown of its site with other keys of the bank ends, and its lowest factor of safety."""
    folder.mkdir()
    site = folder / "site.toml"
    site.write_text(f'extends = "{SITE.with_name("drawdown.toml")}"\n[soils.bank]\n{bank}\n')
    end = study_main.ended("drawdown", folder / "out", "--site", site, *DRAWDOWN, *options)
    lowest = re.search(r"lowest factor of safety ([\d.]+)", end.stdout)
    return end, float(lowest[1]) if lowest else None


def test_a_drawdown_has_the_field_with_the_strength_of_davis(tmp_path):
    fields = [
        f"cohesion = {{value = 4e3, variation = {v}, lengths = [10.0, 2.0], seed = {seed}}}"
        for v, seed in ((0.0, 1), (0.6, 1), (0.6, 2))
    ]
    found = [drawn_down(tmp_path / str(k), bank)[1] for k, bank in enumerate(["cohesion = 4e3", *fields])]
    assert found[1] == found[0] and abs(found[2] - found[3]) > 0.01


def test_a_friction_angle_that_varies_has_no_strength_of_davis(tmp_path):
    bank = "friction_angle = {value = 27.0, variation = 0.1, lengths = [10.0, 2.0]}"
    end, _ = drawn_down(tmp_path / "davis", bank)
    assert end.returncode == 2 and "friction_angle is a random field, expected --no-davis" in end.stderr
    assert drawn_down(tmp_path / "plain", bank, "--no-davis")[1] > 1


def test_studies_without_random_fields_refuse_them(tmp_path):
    site = tmp_path / "site.toml"
    site.write_text(
        f'extends = "{SITE.with_name("fill.toml")}"\n[soils.soil]\nmaterial = "tresca"\nshear_strength = {FIELD}\n'
    )
    end = study_main.ended("consolidation", tmp_path / "out", "--site", site)
    assert end.returncode == 2 and "soils.soil: cohesion is a random field; the studies safety" in end.stderr


def test_a_site_without_random_fields_has_no_picture_of_one(tmp_path):
    site = read_site(site_in(tmp_path, ""), MPI.COMM_WORLD)
    assert strength_pictures(site, site.finite_elements(1), tmp_path) == {}
