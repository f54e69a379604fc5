"""Tooth passes from the phase of a mesh harmonic, for records without a tacho."""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sigdb.core import InputError, NotApplicableError, plain_array
from sigdb.signature.checks import GREATEST_COUNT, Float64Array, count, increasing_times, positive, real_signal

_OWNER = "mesh_pulses"

_PASSES = 2
"""A second demodulation, with the phase that the first found, takes the lag behind changes of speed down tenfold."""
_PASSED, _STOPPED = 4.0, 8.0
"""Distances from the harmonic, in bandwidths, between which the band that is demodulated ends in a half cosine. The
window passes nothing there. The record's ends ring for a quarter of a bandwidth's period, a sixth of half a window."""
_OVERSAMPLED = 2
"""Samples of a band relative to its width: a phase of the bandwidth is followed from one to the next."""


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

    A band about the harmonic is demodulated with ``exp(-j psi)``, ``psi = 2 pi h integral f dt``, and smoothed with a
    Blackman window; the phase of what is left corrects psi. A pulse is where psi, counted from a crest of the harmonic,
    passes a multiple of ``2 pi h``. Where the window reaches beyond the record, in its first and last
    ``1.5 / bandwidth`` seconds, there are no pulses.

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
    mesh = MeshPhase(x, fs, teeth=teeth, mesh_frequency=mesh_frequency, bandwidth=bandwidth)
    return mesh.pulses(harmonic)


class MeshPhase:
    """Phase of the harmonics of a mesh in a record that is transformed once for all of them.

    Parameters
    ----------
    x, fs, teeth, mesh_frequency, bandwidth
        As in :func:`mesh_pulses`.
    times : array_like, (points,), optional
        Times of the values of ``mesh_frequency``, s, increasing; it is linear between them, and constant beyond. By
        default they are those of the samples.

    Raises
    ------
    InputError
        As :func:`mesh_pulses`.

    Examples
    --------
    >>> import numpy as np
    >>> from sigdb.signature import MeshPhase
    >>> fs, turns = 5000.0, 10 * np.arange(50_000) / 5000.0
    >>> x = np.cos(2 * np.pi * 12 * turns) + 0.5 * np.cos(2 * np.pi * 24 * turns)
    >>> mesh = MeshPhase(x, fs, teeth=12, mesh_frequency=[119.0, 121.0], times=[0.0, 10.0])
    >>> [mesh.pulses(harmonic).size for harmonic in (1, 2)]
    [1164, 1164]
    """

    def __init__(
        self,
        x: ArrayLike,
        fs: float,
        *,
        teeth: int,
        mesh_frequency: ArrayLike,
        bandwidth: float | None = None,
        times: ArrayLike | None = None,
    ) -> None:
        from scipy.fft import next_fast_len, rfft

        record, _ = real_signal(_OWNER, "x", x)
        if record.ndim != 1:
            raise InputError(f"{_OWNER}: x of shape {record.shape} must have one axis; pass one channel")
        self._fs, self._samples = positive(_OWNER, "fs", fs), record.size
        z = count(_OWNER, "teeth", teeth, least=1, most=GREATEST_COUNT)
        place = None if times is None else increasing_times(_OWNER, "times", times, after=-np.inf) * self._fs
        self._frequency = _Frequency(_frequencies(mesh_frequency, record.size, place), place, record.size)
        self._check_range(1)
        mean = float(self._frequency.turns(np.array([record.size - 1.0]))[0]) / max(record.size - 1, 1)
        self._width = mean / z if bandwidth is None else positive(_OWNER, "bandwidth", bandwidth)
        self._half = max(round(1.5 * self._fs / self._width), 1)
        if 2 * self._half + 1 >= record.size:
            raise NotApplicableError(
                f"{_OWNER}: x of {record.size} samples must be longer than the {2 * self._half + 1} that a bandwidth of"
                f" {self._width:g} Hz smooths over; record longer or raise bandwidth"
            )
        self._length = int(next_fast_len(record.size, real=True))
        self._spectrum: NDArray[np.complex128] = rfft(record - record.mean(), self._length)

    def pulses(self, harmonic: int = 1) -> Float64Array:
        """Return the times of successive tooth passes by a harmonic, as :func:`mesh_pulses`.

        Parameters
        ----------
        harmonic : int
            Harmonic h of the mesh.

        Returns
        -------
        (pulses,) float64
            Times, s.

        Raises
        ------
        InputError
            As :func:`mesh_pulses`.
        """
        h = count(_OWNER, "harmonic", harmonic, least=1, most=GREATEST_COUNT)
        self._check_range(h)
        z, place, turned = self._band(h)
        smooth = _smoothing(_blackman(self._half / (place[1] - place[0])), z.size)
        psi = 2 * np.pi * h / self._fs * self._frequency.turns(place)
        for _ in range(_PASSES):
            y = smooth(z * np.exp(1j * (turned - psi)))
            if np.any(np.diff(psi) / place[1] + _least_turn(y, place[1]) <= 0):
                raise NotApplicableError(
                    f"{_OWNER}: the phase of mesh harmonic {h} runs backwards; check mesh_frequency, take a stronger"
                    " harmonic or a smaller bandwidth"
                )
            psi += np.angle(y[0]) + np.append(0.0, np.cumsum(np.angle(y[1:] * y[:-1].conj())))
        return _crests(psi / (2 * np.pi), (self._half, self._samples - 1 - self._half), place[1], h) / self._fs

    def _check_range(self, harmonic: int) -> None:
        least, most = self._frequency.least, self._frequency.most
        if not (least > 0 and 2 * harmonic * most < self._fs):
            raise NotApplicableError(
                f"{_OWNER}: mesh_frequency from {least:g} to {most:g} Hz must be above 0 and, times harmonic ="
                f" {harmonic}, below fs/2 = {self._fs / 2:g} Hz; check its unit, or take a lower harmonic"
            )

    def _band(self, harmonic: int) -> tuple[NDArray[np.complex128], Float64Array, Float64Array]:
        """Return the analytic signal of the band about a harmonic, shifted down to begin at 0 Hz, in as few samples.

        Then their places in the record, counted in its samples, and the phase by which the shift has turned them.
        """
        from scipy.fft import ifft, next_fast_len

        step, reach = self._fs / self._length, _STOPPED * self._width
        first, last = harmonic * self._frequency.least, harmonic * self._frequency.most
        low = max(int((first - reach) / step), 0)
        high = min(int((last + reach) / step) + 1, len(self._spectrum))
        f = np.arange(low, high) * step
        beyond = np.maximum(first - f, f - last) / self._width
        outer = np.clip((beyond - _PASSED) / (_STOPPED - _PASSED), 0, 1)
        size = min(int(next_fast_len(_OVERSAMPLED * (high - low))), self._length)
        band = self._spectrum[low:high] * np.cos(np.pi / 2 * outer) ** 2
        z: NDArray[np.complex128] = ifft(band, size) * (2 * size / self._length)
        number = np.arange(int((self._samples - 1) * size / self._length) + 1, dtype=np.float64)
        return z[: number.size], number * (self._length / size), number * (2 * np.pi * low / size)


class _Frequency:
    """A frequency that is linear between places of a record, Hz, and its integral."""

    def __init__(self, f: Float64Array, place: Float64Array | None, samples: int) -> None:
        self.least, self.most = float(f.min()), float(f.max())
        place = np.arange(f.size, dtype=float) if place is None else place
        self._place = np.concatenate([[min(0.0, place[0])], place, [max(samples - 1.0, place[-1])]])
        self._f = np.concatenate([f[:1], f, f[-1:]])
        steps = np.diff(self._place)
        self._turns = np.append(0.0, np.cumsum(steps * (self._f[1:] + self._f[:-1]) / 2))
        self._rise = np.divide(np.diff(self._f), steps, out=np.zeros_like(steps), where=steps > 0)

    def turns(self, place: Float64Array) -> Float64Array:
        """Return the integral up to places, counted in samples, in Hz times samples."""
        i = np.clip(np.searchsorted(self._place, place, side="right") - 1, 0, len(self._rise) - 1)
        after = place - self._place[i]
        return np.asarray(self._turns[i] + (self._f[i] + self._rise[i] * after / 2) * after)


def _frequencies(mesh_frequency: ArrayLike, samples: int, place: Float64Array | None) -> Float64Array:
    f = plain_array(_OWNER, "mesh_frequency", mesh_frequency)
    points = samples if place is None else place.size
    if f.dtype.kind not in "iuf" or f.shape not in (() if place is None else (points,), (points,)) or points == 0:
        each = "sample" if place is None else "time"
        raise InputError(f"{_OWNER}: mesh_frequency of shape {f.shape} must be one number or one for each {each}, Hz")
    return np.atleast_1d(f.astype(np.float64))


def _crests(turns: Float64Array, ends: tuple[float, float], step: float, every: int) -> Float64Array:
    """Return the places of whole turns, the first and every so many after it, between two ends.

    The turns are those at steps of a place; four of them bear on a place between, by a cubic.
    """
    first, last = (_cubic(turns, np.array([end / step]))[0][0] for end in ends)
    crests = np.arange(np.ceil(first), last, every)
    place = np.interp(crests, turns, np.arange(turns.size))
    value, slope = _cubic(turns, place)
    return (place - (value - crests) / slope) * step  # Newton's step from the chord to the curve


def _cubic(y: Float64Array, place: Float64Array) -> tuple[Float64Array, Float64Array]:
    """Return values and slopes of Lagrange's cubic through the four neighbours of each place."""
    i = np.clip(place.astype(np.int64), 1, y.size - 3)
    u, (a, b, c, d) = place - i, (y[i - 1], y[i], y[i + 1], y[i + 2])
    linear, square, cube = -a / 3 - b / 2 + c - d / 6, (a + c) / 2 - b, (d - a) / 6 + (b - c) / 2
    return b + u * (linear + u * (square + u * cube)), linear + u * (2 * square + 3 * u * cube)


def _blackman(half: float) -> Float64Array:
    """Return a Blackman window of unit sum that ends half a window from its centre, between two samples."""
    u = np.pi * np.arange(-int(half), int(half) + 1) / half
    window = 0.42 + 0.5 * np.cos(u) + 0.08 * np.cos(2 * u)
    return np.asarray(window / window.sum())


def _least_turn(y: NDArray[np.complex128], samples: float) -> Float64Array:
    """Return the least turn of the phase during a sample of the record, rad, between neighbours so many samples apart.

    A straight line from y0 to y1 turns by ``Im(y0* y1) / |y|^2`` on its way from one to the other; about a zero of y it
    turns by half a cycle at once.
    """
    y0, step = y[:-1], np.diff(y)
    along = y0.real * step.real + y0.imag * step.imag
    across, length = y0.real * step.imag - y0.imag * step.real, step.real**2 + step.imag**2
    nearest = np.clip(np.divide(-along, length, out=np.zeros_like(along), where=length > 0), 0, 1)
    least = np.maximum(np.abs(y0 + nearest * step) ** 2, np.finfo(float).tiny)
    return np.asarray(2 * np.arctan(np.minimum(across, 0) / least / samples / 2))


def _smoothing(window: Float64Array, size: int) -> Callable[[NDArray[np.complex128]], NDArray[np.complex128]]:
    """Return the convolution of so many samples with a window, whose spectrum is computed once."""
    from scipy.fft import fft, ifft, next_fast_len

    length, half = int(next_fast_len(size + window.size - 1)), window.size // 2
    passed: NDArray[np.complex128] = fft(window, length)

    def smooth(c: NDArray[np.complex128]) -> NDArray[np.complex128]:
        smoothed: NDArray[np.complex128] = ifft(fft(c, length) * passed)[half : half + size]
        return smoothed

    return smooth
