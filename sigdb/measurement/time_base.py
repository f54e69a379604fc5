"""What a column of times says: the sampling rate, and whether samples are missing or out of place."""

from dataclasses import dataclass

import numpy as np

from sigdb.core.errors import InputError
from sigdb.core.typing import FloatArray

SECONDS = {
    "": 1.0, "s": 1.0, "sec": 1.0, "second": 1.0, "seconds": 1.0, "ms": 1e-3, "msec": 1e-3, "us": 1e-6, "µs": 1e-6,
    "μs": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0,
}  # fmt: skip

EVEN = 0.01
"""Times within this part of a step of even ones are even."""

CLEARLY_EVEN = 0.1
"""A series without a name within this part of a step of an even one is taken for times."""

MISSING = 1.75
"""A step longer than so many mean ones leaves a sample out."""

MISPLACED = 0.5
"""Times further than this part of a step from even ones are refused: they may belong to another sample."""


@dataclass(frozen=True, kw_only=True)
class TimeBase:
    """The rate (Hz) of the even times nearest to those given, and the largest deviation from them, in steps."""

    sampling_rate: float
    jitter: float


def time_base(t: FloatArray, *, name: str, unit: str = "") -> TimeBase:
    """The sampling rate of times that rise evenly.

    The step is the slope of the straight line through the times by least squares; the deviation is from that line.

    Raises
    ------
    InputError
        If the times do not rise, leave samples out, or are out of place by more than half a step.

    Examples
    --------
    >>> import numpy as np
    >>> round(time_base(np.arange(100) / 12_800, name="t").sampling_rate, 6)
    12800.0
    """
    if unit.lower() not in SECONDS:
        raise InputError(f"column {name} has the unit {unit!r}, not one of time; give time=false or sampling_rate")
    if t.size < 3 or not np.isfinite(t).all():
        raise InputError(f"column {name} must hold three times or more, none of them missing; or give sampling_rate")
    steps = np.diff(t)
    mean = float(steps.mean())
    if mean <= 0 or steps.min() < 0:
        at = int(np.argmin(steps)) + 1
        raise InputError(f"column {name} must rise, and does not after sample {at}; mend it, or give time=false")
    if steps.max() > MISSING * mean:
        at = int(np.argmax(steps)) + 1
        raise InputError(
            f"column {name} leaps by {steps.max() / np.median(steps):.3g} steps after sample {at}: samples are missing "
            "there; cut the recording in two"
        )
    step, jitter = _even_times(t)
    if jitter > MISPLACED:
        raise InputError(
            f"column {name} is up to {jitter:.3g} steps away from even times; resample it, or give sampling_rate and "
            "time=false if the times are wrong"
        )
    return TimeBase(sampling_rate=1 / (step * SECONDS[unit.lower()]), jitter=jitter)


def rises_evenly(t: FloatArray) -> bool:
    """Whether a series can only be times or counts of samples: it rises, a tenth of a step from even at most."""
    if t.size < 16 or not np.isfinite(t).all() or np.diff(t).min() <= 0:
        return False
    return _even_times(t)[1] <= CLEARLY_EVEN


def _even_times(t: FloatArray) -> tuple[float, float]:
    """Step of the straight line through the times, and the largest distance from it in steps."""
    i = np.arange(t.size) - (t.size - 1) / 2
    step = float(i @ (t - t.mean()) / (i @ i))
    return step, float(np.abs(t - t.mean() - step * i).max() / step)
