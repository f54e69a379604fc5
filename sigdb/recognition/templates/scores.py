"""Averages to scores: the log-likelihood ratio of damage at each tooth, and the posterior of its severity."""

from collections.abc import Iterator
from typing import Self, TypedDict

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import ArrayLike, NDArray
from scipy.special import logsumexp, softmax
from sklearn.base import BaseEstimator, TransformerMixin

from sigdb.core import FloatArray, InputError, IntArray, NotApplicableError, blocks
from sigdb.database import has_several_kinds
from sigdb.measurement import shape_of
from sigdb.recognition.noise.noise_shape import RowNoise, whitened
from sigdb.recognition.noise.surprise import ANOTHER_TOOTH, MORE_DAMAGE, normal_surprise, surprise
from sigdb.recognition.rows.batch import NOISE, POINT, TSA, Batch, Column, Rows
from sigdb.recognition.templates.bank import TemplateBank
from sigdb.recognition.templates.local_templates import LocalTemplates
from sigdb.recognition.templates.posterior import Posterior, posterior, quantity_posterior

COLUMNS: frozenset[Column] = frozenset({*POINT, *NOISE, TSA})
"""Columns that scores are made of."""

_LEAST_SHARE = 0.01
"""Least probability of a part of the mixture that counts in distances of templates."""

_ROWS_AT_ONCE = 512
"""Rows of a task, so that every thread has some."""


class TemplateScores(TransformerMixin, BaseEstimator):
    """Scores of averages against a bank of templates, by the law of noise and specimens.

    The first scores, one for each tooth t, are the logarithms of ``p(x | damage from t) / p(x | none)``. Damage is any
    template, weighed as in the bank, and x is normal as in :class:`Hypotheses` at the operating point of the average,
    or at the nearest one of a bank that does not interpolate. The next score is ``reduced_chi2``, the squared residual
    of the most likely template in standard deviations, divided by the number of samples; it is about 1 for a row that
    the bank covers. ``surprise`` and ``surprise_place`` say how uneven that residual is, and where
    (:func:`~sigdb.recognition.noise.surprise.surprise`), and ``noise`` is the deviation of white noise in which damage
    stands out as much (:meth:`TemplateBank.effective_noise`). Then come posterior mean, median and standard deviation
    (``spread``) of each quantity of severity given damage which has it, whatever the tooth; where damage is of several
    kinds, also the ``probability`` that damage has it. The last score is ``beyond``, by how many standard
    deviations the average asks for more damage than the most severe templates have; 0 where
    the most likely template is not one of these. Where the bank holds between its severities, these are continuous
    (:class:`ContinuousSeverity`).

    The noise of an average is taken from its own revolutions: ``scatter / sqrt(averages)``. Where rows have
    ``noise``, by order, averages and laws are divided by its shape
    (:mod:`~sigdb.recognition.noise.noise_shape`). Turning an average by j teeth turns its scores by j teeth exactly,
    unless harmonic excitations fixed to the shaft are part of the law.

    Parameters
    ----------
    bank
        Templates.
    n_jobs
        Threads, as in joblib.
    severity
        Whether there are scores of severity, those after ``reduced_chi2``.

    Notes
    -----
    Nothing is learnt from rows, so the scores of every row count as those of an unseen specimen.
    """

    def __init__(self, bank: TemplateBank, n_jobs: int | None = None, severity: bool = True) -> None:
        self.bank = bank
        self.n_jobs = n_jobs
        self.severity = severity

    @property
    def column(self) -> str:
        """Name of the scores among those of other reducers."""
        return "template_scores" if self.severity else "template_location_scores"

    def __sklearn_is_fitted__(self) -> bool:
        return True

    def fit(self, X: Rows | None = None, y: ArrayLike | None = None) -> Self:
        """Do nothing."""
        return self

    @property
    def _most_teeth(self) -> int:
        return max(self.bank.teeth)

    @property
    def _ratios(self) -> int:
        """Number of the log-likelihood ratios: one for each tooth."""
        return self._most_teeth

    def get_feature_names_out(self, input_features: ArrayLike | None = None) -> NDArray[np.object_]:
        """Return the names of the scores."""
        teeth = [f"tooth_{t}" for t in range(1, self._most_teeth + 1)]
        return np.array([*teeth, "reduced_chi2", "surprise", "surprise_place", "noise", *self._further], dtype=object)

    @property
    def _further(self) -> tuple[str, ...]:
        return (*self._of_severity, "beyond") if self.severity else ()

    @property
    def _of_severity(self) -> tuple[str, ...]:
        several = ("probability",) if has_several_kinds(self.bank.quantities) else ()
        kinds = ("mean", "median", "spread", *several)
        return tuple(f"{kind}_{quantity}" for kind in kinds for quantity in self.bank.quantities)

    def transform(self, X: Rows) -> FloatArray:
        """Return the scores of rows.

        Parameters
        ----------
        X
            Rows with ``teeth``, ``speed_rpm`` (rpm), ``torque`` (N m), ``averages``, ``scatter`` (unit of the signal)
            and ``tsa``, the average from the tacho mark. ``noise`` by order is optional.

        Returns
        -------
        (rows, scores) float64
            As ``get_feature_names_out``; -inf for teeth that a gear does not have.

        Raises
        ------
        NotApplicableError
            If the bank does not have the tooth count, or averages have another length than its own.
        InputError
            If a column is missing, an average is not finite, or a scatter is not above 0.
        """
        batch = Batch.from_rows(X, COLUMNS)
        noise = batch.row_noise()
        _check_noise(batch, noise.level)
        parts = Parallel(n_jobs=self.n_jobs, prefer="threads")(
            delayed(self._scores)(local, at, x, noise.level[at], noise.uneven[at], coefficients)
            for local, at, x, coefficients in self._pieces(batch, noise)
        )
        scores = np.empty((len(batch), self._ratios + 4 + len(self._further)))
        for at, some in parts:
            scores[at] = some
        return scores

    def noise(self, batch: Batch) -> FloatArray:
        """Return the deviation of white noise in which damage stands out as much as in that of averages, (rows,).

        It is that of rows whose averages were reduced, or of :meth:`TemplateBank.effective_noise`.
        """
        kept = batch.reduced.get(self.column)
        return self.bank.effective_noise(batch) if kept is None else kept[:, self._ratios + 3]

    def noise_db(self, batch: Batch) -> FloatArray:
        """Return that noise relative to the healthy signal at the operating point of averages, (rows,) dB."""
        return np.asarray(10 * np.log10(self.noise(batch) ** 2 / self.bank.healthy_variance(batch)))

    def reduced_chi2(self, batch: Batch) -> FloatArray:
        """Return the reduced chi-square of the most likely template, (rows,)."""
        return batch.reduce(self)[:, self._ratios]

    def surprise(self, batch: Batch) -> tuple[FloatArray, FloatArray]:
        """Return the surprise of the residual of the most likely template, and its place, (rows,) each."""
        surprise, place = batch.reduce(self)[:, self._ratios + 1 : self._ratios + 3].T
        return surprise, place

    def beyond(self, batch: Batch) -> FloatArray:
        """Return by how many standard deviations averages ask for more than the most severe templates, (rows,)."""
        return batch.reduce(self)[:, -1]

    def severities(self, batch: Batch) -> dict[str, FloatArray]:
        """Return ``mean``, ``median``, ``spread`` and ``probability`` of each quantity, (rows, quantities) each.

        The probability, that damage has the quantity, is there where damage is of several kinds.
        """
        scores, names = batch.reduce(self), list(self._of_severity)
        every = scores[:, -1 - len(names) : -1]
        count = len(self.bank.quantities)
        return {names[i].partition("_")[0]: every[:, i : i + count] for i in range(0, len(names), count)}

    def _pieces(
        self, batch: Batch, noise: RowNoise
    ) -> Iterator[tuple[LocalTemplates, IntArray, FloatArray, FloatArray | None]]:
        """Yield templates with places of rows near them, the averages of these, and their coefficients.

        Templates and averages are divided by the shape of the noise.
        """
        pieces = self.bank.locals(*batch.operating_point())
        averages: dict[int, tuple[IntArray, FloatArray]] = {}
        for local, at, coefficients in pieces:
            averages = averages or {teeth: (of_teeth, x) for teeth, of_teeth, x in batch.averages()}
            of_teeth, x = averages[local.teeth]
            rows = np.searchsorted(of_teeth, at)
            _check_averages(x[rows], local)
            for levels, places in noise.alike(at):
                shaped = local.whitened(levels)
                for some in (places[part] for part in blocks(len(places), _ROWS_AT_ONCE)):
                    averages_of = x[rows[some]]
                    if shaped is not local:
                        averages_of = whitened(averages_of, shape_of(levels, local.samples, local.teeth))
                    yield shaped, at[some], averages_of, None if coefficients is None else coefficients[some]

    def _scores(
        self,
        local: LocalTemplates,
        at: IntArray,
        x: FloatArray,
        noise: FloatArray,
        uneven: FloatArray,
        coefficients: FloatArray | None,
    ) -> tuple[IntArray, FloatArray]:
        law: Law = {"noise": noise, "index_error": self.bank.index_error, "coefficients": coefficients}
        each, weight, straight = local.each_log_likelihood(x, **law)
        each += weight[:, :, None, None]
        likelihood = logsumexp(each, axis=0) if len(each) > 1 else each[0]
        best = likelihood.reshape(len(x), -1).argmax(axis=1)
        place = np.column_stack(np.unravel_index(best, likelihood.shape[1:]))
        greatest = each.reshape(len(each), len(x), -1)[:, np.arange(len(x)), best]
        of_parts, part = greatest - weight, greatest.argmax(axis=0)
        ratio, severity = self._ratio_and_severity(local, each, likelihood, law)
        tests = np.empty((len(x), 4))
        for number in np.unique(part).tolist():
            rows = np.flatnonzero(part == number)
            seen = (straight if local.is_late(number) else x)[rows]
            tests[rows] = self._tests(
                local.parts[number], seen, place[rows], of_parts[number, rows], uneven[rows], _law_of(law, rows)
            )
        further = [severity, tests[:, 3:]] if self.severity else []
        return at, np.hstack([ratio, tests[:, :3], (noise * local.noise_factor)[:, None], *further])

    def _tests(
        self,
        local: LocalTemplates,
        x: FloatArray,
        best: IntArray,
        likelihood: FloatArray,
        uneven: FloatArray,
        law: "Law",
    ) -> FloatArray:
        """Return tests of averages against their most likely law, (rows, 4), from the likelihoods.

        They are reduced chi-square, surprise and its place, and by how much averages ask for more damage.
        """
        chi2 = local.laws.chi2_of(best[:, 0], likelihood, noise=law["noise"], index_error=law["index_error"])
        tests = local.residual_tests(self.bank.has_continuous_severity(local.teeth))
        white, more, others = tests.results(x, best, **law)
        even, place = surprise(white, local.teeth, uneven)
        sizes, teeth = local.outward.shape[1], max(1, tests.other_teeth)
        each = np.stack([even, normal_surprise(more, sizes), normal_surprise(others, teeth)])
        place = np.choose(each.argmax(axis=0), [place, MORE_DAMAGE, ANOTHER_TOOTH])
        more = np.where(np.isneginf(more), 0.0, more)
        return np.column_stack([chi2 / local.samples, each.max(axis=0), place, more])

    def _ratio_and_severity(
        self, local: LocalTemplates, each: FloatArray, likelihood: FloatArray, law: "Law"
    ) -> tuple[FloatArray, FloatArray]:
        """Return the first scores, (rows, most teeth), and mean, median and spread of each quantity, (rows, scores).

        The latter are empty where they are not wanted.
        """
        ratio = np.full((len(likelihood), self._most_teeth), -np.inf)
        severity = np.empty((len(likelihood), len(self._of_severity)))
        continuous = local.continuous_severity if self.bank.has_continuous_severity(local.teeth) else None
        if continuous is None:
            after = posterior(likelihood, local.log_prior, local.healthy)
            ratio[:, : local.teeth] = after.location[:, 1:] - after.location[:, :1]
            return ratio, self._severity_of_templates(after, local.severity) if self.severity else severity
        none = logsumexp(likelihood[:, local.healthy, 0] + np.log(local.share[local.healthy]), axis=1)
        distances = _distances(local, each, law)
        if not self.severity:
            evidence = continuous.evidence(likelihood, distances)
        else:
            evidence = np.empty((len(likelihood), local.teeth))
            for some, of_teeth, marginals in continuous.marginals(likelihood, distances):
                evidence[some] = of_teeth
                severity[some] = np.hstack([marginals.mean(), marginals.quantile(0.5), marginals.spread()])
        ratio[:, : local.teeth] = evidence - np.log(local.teeth) - none[:, None]
        return ratio, severity

    def _severity_of_templates(self, after: Posterior, level: FloatArray) -> FloatArray:
        """Return the scores of severity; templates with a pattern do not take part."""
        single = np.isfinite(level[:, -1])
        parts = [quantity_posterior(after, values) for values in level.T]
        columns = [[part.mean, part.quantile(0.5), part.spread] for part in parts]
        if has_several_kinds(self.bank.quantities):
            share = after.among(single).severity
            for column, values in zip(columns, level.T, strict=True):
                column.append(share @ np.isfinite(values))
        return np.column_stack([column[i] for i in range(len(columns[0])) for column in columns])


def _distances(local: LocalTemplates, each: FloatArray, law: "Law") -> list[FloatArray]:
    """Return the distances of the templates of each grid, (rows, pairs): the mean over the parts of the mixture."""
    if len(each) == 1:
        return [grid.at(**law) for grid in local.distances]
    share = softmax(logsumexp(each + local.log_prior, axis=(2, 3)), axis=0)
    share = np.where(share > _LEAST_SHARE, share, 0.0)
    share /= share.sum(axis=0)
    total: list[FloatArray] = []
    for part, of_part in zip(local.parts, share, strict=True):
        rows = np.flatnonzero(of_part)
        if len(rows):
            some = [of_part[rows, None] * grid.at(**_law_of(law, rows)) for grid in part.distances]
            total = total or [np.zeros((len(of_part), distances.shape[1])) for distances in some]
            for sums, distances in zip(total, some, strict=True):
                sums[rows] += distances
    return total


def _of_rows(coefficients: FloatArray | None, rows: IntArray) -> FloatArray | None:
    return None if coefficients is None else coefficients[rows]


def _law_of(law: "Law", rows: IntArray) -> "Law":
    """Return the arguments of the laws of some averages."""
    return {**law, "noise": law["noise"][rows], "coefficients": _of_rows(law["coefficients"], rows)}


class Law(TypedDict):
    """Arguments of the laws of some averages."""

    noise: FloatArray
    index_error: float
    coefficients: FloatArray | None


def _check_noise(batch: Batch, noise: FloatArray) -> None:
    """Refuse rows whose noise is not known."""
    if np.isnan(noise).any():
        scatter = batch.column("scatter")[np.isnan(noise).argmax()]
        raise InputError(
            f"scatter = {scatter:g} must be above 0: the noise of an average is taken from the scatter between its "
            "revolutions; give averages of 2 revolutions or more"
        )


def _check_averages(x: FloatArray, point: LocalTemplates) -> None:
    """Refuse averages that the templates cannot be compared with."""
    if x.shape[1] != point.samples:
        raise NotApplicableError(
            f"tsa has {x.shape[1]} samples, but the bank's averages of {point.teeth} teeth have {point.samples}; "
            "average with as many samples a tooth"
        )
    if not np.isfinite(x).all():
        raise InputError("tsa holds values that are not finite; keep rows whose status is 'ok'")
