"""A model as a folder: estimators without pickle, what they are, and a probe that is checked when they are loaded."""

import hashlib
import io
import json
import platform
import zipfile
import zlib
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import sklearn
import skops.io

from sigdb.core.errors import DatabaseError, InputError
from sigdb.core.version import __version__
from sigdb.database.storage import Store
from sigdb.recognition.card import model_card
from sigdb.recognition.evaluation import Evaluation
from sigdb.recognition.reference_models import model_folder
from sigdb.recognition.training import Model, few_rows

TRUSTED = (
    "numpy.dtype",
    "sigdb.recognition.baselines.Fm4Location",
    "sigdb.recognition.baselines.Fm4Severity",
    "sigdb.recognition.baselines.MajorityLocation",
    "sigdb.recognition.baselines.MajoritySeverity",
    "sigdb.recognition.compact_signals.CompactSignals",
    "sigdb.recognition.detection.Detector",
    "sigdb.recognition.envelope_location.EnvelopeLocation",
    "sigdb.recognition.indicator_score.IndicatorScore",
    "sigdb.recognition.location.LocationClassifier",
    "sigdb.recognition.na4_star_location.Na4StarLocation",
    "sigdb.recognition.nearest_template_location.NearestTemplateLocation",
    "sigdb.recognition.severity.SeverityRegressor",
    "sigdb.recognition.template_bank.PointTemplates",
    "sigdb.recognition.template_bank.TemplateBank",
    "sigdb.recognition.template_location.TemplateLocation",
    "sigdb.recognition.template_severity.TemplateSeverity",
    "sigdb.recognition.views.ToothViews",
    "sigdb.recognition.whitened_bank_location.WhitenedBankLocation",
    "sklearn._loss.link.Interval",
    "sklearn._loss.link.IdentityLink",
    "sklearn._loss.link.LogitLink",
    "sklearn._loss.loss.HalfBinomialLoss",
    "sklearn._loss.loss.HalfSquaredError",
    "sklearn.ensemble._hist_gradient_boosting.binning._BinMapper",
    "sklearn.ensemble._hist_gradient_boosting.predictor.TreePredictor",
)
"""Types that a model may hold beside those that skops trusts; never taken from the file."""

_UNREADABLE = (
    AttributeError,
    EOFError,
    KeyError,
    OSError,
    RuntimeError,
    TypeError,
    ValueError,
    zipfile.BadZipFile,
    zlib.error,
)
"""What damaged or foreign files raise in the readers of JSON, ZIP, skops and NPZ."""

_COLUMNS = ("teeth", "speed_rpm", "torque", "fm4", "wigner_ville", "averages", "scatter", "tsa")
"""Columns that estimators read; averages only where one of them reads templates."""


def save_model(model: Model, folder: str | Path, *, evaluation: Evaluation, probe: pd.DataFrame, command: str) -> None:
    """Write a model's folder: ``model.skops``, ``model.json``, ``probe.npz`` and its card ``README.md``.

    Parameters
    ----------
    model
        A trained model.
    folder
        Where; made if it does not exist.
    evaluation
        Its figures, for the card.
    probe
        Rows of features, of which a few are kept with the model's answers.
    command
        The command that makes it again.
    """
    store, rows = Store.at(folder), few_rows(probe)
    answers = io.BytesIO()
    np.savez_compressed(answers, expected=_answers(model, rows), **_arrays(rows))
    files = {
        "model.skops": skops.io.dumps(model.estimators, compression=zipfile.ZIP_DEFLATED),
        "probe.npz": answers.getvalue(),
    }
    for name, content in files.items():
        store.put(name, content)
    described = {field.name: getattr(model, field.name) for field in fields(model) if field.name != "estimators"}
    described |= {
        "evaluation": evaluation.as_json(),
        "versions": {"sigdb": __version__, "scikit-learn": sklearn.__version__, "python": platform.python_version()},
        "sha256": {name: hashlib.sha256(content).hexdigest() for name, content in files.items()},
    }
    store.put("model.json", (json.dumps(described, indent=1) + "\n").encode())
    store.put("README.md", model_card(model, evaluation, command=command).encode())


def load_model(name_or_folder: str | Path) -> Model:
    """Load a model, and check that it still gives the answers that it gave when it was saved.

    Only types of a fixed list are loaded; pickle and joblib files are refused.

    Parameters
    ----------
    name_or_folder
        A model's folder, or the name of a reference model as listed by :func:`built_in_models`.

    Raises
    ------
    InputError
        If there is no such model, or it holds types that are not on the list.
    DatabaseError
        If the answers on the probe differ.

    Examples
    --------
    >>> import sigdb
    >>> sigdb.load_model("nasa-location").target
    'location'
    """
    folder = model_folder(name_or_folder)
    try:
        described = json.loads((folder / "model.json").read_text(encoding="utf-8"))
        model = _rebuilt(described, _checked(folder, "model.skops", described))
        with np.load(io.BytesIO(_checked(folder, "probe.npz", described)), allow_pickle=False) as probe:
            found, expected = _answers(model, _rows(probe)), probe["expected"]
    except FileNotFoundError as error:
        missing = Path(error.filename).name
        raise InputError(f"{folder} is not a model folder: {missing} is missing; make one with: sigdb train") from None
    except InputError as error:
        raise InputError(f"{folder}: {error}") from None
    except _UNREADABLE as error:
        raise InputError(f"{folder}: not a readable model ({error}); train it again") from None
    if found.shape != expected.shape or not np.allclose(found, expected, rtol=1e-6, atol=1e-9):
        raise DatabaseError(
            f"{folder}: the model's answers on its probe have changed (saved with scikit-learn "
            f"{described['versions']['scikit-learn']}, this is {sklearn.__version__}); train it again"
        )
    return model


def _checked(folder: Path, name: str, described: dict[str, Any]) -> bytes:
    """The bytes of a file, if they are those that ``model.json`` tells of."""
    content = (folder / name).read_bytes()
    if hashlib.sha256(content).hexdigest() != described["sha256"][name]:
        raise ValueError(f"{name} is not the file that was saved with model.json")
    return content


def _rebuilt(described: dict[str, Any], content: bytes) -> Model:
    """The model, of trusted types only."""
    names = [field.name for field in fields(Model) if field.name != "estimators"]
    lacking = [name for name in names if name not in described]
    if lacking:
        raise InputError(f"model.json lacks {', '.join(lacking)}: it is of another version of sigdb; train it again")
    untrusted = set(skops.io.get_untrusted_types(data=content)) - set(TRUSTED)
    if untrusted:
        raise InputError(f"the model holds types that are not trusted: {', '.join(sorted(untrusted))}")
    estimators = skops.io.loads(content, trusted=list(TRUSTED))
    kept = {name: described[name] for name in names} | {"trained_on": tuple(described["trained_on"])}
    return Model(estimators=estimators, **kept)


def _answers(model: Model, rows: pd.DataFrame) -> np.ndarray:
    estimator = model.estimators[model.learner]
    return np.asarray(estimator.predict(rows) if model.target == "severity" else estimator.decision_function(rows))


def _arrays(rows: pd.DataFrame) -> dict[str, Any]:
    return {name: np.stack(rows[name].to_list()) for name in _COLUMNS if name in rows}


def _rows(arrays: Any) -> pd.DataFrame:
    known = [name for name in _COLUMNS if name in arrays]
    return pd.DataFrame({name: list(arrays[name]) if arrays[name].ndim > 1 else arrays[name] for name in known})
