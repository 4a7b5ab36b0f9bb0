"""Names of physical groups of gmsh in place of tags: soils, boundaries, laws, loads, supports, seeding, hand-over."""

import subprocess

import numpy as np
import pytest
from bridge_cases import POISSON, YOUNG
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

COMM = MPI.COMM_WORLD
# Each soil has lines and points of its own at the common border, as when two drawings are put together.
TWO_SOILS = """
DefineConstant[ h = 0.5 ];
Point(1) = {0, 0, 0, h}; Point(2) = {2, 0, 0, h}; Point(3) = {2, 1, 0, h}; Point(4) = {0, 1, 0, h};
Point(5) = {0, 1, 0, h}; Point(6) = {2, 1, 0, h}; Point(7) = {2, 3, 0, h}; Point(8) = {0, 3, 0, h};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 1};
Line(5) = {5, 6}; Line(6) = {6, 7}; Line(7) = {7, 8}; Line(8) = {8, 5};
Curve Loop(1) = {1, 2, 3, 4}; Plane Surface(1) = {1};
Curve Loop(2) = {5, 6, 7, 8}; Plane Surface(2) = {2};
Point(9) = {3, 0, 0, h}; Point(10) = {3, 1, 0, h};
Line(9) = {2, 9}; Line(10) = {9, 10}; Line(11) = {10, 3};
Curve Loop(3) = {9, 10, 11, -2}; Plane Surface(3) = {3};
Physical Surface("soft clay") = {1}; Physical Surface("fill") = {2}; Physical Surface("air") = {3};
Physical Curve("base") = {1}; Physical Curve("sides") = {2, 4, 6, 8}; Physical Curve("top") = {7};
"""
WEIGHTS = {"soft clay": 16e3, "fill": 20e3}
SOILS = ["soft clay", "fill"]


@pytest.fixture(params=["geo", "msh2", "msh4"])
def background(request, tmp_path):
    path = tmp_path / "soils.geo"
    path.write_text(TWO_SOILS)
    if request.param != "geo":
        command = ["gmsh", "-2", "-v", "0", "-format", request.param, "-o", str(path.with_suffix(".msh")), str(path)]
        subprocess.run(command, check=True, stdin=subprocess.DEVNULL)
        path = path.with_suffix(".msh")
    return bridge.read_mesh(path, COMM)


@pytest.fixture
def soils():
    return mpm.LinearElastic(young=YOUNG, poisson=POISSON), mpm.LinearElastic(young=3 * YOUNG, poisson=POISSON)


def body_of(background, soils):
    body, cell_tags, facet_tags = bridge.soil_mesh(*background, tag=SOILS)
    supports = [bridge.roller("sides", (1, 0)), bridge.fixed("base")]
    return bridge.QuasiStatic(body, dict(zip(SOILS, soils)), facet_tags, supports, cell_tags=cell_tags)


def test_two_soils_by_name_are_one_body_in_equilibrium(background, soils):
    """One-dimensional: sigma_v = q + weight above; the base carries all, so the drawings hold together at the border."""
    fem = body_of(background, soils)
    fem.solve(bridge.Load(unit_weight=WEIGHTS, pressure={"top": 5e3}))
    y = fem.points.coordinates()[:, 1]
    vertical = -5e3 - np.where(y > 1, 20e3 * (3 - y), 20e3 * 2 + 16e3 * (1 - y))
    assert fem.converged and np.allclose(fem.points.stress[:, 1], vertical, atol=1e-4)
    assert fem.reaction("base") == pytest.approx((0, -2 * (5e3 + 2 * 20e3 + 16e3)), abs=1e-3)


@pytest.mark.parametrize("background", ["geo"], indirect=True)
def test_particles_are_seeded_supported_and_handed_over_by_name(background, soils):
    fem = body_of(background, soils)
    fem.solve(bridge.Load(unit_weight=WEIGHTS))
    model = mpm.Model(bridge.background_mesh(*background), soils)
    for material, soil in enumerate(SOILS):
        model.seed(density=WEIGHTS[soil] / 10, cell_tag=soil, material=material)
    model.roller("sides", (1, 0))
    model.fix("base")
    model.set_gravity((0, -10))
    assert bridge.initialise(model, fem, count_displacement=False).yielded_fraction == 0
    below = model.particles.position[:, 1] < 1
    assert np.array_equal(model.particles.material, np.where(below, 0, 1))
    assert model.particles.volume.sum() == pytest.approx(2 * 3)  # none in the air
    both = mpm.Model(model.mesh, soils)
    assert both.seed(density=2000.0, cell_tag=SOILS) == len(model.particles)
    assert len(np.unique(both.particles.id)) == len(model.particles)


@pytest.mark.parametrize("background", ["geo"], indirect=True)
def test_a_number_stands_for_the_same_as_its_name(background, soils):
    number = bridge.names_of(background[1])["fill"][0]
    one, other = (
        bridge.soil_mesh(*background, tag=tag)[0].topology.index_map(2).size_global for tag in (number, "fill")
    )
    assert one == other > 0


@pytest.mark.parametrize("background", ["geo"], indirect=True)
def test_a_name_may_stand_for_several_tags(background, soils):
    domain, cell_tags, facet_tags = background
    of = bridge.names_of(cell_tags)
    bridge.name_tags(cell_tags, {**of, "ground": (*of["soft clay"], *of["fill"])})
    body, tags, facets = bridge.soil_mesh(domain, cell_tags, facet_tags, tag="ground")
    supports = [bridge.roller("sides", (1, 0)), bridge.fixed("base")]
    fem = bridge.QuasiStatic(body, {"ground": soils[0]}, facets, supports, cell_tags=tags)
    fem.solve(bridge.Load(unit_weight={"ground": 20e3}))
    assert fem.reaction("base")[1] == pytest.approx(-20e3 * 2 * 3)


@pytest.mark.parametrize("background", ["geo"], indirect=True)
@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (lambda b, f: bridge.soil_mesh(*b, tag=["fill", "sand"]), "tag: no cell has the name 'sand'; the mesh has 'soft clay'"),
        (lambda b, f: f.equilibrate(bridge.Load(pressure={"crest": 1.0})), "pressure: no facet has the name 'crest'"),
        (lambda b, f: f.equilibrate(bridge.Load(unit_weight={"sand": 1.0})), "unit_weight: no cell has the name 'sand'"),
        (lambda b, f: f.equilibrate(bridge.Load(unit_weight={"fill": 1.0, 2: 1.0})), "'fill' is given twice"),
        (lambda b, f: f.reaction("floor"), "facet_tag: no facet has the name 'floor'; the mesh has 'base', 'sides', 'top'"),
        (lambda b, f: mpm.Model(bridge.background_mesh(*b), f.laws).fix("floor"), "facet_tag is 'floor'.*base"),
        (lambda b, f: mpm.Model(bridge.background_mesh(*b), f.laws).seed(density=1.0, cell_tag="sand"), "cell_tag is 'sand'"),
        (lambda b, f: f.equilibrate(bridge.Load(), {"fill": f.laws[0]}), "expected laws for the cell tags 'soft clay', 'fill'"),
    ],
)  # fmt: skip
def test_a_name_that_is_not_there_is_an_error_that_lists_those_that_are(background, soils, wrong, message):
    with pytest.raises(bridge.InputError, match=message):
        wrong(background, body_of(background, soils))


def test_supports_of_particles_are_released(soils):
    mesh = bridge.background_mesh(*bridge.slope_mesh(COMM, cell_size=0.5, kind="fitted"))
    model = mpm.Model(mesh, soils[0])
    model.seed(density=2000.0, cell_tag="soil")
    model.prescribe("base", (0, 0))
    model.set_gravity((0, -10))
    list(model.explicit(until=0.01))
    held = model.report().momentum[1]
    model.release("base")
    list(model.explicit(until=0.02))
    # without a base its own weight alone accelerates the body: m g t more momentum
    assert model.report().momentum[1] - held == pytest.approx(-model.particles.mass.sum() * 10 * 0.01, rel=1e-9)
    with pytest.raises(bridge.InputError, match="'base' is not supported"):
        model.release("base")


@pytest.mark.parametrize("background", ["geo"], indirect=True)
def test_a_parameter_grows_with_depth(background):
    """A column whose modulus is E0 + k depth settles by the integral of the weight above over the modulus."""
    domain, cell_tags, facet_tags = background
    cell_tags, depths = bridge.graded_tags(domain, cell_tags, "fill", lambda x: 3 - x[:, 1], classes=200)
    body, tags, facets = bridge.soil_mesh(domain, cell_tags, facet_tags, tag="fill")
    modulus = YOUNG * np.array([1, 3])  # on top, and 2 m deeper
    laws = {
        tag: mpm.LinearElastic(young=modulus[0] + (modulus[1] - modulus[0]) / 2 * depth, poisson=0.0)
        for tag, depth in depths.items()
    }
    supports = [bridge.roller("sides", (1, 0)), bridge.prescribed("top", (None, 0.0))]
    fem = bridge.QuasiStatic(body, laws, facets, supports, cell_tags=tags)
    fem.solve(bridge.Load(unit_weight={"fill": 20e3}))  # it hangs from its top
    assert fem.reaction("top")[1] == pytest.approx(-20e3 * 2 * 2)
    # u = -gamma / E0 int_0^2 (2 - z) / (1 + z) dz; the mesh of 0.5 m has one modulus in each triangle
    lowest = fem.evaluate_at([(1.0, 1.0)])["displacement"][0, 1]
    assert lowest == pytest.approx(-20e3 / YOUNG * (3 * np.log(3) - 2), rel=0.02)


def test_names_of_soils_without_cell_tags_are_an_error_that_asks_for_these():
    body, _, facets = bridge.soil_mesh(*bridge.slope_mesh(COMM, cell_size=0.5, kind="fitted"))
    law = mpm.MohrCoulomb(young=YOUNG, poisson=POISSON, cohesion=1e6, friction_angle=30.0)
    fem = bridge.QuasiStatic(body, law, facets, [bridge.fixed("base")])
    with pytest.raises(bridge.InputError, match="unit_weight: cell_tags is None, expected the tags in which 'soil' is"):
        fem.solve(bridge.Load(unit_weight={"soil": 20e3}))
