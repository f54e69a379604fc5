"""Recognising damage: one scorer looks at one tooth, and location is that scorer turned around the gear."""

from typing import TYPE_CHECKING

from sigdb.core.lazy import lazy_names

if TYPE_CHECKING:
    from sigdb.recognition.bayes_bound import Bound, bound
    from sigdb.recognition.detection import Detector
    from sigdb.recognition.efficiency import ErrorCurve, eta_info
    from sigdb.recognition.excess import Excess, above_bound
    from sigdb.recognition.expected import error_curve, expected_losses
    from sigdb.recognition.likelihood import Hypotheses
    from sigdb.recognition.likelihood_ratio import OptimalRoc, detection_table, optimal_roc, smallest_found
    from sigdb.recognition.location import LocationClassifier
    from sigdb.recognition.persist import load_model, save_model
    from sigdb.recognition.rows_by_point import OperatingPoint, operating_points
    from sigdb.recognition.settings import Recognition
    from sigdb.recognition.severity import SeverityRegressor
    from sigdb.recognition.template_bank import TemplateBank
    from sigdb.recognition.template_location import TemplateLocation
    from sigdb.recognition.template_scores import TemplateScores
    from sigdb.recognition.template_severity import TemplateSeverity
    from sigdb.recognition.training import Evaluation, Model, evaluate, train
    from sigdb.recognition.transformer import SignatureTransformer

__all__ = [
    "Bound",
    "Detector",
    "ErrorCurve",
    "Evaluation",
    "Excess",
    "Hypotheses",
    "LocationClassifier",
    "Model",
    "OperatingPoint",
    "OptimalRoc",
    "Recognition",
    "SeverityRegressor",
    "SignatureTransformer",
    "TemplateBank",
    "TemplateLocation",
    "TemplateScores",
    "TemplateSeverity",
    "above_bound",
    "bound",
    "detection_table",
    "error_curve",
    "eta_info",
    "evaluate",
    "expected_losses",
    "load_model",
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
        "Evaluation": "sigdb.recognition.training",
        "Excess": "sigdb.recognition.excess",
        "Hypotheses": "sigdb.recognition.likelihood",
        "LocationClassifier": "sigdb.recognition.location",
        "Model": "sigdb.recognition.training",
        "OperatingPoint": "sigdb.recognition.rows_by_point",
        "OptimalRoc": "sigdb.recognition.likelihood_ratio",
        "Recognition": "sigdb.recognition.settings",
        "SeverityRegressor": "sigdb.recognition.severity",
        "SignatureTransformer": "sigdb.recognition.transformer",
        "TemplateBank": "sigdb.recognition.template_bank",
        "TemplateLocation": "sigdb.recognition.template_location",
        "TemplateScores": "sigdb.recognition.template_scores",
        "TemplateSeverity": "sigdb.recognition.template_severity",
        "above_bound": "sigdb.recognition.excess",
        "bound": "sigdb.recognition.bayes_bound",
        "detection_table": "sigdb.recognition.likelihood_ratio",
        "error_curve": "sigdb.recognition.expected",
        "eta_info": "sigdb.recognition.efficiency",
        "evaluate": "sigdb.recognition.training",
        "expected_losses": "sigdb.recognition.expected",
        "load_model": "sigdb.recognition.persist",
        "operating_points": "sigdb.recognition.rows_by_point",
        "optimal_roc": "sigdb.recognition.likelihood_ratio",
        "save_model": "sigdb.recognition.persist",
        "smallest_found": "sigdb.recognition.likelihood_ratio",
        "train": "sigdb.recognition.training",
    },
)
