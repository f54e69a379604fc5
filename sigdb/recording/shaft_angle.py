"""Angle of a shaft in a recording, from the pulses of its tacho or the phase of a mesh harmonic."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from sigdb.core import FloatArray, InputError, NotApplicableError, Note
from sigdb.recording.speed import HARMONICS, SpeedTrack, find_speed
from sigdb.signature import MeshPhase

if TYPE_CHECKING:
    from sigdb.recording.recording import Channel, Recording

SPEED_DOUBT = "speed-doubt"
"""Code of the note that another speed explains the spectrum nearly as well."""

PULSE_SHARE = "pulse_share"
"""Value of the note on a tacho: the share of the time in the state that begins at the edge that counts."""

RELATIVE_TEETH = "relative-teeth"
"""Code of the note that tooth numbers are relative."""

_OUTSIDE_NEAR, _OUTSIDE = 1.35, 1.6
"""Relative score of a speed beyond the range from which on that is taken for the true one: near the speed, and far."""
_NEAR_SIDEBANDS = 0.15
"""Relative distance within which a sideband of the mesh passes for the mesh."""
_MOST_AT_END = 0.75
"""Largest share of the record in which the speed may lie at an end of its range."""
_SLIP, _FEW_SLIPS, _MOST_SLIPS = 0.015, 0.01, 0.2
"""Relative difference of the phase's speed and the spectrum's, and the shares of the record that are noted, refused."""
_KEPT = 0.8
"""Least power of the average by a harmonic, relative to that by the best. Where a phase slips by a cycle during a share
f of the record, other harmonics keep about ``1 - 3 f (1 - f)``: a slip in a twelfth is seen."""
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
    track: SpeedTrack,
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
    track
        The speed by :func:`mesh_speed`.
    harmonic
        Mesh harmonic. The default is that of the first three whose pulses are most even from revolution to
        revolution. The shaft is equally uneven in all three; the noise of the phase adds to it. A harmonic whose phase
        slips by a cycle, so that the average keeps less of the record than by another one, is left out.

    Raises
    ------
    NotApplicableError
        If there is no phase.
    """
    harmonics = range(1, HARMONICS + 1) if harmonic is None else (harmonic,)
    pulses, used = _pulses(channel, teeth, track.time, track.speed_rpm, harmonics)
    return ShaftAngle(
        pulses=pulses,
        pulses_per_rev=teeth,
        ratio=1.0,
        absolute=False,
        source=f"phase of mesh harmonic {used} of {channel.name}",
        notes=(
            *_speed_notes(track, range_rpm, len(_alike(recording, channel))),
            *_phase_notes(used, pulses, channel.duration),
            *_slip_notes(pulses, teeth, track),
        ),
    )


def mesh_speed(recording: "Recording", channel: "Channel", *, teeth: int, range_rpm: tuple[float, float]) -> SpeedTrack:
    """Return the speed that the spectrum of all signals with the rate and length of a channel gives.

    Parameters
    ----------
    recording, channel, teeth, range_rpm
        As in :func:`mesh_angle`.

    Raises
    ------
    NotApplicableError
        If nothing stands out of their spectrum.
    """
    x = np.stack(_alike(recording, channel))
    return find_speed(x, channel.sampling_rate, teeth=teeth, range_rpm=range_rpm)


def _alike(recording: "Recording", channel: "Channel") -> list[FloatArray]:
    """Return the signals with the rate and length of a channel, in the order of the recording."""
    place = (channel.sampling_rate, channel.samples.size)
    named = {each.name: each.samples for each in (*recording.signals, channel)}
    return [
        samples for name, samples in named.items() if (recording.channel(name).sampling_rate, samples.size) == place
    ]


def constant_angle(recording: "Recording", channel: "Channel", *, speed_rpm: float | None) -> ShaftAngle:
    """Return the angle of a shaft that turns at a stated speed, from the first sample of a channel.

    Raises
    ------
    InputError
        If neither the settings nor the recording state a speed.
    """
    speed = recording.speed_rpm if speed_rpm is None else speed_rpm
    if speed is None:
        raise InputError(f"{recording.source}: constant_speed is set, but no speed is stated; give speed_rpm")
    return ShaftAngle(
        pulses=np.arange(int(channel.duration * speed / 60) + 1) * 60 / speed,
        pulses_per_rev=1,
        ratio=1.0,
        absolute=False,
        source=f"constant speed of {speed:.6g} rpm",
        notes=(
            Note(
                code="constant-speed",
                text=f"the speed of {speed:.6g} rpm was taken as stated: if it is wrong or not constant by one part in "
                "the number of tooth passes, the average is smeared",
                values={"speed_rpm": speed},
            ),
            Note(code=RELATIVE_TEETH, text="tooth numbers are relative: there is no tacho mark"),
        ),
    )


def mesh_angle_at(angle: ShaftAngle, channel: "Channel", *, teeth: int, relative: float) -> ShaftAngle:
    """Return the angle from the phase of a mesh harmonic about another speed, relative to that of an angle.

    Raises
    ------
    NotApplicableError
        If the phase cannot be followed there.
    """
    track = angle.speed_track()
    speed = relative * track["speed_rpm"].to_numpy()
    pulses, used = _pulses(channel, teeth, track["time"].to_numpy(), speed, range(1, HARMONICS + 1))
    return replace(angle, pulses=pulses, source=f"phase of mesh harmonic {used} of {channel.name}")


def refuse_lost_mesh(source: str, angle: ShaftAngle, track: SpeedTrack, *, range_rpm: tuple[float, float]) -> None:
    """Refuse an angle by the phase of a mesh that is not the gear's, where the gear is not to be seen.

    Raises
    ------
    NotApplicableError
        If the speed lies at an end of its range or stands out far less than one beyond the range, or if the phase does
        not follow it.
    """
    low, high = range_rpm
    likeliest = float(np.median(track.speed_rpm))
    near = abs(track.outside_rpm / likeliest - 1) < _NEAR_SIDEBANDS
    if track.outside > (_OUTSIDE_NEAR if near else _OUTSIDE):
        raise NotApplicableError(
            f"{source}: no speed is found from {low:g} to {high:g} rpm: the likeliest, {likeliest:.1f} rpm, stands out"
            f" less than {track.outside_rpm:.1f} rpm beyond the range (whose score is {track.outside:.1f} times as"
            " large); give the right speed, or a tacho if two such gears turn"
        )
    if track.at_end > _MOST_AT_END:
        raise NotApplicableError(
            f"{source}: no speed is found from {low:g} to {high:g} rpm: during {track.at_end:.0%} of the record the"
            " likeliest lies at an end of the range; give a range with the speed well inside"
        )
    share, first = _slips(angle.pulses, angle.pulses_per_rev, track)
    if share > _MOST_SLIPS:
        raise NotApplicableError(
            f"{source}: the phase of the mesh does not follow its speed during {share:.0%} of the record, first at"
            f" {first:.4g} s; take another harmonic or channel, or a tacho"
        )


def _pulses(
    channel: "Channel", teeth: int, time: FloatArray, speed_rpm: FloatArray, harmonics: Sequence[int]
) -> tuple[FloatArray, int]:
    """Return the most even tooth passes of the harmonics whose phase does not slip, and that harmonic."""
    x, fs = channel.samples, channel.sampling_rate
    phase = MeshPhase(x, fs, teeth=teeth, mesh_frequency=teeth * speed_rpm / 60, times=time)
    candidates: list[tuple[FloatArray, int]] = []
    refusals: list[NotApplicableError] = []
    for harmonic in harmonics:
        try:
            candidates.append((phase.pulses(harmonic), harmonic))
        except NotApplicableError as error:
            refusals.append(error)
    if not candidates:
        raise refusals[0]
    candidates.sort(key=lambda candidate: _unevenness(candidate[0], teeth))
    most, kept = 1.0, []
    for candidate in candidates:
        kept.append(_kept(x, fs, candidate[0], teeth) if len(candidates) > 1 else most)
        if kept[-1] >= _KEPT * most:  # no other one keeps more than all
            return candidate
    return next(each for each, share in zip(candidates, kept, strict=True) if share >= _KEPT * max(kept))


def _kept(x: FloatArray, fs: float, pulses: FloatArray, each: int) -> float:
    """Return the share of a record's power that its average over the revolutions keeps; 0 for too few revolutions."""
    from sigdb.recording.evidence.kept_power import kept_power

    revolutions = (len(pulses) - 1) // each
    if revolutions < 2:
        return 0.0
    n = round(fs * (pulses[revolutions * each] - pulses[0]) / revolutions)
    kept, power = kept_power(x, float(x.mean()), pulses * fs, each, revolutions, n)
    return float(kept / max(power, np.finfo(float).tiny))


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
    if track.outside > _OUTSIDE_NEAR:
        yield Note(
            code=SPEED_DOUBT,
            text=f"the speed is not certain: {track.outside_rpm:.1f} rpm, beyond the range, stands out more (score"
            f" {track.outside:.2f} of the best within), which may be another mesh",
            values={"other_rpm": track.outside_rpm, "score": track.outside},
        )
    elif track.runner_up > _NEARLY_AS_LIKELY:
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


def _slips(pulses: FloatArray, teeth: int, track: SpeedTrack) -> tuple[float, float]:
    """Return the share of a record in which the phase turns at another speed than the spectrum shows; when first, s."""
    if len(pulses) <= teeth:
        return 0.0, np.nan
    time = (pulses[:-teeth] + pulses[teeth:]) / 2
    speed = 60 / (pulses[teeth:] - pulses[:-teeth])
    off = np.abs(speed / np.interp(time, track.time, track.speed_rpm) - 1) > _SLIP
    return float(np.mean(off)), float(time[np.argmax(off)])


def _slip_notes(pulses: FloatArray, teeth: int, track: SpeedTrack) -> Iterator[Note]:
    share, first = _slips(pulses, teeth, track)
    if share > _FEW_SLIPS:
        yield Note(
            code="mesh-phase-slips",
            text=f"the phase of the mesh does not follow its speed during {share:.1%} of the record, first at"
            f" {first:.4g} s: there the average is smeared",
            values={"share": share, "first_s": first},
        )
