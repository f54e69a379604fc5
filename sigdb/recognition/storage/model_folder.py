"""A model as a folder: estimators without pickle, what they are, and a probe that is checked when they are loaded."""

import hashlib
import io
import json
import platform
import tokenize
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import fields, replace
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import sklearn

from sigdb.core import DatabaseError, FloatArray, InputError, __version__, plain, publish_all
from sigdb.database import DamagedFileError, sealed_json, unsealed
from sigdb.recognition.evaluation import Evaluation
from sigdb.recognition.model import Model, few_rows
from sigdb.recognition.rows.batch import BY_ORDER, CELLS, TSA, Batch, Rows
from sigdb.recognition.storage.bounded_files import MOST_TEXT, archive_members, folder_file
from sigdb.recognition.storage.model_card import model_card
from sigdb.recognition.storage.skops_file import skops_bytes, skops_estimators
from sigdb.recognition.trained_range import TrainedRange


def built_in_models() -> list[str]:
    """Return the names of the reference models that come with sigdb.

    Returns
    -------
    list of str

    Examples
    --------
    >>> from sigdb.recognition import built_in_models
    >>> built_in_models()
    ['nasa-detection', 'nasa-location', 'nasa-severity']
    """
    return list(_built_in_folders())


def model_folder(name_or_folder: str | Path) -> Path:
    """Return the folder of a reference model by its name, or the folder itself.

    A name is text without a path separator that is not a folder here.

    Raises
    ------
    InputError
        If it is a name, and there is no such model.
    """
    folder = Path(name_or_folder)
    if folder.is_dir() or len(folder.parts) != 1 or folder.name != str(name_or_folder):
        return folder
    if folder.suffix == ".py":
        raise InputError(f"{folder.name} is a file in Python; name the class in it, as {folder.name}:Model")
    built_in = _built_in_folders()
    if folder.name not in built_in:
        raise InputError(
            f"{folder.name} is not a model folder, nor one of the reference models, "
            f"{', '.join(built_in) or 'of which there are none here'}; make a model with: sigdb train"
        )
    return built_in[folder.name]


def _built_in_folders() -> dict[str, Path]:
    packaged = Path(str(resources.files("sigdb"))) / "models"
    folder = packaged if packaged.is_dir() else Path(__file__).parents[3] / "models"
    return {path.parent.name: path.parent for path in sorted(folder.glob("*/model.json"))}


_SEALED = b'{"sha256": "'
"""Begin of a description with a seal."""

_UNREADABLE = (
    AttributeError,
    DamagedFileError,
    EOFError,
    KeyError,
    MemoryError,
    OSError,
    OverflowError,
    RuntimeError,
    TypeError,
    tokenize.TokenError,
    ValueError,
    zipfile.BadZipFile,
    zlib.error,
)
"""Errors that the seal and the readers of JSON, ZIP, skops and NPZ raise on damaged or foreign files."""


def save_model(
    model: Model,
    folder: str | Path,
    *,
    evaluation: Evaluation,
    probe: Rows,
    command: str,
    elsewhere: Mapping[str, Evaluation] | None = None,
) -> None:
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
        Rows of features. A few are kept with the model's answers.
    command
        The command that makes it again.
    elsewhere
        By name, its figures on other databases, for the card too.
    """
    folder, rows = Path(folder), few_rows(_as_batch(model, probe))
    answers = io.BytesIO()
    arrays: dict[str, Any] = _arrays(model, rows)
    np.savez_compressed(answers, expected=_answers(model, rows), **arrays)
    files = {"model.skops": skops_bytes(model.estimators), "probe.npz": answers.getvalue()}
    described = {field.name: getattr(model, field.name) for field in fields(model) if field.name != "estimators"}
    described |= {
        "evaluation": evaluation.as_json(),
        "elsewhere": {name: other.as_json() for name, other in (elsewhere or {}).items()},
        "versions": {"sigdb": __version__, "scikit-learn": sklearn.__version__, "python": platform.python_version()},
        "files": {name: hashlib.sha256(content).hexdigest() for name, content in files.items()},
    }
    files["README.md"] = model_card(model, evaluation, command=command, elsewhere=elsewhere).encode()
    files["model.json"] = sealed_json(_as_mapping(plain(described)))  # the last one: it holds the hashes
    publish_all({folder / name: content for name, content in files.items()})


def load_model(name_or_folder: str | Path) -> Model:
    """Load a model, and check that it still gives the answers that it gave when it was saved.

    Only types of a fixed list are loaded; pickle and joblib files are refused.

    Parameters
    ----------
    name_or_folder
        A model's folder, or the name of a reference model as listed by :func:`built_in_models`.

    Returns
    -------
    Model

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
        described = _description(folder)
        model = _rebuilt(described, _checked(folder, "model.skops", described))
        probe = _probe(_checked(folder, "probe.npz", described))
        expected = probe.pop("expected")
        if model.trained_range is None:
            model = replace(model, trained_range=_range_of_templates(model, probe))
        answers = _answers(model, _rows(probe))
    except FileNotFoundError as error:
        missing = Path(error.filename).name
        raise InputError(f"{folder} is not a model folder: {missing} is missing; make one with: sigdb train") from None
    except InputError as error:
        raise InputError(f"{folder}: {error}") from None
    except _UNREADABLE as error:
        raise InputError(f"{folder}: not a readable model ({error}); train it again") from None
    if answers.shape != expected.shape or not np.allclose(answers, expected, rtol=1e-6, atol=1e-9):
        raise DatabaseError(
            f"{folder}: the model's answers on its probe have changed (saved with scikit-learn "
            f"{described['versions']['scikit-learn']}, this is {sklearn.__version__}); train it again"
        )
    return model


def _description(folder: Path) -> dict[str, Any]:
    """Return the content of ``model.json``; hashes of the other files are its ``files``."""
    content = folder_file(folder, "model.json", most=MOST_TEXT)
    if content.startswith(_SEALED):
        return unsealed(content, name="model.json")
    described = _as_mapping(json.loads(content))  # of sigdb 0.1.0, without a seal
    described["files"] = _as_mapping(described.pop("sha256"))
    return described


def _as_mapping(value: object) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise ValueError("model.json holds no description of a model")
    return value


def _checked(folder: Path, name: str, described: Mapping[str, Any]) -> bytes:
    """Return the bytes of a file, if their hash is that in ``model.json``."""
    content = folder_file(folder, name)
    if hashlib.sha256(content).hexdigest() != described["files"][name]:
        raise ValueError(f"{name} is not the file that was saved with model.json")
    return content


def _probe(content: bytes) -> dict[str, np.ndarray]:
    """Return the arrays of ``probe.npz`` by name."""
    members = archive_members("probe.npz", content)
    return {name.removesuffix(".npy"): np.load(io.BytesIO(data), allow_pickle=False) for name, data in members.items()}


def _rebuilt(described: dict[str, Any], content: bytes) -> Model:
    """The model, of trusted types only."""
    later = ("trained_range", "columns", "added")  # models of earlier versions have none
    names = [field.name for field in fields(Model) if field.name not in ("estimators", *later)]
    lacking = [name for name in names if name not in described]
    if lacking:
        raise InputError(f"model.json lacks {', '.join(lacking)}: it is of another version of sigdb; train it again")
    kept = {name: described[name] for name in names} | {"trained_on": tuple(described["trained_on"])}
    trained_range = described.get("trained_range")
    return Model(
        estimators=skops_estimators(content),
        trained_range=None if trained_range is None else TrainedRange.from_json(trained_range),
        columns=tuple(described.get("columns", ())),
        added=_as_mapping(described.get("added", {})),
        **kept,
    )


def _range_of_templates(model: Model, probe: Mapping[str, np.ndarray]) -> TrainedRange | None:
    """Return the range of a model of sigdb 0.1.0, which states none, as far as its templates and its probe show it."""
    banks = [bank for estimator in model.estimators.values() if (bank := estimator.template_bank) is not None]
    return TrainedRange.of_bank(banks[0], probe.get("averages", [])) if banks else None


def _answers(model: Model, rows: Batch) -> FloatArray:
    answers = model.estimator.answer(rows)
    return np.asarray(answers.predicted if answers.scores is None else answers.scores, float)


def _as_batch(model: Model, probe: Rows) -> Batch:
    reads = model.estimator.columns_read
    return Batch.from_rows(probe, reads & frozenset(getattr(probe, "columns", ())))


def _arrays(model: Model, rows: Batch) -> dict[str, np.ndarray]:
    """Return the columns that a model reads of rows of one tooth count, as arrays."""
    read = sorted(model.estimator.columns_read & frozenset(rows.table.columns))
    scalars = {name: rows.table[name].to_numpy() for name in read}
    arrays = {TSA: rows.tsa, CELLS: rows.features, BY_ORDER: rows.noise_by_order}
    return scalars | {name: matrix for name, by_teeth in arrays.items() if by_teeth for matrix in by_teeth.values()}


def _rows(arrays: Mapping[str, np.ndarray]) -> Batch:
    scalars = {name: array for name, array in arrays.items() if array.ndim == 1}
    (teeth,) = np.unique(arrays["teeth"])
    tsa, features, noise = ({int(teeth): arrays[name]} if name in arrays else None for name in (TSA, CELLS, BY_ORDER))
    return Batch(table=pd.DataFrame(scalars), tsa=tsa, features=features, noise_by_order=noise)
