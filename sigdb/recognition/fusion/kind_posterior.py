"""The posterior of kinds of damage, of sizes, and of the damaged gear."""

from collections.abc import Iterable, Mapping

import numpy as np
import pandas as pd
from scipy.special import softmax

from sigdb.core import FloatArray, InputError
from sigdb.database import NO_DAMAGE, QUANTITIES, kind_classes, places_of_kinds
from sigdb.recognition.templates.posterior import Posterior
from sigdb.transmission import KINDS

_INTERVAL = 0.9
"""Probability of the intervals of sizes."""


def stored_sizes(cases: pd.DataFrame) -> list[str]:
    """Return the sizes of damage that cases have besides the severities, such as the depth of a crack."""
    return [size for size in KINDS if size in cases and size not in QUANTITIES and cases[size].fillna(0).any()]


def kind_posterior(after: Posterior, kinds: Iterable[str]) -> pd.DataFrame:
    """Return the probability of each kind of damage of averages, a column each, and of ``none``.

    Parameters
    ----------
    after
        Posterior of the averages.
    kinds
        (templates,) kind of each template.
    """
    names = list(kinds)
    classes = kind_classes(names)
    return pd.DataFrame(np.exp(after.log_classes(places_of_kinds(names, classes))), columns=list(classes))


def size_posterior(after: Posterior, sizes: pd.DataFrame) -> dict[str, FloatArray]:
    """Return median and 90 % interval of sizes, given that the damage has that size: nan where no template has it.

    Parameters
    ----------
    after
        Posterior of averages.
    sizes
        (templates,) values of each size, in its unit.
    """
    answers: dict[str, FloatArray] = {}
    for name, column in sizes.items():
        level = column.fillna(0).to_numpy(float)
        some = Posterior(location=after.location, damage=np.where(level != 0, after.damage, -np.inf))
        ends = {"median": 0.5, "low": (1 - _INTERVAL) / 2, "high": (1 + _INTERVAL) / 2}
        answers |= {f"{end}_{name}": some.quantile(level, p) for end, p in ends.items()}
    return answers


def gear_probabilities(log_odds: Mapping[str, float]) -> dict[str, float]:
    """Return the probability that each gear of a train is the damaged one, and of ``none``, from averages of each.

    An average over the turns of one gear shows its own damage; that of another gear cancels in it, but for what turns
    with it. So the odds of each gear follow from its own averages. No damage and some are equally likely beforehand,
    and so are all gears.

    Parameters
    ----------
    log_odds
        By gear, the logarithm of P(damage) / P(none) from its averages, as of :func:`fuse_models`.

    Returns
    -------
    dict
        Probabilities of ``none`` and of each gear, which add up to 1.

    Raises
    ------
    InputError
        If there is no gear, or a number is nan.

    Examples
    --------
    >>> {gear: round(share, 3) for gear, share in gear_probabilities({"pinion": 4.0, "wheel": -2.0}).items()}
    {'none': 0.035, 'pinion': 0.962, 'wheel': 0.002}
    """
    if not log_odds:
        raise InputError("log_odds has no gear; give the log odds of at least one")
    for gear, value in log_odds.items():
        if np.isnan(value):
            raise InputError(f"log_odds of gear {gear!r} is nan; leave out gears that cannot be judged")
    terms = np.array([0.0, *log_odds.values()]) - np.log([1.0, *[len(log_odds)] * len(log_odds)])
    return dict(zip((NO_DAMAGE, *log_odds), softmax(terms).tolist(), strict=True))
