"""Findings of inspections, which become labels of the rows before them."""

import re
from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import Any, Self

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from pydantic import Field, model_validator

from sigdb.core import BoolArray, InputError
from sigdb.database import (
    CheckedParquet,
    Receipt,
    Store,
    part_name,
    read_manifest,
    read_receipts,
    revision_of,
    sealed_json,
    unsealed,
    write_again,
)
from sigdb.ingest.facts.recording_facts import LABELS, RecordingFacts
from sigdb.ingest.facts.recording_table import read_table
from sigdb.sweep import check_version, ownership_of

_FOLDER = "inspections"


class Finding(RecordingFacts):
    """A finding of an inspection: the labels of a machine's, a gear's or a specimen's rows up to its date.

    A finding of certain files needs no date: it then holds for all of their rows.
    """

    file: str = Field(
        default="", description="Name of the recordings that alone the finding is of, * for any text; all if left out."
    )
    since: str | None = Field(
        default=None,
        description="Date from which on the finding holds; that of the inspection before it of the same machine, gear, "
        "sensor and specimen if left out.",
    )

    @model_validator(mode="after")
    def _has_a_date(self) -> Self:
        if self.date is None and not self.file:
            raise ValueError("date is missing: a finding holds for the rows up to its date, unless it names their file")
        if self.date and self.since and self.since > self.date:
            raise ValueError(f"since = {self.since!r} is after date = {self.date!r}")
        return self

    @property
    def subject(self) -> dict[str, str]:
        """Columns by which the rows are selected, with their values."""
        names = {
            "file": "recording",
            "machine": "machine",
            "specimen": "specimen_name",
            "gear": "gear",
            "sensor": "sensor",
        }
        return {column: value for name, column in names.items() if (value := getattr(self, name))}

    @property
    def found_labels(self) -> dict[str, str | int | float | None]:
        """The labels; they were inspected unless the table says otherwise."""
        return self.labels | {"label_trust": self.label_trust or "inspected"}

    def holds_for(self, rows: pa.Table) -> BoolArray:
        """Return whether it holds for each row."""
        holds = np.ones(rows.num_rows, bool)
        for column, value in self.subject.items():
            holds &= _is(rows[column], value)
        for side, limit in (("since", self.since), ("date", self.date)):
            if limit is None:
                continue
            dates = np.array([date or "" for date in rows["date"].to_pylist()], dtype=object)
            # A day holds all of its times.
            holds &= [
                bool(date) and (date[: len(limit)] <= limit if side == "date" else date >= limit) for date in dates
            ]
        return holds


def _is(column: pa.ChunkedArray, value: str) -> BoolArray:
    """Return whether each text of a column is a value, in which * stands for any text."""
    expression = ".*".join(map(re.escape, value.split("*")))
    return np.array([re.fullmatch(expression, text or "", re.DOTALL) is not None for text in column.to_pylist()], bool)


def enter_findings(location: str | PathLike[str], table: str | PathLike[str]) -> int:
    """Enter the findings of inspections: they become labels of the rows before them.

    Parameters
    ----------
    location : str or path-like
        A database of recordings.
    table : str or path-like
        CSV file with a line for each finding: ``date``, ``since``, and what selects the rows (``machine``,
        ``specimen``, ``gear``, ``sensor``, ``file``) and labels them (``tooth``, ``kind``, ``severity`` and others). A
        finding with a ``file`` needs no date, and a * in it stands for any text.

    Returns
    -------
    int
        Number of rows whose labels have changed.

    Raises
    ------
    InputError
        If a finding is wrong, or there is no such database.
    DatabaseError
        If another process works on the database, or a part is damaged.
    """
    store = Store.at(location)
    findings = read_table(Path(table), Finding)
    if not findings:
        raise InputError(f"{table}: has no finding; give a line for each")
    with ownership_of(store):
        manifest = read_manifest(store)
        if not manifest.is_measured:
            raise InputError(f"{store} is the database of a sweep, whose labels are exact")
        check_version(store, manifest.sigdb_version)
        earlier = read_findings(store)
        new = [each.model_dump(mode="json", exclude_none=True) for each in _since(findings, earlier)]
        entered = [each.model_dump(mode="json", exclude_none=True) for each in earlier]
        if new != entered[-len(new) :]:  # else the command was stopped after it had entered them
            store.put(f"{_FOLDER}/{len(finding_files(store)):05d}.json", sealed_json({"findings": new}))
        return apply_findings(store)


def _since(findings: Sequence[Finding], earlier: Sequence[Finding]) -> list[Finding]:
    """Return findings that begin after the inspection before them of the same subject."""
    results: list[Finding] = []
    for each in sorted(findings, key=lambda finding: finding.date or ""):
        before = [other.date for other in (*earlier, *results) if other.subject == each.subject and other.date]
        before = [date for date in before if each.date and date < each.date]
        if each.since is None and each.date and before:
            each = each.model_copy(update={"since": _after(max(before))})
        results.append(each)
    return results


def _after(date: str) -> str:
    """Return the text that follows all times of a date: rows of the day of an inspection are before it."""
    return f"{date}~"


def finding_files(store: Store) -> list[str]:
    """Return the names of the files with findings, in the order of their entry."""
    return [name for name in sorted(store.sizes(_FOLDER)) if re.fullmatch(rf"{_FOLDER}/\d+\.json", name)]


def read_findings(store: Store) -> list[Finding]:
    """Return all findings that were entered, in order.

    Raises
    ------
    DatabaseError
        If one is damaged.
    """
    contents: list[dict[str, Any]] = [
        unsealed(store.get(name), name=store.name_of(name)) for name in finding_files(store)
    ]
    return [Finding.model_construct(**finding) for content in contents for finding in content["findings"]]


def with_findings(features: pa.Table, findings: Sequence[Finding]) -> pa.Table:
    """Return rows with the labels of the findings that hold for them; the last one counts."""
    for finding in findings:
        holds = finding.holds_for(features)
        if not holds.any():
            continue
        for name in LABELS:
            at = features.schema.get_field_index(name)
            field = features.schema.field(at)
            value = pa.scalar(finding.found_labels[name], field.type)
            features = features.set_column(at, field, pc.if_else(pa.array(holds), value, features[name]))
    return features


def apply_findings(store: Store) -> int:
    """Write the parts again whose rows lack labels of findings, and return the number of these rows."""
    findings = read_findings(store)
    manifest, changed = read_manifest(store), 0
    for receipt in read_receipts(store, "rows", {plan.hash for plan in manifest.plans}) if findings else ():
        rows = CheckedParquet(store, receipt.file("features")).read()
        labelled = with_findings(rows, findings)
        differs = np.zeros(rows.num_rows, bool)
        for name in LABELS:
            old, new = rows[name].to_pylist(), labelled[name].to_pylist()
            differs |= [a != b for a, b in zip(old, new, strict=True)]
        if differs.any():
            receipt = write_again(store, receipt, "features", labelled)
            changed += int(differs.sum())
        _delete_earlier(store, receipt)
    return changed


def _delete_earlier(store: Store, receipt: Receipt) -> None:
    """Delete earlier files of a part's features, which a stopped command has left."""
    for revision in range(revision_of(receipt.file("features").path)):
        store.delete(part_name("features", receipt.part, revision))
