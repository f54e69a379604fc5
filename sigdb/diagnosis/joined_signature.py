"""Several recordings of a machine in one state as one signature, of the revolutions of all."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
import pandas as pd

from sigdb.core import FloatArray, InputError, Note
from sigdb.diagnosis.alike import make_alike, notes_of
from sigdb.diagnosis.change.average_spectrum import AverageSpectrum
from sigdb.diagnosis.change.change import turn_between
from sigdb.diagnosis.diagnose_signature import absent_gears
from sigdb.diagnosis.stored_reference import Healthy
from sigdb.recording import (
    AveragingSettings,
    NoMeshError,
    RecordedSignature,
    Recording,
    RecordingBlocks,
    recorded_signature,
)
from sigdb.signature import order_spectrum
from sigdb.transmission import Transmission

SAME_SPEED, SAME_LOAD = 0.02, 0.05
"""Relative differences of speeds and of loads up to which averages are joined, as for templates of a reference."""


def joined_signature(signatures: Sequence[RecordedSignature]) -> RecordedSignature:
    """Return one signature of several recordings by one channel at one operating point.

    The averages are turned to the first, as healthy recordings are, and each counts with its revolutions. Noise of
    different recordings is independent, so that the average of R revolutions in all has a variance of 1 / R of that of
    one. Spectra of the record, indicators and what repeats are those of the first recording.

    Parameters
    ----------
    signatures
        Signatures of one gear.

    Raises
    ------
    InputError
        If they differ in channel, tooth count, samples or quantity, in speed by more than 2 %, or are one recording.
    """
    first, *others = signatures
    if not others:
        return first
    for each in others:
        _check_alike(first, each)
    pairs = [make_alike(first, each) for each in others]
    absolute = all(pair.signature.absolute and pair.healthy.absolute for pair in pairs)
    spectrum = AverageSpectrum.of(first)
    turns = [turn_between(spectrum, AverageSpectrum.of(pair.healthy), absolute=absolute) for pair in pairs]
    every = [first, *(pair.healthy for pair in pairs)]
    revolutions = np.array([each.averages for each in every], float)
    share = revolutions / revolutions.sum()
    turned = [_turned(each, turn) for each, turn in zip(every, (0.0, *turns), strict=True)]
    tsa = np.asarray(share @ np.array([average for average, _ in turned]))
    order, amplitude = order_spectrum(tsa)
    notes = {note.text: note for each in every for note in each.notes}
    notes |= {note.text: note for note in notes_of(pairs)}
    joined = Note(
        code="joined-recordings",
        text=f"{len(every)} recordings are joined into one average of {int(revolutions.sum())} revolutions; spectra of "
        "the record and indicators are those of the first.",
        values={"recordings": len(every), "revolutions": int(revolutions.sum())},
    )
    return replace(
        first,
        source=", ".join(each.source for each in every),
        absolute=absolute,
        tsa=tsa,
        scatter=float(np.sqrt(share @ [each.scatter**2 for each in every])),
        noise=np.sqrt(share**2 @ np.array([each.noise**2 for each in every])),
        groups=np.concatenate([groups for _, groups in turned]),
        averages=int(revolutions.sum()),
        dropped=sum(each.dropped for each in every),
        speed_rpm=float(share @ [each.speed_rpm for each in every]),
        highest_order=min(each.highest_order for each in every),
        order_spectrum=pd.DataFrame({"order": order, "amplitude": np.abs(amplitude)}),
        notes=(joined, *notes.values()),
    )


def joined_load(loads: Sequence[float | None], name: str) -> float | None:
    """Return the load of recordings that are joined, or their torque; None where it is not known of all.

    Raises
    ------
    InputError
        If they differ by more than 5 %.
    """
    stated = [load for load in loads if load is not None]
    if len(stated) < len(loads):
        return None
    if max(stated) - min(stated) > SAME_LOAD * max(abs(load) for load in stated):
        raise InputError(
            f"{name} of the recordings is {min(stated):g} to {max(stated):g}; recordings are joined at one load, "
            f"within {100 * SAME_LOAD:g} %; diagnose the others alone"
        )
    return float(np.mean(stated))


def _check_alike(first: RecordedSignature, other: RecordedSignature) -> None:
    if first.channel != other.channel:
        raise InputError(
            f"{other.source} is of the channel {other.channel!r}, {first.source} of {first.channel!r}; recordings are "
            "joined by one channel"
        )
    if abs(other.speed_rpm - first.speed_rpm) > SAME_SPEED * first.speed_rpm:
        raise InputError(
            f"{other.source} runs at {other.speed_rpm:.5g} rpm, {first.source} at {first.speed_rpm:.5g} rpm; "
            f"recordings are joined at one speed, within {100 * SAME_SPEED:g} %; diagnose the others alone"
        )


def _turned(signature: RecordedSignature, turn: float) -> tuple[FloatArray, FloatArray]:
    """Return average (n,) and groups (G, n) that begin later by a part of a revolution."""
    rows = np.vstack([signature.tsa, signature.groups])
    n = rows.shape[1]
    turned = np.fft.irfft(np.fft.rfft(rows, axis=1) * np.exp(2j * np.pi * turn * np.arange(n // 2 + 1)), n, axis=1)
    return turned[0], turned[1:]


@dataclass(frozen=True, kw_only=True, eq=False)
class Candidate:
    """A recording by its signature, or by the reason why no mesh could be followed, with its torque and load."""

    result: RecordedSignature | NoMeshError
    torque: float | None
    load: float | None

    @classmethod
    def of(cls, recording: Recording | RecordingBlocks, settings: AveragingSettings, rig: Transmission | None) -> Self:
        """Return a recording by its average."""
        try:
            result: RecordedSignature | NoMeshError = recorded_signature(recording, settings, rig=rig)
        except NoMeshError as error:
            result = error
        return cls(result=result, torque=recording.torque, load=recording.load)

    def as_healthy(self) -> Healthy:
        """Return the recording as a reference stores it."""
        if isinstance(self.result, NoMeshError):
            raise self.result
        return Healthy(signature=self.result, torque=self.torque, load=self.load)


def joined_candidate(runs: Sequence[Candidate], *, torque: float | None, load: float | None) -> Candidate:
    """Return several recordings, joined; or the first one in which the gear is not to be seen.

    Parameters
    ----------
    runs
        The recordings.
    torque, load
        Torque and load of all of them where they are stated as options.
    """
    if len(runs) == 1:
        return runs[0]
    reasons = absent_gears({str(number): each.result for number, each in enumerate(runs)})
    if reasons:
        return runs[int(next(iter(reasons)))]
    return Candidate(
        result=joined_signature([each.result for each in runs if isinstance(each.result, RecordedSignature)]),
        torque=joined_load([each.torque for each in runs], "torque") if torque is None else torque,
        load=joined_load([each.load for each in runs], "load") if load is None else load,
    )
