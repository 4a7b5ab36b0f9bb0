"""The slope that several studies share: its options, mesh, soil, supports and initial stresses."""

from __future__ import annotations

import argparse
from dataclasses import dataclass

import fenics_bridge as bridge
import mpm_core as mpm
import numpy as np
from mpi4py import MPI

from .options import add_choice, add_count, add_number
from .plots import Scene

GRAVITY = 9.81
"""[m/s2]; unit weights are turned into densities with it."""


def add_slope_options(parser: argparse.ArgumentParser) -> None:
    """Options of the slope's geometry, mesh and soil; the defaults are the paper's, section 6."""
    add_number(parser, "--height", 1.0, "m", "height of the slope", above=0)
    add_number(parser, "--angle", 45.0, "degrees", "inclination of the slope", above=0, at_most=90)
    add_number(parser, "--crest", 1.1, "m", "length of the level crest", above=0)
    add_number(parser, "--runout-length", 2.0, "m", "background mesh beyond the toe", above=0)
    add_number(parser, "--cell-size", 0.1, "m", "side of the squares or of the triangles", above=0)
    add_choice(parser, "--mesh", "crossed", ("crossed", "gmsh"), "squares cut by their diagonals, or unstructured")
    add_count(parser, "--particles-per-cell", 10, "particles in each soil cell at the start: 1, 3, 4, 6, 10, 12, ...")
    add_number(parser, "--unit-weight", 80e3, "N/m3", "unit weight of the soil", above=0)
    add_number(parser, "--young", 200e3, "Pa", "Young's modulus", above=0)
    add_number(parser, "--poisson", 0.33, "-", "Poisson's ratio", above=-1, below=0.5)
    add_number(parser, "--cohesion", 1e3, "Pa", "cohesion", at_least=0)
    add_number(parser, "--friction-angle", 25.0, "degrees", "friction angle", at_least=0, below=90)
    add_number(parser, "--dilation-angle", 0.0, "degrees", "dilation angle, at most the friction angle", at_least=0)


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

    def scene(self) -> Scene | None:
        """The whole background mesh for pictures, on the first rank; None on the others. Collective."""
        comm, mesh = self.model.comm, self.model.mesh
        n = mesh.owned_cells
        corners = comm.gather(mesh.points[mesh.cells[:n]])
        tags = comm.gather(mesh.cell_tags[:n])
        if comm.rank != 0:
            return None
        corners = np.concatenate(corners)
        points, cells = np.unique(corners.reshape(-1, 2), axis=0, return_inverse=True)
        return Scene(points, cells.reshape(-1, 3), np.concatenate(tags) == bridge.SOIL)

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
    """Give the particles their initial stresses: "fem", "k0" or "zero".

    Returns the ratio of out-of-balance to external force under that unit weight [-]; 1 without stresses. Collective.
    """
    particles = case.model.particles
    if kind == "fem":
        particles.set("stress", fem_stress(case, unit_weight))
    elif kind == "k0":
        k0 = bridge.k0_elastic(case.soil.poisson)
        particles.set("stress", bridge.k0_stress(particles.position, case.surface, unit_weight, k0))
    return case.model.out_of_balance((0.0, -GRAVITY * unit_weight / case.args.unit_weight))
