"""Estimators as the bytes of a skops file: equal ones have equal bytes, and only listed types are read."""

import hashlib
import io
import json
import warnings
import zipfile
from collections.abc import Callable, Iterator
from typing import Any, TypeAlias

import skops.io
from sklearn.exceptions import InconsistentVersionWarning

from sigdb.core import InputError
from sigdb.recognition.estimators.contract import Estimator
from sigdb.recognition.estimators.registry import own_classes, trusted_types
from sigdb.recognition.storage.boosted_trees import check_boosted_trees, forget_threads
from sigdb.recognition.storage.bounded_files import archive_members

Node: TypeAlias = dict[str, Any]
"""A node of the description that skops writes: of an object, with its class, content, identity and file."""

_SCHEMA = "schema.json"
_PUBLIC = "sigdb.recognition"
"""Module that files name for the classes of sigdb: a public name outlives a move of the module that defines it."""

_SCIKIT_LEARN = (
    "sklearn._loss.",
    "sklearn.discriminant_analysis.",
    "sklearn.ensemble._hist_gradient_boosting.",
    "sklearn.feature_selection.",
    "sklearn.isotonic.",
    "sklearn.linear_model.",
    "sklearn.pipeline.",
    "sklearn.preprocessing.",
)
"""Modules of scikit-learn whose classes a model may hold; skops trusts others too, with compiled trees and pointers."""

_BEGIN = (1980, 1, 1, 0, 0, 0)
"""Time of all members: the earliest that a ZIP can state."""


def skops_bytes(estimators: dict[str, Estimator]) -> bytes:
    """Return estimators as the content of ``model.skops``; the same bytes for equal ones.

    Skops names arrays and objects by their addresses in memory, and states the time. Here they are numbered in the
    order of the description, plain values and types by their content, and the time is left out.
    """
    forget_threads(estimators)
    members = archive_members("model.skops", skops.io.dumps(estimators))
    schema = json.loads(members.pop(_SCHEMA))
    for node in _nodes(schema):
        _set_module(node, lambda name: _PUBLIC)
    files = _renumber(schema, members)
    return _archive(files | {_SCHEMA: json.dumps(schema, separators=(",", ":")).encode()})


def skops_estimators(content: bytes) -> dict[str, Estimator]:
    """Return the estimators of ``model.skops``, of the types of the registry only.

    Raises
    ------
    InputError
        If it holds another type, more than models do, or trees that point outside their arrays.
    """
    members = archive_members("model.skops", content)
    schema, modules = json.loads(members.pop(_SCHEMA)), own_classes()
    for node in _nodes(schema):
        _set_module(node, modules.get)
    plain = _archive(members | {_SCHEMA: json.dumps(schema).encode()}, compression=zipfile.ZIP_STORED)
    trusted = trusted_types()
    unknown = {name for name in map(_type_name, _nodes(schema)) if name.startswith("sklearn.")}
    unknown = {name for name in unknown if not name.startswith(_SCIKIT_LEARN)}
    untrusted = unknown.union(skops.io.get_untrusted_types(data=plain)) - set(trusted)
    if untrusted:
        raise InputError(f"the model holds types that are not trusted: {', '.join(sorted(untrusted))}")
    with warnings.catch_warnings():
        # The answers on the probe show whether another version of scikit-learn gives the same ones.
        warnings.simplefilter("ignore", InconsistentVersionWarning)
        estimators: dict[str, Estimator] = skops.io.loads(plain, trusted=trusted)
    check_boosted_trees(estimators)
    return estimators


def _nodes(value: object) -> Iterator[Node]:
    """Yield the nodes of a description, each before those that it holds."""
    if isinstance(value, dict):
        if "__class__" in value:
            yield value
        for part in value.values():
            yield from _nodes(part)
    elif isinstance(value, list):
        for part in value:
            yield from _nodes(part)


def _type_name(node: Node) -> str:
    return f"{node.get('__module__', '')}.{node['__class__']}"


def _set_module(node: Node, module_of: Callable[[str], str | None]) -> None:
    """Set the module of a class of sigdb; leave it where there is none."""
    module = str(node.get("__module__", ""))
    if module == _PUBLIC or module.startswith(f"{_PUBLIC}."):
        node["__module__"] = module_of(str(node["__class__"])) or module


def _renumber(schema: Node, members: dict[str, bytes]) -> dict[str, bytes]:
    """Number the objects and files of a description; return the files by their new names, in order."""
    numbers: dict[object, int] = {}
    files: dict[str, bytes] = {}
    for node in _nodes(schema):
        if "__id__" in node:
            # Whether equal plain values are one object depends on the interpreter.
            shared = json.dumps([node["__class__"], node["__module__"], node.get("content")])
            key = shared if node["__loader__"] in ("JsonNode", "TypeNode") else node["__id__"]
            node["__id__"] = numbers.setdefault(key, len(numbers) + 1)
        if "file" in node:
            data = members[node["file"]]
            node["file"] = f"{hashlib.sha256(data).hexdigest()[:32]}.npy"
            files[node["file"]] = data
    return files


def _archive(members: dict[str, bytes], *, compression: int = zipfile.ZIP_DEFLATED) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", compression) as archive:
        for name, data in members.items():
            entry = zipfile.ZipInfo(name, _BEGIN)
            entry.compress_type, entry.create_system = compression, 3
            archive.writestr(entry, data)
    return out.getvalue()
