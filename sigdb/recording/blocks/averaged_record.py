"""Average of a record over the revolutions of a shaft, and the record over the angle, in memory or in blocks."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sigdb.core import FloatArray, InputError
from sigdb.recording.blocks.recording_blocks import RecordingBlocks
from sigdb.recording.blocks.shared_channels import MOST_VALUES, SharedChannels, over_angle
from sigdb.recording.shaft_angle import ShaftAngle
from sigdb.recording.tacho.waveform import Waveform
from sigdb.signature import SynchronousAverage, SynchronousAverager, synchronous_average

if TYPE_CHECKING:
    from sigdb.recording.recording import Channel, Recording

MOST_OVER_ANGLE = 2048
"""Largest number of revolutions that are kept over the angle, for the spectrum of the record."""

_ROUNDING = 64 * np.finfo(float).eps


@dataclass(frozen=True, kw_only=True)
class AveragedRecord:
    """Average of a record, and the record itself over the angle.

    Attributes
    ----------
    average
        Synchronous average of M revolutions.
    over_angle
        (K * samples_per_rev,) the first K revolutions in equal steps of angle; K is M, but at most 2048.
    deviation
        Standard deviation of the record; 0 for a record with nothing but rounding errors.
    """

    average: SynchronousAverage
    over_angle: FloatArray
    deviation: float

    @property
    def kept(self) -> float:
        """Standard deviation of the average over that of the record."""
        return float(np.std(self.average.tsa)) / self.deviation if self.deviation else 0.0


def averaged_record(
    recording: "Recording | RecordingBlocks",
    signal: "Channel",
    angle: ShaftAngle,
    *,
    samples_per_rev: int,
    available: int,
    revolutions: int | None,
    shared: SharedChannels | None = None,
    alone: bool = False,
) -> AveragedRecord:
    """Return the average of a signal.

    Parameters
    ----------
    recording
        The recording of the signal, or its blocks.
    signal
        The signal; in blocks, without its samples.
    angle
        Angle of the averaged shaft.
    samples_per_rev
        Samples of the average.
    available
        Whole revolutions of the recording.
    revolutions
        Revolutions to average; all if None.
    shared
        Channels that are averaged one after the other. With them the record is resampled once where it is short enough:
        the average is then that of the record over the angle, which differs from the other by the rounding of the
        kernel.
    alone
        Whether the angle is that of this channel only.

    Raises
    ------
    InputError
        If there are fewer revolutions, or the file cannot be read.
    """
    n = samples_per_rev
    if isinstance(recording, RecordingBlocks):
        return _in_blocks(recording, signal, angle, n, available, revolutions)
    fs = signal.sampling_rate
    count = available if revolutions is None else revolutions
    record = _Deviation()
    record.take(signal.samples)
    if shared is not None and 1 <= count <= min(available, MOST_OVER_ANGLE):
        resampled = shared.over_angle(recording, signal, angle, samples_per_rev=n, revolutions=count, alone=alone)
        return AveragedRecord(average=_mean(resampled, n), over_angle=resampled, deviation=record.deviation())
    average = synchronous_average(
        signal.samples,
        fs,
        angle.pulses,
        samples_per_rev=n,
        pulses_per_rev=angle.pulses_per_rev,
        ratio=angle.ratio,
        revolutions=revolutions,
    )
    K = min(average.revolutions, MOST_OVER_ANGLE)
    resampled = over_angle(signal.samples, fs, angle, samples_per_rev=n, revolutions=K)
    return AveragedRecord(average=average, over_angle=resampled, deviation=record.deviation())


def _mean(record: FloatArray, n: int) -> SynchronousAverage:
    """Return the average of a record over the angle."""
    rows = record.reshape(-1, n)
    tsa = rows.mean(axis=0)
    apart = rows - tsa
    scatter = np.sqrt(np.einsum("ij,ij->j", apart, apart) / (len(rows) - 1)) if len(rows) > 1 else np.full(n, np.nan)
    return SynchronousAverage(tsa=tsa, scatter=scatter, revolutions=len(rows))


def tacho_in_blocks(recording: RecordingBlocks) -> Waveform | None:
    """Return the waveform of the tacho of a recording in blocks; None if its tacho has none."""
    whole = recording.whole
    if whole.tacho is None or whole.tacho_kind != "waveform":
        return None
    name = whole.tacho
    extent = next(channel for channel in recording.channels if channel.name == name)
    return Waveform(
        lambda: (part.channel(name).samples for part in recording.parts(name)),
        extent.samples.size,
        extent.least,
        extent.greatest,
    )


def _in_blocks(
    recording: RecordingBlocks, signal: "Channel", angle: ShaftAngle, n: int, available: int, revolutions: int | None
) -> AveragedRecord:
    fs, pulses = signal.sampling_rate, angle.pulses
    averager = SynchronousAverager(
        fs, samples_per_rev=n, pulses_per_rev=angle.pulses_per_rev, ratio=angle.ratio, revolutions=revolutions
    )
    K, needed = _kept_revolutions(angle, fs, n, available if revolutions is None else min(revolutions, available))
    begin: list[FloatArray] = []
    record = _Deviation()
    size = pushed = 0
    for part in recording.parts(signal.name):
        x = part.channels[0].samples
        if size < needed:
            begin.append(x[: needed - size].copy())
        size += x.size
        is_last = size >= signal.samples.size
        until = len(pulses) if is_last else int(np.searchsorted(pulses, size / fs))
        averager.push(x, pulses[pushed:until])
        pushed = until
        record.take(x)
    average = averager.result()
    if revolutions is not None and average.revolutions < revolutions:
        raise InputError(
            f"{recording.source}: revolutions = {revolutions} must be at most {average.revolutions}, those within"
            " pulses and record; ask for fewer or record longer"
        )
    K = min(K, average.revolutions)
    resampled = over_angle(np.concatenate(begin), fs, angle, samples_per_rev=n, revolutions=K)
    return AveragedRecord(average=average, over_angle=resampled, deviation=record.deviation())


def _kept_revolutions(angle: ShaftAngle, fs: float, n: int, revolutions: int) -> tuple[int, int]:
    """Return the revolutions that are kept over the angle, and the samples from the first one that they need."""
    each = angle.pulses_per_rev / angle.ratio
    K = max(min(revolutions, MOST_OVER_ANGLE, MOST_VALUES // n), 1)
    places = np.arange(K + 1) * each
    ends = np.interp(places, np.arange(len(angle.pulses)), angle.pulses) * fs
    K = max(int(np.searchsorted(ends, MOST_VALUES)) - 1, 1) if ends[-1] > MOST_VALUES else K
    # The kernel reaches beyond the last revolution, by less than another one.
    return K, int(2 * ends[K] - ends[K - 1]) + 64


class _Deviation:
    """Standard deviation of a record that comes in blocks."""

    def __init__(self) -> None:
        self._size, self._mean, self._squares, self._peak = 0, 0.0, 0.0, 0.0

    def take(self, x: FloatArray) -> None:
        """Take the next samples."""
        peak = float(np.max(np.abs(x))) or 1.0
        mean = float(np.mean(x))
        total = self._size + x.size
        apart = mean - self._mean
        self._squares += float(np.var(x / peak)) * peak**2 * x.size + apart**2 * self._size * x.size / total
        self._mean += apart * x.size / total
        self._size, self._peak = total, max(self._peak, peak)

    def deviation(self) -> float:
        """Return the standard deviation; 0 where rounding errors alone make it."""
        deviation = float(np.sqrt(self._squares / self._size))
        return deviation if deviation > _ROUNDING * self._peak else 0.0
