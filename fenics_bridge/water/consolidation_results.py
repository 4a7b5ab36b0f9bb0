"""What a consolidation has found: displacements, pressures, stresses, forces, and the water that is there and that flows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from dolfinx import fem
from dolfinx.mesh import Mesh
from numpy.typing import ArrayLike, NDArray

from fenics_bridge.fem.equilibrium import Body
from fenics_bridge.fem.evaluate import evaluate_at
from fenics_bridge.fem.fields import SupportedBody, nodal_average, part_of
from fenics_bridge.fem.loads import LoadVectors
from fenics_bridge.fem.point_functions import PointFunctions
from fenics_bridge.fem.supports import Constraints, Support
from fenics_bridge.structures.reinforced import ReinforcedBody
from fenics_bridge.types import MeshTags, OfPosition
from fenics_bridge.water.applied import AppliedBoundary
from fenics_bridge.water.coupled import WaterTerms
from fenics_bridge.water.motion import Motion
from fenics_bridge.water.positions import at_positions
from fenics_bridge.water.soils import acting_pressure


class ConsolidationResults(SupportedBody, PointFunctions, ReinforcedBody):
    """The results of `Consolidation`, whose constructor sets these attributes."""

    domain: Mesh
    radius: Any
    pressure: fem.Function
    motion: Motion | None
    _body: Body
    _laws: list[Any]
    _terms: WaterTerms
    _applied: AppliedBoundary
    _loads: LoadVectors
    _soils: Any
    _displacements: Any
    _facet_tags: MeshTags
    _supports: Constraints
    _external: NDArray[np.float64]
    _inflow: NDArray[np.float64]

    @property
    def displacement(self) -> fem.Function:
        """Displacement as a function of its own [m]."""
        return part_of(self._body.solution, self._displacements, "displacement")

    def stress_function(self, smooth: bool = False) -> fem.Function:
        """Effective stress as a function. Collective.

        Args:
            smooth: average the stress of the cells at the nodes, which makes it continuous.

        Returns:
            Effective stress [Pa], constant in each cell, the mean of its points, unless `smooth`.
        """
        mean = self.points.cell_function(self.points.stress, "effective_stress", 0)
        return nodal_average(mean, self.radius, self._loads.active) if smooth else mean

    @property
    def laws(self) -> list[Any]:
        """The laws as a list, in the order in which they were given."""
        return self._laws

    def evaluate_at(self, points: ArrayLike) -> dict[str, NDArray[np.float64]]:
        """Values at points, whichever ranks have the points and their cells. Collective.

        On the border of soil that has been removed the values are those of the soil that is there.

        Args:
            points: positions [m], shape (n, D).

        Returns:
            `displacement` [m], shape (n, D), `pressure` [Pa], shape (n, 1), and effective `stress` [Pa], shape (n, S).

        Raises:
            InputError: a point is outside the body; the message names it. Raised on all ranks alike.
        """
        values = {"pressure": self.pressure, "stress": self.stress_function()}
        return evaluate_at(points, self._loads.active, displacement=self.displacement, **values)

    def pore_pressure(self, suction: bool = False, outside: OfPosition | None = None) -> OfPosition:
        """The pore pressure as a function of positions, for stages, collapse loads and factors of safety, as of `Seepage`.

        Collective.

        Args:
            suction: False for zero where it is negative; True for the suction there times the effective saturation at the nodes.
            outside: function of positions (n, D) [m] for points outside the body; None for zero there.

        Returns:
            Function of positions (n, D) [m] that returns pressures (n,) [Pa]; every rank must call it.
        """
        soils, _, cells = self._soils
        return at_positions(acting_pressure(self.pressure, soils, cells, suction), outside)

    def stored_water(self) -> float:
        """Volume of water in the body [m3], at atmospheric pressure; [m2] in plane strain, in axial symmetry per radian. Collective."""
        return self.domain.comm.allreduce(fem.assemble_scalar(self._terms.content))

    def inflow(self, facet_tag: int | str | None) -> float:
        """Water that entered through the facets of a tag in the last step; as for `Seepage`. Collective.

        Args:
            facet_tag: number or name of the tag; None for all boundary conditions together.

        Returns:
            Inflow [m3/s], per metre [m2/s] in plane strain and per radian in axial symmetry (that of the whole body is 2 pi times
            as much); negative where water leaves.

        Raises:
            InputError: no facet has the tag. Raised on all ranks alike.
        """
        return self._applied.inflow(facet_tag, self._inflow)

    def _nodal_reactions(self) -> tuple[Any, NDArray[np.float64], MeshTags, Sequence[Support]]:
        self._body.increment.x.array[:] = 0.0
        if self.motion is not None:
            self.motion.rest_on()
        self._members.back()
        forces = self._external - self._body.internal_forces(self.points.stress).array
        space, dofs = self._displacements
        return space, forces[dofs], self._facet_tags, self._supports.supports
