"""Axisymmetric finite elements: thick cylinders, expanding cavities, circular footings, ground at rest."""

from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

MESHES = Path(__file__).resolve().parents[3] / "meshes"
AXISYMMETRIC = bridge.Geometry.AXISYMMETRIC
KINDS = {
    "linear": {"degree": 1},
    "averaged": {"degree": 1, "nmd": True},
    "quadratic": {"degree": 2},
    "quartic": {"degree": 4},
}


def ring(inner, outer, cells, height=0.25, rows=2, grading=1.0):
    """The section of a ring: (domain, facet_tags); tag 1 is the wall inside, 2 outside, 3 the base, 4 the top."""
    domain, _, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, [1.0, height], [cells, rows])
    x = domain.geometry.x
    x[:, 0] = inner + (outer - inner) * x[:, 0] ** grading
    return domain, facet_tags


ENDS = [bridge.roller(3, (0, 1)), bridge.roller(4, (0, 1))]


@pytest.mark.parametrize(("kind", "order"), [("linear", 2), ("averaged", 2), ("quadratic", 3), ("quartic", 5)])
def test_thick_cylinder_of_lame(kind, order):
    # sigma_r = A - B / r^2, sigma_theta = A + B / r^2 with A = p a^2 / (b^2 - a^2), B = A b^2, and in plane strain
    # u = (1 + nu) / E ((1 - 2 nu) A r + B / r): 1.906667e-3 m inside, 1.213333e-3 m outside
    law, errors = mpm.LinearElastic(young=1000.0, poisson=0.3), []
    for cells in (8, 16, 32):
        domain, facet_tags = ring(1.0, 2.0, cells, 2.0 / cells)
        fem = bridge.QuasiStatic(domain, law, facet_tags, ENDS, geometry=AXISYMMETRIC, **KINDS[kind])
        fem.solve(bridge.Load(pressure={1: 1.0}))
        assert fem.converged
        u = fem.evaluate_at(np.array([[1.0, 0.5 / cells], [2.0, 0.5 / cells]]))["displacement"][:, 0]
        errors.append(np.abs(u - [1.906667e-3, 1.213333e-3]).max())
        r = fem.points.coordinates()[:, 0]
        expected = np.column_stack([1 / 3 - 4 / 3 / r**2, np.full(len(r), 0.2), 1 / 3 + 4 / 3 / r**2])
        stress_error = np.abs(fem.points.stress[:, :3] - expected).max()
    assert errors[0] / errors[1] > 2 ** (order - 0.3) or errors[1] < 1e-9
    assert errors[1] / errors[2] > 2 ** (order - 0.3) or errors[2] < 1e-9
    assert errors[2] < 2e-6 and stress_error < (0.1 if kind == "averaged" else 0.07 if kind == "linear" else 0.01)


@pytest.mark.parametrize("kind", KINDS)
def test_uniform_strain_is_exact(kind):
    # u_r = e r, u_y = k y: all strains are uniform, and hoop and radial ones the same
    domain, facet_tags = ring(0.0, 1.0, 4, 0.5, 2)
    law = mpm.LinearElastic(young=1000.0, poisson=0.25)  # lambda = G = 400
    supports = [bridge.roller(1, (1, 0)), bridge.prescribed(2, (1e-3, None)), bridge.roller(3, (0, 1)),
                bridge.prescribed(4, (None, 1e-3))]  # fmt: skip
    fem = bridge.QuasiStatic(domain, law, facet_tags, supports, geometry=AXISYMMETRIC, **KINDS[kind])
    fem.solve(bridge.Load(displacement=1.0))
    radial, axial = 1e-3, 2e-3
    mean = 400 * (2 * radial + axial)
    expected = [mean + 800 * radial, mean + 800 * axial, mean + 800 * radial, 0.0]
    assert np.abs(fem.points.stress - expected).max() < 1e-9
    # Per radian: the wall has the area R H, the top R^2 / 2
    assert fem.reaction(2)[0] == pytest.approx(-expected[0] * 0.5, rel=1e-9)
    assert fem.reaction(4)[1] == pytest.approx(-expected[1] * 0.5, rel=1e-9)


@pytest.mark.parametrize("kind", ["averaged", "quadratic", "quartic"])
def test_plastic_thick_cylinder(kind):
    # Hill (1950), chapter V.2, Tresca: with the plastic radius c, p = s_u (1 - c^2 / b^2 + 2 ln(c / a)); in the plastic zone
    # sigma_r = -p + 2 s_u ln(r / a), outside of it sigma_r = -s_u (c^2 / r^2 - c^2 / b^2)
    strength, outer, plastic = 10.0, 2.0, 1.5
    law = mpm.tresca(young=1e4, poisson=0.48, shear_strength=strength)
    domain, facet_tags = ring(1.0, outer, 32, 0.0625, 2)
    fem = bridge.QuasiStatic(domain, law, facet_tags, ENDS, geometry=AXISYMMETRIC, **KINDS[kind])
    pressure = strength * (1 - plastic**2 / outer**2 + 2 * np.log(plastic))
    fem.solve(bridge.Load(pressure={1: pressure}))
    assert fem.converged
    r = fem.points.coordinates()[:, 0]
    inside = -pressure + 2 * strength * np.log(r)
    outside = -strength * plastic**2 * (1 / r**2 - 1 / outer**2)
    assert np.abs(fem.points.stress[:, 0] - np.where(r < plastic, inside, outside)).max() < 0.04 * pressure
    yielded = fem.points.state[:, 0] > 0
    assert yielded[r < plastic - 0.05].all() and not yielded[r > plastic + 0.05].any()
    collapse = bridge.collapse_load(fem, lambda p: bridge.Load(pressure={1: p}), first_step=0.5, start=pressure)
    assert collapse.value == pytest.approx(2 * strength * np.log(outer), rel=1e-2)


@pytest.mark.parametrize("rigidity", [50.0, 100.0, 200.0, 500.0])
def test_expansion_of_a_cavity_in_clay(rigidity):
    # Small strains without change of volume: u r = u_a a, the plastic radius c has u_c = s_u c / 2G, so that
    # p = s_u (1 + ln(2 I_r u_a / a)) in unlimited ground, less s_u c^2 / b^2 in ground of the radius b; where 2 u_a = a, as for
    # a cavity that begins with no radius, it is the limit pressure s_u (1 + ln I_r)
    strength, outer = 10.0, 100.0
    law = mpm.tresca(young=2.98 * rigidity * strength, poisson=0.49, shear_strength=strength)
    domain, facet_tags = ring(1.0, outer, 48, 0.5, 1, grading=3.0)
    supports = [*ENDS, bridge.prescribed(1, (0.5, None))]
    fem = bridge.QuasiStatic(domain, law, facet_tags, supports, geometry=AXISYMMETRIC, degree=2)
    fem.solve(bridge.Load(displacement=1.0), first_step=0.02)
    assert fem.converged
    pressure = -fem.reaction(1)[0] / 0.5  # over the area a H of one radian
    plastic = np.sqrt(rigidity)
    assert abs(pressure) == pytest.approx(strength * (1 + np.log(rigidity) - plastic**2 / outer**2), rel=1.5e-2)


def footing(kind, rough):
    """Collapse pressure over the strength of a rigid circular footing of radius 0.5 m, by its settlement."""
    edge = 0.04 if kind == "quartic" else 0.02
    sizes = {"half_width": 0.5, "width": 2.5, "depth": 1.5, "edge_size": edge, "near_size": 4 * edge, "far_size": 0.4}
    domain, _, facet_tags = bridge.read_mesh(MESHES / "footing.geo", MPI.COMM_WORLD, parameters=sizes)
    law = mpm.tresca(young=1e3, poisson=0.49, shear_strength=1.0)
    supports = [bridge.roller("axis", (1, 0)), bridge.roller("far", (1, 0)), bridge.fixed("base"),
                bridge.prescribed("footing", (0.0 if rough else None, -0.03))]  # fmt: skip
    fem = bridge.QuasiStatic(domain, law, facet_tags, supports, geometry=AXISYMMETRIC, **KINDS[kind])
    fem.solve(bridge.Load(displacement=1.0), first_step=0.1)
    assert fem.converged
    return abs(fem.reaction("footing")[1]) / (0.5 * 0.5**2)


@pytest.mark.parametrize(("rough", "factor"), [(False, 5.69), (True, 6.05)])
@pytest.mark.parametrize("kind", ["averaged", "quadratic", "quartic"])
def test_circular_footing_on_clay(kind, rough, factor):
    # Bearing capacity factors of Cox, Eason, Hopkins (1961) and Eason, Shield (1960). The elements' own is above: they are too
    # stiff, the less so the finer they are
    assert factor < footing(kind, rough) < factor * {"averaged": 1.08, "quadratic": 1.05, "quartic": 1.02}[kind]


@pytest.mark.parametrize("kind", KINDS)
def test_ground_at_rest_stays_at_rest(kind):
    # Stresses are linear, and times the radius quadratic, which the points integrate to second order: so the ground is out of
    # balance by that, and moves by that much; those of quartic elements integrate it exactly
    law = mpm.MohrCoulomb(young=1e6, poisson=0.3, cohesion=1e3, friction_angle=30.0)
    supports = [bridge.roller(1, (1, 0)), bridge.roller(2, (1, 0)), bridge.fixed(3)]
    load, moved = bridge.Load(unit_weight=20e3), []
    settlement = 20e3 / (2 * 1e6)  # of ground that was weightless before, for comparison
    for cells in (4, 8, 16):
        domain, facet_tags = ring(0.0, 2.0, cells, 1.0, cells)
        fem = bridge.QuasiStatic(domain, law, facet_tags, supports, geometry=AXISYMMETRIC, **KINDS[kind])
        stress = bridge.k0_stress(fem.points.coordinates(), 1.0, 20e3, 0.6)
        fem.set_initial_stress(stress, load)
        assert fem.equilibrate(load).converged
        moved.append(np.sqrt(np.mean(fem.displacement.x.array**2)))
        assert fem.reaction(3)[1] == pytest.approx(-20e3 * 1.0 * 2.0**2 / 2, rel=1e-9)  # the weight of one radian
    assert moved[-1] < 2e-3 * settlement and (moved[1] / moved[2] > 3 or moved[-1] < 1e-12 * settlement)
    assert not fem.points.state.any()


def test_wrong_input_is_named():
    law = mpm.LinearElastic(young=1e6, poisson=0.3)
    domain, facet_tags = ring(0.0, 1.0, 2)
    with pytest.raises(bridge.InputError, match="supports: .* nodes lie on the axis and may move along the radius"):
        bridge.QuasiStatic(domain, law, facet_tags, [bridge.fixed(3)], geometry=AXISYMMETRIC)
    beyond, tags = ring(-0.5, 1.0, 2)
    with pytest.raises(bridge.InputError, match="domain has the radius -0.5 m, expected radii from 0 on"):
        bridge.QuasiStatic(beyond, law, tags, [bridge.fixed(3)], geometry=AXISYMMETRIC)
    with pytest.raises(bridge.InputError, match="geometry is .*SOLID.*, which a mesh of 2 dimensions cannot have"):
        bridge.QuasiStatic(domain, law, facet_tags, [bridge.fixed(3)], geometry=bridge.Geometry.SOLID)
