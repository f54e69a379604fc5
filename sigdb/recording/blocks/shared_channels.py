"""Channels of a recording that are averaged one after the other: what they share is computed once."""

from collections.abc import Callable, Hashable, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from sigdb.core import FloatArray
from sigdb.recording.shaft_angle import ShaftAngle
from sigdb.signature import SynchronousAverager

if TYPE_CHECKING:
    from sigdb.recording.recording import Channel, Recording

MOST_VALUES = 2**24
"""Largest number of samples that are kept of several channels over the angle, and of a record in blocks."""

T = TypeVar("T")


class SharedChannels:
    """Channels of a recording that are averaged over the turns of one gear, one after the other.

    The pulses of the tacho, the search for the speed, and the weights of the resampling are the same for all of them.

    Parameters
    ----------
    names : sequence of str
        The channels.
    """

    def __init__(self, names: Sequence[str] = ()) -> None:
        self._names = tuple(names)
        self._values: dict[Hashable, Any] = {}
        self._over_angle: dict[Hashable, FloatArray] = {}

    def value(self, key: Hashable, compute: Callable[[], T]) -> T:
        """Return the value of a key, which is computed on its first use."""
        if key not in self._values:
            self._values[key] = compute()
        value: T = self._values[key]
        return value

    def over_angle(
        self,
        recording: "Recording",
        signal: "Channel",
        angle: ShaftAngle,
        *,
        samples_per_rev: int,
        revolutions: int,
        alone: bool = False,
    ) -> FloatArray:
        """Return a channel in equal steps of angle; channels of its rate and length are resampled with it.

        Parameters
        ----------
        recording, signal
            The recording and the channel.
        angle
            Angle of the averaged shaft.
        samples_per_rev, revolutions
            Samples of a revolution, and revolutions.
        alone
            Whether the angle is that of this channel only.
        """
        size = samples_per_rev * revolutions
        place = (size, angle.pulses_per_rev, angle.ratio, angle.pulses.tobytes())
        if (kept := self._over_angle.pop((signal.name, *place), None)) is not None:
            return kept
        together = [signal] if alone else self._alike(recording, signal)[: max(1, MOST_VALUES // size)]
        resampled = over_angle(
            np.stack([each.samples for each in together]) if len(together) > 1 else signal.samples[None],
            signal.sampling_rate,
            angle,
            samples_per_rev=samples_per_rev,
            revolutions=revolutions,
        )
        self._over_angle = {(each.name, *place): x for each, x in zip(together[1:], resampled[1:], strict=True)}
        return np.asarray(resampled[0])

    def _alike(self, recording: "Recording", signal: "Channel") -> list["Channel"]:
        """Return a channel and the later ones with its rate, length and beginning."""
        later = self._names[self._names.index(signal.name) + 1 :] if signal.name in self._names else ()
        others = [each for each in recording.channels if each.name in later and each.name != signal.name]
        alike = (signal.sampling_rate, signal.samples.size, signal.start)
        return [
            signal,
            *(each for each in others if (each.sampling_rate, each.samples.size, each.start) == alike),
        ]


def over_angle(x: FloatArray, fs: float, angle: ShaftAngle, *, samples_per_rev: int, revolutions: int) -> FloatArray:
    """Return records (..., samples) in equal steps of angle: their revolutions as a single long one.

    Parameters
    ----------
    x, fs
        Records, and their sampling rate, Hz.
    angle
        Angle of the averaged shaft.
    samples_per_rev, revolutions
        Samples of a revolution, and revolutions.
    """
    averager = SynchronousAverager(
        fs,
        samples_per_rev=revolutions * samples_per_rev,
        pulses_per_rev=angle.pulses_per_rev * revolutions,
        ratio=angle.ratio,
        revolutions=1,
    )
    return averager.first_revolution(x, angle.pulses)
