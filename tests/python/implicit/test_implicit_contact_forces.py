"""What rigid surfaces feel and do in implicit steps: impulses, bodies at rest, adhesion, and cells that hang on one node."""

import numpy as np
import pytest
from core_cases import box

import mpm_core as mpm

SIDE = 0.05 / 3


def layer():
    """An elastic layer between smooth sides on a fixed base: 1.2 m wide and 0.4 m high."""
    model = mpm.Model(box((24, 16), (1.2, 0.8), diagonals="alternating"), mpm.LinearElastic(young=1e6, poisson=0.3))
    points = SIDE * (np.indices((72, 24)).reshape(2, -1).T + 0.5)
    model.seed_points(points, np.full(len(points), SIDE**2), density=1000.0)
    model.fix(3)
    for side in (1, 2):
        model.roller(side, (1, 0))
    model.set_gravity((0, -9.81))
    return model


@pytest.mark.parametrize("second_order", [False, True])
def test_the_impulse_of_a_surface_is_the_momentum_that_the_soil_has_lost(second_order):
    model = mpm.Model(box((20, 8), (5, 2)), mpm.LinearElastic(young=1e6, poisson=0.3))
    points = (0.4, 0.52) + (np.indices((16, 8)).reshape(2, -1).T + 0.5) / 16
    model.seed_points(points, np.full(len(points), 1 / 256), density=1000.0)
    model.particles.set("velocity", np.tile((0.0, -1.0), (len(points), 1)))
    plane = model.add_contact(mpm.Plane((0.4, 0.5), (0, 1)))
    start = np.array(model.report().momentum)
    *_, report = model.implicit(0.06, dt=4e-3, second_order=second_order)
    lost = start - np.array(report.momentum)
    assert abs(lost[1]) > 0.5 * abs(start[1])
    np.testing.assert_allclose(plane.impulse, lost, rtol=1e-9, atol=1e-9 * abs(lost[1]))


@pytest.mark.parametrize("rotates", [False, True])
def test_a_free_body_rests_after_quasi_static_steps_as_the_soil_does(rotates):
    model = layer()
    body = model.add_contact(
        mpm.Box((0.5, 0.4 + 1e-9), (0.8, 0.6)), friction=0.5, body=mpm.FreeBody(mass=300.0, rotates=rotates)
    )
    list(model.implicit(1e-3, dt=1e-3, quasi_static=True))
    assert body.displacement[1] < -1e-3  # which over the length of the step would be more than 1 m/s
    assert np.all(body.velocity == 0) and np.all(body.spin == 0) and body.kinetic_energy == 0
    assert np.all(model.particles.velocity == 0)


def test_a_rough_footing_between_walls_with_adhesion_settles_in_clay():
    """The force is above Prandtl's 2 + pi and the adhesion of the walls adds to it; without the smooth onset no step converges."""
    strength, forces = 10e3, {}
    for adhesion in (0.0, strength):
        model = mpm.Model(
            box((24, 16), (3.0, 2.0), diagonals="alternating"), mpm.tresca(young=5e6, poisson=0.49, shear_strength=strength)
        )  # fmt: skip
        side = 0.0625
        points = (np.indices((48, 24)).reshape(2, -1).T + 0.5) * side
        model.seed_points(points, np.full(len(points), side**2), density=1800.0)
        for at, normal in (((0, 0), (0, 1)), ((0, 0), (1, 0)), ((3, 0), (-1, 0))):
            model.add_contact(mpm.Plane(at, normal), adhesion=adhesion)
        model.set_gravity((0, -9.81), ramp=0.1)
        footing = model.add_contact(mpm.Box((1.0, 1.5), (2.0, 1.7)), velocity=(0, -0.02), adhesion=strength)
        *_, report = model.implicit(0.5, dt=0.05, quasi_static=True, nmd=True, integration=mpm.Integration.MIXED)
        assert report.cuts == 0
        forces[adhesion] = footing.force[1] / strength
    assert 2 + np.pi < forces[0.0] < forces[strength] < 1.3 * (2 + np.pi)


@pytest.mark.parametrize("filled", [0.3, 0.6, 1.0])
def test_a_cell_that_hangs_on_one_node_does_not_turn_about_it(filled):
    """Nothing but the ghost penalty holds it where there is no inertia; it then moves about as the soil beside it."""
    model = mpm.Model(box((4, 4), (0.4, 0.4)), mpm.LinearElastic(young=1e6, poisson=0.3))
    model.fix(3)
    base = (np.indices((16, 4)).reshape(2, -1).T + 0.5) * 0.025
    model.seed_points(base, np.full(len(base), 0.025**2), density=1000.0)
    hanging = np.array([[0.1 + 0.1 / 3, 0.1 + 0.2 / 3]])  # in the triangle over (0.1, 0.1), (0.1, 0.2), (0.2, 0.2)
    model.seed_points(hanging, [filled * 0.005], density=1000.0)
    model.set_gravity((0, -9.0))
    list(model.implicit(0.1, dt=0.1, quasi_static=True))
    moved = np.linalg.norm(model.particles.displacement, axis=1)
    assert 0 < moved[-1] < 3 * moved[:-1].max()


def test_a_lone_cell_that_supports_hold_has_no_ghost_penalty():
    """A filled cell without neighbours, compressed between rollers by its weight: the mean stress of its particles is exact."""
    model = mpm.Model(box((1, 1)), mpm.LinearElastic(young=1e6, poisson=0.3))
    model.seed(density=1000.0, per_cell=3)
    only = model.particles.cell == 0
    displacements = []
    for ghost in (mpm.GhostPenalty(), mpm.GhostPenalty(filled=0.0)):
        single = mpm.Model(box((1, 1)), mpm.LinearElastic(young=1e6, poisson=0.3))
        single.seed_points(model.particles.position[only], model.particles.volume[only], density=1000.0)
        single.fix(3) if (model.mesh.points[model.mesh.cells[0]][:, 1] == 0).sum() == 2 else single.fix(4)
        single.set_gravity((0, -9.81))
        list(single.implicit(0.1, dt=0.1, quasi_static=True, ghost=ghost))
        displacements.append(single.particles.displacement.copy())
    assert np.abs(displacements[1]).max() > 0
    np.testing.assert_array_equal(*displacements)
