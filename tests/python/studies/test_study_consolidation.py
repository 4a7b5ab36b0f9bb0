"""The study consolidation: its site files and messages, and ground that is at rest or settles far."""

import json
import warnings
from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI
from study_main import ended, main

from mpm_core import InputError

STUDIES = Path(__file__).parents[3] / "studies"
SITE = (STUDIES.parent / "meshes" / "fill.toml").read_text()


@pytest.mark.parametrize(
    "old, new, words",
    [
        ("conductivity = 1e-9", "conductivity = 0.0", "soils.soil: conductivity is 0.0"),
        ("porosity = 0.5", "porosity = 1.5", "soils.soil: porosity is 1.5"),
        ("unit_weight = 17e3", "", "soils.soil has no unit_weight"),
        ("young = 3e6", "youngs = 3e6", "soils.soil: .*youngs"),
        ('axis = "roller"', 'axis = "slides"', "supports.axis is 'slides'"),
        ("[10.0, 20e3]", "[0.0, 20e3]", "pressures.footing: day 0 comes after day 0, .*rising days"),
        ("[10.0, 20e3]", "[10.0, nan]", "pressures.footing is .*expected finite numbers"),
        ("[10.0, 20e3]", "[10.0, -20e3]", "pressures.footing is -20000 Pa, expected at least 0: a pressure pushes"),
        ("[10.0, 20e3]", "[10.0]", "pressures.footing is .*expected a number or rows"),
        (
            "footing = [[0.0, 0.0]",
            "nowhere = [[0.0, 0.0]",
            "pressures.nowhere: no boundary of the mesh .* has the name 'nowhere'; it has ",
        ),
        ("middle = [0.0, 0.0]", "middle = [0.0]", r"points.middle is .*expected \[x, y\]"),
        ("[points]", "[places]", "unknown key 'places'"),
        (
            "edge = [2.0, 0.0]",
            "edge = [2.0, 1.0]",
            r"site.toml: points.edge is \[2.0, 1.0\], expected a place in the mesh",
        ),
    ],
)
def test_a_wrong_site_is_named(old, new, words, tmp_path):
    from common.consolidation.site import read_consolidation_site

    from fenics_bridge import water

    assert old in SITE
    path = tmp_path / "site.toml"
    path.write_text(SITE.replace(old, new).replace('"footing.geo"', f'"{STUDIES.parent}/meshes/footing.geo"'))
    with pytest.raises(InputError, match=words):
        read_consolidation_site(path, MPI.COMM_SELF).at_rest(water.Element.STABILISED)


@pytest.mark.parametrize(
    "old, new, words",
    [
        ("conductivity = 1e-9", "conductivity = [1e-9, 8.64]", "soils.soil: conductivity is 8.64 m/s, more than that of gravel"),
        ("[boundaries.footing]\nreservoir = 0.5", "[boundaries.footing]\nreservoir = [[0.0, 0.5], [1.0, 100.0]]",
         "the reservoir of 'footing' is 100 m, 100 m above the top of the mesh, which is 6 m high"),
        ("conductivity = 1e-9", "conductivity = 0.5",
         "soils.soil: conductivity is 0.5 m/s, that of rock fill or clean coarse gravel; conductivities are in m/s, and 0.5 m/day are 5.79e-06 m/s"),
        ("conductivity = 1e-9", "conductivity = 0.09", ""),
        ("[boundaries.footing]\nreservoir = 0.5", "[boundaries.footing]\nreservoir = 18.0", ""),  # deep water
        ("[10.0, 20e3]", "[10.0, 20.0]", "pressures.footing is 20 Pa, less than under 0.1 m of soil: 20 kPa are 20e3"),
    ],
)  # fmt: skip
def test_values_that_are_probably_mistakes_are_said(old, new, words, tmp_path):
    from common.consolidation.site import read_consolidation_site

    assert old in SITE
    path = tmp_path / "site.toml"
    path.write_text(SITE.replace(old, new).replace('"footing.geo"', f'"{STUDIES.parent}/meshes/footing.geo"'))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        read_consolidation_site(path, MPI.COMM_SELF, 2.0)
    assert len(caught) == bool(words) and all(words in str(one.message) for one in caught)


RAMP = "footing = [[0.0, 0.0], [10.0, 20e3]]"


@pytest.mark.parametrize(
    "old, new, days, changes",
    [
        (RAMP, RAMP, 3.0, True),
        (RAMP, "footing = 20e3", 3000.0, False),
        (RAMP, "footing = [[5.0, 20e3]]", 3000.0, False),  # one row holds before it and after it
        (RAMP, "footing = [[0.0, 20e3], [10.0, 20e3]]", 3000.0, False),
        (RAMP, "footing = [[-1.0, 0.0], [0.0, 20e3]]", 3000.0, False),  # over at the beginning
        (RAMP, "footing = [[50.0, 0.0], [60.0, 20e3]]", 40.0, False),  # begins after the end
        (RAMP, "footing = [[50.0, 0.0], [60.0, 20e3]]", 55.0, True),
        (RAMP, "footing = [[0.0, 0.0], [1.0, 20e3], [2.0, 0.0]]", 3.0, True),  # as at the beginning again
        ("reservoir = 0.5  #", "reservoir = [[0.0, 0.5], [1.0, 1.0]]  #", 3.0, True),
    ],
)
def test_ground_in_which_nothing_changes_is_known(old, new, days, changes, tmp_path):
    from common.consolidation.site import read_consolidation_site

    assert SITE.count(old) == 1 and SITE.count(RAMP) == 1
    still = SITE if old == RAMP else SITE.replace(RAMP, "footing = 0.0")
    path = tmp_path / "site.toml"
    path.write_text(still.replace(old, new).replace('"footing.geo"', f'"{STUDIES.parent}/meshes/footing.geo"'))
    assert read_consolidation_site(path, MPI.COMM_SELF, 2.0).changes_until(86400.0 * days) == changes


@pytest.mark.parametrize("pressure, words", [("footing=20e3", 1), ("footing=0:0,1:20e3", 0)])
def test_ground_in_which_nothing_changes_is_said(pressure, words, tmp_path, without_pictures):
    options = ["--cell-size", 2, "--days", 1, "--first-step", 1, "--pressures", pressure, "--output", tmp_path / "out"]
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        assert main("consolidation", options) == 0
    assert sum("nothing changes within 1 days" in str(one.message) for one in caught) == words
    settled = json.loads((tmp_path / "out" / "summary.json").read_text())["settlement_middle_m"]
    assert (abs(settled) < 1e-9) == bool(words)


@pytest.mark.parametrize("options, words", [([], 0), (["--first-step", 0.25], 1)])
def test_cells_that_are_too_large_for_the_first_step_are_said(options, words, tmp_path, without_pictures):
    """The cells of 0.15 m under the fill are 0.13 m high, by which soil consolidates in the half day of the first step."""
    import consolidation
    from common.option_words import in_options

    run = ended("consolidation", tmp_path, "--days", 2, "--no-film", *options)
    assert run.returncode == 0
    assert run.stderr.count("the cells at the drained boundary 'footing'") == words
    assert in_options(run.stderr, consolidation.parser()).count("Take a longer --first-step, 0.") == words


def test_ground_that_fails_right_after_a_frame_is_not_drawn_twice(tmp_path, monkeypatch, without_pictures):
    import consolidation

    drawn = []
    monkeypatch.setattr(consolidation.Files, "_picture", lambda files: drawn.append(files._model.time / 86400.0))
    options = ["--cell-size", 2, "--days", 4, "--first-step", 0.5, "--frames", 2, "--no-film"]
    run = ended("consolidation", tmp_path, *options, "--pressures", "footing=0:0,2:1e3,2.00000001:2e6")
    assert run.returncode != 0 and "no equilibrium was found from 2 days on" in run.stdout + run.stderr
    assert drawn == [pytest.approx(2.0)]


@pytest.mark.parametrize(
    "dilation, reason, doubted",
    [(0, "residual 1e-7", True), (25, "residual 1e-7", False), (0, "it collapses: soil would move by 9 m", False)],
)
def test_steps_that_end_by_newtons_method_are_not_said_to_be_failure_of_the_ground(dilation, reason, doubted, tmp_path):
    import consolidation
    from common.consolidation.site import read_consolidation_site

    path, old = tmp_path / "site.toml", "friction_angle = 25.0"
    assert old in SITE
    text = SITE.replace(old, f"{old}\ndilation_angle = {dilation}.0")
    path.write_text(text.replace('"footing.geo"', f'"{STUDIES.parent}/meshes/footing.geo"'))
    said = consolidation.without_equilibrium(read_consolidation_site(path, MPI.COMM_SELF, 2.0), 2 * 86400.0, reason)
    assert said.startswith("no equilibrium was found from 2 days on") and reason in said
    assert ("where 'soil' yields, whose dilation angle is below its friction angle" in said) == doubted
    assert ("as where ground fails under its load" in said) != doubted


def test_particles_take_no_other_water_than_reservoirs(tmp_path):
    from common.consolidation.site import read_consolidation_site

    from fenics_bridge import water

    path = tmp_path / "site.toml"
    site = SITE.replace("[boundaries.footing]\nreservoir", "[boundaries.footing]\nhead")
    path.write_text(site.replace('"footing.geo"', f'"{STUDIES.parent}/meshes/footing.geo"'))
    ground = read_consolidation_site(path, MPI.COMM_SELF)
    with pytest.raises(InputError, match="boundary has Head.*expected reservoirs only for particles"):
        ground.particles(ground.at_rest(water.Element.STABILISED), 3)


@pytest.mark.parametrize("dilation", [0.0, 25.0])
@pytest.mark.parametrize("nmd", [False, True])
def test_particles_begin_at_rest(dilation, nmd, tmp_path):
    """Also in soil that does not dilate, of which elements and particles average strains and forces by half."""
    from common.consolidation.site import read_consolidation_site
    from common.water.wet_particles import SmallMotion

    from fenics_bridge import water

    path = tmp_path / "site.toml"
    site = SITE.replace("friction_angle = 25.0", f"friction_angle = 25.0\ndilation_angle = {dilation}")
    site = site.replace("[[0.0, 0.0], [10.0, 20e3]]", "0.0").replace("cell_size = 0.15", "cell_size = 1.0")
    path.write_text(site.replace('"footing.geo"', f'"{STUDIES.parent}/meshes/footing.geo"'))
    ground = read_consolidation_site(path, MPI.COMM_SELF)
    fem = ground.at_rest(water.Element.STABILISED, nmd)
    model = ground.particles(fem, 3, nmd)
    assert model.out_of_balance(nmd=nmd) < 1e-9
    there = fem.evaluate_at(model.particles.position)["pressure"][:, 0]
    np.testing.assert_allclose(model.particles.pore_pressure, there, rtol=0, atol=1e-9 * there.max())
    motion = SmallMotion(model, nmd)
    list(motion.advance(86400.0, 86400.0))
    assert np.abs(motion.moved).max() < 1e-10


@pytest.mark.parametrize(
    "word, words",
    [
        ("footing", "--pressures is 'footing', expected NAME=PA or NAME=DAYS:PA"),
        ("footing=1:2:3", "--pressures is 'footing=1:2:3'"),
        ("footing=0:0,5", "--pressures is 'footing=0:0,5'"),
        ("footing=5:0,5:1e3", "--pressures footing: day 5 comes after day 5, expected .* rising days"),
        ("footing=-20e3", "--pressures footing is -20000 Pa, expected at least 0: a pressure pushes"),
        ("footing=0:inf", "--pressures.footing is .*expected finite numbers"),
    ],
)
def test_wrong_pressures_on_the_command_line_are_named(word, words):
    from common.consolidation.stages import pressures_of

    with pytest.raises(InputError, match=words):
        pressures_of([word])


def test_the_pressure_between_smooth_plates_rises_as_mandel_says():
    """The pressure in the middle over half the load reaches 1.1555 at a time factor of 0.084 (Poisson ratio 0)."""
    from common.consolidation.site import read_consolidation_site

    from fenics_bridge import water

    site = read_consolidation_site(STUDIES.parent / "meshes" / "slab.toml", MPI.COMM_WORLD, 0.1)
    model = site.at_rest(water.Element.TAYLOR_HOOD)
    middle = np.array([[0.0, 0.0]]) if MPI.COMM_WORLD.rank == 0 else np.empty((0, 2))
    pressure = lambda: MPI.COMM_WORLD.bcast(model.evaluate_at(middle)["pressure"])[0, 0]
    start, period = pressure(), 9810.0 / (1e-9 * 1e6)
    rise = []
    for factor in (0.01, 0.084):
        assert model.run(factor * period, 1e-3 * period, 1.2)[-1].converged
        rise.append((pressure() - start) / 5e3)
    assert rise[1] == pytest.approx(1.1555, rel=0.02) and rise[0] < 1.08


@pytest.mark.parametrize("width", [0.5, 20.0])
def test_settlements_of_more_than_a_tenth_of_the_height_are_warned_of_and_are_no_collapse(tmp_path, width):
    from common.consolidation.site import read_consolidation_site

    from fenics_bridge import water

    text = f'extends = "{STUDIES.parent}/meshes/soft_clay.toml"\ncell_size = 1.0\n[soils.clay]\nconductivity = 1e-6\n[constants]\nwidth = {width}\n'
    (tmp_path / "site.toml").write_text(text)
    model = read_consolidation_site(tmp_path / "site.toml", MPI.COMM_SELF).at_rest(water.Element.TAYLOR_HOOD)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        assert model.run(86400.0 * 200, 86400.0, 1.3)[-1].converged
    found = [str(one.message) for one in said if "more than a tenth of the height of the body" in str(one.message)]
    assert len(found) == 1
    assert -model.displacement.x.array.min() > 0.5


@pytest.mark.parametrize(
    ("settlement", "title"), [(0.02, "Displacements magnified 20 times"), (1.0, "Displacements to scale")]
)
def test_pictures_of_consolidation_do_not_reduce_displacements(settlement, title):
    from common.consolidation.plots import ExcessPicture, ExcessScale
    from common.field_plots import Field

    points, cells = np.array([(0.0, 0.0), (20.0, 0.0), (20.0, 8.0), (0.0, 8.0)]), np.array([(0, 1, 2), (0, 2, 3)])
    moved = np.array([(0.0, 0.0), (0.0, 0.0), (0.0, -settlement), (0.0, -settlement)])
    scale = ExcessScale.of([ExcessPicture("After 1 day", Field(points, cells, np.full((4, 1), 1e3)), moved)])
    assert scale.enlarged == max(0.05 * 8 / settlement, 1.0)  # a twentieth of the height, or as large as it is
    assert scale.title == title


def test_a_unit_weight_in_kn_is_named_also_where_ground_at_rest_has_no_equilibrium(tmp_path):
    from common.consolidation.site import read_consolidation_site

    import mpm_core as mpm
    from fenics_bridge import water

    (tmp_path / "site.toml").write_text(
        f'extends = "{STUDIES.parent}/meshes/soft_clay.toml"\ncell_size = 1.0\n[soils.clay]\nunit_weight = 16\nattraction = 5e3\nk0 = 0.8\n'
    )
    site = read_consolidation_site(tmp_path / "site.toml", MPI.COMM_SELF)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        with pytest.raises((mpm.InputError, mpm.RunError)):
            site.at_rest(water.Element.STABILISED, nmd=True)
    assert any("the unit weight of 'clay' is 16 N/m3" in str(one.message) for one in said)
