"""TDMS, as LabVIEW writes it: channels of numbers, with their scales."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from sigdb.core.errors import InputError
from sigdb.core.typing import FloatArray
from sigdb.measurement.readers.contents import Column, Contents
from sigdb.measurement.readers.limits import bounded_bytes, check_columns, check_values
from sigdb.measurement.readers.tdms_segments import NUMBERS, Meta, Segment, segments, without_rest
from sigdb.measurement.recording_settings import RecordingSettings

FOREIGN: tuple[type[Exception], ...] = ()


def read_tdms(path: Path, settings: RecordingSettings) -> Contents:
    """Channels ``group/channel``, or ``channel`` where there is one group; ``variable`` is a group.

    The sampling rate is one over the property ``wf_increment``, the unit is ``unit_string``.
    """
    meta = Meta()
    pieces: dict[str, list[np.ndarray[Any, Any]]] = {}
    torn = False
    for segment in segments(memoryview(bounded_bytes(path)), meta):
        whole = without_rest(segment)
        torn = torn or len(whole.raw) < len(segment.raw)
        for name, values in _numbers(whole):
            pieces.setdefault(name, []).append(values)
    check_columns(len(pieces))
    check_values(sum(piece.size for all_of in pieces.values() for piece in all_of))
    names = _channel_names(pieces, settings.variable)
    if not names:
        raise InputError("holds no numbers" + (f" in a group {settings.variable!r}" if settings.variable else ""))
    columns = tuple(_column(names[path], pieces[path], meta.properties.get(path, {})) for path in names)
    notes = ("the last part is not whole and was left out",) if torn else ()
    return Contents(columns=columns, notes=notes)


def _numbers(segment: Segment) -> list[tuple[str, np.ndarray[Any, Any]]]:
    """The numbers of each object in a segment, which may repeat its chunk."""
    size = sum(index.size for _, index in segment.objects)
    if not size or not len(segment.raw):
        return []
    if segment.interleaved:
        return _interleaved(segment)
    chunks = np.frombuffer(segment.raw, np.uint8).reshape(-1, size)
    found, at = [], 0
    for name, index in segment.objects:
        if index.kind in NUMBERS and index.size:
            part = np.ascontiguousarray(chunks[:, at : at + index.size])
            found.append((name, part.reshape(-1).view(segment.order + NUMBERS[index.kind])))
        at += index.size
    return found


def _interleaved(segment: Segment) -> list[tuple[str, np.ndarray[Any, Any]]]:
    """One number of each object in turn."""
    kinds = [index.kind for _, index in segment.objects]
    if any(kind not in NUMBERS for kind in kinds):
        raise InputError("is damaged: other things than numbers are interleaved")
    check_columns(len(kinds))
    row = np.dtype([(f"f{i}", segment.order + NUMBERS[kind]) for i, kind in enumerate(kinds)])
    table = np.frombuffer(segment.raw, row, len(segment.raw) // row.itemsize)
    return [(name, table[f"f{i}"]) for i, (name, _) in enumerate(segment.objects)]


def _channel_names(paths: Mapping[str, Any], group: str | None) -> dict[str, str]:
    """What the channel of each path is called."""
    parts = {path: [part.replace("''", "'") for part in path.strip("/'").split("'/'")] for path in paths}
    chosen = {path: names for path, names in parts.items() if group in (None, names[0], "/".join(names))}
    one = len({names[0] for names in chosen.values()}) == 1
    return {path: "/".join(names[1:] if one and len(names) > 1 else names) for path, names in chosen.items()}


def _column(name: str, pieces: list[np.ndarray[Any, Any]], properties: Mapping[str, Any]) -> Column:
    values = pieces[0] if len(pieces) == 1 else np.concatenate(pieces)
    interval = properties.get("wf_increment")
    known = isinstance(interval, (int, float)) and 0 < interval < np.inf
    return Column(
        name=name,
        values=_scaled(name, values, properties),
        unit=str(properties.get("unit_string", "")),
        sampling_rate=1 / float(interval) if known and interval is not None else None,
    )


def _scaled(name: str, values: np.ndarray[Any, Any], properties: Mapping[str, Any]) -> np.ndarray[Any, Any]:
    """Stored numbers as physical ones: the polynomials that the properties name, one after the other."""
    scales = properties.get("NI_Number_Of_Scales", 0)
    if not isinstance(scales, int) or not scales or properties.get("NI_Scaling_Status", "unscaled") != "unscaled":
        return values
    if not 0 < scales <= 16:
        raise InputError(f"channel {name} has {scales} scales")
    for i in range(scales):
        if f"NI_Scale[{i}]_Scale_Type" in properties:
            values = _polynomial(name, i, properties)(values.astype(float))
    return values


def _polynomial(name: str, i: int, properties: Mapping[str, Any]) -> Any:
    kind = properties[f"NI_Scale[{i}]_Scale_Type"]
    source = properties.get(f"NI_Scale[{i}]_{kind}_Input_Source", i - 1)
    if kind == "Linear":
        keys = [f"NI_Scale[{i}]_Linear_Y_Intercept", f"NI_Scale[{i}]_Linear_Slope"]
    elif kind == "Polynomial":
        count = properties.get(f"NI_Scale[{i}]_Polynomial_Coefficients_Size", 4)
        keys = [f"NI_Scale[{i}]_Polynomial_Coefficients[{j}]" for j in range(count if 0 < int(count) <= 16 else 0)]
    else:
        raise InputError(f"channel {name} has a scale of kind {kind!r}, which is not read; save it as scaled numbers")
    if source not in (i - 1, 0xFFFFFFFF, -1) or not keys or any(not isinstance(properties.get(key), (int, float)) for key in keys):
        raise InputError(f"channel {name} has a scale that is not complete; save it as scaled numbers")
    coefficients: FloatArray = np.array([properties[key] for key in keys], dtype=float)
    return lambda x: np.polynomial.polynomial.polyval(x, coefficients)
