"""Growth laws of damage: rates at which a severity climbs a ladder of levels, with a prior over their parameters.

A severity grows from one level to the next as a pure birth process. Its rate is the speed of growth over the distance
of the levels, so that the mean growth is that of the law, and the scatter is that of single steps.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import expm

from sigdb.core import FloatArray, InputError, plain_array

_FURTHER = 10.0
"""How many times slower and faster than by a prior growth beyond it is; assumed."""

_POWERS = np.arange(-1.0, 4.5)
"""Powers of the severity of growth beyond a prior, which are exponents of a crack of -2 to 8; assumed."""

_RATIO = 2.0
"""Greatest ratio of neighbouring speeds of growth beyond a prior."""


@dataclass(frozen=True, kw_only=True, eq=False)
class GrowthLaw:
    """A growth law on a ladder of severities, with a prior over its parameters.

    Attributes
    ----------
    name
        The law.
    levels
        (L,) severities, rising, in any unit.
    step_rates
        (P, L - 1) rate of the step from each level to the next, per unit of time, for each set of parameters.
    weights
        (P,) prior of the parameters; they add up to 1.
    speed
        (P,) speed of growth at the reference severity, which orders the parameters.
    """

    name: str
    levels: FloatArray
    step_rates: FloatArray
    weights: FloatArray
    speed: FloatArray

    def transition(self, elapsed: float) -> FloatArray:
        """Return the probabilities (P, L, L) of the level after a time, by the level before it; the last one stays."""
        return _transition(self, float(f"{elapsed:.4g}"))

    @cached_property
    def wider(self) -> "GrowthLaw":
        """Growth beyond the prior: speeds in powers -1 to 4 of the severity, up to ten times slower or faster.

        Powers are equally likely, and so are speeds at the geometric mean of the levels, up to ten times the greatest
        of the prior: before a look, growth is rather too fast than too slow.
        """
        distance = np.diff(self.levels)
        logarithm = np.log(self.levels[:-1]) - np.log(self.levels[:-1]).mean()
        middle = np.exp(np.log(self.step_rates * distance).mean(axis=1))
        least, greatest = middle.min() / _FURTHER, middle.max() * _FURTHER
        speeds = np.geomspace(least, greatest, 1 + int(np.ceil(np.log(greatest / least) / np.log(_RATIO))))
        speed, power = (grid.ravel() for grid in np.meshgrid(speeds, _POWERS, indexing="ij"))
        return GrowthLaw(
            name=f"growth beyond the prior of {self.name}",
            levels=self.levels,
            step_rates=speed[:, None] * np.exp(np.outer(power, logarithm)) / distance,
            weights=speed / speed.sum(),
            speed=speed,
        )


@lru_cache(maxsize=256)
def _transition(law: GrowthLaw, elapsed: float) -> FloatArray:
    parameters, steps = law.step_rates.shape
    generator = np.zeros((parameters, steps + 1, steps + 1))
    at = np.arange(steps)
    generator[:, at, at], generator[:, at, at + 1] = -law.step_rates, law.step_rates
    return np.asarray(expm(generator * elapsed)).clip(min=0.0)


def paris_crack(levels: ArrayLike, *, rates: ArrayLike, exponents: ArrayLike, reference: float) -> GrowthLaw:
    """Return the law of Paris for a crack [1]_: ``da/dN = C (dK)^m`` with ``dK`` in proportion to the root of a.

    So the speed is ``rate (a / reference)^(m / 2)``. Rates and exponents are independent, each value equally likely.

    Parameters
    ----------
    levels
        (L,) depths a of the crack, or severities in proportion to it.
    rates
        Speeds of growth at the reference, unit of the severity per unit of time.
    exponents
        Values of m; those of steels are 2 to 4.
    reference
        Severity at which the speed is the rate.

    Returns
    -------
    GrowthLaw

    References
    ----------
    .. [1] P. Paris and F. Erdogan, A critical analysis of crack propagation laws, Journal of Basic Engineering 85
       (1963) 528-533.

    Examples
    --------
    >>> law = paris_crack([1.0, 2.0, 4.0], rates=[0.1], exponents=[2.0], reference=1.0)
    >>> law.step_rates.tolist()  # the speed 0.1 a over the distances 1 and 2
    [[0.1, 0.1]]
    """
    a, rate, m = (plain_array("paris_crack", name, value, float) for name, value in
                  (("levels", levels), ("rates", rates), ("exponents", exponents)))  # fmt: skip
    speed, power = (grid.ravel() for grid in np.meshgrid(rate, m / 2, indexing="ij"))
    return _law("Paris crack", a, speed[:, None] * (a[:-1] / reference) ** power[:, None], speed)


def archard_wear(levels: ArrayLike, *, rates: ArrayLike) -> GrowthLaw:
    """Return the law of Archard for wear [1]_: the depth grows with the sliding distance, at a constant speed.

    Parameters
    ----------
    levels
        (L,) depths of wear, or severities in proportion to it.
    rates
        Speeds of growth, unit of the severity per unit of time, equally likely.

    Returns
    -------
    GrowthLaw

    References
    ----------
    .. [1] J. F. Archard, Contact and rubbing of flat surfaces, Journal of Applied Physics 24 (1953) 981-988.
    """
    h, speed = plain_array("archard_wear", "levels", levels, float), plain_array("archard_wear", "rates", rates, float)
    return _law("Archard wear", h, np.repeat(speed[:, None], len(h) - 1, axis=1), speed)


def pit_count(most: int, *, rates: ArrayLike) -> GrowthLaw:
    """Return the law of the number of pits: they come one by one, as a Poisson process.

    Parameters
    ----------
    most
        Greatest number of pits; the least is 1.
    rates
        Pits per unit of time, equally likely.

    Returns
    -------
    GrowthLaw

    Examples
    --------
    >>> law = pit_count(3, rates=[0.5])
    >>> law.levels.tolist(), law.step_rates.tolist()
    ([1.0, 2.0, 3.0], [[0.5, 0.5]])
    """
    speed = plain_array("pit_count", "rates", rates, float)
    return _law("pit count", np.arange(1.0, most + 1), np.repeat(speed[:, None], most - 1, axis=1), speed)


def severity_after(
    start: ArrayLike, elapsed: ArrayLike, *, rate: float, exponent: float = 0.0, reference: float = 1.0
) -> FloatArray:
    """Return the severity after a time, by the law of Paris, or by that of Archard with an exponent of 0.

    It solves ``da/dt = rate (a / reference)^(exponent / 2)`` and is infinite from the instant at which a crack does not
    stop.

    Parameters
    ----------
    start
        Severity at the beginning.
    elapsed
        Time since then.
    rate, exponent, reference
        As in :func:`paris_crack`; one value each.

    Returns
    -------
    (...) float64
        In the unit of the start.

    Examples
    --------
    >>> severity_after(1.0, [0.0, 5.0], rate=0.1).tolist()
    [1.0, 1.5]
    >>> severity_after(1.0, [0.0, 5.0, 10.0], rate=0.1, exponent=4.0).tolist()
    [1.0, 2.0, inf]
    """
    a, t = np.asarray(start, float), np.asarray(elapsed, float)
    power = 1 - exponent / 2
    if power == 0:
        return np.asarray(a * np.exp(rate * t / reference))
    base = (a / reference) ** power + power * rate * t / reference
    with np.errstate(divide="ignore"):
        return np.asarray(reference * np.maximum(base, 0.0) ** (1 / power))


def joined_laws(laws: Sequence[GrowthLaw]) -> GrowthLaw:
    """Return several laws on the same levels as one, each equally likely before a look.

    Parameters
    ----------
    laws
        The laws.

    Returns
    -------
    GrowthLaw

    Raises
    ------
    InputError
        If their levels differ.
    """
    if any(not np.array_equal(law.levels, laws[0].levels) for law in laws):
        raise InputError("the laws have different levels; give them the same ones")
    return GrowthLaw(
        name=" or ".join(law.name for law in laws),
        levels=laws[0].levels,
        step_rates=np.concatenate([law.step_rates for law in laws]),
        weights=np.concatenate([law.weights for law in laws]) / len(laws),
        speed=np.concatenate([law.speed for law in laws]),
    )


def _law(name: str, levels: FloatArray, speeds: FloatArray, speed: FloatArray) -> GrowthLaw:
    """Return the law of speeds of growth (P, L - 1) at the levels, all but the last."""
    if levels.ndim != 1 or len(levels) < 2 or not (np.diff(levels) > 0).all() or levels[0] <= 0:
        raise InputError(f"levels = {levels.tolist()} of {name} must rise from above 0; give two or more")
    if not len(speed) or not (speed > 0).all():
        raise InputError(f"rates = {speed.tolist()} of {name} must be greater than 0; give one or more")
    return GrowthLaw(
        name=name,
        levels=levels,
        step_rates=speeds / np.diff(levels),
        weights=np.full(len(speed), 1 / len(speed)),
        speed=speed,
    )
