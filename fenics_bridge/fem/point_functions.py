"""Values at the quadrature points of a body as functions of position."""

from __future__ import annotations

from typing import Any

import numpy as np
import ufl
from dolfinx import fem

from fenics_bridge import compat
from fenics_bridge.fem.fields import cell_function
from fenics_bridge.fem.quadrature import QuadraturePoints


class PointFunctions:
    """The part of `QuasiStatic` that has functions that are constant in each cell, the means of its points."""

    domain: Any
    points: QuadraturePoints
    _water: Any

    def pore_pressure_function(self) -> fem.Function:
        """Prescribed pore pressure [Pa] as a function that is constant in each cell; zero without water."""
        if self._water is None:
            return fem.Function(compat.function_space(self.domain, "DG", 0, 1), name="pore_pressure")
        return cell_function(self.domain, ufl.as_vector([self._water.pressure]), 0, "pore_pressure")

    def state_function(self) -> fem.Function:
        """State variables of the law as a function that is constant in each cell."""
        return self.points.cell_function(self.points.state, "state", 0)

    def deviatoric_strain_function(self) -> fem.Function:
        """Accumulated deviatoric strain [-], as the particles have it, as a function that is constant in each cell."""
        return self.points.cell_function(self.points.deviatoric_strain, "deviatoric_strain", 0)

    def material_function(self) -> fem.Function:
        """Position in `laws` of the law of each cell, as a function that is constant in each cell."""
        return self.points.cell_function(np.repeat(self.points.material, self.points.per_cell), "material", 0)
