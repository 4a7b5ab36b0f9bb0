"""What the hand-over to particles refuses, and what it says of models that differ."""

import warnings

import numpy as np
import pytest
from bridge_cases import POISSON, YOUNG, slope_model, slope_particles
from dolfinx.mesh import compute_midpoints, meshtags
from handover_cases import UNIT_WEIGHT, solved
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm


@pytest.mark.parametrize(
    ("law", "words"),
    [
        (mpm.LinearElastic(young=YOUNG, poisson=POISSON), "fem.*MohrCoulomb.*LinearElastic"),
        (
            mpm.MohrCoulomb(young=YOUNG, poisson=POISSON, cohesion=2e3, friction_angle=25.0),
            "cohesion=1000.*cohesion=2000",
        ),
    ],
)
def test_laws_that_do_not_match_are_named(law, words):
    with pytest.raises(bridge.InputError, match=words):
        bridge.initialise(slope_particles(UNIT_WEIGHT, law=law), solved())


class Loam:
    """The Mohr-Coulomb law, called from Python, with an array among its attributes."""

    n_state = 2
    p_wave_modulus = mpm.LinearElastic(young=YOUNG, poisson=POISSON).p_wave_modulus
    strength_parameters = {"c": "strength", "phi": "friction angle"}

    def __init__(self, c, exponents=(1.0, 0.0)):
        self.c, self.phi, self.exponents = c, 25.0, np.array(exponents)

    def update(self, *points):
        strength = {"cohesion": self.c * self.exponents[0], "friction_angle": self.phi}
        mpm.MohrCoulomb(young=YOUNG, poisson=POISSON, **strength).update(*points)


def test_laws_in_python_match_by_their_code_and_values():
    """Not as objects: a factor of safety makes new ones each time."""

    def reduced(*values):
        return bridge.reduced_strength(mpm.PythonLaw(Loam(*values)), 1.05)

    body, _, facets = bridge.soil_mesh(*bridge.slope_mesh(MPI.COMM_WORLD, cell_size=0.2))
    held = [bridge.roller(bridge.LEFT, (1, 0)), bridge.fixed(bridge.BASE)]
    fem_model = bridge.QuasiStatic(body, reduced(1.2e3), facets, held, degree=1)
    fem_model.solve(bridge.Load(unit_weight=UNIT_WEIGHT))
    assert fem_model.converged
    model = slope_particles(UNIT_WEIGHT, cell_size=0.2, law=reduced(1.2e3))
    assert bridge.initialise(model, fem_model).unbalanced_ratio < 1e-8
    for values, words in (
        ((1.26e3,), r"has law=Loam\(c=1142.8.*has law=Loam\(c=1200.0"),
        ((1.2e3, (1.0, 0.1)), "has law=Loam"),
    ):
        with pytest.raises(mpm.InputError, match=words):
            bridge.initialise(slope_particles(UNIT_WEIGHT, cell_size=0.2, law=reduced(*values)), fem_model)


@pytest.mark.parametrize(
    ("weight", "said"), [(UNIT_WEIGHT, False), (0.5 * UNIT_WEIGHT, True), (1.1 * UNIT_WEIGHT, True)]
)
def test_particles_of_another_weight_are_said(weight, said):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        bridge.initialise(slope_particles(weight), solved(degree=1), equilibrate=False)
    words = f"unit weight of particles is {weight:.5g} N/m3, density times gravity, that of the finite elements {UNIT_WEIGHT:.5g} N/m3"
    assert any(words in str(one.message) for one in caught) == said


@pytest.mark.parametrize(
    ("load", "given", "said"),
    [
        ({"pressure": {4: 5e3}}, None, "pressure"),
        ({"traction": {4: (1e3, -5e3)}}, None, "traction"),
        ({"pressure": {4: 0.0}}, None, ""),
        ({"pressure": {4: 5e3}}, lambda model: model.traction(4, (0.0, -5e3)), ""),
        ({"pore_pressure": bridge.hydrostatic(1.0)}, None, "pore pressure"),
        ({"pore_pressure": lambda x: 0 * x[:, 0]}, None, ""),
        (
            {"pore_pressure": bridge.hydrostatic(1.0)},
            lambda model: model.particles.set("traction", bridge.seepage_forces(model, bridge.hydrostatic(1.0))),
            "",
        ),
        ({"displacement": 1.0}, None, "prescribed displacement at 4"),
        ({"displacement": 1.0}, lambda model: model.fix(4), ""),
        ({"displacement": 0.0}, None, ""),
    ],
)
def test_loads_that_particles_lack_are_said(load, given, said):
    """Once, with their names; particles without them are far from equilibrium."""
    domain, cell_tags, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, (1.0, 1.0), (4, 4))
    law, load = mpm.LinearElastic(young=1e7, poisson=0.3), dict(load)
    supports = [bridge.fixed(3), bridge.roller(1, (1, 0)), bridge.roller(2, (1, 0))]
    pushed = [bridge.prescribed(4, (0.0, -1e-3))] if "displacement" in load else []
    fem_model = bridge.QuasiStatic(domain, law, facet_tags, [*supports, *pushed], 1)
    if "pore_pressure" in load:
        fem_model.reconfigure(pore_pressure=load.pop("pore_pressure"))
    fem_model.solve(bridge.Load(unit_weight=20e3, **load))
    model = mpm.Model(bridge.background_mesh(domain, cell_tags, facet_tags), law)
    model.seed(density=20e3 / 9.81, per_cell=3)
    bridge.apply_supports(model, supports)
    model.set_gravity((0.0, -9.81))
    if given is not None:
        given(model)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        handover = bridge.initialise(model, fem_model, equilibrate=False)
    texts = [str(one.message) for one in caught if "the finite elements carry" in str(one.message)]
    assert [text[: len(text.split(", which")[0])] for text in texts] == (
        [f"the finite elements carry {said}"] if said else []
    )
    assert said == "" or handover.unbalanced_ratio > 0.01


def test_finite_elements_that_are_not_solved_are_refused():
    with pytest.raises(bridge.InputError, match="fem.*not been solved"):
        bridge.initialise(slope_particles(UNIT_WEIGHT), slope_model(dilation_angle=0.0))


def test_particle_outside_is_named():
    model = slope_particles(UNIT_WEIGHT)
    model.seed_points([[3.0, 0.5]], [1e-3], density=2000.0)
    with pytest.raises(bridge.InputError, match=r"particles: point .* at \(3, 0.5\) m is outside"):
        bridge.initialise(model, solved())


@pytest.mark.parametrize(
    ("make", "fields", "options", "found"),
    [
        (lambda model: model.add_contact(mpm.Plane((0.0, -0.1), (0.0, 1.0))), None, {}, "contact with .* \\(Plane\\)"),
        (lambda model: model.absorb(2), None, {}, "sides that absorb waves"),
        (lambda model: None, [0, 1], {}, "2 velocity fields"),
        (lambda model: None, None, {"integration": mpm.Integration.DUAL_DOMAIN}, "integration DUAL_DOMAIN"),
        (
            lambda model: model.absorb(2),
            [0, 0],
            {"integration": mpm.Integration.DUAL_DOMAIN},
            "sides .* and integration",
        ),
    ],
)
def test_what_equilibrate_does_not_support_is_refused_before_particles_change(make, fields, options, found):
    cells = bridge.box_mesh(MPI.COMM_WORLD, [1.0, 1.0], [4, 4])
    soil = mpm.LinearElastic(young=1e6, poisson=0.3)
    elements = bridge.QuasiStatic(cells[0], soil, cells[2], [bridge.fixed(3)], degree=1)
    elements.solve(bridge.Load(unit_weight=UNIT_WEIGHT))
    model = mpm.Model(bridge.background_mesh(*cells), [soil, soil], velocity_fields=fields)
    model.seed(density=UNIT_WEIGHT / 9.81, per_cell=3)
    model.fix(3)
    model.set_gravity((0, -9.81))
    make(model)
    with pytest.raises(mpm.InputError, match=f"equilibrate is True, expected False with {found}"):
        bridge.initialise(model, elements, **options)
    with pytest.raises(mpm.InputError, match=f"equilibrate\\(\\) does not support {found}"):
        model.equilibrate(**options)
    assert not model.particles.stress.any()
    bridge.initialise(model, elements, equilibrate=False, **options)
    assert model.particles.stress.any()


@pytest.mark.parametrize(
    "options, words", [({"nmd": "no"}, "nmd is 'no'"), ({"integration": "mixed"}, "integration is 'mixed'")]
)
def test_options_of_the_run_that_are_none_are_refused_before_particles_change(options, words):
    model = slope_particles(UNIT_WEIGHT)
    with pytest.raises(mpm.InputError, match=words):
        bridge.initialise(model, solved(degree=1), **options)
    assert not model.particles.stress.any()


def test_gravity_that_still_rises_is_refused_and_said():
    """Under the gravity at the start of a ramp, which is zero, particles would lose the stresses that they are given."""
    particles, elements = slope_particles(UNIT_WEIGHT), solved(degree=1)
    particles.set_gravity(particles.gravity, ramp=2.0)
    with pytest.raises(mpm.InputError, match=r"gravity is 0% of \[0.0, -9.81\] m/s2 at t = 0 s, and rises until 2 s"):
        bridge.initialise(particles, elements)
    particles.set_gravity(particles.gravity)
    bridge.initialise(particles, elements)
    assert particles.particles.stress[:, 1].min() < -0.7 * UNIT_WEIGHT  # the slope is 1 m high


@pytest.mark.parametrize(
    ("densities", "said"), [((1600.0, 2000.0), ""), ((800.0, 2000.0), "8000"), ((1600.0, 3000.0), "30000")]
)
def test_particles_of_another_weight_are_said_after_stages(densities, said):
    domain, _, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, (2.0, 2.0), (4, 4))
    middle = compute_midpoints(domain, 2, np.arange(domain.topology.index_map(2).size_local, dtype=np.int32))
    cell_tags = meshtags(
        domain, 2, np.arange(len(middle), dtype=np.int32), np.where(middle[:, 1] < 1, 1, 2).astype(np.int32)
    )
    bridge.name_tags(cell_tags, {"clay": 1, "fill": 2})
    soil = mpm.LinearElastic(young=20e6, poisson=0.3)
    supports = [bridge.fixed(3)]
    fem = bridge.QuasiStatic(domain, soil, facet_tags, supports, degree=1, cell_tags=cell_tags)
    weights = {"clay": 16e3, "fill": 20e3}
    list(
        bridge.carry_out(
            bridge.FemSite(fem),
            [bridge.Stage(soil, fill=[soil], unit_weight={soil: weights[soil]}) for soil in weights],
        )
    )
    model = mpm.Model(bridge.background_mesh(domain, cell_tags, facet_tags), soil)
    for name, density in zip(weights, densities):
        model.seed(density=density, per_cell=3, cell_tag=name)
    bridge.apply_supports(model, supports)
    model.set_gravity((0.0, -10.0))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        bridge.initialise(model, fem, equilibrate=False)
    found = [str(one.message) for one in caught if "unit weight of particles" in str(one.message)]
    expected = f"the unit weight of particles is {said} N/m3, density times gravity, that of the finite elements 16000 to 20000 N/m3"
    assert len(found) == bool(said) and all(text.startswith(expected) for text in found)
