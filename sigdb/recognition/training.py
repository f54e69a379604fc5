"""Training on a database: a model and its baselines, by a split that keeps specimens apart."""

from collections.abc import Collection

import numpy as np
import pandas as pd

from sigdb.core import InputError, NotApplicableError, OnStep, ignore
from sigdb.database import SHOWN_QUANTITIES, TRAINING, Database, damage_columns, labelled_rows, make_split, model_form
from sigdb.recognition.answers import listed
from sigdb.recognition.calibration.conformal import COVERAGE, least_specimens
from sigdb.recognition.estimators.contract import Estimator
from sigdb.recognition.estimators.registry import columns_read, default_learner, learner_class
from sigdb.recognition.estimators.user_estimator import UserEstimator
from sigdb.recognition.idle_cores import idle_cores
from sigdb.recognition.model import Model, reducers_of
from sigdb.recognition.rows.batch import CELLS, Batch
from sigdb.recognition.rows.further_columns import functions_of, further_columns, missing_numbers
from sigdb.recognition.rows.streams import read_averages, read_features, reduce_averages
from sigdb.recognition.settings import RecognitionSettings
from sigdb.recognition.targets.all_targets import target_named
from sigdb.recognition.targets.target import Target
from sigdb.recognition.templates.bank import TemplateBank
from sigdb.recognition.templates.scores import TemplateScores
from sigdb.recognition.trained_range import TrainedRange
from sigdb.transmission import SIZES

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
        With ``specimen``, ``draw``, the columns of :data:`CASE`, and sizes of damage where there are any.
    most
        Greatest number of rows.

    References
    ----------
    .. [1] R. D. Richtmyer, "The evaluation of definite integrals, and a quasi-Monte-Carlo method based on the
           properties of algebraic numbers", Los Alamos report LA-1342, 1951.
    """
    if len(rows) <= most:
        return rows
    sizes = [name for name in SHOWN_QUANTITIES if name in rows and name not in CASE]
    case = rows.groupby([*CASE, *sizes], dropna=False).ngroup().to_numpy()
    specimen = np.unique(rows["specimen"], return_inverse=True)[1]
    key = np.sqrt(2) * case + np.sqrt(3) * specimen + np.sqrt(5) * rows["draw"].to_numpy()
    kept = np.lexsort((rows.index, key % 1))[:most]
    return rows.iloc[np.sort(kept)]


DRAWN_ROWS = 25_000
"""Greatest number of rows that all estimators but the bank of templates learn from.

On the million rows of the reference recipe, split S1, more rows gain little. The accuracy of ``lda`` for 12 000, 25 000
and 50 000 rows is 0.630, 0.633 and 0.633, that of ``boosting`` 0.648, 0.652 and 0.653. Their standard error over
specimens is 0.004.
"""


@idle_cores()
def train(
    database: Database,
    target: str,
    settings: RecognitionSettings | None = None,
    *,
    split: str = "S1",
    allow_leak: bool = False,
    user_estimator: UserEstimator | None = None,
    baselines: bool = True,
    on_step: OnStep = ignore,
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
        ``location``, ``severity``, ``detection`` or ``kind``.
    settings
        Learner, folds, seed and false-alarm rate.
    split
        Split, ``S0`` to ``S4``, ``S6`` or ``S7``, whose test rows training leaves out; see :func:`make_split`.
    allow_leak
        Whether the split ``random`` of recordings may be made, in which averages of one recording are on both sides.
    user_estimator
        An estimator of one's own that takes the place of the learner; see :func:`evaluate`.
    baselines
        Whether the other learners and the baselines are trained too.
    on_step
        Called with the name of each estimator before it is trained, and with a sentence on what is left out.

    Returns
    -------
    Model

    Raises
    ------
    InputError
        If the target or the split is not known or does not fit the database, or if its rows do not suffice. There must
        be healthy and damaged rows, labels that vary, all classes in each fold, and enough healthy rows for the
        false-alarm rate.
    DatabaseError
        If the sweep is not finished.
    """
    settings = settings or RecognitionSettings()
    question = target_named(target)
    wanted = settings.learner if user_estimator is None else user_estimator.name
    needs_bank = user_estimator is None and wanted is not None and learner_class(wanted, target).needs_bank
    columns = further_columns(database, settings.columns)
    settings = settings.model_copy(update={"columns": columns})
    rows = usable_rows(database, target, columns)
    for text in missing_numbers(database, rows, columns):
        on_step(text)
    _check_labels(database, question, rows)
    parts = make_split(split, rows, seed=database.manifest.seed, folds=settings.folds, allow_leak=allow_leak)
    rows = rows[parts.folds(rows) == TRAINING]
    _check_labels(database, question, rows, "training ")
    of_sigdb = baselines or user_estimator is None
    bank = _bank(database, rows, needs_bank, on_step) if of_sigdb else None
    if (specimens := rows["specimen"].nunique()) < least_specimens(COVERAGE):
        on_step(
            f"sets and intervals of {COVERAGE:g} need {least_specimens(COVERAGE)} specimens; the training rows are of "
            f"{specimens}, so these hold all answers"
        )
    learner = wanted or default_learner(None if columns else bank)
    unfitted = question.estimators(settings, bank) if of_sigdb else {}
    if columns and user_estimator is None and learner in unfitted and not unfitted[learner].columns:
        able = ", ".join(name for name, each in unfitted.items() if each.columns)
        raise InputError(
            f"columns = {', '.join(columns)}: the learner {learner} compares averages with templates, which have none "
            f"of them; choose one of {able}, or leave the columns out"
        )
    if user_estimator is not None:
        others = {name: each for name, each in unfitted.items() if name != user_estimator.name}
        unfitted = {user_estimator.name: user_estimator} | others
    unfitted = unfitted if baselines else {learner: unfitted[learner]}
    on_step("reading averages")
    fitted: dict[str, Estimator] = {}

    def fit(names: Collection[str], seen: Batch) -> None:
        labels, specimens = question.labels(seen.table), seen.table["specimen"].to_numpy()
        for name in names:
            on_step(name)
            try:
                fitted[name] = unfitted[name].fit(seen, labels, specimens)
            except NotApplicableError as error:
                if name == learner:
                    raise
                on_step(f"{name} is left out: {error}")

    scored = [name for name, estimator in unfitted.items() if estimator.learns_from_all]
    drawn = _read(database, evenly_drawn(rows, DRAWN_ROWS), unfitted.values())
    drawn_rows = len(drawn)
    fit([name for name in unfitted if name not in scored], drawn)
    del drawn  # memory holds either these averages or the scores of all rows
    reducers = reducers_of(unfitted[name] for name in scored)
    batch = reduce_averages(database, Batch(table=rows), reducers, sensor=database.sensors[0])
    fit(scored, batch)
    reducer = fitted[learner].reducer
    noise = reducer.noise(batch) if isinstance(reducer, TemplateScores) else None
    estimators = {name: fitted[name] for name in unfitted if name in fitted}
    return Model(
        target=target,
        learner=learner,
        estimators=estimators,
        seed=database.manifest.seed,
        trained_on=tuple(int(specimen) for specimen in np.unique(rows["specimen"])),
        database_hash=database.manifest.hash,
        form=model_form(database.manifest.resolved),
        split=split,
        folds=settings.folds,
        split_hash=parts.hash,
        sensor=database.sensors[0],
        rows=len(rows),
        drawn_rows=drawn_rows,
        false_alarm_rate=settings.false_alarm_rate,
        trained_range=TrainedRange.of_rows(database, rows, noise),
        columns=columns,
        added=functions_of(database, columns),
    )


def _check_labels(database: Database, target: Target, rows: pd.DataFrame, kind: str = "") -> None:
    """Refuse rows from which the target cannot be learnt: all healthy or all damaged, or all with the same labels.

    Parameters
    ----------
    database, target
        Database of the rows, and target.
    rows
        Rows of :func:`usable_rows`, all or some.
    kind
        Kind of the rows, for messages; empty for all of the database.
    """
    of_them = f"{database.store} has no {{}} {kind}rows to learn from"
    swept = f"sweep {'one of them' if len(target.varying) > 1 else 'it'}"
    measured = "ingest recordings with other labels, or label those that are there (sigdb label)"
    remedy = (measured, measured) if database.manifest.is_measured else ("set healthy in [sweep], or add a grid", swept)
    damaged = rows[rows["tooth"] > 0]
    if len(damaged) == len(rows):
        raise InputError(f"{of_them.format('healthy')}; {remedy[0]}")
    if damaged.empty:
        only = f" for {target.name}, which is of rows with {target.row_condition}" if target.row_condition else ""
        raise InputError(f"{of_them.format('damaged')}{only}; {remedy[0]}")
    varying = [name for name in target.varying if name in damaged]
    if target.varying and all(damaged[name].nunique() < 2 for name in varying):
        raise InputError(
            f"{database.store}: {target.name} cannot be learnt, since {listed(varying)} "
            f"{'do' if len(varying) > 1 else 'does'} not vary over its damaged {kind}rows"
            f"{_what_varies(database, target)}; {remedy[1]}"
        )


def _what_varies(database: Database, target: Target) -> str:
    """Return a part of a sentence on the parameters of damage that vary, which the target is not about."""
    stored = set(database.dataset("features").schema.names)
    damage = {"tooth", "pattern", *SIZES, *(detail for details in SIZES.values() for detail in details)}
    names = sorted((damage & stored) - set(target.varying))
    counts = database.sql(
        f"select {', '.join(f'count(distinct {name}) as {name}' for name in names)} from features where tooth > 0"
    ).iloc[0]
    varying = [name for name in names if counts[name] > 1]
    return f" (what varies is {listed(varying)}, which {target.name} is not about)" if varying else ""


def _bank(database: Database, rows: pd.DataFrame, needed: bool, on_step: OnStep) -> TemplateBank | None:
    """Return the templates of the training rows' cases; None where there can be no bank and none is needed."""
    try:
        return TemplateBank.of(database, cases=rows, specimens=rows["specimen"])
    except NotApplicableError as error:
        if needed:
            raise
        on_step(f"templates are left out: {error}")
        return None


def _read(database: Database, rows: pd.DataFrame, estimators: Collection[Estimator]) -> Batch:
    """Return not too many rows with all that estimators read."""
    sensor = database.sensors[0]
    batch = reduce_averages(database, Batch(table=rows), reducers_of(estimators), sensor=sensor)
    if any(estimator.reads_whole_averages for estimator in estimators):
        batch = read_averages(database, batch, sensor=sensor)
    return read_features(database, batch) if any(CELLS in estimator.reads for estimator in estimators) else batch


def usable_rows(database: Database, target: str, further: Collection[str] = ()) -> pd.DataFrame:
    """Rows that have a result and, for severity, one severity for all their damaged teeth, by id, without arrays.

    Parameters
    ----------
    database, target
        Database of the rows, and target.
    further
        Columns of ``features`` that estimators read besides those of their kinds.

    Raises
    ------
    DatabaseError
        If the sweep is not finished.
    """
    question = target_named(target)
    sizes = damage_columns(database) if target == "severity" else []
    further = (*question.columns, *sorted(columns_read()), *further, *sizes)
    return labelled_rows(database, question.row_condition, further)
