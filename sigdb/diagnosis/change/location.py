"""Location of a tooth that stands out, and of further teeth."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.fft import fft

from sigdb.core import FloatArray, IntArray
from sigdb.diagnosis.change.change import PLACES, Change, amplitudes
from sigdb.diagnosis.change.finding import Finding
from sigdb.diagnosis.change.statistics import pulse_energy, pulse_statistic, without_shape
from sigdb.diagnosis.change.template_fit import TemplateFit
from sigdb.diagnosis.change.templates import BehindPath

USUAL_LAG = 1.1
"""Place of a damaged tooth's pulse after its first contact, in tooth passes: the median of 384 simulated averages of
spur gears with 18 to 56 teeth, of drawn sizes, at all sensors and behind random paths."""

EARLY, LATE = 0.75, 1.05
"""Distances from it of the limits within which 95 % of those lags lie."""

PLACE_ERROR = 0.75
"""Error of the place of the templates of a described rig that fit a change, in tooth passes. With the rig itself 192 of
195 simulated cases were within it, 130 of 130 of them by a tacho."""

_LIKELY = 3.0
"""Logarithm of the likelihood ratio to the best place up to which a place is likely: a twentieth."""

_NEAR = 1.5
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

    The place is that of the widest pulse less its usual lag after the first contact. Templates of other rigs are no
    better guide: their lags differ by as much, and their places by more. Only where the rig is described, and its
    templates fit, the place is that of the fit. The interval holds the places that are likely by the likelihood ratio,
    and the spread of the lag over rigs and paths. A further tooth stands out if, without the first pulse, its own
    exceeds the limit and half of the first, more than 2.5 tooth passes away.
    """
    if not finding.stands_out:
        return ()
    if fit is not None:
        low, high = fit.low - fit.place - PLACE_ERROR, fit.high - fit.place + PLACE_ERROR
        first = _tooth(fit.place, finding.change.teeth, low=low, high=high)
    else:
        first = _location(finding)
    return first, *_further(finding, templates)


def _further(finding: Finding, templates: BehindPath | None) -> Iterator[Location]:
    """Yield the further teeth, after taking each event out of the change.

    A gear that rings makes an event long. So the best template is taken out with a free amplitude in each band, then
    all that lies within 2.5 tooth passes of the strongest pulse. A further pulse must exceed the limit and half of the
    first.
    """
    Z, pulse, change = finding.change.teeth, finding.pulse, finding.change
    least = _FURTHER * pulse.greatest * change.middle
    if templates is not None and finding.template is not None:
        best = int(np.argmax(finding.template.value))
        shape = templates.shapes[finding.template.best[best]]
        change = without_shape(change, [shape[band.orders] / band.deviation for band in change.bands], best)
    place = int(np.argmax(pulse.value))
    far = _distance(pulse.value.size, place) > _APART * PLACES
    for _ in range(Z // 4):
        change = without_pulse(change, place)
        rest = np.where(far, pulse_statistic(change).value, 0.0)
        if rest.max() <= finding.pulse_limit or rest.max() * change.middle <= least:
            return
        place = int(np.argmax(rest))
        yield _tooth(place / PLACES - USUAL_LAG, Z, low=-LATE, high=EARLY)
        far &= _distance(rest.size, place) > _APART * PLACES


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


def _location(finding: Finding) -> Location:
    """Return the tooth at the widest pulse near what stands out, with the places that are likely."""
    pulse, change = finding.pulse, finding.change
    statistic = pulse
    if finding.template is not None and pulse.greatest <= finding.pulse_limit:
        statistic = finding.template
    near = _distance(pulse.value.size, int(np.argmax(statistic.value))) <= _NEAR * PLACES
    widest = np.where(near, pulse_energy(change)[-1] / change.middle, 0.0)
    place = int(np.argmax(widest))
    off = _offsets(widest.size, place)
    likely = (np.abs(off) <= _NEAR * PLACES) & (widest >= widest[place] - _LIKELY)
    low, high = (float(end) / PLACES for end in (off[likely].min(), off[likely].max()))
    return _tooth(place / PLACES - USUAL_LAG, change.teeth, low=low - LATE, high=high + EARLY)


def _tooth(place: float, teeth: int, *, low: float, high: float) -> Location:
    """Return the tooth at a place in tooth passes after the first contact of tooth 1."""
    place %= teeth
    tooth, first, last = (int(np.floor(place + end + 0.5)) for end in (0.0, low, high))
    number = tooth % teeth + 1
    return Location(tooth=number, low=number + first - tooth, high=number + last - tooth, place=place)


def _offsets(size: int, place: int) -> IntArray:
    """Return the distances (size,) of all places after one, around the turn; negative before it."""
    return np.asarray((np.arange(size) - place + size // 2) % size - size // 2)


def _distance(size: int, place: int) -> FloatArray:
    """Return the distances (size,) of all places from one, around the turn."""
    return np.abs(_offsets(size, place)).astype(float)
