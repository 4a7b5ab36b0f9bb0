"""Bad input is refused with an error that names the argument and its value."""

import warnings

import numpy as np
import pytest
from core_cases import box, run

import mpm_core as mpm

GOOD_MESH = {
    "points": np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]),
    "cells": np.array([[0, 1, 2], [1, 3, 2]]),
    "facets": np.array([[0, 1]]),
    "facet_tags": np.array([5]),
}
TETRAHEDRON = {"points": np.vstack([np.zeros(3), np.eye(3)]), "cells": np.array([[0, 1, 2, 3]])}


def points_with(node, coordinates):
    points = GOOD_MESH["points"].copy()
    points[node] = coordinates
    return points


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"points": points_with(3, (np.nan, 1))}, "points is nan at index"),
        ({"points": points_with(3, (0.2, 0.2))}, "cells.*overlap.*inverted"),
        ({"points": points_with(3, (0.5, 0.5))}, "cells: cell 1 .*area 0"),
        ({"points": np.zeros((4, 4))}, r"points has shape \(4, 4\)"),
        ({"points": np.zeros(4)}, r"points has shape \(4,\)"),
        ({"points": np.full((4, 2), "a")}, "points has dtype"),
        ({"cells": np.array([[0, 1, 3, 2]])}, "cells has 4 nodes per cell, expected triangles"),
        ({"cells": np.array([[0.0, 1.0, 2.0]])}, "cells has dtype float64"),
        ({"cells": np.array([0, 1, 2])}, r"cells has shape \(3,\)"),
        ({"cells": np.array([[0, 1, 4]])}, "cells: node 4"),
        ({"cells": np.array([[0, 1, -1]])}, "cells: node -1"),
        ({"cells": np.array([[0, 1, 2], [1, 2, 0]])}, "cells.*overlap"),
        ({"facets": np.array([[0, 3]])}, "facets.*not a facet"),
        ({"facets": np.array([[0, 9]])}, "facets: node 9"),
        ({"facets": np.array([[0, 1, 2]])}, r"facets has shape \(1, 3\)"),
        ({"facet_tags": np.array([5, 6])}, "facet_tags has"),
        ({"facet_tags": np.array([0.5])}, "facet_tags has dtype"),
        ({"cell_tags": np.array([1])}, "cell_tags has 1 entries, expected 2"),
        ({"cell_owners": np.array([1, 0])}, "cell_owners: owned cell 1 comes after a ghost"),
    ],
)
def test_bad_meshes(change, words):
    mpm.Mesh(**GOOD_MESH)
    with pytest.raises(mpm.InputError, match=words):
        mpm.Mesh(**(GOOD_MESH | change))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"points": TETRAHEDRON["points"] * [1, 1, 0]}, "cells: cell 0 .*volume 0"),
        ({"cells": np.array([[0, 1, 2]])}, "cells has 3 nodes per cell, expected tetrahedra"),
        ({"points": np.where(TETRAHEDRON["points"] > 0, np.inf, 0.0)}, "points is inf"),
    ],
)
def test_bad_meshes_in_three_dimensions(change, words):
    mpm.Mesh(**TETRAHEDRON)
    with pytest.raises(mpm.InputError, match=words):
        mpm.Mesh(**(TETRAHEDRON | change))


def test_quadrilaterals_among_triangles_cannot_hide_as_tetrahedra():
    points = np.hstack([GOOD_MESH["points"], np.zeros((4, 1))])  # a plane mesh with three coordinates
    with pytest.raises(mpm.InputError, match="volume 0"):
        mpm.Mesh(points, np.array([[0, 1, 3, 2]]))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"young": 0.0}, "young = 0"),
        ({"young": -1e6}, "young = -1"),
        ({"young": np.nan}, "young = nan"),
        ({"poisson": 0.5}, "poisson = 0.5"),
        ({"poisson": -1.0}, "poisson = -1"),
        ({"cohesion": -1.0}, "cohesion = -1"),
        ({"friction_angle": 90.0}, "friction_angle = 90"),
        ({"friction_angle": -1.0}, "friction_angle = -1"),
        ({"dilation_angle": 26.0}, "dilation_angle = 26"),
        ({"dilation_angle": -1.0}, "dilation_angle = -1"),
        ({"tension_cutoff": -1.0}, "tension_cutoff = -1"),
    ],
)
def test_bad_parameters_of_laws(change, words):
    good = {"young": 1e6, "poisson": 0.3, "cohesion": 1e3, "friction_angle": 25.0, "dilation_angle": 5.0}
    mpm.MohrCoulomb(**good)
    with pytest.raises(mpm.InputError, match=words):
        mpm.MohrCoulomb(**(good | change))
    if set(change) <= {"young", "poisson"}:
        with pytest.raises(mpm.InputError, match=words):
            mpm.LinearElastic(**({"young": 1e6, "poisson": 0.3} | change))


@pytest.mark.parametrize("laws", [[], "soil", [None], [mpm.LinearElastic], 3.0])
def test_bad_laws(laws):
    with pytest.raises(mpm.InputError, match="laws "):
        mpm.Model(box([1, 1]), laws)


@pytest.fixture
def model():
    model = mpm.Model(box([2, 2]), mpm.LinearElastic(young=1e6, poisson=0.3))
    model.seed(density=2000.0, per_cell=3)
    return model


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"density": 0.0}, "density is 0.0"),
        ({"density": -1.0}, "density is -1.0"),
        ({"density": np.nan}, "density is nan"),
        ({"per_cell": 0}, "per_cell is 0"),
        ({"per_cell": 2.5}, "per_cell is 2.5"),
        ({"per_cell": True}, "per_cell is True"),
        ({"per_cell": np.nan}, "per_cell is nan"),
        ({"per_cell": "ten"}, "per_cell is ten"),
        ({"cell_tag": 7}, r"cell_tag is 7.*it has \[1\]"),
        ({"material": 1}, "material is 1"),
        ({"material": -1}, "material is -1"),
    ],
)
def test_bad_seeding(model, change, words):
    with pytest.raises(mpm.InputError, match=words):
        model.seed(**({"density": 1000.0, "per_cell": 3} | change))
    assert len(model.particles) == 3 * 8


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda m: m.fix(9), r"facet_tag is 9.*it has \[1, 2, 3, 4\]"),
        (lambda m: m.roller(9, (1, 0)), "facet_tag is 9"),
        (lambda m: m.prescribe(9, (1, 0)), "facet_tag is 9"),
        (lambda m: m.outflow(9), "facet_tag is 9"),
        (lambda m: m.roller(1, (0, 0)), "normal .*no length"),
        (lambda m: m.roller(1, (1, 0, 0)), r"normal has shape \(3,\)"),
        (lambda m: m.roller(1, (np.nan, 0)), "normal is nan"),
        (lambda m: m.prescribe(1, 2.0), r"velocity has shape \(\)"),
        (lambda m: m.prescribe(1, (0, np.inf)), "velocity is inf"),
        (lambda m: m.set_gravity((0, 0, -9.81)), "gravity has shape"),
        (lambda m: m.set_gravity((0, np.nan)), "gravity is nan"),
        (lambda m: m.set_gravity((0, -1), ramp=-1.0), "ramp is -1.0"),
    ],
)
def test_bad_supports_and_loads(model, call, words):
    with pytest.raises(mpm.InputError, match=words):
        call(model)
    run(model, 1e-3)  # and the model is as it was
    assert np.all(model.particles.velocity == 0)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"dt": 0.0}, "dt is 0.0"),
        ({"dt": -1.0}, "dt is -1.0"),
        ({"dt": np.nan}, "dt is nan"),
        ({"dt": 1.0}, "dt is 1 s, above the critical time step"),
        ({"courant": 0.0}, "courant is 0"),
        ({"courant": 1.5}, "courant is 1.5"),
        ({"courant": np.nan}, "courant is nan"),
        ({"damping": -0.1}, "damping is -0.1"),
        ({"damping": 1.0}, "damping is 1.0"),
        ({"damping": np.nan}, "damping is nan"),
        ({"pic": -0.1}, "pic is -0.1"),
        ({"pic": 1.1}, "pic is 1.1"),
        ({"every": 0.0}, "every is 0.0"),
        ({"every": -1.0}, "every is -1.0"),
        ({"until": -1.0}, "until is -1.0"),
        ({"until": np.inf}, "until is inf"),
        ({"until": np.nan}, "until is nan"),
        ({"integration": "MIXED"}, "integration is 'MIXED', expected one of Integration.PARTICLES, Integration.MIXED"),
        ({"transfer": "AFFINE"}, "transfer is 'AFFINE', expected one of Transfer.FLIP, Transfer.AFFINE"),
        ({"stress_update": 0}, "stress_update is 0, expected one of StressUpdate"),
        ({"until": "1"}, "until is '1' s, expected a time"),
        ({"courant": "half"}, "courant is 'half', expected a positive number"),
        ({"damping": "0.5"}, "damping is '0.5', expected a number"),
        ({"pic": None}, "pic is None, expected a number"),
        ({"nmd": "no"}, "nmd is 'no', expected True or False"),
        ({"reproducible": 2}, "reproducible is 2, expected True or False"),
        ({"watch": 3}, "watch is 3, expected a function"),
    ],
)
def test_bad_run_options(model, change, words):
    with pytest.raises(mpm.InputError, match=words):
        run(model, **({"until": 1.0} | change))
    assert (model.time, model.report().steps) == (0.0, 0)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"integration": "MIXED"}, "integration is 'MIXED', expected one of Integration"),
        ({"quasi_static": "yes"}, "quasi_static is 'yes', expected True or False"),
        ({"nmd": None}, "nmd is None, expected True or False"),
        ({"ghost": 0.1}, "ghost is 0.1, expected a GhostPenalty or None"),
        ({"solver": "newton"}, "solver is 'newton', expected a Newton or a Relaxation"),
        ({"watch": "yes"}, "watch is 'yes', expected a function"),
    ],
)
def test_bad_options_of_implicit_runs(model, change, words):
    with pytest.raises(mpm.InputError, match=words):
        model.implicit(1.0, dt=0.1, **change)
    assert (model.time, model.report().steps) == (0.0, 0)


def test_a_model_without_particles_does_not_run():
    with pytest.raises(mpm.InputError, match="no particles"):
        run(mpm.Model(box([1, 1]), mpm.LinearElastic(young=1e6, poisson=0.3)), 1.0)


@pytest.mark.parametrize(
    ("name", "values", "words"),
    [
        (
            "position",
            np.zeros((24, 2)),
            "'position', which cannot be set, expected one of velocity.*; Model.place moves",
        ),
        ("plastic_strain", np.zeros(24), "'plastic_strain', which cannot be set, expected one of .*state"),
        ("stres", np.zeros((24, 4)), "'stres', which does not exist, expected one of velocity, stress, "),
        ("stress", np.zeros((24, 3)), r"stress has shape \(24, 3\), expected \(24, 4\)"),
        ("stress", np.zeros((23, 4)), r"stress has shape \(23, 4\)"),
        ("velocity", np.zeros(24), r"velocity has shape \(24,\)"),
        ("velocity", np.zeros((24, 2), dtype=complex), "velocity has dtype complex128"),
        ("volume", np.full(24, "1"), "volume has dtype"),
        ("mass", [np.inf] * 24, "mass is inf at index"),
    ],
)
def test_bad_particle_fields(model, name, values, words):
    with pytest.raises(mpm.InputError, match=words):
        model.particles.set(name, values)


@pytest.mark.parametrize("name", ["mass", "volume"])
@pytest.mark.parametrize("value", [0.0, -1.0])
def test_a_mass_or_volume_that_is_not_positive_is_refused_by_the_run(name, value):
    # In soil with cohesion, whose default integration asks for the number of particles that fill a cell.
    model = mpm.Model(box([2, 2]), mpm.tresca(young=1e6, poisson=0.3, shear_strength=1e3))
    model.seed(density=2000.0, per_cell=3)
    model.particles.set(name, np.full(24, value))
    for steps in (lambda: run(model, 1e-3), lambda: list(model.implicit(1e-3, dt=1e-3)), model.equilibrate):
        with warnings.catch_warnings(), pytest.raises(mpm.InputError, match="mass and volume of particle .* positive"):
            warnings.simplefilter("ignore")
            steps()


def test_bad_questions(model):
    with pytest.raises(mpm.InputError, match="'velocity' exist only after a step or a report"):
        model.nodal("velocity")
    run(model, 1e-3)
    with pytest.raises(mpm.InputError, match="nodal field is 'pressure'"):
        model.nodal("pressure")
    with pytest.raises(mpm.InputError, match=r"points has shape \(2,\)"):
        model.mesh.cells_of([0.5, 0.5])
    with pytest.raises(mpm.InputError, match="points is nan"):
        model.mesh.cells_of([[0.5, np.nan]])


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (lambda model: model.fix(None), "facet_tag is None, expected a number or a name"),
        (lambda model: model.fix(1.5), "facet_tag is 1.5, expected a number or a name"),
        (lambda model: model.roller([5, None], (1, 0)), r"facet_tag is \[5, None\], expected a number or a name"),
        (
            lambda model: model.seed(density=1.0, material="clay"),
            "material is 'clay', expected 0 to 0, the number of a law",
        ),
        (
            lambda model: model.add_contact(mpm.Disc((0.5, 9.0), 1.0), body=mpm.FreeBody(mass=1.0, axes=True)),
            "axes is True, expected 2 times True or False",
        ),
    ],
)
def test_what_is_no_tag_no_number_and_no_list_is_named(wrong, words):
    model = mpm.Model(mpm.Mesh(**GOOD_MESH), mpm.LinearElastic(young=1e6, poisson=0.2))
    model.seed(density=1000.0, per_cell=3)
    with pytest.raises(mpm.InputError, match=words):
        wrong(model)


def test_an_unknown_field_is_answered_with_those_that_there_are():
    model = mpm.Model(mpm.Mesh(**GOOD_MESH), mpm.LinearElastic(young=1e6, poisson=0.2))
    model.seed(density=1000.0, per_cell=3)
    model.add_field("strength", unit="Pa", meaning="Shear strength")
    with pytest.raises(AttributeError, match="'speed', which does not exist, expected one of .* strength, .* velocity"):
        model.particles.to_dataframe("position", "speed")
