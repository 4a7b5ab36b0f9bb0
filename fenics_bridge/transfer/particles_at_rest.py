"""Ground at rest by particles: the stresses by K0 of soils that a stage places, as `at_rest` has them for finite elements."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

import mpm_core as mpm
from fenics_bridge.errors import agree
from fenics_bridge.fem.at_rest import laws_at_rest
from fenics_bridge.fem.stages import SiteState, Stage, StageError
from fenics_bridge.types import Law
from mpm_core import _core

if TYPE_CHECKING:
    from fenics_bridge.transfer.particle_site import ParticleSite


def stress_at_rest(
    site: ParticleSite, state: SiteState, laws: Mapping[int, Law], k0: Mapping[int, float], **options: Any
) -> tuple[dict[int, NDArray[np.float64]], dict[int, NDArray[np.float64]]]:
    """Stresses at rest of the particles that are to be placed, and the same as the nodal forces have them. Collective.

    Both are by the tag of their soil, in the order of their numbers.

    They are those of other particles in the same cells, which keep their places. Soil that was there before counts as being where it
    was placed.

    Args:
        site: the particles, before the stage.
        state: soils, supports, loads and water that the stage leads to.
        laws: laws by cell tag of the soils that are there.
        k0: ratio of horizontal to vertical stress [-], by the tags of soils that are placed.
        **options: of the site.

    Raises:
        InputError: the elastic body has no equilibrium. Raised on all ranks alike.
    """
    comm, resting = site.model.comm, laws_at_rest(laws, k0, site.state.there)
    model = mpm.Model(site.model.mesh, list(resting.values()), geometry=site.model.geometry)
    numbers: dict[int | str, int] = {tag: number for number, tag in enumerate(resting)}
    twin = type(site)(model, numbers, state.supports, **{**options, "small_displacements": True})
    weights: dict[int | str, float] = {tag: state.unit_weight[tag] for tag in state.there}
    stage = Stage(
        "at rest", state.there, unit_weight=weights, pressure=state.pressure, pore_pressure=state.pore_pressure
    )
    problem = None
    try:
        twin.carry_out(stage)
    except StageError as error:
        problem = f"k0: the ground at rest has no equilibrium: {error}"
    agree(comm, problem)
    carried, p = carried_stress(model, bool(options.get("nmd"))), model.particles
    rows = {tag: np.flatnonzero(twin.rows_of(tag)) for tag in k0}
    ordered = {tag: each[np.argsort(p.id[each])] for tag, each in rows.items()}
    return {tag: p.stress[each] for tag, each in ordered.items()}, {tag: carried[each] for tag, each in ordered.items()}


def carried_stress(model: mpm.Model, nmd: bool) -> NDArray[np.float64]:
    """The stresses (n, S) [Pa] of particles as the nodal forces have them, without alternation of their mean from cell to cell. Collective.

    Args:
        model: particles in equilibrium with small displacements.
        nmd: whether strains are averaged over nodes; else the stresses are as they are.
    """
    p, stress = model.particles, model.particles.stress.copy()
    if not nmd:
        return stress
    normal = 2 if model.mesh.dim == 2 and model.geometry != mpm.Geometry.AXISYMMETRIC else 3
    mean = stress[:, :normal].mean(axis=1)
    fractions = np.array([_core.fraction_of_averaged_forces(law) for law in model.laws])[p.material]
    stress[:, :normal] += (fractions * (model.average_over_nodes(mean) - mean))[:, None]
    return stress


def place_at_rest(
    model: mpm.Model,
    stress: Mapping[int, NDArray[np.float64]],
    rows_of: Mapping[int, NDArray[np.bool_]],
    harden: Callable[[], None],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Give the particles that a stage has placed their stresses at rest. Collective.

    Args:
        model: the particles.
        stress: stresses by the tag of the soil, from `stress_at_rest`.
        rows_of: whether each particle is one that the stage has placed, by the tag of its soil.
        harden: gives the particles the state variables of their history, which belong to these stresses.

    Returns:
        These stresses (n, S) [Pa], and the same, brought back to the strength.
    """
    p = model.particles
    every, chosen = p.stress.copy(), np.zeros(len(p), dtype=bool)
    for tag, given in stress.items():
        rows = np.flatnonzero(rows_of[tag])
        every[rows[np.argsort(p.id[rows])]], chosen[rows] = given, True
    p.set("stress", every)
    harden()
    return every[chosen], _admissible(model)[chosen]


def _admissible(model: mpm.Model) -> NDArray[np.float64]:
    """Stresses of the particles (n, S) [Pa], brought back to the strength of their laws."""
    p = model.particles
    stress, material = p.stress.copy(), p.material
    for number, law in enumerate(model.laws):
        rows = np.flatnonzero(material == number)
        part, state = stress[rows], np.ascontiguousarray(p.state[rows, : law.n_state])
        law.update(np.zeros_like(part), part, state)
        stress[rows] = part
    return stress
