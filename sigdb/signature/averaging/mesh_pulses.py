"""Tooth passes from the phase of a mesh harmonic, for records without a tacho."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sigdb.core import InputError, NotApplicableError, plain_array
from sigdb.signature.checks import GREATEST_COUNT, Float64Array, count, positive, real_signal

_OWNER = "mesh_pulses"

_PASSES = 2
"""A second demodulation, with the phase that the first found, takes the lag behind changes of speed down tenfold."""


def mesh_pulses(
    x: ArrayLike,
    fs: float,
    *,
    teeth: int,
    mesh_frequency: ArrayLike,
    harmonic: int = 1,
    bandwidth: float | None = None,
) -> Float64Array:
    r"""Find the times of successive tooth passes, from the phase of a harmonic of the mesh.

    The record is demodulated with ``exp(-j psi)``, ``psi = 2 pi h integral f dt``, and smoothed with a Blackman window;
    the phase of what is left corrects psi. A pulse is where psi, counted from a crest of the harmonic, passes a
    multiple of ``2 pi h``. Where the window reaches beyond the record, in its first and last ``1.5 / bandwidth``
    seconds, there are no pulses.

    The pulses take a tacho's place in :func:`synchronous_average`, with ``pulses_per_rev = teeth``. They do not know
    which tooth is which: tooth 1 of such an average is the one at the first pulse. Tooth numbers are relative, and
    those of two records differ by an unknown turn.

    Parameters
    ----------
    x : array_like, (samples,)
        Record in any unit, sample 0 at time 0.
    fs : float
        Sampling rate, Hz.
    teeth : int
        Tooth count Z of the gear on the shaft to be averaged.
    mesh_frequency : float or array_like, (samples,)
        Guess of the mesh frequency, Z times the shaft's, Hz, constant or sample by sample: within half a bandwidth,
        divided by the harmonic, of the truth.
    harmonic : int
        Harmonic h of the mesh whose phase is used; one that stands well above its surroundings.
    bandwidth : float, optional
        Distance from the harmonic from which on nothing passes, Hz; the shaft's frequency by default, so that the
        harmonic's own sidebands, one shaft order apart, do not bend the angle. Faster changes of speed are not
        followed.

    Returns
    -------
    (pulses,) float64
        Times, s, one for each tooth pass.

    Raises
    ------
    InputError
        If ``x`` is empty, complex or not finite or has more than one axis, or an option is out of its range. If the
        record is shorter than the smoothing window. If the phase runs backwards: then the harmonic is lost in its
        surroundings.

    References
    ----------
    .. [1] Bonnardot, El Badaoui, Randall, Daniere, Guillet, "Use of the acceleration signal of a gearbox in order to
       perform angular resampling (with limited speed fluctuation)", Mechanical Systems and Signal Processing 19(4),
       2005, doi:10.1016/j.ymssp.2004.05.001.

    Examples
    --------
    >>> import numpy as np
    >>> from sigdb.signature import mesh_pulses, synchronous_average
    >>> fs, t = 5000.0, np.arange(50_000) / 5000.0
    >>> shaft = 10 * t + 0.05 * np.sin(2 * np.pi * 0.3 * t)
    >>> x = (1 + 0.2 * np.cos(2 * np.pi * shaft)) * np.cos(2 * np.pi * 12 * shaft)
    >>> times = mesh_pulses(x, fs, teeth=12, mesh_frequency=119.0)
    >>> average = synchronous_average(x, fs, times, pulses_per_rev=12, samples_per_rev=768)
    >>> average.revolutions, float(np.abs(average.tsa).max().round(2))
    (96, 1.2)
    """
    record, _ = real_signal(_OWNER, "x", x)
    if record.ndim != 1:
        raise InputError(f"{_OWNER}: x of shape {record.shape} must have one axis; pass one channel")
    rate = positive(_OWNER, "fs", fs)
    z, h = (
        count(_OWNER, "teeth", teeth, least=1, most=GREATEST_COUNT),
        count(_OWNER, "harmonic", harmonic, least=1, most=GREATEST_COUNT),
    )
    frequency = _frequency(mesh_frequency, record.size, rate, h)
    width = float(np.mean(frequency)) / z if bandwidth is None else positive(_OWNER, "bandwidth", bandwidth)
    window = _smoothing(width, rate, record.size)

    psi = 2 * np.pi * h * (np.cumsum(frequency) - frequency[0]) / rate
    for _ in range(_PASSES):
        psi = psi + np.unwrap(np.angle(_convolved(record * np.exp(-1j * psi), window)))
    if np.any(np.diff(psi) <= 0):
        raise NotApplicableError(
            f"{_OWNER}: the phase of mesh harmonic {h} runs backwards; check mesh_frequency, take a stronger harmonic"
            " or a smaller bandwidth"
        )
    inside = slice(window.size // 2, record.size - window.size // 2)
    return _crests(psi[inside] / (2 * np.pi), np.arange(record.size)[inside] / rate, h)


def _crests(turns: Float64Array, t: Float64Array, every: int) -> Float64Array:
    """Times of the whole turns of a phase, the first and every so many after it."""
    return np.interp(np.arange(np.ceil(turns[0]), turns[-1], every), turns, t)


def _frequency(mesh_frequency: ArrayLike, samples: int, fs: float, harmonic: int) -> Float64Array:
    f = plain_array(_OWNER, "mesh_frequency", mesh_frequency)
    if f.dtype.kind not in "iuf" or f.shape not in ((), (samples,)):
        raise InputError(f"{_OWNER}: mesh_frequency of shape {f.shape} must be one number or one for each sample, Hz")
    if not np.all((f > 0) & (2 * harmonic * f < fs)):
        raise NotApplicableError(
            f"{_OWNER}: mesh_frequency from {np.min(f):g} to {np.max(f):g} Hz must be above 0 and, times harmonic ="
            f" {harmonic}, below fs/2 = {fs / 2:g} Hz; check its unit, or take a lower harmonic"
        )
    return np.broadcast_to(f.astype(np.float64), (samples,))


def _smoothing(bandwidth: float, fs: float, samples: int) -> Float64Array:
    """A Blackman window of unit sum whose spectrum has its first zero at the bandwidth, and others beyond."""
    length = 2 * round(1.5 * fs / bandwidth) + 1
    if length >= samples:
        raise NotApplicableError(
            f"{_OWNER}: x of {samples} samples must be longer than the {length} that a bandwidth of {bandwidth:g} Hz"
            " smooths over; record longer or raise bandwidth"
        )
    window = np.blackman(length)
    return window / window.sum()


def _convolved(c: NDArray[np.complex128], window: Float64Array) -> NDArray[np.complex128]:
    from scipy.signal import oaconvolve

    smoothed: NDArray[np.complex128] = oaconvolve(c, window, mode="same")
    return smoothed
