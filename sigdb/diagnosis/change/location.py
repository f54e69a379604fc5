"""Location of a tooth that stands out, and of further teeth."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.fft import fft

from sigdb.core import ComplexArray, FloatArray
from sigdb.diagnosis.change.change import PLACES, Band, Change, amplitudes
from sigdb.diagnosis.change.finding import Finding
from sigdb.diagnosis.change.statistics import Statistic, pulse_statistic
from sigdb.diagnosis.change.template_fit import TemplateFit
from sigdb.diagnosis.change.templates import BehindPath

USUAL_LAG = 0.9
"""Place of a damaged tooth's pulse after its first contact, in tooth passes, where no rig gives it: simulated pairs of
spur gears with a contact ratio of 1.5 to 1.8."""

_PULSE_ERROR, _PLACE_ERROR = 1.25, 0.75
"""Errors of the place of a pulse and of a template of a described rig, in tooth passes, by shape and path. Assumed; of
150 pulses of simulated damage of other rigs, added to public recordings, 147 had an error below 1.2."""

_LIKELY = 3.0
"""Logarithm of the likelihood ratio to the best place up to which a place is likely: a twentieth."""

_NEAR = 2.0
"""Greatest distance of likely places from the best one, in tooth passes."""

_FURTHER, _APART = 0.5, 2.5
"""Least statistic of a further tooth relative to the first, and its least distance in tooth passes."""


@dataclass(frozen=True, kw_only=True)
class Location:
    """A tooth that stands out.

    Attributes
    ----------
    tooth
        The likeliest tooth, from 1.
    low, high
        First and last tooth of the interval; they may lie beyond 1 and Z, and then wrap around.
    place
        Place of the event, in tooth passes after the beginning of the average.
    """

    tooth: int
    low: int
    high: int
    place: float

    @property
    def within(self) -> int:
        """Greatest distance of the interval's ends from the tooth."""
        return max(self.tooth - self.low, self.high - self.tooth)


def locate(finding: Finding, templates: BehindPath | None, fit: TemplateFit | None = None) -> tuple[Location, ...]:
    """Return the teeth that stand out, the strongest first; empty where none does.

    Where the rig is described, and its templates fit and stand out more than pulses do, the place is that of the fit.
    Otherwise it is the pulse's place less its lag after the first contact; the lag comes from the pulses of the
    templates themselves. The interval holds the places that are likely by the likelihood ratio, the error of the
    place, and the other of the two places where it is near. A further tooth stands out if, without the first pulse, its
    own exceeds the limit and half of the first, more than 2.5 tooth passes away.
    """
    if not finding.stands_out:
        return ()
    Z, change, pulse, template = finding.change.teeth, finding.change, finding.pulse, finding.template
    lag = USUAL_LAG if templates is None else lag_of(templates, change)
    by_pulse = pulse.greatest / finding.pulse_limit
    by_template = 0.0 if template is None else template.greatest / finding.template_limit
    by_likelihood = 0.0 if finding.likelihood is None else finding.likelihood.greatest / finding.likelihood_limit
    if fit is not None and max(by_template, by_likelihood) >= by_pulse:
        ends = (fit.low - fit.place - _PLACE_ERROR, fit.high - fit.place + _PLACE_ERROR)
        first = _tooth(fit.place, Z, low=ends[0], high=ends[1])
    else:
        other = template.place if template is not None and by_template > 1 else None
        first = _location(pulse, lag, _PULSE_ERROR, Z, other=other)
    return first, *_further(finding, lag, templates)


def _further(finding: Finding, lag: float, templates: BehindPath | None) -> Iterator[Location]:
    """Yield the further teeth, after taking each event out of the change.

    A gear that rings makes an event long. So the best template is taken out with a free amplitude in each band, then
    all that lies within 2.5 tooth passes of the strongest pulse. A further pulse must exceed the limit and half of the
    first.
    """
    Z, pulse, change = finding.change.teeth, finding.pulse, finding.change
    least = _FURTHER * pulse.greatest * change.middle
    if templates is not None and finding.template is not None:
        change = without_template(change, templates, finding.template)
    place = int(np.argmax(pulse.value))
    far = _distance(pulse.value.size, place) > _APART * PLACES
    for _ in range(Z // 4):
        change = without_pulse(change, place)
        rest = np.where(far, pulse_statistic(change).value, 0.0)
        if rest.max() <= finding.pulse_limit or rest.max() * change.middle <= least:
            return
        place = int(np.argmax(rest))
        yield _tooth(place / PLACES - lag, Z, low=-_PULSE_ERROR, high=_PULSE_ERROR)
        far &= _distance(rest.size, place) > _APART * PLACES


def without_template(change: Change, templates: BehindPath, statistic: Statistic) -> Change:
    """Return a change without the best template of a statistic, which has a free complex amplitude in each band."""
    place = int(np.argmax(statistic.value))
    shape = templates.shapes[statistic.best[place]]
    bands = []
    for band in change.bands:
        turn = np.exp(-2j * np.pi * band.orders * place / (PLACES * change.teeth))
        T = shape[band.orders] * turn / band.deviation
        power = float(np.sum(np.abs(T) ** 2))
        fitted = np.sum(np.conj(T) * band.residual) / power * T if power > 0 else 0.0
        bands.append(replace(band, residual=band.residual - fitted))
    return replace(change, bands=tuple(bands))


def without_pulse(change: Change, place: int) -> Change:
    """Return a change whose envelopes are zero near a place, and fade in within a tooth pass about that gap.

    Parameters
    ----------
    change
        The change.
    place
        Place of the pulse, in eighths of a tooth pass.
    """
    size = PLACES * change.teeth
    gap = np.clip(_distance(size, place) / PLACES - _APART, 0, 1)
    bands = []
    for band, line in zip(change.bands, amplitudes(change, [band.residual for band in change.bands]), strict=True):
        kept = fft(line * gap) / size
        residual = kept[(band.orders - band.harmonic * change.teeth) % size]
        bands.append(replace(band, residual=residual))
    return replace(change, bands=tuple(bands))


def _location(statistic: Statistic, lag: float, error: float, teeth: int, other: float | None = None) -> Location:
    """Return the tooth at the greatest value, with the places that are likely and another place if it is near."""
    size = statistic.value.size
    place = int(np.argmax(statistic.value))
    off = (np.arange(size) - place + size // 2) % size - size // 2
    near = (np.abs(off) <= _NEAR * PLACES) & (statistic.ratio >= statistic.ratio[place] - _LIKELY)
    low, high = (float(end) / PLACES for end in (off[near].min(), off[near].max()))
    low, high = low - error, high + error
    if other is not None:
        distance = (other - place / PLACES + lag + teeth / 2) % teeth - teeth / 2
        if abs(distance) <= _NEAR:
            low, high = min(low, distance), max(high, distance)
    return _tooth(place / PLACES - lag, teeth, low=low, high=high)


def _tooth(place: float, teeth: int, *, low: float, high: float) -> Location:
    """Return the tooth at a place in tooth passes after the first contact of tooth 1."""
    place %= teeth
    tooth, first, last = (int(np.floor(place + end + 0.5)) for end in (0.0, low, high))
    number = tooth % teeth + 1
    return Location(tooth=number, low=number + first - tooth, high=number + last - tooth, place=place)


def _distance(size: int, place: int) -> FloatArray:
    """Return the distances (size,) of all places from one, around the turn."""
    return np.abs((np.arange(size) - place + size // 2) % size - size // 2).astype(float)


def lag_of(templates: BehindPath, change: Change) -> float:
    """Return the median place of the templates' pulses after the first contact of their tooth, in tooth passes."""
    Z = change.teeth
    places = np.array([pulse_of(spectrum, change).place for spectrum in templates.shapes])
    return USUAL_LAG + float(np.median((places - USUAL_LAG + Z / 2) % Z - Z / 2))


def pulse_of(difference: ComplexArray, change: Change) -> Statistic:
    """Return the pulse statistic of a difference (n / 2 + 1,), in the bands and at the deviations of a change."""
    bands = tuple(
        Band(
            harmonic=band.harmonic,
            orders=band.orders,
            gain=band.gain,
            residual=difference[band.orders] / band.deviation,
            deviation=band.deviation,
        )
        for band in change.bands
    )
    return pulse_statistic(Change(teeth=change.teeth, bands=bands, turn=0.0, likeness=0.0))
