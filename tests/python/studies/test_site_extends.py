"""Files of sites that extend others."""

from pathlib import Path

import pytest
import study_main  # noqa: F401
from common.site.keys import read_site_table
from common.site.laws import idle_doubt, law_at
from common.site.tables import MOST_FILES, site_files

from mpm_core import InputError

BASE = """
mesh = "ground.geo"
cell_size = 2.0
[soils.clay]
unit_weight = 17e3
cohesion = {value = 10e3, per_metre = 1e3, top = 0.0}
[soils.sand]
unit-weight = 19e3
python_law = "law.py:Sand"
[[stages]]
name = "in situ"
"""


def written(path, text):
    path.parent.mkdir(exist_ok=True)
    path.write_text(text)
    return path


@pytest.fixture
def base(tmp_path):
    return written(tmp_path / "base" / "site.toml", BASE)


def test_values_of_tables_change_one_by_one_and_files_stay_beside_the_base(tmp_path, base):
    variant = written(tmp_path / "dry" / "site.toml", """
        extends = "../base/site.toml"
        cell_size = 1.0
        [soils.clay]
        cohesion = {value = 20e3}
        [soils.sand]
        unit_weight = 20e3
        [boundaries.top]
        rain = 5.0
    """)  # fmt: skip
    table, folder = read_site_table(variant), base.parent.resolve()
    assert table["soils"] == {
        "clay": {"unit_weight": 17e3, "cohesion": {"value": 20e3, "per_metre": 1e3, "top": 0.0}},
        "sand": {"unit_weight": 20e3, "python_law": f"{folder}/law.py:Sand"},
    }
    assert Path(table["mesh"]) == folder / "ground.geo"
    assert (table["cell_size"], table["boundaries"], table["stages"]) == (
        1.0,
        {"top": {"rain": 5.0}},
        [{"name": "in situ"}],
    )
    assert "extends" not in table and read_site_table(base)["mesh"] == "ground.geo"


def test_lists_are_replaced_as_a_whole(tmp_path, base):
    variant = written(
        tmp_path / "site.toml", f'extends = "{base}"\n[[stages]]\nname = "one"\n[[stages]]\nname = "two"\n'
    )
    assert [stage["name"] for stage in read_site_table(variant)["stages"]] == ["one", "two"]


def test_a_variant_of_a_variant_is_one_of_the_base(tmp_path, base):
    first = written(tmp_path / "first.toml", 'extends = "base/site.toml"\n[soils.clay]\nunit_weight = 16e3\n')
    second = written(tmp_path / "second.toml", 'extends = "first.toml"\ncell_size = 0.5\n')
    table = read_site_table(second)
    assert (table["cell_size"], table["soils"]["clay"]["unit_weight"]) == (0.5, 16e3)
    assert site_files(second) == [second, first, base.parent.parent / "base" / "site.toml"]


@pytest.mark.parametrize("text, expected", [
    ("extends = 3", "extends is 3, expected the file of a site"),
    ('extends = "none.toml"', "cannot read the site .*none.toml: No such file"),
    ('extends = "base/site.toml"\n[soils.clay]\ncohesoin = 1.0', "site.toml: soils.clay: unknown key 'cohesoin'"),
    ('extends = "site.toml"', f"expected at most {MOST_FILES} files that extend one another"),
])  # fmt: skip
def test_mistakes_are_named(tmp_path, base, text, expected):
    variant = written(tmp_path / "site.toml", text)
    with pytest.raises(InputError, match=expected):
        read_site_table(variant)


def test_a_wrong_key_is_that_of_the_file_that_has_it(tmp_path, base):
    base.write_text(BASE.replace("unit_weight", "unit_wieght"))
    variant = written(tmp_path / "variant.toml", 'extends = "base/site.toml"\n')
    with pytest.raises(InputError, match=r"base/site.toml: soils.clay: unknown key 'unit_wieght'"):
        read_site_table(variant)


def test_one_strength_takes_the_place_of_the_other(tmp_path):
    """Otherwise the cohesion of a variant, or of a sweep, would have no effect on clay with a shear strength."""
    path = tmp_path / "site.toml"
    path.write_text(
        f'extends = "{Path(__file__).parents[3] / "meshes" / "embankment.toml"}"\nsoils.clay.cohesion = 5e3\n'
    )
    clay = read_site_table(path)["soils"]["clay"]
    assert clay["cohesion"] == 5e3 and "shear_strength" not in clay
    other = tmp_path / "other.toml"
    other.write_text('extends = "site.toml"\nsoils.clay.shear_strength = 7e3\n')
    clay = read_site_table(other)["soils"]["clay"]
    assert clay["shear_strength"] == 7e3 and "cohesion" not in clay


def test_two_strengths_of_one_soil_are_refused():
    with pytest.raises(InputError, match="soils.clay has cohesion and shear_strength, expected one of them"):
        law_at({"young": 5e6, "cohesion": 5e3, "shear_strength": 7e3}, None, "soils.clay")


def test_another_law_leaves_out_what_has_no_effect_on_it(tmp_path, base):
    """But not what the file that names the law gives itself, of which a warning says so."""
    variant = written(tmp_path / "variant.toml", """
        extends = "base/site.toml"
        [soils.clay]
        material = "elastic"
        young = 3e6
        [soils.sand]
        material = "hardening-soil"
        poisson = 0.3
    """)  # fmt: skip
    assert read_site_table(variant)["soils"] == {
        "clay": {"unit_weight": 17e3, "material": "elastic", "young": 3e6},
        "sand": {"unit_weight": 19e3, "material": "hardening-soil", "poisson": 0.3},
    }


def test_a_law_that_comes_back_has_its_parameters_again(tmp_path, base):
    """As in a sweep of the material of a variant."""
    base.write_text(BASE.replace("[soils.clay]", "[soils.clay]\nyoung = 4e6"))
    written(tmp_path / "first.toml", 'extends = "base/site.toml"\nsoils.clay.material = "hardening-soil"\n')
    second = written(tmp_path / "second.toml", 'extends = "first.toml"\nsoils.clay.material = "mohr-coulomb"\n')
    assert "young" not in read_site_table(tmp_path / "first.toml")["soils"]["clay"]
    assert read_site_table(second)["soils"]["clay"]["young"] == 4e6


@pytest.mark.parametrize("table, words", [
    ({"material": "hardening-soil", "young": 2e7, "poisson": 0.3, "cohesion": 1e3},
     "young and poisson have no effect with the law hardening-soil"),
    ({"viscosity": 1e3, "cohesion": 1e3}, "viscosity has no effect with the law mohr-coulomb"),
    ({"material": "elastic", "shear_strength": 1e3}, "shear_strength has no effect with the law elastic"),
    ({"material": "tresca", "properties": [1.0]}, "properties has no effect with the law tresca"),
    ({"young": 2e7, "umat": "law.so", "properties": [1.0], "material": "tresca"}, "material has no effect with the law umat"),
    ({"young": 2e7, "python_law": "law.py:Sand"}, "young has no effect with the law python_law"),
    ({"young": 2e7, "water_modulus": 1e8}, "water_modulus has no effect with the law mohr-coulomb that is not undrained"),
])  # fmt: skip
def test_keys_without_effect_are_named(table, words):
    assert idle_doubt(table, "soils.clay") == f"soils.clay: {words}"


@pytest.mark.parametrize("table", [
    {"young": 2e7, "poisson": 0.3, "cohesion": 1e3, "friction_angle": 30.0, "porosity": 0.4, "finite_strain": True},
    {"material": "hardening-soil", "secant_modulus": 3e7, "undrained": True, "water_modulus": 1e8},
    {"material": "tresca", "shear_strength": 1e3, "young": 2e7},
    {"young": 2e7, "poisson": 0.3, "umat": "law.so", "properties": [1.0]},
])  # fmt: skip
def test_keys_with_an_effect_are_not_named(table):
    assert idle_doubt(table, "soils.clay") == ""
