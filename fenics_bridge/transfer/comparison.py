"""Comparison of finite elements and particles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from mpi4py import MPI
from mpm_core.checks import of_kind
from numpy.typing import ArrayLike, NDArray

import mpm_core as mpm
from fenics_bridge.fem.elastic import ElasticSolution
from fenics_bridge.fem.evaluate import PointSearch
from fenics_bridge.fem.geometry import require_same_geometry
from fenics_bridge.fem.quasi_static import QuasiStatic


@dataclass(frozen=True)
class Difference:
    """Difference between particles and finite elements in one quantity, relative to the finite elements."""

    l2: float
    """Root of the volume-weighted sum of squares, over that of the finite elements [-]"""
    maximum: float
    """Largest difference over the largest value of the finite elements [-]"""
    here: NDArray[np.float64]
    """Differences at this rank's particles, particles minus finite elements, shape (n, k), in the unit of the quantity"""


def compare(
    fem: QuasiStatic | ElasticSolution, model: mpm.Model, smooth: bool = False, places: ArrayLike | None = None
) -> dict[str, Difference]:
    """Differences in displacement and stress at the particles' material points. Collective.

    A particle is compared with the finite elements at the place where it started, by which both know a material point;
    they are evaluated there (a consistent transfer: values are kept, sums need not be).

    Args:
        fem: finite elements.
        model: particles, whose displacements count from the finite elements' undeformed body.
        smooth: as for `QuasiStatic.stress_function`.
        places: other places at which to evaluate the finite elements [m], shape (n, D); for particles that were handed over and
            so never stood in the undeformed body, `model.particles.position` after the hand-over.

    Returns:
        `displacement` [m] and `stress` [Pa].

    Raises:
        InputError: the place of a particle is outside the finite elements' mesh (the message names the particle), or the
            geometries differ, or finite elements and model are in the wrong order. Raised on all ranks alike.
    """
    of_kind("fem", fem, QuasiStatic, ElasticSolution)
    of_kind("model", model, mpm.Model)
    require_same_geometry(model, fem)
    particles = model.particles
    search = PointSearch(fem.displacement.function_space.mesh, particles.initial_position if places is None else places)
    search.require_all("particles")
    stress = search.values(fem.stress_function(smooth))
    pairs = {
        "displacement": (particles.displacement, search.values(fem.displacement)),
        "stress": (particles.stress, stress),
    }
    return {name: _difference(model.comm, here, there, particles.volume) for name, (here, there) in pairs.items()}


def _difference(
    comm: MPI.Comm, values: NDArray[np.float64], reference: NDArray[np.float64], volume: NDArray[np.float64]
) -> Difference:
    difference = values - reference
    sums = [comm.allreduce(float(np.sum(volume[:, None] * a**2))) for a in (difference, reference)]
    largest = [
        comm.allreduce(float(np.linalg.norm(a, axis=1).max(initial=0.0)), MPI.MAX) for a in (difference, reference)
    ]
    return Difference(_ratio(*sums) ** 0.5, _ratio(*largest), difference)


def _ratio(above: float, below: float) -> float:
    return above / below if below > 0 else (0.0 if above == 0 else np.inf)
