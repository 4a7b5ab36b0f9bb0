"""Stages of construction by quasi-static particles: the same list of stages as for finite elements."""

import numpy as np
import pytest
from mpi4py import MPI
from stage_cases import POISSON, ROLLERS, SOILS, elastic, mesh_of, oedometer, site_of, weights

import fenics_bridge as bridge
import mpm_core as mpm


def particle_site(mesh, laws, more=(), supports=ROLLERS, geometry=None, **options):
    model = mpm.Model(bridge.background_mesh(*mesh), [*laws.values(), *more], geometry=geometry)
    return bridge.ParticleSite(model, {soil: k for k, soil in enumerate(laws)}, supports, **options)


def plastic(soils):
    return {
        s: mpm.MohrCoulomb(young=20e6, poisson=0.3, cohesion=9e3, friction_angle=25.0, dilation_angle=25.0)
        for s in soils
    }


IN_SITU = bridge.Stage("in situ", fill=SOILS["pit"], unit_weight=weights(SOILS["pit"]))
WORKS = [
    bridge.Stage("dig", excavate="pit 1"),
    bridge.Stage("water", pore_pressure=bridge.hydrostatic(3.0)),
    bridge.Stage("deeper", excavate="pit 2", pore_pressure=bridge.hydrostatic(2.0)),
    bridge.Stage("fill", fill="pit 2", unit_weight={"pit 2": 22e3}, release="right", support=bridge.fixed("right")),
]


@pytest.mark.parametrize("geometry", [None, bridge.Geometry.AXISYMMETRIC])
@pytest.mark.parametrize("laws", [elastic, plastic])
def test_particles_that_keep_their_places_have_the_stresses_of_the_finite_elements(tmp_path, laws, geometry):
    """With the same cells both are the same equations: linear triangles, one stress in each; of a trench or of a shaft."""
    mesh, soils = mesh_of("pit", tmp_path), SOILS["pit"]
    works = WORKS if laws is elastic else WORKS[:3]
    fem = site_of(mesh, laws(soils), degree=1, first_step=1.0, geometry=geometry)
    particles = particle_site(mesh, laws(soils), geometry=geometry, small_displacements=True, tolerance=1e-8)
    for stage in [IN_SITU, *works]:
        fem.carry_out(stage)
        particles.carry_out(stage)
        p = particles.model.particles
        expected = fem.fem.evaluate_at(p.position)["stress"]
        assert np.allclose(p.stress, expected, rtol=0, atol=1e-8 * np.abs(expected).max())
    assert laws is elastic or p.plastic_strain.max() > 1e-5


@pytest.mark.parametrize("geometry", [None, bridge.Geometry.AXISYMMETRIC])
def test_particles_that_keep_their_places_count_the_displacement_of_the_finite_elements(tmp_path, geometry):
    """With the same cells both are the same equations: displacements are linear in each triangle, also from a reset on."""
    mesh, soils = mesh_of("pit", tmp_path), SOILS["pit"]
    dig = bridge.Stage("dig", excavate="pit 1", reset_displacement=True)
    fem = site_of(mesh, plastic(soils), degree=1, first_step=1.0, geometry=geometry)
    site = particle_site(mesh, plastic(soils), geometry=geometry, small_displacements=True, tolerance=1e-8)
    for stage in [IN_SITU, dig, bridge.Stage("deeper", excavate="pit 2")]:
        fem.carry_out(stage)
        report, p = site.carry_out(stage), site.model.particles
        expected = fem.fem.evaluate_at(p.position)["displacement"]
        largest = np.linalg.norm(expected, axis=1).max()
        assert np.allclose(p.displacement, expected, rtol=0, atol=1e-7 * largest)
        assert report.largest_displacement == pytest.approx(largest, rel=1e-6)


def test_tetrahedra_are_filled_by_default():
    """A layer on rollers settles by gamma (H z - z^2 / 2) / M in each of its points, up to linear elements."""
    domain, cells, facets = bridge.box_mesh(MPI.COMM_WORLD, [1.0, 1.0, 4.0], [1, 1, 16])
    normals = {1: (1, 0, 0), 2: (1, 0, 0), 3: (0, 1, 0), 4: (0, 1, 0), 5: (0, 0, 1)}
    soil, supports = elastic(["ground"])["ground"], [bridge.roller(tag, normal) for tag, normal in normals.items()]
    site = bridge.ParticleSite(
        mpm.Model(bridge.background_mesh(domain, cells, facets), soil), {1: 0}, supports, small_displacements=True
    )
    site.carry_out(bridge.Stage("in situ", fill=1, unit_weight={1: 20e3}))
    p = site.model.particles
    z = p.position[:, 2]
    expected = -20e3 * (4 * z - z**2 / 2) / oedometer("ground")
    assert np.allclose(p.displacement[:, 2], expected, rtol=0, atol=2e-3 * np.abs(expected).max())


def test_layers_settle_as_by_hand(tmp_path):
    """Stiff enough that the particles' own motion changes nothing: 1 % of the sum of one-dimensional compressions."""
    mesh, soils = mesh_of("column", tmp_path), SOILS["column"]
    site = particle_site(mesh, elastic(soils), per_cell=6)
    reports = list(bridge.carry_out(site, [bridge.Stage(s, fill=s, unit_weight=weights([s])) for s in soils]))
    p = site.model.particles
    top = p.displacement[site.rows_of("ground") & (p.initial_position[:, 1] > 2.9), 1]
    assert len(top) > 0
    height = p.initial_position[site.rows_of("ground") & (p.initial_position[:, 1] > 2.9), 1]
    load = 18e3 * 1 + 16e3 * 2
    expected = (load * height + 20e3 * (3 * height - height**2 / 2)) / oedometer("ground")
    assert np.allclose(-top, expected, rtol=0.01)
    assert [r.name for r in reports] == list(soils)
    assert p.mass.sum() * 9.81 == pytest.approx(20e3 * 3 + 18e3 + 16e3 * 2)


def test_a_pressure_compresses_the_ground_below_it(tmp_path):
    site = particle_site(mesh_of("column", tmp_path), elastic(SOILS["column"]), small_displacements=True)
    stages = [bridge.Stage("ground", fill="ground", unit_weight={"ground": 1.0}),
              bridge.Stage("load", pressure={"surface": 50e3})]  # fmt: skip
    list(bridge.carry_out(site, stages))
    p = site.model.particles
    assert p.traction.sum(axis=0) == pytest.approx((0, -50e3), abs=1e-6)
    low = p.position[:, 1] < 1.5  # below the cells whose particles carry the load
    assert np.allclose(p.stress[low, 1], -50e3, rtol=0.01)
    assert np.allclose(p.stress[low, 0], -50e3 * POISSON / (1 - POISSON), rtol=0.05)
    site.carry_out(bridge.Stage("away", pressure={"surface": 0.0}))
    assert np.allclose(site.model.particles.stress, 0, atol=20)


def test_another_law_takes_over(tmp_path):
    laws, stiff = elastic(SOILS["column"]), mpm.LinearElastic(young=200e6, poisson=POISSON)
    site = particle_site(mesh_of("column", tmp_path), laws, [stiff])
    site.carry_out(bridge.Stage("ground", fill="ground", unit_weight={"ground": 20e3}))
    site.carry_out(bridge.Stage("stiff", law={"ground": stiff}, reset_displacement=True))
    assert set(site.model.particles.material) == {3}
    site.carry_out(bridge.Stage("heavier", unit_weight={"ground": 40e3}))
    p = site.model.particles
    expected = 20e3 * (3 * p.initial_position[:, 1] - p.initial_position[:, 1] ** 2 / 2) / (10 * oedometer("ground"))
    assert np.allclose(-p.displacement[:, 1], expected, rtol=0.02, atol=1e-6)
    with pytest.raises(bridge.InputError, match="'soft': law: .* is not among the laws that the model was made with"):
        site.carry_out(bridge.Stage("soft", law={"ground": mpm.LinearElastic(young=1e6, poisson=0.3)}))


def test_mistakes_are_named(tmp_path):
    mesh = mesh_of("pit", tmp_path)
    site = particle_site(mesh, elastic(SOILS["pit"]))
    with pytest.raises(bridge.InputError, match="stage 'a': fill: .*'sand'.*pit 1"):
        site.carry_out(bridge.Stage("a", fill="sand", unit_weight={"ground": 1.0}))
    with pytest.raises(bridge.InputError, match="unit_weight: the soil 'ground' has none"):
        site.carry_out(bridge.Stage("a", fill="ground"))
    with pytest.raises(bridge.InputError, match="prescribes a displacement"):
        particle_site(mesh, elastic(SOILS["pit"]), supports=[bridge.prescribed("base", (0.0, 0.1))])
    with pytest.raises(bridge.InputError, match=r"chosen has shape \(2,\)"):
        site.model.remove(np.zeros(2, dtype=bool))


def test_a_cut_that_does_not_stand_is_a_stage_error(tmp_path):
    soft = mpm.tresca(young=20e6, poisson=0.4, shear_strength=2e3)
    site = particle_site(mesh_of("pit", tmp_path), dict.fromkeys(SOILS["pit"], soft), small_displacements=True)
    k0 = bridge.Stage("in situ", fill=SOILS["pit"], unit_weight=dict.fromkeys(SOILS["pit"], 20e3),
                      stress=lambda x: bridge.k0_stress(x, 6.0, 20e3, 1.0))  # fmt: skip
    site.carry_out(k0)
    with pytest.raises(
        bridge.StageError, match=r"stage 2 \('dig'\) has no equilibrium of the particles.*more strength"
    ) as e:
        site.carry_out(WORKS[0])
    assert 0 < e.value.fraction < 1  # where the steps find no way any more depends on round-off


def test_removed_particles_are_gone_and_the_others_stay(tmp_path):
    site = particle_site(mesh_of("pit", tmp_path), elastic(SOILS["pit"]))
    site.carry_out(IN_SITU)
    p, model = site.model.particles, site.model
    gone = p.position[:, 0] < 3
    kept = dict(zip(p.id[~gone].tolist(), p.stress[~gone].tolist()))
    assert model.remove(gone) == MPI.COMM_WORLD.allreduce(int(gone.sum())) > 0
    assert dict(zip(model.particles.id.tolist(), model.particles.stress.tolist())) == kept


def test_values_of_a_parameter_need_particles(tmp_path):
    """Before the stage that places the soil they would be lost; after it the particles have them."""
    varying = mpm.Heterogeneous(elastic(["ground"])["ground"], ["young"])
    site = particle_site(mesh_of("pit", tmp_path), {"ground": varying}, small_displacements=True)
    with pytest.raises(mpm.InputError, match="values of 'young' are for particles, of which the model has none"):
        site.model.set_parameter("young", 8e6)
    site.carry_out(bridge.Stage("in situ", fill="ground", unit_weight=weights(["ground"])))
    site.model.set_parameter("young", 8e6)
    assert np.allclose(site.model.parameter("young"), 8e6)


def test_one_of_several_sides_of_a_support_is_released(tmp_path):
    """Particles at "sides" of which one goes are held as by a support at the other alone."""
    domain, cell_tags, facet_tags = mesh_of("pit", tmp_path)
    names = bridge.names_of(facet_tags)
    bridge.name_tags(facet_tags, {**names, "sides": names["left"] + names["right"]})
    soils, stresses = SOILS["pit"], []
    for supports in (ROLLERS, [bridge.roller("sides", (1, 0)), bridge.fixed("base")]):
        options = {"supports": supports, "small_displacements": True, "tolerance": 1e-8}
        site = particle_site((domain, cell_tags, facet_tags), elastic(soils), **options)
        list(bridge.carry_out(site, [IN_SITU, bridge.Stage("free", release="right")]))
        stresses.append(site.model.particles.stress)
    assert np.allclose(*stresses, rtol=0, atol=1e-7 * np.abs(stresses[0]).max())


@pytest.mark.parametrize("load", [{"pressure": {"right": 5e3}}, {"pore_pressure": bridge.hydrostatic(2.0)}])
def test_loads_on_resting_cells_are_refused_until_they_are_particles(tmp_path, load):
    """Resting cells carry no forces: a stage that would load some changes nothing, and is carried out once they are converted."""
    soils, stresses = SOILS["pit"][:1], []
    stage = bridge.Stage("load", **load, release="right")
    for rests in (False, True):
        site = particle_site(mesh_of("pit", tmp_path), elastic(soils), small_displacements=True, tolerance=1e-8)
        site.carry_out(bridge.Stage("in situ", fill=soils, unit_weight=weights(soils)))
        if rests:
            site.model.rest()
            before = site.model.particles.stress
            with pytest.raises(
                mpm.InputError, match=rf"'load': {next(iter(load))} would load [1-9]\d* resting cells.*convert"
            ):
                site.carry_out(stage)
            assert np.array_equal(site.model.particles.stress, before) and site.number == 1
            site.model.convert()
        site.carry_out(stage)
        p = site.model.particles
        stresses.append(p.stress[np.lexsort(p.position.T)])
    assert np.allclose(*stresses, rtol=0, atol=1e-6 * np.abs(stresses[0]).max())


def test_a_layer_in_cells_that_other_soil_has_moved_into_is_refused(tmp_path):
    """Such as ground that heaved below a cut; nothing of the stage is done then."""
    soils = SOILS["column"]
    site = particle_site(mesh_of("column", tmp_path), elastic(soils))
    p = site.model.particles
    site.carry_out(bridge.Stage("in situ", fill=["ground"], unit_weight=weights(["ground"])))
    heaved = p.position.copy()
    heaved[np.argmax(heaved[:, 1]), 1] = 3.1
    site.model.place(heaved)
    place, displacement = p.position, p.displacement
    layer = bridge.Stage("layer", fill=["layer 2", "layer 1"], unit_weight=weights(soils), reset_displacement=True)
    with pytest.raises(bridge.InputError, match="stage 'layer': fill: .* moved into 1 cells of the soil 'layer 1'"):
        site.carry_out(layer)
    assert np.array_equal(p.position, place) and np.array_equal(p.displacement, displacement) and site.number == 1
    site.model.remove(p.position[:, 1] > 3.0)
    site.carry_out(layer)
    assert len(site.rows_of("layer 1").nonzero()[0]) > 0
