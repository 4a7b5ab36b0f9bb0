"""Text in the place of a number, as it comes from a file or a form, is an error that names the argument."""

import pytest
from core_cases import box
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water

SOIL = mpm.MohrCoulomb(young=1e6, poisson=0.3, cohesion=1e3, friction_angle=25.0)


def model():
    return mpm.Model(box((2, 2)), SOIL)


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
        (lambda: bridge.hydrostatic(0.0, unit_weight="9810"), "unit_weight is '9810' N/m3"),
    ],
)
def test_text_for_a_number_is_refused(call, words):
    with pytest.raises(mpm.InputError, match=f"^{words}, expected"):
        call()
