"""Run of a plan: the planned parts without a receipt are made in parallel, until none is left."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from os import PathLike

from sigdb.core import OnProgress, Progress, ignore
from sigdb.database import KINDS, Manifest, Store, read_manifest, read_receipts
from sigdb.sweep.plan.make_plan import plan_from
from sigdb.sweep.plan.plan import Plan
from sigdb.sweep.work.describe_database import describe_database, plan_record
from sigdb.sweep.work.engines import Cluster, Engine, Processes, make_missing
from sigdb.sweep.work.ownership import ownership_of
from sigdb.sweep.work.rows import make_row_part
from sigdb.sweep.work.stored_schema import check_computable, check_equations, keep_schema
from sigdb.sweep.work.templates import make_template_part


@dataclass(frozen=True, kw_only=True)
class SweepSummary:
    """Summary of a run, and of the database after it.

    Attributes
    ----------
    new_rows : int
        Number of rows that this run made; 0 if there was nothing to do.
    rows, templates : int
        Number of rows and of templates in the database.
    failed : int
        Number of rows without a result; their status says why.
    bytes : int
        Size of all parts.
    """

    new_rows: int
    rows: int
    templates: int
    failed: int
    bytes: int


def run(
    plan: Plan,
    out: str | PathLike[str],
    *,
    recipe: str = "",
    jobs: int = -1,
    scheduler: str | None = None,
    retry_failed: bool = False,
    on_progress: OnProgress = ignore,
) -> SweepSummary:
    """Make a database, or its missing parts.

    After a stop at any instant, the same call goes on. Rows are the same bit for bit for any number of jobs, on one
    machine or many.

    Parameters
    ----------
    plan : Plan
        A plan from :func:`sigdb.sweep.make_plan`.
    out : str or path-like
        Directory of the database, or its place in an object store: ``s3://bucket/prefix``.
    recipe : str
        Text of the recipe, which is stored unchanged.
    jobs : int
        Number of worker processes; -1 for one on each core.
    scheduler : str, optional
        Address of a Dask scheduler whose workers make the parts in place of processes on this machine.
    retry_failed : bool
        Whether to make parts again that hold templates or rows without a result.
    on_progress : callable
        Called with a :class:`sigdb.core.Progress` whenever a part is finished.

    Returns
    -------
    SweepSummary
        Counts of rows, templates and failures.

    Raises
    ------
    InputError
        If the place holds the database of another recipe, or no scheduler answers.
    DatabaseError
        If another sweep is running on it, or it cannot be written.
    """
    store = Store.at(out)
    with ownership_of(store):
        store.clear_temporary()
        manifest = describe_database(plan, store, recipe)
        if retry_failed:
            _forget_failed(store, manifest)
        plans = [plan, *(plan_from(extension.resolved) for extension in manifest.extensions)]
        return run_parts(plans, store, Cluster(scheduler) if scheduler else Processes(jobs), on_progress)


def append(plan: Plan, store: Store) -> None:
    """Add an extension to a database's description; :func:`run_parts` makes its parts. The caller owns the place."""
    manifest = read_manifest(store)
    replace(manifest, extensions=(*manifest.extensions, plan_record(plan))).write(store)


def _forget_failed(store: Store, manifest: Manifest) -> None:
    """Delete the receipts of parts with failures, so that these parts are missing.

    Receipts of rows go first. After a stop in between, no row is left of a template that will be made again.
    """
    for name in reversed(KINDS):
        for receipt in read_receipts(store, name, {plan.hash for plan in manifest.plans}):
            if receipt.failed:
                store.delete(receipt.path)


_MAKERS = {"templates": make_template_part, "rows": make_row_part}


def run_parts(plans: Sequence[Plan], store: Store, engine: Engine, on_progress: OnProgress = ignore) -> SweepSummary:
    """Make the missing parts of a database's plans: all templates, then all rows. The caller owns the place."""
    schema, hashes = keep_schema(plans[0], store), {plan.hash for plan in plans}
    check_computable(plans[0], schema, store)
    if sum(receipt.rows for receipt in read_receipts(store, "templates", hashes)) < sum(p.n_templates for p in plans):
        check_equations(schema, store)
    new = {stage: _run_stage(stage, plans, store, engine, on_progress) for stage in KINDS}
    receipts = {name: read_receipts(store, name, hashes) for name in KINDS}
    return SweepSummary(
        new_rows=new["rows"],
        rows=sum(plan.rows for plan in plans),
        templates=sum(plan.n_templates for plan in plans),
        failed=sum(receipt.failed for receipt in receipts["rows"]),
        bytes=sum(file.bytes for both in receipts.values() for receipt in both for file in receipt.files),
    )


def _run_stage(stage: str, plans: Sequence[Plan], store: Store, engine: Engine, on_progress: OnProgress) -> int:
    """Make the missing parts of a stage and return the number of new rows or templates."""
    hashes = {plan.hash for plan in plans}
    total = sum(plan.n_templates if stage == "templates" else plan.rows for plan in plans)

    def count() -> dict[int, int]:
        return {receipt.part: receipt.rows for receipt in read_receipts(store, stage, hashes)}

    def report() -> None:
        on_progress(Progress(stage=stage, done=sum(finished.values()), total=total, before=before))

    finished = count()
    before = sum(finished.values())
    report()
    for plan in plans:
        make_missing(
            engine,
            _MAKERS[stage],
            plan,
            store,
            numbers=plan.template_part_numbers if stage == "templates" else plan.row_part_numbers,
            finished=finished,
            recount=count,
            report=report,
            total=f"{total} {stage}",
        )
    return total - before
