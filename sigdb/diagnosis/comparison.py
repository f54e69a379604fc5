"""Comparison of an average with the templates of one operating point."""

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from scipy.special import softmax

from sigdb.core import FloatArray
from sigdb.diagnosis.bank import average_rows, behind_path, calibrate_models, draw_averages
from sigdb.diagnosis.healthy_reference import HealthyReference
from sigdb.diagnosis.transfer_path import TransferPath, apply_gain
from sigdb.recognition import QUANTITIES, PointTemplates, TemplateBank

_NEAREST = 5
"""Number of templates in the list of the nearest."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Comparison:
    """Result of the comparison of an average with templates.

    Attributes
    ----------
    x
        (n,) the average in the band of the comparison.
    reference
        Healthy reference; None without a healthy recording.
    candidates
        Teeth of a set that contains the truth with a probability of 0.9; 0 for no damage.
    probability
        (1 + teeth,) probability of no damage and of each tooth, at even prior odds of damage.
    severity
        ``target``, ``estimate``, ``low`` and ``high``, valid if there is damage.
    nearest
        The most probable templates: severities, ``tooth``, ``probability``, ``reduced_chi2``.
    template, healthy
        (n,) the most probable template, and the healthy template.
    reduced_chi2
        Squared residual of the best template relative to its expectation from the noise: about 1 where a template is
        true.
    limit
        Value of ``reduced_chi2`` that 1 % of draws from the templates' law exceed.
    """

    x: FloatArray
    reference: HealthyReference | None
    candidates: tuple[int, ...]
    probability: FloatArray
    severity: pd.DataFrame
    nearest: pd.DataFrame
    template: FloatArray
    healthy: FloatArray
    reduced_chi2: float
    limit: float

    @property
    def outside(self) -> bool:
        """Whether no template fits: ``reduced_chi2`` is above ``limit``."""
        return self.reduced_chi2 > self.limit


def compare(
    bank: TemplateBank,
    x: FloatArray,
    path: TransferPath,
    *,
    noise: FloatArray,
    averages: int,
    reference: HealthyReference | None = None,
) -> Comparison:
    """Compare an average with a bank of one operating point behind a path.

    Both are divided by the noise, order by order, so that the noise is white within the band of the path. The models of
    location and severity are calibrated on draws from the law of the templates behind the path, at the noise of the
    average.

    Parameters
    ----------
    bank
        Templates of one operating point.
    x
        (n,) average.
    path
        Path from the templates to the average.
    noise
        (n / 2 + 1,) standard deviation of its noise at each order, above zero.
    averages
        Revolutions in the average.
    reference
        Healthy reference that average and path come from; None without a healthy recording.
    """
    mean = float(np.sqrt(np.mean(noise[path.covered] ** 2)))
    whitening = np.where(path.covered, mean / noise, 0.0)
    bank = behind_path(bank, replace(path, gain=path.gain * whitening))
    (point,), white = bank.points, apply_gain(x, whitening)
    location, severity = calibrate_models(bank, draw_averages(bank, path, noise=mean, averages=averages))
    row = average_rows(point, white[None], noise=mean, averages=averages)
    verdict = location.assess(row).iloc[0]
    band = 2 * path.covered.sum() / len(x)
    nearest, template = _nearest(point, bank.index_error, white, mean)
    coloured = np.where(path.covered, noise / mean, 0.0)
    return Comparison(
        x=path.band(x),
        reference=reference,
        candidates=verdict["candidates"],
        probability=location.predict_proba(row)[0],
        severity=_severity(severity.predict(row).iloc[0], point.severity[~point.healthy]),
        nearest=nearest.assign(reduced_chi2=nearest["reduced_chi2"] / band),
        template=apply_gain(template, coloured),
        healthy=apply_gain(point.hypotheses.signal[point.healthy][0], coloured),
        reduced_chi2=float(verdict["reduced_chi2"] / band),
        limit=float(location.reduced_chi2_threshold_ / band),
    )


def _severity(predicted: "pd.Series[float]", simulated: FloatArray) -> pd.DataFrame:
    """Return estimates and intervals whose ends lie half way to the next simulated value."""
    rows = []
    for target, values in zip(QUANTITIES, simulated.T, strict=True):
        levels = np.unique(values[np.isfinite(values)])
        middles = (levels[1:] + levels[:-1]) / 2
        below, above = middles[middles < predicted[f"{target}_low"]], middles[middles > predicted[f"{target}_high"]]
        low = float(below[-1]) if below.size else float(levels[0])
        high = float(above[0]) if above.size else float(levels[-1])
        if target == "damaged_teeth":
            low, high = float(np.ceil(low)), float(np.floor(high))
        rows.append({"target": target, "estimate": float(predicted[target]), "low": low, "high": high})
    return pd.DataFrame(rows)


def _nearest(point: PointTemplates, index_error: float, x: FloatArray, noise: float) -> tuple[pd.DataFrame, FloatArray]:
    """Return the most probable templates, each at its best turn, and the signal of the first."""
    laws, n = point.hypotheses, len(x)
    likelihood = laws.log_likelihood(x[None], noise=noise, index_error=index_error)[0]
    turn = np.where(laws.healthy, 0, likelihood.argmax(axis=1))
    chi2 = laws.chi2(likelihood[None], noise=noise, index_error=index_error)[0]
    table = pd.DataFrame(dict(zip(QUANTITIES, np.where(laws.healthy, 0.0, point.severity.T), strict=True))).assign(
        tooth=np.where(laws.healthy, 0, turn + 1),
        probability=softmax(likelihood + point.log_prior).sum(axis=1),
        reduced_chi2=chi2.min(axis=1) / n,
    )
    order = np.argsort(-table["probability"].to_numpy(), kind="stable")[:_NEAREST]
    best = np.roll(laws.signal[order[0]], int(turn[order[0]]) * (n // point.teeth))
    return table.iloc[order].reset_index(drop=True), best
