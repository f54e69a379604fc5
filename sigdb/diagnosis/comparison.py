"""An average against the templates of one operating point: how well each fits, and which answer is given."""

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from scipy.special import softmax

from sigdb.core import FloatArray
from sigdb.diagnosis.bank import averages_frame, calibrate, draws, through
from sigdb.diagnosis.healthy_reference import Reference
from sigdb.diagnosis.transfer_path import TransferPath, filtered
from sigdb.recognition import QUANTITIES, PointTemplates, TemplateBank

_NEAREST = 5


@dataclass(frozen=True, kw_only=True, eq=False)
class Compared:
    """What templates say of an average.

    Attributes
    ----------
    x
        (n,) the average, in the band that was compared.
    reference
        How a healthy recording was used; None without.
    candidates
        Answers of a set that holds the truth with a probability of 0.9, 0 for none.
    probability
        (1 + teeth,) of 'none' and of each tooth, at even odds before the recording.
    severity
        By target ``estimate``, ``low`` and ``high``, if there is damage.
    nearest
        The most probable templates: severities, ``tooth``, ``probability``, ``misfit``.
    template, healthy
        (n,) the first of them, and the one of a healthy gear.
    misfit, limit
        Squared residual of the best template over what the noise gives, about 1 for what the templates cover; what 1 %
        of draws from their law exceed.
    """

    x: FloatArray
    reference: Reference | None
    candidates: tuple[int, ...]
    probability: FloatArray
    severity: pd.DataFrame
    nearest: pd.DataFrame
    template: FloatArray
    healthy: FloatArray
    misfit: float
    limit: float

    @property
    def outside(self) -> bool:
        """Whether no template fits."""
        return self.misfit > self.limit


def compare(
    bank: TemplateBank,
    x: FloatArray,
    path: TransferPath,
    *,
    noise: FloatArray,
    averages: int,
    reference: Reference | None = None,
) -> Compared:
    """Compare an average with a bank of one operating point behind a path.

    Both are divided by the noise, order by order, so that it is white within the band of the path. Models of location
    and severity are calibrated on draws from the law of the templates behind the path, at the average's own noise.

    Parameters
    ----------
    bank
        Templates of one operating point.
    x
        (n,) average.
    path
        From the templates to it.
    noise
        (n / 2 + 1,) standard deviation of its noise at each order, above zero.
    averages
        Revolutions in it.
    reference
        Where average and path are from, if from a healthy recording.
    """
    mean = float(np.sqrt(np.mean(noise[path.known] ** 2)))
    whitening = np.where(path.known, mean / noise, 0.0)
    bank = through(bank, replace(path, gain=path.gain * whitening))
    (point,), white = bank.points, filtered(x, whitening)
    location, severity = calibrate(bank, draws(bank, path, noise=mean, averages=averages))
    row = averages_frame(point, white[None], noise=mean, averages=averages)
    said = location.judge(row).iloc[0]
    share = 2 * path.known.sum() / len(x)
    nearest, template = _nearest(point, bank.index_error, white, mean)
    coloured = np.where(path.known, noise / mean, 0.0)
    return Compared(
        x=path.band(x),
        reference=reference,
        candidates=said["candidates"],
        probability=location.predict_proba(row)[0],
        severity=_severity(severity.predict(row).iloc[0], point.severity[~point.healthy]),
        nearest=nearest.assign(misfit=nearest["misfit"] / share),
        template=filtered(template, coloured),
        healthy=filtered(point.hypotheses.signal[point.healthy][0], coloured),
        misfit=float(said["misfit"] / share),
        limit=float(location.misfit_threshold_ / share),
    )


def _severity(said: pd.Series, simulated: FloatArray) -> pd.DataFrame:
    """Estimates and intervals; their ends half way to the next value that was simulated, for none between was."""
    rows = []
    for one, values in zip(QUANTITIES, simulated.T, strict=True):
        levels = np.unique(values[np.isfinite(values)])
        middles = (levels[1:] + levels[:-1]) / 2
        below, above = middles[middles < said[f"{one}_low"]], middles[middles > said[f"{one}_high"]]
        low = float(below[-1]) if below.size else float(levels[0])
        high = float(above[0]) if above.size else float(levels[-1])
        if one == "damaged_teeth":
            low, high = float(np.ceil(low)), float(np.floor(high))
        rows.append({"target": one, "estimate": float(said[one]), "low": low, "high": high})
    return pd.DataFrame(rows)


def _nearest(point: PointTemplates, index_error: float, x: FloatArray, noise: float) -> tuple[pd.DataFrame, FloatArray]:
    """The most probable templates, each at its best turn, and the signal of the first of them."""
    laws, n = point.hypotheses, len(x)
    likelihood = laws.log_likelihood(x[None], noise=noise, index_error=index_error)[0]
    turn = np.where(laws.healthy, 0, likelihood.argmax(axis=1))
    d = (laws.gains * index_error / noise) ** 2
    constant = n * np.log(2 * np.pi * noise**2) + np.log1p(d).sum(axis=1)
    table = pd.DataFrame(dict(zip(QUANTITIES, np.where(laws.healthy, 0.0, point.severity.T), strict=True))).assign(
        tooth=np.where(laws.healthy, 0, turn + 1),
        probability=softmax(likelihood + point.log_prior).sum(axis=1),
        misfit=(-2 * likelihood.max(axis=1) - constant) / n,
    )
    order = np.argsort(-table["probability"].to_numpy(), kind="stable")[:_NEAREST]
    best = np.roll(laws.signal[order[0]], int(turn[order[0]]) * (n // point.teeth))
    return table.iloc[order].reset_index(drop=True), best
