"""Whether a model is significantly better than the Bayes rule, which it cannot be."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import norm
from scipy.stats import t as student

from sigdb.core.errors import InputError
from sigdb.core.typing import FloatArray


@dataclass(frozen=True, kw_only=True)
class Excess:
    """By how much a model is better than the bound on the same rows.

    Attributes
    ----------
    value
        Mean of the bound's loss less the model's; below 0 the model is worse, as it must be.
    p_value
        Probability of such an excess or a greater one for a model that is as good as the bound; nan for fewer than two
        specimens.
    significant
        Whether that is less than one minus the level: the model has seen what it should not (test rows, or their
        specimens), or the bound's law is not that of the rows.
    """

    value: float
    p_value: float
    significant: bool


def above_bound(
    model_losses: ArrayLike, bound_losses: ArrayLike, specimens: ArrayLike, *, level: float = 0.99
) -> Excess:
    """Whether a model is significantly better than the Bayes rule, paired over the same rows.

    Rows of a specimen are no independent evidence. With D_s the sum of the gains of specimen s over its n_s rows, of S
    specimens, the mean gain and its error are::

        mean = sum D / sum n,   error^2 = S / (S - 1) sum (D_s - mean n_s)^2 / (sum n)^2,

    the linearised variance of a ratio, and their quotient is held against Student's t with S - 1 degrees of freedom.
    Percentiles of a bootstrap would not do: those of five gains above 0, which chance gives once in 32 times, are above
    0 at every level. Where two rules differ in single rows, few specimens may agree by chance, as two that gain a row
    each: so the mean is held against the normal law with the error of independent rows as well, and the greater
    probability counts.

    Parameters
    ----------
    model_losses, bound_losses
        (rows,) losses, the less the better, of a kind that the Bayes rule makes least: a column of
        :attr:`Bound.losses`, and the same of the model. For a hit rate give the misses.
    specimens
        (rows,) specimen of each row.
    level
        Level of significance, one-sided.

    Returns
    -------
    Excess

    Raises
    ------
    InputError
        If the lengths differ, or there are no rows.

    References
    ----------
    Cochran, *Sampling Techniques*, 3rd ed., Wiley 1977, chapter 9A (clusters of unequal size).

    Examples
    --------
    >>> honest = above_bound([0.4, 0.2, 0.5, 0.1], [0.1, 0.2, 0.2, 0.0], [0, 1, 2, 3])
    >>> round(honest.value, 3), honest.significant
    (-0.175, False)
    """
    model, best, specimens = (np.asarray(one) for one in (model_losses, bound_losses, specimens))
    if not 0 < len(model) == len(best) == len(specimens):
        raise InputError(
            f"above_bound: {len(model)} losses of the model, {len(best)} of the bound, {len(specimens)} specimens; "
            "give those of the same rows, at least one"
        )
    gain = best.astype(float) - model.astype(float)
    mean, error, freedom = _clustered(gain, specimens)
    if freedom < 1:
        return Excess(value=mean, p_value=np.nan, significant=False)
    if mean == 0:
        return Excess(value=0.0, p_value=0.5, significant=False)
    with np.errstate(divide="ignore"):
        of_specimens = student.sf(np.divide(mean, error), freedom)
        of_rows = norm.sf(np.divide(mean * np.sqrt(len(gain)), gain.std(ddof=1)))
    p_value = float(max(of_specimens, of_rows))
    return Excess(value=mean, p_value=p_value, significant=p_value < 1 - level)


def _clustered(values: FloatArray, specimens: np.ndarray) -> tuple[float, float, int]:
    """Mean over rows, its standard error from the scatter between specimens, and the degrees of freedom."""
    names, index = np.unique(specimens, return_inverse=True)
    D, n, S = np.bincount(index, values), np.bincount(index), len(names)
    mean = D.sum() / n.sum()
    error = np.sqrt(S / max(1, S - 1) * ((D - mean * n) ** 2).sum()) / n.sum()
    return float(mean), float(error), S - 1
