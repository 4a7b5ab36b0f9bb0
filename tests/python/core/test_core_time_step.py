"""The critical time step (16) and what is made of it."""

import numpy as np
import pytest
from core_cases import DIMS, box, moduli, run

import mpm_core as mpm

YOUNG, POISSON, DENSITY = 1e6, 0.3, 2000.0
ELASTIC = mpm.LinearElastic(young=YOUNG, poisson=POISSON)
SPEED = np.sqrt(moduli(YOUNG, POISSON)[2] / DENSITY)


def altitudes(mesh):
    """Smallest altitude of each cell: D times the volume over the largest facet."""
    corners = mesh.points[mesh.cells]
    areas = []
    for vertex in range(mesh.dim + 1):
        facet = np.delete(corners, vertex, axis=1)
        edges = facet[:, 1:] - facet[:, :1]
        gram = np.einsum("cia,cja->cij", edges, edges)
        areas.append(np.sqrt(np.linalg.det(gram)) / (1 if mesh.dim == 2 else 2))
    return mesh.dim * mesh.cell_volumes / np.max(areas, axis=0)


def soil_block(dim, law=ELASTIC, body=None):
    model = mpm.Model(box([4] * dim, shake=0.15, body=body), law)
    model.seed(density=DENSITY, per_cell=1, cell_tag=1)
    return model


def test_altitudes_of_known_cells():
    assert altitudes(box([1, 1])) == pytest.approx(np.sqrt(0.5))  # legs 1, 1 and hypotenuse sqrt 2
    # Kuhn's tetrahedron: volume 1/6, largest facet with legs 1 and sqrt 2
    assert altitudes(box([1, 1, 1])) == pytest.approx(3 / 6 / np.sqrt(0.5))


@pytest.mark.parametrize("dim", DIMS)
def test_critical_time_step_is_the_smallest_altitude_over_the_wave_speed(dim):
    model = soil_block(dim)
    assert model.critical_time_step() == pytest.approx(altitudes(model.mesh).min() / SPEED, rel=1e-12)


@pytest.mark.parametrize("dim", DIMS)
def test_only_filled_cells_and_their_own_law_and_density_count(dim):
    stiff_soil = mpm.MohrCoulomb(young=9 * YOUNG, poisson=POISSON, cohesion=1e3, friction_angle=30.0)
    model = soil_block(dim, [ELASTIC, stiff_soil], body=([0.0] * dim, [0.5] * dim))
    filled = model.mesh.cell_tags == 1
    soft = altitudes(model.mesh)[filled].min() / SPEED
    assert model.critical_time_step() == pytest.approx(soft, rel=1e-12)
    model.seed(density=4 * DENSITY, per_cell=1, cell_tag=0, material=1)
    stiff = altitudes(model.mesh)[~filled].min() / (SPEED * 3 / 2)
    assert model.critical_time_step() == pytest.approx(min(soft, stiff), rel=1e-12)


@pytest.mark.parametrize("dim", DIMS)
def test_the_cell_that_sets_the_step_is_found(dim):
    # One stiff cell somewhere: whichever it is, its h / c is far below that of the others
    stiff_soil = mpm.MohrCoulomb(young=100 * YOUNG, poisson=POISSON, cohesion=1e3, friction_angle=30.0)
    model = soil_block(dim, [ELASTIC, stiff_soil])
    soft = mpm.critical_cell(model)
    assert altitudes(model.mesh)[soft.number] == pytest.approx(altitudes(model.mesh).min(), rel=1e-12)
    number = len(model.mesh.cells) // 3
    place = model.mesh.points[model.mesh.cells[number]].mean(axis=0)
    model.seed_points(place[None] + 1e-6, [1e-3], density=DENSITY, material=1)
    found = mpm.critical_cell(model)
    assert (found.number, found.material) == (number, 1) and found.centre == pytest.approx(tuple(place))
    assert found.wave_speed == pytest.approx(10 * SPEED, rel=1e-12)
    assert found.altitude == pytest.approx(altitudes(model.mesh)[number], rel=1e-12)
    assert found.time_step == pytest.approx(found.altitude / found.wave_speed, rel=1e-12)
    assert found.time_step == pytest.approx(model.critical_time_step(), rel=1e-12)


def test_no_cell_sets_the_step_of_nothing():
    with pytest.raises(mpm.InputError, match="no particles"):
        mpm.critical_cell(mpm.Model(box([1, 1]), ELASTIC))


@pytest.mark.parametrize("dim", DIMS)
def test_default_step_is_half_the_critical_one_and_meets_the_end(dim):
    model = soil_block(dim)
    critical = model.critical_time_step()
    report = run(model, 100 * critical)
    assert report.dt == pytest.approx(0.5 * critical, rel=1e-12)
    assert (report.steps, report.time) == (200, 100 * critical)
    report = run(model, 110.1 * critical, courant=0.2)
    assert report.time == 110.1 * critical
    assert report.steps == 200 + 51  # 50.5 steps of 0.2 dt_cr: one more, each a little shorter
    assert report.dt == pytest.approx(10.1 * critical / 51, rel=1e-6)


@pytest.mark.parametrize("dim", DIMS)
def test_step_above_the_critical_one_is_refused_with_both_numbers(dim):
    model = soil_block(dim)
    critical = model.critical_time_step()
    numbers = f"dt is {1.01 * critical:.6g} s, above the critical time step {critical:.6g} s"
    with pytest.raises(mpm.InputError, match=numbers):
        run(model, 1.0, dt=1.01 * critical)
    assert (model.time, model.report().steps) == (0.0, 0)
    assert run(model, 10 * critical, dt=critical).dt == pytest.approx(critical)
    assert run(model, 20 * critical, dt=2 * critical, allow_unstable=True).steps == 15


@pytest.mark.parametrize("dim", DIMS)
def test_step_follows_the_density_during_a_run(dim):
    # A soft block that grows almost freely, v = x / t0 with t0 = 1 s: after t its density is rho / (1 + t / t0)^D.
    body = ([0.5] * dim, [1.5] * dim)
    mesh = box([8] * dim, lengths=[2.0] * dim, body=body)
    model = mpm.Model(mesh, mpm.LinearElastic(young=10.0, poisson=0.0))
    model.seed(density=DENSITY, per_cell={2: 10, 3: 10}[dim], cell_tag=1)
    model.particles.set("velocity", model.particles.position - 1.0)
    before, steps = model.critical_time_step(), 0
    for report in model.explicit(0.3, every=0.05, courant=1e-4):
        rarest = np.min(model.particles.mass / model.particles.volume)
        after = altitudes(mesh).min() * np.sqrt(rarest / 10.0)
        assert model.critical_time_step() == pytest.approx(after, rel=1e-12)
        assert after < 0.97 * before
        mean = 0.05 / (report.steps - steps)
        assert 1e-4 * after < mean < 1e-4 * before
        before, steps = after, report.steps


def test_until_and_every():
    model = soil_block(2)
    times = [report.time for report in model.explicit(0.01, every=0.004)]
    assert times == pytest.approx([0.004, 0.008, 0.01], rel=1e-12)
    assert list(model.explicit(0.01)) == []
    with pytest.raises(mpm.InputError, match="until is 0.005 s.*0.01 s"):
        run(model, 0.005)


@pytest.mark.parametrize("scheme", ["explicit", "implicit"])
def test_reports_after_a_number_of_steps(scheme):
    model = soil_block(2)
    dt = 1e-3 * model.critical_time_step()
    reports = list(getattr(model, scheme)(100 * dt, dt=dt, every_steps=45))
    assert [report.steps for report in reports] == [45, 90, 100]
    assert [report.steps for report in getattr(model, scheme)(200 * dt, dt=dt, every=40 * dt, since=0.0, every_steps=45)] == [
        120, 135, 160, 180, 200
    ]  # fmt: skip
    with pytest.raises(mpm.InputError, match="every_steps is 0, expected a whole number from 1"):
        getattr(model, scheme)(300 * dt, dt=dt, every_steps=0)
