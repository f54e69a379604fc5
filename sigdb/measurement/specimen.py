"""The law of a specimen, a pair of gears with index errors of its own, and of the noise of its measurement."""

import math

import numpy as np

from sigdb.core import FloatArray, IntArray, plain_array


def tooth_cycle(teeth: int, mate_teeth: int) -> int:
    """Return the revolutions of a gear after which the same teeth meet again, ``mate_teeth / gcd``.

    Parameters
    ----------
    teeth, mate_teeth : int
        Tooth counts of the gear and of its mate.

    Returns
    -------
    int
        Whole revolutions of the gear.

    Examples
    --------
    >>> tooth_cycle(12, 36), tooth_cycle(13, 36)
    (3, 36)
    """
    return mate_teeth // math.gcd(teeth, mate_teeth)


RUNOUT_ORDERS = (1, 2)
"""Orders of the slow part of a gear's errors, cycles per revolution: run-out, and an oval pitch curve."""


def index_errors(stream: np.random.Generator, teeth: int, mate_teeth: int, *, runout: float = 0.0) -> FloatArray:
    """Draw the index errors that a synchronous average sees, for an ``index_error`` of 1.

    Both gears draw independent standard normal errors, one a tooth, and have their mean removed. In an average over
    whole tooth cycles a mate's errors enter only through their mean over the teeth that meet the same tooth:
    ``e_j = gear_j + mean of mate over the teeth that meet j``. With ``runout`` both gears have a slow part too, sines
    of the orders 1 and 2 of random amplitude and phase; see :func:`pitch_errors`.

    Parameters
    ----------
    stream : numpy.random.Generator
        The specimen's random stream.
    teeth, mate_teeth : int
        Tooth counts of the averaged gear and of its mate.
    runout : float
        Root mean square amplitude of each of the two slow orders, in multiples of ``index_error``.

    Returns
    -------
    (teeth,) float64
        Errors along the mesh normal, in multiples of ``index_error``.

    Examples
    --------
    >>> from sigdb.core import specimen_stream
    >>> index_errors(specimen_stream(1, 0), 12, 36).shape
    (12,)
    """
    gear, mate = (draw - draw.mean() for draw in (stream.standard_normal(teeth), stream.standard_normal(mate_teeth)))
    if runout:
        gear, mate = (each + runout * slow_errors(stream, len(each)) for each in (gear, mate))
    meets = (np.arange(teeth)[:, None] + teeth * np.arange(tooth_cycle(teeth, mate_teeth))) % mate_teeth
    return gear + mate[meets].mean(axis=1)


def slow_errors(stream: np.random.Generator, teeth: int) -> FloatArray:
    """Draw the slow part of a gear's errors: sines of orders 1 and 2 with a root mean square amplitude of 1.

    Parameters
    ----------
    stream : numpy.random.Generator
        Random stream; it gives four numbers.
    teeth : int
        Tooth count.

    Returns
    -------
    (teeth,) float64
        Errors, without unit. Amplitudes follow a Rayleigh law, and phases are uniform.
    """
    angle = 2 * np.pi * np.outer(RUNOUT_ORDERS, np.arange(teeth)) / teeth
    waves = np.concatenate([np.cos(angle), np.sin(angle)])
    return np.asarray(stream.standard_normal(len(waves)) @ waves / math.sqrt(2))


def index_error_covariance(teeth: int, mate_teeth: int, *, runout: float = 0.0) -> FloatArray:
    """Return the covariance of :func:`index_errors`.

    With g = gcd(teeth, mate_teeth), teeth whose numbers agree modulo g meet the same teeth of the mate:
    ``C_ij = delta(i = j) - 1 / teeth + (g / mate_teeth) (delta(i = j modulo g) - 1 / g)``. Each slow order k of the
    gear adds ``runout^2 / 2 cos(2 pi k (i - j) / teeth)``. One of the mate adds the same with its own tooth count, if k
    is a multiple of ``mate_teeth / g``; else it leaves nothing in the mean over the teeth that meet the same tooth.
    The covariance is circulant: turning a specimen does not change its law.

    Parameters
    ----------
    teeth, mate_teeth : int
        Tooth counts of the averaged gear and of its mate.
    runout : float
        As in :func:`index_errors`.

    Returns
    -------
    (teeth, teeth) float64
        Covariance for an ``index_error`` of 1.

    Examples
    --------
    >>> index_error_covariance(2, 4).tolist()
    [[0.75, -0.75], [-0.75, 0.75]]
    """
    apart = np.subtract.outer(np.arange(teeth), np.arange(teeth))
    common = math.gcd(teeth, mate_teeth)
    gear = (apart == 0) - 1 / teeth
    mate = ((apart % common == 0) - 1 / common) * common / mate_teeth
    orders = [(k, teeth) for k in RUNOUT_ORDERS] + [
        (k, mate_teeth) for k in RUNOUT_ORDERS if k % (mate_teeth // common) == 0
    ]
    slow = runout**2 / 2 * sum(np.cos(2 * np.pi * k * apart / count) for k, count in orders)
    return np.asarray(gear + mate + slow if runout else gear + mate)


def independent_responses(response: FloatArray, covariance: FloatArray) -> FloatArray:
    """Return the responses to independent errors of 1 m in place of correlated ones.

    Parameters
    ----------
    response : float64 array, (..., teeth)
        Change per error of each tooth.
    covariance : float64 array, (teeth, teeth)
        Covariance C of the errors, of :func:`index_error_covariance`.

    Returns
    -------
    (..., teeth - 1) float64
        ``response C^(1/2)``, without the mean of the errors, which is removed from them.
    """
    variance, vectors = np.linalg.eigh(covariance)
    kept = slice(1, None)  # the errors' mean is removed: the least eigenvalue is 0
    return np.asarray(response @ vectors[:, kept] * np.sqrt(variance[kept]))


def noise_deviation(reference_variance: FloatArray, snr_db: FloatArray) -> FloatArray:
    """Return the standard deviation of the noise of one revolution.

    ``snr_db = 10 log10(reference_variance / deviation^2)``. The noise of an average over M revolutions has 1/M of the
    variance.

    Parameters
    ----------
    reference_variance : float64 array, (...)
        Variance of the nominal healthy clean average of the same sensor and operating point, (unit of the signal)^2.
    snr_db : float64 array, (...)
        Signal-to-noise ratio, dB.

    Returns
    -------
    (...) float64
        Standard deviation in the unit of the signal.

    Examples
    --------
    >>> import numpy as np
    >>> noise_deviation(np.array([4.0]), np.array([20.0])).tolist()
    [0.2]
    """
    variance = plain_array("noise_deviation", "reference_variance", reference_variance)
    return np.asarray(np.sqrt(variance) * 10 ** (-plain_array("noise_deviation", "snr_db", snr_db) / 20))


def revolution_scatter(
    stream: np.random.Generator, deviation: FloatArray, samples: int, averages: int | IntArray
) -> FloatArray:
    """Draw the measured standard deviation between revolutions, rms over angle; nan for a single revolution.

    With white noise the sum of squares over ``samples`` angles follows a chi-square law with
    ``samples (averages - 1)`` degrees of freedom.

    Parameters
    ----------
    stream : numpy.random.Generator
        Random stream; it gives one number for each deviation, in order.
    deviation : float64 array, (...)
        Standard deviation of the noise of one revolution, in any unit.
    samples : int
        Angles of an average.
    averages : int or int array
        Revolutions of each average, broadcast to the shape of ``deviation``.

    Returns
    -------
    (...) float64
        Measured deviations, in the unit of ``deviation``.
    """
    deviation = plain_array("revolution_scatter", "deviation", deviation)
    counts = plain_array("revolution_scatter", "averages", averages)
    freedom = np.broadcast_to(samples * (counts - 1), np.shape(deviation))
    drawn = np.sqrt(stream.chisquare(np.maximum(freedom, 1)) / np.maximum(freedom, 1))
    return deviation * np.where(freedom > 0, drawn, np.nan)
