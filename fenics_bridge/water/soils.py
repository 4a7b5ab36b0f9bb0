"""Hydraulic properties of soils, and the soil of each cell."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, field, fields, replace
from typing import Any, NamedTuple

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.mesh import Mesh
from mpi4py import MPI
from mpm_core.input_warnings import warn_of_water_density
from mpm_core.retention import curve_values
from mpm_core.water_checks import LABORATORY_GRAVITY
from numpy.typing import ArrayLike, NDArray

from fenics_bridge import compat
from fenics_bridge.errors import InputError, agree, is_finite
from fenics_bridge.mesh.names import by_number, label
from fenics_bridge.mesh.tagged import numbered_anew, owned_cells, tag_values
from fenics_bridge.types import MeshTags
from fenics_bridge.water.retention import AlwaysSaturated, FreeSurface, Gardner, Tabulated, VanGenuchten

WATER_DENSITY = 1000.0
"""Density of water [kg/m3]."""

WATER_WEIGHT = WATER_DENSITY * LABORATORY_GRAVITY
"""Unit weight of water under 9.81 m/s2 [N/m3]."""

WATER_MODULUS = 2.2e9
"""Bulk modulus of water [Pa]."""


class Water(NamedTuple):
    """Water in the pores, as `given_water` checks it."""

    unit_weight: float
    """gamma_w [N/m3], under the gravity of the model"""
    modulus: float
    """K_w [Pa]"""
    gravity: float
    """Gravity of the model [m/s2]"""


def given_water(
    comm: MPI.Comm, unit_weight: float | None, gravity: float, modulus: float = WATER_MODULUS, infinite: bool = False
) -> Water:
    """Water of a unit weight [N/m3] under a gravity [m/s2], by default that of 1000 kg/m3; warns of an odd one. Collective.

    Raises:
        InputError: a number that is not positive; the modulus [Pa] may be infinite where that is allowed. Raised on all ranks alike.
    """
    mistake = None
    if not (is_finite(gravity) and gravity > 0):
        mistake = f"gravity is {gravity!r} m/s2, expected a positive number"
    elif not (is_finite(weight := WATER_DENSITY * gravity if unit_weight is None else unit_weight) and weight > 0):
        mistake = f"unit_weight is {unit_weight!r} N/m3, expected a positive number"
    elif not ((is_finite(modulus) and modulus > 0) or (infinite and modulus == np.inf)):
        mistake = f"water_modulus is {modulus!r} Pa, expected a positive number{', or infinity' if infinite else ''}"
    agree(comm, mistake)
    warn_of_water_density(comm, weight / gravity, stacklevel=4)
    return Water(weight, modulus, gravity)


@dataclass(frozen=True)
class PorousSoil:
    """Hydraulic properties of a soil: conductivity, porosity, compressibility and retention curve.

    Raises:
        InputError: a value out of its range.
    """

    conductivity: Any
    """Saturated hydraulic conductivity k [m/s]: a number, (D,) along the axes, or a symmetric (D, D) tensor; positive. As measured
    in a laboratory under 9.81 m/s2, whatever the gravity of the model"""
    porosity: float = 0.4
    """Porosity n [-], in (0, 1); for transient flow only"""
    compressibility: float = 0.0
    """Compressibility of the skeleton m_v [1/Pa], the inverse of the oedometric modulus; for transient flow only"""
    retention: Any = field(default_factory=AlwaysSaturated)
    """Retention curve of `fenics_bridge.water.retention`; without one the soil stays saturated"""
    density: float | None = None
    """Density of the saturated soil [kg/m3]; for steps with inertia only"""

    def __post_init__(self) -> None:
        try:
            k = np.multiply(1.0, self.conductivity)  # which refuses text
        except (TypeError, ValueError):
            k = np.full(1, np.nan)
        square = k.ndim == 2 and k.shape[0] == k.shape[1] and np.allclose(k, k.T)
        if not (
            np.all(np.isfinite(k)) and (k.ndim < 2 or square) and np.all(np.linalg.eigvalsh(self.tensor(k, 3)) > 0)
        ):
            raise InputError(f"conductivity is {self.conductivity!r} m/s, expected positive numbers, or a "
                             "symmetric tensor with positive principal values")  # fmt: skip
        if not (is_finite(self.porosity) and 0 < self.porosity < 1):
            raise InputError(f"porosity is {self.porosity!r}, expected more than 0 and less than 1")
        if not (is_finite(self.compressibility) and self.compressibility >= 0):
            raise InputError(f"compressibility is {self.compressibility!r} 1/Pa, expected 0 or more")
        curve_values(self.retention)
        if self.density is not None and not (is_finite(self.density) and self.density > 0):
            raise InputError(f"density is {self.density!r} kg/m3, expected a positive number")

    @staticmethod
    def tensor(conductivity: ArrayLike, dim: int) -> NDArray[np.float64]:
        """Conductivity as a tensor.

        Args:
            conductivity: as the attribute [m/s].
            dim: dimension D, where the conductivity is one number.

        Returns:
            Shape (D, D) [m/s].
        """
        k = np.asarray(conductivity, dtype=float)
        return k if k.ndim == 2 else np.diag(np.broadcast_to(k, k.shape or (dim,)))


def dipping(along: float, across: float, dip: float, direction: float | None = None) -> NDArray[np.float64]:
    """Tensor of the conductivity of strata that dip, for `PorousSoil` or, over a conductivity, for `Model.add_water`.

    Args:
        along: conductivity along the strata [m/s].
        across: conductivity across them [m/s].
        dip: angle by which they fall below the horizontal [degrees]; in two dimensions along x.
        direction: in three dimensions, the horizontal direction in which they fall, as an angle from x towards y [degrees].

    Returns:
        Shape (2, 2), or (3, 3) with a direction [m/s].

    Raises:
        InputError: a conductivity is not positive, or an angle is not finite.
    """
    for name, value in (("along", along), ("across", across)):
        if not (is_finite(value) and value > 0):
            raise InputError(f"{name} is {value!r} m/s, expected a positive number")
    for name, value in (("dip", dip), ("direction", 0.0 if direction is None else direction)):
        if not is_finite(value):
            raise InputError(f"{name} is {value!r} degrees, expected a finite number")
    sine, cosine = np.sin(np.radians(dip)), np.cos(np.radians(dip))
    turned = None if direction is None else np.radians(direction)
    normal = np.array([sine, cosine] if turned is None else [sine * np.cos(turned), sine * np.sin(turned), cosine])
    return along * np.eye(len(normal)) + (across - along) * np.outer(normal, normal)


def soils_by_tag(
    domain: Mesh, soil: Any, cell_tags: MeshTags | None, dry: bool = False, gravity: float = LABORATORY_GRAVITY
) -> tuple[list[PorousSoil], list[Any], list[NDArray[np.int32]]]:
    """The soils, the measure over the cells of each, and these cells, ghosts too. Collective.

    Args:
        domain: mesh of the body.
        soil: soil, or soils by cell tag or name.
        cell_tags: tags of the cells.
        dry: whether some may be None, which holds no water and is left out.
        gravity: of the model [m/s2], under which the soils that are returned have their conductivities.

    Raises:
        InputError: a tag does not exist or has no soil, or a conductivity is of another dimension. Raised on all ranks alike.
    """
    comm, dim = domain.comm, domain.geometry.dim
    by_tag: dict[Any, PorousSoil] = {None: soil} if not isinstance(soil, dict) else soil
    for key, one in by_tag.items():
        allowed = isinstance(one, PorousSoil) or (dry and one is None and key is not None)
        agree(comm, None if allowed else f"soil is {one!r} for {key!r}, expected a PorousSoil")
        shape = np.shape(getattr(one, "conductivity", 0.0))
        agree(comm, None if not shape or shape[0] == dim else f"conductivity has shape {shape}, expected ({dim},) or "
              f"({dim}, {dim}) in {dim}D")  # fmt: skip
    if not isinstance(soil, dict):
        every = np.arange(owned_cells(domain) + domain.topology.index_map(dim).num_ghosts, dtype=np.int32)
        return [_under(soil, gravity)], [ufl.Measure("dx", domain=domain)], [every]
    agree(comm, "cell_tags is None, expected the tags that the soils are given for" if cell_tags is None else None)
    by_tag = by_number(comm, cell_tags, by_tag, "soil", "cell")
    values = tag_values(domain, cell_tags, dim)
    known = set().union(*comm.allgather(set(values.tolist())))
    without = sorted(known - set(by_tag))
    agree(comm, f"soil: none for cells with tag {label(cell_tags, without[0])} (0: untagged)" if without else None)
    wet = [tag for tag, one in by_tag.items() if one is not None]
    agree(comm, None if wet else "soil is None for all cells, expected a PorousSoil for some")
    cells = [np.flatnonzero(values == tag).astype(np.int32) for tag in wet]
    dx = ufl.Measure("dx", domain=domain, subdomain_data=numbered_anew(domain, cell_tags, [[tag] for tag in wet]))
    return [_under(by_tag[tag], gravity) for tag in wet], [dx(1 + i) for i in range(len(wet))], cells


def as_constants(domain: Mesh, soils: Sequence[Any]) -> list[Any]:
    """Soils for forms: all numbers are constants, so that forms are compiled once, not for each value of a parameter.

    Args:
        domain: mesh of the forms.
        soils: soils, as of `soils_by_tag`.

    Returns:
        Copies of them. The conductivity is a tensor, shape (D, D) [m/s].
    """
    dim = domain.geometry.dim
    return [_constant(domain, replace(s, conductivity=s.tensor(s.conductivity, dim))) for s in soils]


def _constant(domain: Mesh, value: Any) -> Any:
    """A number, an array, or the copy of a soil or a curve, whose checks are passed by, for forms; a user's own curve stays."""
    if type(value) in (PorousSoil, VanGenuchten, Gardner, Tabulated, FreeSurface):
        result = copy(value)
        for each in fields(value):
            object.__setattr__(result, each.name, _constant(domain, getattr(value, each.name)))
        return result
    if isinstance(value, tuple):
        return tuple(_constant(domain, each) for each in value)
    is_number = isinstance(value, (int, float, np.number, np.ndarray))
    return fem.Constant(domain, np.asarray(value, dtype=np.float64)) if is_number else value


def set_by_soil(function: fem.Function, soils: Sequence[Any], cells: Sequence[NDArray[np.int32]], values: Any) -> None:
    """Sets a continuous function at the nodes of each soil; where soils meet, the last one counts. Collective.

    Args:
        function: the function.
        soils: soils, as of `soils_by_tag`.
        cells: their cells on this rank, likewise.
        values: function of a soil and of rows of `function.x.array` (m,) that returns their values (m,).
    """
    dofs = compat.cell_dofs(function.function_space)
    for soil, own in zip(soils, cells):
        nodes = np.unique(dofs[own])
        function.x.array[nodes] = values(soil, nodes)
    function.x.scatter_forward()


def acting_pressure(
    pressure: fem.Function, soils: Sequence[Any], cells: Sequence[NDArray[np.int32]], suction: bool
) -> fem.Function:
    """Pore pressure [Pa] as it acts on the skeleton, a continuous function. Collective.

    Args:
        pressure: pore pressure [Pa], negative under suction.
        soils: soils, as of `soils_by_tag`.
        cells: their cells on this rank, likewise.
        suction: False for zero where the pressure is negative; True for the suction there times the effective saturation.
    """
    p = pressure.x.array
    acting = fem.Function(pressure.function_space, name="pore_pressure")
    acting.x.array[:] = np.maximum(p, 0.0)
    if suction:
        set_by_soil(acting, soils, cells, lambda soil, nodes: soil.retention.effective(-p[nodes]) * p[nodes])
    return acting


def _under(soil: Any, gravity: float) -> Any:
    """A soil with its conductivity under a gravity [m/s2], in which k / gamma_w is the same."""
    if gravity == LABORATORY_GRAVITY:
        return soil
    return replace(soil, conductivity=gravity / LABORATORY_GRAVITY * np.asarray(soil.conductivity))
