"""From finite elements to resting cells."""

import numpy as np
import pytest
from axisymmetric_cases import cylinder_fem, cylinder_particles
from bridge_cases import slope_model, slope_particles

import fenics_bridge as bridge
import mpm_core as mpm

UNIT_WEIGHT = 18e3


def handed_over(**options):
    fem = slope_model(dilation_angle=0.0)
    fem.solve(bridge.Load(unit_weight=UNIT_WEIGHT))
    model = slope_particles(UNIT_WEIGHT)
    return fem, model, bridge.initialise(model, fem, **options)


@pytest.mark.parametrize("count_displacement", [True, False])
def test_finite_elements_go_on_as_resting_cells_in_equilibrium(count_displacement):
    fem, model, report = handed_over(resting=True, count_displacement=count_displacement)
    assert model.particles.is_resting.all() and len(model.particles) == (model.mesh.cell_tags == bridge.SOIL).sum()
    assert report.unbalanced_ratio < 1e-10 and report.equilibrated_ratio is None
    assert report.returned_fraction == 0 and report.yielded_fraction == 0
    values = fem.evaluate_at(model.particles.position)
    np.testing.assert_allclose(model.particles.stress, values["stress"], atol=1e-9 * UNIT_WEIGHT)
    np.testing.assert_array_equal(model.particles.state, values["state"])
    expected = values["displacement"] * count_displacement
    np.testing.assert_allclose(model.particles.displacement, expected, atol=1e-14)
    # It stays there: under the load of the finite elements nothing moves or turns into particles, whatever they moved before.
    after = model.explicit(0.05, damping=0.5).last()
    assert after.converted_cells == 0 and after.unbalanced_ratio < 1e-8
    np.testing.assert_allclose(model.particles.stress, values["stress"], atol=1e-7 * UNIT_WEIGHT)


def test_resting_cells_start_to_slide_as_particles_do():
    # They differ by what the particles have moved relative to their cells: in the order of displacement over cell size.
    means = []
    for resting in (False, True):
        _, model, _ = handed_over(resting=resting, count_displacement=False)
        model.set_gravity((0.0, -4 * 9.81))
        model.explicit(0.01, damping=0.75).last()
        p, n = model.particles, len(model.mesh.cells)
        means.append(np.stack([np.bincount(p.cell, p.mass * u, n) for u in p.displacement.T]) / p.mass.max())
        moved = np.abs(p.displacement).max() / 0.1
    scale = [np.abs(mean).max() for mean in means]
    means = [mean / size for mean, size in zip(means, scale)]
    assert 0.002 < moved < 0.01
    np.testing.assert_allclose(means[1], means[0], atol=2 * moved)


def test_a_body_of_revolution_goes_on_at_rest_until_its_foot_fails():
    """Linear elements and resting cells are the same in axial symmetry; under twice the weight the foot yields first."""
    fem = cylinder_fem(degree=1)
    model = cylinder_particles(headroom=0.25)
    assert bridge.initialise(model, fem, count_displacement=False, resting=True).unbalanced_ratio < 1e-9
    report = model.explicit(0.02, damping=0.5).last()
    assert report.converted_cells == 0 and report.unbalanced_ratio < 1e-8
    model.set_gravity((0.0, -2 * 9.81))
    start = report.mass
    report = model.explicit(0.09, conversion=mpm.Conversion(plastic_strain=0.01, displacement=1.0, layers=1)).last()
    assert report.mass == pytest.approx(start, rel=1e-12)
    assert report.converted_cells > 0 and report.resting_cells > 0
    p = model.particles
    foot, top = p.position @ (1.0, -1.0) > 0.6, p.position @ (1.0, -1.0) < -0.6  # outside below, on the axis above
    assert p.is_resting[foot].mean() < 0.5 and p.is_resting[top].all()


def test_resting_cells_are_not_moved_by_the_hand_over():
    with pytest.raises(mpm.InputError, match="move is True, expected False with resting"):
        handed_over(resting=True, move=True)
