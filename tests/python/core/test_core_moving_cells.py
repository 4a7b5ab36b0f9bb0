"""Cells that move with the body (total Lagrangian): bending, energy, what they hit, and how they begin and end."""

import numpy as np
import pytest
from core_cases import DIMS, box, by_id, run
from scipy.optimize import brentq

import mpm_core as mpm
from mpm_core import probes

ELASTIC = mpm.LinearElastic(young=200e3, poisson=0.3)
MIXED = mpm.Integration.MIXED


def block(dim, velocity=None, law=ELASTIC, per_cell=4):
    """A block in the middle of a mesh of twice its size, whose particles have the velocities that a function gives their places."""
    mesh = box([8] * dim, [2.0] * dim, body=([0.5] * dim, [1.5] * dim), shake=0.1)
    model = mpm.Model(mesh, law)
    model.seed(density=2000.0, per_cell=per_cell, cell_tag=1)
    if velocity is not None:
        model.particles.set("velocity", velocity(model.particles.position))
    return model


def spin(dim, rate):
    turn = np.zeros((dim, dim))
    turn[0, 1], turn[1, 0] = -rate, rate
    return turn


def swing(cells, per_cell=3, **options):
    """Displacement of the tip of a cantilever of 2 x 1 m over time, and the last report; as studies/verification/cantilever.py."""
    size = 1.0 / cells
    body = ([0, 2], [2, 3])
    model = mpm.Model(
        box([round(2.5 / size), round(4 / size)], [2.5, 4.0], body=body, diagonals="alternating"),
        mpm.Hencky(mpm.LinearElastic(young=5e5, poisson=0.3)),
    )
    model.seed(density=1000.0, per_cell=per_cell, cell_tag=1)
    model.fix(1)
    model.set_gravity((0, -10))
    p = model.particles
    tip = p.id[p.position[:, 0] > 1.75]
    moved, energies = [], []
    for report in model.explicit(1.32, every=0.02, energy_limit=None, **options):
        moved.append(p.displacement[p.find(tip), 1].mean())
        energies.append((report.unexplained_energy, report.external_work))
    unexplained, work = np.array(energies).T
    return np.array(moved), np.abs(unexplained).max() / work.max(), report


# --- Bending --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("per_cell", [1, 3, 12])
def test_a_beam_swings_back_with_few_particles_in_a_cell(per_cell):
    # An elastic beam on which gravity acts at once returns to where it was. Quadratic finite elements give 1.027 m and 0.012 m
    # (studies/verification/cantilever.py). On cells that stay 12 particles in each bring it to 1.06 m and back to 0.18 m only.
    moved, unexplained, report = swing(16, per_cell, moving_cells=True)
    assert moved.min() == pytest.approx(-1.027, rel=0.02)
    assert moved[np.argmin(moved) :].max() == pytest.approx(0.012, abs=0.005)
    assert unexplained < 1e-3


def test_finer_cells_change_a_swinging_beam_by_little():
    lowest = [swing(cells, 3, moving_cells=True)[0].min() for cells in (4, 8, 16)]
    first, second = np.abs(np.diff(lowest))
    assert second < first / 2 and second < 0.03 * abs(lowest[-1])


def hung(cells, **options):
    """A bar of 1 m that hangs at rest under its weight, and how far the particles in its lowest cells have moved down."""
    size = 1.0 / cells
    body = ([0.25, 1.0], [0.5, 2.0])
    model = mpm.Model(
        box([round(0.75 / size), 2 * cells], [0.75, 2.0], body=body),
        mpm.Hencky(mpm.LinearElastic(young=80e3, poisson=0.0)),
    )
    model.seed(density=2000.0, per_cell=3, cell_tag=1)
    model.fix(4)
    model.set_gravity((0, -10))
    run(model, 4.0, damping=0.75, energy_limit=None, **options)
    p = model.particles
    return model, -p.displacement[p.initial_position[:, 1] < 1 + size, 1].mean()


@pytest.mark.parametrize("cells", [8, 16, 32])
def test_a_bar_that_hangs_stretches_as_it_should_on_any_mesh(cells):
    # Poisson's ratio 0: E ln(l) / l = rho_0 g (1 - X) at the distance X from the top, where l is the stretch, 1.43 at the top.
    x = (np.arange(1000) + 0.5) / 1000
    stretch = np.array([brentq(lambda s: 80e3 * np.log(s) / s - 2000.0 * 10 * (1 - at), 1, np.e) for at in x])
    lowest = 1 - 0.5 / cells  # middle of the lowest cells
    expected = (stretch[x < lowest] - 1).sum() / 1000
    model, elongation = hung(cells, moving_cells=True)
    assert stretch[0] == pytest.approx(1.43, abs=0.01)
    assert elongation == pytest.approx(expected, rel=0.01)
    assert model.report().is_quasi_static(2e-3)


# --- Identities -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("dim", DIMS)
def test_particles_stay_where_they_are_in_their_cells(dim):
    # Shape functions at particles do not change, however the block turns, rings and flies.
    gradient = np.random.default_rng(1).normal(size=(dim, dim))
    model = block(dim, lambda x: 0.3 + (x - 1) @ (spin(dim, 2.0) + 0.3 * gradient).T)
    p = model.particles
    cells = by_id(model, "cell")

    def shape_values():
        corners = model.node_positions[model.mesh.cells[p.cell]]
        edges = np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2)
        values = np.linalg.solve(edges, (p.position - corners[:, 0])[..., None])[..., 0]
        return values[np.argsort(p.id)]

    before = shape_values()
    run(model, 0.2, moving_cells=True)
    assert np.abs(p.displacement).max() > 0.1
    np.testing.assert_array_equal(by_id(model, "cell"), cells)
    np.testing.assert_allclose(shape_values(), before, atol=1e-11)


@pytest.mark.parametrize("integration", [mpm.Integration.PARTICLES, MIXED])
@pytest.mark.parametrize("dim", DIMS)
def test_a_tumbling_block_keeps_momentum_and_energy(dim, integration):
    model = block(dim, lambda x: 0.3 + (x - 1) @ spin(dim, 1.0).T)
    mass = model.particles.mass
    momentum = mass @ model.particles.velocity
    report = run(model, 0.5, courant=0.3, moving_cells=True, integration=integration)
    np.testing.assert_allclose(model.particles.mass @ model.particles.velocity, momentum, rtol=1e-12)
    assert abs(report.unexplained_fraction) < 0.001


def test_cells_of_one_density_stay_filled():
    # With MIXED the weight V_cell / sum V_p of a cell does not change, so that no force depends on how cells are filled.
    model = block(2, lambda x: 0.2 * (x - 1) @ np.diag([1.0, -1.0]))
    run(model, 0.05, moving_cells=True, integration=MIXED)
    held = np.bincount(model.particles.cell, model.particles.volume, minlength=model.mesh.owned_cells)
    filled = held > 0
    np.testing.assert_allclose(held[filled], model.cell_volumes[filled], rtol=1e-3)


def test_axial_symmetry_moves_rings_with_their_cells():
    # A hollow cylinder that expands at v_r = c / r keeps its volume: the cells follow, and their integrals of r dA do not change.
    mesh = box([8, 2], [1.0, 0.25], place=lambda x: x + [1.0, 0.0], body=([0.0, 0.0], [2.0, 0.25]))
    model = mpm.Model(mesh, mpm.LinearElastic(young=1.0, poisson=0.0), geometry=mpm.Geometry.AXISYMMETRIC)
    model.seed(density=2000.0, per_cell=3, cell_tag=0 if not mesh.cell_tags.any() else 1)
    volumes = model.cell_volumes
    model.particles.set(
        "velocity", np.column_stack([0.1 / model.particles.position[:, 0], np.zeros(len(model.particles))])
    )
    run(model, 0.1, dt=1e-3, moving_cells=True)
    filled = np.unique(model.particles.cell)
    assert np.abs(model.particles.displacement[:, 0]).min() > 0.004
    np.testing.assert_allclose(model.cell_volumes[filled], volumes[filled], rtol=5e-3)


# --- What the cells meet, and how they begin and end ----------------------------------------------------------------


def test_a_run_ends_before_the_body_meets_the_boundary_and_goes_on_with_cells_that_stay():
    # None of the cells of a block that falls on a smooth floor has a node of the floor: it would fall through it.
    model = mpm.Model(box([8, 16], [2.0, 2.0], body=([0.5, 0.5], [1.5, 1.0])), ELASTIC)
    model.seed(density=2000.0, per_cell=4, cell_tag=1)
    model.roller(3, normal=(0, 1))
    p = model.particles
    p.set("velocity", np.broadcast_to([0.0, -2.0], p.velocity.shape))
    lowest = p.position[:, 1].min()
    with pytest.raises(
        mpm.RunError, match=r"cannot move .* the body at \(.*\) m is about to meet the boundary.*goes on from here"
    ):
        run(model, 0.5, moving_cells=True)
    assert 0.2 < model.time < 0.25 and p.position[:, 1].min() > 0
    np.testing.assert_allclose(p.position[:, 1].min(), lowest - 2 * model.time, rtol=1e-9)  # the last step is whole
    momentum = [report.momentum[1] for report in model.explicit(0.5, every=0.01)]
    assert p.position[:, 1].min() > 0 and max(momentum) > 0.3 * 2.0 * p.mass.sum()  # the floor throws it back


def test_a_run_ends_when_a_cell_is_too_distorted():
    # A layer is sheared between its base and a lid that moves: an altitude of its cells falls as 1 / sqrt(1 + gamma^2).
    model = mpm.Model(box([4, 2], [2.0, 1.0]), mpm.LinearElastic(young=1e3, poisson=0.3))
    model.seed(density=2000.0, per_cell=4)
    model.fix(3)
    model.prescribe(4, velocity=(100.0, 0.0))
    with pytest.raises(mpm.RunError, match=r"the cell around \(.*\) m has less than 0.1 of its initial altitude left"):
        run(model, 1.0, moving_cells=True, energy_limit=None)
    gamma = 100.0 * model.time / 0.5
    assert gamma > 5


def test_a_run_on_cells_that_stay_finds_particles_in_other_cells():
    model = block(2, lambda x: 0 * x + 1.0)
    run(model, 0.3, moving_cells=True)
    mass, momentum = model.particles.mass.sum(), model.particles.mass @ model.particles.velocity
    assert np.abs(model.node_positions - model.mesh.points).max() == pytest.approx(0.3)
    report = run(model, 0.31)
    np.testing.assert_array_equal(model.node_positions, model.mesh.points)
    assert report.mass == pytest.approx(mass, rel=1e-14)
    np.testing.assert_allclose(report.momentum, momentum, rtol=1e-12)
    corners = model.mesh.points[model.mesh.cells[model.particles.cell]]
    assert (model.particles.position >= corners.min(axis=1)).all() and (
        model.particles.position <= corners.max(axis=1)
    ).all()


@pytest.mark.parametrize("after", ["implicit", "seed", "equilibrate", "place", "absorb"])
def test_all_else_begins_with_the_mesh_as_it_was(after):
    model = block(2, lambda x: 0 * x + 0.1)
    run(model, 0.1, moving_cells=True)
    if after == "implicit":
        *_, _ = model.implicit(0.11, dt=0.01)
    elif after == "seed":
        model.seed_points([[0.1, 0.1]], [1e-3], density=2000.0)
    elif after == "absorb":
        with pytest.raises(mpm.InputError, match="no soil at its facets"):
            model.absorb(1)
    elif after == "place":
        model.place(model.particles.position)
    else:
        model.set_gravity((0, -1.0))
        with pytest.raises(mpm.RunError):  # nothing holds it
            model.equilibrate(max_steps=1)
    np.testing.assert_array_equal(model.node_positions, model.mesh.points)


def test_a_particle_that_would_be_outside_of_the_mesh_is_named():
    # The block fills the mesh, so that its surface is on the boundary of the mesh, which it leaves.
    model = mpm.Model(box([4, 4]), ELASTIC)
    model.seed(density=2000.0, per_cell=4)
    model.particles.set("velocity", np.broadcast_to([1.0, 0.0], model.particles.velocity.shape))
    run(model, 0.2, moving_cells=True)
    np.testing.assert_allclose(model.particles.displacement[:, 0], 0.2, rtol=1e-9)
    with pytest.raises(
        mpm.RunError, match=r"went back at t = 0\.2.*position of particle \d+ is .*outside of the mesh; extend"
    ):
        run(model, 0.21)


def test_a_run_goes_on_from_a_file_to_the_last_bit(tmp_path):
    def velocity(x):
        return (x - 1) @ spin(2, 3.0).T + np.sin(3 * x)

    first = block(2, velocity)
    run(first, 0.1, moving_cells=True)
    first.save(tmp_path / "state.h5")
    second = block(2)
    second.restore(tmp_path / "state.h5")
    np.testing.assert_array_equal(second.node_positions, first.node_positions)
    for model in (first, second):
        run(model, 0.2, moving_cells=True)
    for name in ("position", "velocity", "stress"):
        np.testing.assert_array_equal(by_id(second, name), by_id(first, name))
    second.save(tmp_path / "later.h5")
    run(second, 0.21)  # cells back in their places
    second.restore(tmp_path / "later.h5")
    np.testing.assert_array_equal(second.node_positions, first.node_positions)


# --- What is looked at, warned of and refused -----------------------------------------------------------------------


def test_probes_look_where_cells_are_now():
    # A block with the stress 1 Pa flies 0.3 m to the right: the section at 1.6 m and the point at 1.7 m were outside of it before.
    model = block(2, lambda x: 0 * x + [1.0, 0.0], law=mpm.LinearElastic(young=1e-6, poisson=0.0))
    model.particles.set("stress", np.broadcast_to([1.0, 0.0, 0.0, 0.0], model.particles.stress.shape))
    section = probes.SectionProbe(model, point=(1.6, 0.0), normal=(1, 0))
    points = probes.PointProbe(model, [[1.7, 1.0], [0.6, 1.0]])
    assert section.values()["force_normal_N"] == 0
    run(model, 0.3, dt=0.01, moving_cells=True, allow_unstable=True)
    assert section.values()["force_normal_N"] == pytest.approx(1.0, rel=0.02)  # 1 Pa over the height of 1 m
    values = list(points.values().values())[1:]  # filled fraction, velocity and stress of each point
    assert values[:3] == pytest.approx([1.0, 1.0, 0.0], abs=0.02)
    assert values[len(values) // 2] == 0


def test_parts_that_do_not_feel_each_other_are_warned_of():
    model = mpm.Model(box([8, 2], [4.0, 1.0]), ELASTIC)
    points = np.array([[0.3, 0.2], [3.3, 0.2]])
    model.seed_points(points, [0.1, 0.1], density=2000.0)
    model.set_gravity((0, -1.0))
    model.fix(3)
    with pytest.warns(RuntimeWarning, match="2 parts, between which no force acts while cells move"):
        run(model, 1e-3, moving_cells=True)


@pytest.mark.parametrize(
    "options, what",
    [
        ({"stress_update": mpm.StressUpdate.LAST}, "stress_update LAST"),
        ({"integration": mpm.Integration.DUAL_DOMAIN}, "DUAL_DOMAIN"),
        ({"reproducible": True}, "reproducible runs"),
        ({"transfer": mpm.Transfer.AFFINE}, "transfer AFFINE, expected FLIP"),
        ({"rayleigh": mpm.Rayleigh(mass=0.1)}, "rayleigh damping"),
        ({"rebalance": 1.5}, "expected None"),
        ({"moving_cells": "yes"}, "expected True or False"),
    ],
)
def test_what_moving_cells_do_not_cover_is_refused_by_name(options, what):
    with pytest.raises(mpm.InputError, match=f"moving_cells.*{what}"):
        run(block(2), 0.1, **{"moving_cells": True} | options)
