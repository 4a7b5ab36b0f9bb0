"""Parameters of laws that differ from point to point: profiles over depth, values by tag, random fields."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._core import Hencky, Heterogeneous, InputError, SofteningMohrCoulomb, Undrained
from .checks import count, real_numbers
from .mesh import Tag, floats

Field = float | ArrayLike | Callable[[NDArray[np.float64]], ArrayLike] | Mapping[Tag, float]
"""Values of a parameter as they may be given, see `Model.set_parameter`"""


DEVIATION = "cohesion_deviation"
"""State variable of `SofteningMohrCoulomb`: the relative deviation of a point's cohesion, peak and residual"""


def _core_part(law: Any) -> Any:
    """The law that `Hencky` and `Undrained` are made of."""
    while isinstance(law, (Hencky, Undrained)):
        law = law.law if isinstance(law, Hencky) else law.skeleton
    return law


def varying_of(law: Any) -> Sequence[str]:
    """Names of the parameters of a law that vary from point to point: those of `Heterogeneous`, and the cohesion of `SofteningMohrCoulomb`."""
    part = _core_part(law)
    return part.varying if isinstance(part, Heterogeneous) else ["cohesion"] * isinstance(part, SofteningMohrCoulomb)


def has_varying(law: Any, name: str) -> bool:
    """Whether a parameter of a law varies from point to point."""
    return name in varying_of(law)


def nominal_value(law: Any, name: str) -> float:
    """The nominal value of a parameter that varies."""
    part = _core_part(law)
    return part.peak.cohesion if isinstance(part, SofteningMohrCoulomb) else getattr(part.law, name)


def values_from(law: Any, name: str, state: NDArray[np.float64]) -> NDArray[np.float64]:
    """Values (n,) of a parameter that varies, from the states (n, number of states) of points of the law."""
    nominal = nominal_value(law, name)
    if isinstance(_core_part(law), SofteningMohrCoulomb):
        return nominal * (1 + state[:, law.state_names.index(DEVIATION)])
    return nominal + state[:, law.state_names.index(f"{name}_difference")]


def parameter_values(
    name: str,
    given: Any,
    position: NDArray[np.float64],
    of_cell: Any,
    tags: Mapping[Any, Any],
) -> NDArray[np.float64]:
    """Values at points, shape (n,); NaN at points that none are given for.

    Args:
        name: name of the parameter, for messages.
        given: as for `Model.set_parameter`.
        position: [m], shape (n, D).
        of_cell: tag of each point's cell, shape (n,); used where values are given by tag.
        tags: {key of `given`: the cell tags that it stands for}.
    """
    if isinstance(given, Mapping):
        values = np.full(len(position), np.nan)
        for tag, value in given.items():
            values[np.isin(of_cell, tags[tag])] = floats(name, [value], (1,))[0]
        return values
    if callable(given):
        given = given(position)
    elif np.ndim(given) == 0:
        return np.full(len(position), floats(name, [given], (1,))[0])
    return floats(name, given, (len(position),))


def check_differences(law: Any, state: NDArray[np.float64]) -> None:
    """Require that the parameters of points are in their ranges, and no stiffer than the law's numbers.

    Args:
        law: any law; one without parameters that vary fits to all states.
        state: state variables of points of the law, shape (n, number of states).

    Raises:
        InputError: a point's parameters are not possible.
    """
    part = _core_part(law)
    if isinstance(part, Heterogeneous):
        first = law.state_names.index(f"{part.varying[0]}_difference")
        part.check_points(np.ascontiguousarray(state[:, first : first + len(part.varying)]))


def differences_of(
    name: str, values: NDArray[np.float64], laws: Sequence[Any], material: NDArray[np.int32], state: NDArray[np.float64]
) -> NDArray[np.float64]:
    """A copy of the states of points with the values of a parameter in them.

    Args:
        name: name of the parameter.
        values: values of the parameter, shape (n,); points where they are NaN keep theirs.
        laws: the laws, by number.
        material: number of each point's law, shape (n,).
        state: shape (n, number of states).

    Raises:
        InputError: no law varies in the parameter; a value out of its range, or stiffer than the law's numbers.
    """
    numbers = [k for k, law in enumerate(laws) if has_varying(law, name)]
    if not numbers:
        known = [one for law in laws for one in varying_of(law)]
        has = ", ".join(dict.fromkeys(known)) or "no parameter; make the law Heterogeneous(law, [names])"
        raise InputError(f"name is '{name!s}', but what varies in the laws is {has}")
    new = state.copy()
    for number in numbers:
        law, rows = laws[number], np.flatnonzero((material == number) & ~np.isnan(values))
        part, nominal = _core_part(law), nominal_value(law, name)
        if isinstance(part, SofteningMohrCoulomb):
            new[rows, law.state_names.index(DEVIATION)] = _deviations(name, values[rows], nominal)
            continue
        new[rows, law.state_names.index(f"{name}_difference")] = values[rows] - nominal
        try:
            check_differences(law, new[rows])
        except InputError as error:  # the value may be one of another parameter, which does not fit to those given
            raise InputError(str(error) if name in str(error) else f"with the values of {name}, {error}") from None
    return new


def _deviations(name: str, values: NDArray[np.float64], nominal: float) -> NDArray[np.float64]:
    """Values of the cohesion of points over that of their law, less 1.

    Raises:
        InputError: a value below 0, or a law without cohesion, to which none is relative.
    """
    if not nominal > 0:
        raise InputError(
            f"{name} of the law SofteningMohrCoulomb is {nominal:g} Pa, expected more than 0: points have values in proportion to it"
        )
    wrong = values[values < 0]
    if len(wrong):
        raise InputError(f"{name} = {wrong[0]:g} of a point, expected at least 0 [Pa]")
    return values / nominal - 1


class RandomField:
    """A random field: a function of positions that is the same on any number of ranks, and for any other points.

    A sum of waves with random directions and phases, whose spectrum is that of the correlation (Shinozuka & Jan 1972): over
    all seeds mean, deviation and correlation are exact, and values are normal except for a fraction of 1 / waves.

    Args:
        mean: of the values.
        deviation: standard deviation of the values.
        lengths: correlation length along each axis [m], shape (D,); infinite where the field is constant along an axis.
        seed: of the random numbers; another one gives another field.
        correlation: "gaussian", exp(-sum (r_k / l_k)^2), smooth; or "markov", exp(-sum |r_k| / l_k), rough.
        lognormal: the logarithm is normal, so that all values are positive. The correlation is that of the logarithm.
        waves: number of waves.

    Example:
        >>> strength = mpm.RandomField(mean=20e3, deviation=5e3, lengths=[10.0, 1.0], seed=3, lognormal=True)
        >>> model.set_parameter("cohesion", strength)
    """

    def __init__(
        self,
        *,
        mean: float,
        deviation: float,
        lengths: ArrayLike,
        seed: int = 0,
        correlation: str = "gaussian",
        lognormal: bool = False,
        waves: int = 1000,
    ) -> None:
        scale = real_numbers("lengths", lengths)
        if scale.ndim != 1 or not (scale > 0).all():
            raise InputError(f"lengths is {lengths!r}, expected a positive number [m] for each axis")
        if not real_numbers("deviation", deviation) >= 0:
            raise InputError(f"deviation is {deviation}, expected at least 0")
        if not np.isfinite(real_numbers("mean", mean)):
            raise InputError(f"mean is {mean}, expected a finite number")
        if lognormal and not mean > 0:
            raise InputError(f"mean is {mean}, expected a positive one of a lognormal field")
        if correlation not in ("gaussian", "markov"):
            raise InputError(f"correlation is {correlation!r}, expected 'gaussian' or 'markov'")
        count("waves", waves)
        if isinstance(seed, bool) or not isinstance(seed, (int, np.integer)) or seed < 0:
            raise InputError(f"seed is {seed!r}, expected a whole number from 0 on")
        self.mean, self.deviation, self.lognormal = mean, deviation, lognormal
        random = np.random.default_rng(seed)
        # The spectrum of exp(-r^2 / l^2) is normal with deviation sqrt(2) / l, that of exp(-|r| / l) is Cauchy's of scale 1 / l
        draw = random.standard_normal if correlation == "gaussian" else random.standard_cauchy
        self._wave = draw((waves, len(scale))) * (np.sqrt(2) if correlation == "gaussian" else 1.0) / scale
        self._phase = random.uniform(0.0, 2 * np.pi, waves)

    def __repr__(self) -> str:
        kind = "lognormal" if self.lognormal else "normal"
        spread = f"mean {self.mean:g}, standard deviation {self.deviation:g}"
        return f"<RandomField: {kind}, {spread}, sum of {len(self._phase)} waves>"

    def __call__(self, position: ArrayLike) -> NDArray[np.float64]:
        """Values at positions [m], shape (n, D): shape (n,)."""
        x = floats("position", position, (None, self._wave.shape[1]))
        normal = np.zeros(len(x))
        for wave, phase in zip(
            self._wave, self._phase
        ):  # one by one: little memory, and the same sum for any number of points
            angle = np.full(len(x), phase)
            for k, number in enumerate(wave):
                angle += x[:, k] * number
            normal += np.cos(angle)
        normal *= np.sqrt(2 / len(self._phase))
        if not self.lognormal:
            return self.mean + self.deviation * normal
        variance = np.log1p((self.deviation / self.mean) ** 2)
        return self.mean * np.exp(np.sqrt(variance) * normal - variance / 2)
