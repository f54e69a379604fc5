"""A trained model with its baselines: what it reads, and how it answers."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Unpack

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sigdb.core import Answer, BoolArray, FloatArray, InputError, IntArray, NotApplicableError
from sigdb.database import Database
from sigdb.recognition.answers import Answers, answer_table, severity_sentences, without_improbable
from sigdb.recognition.decision import NO_KIND, NO_TOOTH, Costs, check_decision, decided_answers, warn_of_outside
from sigdb.recognition.estimators.contract import Estimator
from sigdb.recognition.rows.batch import CELLS, TSA, Batch, Reducer, Rows
from sigdb.recognition.rows.plain_rows import PlainRow, plain_rows
from sigdb.recognition.rows.streams import read_averages, read_features, reduce_averages, stream_features
from sigdb.recognition.templates.scores import TemplateScores
from sigdb.recognition.trained_range import TrainedRange

_PROBE = 8


@dataclass(frozen=True, kw_only=True)
class Model:
    """A trained model with the baselines that were trained on the same rows.

    Attributes
    ----------
    target
        ``location``, ``severity``, ``detection`` or ``kind``.
    learner
        Name of the estimator that is the model; the others are for comparison.
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
        Number of them that most estimators have learnt from, see :func:`train`.
    false_alarm_rate
        Rate that detectors, and the baselines' thresholds, were set at.
    trained_range
        The range of its training rows; None where it is not known, for models of version 0.1.0 without templates.
    columns
        Further columns that ``boosting`` and ``lda`` read: indicators or added features.
    added
        SHA-256 of the module of each function that added some of these columns, by ``MODULE:FUNCTION``.
    """

    target: str
    learner: str
    estimators: dict[str, Estimator]
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
    trained_range: TrainedRange | None = None
    columns: tuple[str, ...] = ()
    added: Mapping[str, str] = field(default_factory=dict)

    @property
    def estimator(self) -> Estimator:
        """The estimator that is the model."""
        return self.estimators[self.learner]

    @property
    def reducers(self) -> dict[str, Reducer]:
        """By name, the reducers of averages of its estimators."""
        return reducers_of(self.estimators.values())

    def predict(
        self,
        X: Rows | None = None,
        *,
        prevalence: float | None = None,
        costs: Costs | None = None,
        **row: Unpack[PlainRow],
    ) -> "IntArray | NDArray[np.str_] | pd.DataFrame":
        """Return the decisions of :meth:`assess`: the predictions for rows like those that the model was trained on.

        A row outside the range of the training, or that fits no template, has none: -1, ``outside`` for kinds, nan for
        severities. ``estimator.predict`` forces an answer to every row.

        Parameters
        ----------
        X
            Rows of features, see :class:`LocationClassifier`, :class:`SeverityRegressor` and :class:`Detector`; with
            averages for the learner ``templates``, see :class:`TemplateScores`. Or none, but arrays instead.
        prevalence
            Share of the gears that are damaged, between 0 and 1. By default that of the training rows for location. A
            detector answers at its rate of false alarms if there are no costs either.
        costs
            Costs of a false alarm, a miss and a wrong tooth: the answer is that of least expected cost. By default all
            errors of location cost the same. A detector needs a prevalence with them.
        **row
            ``tsa``, averages of one revolution from the tacho mark, (n,) or (rows, n), in the unit of the training.
            ``speed_rpm`` and ``torque`` (N m) of the drive, numbers or (rows,). ``averages``, the number of
            revolutions of each average. ``scatter``, the standard deviation between revolutions, rms over angle, in
            the unit of ``tsa``. ``noise``, if it is not white, the deviation of white noise with the density of the
            average's noise at orders 0, 1, 2 ... n / 2, in the unit of ``tsa``. ``teeth`` is the tooth count, where the
            model was trained on several. ``unit`` and ``sensor``, if stated, must be those of the training.

        Returns
        -------
        ndarray or DataFrame
            (rows,) first damaged tooth, or 1 for damage; 0 for none and -1 for a row outside. Kind: the kind of damage,
            ``none`` for none, ``outside`` for a row outside. Severity: a frame, see :meth:`SeverityRegressor.predict`;
            nan for a row outside.

        Raises
        ------
        InputError
            If a column or an argument is missing or is no array of numbers, or a value is masked. Also if the
            prevalence or the costs do not fit the model.

        Warns
        -----
        OutsideWarning
            If a row is outside. About 1 in 100 rows of the training fits no template either.
        """
        verdict = self.assess(X, prevalence=prevalence, costs=costs, **row)
        warn_of_outside(verdict)
        if "decision" not in verdict:
            return verdict.drop(columns=["kind", "answer", "outside", "reason"])
        if self.target == "kind":
            return np.where(verdict["outside"], NO_KIND, verdict["decision"]).astype(str)
        return np.where(verdict["outside"], NO_TOOTH, verdict["decision"]).astype(int)

    def predict_proba(
        self, X: Rows | None = None, *, prevalence: float | None = None, **row: Unpack[PlainRow]
    ) -> FloatArray:
        """Return the probabilities of the answers; nan for a row that :meth:`predict` has no answer to.

        Parameters
        ----------
        X, prevalence, **row
            As in :meth:`predict`.

        Returns
        -------
        ndarray
            Location: of 'none' and of each tooth, (rows, teeth + 1). Detection: of no damage and of damage, if both
            are as likely beforehand or by the prevalence, (rows, 2).

        Raises
        ------
        NotApplicableError
            For a model of severity, which has intervals instead.

        Warns
        -----
        OutsideWarning
            As in :meth:`predict`.
        """
        batch = self._batch(X, row)
        reasons, usual, inside = self._usual(batch)
        warn_of_outside(
            pd.DataFrame({"outside": [bool(reason) for reason in reasons], "reason": reasons}, index=batch.index)
        )
        probabilities: FloatArray = np.full((len(batch), len(getattr(self.estimator, "classes_", ()))), np.nan)
        if len(usual):
            answers = decided_answers(self.estimator, usual, prevalence, None)
            if answers.probabilities is None:
                raise NotApplicableError(f"a model of {self.target} has no probabilities; predict() gives intervals")
            probabilities[inside] = answers.probabilities
        return probabilities

    def assess(
        self,
        X: Rows | None = None,
        *,
        prevalence: float | None = None,
        costs: Costs | None = None,
        **row: Unpack[PlainRow],
    ) -> pd.DataFrame:
        """Return the answers to rows, with their sentences; also to those that the model was not trained for.

        Parameters
        ----------
        X, prevalence, costs, **row
            As in :meth:`predict`.

        Returns
        -------
        pandas.DataFrame
            With the columns:

            - ``kind``: a key of :data:`sigdb.core.ANSWERS`. Location: ``one tooth``, ``nothing stands out``, or
              ``cannot be judged`` where the set of answers holds no damage and a tooth; detection and kind of damage:
              ``damage`` or ``nothing stands out``, of the kind also ``cannot be judged`` as of location;
              severity, which does not say whether there is damage: None. For all targets
              ``cannot be judged`` where the row is outside;
            - ``answer``: the same as a sentence;
            - ``outside``: whether the row is outside the range of the training, or fits no template;
            - ``reason``: the reason why it is outside, empty for others;
            - ``probability``: probability of the decision, all but severity;
            - ``decision``: the answer of :meth:`predict`, all but severity: the most probable one, that of least
              expected cost, or that at the rate of false alarms;
            - ``candidates``: answers of the set, location (0 for none) and kind;
            - the columns of :meth:`predict`, severity.

            Numbers of rows outside are nan, and their candidates are empty.
        """
        check_decision(self.estimator, prevalence, costs)
        batch = self._batch(X, row)
        reasons, usual, inside = self._usual(batch)
        verdict = self._verdict(usual, prevalence, costs) if len(usual) else self._no_verdict()
        # By place: an index may hold a value twice.
        table = verdict.set_axis(inside).reindex(range(len(batch)))
        outside = np.array([bool(reason) for reason in reasons])
        unjudged = answer_table([Answer.of("cannot be judged", reason=reason) for reason in reasons])
        for name in unjudged:
            table[name] = table[name].mask(outside, unjudged[name])
        if "candidates" in table:
            table["candidates"] = [() if out else some for out, some in zip(outside, table["candidates"], strict=True)]
        table.insert(2, "outside", outside)
        table.insert(3, "reason", reasons)
        return table.set_axis(batch.index)

    def _batch(self, X: Rows | None, row: PlainRow) -> Batch:
        """Return rows as a batch with all that is read, and with averages where there are any."""
        if X is None and self.estimator.columns:
            raise InputError(
                f"the model reads the columns {', '.join(self.estimator.columns)}, which an average alone does not "
                "have; give rows of a database that has them"
            )
        if X is None:
            unit = None if self.trained_range is None else self.trained_range.unit
            X = plain_rows(row, reads=self.estimator.columns_read, teeth=self.teeth, unit=unit, sensor=self.sensor)
        elif row:
            raise InputError(f"rows are given together with {', '.join(row)}; give rows, or arrays by name")
        if isinstance(X, Batch):
            return X
        columns = frozenset(getattr(X, "columns", ()))
        return Batch.from_rows(X, self.estimator.columns_read - (self.estimator.optional - columns) | (columns & {TSA}))

    @property
    def teeth(self) -> tuple[int, ...]:
        """Tooth counts of the templates; none where there are no templates."""
        banks = (estimator.template_bank for estimator in self.estimators.values())
        return next((bank.teeth for bank in banks if bank is not None), ())

    def _reasons(self, batch: Batch) -> list[str]:
        bank = self.estimator.template_bank
        reducer = self.estimator.reducer
        noise = reducer.noise(batch) if isinstance(reducer, TemplateScores) else None
        reasons = [""] * len(batch) if self.trained_range is None else self.trained_range.reasons(batch, noise)
        if bank is not None:
            for i in np.flatnonzero(~np.isin(batch.column("teeth"), bank.teeth)):
                reasons[i] = f"teeth = {batch.column('teeth')[i]:g} was not trained on; {bank.teeth} was"
            beyond = bank.reasons(*batch.operating_point())
            reasons = [reason or another for reason, another in zip(reasons, beyond, strict=True)]
        return reasons

    def _usual(self, batch: Batch) -> tuple[list[str], Batch, IntArray]:
        """Return why each row is outside, empty where it is not; the rows inside, reduced once; and their places."""
        reasons = self._reasons(batch)
        inside = np.flatnonzero([not reason for reason in reasons])
        usual = batch.take(inside)
        if len(usual):
            usual = self._reduced(usual)
            unfit = self._unfit_reasons(usual)
            for i, reason in zip(inside, unfit, strict=True):
                reasons[i] = reason
            fits = np.array([not reason for reason in unfit])
            usual, inside = usual.take(fits), inside[fits]
        return reasons, usual, inside

    def _reduced(self, batch: Batch) -> Batch:
        reducer = self.estimator.reducer
        if reducer is None or reducer.column in batch.reduced:
            return batch
        return replace(batch, reduced={**batch.reduced, reducer.column: reducer.transform(batch)})

    def _unfit_reasons(self, batch: Batch) -> list[str]:
        """Return why a row fits no template of any estimator that can read it, empty where it does, (rows,)."""
        for estimator in (self.estimator, *self.estimators.values()):
            if estimator.columns_read <= {*batch.table.columns, *((TSA,) if batch.tsa is not None else ())}:
                reasons = estimator.unfit_reasons(batch)
                if reasons is not None:
                    return reasons
        return [""] * len(batch)

    def _outside(self, batch: Batch) -> BoolArray:
        """Return whether rows are outside the range of the training, or fit no template of the model; (rows,)."""
        unfit = self.estimator.unfit_reasons(batch) or [""] * len(batch)
        return np.array([bool(reason or other) for reason, other in zip(self._reasons(batch), unfit, strict=True)])

    def _verdict(self, batch: Batch, prevalence: float | None, costs: Costs | None) -> pd.DataFrame:
        """Return the answers to rows that are inside."""
        answers = decided_answers(self.estimator, batch, prevalence, costs)
        predicted, probabilities = answers.predicted, answers.probabilities
        if isinstance(predicted, pd.DataFrame):
            predicted = without_improbable(predicted)
            sentences = severity_sentences(predicted, getattr(self.estimator, "greatest", {}))
            return predicted.assign(kind=None, answer=sentences)[["kind", "answer", *predicted]]
        probability = np.nan if probabilities is None else probabilities[np.arange(len(batch)), predicted]
        numbers: dict[str, Any] = {"probability": probability, "decision": answers.named}
        if answers.sets is None:
            table = answer_table([Answer.of("damage" if damaged else "nothing stands out") for damaged in predicted])
            return table.assign(**numbers)
        table = answer_table(answers.verdicts)
        return table.assign(**numbers, candidates=pd.Series(answers.candidates, dtype=object))

    def _no_verdict(self) -> pd.DataFrame:
        """Return the columns of a verdict without a row."""
        sets = ("candidates",) if self.target in ("location", "kind") else ()
        numbers = getattr(self.estimator, "quantities_", ("probability", "decision", *sets))
        return pd.DataFrame(columns=["kind", "answer", *numbers])

    def answers(self, database: Database, rows: pd.DataFrame) -> dict[str, Answers]:
        """Return the answers of each estimator, read and computed batch by batch.

        Parameters
        ----------
        database
            Where the rows are from.
        rows
            Rows of :func:`usable_rows`.

        Returns
        -------
        dict
            By name of the estimator, in the order of ``rows``. Baselines that do not apply to the rows are left out.

        Raises
        ------
        NotApplicableError
            If the model itself does not apply to the rows.
        """
        needed = reducers_of([self.estimator])
        batch = reduce_averages(database, Batch(table=rows), self.reducers, sensor=self.sensor, needed=needed)
        order: list[IntArray] = []
        parts: dict[str, list[Answers]] = {name: [] for name in self.estimators}
        whole = any(estimator.reads_whole_averages for estimator in self.estimators.values())
        for places, part in stream_features(database, batch):
            some = read_averages(database, part, sensor=self.sensor) if whole else part
            order.append(places)
            for name in list(parts):
                try:
                    outside = self._outside(some) if name == self.learner else None
                    parts[name].append(replace(self.estimators[name].answer(some), outside=outside))
                except NotApplicableError:
                    if name == self.learner:
                        raise
                    del parts[name]
        every = np.concatenate(order)
        back = None if (np.diff(every) > 0).all() else np.argsort(every)
        answers = {}
        for name in list(parts):  # forgotten one by one, so that memory holds one estimator's answers twice at most
            of_name = Answers.concatenate(parts.pop(name))
            answers[name] = of_name if back is None else of_name.select(back)
        return answers

    def read(self, database: Database, rows: pd.DataFrame) -> Batch:
        """Return rows, not too many of them, with all that the model reads; ``rows`` has their scalars by id."""
        batch, reads = Batch(table=rows), self.estimator.reads
        batch = read_features(database, batch) if CELLS in reads else batch
        return read_averages(database, batch, sensor=self.sensor) if TSA in reads else batch

    def probe(self, database: Database, rows: pd.DataFrame) -> Batch:
        """Return a few rows of one tooth count with all that the model reads, for :func:`save_model`."""
        return self.read(database, few_rows(Batch(table=rows)).table)


def few_rows(rows: Batch) -> Batch:
    """Return eight rows, or all of fewer, of the first one's tooth count, in equal steps."""
    teeth = rows.table["teeth"].to_numpy()
    alike = np.flatnonzero(teeth == teeth[0])
    return rows.take(alike[:: max(1, len(alike) // _PROBE)][:_PROBE])


def reducers_of(estimators: Iterable[Estimator]) -> dict[str, Reducer]:
    """Return the reducers of estimators by name."""
    reducers = [estimator.reducer for estimator in estimators]
    return {reducer.column: reducer for reducer in reducers if reducer is not None}
