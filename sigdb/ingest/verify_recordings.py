"""Verification of a database of recordings, and repair: damaged parts are made again from the recordings."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from functools import partial
from os import PathLike
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from sigdb.core import DatabaseError, OnProgress, Progress, ignore
from sigdb.database import (
    MANIFEST_FILE,
    SCHEMA_FILE,
    TABLES_OF,
    AddedCheck,
    IntegrityFinding,
    Manifest,
    PartKey,
    Receipt,
    Schema,
    Store,
    check_added,
    check_open_tables,
    damaged_part,
    foreign_files,
    has_own_files,
    log_files,
    read_all_receipts,
    read_manifest,
    read_part,
    read_schema,
    receipt_name,
    write_schema,
)
from sigdb.ingest.findings import finding_files, read_findings
from sigdb.ingest.ingest_recordings import run_plans
from sigdb.ingest.plan import MOVES_FILE, PART_ROWS, IngestPlan, stored_plans
from sigdb.ingest.recorded_rows import sha256_of
from sigdb.ingest.row_parts import part_pieces
from sigdb.ingest.schema import measured_schema
from sigdb.sweep import Processes, Repair, repair_by

_Files = dict[str, pq.ParquetFile]


def verify(
    location: str | PathLike[str], *, deep: bool = False, sample: int = 8, on_progress: OnProgress = ignore
) -> tuple[IntegrityFinding, ...]:
    """Return everything in a database of recordings that is not as it should be; nothing is changed.

    Parameters
    ----------
    location : str or path-like
        Directory of the database, or its place in an object store.
    deep : bool
        Whether to read the recordings again: each must have the SHA-256 of its rows, and a sample of parts is made
        again and compared bit for bit. Statuses, ids and numbers of all rows are checked too.
    sample : int
        Number of parts that ``deep`` makes again, spread evenly.
    on_progress : callable
        Called with a :class:`sigdb.core.Progress` as files are checked, with the stage ``files``.

    Returns
    -------
    tuple of IntegrityFinding
        Empty for a database that is finished and whole.

    Raises
    ------
    InputError
        If there is no database.
    """
    store = Store.at(location)
    try:
        plans = stored_plans(read_manifest(store).plans, store)
    except DatabaseError as error:
        return (_description(MANIFEST_FILE, f"or the list of recordings is damaged: {error}"),)
    schema, findings = _schema(store)
    owners: dict[PartKey, IngestPlan] = {("rows", part): plan for plan in plans for part in plan.row_part_numbers}
    receipts, damaged = read_all_receipts(store)
    findings += [each for each in damaged if each.key in owners]
    for key, receipt in receipts.items():
        if key in owners and not _fits(receipt, owners[key]):
            findings.append(damaged_part(key, receipt.path, "the receipt is not that of the recordings of the part"))
    begun = {*receipts, *(each.key for each in damaged)}
    findings += _unfinished(owners, begun)
    expected = {file.path for key, receipt in receipts.items() if key in owners for file in receipt.files}
    expected |= {plan.list_name for plan in plans} | set(finding_files(store)) | {MOVES_FILE}
    added = AddedCheck.of(store)
    expected |= {*added.files, *log_files(store)}
    findings += foreign_files(store, [*owners, *added.parts([part for _, part in owners])], expected)
    whole: dict[PartKey, _Files] = {}
    mine = {key: receipt for key, receipt in receipts.items() if key in owners and _fits(receipt, owners[key])}
    for number, (key, receipt) in enumerate(mine.items(), start=1):
        files, wrong = read_part(store, receipt, schema)
        if deep and not wrong:
            wrong = list(_wrong_contents(receipt, files))
        findings += [damaged_part(key, file, what) for file, what in wrong]
        if not wrong:
            whole[key] = files
        on_progress(Progress(stage="files", done=number, total=len(mine), before=0))
    if deep:
        for key, files in whole.items():
            findings += _changed_recordings(owners[key], key[1], files["features"])
        findings += _remade(store, owners, whole, schema, sample)
    findings += check_added(added, {part: receipt for (_, part), receipt in mine.items()}, deep=deep, sample=sample)
    findings += check_open_tables(store, mine.values())
    return tuple(findings)


def repair(
    location: str | PathLike[str],
    *,
    deep: bool = False,
    sample: int = 8,
    jobs: int = -1,
    on_progress: OnProgress = ignore,
) -> Repair:
    """Make damaged and missing parts again from the recordings.

    A damaged part of which a recording is gone stays as it is, and is among the findings that are left.

    Parameters
    ----------
    location : str or path-like
        Directory of the database, or its place in an object store.
    deep, sample
        As in :func:`verify`.
    jobs : int
        Number of worker processes; -1 for one on each core.
    on_progress : callable
        Called with a :class:`sigdb.core.Progress` as files are checked and parts are made.

    Returns
    -------
    Repair
        The findings before and after.

    Raises
    ------
    InputError
        If there is no database, or another version of sigdb made it.
    DatabaseError
        If another process works on the database, or it cannot be written.
    """
    store, engine = Store.at(location), Processes(jobs)

    def make_again(manifest: Manifest, damaged: Collection[PartKey], schema_is_damaged: bool) -> None:
        if schema_is_damaged:
            write_schema(measured_schema(), store)
        plans = stored_plans(manifest.plans, store)
        for stage, part in damaged:
            if stage != "rows" or _can_be_read(plans, part):
                store.delete(receipt_name(stage, part))
        run_plans(plans, store, engine, on_progress)

    check = partial(verify, location, deep=deep, sample=sample, on_progress=on_progress)
    return repair_by(make_again, check, store, engine, on_progress)


def _can_be_read(plans: Sequence[IngestPlan], part: int) -> bool:
    """Return whether all recordings of a part are where they were: without them its rows would have no result."""
    of_part = (each for plan in plans if part in plan.row_part_numbers for each in plan.recordings_of(part))
    return all(Path(each.path).is_file() for each in of_part)


def _description(file: str, what: str) -> IntegrityFinding:
    remedy = "put it back from a copy" if file == MANIFEST_FILE else "write it again with --repair"
    return IntegrityFinding(kind="damage", file=file, what=what, remedy=remedy)


def _schema(store: Store) -> tuple[Schema | None, list[IntegrityFinding]]:
    try:
        return read_schema(store), []
    except DatabaseError as error:
        return None, [_description(SCHEMA_FILE, f"is damaged ({error})")]


def _fits(receipt: Receipt, plan: IngestPlan) -> bool:
    return receipt.plan == plan.hash and receipt.first == receipt.part * PART_ROWS and has_own_files(receipt)


def _unfinished(owners: Mapping[PartKey, IngestPlan], begun: set[PartKey | None]) -> Iterator[IntegrityFinding]:
    missing = [part for stage, part in owners if (stage, part) not in begun]
    if missing:
        yield IntegrityFinding(
            kind="unfinished",
            file="",
            what=f"{len(missing)} of {len(owners)} parts of rows are not made yet, the first is {missing[0]}",
            remedy="go on with the command that began it, or make them with --repair",
        )


def _wrong_contents(receipt: Receipt, files: _Files) -> Iterator[tuple[str, str]]:
    """Yield the files of a part with wrong ids, statuses, or numbers that are not finite, with what is wrong."""
    names = dict(zip(TABLES_OF[receipt.name], (file.path for file in receipt.files), strict=True))
    ids = np.arange(receipt.first, receipt.first + receipt.rows)
    for table, file in files.items():
        rows = file.read()
        if not np.array_equal(rows["id"].to_numpy(), ids):
            yield names[table], "its ids do not follow each other"
        for field in rows.schema:
            values = pc.list_flatten(rows[field.name]) if pa.types.is_list(field.type) else rows[field.name]
            if pa.types.is_floating(values.type) and pc.all(pc.is_finite(pc.drop_null(values))).as_py() is False:
                yield names[table], f"column {field.name} holds a value that is no finite number"
        if table == "features":
            ok = pc.equal(rows["status"], "ok")
            if pc.any(pc.not_equal(ok, pc.equal(rows["status_code"], "ok"))).as_py():
                yield names[table], "status and status_code of a row do not agree"
            if pc.any(pc.and_(ok, pc.is_null(rows["scatter"]))).as_py():
                yield names[table], "a row whose status is ok has no result"


def _changed_recordings(plan: IngestPlan, part: int, features: pq.ParquetFile) -> Iterator[IntegrityFinding]:
    """Yield a finding for each recording that is gone, or whose content is not that of its rows."""
    rows = features.read(columns=["recording", "sha256"]).group_by("recording").aggregate([("sha256", "min")])
    stored = dict(zip(rows["recording"].to_pylist(), rows["sha256_min"].to_pylist(), strict=True))
    for recording in plan.recordings_of(part):
        now = sha256_of(Path(recording.path))
        if now == stored.get(recording.name):
            continue
        gone = "is gone" if now is None else "is not the file that was ingested: its SHA-256 is another one"
        yield IntegrityFinding(
            kind="damage",
            file=recording.path,
            what=gone,
            remedy="put it back from a copy; its rows are as they were made",
        )


def _remade(
    store: Store,
    owners: Mapping[PartKey, IngestPlan],
    whole: Mapping[PartKey, _Files],
    schema: Schema | None,
    sample: int,
) -> Iterator[IntegrityFinding]:
    """Yield a finding for each of some parts that differs from what the recordings give now."""
    if schema is None or not whole or not sample:
        return
    findings, keys = read_findings(store), list(whole)
    for at in np.unique(np.linspace(0, len(keys) - 1, min(sample, len(keys))).round().astype(int)):
        key = keys[at]
        if any(_changed_recordings(owners[key], key[1], whole[key]["features"])):
            continue
        pieces = list(part_pieces(owners[key], schema, findings, key[1]))
        for table, file in whole[key].items():
            if not pa.concat_tables([piece[table] for piece in pieces]).equals(file.read()):
                yield damaged_part(key, f"{table}, part {key[1]}", "is not what its recordings give")
