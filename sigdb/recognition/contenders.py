"""The estimators that are trained on a database and compared: the learners, then the baselines."""

from collections.abc import Callable
from typing import Any

from sigdb.recognition.baselines import Fm4Location, Fm4Severity, MajorityLocation, MajoritySeverity
from sigdb.recognition.detection import Detector
from sigdb.recognition.envelope_location import EnvelopeLocation
from sigdb.recognition.learners import POOLED
from sigdb.recognition.location import LocationClassifier
from sigdb.recognition.location_detector import LocationDetector
from sigdb.recognition.na4_star_location import Na4StarLocation
from sigdb.recognition.nearest_template_location import NearestTemplateLocation
from sigdb.recognition.settings import Recognition
from sigdb.recognition.severity import SeverityRegressor
from sigdb.recognition.template_bank import TemplateBank
from sigdb.recognition.template_location import TemplateLocation
from sigdb.recognition.template_severity import TemplateSeverity
from sigdb.recognition.whitened_bank_location import WhitenedBankLocation


def location(settings: Recognition, bank: TemplateBank | None) -> dict[str, Any]:
    """Unfitted estimators of location by name."""
    learners = {name: LocationClassifier(name, settings.seed) for name in POOLED}
    if bank is None:
        return learners | _thresholds(settings, bank) | {"majority": MajorityLocation()}
    templates = {"templates": TemplateLocation(bank), "whitened_bank": WhitenedBankLocation(bank)}
    return learners | templates | _thresholds(settings, bank) | {"majority": MajorityLocation()}


def severity(settings: Recognition, bank: TemplateBank | None) -> dict[str, Any]:
    """Unfitted estimators of severity by name."""
    learners = {name: SeverityRegressor(name, settings.seed) for name in POOLED}
    templates = {} if bank is None else {"templates": TemplateSeverity(bank)}
    return learners | templates | {"fm4": Fm4Severity(), "majority": MajoritySeverity()}


def detection(settings: Recognition, bank: TemplateBank | None) -> dict[str, Any]:
    """Unfitted detectors by name, at the false-alarm rate of the settings."""
    rate = settings.false_alarm_rate
    scorers = {name: LocationClassifier(name, settings.seed) for name in POOLED}
    learners = {name: LocationDetector(one, rate, settings.seed) for name, one in scorers.items()}
    templates = {} if bank is None else {"templates": Detector(bank, rate)}
    baselines = {name: LocationDetector(one, rate, settings.seed) for name, one in _thresholds(settings, bank).items()}
    return learners | templates | baselines


def _thresholds(settings: Recognition, bank: TemplateBank | None) -> dict[str, Any]:
    rate = settings.false_alarm_rate
    nearest = {} if bank is None else {"nearest_template": NearestTemplateLocation(bank, rate)}
    return nearest | {
        "envelope_peak": EnvelopeLocation(rate),
        "na4_star": Na4StarLocation(rate),
        "fm4": Fm4Location(rate),
    }


CONTENDERS: dict[str, Callable[[Recognition, TemplateBank | None], dict[str, Any]]] = {
    "location": location,
    "severity": severity,
    "detection": detection,
}
"""Unfitted estimators by target, from settings and a bank of templates where there is one."""
