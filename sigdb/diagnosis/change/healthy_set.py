"""Healthy recordings of one machine as the reference of another recording: interpolated in load and speed."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sigdb.core import FloatArray, Note
from sigdb.diagnosis.change.average_spectrum import AverageSpectrum
from sigdb.diagnosis.change.change import change_from, turn_between
from sigdb.recording import RecordedSignature

_SAME_SPEED = 0.02
"""Relative difference of speeds above which the speed counts as another one."""

_BEYOND = 0.05
"""Distance from the range of the healthy recordings, relative to its end, from which a run lies outside."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Healthy:
    """A healthy recording.

    Attributes
    ----------
    signature
        Its signature.
    spectrum
        Its spectrum, turned to that of the first recording.
    torque
        Torque, N m, or load in any one unit; None if it is unknown.
    """

    signature: RecordedSignature
    spectrum: AverageSpectrum
    torque: float | None


@dataclass(frozen=True, kw_only=True, eq=False)
class HealthySet:
    """Healthy recordings of one machine by one channel.

    Attributes
    ----------
    recordings
        The recordings.
    absolute
        Whether all begin at the tacho mark.
    """

    recordings: tuple[Healthy, ...]
    absolute: bool

    @classmethod
    def of(cls, signatures: Sequence[RecordedSignature], torques: Sequence[float | None]) -> "HealthySet":
        """Return the set of healthy signatures, with averages turned to begin at the same tooth."""
        absolute = all(signature.absolute for signature in signatures)
        first = AverageSpectrum.of(signatures[0])
        results = [Healthy(signature=signatures[0], spectrum=first, torque=torques[0])]
        for signature, torque in zip(signatures[1:], torques[1:], strict=True):
            spectrum = AverageSpectrum.of(signature)
            turn = turn_between(first, spectrum, absolute=absolute)
            results.append(Healthy(signature=signature, spectrum=spectrum.turned(turn), torque=torque))
        return cls(recordings=tuple(results), absolute=absolute)

    def __len__(self) -> int:
        return len(self.recordings)

    def without(self, number: int) -> "HealthySet":
        """Return the set without one recording."""
        rest = tuple(each for i, each in enumerate(self.recordings) if i != number)
        return replace(self, recordings=rest)

    def reference(
        self, run: AverageSpectrum, *, speed_rpm: float, torque: float | None
    ) -> tuple[AverageSpectrum, float, tuple[Note, ...]]:
        """Return the healthy spectrum at the speed and torque of a run, its turn to the run, and notes.

        Where the torques are known, or the speeds differ, the reference is a weighted mean of the recordings. The
        weights w sum to 1 and reproduce what is linear in torque and speed; of these, the sum of (w d)^2 is least, with
        the distance d of a recording from the run. Where nothing is known, the recording that fits best is taken.
        """
        if len(self) == 1:
            spectrum = self.recordings[0].spectrum
            return spectrum, turn_between(run, spectrum, absolute=self.absolute), ()
        place, places, notes = self._coordinates(speed_rpm, torque)
        if places.shape[1]:
            spectrum = _mean([each.spectrum for each in self.recordings], _weights(places, place))
            return spectrum, turn_between(run, spectrum, absolute=self.absolute), notes
        results = []
        for each in self.recordings:
            turn = turn_between(run, each.spectrum, absolute=self.absolute)
            results.append((change_from(run, each.spectrum, turn=turn).misfit, turn, each))
        _, turn, best = min(results, key=lambda item: item[0])
        text = (
            f"The torques are not given: of {len(self)} healthy recordings {best.signature.source} was compared, which "
            "fits best."
        )
        return best.spectrum, turn, (Note(code="healthy-by-fit", text=text, values={"healthy": best.signature.source}),)

    def _coordinates(self, speed_rpm: float, torque: float | None) -> tuple[FloatArray, FloatArray, tuple[Note, ...]]:
        """Return the run's place (c,) and those of the recordings (m, c), 0 to 1 over their range, and notes."""
        columns = []
        if torque is not None and all(each.torque is not None for each in self.recordings):
            columns.append(("torque", "N m", torque, np.array([each.torque for each in self.recordings], float)))
        speeds = np.array([each.signature.speed_rpm for each in self.recordings])
        columns.append(("speed", "rpm", speed_rpm, speeds))
        place, places, notes = [], [], []
        for name, unit, value, values in columns:
            low, high = float(values.min()), float(values.max())
            if name == "speed" and high - low <= _SAME_SPEED * high:
                continue
            if high <= low:
                continue
            if not low - _BEYOND * abs(low) <= value <= high + _BEYOND * abs(high):
                text = (
                    f"The {name} of {value:.5g} {unit} lies outside the healthy recordings' range of {low:.5g} to "
                    f"{high:.5g} {unit}: the reference at its end was taken, and another {name} may look like a change."
                )
                notes.append(
                    Note(code=f"{name}-outside-healthy", text=text, values={"run": value, "low": low, "high": high})
                )
            place.append((min(max(value, low), high) - low) / (high - low))
            places.append((values - low) / (high - low))
        return np.array(place), np.array(places).reshape(len(place), len(self)).T, tuple(notes)


def _weights(places: FloatArray, place: FloatArray) -> FloatArray:
    """Return weights (m,) that sum to 1 and reproduce linear functions of the coordinates where they can."""
    far = 0.05 + np.linalg.norm(places - place, axis=1)
    A = np.vstack([np.ones(len(places)), (places - place).T])
    wanted = np.zeros(len(A))
    wanted[0] = 1.0
    scaled = A / far
    w = np.linalg.pinv(scaled, rcond=1e-6) @ wanted / far
    return np.asarray(w / w.sum())


def _mean(spectra: Sequence[AverageSpectrum], weights: FloatArray) -> AverageSpectrum:
    """Return the weighted mean of spectra."""
    G = min(len(spectrum.groups) for spectrum in spectra)
    return replace(
        spectra[0],
        groups=sum(w * each.groups[:G] for w, each in zip(weights, spectra, strict=True)),
        spread=sum(w**2 * each.spread for w, each in zip(weights, spectra, strict=True)),
        highest_order=min(each.highest_order for each in spectra),
    )
