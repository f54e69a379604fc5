"""``sigdb sweep``, and ``python -m sigdb.sweep``."""

import json
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

import click

from sigdb.cli.options.format import echo_json, format_option
from sigdb.cli.options.places import RECIPE
from sigdb.cli.options.workers import job_option, jobs_option, scheduler_option

if TYPE_CHECKING:
    from sigdb.sweep import Job, Plan


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.argument("recipe", type=RECIPE)
@click.option("--out", help="Directory of the database, or s3://BUCKET/PREFIX; by default data/RECIPE/signatures.")
@jobs_option
@scheduler_option
@job_option
@click.option("--retry-failed", is_flag=True, help="Make parts that hold templates or rows without a result again.")
@click.option(
    "--materialise", is_flag=True, help='Store the rows of a database that was made with store = "templates", too.'
)
@click.option("--dry-run", is_flag=True, help="Print templates, rows, bytes, time and the first rows, and stop.")
@click.option(
    "--measure/--no-measure",
    default=True,
    show_default=True,
    help="Let --dry-run simulate some seconds for its estimates of bytes and time.",
)
@format_option("table", "json", of="the plan that --dry-run prints")
def sweep(
    recipe: Path,
    out: str | None,
    jobs: int,
    scheduler: str | None,
    job: "Job | None",
    retry_failed: bool,
    materialise: bool,
    dry_run: bool,
    measure: bool,
    form: str,
) -> None:
    """Make the database of a recipe, or go on making it.

    The command may be stopped at any instant; repeated, it goes on. Rows are the same for any number of jobs. Jobs of a
    batch system make a database together, each with its --job.

    \b
    Example:
      sigdb sweep pipelines/quick.toml --dry-run
    """
    from sigdb.cli.progress import show_progress
    from sigdb.pipeline import load_recipe
    from sigdb.sweep import run

    loaded = load_recipe(recipe)
    plan = loaded.plan()
    out = out or str(Path("data") / recipe.stem / "signatures")
    if dry_run:
        _print_plan(plan, out, jobs, form, measure=measure)
        return
    click.echo(f"{out}: {plan.rows} rows from {plan.n_templates} templates of rig {plan.rig.name}")
    started = time.perf_counter()
    with show_progress() as on_progress:
        summary = run(
            plan,
            out,
            recipe=loaded.text,
            jobs=jobs,
            scheduler=scheduler,
            job=job,
            retry_failed=retry_failed,
            materialise=materialise,
            on_progress=on_progress,
        )
    seconds = time.perf_counter() - started
    there = f"{summary.rows} rows, {summary.bytes / 1e6:.1f} MB"
    if summary.missing_rows:
        there += f"; {summary.missing_rows} of them are left to other jobs"
    if summary.new_rows == 0:
        all_rows = f"all {summary.rows} rows are" if not summary.missing_rows else f"the share of job {job} is"
        click.echo(f"{out}: nothing to do, {all_rows} there")
    else:
        click.echo(
            f"{out}: made {summary.new_rows} rows in {seconds:.1f} s ({summary.new_rows / seconds:.0f} rows/s); {there}"
        )
    if summary.failed:
        click.echo(
            f"{summary.failed} rows have no result; their status says why: sigdb query {out} "
            f'"select {_reason(out)} as reason, count(*) as rows, min(status) as example from features group by reason"'
        )


def _reason(out: str) -> str:
    """SQL of the reason why a row has no result; a database of an earlier version has only its sentence."""
    from sigdb.database import open as open_database

    names = open_database(out).dataset("features").schema.names
    return "status_code" if "status_code" in names else "split_part(status, ' (', 1)"


def _print_plan(plan: "Plan", out: str, jobs: int, form: str, *, measure: bool) -> None:
    from sigdb.report import Terminal, TextTable
    from sigdb.sweep import estimate

    if form == "table":
        click.echo(f"{out}: would hold {plan.rows} rows from {plan.n_templates} templates, in {plan.row_parts} parts")
    cost = estimate(plan, jobs) if measure else None
    first = plan.table_of(plan.sample_ids(5, 5))
    if form == "json":
        facts = {"out": out, "rows": plan.rows, "templates": plan.n_templates, "parts": plan.row_parts}
        if cost is not None:
            facts |= {"bytes": round(cost.bytes), "seconds": cost.seconds, "jobs": cost.jobs}
        rows = json.loads(first.to_json(orient="records", double_precision=15))
        echo_json(facts | {"first_rows": rows}, indent=None)
        return
    if cost is not None:
        size, time_text = _bytes_text(cost.bytes), _seconds_text(cost.seconds)
        click.echo(f"about {size} and {time_text} with {cost.jobs} jobs, measured on a sample")
    click.echo("first rows of the plan, and the first with damage:")
    click.echo(TextTable.of_frame(first).text(Terminal.of(sys.stdout)))


def _bytes_text(size: float) -> str:
    return f"{size / 1e9:.1f} GB" if size >= 1e10 else f"{size / 1e6:.1f} MB"


def _seconds_text(seconds: float) -> str:
    for name, length in (("days", 86400), ("h", 3600), ("min", 60)):
        if seconds >= 3 * length:
            return f"{seconds / length:.1f} {name}"
    return f"{seconds:.0f} s"
