"""Factor of safety by particles that rest or flow, against linear finite elements on the same cells."""

import numpy as np
import pytest
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

UNIT_WEIGHT, GRAVITY = 20e3, 9.81
SUPPORTS = [bridge.roller(bridge.LEFT, (1, 0)), bridge.fixed(bridge.BASE)]
MESH = bridge.slope_mesh(MPI.COMM_WORLD, crest=1.0, cell_size=0.2)


def soil(friction_angle=25.0, dilation_angle=0.0, cohesion=1e3, young=20e6):
    return mpm.MohrCoulomb(
        young=young, poisson=0.33, cohesion=cohesion, friction_angle=friction_angle, dilation_angle=dilation_angle
    )


def particles(law, gravity=GRAVITY, geometry=None):
    """Function of the factor that returns the slope's particles, unstressed."""
    mesh = bridge.background_mesh(*MESH)

    def model_of(factor):
        model = mpm.Model(mesh, bridge.reduced_strength(law, factor), geometry=geometry)
        model.seed(density=UNIT_WEIGHT / GRAVITY, per_cell=3, cell_tag=bridge.SOIL)
        bridge.apply_supports(model, SUPPORTS)
        model.set_gravity((0.0, -gravity))
        return model

    return model_of


@pytest.mark.parametrize(
    ("friction_angle", "dilation_angle", "cohesion", "geometry"),
    [
        (25.0, 0.0, 1e3, None),
        (25.0, 25.0, 1e3, None),
        (0.0, 0.0, 4e3, None),
        (25.0, 0.0, 1e3, bridge.Geometry.AXISYMMETRIC),
    ],
)
def test_particles_have_the_factor_of_the_finite_elements(friction_angle, dilation_angle, cohesion, geometry, capsys):
    """On the same linear cells, whose particles hardly move: the brackets, at most 1 % wide, overlap within 1 %."""
    law = soil(friction_angle, dilation_angle, cohesion)
    body, _, facet_tags = bridge.soil_mesh(*MESH)
    model = bridge.QuasiStatic(body, law, facet_tags, SUPPORTS, degree=1, geometry=geometry)
    elements = bridge.factor_of_safety(model, bridge.Load(unit_weight=UNIT_WEIGHT), first_step=0.2)
    found = bridge.particle_safety(particles(law, geometry=geometry), start=0.7, progress=bridge.print_step)
    printed = capsys.readouterr().err.splitlines()
    assert printed and all(" explicit " in line for line in printed)
    assert elements.failed and found.failed and found.residual <= 1e-3
    assert found.value <= 1.01 * elements.failed_at and elements.value <= 1.01 * found.failed_at
    assert found.failed_at - found.value <= 2 * 5e-3 * found.value
    assert len(found.curve) >= 3 and found.curve[-1, 0] == found.value
    moving = found.model.particles
    assert np.linalg.norm(moving.velocity, axis=1).max() > 0


def test_the_factor_does_not_depend_on_where_cells_rest():
    """To 0.1 %, with brackets half as wide; in soil so stiff that particles settle by less than that of the height."""
    made = particles(soil(25.0, 25.0, young=400e6))

    def resting(where):
        def model_of(factor):
            model = made(factor)
            if where is not None:
                model.rest(where=where)
            return model

        return model_of

    parts = (None, lambda x: x[:, 0] >= 0, lambda x: x[:, 0] < 0.8, lambda x: x[:, 0] > 1.2)
    options = dict(start=1.17, first_step=0.02, tolerance=5e-4)
    found = [bridge.particle_safety(resting(part), **options) for part in parts]
    assert [each.model.report().resting_cells > 0 for each in found] == [False, True, True, True]
    for each in found[1:]:
        assert each.failed and each.value == pytest.approx(found[0].value, rel=1e-3)


def test_the_factor_is_that_of_the_strength():
    """Twice the cohesion of soil without friction, twice the factor."""
    weak, strong = (bridge.particle_safety(particles(soil(0.0, 0.0, c)), start=f) for c, f in ((4e3, 0.7), (8e3, 1.4)))
    assert strong.value == pytest.approx(2 * weak.value, rel=0.01)


def test_ground_that_cannot_fail_is_said_so(monkeypatch):
    monkeypatch.setattr("fenics_bridge.fem.load_steps.FAR", 4)
    domain, cell_tags, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, (1.0, 1.0), (2, 2))
    mesh = bridge.background_mesh(domain, cell_tags, facet_tags)

    def model_of(factor):
        model = mpm.Model(mesh, bridge.reduced_strength(soil(), factor))
        model.seed(density=UNIT_WEIGHT / GRAVITY, per_cell=3)
        bridge.apply_supports(model, [bridge.roller(1, (1, 0)), bridge.roller(2, (1, 0)), bridge.fixed(3)])
        model.set_gravity((0.0, -GRAVITY))
        return model

    with pytest.raises(bridge.InputError, match="rest at every factor up to 4.5; the body may not be able to fail"):
        bridge.particle_safety(model_of, first_step=1.0)


def test_wrong_arguments_are_named():
    with pytest.raises(
        bridge.InputError, match="start: with the strength divided by 3.0 the particles do not come to rest: .*flow"
    ):
        bridge.particle_safety(particles(soil()), start=3.0)
    with pytest.raises(bridge.InputError, match="model_of returns a model without gravity"):
        bridge.particle_safety(particles(soil(), gravity=0.0))
    with pytest.raises(bridge.InputError, match="what model_of returns is None, expected a Model"):
        bridge.particle_safety(lambda factor: None)
    for name, value in (("start", 0.0), ("first_step", -1.0), ("tolerance", 1.0), ("damping", 1.0), ("rest", 0.0)):
        with pytest.raises(bridge.InputError, match=f"{name} is {value!r}, expected"):
            bridge.particle_safety(particles(soil()), **{name: value})
