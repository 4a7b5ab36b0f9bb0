"""Several velocity fields on one mesh: bodies that do not see each other."""

import numpy as np
import pytest
from core_cases import box

import mpm_core as mpm

SOFT = mpm.LinearElastic(young=1e4, poisson=0.2)


def crossing(bodies):
    """Bodies that start on the left (0) and on the right (1) and fly through one another, spinning and oscillating."""
    mesh = box((12, 6), (2.0, 1.0), diagonals="alternating")
    model = mpm.Model(mesh, [SOFT, SOFT], velocity_fields=[0, 1] if len(bodies) == 2 else None)
    rng = np.random.default_rng(3)
    velocities = []
    for body in (0, 1):
        points = rng.uniform((0.3, 0.3), (0.7, 0.7), (60, 2)) + (body, 0.0)
        if body in bodies:
            model.seed_points(points, np.full(60, 0.16 / 60), density=1000.0 * (1 + body), material=body)
            velocities.append((1.0 - 2 * body) * np.array([1.0, 0.2]) + 0.3 * (points - points.mean(axis=0))[:, ::-1])
    model.particles.set("velocity", np.concatenate(velocities)[model.particles.id])
    return model


@pytest.mark.parametrize(
    "options",
    [{}, {"nmd": True}, {"stress_update": mpm.StressUpdate.FIRST}, {"integration": mpm.Integration.MIXED}],
    ids=str,
)
def test_two_bodies_fall_through_one_another_each_as_if_alone(options):
    both, alone = crossing([0, 1]), [crossing([body]) for body in (0, 1)]
    for model in (both, *alone):
        list(model.explicit(0.8, dt=2e-3, **options))
    for body in (0, 1):
        mine = both.particles[both.particles.material == body]
        assert abs(mine.displacement[:, 0].mean()) > 0.7  # to the other side
        for name in ("displacement", "velocity", "stress", "volume"):
            ours = getattr(mine, name)[np.argsort(mine.id)]
            theirs = getattr(alone[body].particles, name)[np.argsort(alone[body].particles.id)]
            np.testing.assert_allclose(ours, theirs, atol=1e-10 * abs(theirs).max())
    # In one field they meet, and hold one another back.
    together = crossing([0, 1])
    merged = mpm.Model(together.mesh, together.laws)
    merged.seed_points(together.particles.position, together.particles.volume, density=1000.0)
    merged.particles.set("velocity", together.particles.velocity)
    list(merged.explicit(0.6, dt=2e-3, **options))
    assert merged.particles.displacement[:60, 0].mean() < 0.4


def test_nodes_and_checkpoints_know_the_fields(tmp_path):
    model = crossing([0, 1])
    list(model.explicit(0.1, dt=2e-3))
    masses = [model.nodal("mass", velocity_field=k).sum() for k in (0, 1)]
    np.testing.assert_allclose(masses, [0.16 * 1000, 0.16 * 2000], rtol=1e-12)
    model.save(tmp_path / "state.h5")
    same = mpm.Model(model.mesh, [SOFT, SOFT], velocity_fields=[0, 1])
    same.restore(tmp_path / "state.h5")
    for each in (model, same):
        list(each.explicit(0.4, dt=2e-3))
    np.testing.assert_array_equal(model.particles.stress, same.particles.stress)
    merged = mpm.Model(model.mesh, [SOFT, SOFT])
    with pytest.raises(mpm.InputError, match="another division into velocity fields"):
        merged.restore(tmp_path / "state.h5")


@pytest.mark.parametrize(
    "fields, message",
    [
        ([0], "1 numbers, expected one for each of 2 laws"),
        ([0, 2], "no law in the field 1"),
        ([1, 1], "no law in the field 0"),
        ([0, -1], "without gaps"),
        ([0, 0.5], "expected whole numbers"),
    ],
)
def test_numbers_of_fields_that_cannot_be_are_refused(fields, message):
    with pytest.raises(mpm.InputError, match=message):
        mpm.Model(box((2, 2)), [SOFT, SOFT], velocity_fields=fields)


def test_what_one_field_can_only_do_is_refused_for_several():
    model = crossing([0, 1])
    with pytest.raises(mpm.InputError, match="2 velocity fields, expected one in implicit steps"):
        list(model.implicit(0.1, dt=0.05))
    with pytest.raises(mpm.InputError, match="integration is DUAL_DOMAIN"):
        list(model.explicit(0.1, integration=mpm.Integration.DUAL_DOMAIN))
