"""Repeatability of a recording without its mesh: whether one event stands at one place of a gear's turn."""

import math
from dataclasses import dataclass

import numpy as np

from sigdb.core import Answer, BoolArray, ComplexArray, FloatArray, Kind
from sigdb.recording.evidence.least_event import PROBABILITY, least_event
from sigdb.recording.evidence.presence import MeshPresence
from sigdb.recording.evidence.residual_bands import MOST_BANDS, PLACES, SIDEBANDS, ResidualBands, passes_apart

FALSE_ALARM_RATE, LIMIT, HEALTHY_GEARS = 1e-3, 21.7, 14_997
"""Counted by ``benchmarks/repeatability.py``: the limit that a share of the healthy gears of each kind exceeds at most.

The numbers are in ``docs/guide/repeatability.json``; a third of the gears is of each of three kinds.
"""
SAME_PLACE, ODD_EVEN, POWER_RATIO = 0.632, 0.996, 159.0
"""Quantiles 0.95 of what repeats of healthy gears with pitch errors, counted there too: share of the revolutions whose
strongest pulse lies at the same place, correlation of odd and even revolutions, and power ratio."""
_LEAST_TEETH, _LEAST_REVOLUTIONS = 10, 8
"""Fewest teeth and revolutions for which the healthy gears were counted."""
_SAME = 1.0
"""Tooth passes within which two places are the same."""
_OTHER_TEETH = (-2, -1, 1, 2)
"""Tooth counts, relative to the gear's, of the shafts for which the record is averaged too."""
_MOST_SAMPLES = 2**20
"""Largest number of samples that are averaged for other tooth counts."""
_CHUNK = 64
"""Revolutions that are transformed at once."""


@dataclass(frozen=True, kw_only=True)
class Repeatability:
    """Answer to the question whether one event stands at one place of a gear's turn, without a healthy recording.

    The residual of the average is what lies between the mesh harmonics and their first two sidebands. Pitch errors of
    ordinary gears repeat as well, so the size of the event decides, against gears of the classes 5 to 9 of ISO 1328-1.

    Attributes
    ----------
    kind
        ``one event``, ``nothing stands out``, or ``cannot be judged``.
    answer
        The same as a sentence.
    energy_ratio, limit
        Greatest energy of a pulse of the average's residual over that of the other teeth, and the value above which it
        is an event.
    false_alarm_rate, healthy_gears
        Share of the simulated healthy gears of each kind above the limit at most, and the number of all these gears.
    place, width
        Place of that pulse in tooth passes after the begin of the revolution, 0 to Z, and its width, tooth passes.
    revolutions
        Revolutions R of the record.
    same_place, same_place_by_chance, same_place_by_pitch_errors
        Revolutions whose strongest pulse lies within a tooth pass of that place, how many noise alone gives, and how
        many at most 95 % of healthy gears with pitch errors give.
    halves_agree
        Whether the strongest pulses of the odd, even, first and last revolutions lie within a tooth pass of the place.
    odd_even_correlation, odd_even_by_noise, odd_even_by_pitch_errors
        Correlation of the residuals of odd and even revolutions, the standard deviation that noise alone gives, and
        the most that 95 % of healthy gears with pitch errors give.
    power_ratio, power_ratio_by_noise, power_ratio_by_pitch_errors
        Share of the residual's power that the average keeps, over the mean of the same shares for averages of Z - 2,
        Z - 1, Z + 1 and Z + 2 tooth passes. The others are its value for noise alone, and the most that 95 % of healthy
        gears give.
    least_event
        rms of the smallest short pulse, over the rms of the average, that would have been seen with a probability of
        0.95 if added to the record; nan where one of the whole rms would not have been seen, and where a pulse stands
        out. A damaged tooth is no short pulse: its response rings on, and needs twice that rms in the median, and much
        more in some rigs.
    """

    kind: Kind
    answer: str
    revolutions: int
    energy_ratio: float = math.nan
    limit: float = LIMIT
    false_alarm_rate: float = FALSE_ALARM_RATE
    healthy_gears: int = HEALTHY_GEARS
    place: float = math.nan
    width: float = math.nan
    same_place: int = 0
    same_place_by_chance: float = math.nan
    same_place_by_pitch_errors: float = math.nan
    halves_agree: bool = False
    odd_even_correlation: float = math.nan
    odd_even_by_noise: float = math.nan
    odd_even_by_pitch_errors: float = ODD_EVEN
    power_ratio: float = math.nan
    power_ratio_by_noise: float = 1.0
    power_ratio_by_pitch_errors: float = POWER_RATIO
    least_event: float = math.nan


def repeatability(
    x: FloatArray, *, samples_per_rev: int, teeth: int, highest: float, presence: MeshPresence
) -> Repeatability:
    """Return whether one event stands out at one place of a gear's turn, of what healthy gears show.

    The residual is whitened by its own level about each order, and the energy of short pulses is computed over the
    turn in each mesh band. An event needs a ratio above the limit, at the same place in the averages of the odd, even,
    first and last revolutions, and more power in the average of the gear's turn than in those of other lengths.

    Parameters
    ----------
    x : ndarray
        (R * samples_per_rev,) record in equal steps of angle.
    samples_per_rev : int
        Samples of a revolution, a multiple of ``teeth``.
    teeth : int
        Tooth count Z.
    highest : float
        Highest order of the record.
    presence : MeshPresence
        Whether the gear is to be seen in the record.

    Returns
    -------
    Repeatability

    Examples
    --------
    >>> from sigdb.recording.evidence.presence import mesh_presence
    >>> passes, stream = np.arange(50 * 20 * 32) / 32, np.random.default_rng(0)
    >>> mesh = sum(np.cos(2 * np.pi * h * passes) for h in (1, 2, 3))
    >>> errors = (1 + 0.1 * stream.standard_normal(20))[passes.astype(int) % 20]
    >>> gear = errors * mesh + 0.5 * stream.standard_normal(passes.size)
    >>> event = 4 * np.exp(-(((passes % 20 - 7.5) / 0.12) ** 2))
    >>> options = {"samples_per_rev": 640, "teeth": 20, "highest": 100.0}
    >>> for record in (gear, gear + event):
    ...     presence = mesh_presence(record, **options)
    ...     repeatability(record, **options, presence=presence).kind
    'nothing stands out'
    'one event'
    """
    n, Z = samples_per_rev, teeth
    turns = x.reshape(-1, n)
    R = len(turns)
    if doubt := _doubt(presence, Z, R):
        return _unjudged(doubt, R)
    spectra = _spectra(turns, most=(MOST_BANDS + 1) * Z)
    bands = ResidualBands.of(spectra, teeth=Z, highest=highest)
    if bands is None:
        return _unjudged(f"up to order {highest:.0f} the record holds no band about a mesh harmonic", R)
    average = spectra.mean(axis=0)
    pulse = bands.pulses(average[bands.orders])
    energy_ratio, place, width = (float(value) for value in (pulse.ratio, pulse.place, pulse.width))
    halves = np.stack([spectra[half].mean(axis=0) for half in _halves(R)])
    same, agree = (passes_apart(_places(bands, some, average, width), place, Z) <= _SAME for some in (spectra, halves))
    ratio = _power_ratio(x, n, Z, bands)
    least = math.nan if energy_ratio > LIMIT else least_event(bands, average, LIMIT)
    answer = _answer(energy_ratio, same, agree=bool(agree.all()), power_ratio=ratio, least=least)
    return Repeatability(
        kind=answer.kind,
        answer=answer.sentence,
        revolutions=R,
        energy_ratio=energy_ratio,
        place=place,
        width=width,
        same_place=int(same.sum()),
        same_place_by_chance=R * float(np.mean(bands.distance(0.0) <= _SAME)),
        same_place_by_pitch_errors=R * SAME_PLACE,
        halves_agree=bool(agree.all()),
        odd_even_correlation=_odd_even_correlation(bands, halves[:2], average),
        odd_even_by_noise=1 / math.sqrt(2 * bands.orders.size),
        power_ratio=ratio,
        least_event=least,
    )


def _doubt(presence: MeshPresence, teeth: int, revolutions: int) -> str:
    """Return why there is no answer; empty if there is one."""
    if not presence.present:
        return presence.reason
    if revolutions < _LEAST_REVOLUTIONS:
        return f"{revolutions} revolutions are fewer than {_LEAST_REVOLUTIONS}; record longer"
    if teeth < _LEAST_TEETH:
        return f"{teeth} teeth are fewer than {_LEAST_TEETH}, the fewest for which healthy gears were counted"
    return ""


def _unjudged(reason: str, revolutions: int) -> Repeatability:
    answer = Answer.of("cannot be judged", reason=reason)
    return Repeatability(kind=answer.kind, answer=answer.sentence, revolutions=revolutions)


def _answer(energy_ratio: float, same: BoolArray, *, agree: bool, power_ratio: float, least: float) -> Answer:
    if energy_ratio > LIMIT and agree and power_ratio > 1:
        return Answer.of("one event", same_place=int(same.sum()), revolutions=same.size)
    if energy_ratio > LIMIT:
        why = (
            "not in the odd, even, first and last revolutions alike, as of a disturbance"
            if not agree
            else "averages over other lengths than this gear's turn keep as much"
        )
        return Answer.of("cannot be judged", reason=f"a pulse stands out of the average, but {why}")
    if math.isnan(least):
        reason = "a pulse of the whole rms of the average would not stand out of what healthy gears show"
        return Answer.of("cannot be judged", reason=reason)
    power = (
        f"; a short pulse of {least:.2g} of the average's rms or more would have been seen with probability "
        f"{PROBABILITY:g}"
    )
    return Answer.of("nothing stands out", power=power)


def _spectra(turns: FloatArray, *, most: int) -> ComplexArray:
    """Return the spectra of revolutions up to a highest order."""
    n = turns.shape[1]
    parts = [np.fft.rfft(turns[i : i + _CHUNK], axis=1)[:, : most + 1] / n for i in range(0, len(turns), _CHUNK)]
    return np.concatenate(parts)


def _halves(revolutions: int) -> list[slice]:
    """Return the odd, even, first and last revolutions."""
    half = revolutions // 2
    return [slice(0, None, 2), slice(1, None, 2), slice(0, half), slice(half, None)]


def _places(bands: ResidualBands, spectra: ComplexArray, average: ComplexArray, width: float) -> FloatArray:
    """Return the places of the strongest pulses of spectra (R, K) by the level of an average, tooth passes."""
    residual = average[bands.orders]
    root, weight = np.sqrt(bands.level(residual)), bands.weight(residual)
    parts = (spectra[i : i + _CHUNK][:, bands.orders] / root for i in range(0, len(spectra), _CHUNK))
    return np.concatenate([bands.energy(part, weight, width).argmax(axis=-1) for part in parts]) / PLACES


def _odd_even_correlation(bands: ResidualBands, halves: ComplexArray, average: ComplexArray) -> float:
    """Return the correlation of the residuals of two averages (2, K) over the level of a third."""
    odd, even = (halves[:, bands.orders] / np.sqrt(bands.level(average[bands.orders]))).reshape(2, -1)
    power = math.sqrt(float(np.sum(np.abs(odd) ** 2) * np.sum(np.abs(even) ** 2)))
    return float(np.real(np.vdot(odd, even))) / power if power else 0.0


def _power_ratio(x: FloatArray, n: int, Z: int, bands: ResidualBands) -> float:
    """Return the power that the average of the turn keeps over that of other lengths, noise removed by its count."""
    x = x[: max(_MOST_SAMPLES // n, _LEAST_REVOLUTIONS) * n]
    of_turn, *others = (_kept_power(x, n // Z * (Z + more), Z + more, bands) for more in (0, *_OTHER_TEETH))
    return of_turn / max(float(np.mean(others)), np.finfo(float).tiny)


def _kept_power(x: FloatArray, period: int, teeth: int, bands: ResidualBands) -> float:
    """Return the mean power of the residual of an average over periods, times their number."""
    turns = x[: len(x) // period * period].reshape(-1, period)
    power = np.abs(np.fft.rfft(turns.mean(axis=0)) / period) ** 2
    orders = np.arange(teeth // 2 + 1, (len(bands.orders) + 0.5) * teeth).astype(int)
    about = np.minimum(orders % teeth, -orders % teeth)
    residual = orders[(about > SIDEBANDS) & (orders < len(power))]
    return float(np.mean(power[residual])) * period * len(turns)
