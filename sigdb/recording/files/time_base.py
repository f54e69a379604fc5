"""Even times: the sampling rate of a column of times, its unit, jitter and rounding."""

from dataclasses import dataclass

import numpy as np

from sigdb.core import FloatArray, InputError, Note
from sigdb.recording.files.time_names import seconds_of

EVEN = 0.01
"""Distance from even times, in steps, up to which times are even."""

MISSING = 1.75
"""Length of a step, in mean steps, from which on a sample is missing."""

MISPLACED = 0.5
"""Distance from even times, in steps, beyond which times are refused: they may belong to another sample."""

ROUNDED = 0.5
"""Resolution of times, in mean steps, from which on leaps and equal times may be a rounding."""

COARSEST = 0.01
"""Largest resolution of times, relative to their span, whose slope is taken for a rate."""

_PARTS, _HALVINGS = 2000, 80
"""Parts of a series of rounded times, and steps of the search for their slope."""

_OFTEN = 0.02
"""Share of unequal steps from which on leaps may be a rounding."""

_LARGEST, _SHORTEST = 1e20, 1e-15
"""Largest time and shortest mean step, in any unit."""

_EPOCH = 9e8, 4.1e9
"""Seconds since 1970 from 1998 to 2099."""

_DATE_NUMBERS = 2e4, 1e6
"""Days since 1900 or the year 0 of the last decades, as spreadsheets and MATLAB write dates."""

_FASTEST_DATE = 1e6
"""Rate in Hz above which seconds may be days."""


@dataclass(frozen=True, kw_only=True)
class TimeBase:
    """Even times nearest to measured times.

    Attributes
    ----------
    sampling_rate
        Their rate, Hz.
    jitter
        Largest deviation from them, in steps.
    start
        The first of them, s.
    resolution
        Resolution of rounded times, s; 0 where the rounding is finer than half a step.
    uncertainty
        Largest relative error of the rate that the rounding allows.
    """

    sampling_rate: float
    jitter: float
    start: float = 0.0
    resolution: float = 0.0
    uncertainty: float = 0.0


def time_base(t: FloatArray, *, name: str, unit: str = "") -> TimeBase:
    """Return the sampling rate of times that rise evenly.

    The step is the slope of the straight line through the times by least squares; the deviation is from that line.
    Times that are rounded to more than half a step may be equal or leap as far as the rounding explains it. Their line
    is the one whose largest deviation is least, since each time lies within half a resolution of the true one.

    Raises
    ------
    InputError
        If the times do not rise, leave samples out, or are out of place by more than half a step.

    Examples
    --------
    >>> import numpy as np
    >>> round(time_base(np.arange(100) / 12_800, name="t").sampling_rate, 6)
    12800.0
    >>> rounded = time_base(np.round(np.arange(1000) / 2000, 3), name="t")
    >>> round(rounded.sampling_rate), rounded.resolution
    (2000, 0.001)
    """
    factor = seconds_of(unit)
    if factor is None:
        raise InputError(f"column {name} has the unit {unit!r}, not one of time; give time=false, or its unit by units")
    if t.size < 3 or not np.isfinite(t).all():
        raise InputError(f"column {name} must hold three times or more, none of them missing; or give time=false")
    if np.abs(t).max() > _LARGEST:
        raise InputError(f"column {name} holds {np.abs(t).max():.3g}, which is no time; mend it, or give time=false")
    steps = np.diff(t)
    mean = float(steps.mean())
    if mean <= 0 or steps.min() < 0:
        at = int(np.argmin(steps)) + 1
        raise InputError(f"column {name} must rise, and does not after sample {at}; mend it, or give time=false")
    if mean < _SHORTEST:
        raise InputError(f"column {name} rises by {mean:.3g} a sample, as no times do; mend it, or give time=false")
    step, residual = _line(t)
    resolution = _resolution(steps, mean)
    if resolution:
        step, residual = _narrowest_band(residual, step)
        _refuse_leaps_of_rounded_times(steps, residual, step, resolution, name=name, unit=unit)
    else:
        _refuse_leaps(steps, mean, name=name)
    jitter = float(np.abs(residual).max() / step)
    if jitter > MISPLACED and not resolution:
        raise InputError(
            f"column {name} is up to {jitter:.3g} steps away from even times; resample it, or give sampling_rate and "
            "time=false if the times are wrong"
        )
    return TimeBase(
        sampling_rate=1 / (step * factor),
        jitter=jitter,
        start=float(t[0] if jitter <= EVEN else t[0] - residual[0]) * factor,
        resolution=resolution * factor,
        uncertainty=1.5 * resolution / float(t[-1] - t[0]),
    )


def _line(t: FloatArray) -> tuple[float, FloatArray]:
    """Return the step of the straight line through the times, and the distances from it."""
    i = np.arange(t.size) - (t.size - 1) / 2
    centred = t - t.mean()
    step = float(i @ centred / (i @ i))
    return step, np.asarray(centred - step * i)


def _narrowest_band(residual: FloatArray, step: float) -> tuple[float, FloatArray]:
    """Return the step and the distances of the line whose largest distance is least.

    Only the extremes of each of at most 2000 parts of the series are compared, whose slopes differ little.
    """
    edges = np.linspace(0, residual.size, min(residual.size, _PARTS) + 1).astype(int)[:-1]
    lengths = np.diff([*edges, residual.size])
    high, low = np.maximum.reduceat(residual, edges), np.minimum.reduceat(residual, edges)
    i = edges + (lengths - 1) / 2 - (residual.size - 1) / 2
    reach = 2 * float(np.ptp(residual)) / residual.size
    least, most = -reach, reach
    for _ in range(_HALVINGS):
        third = (most - least) / 3
        left, right = (float((high - a * i).max() - (low - a * i).min()) for a in (least + third, most - third))
        least, most = (least, most - third) if left <= right else (least + third, most)
    change = (least + most) / 2
    rest = residual - change * (np.arange(residual.size) - (residual.size - 1) / 2)
    return step + change, np.asarray(rest - (rest.max() + rest.min()) / 2)


def _resolution(steps: FloatArray, mean: float) -> float:
    """Return the resolution of rounded times; 0 if they are not rounded, or to less than half a step."""
    positive = steps[steps > 0]
    least = float(positive.min())
    if least < _SHORTEST * mean:
        return 0.0
    multiples = np.round(positive / least)
    resolution = float(positive.sum() / multiples.sum())
    if resolution < ROUNDED * mean or np.abs(positive / resolution - multiples).max() > 0.1:
        return 0.0
    if positive.size < steps.size:
        return resolution
    often = np.count_nonzero(multiples != np.median(multiples)) >= max(3, _OFTEN * steps.size)
    return resolution if often and _is_decimal(resolution) else 0.0


def _is_decimal(resolution: float) -> bool:
    """Return whether a number is 1, 2 or 5 times a power of ten."""
    mantissa = resolution / 10.0 ** np.floor(np.log10(resolution * 1.01))
    return bool(np.abs(np.array([1.0, 2.0, 5.0]) / mantissa - 1).min() < 0.01)


def _refuse_leaps(steps: FloatArray, mean: float, *, name: str) -> None:
    if steps.max() > MISSING * mean:
        at = int(np.argmax(steps)) + 1
        usual = float(np.median(steps)) or mean
        raise InputError(
            f"column {name} leaps by {steps.max() / usual:.3g} steps after sample {at}: samples are missing "
            "there; cut the recording in two"
        )


def _refuse_leaps_of_rounded_times(
    steps: FloatArray, residual: FloatArray, step: float, resolution: float, *, name: str, unit: str
) -> None:
    if np.ptp(residual) <= resolution + MISPLACED * step:
        return
    explained = np.ceil(step / resolution - 1e-6) * resolution
    at = int(np.argmax(steps) if steps.max() > explained + 0.5 * resolution else np.argmax(np.abs(residual))) + 1
    raise InputError(
        f"column {name} is rounded to {resolution:.3g} {unit or 's'} and is up to {np.abs(residual).max() / step:.3g} "
        f"steps away from even times, near sample {at}: samples are missing there; cut the recording in two, or give "
        "sampling_rate and time=false if the times are wrong"
    )


def unit_of_times(t: FloatArray, *, name: str, unit: str) -> tuple[str, list[Note]]:
    """Return the unit of times: the stated one, that of an epoch by its magnitude, or seconds.

    Raises
    ------
    InputError
        If the times are none that a recording can have.
    """
    largest = float(np.abs(t[[0, -1]]).max())
    if unit:
        if largest * (seconds_of(unit) or 0.0) > _EPOCH[1]:
            raise InputError(f"column {name} holds {largest:.3g} {unit}, which is no time; give its unit by units")
        return unit, []
    for epoch_unit, factor in (("s", 1.0), ("ms", 1e3), ("us", 1e6), ("ns", 1e9)):
        if _EPOCH[0] * factor <= largest <= _EPOCH[1] * factor:
            text = f"column {name} was read as {epoch_unit} since 1970, by its magnitude"
            return epoch_unit, [Note(code="epoch", text=text, values={"column": name, "unit": epoch_unit})]
    if largest > _EPOCH[1]:
        raise InputError(
            f"column {name} holds {largest:.3g} without a unit, which is no time in s and no time since 1970; give its "
            f"unit by units, or sampling_rate and time=false"
        )
    if t.size > 1 and _DATE_NUMBERS[0] < largest < _DATE_NUMBERS[1]:
        mean = float(t[-1] - t[0]) / (t.size - 1)
        if 0 < mean < 1 / _FASTEST_DATE:
            raise InputError(
                f"column {name} begins at {t[0]:.9g} and rises by {mean:.3g} a sample, as dates in days do; give its "
                "unit by units, or sampling_rate and time=false"
            )
    return "", []


def refuse_coarse(base: TimeBase, *, name: str) -> None:
    """Refuse times whose rounding leaves the rate open."""
    if base.uncertainty > 1.5 * COARSEST:
        raise InputError(
            f"column {name} is rounded to {base.resolution:.3g} s, which leaves the rate open: "
            f"{base.sampling_rate:.6g} Hz within {100 * base.uncertainty:.2g} %; give sampling_rate"
        )
