"""From finite elements to particles: stress, state and displacement of an equilibrium."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from mpm_core.checks import flag, member, of_kind, renamed
from mpm_core.collective import collectively
from numpy.typing import NDArray

import mpm_core as mpm
from fenics_bridge.errors import agree
from fenics_bridge.fem.elastic import ElasticSolution
from fenics_bridge.fem.evaluate import PointSearch
from fenics_bridge.fem.geometry import Geometry
from fenics_bridge.fem.quasi_static import QuasiStatic
from fenics_bridge.transfer.dried import balance_dried_soil
from fenics_bridge.transfer.handover_checks import (
    require_same_laws,
    require_usable,
    warn_of_missing_loads,
    warn_of_other_water,
    warn_of_other_weight,
)
from fenics_bridge.transfer.moved import fitted_volumes, held_volumes, volume_change
from fenics_bridge.transfer.pore_pressures import (
    add_to_stress,
    set_pore_pressure,
    takes_pore_pressure,
)
from fenics_bridge.water.consolidation import Consolidation

_BALANCED, _MOST_STEPS = 5e-4, 60
"""Out-of-balance ratio to reach, and largest number of steps: near collapse each one leaves a fraction of it."""


@dataclass(frozen=True, repr=False)
class Handover:
    """Result of a hand-over; sums are over all ranks."""

    unbalanced_ratio: float
    """Out-of-balance over external force of the particles as they were given their stress [-]"""
    equilibrated_ratio: float | None
    """Out-of-balance ratio after the equilibration [-]; None without equilibration, as with resting cells"""
    returned_fraction: float
    """Fraction of the particles whose stress had to be returned to the yield surface [-]"""
    yielded_fraction: float
    """Fraction of the particles that yielded in the equilibration where the finite elements did not [-]"""

    def __repr__(self) -> str:
        after = "" if self.equilibrated_ratio is None else f", {self.equilibrated_ratio:.2g} after the equilibration"
        return (
            f"<Handover: out-of-balance ratio {self.unbalanced_ratio:.2g}{after}; {self.returned_fraction:.2%} of the particles "
            f"returned to the yield surface, {self.yielded_fraction:.2%} newly yielded>"
        )

    settled_ratio = renamed("settled_ratio", "equilibrated_ratio")
    returned_share = renamed("returned_share", "returned_fraction")
    yielded_share = renamed("yielded_share", "yielded_fraction")


def initialise(
    model: mpm.Model,
    fem: QuasiStatic | ElasticSolution | Consolidation,
    *,
    count_displacement: bool = True,
    move: bool = False,
    smooth: bool = False,
    equilibrate: bool = True,
    resting: bool = False,
    nmd: bool | None = None,
    integration: mpm.Integration | None = None,
) -> Handover:
    """Start particles from an equilibrium found by finite elements (a consistent transfer: it keeps values). Collective.

    Each particle takes the stress, the state and the accumulated strain of the finite elements where it is, is returned
    to the yield surface should it be outside, and loses its velocity. The model's gravity must be that of the
    equilibrium, its loads and supports too, and its geometry that of the finite elements.

    On the same cells, particles are in equilibrium at once (out of balance by rounding) with linear elements, and in
    plane strain and 3D with quadratic ones, whose cell means linear test functions cannot distinguish from their stresses.
    In axisymmetric bodies two things differ: the hoop stress acts with the particles at the centre of a cell, which leaves
    some 1e-3 of quadratic elements out of balance; and the weights of nodes are exact for particles at Gauss points of
    degree 2 (`per_cell` of 3, 12, 48), and with others good to the square of the cell size. The suction of soil that has dried and
    the weight of its water are no polynomials: particles then take total stresses and moments of the weight from each cell of the
    elements (`dried.balance_dried_soil`), of which a particle alone in its cell has the sum only. Averaged forces of dried soil
    leave some 1e-4, since these averages leave out the suction.

    Args:
        model: model with particles.
        fem: finite elements, solved and converged; the meshes and their partitions may differ. Particles with pore water
            (`Model.add_water`) take their pore pressures too, from a `water.Consolidation` or from a `QuasiStatic` with prescribed
            ones, without suction where they have retention curves, and `equilibrate` keeps these. Particles of `Undrained` laws,
            whose skeletons are the laws of a `QuasiStatic` with prescribed pore pressures, take total stresses, and the pressures
            as their `excess_pore_pressure`; particles of other laws may lie beside them where there are no pore pressures.
            Its structural members are installed in the model with their forces; `equilibrate` must be False then.
        count_displacement: let displacements of particles include those of the finite elements; otherwise they start from zero.
        move: move particles with the body, by its displacement; otherwise they stay where they are, with their volume.
            Volumes of particles that move change with the body's, and are then fitted to what each cell of their mesh holds
            of the moved body (`moved.fitted_volumes`). A body that has moved is only near equilibrium: that of small
            strains is one of the undeformed body, and now its surface cuts cells.
        smooth: take the smooth stress instead of the cell's mean. With the same cells in both meshes the mean is in
            equilibrium as it is; with other cells the smooth stress is far nearer to it.
        equilibrate: bring the particles to equilibrium (`Model.equilibrate`) under the model's present loads, to an
            out-of-balance ratio of 5e-4.
        resting: let all cells rest (`Model.rest`) as the finite elements that they were; only what fails turns into particles.
            They are not moved, and not equilibrated: with the cells of the finite elements they are in equilibrium as they are.
        nmd: whether the run that follows averages strains, in explicit steps: equilibrium is then one of forces of averaged mean
            stresses. By default as in the finite elements. False for implicit steps that move particles: these average strains.
        integration: how the run that follows makes forces of stresses; by default as in `mpm_core.Model.explicit`.

    Returns:
        How far the particles are from equilibrium, and how many of them yield.

    Raises:
        InputError: a particle is outside the finite elements' mesh or, moved, outside the background mesh, laws or geometries do
            not match, the finite elements did not converge, gravity still rises, or `equilibrate` is True where the model has
            something that `Model.equilibrate` does not support. The particles are unchanged. Raised on all ranks alike.
    """
    particles = of_kind("model", model, mpm.Model).particles
    of_kind("fem", fem, QuasiStatic, ElasticSolution, Consolidation)
    options = {
        "count_displacement": count_displacement,
        "move": move,
        "smooth": smooth,
        "equilibrate": equilibrate,
        "resting": resting,
    }
    chosen = () if nmd is None else (("nmd", nmd),)
    collectively(model.comm, lambda: [flag(name, value) for name, value in (*options.items(), *chosen)])
    if integration is not None:
        collectively(model.comm, lambda: member("integration", integration, mpm.Integration))
    require_usable(model, fem, move, equilibrate and not resting, integration)
    warn_of_other_weight(model, fem)
    warn_of_other_water(model, fem)
    warn_of_missing_loads(model, fem)
    if resting:
        agree(model.comm, "move is True, expected False with resting: resting cells are not moved" if move else None)
        model.rest()
    search = PointSearch(fem.displacement.function_space.mesh, particles.position)
    search.require_all("particles")
    if isinstance(fem, (QuasiStatic, Consolidation)):
        number = np.rint(search.values(fem.material_function())[:, 0]).astype(int)
        outside = int(np.sum(number < 0))
        agree(
            model.comm,
            f"{outside} particles lie where the finite elements have no soil" if outside else None,
        )
        require_same_laws(model, fem, number)
    returned = _take_stress_and_state(model, fem, search, smooth)
    _displace(model, fem.displacement, search, move, count_displacement)
    _take_members(model, fem, move)
    averaged = getattr(fem, "_nmd", False) if nmd is None else nmd
    before = model.out_of_balance(nmd=averaged, integration=integration)
    had_yielded = int(np.sum(particles.plastic_strain > 0))
    after = None
    if equilibrate and not resting:
        settled = model.equilibrate(nmd=averaged, integration=integration, tolerance=_BALANCED, max_steps=_MOST_STEPS)
        after = settled.unbalanced_ratio
    yielded = int(np.sum(particles.plastic_strain > 0)) - had_yielded  # what has yielded stays so
    count, returned, yielded = (model.comm.allreduce(n) for n in (len(particles), returned, yielded))
    return Handover(before, after, returned / count, yielded / count)


def _take_stress_and_state(model: mpm.Model, fem: Any, search: PointSearch, smooth: bool) -> int:
    """Give the particles stress and state of the finite elements at their positions; returns the number of returned stresses."""
    particles = model.particles
    stress, state = search.values(fem.stress_function(smooth)), particles.state.copy()
    if isinstance(fem, (QuasiStatic, Consolidation)):
        values = search.values(fem.state_function())
        state[:, : values.shape[1]] = values
    if takes_pore_pressure(model, fem):
        if model._core.water is not None:
            set_pore_pressure(model, fem._water.pressure, search)
        else:
            add_to_stress(model, fem, search, smooth, stress, state)
    if isinstance(fem, Consolidation):
        set_pore_pressure(model, fem.pressure, search)
        stress = balance_dried_soil(model, fem, search, stress)
    returned = _returned(model.laws, particles.material, stress, state)
    particles.set("stress", stress)
    particles.set("state", state)
    particles.set("deviatoric_strain", search.values(fem.deviatoric_strain_function())[:, 0])
    for name in ("velocity", "velocity_gradient") if model.resting_cells.any() else ("velocity",):
        particles.set(name, np.zeros_like(getattr(particles, name)))
    return returned


def _displace(model: Any, displacement: Any, search: PointSearch, move: bool, count: bool) -> None:
    """Move the particles, count the displacement as theirs, both or neither; rows may have another order afterwards."""
    particles, start = model.particles, model.particles.position
    moved = search.values(displacement)
    if count:
        particles.set("initial_position", start if move else start - moved)
    elif move:
        particles.set("initial_position", start + moved)
    if move:
        held = held_volumes(model.mesh.domain, displacement, model.geometry)
        change = search.values(volume_change(displacement))[:, 0]
        if model.geometry == Geometry.AXISYMMETRIC:
            change *= 1 + moved[:, 0] / start[:, 0]
        particles.set("volume", particles.volume * change)
        model.place(start + moved)
        particles.set("volume", fitted_volumes(particles.volume, particles.cell, held))


def _returned(
    laws: Sequence[Any], material: NDArray[np.integer], stress: NDArray[np.float64], state: NDArray[np.float64]
) -> int:
    """Return stresses to the yield surface, in place; returns the number of those that were outside."""
    outside = 0
    for number, law in enumerate(laws):
        rows = np.flatnonzero(material == number)
        inside, unused = stress[rows], np.ascontiguousarray(state[rows, : law.n_state])
        law.update(np.zeros_like(inside), inside, unused, None)
        moved = np.abs(inside - stress[rows]).max(axis=1, initial=0.0)
        outside += int(np.sum(moved > 1e-9 * np.abs(stress).max(initial=0.0)))
        stress[rows] = inside  # the state stays that of the finite elements
    return outside


def _take_members(model: mpm.Model, fem: Any, move: bool) -> None:
    """Install the structural members of the finite elements, with their forces, where the soil around them goes. Collective."""
    members, forces = getattr(fem, "members", {}), {}
    for name in members:
        given = fem.member_forces(name)
        moved = fem.moved_member(name)
        forces[name] = replace(given, displacement=moved if move else np.zeros_like(moved))
    model.install(members, forces)
