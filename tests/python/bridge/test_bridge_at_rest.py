"""Soils that stages place with K0: level ground by hand, and any other by equilibrium and by identities."""

import numpy as np
import pytest
from mpi4py import MPI
from stage_cases import (
    DIG,
    IN_SITU,
    POISSON,
    ROLLERS,
    SOILS,
    carried_out,
    elastic,
    geometry,
    mesh_of,
    site_of,
    weights,
)

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge.fem import at_rest

COLUMN, PIT = SOILS["column"], SOILS["pit"]
K0 = dict(zip(COLUMN, (0.5, 1.5, 0.8)))
AXISYMMETRIC = bridge.Geometry.AXISYMMETRIC
WATER, SURCHARGE = 9.81e3, 30e3
INCOMPRESSIBLE = mpm.tresca(young=20e6, poisson=0.49, shear_strength=1e6)
CLAY = mpm.CamClay(
    compression=0.2, swelling=0.03, critical_slope=1.2, poisson=0.3, preconsolidation=500e3, void_ratio=1.0
)


@pytest.fixture(scope="module")
def column(tmp_path_factory):
    folder = tmp_path_factory.mktemp("layers")
    soils = {"ground": 1, "layer 1": 2, "layer 2": 3}
    text = geometry([(0, 0, 1, 3), (0, 3, 1, 1), (0, 4, 1, 2)], soils, 1, ("top", 0, 6, 1, 6), 0.5)
    (folder / "layers.geo").write_text(text)
    return bridge.read_mesh(folder / "layers.geo", MPI.COMM_WORLD)


@pytest.fixture(scope="module")
def pit(tmp_path_factory):
    return mesh_of("pit", tmp_path_factory.mktemp("pit"))


def layers_by_hand(y):
    """Vertical effective stress and K0 of the layers with water up to 4 m and a surcharge, at heights y."""
    above = np.select([y > 4, y > 3], [16e3 * (6 - y), 16e3 * 2 + 18e3 * (4 - y)], 16e3 * 2 + 18e3 + 20e3 * (3 - y))
    k0 = np.select([y > 4, y > 3], [K0["layer 2"], K0["layer 1"]], K0["ground"])
    return -(above + SURCHARGE - WATER * np.maximum(4 - y, 0)), k0


LAYERS = {
    "fill": COLUMN,
    "unit_weight": weights(COLUMN),
    "pore_pressure": bridge.hydrostatic(4.0),
    "pressure": {"top": SURCHARGE},
}


@pytest.mark.parametrize("laws", [elastic(COLUMN), dict.fromkeys(COLUMN, INCOMPRESSIBLE), dict.fromkeys(COLUMN, CLAY)])
@pytest.mark.parametrize("degree, shape", [(2, None), (4, AXISYMMETRIC)])
def test_level_layers_under_water_and_surcharge_are_at_rest(column, laws, degree, shape):
    """Displacements of these degrees have the solution in them, and in axial symmetry degree 4 has its integrals. Cam clay, which has no stiffness
    without stress, could not come without K0."""
    site = site_of(column, laws, degree=degree, geometry=shape)
    [report] = carried_out(site, bridge.Stage("in situ", **LAYERS, k0=K0))
    stress = site.fem.points.stress
    vertical, k0 = layers_by_hand(site.fem.points.coordinates()[:, 1])
    expected = np.column_stack([k0 * vertical, vertical, k0 * vertical, 0 * vertical])
    assert np.abs(stress - expected).max() < 1e-8 * np.abs(expected).max()
    assert report.largest_displacement < 1e-12


@pytest.mark.parametrize(
    "options", [{"degree": 1}, {"degree": 1, "nmd": True}, {"degree": 1, "nmd": True, "as_particles": True}]
)
def test_linear_elements_are_at_rest_too(column, options):
    """Nothing moves, also where forces are averaged by a fraction; stresses, constant in each cell, have the error of half a cell's weight."""
    dilates = mpm.MohrCoulomb(young=20e6, poisson=0.3, cohesion=1e6, friction_angle=30.0, dilation_angle=10.0)
    laws = {**elastic(COLUMN), "layer 1": dilates}
    for k0 in (K0, dict.fromkeys(COLUMN, 1.5)):
        site = site_of(column, laws, **options)
        [report] = carried_out(site, bridge.Stage("in situ", **LAYERS, k0=k0))
        assert report.largest_displacement < 1e-12
    vertical, _ = layers_by_hand(site.fem.points.coordinates()[:, 1])
    apart = site.fem.points.stress[:, :3] - np.column_stack([1.5 * vertical, vertical, 1.5 * vertical])
    assert np.abs(apart).max() < 0.5 * 20e3 * 0.5 * 1.5  # cells are 0.5 m high


def test_a_solid_has_k0_along_both_horizontal_axes():
    domain, cells, facets = bridge.box_mesh(MPI.COMM_WORLD, [1.0, 1.0, 4.0], [1, 1, 2])
    normals = {1: (1, 0, 0), 2: (1, 0, 0), 3: (0, 1, 0), 4: (0, 1, 0), 5: (0, 0, 1)}
    supports = [bridge.roller(tag, normal) for tag, normal in normals.items()]
    site = site_of((domain, cells, facets), {1: elastic(["ground"])["ground"]}, supports)
    [report] = carried_out(site, bridge.Stage("in situ", fill=1, unit_weight={1: 20e3}, k0={1: 1.4}))
    weight = -20e3 * (4 - site.fem.points.coordinates()[:, 2])
    expected = np.column_stack([1.4 * weight, 1.4 * weight, weight, *np.zeros((3, len(weight)))])
    assert np.abs(site.fem.points.stress - expected).max() < 1e-8 * 80e3
    assert report.largest_displacement < 1e-12


@pytest.mark.parametrize("shape", [None, AXISYMMETRIC])
@pytest.mark.parametrize("options", [{}, {"degree": 1}, {"degree": 1, "nmd": True}])
def test_k0_of_elasticity_is_weight_that_is_switched_on(pit, options, shape):
    """nu / (1 - nu) beside a pit with water: the stresses of elastic soil without K0, and no displacement."""
    k0 = bridge.k0_elastic(POISSON)
    stage = {"fill": ["ground", "pit 1"], "unit_weight": weights(PIT), "pore_pressure": bridge.hydrostatic(3.5)}
    laws = dict.fromkeys(PIT, elastic(PIT)["ground"])
    site, without = (site_of(pit, laws, geometry=shape, **options) for _ in range(2))
    [report] = carried_out(site, bridge.Stage("in situ", **stage, k0={"ground": k0, "pit 1": k0}))
    [moved] = carried_out(without, bridge.Stage("in situ", **stage))
    expected = without.fem.points.stress
    assert np.abs(site.fem.points.stress - expected).max() < 1e-9 * np.abs(expected).max()
    assert report.largest_displacement < 1e-9 * moved.largest_displacement


def test_soils_without_k0_come_as_without_it(column):
    """Free of stress: their own weight gives them nu / (1 - nu), and does not strain those below, which have it already."""
    site = site_of(column, elastic(COLUMN))
    carried_out(site, bridge.Stage("in situ", **LAYERS, k0={"ground": 0.7, "layer 2": 2.0}))
    stress, y = site.fem.points.stress, site.fem.points.coordinates()[:, 1]
    k0 = np.select([y > 4, y > 3], [2.0, POISSON / (1 - POISSON)], 0.7)
    vertical, _ = layers_by_hand(y)
    assert np.allclose(stress[:, 1], vertical, rtol=0, atol=1e-8 * 150e3)
    assert np.allclose(stress[:, 0], k0 * vertical, rtol=0, atol=1e-8 * 150e3)


def test_a_layer_with_k0_presses_on_the_ground_that_was_there(column):
    """It keeps K0 as the ground below settles, whose stresses grow by its weight as by a surcharge."""
    site = site_of(column, elastic(COLUMN))
    first = bridge.Stage("in situ", fill=COLUMN[:2], unit_weight=weights(COLUMN), k0={"ground": 0.6, "layer 1": 0.6})
    carried_out(site, first, bridge.Stage("layer", fill="layer 2", unit_weight=weights(COLUMN), k0={"layer 2": 1.1}))
    stress, y = site.fem.points.stress, site.fem.points.coordinates()[:, 1]
    own = np.where(y > 3, 18e3 * (4 - y), 18e3 + 20e3 * (3 - y))
    below = 0.6 * own + 32e3 * POISSON / (1 - POISSON)
    expected = -np.where(y > 4, 1.1 * 16e3 * (6 - y), below)
    assert np.allclose(stress[:, 0], expected, rtol=0, atol=1e-8 * 150e3)


def test_a_layer_on_older_ground_does_not_bend(pit, monkeypatch):
    """Beside the sides of a pit, on its floor: it is weighed as on rigid ground, to about 1 / HELD."""
    placed = []
    for held in (at_rest.HELD, 1e3 * at_rest.HELD, 1.0):
        monkeypatch.setattr(at_rest, "HELD", held)
        site = site_of(pit, elastic(PIT))
        carried_out(site, bridge.Stage("sides", fill=["ground", "pit 2"], unit_weight=weights(PIT)))
        stage = bridge.Stage("fill", fill="pit 1", unit_weight=weights(PIT), k0={"pit 1": 0.5})
        state, _, _ = site.state.after(stage)
        before, laws = site.state.there, site.fem.law_by_tag()
        placed.append(at_rest.stress_at_rest(site.fem, state, (), laws, state.k0_of(stage), before)[0])
    apart = [np.abs(stress - placed[1]).max() / np.abs(placed[1]).max() for stress in placed]
    assert apart[0] < 1e-3 < 0.05 < apart[2]


def test_a_slope_is_in_equilibrium_and_has_k0_far_below_level_ground(tmp_path):
    """Tresca ground that is strong enough everywhere stays as it comes; its influence ends within some heights of the layer."""
    text = geometry([(0, 0, 60, 6), (0, 5, 12, 1)], {"cut": 2, "ground": 3}, 60, ("floor", 0, 5, 12, 5), 0.5)
    (tmp_path / "cut.geo").write_text(text)
    mesh = bridge.read_mesh(tmp_path / "cut.geo", MPI.COMM_WORLD)
    soil = mpm.tresca(young=20e6, poisson=0.45, shear_strength=80e3)
    site = site_of(mesh, dict.fromkeys(["cut", "ground"], soil))
    stage = bridge.Stage("in situ", fill="ground", unit_weight={"ground": 20e3}, k0={"ground": 1.3})
    [report] = carried_out(site, stage)
    assert report.largest_displacement < 1e-12 and site.fem.reaction("base")[1] == pytest.approx(-20e3 * (360 - 12))
    far = site.fem.evaluate_at([(40.0, 1.0), (40.0, 3.0), (45.0, 2.0)], smooth=True)["stress"]
    depth = np.array([5.0, 3.0, 4.0])
    assert np.allclose(far[:, 0], -1.3 * 20e3 * depth, rtol=0.01) and np.allclose(far[:, 1], -20e3 * depth, rtol=0.01)


def at_rest_beyond_strength(column, cohesion, k0):
    """Site of one soil, (n,) vertical stresses by weight, and where K0 times them is beyond the strength, with its warning."""
    soil = mpm.MohrCoulomb(young=20e6, poisson=0.3, cohesion=cohesion, friction_angle=30.0, dilation_angle=30.0)
    site = site_of(column, dict.fromkeys(COLUMN, soil))
    stage = bridge.Stage("in situ", fill=COLUMN, unit_weight=dict.fromkeys(COLUMN, 20e3), k0=dict.fromkeys(COLUMN, k0))
    with pytest.warns(RuntimeWarning, match="stage 'in situ': k0: the stresses are beyond the strength") as said:
        carried_out(site, stage)
    vertical = 20e3 * (6 - site.fem.points.coordinates()[:, 1])
    beyond = max(k0, 1) * vertical > 3 * min(k0, 1) * vertical + 2 * cohesion * np.sqrt(3)  # Kp = 3
    assert f"at {beyond.mean():.1%} of the points" in str(said[0].message)
    return site, vertical, beyond


@pytest.mark.parametrize("k0", [4.5, 0.1])
def test_sand_whose_k0_is_beyond_the_strength_has_that_of_its_strength(column, k0):
    """The return to it, associated, leaves the soil at its limit: passive pressure of K0 above Kp. K0 of 0.1 < Ka = 1/3 returns along C (1, -3/2),
    where the lateral strain is along both axes, to v = 1.041 and h = v / 3 times the weight; v then goes back to 1, by which h would fall by
    nu / (1 - nu) = 3/7 of it, more than a third: it is active pressure."""
    site, vertical, beyond = at_rest_beyond_strength(column, 0.0, k0)
    stress, expected = -site.fem.points.stress, 3.0 if k0 > 1 else 1 / 3
    assert beyond.all()
    assert np.allclose(stress[:, 1], vertical, rtol=0, atol=1e-6 * 120e3)
    assert np.allclose(stress[:, 0], expected * vertical, rtol=0, atol=1e-6 * 120e3)


@pytest.mark.parametrize("k0", [4.5, 0.1])
def test_k0_is_kept_where_it_is_within_the_strength(column, k0):
    """Cohesive soil near the surface; below it the strength holds, and all of it is in equilibrium."""
    site, vertical, beyond = at_rest_beyond_strength(column, 5e3, k0)
    stress = -site.fem.points.stress
    far = vertical < 0.5 * vertical[beyond].min()  # of cells of one kind
    assert 0.1 < beyond.mean() < 0.95 and far.any()
    assert np.allclose(stress[far, 0], k0 * vertical[far], rtol=0.02, atol=50.0)
    ends = np.sort(stress[:, :3], axis=1)
    assert np.all(ends[:, 2] <= 3 * ends[:, 0] + 2 * 5e3 * np.sqrt(3) + 1.0)
    assert site.fem.reaction("base")[1] == pytest.approx(-120e3)


def test_stiff_ground_beside_soft_ground_does_not_carry_its_weight(pit):
    """The pit filled with soil of other stiffness but the same weight: level ground with the K0 of each soil, of which equal ones stay as they are."""
    site = site_of(pit, elastic(PIT))
    stage = bridge.Stage("in situ", fill=PIT, unit_weight=dict.fromkeys(PIT, 20e3), k0=dict.fromkeys(PIT, 1.2))
    [report] = carried_out(site, stage)
    vertical = -20e3 * (6 - site.fem.points.coordinates()[:, 1])
    assert np.abs(site.fem.points.stress[:, :2] - np.column_stack([1.2 * vertical, vertical])).max() < 1e-8 * 120e3
    assert report.largest_displacement < 1e-12


def test_the_force_of_a_strut_grows_with_k0_in_proportion(pit):
    """Elastic soil: stresses of level ground are linear in K0, and so is what the cut releases."""
    forces, same = [], dict.fromkeys(PIT, 20e3)
    for k0 in (0.5, 1.0, 1.5):
        site = site_of(pit, elastic(PIT))
        strut = mpm.strut((3.0, 5.0), (0.0, 5.0), axial_stiffness=1e8, fixed_end=True)
        carried_out(site, bridge.Stage("in situ", fill=PIT, unit_weight=same, k0=dict.fromkeys(PIT, k0)), DIG[0],
                    bridge.Stage("strut", install={"strut": strut}), bridge.Stage("dig 2", excavate="pit 2"))  # fmt: skip
        forces.append(site.fem.member_forces("strut").axial_force.min())
    first, second = np.diff(forces)
    assert first < -1.0 and second == pytest.approx(first, rel=1e-7)


def test_ground_at_rest_that_does_not_drain_has_its_effective_stress(column):
    """Its weight is borne by the skeleton, not by the pore water, as it is without K0."""
    soil = mpm.Undrained(elastic(COLUMN)["ground"], porosity=0.4)
    stage = bridge.Stage("in situ", **LAYERS, k0=K0)
    site, without = (site_of(column, dict.fromkeys(COLUMN, soil)) for _ in range(2))
    carried_out(site, stage)
    carried_out(without, bridge.Stage("in situ", **LAYERS))
    excess = [fem.points.state[:, soil.state_names.index("excess_pore_pressure")] for fem in (site.fem, without.fem)]
    vertical, k0 = layers_by_hand(site.fem.points.coordinates()[:, 1])
    assert np.abs(excess[0]).max() < 1e-6 * np.abs(excess[1]).max()
    assert np.allclose(site.fem.points.stress[:, 0], k0 * vertical, rtol=0, atol=1e-8 * 150e3)


def test_a_wall_that_holds_water_back_comes_without_forces(pit, recwarn):
    """The soil on both sides bears the difference of the water, which moves it without K0."""
    wall = mpm.beam([(3.0, 6.0), (3.0, 3.0)], axial_stiffness=1e9, bending_stiffness=1e7, impervious=True)
    stage = {"fill": PIT, "unit_weight": dict.fromkeys(PIT, 20e3), "install": {"wall": wall},
             "pore_pressure": lambda x: 9810 * np.maximum(np.where(x[:, 0] < 3, 4.0, 5.5) - x[:, 1], 0)}  # fmt: skip
    site, without = (site_of(pit, dict.fromkeys(PIT, elastic(PIT)["ground"])) for _ in range(2))
    [report] = carried_out(site, bridge.Stage("in situ", **stage, k0=dict.fromkeys(PIT, 0.9)))
    [moved] = carried_out(without, bridge.Stage("in situ", **stage))
    moments = [np.abs(one.fem.member_forces("wall").moment).max() for one in (site, without)]
    assert moments[0] < 1e-6 * moments[1] and report.largest_displacement < 1e-6 * moved.largest_displacement
    assert not [one for one in recwarn if "stiff" in str(one.message)]


def particle_site(mesh, laws, **options):
    model = mpm.Model(bridge.background_mesh(*mesh), list(laws.values()), geometry=options.pop("geometry", None))
    return bridge.ParticleSite(model, {soil: k for k, soil in enumerate(laws)}, ROLLERS, **options)


@pytest.mark.parametrize("shape, nmd", [(None, False), (None, True), (AXISYMMETRIC, False)])
def test_particles_have_the_stresses_of_the_finite_elements(pit, shape, nmd):
    """On the same cells, of ground beside a pit, one part of which comes later; elements average as particles do."""
    stages = [bridge.Stage("in situ", fill=["ground", "pit 2"], unit_weight=weights(PIT), k0={"ground": 1.2, "pit 2": 0.4},
                           pore_pressure=bridge.hydrostatic(2.0)),
              bridge.Stage("fill", fill="pit 1", unit_weight=weights(PIT), k0={"pit 1": 0.9})]  # fmt: skip
    fem = site_of(pit, elastic(PIT), first_step=1.0, degree=1, nmd=nmd, geometry=shape, as_particles=nmd)
    particles = particle_site(pit, elastic(PIT), geometry=shape, nmd=nmd, small_displacements=True, tolerance=1e-8)
    for stage in stages:
        fem.carry_out(stage)
        report = particles.carry_out(stage)
        p = particles.model.particles
        expected = fem.fem.evaluate_at(p.position)["stress"]
        assert np.abs(p.stress - expected).max() < 1e-8 * np.abs(expected).max()
    assert report.largest_displacement > 1e-5  # the ground settles below the fill


def test_particles_beyond_the_strength_are_warned_of(pit):
    soil = mpm.MohrCoulomb(young=20e6, poisson=0.3, cohesion=5e3, friction_angle=30.0, dilation_angle=30.0)
    site = particle_site(pit, dict.fromkeys(PIT, soil), small_displacements=True)
    with pytest.warns(RuntimeWarning, match=r"stage 'in situ': k0: .* beyond the strength of the soil at \d"):
        site.carry_out(bridge.Stage("in situ", fill=PIT, unit_weight=weights(PIT), k0=dict.fromkeys(PIT, 5.0)))


@pytest.mark.parametrize(
    "values, message",
    [
        ({"k0": 0.5}, "stage 'a': k0 is 0.5, expected a dictionary by soil"),
        ({"k0": {"ground": 0.0}}, "stage 'a': k0 is 0.0 for 'ground', expected a number above 0"),
        ({"k0": {"ground": np.nan}}, "stage 'a': k0 is nan for 'ground', expected a number above 0"),
        (
            {"k0": {"ground": 50}},
            "stage 'a': k0 is 50 for 'ground', expected a number above 0 and up to 10, such as 0.5",
        ),
        ({"k0": {"sand": 0.5}}, "stage 'a': k0: .*'sand'"),
        ({"k0": {"pit 1": 0.5}}, "stage 'a': k0 is given for 'pit 1', expected a soil of fill"),
        ({"k0": {"ground": 0.5}, "stress": lambda x: x}, "stage 'a': stress and k0 are given, expected one of them"),
    ],
)
def test_wrong_k0_changes_nothing(pit, values, message):
    stage = bridge.Stage("a", fill="ground", unit_weight=weights(PIT), **values)
    for site in (site_of(pit, elastic(PIT)), particle_site(pit, elastic(PIT))):
        with pytest.raises(bridge.InputError, match=message):
            site.carry_out(stage)
        assert site.number == 0 and site.state.there == ()
        site.carry_out(IN_SITU)
