"""Water retention curves: saturation and relative permeability of unsaturated soil as functions of suction.

Suction is minus the pore pressure [Pa]; at and below zero suction soil is saturated. Each curve has two functions of the
suction, which take numbers, NumPy arrays and UFL expressions alike:

- `saturation(suction)`: degree of saturation S [-], falling from 1 to the residual one
- `relative_permeability(suction)`: k_r [-], the fraction of the saturated conductivity, falling from 1

`effective(suction)` is (S - residual) / (1 - residual).
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
import ufl
from mpi4py import MPI
from mpm_core.checks import real_numbers
from ufl.core.expr import Expr

from fenics_bridge.errors import InputError, is_finite

LEAST_PERMEABILITY = 1e-8
"""Relative permeability that is left in the driest soil, so that the equations keep one solution."""

LARGEST_ALPHA = 0.01
"""Inverse of a suction [1/Pa] above which it is probably in another unit; that of gravel is below 0.002"""

_SMALL = 1e-9
"""Suction, over the one by which a curve is scaled, below which soil counts as saturated: slopes of curves stay finite."""


class _Curve:
    """Base class of retention curves."""

    residual: float
    """Residual degree of saturation [-], which no suction takes out"""

    def effective(self, suction: Any) -> Any:
        """Effective saturation S_e = (S - residual) / (1 - residual) [-].

        Args:
            suction: minus the pore pressure [Pa]: a number, a NumPy array or a UFL expression.

        Returns:
            The same kind of value.
        """
        raise NotImplementedError

    def saturation(self, suction: Any) -> Any:
        """Degree of saturation S [-], falling from 1 to the residual one.

        Args:
            suction: minus the pore pressure [Pa]: a number, a NumPy array or a UFL expression.

        Returns:
            The same kind of value.
        """
        return self.residual + (1 - self.residual) * self.effective(suction)


@dataclass(frozen=True)
class VanGenuchten(_Curve):
    """S_e = [1 + (alpha s)^n]^-m, m = 1 - 1/n; k_r = sqrt(S_e) [1 - (1 - S_e^(1/m))^m]^2.

    (van Genuchten 1980, with Mualem's model of the permeability.) Below n = 1.5 the permeability falls so steeply at zero
    suction that steps in time become short; an air-entry suction of some 200 Pa cures that: soil is saturated up to it, and
    S_e and k_r are scaled to be 1 there (Vogel, van Genuchten and Cislerova 2000).

    Raises:
        InputError: a value out of its range.
    """

    alpha: float
    """Inverse of a suction [1/Pa], above 0 (a value in 1/m divided by the unit weight of water)"""
    n: float
    """Exponent [-], above 1"""
    residual: float = 0.0
    """Residual degree of saturation [-], in [0, 1)"""
    air_entry: float = 0.0
    """Air-entry suction [Pa], 0 or more"""

    def __post_init__(self) -> None:
        _check_positive("alpha", self.alpha, "1/Pa")
        _warn_of_alpha(self.alpha)
        if not (is_finite(self.n) and self.n > 1):
            raise InputError(f"n is {self.n!r}, expected more than 1")
        _check_residual(self.residual)
        if not (is_finite(self.air_entry) and self.air_entry >= 0):
            raise InputError(f"air_entry is {self.air_entry!r} Pa, expected 0 or more")

    def _powers(self, suction: Any) -> Any:
        """(alpha s)^n at the suction and at the air entry."""
        entry = _at_least(self.alpha * self.air_entry, _SMALL)
        return _at_least(suction * self.alpha, entry) ** self.n, entry**self.n

    def effective(self, suction: Any) -> Any:
        """Effective saturation S_e [-].

        Args:
            suction: minus the pore pressure [Pa]: a number, a NumPy array or a UFL expression.
        """
        here, at_entry = self._powers(suction)
        return ((1 + here) / (1 + at_entry)) ** (1 / self.n - 1)

    def relative_permeability(self, suction: Any) -> Any:
        """Fraction k_r of the saturated conductivity [-], falling from 1.

        Args:
            suction: minus the pore pressure [Pa]: a number, a NumPy array or a UFL expression.

        Returns:
            The same kind of value.
        """
        m = 1 - 1 / self.n
        # 1 - S_e^(1/m) is x / (1 + x) with x = (alpha s)^n, without the loss of digits near saturation.
        here, at_entry = self._powers(suction)
        through = (1 - (here / (1 + here)) ** m) / (1 - (at_entry / (1 + at_entry)) ** m)
        kept = self.effective(suction) ** 0.5 * through**2
        return LEAST_PERMEABILITY + (1 - LEAST_PERMEABILITY) * kept


@dataclass(frozen=True)
class Gardner(_Curve):
    """S_e = k_r = exp(-alpha s) (Gardner 1958), for which many flows have closed forms.

    Raises:
        InputError: a value out of its range.
    """

    alpha: float
    """Inverse of a suction [1/Pa], above 0"""
    residual: float = 0.0
    """Residual degree of saturation [-], in [0, 1)"""

    def __post_init__(self) -> None:
        _check_positive("alpha", self.alpha, "1/Pa")
        _warn_of_alpha(self.alpha)
        _check_residual(self.residual)

    def effective(self, suction: Any) -> Any:
        """Effective saturation S_e [-].

        Args:
            suction: minus the pore pressure [Pa]: a number, a NumPy array or a UFL expression.
        """
        return _exp(-self.alpha * _at_least(suction, 0.0))

    def relative_permeability(self, suction: Any) -> Any:
        """Fraction k_r of the saturated conductivity [-].

        Args:
            suction: minus the pore pressure [Pa]: a number, a NumPy array or a UFL expression.
        """
        return LEAST_PERMEABILITY + (1 - LEAST_PERMEABILITY) * self.effective(suction)


@dataclass(frozen=True)
class Tabulated(_Curve):
    """Measured points, joined by straight lines; beyond the last suction the last values hold.

    Raises:
        InputError: curves of different length, that do not fall, or that do not begin saturated.
    """

    suction: tuple[float, ...]
    """Suctions [Pa], shape (k,), rising, the first one 0"""
    saturation_values: tuple[float, ...]
    """Degrees of saturation [-], shape (k,), falling from 1"""
    permeability_values: tuple[float, ...]
    """Relative permeabilities [-], shape (k,), falling from 1 and 0 or more"""

    def __post_init__(self) -> None:
        lengths = {len(self.suction), len(self.saturation_values), len(self.permeability_values)}
        if len(lengths) != 1 or lengths == {1} or lengths == {0}:
            raise InputError(f"suction, saturation_values and permeability_values have {sorted(lengths)} values, "
                             "expected the same number of each, at least two")  # fmt: skip
        s = real_numbers("suction", self.suction)
        if not (s[0] == 0 and np.all(np.diff(s) > 0) and np.all(np.isfinite(s))):
            raise InputError(f"suction is {self.suction!r} Pa, expected rising values from 0 on")
        for name in ("saturation_values", "permeability_values"):
            values = real_numbers(name, getattr(self, name))
            wrong = np.flatnonzero(~(np.diff(values) <= 0))
            if len(wrong):
                k = wrong[0]
                raise InputError(f"{name} rises from {values[k]:g} to {values[k + 1]:g} between suctions of {s[k]:g} and "
                                 f"{s[k + 1]:g} Pa, expected values that fall")  # fmt: skip
            if values[0] != 1 or values[-1] < 0:
                raise InputError(f"{name} goes from {values[0]:g} to {values[-1]:g}, expected from 1 to no less than 0")
        if self.residual == 1:
            raise InputError(
                "saturation_values stay 1, expected values that fall; soil that stays saturated has AlwaysSaturated()"
            )

    @property
    def residual(self) -> float:  # type: ignore[override]
        """Residual degree of saturation [-]: the last one."""
        return self.saturation_values[-1]

    def effective(self, suction: Any) -> Any:
        """Effective saturation S_e [-].

        Args:
            suction: minus the pore pressure [Pa]: a number, a NumPy array or a UFL expression.
        """
        return (self.saturation(suction) - self.residual) / (1 - self.residual)

    def saturation(self, suction: Any) -> Any:
        """Degree of saturation S [-].

        Args:
            suction: minus the pore pressure [Pa]: a number, a NumPy array or a UFL expression.
        """
        return _joined(suction, self.suction, self.saturation_values)

    def relative_permeability(self, suction: Any) -> Any:
        """Fraction k_r of the saturated conductivity [-].

        Args:
            suction: minus the pore pressure [Pa]: a number, a NumPy array or a UFL expression.
        """
        kept = _joined(suction, self.suction, self.permeability_values)
        return LEAST_PERMEABILITY + (1 - LEAST_PERMEABILITY) * kept


@dataclass(frozen=True)
class FreeSurface(_Curve):
    """Soil that drains above the water table and hardly conducts water there: for seepage with a free surface.

    The relative permeability falls smoothly from 1 to `dry_permeability` over the suction of a `fringe` of water, and
    saturation from 1 to `residual`.

    Raises:
        InputError: a value out of its range.
    """

    fringe: float = 1e3
    """Suction at which soil is dry [Pa], some tenth of a cell's height times the unit weight of water"""
    dry_permeability: float = 1e-3
    """Relative permeability of dry soil [-], in (0, 1)"""
    residual: float = 0.0
    """Residual degree of saturation [-], in [0, 1)"""

    def __post_init__(self) -> None:
        _check_positive("fringe", self.fringe, "Pa")
        _check_residual(self.residual)
        if not 0 < self.dry_permeability < 1:
            raise InputError(f"dry_permeability is {self.dry_permeability!r}, expected more than 0 and less than 1")

    def effective(self, suction: Any) -> Any:
        """Effective saturation S_e [-].

        Args:
            suction: minus the pore pressure [Pa]: a number, a NumPy array or a UFL expression.
        """
        x = _at_most(_at_least(suction / self.fringe, 0.0), 1.0)
        return 1 - x * x * (3 - 2 * x)

    def relative_permeability(self, suction: Any) -> Any:
        """Fraction k_r of the saturated conductivity [-].

        Args:
            suction: minus the pore pressure [Pa]: a number, a NumPy array or a UFL expression.
        """
        return self.dry_permeability + (1 - self.dry_permeability) * self.effective(suction)


@dataclass(frozen=True)
class AlwaysSaturated(_Curve):
    """Soil that stays saturated under any suction."""

    residual = 0.0

    def effective(self, suction: Any) -> Any:
        """Effective saturation S_e = 1 [-], which is also the fraction k_r of the saturated conductivity.

        Args:
            suction: minus the pore pressure [Pa]: a number, a NumPy array or a UFL expression.
        """
        return 1 + 0 * suction

    relative_permeability = effective


# --- for numbers and UFL alike ---------------------------------------------------------------------------------------


def _exp(x: Any) -> Any:
    return ufl.exp(x) if isinstance(x, Expr) else np.exp(x)


def _at_least(x: Any, low: float) -> Any:
    return ufl.max_value(x, low) if isinstance(x, Expr) else np.maximum(x, low)


def _at_most(x: Any, high: float) -> Any:
    return ufl.min_value(x, high) if isinstance(x, Expr) else np.minimum(x, high)


def _joined(x: Any, places: Any, values: Any) -> Any:
    """Straight lines between points; the first and the last value outside of them."""
    if not isinstance(x, Expr):
        return np.interp(x, places, values)
    result = ufl.as_ufl(values[-1])
    for k in reversed(range(len(places) - 1)):
        slope = (values[k + 1] - values[k]) / (places[k + 1] - places[k])
        result = ufl.conditional(ufl.lt(x, places[k + 1]), values[k] + slope * (x - places[k]), result)
    return ufl.conditional(ufl.lt(x, places[0]), ufl.as_ufl(values[0]), result)


def _check_positive(name: str, value: float, unit: str) -> None:
    if not (is_finite(value) and value > 0):
        raise InputError(f"{name} is {value!r} {unit}, expected a positive number")


def _warn_of_alpha(alpha: float) -> None:
    if alpha > LARGEST_ALPHA and MPI.COMM_WORLD.rank == 0:
        warnings.warn(
            f"alpha is {alpha:g} 1/Pa, so that soil dries at a suction of {1 / alpha:.2g} Pa; a value in 1/m is divided by the unit "
            f"weight of water ({alpha / 9810:.3g} 1/Pa), one in 1/kPa by 1000",
            RuntimeWarning,
            stacklevel=4,
        )


def _check_residual(value: float) -> None:
    if not 0 <= value < 1:
        raise InputError(f"residual is {value!r}, expected at least 0 and less than 1")
