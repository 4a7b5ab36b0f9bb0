"""Undrained strength in proportion to the vertical effective stress, of ground that has consolidated under the stages before."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from mpi4py import MPI
from mpm_core.law_warnings import with_inner_laws
from mpm_core.parameter_fields import has_varying, nominal_value
from numpy.typing import ArrayLike, NDArray

from fenics_bridge.errors import InputError, agree, is_finite
from fenics_bridge.fem.overconsolidation import LARGEST, effective_stress, upward
from fenics_bridge.types import Law, OfPosition

STRENGTH = "cohesion"
"""Parameter of a law without friction that is its undrained shear strength"""

LARGEST_RATIO = 2.0
"""Strength ratio above which it is one in percent: that of normally consolidated clay is 0.2 to 0.35"""


@dataclass(frozen=True)
class StrengthRatio:
    """Undrained shear strength over vertical effective stress: s_u = ratio * sigma_v' * OCR^exponent, at least the cohesion of the law.

    Where a vertical preconsolidation stress sigma_p' is given, OCR is sigma_p' / sigma_v', at least `overconsolidation`. Given again in a later stage of a
    fill, the strength follows the consolidation: it grows by sigma_v'^(1 - exponent) up to sigma_p', and in proportion to sigma_v' beyond (Ladd 1991,
    J. Geotech. Eng. ASCE 117, 540-615).

    It is the peak strength of SofteningMohrCoulomb, whose residual strength stays in proportion to it.

    SHANSEP (Ladd and Foott 1974, J. Geotech. Eng. Div. ASCE 100, 763-786). Without overconsolidation it is also the strength after liquefaction
    of loose sand and tailings, s_u / sigma_v' = 0.03 to 0.12 (Olson and Stark 2002, Can. Geotech. J. 39, 629-647).

    Args:
        ratio: strength ratio S of normally consolidated soil [-].
        overconsolidation: overconsolidation ratio OCR [-].
        exponent: exponent m of OCR [-].
        vertical_preconsolidation: largest vertical effective stress that the soil has carried [Pa], a number or a function of positions (n, D) [m] that
            returns (n,); 0 for none.

    Raises:
        InputError: ratio is not above 0 and at most 2, overconsolidation not from 1 to 100, exponent not from 0 to 1, or a vertical preconsolidation
            stress below 0.
    """

    ratio: float
    overconsolidation: float = 1.0
    exponent: float = 0.8
    vertical_preconsolidation: float | OfPosition = 0.0

    def __post_init__(self) -> None:
        wrong = None
        if not (is_finite(self.ratio) and 0 < self.ratio <= LARGEST_RATIO):
            wrong = f"ratio is {self.ratio!r}, expected a number above 0 and up to {LARGEST_RATIO:g}, such as 0.22"
        elif not (is_finite(self.overconsolidation) and 1 <= self.overconsolidation <= LARGEST):
            wrong = (
                f"overconsolidation is {self.overconsolidation!r}, expected a ratio from 1 to {LARGEST:g}, such as 2"
            )
        elif not (is_finite(self.exponent) and 0 <= self.exponent <= 1):
            wrong = f"exponent is {self.exponent!r}, expected a number from 0 to 1, such as 0.8"
        elif not (
            callable(self.vertical_preconsolidation)
            or is_finite(self.vertical_preconsolidation)
            and self.vertical_preconsolidation >= 0
        ):
            wrong = f"vertical_preconsolidation is {self.vertical_preconsolidation!r}, expected a stress from 0 on [Pa], or a function of positions"
        if wrong is not None:
            raise InputError(wrong)

    def __call__(self, vertical: ArrayLike, position: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
        """Undrained shear strength [Pa] under vertical effective stresses [Pa], compression positive; 0 under tension. Shapes are alike.

        Args:
            vertical: vertical effective stress.
            position: (n, D) [m], for a vertical preconsolidation stress that is a function.

        Raises:
            InputError: position is None and the vertical preconsolidation stress is a function.
        """
        present = np.maximum(np.asarray(vertical, dtype=float), 0.0)
        before: ArrayLike | OfPosition = self.vertical_preconsolidation
        if callable(before):
            if position is None:
                raise InputError(
                    "position is None, expected positions (n, D), since vertical_preconsolidation is a function of them"
                )
            before = before(position)
        largest = np.maximum(self.overconsolidation * present, before)
        strength: NDArray[np.float64] = self.ratio * present ** (1 - self.exponent) * largest**self.exponent
        return np.where(present > 0, strength, 0.0)


def require_cohesive(
    comm: MPI.Comm, where: str, laws: Mapping[int, Law], soils: Iterable[int], name_of: Callable[[int], str]
) -> None:
    """Require laws of which a strength ratio gives the strength. Collective.

    Args:
        comm: the ranks.
        where: stage, for messages.
        laws: laws by cell tag.
        soils: cell tags of soils with a strength ratio.
        name_of: function of a tag that gives the name of its soil.

    Raises:
        InputError: the law of a soil has another strength. Raised on all ranks alike.
    """
    wrong = next((tag for tag in soils if not is_cohesive(laws[tag])), None)
    expected = f"expected one without friction whose {STRENGTH} varies: Heterogeneous(tresca(...), [{STRENGTH!r}]) or SofteningMohrCoulomb"
    agree(
        comm,
        None
        if wrong is None
        else f"{where}strength_ratio: the law of the soil {name_of(wrong)} is {laws[wrong].name}, {expected}",
    )


def is_cohesive(law: Law) -> bool:
    """Whether the strength of a law is a cohesion that varies from point to point, and nothing else."""
    angles = (getattr(one, "friction_angle", 0.0) for one in with_inner_laws(law))
    return has_varying(law, STRENGTH) and not any(angles)


def vertical_stress(law: Law, stress: NDArray[np.float64], state: NDArray[np.float64]) -> NDArray[np.float64]:
    """Vertical effective stress of points [Pa], compression positive, shape (n,).

    Args:
        law: law of the points.
        stress: stress [Pa], tension positive, shape (n, S); the last axis of the space points up.
        state: state variables, shape (n, n_state).
    """
    return -effective_stress(law, stress, state)[:, upward(stress.shape[1])]


def strengths(
    law: Law, ratio: StrengthRatio, vertical: NDArray[np.float64], position: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Undrained shear strengths of points [Pa], shape (n,): by the ratio, at least the cohesion that the law itself has.

    Args:
        law: law of the points, which varies in its cohesion.
        ratio: strength ratio.
        vertical: vertical effective stress [Pa], compression positive, shape (n,).
        position: (n, D) [m].
    """
    return np.maximum(ratio(vertical, position), nominal_value(law, STRENGTH))
