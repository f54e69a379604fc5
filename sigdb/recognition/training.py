"""Training on a database: by a split that keeps specimens apart, baselines beside the model."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from sigdb.core import InputError
from sigdb.database import Database, check_complete
from sigdb.recognition.rows.streamed import Reducer, reducers_of, with_averages, with_features, with_reduced
from sigdb.recognition.settings import RecognitionSettings
from sigdb.recognition.severity_quantities import QUANTITIES
from sigdb.recognition.splits.kinds import make_split, model_form
from sigdb.recognition.splits.split import TRAINING
from sigdb.recognition.targets.all_targets import target_named
from sigdb.recognition.templates.bank import TemplateBank

CASE = (
    "teeth",
    "tooth",
    "damaged_teeth",
    "phase_shift_deg",
    "stiffness_loss",
    "speed_rpm",
    "torque",
    "snr_db",
    "averages",
)
"""Columns that make a case."""


def evenly_drawn(rows: pd.DataFrame, most: int) -> pd.DataFrame:
    """At most so many of the rows, in their order, evenly over specimens, cases and noise draws.

    With c, s and d the numbers of a row's case, specimen and draw, the rows are kept whose fraction of
    ``c sqrt(2) + s sqrt(3) + d sqrt(5)`` is least. Such fractions fill the interval from 0 to 1 evenly along each of
    the three [1]_, so that each case and each specimen keeps nearly its share. Nothing is random: the same rows are
    drawn from the same rows in any order.

    Parameters
    ----------
    rows
        With ``specimen``, ``draw`` and the columns of :data:`CASE`.
    most
        Greatest number of rows.

    References
    ----------
    .. [1] R. D. Richtmyer, "The evaluation of definite integrals, and a quasi-Monte-Carlo method based on the
           properties of algebraic numbers", Los Alamos report LA-1342, 1951.
    """
    if len(rows) <= most:
        return rows
    case = rows.groupby(list(CASE), dropna=False).ngroup().to_numpy()
    specimen = np.unique(rows["specimen"], return_inverse=True)[1]
    key = np.sqrt(2) * case + np.sqrt(3) * specimen + np.sqrt(5) * rows["draw"].to_numpy()
    kept = np.lexsort((rows.index, key % 1))[:most]
    return rows.iloc[np.sort(kept)]


DRAWN_ROWS = 25_000
"""Greatest number of rows that all estimators but the bank of templates learn from. On the million rows of the
reference recipe, split S1, accuracy for 12 000, 25 000 and 50 000 rows is 0.630, 0.633 and 0.633 of ``lda``, and 0.648,
0.652 and 0.653 of ``boosting``, with a standard error over specimens of 0.004."""

TEMPLATES = "templates"
"""Name of the estimator that is calibrated on all training rows."""

_PROBE = 8


@dataclass(frozen=True, kw_only=True)
class Model:
    """A trained model with the baselines that were trained on the same rows.

    Attributes
    ----------
    target
        ``location``, ``severity`` or ``detection``.
    learner
        Which of the estimators is the model; the others stand beside it for comparison.
    estimators
        Fitted estimators by name: the learners, then the baselines. ``templates`` is missing where the database has
        no bank (:class:`TemplateBank`), and detectors whose healthy rows do not support the false-alarm rate are.
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
    drawn_rows
        Number of them that all but ``templates`` have learnt from, see :func:`train`.
    false_alarm_rate
        Rate that detectors, and the baselines' thresholds, were set at.
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
    drawn_rows: int
    false_alarm_rate: float

    @property
    def reducers(self) -> dict[str, Reducer]:
        """By column, what reduces averages to what the estimators read."""
        return reducers_of(self.estimators.values())

    def ready(self, database: Database, rows: pd.DataFrame) -> pd.DataFrame:
        """Rows of :func:`usable_rows`, with what the estimators read of averages where it can be had.

        Raises
        ------
        InputError
            If what the model itself reads cannot be had.
        """
        needed = reducers_of([self.estimators[self.learner]])
        return with_reduced(database, rows, self.reducers, sensor=self.sensor, needed=needed)

    def predict(self, X: pd.DataFrame) -> Any:
        """What the model says of rows of features, see :class:`LocationClassifier`, :class:`SeverityRegressor` and
        :class:`Detector`.

        With the learner ``templates``: of rows with averages, see :class:`TemplateScores`.
        """
        return self.estimators[self.learner].predict(X)


def train(
    database: Database,
    target: str,
    settings: RecognitionSettings | None = None,
    *,
    split: str = "S1",
    on_step: Callable[[str], Any] = lambda step: None,
) -> Model:
    """Train on a database, with one fold of specimens left out for :func:`evaluate`.

    Memory holds the arrays of a batch of rows, however many there are. The bank of templates is calibrated on all
    training rows, whose averages are reduced to scores as they are read. All else learns from at most 25 000 of them
    (:data:`DRAWN_ROWS`), drawn evenly over specimens and cases (:func:`~sigdb.recognition.training.evenly_drawn`).

    Parameters
    ----------
    database
        A finished database with healthy rows.
    target
        ``location``, ``severity`` or ``detection``.
    settings
        Learner, folds, seed and false-alarm rate.
    split
        What is left out besides, ``S0`` to ``S4``: see :func:`~sigdb.recognition.splits.kinds.make_split`.
    on_step
        Called with the name of each estimator before it is trained, and with a sentence on what is left out.

    Raises
    ------
    InputError
        If the target or the split is not known or does not fit the database, there are no healthy or no damaged rows,
        a class is missing from a fold, or healthy rows are too few for the false-alarm rate.
    DatabaseError
        If the sweep is not finished.
    """
    settings = settings or RecognitionSettings()
    question = target_named(target)
    rows = usable_rows(database, target)
    counts = np.bincount((rows["tooth"] > 0).to_numpy(int), minlength=2)
    if not counts.all():
        lacking = "healthy" if counts[0] == 0 else "damaged"
        raise InputError(f"{database.store} has no {lacking} rows to learn from; set healthy in [sweep], or add a grid")
    parts = make_split(split, rows, seed=database.manifest.seed, folds=settings.folds)
    training = rows[parts.folds(rows) == TRAINING]
    del rows  # of many rows this is much
    bank = _bank(database, training, settings.learner, on_step)
    unfitted = question.estimators(settings, bank)
    on_step("reading averages")
    own = reducers_of(one for name, one in unfitted.items() if name == TEMPLATES)
    drawn = _with_all(database, evenly_drawn(training, DRAWN_ROWS), reducers_of(unfitted.values()))
    training = with_reduced(database, training, own, sensor=database.sensors[0])
    estimators = {}
    for name, estimator in unfitted.items():
        on_step(name)
        seen = training if name == TEMPLATES else drawn
        try:
            estimators[name] = estimator.fit(seen, question.labels(seen), seen["specimen"].to_numpy())
        except InputError as error:
            if name == settings.learner:
                raise
            on_step(f"{name} is left out: {error}")
    return Model(
        target=target,
        learner=settings.learner,
        estimators=estimators,
        seed=database.manifest.seed,
        trained_on=tuple(int(one) for one in np.unique(training["specimen"])),
        database_hash=database.manifest.hash,
        form=model_form(database.manifest.resolved),
        split=split,
        folds=settings.folds,
        split_hash=parts.hash,
        sensor=database.sensors[0],
        rows=len(training),
        drawn_rows=len(drawn),
        false_alarm_rate=settings.false_alarm_rate,
    )


def _with_all(database: Database, rows: pd.DataFrame, reducers: dict[str, Reducer]) -> pd.DataFrame:
    """Not too many rows with all that estimators read."""
    return with_features(database, with_reduced(database, rows, reducers, sensor=database.sensors[0]))


def usable_rows(database: Database, target: str) -> pd.DataFrame:
    """Rows that have a result and, for severity, one severity for all their damaged teeth, by id, without arrays.

    Raises
    ------
    DatabaseError
        If the sweep is not finished.
    """
    check_complete(database)
    columns = ", ".join(_COLUMNS)
    condition = target_named(target).row_condition
    where = f"status = 'ok' and {condition}" if condition else "status = 'ok'"
    return database.sql(f"select id, {columns} from features where {where} order by id").set_index("id")


_COLUMNS = (
    "tooth",
    *QUANTITIES,
    "specimen",
    "draw",
    "snr_db",
    "averages",
    "scatter",
    "fm4",
    "teeth",
    "speed_rpm",
    "torque",
)
"""What is known of a row beside its arrays."""


def probe_rows(model: Model, database: Database, rows: pd.DataFrame) -> pd.DataFrame:
    """A few rows of one tooth count with all that the model's estimators read, for :func:`save_model`."""
    few = with_features(database, few_rows(rows))
    return with_averages(database, few, sensor=model.sensor) if model.reducers else few


def few_rows(rows: pd.DataFrame) -> pd.DataFrame:
    """Eight rows, or all of fewer, of the first one's tooth count, in equal steps."""
    alike = rows[rows["teeth"] == rows["teeth"].iloc[0]]
    return alike.iloc[:: max(1, len(alike) // _PROBE)][:_PROBE]


def _bank(
    database: Database, training: pd.DataFrame, learner: str, on_step: Callable[[str], Any]
) -> TemplateBank | None:
    """The templates of the training rows' cases; None where there can be no bank and another learner is the model."""
    try:
        return TemplateBank.of(database, cases=training, specimens=training["specimen"])
    except InputError as error:
        if learner == TEMPLATES:
            raise
        on_step(f"{TEMPLATES} are left out: {error}")
        return None
