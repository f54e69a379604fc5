"""The models that a recipe asks for, and the reports of what they are worth."""

import json
import shlex
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sigdb.core import InputError
from sigdb.database import Database
from sigdb.pipeline.models import train_model
from sigdb.pipeline.recipe import Recipe
from sigdb.pipeline.stages import Stage, content_of, run_stage
from sigdb.recognition import Estimate, Evaluation, evaluate_with_bound, load_model
from sigdb.sweep import Plan

MERIT = {"location": "accuracy", "severity": "mae_stiffness_loss", "detection": "pd_at_1e-2"}
"""The figure by which models of a target are told apart in a line."""

_OF_A_RUN = {"targets", "splits", "evaluate_on"}
"""Settings that say which models there are, and nothing of any of them."""


@dataclass(frozen=True, kw_only=True)
class ModelResult:
    """What a model is worth on a database.

    Attributes
    ----------
    target
        What it answers.
    split
        By which split: ``S0`` to ``S5``.
    model, page
        Folder of the model, and the page of its report.
    merit
        Name of the figure of merit.
    figure, bound
        That figure of the model and of the best possible answer; None where there is none.
    above
        Names of the model's figures that are better than the bound, which no honest model's are.
    """

    target: str
    split: str
    model: Path
    page: Path
    merit: str
    figure: Estimate | None
    bound: Estimate | None
    above: tuple[str, ...]


def check_models(recipe: Recipe, plan: Plan, others: Mapping[str, Plan]) -> None:
    """Refuse what no model can be made or evaluated from, before anything is simulated.

    Parameters
    ----------
    recipe, plan
        The recipe and its plan.
    others
        By name, the plans of the recipes on whose databases the models are evaluated.

    Raises
    ------
    InputError
        Names the key and what to do.
    """
    settings, sweep = recipe.sections.recognition, recipe.sections.sweep
    if settings.targets and not sweep.healthy:
        raise InputError(f"{recipe.path}: recognition.targets needs healthy rows; set healthy in [sweep]")
    if settings.targets and sweep.specimens < settings.folds:
        raise InputError(
            f"{recipe.path}: sweep.specimens = {sweep.specimens} cannot be split into recognition.folds = "
            f"{settings.folds}; give more specimens, or fewer folds"
        )
    for name, other in others.items():
        if other.sensors[0] != plan.sensors[0]:
            raise InputError(
                f"{recipe.path}: recognition.evaluate_on: the models read {plan.sensors[0]!r}, {name} stores "
                f"{other.sensors[0]!r} first; put that sensor first in its [signature]"
            )


def make_models(
    recipe: Recipe,
    database: Database,
    others: Mapping[str, Database],
    out: Path,
    on_stage: Callable[[str], Any],
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
        Called with a sentence on what is under way or has been made.
    """
    settings = recipe.sections.recognition
    content, contents = content_of(database), {name: content_of(other) for name, other in others.items()}
    for split in settings.splits:
        for target in settings.targets:
            name = target if split == "S1" else f"{target}-{split}"
            model = Stage(
                out=out,
                name=f"models/{name}",
                inputs={
                    "target": target,
                    "split": split,
                    "settings": settings.model_dump(exclude=_OF_A_RUN),
                    "database": content,
                },
            )
            evaluation = _trained(recipe, database, model, on_stage)
            yield _reported(f"{recipe.path.stem}: {name}", model, name, database, content, evaluation, on_stage)
            for other in others if split == settings.splits[0] else ():
                title, on = f"{recipe.path.stem}: {name} on {other}", f"{name}-on-{other}"
                yield _reported(title, model, on, others[other], contents[other], None, on_stage)


def _trained(recipe: Recipe, database: Database, stage: Stage, on_stage: Callable[[str], Any]) -> Evaluation | None:
    """What a model was found to be worth when it was trained; None where it was there."""
    found = []

    def make() -> list[Path]:
        on_stage(f"{stage.path}: training, split {stage.inputs['split']}")
        evaluation = train_model(
            database,
            stage.inputs["target"],
            stage.path,
            split=stage.inputs["split"],
            command=shlex.join(["sigdb", "run", str(recipe.path), "--out", str(stage.out)]),
            on_step=lambda step: on_stage(f"{stage.path}: {step}"),
            check=False,  # the run tells of it at its end, when all reports are written
        )
        found.append(evaluation)
        return _files(stage.path)

    run_stage(stage, make, on_stage, "trained")
    return found[0] if found else None


def _reported(
    title: str,
    model: Stage,
    name: str,
    database: Database,
    content: Mapping[str, Any],
    evaluation: Evaluation | None,
    on_stage: Callable[[str], Any],
) -> ModelResult:
    from sigdb.report import NUMBERS, PAGE, write_evaluation_report

    stage = Stage(out=model.out, name=f"reports/{name}", inputs={"model": model.files, "database": content})

    def make() -> list[Path]:
        if evaluation is None:
            on_stage(f"{stage.path}: evaluating on {database.store}")
        found = evaluation or evaluate_with_bound(load_model(model.path), database)
        write_evaluation_report(found, stage.path, title=title)
        return _files(stage.path)

    run_stage(stage, make, on_stage, "written")
    return _result(model.path, stage.path / PAGE, json.loads((stage.path / NUMBERS).read_text(encoding="utf-8")))


def _result(model: Path, page: Path, facts: Mapping[str, Any]) -> ModelResult:
    merit = MERIT[facts["target"]]
    return ModelResult(
        target=facts["target"],
        split=facts["split"].partition(",")[0],
        model=model,
        page=page,
        merit=merit,
        figure=_figure(facts["figures"][facts["learner"]].get(merit)),
        bound=_figure((facts["bound"] or {}).get(merit)),
        above=tuple(facts["above"]),
    )


def _figure(ends: Mapping[str, float | None] | None) -> Estimate | None:
    if ends is None or ends["value"] is None:
        return None
    return Estimate(**{name: np.nan if value is None else value for name, value in ends.items()})


def _files(folder: Path) -> list[Path]:
    return [path for path in folder.rglob("*") if path.is_file()]
