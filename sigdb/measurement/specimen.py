"""A specimen: a pair of gears with its own index errors."""

import math

import numpy as np

from sigdb.core.typing import FloatArray


def tooth_cycle(teeth: int, mate_teeth: int) -> int:
    """Revolutions of a gear after which the same teeth meet again, ``mate / gcd``.

    Examples
    --------
    >>> tooth_cycle(12, 36), tooth_cycle(13, 36)
    (3, 36)
    """
    return mate_teeth // math.gcd(teeth, mate_teeth)


def index_errors(stream: np.random.Generator, teeth: int, mate_teeth: int) -> FloatArray:
    """Index errors that a synchronous average sees, for an ``index_error`` of 1.

    Both gears draw independent standard normal errors, one a tooth, and have their mean removed. In an average over
    whole tooth cycles a mate's errors enter only through their mean over the teeth that meet the same tooth:
    ``e_j = own_j + mean of mate over the teeth that meet j``.

    Parameters
    ----------
    stream
        The specimen's random stream.
    teeth, mate_teeth
        Tooth counts of the averaged gear and of its mate.

    Returns
    -------
    ndarray, (teeth,)

    Examples
    --------
    >>> from sigdb.core.streams import specimen_stream
    >>> index_errors(specimen_stream(1, 0), 12, 36).shape
    (12,)
    """
    own, mate = (draw - draw.mean() for draw in (stream.standard_normal(teeth), stream.standard_normal(mate_teeth)))
    meets = (np.arange(teeth)[:, None] + teeth * np.arange(tooth_cycle(teeth, mate_teeth))) % mate_teeth
    return own + mate[meets].mean(axis=1)


def index_error_covariance(teeth: int, mate_teeth: int) -> FloatArray:
    """Covariance of :func:`index_errors`.

    With g = gcd(teeth, mate_teeth), teeth whose numbers agree modulo g meet the same teeth of the mate:
    ``C_ij = delta(i = j) - 1 / teeth + (g / mate_teeth) (delta(i = j modulo g) - 1 / g)``. It is circulant: turning a
    specimen does not change its law.

    Parameters
    ----------
    teeth, mate_teeth
        Tooth counts of the averaged gear and of its mate.

    Returns
    -------
    ndarray, (teeth, teeth)

    Examples
    --------
    >>> index_error_covariance(2, 4).tolist()
    [[0.75, -0.75], [-0.75, 0.75]]
    """
    apart = np.subtract.outer(np.arange(teeth), np.arange(teeth))
    common = math.gcd(teeth, mate_teeth)
    own = (apart == 0) - 1 / teeth
    mate = ((apart % common == 0) - 1 / common) * common / mate_teeth
    return np.asarray(own + mate)
