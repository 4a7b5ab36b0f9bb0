"""Pore water of a wet heap in implicit steps: the same in a problem of any size, and after a restart in the midst of its motion.

Units are powers of two, so that the numbers of two runs in other units have the same digits, but for the linear solver.
"""

import h5py
import numpy as np
import pytest
from core_cases import box, by_id, rollers

import mpm_core as mpm

END, DT = 0.16, 0.01


def heap(length=1.0, time=1.0, mass=1.0):
    """A block of soil full of water that slides down a smooth incline and spreads, in units of so many m, s and kg."""
    pressure, density = mass / length / time**2, mass / length**3
    mesh = box((24, 6), (2.4, 0.6), diagonals="alternating", body=((0.1, 0.0), (0.6, 0.4)), place=lambda x: length * x)
    soil = mpm.MohrCoulomb(young=4e6 * pressure, poisson=0.3, cohesion=1e3 * pressure, friction_angle=25.0)
    model = mpm.Model(mesh, soil)
    model.seed(density=2000.0 * density, per_cell=6, cell_tag=1)
    rollers(model, but=(2, 4))
    model.set_gravity(np.array([2.5, -9.5]) * length / time**2)
    model.add_water(  # a conductivity is that under 9.81 m/s2, whatever the units
        porosity=0.4, conductivity=1e-3 * time, density=1000.0 * density, modulus=2e7 * pressure, drained_surface=True
    )
    return model


def slide(model, until, time=1.0):
    return list(model.implicit(until * time, dt=DT * time, integration=mpm.Integration.MIXED))


@pytest.mark.parametrize("units", [(2.0**10, 2.0**5, 2.0**30), (2.0**-10, 2.0**-5, 2.0**-30)])
@pytest.mark.filterwarnings("ignore")
def test_a_problem_of_another_size_takes_the_same_iterations(units):
    # The same density and gravity, as in a model test: lengths as l, times as the root of l, stresses as l.
    length, time, mass = units
    one, other = heap(), heap(*units)
    ours, theirs = slide(one, END), slide(other, END, time)
    assert [report.iterations for report in theirs] == [report.iterations for report in ours]
    assert np.abs(one.particles.displacement).max() > 0.05
    np.testing.assert_allclose([r.residual for r in theirs], [r.residual for r in ours], atol=1e-10)
    for name, unit in (
        ("position", length), ("velocity", length / time), ("stress", mass / length / time**2),
        ("pore_pressure", mass / length / time**2),
    ):  # fmt: skip
        expected = by_id(one, name)
        np.testing.assert_allclose(
            by_id(other, name) / unit, expected, atol=1e-9 * np.abs(expected).max(), err_msg=name
        )


@pytest.mark.filterwarnings("ignore")
def test_a_slide_that_has_taken_in_water_goes_on_from_a_file_to_the_last_bit(tmp_path):
    # Soil that shears draws water in, which brings its kinetic energy along: the energy that has left is below zero.
    first, second = heap(), heap()
    slide(first, 0.1)
    first.save(tmp_path / "state.h5")
    with h5py.File(tmp_path / "state.h5") as file:
        assert file["ranks/energy_outflow_kinetic"][0] < 0
    second.restore(tmp_path / "state.h5")
    reports = [slide(model, END)[-1] for model in (first, second)]
    assert reports[1] == reports[0]
    for name in ("position", "velocity", "stress", "pore_pressure", "mass"):
        np.testing.assert_array_equal(by_id(second, name), by_id(first, name))
