"""Recognising damage: one scorer looks at one tooth, and location is that scorer turned around the gear."""

from typing import TYPE_CHECKING

from sigdb.core.lazy import lazy_names

if TYPE_CHECKING:
    from sigdb.recognition.bootstrap import Figure
    from sigdb.recognition.evaluation import Evaluation, EvaluationError, asked_rows, evaluate
    from sigdb.recognition.location import LocationClassifier
    from sigdb.recognition.persist import load_model, save_model
    from sigdb.recognition.settings import Recognition
    from sigdb.recognition.severity import SeverityRegressor
    from sigdb.recognition.split_kinds import make_split
    from sigdb.recognition.splits import Split
    from sigdb.recognition.training import Model, train
    from sigdb.recognition.transformer import SignatureTransformer

__all__ = [
    "Evaluation",
    "EvaluationError",
    "Figure",
    "LocationClassifier",
    "Model",
    "Recognition",
    "SeverityRegressor",
    "SignatureTransformer",
    "Split",
    "asked_rows",
    "evaluate",
    "load_model",
    "make_split",
    "save_model",
    "train",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "Evaluation": "sigdb.recognition.evaluation",
        "EvaluationError": "sigdb.recognition.evaluation",
        "Figure": "sigdb.recognition.bootstrap",
        "LocationClassifier": "sigdb.recognition.location",
        "Model": "sigdb.recognition.training",
        "Recognition": "sigdb.recognition.settings",
        "SeverityRegressor": "sigdb.recognition.severity",
        "SignatureTransformer": "sigdb.recognition.transformer",
        "Split": "sigdb.recognition.splits",
        "asked_rows": "sigdb.recognition.evaluation",
        "evaluate": "sigdb.recognition.evaluation",
        "load_model": "sigdb.recognition.persist",
        "make_split": "sigdb.recognition.split_kinds",
        "save_model": "sigdb.recognition.persist",
        "train": "sigdb.recognition.training",
    },
)
