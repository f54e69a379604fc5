"""The synchronous average of a record that comes in blocks, in bounded memory."""

import itertools
import math
from dataclasses import dataclass, replace
from operator import itemgetter

import numpy as np
from numpy.typing import ArrayLike

from sigdb.core import InputError
from sigdb.signature.averaging.record import MEMORY, Record
from sigdb.signature.averaging.shaft_phase import GUARD, ShaftPhase
from sigdb.signature.averaging.sinc_kernel import HALF_WIDTH, reach, sinc_table
from sigdb.signature.checks import GREATEST_COUNT, Float64Array, count, increasing_times, positive, real_signal

_OWNER = "synchronous_average"

_STEPS_AN_OCTAVE = 16
"""Steps of the kernel's cut-off: revolutions whose samples differ by less than 2 % share one kernel."""

_TOLERANCE = 1e-6
"""Samples by which a last pulse may pass the record's end, by rounding."""


@dataclass(frozen=True, kw_only=True)
class SynchronousAverage:
    """One revolution of a shaft, averaged over many.

    Attributes
    ----------
    tsa : (..., samples_per_rev) float64
        The average, in the unit of the record; sample 0 is at the tacho's mark.
    scatter : (..., samples_per_rev) float64
        Standard deviation between the revolutions at each angle, with ``revolutions - 1`` in its denominator; nan for
        a single revolution. The standard error of the average is ``scatter / sqrt(revolutions)``.
    revolutions : int
        Revolutions in the average.
    """

    tsa: Float64Array
    scatter: Float64Array
    revolutions: int


@dataclass(kw_only=True)
class _Progress:
    """Running mean and sum of squared deviations, ``(channels, n)``, of the revolutions averaged so far."""

    mean: Float64Array
    squares: Float64Array
    revolutions: int = 0
    length: float = np.inf
    """Samples in the last of them."""
    end: float = 0.0
    """The last one's end, counted in samples from the record's first."""


class SynchronousAverager:
    """Synchronous average of a record that comes in blocks, as :func:`synchronous_average` computes it.

    Its memory does not grow with the record: it holds samples of about 32 intervals between pulses, and a revolution or
    two.

    Parameters
    ----------
    fs, samples_per_rev, pulses_per_rev, ratio, revolutions
        As in :func:`synchronous_average`.

    Raises
    ------
    InputError
        If an argument is out of its range.

    Examples
    --------
    >>> import numpy as np
    >>> from sigdb.signature import SynchronousAverager
    >>> averager = SynchronousAverager(1000.0, samples_per_rev=96)
    >>> for block in range(20):
    ...     t = block + np.arange(1000) / 1000.0
    ...     averager.push(np.cos(2 * np.pi * 8 * 10 * t), pulse_times=block + np.arange(10) / 10)
    >>> average = averager.result()
    >>> average.revolutions, float(average.tsa[0].round(5))
    (199, 1.0)
    """

    def __init__(
        self,
        fs: float,
        *,
        samples_per_rev: int,
        pulses_per_rev: int = 1,
        ratio: float = 1.0,
        revolutions: int | None = None,
    ) -> None:
        self._fs = positive(_OWNER, "fs", fs)
        self._n = count(_OWNER, "samples_per_rev", samples_per_rev, least=1, most=GREATEST_COUNT)
        self._pulses = count(_OWNER, "pulses_per_rev", pulses_per_rev, least=1, most=GREATEST_COUNT) / positive(
            _OWNER, "ratio", ratio
        )
        self._most = np.inf if revolutions is None else count(_OWNER, "revolutions", revolutions, least=1)
        self._record = Record()
        self._phase = ShaftPhase(_OWNER)
        self._channels: tuple[int, ...] | None = None
        self._done = _Progress(mean=np.empty((0, 0)), squares=np.empty((0, 0)))

    def push(self, x: ArrayLike, pulse_times: ArrayLike = ()) -> None:
        """Take the next block of the record, and further pulses; the two need not cover the same time.

        Parameters
        ----------
        x : array_like, (..., samples)
            The samples that follow those taken so far.
        pulse_times : array_like, (pulses,)
            Times after those taken so far, s; 0 is the time of the record's first sample.

        Raises
        ------
        InputError
            If ``x`` is complex, not finite or has other channels than before, or times are not finite and increasing.
        """
        self._take(x, pulse_times)
        # The record's beginning is predicted from as many samples as if it had come whole.
        if self._record.count >= MEMORY:
            self._done = self._advanced(ended=False)
            self._forget()

    def first_revolution(self, x: ArrayLike, pulse_times: ArrayLike) -> Float64Array:
        """Return the first revolution of a whole record in equal steps of angle, not averaged; no block was taken yet.

        Parameters
        ----------
        x, pulse_times : array_like
            As in :func:`synchronous_average`.

        Returns
        -------
        (..., samples_per_rev) float64

        Raises
        ------
        InputError
            As :meth:`push` and :meth:`result`, and if a block was taken before.
        """
        from sigdb.signature.averaging.revolutions import sample_revolution

        if self._channels is not None:
            raise InputError(f"{_OWNER}: blocks were taken before this record; take a new averager for it")
        self._take(x, pulse_times)
        if self._phase.count >= 2:
            spline = self._phase.spline()
            edges, stretches = self._pending(spline, ended=True)
            if len(stretches):
                sampled = np.empty((len(self._done.mean), self._n))
                sample_revolution(*self._window(spline, edges[0], edges[1], stretches[0]), sampled)
                return sampled.reshape(*(self._channels or ()), self._n)
        raise self._no_revolution()

    def _take(self, x: ArrayLike, pulse_times: ArrayLike) -> None:
        block, _ = real_signal(_OWNER, "x", x)
        times = increasing_times(_OWNER, "pulse_times", pulse_times, after=self._phase.last)
        if self._phase.count == 0 and np.any(times[:1] < 0):
            raise InputError(
                f"{_OWNER}: pulse_times begin at {times[0]:g} s, before the record's first sample, at 0; leave out the"
                " pulses before it, the first that is left is the mark"
            )
        self._check_channels(block.shape[:-1])
        self._record.append(block.reshape(-1, block.shape[-1]))
        self._phase.append(times)

    def result(self) -> SynchronousAverage:
        """Return the average of the record so far, as if it ended here; more blocks may follow.

        Returns
        -------
        SynchronousAverage
            The result of :func:`synchronous_average` for the record so far.

        Raises
        ------
        InputError
            If pulses and record bound no revolution yet.
        """
        done = self._advanced(ended=True)
        M = done.revolutions
        if self._channels is None or M == 0:
            raise self._no_revolution()
        shape = (*self._channels, self._n)
        scatter = np.sqrt(done.squares / (M - 1)) if M > 1 else np.full_like(done.squares, np.nan)
        mean = done.mean.copy() if done is self._done else done.mean
        return SynchronousAverage(tsa=mean.reshape(shape), scatter=scatter.reshape(shape), revolutions=M)

    def _no_revolution(self) -> InputError:
        return InputError(
            f"{_OWNER}: pulse_times, {self._phase.count} of them, and a record of {self._record.count / self._fs:g}"
            f" s bound no revolution of {self._pulses:g} pulses; record longer, or check fs, pulses_per_rev and ratio"
        )

    def _check_channels(self, channels: tuple[int, ...]) -> None:
        if self._channels is None:
            self._channels, sums = channels, (math.prod(channels), self._n)
            self._done = _Progress(mean=np.zeros(sums), squares=np.zeros(sums))
        if channels != self._channels:
            raise InputError(
                f"{_OWNER}: x has channels of shape {channels}, but the blocks before have {self._channels};"
                " push the same channels each time"
            )

    def _advanced(self, *, ended: bool) -> _Progress:
        """Progress with all the revolutions that can be averaged now."""
        from sigdb.signature.averaging.revolutions import add_revolutions

        if self._phase.count < 2 or self._done.revolutions == self._most:
            return self._done
        spline = self._phase.spline()
        edges, stretches = self._pending(spline, ended=ended)
        if not len(stretches):
            return self._done
        done = replace(self._done, mean=self._done.mean.copy(), squares=self._done.squares.copy())
        for stretch, group in itertools.groupby(zip(stretches, edges, edges[1:], strict=False), key=itemgetter(0)):
            ends = [(start, stop) for _, start, stop in group]
            window = self._window(spline, ends[0][0], ends[-1][1], stretch)
            add_revolutions(*window, done.revolutions, len(ends), done.mean, done.squares)
            done.revolutions += len(ends)
            done.length, done.end = ends[-1][1] - ends[-1][0], ends[-1][1]
        return done

    def _window(
        self, spline: Float64Array, start: float, stop: float, stretch: float
    ) -> tuple[Float64Array, float, float, Float64Array, float, float, Float64Array]:
        """Return the arguments of the kernels for revolutions between two places, in samples."""
        margin = reach(stretch) + 1
        first, last = int(np.floor(start)) - margin, int(np.ceil(stop)) + margin
        x = self._record.window(first, last)
        return x, float(first), self._fs, spline, float(self._phase.first), self._pulses, sinc_table(stretch)

    def _pending(self, spline: Float64Array, *, ended: bool) -> tuple[Float64Array, Float64Array]:
        """Return the ends, in samples, of the revolutions that can be averaged now, and the stretch of each kernel."""
        guard = 0 if ended else GUARD
        # A ratio such as 12/36 may miss the last pulse by rounding.
        last = min(self._most, int((self._phase.count - 1 - guard) / self._pulses + 1e-9))
        revolutions = np.arange(self._done.revolutions, max(last, self._done.revolutions) + 1)
        places = revolutions * self._pulses
        self._phase.check_forwards(spline, places[0], places[-1])
        edges = self._phase.times(spline, places) * self._fs
        lengths = np.diff(edges)
        previous = np.append(self._done.length, lengths)[:-1]
        # A kernel reaches back over the revolution before at most: no more is kept.
        stretch = np.minimum(_stretch(lengths / self._n), np.maximum(previous / HALF_WIDTH, 1.0))
        room = 0 if ended else np.ceil(HALF_WIDTH * stretch) + 1
        inside = edges[1:] + room <= self._record.count + _TOLERANCE
        ready = int(np.argmin(np.append(inside, False)))
        return edges[: ready + 1], stretch[:ready]

    def _forget(self) -> None:
        """Drop what no later revolution needs."""
        done = self._done
        if done.revolutions == self._most:
            self._record.forget_before(self._record.count)
            self._phase.forget_before(self._phase.count)
        elif done.revolutions:
            self._record.forget_before(int(done.end - max(done.length, HALF_WIDTH)) - 3)
            self._phase.forget_before(int(done.revolutions * self._pulses))


def _stretch(samples: Float64Array) -> Float64Array:
    """Return how much wider a kernel is than a sinc of the record, from the record's samples for each new sample."""
    steps = np.round(_STEPS_AN_OCTAVE * np.log2(np.maximum(samples, 1.0)))
    return 2 ** (steps / _STEPS_AN_OCTAVE)
