"""A model as a folder: estimators without pickle, what they are, and a probe that is checked when they are loaded."""

import hashlib
import io
import json
import platform
import zipfile
import zlib
from collections.abc import Callable, Mapping
from dataclasses import fields
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import sklearn
import skops.io

from sigdb.core import DatabaseError, FloatArray, InputError, __version__, json_text
from sigdb.database import Store
from sigdb.recognition.estimators.registry import own_classes, trusted_types
from sigdb.recognition.evaluation import Evaluation
from sigdb.recognition.model import Model, few_rows
from sigdb.recognition.model_card import model_card
from sigdb.recognition.rows.batch import CELLS, TSA, Batch, Rows


def built_in_models() -> list[str]:
    """Return the names of the reference models that come with sigdb.

    Returns
    -------
    list of str

    Examples
    --------
    >>> from sigdb.recognition import built_in_models
    >>> built_in_models()
    ['nasa-location', 'nasa-severity']
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
    built_in = _built_in_folders()
    if folder.name not in built_in:
        raise InputError(
            f"{folder.name} is not a model folder, nor one of the reference models, "
            f"{', '.join(built_in) or 'of which there are none here'}; make a model with: sigdb train"
        )
    return built_in[folder.name]


def _built_in_folders() -> dict[str, Path]:
    packaged = Path(str(resources.files("sigdb"))) / "models"
    folder = packaged if packaged.is_dir() else Path(__file__).parents[2] / "models"
    return {path.parent.name: path.parent for path in sorted(folder.glob("*/model.json"))}


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
"""Errors that the readers of JSON, ZIP, skops and NPZ raise on damaged or foreign files."""

_PUBLIC = "sigdb.recognition"
"""Module that files name for the classes of sigdb: a public name outlives a move of the module that defines it."""


def save_model(model: Model, folder: str | Path, *, evaluation: Evaluation, probe: Rows, command: str) -> None:
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
    """
    store, rows = Store.at(folder), few_rows(_as_batch(model, probe))
    answers = io.BytesIO()
    arrays: dict[str, Any] = _arrays(model, rows)
    np.savez_compressed(answers, expected=_answers(model, rows), **arrays)
    files = {
        "model.skops": _with_modules(skops.io.dumps(model.estimators), lambda name: _PUBLIC),
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
    store.put("model.json", json_text(described).encode())
    store.put("README.md", model_card(model, evaluation, command=command).encode())


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
        described = json.loads((folder / "model.json").read_text(encoding="utf-8"))
        model = _rebuilt(described, _checked(folder, "model.skops", described))
        with np.load(io.BytesIO(_checked(folder, "probe.npz", described)), allow_pickle=False) as probe:
            expected = probe["expected"]
            answers = _answers(model, _rows({name: probe[name] for name in probe.files if name != "expected"}))
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


def _checked(folder: Path, name: str, described: dict[str, Any]) -> bytes:
    """Return the bytes of a file, if their hash is that in ``model.json``."""
    content = (folder / name).read_bytes()
    if hashlib.sha256(content).hexdigest() != described["sha256"][name]:
        raise ValueError(f"{name} is not the file that was saved with model.json")
    return content


def _with_modules(content: bytes, module_of: Callable[[str], str | None]) -> bytes:
    """Return the same model, with another module for each class of sigdb.

    Parameters
    ----------
    content
        A file that skops wrote. It names the module in which each class is defined.
    module_of
        From the name of a class, its module; None to leave it as it is.
    """

    def renamed(node: dict[str, object]) -> dict[str, object]:
        module, name = str(node.get("__module__", "")), str(node.get("__class__", ""))
        if module == _PUBLIC or module.startswith(f"{_PUBLIC}."):
            node["__module__"] = module_of(name) or module
        return node

    out = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(content)) as old, zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as new:
        for entry in old.infolist():
            data = old.read(entry)
            if entry.filename == "schema.json":
                data = json.dumps(json.loads(data, object_hook=renamed), indent=2).encode()
            new.writestr(entry.filename, data)
    return out.getvalue()


def _rebuilt(described: dict[str, Any], content: bytes) -> Model:
    """The model, of trusted types only."""
    names = [field.name for field in fields(Model) if field.name != "estimators"]
    lacking = [name for name in names if name not in described]
    if lacking:
        raise InputError(f"model.json lacks {', '.join(lacking)}: it is of another version of sigdb; train it again")
    content, trusted = _with_modules(content, own_classes().get), trusted_types()
    untrusted = set(skops.io.get_untrusted_types(data=content)) - set(trusted)
    if untrusted:
        raise InputError(f"the model holds types that are not trusted: {', '.join(sorted(untrusted))}")
    estimators = skops.io.loads(content, trusted=trusted)
    kept = {name: described[name] for name in names} | {"trained_on": tuple(described["trained_on"])}
    return Model(estimators=estimators, **kept)


def _answers(model: Model, rows: Batch) -> FloatArray:
    answers = model.estimator.answer(rows)
    return np.asarray(answers.predicted if answers.scores is None else answers.scores, float)


def _as_batch(model: Model, probe: Rows) -> Batch:
    reads = model.estimator.reads
    return Batch.from_rows(probe, reads & frozenset(getattr(probe, "columns", ())))


def _arrays(model: Model, rows: Batch) -> dict[str, np.ndarray]:
    """Return the columns that a model reads of rows of one tooth count, as arrays."""
    scalars = {name: rows.table[name].to_numpy() for name in model.estimator.reads & frozenset(rows.table.columns)}
    arrays = {TSA: rows.tsa, CELLS: rows.features}
    return scalars | {name: matrix for name, by_teeth in arrays.items() if by_teeth for matrix in by_teeth.values()}


def _rows(arrays: Mapping[str, np.ndarray]) -> Batch:
    scalars = {name: array for name, array in arrays.items() if array.ndim == 1}
    (teeth,) = np.unique(arrays["teeth"])
    tsa, features = ({int(teeth): arrays[name]} if name in arrays else None for name in (TSA, CELLS))
    return Batch(table=pd.DataFrame(scalars), tsa=tsa, features=features)
