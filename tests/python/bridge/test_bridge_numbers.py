"""Text in the place of a number, as it comes from a file or a form, is an error that names the argument."""

import numpy as np
import pytest
from core_cases import box
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water

SOIL = mpm.MohrCoulomb(young=1e6, poisson=0.3, cohesion=1e3, friction_angle=25.0)


CELLS = bridge.box_mesh(MPI.COMM_SELF, (1.0, 1.0), (2, 2))


def model():
    return mpm.Model(box((2, 2)), SOIL)


def elements():
    return bridge.QuasiStatic(CELLS[0], SOIL, CELLS[2], [bridge.fixed(3)])


@pytest.mark.parametrize(
    "call, words",
    [
        (lambda: model().add_contact(mpm.Plane((0, 0), normal=(0, 1)), friction="0.3"), "friction is '0.3'"),
        (lambda: mpm.Rayleigh(mass="5"), "mass is '5'"),
        (lambda: model().set_gravity((0, -9.81), ramp="1"), "ramp is '1'"),
        (lambda: bridge.slope_mesh(MPI.COMM_WORLD, height="1"), "height is '1' m"),
        (lambda: bridge.slope_mesh(MPI.COMM_WORLD, angle="45"), "angle is '45' degrees"),
        (lambda: bridge.reduced_strength(SOIL, "2"), "factor is '2'"),
        (lambda: bridge.reduced_strength("clay", 2.0), "law is 'clay'"),
        (lambda: water.VanGenuchten(alpha="1e-4", n=2.0), "alpha is '1e-4' 1/Pa"),
        (lambda: water.VanGenuchten(alpha=1e-4, n="2"), "n is '2'"),
        (lambda: water.Newmark(gamma="0.5"), "gamma is '0.5'"),
        (lambda: water.PorousSoil("1e-5"), "conductivity is '1e-5' m/s"),
        (lambda: mpm.tresca(young=1e6, poisson=0.3, shear_strength="20e3"), "shear_strength is '20e3'"),
        (lambda: bridge.roller("left", ("1", "0")), "normal has dtype <U1"),
        (lambda: bridge.initialise("fem", model()), "model is 'fem'"),
        (lambda: bridge.initialise(model(), "fem"), "fem is 'fem'"),
        (lambda: bridge.initialise(model(), elements(), move="no"), "move is 'no'"),
        (lambda: elements().equilibrate(bridge.Load(), duration="1"), "duration is '1'"),
        (lambda: bridge.collapse_load(elements(), bridge.Load(), 1e3), r"load_of is Load\(\)"),
        (lambda: model().equilibrate(max_steps="3"), "max_steps is '3'"),
        (lambda: model().equilibrate(max_steps=0), "max_steps is 0"),
        (lambda: bridge.hydrostatic(0.0, unit_weight="9810"), "unit_weight is '9810' N/m3"),
    ],
)
def test_text_for_a_number_is_refused(call, words):
    with pytest.raises(mpm.InputError, match=f"^{words}, expected"):
        call()


def filled(**options):
    new = mpm.Model(box((2, 2)), SOIL, **options)
    new.seed(density=2000.0, per_cell=3)
    return new


TEXTS = np.array(["1.5", "2.5"])


def seepage(condition):
    domain, cell_tags, facet_tags = CELLS
    return water.Seepage(domain, water.PorousSoil(1e-5), facet_tags, [condition])


@pytest.mark.parametrize(
    "call, words",
    [
        (lambda: bridge.box_mesh(MPI.COMM_SELF, ("1", "1"), (2, 2)), r"lengths is \('1', '1'\)"),
        (lambda: bridge.PointSearch(CELLS[0], [["0.5", "0.5"]]), "points is .*'0.5'"),
        (lambda: bridge.PointSearch(CELLS[0], np.array([[0.5, 0.5j]])), "points is .*0.5j"),
        (lambda: bridge.PointSearch(CELLS[0], [[0.5, 0.5], [0.5]]), "points is "),
        (lambda: bridge.graded_tags(*CELLS[:2], 1, lambda x: x[:, 0].astype(str)), "value_of is array"),
        (lambda: bridge.k0_stress([["1", "2"]], 3.0, 20e3, 0.5), "points is "),
        (lambda: bridge.k0_stress([[1.0, 2.0]], "3", 20e3, 0.5), "surface is '3'"),
        (lambda: bridge.k0_stress([[1.0, 2.0]], 3.0, "20e3", 0.5), "layers is "),
        (lambda: water.Tabulated((0, "1e3"), (1, 0.5), (1, 0.5)), "suction is "),
        (lambda: filled().set_state("plastic_strain", np.full(24, "0.1")), "values is array"),
        (lambda: mpm.RandomField(mean=1.0, deviation=0.1, lengths=["1", "2"]), "lengths is "),
        (lambda: seepage(water.Head(1, "3")), ".*level is '3', expected a number, a function"),
        (lambda: mpm.Motion(TEXTS, [0.0, 1.0]), "time is array"),
        (lambda: mpm.motion_of_acceleration([0.0, 1.0], TEXTS), "acceleration is array"),
        (lambda: mpm.Rayleigh(mass=1.0).ratio("2"), "frequency is '2'"),
        (lambda: mpm.ElementTest(SOIL, np.zeros(4)).step(["0", "1e-3", "0", "0"]), "strain_increment is "),
        (lambda: filled().add_water(porosity="0.4", conductivity=1e-5), "porosity is '0.4'"),
        (lambda: filled().add_water(porosity=0.4, conductivity={0: "1e-5"}), "conductivity is '1e-5'"),
        (lambda: filled().add_water(porosity=0.4, conductivity=1e-5, anisotropy=("1", "2")), "anisotropy is "),
        (lambda: filled().add_contact(mpm.Plane((0, 0), (0, 1)), velocity=("1", "0")), "velocity is "),
    ],
)
def test_text_complex_numbers_and_ragged_rows_for_an_array_are_refused(call, words):
    with pytest.raises(mpm.InputError, match=f"^{words}"):
        call()


def test_what_is_no_mesh_is_refused_by_name():
    _, _, facets = CELLS
    for call in (
        lambda domain: bridge.QuasiStatic(domain, SOIL, facets, []),
        lambda domain: bridge.background_mesh(domain),
        lambda domain: bridge.soil_mesh(domain, facets),
        lambda domain: bridge.solve_elastic(domain, facets, [], young=1e6, poisson=0.3, unit_weight=0.0),
        lambda domain: bridge.PointSearch(domain, [[0.0, 0.0]]),
        lambda domain: water.Seepage(domain, water.PorousSoil(1e-5), facets, []),
        lambda domain: water.Consolidation(domain, SOIL, water.PorousSoil(1e-5), facets, [], []),
    ):
        for wrong, words in (
            ("slope.msh", "domain is 'slope.msh', expected a mesh"),
            (CELLS, "a tuple of 3 .* the first of"),
        ):
            with pytest.raises(mpm.InputError, match=words):
                call(wrong)
