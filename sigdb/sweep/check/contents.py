"""Comparison of a part's contents with its plan: parameters, results where the status is ``ok``, nulls elsewhere."""

import math
from collections.abc import Iterable, Iterator, Mapping

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from sigdb.core import NOISE_BLOCK, BoolArray, IntArray
from sigdb.database import DIGESTS, Receipt
from sigdb.signature import FEATURES
from sigdb.sweep.plan.plan import Plan

_WITHOUT_RESULT = ("min_compression", "min_mesh_force", "contact_loss")
"""Columns that may have a value in a row without a result."""

_NULL = -1
"""Length of a list that is null."""

Fault = tuple[str, str]
"""A table, and a sentence about an error in it."""


def check_row_contents(plan: Plan, receipt: Receipt, files: Mapping[str, pq.ParquetFile]) -> Iterator[Fault]:
    """Yield the errors in the values of a part of rows."""
    features = files["features"].read()
    cases = plan.table(receipt.first, receipt.first + receipt.rows)
    ids, ok = cases["id"].to_numpy(), _ok(features)
    yield from _each("features", _wrong_count(receipt, ok))
    yield from _each("features", _wrong_codes(features, ids))
    planned = {str(name): cases[name].to_numpy() for name in cases}
    # An average of a mesh that loses contact has no index errors in it.
    lost = ok & pc.fill_null(features["contact_loss"], False).to_numpy()
    planned["index_error"] = np.where(lost, 0.0, planned["index_error"])
    yield from _each("features", _wrong_parameters(features, planned, ids))
    yield from _each("features", _wrong_numbers(features, planned, ids, ok))
    yield from _each("features", _wrong_lists(features, _row_lengths(plan, cases["teeth"].to_numpy(), ok), ids))
    at = 0
    for group in range(files["signals"].num_row_groups):
        signals = files["signals"].read_row_group(group)
        here = slice(at, at := at + signals.num_rows)
        lengths = _row_lengths(plan, cases["teeth"].to_numpy()[here], ok[here])
        yield from _each("signals", _wrong_parameters(signals, {"id": ids[here]}, ids[here]))
        yield from _each("signals", _wrong_lists(signals, lengths, ids[here]))


def check_digests(plan: Plan, receipt: Receipt, files: Mapping[str, pq.ParquetFile]) -> Iterator[Fault]:
    """Yield the errors in the digests of a virtual part: each block of rows must have those of all columns."""
    table = files[DIGESTS].read(columns=["first", "column"])
    columns = table["column"].unique().to_pylist()
    due = list(range(receipt.first, receipt.first + receipt.rows, NOISE_BLOCK))
    if not {"id", "status", "tsa"}.issubset({name.partition("__")[0] for name in columns}):
        yield DIGESTS, "has no digests of some columns of the rows"
    if table["first"].to_pylist() != [first for first in due for _ in columns]:
        yield (
            DIGESTS,
            f"has not the digests of the blocks of rows {receipt.first} to {receipt.first + receipt.rows - 1}",
        )
    elif table["column"].to_pylist() != columns * len(due):
        yield DIGESTS, "has digests of other columns in some blocks"


def check_template_contents(plan: Plan, receipt: Receipt, files: Mapping[str, pq.ParquetFile]) -> Iterator[Fault]:
    """Yield the errors in the values of a part of templates."""
    table = files["templates"].read()
    numbers = np.arange(receipt.first, receipt.first + receipt.rows)
    cases = [
        {"template": number, "tooth": plan.case(number).damage.tooth, **plan.case_columns(number)}
        for number in numbers.tolist()
    ]
    parameters = {name: np.array([case[name] for case in cases], dtype=object) for name in cases[0]}
    yield from _each("templates", _wrong_count(receipt, _ok(table)))
    yield from _each("templates", _wrong_codes(table, numbers))
    yield from _each("templates", _wrong_parameters(table, parameters, numbers))
    yield from _each(
        "templates", _wrong_numbers(table, [*parameters, "least_elsewhere", "least_force_elsewhere"], numbers, None)
    )
    yield from _each("templates", _wrong_lists(table, _template_lengths(plan, table, numbers), numbers))


def doubtful_rows(features: pq.ParquetFile) -> IntArray:
    """Return the places of rows whose result lacks a number.

    That is right for a quotient whose denominator is 0, and wrong otherwise. Only a second computation of the row
    decides.
    """
    results = [field.name for field in features.schema_arrow if pa.types.is_float32(field.type)]
    table = features.read(columns=["status", *results])
    missing = np.any([table[name].is_null().to_numpy() for name in results], axis=0)
    return np.flatnonzero(missing & _ok(table))


def _each(table: str, sentences: Iterable[str]) -> Iterator[Fault]:
    return ((table, sentence) for sentence in sentences)


def _ok(table: pa.Table) -> BoolArray:
    return np.array([status == "ok" for status in table["status"].to_pylist()], dtype=bool)


def _wrong_count(receipt: Receipt, ok: BoolArray) -> Iterator[str]:
    if receipt.failed != (~ok).sum():
        yield f"has {(~ok).sum()} rows without a result, its receipt says {receipt.failed}"


def _wrong_codes(table: pa.Table, numbers: IntArray) -> Iterator[str]:
    """Yield a sentence if the code of a status is not that of a result where there is one, or the other way round."""
    if "status_code" not in table.schema.names:
        return  # of an earlier version
    codes = table["status_code"].to_pylist()
    wrong = np.array([not code or (code == "ok") != ok for code, ok in zip(codes, _ok(table), strict=True)], dtype=bool)
    if wrong.any():
        row = int(np.argmax(wrong))
        yield f"status_code of row {numbers[row]} is {codes[row]!r}, its status is {table['status'][row].as_py()!r}"


def _wrong_parameters(table: pa.Table, planned: Mapping[str, np.ndarray], numbers: IntArray) -> Iterator[str]:
    """Yield a sentence for each column that differs from the plan, with its first row that differs."""
    for name, values in planned.items():
        stored, due = table[name], pa.array(values, table.schema.field(name).type, from_pandas=True)
        same = pc.fill_null(pc.equal(stored, due), False).to_numpy()
        same |= stored.is_null().to_numpy() & due.is_null().to_numpy(zero_copy_only=False)
        if not same.all():
            row = int(np.argmin(same))
            yield f"{name} of row {numbers[row]} is {stored[row].as_py()!r}, by the recipe {due[row].as_py()!r}"


def _wrong_numbers(table: pa.Table, left_out: Iterable[str], numbers: IntArray, ok: BoolArray | None) -> Iterator[str]:
    """Yield a sentence for each column of results with a number that is not finite, or in a row without a result."""
    for field in table.schema:
        if not pa.types.is_floating(field.type) or field.name in left_out:
            continue
        missing = table[field.name].is_null().to_numpy()
        wrong = ~missing & ~np.isfinite(table[field.name].to_numpy())
        if ok is not None and field.name not in _WITHOUT_RESULT:
            wrong |= ~missing & ~ok
        if wrong.any():
            row = int(np.argmax(wrong))
            yield f"{field.name} of row {numbers[row]} is {table[field.name][row].as_py()!r}"


def _wrong_lists(table: pa.Table, lengths: Mapping[str, IntArray], numbers: IntArray) -> Iterator[str]:
    """Yield a sentence for each column of lists with a list too many or too few, of another length, or not finite."""
    for name, due in lengths.items():
        for column in (stored for stored in table.schema.names if stored.partition("__")[0] == name):
            length = pc.fill_null(pc.list_value_length(table[column]), _NULL).to_numpy()
            if (length != due).any():
                row = int(np.argmax(length != due))
                yield f"{column} of row {numbers[row]} {_length(length[row])}, by the recipe it {_length(due[row])}"
                continue
            values = pc.list_flatten(table[column])
            wrong = ~np.isfinite(values.to_numpy())  # a null becomes nan
            if wrong.any():
                row = int(pc.list_parent_indices(table[column])[int(np.argmax(wrong))].as_py())
                yield f"{column} of row {numbers[row]} holds a value that is no finite number"


def _length(values: int) -> str:
    return "is null" if values == _NULL else f"has {values} values"


def _row_lengths(plan: Plan, teeth: IntArray, ok: BoolArray) -> dict[str, IntArray]:
    """Return the number of values that each list of a row must have."""
    step = plan.signature.samples_per_tooth
    counts, which = np.unique(teeth, return_inverse=True)
    due = {"tsa": teeth * step, "noise": teeth * step // 2 + 1} | {
        name: np.array([math.prod(feature.shape(teeth=z, n=z * step)) for z in counts.tolist()])[which]
        for name, feature in FEATURES.items()
        if feature.axes
    }
    return {name: np.where(ok, values, _NULL) for name, values in due.items()}


def _template_lengths(plan: Plan, table: pa.Table, numbers: IntArray) -> dict[str, IntArray]:
    """Return the number of values that each list of a template must have; without contact it has no responses."""
    points = [plan.rig_points[plan.case(number).rig_point] for number in numbers.tolist()]
    teeth = np.array([point.teeth for point in points])
    n = teeth * plan.signature.samples_per_tooth
    period = n * np.array([point.revolutions for point in points])
    orders = pc.fill_null(pc.list_value_length(table["orders"]), 0).to_numpy()
    ok = _ok(table)
    linear = ok & ~pc.fill_null(table["contact_loss"], False).to_numpy()
    whole = {"tsa": n, "compression": period, "mesh_force": period, "orders": orders}
    responses = {
        "compression_response": period * teeth,
        "compression_harmonic": period * orders * 2,
        "mesh_force_response": period * teeth,
        "mesh_force_harmonic": period * orders * 2,
        "specimen_response": n * teeth,
        "harmonic_response": n * orders * 2,
    }
    responses |= {name: _whole_modes(table, name, n) for name in table.schema.names if name == "nuisance_modes"}
    if "nuisance_counts" in table.schema.names:
        responses["nuisance_counts"] = np.full(len(n), len(plan.nuisance.each))
    return {name: np.where(ok, values, _NULL) for name, values in whole.items()} | {
        name: np.where(linear, values, _NULL) for name, values in responses.items()
    }


def _whole_modes(table: pa.Table, name: str, n: IntArray) -> IntArray:
    """Return the number of values that modes must have: as many as they have, if that is a multiple of n."""
    stored = pc.fill_null(pc.list_value_length(table[name]), _NULL).to_numpy()
    return np.where((stored == _NULL) | (stored % n == 0), stored, n)
