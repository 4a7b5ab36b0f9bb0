"""Values at the quadrature points of a body as functions of position."""

from __future__ import annotations

import numpy as np
from dolfinx import fem

from fenics_bridge.fem.quadrature import QuadraturePoints


class PointFunctions:
    """Functions that are constant in each cell, the means of its points; for bodies with an attribute `points`."""

    points: QuadraturePoints

    def state_function(self) -> fem.Function:
        """State variables of the law as a function that is constant in each cell."""
        return self.points.cell_function(self.points.state, "state", 0)

    def deviatoric_strain_function(self) -> fem.Function:
        """Accumulated deviatoric strain [-], as the particles have it, as a function that is constant in each cell."""
        return self.points.cell_function(self.points.deviatoric_strain, "deviatoric_strain", 0)

    def material_function(self) -> fem.Function:
        """Position in `laws` of the law of each cell, as a function that is constant in each cell."""
        return self.points.cell_function(np.repeat(self.points.material, self.points.per_cell), "material", 0)
