"""The Bayes bound: the best possible answers to the rows of a database, and to rows drawn anew from their law.

Tier B2: white noise and specimens. The rule uses the law: the templates, their shares among the rows, the operating
point, the level of the noise and the size of the index errors. It has neither the specimen nor the draw of the noise.
No rule that takes one average at a time, of unseen gears, is better on average.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from sigdb.core import InputError
from sigdb.database import Database
from sigdb.recognition.bound.bayes_rule import LOCATION_RULE, RULES, ClassRule, apply_rule
from sigdb.recognition.bound.expected_losses import expected_losses, requested_shares
from sigdb.recognition.bound.operating_points import OperatingPoint, operating_points
from sigdb.recognition.metrics.calibration import CALIBRATION_METRICS
from sigdb.recognition.metrics.estimate import Estimate, Specimens
from sigdb.recognition.metrics.location_and_severity import KIND_METRICS, LOCATION_METRICS, SEVERITY_METRICS
from sigdb.recognition.metrics.metric import estimates
from sigdb.recognition.templates.posterior import entropy_of


@dataclass(frozen=True, kw_only=True, eq=False)
class Bound:
    """The answers of the Bayes rule to rows of a database.

    Attributes
    ----------
    target
        ``location``, ``kind`` or ``severity``.
    rows
        By id: ``tooth``, ``teeth``, ``specimen``, and the answer of the rule. Location and kind: ``true`` and
        ``predicted`` (the most probable tooth, 0 for none, or kind of damage, ``none`` for none), ``log_odds``
        (logarithm of P(damage) / P(none)), ``risk`` (probability that the answer is wrong), ``entropy`` (of the tooth
        or the kind, nats). Severity: ``median_QUANTITY`` and ``mean_QUANTITY`` of the
        posterior, and ``low_QUANTITY`` and ``high_QUANTITY``, which enclose 0.9 of it.
    losses
        By id, the losses that the rule minimises on average: ``error`` (0 or 1, healthy rows too), ``log_loss``
        (nats); ``absolute_QUANTITY`` (of the posterior median), ``square_QUANTITY`` (of the mean), ``crps_QUANTITY``.
    scores
        By id, columns 0, 1, 2, ..., or the kinds: logarithm of the posterior probability of 'none' and of each tooth or
        kind, -inf where a gear has no such tooth. None for severity.
    outside
        Number of rows outside the law, by reason. They are not in ``rows``.
    expected
        The same losses on rows drawn anew from the law, specimens and noise: mean and standard error. None if they were
        not requested.
    entropy
        Mean entropy of the location, or of the kind, before an average is seen, nats: H of :func:`eta_info`.
    points
        Operating points of the rows.
    """

    target: str
    rows: pd.DataFrame
    losses: pd.DataFrame
    scores: pd.DataFrame | None
    outside: dict[str, int]
    expected: dict[str, tuple[float, float]] | None
    entropy: float
    points: Sequence[OperatingPoint] = field(default=(), repr=False)

    @cached_property
    def values(self) -> pd.DataFrame:
        """By id, the value of each row by metric, NaN where a row does not count.

        Location: ``accuracy`` (healthy rows too), ``p_exact``, ``p_within_one``, ``p_detected``, ``circular_bias``,
        ``none_on_healthy``, ``log_loss``. Kind: ``p_kind`` in the place of those of teeth.
        Only accuracy and log loss are bounds: a rule that calls damage more often
        detects more of it. Severity: ``mae_QUANTITY`` and ``crps_QUANTITY``, and ``rmse_QUANTITY``, errors whose root
        mean square is the metric.
        """
        return pd.DataFrame(RULES[self.target].values(self.rows, self.losses), index=self.rows.index)

    @cached_property
    def metrics(self) -> dict[str, Estimate]:
        """Metrics by name, with 95 % intervals over specimens."""
        values = {str(name): value.to_numpy() for name, value in self.values.items()}
        metrics = (*LOCATION_METRICS, *KIND_METRICS[1:2], *CALIBRATION_METRICS, *SEVERITY_METRICS)
        return estimates(metrics, values, Specimens(self.rows["specimen"].to_numpy()))

    @cached_property
    def prior_log_loss(self) -> "pd.Series[float]":
        """By id, the log loss of the prior of location or kind; its mean is the entropy H."""
        rule = RULES[self.target]
        return pd.concat([rule.prior_log_loss(point) for point in self.points if isinstance(rule, ClassRule)])

    @cached_property
    def index_error(self) -> float:
        """Root mean square of the sizes of the index errors, m."""
        squares = [point.requested.rows["index_error"] ** 2 for point in self.points]
        return float(np.sqrt(np.concatenate(squares).mean()))


def bayes_bound(
    database: Database,
    ids: ArrayLike | None = None,
    *,
    among: ArrayLike | None = None,
    target: str = LOCATION_RULE.name,
    sensor: str | None = None,
    known_cells: bool = True,
    like: Sequence[OperatingPoint] = (),
    draws: int = 0,
    seed: int = 0,
) -> Bound:
    """Compute the Bayes bound for rows of a database.

    Parameters
    ----------
    database
        A database with rows.
    ids
        Rows that models are evaluated on; all if left out. Rows without a result and rows with loss of contact are
        outside the law; for severity also healthy ones and those with a pattern.
    among
        Rows whose shares are the prior; all if left out. For rows that are chosen by their case, as a split does, give
        these rows: then no rule is better on them.
    target
        ``location``, ``kind`` or ``severity`` (of damaged rows).
    sensor
        A stored sensor; the first one if left out.
    known_cells
        Whether the rule knows that severities are those of the templates; see :class:`OperatingPoint`.
    like
        Operating points of a bound of this database, whose hypotheses are taken; they are read from it if left out.
    draws
        Number of rows to draw anew for ``expected``; none for 0.
    seed
        Seed of these draws.

    Returns
    -------
    Bound
        Answers, losses and operating points.

    Raises
    ------
    InputError
        If the target or the sensor is not one that exists.
    NotApplicableError
        If no row is inside the law.

    Examples
    --------
    An evaluation compares answers ``predicted`` of a model to the rows ``ids``::

        best = bayes_bound(database, ids, target="location")
        wrong = predicted.loc[best.rows.index] != best.rows["tooth"]
        excess = above_bound(wrong, best.losses["error"], best.rows["specimen"])
    """
    if target not in RULES:
        raise InputError(f"target = {target!r} does not exist; choose one of {', '.join(RULES)}")
    rule = RULES[target]
    points, outside = operating_points(database, ids, among=among, sensor=sensor, damaged=rule.damaged_only, like=like)
    points = [replace(point, known_cells=known_cells or not rule.continuous) for point in points]
    applied = (apply_rule(rule, point, point.stored(database, sensor)) for point in points)
    answers = pd.concat(applied).sort_index()
    losses = [name for name in rule.losses if name in answers]
    scores = [str(name) for name in answers if str(name).startswith("score_")]
    classes = [name.removeprefix("score_") for name in scores]
    columns = [int(name) if name.isdigit() else name for name in classes]
    posterior = answers[scores].fillna(-np.inf).set_axis(columns, axis=1)
    prior = [
        rule.log_probabilities(point, point.prior) if isinstance(rule, ClassRule) else point.prior.location
        for point in points
    ]
    entropy = [entropy_of(each)[0] for each in prior]
    return Bound(
        target=target,
        rows=answers.drop(columns=[*losses, *scores]),
        losses=answers[losses],
        scores=posterior if scores else None,
        outside=outside,
        expected=expected_losses(points, target, draws=draws, seed=seed) if draws else None,
        entropy=float(requested_shares(points) @ entropy),
        points=points,
    )
