"""Recognising damage: one scorer looks at one tooth, and location is that scorer turned around the gear."""

from sigdb.recognition.location import LocationClassifier
from sigdb.recognition.persist import load_model, save_model
from sigdb.recognition.settings import Recognition
from sigdb.recognition.severity import SeverityRegressor
from sigdb.recognition.train import Evaluation, Model, evaluate, train

__all__ = [
    "Evaluation",
    "LocationClassifier",
    "Model",
    "Recognition",
    "SeverityRegressor",
    "evaluate",
    "load_model",
    "save_model",
    "train",
]
