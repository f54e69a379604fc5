"""Whether a database is whole and right, and making damaged parts again from the recipe in it."""

from bisect import bisect_left
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import groupby
from os import PathLike

import pyarrow.parquet as pq

from sigdb.core import OnProgress, Progress, ignore
from sigdb.database import (
    KINDS,
    MANIFEST_FILE,
    SCHEMA_FILE,
    TABLES_OF,
    IntegrityFinding,
    PartKey,
    Receipt,
    Schema,
    Store,
    damaged_part,
    foreign_files,
    part_name,
    read_all_receipts,
    read_file,
    read_manifest,
    receipt_name,
)
from sigdb.sweep.check.contents import doubtful_rows, wrong_rows, wrong_templates
from sigdb.sweep.check.descriptions import Owners, check_descriptions
from sigdb.sweep.check.remake import differing_parts
from sigdb.sweep.plan.make_plan import plan_from
from sigdb.sweep.plan.plan import Plan
from sigdb.sweep.work.describe_database import check_version
from sigdb.sweep.work.engines import Processes
from sigdb.sweep.work.ownership import ownership_of
from sigdb.sweep.work.run import run_parts
from sigdb.sweep.work.stored_schema import keep_schema


def verify(
    location: str | PathLike[str],
    *,
    deep: bool = False,
    sample: int = 8,
    on_progress: OnProgress = ignore,
) -> tuple[IntegrityFinding, ...]:
    """Look for anything in a database that is not as it should be; nothing is changed.

    Every byte of every file is read: descriptions and receipts are compared with their seals, parts with their
    receipts (size, SHA-256), their columns with the schema, parts and descriptions with the plan that the recipe in
    ``sigdb.toml`` gives, and what is none of the database's is named. So any flipped byte is found, any missing file
    and any foreign one.

    Parameters
    ----------
    location
        The database's directory, or its place in an object store.
    deep
        Decode all values, too: ids, parameters and labels must be the recipe's, results finite numbers where the status
        is ``ok`` and null where it is not; and a sample is made again and compared bit for bit.
    sample
        How many templates, and how many blocks of 256 rows, ``deep`` makes again, spread evenly over the database.
    on_progress
        Called as files are checked, with the stage ``files``.

    Returns
    -------
    tuple of Finding
        Empty for a database that is finished and whole.

    Raises
    ------
    InputError
        If there is no database.

    Examples
    --------
    >>> from sigdb.sweep import verify
    >>> verify("nowhere")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    sigdb.core.errors.InputError: nowhere is not a sigdb database (it has no sigdb.toml); make one with: ...
    """
    return _found(Store.at(location), deep, sample, on_progress)


@dataclass(frozen=True, kw_only=True)
class Repair:
    """What a repair found, and what is left of it.

    Attributes
    ----------
    found
        Findings before.
    left
        Findings after.
    """

    found: tuple[IntegrityFinding, ...]
    left: tuple[IntegrityFinding, ...]


def repair(
    location: str | PathLike[str],
    *,
    deep: bool = False,
    sample: int = 8,
    jobs: int = -1,
    on_progress: OnProgress = ignore,
) -> Repair:
    """Make again from the recipe what :func:`verify` finds damaged, and what is missing.

    Damaged parts lose their receipt and are made again, bit for bit as they were, templates before rows; a damaged
    ``schema.json`` is written again. A foreign file is never deleted, but for temporary ones of stopped sweeps. A
    damaged ``sigdb.toml`` holds the recipe itself: sweep with the original recipe to write it again, then repair.

    Parameters
    ----------
    location, deep, sample, on_progress
        As in :func:`verify`.
    jobs
        Worker processes; -1 for one on each core.

    Raises
    ------
    InputError
        If there is no database, or another version of sigdb made it.
    DatabaseError
        If a sweep is running on it, or it cannot be written.
    """
    store = Store.at(location)
    found = _found(store, deep, sample, on_progress)
    if not found or any(finding.file == MANIFEST_FILE for finding in found):
        return Repair(found=found, left=found)
    with ownership_of(store):
        store.clear_temporary()
        manifest = read_manifest(store)
        check_version(store, manifest.sigdb_version)
        plans = [plan_from(record.resolved) for record in manifest.plans]
        if any(finding.file == SCHEMA_FILE for finding in found):
            keep_schema(plans[0], store)  # from the parts, before damaged ones lose their receipts
        for key in {finding.key for finding in found if finding.key}:
            store.delete(receipt_name(*key))
        run_parts(plans, store, Processes(jobs), on_progress)
    return Repair(found=found, left=_found(store, deep, sample, on_progress))


def _found(store: Store, deep: bool, sample: int, on_progress: OnProgress) -> tuple[IntegrityFinding, ...]:
    descriptions = check_descriptions(store)
    owners, findings = descriptions.owners, [*descriptions.findings]
    receipts, damaged = read_all_receipts(store)
    if owners:
        damaged = [one for one in damaged if one.key in owners]
        strangers = {key for key, receipt in receipts.items() if key in owners and not _fits(receipt, owners[key])}
        what = "the receipt is not that of the recipe's part: another plan, other rows or other files"
        findings += [damaged_part(key, receipts[key].path, what) for key in strangers]
        findings += _unfinished(owners, {*receipts, *(one.key for one in damaged if one.key)})
        findings += foreign_files(store, owners)
        receipts = {key: receipt for key, receipt in receipts.items() if key in owners and key not in strangers}
    findings += damaged
    whole: dict[PartKey, tuple[Plan, Receipt]] = {}
    doubtful: list[tuple[PartKey, int]] = []
    total, done = sum(len(receipt.files) for receipt in receipts.values()), 0
    for key, receipt in receipts.items():
        plan = owners.get(key)
        files, wrong = _read_part(store, receipt, descriptions.schema)
        if deep and plan and not wrong:
            wrong = [(part_name(table, key[1]), what) for table, what in _WRONG[key[0]](plan, receipt, files)]
            if "features" in files:
                doubtful += [(key, receipt.first + int(row)) for row in doubtful_rows(files["features"])[:1]]
        if plan and not wrong:
            whole[key] = plan, receipt
        findings += [damaged_part(key, file, what) for file, what in wrong]
        done += len(receipt.files)
        on_progress(Progress(stage="files", done=done, total=total, before=0))
    if deep and descriptions.schema:
        findings += differing_parts(store, whole, descriptions.schema, sample, doubtful)
    return tuple(findings)


_WRONG = {"templates": wrong_templates, "rows": wrong_rows}


def _read_part(
    store: Store, receipt: Receipt, schema: Schema | None
) -> tuple[dict[str, pq.ParquetFile], list[tuple[str, str]]]:
    """A part's files that are as they were written, by table, and what is wrong with others, by name."""
    files, wrong = {}, []
    for table, record in zip(TABLES_OF[receipt.name], receipt.files, strict=True):
        file, what = read_file(store, record, receipt.rows, schema.arrow(table) if schema else None)
        if file is None:
            wrong.append((record.path, what))
        else:
            files[table] = file
    return files, wrong


def _fits(receipt: Receipt, plan: Plan) -> bool:
    """Whether a receipt is that of the plan's part of its number."""
    first, stop = _range(plan, receipt)
    return (
        receipt.plan == plan.hash
        and (receipt.first, receipt.rows) == (first, stop - first)
        and [file.path for file in receipt.files] == [part_name(one, receipt.part) for one in TABLES_OF[receipt.name]]
    )


def _range(plan: Plan, receipt: Receipt) -> tuple[int, int]:
    if receipt.name == "rows":
        return plan.row_range(receipt.part)
    numbers = plan.template_range(receipt.part)
    return numbers.start, numbers.stop


def _unfinished(owners: Owners, begun: set[PartKey]) -> Iterator[IntegrityFinding]:
    """What is not made yet, in a sentence for templates and one for rows."""
    for stage in KINDS:
        planned = [part for name, part in owners if name == stage]
        missing = [part for part in planned if (stage, part) not in begun]
        if missing:
            yield IntegrityFinding(
                kind="unfinished",
                file="",
                what=f"{len(missing)} of {len(planned)} parts of {stage} are not made yet ({_runs(missing)})",
                remedy="go on with the command that began it, or make them with --repair",
            )


def _runs(numbers: list[int]) -> str:
    """Numbers in order as runs: 3, 5-7."""
    runs = [list(run) for _, run in groupby(numbers, key=lambda number: number - bisect_left(numbers, number))]
    return ", ".join(f"{run[0]}-{run[-1]}" if len(run) > 1 else str(run[0]) for run in runs)
