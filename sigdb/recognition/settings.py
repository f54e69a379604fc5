"""The section ``[recognition]`` of a recipe."""

from collections import Counter
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field, Strict, field_validator, model_validator

from sigdb.core import Section, quantity
from sigdb.database import SPLIT_NAMES
from sigdb.recognition.estimators.registry import LEARNERS, TARGET_NAMES

if TYPE_CHECKING:
    Learner = str
    SplitName = str
    Target = str
else:
    Learner = Literal[tuple(LEARNERS)]
    SplitName = Literal[SPLIT_NAMES]
    Target = Literal[TARGET_NAMES]


class CriteriaSettings(Section):
    """Limits that a model must keep, each named after the metric that it limits. None is set by default."""

    loss_db: float | None = quantity(
        "dB",
        "Location and kind: greatest loss against the best possible answer, in every band of noise.",
        gt=0,
        default=None,
    )
    a90_ratio: float | None = quantity(
        "-", "Location and detection: greatest a90 over that of the best possible answer.", gt=0, default=None
    )
    mae_ratio: float | None = quantity(
        "-", "Severity: greatest mean absolute error over that of the posterior median.", gt=0, default=None
    )
    ece: float | None = quantity("-", "Location and kind: greatest expected calibration error.", gt=0, default=None)
    undercovered_cells: float | None = quantity(
        "-",
        "Location, kind and severity: greatest share of cells of severity, noise and operating point whose 90 % sets "
        "or intervals cover too little.",
        ge=0,
        le=1,
        default=None,
    )

    @property
    def limits(self) -> dict[str, float]:
        """The limits that are set, by name."""
        limits: dict[str, float] = self.model_dump(exclude_none=True)
        return limits


class RobustnessSettings(Section):
    """The test of models on rows that do not follow their law, one disturbance after the other; none by default."""

    rows: int = quantity("-", "Rows of each disturbance; no test for 0.", ge=0, default=0)
    points: int = quantity("-", "Operating points that they are of, at most.", ge=1, default=3)
    seed: int = quantity("-", "Seed of their rigs, gears and noise.", ge=0, default=0)
    rigs: int = quantity(
        "-", "Rigs drawn for the best possible answers under errors of speed, load, rig and profile.", ge=2, default=32
    )


class RecognitionSettings(Section):
    """Training of models, and the models that a run of the recipe makes."""

    learner: Learner | None = Field(
        default=None,
        description="Shrinkage linear discriminant analysis, gradient boosting of histograms, or a bank of templates. "
        "By default the templates, or boosting where the database has no bank.",
    )
    columns: Annotated[tuple[str, ...], Strict(False)] = Field(
        default=(),
        description="Further columns of features that boosting and lda read: indicators, added features, the "
        "MODULE:FUNCTION that added them, or 'added' for all that were added.",
    )
    coverage_by: Literal["cell", "all"] = Field(
        default="cell",
        description="Whether 90 % sets and intervals hold in each cell of severity, noise and operating point, or on "
        "average over all rows, which makes them smaller.",
    )
    folds: int = quantity("-", "Folds of specimens; one is held out for evaluation.", ge=3, default=5)
    seed: int = quantity("-", "Seed of training.", ge=0, default=0)
    false_alarm_rate: float = quantity(
        "-", "Rate of false alarms at which a detector is set.", gt=0, lt=1, default=0.01
    )
    criteria: CriteriaSettings = Field(
        default=CriteriaSettings(), description="Limits that models must keep; none if left out."
    )
    robustness: RobustnessSettings = Field(
        default=RobustnessSettings(), description="Test on rows that do not follow the law of the database."
    )
    targets: Annotated[tuple[Target, ...], Strict(False)] = Field(
        default=(), description="Questions that a run trains models for; none if left out."
    )
    splits: Annotated[tuple[SplitName, ...], Strict(False)] = Field(
        default=("S1",),
        description="Rows left out of training: a model for each target and split.",
        min_length=1,
    )
    evaluate_on: Annotated[tuple[str, ...], Strict(False)] = Field(
        default=(),
        description="Other recipes, by path from this one's folder: a run makes their databases too, and evaluates the "
        "models of the first split on them.",
    )

    @field_validator("columns", "targets", "splits", "evaluate_on")
    @classmethod
    def _named_once(cls, names: tuple[str, ...]) -> tuple[str, ...]:
        for name, count in Counter(names).items():
            if count > 1:
                raise ValueError(f"{name!r} is given twice; give it once")
        return names

    @field_validator("evaluate_on")
    @classmethod
    def _are_recipes(cls, paths: tuple[str, ...]) -> tuple[str, ...]:
        for path in paths:
            if not path.endswith(".toml"):
                raise ValueError(f"{path!r} is not the path of a recipe, which ends in .toml")
        return paths

    @model_validator(mode="after")
    def _has_models(self) -> "RecognitionSettings":
        if self.evaluate_on and not self.targets:
            raise ValueError("evaluate_on is given without targets; name what to train models for, or leave it out")
        return self
