"""Ramps: series that only rise or fall, such as times, counts and angles, which are no vibration."""

from collections.abc import Collection
from typing import Literal

import numpy as np

from sigdb.core import FloatArray, InputError, Note
from sigdb.recording.files.formats.contents import DataColumn
from sigdb.recording.files.time_names import other_abscissa

Ramp = Literal["", "counts", "rises", "falls", "repeats"]
"""Kind of a ramp; empty for another series. ``counts`` rises by 1, ``repeats`` begins again and again."""

FEWEST = 8
"""Number of values, and of different values, from which on a series can be a ramp."""

NEAR_LINE = 3.0
"""Distance from a straight line, in steps of the line, up to which a series is a ramp."""

LONG_TEETH = 16
"""Fewest samples of a ramp that begins again."""

_FIRST = 4096
"""Number of samples that decide for most series that they are no ramp."""

_ROUNDING = 1e-6


def ramp_kind(x: FloatArray) -> Ramp:
    """Return the kind of ramp that a series is.

    A series is a ramp if it never falls or never rises, if it lies within three steps of a straight line, or if its
    steps are equal but for jumps back. A vibration does none of these.

    Parameters
    ----------
    x
        (n,) numbers; missing ones are left out.

    Examples
    --------
    >>> import numpy as np
    >>> ramp_kind(np.arange(50.0)), ramp_kind(np.arange(50) / 8000), ramp_kind(np.sin(np.arange(50.0)))
    ('counts', 'rises', '')
    """
    with np.errstate(over="ignore", invalid="ignore"):  # steps of numbers near the largest
        first = _kind(x[:_FIRST])
        varies = np.unique(_finite(x[:_FIRST])).size > 1
        return first if x.size <= _FIRST or (varies and not first) else _kind(x)


def _kind(x: FloatArray) -> Ramp:
    x = _finite(x)
    if x.size < FEWEST:
        return ""
    steps = np.diff(x)
    if not steps.any():
        return ""
    if np.all(steps == 1) and x[0] == np.round(x[0]):
        return "counts"
    if np.count_nonzero(steps) >= FEWEST - 1 and (steps.min() >= 0 or steps.max() <= 0):
        return "rises" if steps.max() > 0 else "falls"
    if _near_line(x):
        return "rises" if x[-1] > x[0] else "falls"
    return "repeats" if _repeats(steps) else ""


def _finite(x: FloatArray) -> FloatArray:
    whole = np.isfinite(x)
    return x if whole.all() else x[whole]


def _near_line(x: FloatArray) -> bool:
    """Return whether a series lies near a straight line that spans many of its steps."""
    scale = float(np.abs(x).max()) or 1.0
    i = np.arange(x.size) - (x.size - 1) / 2
    y = x / scale
    y = y - y.mean()
    slope = float(i @ y / (i @ i))
    return bool(np.abs(y - slope * i).max() <= min(NEAR_LINE, x.size / FEWEST / 2) * abs(slope))


def _repeats(steps: FloatArray) -> bool:
    """Return whether the steps are equal but for jumps back at least 16 samples apart."""
    step = float(np.median(steps))
    jumps = np.flatnonzero(np.abs(steps - step) > _ROUNDING * np.abs(steps).max())
    if step == 0 or not jumps.size or jumps.size > steps.size / LONG_TEETH:
        return False
    # A large spike hides the steps of a vibration in its rounding.
    if np.abs(np.delete(steps, jumps) - step).max() > abs(step):
        return False
    apart = jumps.size < 2 or np.diff(jumps).min() >= LONG_TEETH
    return bool(apart and np.all(steps[jumps] * np.sign(step) < -(LONG_TEETH / 2) * abs(step)))


def rises_in_equal_steps(x: FloatArray) -> bool:
    """Return whether a series rises from sample to sample by the same step, to a thousandth of it.

    Examples
    --------
    >>> import numpy as np
    >>> rises_in_equal_steps(np.arange(10) * 0.5), rises_in_equal_steps(np.arange(10.0) ** 2)
    (True, False)
    """
    if x.size < 3 or not np.isfinite(x).all():
        return False
    step = (x[-1] - x[0]) / (x.size - 1)
    return bool(step > 0 and np.abs(x - x[0] - step * np.arange(x.size)).max() <= 1e-3 * step)


def without_spectra(
    columns: tuple[DataColumn, ...], tacho: str | None, sure: Collection[int]
) -> tuple[tuple[DataColumn, ...], list[Note]]:
    """Return the columns that run over no frequency, order or angle in another column, and notes on the others.

    Frequencies and orders rise, angles rise in equal steps. The columns of that length run over them.

    Parameters
    ----------
    columns
        The columns of a file.
    tacho
        Name of the tacho's column.
    sure
        Lengths of columns for which there are times, or for which the file states what runs over what.

    Raises
    ------
    InputError
        If all columns do, or the tacho does.
    """
    over: dict[int, tuple[str, str]] = {}
    for i, column in enumerate(columns):
        quantity = other_abscissa(column.name, column.unit) if column.values.dtype.kind in "iuf" else ""
        if not quantity or column.name == tacho or column.values.size in sure:
            continue
        rises = ramp_kind(column.numbers) in ("rises", "counts")
        if rises and (quantity != "angle" or (i == 0 and rises_in_equal_steps(column.values.astype(float)))):
            over.setdefault(column.values.size, (column.name, quantity))
    kept, notes = [], []
    for column in columns:
        name, quantity = over.get(column.values.size, (column.name, ""))
        if name == column.name:
            kept.append(column)
            continue
        text = f"{column.name} runs over {quantity}, in {name}, not over time, and was left out"
        notes.append(Note(code="not-over-time", text=text, values={"column": column.name, "abscissa": quantity}))
    left = {column.name for column in kept} - {name for name, _ in over.values()}
    if notes and (not left or (tacho and tacho not in left)):
        name, quantity = next(iter(over.values()))
        raise InputError(
            f"column {name} holds the {quantity}, which rises: the other columns run over {quantity}, not over "
            "time; export the signal over time, or choose channels with sampling_rate if it is one"
        )
    return tuple(kept), notes
