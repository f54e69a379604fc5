"""The estimators that are trained on a database and compared: the learners, then the baselines."""

from collections.abc import Callable
from typing import Any

from sigdb.recognition.estimators.baselines.nearest_template import NearestTemplateLocation, WhitenedBankLocation
from sigdb.recognition.estimators.baselines.threshold import (
    EnvelopeLocation,
    Fm4Location,
    Fm4Severity,
    IndicatorScore,
    MajorityLocation,
    MajoritySeverity,
    Na4StarLocation,
)
from sigdb.recognition.estimators.detector import Detector
from sigdb.recognition.estimators.pooled_location import POOLED, LocationClassifier
from sigdb.recognition.estimators.pooled_severity import SeverityRegressor
from sigdb.recognition.estimators.template_location import TemplateLocation
from sigdb.recognition.estimators.template_severity import TemplateSeverity
from sigdb.recognition.settings import RecognitionSettings
from sigdb.recognition.templates.bank import TemplateBank


def location(settings: RecognitionSettings, bank: TemplateBank | None) -> dict[str, Any]:
    """Unfitted estimators of location by name."""
    learners = {name: LocationClassifier(name, settings.seed) for name in POOLED}
    if bank is None:
        return learners | _thresholds(settings, bank) | {"majority": MajorityLocation()}
    templates = {"templates": TemplateLocation(bank), "whitened_bank": WhitenedBankLocation(bank)}
    return learners | templates | _thresholds(settings, bank) | {"majority": MajorityLocation()}


def severity(settings: RecognitionSettings, bank: TemplateBank | None) -> dict[str, Any]:
    """Unfitted estimators of severity by name."""
    learners = {name: SeverityRegressor(name, settings.seed) for name in POOLED}
    templates = {} if bank is None else {"templates": TemplateSeverity(bank)}
    return learners | templates | {"fm4": Fm4Severity(), "majority": MajoritySeverity()}


def detection(settings: RecognitionSettings, bank: TemplateBank | None) -> dict[str, Any]:
    """Unfitted detectors by name, at the false-alarm rate of the settings."""
    rate = settings.false_alarm_rate
    # Two folds: these scorers take long to train.
    learners = {name: Detector(LocationClassifier(name, settings.seed), rate, folds=2) for name in POOLED}
    templates = {} if bank is None else {"templates": Detector(WhitenedBankLocation(bank), rate)}
    baselines = {name: Detector(IndicatorScore(one), rate) for name, one in _thresholds(settings, bank).items()}
    return learners | templates | baselines


def _thresholds(settings: RecognitionSettings, bank: TemplateBank | None) -> dict[str, Any]:
    rate = settings.false_alarm_rate
    nearest = {} if bank is None else {"nearest_template": NearestTemplateLocation(bank, rate)}
    return nearest | {
        "envelope_peak": EnvelopeLocation(rate),
        "na4_star": Na4StarLocation(rate),
        "fm4": Fm4Location(rate),
    }


CONTENDERS: dict[str, Callable[[RecognitionSettings, TemplateBank | None], dict[str, Any]]] = {
    "location": location,
    "severity": severity,
    "detection": detection,
}
"""Unfitted estimators by target, from settings and a bank of templates where there is one."""
