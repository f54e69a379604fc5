"""Tables and values in the user's cache, read whole as they were written, or not at all."""

import base64
import hashlib
import json
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa

from sigdb.core import Answer, Note, __version__, publish
from sigdb.database import cache_folder
from sigdb.diagnosis import LevelChange, Power
from sigdb.monitoring.alarms import ChangePoint, LevelReference, Trend
from sigdb.monitoring.tooth_growth import ToothGrowth
from sigdb.prognosis import RemainingLife

_VALUES = b"values"
"""Key of the metadata that holds the values."""

_SEAL = 32
"""Bytes of the SHA-256 before the table, since Arrow may crash on a damaged file."""

_KIND, _TABLE = "kept kind", "table"
"""Key that names the kind of a value, and the kind of a table."""

_CLASSES = {
    each.__name__: each
    for each in (Answer, ChangePoint, LevelChange, LevelReference, Note, Power, RemainingLife, ToothGrowth, Trend)
}
"""Classes of values that are kept."""


def kept_place(kind: str, *source: object) -> Path:
    """Return the file of a table in the user's cache, by its kind and all that it depends on; so does this version."""
    text = json.dumps([__version__, *source], sort_keys=True)
    return cache_folder() / f"monitor-{kind}-{hashlib.sha256(text.encode()).hexdigest()[:32]}.arrow"


def kept_table(place: Path) -> tuple[pa.Table | None, Any]:
    """Return the table in a file and its values; None twice where there is no file, or it is not whole."""
    try:
        content = memoryview(place.read_bytes())
        if hashlib.sha256(content[_SEAL:]).digest() != content[:_SEAL]:
            return None, None
        with pa.ipc.open_file(pa.BufferReader(content[_SEAL:])) as file:
            table = file.read_all()
        return table, values_of(table.schema.metadata[_VALUES].decode())
    except (OSError, KeyError, TypeError, ValueError):  # absent, or of other classes of results
        return None, None


def keep_table(place: Path, table: pa.Table, values: object) -> None:
    """Write a table and values; a cache that cannot be written costs time only."""
    sink = pa.BufferOutputStream()
    marked = table.combine_chunks().replace_schema_metadata({_VALUES: text_of(values)})
    with pa.ipc.new_file(sink, marked.schema) as writer:
        writer.write_table(marked)
    with suppress(OSError):
        content = sink.getvalue()
        publish(place, hashlib.sha256(content).digest() + content.to_pybytes())


def list_column(rows: np.ndarray) -> pa.ListArray:
    """Return a matrix as a column of lists."""
    ends = np.arange(len(rows) + 1, dtype=np.int32) * rows.shape[1]
    return pa.ListArray.from_arrays(pa.array(ends), pa.array(rows.ravel()))


def text_of(values: object) -> str:
    """Return values as JSON text: plain ones, arrays, tables, and the classes of results."""
    return json.dumps(values, default=_tagged)


def values_of(text: str) -> Any:
    """Return the values that :func:`text_of` wrote; a tuple comes back as a list."""
    return json.loads(text, object_hook=_untagged)


def _tagged(value: object) -> object:
    if isinstance(value, np.ndarray):
        return _marked(value.dtype.str, base64.b64encode(value.tobytes()).decode())
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, pd.DataFrame):
        return _marked(_TABLE, value.to_dict("list"))
    if isinstance(value, Mapping):
        return dict(value)
    if is_dataclass(value) and type(value).__name__ in _CLASSES:
        return _marked(type(value).__name__, {each.name: getattr(value, each.name) for each in fields(value)})
    raise TypeError(f"{type(value).__name__} is not kept")


def _marked(kind: str, content: object) -> dict[str, object]:
    return {_KIND: kind, "content": content}


def _untagged(content: dict[str, Any]) -> object:
    kind = content.get(_KIND)
    if kind is None:
        return content
    if kind == _TABLE:
        return pd.DataFrame(content["content"])
    if kind in _CLASSES:
        return _CLASSES[kind](**content["content"])
    return np.frombuffer(base64.b64decode(content["content"]), dtype=kind)
