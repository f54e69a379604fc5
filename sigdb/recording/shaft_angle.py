"""Angle of a shaft in a recording, from the pulses of its tacho or the phase of a mesh harmonic."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from sigdb.core import FloatArray, NotApplicableError, Note
from sigdb.recording.speed import HARMONICS, SpeedTrack, find_speed
from sigdb.signature import mesh_pulses

if TYPE_CHECKING:
    from sigdb.recording.recording import Channel, Recording

SPEED_DOUBT = "speed-doubt"
"""Code of the note that another speed explains the spectrum nearly as well."""

RELATIVE_TEETH = "relative-teeth"
"""Code of the note that tooth numbers are relative."""

_NEARLY_AS_LIKELY = 0.9
"""Relative score of the next likely speed above which the speed is doubtful."""


@dataclass(frozen=True, kw_only=True)
class ShaftAngle:
    """Pulses that give the angle of a shaft.

    Attributes
    ----------
    pulses
        (pulses,) times, s.
    pulses_per_rev
        Pulses in a revolution of the shaft that they are on.
    ratio
        Revolutions of the averaged shaft in a revolution of that shaft.
    absolute
        Whether the first pulse is always at the same angle of the averaged shaft.
    source
        Source of the pulses, in words.
    notes
        Notes on the pulses.
    misfit
        Standard deviation of a pulse from the curve through its neighbours, in revolutions of the pulses' shaft.
    """

    pulses: FloatArray
    pulses_per_rev: int
    ratio: float
    absolute: bool
    source: str
    notes: tuple[Note, ...] = ()
    misfit: float = 0.0

    def revolutions(self, duration: float) -> int:
        """Return the whole revolutions of the averaged shaft between the first and last pulse of a record."""
        within = int(np.count_nonzero(self.pulses <= duration))
        return int((within - 1) / self.pulses_per_rev * self.ratio + 1e-9) if within else 0

    def speed_track(self) -> pd.DataFrame:
        """Return ``time`` (s) and ``speed_rpm`` of the averaged shaft for each revolution of the pulses' shaft."""
        t, k = self.pulses, self.pulses_per_rev
        start, stop = t[:-k], t[k:]
        return pd.DataFrame({"time": (start + stop) / 2, "speed_rpm": 60 * self.ratio / (stop - start)})


def mesh_angle(
    recording: "Recording",
    channel: "Channel",
    *,
    teeth: int,
    range_rpm: tuple[float, float],
    harmonic: int | None = None,
) -> ShaftAngle:
    """Return the angle from the phase of a mesh harmonic, about the speed that the spectrum of all channels gives.

    Parameters
    ----------
    recording
        The recording; its signals of the same rate and length take part in the search for the speed.
    channel
        Channel whose phase is used.
    teeth
        Tooth count of the gear on the averaged shaft.
    range_rpm
        Range in which the speed of the shaft lies.
    harmonic
        Mesh harmonic. The default is that of the first three whose pulses are most even from revolution to
        revolution. The shaft is equally uneven in all three; the noise of the phase adds to it.

    Raises
    ------
    InputError
        If there is no speed or no phase.
    """
    fs, size = channel.sampling_rate, len(channel.samples)
    others = [signal for signal in recording.signals if signal.name != channel.name]
    alike = [signal.samples for signal in others if signal.sampling_rate == fs and len(signal.samples) == size]
    track = find_speed(np.stack([channel.samples, *alike]), fs, teeth=teeth, range_rpm=range_rpm)
    speed = np.interp(np.arange(size) / fs, track.time, track.speed_rpm) / 60
    pulses, used = _pulses(channel, teeth, speed, range(1, HARMONICS + 1) if harmonic is None else (harmonic,))
    return ShaftAngle(
        pulses=pulses,
        pulses_per_rev=teeth,
        ratio=1.0,
        absolute=False,
        source=f"phase of mesh harmonic {used} of {channel.name}",
        notes=(*_speed_notes(track, range_rpm, len(alike) + 1), *_phase_notes(used, pulses, size / fs)),
    )


def _pulses(channel: "Channel", teeth: int, speed: FloatArray, harmonics: Sequence[int]) -> tuple[FloatArray, int]:
    """Return the most even tooth passes that a harmonic gives, and that harmonic."""
    candidates: list[tuple[float, FloatArray, int]] = []
    refusals: list[NotApplicableError] = []
    for harmonic in harmonics:
        try:
            x, fs = channel.samples, channel.sampling_rate
            pulses = mesh_pulses(x, fs, teeth=teeth, mesh_frequency=teeth * speed, harmonic=harmonic)
            candidates.append((_unevenness(pulses, teeth), pulses, harmonic))
        except NotApplicableError as error:
            refusals.append(error)
    if not candidates:
        raise refusals[0]
    _, best, used = min(candidates, key=lambda candidate: candidate[0])
    return best, used


def _unevenness(pulses: FloatArray, each: int) -> float:
    """Return the standard deviation of the change of a revolution's length, s; infinite for too few revolutions."""
    if len(pulses) <= 2 * each:
        return np.inf
    return float(np.std(pulses[2 * each :] - 2 * pulses[each:-each] + pulses[: -2 * each]))


def _speed_notes(track: SpeedTrack, range_rpm: tuple[float, float], channels: int) -> Iterator[Note]:
    low, high = range_rpm
    least, most = float(track.speed_rpm.min()), float(track.speed_rpm.max())
    yield Note(
        code="speed-from-spectrum",
        text=f"speed found in the spectrum of {channels} channel{'s' if channels > 1 else ''} between {low:g} and"
        f" {high:g} rpm: {least:.1f} to {most:.1f} rpm",
        values={"channels": channels, "low_rpm": low, "high_rpm": high, "least_rpm": least, "most_rpm": most},
    )
    if track.runner_up > _NEARLY_AS_LIKELY:
        yield Note(
            code=SPEED_DOUBT,
            text=f"the speed is not certain: {track.runner_up_rpm:.1f} rpm explains the spectrum nearly as well (score"
            f" {track.runner_up:.2f} of the best); give the speed",
            values={"other_rpm": track.runner_up_rpm, "score": track.runner_up},
        )


def _phase_notes(harmonic: int, pulses: FloatArray, duration: float) -> Iterator[Note]:
    covered = float(pulses[-1] - pulses[0])
    yield Note(
        code="mesh-phase",
        text=f"angle from the phase of mesh harmonic {harmonic}, in {covered:.3g} s of {duration:.3g} s: the phase is"
        " not known near the ends of the record, and does not follow changes of speed within a revolution",
        values={"harmonic": harmonic, "covered_s": covered, "duration_s": duration},
    )
    yield Note(
        code=RELATIVE_TEETH,
        text="tooth numbers are relative: without a tacho mark, tooth 1 is the tooth at the first pass of this"
        " recording",
    )
