"""Confidence intervals of the indicators of an average, from its revolutions."""

import numpy as np
import pandas as pd

from sigdb.core import FloatArray
from sigdb.signature import INDICATORS, indicators

LEVEL = 0.95
"""Confidence level of an interval."""

_MOST_GROUPS, _LEAST_GROUPS = 24, 10
"""Largest and least number of groups of revolutions."""


def indicator_intervals(
    x: FloatArray, *, samples_per_rev: int, teeth: int, averages: int, cycle: int | None = None
) -> pd.DataFrame:
    r"""Return 95 % intervals of the indicators of an average, by a jackknife over groups of its revolutions.

    The revolutions are split into G groups of consecutive ones, of whole tooth cycles where at least ten fit. The
    average is computed without each group in turn. With the indicator :math:`t_g` of that average, or its logarithm
    where all of them are above 0, the standard error is ::

        s^2 = (G - 1) / G sum_g (t_g - mean t)^2,

    and the interval is ``t +- q s`` with the quantile q of Student's law with G - 1 degrees of freedom. It holds for
    the mean over repetitions of the recording with as many averages. Noise that an average of that length keeps is
    part of it. Groups of consecutive revolutions also count slow changes of speed and load.

    In simulations of stationary Gaussian noise, white or coloured, 92 to 100 % of the intervals hold that mean. They
    are too short for noise with rare large values, whose moments hardly a recording shows (Student's law with 3 degrees
    of freedom, 60 revolutions: 9 % for M8A, 64 % for FM4), and for noise that is alike over many revolutions.

    Parameters
    ----------
    x
        (K * samples_per_rev,) record in equal steps of angle: the averaged revolutions, or the first of them.
    samples_per_rev
        Samples in a revolution.
    teeth
        Tooth count of the averaged gear.
    averages
        Revolutions M of the average; where M is above K the standard error is that of K revolutions times
        ``sqrt(K / M)``.
    cycle
        Revolutions of a tooth cycle; None if it is unknown.

    Returns
    -------
    pandas.DataFrame
        ``indicator``, ``low``, ``high``, a row for each of :data:`sigdb.signature.INDICATORS`; nan where there are
        fewer than ten groups.

    References
    ----------
    .. [1] Efron, Tibshirani, "An Introduction to the Bootstrap", 1993, chapter 11: the jackknife.

    Examples
    --------
    >>> import numpy as np
    >>> turns = np.arange(200 * 768) / 768
    >>> noise = np.random.default_rng(1).normal(0, 0.3, turns.size)
    >>> table = indicator_intervals(np.cos(24 * np.pi * turns) + noise, samples_per_rev=768, teeth=12, averages=200)
    >>> low, high = table.set_index("indicator").loc["rms", ["low", "high"]]
    >>> bool(low < np.sqrt(0.5 + 0.09 / 200) < high)
    True
    """
    from scipy.special import stdtrit

    rows = x.reshape(-1, samples_per_rev)
    means, size = revolution_groups(x, samples_per_rev=samples_per_rev, cycle=cycle)
    groups = len(means)
    if groups < _LEAST_GROUPS:
        return pd.DataFrame({"indicator": list(INDICATORS), "low": np.nan, "high": np.nan})
    without = (means.sum(axis=0) - means) / (groups - 1)
    centre = indicators(rows.mean(axis=0), teeth=teeth)
    quantile = float(stdtrit(groups - 1, (1 + LEVEL) / 2))
    scale = quantile * np.sqrt((groups - 1) * groups * size / averages)
    table = []
    for name, left in indicators(without, teeth=teeth).items():
        positive = bool(np.all(left > 0) and centre[name] > 0)
        values, middle = (np.log(left), np.log(centre[name])) if positive else (left, centre[name])
        half = scale * np.std(values)
        low, high = float(middle - half), float(middle + half)
        table.append((name, np.exp(low), np.exp(high)) if positive else (name, low, high))
    return pd.DataFrame(table, columns=["indicator", "low", "high"])


def revolution_groups(x: FloatArray, *, samples_per_rev: int, cycle: int | None = None) -> tuple[FloatArray, int]:
    """Return the averages (G, samples_per_rev) of groups of consecutive revolutions, and the revolutions in each.

    There are at most 24 groups, of whole tooth cycles where at least ten fit.
    """
    rows = x.reshape(-1, samples_per_rev)
    groups, size = _groups(len(rows), cycle)
    return rows[: groups * size].reshape(groups, size, samples_per_rev).mean(axis=1), size


def _groups(revolutions: int, cycle: int | None) -> tuple[int, int]:
    """Return the number of groups and the revolutions in each; whole tooth cycles where ten groups have room."""
    unit = cycle if cycle and revolutions // cycle >= _LEAST_GROUPS else 1
    groups = min(_MOST_GROUPS, revolutions // unit)
    return groups, revolutions // unit // max(groups, 1) * unit
