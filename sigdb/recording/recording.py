"""A recording: the channels of one measurement."""

import numbers
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from sigdb.core import FloatArray, InputError, Note, check_unmasked, plain_array, shown, suggestion

if TYPE_CHECKING:
    import pandas as pd

TachoKind = Literal["waveform", "pulse-times", "counts", "angle", "speed"]
"""Quantity that the channel of a tacho holds."""

Edge = Literal["rising", "falling"]
"""Edge of a tacho's pulse."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Channel:
    """One measured signal, evenly sampled.

    Attributes
    ----------
    name
        Name in its recording.
    samples
        (n,) float64, finite, in ``unit``; sample i is taken i / sampling_rate seconds after the first.
    sampling_rate
        Sampling rate, Hz.
    unit
        Unit as the file or the user writes it; empty where none is stated.
    rate_from
        Source of the sampling rate, in words.
    start
        Time of the first sample in s, on the recording's time axis.

    Raises
    ------
    InputError
        If the samples are not a series of finite numbers, or the rate is not positive.

    Examples
    --------
    >>> import numpy as np
    >>> Channel(name="a1", samples=np.zeros(25_600), sampling_rate=12_800.0, unit="m/s^2").duration
    2.0
    """

    name: str
    samples: FloatArray
    sampling_rate: float
    unit: str = ""
    rate_from: str = "the caller"
    start: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "samples", plain_array(f"channel {self.name}", "samples", self.samples))
        if self.samples.ndim != 1 or self.samples.size == 0 or self.samples.dtype != np.float64:
            raise InputError(
                f"channel {self.name}: samples of shape {self.samples.shape} and type {self.samples.dtype}; "
                "give a series (n,) of float64"
            )
        if not np.isfinite(self.samples).all():
            raise InputError(f"channel {self.name}: samples must be finite; fill or cut what is missing")
        for name, value, lowest in (("sampling_rate", self.sampling_rate, 0.0), ("start", self.start, -np.inf)):
            if isinstance(value, bool) or not isinstance(value, numbers.Real) or not lowest < value < np.inf:
                rule = "a positive number, in Hz" if name == "sampling_rate" else "a finite number, in s"
                raise InputError(f"channel {self.name}: {name} = {shown(value)} must be {rule}")

    @property
    def duration(self) -> float:
        """Duration in s: the number of samples over the sampling rate."""
        return self.samples.size / self.sampling_rate


@dataclass(frozen=True, kw_only=True, eq=False)
class UnreadChannel(Channel):
    """A channel whose samples are not in memory: ``samples`` has their number, and all of them are nan.

    Attributes
    ----------
    least, greatest, rms
        Least and greatest sample and root mean square, in ``unit``.
    """

    least: float
    greatest: float
    rms: float

    def __post_init__(self) -> None:
        """Accept samples that are nan."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Recording:
    """Channels of one measurement, and facts about the shaft.

    Attributes
    ----------
    source
        The file, or another source.
    channels
        Channels in the order of the file. All begin at the same instant, or within a sample of each other where the
        file states so; ``start`` of each channel then differs.
    tacho
        Name of the channel with the tacho, if there is one.
    pulses_per_rev
        Pulses of the tacho in one revolution of its shaft.
    tacho_kind
        Quantity that the tacho's channel holds: ``waveform``, ``pulse-times``, ``counts``, ``angle`` or ``speed``.
    pulse_times
        (pulses,) times of the tacho's pulses, s, on the recording's time axis, in place of a channel.
    threshold, hysteresis, edge
        Level at which a pulse begins, depth to which the waveform must return before the next one, both in the tacho's
        unit, and the edge that counts, ``rising`` or ``falling``. None leaves the choice to the reader.
    ratio
        Revolutions of the shaft of interest in one of the tacho's shaft.
    teeth, speed_rpm, torque
        Tooth count of the gear of interest, mean speed of its shaft (rev/min) and torque on it (N m), where stated.
    load
        Load of the machine where stated, in per cent or in any one unit.
    zero_time
        Time in s after the beginning of 1970 at which the time axis of the channels is zero; None if not stated.
    notes
        Notes on what was changed on reading.

    Raises
    ------
    InputError
        If there is no channel, if two have the same name, or if the tacho is not among them.

    Examples
    --------
    >>> import numpy as np
    >>> a1 = Channel(name="a1", samples=np.zeros(100), sampling_rate=1000.0)
    >>> recording = Recording(source="example", channels=(a1,))
    >>> recording.channel("a1").sampling_rate
    1000.0
    """

    source: str
    channels: tuple[Channel, ...]
    tacho: str | None = None
    pulses_per_rev: float = 1.0
    tacho_kind: TachoKind = "waveform"
    pulse_times: FloatArray | None = None
    threshold: float | None = None
    hysteresis: float | None = None
    edge: Edge | None = None
    ratio: float = 1.0
    teeth: int | None = None
    speed_rpm: float | None = None
    torque: float | None = None
    load: float | None = None
    zero_time: float | None = None
    notes: tuple[Note, ...] = ()

    def __post_init__(self) -> None:
        names = [channel.name for channel in self.channels]
        if not names:
            raise InputError(f"{self.source}: a recording has at least one channel")
        if len(set(names)) < len(names):
            raise InputError(f"{self.source}: channels must have different names, not {', '.join(names)}")
        if self.pulse_times is not None:
            check_unmasked(self.source, "pulse_times", self.pulse_times)
            if self.pulse_times.ndim != 1 or not np.isfinite(self.pulse_times).all():
                raise InputError(f"{self.source}: pulse_times must be a series of finite times, s")
        elif self.tacho is not None:
            self.channel(self.tacho)

    def channel(self, name: str) -> Channel:
        """Return the channel of a name.

        Parameters
        ----------
        name : str
            Name of the channel.

        Returns
        -------
        Channel

        Raises
        ------
        InputError
            If there is no such channel; the message names the others.
        """
        by_name = {channel.name: channel for channel in self.channels}
        if name not in by_name:
            raise InputError(f"{self.source}: no channel {name!r}{suggestion(name, by_name)}")
        return by_name[name]

    def overview(self) -> "pd.DataFrame":
        """Return what was read, a row for each channel, and what was left out of the file, a row for each part.

        Returns
        -------
        pandas.DataFrame
            For channels: ``channel``, ``unit``, ``sampling_rate`` (Hz) and its source ``rate_from``, ``start`` and
            ``duration`` (s), ``samples``, and ``least``, ``greatest`` and ``rms`` in the unit. ``clipped`` is the share
            of samples at the extremes of a clipped signal; ``spikes`` and ``drop_outs`` are numbers of places. These
            three are missing for the tacho. ``left_out`` is the reason why a part is no channel, else empty.

        Examples
        --------
        >>> import numpy as np
        >>> x = np.clip(np.sin(np.arange(1000) / 10), -0.8, 2)
        >>> recording = Recording(source="here", channels=(Channel(name="a1", samples=x, sampling_rate=1e3),))
        >>> recording.overview()[["channel", "duration", "least", "clipped", "spikes"]].to_dict("records")
        [{'channel': 'a1', 'duration': 1.0, 'least': -0.8, 'clipped': 0.206, 'spikes': 0}]
        """
        from sigdb.recording.overview.overview_table import overview_table

        return overview_table(self)

    @property
    def signals(self) -> tuple[Channel, ...]:
        """All channels except the tacho."""
        return tuple(channel for channel in self.channels if channel.name != self.tacho)
