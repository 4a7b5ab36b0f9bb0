"""The schedule of fields: what Python, files and checkpoints know of particles follows from one list."""

import h5py
import numpy as np
import pytest
from core_cases import DIMS, box
from mpm_core.output import ModelOutput

import mpm_core as mpm

SOIL = mpm.MohrCoulomb(young=1e6, poisson=0.3, cohesion=1e3, friction_angle=20.0)


def moving(dim):
    """Soil that changes cells soon, with a field of its own: where each particle was at the start, and a number."""
    model = mpm.Model(box([6] * dim, body=([0.0] * dim, [0.5] * dim)), SOIL)
    model.add_field("origin", unit="m", meaning="Position at the start", components=dim)
    model.seed(density=1500.0, per_cell=4, cell_tag=1)
    model.add_field("strength", unit="Pa", meaning="Undrained shear strength", initial=5e3)
    model.particles.set("origin", model.particles.position)
    model.particles.set("velocity", np.full((len(model.particles), dim), 2.0))
    return model


@pytest.mark.parametrize("dim", DIMS)
def test_an_added_field_stays_with_its_particles(dim):
    model = moving(dim)
    start = dict(zip(model.particles.id.tolist(), model.particles.position.tolist(), strict=True))
    list(model.explicit(0.1))
    particles = model.particles
    assert model._core.sorts > 1 and particles.displacement.min() > 0.1  # more than a cell: the order has changed
    np.testing.assert_array_equal(particles.origin, [start[number] for number in particles.id.tolist()])
    np.testing.assert_array_equal(particles.strength, np.full(len(particles), 5e3))
    np.testing.assert_array_equal(particles[[3, 1]].origin, particles.origin[[3, 1]])
    assert model.remove(particles.position[:, 0] < 0.3) > 0
    np.testing.assert_array_equal(particles.origin, [start[number] for number in particles.id.tolist()])


def test_an_added_field_goes_through_a_checkpoint(tmp_path):
    model = moving(2)
    list(model.explicit(0.05))
    model.save(tmp_path / "state.h5")
    other = mpm.Model(box([6, 6], body=([0, 0], [0.5, 0.5])), SOIL)
    other.restore(tmp_path / "state.h5")
    for each in (model, other):
        list(each.explicit(0.1))
    for name in ("id", "origin", "strength", "position", "stress"):
        np.testing.assert_array_equal(getattr(model.particles, name), getattr(other.particles, name))
    assert other.particles.schedule() == model.particles.schedule()


def test_a_checkpoint_without_an_added_field_is_refused_by_its_name(tmp_path):
    model = mpm.Model(box([2, 2]), SOIL)
    model.seed(density=1500.0, per_cell=3)
    model.save(tmp_path / "state.h5")
    model.add_field("strength", unit="Pa", meaning="Undrained shear strength")
    with pytest.raises(mpm.RunError, match="/particles/strength"):
        model.restore(tmp_path / "state.h5")


def test_an_added_field_is_written_to_frames(tmp_path):
    model = moving(2)
    with ModelOutput(model, particles=tmp_path / "particles", particle_fields=["origin", "strength"]) as output:
        output.write()
    with h5py.File(next((tmp_path / "particles").glob("*.h5"))) as file:
        np.testing.assert_allclose(file["origin"][:, :2], model.particles.position, rtol=1e-6)
        np.testing.assert_array_equal(np.ravel(file["strength"]), np.full(len(model.particles), 5e3, np.float32))


@pytest.mark.parametrize("dim", DIMS)
def test_each_field_of_the_schedule_is_an_attribute_with_its_meaning(dim):
    model = moving(dim)
    model.traction(1, [1.0] * dim)
    model.rest(where=lambda x: x[:, 0] > 0.4)
    model.add_water(porosity=0.4, conductivity=1e-6)
    model._core.split_phases()  # the water's own mass and velocity, which explicit runs give it
    model.particles.set("saturation", np.ones(len(model.particles)))  # where soil may dry
    for field in model.particles.schedule():
        values = getattr(model.particles, field["name"])
        assert values.shape in ((len(model.particles),), (len(model.particles), field["components"]))
        assert field["unit"] and field["meaning"]
        attribute = vars(mpm.Particles).get(field["name"])
        if attribute is not None:
            assert field["meaning"] in attribute.__doc__ and f"[{field['unit']}]" in attribute.__doc__
        if field["settable"]:
            new = values + 1.0
            if field["name"] == "traction":  # resting cells carry none
                new[model.particles.is_resting] = 0.0
            model.particles.set(field["name"], new)
            np.testing.assert_array_equal(getattr(model.particles, field["name"]), new)
        else:
            with pytest.raises(mpm.InputError, match=f"'{field['name']}', which cannot be set"):
                model.particles.set(field["name"], values + 1.0)


@pytest.mark.parametrize(
    "arguments, message",
    [
        ({"name": "volume"}, "'volume', which"),
        ({"name": "single"}, "'single', which an attribute"),
        ({"name": "two words"}, "'two words', expected letters"),
        ({"name": "x", "components": 0}, "components of the field x are 0"),
        ({"name": "x", "components": 1.5}, "components is 1.5"),
        ({"name": "x", "initial": np.nan}, "initial is nan"),
    ],
)
def test_a_field_that_cannot_be_is_refused(arguments, message):
    model = mpm.Model(box([2, 2]), SOIL)
    with pytest.raises(mpm.InputError, match=message):
        model.add_field(**{"unit": "-", "meaning": "", **arguments})
    assert not hasattr(model.particles, "x")


def test_the_table_of_the_docs_has_each_field_of_the_schedule():
    from mpm_core.particles import field_table

    schedule = moving(3).particles.schedule()
    rows = field_table(schedule).splitlines()[2:]
    assert [row.split("`")[1] for row in rows] == [field["name"] for field in schedule]
    assert "| `strength` | Pa | 1 | Undrained shear strength | yes |" in rows
