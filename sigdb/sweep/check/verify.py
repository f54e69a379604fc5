"""Verification of a database: its files are compared with their receipts and with the recipe in it."""

from bisect import bisect_left
from collections.abc import Iterator
from itertools import groupby
from os import PathLike

from sigdb.core import OnProgress, Progress, ignore
from sigdb.database import (
    KINDS,
    AddedCheck,
    IntegrityFinding,
    PartKey,
    Receipt,
    Store,
    check_added,
    check_open_tables,
    damaged_part,
    foreign_files,
    has_own_files,
    log_files,
    part_name,
    read_all_receipts,
    read_part,
)
from sigdb.sweep.check.contents import check_digests, check_row_contents, check_template_contents, doubtful_rows
from sigdb.sweep.check.descriptions import Owners, check_descriptions
from sigdb.sweep.check.remake import remake_sample
from sigdb.sweep.plan.plan import Plan


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
    no longer has, is no damage. Added features are checked, too: see :func:`add_features`. Registrations as Delta or
    Iceberg tables are compared with the receipts and, for Iceberg, with the place of the database.

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
    store = Store.at(location)
    descriptions, added = check_descriptions(store), AddedCheck.of(store)
    receipts, findings = _check_receipts(store, descriptions.owners, added)
    findings = [*descriptions.findings, *findings]
    whole: dict[PartKey, tuple[Plan, Receipt]] = {}
    doubtful: list[tuple[PartKey, int]] = []
    total, done = sum(len(receipt.files) for receipt in receipts.values()), 0
    for key, receipt in receipts.items():
        plan = descriptions.owners.get(key)
        files, wrong = read_part(store, receipt, descriptions.schema)
        if deep and plan and not wrong:
            check = check_digests if receipt.is_virtual else _CHECK_CONTENTS[key[0]]
            wrong = [(part_name(table, key[1]), what) for table, what in check(plan, receipt, files)]
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
    findings += check_open_tables(store, receipts.values())
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
    findings += foreign_files(store, [*owners, *added.parts(rows)], [*added.files, *log_files(store)])
    return {key: receipt for key, receipt in receipts.items() if key in owners and key not in strangers}, [
        *findings,
        *damaged,
    ]


_CHECK_CONTENTS = {"templates": check_template_contents, "rows": check_row_contents}


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
