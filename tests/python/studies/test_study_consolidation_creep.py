"""Soft clay that creeps in the study consolidation: its settlement by the logarithm of time, and by isotaches."""

import warnings
from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI

STUDIES = Path(__file__).parents[3] / "studies"


def test_soft_clay_creeps_on_when_its_water_is_out(tmp_path):
    """By creep / v times the height for each factor e of time, in `meshes/soft_clay.toml`; without creep not at all."""
    from common.consolidation.site import read_consolidation_site

    from fenics_bridge import water

    slope = {}
    for creep in (0.01, 0.0):
        text = f'extends = "{STUDIES.parent}/meshes/soft_clay.toml"\ncell_size = 1.0\n[soils.clay]\nconductivity = 1e-6\ncreep = {creep}\n'
        (tmp_path / "site.toml").write_text(text)
        site = read_consolidation_site(tmp_path / "site.toml", MPI.COMM_SELF)
        model = site.at_rest(water.Element.TAYLOR_HOOD)
        settled = []
        for days in (2e3, 2e4):
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # coarse cells, large strains
                assert model.run(86400.0 * days, 86400.0, 1.4)[-1].converged
            settled.append(-model.displacement.x.array.min())
        slope[creep] = (settled[1] - settled[0]) / np.log(10)
        volume = 2.6 * np.exp(-np.mean(settled) / 5)
    assert slope[0.01] == pytest.approx(0.01 / volume * 5, rel=0.1)  # the volume is that without creep
    assert abs(slope[0.0]) < 1e-5


def test_soft_clay_under_a_fill_settles_to_the_isotache_of_its_age(tmp_path):
    """Without water the preconsolidation pressure is p_eq (a t / day)^(creep / (lambda - kappa)) after t, a = 1 - (q / (M p))^2, and v has fallen by
    kappa ln(p / p_0) + (lambda - kappa) ln(p_c / p_c0); lateral strains are none where q / p = r has 2 r / (M^2 - r^2) = 2 / 3.
    """
    from common.consolidation.site import read_consolidation_site

    from fenics_bridge import water

    compression, swelling, creep, slope, attraction, volume = 0.26, 0.04, 0.01, 1.0, 1e3, 2.6
    (tmp_path / "site.toml").write_text(
        f'extends = "{STUDIES.parent}/meshes/soft_clay.toml"\ncell_size = 0.25\n[soils.clay]\nconductivity = 1e-7\n'
        "[pressures]\ntop = [[0.0, 5e3], [100.0, 30e3]]\n"
    )
    model = read_consolidation_site(tmp_path / "site.toml", MPI.COMM_SELF).at_rest(water.Element.TAYLOR_HOOD)
    before = (16e3 - 9810.0) * (np.arange(500) + 0.5) / 100 + 5e3  # Pa, vertical
    lateral = 1 - 3 * slope / (6 + slope)  # 1 - sin(phi) of first loading, by which the ratio of the file gives p_c

    def of(vertical, k0):
        pressure, shear = (1 + 2 * k0) / 3 * vertical + attraction, (1 - k0) * vertical
        return pressure, shear, pressure + shear**2 / (slope**2 * pressure)

    preconsolidation, start, after = of(1.3 * before, lateral)[2], of(before, 0.6)[0], before + 25e3
    ratio = (np.sqrt(9 + 4 * slope**2) - 3) / 2
    pressure, _, size = of(after, (after * (1 - ratio / 3) - ratio * attraction) / (after * (1 + 2 / 3 * ratio)))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # coarse cells, large strains
        for days in (100.0, 1e4):
            assert model.run(86400.0 * days, 86400.0, 1.3, accuracy=0.01)[-1].converged
    age = (1 - (ratio / slope) ** 2) * days
    hardened = size * age ** (creep / (compression - swelling)) / preconsolidation
    lost = swelling * np.log(pressure / start) + (compression - swelling) * np.log(hardened)
    expected = 5.0 * np.mean(-np.log(1 - lost / volume))
    assert -model.displacement.x.array.min() == pytest.approx(expected, rel=0.015), print(expected)


def test_soft_clay_settles_without_any_load(tmp_path):
    """Where its overconsolidation ratio is 1, from 1000 to 30000 days by creep / v ln(30) times the height. Such ground is not said to be at rest."""
    from common.consolidation.site import read_consolidation_site

    from fenics_bridge import water

    path = tmp_path / "site.toml"
    path.write_text(
        f'extends = "{STUDIES.parent}/meshes/soft_clay.toml"\ncell_size = 1.0\n[soils.clay]\nconductivity = 1e-6\noverconsolidation = 1.0\nk0 = 0.6\n'
        "[pressures]\ntop = 0.0\n"
    )
    site = read_consolidation_site(path, MPI.COMM_SELF)
    assert site.changes_until(86400.0)
    model, found = site.at_rest(water.Element.TAYLOR_HOOD), []
    for days in (1e3, 3e4):
        assert model.run(86400.0 * days, 86400.0, 1.2)[-1].converged
        found.append(-model.displacement.x.array.min())
    height, volume = 5.0, 2.6 * np.exp(-np.mean(found) / 5.0)
    assert found[1] - found[0] == pytest.approx(0.01 / volume * np.log(30) * height, rel=0.02)
