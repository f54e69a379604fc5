"""The registry of estimators: learners and baselines by name, for each target.

It names classes without importing them, so that settings and commands know the learners, targets and splits without
scikit-learn.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import import_module
from typing import TYPE_CHECKING

from sigdb.core import InputError

if TYPE_CHECKING:
    from sigdb.recognition.estimators.contract import Estimator
    from sigdb.recognition.settings import RecognitionSettings
    from sigdb.recognition.templates.bank import TemplateBank

DETECTION = "detection"

TARGET_NAMES = ("location", "severity", DETECTION, "kind")
"""Names of the targets."""


@dataclass(frozen=True, kw_only=True)
class Entry:
    """An estimator of the registry.

    Attributes
    ----------
    name
        Name in results, and for ``--learner``.
    text
        Description in a few words.
    learner
        Whether it may be the model; the others are baselines.
    classes
        By target, its class: module, below ``sigdb.recognition.estimators``, and name. That of ``detection`` is an
        estimator of location, on whose scores a ``Detector`` sets its threshold.
    trusted
        Types of other libraries that a trained one holds, in addition to those that skops trusts.
    """

    name: str
    text: str
    learner: bool = False
    classes: Mapping[str, str] = field(default_factory=dict)
    trusted: tuple[str, ...] = ()


_POOLED = {
    "location": "pooled_location.LocationClassifier",
    "severity": "pooled_severity.SeverityRegressor",
    "detection": "pooled_location.LocationClassifier",
    "kind": "pooled_kind.KindClassifier",
}


def _baseline(location: str) -> dict[str, str]:
    return {"location": location, "detection": location}


REGISTRY: tuple[Entry, ...] = (
    Entry(name="lda", text="shrinkage linear discriminant analysis", learner=True, classes=_POOLED),
    Entry(
        name="boosting",
        text="gradient boosting of histograms",
        learner=True,
        classes=_POOLED,
        trusted=(
            "numpy.dtype",
            "sklearn._loss._loss.CyHalfBinomialLoss",
            "sklearn._loss._loss.CyHalfSquaredError",
            "sklearn._loss.link.Interval",
            "sklearn._loss.link.IdentityLink",
            "sklearn._loss.link.LogitLink",
            "sklearn._loss.loss.HalfBinomialLoss",
            "sklearn._loss.loss.HalfSquaredError",
            "sklearn.ensemble._hist_gradient_boosting.binning._BinMapper",
            "sklearn.ensemble._hist_gradient_boosting.predictor.TreePredictor",
        ),
    ),
    Entry(
        name="templates",
        text="likelihoods of a bank of templates, calibrated",
        learner=True,
        classes={
            "location": "template_location.TemplateLocation",
            "severity": "template_severity.TemplateSeverity",
            "detection": "template_location.TemplateLocation",
            "kind": "template_kind.TemplateKind",
        },
    ),
    Entry(
        name="whitened_bank",
        text="likelihoods of a bank of templates",
        classes={"location": "template_location.WhitenedBankLocation"},
    ),
    Entry(
        name="nearest_template",
        text="least Euclidean distance from a template",
        classes=_baseline("baselines.nearest_template.NearestTemplateLocation"),
    ),
    Entry(
        name="envelope_peak",
        text="peak of the envelope of the residual",
        classes=_baseline("baselines.threshold.EnvelopeLocation"),
    ),
    Entry(name="na4_star", text="threshold of NA4*", classes=_baseline("baselines.threshold.Na4StarLocation")),
    Entry(
        name="fm4",
        text="threshold of FM4, and severity as a function of it",
        classes=_baseline("baselines.threshold.Fm4Location") | {"severity": "baselines.threshold.Fm4Severity"},
    ),
    Entry(
        name="majority",
        text="the most frequent answer of the training",
        classes={
            "location": "baselines.threshold.MajorityLocation",
            "severity": "baselines.threshold.MajoritySeverity",
            "kind": "pooled_kind.MajorityKind",
        },
    ),
)
"""Estimators in the order of results: the learners, then the baselines."""

LEARNERS: dict[str, str] = {entry.name: entry.text for entry in REGISTRY if entry.learner}
"""Descriptions of the learners, by name."""

_PARTS = (
    "estimators.baselines.threshold.IndicatorScore",
    "estimators.detector.Detector",
    "rows.tooth_views.ToothViews",
    "templates.bank.TemplateBank",
    "templates.compact_signals.CompactSignals",
    "templates.point_templates.PointTemplates",
    "templates.severity_grid.SeverityInterpolation",
    "templates.speed_curve.Interpolation",
)


def own_classes() -> dict[str, str]:
    """Return the module of each class of sigdb that a model may hold, by the class's name."""
    registered = {f"estimators.{path}" for entry in REGISTRY for path in entry.classes.values()}
    paths = [f"sigdb.recognition.{path}".rpartition(".") for path in sorted(registered.union(_PARTS))]
    return {name: module for module, _, name in paths}


def trusted_types() -> list[str]:
    """Return the types that a model may hold in addition to those that skops trusts; never taken from a file."""
    foreign = {path for entry in REGISTRY for path in entry.trusted}
    return sorted({f"{module}.{name}" for name, module in own_classes().items()} | foreign)


def columns_read() -> frozenset[str]:
    """Return the columns of scalars of the table ``features`` that registered estimators read."""
    from sigdb.recognition.rows.batch import CELLS, TSA

    kinds = {kind for entry in REGISTRY for target in entry.classes if (kind := estimator_class(entry, target))}
    return frozenset().union(*(kind.reads for kind in kinds)) - {TSA, CELLS}


def make_estimators(target: str, settings: RecognitionSettings, bank: TemplateBank | None) -> dict[str, Estimator]:
    """Return the unfitted estimators of a target by name.

    Parameters
    ----------
    target
        ``location``, ``severity``, ``detection`` or ``kind``.
    settings
        Seed, and false-alarm rate of detectors and thresholds.
    bank
        Templates of the training rows. Without them estimators that need a bank are left out.
    """
    from sigdb.recognition.estimators.detector import Detector

    estimators: dict[str, Estimator] = {}
    for entry in REGISTRY:
        kind = estimator_class(entry, target)
        if kind is None or (kind.needs_bank and bank is None):
            continue
        estimator = kind.create(entry.name, settings, bank)
        estimators[entry.name] = Detector.of(estimator, settings.false_alarm_rate) if target == DETECTION else estimator
    return estimators


def estimator_class(entry: Entry, target: str) -> type[Estimator] | None:
    """Return the class of an entry for a target; None where it has none."""
    if target not in entry.classes:
        return None
    module, _, name = entry.classes[target].rpartition(".")
    kind: type[Estimator] = getattr(import_module(f"sigdb.recognition.estimators.{module}"), name)
    return kind


def default_learner(bank: TemplateBank | None) -> str:
    """Return the learner where none is named: the one of templates, or boosting where there is no bank."""
    return "boosting" if bank is None else "templates"


def learner_class(learner: str, target: str) -> type[Estimator]:
    """Return the class of a learner for a target.

    Raises
    ------
    InputError
        If the learner is not known, or has none for the target.
    """
    able = {entry.name: entry for entry in REGISTRY if entry.learner and target in entry.classes}
    kind = estimator_class(able[learner], target) if learner in able else None
    if kind is None:
        raise InputError(f"learner = {learner!r} is not one of those for {target}; choose one of {', '.join(able)}")
    return kind
