"""Mistakes that would otherwise pass in silence: each is said, with the way out."""

import warnings

import numpy as np
import pytest
from core_cases import box

import mpm_core as mpm

ELASTIC = mpm.LinearElastic(young=1e6, poisson=0.3)


def block(**options):
    model = mpm.Model(box([2, 2], body=((0.0, 0.0), (0.5, 1.0))), ELASTIC)
    model.seed(density=1000.0, per_cell=3, **options)
    return model


@pytest.mark.parametrize("scheme", ["explicit", "implicit"])
def test_a_run_that_nobody_iterates_says_so(scheme):
    model = block()
    model.fix(3)
    model.set_gravity((0.0, -10.0))
    with pytest.warns(RuntimeWarning, match=rf"Model.{scheme}\(...\) made no step.*last\(\)"):
        getattr(model, scheme)(0.01, dt=1e-3)
    assert model.steps == 0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter(
            "ignore", mpm.EnergyWarning
        )  # steps of backward Euler dissipate the wave of the sudden weight
        report = getattr(model, scheme)(0.01, dt=1e-3).last()
    assert report.time == model.time == 0.01 and report.steps == model.steps > 0


def test_a_run_without_anything_that_acts_warns():
    model = block()
    with pytest.warns(RuntimeWarning, match="nothing acts on the particles: gravity is zero.*set_gravity"):
        model.explicit(0.01).last()
    for act in (
        lambda m: (m.fix(3), m.set_gravity((0.0, -10.0))),
        lambda m: m.traction(2, (1.0, 0.0)),
        lambda m: m.prescribe(1, (1.0, 0.0)),
        lambda m: m.particles.set("velocity", np.ones((len(m.particles), 2))),
    ):
        model = block()
        act(model)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            next(iter(model.explicit(1e-4)))


def test_values_written_into_a_copy_are_refused():
    model = block()
    with pytest.raises(ValueError, match="read-only"):
        model.particles.stress[:] = -1e3
    with pytest.raises(ValueError, match="read-only"):
        model.particles[np.arange(3)].velocity[0] = 1.0
    stress = model.particles.stress.copy()
    stress[:] = -1e3
    model.particles.set("stress", stress)
    np.testing.assert_array_equal(model.particles.stress, -1e3)


@pytest.mark.parametrize(("first", "second"), [(None, None), (1, None), (None, 1), (1, 1), ((0, 1), 0)])
def test_cells_are_not_seeded_twice(first, second):
    model = block(cell_tag=first)
    count, mass = len(model.particles), model.report().mass
    with pytest.raises(mpm.InputError, match=r"cell_tag is .* hold particles already.*model.assign\(\)"):
        model.seed(density=1000.0, per_cell=1, cell_tag=second)
    assert len(model.particles) == count and model.report().mass == mass


def test_parts_with_other_tags_are_seeded_one_after_the_other():
    model = block(cell_tag=1)
    model.seed(density=1000.0, per_cell=1, cell_tag=0)
    assert model.report().mass == pytest.approx(1000.0)


SOIL = dict(young=1e6, poisson=0.3, cohesion=1e3, friction_angle=25.0)


@pytest.mark.parametrize(
    ("law", "args", "change", "words"),
    [
        (
            mpm.MohrCoulomb,
            (),
            {"frictionangle": 3.0},
            "frictionangle is no parameter of MohrCoulomb; did you mean friction_angle",
        ),
        (
            mpm.MohrCoulomb,
            (),
            {"colour": 3.0},
            r"colour is no parameter of MohrCoulomb\. MohrCoulomb has young, poisson",
        ),
        (
            mpm.MohrCoulomb,
            (5.0,),
            {},
            "MohrCoulomb got 5.0 without a name, expected parameters by name, such as young=",
        ),
        (mpm.MohrCoulomb, (), {"cohesion": "1 kPa"}, "cohesion of MohrCoulomb is '1 kPa', expected a number"),
        (mpm.LinearElastic, (), {}, "cohesion is no parameter of LinearElastic"),
    ],
)
def test_wrong_arguments_of_laws_are_named(law, args, change, words):
    with pytest.raises(mpm.InputError, match=words):
        law(*args, **{**SOIL, **change})


def test_missing_arguments_of_laws_are_named():
    with pytest.raises(mpm.InputError, match="MohrCoulomb lacks cohesion, friction_angle"):
        mpm.MohrCoulomb(young=1e6, poisson=0.3)
    peak = mpm.MohrCoulomb(**SOIL)
    with pytest.raises(mpm.InputError, match="SofteningMohrCoulomb lacks .*softening_strain"):
        mpm.SofteningMohrCoulomb(peak, residual_cohesion=1.0)
    with pytest.raises(mpm.InputError, match="SofteningMohrCoulomb lacks peak"):
        mpm.SofteningMohrCoulomb(
            residual_cohesion=1.0, residual_friction_angle=20.0, softening_strain=0.1, reference_length=1.0
        )


def test_a_mesh_of_another_kind_is_named():
    class Mesh:
        """Such as that of DOLFINx"""

    with pytest.raises(mpm.InputError, match=r"mesh is a .*Mesh, expected an mpm_core.Mesh; .*background_mesh"):
        mpm.Model(Mesh(), ELASTIC)
