"""Recognising damage: one scorer looks at one tooth, and location is that scorer turned around the gear."""

from typing import TYPE_CHECKING

from sigdb.core.lazy import lazy_names

if TYPE_CHECKING:
    from sigdb.recognition.location import LocationClassifier
    from sigdb.recognition.persist import load_model, save_model
    from sigdb.recognition.settings import Recognition
    from sigdb.recognition.severity import SeverityRegressor
    from sigdb.recognition.training import Evaluation, Model, evaluate, train
    from sigdb.recognition.transformer import SignatureTransformer

__all__ = [
    "Evaluation",
    "LocationClassifier",
    "Model",
    "Recognition",
    "SeverityRegressor",
    "SignatureTransformer",
    "evaluate",
    "load_model",
    "save_model",
    "train",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "Evaluation": "sigdb.recognition.training",
        "LocationClassifier": "sigdb.recognition.location",
        "Model": "sigdb.recognition.training",
        "Recognition": "sigdb.recognition.settings",
        "SeverityRegressor": "sigdb.recognition.severity",
        "SignatureTransformer": "sigdb.recognition.transformer",
        "evaluate": "sigdb.recognition.training",
        "load_model": "sigdb.recognition.persist",
        "save_model": "sigdb.recognition.persist",
        "train": "sigdb.recognition.training",
    },
)
