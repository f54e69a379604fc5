"""Two recordings as a pair: the same unit, the same band of orders, the same tacho mark."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from sigdb.core import FloatArray, InputError, Note
from sigdb.diagnosis.change.average_spectrum import LEAST_GROUPS, AverageSpectrum
from sigdb.diagnosis.change.change import USED, turn_between
from sigdb.diagnosis.change.statistics import left_by_damage
from sigdb.recording import PULSE_SHARE, RecordedSignature, in_unit_of

BANDS_DIFFER = "bands-differ"
"""Code of the note that one of the recordings reaches to higher orders."""

MARKS_DISAGREE = "marks-disagree"
"""Code of the note that the tacho marks of the two recordings do not stand for the same angle."""

MARKS_UNVERIFIED = "marks-unverified"
"""Code of the note that the recordings do not show whether their marks stand for the same angle."""

_ABOVE_NOISE = 4.0
"""Amplitude of an order, in standard deviations of its noise, above which its phase counts."""
_LEAST_ALIKE, _LESS_ALIKE = 0.6, 0.5
"""Least share of the orders that agree after the turn, and the share of that number that may agree without it."""
_BEYOND_CHANCE = 1.5
"""Ratio of the agreement after a turn to the greatest agreement of random phases."""
_NO_CHANCE = 3.0
"""Agreement without a turn that shows the marks to agree, in standard deviations of that of random phases."""
_MIRRORED = 0.1
"""Difference from one, and from each other, of the shares of two pulses from which on one is the other inverted."""
_SAME_BAND = 0.02
"""Relative difference of the highest orders below which they are one band."""


@dataclass(frozen=True, kw_only=True)
class Pair:
    """A recording and its healthy recording, made alike.

    Attributes
    ----------
    signature, healthy
        The signatures, in one unit. Neither is absolute where the marks do not agree.
    notes
        Notes on what was changed and on what differs.
    """

    signature: RecordedSignature
    healthy: RecordedSignature
    notes: tuple[Note, ...]


def make_alike(signature: RecordedSignature, healthy: RecordedSignature) -> Pair:
    """Return two signatures as a pair that can be compared.

    Raises
    ------
    InputError
        If they differ in quantity or tooth count, or hold the same samples.
    """
    _check_pair(signature, healthy)
    healthy, units = in_unit_of(healthy, signature)
    band = _band_note(signature, healthy)
    marks = _marks_note(signature, healthy) if signature.absolute and healthy.absolute else ()
    if any(note.code == MARKS_DISAGREE for note in marks):
        signature, healthy = (replace(each, absolute=False) for each in (signature, healthy))
    return Pair(signature=signature, healthy=healthy, notes=(*units, *_channel_note(signature, healthy), *band, *marks))


def _marks_note(signature: RecordedSignature, healthy: RecordedSignature) -> tuple[Note, ...]:
    """Return a note if the tacho marks of two recordings do not agree, or if nothing shows that they do."""
    phases = _Phases(signature, healthy)
    turn = phases.turn()
    relative = "The tacho's polarity, edge or position differs, so tooth numbers are relative."
    if turn and not _damage_explains(signature, healthy, turn):
        teeth = turn * signature.teeth
        text = (
            f"The tacho marks of the two recordings do not agree: they fit best when the healthy average is turned by "
            f"{360 * turn:.1f} deg, {teeth:.1f} teeth. {relative}"
        )
        return (Note(code=MARKS_DISAGREE, text=text, values={"turn_deg": 360 * turn, "teeth": teeth}),)
    if turn or phases.agree():
        return ()
    share, other = _pulse_share(signature), _pulse_share(healthy)
    if share is not None and other is not None and abs(share + other - 1) < _MIRRORED < abs(share - other):
        text = (
            f"The tacho marks of the two recordings do not agree: a pulse takes {share:.0%} of the time in the "
            f"recording and {other:.0%} in the healthy one, as if one of them were inverted. {relative}"
        )
        return (Note(code=MARKS_DISAGREE, text=text, values={"recording": share, "healthy": other}),)
    text = (
        "The recordings do not show whether their tacho marks stand for the same angle, since hardly anything but mesh "
        "harmonics stands out of both: the tooth number holds if polarity, edge and position of the tacho are the same."
    )
    return (Note(code=MARKS_UNVERIFIED, text=text),)


def _damage_explains(signature: RecordedSignature, healthy: RecordedSignature, turn: float) -> bool:
    """Return whether one damaged tooth explains the difference by the marks as well as after the turn.

    Severe damage may turn the phases of all orders: it looks like the greatest error of a healthy tooth at another
    place.
    """
    if min(len(signature.groups), len(healthy.groups)) < LEAST_GROUPS:
        return False
    run, reference = AverageSpectrum.of(signature), AverageSpectrum.of(healthy)
    by_marks = turn_between(run, reference, absolute=True)
    return left_by_damage(run, reference, turn=by_marks) <= left_by_damage(run, reference, turn=-turn)


def _pulse_share(signature: RecordedSignature) -> float | None:
    """Return the share of the time that the pulses of the tacho take; None if it is unknown."""
    shares = [note.values[PULSE_SHARE] for note in signature.notes if PULSE_SHARE in note.values]
    return float(shares[0]) if shares else None


def _check_pair(signature: RecordedSignature, healthy: RecordedSignature) -> None:
    sources = f"{signature.source} and the healthy recording {healthy.source}"
    if signature.teeth != healthy.teeth or len(signature.tsa) != len(healthy.tsa):
        raise InputError(
            f"{sources} differ in their tooth count or samples a tooth: {signature.teeth} teeth and "
            f"{len(signature.tsa)} samples, {healthy.teeth} teeth and {len(healthy.tsa)} samples; average them alike"
        )
    if np.array_equal(signature.tsa, healthy.tsa):
        raise InputError(
            f"{sources} hold the same samples: a recording compared with itself shows no damage; give another one"
        )


def notes_of(pairs: Sequence[Pair]) -> tuple[Note, ...]:
    """Return the notes of several pairs, each once; of the bands, that with the fewest orders, which are compared."""
    notes = {note.text: note for pair in pairs for note in pair.notes}
    bands = [note for note in notes.values() if note.code == BANDS_DIFFER]
    least = min(bands, key=lambda note: note.values["compared"], default=None)
    return tuple(note for note in notes.values() if note.code != BANDS_DIFFER or note is least)


def _channel_note(signature: RecordedSignature, healthy: RecordedSignature) -> Iterator[Note]:
    if signature.channel != healthy.channel:
        text = (
            f"The recording is of channel {signature.channel}, the healthy one of {healthy.channel}: the path from the "
            "mesh is the same only if both are one sensor in one place."
        )
        values = {"recording": signature.channel, "healthy": healthy.channel}
        yield Note(code="channels-differ", text=text, values=values)


def _band_note(signature: RecordedSignature, healthy: RecordedSignature) -> tuple[Note, ...]:
    """Return a note if one of the recordings reaches to higher orders, which are then not compared."""
    low, high = sorted((signature.highest_order, healthy.highest_order))
    highest = USED * low
    if high - low <= _SAME_BAND * high or highest >= len(signature.tsa) / 2:
        return ()
    text = (
        f"The recording reaches to order {signature.highest_order:.1f}, the healthy one to "
        f"{healthy.highest_order:.1f}, by their sampling rates and speeds: they are compared up to order {highest:.1f}."
    )
    values = {"recording": signature.highest_order, "healthy": healthy.highest_order, "compared": highest}
    return (Note(code=BANDS_DIFFER, text=text, values=values),)


class _Phases:
    """Agreement of the phases of two averages, by the turn of the second.

    Let X and Y be the spectra of the averages at the K orders that stand out of the noise in both. The agreement after
    a turn by u revolutions is ``c(u) = Re sum_k X_k Y_k^* exp(2 pi j k u) / |X_k Y_k|``, the generalised cross
    correlation with phase transform of Knapp and Carter, IEEE Transactions on Acoustics, Speech, and Signal Processing
    24(4), 1976, doi:10.1109/TASSP.1976.1162830. It is at most K. For random phases its standard deviation at one angle
    is ``sqrt(K / 2)``, and its maximum over n angles is hardly above ``sqrt(K ln n)``.
    """

    def __init__(self, signature: RecordedSignature, healthy: RecordedSignature) -> None:
        n, Z = len(signature.tsa), signature.teeth
        X, Y = np.fft.rfft(signature.tsa), np.fft.rfft(healthy.tsa)
        orders = np.arange(len(X))
        held = orders <= USED * min(signature.highest_order, healthy.highest_order)
        used = held & (orders > 0) & _audible(X, signature.noise, n) & _audible(Y, healthy.noise, n)
        cross = np.where(used, X * np.conj(Y), 0)
        self._cross = np.divide(cross, np.abs(cross), out=np.zeros_like(cross), where=used)
        self._orders, self._n, self._teeth = orders, n, Z
        self._turns = (np.arange(n) / n + 0.5) % 1 - 0.5

    def turn(self) -> float:
        """Return the turn of the healthy average that makes it agree with the other, in revolutions; 0 if none does.

        A turn is returned where c reaches 0.6 K and 1.5 times the maximum for random phases, and stays below half of
        its maximum within half a tooth of 0.
        """
        K = np.count_nonzero(self._cross)
        agreement = self._agreement(self._cross)
        best = int(np.argmax(agreement))
        unturned = agreement[np.abs(self._turns) <= 0.5 / self._teeth].max()
        least = max(_LEAST_ALIKE * K, _BEYOND_CHANCE * np.sqrt(K * np.log(self._n)))
        if K < 2 or agreement[best] < least or unturned > _LESS_ALIKE * agreement[best]:
            return 0.0
        return float(self._turns[best])

    def agree(self) -> bool:
        """Return whether the orders that are no mesh harmonics agree without a turn; mesh harmonics do at any tooth."""
        cross = np.where(self._orders % self._teeth > 0, self._cross, 0)
        near = np.abs(self._turns) <= 0.25 / self._teeth
        K = np.count_nonzero(cross)
        return bool(K and self._agreement(cross)[near].max() >= _NO_CHANCE * np.sqrt(K / 2))

    def _agreement(self, cross: np.ndarray) -> FloatArray:
        return np.asarray(np.fft.irfft(cross, self._n) * self._n / 2)


def _audible(X: np.ndarray, noise: FloatArray, n: int) -> np.ndarray:
    return np.asarray(np.abs(X) > _ABOVE_NOISE * np.broadcast_to(noise, X.shape) * np.sqrt(n / 2))
