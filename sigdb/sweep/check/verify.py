"""Verification of a database, and repair: damaged parts are made again from the recipe in it."""

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
    AddedCheck,
    IntegrityFinding,
    PartKey,
    Receipt,
    Schema,
    Store,
    check_added,
    damaged_part,
    foreign_files,
    has_own_files,
    part_name,
    read_all_receipts,
    read_file,
    read_manifest,
    read_schema,
    receipt_name,
    tables_of,
)
from sigdb.sweep.check.contents import check_row_contents, check_template_contents, doubtful_rows
from sigdb.sweep.check.descriptions import Owners, check_descriptions
from sigdb.sweep.check.remake import remake_sample
from sigdb.sweep.plan.make_plan import plan_from
from sigdb.sweep.plan.plan import Plan
from sigdb.sweep.work.add_features import finish_all_added
from sigdb.sweep.work.describe_database import check_version
from sigdb.sweep.work.engines import Processes
from sigdb.sweep.work.ownership import ownership_of
from sigdb.sweep.work.run import run_parts
from sigdb.sweep.work.stored_schema import check_equations, keep_schema


def verify(
    location: str | PathLike[str],
    *,
    deep: bool = False,
    sample: int = 8,
    on_progress: OnProgress = ignore,
) -> tuple[IntegrityFinding, ...]:
    """Return everything in a database that is not as it should be; nothing is changed.

    Every byte of every file is read. Descriptions and receipts are compared with their seals, parts with their receipts
    (size, SHA-256), and their columns with ``schema.json``. Parts and descriptions are compared with the plan that the
    recipe in ``sigdb.toml`` gives. Foreign files are named. So any flipped byte, missing file or foreign file is found.

    A database keeps the columns that it was begun with. A column of results that another version of sigdb would add, or
    no longer has, is no damage. Added features are checked, too: see :func:`add_features`.

    Parameters
    ----------
    location : str or path-like
        Directory of the database, or its place in an object store.
    deep : bool
        Whether to decode all values, too. Ids, parameters and labels must be those of the recipe. Results must be
        finite numbers where the status is ``ok``, and null elsewhere. A sample is made again and compared bit for bit.
        So is a sample of added features, which imports the modules of their functions if these have not changed.
    sample : int
        Number of templates, and of blocks of 256 rows, that ``deep`` makes again, spread evenly over the database.
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

    Examples
    --------
    >>> from sigdb.sweep import verify
    >>> verify("nowhere")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    sigdb.core.errors.InputError: nowhere is not a sigdb database (it has no sigdb.toml); make one with: ...
    """
    return _verify(Store.at(location), deep, sample, on_progress)


@dataclass(frozen=True, kw_only=True)
class Repair:
    """Findings in a database before and after a repair.

    Attributes
    ----------
    before : tuple of IntegrityFinding
        Findings before the repair.
    left : tuple of IntegrityFinding
        Findings after it.
    """

    before: tuple[IntegrityFinding, ...]
    left: tuple[IntegrityFinding, ...]


def repair(
    location: str | PathLike[str],
    *,
    deep: bool = False,
    sample: int = 8,
    jobs: int = -1,
    on_progress: OnProgress = ignore,
) -> Repair:
    """Make again from the recipe everything that :func:`verify` finds damaged or missing.

    Damaged parts lose their receipts and are made again, bit for bit as they were, templates before rows. A damaged
    ``schema.json`` is written again from the parts. No foreign file is deleted, except temporary files of stopped
    sweeps. The recipe itself stands in ``sigdb.toml``: if that is damaged, sweep with the original recipe to write it
    again, then repair.

    Parameters
    ----------
    location : str or path-like
        Directory of the database, or its place in an object store.
    deep : bool
        As in :func:`verify`.
    sample : int
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
        If a sweep is running on it, it cannot be written, or templates of an earlier version with other equations are
        damaged.
    """
    store = Store.at(location)
    before = _verify(store, deep, sample, on_progress)
    if not before or any(finding.file == MANIFEST_FILE for finding in before):
        return Repair(before=before, left=before)
    with ownership_of(store):
        store.clear_temporary()
        manifest = read_manifest(store)
        check_version(store, manifest.sigdb_version)
        plans = [plan_from(record.resolved) for record in manifest.plans]
        if any(finding.file == SCHEMA_FILE for finding in before):
            keep_schema(plans[0], store)  # from the parts, before damaged ones lose their receipts
        damaged = {finding.key for finding in before if finding.key}
        if any(stage == "templates" for stage, _ in damaged):
            check_equations(read_schema(store), store)
        for key in damaged:
            store.delete(receipt_name(*key))
        run_parts(plans, store, Processes(jobs), on_progress)
        finish_all_added(store, Processes(jobs), on_progress)
    return Repair(before=before, left=_verify(store, deep, sample, on_progress))


def _verify(store: Store, deep: bool, sample: int, on_progress: OnProgress) -> tuple[IntegrityFinding, ...]:
    descriptions, added = check_descriptions(store), AddedCheck.of(store)
    receipts, findings = _check_receipts(store, descriptions.owners, added)
    findings = [*descriptions.findings, *findings]
    whole: dict[PartKey, tuple[Plan, Receipt]] = {}
    doubtful: list[tuple[PartKey, int]] = []
    total, done = sum(len(receipt.files) for receipt in receipts.values()), 0
    for key, receipt in receipts.items():
        plan = descriptions.owners.get(key)
        files, wrong = _read_part(store, receipt, descriptions.schema)
        if deep and plan and not wrong:
            wrong = [(part_name(table, key[1]), what) for table, what in _CHECK_CONTENTS[key[0]](plan, receipt, files)]
            if "features" in files:
                doubtful += [(key, receipt.first + int(row)) for row in doubtful_rows(files["features"])[:1]]
        if plan and not wrong:
            whole[key] = plan, receipt
        findings += [damaged_part(key, file, what) for file, what in wrong]
        done += len(receipt.files)
        on_progress(Progress(stage="files", done=done, total=total, before=0))
    if deep and descriptions.schema:
        findings += remake_sample(store, whole, descriptions.schema, sample, doubtful)
    rows = {part: receipt for (stage, part), receipt in receipts.items() if stage == "rows"}
    findings += check_added(added, rows, deep=deep, sample=sample)
    return tuple(findings)


def _check_receipts(
    store: Store, owners: Owners, added: AddedCheck
) -> tuple[dict[PartKey, Receipt], list[IntegrityFinding]]:
    """Return the receipts of a database's parts, and the errors in receipts and names of files.

    Without owners, which a damaged ``sigdb.toml`` has none of, all receipts that can be read are returned.
    """
    receipts, damaged = read_all_receipts(store)
    if not owners:
        return receipts, damaged
    damaged = [finding for finding in damaged if finding.key in owners]
    strangers = {key for key, receipt in receipts.items() if key in owners and not _fits(receipt, owners[key])}
    what = "the receipt is not that of the recipe's part: another plan, other rows or other files"
    findings = [damaged_part(key, receipts[key].path, what) for key in strangers]
    findings += _unfinished(owners, {*receipts, *(finding.key for finding in damaged if finding.key)})
    rows = [part for stage, part in owners if stage == "rows"]
    findings += foreign_files(store, [*owners, *added.parts(rows)], added.files)
    return {key: receipt for key, receipt in receipts.items() if key in owners and key not in strangers}, [
        *findings,
        *damaged,
    ]


_CHECK_CONTENTS = {"templates": check_template_contents, "rows": check_row_contents}


def _read_part(
    store: Store, receipt: Receipt, schema: Schema | None
) -> tuple[dict[str, pq.ParquetFile], list[tuple[str, str]]]:
    """Return the undamaged files of a part, by table, and the errors in its other files, by name."""
    files, wrong = {}, []
    for table, record in zip(tables_of(receipt.name), receipt.files, strict=True):
        file, what = read_file(store, record, receipt.rows, schema.arrow(table) if schema else None)
        if file is None:
            wrong.append((record.path, what))
        else:
            files[table] = file
    return files, wrong


def _fits(receipt: Receipt, plan: Plan) -> bool:
    """Return whether a receipt is that of the plan's part of its number."""
    first, stop = _range(plan, receipt)
    return (
        receipt.plan == plan.hash and (receipt.first, receipt.rows) == (first, stop - first) and has_own_files(receipt)
    )


def _range(plan: Plan, receipt: Receipt) -> tuple[int, int]:
    if receipt.name == "rows":
        return plan.row_range(receipt.part)
    numbers = plan.template_range(receipt.part)
    return numbers.start, numbers.stop


def _unfinished(owners: Owners, begun: set[PartKey]) -> Iterator[IntegrityFinding]:
    """Yield a finding for templates, and one for rows, if some of their parts are missing."""
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
    """Return ascending numbers as text of runs: 3, 5-7."""
    runs = [list(run) for _, run in groupby(numbers, key=lambda number: number - bisect_left(numbers, number))]
    return ", ".join(f"{run[0]}-{run[-1]}" if len(run) > 1 else str(run[0]) for run in runs)
