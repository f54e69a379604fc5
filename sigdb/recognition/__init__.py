"""Recognising damage: one scorer looks at one tooth, and location is that scorer turned around the gear."""

from typing import TYPE_CHECKING

from sigdb.core.lazy import lazy_names

if TYPE_CHECKING:
    from sigdb.recognition.bayes_bound import Bound, bound
    from sigdb.recognition.bootstrap import Figure
    from sigdb.recognition.detection import Detector
    from sigdb.recognition.efficiency import ErrorCurve, eta_info
    from sigdb.recognition.evaluation import Evaluation, EvaluationError, asked_rows, evaluate
    from sigdb.recognition.excess import Excess, above_bound
    from sigdb.recognition.expected import error_curve, expected_losses
    from sigdb.recognition.judged import evaluate_beside_bound
    from sigdb.recognition.likelihood import Hypotheses
    from sigdb.recognition.likelihood_ratio import OptimalRoc, detection_table, optimal_roc, smallest_found
    from sigdb.recognition.location import LocationClassifier
    from sigdb.recognition.location_sets import LocationSets
    from sigdb.recognition.persist import load_model, save_model
    from sigdb.recognition.reference_models import built_in_models
    from sigdb.recognition.rows_by_point import OperatingPoint, operating_points
    from sigdb.recognition.settings import Recognition
    from sigdb.recognition.severity import SeverityRegressor
    from sigdb.recognition.severity_intervals import SeverityIntervals
    from sigdb.recognition.split_kinds import make_split
    from sigdb.recognition.splits import Split
    from sigdb.recognition.template_bank import TemplateBank
    from sigdb.recognition.template_location import TemplateLocation
    from sigdb.recognition.template_scores import TemplateScores
    from sigdb.recognition.template_severity import TemplateSeverity
    from sigdb.recognition.training import Model, train
    from sigdb.recognition.transformer import SignatureTransformer

__all__ = [
    "Bound",
    "Detector",
    "ErrorCurve",
    "Evaluation",
    "EvaluationError",
    "Excess",
    "Figure",
    "Hypotheses",
    "LocationClassifier",
    "LocationSets",
    "Model",
    "OperatingPoint",
    "OptimalRoc",
    "Recognition",
    "SeverityIntervals",
    "SeverityRegressor",
    "SignatureTransformer",
    "Split",
    "TemplateBank",
    "TemplateLocation",
    "TemplateScores",
    "TemplateSeverity",
    "above_bound",
    "asked_rows",
    "bound",
    "built_in_models",
    "detection_table",
    "error_curve",
    "eta_info",
    "evaluate",
    "evaluate_beside_bound",
    "expected_losses",
    "load_model",
    "make_split",
    "operating_points",
    "optimal_roc",
    "save_model",
    "smallest_found",
    "train",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "Bound": "sigdb.recognition.bayes_bound",
        "Detector": "sigdb.recognition.detection",
        "ErrorCurve": "sigdb.recognition.efficiency",
        "Excess": "sigdb.recognition.excess",
        "Hypotheses": "sigdb.recognition.likelihood",
        "Evaluation": "sigdb.recognition.evaluation",
        "EvaluationError": "sigdb.recognition.evaluation",
        "Figure": "sigdb.recognition.bootstrap",
        "LocationClassifier": "sigdb.recognition.location",
        "LocationSets": "sigdb.recognition.location_sets",
        "Model": "sigdb.recognition.training",
        "OperatingPoint": "sigdb.recognition.rows_by_point",
        "OptimalRoc": "sigdb.recognition.likelihood_ratio",
        "Recognition": "sigdb.recognition.settings",
        "SeverityIntervals": "sigdb.recognition.severity_intervals",
        "SeverityRegressor": "sigdb.recognition.severity",
        "SignatureTransformer": "sigdb.recognition.transformer",
        "TemplateBank": "sigdb.recognition.template_bank",
        "TemplateLocation": "sigdb.recognition.template_location",
        "TemplateScores": "sigdb.recognition.template_scores",
        "TemplateSeverity": "sigdb.recognition.template_severity",
        "above_bound": "sigdb.recognition.excess",
        "bound": "sigdb.recognition.bayes_bound",
        "built_in_models": "sigdb.recognition.reference_models",
        "detection_table": "sigdb.recognition.likelihood_ratio",
        "error_curve": "sigdb.recognition.expected",
        "eta_info": "sigdb.recognition.efficiency",
        "expected_losses": "sigdb.recognition.expected",
        "operating_points": "sigdb.recognition.rows_by_point",
        "optimal_roc": "sigdb.recognition.likelihood_ratio",
        "Split": "sigdb.recognition.splits",
        "asked_rows": "sigdb.recognition.evaluation",
        "evaluate": "sigdb.recognition.evaluation",
        "evaluate_beside_bound": "sigdb.recognition.judged",
        "load_model": "sigdb.recognition.persist",
        "make_split": "sigdb.recognition.split_kinds",
        "save_model": "sigdb.recognition.persist",
        "smallest_found": "sigdb.recognition.likelihood_ratio",
        "train": "sigdb.recognition.training",
    },
)
