"""Particles that leave the mesh, values that are not numbers, runs that blow up."""

import re

import numpy as np
import pytest
from core_cases import DIMS, box, by_id, one_cell, run

import mpm_core as mpm

SOFT = mpm.LinearElastic(young=1.0, poisson=0.0)
HARD = mpm.LinearElastic(young=1e6, poisson=0.3)


def moving_block(dim):
    """A block near the high side of x that moves there with 1 m/s."""
    model = mpm.Model(box([8] * dim, body=([0.5] + [0.25] * (dim - 1), [0.875] + [0.75] * (dim - 1))), SOFT)
    model.seed(density=2000.0, per_cell={2: 3, 3: 4}[dim], cell_tag=1)
    model.particles.set("velocity", np.eye(dim)[0] * np.ones((len(model.particles), 1)))
    return model


@pytest.mark.parametrize("dim", DIMS)
def test_particles_that_pass_an_outflow_are_counted(dim):
    model = moving_block(dim)
    model.outflow(2)
    start, ids = model.report(), np.sort(model.particles.id)
    x, mass = by_id(model, "position")[:, 0], by_id(model, "mass")
    for report in model.explicit(0.6, dt=0.01, every=0.1):
        left = x + report.time > 1.0
        assert report.outflow_particles == left.sum()
        assert report.outflow_mass == pytest.approx(mass[left].sum(), rel=1e-12)
        assert report.particles == len(model.particles) == (~left).sum()
        assert report.mass + report.outflow_mass == pytest.approx(start.mass, rel=1e-12)
        assert np.array_equal(np.sort(model.particles.id), ids[~left])
        assert np.allclose(model.particles.displacement[:, 0], report.time, rtol=0, atol=1e-9)
    assert report.outflow_particles == len(x)
    assert report.particles == 0 and report.kinetic_energy == 0


@pytest.mark.parametrize("dim", DIMS)
def test_a_particle_that_leaves_elsewhere_stops_the_run_and_is_named(dim):
    model = moving_block(dim)
    model.outflow(1)
    x = by_id(model, "position")
    with pytest.raises(mpm.RunError, match="left the background mesh") as error:
        run(model, 0.6, dt=0.01)
    number = r"[-+.e\d]+"
    vector = r"\((" + ", ".join([number] * dim) + r")\)"
    pattern = rf"particle (\d+) at {vector} m with velocity {vector} m/s .* t = ({number}) s"
    particle, position, velocity, time = re.search(pattern, str(error.value)).groups()
    first = np.max(x[:, 0])
    row = int(np.searchsorted(np.sort(model.particles.id), int(particle)))
    step = np.ceil((1.0 - first) / 0.01) * 0.01
    assert x[row, 0] == pytest.approx(first, abs=1e-12)
    assert [float(c) for c in position.split(",")] == pytest.approx(x[row] + step * np.eye(dim)[0], abs=1e-5)
    assert [float(c) for c in velocity.split(",")] == pytest.approx(np.eye(dim)[0], abs=1e-5)
    assert float(time) == pytest.approx(step - 0.01)
    assert len(model.particles) == len(x)  # nobody was dropped


def test_the_place_of_a_particle_on_a_map_is_given_to_the_centimetre():
    there = np.array([351234.0, 5403030.0])
    squares = box((2, 2), (1.0, 1.0))
    model = mpm.Model(mpm.Mesh(squares.points + there, squares.cells), mpm.LinearElastic(young=1e6, poisson=0.3))
    model.seed_points([there + 0.53], [0.01], density=2000.0)
    model.particles.set("velocity", [(0.0, 1.0)])
    with pytest.raises(mpm.RunError, match=r"at \(351234\.53, 5403031\.0\d?\) m"):
        model.explicit(1.0, dt=0.01).last()


@pytest.mark.parametrize("dim", DIMS)
def test_values_that_are_not_numbers_cannot_be_set(dim):
    model = moving_block(dim)
    for name in ("velocity", "stress", "volume", "mass", "state", "deviatoric_strain"):
        values = getattr(model.particles, name).copy()
        values.reshape(-1)[3] = np.nan
        with pytest.raises(mpm.InputError, match=f"{name} is nan at index"):
            model.particles.set(name, values)
    assert np.all(np.isfinite(model.particles.velocity))


@pytest.mark.parametrize(("name", "value"), [("mass", 0.0), ("mass", -1.0), ("volume", 0.0), ("volume", -1.0)])
def test_mass_and_volume_stay_positive(name, value):
    model = moving_block(2)
    values = getattr(model.particles, name).copy()
    values[5] = value
    model.particles.set(name, values)
    with pytest.raises(mpm.InputError, match=f"mass and volume of particle {model.particles.id[5]}"):
        run(model, 0.1)


@pytest.mark.parametrize("dim", DIMS)
@pytest.mark.parametrize(
    "scheme",
    [{}, {"nmd": True}, {"stress_update": mpm.StressUpdate.LAST}, {"stress_update": mpm.StressUpdate.FIRST}],
    ids=["MUSL", "NMD", "USL", "USF"],
)
@pytest.mark.parametrize(
    "law",
    [HARD, mpm.MohrCoulomb(young=1e6, poisson=0.3, cohesion=1e3, friction_angle=30.0)],
    ids=["elastic", "Mohr-Coulomb"],
)
def test_a_run_that_blows_up_says_so(dim, scheme, law):
    model = mpm.Model(box([4] * dim), law)
    model.seed(density=2000.0, per_cell=4)
    model.particles.set("velocity", np.random.default_rng(7).uniform(-1, 1, model.particles.position.shape))
    for side in range(2 * dim):
        model.fix(side + 1)
    count = len(model.particles)
    with pytest.raises(mpm.RunError, match=r"particle \d+ at"):
        run(model, 1e3, dt=10 * model.critical_time_step(), allow_unstable=True, **scheme)
    assert len(model.particles) == count


@pytest.mark.parametrize("dim", DIMS)
def test_values_beyond_all_numbers_end_the_run_even_at_an_outflow(dim):
    model = mpm.Model(one_cell(dim), HARD)
    model.seed(density=1000.0, per_cell=1)
    for tag in range(dim + 1):
        model.outflow(tag + 1)
    model.set_gravity([1e308] * dim)
    with pytest.raises(mpm.RunError, match="nan"):
        run(model, 1e9, dt=1e9, allow_unstable=True)
