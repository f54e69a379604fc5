"""Noise of a synchronous average and what the scatter between revolutions tells of it."""

import numpy as np

from sigdb.core.typing import FloatArray, IntArray


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
