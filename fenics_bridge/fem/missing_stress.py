"""The stress that a cell lacks for equilibrium, relative to the strength that it mobilises; it also shows small mechanisms."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fenics_bridge.fem.quadrature import QuadraturePoints
from fenics_bridge.types import Law


def missing_fraction(
    points: QuadraturePoints, laws: Sequence[Law], viscosity: float, strain: NDArray[np.float64]
) -> float:
    """Largest missing stress of a cell over the strength that it mobilises, where it yields [-].

    At the end of a viscous step the laws' stress and the viscous stress s = theta C de are in equilibrium with the load
    together: s is what the soil lacks. Where the soil is elastic it can still take s up, so that only the power of s on the
    plastic strain de - C^-1 dsigma counts. It is divided by |dev sigma| |dev de| + |p| |tr de|, cell by cell and not over the
    body, in which a small mechanism would be lost. In the steady mechanism of an undrained soil the ratio is the fraction by
    which the strength is too small; in general it estimates that fraction, as the static theorem of limit analysis suggests:
    soil whose strength were greater by it could carry the stress sigma + s, which is in equilibrium.

    The difference between the stress in equilibrium and that of the law, over the shear strength, is what PLAXIS calls the
    local error (Scientific Manual, "local error"); of it the mean of a cell is taken here.

    Args:
        points: the quadrature points, with the trial stress at the end of the step.
        laws: the laws, by number.
        viscosity: theta [-].
        strain: strain increment de of the step, shape (n, S).

    Returns:
        The largest fraction in the cells of this rank; 0 where nothing yields.
    """
    change = points.trial_stress - points.stress
    power = viscosity * np.einsum("ns,ns->n", points.elastic_stress(laws, strain) - change, strain)
    pressure, deviatoric_stress = _parts(points.trial_stress, 2.0)
    dilation, distortion = _parts(strain, 0.5)
    mobilised = points.sum_over_cells(deviatoric_stress * distortion + 3 * np.abs(pressure * dilation))
    missing = points.sum_over_cells(power)
    yields = missing > 0
    return float(np.max(missing[yields] / np.maximum(mobilised[yields], 1e-300), initial=0.0))


def _parts(values: NDArray[np.float64], shear: float) -> tuple[Any, ...]:
    """Means and norms of deviators of components (n, S): each (n,); shear: factor of the squares of the shear components."""
    mean = values[:, :3].mean(axis=1)
    deviator = values[:, :3] - mean[:, None]
    return mean, np.sqrt(np.sum(deviator**2, axis=1) + shear * np.sum(values[:, 3:] ** 2, axis=1))
