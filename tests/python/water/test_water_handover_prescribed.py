"""From finite elements under prescribed pore pressures to particles: as pore water, in undrained soil, or as forces of seepage."""

import warnings

import numpy as np
import pytest
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water

SOIL = mpm.MohrCoulomb(young=2e7, poisson=0.3, cohesion=6e3, friction_angle=28.0)
UNDRAINED = mpm.Undrained(SOIL, water_modulus=2e8, porosity=0.4)
WEIGHT, WATER = 20e3, 9810.0
SUPPORTS = [bridge.fixed(bridge.BASE), bridge.roller(bridge.LEFT, (1, 0))]


def bank(pore_pressure, *, nmd=False):
    """A bank 4 m high in equilibrium under pore pressures, and the tags of its background mesh."""
    background = bridge.slope_mesh(MPI.COMM_WORLD, height=4.0, angle=45.0, crest=4.0, cell_size=0.5)
    body, _, facets = bridge.soil_mesh(*background)
    fem = bridge.QuasiStatic(body, SOIL, facets, SUPPORTS, degree=1, nmd=nmd)
    fem.reconfigure(pore_pressure=pore_pressure)
    fem.solve(bridge.Load(unit_weight=WEIGHT))
    assert fem.converged
    return fem, background


def particles(background, law):
    model = mpm.Model(bridge.background_mesh(*background), law)
    model.seed(density=WEIGHT / 9.81, per_cell=3, cell_tag=bridge.SOIL)
    bridge.apply_supports(model, SUPPORTS)
    model.set_gravity((0.0, -9.81))
    return model


def below_two_metres(x):
    """Seepage towards the toe, which the water table reaches, with suction above it."""
    return WATER * (2.0 - 0.25 * x[:, 0] - x[:, 1])


def handed_over(model, fem, **options):
    """The hand-over and the warnings of it."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        result = bridge.initialise(model, fem, **options)
    return result, [str(one.message) for one in caught if "the finite elements carry" in str(one.message)]


@pytest.fixture(scope="module")
def seeping():
    return bank(below_two_metres)


def test_undrained_particles_take_total_stresses_and_the_pressures_of_the_elements(seeping):
    fem, background = seeping
    model = particles(background, UNDRAINED)
    result, said = handed_over(model, fem)
    assert result.unbalanced_ratio < 1e-10 and said == []
    p, pressure = model.particles, model.state("excess_pore_pressure")
    effective = p.stress + pressure[:, None] * np.array([1.0, 1.0, 1.0, 0.0])
    np.testing.assert_allclose(effective, fem.evaluate_at(p.position)["stress"], atol=1e-3)
    centre = model.mesh.points[model.mesh.cells[p.cell]].mean(axis=1)  # pressures are means of cells, as stresses are
    np.testing.assert_allclose(pressure, below_two_metres(centre), atol=1e-6 * WATER)
    model.explicit(0.1).last()  # nothing happens
    assert np.abs(model.particles.velocity).max() < 1e-8


def test_pore_water_of_particles_takes_the_pressures_of_the_elements(seeping):
    fem, background = seeping
    model = particles(background, SOIL)
    model.add_water(porosity=0.4, conductivity=1e-9)
    result, said = handed_over(model, fem)
    assert result.unbalanced_ratio < 1e-9 and said == []
    p = model.particles
    np.testing.assert_allclose(p.pore_pressure, below_two_metres(p.position), atol=1e-6 * WATER)
    np.testing.assert_allclose(p.stress, fem.evaluate_at(p.position)["stress"], atol=1e-3)
    np.testing.assert_allclose(p.pressure_gradient, np.tile([-0.25 * WATER, -WATER], (len(p), 1)), rtol=1e-9)


def test_forces_of_seepage_keep_drained_particles_in_equilibrium():
    """Without suction, whose pull at the surface acts on the particles next to it."""

    def positive(x):
        return np.maximum(below_two_metres(x), 0.0)

    fem, background = bank(positive)
    model = particles(background, SOIL)
    model.particles.set("traction", bridge.seepage_forces(model, positive))
    result, said = handed_over(model, fem)
    assert result.unbalanced_ratio < 1e-10 and said == []


def test_averaged_strains_change_the_balance_of_undrained_particles_by_little():
    # Averages of total mean stresses differ from those of effective ones by the curvature of the pore pressure, and at the boundary
    fem, background = bank(below_two_metres, nmd=True)
    model = particles(background, UNDRAINED)
    result, _ = handed_over(model, fem)
    assert result.equilibrated_ratio < 5e-4 and result.yielded_fraction == 0
    pressure = model.state("excess_pore_pressure")
    centre = model.mesh.points[model.mesh.cells[model.particles.cell]].mean(axis=1)
    assert np.abs(pressure - below_two_metres(centre)).max() < 0.1 * 4.0 * WATER


def test_particles_that_take_no_pore_pressures_are_named_with_remedies(seeping):
    fem, background = seeping
    result, said = handed_over(particles(background, SOIL), fem, equilibrate=False)
    assert result.unbalanced_ratio > 0.05 and len(said) == 1
    assert (
        "carry pore pressure, which" in said[0] and "Model.add_water" in said[0] and "bridge.seepage_forces" in said[0]
    )


def test_water_on_the_surface_has_to_be_given_to_particles():
    """Under a reservoir of 1.5 m particles need its pressure on their surface: `stand_water` gives it."""
    fem, background = bank(bridge.hydrostatic(1.5))
    said = handed_over(particles(background, UNDRAINED), fem, equilibrate=False)[1]
    assert len(said) == 1 and "pressure of water that stands on the surface" in said[0]
    model = particles(background, SOIL)
    model.add_water(porosity=0.4, conductivity=1e-9, drained_surface=True)
    model.stand_water(1.5)
    assert handed_over(model, fem, equilibrate=False)[1] == []


def test_the_skeleton_must_be_the_law_of_the_elements(seeping):
    fem, background = seeping
    other = mpm.MohrCoulomb(young=2e7, poisson=0.3, cohesion=7e3, friction_angle=28.0)
    with pytest.raises(mpm.InputError, match="cohesion=6000.0, that of material 0 has cohesion=7000.0"):
        bridge.initialise(particles(background, mpm.Undrained(other, water_modulus=2e8, porosity=0.4)), fem)


def test_water_without_pore_pressures_in_the_elements_is_refused():
    domain, _, tags = bridge.box_mesh(MPI.COMM_WORLD, (1.0, 1.0), (2, 2))
    fem = bridge.QuasiStatic(domain, SOIL, tags, [bridge.fixed(3)], degree=1)
    fem.solve(bridge.Load(unit_weight=1e3))
    model = mpm.Model(bridge.background_mesh(domain, None, tags), SOIL)
    model.seed(density=2000.0, per_cell=3)
    model.add_water(porosity=0.4, conductivity=1e-8)
    with pytest.raises(
        mpm.InputError, match="fem is a QuasiStatic without pore pressures, expected a QuasiStatic with them"
    ):
        bridge.initialise(model, fem)


def test_seepage_through_a_bank_leads_to_particles_at_rest():
    """Pressures of a steady flow, of which the elements take the linear interpolation at their nodes."""
    background = bridge.slope_mesh(MPI.COMM_WORLD, height=4.0, angle=45.0, crest=4.0, cell_size=0.5)
    body, _, facets = bridge.soil_mesh(*background)
    silt = water.PorousSoil(1e-6, porosity=0.4, retention=water.VanGenuchten(alpha=1.5e-4, n=2.0))
    flow = water.Seepage(body, silt, facets, [water.Head(bridge.LEFT, 3.0), water.SeepageFace(bridge.SLOPE)])
    flow.solve()
    fem, background = bank(flow.pore_pressure())
    model = particles(background, UNDRAINED)
    result, said = handed_over(model, fem)
    assert result.unbalanced_ratio < 1e-9 and said == []


def test_suction_that_is_prescribed_is_refused_where_particles_may_dry(seeping):
    """It would be taken for the whole suction, while prescribed pressures act as they are: S_e p would act, and water be missing."""
    model = particles(seeping[1], SOIL)
    model.add_water(
        porosity=0.4, conductivity=1e-9, retention=water.VanGenuchten(alpha=1e-4, n=2.0), drained_surface=True
    )
    with pytest.raises(mpm.InputError, match="fem is a QuasiStatic with suction of up to .* have retention curves"):
        bridge.initialise(model, seeping[0])
    fem, background = bank(lambda x: np.maximum(below_two_metres(x), 0.0))
    model = particles(background, SOIL)
    model.add_water(
        porosity=0.4, conductivity=1e-9, retention=water.VanGenuchten(alpha=1e-4, n=2.0), drained_surface=True
    )
    assert bridge.initialise(model, fem, equilibrate=False).unbalanced_ratio < 1e-9


def above(model, height):
    """Number 1 for particles of cells above a height, else 0."""
    centres = model.mesh.points[model.mesh.cells].mean(axis=1)
    return (centres[model.particles.cell, 1] > height).astype(int)


def test_drained_soil_above_the_water_table_stays_drained():
    fem, background = bank(lambda x: np.maximum(below_two_metres(x), 0.0))
    model = particles(background, [UNDRAINED, SOIL])
    model.assign(above(model, 2.0))
    result, said = handed_over(model, fem)
    assert result.unbalanced_ratio < 1e-10 and said == []
    pressure = model.state("excess_pore_pressure")
    assert np.isnan(pressure[model.particles.material == 1]).all() and np.nanmax(pressure) > 15e3


def test_drained_soil_under_pore_pressures_is_refused_beside_undrained_soil(seeping):
    fem, background = seeping
    model = particles(background, [UNDRAINED, SOIL])
    model.assign(above(model, 1.0))
    with pytest.raises(
        mpm.InputError, match=r"materials \[1\] are not Undrained, but there are pore pressures of .* Pa in fem"
    ):
        bridge.initialise(model, fem)
    assert not model.particles.stress.any()
