"""Undrained clay under a strip footing and in a slope: limit loads with pore water, and in total stresses.

Half of a rough footing is pushed into weightless ground with cohesion and without friction until its load no longer rises; the
limit load is 2 + π times the cohesion (Prandtl 1920). The water in the pores keeps the volume constant, as k → 0. Quadratic
displacement with linear pressure (P2-P1) carries the same load as quadratic elements of total stresses with the undrained law,
which is the expected value below. Linear displacement and pressure (P1-P1), and particles on the same nodes, do not: the water
keeps the volume around each node, but in addition the skeleton resists the change of volume of each cell, so that its
effective stresses rise without limit. Elements and particles whose volumetric strains are averaged over nodes (NMD) do not
have this error. They carry the load of linear elements of total stresses with averaged strains, which is above that of
quadratic elements on coarse meshes. The same holds for a slope of 45° under its own weight: it differs from quadratic elements
by the error of the mesh, not by the water.
"""

from __future__ import annotations

import numpy as np
from _case import Check, Result
from _plots import save_comparison
from common.results import ROOT
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water

comm = MPI.COMM_WORLD
COHESION, SHEAR, POROSITY, MODULUS = 1e3, 4e6, 0.4, 2.2e9  # Pa, Pa, -, Pa
HALF, SETTLED, STEPS = 0.5, 0.02, 20  # half width and settlement of the footing [m]
SIZES = (0.24, 0.12, 0.06)
"""Cell sizes beside the footing [m]; a quarter of these at its edge"""
AXIS, BASE, FAR, FREE, PRESSED = 1, 2, 3, 4, 5
LIMIT = 2 + np.pi
SUPPORTS = [bridge.roller(AXIS, (1, 0)), bridge.roller(FAR, (1, 0)), bridge.fixed(BASE)]
COARSE_SLOPE = (
    "With linear elements the unit weight at collapse converges from above, as it does in total stresses; cells of 0.1 m are too "
    "coarse for the tolerance."
)
COARSE = "The load converges from above with the cell size, and cells of 0.24 m are too coarse for the tolerance."


def clay():
    return mpm.MohrCoulomb(young=2.6 * SHEAR, poisson=0.3, cohesion=COHESION, friction_angle=0.0)


def undrained():
    return mpm.Undrained(clay(), water_modulus=MODULUS, porosity=POROSITY)


def ground(size):
    parameters = {"width": 4.0, "depth": 2.0, "edge_size": size / 4, "near_size": size, "far_size": 5 * size}
    return bridge.read_mesh(ROOT / "meshes" / "footing.geo", comm, parameters=parameters)


def total_stress(size, degree=2):
    """Load over the cohesion by elements with the undrained law, step by step; linear ones with averaged strains."""
    domain, _, facet_tags = ground(size)
    supports = [*SUPPORTS, bridge.prescribed(PRESSED, (0.0, -SETTLED))]
    model = bridge.QuasiStatic(domain, undrained(), facet_tags, supports, degree, nmd=degree == 1)
    loads = []
    for part in np.arange(1, STEPS + 1) / STEPS:
        if not model.equilibrate(bridge.Load(displacement=part)).converged:
            raise mpm.RunError(f"no equilibrium at {part:g} of the settlement")
        loads.append(model.reaction(PRESSED)[1] / (HALF * COHESION))
    return np.array(loads)


def coupled(size, element, nmd=False):
    """Load of the footing by finite elements of soil and water."""
    domain, _, facet_tags = ground(size)
    supports = [*SUPPORTS, bridge.prescribed(PRESSED, (0.0, -SETTLED))]
    soil = water.PorousSoil(1e-17, porosity=POROSITY)
    model = water.Consolidation(
        domain, clay(), soil, facet_tags, supports, [water.Head(FREE, 0.0)], element=element, nmd=nmd, unit_weight=1e-3,
        water_modulus=np.inf, load=lambda time: bridge.Load(displacement=time),
    )  # fmt: skip
    loads = []
    for part in np.arange(1, STEPS + 1) / STEPS:
        report = model.run(part, 1 / STEPS)[-1]
        if not report.converged:
            raise mpm.RunError(f"no equilibrium at {part:g} of the settlement: {report.reason}")
        loads.append(model.reaction(PRESSED)[1] / (HALF * COHESION))
    return np.array(loads)


def slope(size):
    """Unit weights, in multiples of cohesion over height, under which a slope of 45° collapses, to 1/2000 of it.

    By total stresses with quadratic and with averaged linear elements, and by soil and water with both, P2-P1 and P1-P1.
    """
    background = bridge.slope_mesh(comm, height=1.0, angle=45.0, crest=1.2, cell_size=size, kind="fitted")
    domain, _, facet_tags = bridge.soil_mesh(*background)
    supports, found = [bridge.roller(bridge.LEFT, (1, 0)), bridge.fixed(bridge.BASE)], []
    for degree in (2, 1):
        model = bridge.QuasiStatic(domain, undrained(), facet_tags, supports, degree, nmd=degree == 1)
        model.solve(bridge.Load(unit_weight=20 * COHESION), first_step=0.2, tolerance=1e-3)
        found.append(model.load.unit_weight / COHESION)
    for element in (water.Element.TAYLOR_HOOD, water.Element.STABILISED):
        found.append(carried_unit_weight(domain, facet_tags, supports, element) / COHESION)
    return found


def carried_unit_weight(domain, facet_tags, supports, element):
    """Largest unit weight [N/m3] with an equilibrium of soil and water."""
    model = water.Consolidation(
        domain, clay(), water.PorousSoil(1e-17, porosity=POROSITY), facet_tags, supports, [], element=element,
        nmd=element == water.Element.STABILISED, unit_weight=1e-3,
    )  # fmt: skip
    carried, more = 0.0, 2 * COHESION
    while more > 3e-3 * COHESION:
        model.load = bridge.Load(unit_weight=carried + more)
        if model.advance(1.0).converged:
            carried += more
        else:
            more /= 2
    return carried


def particles(size, *, wet=True):
    """Load by implicit particles with NMD and water, or the undrained law, one per cell: work of the footing over its path."""
    model = mpm.Model(bridge.background_mesh(*ground(size)), clay() if wet else undrained())
    model.seed(density=2000.0, per_cell=1)
    bridge.apply_supports(model, SUPPORTS)
    model.prescribe(PRESSED, (0.0, -SETTLED))
    if wet:
        model.add_water(porosity=POROSITY, conductivity=1e-17, modulus=MODULUS)
        model.hold_pore_pressure(FREE, 0.0)
    steps = model.implicit(
        1.0, dt=1 / STEPS, every=1 / STEPS, quasi_static=True, small_displacements=True, nmd=True,
        solver=mpm.Newton(max_iterations=100),
    )  # fmt: skip
    works = [0.0] + [report.support_work for report in steps]
    return np.diff(works) * STEPS / (SETTLED * HALF * COHESION)


def run(quick: bool, folder) -> Result:
    way = np.arange(1, STEPS + 1) / STEPS * SETTLED / HALF
    checks, found = [], {}
    for size in SIZES[:1] if quick else SIZES:
        expected, averaged = total_stress(size)[-1], total_stress(size, degree=1)[-1]
        curves = {
            "P2-P1": coupled(size, water.Element.TAYLOR_HOOD),
            "P1-P1, NMD": coupled(size, water.Element.STABILISED, nmd=True),
            "particles, NMD": particles(size),
            "particles, NMD, undrained law": particles(size, wet=False),
        }
        for name, loads in curves.items():
            limit = COARSE if "NMD" in name and size > 0.2 else ""
            checks.append(Check(f"load over the cohesion, cells of {size:g} m", expected, "quadratic elements, total stresses",
                                loads[-1], 0.02, limit=limit, method=name))  # fmt: skip
            if "NMD" in name:
                checks.append(Check(f"load over the cohesion, cells of {size:g} m, against linear elements", averaged,
                                    "linear elements with averages, total stresses", loads[-1], 0.02, method=name))  # fmt: skip
        curves |= {"P1-P1": coupled(size, water.Element.STABILISED)}
        shown = ("P1-P1", "P1-P1, NMD", "particles, NMD")
        found |= {f"cells of {size:g} m, {name}": (100 * way, curves[name]) for name in shown}
        checks.append(Check(f"load of total stresses over the cohesion, cells of {size:g} m", LIMIT, "2 + π, Prandtl 1920",
                            expected, 0.05, limit=COARSE if size > 0.2 else "", method="P2"))  # fmt: skip
    for size in (0.2,) if quick else (0.1, 0.05):
        quadratic, linear, taylor_hood, wet = slope(size)
        name = f"slope, unit weight at collapse over the cohesion, cells of {size:g} m"
        checks.append(Check(name, quadratic, "quadratic elements, total stresses", taylor_hood, 0.02, "1/m",
                            method="P2-P1"))  # fmt: skip
        checks.append(Check(name, quadratic, "quadratic elements, total stresses", wet, 0.02, "1/m",
                            limit=COARSE_SLOPE if size > 0.05 else "", method="P1-P1, NMD"))  # fmt: skip
        checks.append(Check(f"{name}, against linear elements", linear, "linear elements with averages, total stresses", wet,
                            0.02, "1/m", method="P1-P1, NMD"))  # fmt: skip
    if comm.rank == 0:
        labels = "Settlement over half the width [%]", "Load over the cohesion [-]"
        save_comparison(
            folder / "load.png", found, {"2 + π": ([0, 4], [LIMIT, LIMIT])}, labels, limits=((0, 4), (0, 14))
        )
    caption = "Load of a footing on soil whose water does not leave, without and with averaged volumetric strains"
    return Result(checks, {"load.png": caption})
