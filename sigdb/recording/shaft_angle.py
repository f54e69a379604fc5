"""The angle of a shaft in a recording: pulses of its tacho, or the phase of a mesh harmonic."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from sigdb.core import FloatArray, InputError
from sigdb.recording.speed import HARMONICS, FoundSpeed, find_speed
from sigdb.signature import mesh_pulses, tacho_pulses

if TYPE_CHECKING:
    from sigdb.recording.recording import Channel, Recording

SPEED_DOUBT = "the speed is not certain"
"""How a note on a speed that may be another one begins."""

_NEARLY_AS_LIKELY = 0.9
"""Score of the next likely speed, over that of the one found, from which on it is told."""


@dataclass(frozen=True, kw_only=True)
class ShaftAngle:
    """Pulses that tell the angle of a shaft.

    Attributes
    ----------
    pulses
        Times, s.
    pulses_per_rev
        Pulses in a revolution of the shaft that gives them.
    ratio
        Revolutions of the averaged shaft in one of that shaft.
    absolute
        Whether the first pulse is always at the same angle of the averaged shaft.
    source
        What the pulses are, in words.
    notes
        What is to be known of them, one sentence each.
    """

    pulses: FloatArray
    pulses_per_rev: int
    ratio: float
    absolute: bool
    source: str
    notes: tuple[str, ...] = ()

    def revolutions(self, duration: float) -> int:
        """Whole revolutions of the averaged shaft from the first pulse to the last within a record of this length."""
        within = int(np.count_nonzero(self.pulses <= duration))
        return int((within - 1) / self.pulses_per_rev * self.ratio + 1e-9) if within else 0

    def speed_track(self) -> pd.DataFrame:
        """Speed of the averaged shaft over each revolution of the one that gives the pulses: time, s; speed_rpm."""
        t, k = self.pulses, self.pulses_per_rev
        start, stop = t[:-k], t[k:]
        return pd.DataFrame({"time": (start + stop) / 2, "speed_rpm": 60 * self.ratio / (stop - start)})


def tacho_angle(recording: "Recording") -> ShaftAngle:
    """The angle by the recording's tacho.

    Raises
    ------
    InputError
        If the recording has no tacho channel, it has too few pulses, or a revolution has no whole number of them.
    """
    if recording.tacho is None:
        raise InputError(
            f"{recording.source}: no channel is known as its tacho; name it, or take the angle from the phase of the"
            " mesh (mesh_phase)"
        )
    channel, each, ratio = recording.channel(recording.tacho), recording.pulses_per_rev, recording.ratio
    if each < 1 or round(each) != each:
        raise InputError(
            f"{recording.source}: pulses_per_rev = {each:g} must be a whole number; what gears lie between is ratio"
        )
    pulses = tacho_pulses(channel.samples, channel.sampling_rate)
    if len(pulses) <= each:
        raise InputError(
            f"{recording.source}: tacho {channel.name} has {len(pulses)} pulses, which bound no revolution of {each:g};"
            " check that it is the tacho, or record longer"
        )
    absolute = each == 1 and round(ratio) == ratio
    notes = [f"tacho {channel.name}: {len(pulses)} pulses, {each:g} a revolution of its shaft"]
    if ratio != 1:
        notes.append(f"the averaged shaft turns {ratio:.6g} times a revolution of the tacho's shaft")
    if not absolute:
        notes.append(
            "tooth numbers are relative: the tacho's pulses do not tell one angle of the averaged shaft, so tooth 1 is"
            " the one at the first pulse of this recording"
        )
    return ShaftAngle(
        pulses=pulses,
        pulses_per_rev=int(each),
        ratio=ratio,
        absolute=absolute,
        source=f"tacho {channel.name}",
        notes=tuple(notes),
    )


def mesh_angle(
    recording: "Recording",
    channel: "Channel",
    *,
    teeth: int,
    range_rpm: tuple[float, float],
    harmonic: int | None = None,
) -> ShaftAngle:
    """The angle by the phase of a mesh harmonic, about the speed that the spectrum of all channels tells.

    Parameters
    ----------
    recording
        Its signals of the same rate and length take part in finding the speed.
    channel
        The channel whose phase is taken.
    teeth
        Tooth count of the gear on the averaged shaft.
    range_rpm
        Where the shaft's speed lies.
    harmonic
        Mesh harmonic; by default that of the first three whose pulses come most evenly, revolution after revolution:
        the shaft's own unevenness is in each of them, the noise of the phase adds to it.

    Raises
    ------
    InputError
        If no speed or no phase is found.
    """
    fs, size = channel.sampling_rate, len(channel.samples)
    others = [one for one in recording.signals if one.name != channel.name]
    alike = [one.samples for one in others if one.sampling_rate == fs and len(one.samples) == size]
    found = find_speed(np.stack([channel.samples, *alike]), fs, teeth=teeth, range_rpm=range_rpm)
    speed = np.interp(np.arange(size) / fs, found.time, found.speed_rpm) / 60
    pulses, used = _pulses(channel, teeth, speed, range(1, HARMONICS + 1) if harmonic is None else (harmonic,))
    return ShaftAngle(
        pulses=pulses,
        pulses_per_rev=teeth,
        ratio=1.0,
        absolute=False,
        source=f"phase of mesh harmonic {used} of {channel.name}",
        notes=(*_speed_notes(found, range_rpm, len(alike) + 1), *_phase_notes(used, pulses, size / fs)),
    )


def _pulses(channel: "Channel", teeth: int, speed: FloatArray, harmonics: Sequence[int]) -> tuple[FloatArray, int]:
    """Tooth passes by the harmonic that gives them most evenly, and that harmonic."""
    found: list[tuple[float, FloatArray, int]] = []
    refused: list[InputError] = []
    for one in harmonics:
        try:
            x, fs = channel.samples, channel.sampling_rate
            pulses = mesh_pulses(x, fs, teeth=teeth, mesh_frequency=teeth * speed, harmonic=one)
            found.append((_unevenness(pulses, teeth), pulses, one))
        except InputError as error:
            refused.append(error)
    if not found:
        raise refused[0]
    best = min(found, key=lambda one: one[0])
    return best[1], best[2]


def _unevenness(pulses: FloatArray, each: int) -> float:
    """Standard deviation of how much a revolution is longer than the one before, s; infinite where it is not known."""
    if len(pulses) <= 2 * each:
        return np.inf
    return float(np.std(pulses[2 * each :] - 2 * pulses[each:-each] + pulses[: -2 * each]))


def _speed_notes(found: FoundSpeed, range_rpm: tuple[float, float], channels: int) -> list[str]:
    low, high = range_rpm
    said = [
        f"speed found in the spectrum of {channels} channel{'s' if channels > 1 else ''} between {low:g} and"
        f" {high:g} rpm: {found.speed_rpm.min():.1f} to {found.speed_rpm.max():.1f} rpm"
    ]
    if found.runner_up > _NEARLY_AS_LIKELY:
        said.append(
            f"{SPEED_DOUBT}: {found.runner_up_rpm:.1f} rpm explains the spectrum nearly as well (score"
            f" {found.runner_up:.2f} of the best); give the speed"
        )
    return said


def _phase_notes(harmonic: int, pulses: FloatArray, duration: float) -> list[str]:
    return [
        f"angle from the phase of mesh harmonic {harmonic}, in {pulses[-1] - pulses[0]:.3g} s of {duration:.3g} s: the"
        " window of the phase reaches beyond the record at its ends, and changes of speed within a revolution are not"
        " followed",
        "tooth numbers are relative: without a tacho mark, tooth 1 is the one at the first pass of this recording",
    ]
