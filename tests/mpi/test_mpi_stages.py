"""Stages of construction give the same on 1, 2 and 3 ranks: against sums by hand and a site on one rank."""

from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI
from stage_cases import ROLLERS, SOILS, mesh_of, site_of, weights

import fenics_bridge as bridge
import mpm_core as mpm

COMM = MPI.COMM_WORLD
POINTS = np.array([(x, y) for x in (0.5, 2.9, 3.2, 6.0) for y in (0.4, 1.7, 2.8)])
BORDER = np.array(
    [(3.0, 3.3), (3.0, 4.6), (3.0, 5.4), (0.4, 3.0), (1.7, 3.0)]
)  # of the pit, with soil on one side only


@pytest.fixture
def folder(tmp_path):
    return Path(COMM.bcast(str(tmp_path)))


def plastic(soils):
    return {
        s: mpm.MohrCoulomb(young=20e6, poisson=0.3, cohesion=12e3, friction_angle=25.0, dilation_angle=25.0)
        for s in soils
    }


def dug(folder, comm, **options):
    """Stresses and displacements after an excavation with water and load, of which one stage leaves a part to the next."""
    site = site_of(mesh_of("pit", folder, comm), plastic(SOILS["pit"]), **options)
    stages = [
        bridge.Stage(
            "in situ", fill=SOILS["pit"], unit_weight=weights(SOILS["pit"]), pore_pressure=bridge.hydrostatic(2.0)
        ),
        bridge.Stage("dig 1", excavate="pit 1", reset_displacement=True, deconfinement=0.6),
        bridge.Stage("dig 2", excavate="pit 2", pressure={"floor": 5e3}, pore_pressure=bridge.hydrostatic(1.0)),
    ]
    reports = list(bridge.carry_out(site, stages))
    smooth = site.fem.evaluate_at(np.concatenate([POINTS, BORDER]), smooth=True)
    return site.fem.evaluate_at(np.concatenate([POINTS, BORDER])) | {"smooth stress": smooth["stress"]}, reports


@pytest.mark.parametrize("options", [{"degree": 1}, {"degree": 2}, {"degree": 1, "nmd": True}])
def test_an_excavation_is_the_same_on_all_numbers_of_ranks(folder, options):
    together, reports = dug(folder, COMM, **options)
    apart = folder / f"rank {COMM.rank}"
    apart.mkdir()
    alone, expected = dug(apart, MPI.COMM_SELF, **options)
    assert (np.abs(alone["stress"]).max(axis=1) > 0).all()
    for name, values in together.items():
        assert np.allclose(values, alone[name], rtol=0, atol=1e-8 * max(np.abs(alone[name]).max(), 1e-12))
    assert [r.steps for r in reports] == [r.steps for r in expected]


def test_a_stage_that_fails_says_the_same_on_all_ranks(folder):
    laws = {soil: mpm.tresca(young=20e6, poisson=0.4, shear_strength=2e3) for soil in SOILS["pit"]}
    site = site_of(mesh_of("pit", folder), laws, ROLLERS, degree=1)
    with pytest.raises(bridge.StageError) as error:
        list(bridge.carry_out(site, [bridge.Stage("in situ", fill="ground", unit_weight={"ground": 20e3})]))
    assert len(set(COMM.allgather(str(error.value)))) == 1
    with pytest.raises(bridge.InputError, match="stage 'a': fill: no cell has the name 'sand'"):
        site.carry_out(bridge.Stage("a", fill="sand"))


def test_particles_in_stages_are_the_same_on_all_numbers_of_ranks(folder):
    apart = folder / f"rank {COMM.rank}"
    apart.mkdir()
    results = []
    for place, comm in ((folder, COMM), (apart, MPI.COMM_SELF)):
        laws = plastic(SOILS["pit"])
        model = mpm.Model(bridge.background_mesh(*mesh_of("pit", place, comm)), list(laws.values()))
        site = bridge.ParticleSite(
            model, {s: k for k, s in enumerate(laws)}, ROLLERS, tolerance=1e-8, small_displacements=True
        )
        water = bridge.hydrostatic(2.0)
        stages = [
            bridge.Stage("in situ", fill=SOILS["pit"], unit_weight=weights(SOILS["pit"]), pore_pressure=water),
            bridge.Stage("dig 1", excavate="pit 1"),
            bridge.Stage("dig 2", excavate="pit 2", pressure={"floor": 5e3}),
        ]
        list(bridge.carry_out(site, stages))
        p = model.particles
        parts = comm.allgather((p.id, p.stress))
        results.append({i: row for ids, rows in parts for i, row in zip(ids.tolist(), rows)})
    together, alone = results
    assert together.keys() == alone.keys()
    largest = max(np.abs(row).max() for row in alone.values())
    assert all(np.abs(together[i] - alone[i]).max() < 1e-8 * largest for i in alone)


def in_order(comm, ids, values):
    """Values of the particles of all ranks in the order of their numbers."""
    numbers, rows = (np.concatenate(parts) for parts in zip(*comm.allgather((ids, values))))
    return rows[np.argsort(numbers)]


K0 = dict(zip(SOILS["pit"], (1.2, 0.5, 4.0)))


def test_stresses_by_k0_are_the_same_on_all_numbers_of_ranks(folder):
    """Of finite elements with water, where K0 of a part is beyond the strength, and of particles."""
    apart = folder / f"rank {COMM.rank}"
    apart.mkdir()
    stage = bridge.Stage("in situ", fill=SOILS["pit"], unit_weight=weights(SOILS["pit"]), k0=K0,
                         pore_pressure=bridge.hydrostatic(2.0))  # fmt: skip
    values, laws = [], plastic(SOILS["pit"])
    for place, comm in ((folder, COMM), (apart, MPI.COMM_SELF)):
        mesh = mesh_of("pit", place, comm)
        fem = site_of(mesh, laws, degree=2)
        fem.carry_out(stage)
        model = mpm.Model(bridge.background_mesh(*mesh), list(laws.values()))
        numbers = {soil: number for number, soil in enumerate(laws)}
        particles = bridge.ParticleSite(model, numbers, ROLLERS, tolerance=1e-8, small_displacements=True)
        particles.carry_out(stage)
        p = model.particles
        values.append((fem.fem.evaluate_at(POINTS)["stress"], in_order(comm, p.id, p.stress)))
    for together, alone in zip(*values):
        assert np.abs(together - alone).max() < 1e-8 * np.abs(alone).max()


def test_overconsolidation_is_the_same_on_all_numbers_of_ranks(folder):
    """Of finite elements and particles, and what they do as soil is dug away; a law without memory is an error on all ranks."""
    apart = folder / f"rank {COMM.rank}"
    apart.mkdir()
    soil = mpm.HardeningSoil(
        secant_modulus=20e6, oedometer_modulus=20e6, unloading_modulus=60e6, cohesion=5e3, friction_angle=30.0
    )
    laws = dict.fromkeys(SOILS["pit"], soil)
    stages = [
        bridge.Stage("in situ", fill=SOILS["pit"], unit_weight=weights(SOILS["pit"]), k0=dict.fromkeys(SOILS["pit"], 0.8),
                     overconsolidation={"ground": 3.0, "pit 2": 1.5}, pore_pressure=bridge.hydrostatic(2.0)),
        bridge.Stage("dig", excavate="pit 1"),
    ]  # fmt: skip
    values = []
    for place, comm in ((folder, COMM), (apart, MPI.COMM_SELF)):
        mesh = mesh_of("pit", place, comm)
        fem = site_of(mesh, laws, degree=2)
        model = mpm.Model(bridge.background_mesh(*mesh), [soil])
        particles = bridge.ParticleSite(
            model, dict.fromkeys(laws, 0), ROLLERS, tolerance=1e-8, small_displacements=True
        )
        for site in (fem, particles):
            list(bridge.carry_out(site, stages))
        p = model.particles
        found = fem.fem.evaluate_at(POINTS)
        values.append((found["state"], found["stress"], in_order(comm, p.id, p.state)))
    for together, alone in zip(*values):
        assert np.abs(together - alone).max() < 1e-7 * np.abs(alone).max()
    site = site_of(mesh_of("pit", folder), plastic(SOILS["pit"]), degree=1)
    with pytest.raises(bridge.InputError, match="'ground', whose law is MohrCoulomb, expected HardeningSoil") as error:
        site.carry_out(stages[0])
    assert len(set(COMM.allgather(str(error.value)))) == 1


def test_strength_ratios_are_the_same_on_all_numbers_of_ranks(folder):
    """Of averaged linear elements and of particles, by K0 and by the stresses of a stage; another law is an error on all ranks."""
    apart = folder / f"rank {COMM.rank}"
    apart.mkdir()
    clay = mpm.Heterogeneous(mpm.tresca(young=20e6, poisson=0.4, shear_strength=5e3), ["cohesion"])
    ratio, soils = bridge.StrengthRatio(0.3, overconsolidation=2.0), SOILS["pit"]
    stages = [
        bridge.Stage("in situ", fill=soils, unit_weight=weights(soils), k0=dict.fromkeys(soils, 0.8),
                     strength_ratio=dict.fromkeys(soils[1:], ratio), pore_pressure=bridge.hydrostatic(2.0)),
        bridge.Stage("undrained", law={"ground": clay}, strength_ratio={"ground": ratio}),
    ]  # fmt: skip
    laws = plastic(soils) | dict.fromkeys(soils[1:], clay)
    values = []
    for place, comm in ((folder, COMM), (apart, MPI.COMM_SELF)):
        mesh = mesh_of("pit", place, comm)
        fem = site_of(mesh, laws, degree=1, nmd=True)
        model = mpm.Model(bridge.background_mesh(*mesh), [laws["ground"], clay])
        numbers = {soil: int(law is clay) for soil, law in laws.items()}
        particles = bridge.ParticleSite(model, numbers, ROLLERS, tolerance=1e-8, small_displacements=True, nmd=True)
        for site in (fem, particles):
            list(bridge.carry_out(site, stages))
        p = model.particles
        values.append((fem.fem.evaluate_at(POINTS)["state"], in_order(comm, p.id, p.state)))
    for together, alone in zip(*values):
        assert alone[:, -1].max() > 10e3
        assert np.abs(together - alone).max() < 1e-7 * np.abs(alone).max()
    site = site_of(mesh_of("pit", folder), plastic(soils), degree=1)
    with pytest.raises(bridge.InputError, match="the law of the soil 'pit 1' is MohrCoulomb, expected one") as error:
        site.carry_out(stages[0])
    assert len(set(COMM.allgather(str(error.value)))) == 1
