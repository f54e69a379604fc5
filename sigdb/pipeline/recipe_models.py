"""The models that a recipe requests, and the reports of their evaluations."""

import json
import shlex
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from sigdb.core import TEMPORARY, InputError, OnStep
from sigdb.database import KIND, NO_DAMAGE, Database, damage_kinds, severity_levels, severity_quantities
from sigdb.pipeline.models import train_model
from sigdb.pipeline.recipe import Recipe
from sigdb.pipeline.robustness.robustness import with_robustness
from sigdb.pipeline.stages import Stage, content_of, run_stage
from sigdb.recognition import (
    FACTORS,
    TARGETS,
    CriteriaSettings,
    Estimate,
    Evaluation,
    Model,
    RobustnessSettings,
    evaluate,
    load_model,
    metric_among,
)
from sigdb.sweep import Plan

_OF_A_RUN = {"targets", "splits", "evaluate_on"}
"""Settings that select models, and do not change any of them."""


@dataclass(frozen=True, kw_only=True)
class ModelResult:
    """The result of a model on a database.

    Attributes
    ----------
    target
        Target of the model.
    split
        Name of the split: ``S0`` to ``S5``.
    model, page
        Folder of the model, and the page of its report.
    metric
        Name of the metric that sums the model up.
    value, bound
        That metric of the model and of the best possible answer, in the unit of its title; None where it is not
        estimated.
    above
        Names of the model's metrics that are better than the bound, which no honest model's are.
    """

    target: str
    split: str
    model: Path
    page: Path
    metric: str
    value: Estimate | None
    bound: Estimate | None
    above: tuple[str, ...]


def check_models(recipe: Recipe, plan: Plan, others: Mapping[str, Plan]) -> None:
    """Refuse settings from which no model can be trained or evaluated, before the simulation.

    Parameters
    ----------
    recipe, plan
        The recipe and its plan.
    others
        By name, the plans of the recipes on whose databases the models are evaluated.

    Raises
    ------
    InputError
        If a setting does not fit; the message names the key and the remedy.
    """
    settings, sweep = recipe.sections.recognition, recipe.sections.sweep
    if settings.targets and not sweep.healthy:
        raise InputError(f"{recipe.path}: recognition.targets needs healthy rows; set healthy in [sweep]")
    if settings.targets and sweep.specimens < settings.folds:
        raise InputError(
            f"{recipe.path}: sweep.specimens = {sweep.specimens} cannot be split into recognition.folds = "
            f"{settings.folds}; give more specimens, or fewer folds"
        )
    if "severity" in settings.targets and not _severity_varies(plan):
        raise InputError(
            f"{recipe.path}: recognition.targets: severity cannot be learnt, since no size of the damages of "
            "[sweep] varies that all their damaged teeth share; give several values of one, such as stiffness_loss or "
            "crack_depth"
        )
    if KIND in settings.targets and len({*damage_kinds(_damages(plan))} - {NO_DAMAGE}) < 2:
        raise InputError(
            f"{recipe.path}: recognition.targets: kind cannot be learnt, since all damage of [sweep] is of one kind; "
            "give grids of several, such as stiffness_loss and phase_shift_deg"
        )
    for name, other in others.items():
        if other.sensors[0] != plan.sensors[0]:
            raise InputError(
                f"{recipe.path}: recognition.evaluate_on: the models read {plan.sensors[0]!r}, {name} stores "
                f"{other.sensors[0]!r} first; put that sensor first in its [signature]"
            )


def _damages(plan: Plan) -> pd.DataFrame:
    """Return the damages of a plan as cases that kinds follow from."""
    damages = plan.damages
    columns = pd.DataFrame({name: damages.column(name) for name in damages.fields})
    pattern = np.where(damages.pattern > 0, "pattern", "")
    columns = columns.assign(damaged_teeth=damages.column("damaged_teeth"))
    return columns.assign(tooth=damages.is_damage.astype(int), pattern=pattern)


def _severity_varies(plan: Plan) -> bool:
    """Return whether a severity varies over the damages that have one severity for all teeth."""
    cases = _damages(plan)
    alike = cases[(cases["pattern"] == "") & (cases["tooth"] > 0)]
    return bool((severity_levels(alike, severity_quantities(alike)).nunique() > 1).any())


def make_models(
    recipe: Recipe,
    database: Database,
    others: Mapping[str, Database],
    out: Path,
    on_stage: OnStep,
) -> Iterator[ModelResult]:
    """Train and evaluate the models of a recipe, those of the first split on other databases too.

    A model of S1 is in ``models/TARGET``, of another split in ``models/TARGET-SPLIT``; reports are in ``reports``,
    under the same names, and on another database under ``MODEL-on-NAME``.

    Parameters
    ----------
    recipe
        The recipe.
    database
        Its database.
    others
        By name, databases on which the models of the first split are evaluated too.
    out
        Folder of the run.
    on_stage
        Called with a sentence at the beginning and at the end of each stage.

    Yields
    ------
    ModelResult
        The result of each report.
    """
    settings = recipe.sections.recognition
    content, contents = content_of(database), {name: content_of(other) for name, other in others.items()}
    for split in settings.splits:
        for target in settings.targets:
            name = target if split == "S1" else f"{target}-{split}"
            first = split == settings.splits[0]
            model = Stage(
                out=out,
                name=f"models/{name}",
                inputs={
                    "target": target,
                    "split": split,
                    "settings": settings.model_dump(exclude=_OF_A_RUN),
                    "database": content,
                    **({"others": contents} if first and others else {}),
                },
            )
            evaluations = _train(recipe, database, model, others if first else {}, on_stage)
            page = partial(_report, model, criteria=settings.criteria, on_stage=on_stage)
            title = f"{recipe.path.stem}: {name}"
            yield page(title, name, database, content, evaluations.get(""), robustness=settings.robustness)
            for other in others if first else ():
                title, on = f"{recipe.path.stem}: {name} on {other}", f"{name}-on-{other}"
                yield page(title, on, others[other], contents[other], evaluations.get(other))


def _train(
    recipe: Recipe, database: Database, stage: Stage, others: Mapping[str, Database], on_stage: OnStep
) -> dict[str, Evaluation]:
    """Return the evaluations of a model that is trained now; none where the model was there.

    That on its own database has an empty name.
    """
    evaluations: list[Evaluation] = []

    def make() -> list[Path]:
        on_stage(f"{stage.path}: training, split {stage.inputs['split']}")
        train_model(
            database,
            stage.inputs["target"],
            stage.path,
            split=stage.inputs["split"],
            command=shlex.join(["sigdb", "run", str(recipe.path), "--out", str(stage.out)]),
            others=others,
            on_step=lambda step: on_stage(f"{stage.path}: {step}"),
            on_evaluation=evaluations.append,
            check=False,  # the run reports it at its end, when all reports are written
        )
        return _files(stage.path)

    run_stage(stage, make, on_stage, "trained")
    return dict(zip(("", *others), evaluations, strict=False))


def _report(
    model: Stage,
    title: str,
    name: str,
    database: Database,
    content: Mapping[str, Any],
    evaluation: Evaluation | None,
    *,
    criteria: CriteriaSettings,
    on_stage: OnStep,
    robustness: RobustnessSettings | None = None,
) -> ModelResult:
    """Write the report of a model on a database, where it is not there yet, and return the result."""
    from sigdb.report import NUMBERS, PAGE, write_evaluation_report

    tested = robustness if robustness and robustness.rows else None
    stage = Stage(
        out=model.out,
        name=f"reports/{name}",
        inputs={"model": model.files, "database": content, "criteria": criteria.limits}
        | ({"robustness": tested.model_dump()} if tested else {}),
    )

    def make() -> list[Path]:
        if evaluation is None:
            on_stage(f"{stage.path}: evaluating on {database.store}")
        result = evaluation or _evaluated(load_model(model.path), database, criteria, tested)
        write_evaluation_report(result, stage.path, title=title)
        return _files(stage.path)

    run_stage(stage, make, on_stage, "written")
    return _result(model.path, stage.path / PAGE, json.loads((stage.path / NUMBERS).read_text(encoding="utf-8")))


def _evaluated(
    model: Model, database: Database, criteria: CriteriaSettings, robustness: RobustnessSettings | None
) -> Evaluation:
    """Return the evaluation of a model, with its robustness where settings ask for it."""
    evaluation = evaluate(model, database, criteria=criteria)
    return evaluation if robustness is None else with_robustness(evaluation, model, database, robustness)


def _result(model: Path, page: Path, facts: Mapping[str, Any]) -> ModelResult:
    target, metrics = TARGETS[facts["target"]], facts["metrics"][facts["learner"]]
    metric = metric_among(target, target.headline, metrics)
    return ModelResult(
        target=facts["target"],
        split=facts["split"],
        model=model,
        page=page,
        metric=metric,
        value=_estimate(metrics.get(metric), FACTORS[metric]),
        bound=_estimate((facts["bound"] or {}).get(metric), FACTORS[metric]),
        above=tuple(facts["above"]),
    )


def _estimate(ends: Mapping[str, float | None] | None, factor: float) -> Estimate | None:
    if ends is None or ends["value"] is None:
        return None
    return Estimate(**{name: np.nan if value is None else value for name, value in ends.items()}).times(factor)


def _files(folder: Path) -> list[Path]:
    return [path for path in folder.rglob("*") if path.is_file() and not path.name.endswith(TEMPORARY)]
