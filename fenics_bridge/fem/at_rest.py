"""Ground at rest: stresses in equilibrium whose horizontal part is K0 times the vertical one, for soils that a stage places.

They are those of an elastic body, loaded by the weight, water and pressures of the stage, whose stiffness makes the horizontal stress K0 times
the vertical one where the ground does not strain sideways. So they are in equilibrium in any body and with any elements: level ground has exactly K0,
and a slope what its surface leaves of it. Up to K0 = 0.8 the body is isotropic, with Poisson's ratio K0 / (1 + K0). All soils have the same
modulus of vertical strain, so that stiff soil beside soft soil does not carry the weight of both.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI
from mpm_core.law_warnings import with_inner_laws
from numpy.typing import NDArray

import mpm_core as mpm
from fenics_bridge.errors import agree
from fenics_bridge.fem.loads import Load
from fenics_bridge.fem.overconsolidation import upward
from fenics_bridge.fem.quasi_static import QuasiStatic
from fenics_bridge.types import Law
from mpm_core import _core

if TYPE_CHECKING:
    from fenics_bridge.fem.stages import SiteState

MODULUS = 1e7
"""Modulus of vertical strain without lateral strain [Pa]; stresses do not depend on it"""

LARGEST_POISSON = 0.45
"""Poisson's ratio that stands for larger ones: linear elements would lock, and stresses of level ground do not depend on it"""

HELD = 1e4
"""Factor of the stiffness of soil that was there before, so that a layer does not bend as it is weighed"""

BEYOND = 1e-6
"""Change of a stress over the largest one, above which it was beyond the strength [-]"""


class GroundAtRest:
    """Elastic ground with K0 as a law in Python: sigma = M w (w . e) + S e_h + G gamma.

    M is the modulus of vertical strain without lateral strain, w is 1 for the vertical and K0 for both horizontal axes, S is the stiffness
    E / (1 - nu^2) [[1, nu], [nu, 1]] of the horizontal strains in plane stress, and G the shear modulus; E and G are those of M and nu in isotropic
    ground, which this is for nu = K0 / (1 + K0).

    Args:
        law: law of the soil.
        k0: ratio of horizontal to vertical stress [-]; None for that of its elasticity.
        factor: of all moduli [-].
    """

    n_state = 1

    def __init__(self, law: Law, k0: float | None, factor: float = 1.0) -> None:
        self.p_wave_modulus = law.p_wave_modulus  # elements average by it, of this law as of that of the soil
        poisson = _drained_poisson(law) if k0 is None else k0 / (1 + k0)
        self.poisson, self.modulus = min(poisson, LARGEST_POISSON), factor * MODULUS
        self.k0 = self.poisson / (1 - self.poisson) if k0 is None else k0
        association = _core.associated_fraction(law)
        if np.isfinite(association):  # elements and particles average forces by it
            self.friction, self.dilation = 45.0, math.degrees(math.atan(association))
            self.strength_parameters = {"friction": "friction angle", "dilation": "dilation angle"}

    def stiffness(self, size: int) -> NDArray[np.float64]:
        """Stiffness (S, S) [Pa]; size: 4 in two dimensions, 6 in three."""
        vertical = upward(size)
        horizontal = [axis for axis in range(3) if axis != vertical]
        nu, weight = self.poisson, np.zeros(size)
        shear = self.modulus * (1 - 2 * nu) / (2 * (1 - nu))
        weight[vertical], weight[horizontal] = 1.0, self.k0
        matrix = shear * np.diag((np.arange(size) > 2).astype(float))
        matrix[np.ix_(horizontal, horizontal)] = 2 * shear / (1 - nu) * np.array([[1, nu], [nu, 1]])
        return matrix + self.modulus * np.outer(weight, weight)

    def update(
        self,
        strain_increment: NDArray[np.float64],
        stress: NDArray[np.float64],
        state: NDArray[np.float64],
        tangent: NDArray[np.float64] | None,
    ) -> None:
        """Add the stress of a strain increment (n, S)."""
        matrix = self.stiffness(stress.shape[1])
        stress += strain_increment @ matrix
        if tangent is not None:
            tangent[:] = matrix


def _drained_poisson(law: Law) -> float:
    """Poisson's ratio of the moduli of a law without its water, 0 or more."""
    skeleton = list(with_inner_laws(law))[-1]
    shear, wave = skeleton.shear_modulus, skeleton.p_wave_modulus
    return max((wave - 2 * shear) / (2 * (wave - shear)), 0.0)


def laws_at_rest(
    laws: Mapping[int, Law], k0: Mapping[int, float], before: Collection[int] = ()
) -> dict[int, mpm.PythonLaw]:
    """Laws of ground at rest by cell tag.

    Args:
        laws: those of the soils.
        k0: ratio of horizontal to vertical stress [-], by the tags of the soils that have one.
        before: tags of the soils that were there before, which hold those that are placed.
    """
    return {
        tag: mpm.PythonLaw(GroundAtRest(law, k0.get(tag), HELD if tag in before else 1.0)) for tag, law in laws.items()
    }


def stress_at_rest(
    fem: QuasiStatic,
    state: SiteState,
    off: Sequence[int],
    laws: Mapping[int, Law],
    k0: Mapping[int, float],
    before: Collection[int],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Stresses at rest at `points.coordinates()`, and the same as the nodal forces have them: (n, S) [Pa], zero in soils without K0.

    Collective. Structural members carry nothing, since they come without strain; those that hold water back do so.

    Args:
        fem: the finite elements.
        state: soils, supports, loads and water that the stage leads to.
        off: tags of the soils that are not there.
        laws: laws by cell tag, of all soils.
        k0: ratio of horizontal to vertical stress [-], by the tags of soils that are placed.
        before: tags of the soils that were there before.

    Raises:
        InputError: the elastic body has no equilibrium. Raised on all ranks alike.
    """
    twin = QuasiStatic(
        fem.domain, laws_at_rest(laws, k0, before), fem.facet_tags, state.supports, fem.degree, fem._nmd,
        options_prefix=fem._options_prefix, cell_tags=fem.cell_tags, solver=fem.solver, as_particles=fem._as_particles,
        geometry=fem.geometry,
    )  # fmt: skip
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of walls that are too soft; others are given of the body itself
        twin.reconfigure(off=off, pore_pressure=state.pore_pressure, members=_without_stiffness(state.members))
    report = twin.equilibrate(Load({tag: state.unit_weight[tag] for tag in state.there}, state.pressure))
    agree(fem.domain.comm, None if report.converged else f"k0: the ground at rest has no equilibrium: {report.reason}")
    rows = rows_of(fem, k0)

    def in_order(values: NDArray[np.float64]) -> NDArray[np.float64]:
        by_cell = values.reshape(len(twin.points.cells), twin.points.per_cell, -1)
        found = by_cell[np.argsort(twin.points.cells)][fem.points.cells].reshape(values.shape)
        return np.where(rows[:, None], found, 0.0)

    return in_order(twin.points.stress), in_order(twin._kinematics.carried_stress())


def rows_of(fem: QuasiStatic, tags: Collection[int]) -> NDArray[np.bool_]:
    """Whether each point is in a soil of some tags: (n,); the laws are given by tag."""
    numbers = [number for number, tag in enumerate(fem.soils) if tag in tags]
    return np.repeat(np.isin(fem._materials.number[fem.points.cells], numbers), fem.points.per_cell)


def warn_beyond_strength(
    comm: MPI.Comm, where: str, given: NDArray[np.float64], admissible: NDArray[np.float64]
) -> None:
    """Warn where stresses by K0 are beyond the strength of the soil. Collective.

    Args:
        comm: the ranks.
        where: stage, for the message.
        given: stresses by K0, shape (n, S) [Pa].
        admissible: the same, brought back to the strength.
    """
    largest = comm.allreduce(float(np.abs(given).max(initial=0.0)), MPI.MAX)
    beyond = np.abs(admissible - given).max(axis=1, initial=0.0) > BEYOND * largest
    count, total = comm.allreduce(int(beyond.sum())), comm.allreduce(len(beyond))
    if count and comm.rank == 0:
        warnings.warn(
            f"{where}k0: the stresses are beyond the strength of the soil at {count / total:.1%} of the points that have K0, and are brought back "
            "to it: K0 is below that of active or above that of passive earth pressure there, or the preconsolidation pressure is below the stress",
            RuntimeWarning,
            stacklevel=3,
        )


def _without_stiffness(members: Mapping[str, mpm.Member]) -> dict[str, mpm.Member]:
    """The walls that hold water back, which carry next to nothing."""
    return {
        name: replace(one, axial_stiffness=1e-9 * one.axial_stiffness, bending_stiffness=1e-9 * one.bending_stiffness)
        for name, one in members.items()
        if one.impervious
    }
