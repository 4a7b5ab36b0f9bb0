"""From finite elements to particles: stress, state and displacement of an equilibrium."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fenics_bridge.errors import agree
from fenics_bridge.evaluate import PointSearch
from fenics_bridge.quasi_static import QuasiStatic


@dataclass(frozen=True)
class Handover:
    """What a hand-over did; sums are over all ranks.

    unbalanced_ratio: out-of-balance over external force of the particles as they were given their stress [-]
    settled_ratio: the same after the equilibration [-]; None when there was none
    returned_share: share of the particles whose stress had to be brought back inside the strength [-]
    yielded_share: share of the particles that yielded in the equilibration where the finite elements did not [-]
    """

    unbalanced_ratio: float
    settled_ratio: float | None
    returned_share: float
    yielded_share: float


def initialise(model, fem, *, count_displacement=True, move=False, smooth=False, equilibrate=True):
    """Start particles from an equilibrium found by finite elements (a consistent transfer: it keeps values).

    Each particle takes the stress and the state of the finite elements where it is, is returned to the yield surface
    should it be outside, and loses its velocity. The model's gravity must be that of the equilibrium.

    model: `mpm_core.Model` with particles; fem: QuasiStatic, solved and converged, or ElasticSolution; the meshes and
        their partitions may differ
    move: move particles with the body, by its displacement; otherwise they stay where they are. (Small strains: their
        volumes stay in both cases.) A body that has moved does not fill cells as before and so is not in equilibrium at
        once, not even on the same cells.
    count_displacement: displacements of particles include those of the finite elements; otherwise they start from zero
    smooth: take the smooth stress instead of the cell's mean. With the same cells in both meshes the mean is in
        equilibrium as it is; with other cells the smooth stress is far nearer to it.
    equilibrate: bring the particles to equilibrium (`Model.equilibrate`) under the model's present loads
    Returns a Handover. Raises InputError, on all ranks, for a particle outside the finite elements' mesh, for laws that
    do not match, and for finite elements that did not converge. Collective.
    """
    plastic = isinstance(fem, QuasiStatic)
    particles = model.particles
    agree(model.comm, _first_mistake(model, fem) if plastic else None)
    search = PointSearch(fem.displacement.function_space.mesh, particles.position)
    search.require_all("particles")
    stress = search.values(fem.stress_function(smooth))
    state = particles.state
    if plastic:
        state[:, : fem.law.n_state] = search.values(fem.state_function())
    returned = _returned(model.laws, particles.material, stress, state)
    particles.set("stress", stress)
    particles.set("state", state)
    particles.set("velocity", np.zeros_like(particles.velocity))
    _displace(model, search.values(fem.displacement), move, count_displacement)
    before = model.out_of_balance()
    had_yielded = int(np.sum(particles.plastic_strain > 0))
    settled = model.equilibrate().unbalanced_ratio if equilibrate else None
    yielded = int(np.sum(particles.plastic_strain > 0)) - had_yielded  # what has yielded stays so
    count, returned, yielded = (model.comm.allreduce(n) for n in (len(particles), returned, yielded))
    return Handover(before, settled, returned / count, yielded / count)


def _displace(model, displacement, move, count):
    """Move the particles, count the displacement as theirs, both or neither; rows may have another order afterwards."""
    start = model.particles.position
    if count:
        model.particles.set("initial_position", start if move else start - displacement)
    elif move:
        model.particles.set("initial_position", start + displacement)
    if move:
        model.place(start + displacement)


def _returned(laws, material, stress, state):
    """Bring stresses inside the strength, in place; the number of those that were outside."""
    outside = 0
    for number, law in enumerate(laws):
        rows = np.flatnonzero(material == number)
        inside, unused = stress[rows], np.ascontiguousarray(state[rows, : law.n_state])
        law.update(np.zeros_like(inside), inside, unused, None)
        moved = np.abs(inside - stress[rows]).max(axis=1, initial=0.0)
        outside += int(np.sum(moved > 1e-9 * np.abs(stress).max(initial=0.0)))
        stress[rows] = inside  # the state stays that of the finite elements
    return outside


def _first_mistake(model, fem):
    if not fem.converged:
        return "fem: it has not been solved, or its last solution did not converge"
    for number in np.unique(model.particles.material):
        law = model.laws[number]
        if type(law) is not type(fem.law):
            return f"fem: its law is {type(fem.law).__name__}, that of material {number} is {type(law).__name__}"
        for name in _parameters(law):
            here, there = getattr(law, name), getattr(fem.law, name)
            if here != there:
                return f"fem: its law has {name}={there!r}, that of material {number} has {name}={here!r}"
    return None


def _parameters(law):
    """Names of a law's parameters: its numbers, and whatever else is no method."""
    return [name for name in dir(law) if not name.startswith("_") and not callable(getattr(law, name))]
