"""Ingest of recordings: a database of their averages, features and labels, which later files extend."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path

from sigdb.core import InputError, OnProgress, Progress, __version__, ignore
from sigdb.database import (
    MANIFEST_FILE,
    MEASURED_SENSOR,
    Manifest,
    Receipt,
    Store,
    read_manifest,
    read_receipts,
    write_schema,
)
from sigdb.ingest.facts.recording_files import find_files, planned_recordings
from sigdb.ingest.findings import apply_findings
from sigdb.ingest.moves import find_moves, follow_moves
from sigdb.ingest.plan import PART_ROWS, IngestPlan, PlannedRecording, stored_plans
from sigdb.ingest.recorded_rows import named_rigs
from sigdb.ingest.row_parts import make_recording_part
from sigdb.ingest.schema import measured_schema
from sigdb.ingest.settings import IngestSettings
from sigdb.sweep import Cluster, Engine, Processes, check_version, make_missing, ownership_of
from sigdb.transmission import Transmission


@dataclass(frozen=True, kw_only=True)
class IngestSummary:
    """Summary of an ingest, and of the database after it.

    Attributes
    ----------
    new_recordings : int
        Number of files that this ingest added or finished.
    recordings, rows : int
        Number of files and of rows in the database.
    failed : int
        Number of rows without a result; their status says why.
    bytes : int
        Size of all parts.
    left_out : tuple of str
        Names of files that table or pattern leave out.
    moved : int
        Number of ingested files that were recognised at another place by their SHA-256.
    """

    new_recordings: int
    recordings: int
    rows: int
    failed: int
    bytes: int
    left_out: tuple[str, ...]
    moved: int = 0


def ingest(
    place: str | PathLike[str],
    out: str | PathLike[str],
    *,
    table: str | PathLike[str] | None = None,
    pattern: str | None = None,
    settings: IngestSettings | None = None,
    jobs: int = -1,
    scheduler: str | None = None,
    on_progress: OnProgress = ignore,
) -> IngestSummary:
    """Make a database of recordings, go on with one, or add the files that are new to it.

    Each average of a gear by a channel is a row with the columns of simulated rows and those of a measurement. A file
    that cannot be read, or whose reading is in doubt, is a row without result whose status says why. Recordings stay
    where they are. Those that have been moved since are recognised by their SHA-256.

    Parameters
    ----------
    place : str or path-like
        Folder of recordings, or a table of them.
    out : str or path-like
        Directory of the database, or its place in an object store.
    table : str or path-like, optional
        Table of the files of the folder; by default ``recordings.csv`` in it, if it exists.
    pattern : str, optional
        Pattern over the names of the files, such as ``{state}_{load}Nm_{number}.csv``.
    settings : IngestSettings, optional
        Settings of averages and of reading; the defaults if left out.
    jobs : int
        Number of worker processes; -1 for one on each core.
    scheduler : str, optional
        Address of a Dask scheduler whose workers make the parts in place of processes on this machine.
    on_progress : callable
        Called with a :class:`sigdb.core.Progress` whenever recordings are finished.

    Returns
    -------
    IngestSummary
        Counts of recordings, rows and failures.

    Raises
    ------
    InputError
        If there is no recording, a fact is wrong, the place holds a database of a sweep or of other settings, or an
        ingested file has changed.
    DatabaseError
        If another process works on the database, or it cannot be written.
    """
    settings = settings or IngestSettings()
    store = Store.at(out)
    before, plans = _description(store), _begun(store)  # before it is owned: a refusal leaves no folder
    paths = {recording.path for plan in plans for recording in plan.recordings}
    files = find_files(Path(place), table=None if table is None else Path(table), pattern=pattern, earlier_paths=paths)
    with ownership_of(store):
        store.clear_temporary()
        if _description(store) != before:
            plans = _begun(store)
        moves = find_moves(store, plans, files)
        plans = follow_moves(store, plans, moves)
        earlier = [recording for plan in plans for recording in plan.recordings]
        new = planned_recordings(files, earlier)
        if plans:
            _check_alike(plans[0], settings, store)
        if new:
            plan = IngestPlan(
                settings=settings,
                rigs=_rigs(settings, new),
                recordings=new,
                first_part=plans[-1].row_part_numbers.stop if plans else 0,
            )
            plans.append(_described(plan, plans[-1] if plans else None, store))
        apply_findings(store)
        engine = Cluster(scheduler) if scheduler else Processes(jobs)
        return replace(run_plans(plans, store, engine, on_progress, files.left_out), moved=len(moves))


def run_plans(
    plans: Sequence[IngestPlan],
    store: Store,
    engine: Engine,
    on_progress: OnProgress = ignore,
    left_out: tuple[str, ...] = (),
) -> IngestSummary:
    """Make the missing parts of plans. The caller owns the place."""
    sizes = {part: len(plan.recordings_of(part)) for plan in plans for part in plan.row_part_numbers}
    total, hashes = sum(sizes.values()), {plan.hash for plan in plans}

    receipts: list[Receipt] = []

    def count() -> dict[int, int]:
        receipts[:] = read_receipts(store, "rows", hashes, read_before=receipts)
        return {receipt.part: receipt.rows for receipt in receipts}

    def done() -> int:
        return sum(sizes[part] for part in finished)

    def report() -> None:
        on_progress(Progress(stage="recordings", done=done(), total=total, before=before))

    finished = count()
    before = done()
    report()
    for plan in plans:
        make_missing(
            engine,
            make_recording_part,
            plan,
            store,
            numbers=plan.row_part_numbers,
            finished=finished,
            recount=count,
            report=report,
            total="the rows",
        )
    count()
    return IngestSummary(
        new_recordings=total - before,
        recordings=total,
        rows=sum(receipt.rows for receipt in receipts),
        failed=sum(receipt.failed for receipt in receipts),
        bytes=sum(file.bytes for receipt in receipts for file in receipt.files),
        left_out=left_out,
    )


def _description(store: Store) -> bytes:
    """Return the description of a database; empty where there is none."""
    return b"" if store.size(MANIFEST_FILE) is None else store.get(MANIFEST_FILE)


def _begun(store: Store) -> list[IngestPlan]:
    """Return the plans of a database; none where there is no database yet."""
    if store.size(MANIFEST_FILE) is None:
        if store.sizes("receipts"):
            raise InputError(
                f"{store} holds parts but no {MANIFEST_FILE}; put it back from a copy, or give another --out"
            )
        return []
    manifest = read_manifest(store)
    if not manifest.is_measured:
        raise InputError(f"{store} is the database of a sweep; give another place with --out")
    check_version(store, manifest.sigdb_version)
    return stored_plans(manifest.plans, store)


def _check_alike(plan: IngestPlan, settings: IngestSettings, store: Store) -> None:
    """Refuse averages of another number of samples a tooth than the database has."""
    before = plan.settings.samples_per_tooth
    if settings.samples_per_tooth != before:
        raise InputError(
            f"{store} has averages of {before} samples a tooth, not of {settings.samples_per_tooth}; give the same "
            "number, or another place with --out"
        )


def _described(plan: IngestPlan, before: IngestPlan | None, store: Store) -> IngestPlan:
    """Write the list of the recordings of a plan, then the description of the database that names it.

    The plan before it grows by the recordings if it has the same settings: the description of a database that is
    extended a thousand times stays as short as it was.
    """
    store.put(plan.list_name, plan.list_content)
    if before is None:
        write_schema(measured_schema(), store)
        Manifest(
            plan=plan.record,
            part_rows=PART_ROWS,
            part_templates=1,
            sensors=(MEASURED_SENSOR,),
            recipe="",
            sigdb_version=__version__,
            licence="not stated: that of the recordings",
            citation="Cite sigdb by its CITATION.cff, and the source of the recordings.",
        ).write(store)
        return plan
    manifest = read_manifest(store)
    if not plan.is_alike(before):
        replace(manifest, extensions=(*manifest.extensions, plan.record)).write(store)
        return plan
    record = manifest.plans[-1]
    manifest.with_last_plan(plan.grown(record)).write(store)
    return replace(plan, grows=record.hash)


def _rigs(settings: IngestSettings, recordings: Sequence[PlannedRecording]) -> dict[str, Transmission]:
    names = [settings.rig, *(facts.rig for recording in recordings for facts in recording.facts)]
    return named_rigs([name for name in names if name is not None])
