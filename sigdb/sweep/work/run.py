"""Run of a plan: the planned parts without a receipt are made in parallel, until none is left."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from os import PathLike
from typing import Self

from sigdb.core import InputError, OnProgress, Progress, ignore
from sigdb.database import (
    DIGESTS,
    KINDS,
    Manifest,
    Receipt,
    Store,
    finished_parts,
    part_name,
    read_manifest,
    read_receipts,
)
from sigdb.sweep.plan.make_plan import plan_from
from sigdb.sweep.plan.plan import Plan
from sigdb.sweep.work.describe_database import describe_database, plan_record
from sigdb.sweep.work.engines import Cluster, Engine, Processes, make_missing
from sigdb.sweep.work.ownership import ownership_of
from sigdb.sweep.work.rows import make_row_part, make_virtual_part
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
    missing_rows : int
        Number of rows that other jobs have not made yet; 0 without jobs.
    failed : int
        Number of rows without a result; their status says why.
    bytes : int
        Size of all parts.
    """

    new_rows: int
    rows: int
    templates: int
    missing_rows: int = 0
    failed: int
    bytes: int


@dataclass(frozen=True)
class Job:
    """One of several jobs of a batch system that make a database together.

    Job i of n makes every n-th part of the rows, beginning with the i-th. All rows need templates, and no job waits for
    another: each makes its share of the templates, then those that are missing still. Two jobs that make the same part
    write the same bytes.

    Attributes
    ----------
    number : int
        Number of the job, from 1.
    of : int
        Number of jobs.

    Raises
    ------
    InputError
        If the number is not one from 1 to the number of jobs.

    Examples
    --------
    >>> from sigdb.sweep import Job
    >>> Job.from_text("2/8")
    Job(number=2, of=8)
    """

    number: int
    of: int

    def __post_init__(self) -> None:
        if not 1 <= self.number <= self.of:
            raise InputError(f"job {self.number}/{self.of} must be one of 1/{self.of} to {self.of}/{self.of}")

    @classmethod
    def from_text(cls, text: str) -> Self:
        """Return the job of a text such as ``2/8``.

        Raises
        ------
        InputError
            If it is none.
        """
        parts = re.fullmatch(r"(\d{1,9})/(\d{1,9})", text.strip())
        if parts is None:
            raise InputError(f"job {text!r} must be the number of a job and that of all jobs, such as 2/8")
        return cls(int(parts[1]), int(parts[2]))

    def __str__(self) -> str:
        return f"{self.number}/{self.of}"

    @property
    def name(self) -> str:
        """Name of the job in the names of files."""
        return f"{self.number}-of-{self.of}"

    def share(self, numbers: Sequence[int]) -> Sequence[int]:
        """Return the numbers of the parts that the job makes."""
        return numbers[self.number - 1 :: self.of]


_ALONE = Job(1, 1)


def run(
    plan: Plan,
    out: str | PathLike[str],
    *,
    recipe: str = "",
    jobs: int = -1,
    scheduler: str | None = None,
    job: Job | None = None,
    retry_failed: bool = False,
    materialise: bool = False,
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
    job : Job, optional
        The job of a batch system that this run is. It makes its share of the rows, and others may run on the place.
    retry_failed : bool
        Whether to make parts again that hold templates or rows without a result.
    materialise : bool
        Whether to store the rows of virtual parts too, and of all parts whatever the recipe says.
    on_progress : callable
        Called with a :class:`sigdb.core.Progress` whenever a part is finished.

    Returns
    -------
    SweepSummary
        Counts of rows, templates and failures.

    Raises
    ------
    InputError
        If the place holds the database of another recipe, no scheduler answers, or a job is to retry what has failed.
    DatabaseError
        If another sweep is running on it, or it cannot be written.
    """
    store = Store.at(out)
    if job and retry_failed:
        raise InputError("a job cannot make failed rows again, which others may read; do it once without --job")
    with ownership_of(store, job.name if job else ""):
        if job is None:
            store.clear_temporary()
        manifest = describe_database(plan, store, recipe, "rows" if materialise else plan.design.store)
        if retry_failed:
            _forget_failed(store, manifest)
        plans = [plan, *(plan_from(extension.resolved) for extension in manifest.extensions)]
        engine = Cluster(scheduler) if scheduler else Processes(jobs)
        summary = run_parts(plans, store, engine, on_progress, job or _ALONE, materialise=materialise)
        if materialise:
            _delete_digests(store, {plan.hash for plan in plans})
        return summary


def _delete_digests(store: Store, hashes: set[str]) -> None:
    """Delete the digests of parts whose rows are stored."""
    for receipt in read_receipts(store, "rows", hashes):
        if not receipt.is_virtual:
            store.delete(part_name(DIGESTS, receipt.part))


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


_MAKERS = {"templates": make_template_part, "rows": make_row_part, "virtual rows": make_virtual_part}
"""Maker of a part of templates, of rows, and of rows of which templates are stored."""


def run_parts(
    plans: Sequence[Plan],
    store: Store,
    engine: Engine,
    on_progress: OnProgress = ignore,
    job: Job = _ALONE,
    *,
    materialise: bool = False,
) -> SweepSummary:
    """Make the missing parts of a database's plans: all templates, then all rows. The caller owns the place.

    Virtual parts count as missing if they are to be materialised.
    """
    schema, hashes = keep_schema(plans[0], store), {plan.hash for plan in plans}
    check_computable(plans[0], schema, store)
    if sum(receipt.rows for receipt in read_receipts(store, "templates", hashes)) < sum(p.n_templates for p in plans):
        check_equations(schema, store)
    _make_templates(plans, store, engine, on_progress, job)
    form = read_manifest(store).store
    rows = _Stage("rows", _MAKERS["rows" if form == "rows" else "virtual rows"], materialise=materialise)
    new_rows = rows.run([(plan, job.share(plan.row_part_numbers)) for plan in plans], store, engine, on_progress)
    receipts = {name: read_receipts(store, name, hashes) for name in KINDS}
    planned = sum(plan.rows for plan in plans)
    return SweepSummary(
        new_rows=new_rows,
        rows=planned,
        templates=sum(plan.n_templates for plan in plans),
        missing_rows=planned - sum(each.rows for each in receipts["rows"] if not (materialise and each.is_virtual)),
        failed=sum(receipt.failed for receipt in receipts["rows"]),
        bytes=sum(file.bytes for both in receipts.values() for receipt in both for file in receipt.files),
    )


def _make_templates(plans: Sequence[Plan], store: Store, engine: Engine, on_progress: OnProgress, job: Job) -> None:
    """Make the templates of a job's share, then some of the missing ones again and again, until none is missing.

    Jobs begin with parts of their own, and each leaves out what others have finished in between.
    """
    shares = [(plan, job.share(plan.template_part_numbers)) for plan in plans]
    stage = _Stage("templates", _MAKERS["templates"])
    stage.run(shares, store, engine, on_progress)
    while job.of > 1:
        finished = finished_parts(store, "templates")
        missing = [(plan, [part for part in plan.template_part_numbers if part not in finished]) for plan in plans]
        missing = [(plan, parts[len(parts) * (job.number - 1) // job.of :]) for plan, parts in missing if parts]
        if not missing:
            break
        plan, parts = missing[0]
        stage.run([(plan, parts[:_TAKEN_OVER])], store, engine, ignore)


_TAKEN_OVER = 8
"""Parts of templates that a job makes of another's share before it looks what is missing."""

Share = Sequence[tuple[Plan, Sequence[int]]]
"""Plans, and the numbers of their parts that are made."""


@dataclass(frozen=True)
class _Stage:
    """A kind of parts, and the function that makes one; virtual parts count as missing if they are materialised."""

    name: str
    make: Callable[[Plan, Store, int], Receipt]
    materialise: bool = False

    def run(self, share: Share, store: Store, engine: Engine, on_progress: OnProgress) -> int:
        """Make the missing parts of a share and return the number of new rows or templates."""
        hashes, wanted = {plan.hash for plan, _ in share}, {part for _, parts in share for part in parts}
        total = sum(_size(self.name, plan, part) for plan, parts in share for part in parts)

        def count() -> dict[int, int]:
            receipts = [each for each in read_receipts(store, self.name, hashes) if each.part in wanted]
            return {each.part: each.rows for each in receipts if not (self.materialise and each.is_virtual)}

        def report() -> None:
            on_progress(Progress(stage=self.name, done=sum(finished.values()), total=total, before=before))

        finished = count()
        before = sum(finished.values())
        report()
        for plan, parts in share:
            make_missing(
                engine,
                self.make,
                plan,
                store,
                numbers=parts,
                finished=finished,
                recount=count,
                report=report,
                total=f"{total} {self.name}",
            )
        return total - before


def _size(stage: str, plan: Plan, part: int) -> int:
    """Return the number of templates or rows of a part."""
    if stage == "templates":
        return len(plan.template_range(part))
    start, stop = plan.row_range(part)
    return stop - start
