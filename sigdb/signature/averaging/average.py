"""Time-synchronous averaging: from a record and the pulses of a tacho to one revolution of a shaft."""

from numpy.typing import ArrayLike

from sigdb.core import InputError
from sigdb.signature.averaging.averager import SynchronousAverage, SynchronousAverager


def synchronous_average(
    x: ArrayLike,
    fs: float,
    pulse_times: ArrayLike,
    *,
    samples_per_rev: int,
    pulses_per_rev: int = 1,
    ratio: float = 1.0,
    revolutions: int | None = None,
) -> SynchronousAverage:
    r"""Average a record over the revolutions of a shaft, sampled in equal steps of its angle.

    ``tsa[j] = 1/M sum_{r=0}^{M-1} x(t(r + j/n))``, with t the time at which the shaft has turned by that many
    revolutions from the first pulse: a cubic spline (not-a-knot) through all pulses.

    Parameters
    ----------
    x : array_like, (..., samples)
        Record in any unit, sample 0 at time 0; leading axes are channels of the same tacho.
    fs : float
        Sampling rate, Hz.
    pulse_times : array_like, (pulses,)
        Times at which the tacho's shaft has turned by another ``1/pulses_per_rev``, s, increasing. The first is the
        mark, angle 0. Pulses after the last whole revolution, or after the record, serve the spline only.
    samples_per_rev : int
        Samples n of the average. A multiple of the tooth count, 64 a tooth in sigdb's databases, makes a tooth pass a
        whole number of samples.
    pulses_per_rev : int
        Pulses in one revolution of the tacho's shaft.
    ratio : float
        Revolutions of the averaged shaft in one of the tacho's shaft: a tacho on a pinion of 12 teeth and an average
        over the gear of 36 that it drives have 12/36.
    revolutions : int, optional
        Revolutions M to average, from the mark on; by default all that pulses and record bound. A multiple of the
        tooth cycle, the revolutions after which the same teeth meet again, keeps the other gear's orders out.

    Returns
    -------
    SynchronousAverage
        Average, scatter between revolutions, and their number.

    Raises
    ------
    InputError
        If ``x`` is empty, complex or not finite, or an option is out of its range. If pulse times are not finite and
        increasing, begin before the record, or are so uneven that a pulse must be missing. If no revolution, or fewer
        than requested, lie within pulses and record.

    Notes
    -----
    The record is interpolated by a sinc of 16 zero crossings a side in a Kaiser window. Its gain is within 3e-6 of 1 up
    to 0.38 of the sampling rate. Where a revolution has more samples than n, the kernel is widened. Then it cuts off
    (-6 dB) at order n/2, and is flat up to three quarters of that. It never reaches further back than over the
    revolution before, so below n = 16 it cuts off at order 8. The record is continued beyond its ends by linear
    prediction, so that the first and last revolutions count like any other.

    The average passes order nu with the gain ``|sin(pi M nu) / (M sin(pi nu))|``: 1 at whole orders, at most
    ``1 / (M sin(pi nu))`` elsewhere.

    References
    ----------
    .. [1] McFadden, "A revised model for the extraction of periodic waveforms by time domain averaging", Mechanical
       Systems and Signal Processing 1(1), 1987, doi:10.1016/0888-3270(87)90085-9.
    .. [2] McFadden, "Interpolation techniques for time domain averaging of gear vibration", Mechanical Systems and
       Signal Processing 3(1), 1989.

    Examples
    --------
    A shaft at 10 rev/s with a mesh of 12 teeth, and a tone that has nothing to do with it:

    >>> import numpy as np
    >>> from sigdb.signature import synchronous_average
    >>> fs, t = 5000.0, np.arange(50_000) / 5000.0
    >>> x = np.cos(2 * np.pi * 120 * t) + np.cos(2 * np.pi * 33 * t)
    >>> average = synchronous_average(x, fs, np.arange(0, 10, 0.1), samples_per_rev=768, revolutions=90)
    >>> theta = 2 * np.pi * np.arange(768) / 768
    >>> average.revolutions, np.allclose(average.tsa, np.cos(12 * theta), atol=1e-5)
    (90, True)
    """
    averager = SynchronousAverager(
        fs, samples_per_rev=samples_per_rev, pulses_per_rev=pulses_per_rev, ratio=ratio, revolutions=revolutions
    )
    averager.push(x, pulse_times)
    average = averager.result()
    if revolutions is not None and average.revolutions < revolutions:
        raise InputError(
            f"synchronous_average: revolutions = {revolutions} must be at most {average.revolutions}, those within"
            " pulses and record; ask for fewer or record longer"
        )
    return average
