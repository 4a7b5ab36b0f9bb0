"""One second of the run-out of saturated clay by the schemes that can compute it: processor times, and how far it slides.

    python3 tests/bench/clay_schemes.py --cell-size 0.2

A slope at 45 degrees, 4 m high, with 4 m of level ground behind it, is let go with the stresses of level ground at rest: pore
pressures that grow with the depth below the surface, and horizontal effective stresses that are half of the vertical ones. The
schemes are explicit steps with separate velocities of soil and water, explicit steps with a law of undrained soil of the same
skeleton, which has no water of its own, and implicit steps with incompressible water. The table is printed in Markdown.
"""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Callable
from time import process_time
from typing import Any

import numpy as np
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

HEIGHT, CREST, DURATION = 4.0, 4.0, 1.0  # m, m, s
GRAVITY, WATER, GRAINS, POROSITY = 9.81, 1000.0, 2650.0, 0.45  # m/s2, kg/m3, kg/m3
DENSITY = (1 - POROSITY) * GRAINS + POROSITY * WATER
FRONT = 0.01
"""Part of the soil that lies beyond its front"""
CLAY = mpm.MohrCoulomb(young=2e6, poisson=0.3, cohesion=3e3, friction_angle=20.0, dilation_angle=0.0)


def slope(a: argparse.Namespace, law: Any) -> mpm.Model:
    """The slope without stresses and water."""
    mesh = bridge.slope_mesh(MPI.COMM_SELF, HEIGHT, 45.0, CREST, a.cell_size, kind="crossed", runout=2.0)
    model = mpm.Model(bridge.background_mesh(*mesh), law)
    model.seed(density=DENSITY, per_cell=a.particles_per_cell, cell_tag=bridge.SOIL)
    model.roller(bridge.LEFT, (1, 0))
    model.roller(bridge.RIGHT, (1, 0))
    model.fix(bridge.BASE)
    model.set_gravity((0.0, -GRAVITY))
    return model


def depth(x: np.ndarray) -> np.ndarray:
    """Depth of places (n, 2) below the surface of the slope [m]."""
    return np.maximum(HEIGHT - np.maximum(x[:, 0] - CREST, 0.0) - x[:, 1], 0.0)


def effective(x: np.ndarray) -> np.ndarray:
    """Effective stresses at places (n, 2) [Pa], shape (n, 4)."""
    return -(DENSITY - WATER) * GRAVITY * depth(x)[:, None] * np.array([0.5, 1.0, 0.5, 0.0])


def pressure(x: np.ndarray) -> np.ndarray:
    """Pore pressures at places (n, 2) [Pa]."""
    return WATER * GRAVITY * depth(x)


def with_water(a: argparse.Namespace, modulus: float) -> mpm.Model:
    """The slope, its pores full of water with a bulk modulus [Pa]."""
    model = slope(a, CLAY)
    model.add_water(porosity=POROSITY, conductivity=1e-9, modulus=modulus)
    model.set_pore_pressure(pressure)
    model.particles.set("stress", effective(model.particles.position))
    return model


def undrained(a: argparse.Namespace, modulus: float) -> mpm.Model:
    """The slope of a law of undrained soil, with total stresses."""
    model = slope(a, mpm.Undrained(CLAY, water_modulus=modulus, porosity=POROSITY))
    x = model.particles.position
    model.particles.set("stress", effective(x) - pressure(x)[:, None] * np.array([1.0, 1.0, 1.0, 0.0]))
    model.set_state("excess_pore_pressure", pressure(x))
    return model


def front(x: np.ndarray, volume: np.ndarray) -> float:
    """Position of the front of the soil [m], from the positions of its particles along the slope and their volumes."""
    order = np.argsort(x)
    filled = np.cumsum(volume[order])
    return float(np.interp((1 - FRONT) * filled[-1], filled, x[order]))


def slide(model: mpm.Model, run: Callable[[mpm.Model], mpm.Reports]) -> str:
    """Let the slope go; the columns of the table behind the name."""
    count, start = len(model.particles), process_time()
    report = run(model).last()
    seconds, p = process_time() - start, model.particles
    if len(p) != count or abs(model.time - DURATION) > 1e-9:
        raise RuntimeError(f"{len(p)} of {count} particles are left after {model.time:g} s")
    ahead = front(p.position[:, 0], p.volume) - front(p.initial_position[:, 0], p.volume)
    x, y = p.initial_position.T
    shoulder = (y > HEIGHT - 0.2) & (x > CREST - 0.2) & (x < CREST)
    return (f"{1e3 * DURATION / model.steps:.2g} | {seconds:.1f} | {ahead:.2f} | {-p.displacement[shoulder, 1].mean():.2f} | "
            f"{100 * report.unexplained_fraction:.1f}")  # fmt: skip


def main() -> None:
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("--cell-size", type=float, default=0.2, help="edge of the squares, which are cut in four [m]")
    p.add_argument("--particles-per-cell", type=int, default=4, help="in each triangle")
    p.add_argument("--integration", choices=["MIXED", "PARTICLES"], default="MIXED", help="see docs/integration.md")
    p.add_argument(
        "--moduli", type=float, nargs="*", default=[200.0, 60.0, 20.0], help="of the water in explicit steps [MPa]"
    )
    p.add_argument(
        "--steps", type=float, nargs="*", default=[5.0, 10.0, 20.0], help="lengths of the implicit steps [ms]"
    )
    a = p.parse_args()
    options = {"nmd": True, "integration": getattr(mpm.Integration, a.integration)}
    explicit = lambda model: model.explicit(DURATION, **options)
    warnings.simplefilter("ignore", mpm.EnergyWarning)  # the table has it
    print("| scheme | step [ms] | time [s] | front moves by [m] | crest settles by [m] | unexplained energy [%] |")
    print("| --- | --- | --- | --- | --- | --- |")
    for name, make in (("separate velocities", with_water), ("undrained soil", undrained)):
        for modulus in a.moduli:
            scheme = f"explicit, {name}, K_w {modulus:g} MPa"
            print(f"| {scheme} | {slide(make(a, 1e6 * modulus), explicit)} |", flush=True)
    for dt in a.steps:
        implicit = lambda model, dt=dt: model.implicit(DURATION, dt=1e-3 * dt, **options)
        print(f"| implicit, K_w infinite | {slide(with_water(a, np.inf), implicit)} |", flush=True)
    print(f"\nDrained soil would have explicit steps of {500 * slope(a, CLAY).critical_time_step():.2g} ms.")


if __name__ == "__main__":
    main()
