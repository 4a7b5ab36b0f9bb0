"""The slope that several studies share: its options, mesh, soil, supports and initial stresses."""

from __future__ import annotations

import argparse
from dataclasses import dataclass

import fenics_bridge as bridge
import mpm_core as mpm
import numpy as np
from mpi4py import MPI

GRAVITY = 9.81
"""[m/s2]; unit weights are turned into densities with it."""


def add_slope_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of the slope's geometry, soil and mesh; the defaults are the paper's, section 6."""
    group = parser.add_argument_group("slope")
    group.add_argument("--height", type=float, default=1.0, help="height of the slope [m]")
    group.add_argument("--angle", type=float, default=45.0, help="inclination [degrees], up to 90")
    group.add_argument("--crest", type=float, default=1.1, help="length of the level crest [m]")
    group.add_argument("--runout-length", type=float, default=2.0, help="background mesh beyond the toe [m]")
    group.add_argument("--cell-size", type=float, default=0.1, help="side of the squares or triangles [m]")
    group.add_argument(
        "--mesh", choices=("crossed", "gmsh"), default="crossed", help="squares cut by their diagonals, or unstructured"
    )
    group = parser.add_argument_group("soil")
    group.add_argument("--unit-weight", type=float, default=80e3, help="unit weight that makes it slide [N/m3]")
    group.add_argument("--young", type=float, default=200e3, help="Young's modulus [Pa]")
    group.add_argument("--poisson", type=float, default=0.33, help="Poisson's ratio [-]")
    group.add_argument("--cohesion", type=float, default=1e3, help="cohesion [Pa]")
    group.add_argument("--friction-angle", type=float, default=25.0, help="friction angle [degrees]")
    group.add_argument("--dilation-angle", type=float, default=0.0, help="dilation angle [degrees]")


@dataclass
class SlopeCase:
    """The slope as a particle model on its background mesh."""

    args: argparse.Namespace
    domain: object
    cell_tags: object
    facet_tags: object
    soil: mpm.MohrCoulomb
    model: mpm.Model

    @property
    def toe(self) -> float:
        """Abscissa of the toe before the slide [m]."""
        return self.args.crest + self.args.height / np.tan(np.radians(self.args.angle))

    @property
    def surface(self) -> np.ndarray:
        """Ground surface before the slide, polyline of points (x, y) [m]."""
        a = self.args
        return np.array([(0.0, a.height), (a.crest, a.height), (self.toe, 0.0)])


def soil_of(args: argparse.Namespace) -> mpm.MohrCoulomb:
    """The soil that the options describe."""
    return mpm.MohrCoulomb(
        young=args.young,
        poisson=args.poisson,
        cohesion=args.cohesion,
        friction_angle=args.friction_angle,
        dilation_angle=args.dilation_angle,
    )


def build_slope(args: argparse.Namespace, comm: MPI.Comm) -> SlopeCase:
    """Mesh, particles, supports and gravity; no stresses yet. Collective."""
    soil = soil_of(args)
    if not args.unit_weight > 0:
        raise mpm.InputError(f"unit_weight is {args.unit_weight} N/m3, expected a positive number")
    domain, cell_tags, facet_tags = bridge.slope_mesh(
        comm,
        height=args.height,
        angle=args.angle,
        crest=args.crest,
        cell_size=args.cell_size,
        kind=args.mesh,
        runout=args.runout_length,
    )
    model = mpm.Model(bridge.background_mesh(domain, cell_tags, facet_tags), soil)
    model.seed(density=args.unit_weight / GRAVITY, per_cell=args.particles_per_cell, cell_tag=bridge.SOIL)
    model.roller(bridge.LEFT, normal=(1, 0))
    model.fix(bridge.BASE)
    model.set_gravity((0.0, -GRAVITY))
    return SlopeCase(args, domain, cell_tags, facet_tags, soil, model)


def fem_stress(case: SlopeCase, unit_weight: float) -> np.ndarray:
    """Stresses at the particles from elastic equilibrium of the soil body under its weight, by FEM: (n, 4) [Pa]."""
    body, _, body_facets = bridge.soil_mesh(case.domain, case.cell_tags, case.facet_tags, tag=bridge.SOIL)
    supports = [bridge.roller(bridge.LEFT, (1, 0)), bridge.fixed(bridge.BASE)]
    solution = bridge.solve_elastic(body, body_facets, supports, case.soil.young, case.soil.poisson, unit_weight)
    return solution.evaluate_at(case.model.particles.position)["stress"]


def initialise(case: SlopeCase, kind: str, unit_weight: float) -> float:
    """Give the particles their initial stresses: from FEM, by K0, or none.

    Returns the ratio of out-of-balance to external force under that unit weight [-]; 1 without stresses. Collective.
    """
    particles = case.model.particles
    if kind == "fem":
        particles.set("stress", fem_stress(case, unit_weight))
    elif kind == "k0":
        k0 = bridge.k0_elastic(case.soil.poisson)
        particles.set("stress", bridge.k0_stress(particles.position, case.surface, unit_weight, k0))
    elif kind != "zero":
        raise mpm.InputError(f"initial is {kind!r}, expected fem, k0 or zero")
    return case.model.out_of_balance((0.0, -GRAVITY * unit_weight / case.args.unit_weight))
