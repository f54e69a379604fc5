"""Repair of a database: what verification finds damaged or missing is made again."""

from collections.abc import Callable, Collection
from dataclasses import dataclass
from functools import partial
from os import PathLike

from sigdb.core import OnProgress, ignore
from sigdb.database import (
    MANIFEST_FILE,
    SCHEMA_FILE,
    IntegrityFinding,
    Manifest,
    PartKey,
    Store,
    read_manifest,
    read_schema,
    receipt_name,
)
from sigdb.sweep.check.verify import verify
from sigdb.sweep.plan.make_plan import plan_from
from sigdb.sweep.work.add_features import finish_all_added
from sigdb.sweep.work.describe_database import check_version
from sigdb.sweep.work.engines import Engine, Processes
from sigdb.sweep.work.ownership import ownership_of
from sigdb.sweep.work.run import run_parts
from sigdb.sweep.work.stored_schema import check_equations, keep_schema


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
    store, engine = Store.at(location), Processes(jobs)

    def make_again(manifest: Manifest, damaged: Collection[PartKey], schema_is_damaged: bool) -> None:
        plans = [plan_from(record.resolved) for record in manifest.plans]
        if schema_is_damaged:
            keep_schema(plans[0], store)  # from the parts, before damaged ones lose their receipts
        if any(stage == "templates" for stage, _ in damaged):
            check_equations(read_schema(store), store)
        for key in damaged:
            store.delete(receipt_name(*key))
        run_parts(plans, store, engine, on_progress)

    check = partial(verify, location, deep=deep, sample=sample, on_progress=on_progress)
    return repair_by(make_again, check, store, engine, on_progress)


MakeAgain = Callable[[Manifest, Collection[PartKey], bool], None]
"""Makes parts again: called with the description of the database, the damaged parts, and whether ``schema.json`` is."""


def repair_by(
    make_again: MakeAgain,
    check: Callable[[], tuple[IntegrityFinding, ...]],
    store: Store,
    engine: Engine,
    on_progress: OnProgress = ignore,
) -> Repair:
    """Own a database, make its damaged and missing parts again, and its added features; return all findings.

    A database whose description is damaged stays as it is.

    Parameters
    ----------
    make_again
        Writes a damaged ``schema.json``, deletes the receipts of damaged parts and makes all parts without a receipt.
    check
        Returns the findings in the database.
    store
        The database.
    engine
        Computes the added features.
    on_progress
        Called with a :class:`sigdb.core.Progress` as added features are computed.

    Raises
    ------
    InputError
        If another version of sigdb made the database.
    DatabaseError
        If another process works on it, or it cannot be written.
    """
    before = check()
    files = {finding.file for finding in before}
    if not before or MANIFEST_FILE in files:
        return Repair(before=before, left=before)
    with ownership_of(store):
        store.clear_temporary()
        manifest = read_manifest(store)
        check_version(store, manifest.sigdb_version)
        make_again(manifest, {finding.key for finding in before if finding.key}, SCHEMA_FILE in files)
        finish_all_added(store, engine, on_progress)
    return Repair(before=before, left=check())
