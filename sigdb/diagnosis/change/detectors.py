"""Detectors of damage: every statistic of a change with its limit, its healthy pieces and its rate of false alarms."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from sigdb.core import FloatArray
from sigdb.diagnosis.change.change import Change
from sigdb.diagnosis.change.finding import Finding, HealthyLaw, changes_between, changes_within
from sigdb.diagnosis.change.healthy_set import HealthySet
from sigdb.signature import fm4, na4_star

DetectorName = Literal["pulse", "FM4", "NA4", "template", "likelihood"]


@dataclass(frozen=True, kw_only=True)
class Detector:
    """A statistic that damage raises, with the limit that healthy recordings give it.

    Attributes
    ----------
    name
        ``pulse``, ``FM4`` and ``NA4`` of the difference, which need healthy recordings alone; ``template`` and
        ``likelihood``, which need templates too.
    value, limit
        Its value in the recording, and the limit above which it is an alarm.
    pieces
        Number n of independent healthy pieces and further recordings on which the limit was counted.
    false_alarm_rate
        Rate of false alarms that they support, 1 / (n + 1), or that of noise where it is greater.
    """

    name: DetectorName
    value: float
    limit: float
    pieces: int
    false_alarm_rate: float

    @property
    def alarm(self) -> bool:
        """Whether the value is above the limit."""
        return self.value > self.limit

    @property
    def simulated(self) -> bool:
        """Whether it needs simulated templates as well as healthy recordings."""
        return self.name in ("template", "likelihood")

    @property
    def decides(self) -> bool:
        """Whether its alarm is the answer: FM4 and NA4 locate nothing, and NA4 grows with any change of level."""
        return self.name not in ("FM4", "NA4")


def detectors(finding: Finding, law: HealthyLaw, healthy: HealthySet) -> tuple[Detector, ...]:
    """Return the detectors of a change: those of healthy recordings alone, then those of templates.

    FM4 and NA4 are those of the whitened difference ``d(u) = Re sum_k r_k exp(2 pi j k u) / sqrt(K)``, with the
    residuals r of the bands at K orders. FM4 is the kurtosis of d. NA4 is its fourth moment over the square of the mean
    of its second moments in the healthy pieces. Their limits are the greatest values of all pieces of healthy
    recordings against the rest of their recordings, and of each recording against the others.

    Parameters
    ----------
    finding
        Statistics of the recording.
    law
        Limits from healthy recordings.
    healthy
        Healthy recordings.
    """
    changes = [*changes_within(healthy), *changes_between(healthy)]
    samples = healthy.recordings[0].spectrum.samples
    differences = np.array([_difference(each, samples) for each in (*changes, finding.change)])
    moments: dict[DetectorName, FloatArray] = {
        "FM4": fm4(differences),
        "NA4": na4_star(differences, baseline=len(changes)),
    }
    statistics: Sequence[tuple[DetectorName, float | None, float]] = (
        ("pulse", finding.pulse.greatest, finding.pulse_limit),
        *((name, float(values[-1]), float(np.nanmax(values[:-1], initial=0.0))) for name, values in moments.items()),
        ("template", None if finding.template is None else finding.template.greatest, finding.template_limit),
        ("likelihood", None if finding.likelihood is None else finding.likelihood.greatest, finding.likelihood_limit),
    )
    return tuple(
        Detector(name=name, value=value, limit=limit, pieces=law.pieces, false_alarm_rate=law.false_alarms)
        for name, value, limit in statistics
        if value is not None
    )


def _difference(change: Change, samples: int) -> FloatArray:
    """Return the whitened difference (samples,) over the turn."""
    spectrum = np.zeros(samples // 2 + 1, complex)
    for band in change.bands:
        spectrum[band.orders] = band.residual
    count = sum(len(band.orders) for band in change.bands)
    return np.asarray(np.fft.irfft(spectrum, samples) * samples / np.sqrt(max(count, 1)))
