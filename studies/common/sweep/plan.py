"""Which runs a sweep makes: values of parameters from lists and from probability distributions."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from mpm_core import InputError

Value = float | int | str | bool
Row = dict[str, Value]
"""Values of a run by the names of its parameters; what is not in it is as the study has it"""

DISTRIBUTIONS: dict[str, tuple[str, int]] = {
    "normal": ("MEAN:SD", 2),
    "lognormal": ("MEAN:SD", 2),
    "uniform": ("LOW:HIGH", 2),
    "triangular": ("LOW:MODE:HIGH", 3),
}
"""Numbers of each distribution; of the first two also LOW:HIGH, within which values are"""
TAILS = (0.05, 0.95)
"""Quantiles that stand for a distribution where parameters are changed one at a time"""


@dataclass(frozen=True)
class Variable:
    """A parameter that runs have different values of."""

    name: str
    """An option of the study, without dashes in front, or a key of its site, such as soils.clay.cohesion"""
    values: tuple[Value, ...] = ()
    """The values of a list"""
    quantile: Callable[[Any], Any] | None = None
    """Value by its probability of not being exceeded, of a parameter that is random"""

    @property
    def samples(self) -> bool:
        """Whether its values are samples of what is random: those of a distribution, or the seeds of random fields."""
        return self.quantile is not None or self.name.split(".")[-1] == "seed"


def variable_of(word: str) -> Variable:
    """The variable of a word NAME=VALUES.

    VALUES is a list A,B,C, equal steps FROM:TO:COUNT, or a distribution such as normal:MEAN:SD.

    Raises:
        InputError: it is none of these.
    """
    name, equals, text = word.partition("=")
    name, parts = name.removeprefix("--"), text.split(":")
    if not name or not equals or not text:
        raise InputError(
            f"--vary is {word!r}, expected NAME=VALUES, such as cohesion=1e3,2e3 or cohesion=normal:5e3:1e3"
        )
    if parts[0] in DISTRIBUTIONS:
        return Variable(name, quantile=_quantile(parts[0], parts[1:], word))
    numbers = [number_of(part) for part in parts]
    if len(parts) > 2 and numbers[0] is None and None not in numbers[1:]:
        known = ", ".join(DISTRIBUTIONS)
        raise InputError(f"--vary is {word!r}, expected one of the distributions {known}; there is no {parts[0]!r}")
    if len(parts) == 1 or None in numbers:
        if "" in text.split(","):
            raise InputError(f"--vary is {word!r}, expected a value before and after each comma")
        return Variable(name, tuple(map(_value, text.split(","))))
    if len(numbers) != 3 or numbers[2] != int(numbers[2] or 0) or (numbers[2] or 0) < 2:
        raise InputError(f"--vary is {word!r}, expected FROM:TO:COUNT with at least two values")
    values = [_rounded(value) for value in np.linspace(numbers[0], numbers[1], int(numbers[2]))]
    whole = all(map(str.isdecimal, parts)) and all(value == int(value) for value in values)
    return Variable(name, tuple(map(int, values) if whole else values))


def plan(
    variables: Sequence[Variable],
    samples: int | None = None,
    correlations: Mapping[tuple[str, str], float] | None = None,
    seed: int = 0,
    one_at_a_time: bool = False,
) -> list[Row]:
    """The values of all runs.

    Lists give all combinations of their values, and distributions a sample of each of these. Samples are points of a scrambled
    Halton sequence, which fill the space more evenly than random numbers do; more samples continue the same sequence.

    Args:
        variables: the parameters.
        samples: number of samples; None where no parameter is random.
        correlations: coefficient of correlation of pairs of random parameters, by a Gaussian copula.
        seed: of the sequence.
        one_at_a_time: a run without changes, and one for each value of each parameter alone; of random ones those that are
            exceeded with 95 and 5 %.

    Raises:
        InputError: a parameter that is there twice, distributions without a number of samples, or correlations that are not possible
            together.
    """
    names = [_key(one.name) for one in variables]
    twice = next((one.name for k, one in enumerate(variables) if names[k] in names[:k]), None)
    if twice is not None:
        raise InputError(f"--vary names {twice} twice, expected each parameter once, with all of its values")
    if one_at_a_time:
        return [{}, *({one.name: value} for one in variables for value in _alone(one))]
    lists = [one for one in variables if one.quantile is None]
    random = [one for one in variables if one.quantile is not None]
    if bool(random) != (samples is not None):
        missing = (
            f"a number with {random[0].name}, which is random" if random else "none without a parameter that is random"
        )
        raise InputError(f"--samples is {samples}, expected {missing}")
    grid = [dict(zip([one.name for one in lists], row)) for row in itertools.product(*(one.values for one in lists))]
    return [row | drawn for drawn in _drawn(random, samples or 1, correlations or {}, seed) for row in grid]


def _alone(variable: Variable) -> Sequence[Value]:
    return variable.values if variable.quantile is None else [_rounded(variable.quantile(tail)) for tail in TAILS]


def _key(name: str) -> str:
    """The name of a parameter, which may have dashes or underscores."""
    return name.replace("_", "-")


def _drawn(
    random: Sequence[Variable], samples: int, correlations: Mapping[tuple[str, str], float], seed: int
) -> list[Row]:
    if not random and not correlations:
        return [{}]
    names, index = [one.name for one in random], {_key(one.name): k for k, one in enumerate(random)}
    correlation = np.eye(len(names))
    for (first, second), coefficient in correlations.items():
        for name in (first, second):
            if _key(name) not in index:
                raise InputError(
                    f"--correlate names {name}, expected two parameters with distributions; these are {', '.join(names) or 'none'}"
                )
        i, j = index[_key(first)], index[_key(second)]
        correlation[i, j] = correlation[j, i] = coefficient
    try:
        root = np.linalg.cholesky(correlation)
    except np.linalg.LinAlgError:
        raise InputError("--correlate has coefficients that are not possible together") from None
    points = stats.qmc.Halton(len(names), scramble=True, seed=seed).random(samples)
    even = stats.norm.cdf(stats.norm.ppf(points) @ root.T)
    columns = [[_rounded(one.quantile(u)) for u in even[:, k]] for k, one in enumerate(random) if one.quantile]
    return [dict(zip(names, row)) for row in zip(*columns)]


def _quantile(kind: str, parts: Sequence[str], word: str) -> Callable[[Any], Any]:
    """The quantile function of a distribution."""
    numbers = [number_of(part) for part in parts]
    form, count = DISTRIBUTIONS[kind]
    limited = kind in ("normal", "lognormal") and len(numbers) == 4
    given = [x for x in numbers if x is not None]
    if len(given) != len(numbers) or (len(numbers) != count and not limited):
        more = ", or with :LOW:HIGH after it" if kind in ("normal", "lognormal") else ""
        raise InputError(f"--vary is {word!r}, expected {kind}:{form}{more}")
    if kind in ("uniform", "triangular"):
        if given != sorted(given) or given[0] == given[-1]:
            raise InputError(f"--vary is {word!r}, expected rising numbers {form}")
        low, width = given[0], given[-1] - given[0]
        shape = [(given[1] - low) / width] if kind == "triangular" else []
        return getattr(stats, "triang" if shape else "uniform")(*shape, low, width).ppf
    mean, deviation = given[:2]
    if deviation <= 0 or (kind == "lognormal" and mean <= 0):
        above = "a mean and a standard deviation above 0" if kind == "lognormal" else "a standard deviation above 0"
        raise InputError(f"--vary is {word!r}, expected {above}")
    if kind == "normal":
        return _within(stats.norm(mean, deviation), given[2:], word)
    spread = math.sqrt(math.log1p((deviation / mean) ** 2))
    return _within(stats.lognorm(spread, scale=mean * math.exp(-(spread**2) / 2)), given[2:], word)


def _within(distribution: Any, limits: Sequence[float], word: str) -> Callable[[Any], Any]:
    """The quantile function of a distribution, of its part within limits where there are some."""
    if not limits:
        return distribution.ppf
    low, high = distribution.cdf(limits)
    if not low < high:
        raise InputError(f"--vary is {word!r}, expected limits LOW:HIGH between which there are values")
    return lambda u: distribution.ppf(low + u * (high - low))


def number_of(text: str) -> float | None:
    """A finite number; None for another text."""
    try:
        number = float(text)
    except ValueError:
        return None
    return number if math.isfinite(number) else None


def _value(text: str) -> Value:
    """A value of a list as TOML has it."""
    number = number_of(text)
    if number is None:
        return text == "true" if text in ("true", "false") else text
    return int(text) if text.lstrip("+-").isdecimal() else number


def _rounded(value: float) -> float:
    """A number with six digits, as a person would write it."""
    return float(f"{value:.6g}")


def correlation_of(word: str) -> tuple[tuple[str, str], float]:
    """Names and coefficient of a word NAME,NAME=R.

    Raises:
        InputError: it is not of this form, or R is not between -1 and 1.
    """
    names, _, text = word.partition("=")
    pair, coefficient = names.split(","), number_of(text)
    if len(pair) != 2 or pair[0] == pair[1] or coefficient is None or not -1 < coefficient < 1:
        raise InputError(
            f"--correlate is {word!r}, expected two names and a coefficient between -1 and 1: NAME,NAME=-0.5"
        )
    return (pair[0].removeprefix("--"), pair[1].removeprefix("--")), coefficient


def column(values: Sequence[Any]) -> NDArray[Any]:
    """Values of runs as numbers, NaN where there is none; as texts where one is a text."""
    texts = any(isinstance(value, str) for value in values)
    return (
        np.array(["" if v is None else str(v) for v in values])
        if texts
        else np.array([math.nan if v is None else float(v) for v in values])
    )
