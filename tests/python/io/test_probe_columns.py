"""Columns of probes: their names, and the balance of energy that they close."""

import numpy as np
import pytest
from core_cases import box
from mpm_core.probes import ParticleProbe, PointProbe, TotalsProbe

import mpm_core as mpm

STRESS = [-1e3, -2e3, -3e3, 4e2]


@pytest.mark.parametrize(
    ("geometry", "third"), [(mpm.Geometry.AXISYMMETRIC, "hoop"), (mpm.Geometry.PLANE_STRAIN, "zz")]
)
def test_the_third_axis_of_the_stress_is_the_hoop_in_axial_symmetry(geometry, third):
    model = mpm.Model(box((2, 2)), mpm.LinearElastic(young=1e6, poisson=0.3), geometry=geometry)
    model.seed(density=2000.0, per_cell=3)
    model.particles.set("stress", np.tile(STRESS, (len(model.particles), 1)))
    for probe in (ParticleProbe(model, [(0.4, 0.3)]), PointProbe(model, [(0.4, 0.3)])):
        found = {name: value for name, value in probe.values().items() if name.startswith("stress")}
        names = [f"stress_{part}_Pa" for part in ("xx", "yy", third, "xy")]
        assert found == pytest.approx(dict(zip(names, STRESS, strict=True)))


def test_the_energies_of_all_totals_are_a_balance_where_water_flows():
    """Soil without inertia that a load presses, and whose water flows out: no energy is kinetic."""
    model = mpm.Model(box((2, 10), (0.2, 1.0)), mpm.LinearElastic(young=10e6, poisson=0.3))
    model.seed(density=2000.0, per_cell=3)
    for tag in (1, 2):
        model.roller(tag, (1, 0))
    model.fix(3)
    model.add_water(porosity=0.4, conductivity=1e-6)
    model.hold_pore_pressure(4, 0.0)
    model.press_surface(4, 10e3)
    totals = TotalsProbe(model)
    model.implicit(200.0, dt=20.0, quasi_static=True).last()
    found = totals.values()
    spent = ("stress_work", "damping_work", "drag_work", "friction_work", "pic_loss", "unexplained_energy")
    brought = found["external_work_J"] + found["support_work_J"]
    assert brought == pytest.approx(sum(found[f"{name}_J"] for name in spent), rel=1e-9)
    assert found["drag_work_J"] > 0.3 * brought > 0
