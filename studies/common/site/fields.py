"""Random fields of the soils of a site: strength that varies from place to place, also about a mean that grows with depth.

Example of a file:

    [soils.clay]
    material = "tresca"
    shear_strength = {value = 15e3, variation = 0.3, lengths = [20.0, 2.0], seed = 1}
    # and per_metre, top as of parameters that grow with depth; correlation = "gaussian"; lognormal = false
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from mpm_core.parameter_fields import has_varying, nominal_value
from numpy.typing import NDArray

import mpm_core as mpm

from ..parameters import unknown_key
from .laws import is_number, is_profile

KEYS = ("value", "per_metre", "top", "variation", "lengths", "seed", "correlation", "lognormal")
RANDOM = {"cohesion": "cohesion", "shear_strength": "cohesion", "friction_angle": "friction_angle"}
"""Parameters that may be random fields, and what their laws call them"""


@dataclass(frozen=True)
class SoilField:
    """A parameter of a soil that is a random field about its mean.

    soil: its name; parameter: as its law calls it; mean: function of heights (n,) [m]; relative: field with the mean 1
    nominal: value of the law of the soil that is not weakened
    """

    soil: str
    parameter: str
    mean: Callable[[NDArray[np.float64]], Any]
    relative: mpm.RandomField
    nominal: float

    def __call__(self, position: NDArray[np.float64]) -> NDArray[np.float64]:
        """Values at positions [m], shape (n, D): shape (n,)."""
        return self.mean(position[:, -1]) * self.relative(position)


def fields_of(soil: str, parameters: Mapping[str, Any], dim: int, where: str) -> tuple[list[SoilField], dict[str, Any]]:
    """The random fields among the parameters of a soil, and its parameters with the mean in place of each.

    Args:
        soil: its name.
        parameters: of its law, as in the file.
        dim: of the mesh.
        where: they stand, for messages.

    Raises:
        InputError: a field that is not possible.
    """
    fields, numbers = [], dict(parameters)
    for name, given in parameters.items():
        if not isinstance(given, dict) or not {"variation", "lengths"} & set(given):
            continue
        here = f"{where}: {name}"
        if name not in RANDOM:
            raise mpm.InputError(f"{here} is a random field, expected one of {', '.join(RANDOM)} only")
        for key in given:
            if key not in KEYS:
                raise mpm.InputError(f"{here}: {unknown_key(key, KEYS)}")
        profile = {key: given[key] for key in ("value", "per_metre", "top") if key in given}
        if not (is_number(given.get("value")) and (set(profile) == {"value"} or is_profile(profile))):
            raise mpm.InputError(f"{here} is {given}, expected value, or value, per_metre and top, of a random field")
        fields.append(SoilField(soil, RANDOM[name], _mean(profile), _relative(given, dim, here), float(given["value"])))
        numbers[name] = float(given["value"])
    return fields, numbers


def _mean(profile: Mapping[str, float]) -> Callable[[NDArray[np.float64]], Any]:
    value, slope, top = profile["value"], profile.get("per_metre", 0.0), profile.get("top", 0.0)
    return lambda height: value + slope * np.maximum(top - height, 0.0)


def _relative(given: Mapping[str, Any], dim: int, where: str) -> mpm.RandomField:
    """The field of the values over their mean."""
    seed = given.get("seed", 0)
    seed = int(seed) if is_number(seed) and seed == int(seed) else seed
    if not is_number(given.get("variation")) or given["variation"] < 0:
        raise mpm.InputError(
            f"{where}: variation is {given.get('variation')!r}, expected a coefficient of variation from 0 on, such as 0.3"
        )
    lengths = given.get("lengths")
    if not isinstance(lengths, list) or len(lengths) != dim:
        raise mpm.InputError(
            f"{where}: lengths is {lengths!r}, expected a correlation length along each of {dim} axes [m], such as {[20.0] * (dim - 1) + [2.0]}"
        )
    lognormal = given.get("lognormal", True)
    if not isinstance(lognormal, bool):
        raise mpm.InputError(f"{where}: lognormal is {lognormal!r}, expected true or false")
    try:
        return mpm.RandomField(mean=1.0, deviation=given["variation"], lengths=lengths, seed=seed, lognormal=lognormal,
                               correlation=given.get("correlation", "markov"))  # fmt: skip
    except mpm.InputError as error:
        raise mpm.InputError(f"{where}: {error}") from None


def varying(law: Any, parameters: Sequence[str]) -> Any:
    """The law of a soil with parameters that vary from point to point; that of undrained soil keeps its pore water."""
    if all(has_varying(law, name) for name in parameters):
        return law
    if isinstance(law, mpm.Undrained):
        return mpm.Undrained(varying(law.skeleton, parameters), water_modulus=law.water_modulus, porosity=law.porosity)
    return mpm.Heterogeneous(law, parameters)


def values_of(
    fields: Sequence[SoilField],
    positions: NDArray[np.float64],
    tags: NDArray[Any],
    tags_of: Callable[[list[str]], list[int]],
    laws: Mapping[int, Any],
) -> dict[str, NDArray[np.float64]]:
    """Values of all random parameters at points, by name; in other soils those of their laws, or 1 where these do not ask for them.

    Args:
        fields: of all soils.
        positions: [m], shape (n, D).
        tags: the tag of each point's soil, shape (n,).
        tags_of: function of names of soils that gives their tags.
        laws: laws by tag.
    """
    values: dict[str, NDArray[np.float64]] = {}
    for name in dict.fromkeys(field.parameter for field in fields):
        values[name] = np.ones(len(positions))
        for tag, law in laws.items():
            if has_varying(law, name):
                values[name][tags == tag] = nominal_value(law, name)
    for field in fields:
        rows = np.flatnonzero(np.isin(tags, tags_of([field.soil])))
        values[field.parameter][rows] = field(positions[rows])
        # The peak of softening soil is a number of the law, which has been divided with it.
        for tag in tags_of([field.soil]):
            if field.nominal > 0 and tag in laws and has_varying(laws[tag], field.parameter):
                values[field.parameter][tags == tag] *= nominal_value(laws[tag], field.parameter) / field.nominal
    return values
