"""A specimen: a pair of gears with its own index errors."""

import math

import numpy as np

from sigdb.core import FloatArray, IntArray


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


def noise_deviation(reference_variance: FloatArray, snr_db: FloatArray) -> FloatArray:
    """Standard deviation of the noise of one revolution, unit of the signal.

    ``snr_db = 10 log10(reference_variance / deviation^2)``, the reference being the nominal healthy clean average of
    the same sensor and operating point. The noise of an average over M revolutions has 1/M of the variance.

    Examples
    --------
    >>> import numpy as np
    >>> noise_deviation(np.array([4.0]), np.array([20.0])).tolist()
    [0.2]
    """
    return np.sqrt(reference_variance) * 10 ** (-np.asarray(snr_db) / 20)


def revolution_scatter(
    stream: np.random.Generator, deviation: FloatArray, samples: int, averages: int | IntArray
) -> FloatArray:
    """Measured standard deviation between revolutions, rms over angle; nan for a single revolution.

    With white noise the sum of squares over ``samples`` angles follows a chi-square law of
    ``samples (averages - 1)`` degrees of freedom, from which it is drawn.

    Parameters
    ----------
    stream
        Where it is drawn from: one number for each deviation, in order.
    deviation
        Standard deviation of the noise of one revolution, in any shape and unit.
    samples
        Angles of an average.
    averages
        Revolutions of each average, against the shape of ``deviation``.

    Returns
    -------
    ndarray
        Shape and unit of ``deviation``.
    """
    freedom = np.broadcast_to(samples * (np.asarray(averages) - 1), np.shape(deviation))
    drawn = np.sqrt(stream.chisquare(np.maximum(freedom, 1)) / np.maximum(freedom, 1))
    return deviation * np.where(freedom > 0, drawn, np.nan)
