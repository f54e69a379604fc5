"""Training on a database: by a split that keeps specimens apart, baselines beside the model."""

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
from sigdb.recognition.settings import Recognition
from sigdb.recognition.severity import TARGETS, SeverityRegressor
from sigdb.recognition.split_kinds import make_split, model_form
from sigdb.recognition.splits import TRAINING
from sigdb.recognition.template_bank import TemplateBank
from sigdb.recognition.template_location import TemplateLocation
from sigdb.recognition.template_rows import with_averages, with_scores
from sigdb.recognition.template_scores import TemplateScores
from sigdb.recognition.template_severity import TemplateSeverity
from sigdb.recognition.views import COLUMNS

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
    database_hash
        Hash of that database.
    form
        Hash of each part of the rig and the solver that the database was made with.
    split, folds, split_hash
        Name of the split that it was trained by, its number of folds, and the hash of its table.
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
    form: dict[str, str]
    split: str
    folds: int
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


def train(
    database: Database,
    target: str,
    settings: Recognition | None = None,
    *,
    split: str = "S1",
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
    split
        What is left out besides, ``S0`` to ``S4``: see :func:`~sigdb.recognition.split_kinds.make_split`.
    on_step
        Called with a word for each estimator before it is trained.

    Raises
    ------
    InputError
        If the target or the split is not known or does not fit the database, there are no healthy or no damaged rows,
        or a class is missing from a fold.
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
    parts = make_split(split, rows, seed=database.manifest.seed, folds=settings.folds)
    training = rows[parts.folds(rows) == TRAINING]
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
        trained_on=tuple(int(one) for one in np.unique(groups)),
        database_hash=database.manifest.hash,
        form=model_form(database.manifest.resolved),
        split=split,
        folds=settings.folds,
        split_hash=parts.hash,
        sensor=database.sensors[0],
        rows=len(training),
    )


def usable_rows(database: Database, target: str) -> pd.DataFrame:
    """Rows that have a result and, for severity, one severity for all their damaged teeth.

    Raises
    ------
    DatabaseError
        If the sweep is not finished.
    """
    check_complete(database)
    labels = ("tooth", *TARGETS, "specimen", "draw", "snr_db", "averages", "scatter", "fm4", "status")
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
