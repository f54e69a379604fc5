"""Training on a database and evaluating on one: rows by specimen, baselines beside the model."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from sigdb.core.errors import InputError
from sigdb.database import Database
from sigdb.database.reader import check_complete
from sigdb.recognition.baselines import Fm4Location, Fm4Severity, MajorityLocation, MajoritySeverity
from sigdb.recognition.learners import POOLED
from sigdb.recognition.location import LocationClassifier
from sigdb.recognition.metrics import FIGURES, Figure
from sigdb.recognition.settings import Recognition
from sigdb.recognition.severity import TARGETS, SeverityRegressor
from sigdb.recognition.splits import check_classes, specimen_folds, split_hash
from sigdb.recognition.template_bank import TemplateBank
from sigdb.recognition.template_location import TemplateLocation
from sigdb.recognition.template_rows import with_averages, with_scores
from sigdb.recognition.template_scores import TemplateScores
from sigdb.recognition.template_severity import TemplateSeverity
from sigdb.recognition.views import COLUMNS

_TEST_FOLD = 0
_ESTIMATORS: dict[str, tuple[Callable[..., Any], dict[str, Callable[..., Any]]]] = {
    "location": (LocationClassifier, {"fm4": Fm4Location, "majority": MajorityLocation}),
    "severity": (SeverityRegressor, {"fm4": Fm4Severity, "majority": MajoritySeverity}),
}
_OF_TEMPLATES: dict[str, Callable[..., Any]] = {"location": TemplateLocation, "severity": TemplateSeverity}
_PROBE = 8


@dataclass(frozen=True, kw_only=True)
class Model:
    """A trained model with the baselines that were trained on the same rows.

    Attributes
    ----------
    target
        ``location`` or ``severity``.
    learner
        Which of the estimators is the model; the others stand beside it for comparison.
    estimators
        Fitted estimators by name: the learners, then the baselines. ``templates`` is missing where the database has
        no bank (:class:`TemplateBank`).
    seed
        Seed of the database that it was trained on.
    trained_on
        Specimens of that database that it has seen.
    database_hash, split_hash
        Hashes of that database, and of the table of specimens and folds.
    sensor
        Sensor whose signatures it reads.
    rows
        Number of training rows.
    """

    target: str
    learner: str
    estimators: dict[str, Any]
    seed: int
    trained_on: tuple[int, ...]
    database_hash: str
    split_hash: str
    sensor: str
    rows: int

    @property
    def scores(self) -> TemplateScores | None:
        """What reduces averages to scores of templates; None where no estimator reads them."""
        one = self.estimators.get("templates")
        return None if one is None else TemplateScores(one.bank)

    def ready(self, database: Database, rows: pd.DataFrame) -> pd.DataFrame:
        """Rows of :func:`usable_rows`, with what the estimators read beside features."""
        return rows if self.scores is None else with_scores(database, rows, self.scores)

    def predict(self, X: pd.DataFrame) -> Any:
        """What the model says of rows of features, see :class:`LocationClassifier` and :class:`SeverityRegressor`.

        With the learner ``templates``: of rows with averages, see :class:`TemplateScores`.
        """
        return self.estimators[self.learner].predict(X)


@dataclass(frozen=True, kw_only=True)
class Evaluation:
    """Figures of merit of a model and of its baselines on rows whose specimens it has not seen.

    Attributes
    ----------
    target, learner
        As in the model.
    split
        How the rows were chosen, in words.
    rows, specimens
        Number of rows and of specimens.
    figures
        Figures by estimator and name.
    """

    target: str
    learner: str
    split: str
    rows: int
    specimens: int
    figures: dict[str, dict[str, Figure]]


def train(
    database: Database,
    target: str,
    settings: Recognition | None = None,
    *,
    on_step: Callable[[str], Any] = lambda step: None,
) -> Model:
    """Train location or severity on a database, with one fold of specimens left out for :func:`evaluate`.

    Parameters
    ----------
    database
        A finished database with healthy rows.
    target
        ``location`` or ``severity``.
    settings
        Learner, folds and seed.
    on_step
        Called with a word for each estimator before it is trained.

    Raises
    ------
    InputError
        If the target is not known, there are no healthy or no damaged rows, or a class is missing from a fold.
    DatabaseError
        If the sweep is not finished.
    """
    settings = settings or Recognition()
    if target not in _ESTIMATORS:
        raise InputError(f"target = {target!r} is not known; choose one of {', '.join(_ESTIMATORS)}")
    rows = usable_rows(database, target)
    counts = np.bincount((rows["tooth"] > 0).to_numpy(int), minlength=2)
    if not counts.all():
        lacking = "healthy" if counts[0] == 0 else "damaged"
        raise InputError(f"{database.store} has no {lacking} rows to learn from; set healthy in [sweep], or add a grid")
    folds = specimen_folds(database.manifest.seed, rows["specimen"].to_numpy(), settings.folds)
    inside = (rows["specimen"].map(folds) != _TEST_FOLD).to_numpy()
    check_classes(rows["tooth"], inside, "training")
    check_classes(rows["tooth"], ~inside, "held-out")
    training = rows[inside]
    bank = _bank(database, settings.learner, on_step)
    if bank is not None:
        on_step("scores of templates")
        training = with_scores(database, training, TemplateScores(bank))
    groups = training["specimen"].to_numpy()
    labels = training["tooth"] if target == "location" else training[["tooth", *TARGETS]]

    learned, baselines = _ESTIMATORS[target]
    unfitted = {name: learned(name, settings.seed) for name in POOLED}
    unfitted |= {"templates": _OF_TEMPLATES[target](bank)} if bank is not None else {}
    unfitted |= {name: baseline() for name, baseline in baselines.items()}
    estimators = {}
    for name, estimator in unfitted.items():
        on_step(name)
        estimators[name] = estimator.fit(training, labels, groups)
    return Model(
        target=target,
        learner=settings.learner,
        estimators=estimators,
        seed=database.manifest.seed,
        trained_on=tuple(sorted(one for one, fold in folds.items() if fold != _TEST_FOLD)),
        database_hash=database.manifest.hash,
        split_hash=split_hash(folds),
        sensor=database.sensors[0],
        rows=len(training),
    )


def evaluate(model: Model, database: Database) -> Evaluation:
    """Evaluate a model on the rows of a database whose specimens it has not seen.

    Specimens are the same gears in databases of the same seed; rows with a specimen that the model was trained on are
    left out.

    Raises
    ------
    InputError
        If no rows are left, or the database holds another sensor.
    """
    rows = usable_rows(database, model.target)
    if database.sensors[0] != model.sensor:
        raise InputError(f"the model reads {model.sensor!r}, {database.store} holds {database.sensors[0]!r} first")
    same_gears = database.manifest.seed == model.seed
    if same_gears:
        rows = rows[~rows["specimen"].isin(model.trained_on)]
    if rows.empty:
        raise InputError(
            f"every specimen of {database.store} was used in training; evaluate on a database with another seed"
        )
    if model.target == "severity":
        rows = rows[rows["tooth"] > 0]
        if rows.empty:
            raise InputError(f"{database.store} has no damaged rows, and severity is judged on them")
    rows = model.ready(database, rows)
    held_out = "specimens held out of training" if same_gears else "specimens of a database with another seed"
    same_cases = "the same cases" if database.manifest.hash == model.database_hash else "the cases of another database"
    return Evaluation(
        target=model.target,
        learner=model.learner,
        split=f"S1, by specimen: {held_out}, {same_cases}",
        rows=len(rows),
        specimens=rows["specimen"].nunique(),
        figures={
            name: FIGURES[model.target](estimator.predict(rows), rows) for name, estimator in model.estimators.items()
        },
    )


def usable_rows(database: Database, target: str) -> pd.DataFrame:
    """Rows that have a result and, for severity, one severity for all their damaged teeth.

    Raises
    ------
    DatabaseError
        If the sweep is not finished.
    """
    check_complete(database)
    labels = ("tooth", *TARGETS, "specimen", "averages", "scatter", "fm4", "status")
    columns = ", ".join(dict.fromkeys((*labels, *COLUMNS)))
    plain = " and pattern = ''" if target == "severity" else ""
    return database.sql(f"select id, {columns} from features where status = 'ok'{plain} order by id").set_index("id")


def probe_rows(model: Model, database: Database, rows: pd.DataFrame) -> pd.DataFrame:
    """A few rows of one tooth count with all that the model's estimators read, for :func:`save_model`."""
    alike = rows[rows["teeth"] == rows["teeth"].iloc[0]]
    few = alike.iloc[:: max(1, len(alike) // _PROBE)][:_PROBE]
    return few if model.scores is None else with_averages(database, few, model.scores)


def _bank(database: Database, learner: str, on_step: Callable[[str], Any]) -> TemplateBank | None:
    """The bank of templates; None where the database has none and another learner is the model."""
    try:
        return TemplateBank.of(database)
    except InputError as error:
        if learner == "templates":
            raise
        on_step(f"templates are left out: {error}")
        return None
