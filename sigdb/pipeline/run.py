"""A whole recipe: its database, then its figures, then its comparison with the paper."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sigdb.database import open as open_database
from sigdb.pipeline.paper.results import paper_claims
from sigdb.pipeline.paper.signals import check_subject
from sigdb.pipeline.recipe import Recipe
from sigdb.pipeline.recipe_figures import check_figures, draw_figures
from sigdb.sweep import Progress, Summary
from sigdb.sweep import run as run_sweep


@dataclass(frozen=True, kw_only=True)
class Made:
    """What a run of a recipe has made.

    Attributes
    ----------
    database
        Directory of the database.
    summary
        What the sweep did.
    figures
        Picture files.
    claims
        The comparison with the paper, as of :func:`paper_claims`; None where the recipe does not ask for it.
    """

    database: Path
    summary: Summary
    figures: tuple[Path, ...]
    claims: dict[str, Any] | None


def run_recipe(
    recipe: Recipe,
    out: str | Path,
    *,
    jobs: int = -1,
    on_stage: Callable[[str], Any] = lambda sentence: None,
    on_progress: Callable[[Progress], Any] = lambda progress: None,
) -> Made:
    """Make all that a recipe asks for: what is there already is kept, figures are drawn again.

    Parameters
    ----------
    recipe
        From :func:`load_recipe`.
    out
        Folder: the database goes to ``signatures``, pictures to ``figures``, the comparison with the paper to
        ``claims.md`` and ``claims.json``.
    jobs
        Worker processes of the sweep; -1 for one on each core.
    on_stage
        Called with a sentence on what begins or has been made.
    on_progress
        Called with what of the sweep is finished, as of :func:`sigdb.sweep.run`.

    Returns
    -------
    Made

    Raises
    ------
    InputError
        If the design does not fit the rig, the folder holds the database of another recipe, or a figure's condition
        does not select one case.
    DatabaseError
        If the database cannot be written or read.
    """
    out, plan, report = Path(out), recipe.plan(), recipe.sections.report
    check_figures(recipe, plan)
    if report.paper:
        check_subject(recipe.rig, plan.gear, plan.sensors[0])
    folder = out / "signatures"
    on_stage(f"{folder}: {plan.rows} rows from {plan.n_templates} templates of rig {plan.rig.name}")
    summary = run_sweep(plan, folder, recipe=recipe.text, jobs=jobs, on_progress=on_progress)
    on_stage(_said(folder, summary))
    figures = []
    for path in draw_figures(recipe, plan, open_database(folder), out / "figures"):
        on_stage(f"{path}: drawn")
        figures.append(path)
    claims = _compared(recipe, plan.gear, plan.sensors[0], out, on_stage) if report.paper else None
    return Made(database=folder, summary=summary, figures=tuple(figures), claims=claims)


def _said(folder: Path, summary: Summary) -> str:
    if summary.made == 0:
        said = f"{folder}: complete, all {summary.rows} rows are there"
    else:
        said = f"{folder}: made {summary.made} rows, {summary.bytes / 1e6:.1f} MB"
    return f"{said}; {summary.failed} have no result" if summary.failed else said


def _compared(recipe: Recipe, gear: str, sensor: str, out: Path, on_stage: Callable[[str], Any]) -> dict[str, Any]:
    from sigdb.report import claims_markdown

    on_stage(f"{out}: comparing with the paper, and with one number of the rig changed at a time")
    facts = paper_claims(recipe.rig, gear=gear, sensor=sensor)
    pages = {"claims.md": claims_markdown(facts), "claims.json": json.dumps(facts, indent=1) + "\n"}
    for name, text in pages.items():
        (out / name).write_text(text, encoding="utf-8")
        on_stage(f"{out / name}: written")
    return facts
