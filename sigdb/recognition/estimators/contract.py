"""The contract of an estimator: the columns that it reads, how it is trained, and how it answers."""

from abc import ABC, abstractmethod
from typing import ClassVar, Self, TypeAlias

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from sklearn.base import BaseEstimator

from sigdb.core import BoolArray, FloatArray, InputError, IntArray, NotApplicableError, plain_array
from sigdb.database import QUANTITIES
from sigdb.recognition.answers import NO_TEMPLATE_FITS, Answers
from sigdb.recognition.rows.batch import TSA, Batch, Column, Reducer, Rows
from sigdb.recognition.settings import RecognitionSettings
from sigdb.recognition.templates.bank import TemplateBank

Labels: TypeAlias = ArrayLike | pd.DataFrame
"""First damaged tooth of each row, 0 for none; or a frame of it, ``tooth``, of the severities, and of ``kind``."""


class Estimator(BaseEstimator, ABC):
    """An estimator that is trained on rows of a database and compared with others.

    To add one, write a subclass in a file of its own and enter it in
    :data:`~sigdb.recognition.estimators.registry.REGISTRY`. It keeps scikit-learn's conventions: parameters of the
    initialiser are attributes of the same names, and what is learnt has names that end in an underscore.

    Attributes
    ----------
    reads
        Columns of the table ``features`` that it reads, and ``tsa`` where it reads averages.
    columns
        Further columns of ``features`` that it was given to read: indicators or added features.
    optional
        Columns among those of ``reads`` that rows may lack.
    needs_bank
        Whether it is made from a bank of templates.
    detector_folds
        Number of parts of the specimens with which a :class:`Detector` trains copies of it.
    """

    reads: frozenset[Column] = frozenset()
    columns: tuple[Column, ...] = ()
    optional: ClassVar[frozenset[Column]] = frozenset()
    needs_bank: ClassVar[bool] = False
    detector_folds: ClassVar[int] = 5

    @property
    def columns_read(self) -> frozenset[Column]:
        """All columns that it reads: those of its kind, and those that it was given."""
        return self.reads | frozenset(self.columns)

    @property
    def reducer(self) -> Reducer | None:
        """Reducer of averages to the few numbers that it reads; None where it reads whole averages, or none."""
        return None

    @property
    def reads_whole_averages(self) -> bool:
        """Whether it reads whole averages."""
        return TSA in self.reads and self.reducer is None

    @property
    def learns_from_all(self) -> bool:
        """Whether it is trained on all rows, since it reads only a few numbers of each; others see a part of them."""
        return False

    @property
    def template_bank(self) -> TemplateBank | None:
        """Bank of templates that it carries; None without."""
        return None

    @property
    def trained_prevalence(self) -> float | None:
        """Share of damaged rows that its probabilities were calibrated with; None where there is none."""
        return getattr(self, "prevalence_", None)

    @property
    def kinds(self) -> tuple[str, ...]:
        """Kinds of damage among which a trained one chooses, ``none`` first; empty for another question."""
        classes = np.asarray(getattr(self, "classes_", ()))
        return tuple(classes.tolist()) if classes.dtype.kind == "U" else ()

    @classmethod
    def create(cls, name: str, settings: RecognitionSettings, bank: TemplateBank | None) -> Self:
        """Return an unfitted estimator.

        Parameters
        ----------
        name
            Its name in the registry.
        settings
            Settings of the training.
        bank
            Templates of the training rows; None only if ``needs_bank`` is not set.
        """
        return cls()

    @abstractmethod
    def fit(self, X: Rows, y: Labels, groups: ArrayLike | None = None) -> Self:
        """Train.

        Parameters
        ----------
        X
            Rows with the columns of ``reads``.
        y
            Labels of the rows.
        groups
            Specimen of each row; each row counts as its own if left out.
        """

    @abstractmethod
    def predict(self, X: Rows) -> IntArray | pd.DataFrame:
        """Return the predictions for rows: first damaged teeth, 0 for none, or a frame of severities."""

    def answer(self, X: Rows) -> Answers:
        """Return the answers to rows: predictions, with scores, probabilities and sets where there are any."""
        return Answers(predicted=self.predict(X))

    def fits_none(self, X: Rows) -> BoolArray | None:
        """Return whether none of its templates fits a row, (rows,); None if it has no templates to compare with."""
        return None

    def unfit_reasons(self, X: Rows) -> list[str] | None:
        """Return why none of its templates fits a row, empty where one does; None if it has none to compare with."""
        strange = self.fits_none(X)
        return None if strange is None else [NO_TEMPLATE_FITS if unfit else "" for unfit in strange]

    def detector_scorer(self) -> "Estimator":
        """Return the estimator, unfitted, whose scores a :class:`Detector` sets its threshold on."""
        return self

    def _batch(self, X: Rows) -> Batch:
        """Return rows as a batch, with the arrays that are read."""
        if isinstance(X, Batch):
            return X
        lacking = self.optional - frozenset(getattr(X, "columns", ()))
        return Batch.from_rows(X, self.columns_read - lacking)


class Scorer(Estimator):
    """An estimator with scores of 'none' and of each tooth, whose greatest is its answer."""

    @abstractmethod
    def decision_function(self, X: Rows) -> FloatArray:
        """Return unbounded scores of 'none' and of each tooth, (rows, most teeth + 1)."""

    def predict(self, X: Rows) -> IntArray:
        """Return the first damaged tooth of each row, 0 for none; (rows,)."""
        return self.decision_function(X).argmax(axis=1)

    def answer(self, X: Rows) -> Answers:
        """Return the answers to rows, with their scores."""
        scores = self.decision_function(X)
        return Answers(predicted=scores.argmax(axis=1), scores=scores)


class SeverityEstimator(Estimator):
    """An estimator of severities.

    Attributes
    ----------
    quantities_
        Quantities that it was trained on; those of models of earlier versions if it does not say.
    """

    quantities_: tuple[str, ...] = QUANTITIES

    @abstractmethod
    def predict(self, X: Rows) -> pd.DataFrame:
        """Return the severities of rows; where there are intervals, their ends are ``NAME_low`` and ``NAME_high``."""


def tooth_and_severity(y: Labels) -> tuple[IntArray, FloatArray]:
    """Return tooth (rows,) and severities (rows, k) of labels; k is 0 unless they are a frame."""
    if isinstance(y, pd.DataFrame):
        return y["tooth"].to_numpy(int), y.drop(columns="tooth").to_numpy(float)
    tooth = plain_array("fit", "y", y, int)
    return tooth, np.empty((len(tooth), 0))


def severity_labels(y: Labels) -> pd.DataFrame:
    """Return labels of severity, a frame of ``tooth`` and a column for each quantity.

    Raises
    ------
    InputError
        If they are none.
    """
    if not isinstance(y, pd.DataFrame):
        raise InputError("y has no severities; give a frame with tooth and the severities of each row")
    return y


def required_bank(bank: TemplateBank | None) -> TemplateBank:
    """Return a bank of templates, for an estimator that needs one.

    Raises
    ------
    NotApplicableError
        If there is none.
    """
    if bank is None:
        raise NotApplicableError("the estimator is made from a bank of templates, and there is none")
    return bank


def specimens_of(groups: ArrayLike | None, rows: int) -> IntArray:
    """Return the specimens of rows; each row its own if there are none."""
    return np.arange(rows) if groups is None else plain_array("fit", "groups", groups)
