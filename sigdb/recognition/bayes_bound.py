"""The Bayes bound: what the best possible rule does on the rows of a database, and on rows drawn anew from their law.

Tier B2: white noise and specimens. The rule knows the law: the templates, their shares among the rows, the operating
point, the level of the noise and the size of the index errors. It knows neither the specimen nor the draw of the noise.
No rule that judges one average at a time, of gears it has not seen, does better on average.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from sigdb.core.errors import InputError
from sigdb.core.typing import FloatArray
from sigdb.database import Database
from sigdb.recognition.bootstrap import Figure, Specimens
from sigdb.recognition.efficiency import ErrorCurve
from sigdb.recognition.metrics import circular_distance
from sigdb.recognition.posterior import Posterior
from sigdb.recognition.rows_by_point import OperatingPoint, operating_points
from sigdb.recognition.severity import TARGETS

LOSSES: Mapping[str, tuple[str, ...]] = {
    "location": ("error", "log_loss"),
    "severity": tuple(f"{kind}_{target}" for kind in ("absolute", "square", "crps") for target in TARGETS),
}
"""Losses of a row that the Bayes rule makes as small as they can be on average; less is a sign of a leak."""

DECIBELS = np.arange(-3.0, 25.0, 1.5)
"""Levels of an error curve, dB above the rows' own noise."""

_EXPECTED = {"error": "risk", "log_loss": "entropy"}
"""What the rule itself expects a loss to be: of the same mean over rows of the law, and less scatter."""


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
        wrong), ``entropy`` (of the tooth, nats). Severity: each target's posterior
        ``median_TARGET`` and ``mean_TARGET``.
    losses
        By id, a column for each of :data:`LOSSES`: ``error`` (0 or 1, healthy rows too), ``log_loss`` (nats);
        ``absolute_TARGET`` (of the posterior median), ``square_TARGET`` (of the mean), ``crps_TARGET``.
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
    outside: dict[str, int]
    expected: dict[str, tuple[float, float]] | None
    entropy: float

    @cached_property
    def figures(self) -> dict[str, Figure]:
        """Figures of merit by the names that models' have, with 95 % intervals over specimens.

        Location: ``accuracy`` (healthy rows too), ``p_exact``, ``p_within_one``, ``p_detected``, ``circular_bias``,
        ``none_on_healthy``, ``log_loss``. Of these only accuracy and log loss are bounds: a rule that calls damage more
        often finds more of it. Severity: ``mae_TARGET``, ``rmse_TARGET``, ``crps_TARGET``.
        """
        specimens = Specimens(self.rows["specimen"].to_numpy())
        if self.target == "location":
            return {name: specimens.mean(value) for name, value in _located(self.rows, self.losses).items()}
        return {
            figure: specimens.root_mean_square(value) if figure.startswith("rmse") else specimens.mean(value)
            for figure, value in _estimated(self.losses).items()
        }


def bound(
    database: Database,
    ids: ArrayLike | None = None,
    *,
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

        best = bound(database, ids, target="location")
        wrong = predicted.loc[best.rows.index] != best.rows["tooth"]
        excess = above_bound(wrong, best.losses["error"], best.rows["specimen"])
    """
    if target not in LOSSES:
        raise InputError(f"target = {target!r} is not known; choose one of {', '.join(LOSSES)}")
    points, outside = operating_points(database, ids, sensor=sensor, damaged=target == "severity")
    judged = pd.concat(judge(point, point.stored(database, sensor), target) for point in points).sort_index()
    names = list(LOSSES[target])
    return Bound(
        target=target,
        rows=judged.drop(columns=names),
        losses=judged[names],
        outside=outside,
        expected=expected_losses(points, target, draws=draws, seed=seed) if draws else None,
        entropy=float(sum(s * point.before.entropy[0] for s, point in zip(_shares(points), points, strict=True))),
    )


def expected_losses(
    points: Iterable[OperatingPoint],
    target: str,
    *,
    draws: int,
    seed: int = 0,
    specimens: bool = True,
    decibels: float = 0.0,
) -> dict[str, tuple[float, float]]:
    """Mean losses of the Bayes rule, with standard errors, over rows drawn anew from the law.

    Parameters
    ----------
    points
        Whose rows are drawn, each as often as it has rows.
    target
        ``location`` or ``severity``.
    draws
        Number of rows.
    seed
        Of the draws. Calls with the same seed draw the same rows, specimens and noise, whatever the noise's level.
    specimens
        Whether gears have index errors (tier B2), or are nominal (B0).
    decibels
        By how much the noise is raised.

    Returns
    -------
    dict
        By loss: mean and standard error.
    """
    points, stream = list(points), np.random.default_rng(seed)
    counts = stream.multinomial(draws, _shares(points))
    judged = pd.concat(
        judge(point, point.redrawn(stream, count, specimens=specimens, decibels=decibels), target)
        for point, count in zip(points, counts.tolist(), strict=True)
        if count
    )
    means = {name: judged[_EXPECTED.get(name, name)] for name in LOSSES[target]}
    return {name: (float(loss.mean()), float(loss.std() / np.sqrt(draws))) for name, loss in means.items()}


def error_curve(
    points: Iterable[OperatingPoint], decibels: ArrayLike = DECIBELS, *, draws: int = 2000, seed: int = 0
) -> ErrorCurve:
    """Error of the Bayes rule of location against the level of the noise, the specimens as they are.

    Parameters
    ----------
    points
        As :func:`operating_points` gives them.
    decibels
        By how much the noise is raised, ascending.
    draws, seed
        Rows drawn at each level; the same ones at all.
    """
    points, levels = list(points), np.asarray(decibels, float)
    found = [expected_losses(points, "location", draws=draws, seed=seed, decibels=level)["error"] for level in levels]
    error, standard_error = np.array(found).T
    chance = sum(share * point.before.risk[0] for share, point in zip(_shares(points), points, strict=True))
    return ErrorCurve(decibels=levels, error=error, standard_error=standard_error, chance=float(chance))


def _shares(points: list[OperatingPoint]) -> FloatArray:
    """(points,) share of each operating point among the rows asked for."""
    judged = np.array([point.judged.sum() for point in points], float)
    return judged / judged.sum()


def judge(point: OperatingPoint, parts: Iterable[tuple[pd.DataFrame, FloatArray]], target: str) -> pd.DataFrame:
    """What the Bayes rule says of averages, and its losses, by id."""
    return pd.concat(_JUDGE[target](point, rows, point.posterior(x, rows)) for rows, x in parts)


def _judge_location(point: OperatingPoint, rows: pd.DataFrame, known: Posterior) -> pd.DataFrame:
    true, found = rows["tooth"].to_numpy(), known.tooth
    return rows[["tooth", "teeth", "specimen"]].assign(
        found=found,
        log_odds=known.log_odds,
        risk=known.risk,
        entropy=known.entropy,
        error=(found != true).astype(float),
        log_loss=-known.location[np.arange(len(rows)), true],
    )


def _judge_severity(point: OperatingPoint, rows: pd.DataFrame, known: Posterior) -> pd.DataFrame:
    judged = rows[["tooth", "teeth", "specimen"]]
    for target in TARGETS:
        level = np.nan_to_num(point.hypotheses.cases[target].to_numpy(float))  # patterns have none, and no share
        true, mean, median = rows[target].to_numpy(float), known.mean(level), known.median(level)
        columns = {
            f"mean_{target}": mean,
            f"median_{target}": median,
            f"absolute_{target}": np.abs(median - true),
            f"square_{target}": (mean - true) ** 2,
            f"crps_{target}": known.crps(level, true),
        }
        judged = judged.assign(**columns)
    return judged


_JUDGE: dict[str, Callable[[OperatingPoint, pd.DataFrame, Posterior], pd.DataFrame]] = {
    "location": _judge_location,
    "severity": _judge_severity,
}


def _located(rows: pd.DataFrame, losses: pd.DataFrame) -> dict[str, FloatArray]:
    """What each row adds to the figures of location; nan where it does not count."""
    true, found, teeth = (rows[name].to_numpy(int) for name in ("tooth", "found", "teeth"))
    damaged, called = true > 0, found > 0
    distance = circular_distance(found, true, teeth)
    return {
        "accuracy": 1 - losses["error"].to_numpy(),
        "p_exact": np.where(damaged, found == true, np.nan),
        "p_within_one": np.where(damaged, called & (np.abs(distance) <= 1), np.nan),
        "p_detected": np.where(damaged, called, np.nan),
        "none_on_healthy": np.where(damaged, np.nan, ~called),
        "circular_bias": np.where(damaged & called, distance, np.nan),
        "log_loss": losses["log_loss"].to_numpy(),
    }


def _estimated(losses: pd.DataFrame) -> dict[str, FloatArray]:
    """What each row adds to the figures of severity; for a root mean square the error itself."""
    errors = {f"rmse_{target}": np.sqrt(losses[f"square_{target}"].to_numpy()) for target in TARGETS}
    means = {
        f"{figure}_{target}": losses[f"{loss}_{target}"].to_numpy()
        for loss, figure in (("absolute", "mae"), ("crps", "crps"))
        for target in TARGETS
    }
    return means | errors
