"""A column of soil and water with a velocity each, which several tests share."""

from __future__ import annotations

import numpy as np
from core_cases import box

import mpm_core as mpm

POROSITY, GRAINS, WATER, GAMMA = 0.4, 2650.0, 1000.0, 9810.0
DENSITY = (1 - POROSITY) * GRAINS + POROSITY * WATER
ELASTIC = mpm.LinearElastic(young=10e6, poisson=0.3)
OEDOMETER = ELASTIC.p_wave_modulus
LEFT, RIGHT, BASE, TOP = 1, 2, 3, 4


def column(cells, *, conductivity=1e-3, modulus=2.2e8, law=ELASTIC, height=1.0, dim=2, anisotropy=None):
    """A saturated column on a fixed base between rollers, two cells wide."""
    size = 2 * height / cells
    mesh = box(
        [2] * (dim - 1) + [cells], [size] * (dim - 1) + [height], diagonals="alternating" if dim == 2 else "one-way"
    )
    model = mpm.Model(mesh, law)
    model.seed(density=DENSITY, per_cell={2: 3, 3: 4}[dim])
    for axis in range(dim - 1):
        for end in (1, 2):
            model.roller(2 * axis + end, np.eye(dim)[axis])
    model.fix(2 * dim - 1)
    model.add_water(porosity=POROSITY, conductivity=conductivity, modulus=modulus, anisotropy=anisotropy)
    return model
