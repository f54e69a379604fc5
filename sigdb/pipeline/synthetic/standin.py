"""A recording: channels with their unit and rate, and what is known of the shaft."""

from dataclasses import dataclass

from sigdb.core.errors import InputError
from sigdb.core.typing import FloatArray


@dataclass(frozen=True, kw_only=True)
class Channel:
    """A sampled channel.

    Attributes
    ----------
    name, unit
        Its name, and its unit; empty if not stated.
    samples
        (n,) values.
    sampling_rate
        Hz.
    """

    name: str
    samples: FloatArray
    sampling_rate: float
    unit: str


@dataclass(frozen=True, kw_only=True)
class Recording:
    """Channels of one measurement.

    Attributes
    ----------
    source
        Where it is from.
    channels
        Its channels.
    tacho
        Name of the tacho's channel.
    notes
        What to know of it, one sentence each.
    teeth, speed_rpm, torque
        Of the gear and its shaft, where known.
    pulses_per_rev, ratio
        Pulses in a revolution of the tacho's shaft; revolutions of the gear's shaft in one of that.
    """

    source: str
    channels: tuple[Channel, ...]
    tacho: str | None = None
    notes: tuple[str, ...] = ()
    teeth: int | None = None
    speed_rpm: float | None = None
    torque: float | None = None
    pulses_per_rev: float = 1.0
    ratio: float = 1.0

    def channel(self, name: str) -> Channel:
        """The channel of a name."""
        for one in self.channels:
            if one.name == name:
                return one
        raise InputError(f"no channel {name!r}; known: {', '.join(one.name for one in self.channels)}")

    @property
    def signals(self) -> tuple[Channel, ...]:
        """Channels that are not the tacho."""
        return tuple(one for one in self.channels if one.name != self.tacho)
