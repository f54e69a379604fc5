"""A run of a recipe: its databases, its models and their reports, its figures, its comparison with the paper."""

import json
from dataclasses import dataclass
from pathlib import Path

from sigdb.core import OnProgress, OnStep, ignore, json_text, publish_all
from sigdb.database import open as open_database
from sigdb.paper import PaperClaims, check_subject, paper_claims
from sigdb.pipeline.recipe import Recipe
from sigdb.pipeline.recipe_figures import check_figures, draw_figure
from sigdb.pipeline.recipe_models import ModelResult, check_models, make_models
from sigdb.pipeline.stages import Stage, content_of, run_stage
from sigdb.report import Picture
from sigdb.sweep import Plan, SweepSummary
from sigdb.sweep import run as run_sweep


@dataclass(frozen=True, kw_only=True)
class RecipeRun:
    """Result of a run of a recipe: what it made, and what was already there.

    Attributes
    ----------
    database
        Directory of the database.
    summary
        Summary of the sweep.
    others
        Directories of the databases of other recipes on which the models were evaluated.
    results
        Results of the models, one for each report.
    figures
        Picture files.
    claims
        The comparison with the paper; None where the recipe does not request it.
    """

    database: Path
    summary: SweepSummary
    others: tuple[Path, ...]
    results: tuple[ModelResult, ...]
    figures: tuple[Path, ...]
    claims: PaperClaims | None


def run_recipe(
    recipe: Recipe,
    out: str | Path,
    *,
    jobs: int = -1,
    on_stage: OnStep = ignore,
    on_progress: OnProgress = ignore,
) -> RecipeRun:
    """Make the database, models, reports and figures of a recipe.

    Results that exist already, whole and from the same inputs, are kept. Inputs are compared by their content:
    databases by the checksums of their parts, models by their files, settings and versions by value. After an
    interruption the same call continues.

    Parameters
    ----------
    recipe : Recipe
        From :func:`load_recipe`.
    out : str or path-like
        Folder of the run: the database goes to ``signatures``, those of other recipes to ``others/NAME/signatures``,
        models to ``models``, their reports to ``reports``, pictures to ``figures``, the comparison with the paper to
        ``claims.md`` and ``claims.json``. The inputs of each are in ``receipts``.
    jobs : int
        Worker processes of the sweep; -1 for one on each core.
    on_stage : callable
        Called with a sentence at the beginning and at the end of each stage.
    on_progress : callable
        Called with the progress of the sweep, as in :func:`sigdb.sweep.run`.

    Returns
    -------
    RecipeRun
        A model that is better than the best possible answer has names of metrics in ``above`` of its result.

    Raises
    ------
    InputError
        If the design does not fit the rig, or the folder holds the database of another recipe. Also if the database
        does not allow a model or its split, or a figure's condition does not select a single case.
    DatabaseError
        If the database cannot be written or read.
    """
    run = _Run(recipe, Path(out), jobs, on_stage, on_progress)
    run.check()
    summary = run.sweep(recipe, run.plan, run.folder)
    for name, other in run.others.items():
        run.sweep(other, run.other_plans[name], run.other_folder(name))
    return RecipeRun(
        database=run.folder,
        summary=summary,
        others=tuple(run.other_folder(name) for name in run.others),
        results=run.models(),
        figures=run.figures(),
        claims=run.claims(),
    )


class _Run:
    """A recipe with the folder and the callbacks of its run."""

    def __init__(
        self,
        recipe: Recipe,
        out: Path,
        jobs: int,
        on_stage: OnStep,
        on_progress: OnProgress,
    ) -> None:
        self.recipe, self.out, self.jobs = recipe, out, jobs
        self.on_stage, self.on_progress = on_stage, on_progress
        self.plan, self.folder = recipe.plan(), out / "signatures"
        self.others = {other.path.stem: other for other in recipe.evaluated_on()}
        self.other_plans: dict[str, Plan] = {name: other.plan() for name, other in self.others.items()}

    def other_folder(self, name: str) -> Path:
        return self.out / "others" / name / "signatures"

    def check(self) -> None:
        """Refuse settings that cannot work, before any work."""
        check_figures(self.recipe, self.plan)
        check_models(self.recipe, self.plan, self.other_plans)
        if self.recipe.sections.report.paper:
            check_subject(self.recipe.rig, self.plan.gear, self.plan.sensors[0])

    def sweep(self, recipe: Recipe, plan: Plan, folder: Path) -> SweepSummary:
        self.on_stage(f"{folder}: {plan.rows} rows from {plan.n_templates} templates of rig {plan.rig.name}")
        summary = run_sweep(plan, folder, recipe=recipe.text, jobs=self.jobs, on_progress=self.on_progress)
        self.on_stage(_sweep_sentence(folder, summary))
        return summary

    def models(self) -> tuple[ModelResult, ...]:
        if not self.recipe.sections.recognition.targets:
            return ()
        others = {name: open_database(self.other_folder(name)) for name in self.others}
        return tuple(make_models(self.recipe, open_database(self.folder), others, self.out, self.on_stage))

    def figures(self) -> tuple[Path, ...]:
        return tuple(self._figure(picture) for picture in self.recipe.sections.report.figures)

    def _figure(self, picture: Picture) -> Path:
        database, report = open_database(self.folder), self.recipe.sections.report
        stage = Stage(
            out=self.out,
            name=f"figures/{picture.name}.png",
            inputs={
                "picture": picture.model_dump(),
                "look": report.model_dump(exclude={"figures", "paper"}),
                "database": content_of(database),
            },
        )

        def make() -> list[Path]:
            draw_figure(self.recipe, self.plan, database, picture, stage.path)
            return [stage.path]

        run_stage(stage, make, self.on_stage, "drawn")
        return stage.path

    def claims(self) -> PaperClaims | None:
        """Return the comparison with the paper, where the recipe requests it."""
        if not self.recipe.sections.report.paper:
            return None
        gear, sensor, numbers = self.plan.gear, self.plan.sensors[0], self.out / "claims.json"
        rig = self.recipe.rig.model_dump(mode="json")
        stage = Stage(out=self.out, name="claims.md", inputs={"rig": rig, "gear": gear, "sensor": sensor})

        def make() -> list[Path]:
            from sigdb.report import claims_markdown

            self.on_stage(f"{self.out}: comparing with the paper, and with one number of the rig changed at a time")
            claims = paper_claims(self.recipe.rig, gear=gear, sensor=sensor)
            publish_all({numbers: json_text(claims.as_json()), stage.path: claims_markdown(claims)})
            return [stage.path, numbers]

        run_stage(stage, make, self.on_stage, "written")
        return PaperClaims.from_json(json.loads(numbers.read_text(encoding="utf-8")))


def _sweep_sentence(folder: Path, summary: SweepSummary) -> str:
    if summary.new_rows == 0:
        text = f"{folder}: unchanged, all {summary.rows} rows are there"
    else:
        text = f"{folder}: made {summary.new_rows} rows, {summary.bytes / 1e6:.1f} MB"
    return f"{text}; {summary.failed} have no result" if summary.failed else text
