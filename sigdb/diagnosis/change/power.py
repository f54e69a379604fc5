"""Power of a decision: the damage that a recording would have shown, by adding damage to the recording itself."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pandas as pd

from sigdb.core import ComplexArray, FloatArray, IntArray
from sigdb.diagnosis.change.average_spectrum import AverageSpectrum
from sigdb.diagnosis.change.path import GAIN_ERROR, wandering
from sigdb.diagnosis.change.templates import BehindPath

SEEN = 0.95
"""Probability with which the stated damage would have been seen."""

LOSSES = (0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8)
"""Stiffness losses of one tooth that are added."""

PULSES = (0.01, 0.02, 0.03, 0.05, 0.07, 0.1, 0.15, 0.2, 0.3, 0.5, 0.7, 1.0)
"""Rms values of the pulses that are added, relative to that of the average, where no rig is known."""

_SHAPE_ERROR = 0.7
"""Deviation of the relative error of a pulse's spectrum, twice a mesh harmonic: damage is no ideal pulse. Assumed."""

_MOST_TRIES = 160
"""Most pairs of a tooth and a rig; with more teeth, each is tried with fewer of the rigs, in turn."""

_WORSE = 0.75
"""Share of the rigs that would have been seen at the stated damage below which a tooth is named."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Power:
    """Damage that a recording would have shown.

    Attributes
    ----------
    quantity
        ``stiffness_loss`` of one tooth, or ``pulse``: the rms of an event relative to that of the average.
    smallest
        Smallest value from which on at least 95 % would have been seen, of all teeth and of one more rig; None where no
        value of the range would.
    share_of_rms
        Median rms of the added difference at that value, relative to that of the average; None with it.
    exceptions
        ``tooth`` and ``smallest`` of the teeth at which fewer than three quarters of the rigs would have been seen at
        that value, and the value at which all would; nan where some would at none.
    greatest
        Greatest value that was added.
    table
        ``value``, ``seen``: share of all teeth and rigs at which it was seen.
    """

    quantity: str
    smallest: float | None
    share_of_rms: float | None
    exceptions: pd.DataFrame
    greatest: float
    table: pd.DataFrame


def power(
    run: AverageSpectrum,
    decide: Callable[[AverageSpectrum], bool],
    *,
    templates: BehindPath | None,
    seed: int = 0,
) -> Power:
    """Return the damage that a recording would have shown, by adding damage to it and asking the decision itself.

    Damage of one tooth is added at every tooth of every rig behind the path that its mesh harmonics give. The gain of
    the path errs at random between them: by 30 %, twice a mesh harmonic, and that of pulses by 70 %. The value that is
    seen is found by bisection, so a greater damage counts as seen where a smaller one is.

    The machine is one more rig; only its ensemble is known. Let m and s be the mean and the standard deviation
    of the logarithm of the value that is needed, over all teeth of n rigs. The bound for a tooth of one more rig, with
    a probability of 0.95, is ``exp(m + t s sqrt(1 + 1 / n))`` with the quantile t of Student's law with n - 1 degrees
    of freedom. The next value above it is stated. Pulses are no rigs: for them it is ``exp(m + 1.645 s)``. That law may
    have a longer tail than the rigs do. So the greatest value of all tries is stated where it is less, and no more than
    a twentieth of them is beyond the greatest of all other rigs, as a mean over the rigs that are left out in turn.

    Parameters
    ----------
    run
        Spectrum of the recording.
    decide
        Whether a tooth stands out of a spectrum: the decision.
    templates
        Templates of the rigs behind the path that the recording's own mesh harmonics give; None for pulses with the
        spectrum of the mesh.
    seed
        Seed of the path's errors.
    """
    stream = np.random.default_rng(seed)
    rms = float(np.sqrt(np.sum(np.abs(run.mean[1:]) ** 2)))
    values, additions = _damage(templates) if templates is not None else _pulses(run)
    Z, k = run.teeth, np.arange(len(run.mean))
    error = GAIN_ERROR if templates is not None else _SHAPE_ERROR
    rigs = min(len(additions), max(_MOST_TRIES // Z, 1))
    needed, rig = np.full((Z, rigs), np.inf), np.zeros((Z, rigs), int)
    share = np.full((len(values), Z, rigs), np.nan)
    for tooth in range(Z):
        for number in range(rigs):
            rig[tooth, number] = (tooth * rigs + number) % len(additions)
            addition = additions[rig[tooth, number]]
            at_tooth = addition * wandering(stream, run, error) * np.exp(-2j * np.pi * k * tooth / Z)
            share[:, tooth, number] = np.sqrt(np.sum(np.abs(at_tooth) ** 2, axis=1)) / rms
            index = _first(decide, run, at_tooth)
            if index < len(values):
                needed[tooth, number] = values[index]
    return _power("stiffness_loss" if templates is not None else "pulse", values, needed, rig, share)


def _power(quantity: str, values: FloatArray, needed: FloatArray, rig: IntArray, share: FloatArray) -> Power:
    """Return the power from the values (Z, rigs) that were needed at each tooth with each rig."""
    at_tooth = needed.max(axis=1)
    stated = for_one_more(needed.ravel(), values, rig.ravel() if quantity == "stiffness_loss" else None)
    smallest = float(stated) if np.isfinite(stated) else None
    worse = np.flatnonzero(np.mean(needed <= stated, axis=1) < _WORSE)
    exceptions = pd.DataFrame(
        {"tooth": worse + 1, "smallest": np.where(np.isfinite(at_tooth), at_tooth, np.nan)[worse]}
    )
    row = None if smallest is None else int(np.flatnonzero(values == smallest)[0])
    return Power(
        quantity=quantity,
        smallest=smallest,
        share_of_rms=None if row is None else float(np.nanmedian(share[row])),
        exceptions=exceptions if smallest is not None else exceptions.iloc[:0],
        greatest=float(values[-1]),
        table=pd.DataFrame({"value": values, "seen": [float(np.mean(needed <= value)) for value in values]}),
    )


def for_one_more(needed: FloatArray, values: FloatArray, rig: IntArray | None) -> float:
    """Return the value that a tooth of one more rig needs at most with a probability of 0.95; inf beyond the range.

    Parameters
    ----------
    needed
        (N,) value that each try needed; inf beyond the range.
    values
        Values that were tried, ascending.
    rig
        (N,) rig of each try; None where all tries are of one kind.
    """
    from scipy.special import ndtri, stdtrit

    groups = [needed] if rig is None else [needed[rig == number] for number in np.unique(rig)]
    rigs, greatest = len(groups), float(needed.max())
    others = [max((each.max() for each in groups if each is not group), default=greatest) for group in groups]
    beyond = float(np.mean([np.mean(group > other) for group, other in zip(groups, others, strict=True)]))
    logarithm = np.log(np.where(np.isinf(needed), 1.25 * values[-1], needed))
    quantile = stdtrit(rigs - 1, SEEN) * np.sqrt(1 + 1 / rigs) if rigs > 1 else ndtri(SEEN)
    bound = float(np.exp(logarithm.mean() + quantile * logarithm.std()))
    if beyond <= 1 - SEEN:
        bound = min(bound, greatest)
    above = values[values >= bound * (1 - 1e-9)]
    return float(above[0]) if above.size else np.inf


def _first(decide: Callable[[AverageSpectrum], bool], run: AverageSpectrum, additions: ComplexArray) -> int:
    """Return the first of growing additions from which on a tooth stands out, by bisection; their number if none."""
    low, high = 0, len(additions)
    while low < high:
        middle = (low + high) // 2
        if decide(run.plus(additions[middle])):
            high = middle
        else:
            low = middle + 1
    return low


def _damage(behind: BehindPath) -> tuple[FloatArray, list[ComplexArray]]:
    """Return the losses, and for each rig the differences behind the path."""
    values, templates = np.array(LOSSES), behind.templates
    single = (templates.severity["damaged_teeth"] == 1) & (templates.severity["phase_shift_deg"] == 0)
    results = []
    for member in np.unique(templates.member):
        rows = np.flatnonzero(single.to_numpy() & (templates.member == member))
        if not rows.size:
            continue
        losses = templates.severity["stiffness_loss"].to_numpy(float)[rows]
        order = np.argsort(losses)
        simulated = np.concatenate([np.zeros((1, behind.spectra.shape[1])), behind.spectra[rows[order]]])
        results.append(_at(values, np.concatenate([[0.0], losses[order]]), simulated))
    return values, results


def _at(values: FloatArray, losses: FloatArray, simulated: ComplexArray) -> ComplexArray:
    """Return differences at losses between those that were simulated, by straight lines.

    Beyond the last, where the mesh opens, the difference grows in proportion to the loss.
    """
    right = np.clip(np.searchsorted(losses, values), 1, len(losses) - 1)
    part = np.clip((values - losses[right - 1]) / (losses[right] - losses[right - 1]), 0, 1)[:, None]
    beyond = np.maximum(values / losses[-1], 1.0)[:, None]
    return np.asarray(beyond * ((1 - part) * simulated[right - 1] + part * simulated[right]))


def _pulses(run: AverageSpectrum) -> tuple[FloatArray, list[ComplexArray]]:
    """Return pulses of four widths whose spectrum about each mesh harmonic has the share of that harmonic."""
    values, Z = np.array(PULSES), run.teeth
    X = run.mean
    k = np.arange(len(X))
    nearest = np.clip(np.round(k / Z).astype(int), 1, (len(X) - 1) // Z) * Z
    held = (k > 0) & (k < run.highest_order)
    rms = float(np.sqrt(np.sum(np.abs(run.mean[1:]) ** 2)))
    results = []
    for width in (0.4, 0.8, 1.6, 3.2):
        shape = np.where(held, X[nearest] * np.exp(-0.5 * ((k - nearest) * np.pi / Z * width) ** 2), 0)
        shape = shape / np.sqrt(np.sum(np.abs(shape) ** 2)) * rms
        results.append(values[:, None] * shape)
    return values, results
