"""Templates that fit a change: the place and the severity of the damage, weighted by their likelihood."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.special import logsumexp

from sigdb.core import FloatArray
from sigdb.database import QUANTITIES
from sigdb.diagnosis.change.change import PLACES, Change, amplitudes
from sigdb.diagnosis.change.path import GAIN_ERROR
from sigdb.diagnosis.change.statistics import INDEPENDENT, NOISE_ALARMS, Statistic, nothing
from sigdb.diagnosis.change.templates import BehindPath

_TAIL = 0.05
"""Probability beyond each end of an interval."""

_FACTORS = np.exp([-0.5, -0.25, 0.0, 0.25, 0.5])
"""Factors of the gain that all bands share; assumed."""

_FITS = 0.8
"""Least share of the change's energy over noise that the best template explains. Templates of the rig itself explained
as much in 114 of 144 simulated cases, those of a rig of other sizes in 12 of 151."""

_NEAR = 1.5
"""Distance, in tooth passes, from the likeliest place within which templates count for the severity."""


@dataclass(frozen=True, kw_only=True, eq=False)
class TemplateFit:
    """The templates that fit a change.

    Attributes
    ----------
    place, low, high
        First contact of the damaged tooth, in tooth passes after the beginning of the average: the likeliest, and the
        ends of an interval with a probability of 0.95; they may lie beyond 0 and Z.
    severity
        ``target``, ``estimate`` (median), ``low``, ``high`` (90 %). The ends lie half way to the next simulated value;
        a loss has no upper end, 1, where greater ones were left out since the mesh opens.
    """

    place: float
    low: float
    high: float
    severity: pd.DataFrame


@dataclass(frozen=True, kw_only=True, eq=False)
class _Likelihood:
    """Logarithm (factors, T, 8 Z) of the likelihood ratio of each template to none, over the misfit of the best."""

    ratio: FloatArray
    explained: float


def _likelihood(change: Change, behind: BehindPath) -> _Likelihood:
    """Return the likelihood of the templates behind the path.

    With the template P behind the path, the residual r and the deviation s of the change, let
    ``S = sum_k |P_k / s_k|^2`` and ``z = sum_k (P_k / s_k)^* r_k / sqrt(S)`` in each band. If the relative error of the
    path's gain in a band is complex normal with the variance ``v = 0.3^2`` (assumed), the log-likelihood ratio is ::

        sum_h |z_h|^2 - |z_h - sqrt(S_h)|^2 / (1 + v S_h) - ln(1 + v S_h).

    It is divided by the misfit of the best template where that is above 1, since no simulated damage is exact. It is
    evaluated for several factors of the gain that all bands share.
    """
    Z = change.teeth
    shapes = [behind.spectra[:, band.orders] / band.deviation for band in change.bands]
    power = np.array([np.sum(np.abs(shape) ** 2, axis=1) for shape in shapes])[:, :, None]
    parts = [np.conj(shape) * band.residual for shape, band in zip(shapes, change.bands, strict=True)]
    places = np.arange(PLACES * Z) / PLACES
    turned = np.exp(2j * np.pi * places * np.array([band.harmonic for band in change.bands])[:, None])
    z = amplitudes(change, parts) * turned[:, None] / np.sqrt(np.maximum(power, np.finfo(float).tiny))
    energy, along = np.abs(z) ** 2, z.real
    ratio = np.empty((len(_FACTORS), *z.shape[1:]))
    for number, factor in enumerate(_FACTORS):
        S = factor**2 * power
        spread = 1 + GAIN_ERROR**2 * S
        ratio[number] = (energy - (energy - 2 * np.sqrt(S) * along + S) / spread - np.log(spread)).sum(axis=0)
    level, best = sum(band.level for band in change.bands), float(ratio.max())
    misfit = max(1.0, (level - best) / max(change.degrees, 1))
    explained = best / max(level - change.degrees, 1.0)
    return _Likelihood(ratio=ratio / misfit, explained=explained)


def likelihood_statistic(change: Change, behind: BehindPath) -> Statistic:
    """Return the logarithm of the likelihood ratio of damage to none at each place, over that of a rate of 0.001.

    The likelihood ratio is averaged over the templates and factors of the gain, and divided by the number of places
    that are independent, two in a tooth pass. Its mean is 1 where there is nothing but noise, so that it exceeds 1000
    with a probability of at most 0.001 (Markov's inequality), whatever the templates are. It is more sensitive than the
    statistics with free amplitudes where path and rig are right, and less where they are not.

    Parameters
    ----------
    change
        Change of the run.
    behind
        Templates behind the path.
    """
    if not change.bands or not behind.spectra.any():
        return nothing(change)
    ratio = _likelihood(change, behind).ratio
    rows = ratio.reshape(-1, ratio.shape[2])
    evidence = logsumexp(rows, axis=0) - np.log(len(rows) * INDEPENDENT * change.teeth)
    best = rows.argmax(axis=0)
    return Statistic(value=evidence / -np.log(NOISE_ALARMS), best=best % ratio.shape[1], ratio=evidence)


def fit_templates(change: Change, behind: BehindPath) -> TemplateFit | None:
    """Return the place and severity of the damage behind a change; None where no template explains it.

    All templates are equally likely before, so the intervals count the rigs of an ensemble too.

    Parameters
    ----------
    change
        Change of the run since its reference.
    behind
        Templates of a rig that is described, with its ensemble, behind the path.
    """
    results = _likelihood(change, behind)
    if results.explained < _FITS:
        return None
    weight = np.exp(results.ratio - results.ratio.max()).sum(axis=0)
    size = weight.shape[1]
    centre = int(weight.sum(axis=0).argmax())
    off = (np.arange(size) - centre + size // 2) % size - size // 2
    order = np.argsort(off)
    share = np.cumsum(weight.sum(axis=0)[order])
    low, high = (off[order][np.searchsorted(share, q * share[-1])] / PLACES for q in (0.025, 0.975))
    near = weight[:, np.abs(off) <= _NEAR * PLACES].sum(axis=1)
    place = centre / PLACES
    return TemplateFit(place=place, low=place + low, high=place + high, severity=_severity(behind, near / near.sum()))


def _severity(behind: BehindPath, weight: FloatArray) -> pd.DataFrame:
    """Return the intervals of the quantities of severity for weights (T,) of the templates."""
    templates = behind.templates
    rows = {
        name: _interval(templates.severity[name].to_numpy(float), weight, whole=name == "damaged_teeth")
        for name in QUANTITIES
    }
    if weight[templates.last].sum() > _TAIL:
        rows["stiffness_loss"]["high"] = 1.0
    return pd.DataFrame([{"target": name, **row} for name, row in rows.items()])


def _interval(values: FloatArray, weight: FloatArray, *, whole: bool) -> dict[str, float]:
    """Return the weighted median, and the interval whose ends lie half way to the next value."""
    levels = np.unique(values)
    share = np.cumsum([weight[values == level].sum() for level in levels])
    first, middle, last = (int(np.searchsorted(share, q * share[-1])) for q in (_TAIL, 0.5, 1 - _TAIL))
    low = levels[first] if whole or first == 0 else (levels[first - 1] + levels[first]) / 2
    high = levels[last] if whole or last == len(levels) - 1 else (levels[last] + levels[last + 1]) / 2
    return {"estimate": float(levels[middle]), "low": float(low), "high": float(high)}
