"""The Bayes bound: what the best possible rule does on the rows of a database, and on rows drawn anew from their law.

Tier B2: white noise and specimens. The rule knows the law: the templates, their shares among the rows, the operating
point, the level of the noise and the size of the index errors. It knows neither the specimen nor the draw of the noise.
No rule that judges one average at a time, of gears it has not seen, does better on average.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from sigdb.core import FloatArray, InputError
from sigdb.database import Database
from sigdb.recognition.bound.bayes_rule import LOSSES, judge
from sigdb.recognition.bound.expected_losses import expected_losses, judged_shares
from sigdb.recognition.bound.operating_points import operating_points
from sigdb.recognition.metrics.detection import called_figures, detection_figures
from sigdb.recognition.metrics.estimate import Estimate, Specimens
from sigdb.recognition.metrics.location_and_severity import location_values
from sigdb.recognition.metrics.probability_of_detection import pod_figures
from sigdb.recognition.severity_quantities import QUANTITIES


@dataclass(frozen=True, kw_only=True, eq=False)
class Bound:
    """What the Bayes rule does on rows of a database.

    Attributes
    ----------
    target
        ``location`` or ``severity``.
    rows
        By id: ``tooth``, ``teeth``, ``specimen``, and what the rule says of each row. Location: ``found`` (the most
        probable tooth, 0 for none), ``log_odds`` (logarithm of P(damage) / P(none)), ``risk`` (probability that it is
        wrong), ``entropy`` (of the tooth, nats). Severity: each target's posterior ``median_TARGET``
        and ``mean_TARGET``, and ``low_TARGET`` and ``high_TARGET``, between which it has 0.9.
    losses
        By id, what the rule makes as small as it can be on average: ``error`` (0 or 1, healthy rows too), ``log_loss``
        (nats); ``absolute_TARGET`` (of the posterior median), ``square_TARGET`` (of the mean), ``crps_TARGET``.
    scores
        By id, columns 0, 1, 2, ...: logarithm of the posterior probability of 'none' and of each tooth, -inf where a
        gear has no such tooth. None for severity.
    outside
        Number of rows that the law does not cover, by reason. They are not in ``rows``.
    expected
        The same losses on rows drawn anew from the law, specimens and noise: mean and standard error. None if they were
        not asked for.
    entropy
        Mean entropy of the location before an average is seen, nats: H of :func:`eta_info`.
    """

    target: str
    rows: pd.DataFrame
    losses: pd.DataFrame
    scores: pd.DataFrame | None
    outside: dict[str, int]
    expected: dict[str, tuple[float, float]] | None
    entropy: float

    @cached_property
    def values(self) -> pd.DataFrame:
        """By id, what each row adds to the figures: they are means of the values that are not nan.

        Location: ``accuracy`` (healthy rows too), ``p_exact``, ``p_within_one``, ``p_detected``, ``circular_bias``,
        ``none_on_healthy``, ``log_loss``. Of these only accuracy and log loss are bounds: a rule that calls damage more
        often finds more of it. Severity: ``mae_TARGET`` and ``crps_TARGET``, and ``rmse_TARGET``, errors whose root
        mean square is the figure.
        """
        if self.target == "location":
            values = location_values(self.rows["found"].to_numpy(int), self.rows)
            values |= {"log_loss": self.losses["log_loss"].to_numpy()}
        else:
            values = _estimated(self.losses)
        return pd.DataFrame(values, index=self.rows.index)

    @cached_property
    def figures(self) -> dict[str, Estimate]:
        """The figures by name, with 95 % intervals of a bootstrap over specimens."""
        specimens = Specimens(self.rows["specimen"].to_numpy())
        columns = {str(name): value.to_numpy() for name, value in self.values.items()}
        return {
            name: specimens.root_mean_square(value) if name.startswith("rmse") else specimens.mean(value)
            for name, value in columns.items()
        }


def bayes_bound(
    database: Database,
    ids: ArrayLike | None = None,
    *,
    among: ArrayLike | None = None,
    target: str = "location",
    sensor: str | None = None,
    draws: int = 0,
    seed: int = 0,
) -> Bound:
    """The Bayes bound for rows of a database.

    Parameters
    ----------
    database
        A database with rows, of a rig with one mesh.
    ids
        Rows that models are judged on; all if left out. Rows without a result and rows with loss of contact are
        outside; for severity also healthy ones and those with a pattern.
    among
        Rows whose shares are the prior; all if left out. Rows that are chosen by their case, as a split does, take
        themselves: no rule is better on them then.
    target
        ``location`` or ``severity`` (that given damage).
    sensor
        A stored sensor; the first one if left out.
    draws
        Number of rows to draw anew for ``expected``; none for 0.
    seed
        Of those.

    Returns
    -------
    Bound

    Raises
    ------
    InputError
        If the target is not known, no row is inside the law, or the rig does not turn exactly.

    Examples
    --------
    What evaluation does, with a model's answers ``predicted`` for the rows ``ids``::

        best = bayes_bound(database, ids, target="location")
        wrong = predicted.loc[best.rows.index] != best.rows["tooth"]
        excess = above_bound(wrong, best.losses["error"], best.rows["specimen"])
    """
    if target not in LOSSES:
        raise InputError(f"target = {target!r} is not known; choose one of {', '.join(LOSSES)}")
    points, outside = operating_points(database, ids, among=among, sensor=sensor, damaged=target == "severity")
    judged = pd.concat(judge(point, point.stored(database, sensor), target) for point in points).sort_index()
    losses, scores = list(LOSSES[target]), [str(name) for name in judged if str(name).startswith("score_")]
    posterior = judged[scores].fillna(-np.inf).set_axis(np.arange(len(scores)), axis=1)
    before = [point.before.entropy[0] for point in points]
    return Bound(
        target=target,
        rows=judged.drop(columns=[*losses, *scores]),
        losses=judged[losses],
        scores=posterior if scores else None,
        outside=outside,
        expected=expected_losses(points, target, draws=draws, seed=seed) if draws else None,
        entropy=float(judged_shares(points) @ before),
    )


def _estimated(losses: pd.DataFrame) -> dict[str, FloatArray]:
    """What each row adds to the figures of severity; for a root mean square the error itself."""
    errors = {f"rmse_{target}": np.sqrt(losses[f"square_{target}"].to_numpy()) for target in QUANTITIES}
    means = {
        f"{figure}_{target}": losses[f"{loss}_{target}"].to_numpy()
        for loss, figure in (("absolute", "mae"), ("crps", "crps"))
        for target in QUANTITIES
    }
    return means | errors


def detection_bound(log_odds: pd.Series, rows: pd.DataFrame, false_alarm_rate: float) -> dict[str, Estimate]:
    """Figures of the detector by the Bayes rule's log odds of damage, as those of a model.

    Its threshold is the least that at most a share ``false_alarm_rate`` of the healthy rows exceeds, those rows
    themselves: the rule knows the law, and needs no others to set it. ``p_detected`` is no bound for a detector whose
    own rate differs.

    Parameters
    ----------
    log_odds
        By id, from ``rows`` of :class:`Bound`.
    rows
        The same rows with ``tooth``, severities and ``specimen``.
    false_alarm_rate
        Between 0 and 1.
    """
    score = log_odds.to_numpy(float)
    healthy = np.sort(score[rows["tooth"].to_numpy() == 0])[::-1]
    threshold = healthy[int(false_alarm_rate * len(healthy) * (1 + 1e-12))] if len(healthy) else np.inf
    figures = called_figures((score > threshold).astype(int), rows)
    return figures | detection_figures(score, rows) | pod_figures(score, rows)
