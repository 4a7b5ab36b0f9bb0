"""The study consolidation: its site files, and a layer that settles as Terzaghi says."""

import csv
import json
import sys
from pathlib import Path

import numpy as np
import pytest
from consolidation_cases import layer_settled
from mpi4py import MPI

from mpm_core import InputError

STUDIES = Path(__file__).parents[3] / "studies"
sys.path.insert(0, str(STUDIES))
SITE = (STUDIES.parent / "meshes" / "fill.toml").read_text()


@pytest.mark.parametrize(
    "old, new, words",
    [
        ("conductivity = 1e-9", "conductivity = 0.0", "soils.soil: conductivity: got 0.0"),
        ("porosity = 0.5", "porosity = 1.5", "soils.soil: porosity: got 1.5"),
        ("unit_weight = 17e3", "", "soils.soil: has no unit_weight"),
        ("young = 3e6", "youngs = 3e6", "soils.soil: .*youngs"),
        ('axis = "roller"', 'axis = "slides"', "supports.axis is 'slides'"),
        ("[10.0, 20e3]", "[0.0, 20e3]", "pressures.footing: .*rising days"),
        ("footing = [[0.0, 0.0]", "nowhere = [[0.0, 0.0]", "no facet has the name 'nowhere'"),
        ("middle = [0.0, 0.0]", "middle = [0.0]", r"points.middle: .*expected \[x, y\]"),
        ("[points]", "[places]", "unknown key 'places'"),
    ],
)
def test_a_wrong_site_is_named(old, new, words, tmp_path):
    from common.consolidation_site import read_consolidation_site

    from fenics_bridge import water

    assert old in SITE
    path = tmp_path / "site.toml"
    path.write_text(SITE.replace(old, new).replace('"footing.geo"', f'"{STUDIES.parent}/meshes/footing.geo"'))
    with pytest.raises(InputError, match=words):
        read_consolidation_site(path, MPI.COMM_SELF).at_rest(water.Element.STABILISED)


def test_particles_take_no_other_water_than_reservoirs(tmp_path):
    from common.consolidation_site import read_consolidation_site

    from fenics_bridge import water

    path = tmp_path / "site.toml"
    site = SITE.replace("[boundaries.footing]\nreservoir", "[boundaries.footing]\nhead")
    path.write_text(site.replace('"footing.geo"', f'"{STUDIES.parent}/meshes/footing.geo"'))
    ground = read_consolidation_site(path, MPI.COMM_SELF)
    with pytest.raises(InputError, match="boundary: has Head.*expected reservoirs only for particles"):
        ground.particles(ground.at_rest(water.Element.STABILISED), 3)


@pytest.mark.parametrize("dilation", [0.0, 25.0])
@pytest.mark.parametrize("nmd", [False, True])
def test_particles_begin_at_rest(dilation, nmd, tmp_path):
    """Also where elements average strains only, of soil that does not dilate, and particles their forces as well."""
    from common.consolidation_site import read_consolidation_site
    from common.wet_particles import SmallMotion

    from fenics_bridge import water

    path = tmp_path / "site.toml"
    site = SITE.replace("friction_angle = 25.0", f"friction_angle = 25.0\ndilation_angle = {dilation}")
    site = site.replace("[[0.0, 0.0], [10.0, 20e3]]", "0.0").replace("near_size = 0.25", "near_size = 1.0")
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


@pytest.mark.parametrize("elements", ["P2-P1", "P1-P1"])
def test_a_layer_settles_as_terzaghi_says(elements, tmp_path):
    import consolidation

    lines = ["DefineConstant[ cell_size = 0.1 ];", "Point(1) = {0, 0, 0};", "Point(2) = {0.3, 0, 0};",
             "Point(3) = {0.3, 2, 0};", "Point(4) = {0, 2, 0};", *(f"Line({k}) = {{{k}, {k % 4 + 1}}};" for k in range(1, 5)),
             "Curve Loop(1) = {1, 2, 3, 4};", "Plane Surface(1) = {1};", 'Physical Surface("clay") = {1};',
             'Physical Curve("base") = {1};', 'Physical Curve("right") = {2};', 'Physical Curve("top") = {3};',
             'Physical Curve("left") = {4};', "Mesh.MeshSizeMax = cell_size;"]  # fmt: skip
    (tmp_path / "layer.geo").write_text("\n".join(lines) + "\n")
    young, poisson, load, k, height = 4e6, 0.25, 30e3, 1e-9, 2.0
    (tmp_path / "layer.toml").write_text(
        f'mesh = "layer.geo"\n[soils.clay]\nunit_weight = 18e3\nconductivity = {k}\nmaterial = "elastic"\nyoung = {young}\n'
        f"poisson = {poisson}\n[boundaries.top]\nreservoir = 2.0\n"
        f"[pressures]\ntop = [[0.0, 0.0], [0.001, {load}]]\n[points]\nmiddle = [0.15, 2.0]\n"
    )
    oedometer = young * (1 - poisson) / ((1 + poisson) * (1 - 2 * poisson))
    period = height**2 * 9810.0 / (k * oedometer) / 86400  # days
    folder = tmp_path / "results"
    arguments = ["--site", tmp_path / "layer.toml", "--elements", elements, "--days", period, "--first-step", 1e-3 * period,
                 "--growth", 1.1, "--frames", 2, "--particles", "--output", folder]  # fmt: skip
    assert consolidation.main([str(word) for word in arguments]) == 0
    with open(folder / "history.csv", newline="") as file:
        columns = ("time_days", "settlement_middle_m", "settlement_middle_particles_m")
        rows = [[float(row[name]) for name in columns] for row in csv.DictReader(file)]
    days, settled, by_particles = np.transpose(rows[1:])
    exact = [layer_settled(factor) for factor in days / period]
    late = days > 0.02 * period
    for found in (settled, by_particles):
        assert found[late] * oedometer / (load * height) == pytest.approx(np.array(exact)[late], abs=0.02)
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["largest_water_error_m2"] < 1e-10 * load * height / oedometer
    assert summary["largest_excess_pressure_Pa"] == pytest.approx(load, rel=0.01 if elements == "P1-P1" else 0.1)


def test_the_pressure_between_smooth_plates_rises_as_mandel_says():
    """The pressure in the middle over half the load reaches 1.1555 at a time factor of 0.084 (Poisson ratio 0)."""
    from common.consolidation_site import read_consolidation_site

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
