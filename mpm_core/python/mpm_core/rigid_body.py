"""Motion of rigid surfaces as given by the caller."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._core import Geometry, InputError
from .checks import flag, positive, real_numbers
from .mesh import floats
from .surfaces import Box, Disc, Sphere, Surface

Velocity: TypeAlias = ArrayLike | tuple[Sequence[float], ArrayLike] | None
"""A vector, or (times [s], values): linear in between and constant before and after."""


@dataclass(frozen=True)
class FreeBody:
    """A rigid body that gravity, contact and an applied force move: three degrees of freedom in two dimensions, six in three.

    The model's gravity acts on it; local damping of an explicit run does not.

    Args:
        mass: [kg]; per metre in plane strain, per radian in axial symmetry.
        inertia: moment of inertia about its centre [kg m2]; in three dimensions three principal moments, about axes that are x, y
            and z at the start, or one number for all. By default that of a homogeneous solid Disc, Sphere or Box.
        axes: for each axis, whether the body moves freely along it; along the others, as the prescribed velocity says. All by
            default, in axial symmetry only y.
        rotates: whether it rotates freely; otherwise it has the prescribed spin. True by default, except in axial symmetry.
        force: applied at its centre [N], shape (D,); or (times [s], forces (n, D)), in addition to the weight of the body. Per
            metre in plane strain, per radian in axial symmetry.
    """

    mass: float
    inertia: ArrayLike | None = None
    axes: Sequence[bool] | None = None
    rotates: bool | None = None
    force: Velocity = None


@dataclass(frozen=True)
class Servo:
    """Control of a load: along its axes the body moves so that contact balances the applied force, without inertia and weight.

    The velocity is the difference of both over m/dt, with the mass m of the particles in contact and the time step dt: a dashpot
    about as strong as sound waves in the soil. It does not oscillate, and approaches the load as fast as the soil does. Implicit
    steps end with the load of their end on the soil, whatever the speed.

    Args:
        force: that the body passes on to the soil [N], shape (D,); or (times [s], forces (n, D)). Per metre in plane strain, per
            radian in axial symmetry, of which a total load is 2 pi times as much. Entries of other axes are zero.
        speed: largest speed along each axis [m/s]; with it the body approaches the soil.
        axes: for each axis, whether it is controlled; by default those with a force other than zero. Along the others the body
            moves with the prescribed velocity.
    """

    force: Velocity
    speed: float
    axes: Sequence[bool] | None = None


def history(name: str, value: Velocity, size: int, unit: str) -> tuple[list[float], list[list[float]]]:
    """Times and values of a vector; a single component may go without brackets."""
    if value is None:
        return [0.0], [[0.0] * size]
    if isinstance(value, tuple) and len(value) == 2 and np.ndim(value[0]) == 1:
        times = floats(f"times of the {name}", value[0], (None,))
        if len(times) == 0 or (np.diff(times) <= 0).any():
            raise InputError(f"times of the {name} are {times.tolist()} s, expected rising ones")
        values = np.asarray(value[1])
        if size == 1 and values.ndim == 1:
            values = values[:, None]
        return times.tolist(), floats(f"values of the {name} [{unit}]", values, (len(times), size)).tolist()
    try:
        constant = real_numbers(name, value)
    except InputError as error:
        raise InputError(
            f"{name} is {value!r}, expected {size} numbers [{unit}], or a pair of times [s] and as many rows of them"
        ) from error
    return [0.0], [floats(name, constant[None] if size == 1 and constant.ndim == 0 else constant, (size,)).tolist()]


def describe(
    surface: Surface, centre: NDArray[np.float64], velocity: Velocity, spin: Velocity, body: FreeBody | Servo | None, *,
    geometry: Geometry, time: float,
) -> dict[str, Any]:  # fmt: skip
    """A motion as checkpoints describe it, with everything checked.

    Raises:
        InputError: an argument out of its range, or of another dimension.
    """
    dim = len(centre)
    entry: dict[str, Any] = {
        "centre": centre.tolist(), "start": time, "velocity": history("velocity", velocity, dim, "m/s"),
        "spin": history("spin", spin, 1 if dim == 2 else 3, "rad/s"), "drive": [0] * dim, "rotates": False, "mass": 0.0,
        "inertia": [0.0] * 3, "force": history("force", None, dim, "N"), "speed": 0.0,
    }  # fmt: skip
    if body is not None and not isinstance(body, FreeBody | Servo):
        raise InputError(f"body is {body!r}, expected a FreeBody or a Servo")
    if isinstance(body, FreeBody):
        entry |= _free(body, surface, centre, geometry)
    elif body is not None:
        entry |= _servo(body, dim)
    flat = geometry == Geometry.AXISYMMETRIC
    if flat and (entry["rotates"] or np.any(entry["spin"][1])):
        raise InputError("spin or rotates is given, expected a body that does not rotate in axial symmetry")
    if flat and entry["drive"][0] != 0:
        raise InputError(f"axes is {body.axes}, expected (False, True) in axial symmetry")  # type: ignore[union-attr]
    return entry


def _axes(axes: Sequence[bool], dim: int) -> list[bool]:
    if np.ndim(axes) != 1 or len(axes) != dim or not all(isinstance(axis, bool | np.bool_) for axis in axes):
        raise InputError(f"axes is {axes!r}, expected {dim} times True or False")
    return [bool(axis) for axis in axes]


def _free(body: FreeBody, surface: Surface, centre: NDArray[np.float64], geometry: Geometry) -> dict[str, Any]:
    dim = len(centre)
    flat = geometry == Geometry.AXISYMMETRIC
    axes = _axes(((False, True) if flat else (True,) * dim) if body.axes is None else body.axes, dim)
    rotates = (not flat) if body.rotates is None else flag("rotates", body.rotates)
    mass = positive("mass", body.mass, "kg")
    moments = np.zeros(3)
    if rotates:
        moments[2 if dim == 2 else 0 :] = _inertia(body, surface, centre, mass)
    force = history("force", body.force, dim, "N")
    return {
        "drive": [int(axis) for axis in axes], "rotates": rotates, "mass": mass, "inertia": moments.tolist(), "force": force,
    }  # fmt: skip


def _inertia(body: FreeBody, surface: Surface, centre: NDArray[np.float64], mass: float) -> NDArray[np.float64]:
    """Principal moments of inertia, of which there are one or three."""
    dim = len(centre)
    if body.inertia is None:
        own = surface._checked(dim)[1]
        if not isinstance(surface, Disc | Sphere | Box) or not np.array_equal(centre, own):
            raise InputError(
                f"inertia is not given, expected it for a {type(surface).__name__} that rotates freely about {centre.tolist()} "
                "m; it follows from the mass for a Disc, Sphere or Box about its own centre"
            )
        if not isinstance(surface, Box):
            return np.full(1 if dim == 2 else 3, (0.5 if dim == 2 else 0.4) * mass * surface.radius**2)
        squares = mass / 12 * (np.asarray(surface.upper, dtype=float) - np.asarray(surface.lower, dtype=float)) ** 2
        return squares.sum() - squares if dim == 3 else squares.sum(keepdims=True)
    given = np.asarray(body.inertia)
    moments = floats("inertia", given[None] if given.ndim == 0 else given, (3,) if dim == 3 and given.ndim else (1,))
    if (moments <= 0).any():
        raise InputError(f"inertia is {moments.tolist()} kg m2, expected positive moments")
    if len(moments) == 3 and 2 * moments.max() > moments.sum() * (1 + 1e-12):
        raise InputError(f"inertia is {moments.tolist()} kg m2, expected no moment above the sum of the other two")
    return moments if dim == 2 or len(moments) == 3 else np.full(3, moments[0])


def _servo(body: Servo, dim: int) -> dict[str, Any]:
    force = history("force", body.force, dim, "N")
    loaded = np.any(force[1], axis=0)
    axes = _axes(loaded if body.axes is None else body.axes, dim)
    if not any(axes):
        raise InputError("force of the Servo is zero, expected a load along some axis, or axes that are controlled")
    if (loaded & ~np.array(axes)).any():
        raise InputError(
            f"force of the Servo is {force[1]} N, expected no component along axes that are not controlled"
        )
    return {"drive": [2 * int(axis) for axis in axes], "force": force, "speed": positive("speed", body.speed, "m/s")}


def rigid_body(entry: dict[str, Any]) -> Any:
    """The body of the core that a description stands for, at its start."""
    dim = len(entry["centre"])
    spins = [values if dim == 3 else [0.0, 0.0, *values] for values in entry["spin"][1]]

    def at_start(times: list[float], values: list[list[float]]) -> list[float]:
        return [float(np.interp(entry["start"], times, column)) for column in np.transpose(values)]

    velocity = at_start(*entry["velocity"])
    return getattr(_core, f"RigidBody{dim}")(
        entry["centre"], tuple(entry["velocity"]), (entry["spin"][0], spins), entry["drive"], entry["rotates"], entry["mass"],
        entry["inertia"], tuple(entry["force"]), entry["speed"], velocity, at_start(entry["spin"][0], spins),
    )  # fmt: skip


def motion_text(entry: dict[str, Any], geometry: Geometry) -> str:
    """How a body moves, in words with units; empty for one at rest."""
    per = {Geometry.PLANE_STRAIN: "/m", Geometry.AXISYMMETRIC: "/rad"}.get(geometry, "")
    texts = []
    if 2 in entry["drive"]:
        texts.append(f"servo of {_rows(entry['force'])} N{per}")
    elif any(entry["drive"]) or entry["rotates"]:
        texts.append(f"free body of {entry['mass']:g} kg{per}")
    moves = [("velocity", "m/s"), ("spin", "rad/s")]
    texts += [f"{name} {_rows(entry[name])} {unit}" for name, unit in moves if np.any(entry[name][1])]
    return "".join(f", {text}" for text in texts)


def _rows(table: tuple[list[float], list[list[float]]]) -> str:
    """A vector, or the first and last ones of a table over time."""
    first, last = (", ".join(f"{value:g}" for value in row) for row in (table[1][0], table[1][-1]))
    return f"({first})" if len(table[0]) == 1 else f"({first}) to ({last})"
