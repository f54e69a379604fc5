"""Missing samples: short gaps are filled, ends are cut, other gaps are refused."""

import numpy as np

from sigdb.core import FloatArray, InputError, IntArray, Note

MOST_FILLED = 0.01
"""Largest fraction of a channel that may be filled."""

MOST_CUT = 0.1
"""Largest fraction of a recording that may be cut at its ends."""


def gaps(x: FloatArray) -> tuple[IntArray, IntArray]:
    """Return the first samples and the lengths of runs of nan.

    Examples
    --------
    >>> import numpy as np
    >>> [part.tolist() for part in gaps(np.array([1.0, np.nan, np.nan, 4.0]))]
    [[1], [2]]
    """
    edges = np.diff(np.concatenate([[0], np.isnan(x).astype(np.int8), [0]]))
    starts = np.flatnonzero(edges == 1)
    return starts, np.flatnonzero(edges == -1) - starts


def fill_gaps(x: FloatArray, *, name: str, longest: int, is_tacho: bool = False) -> tuple[FloatArray, list[Note]]:
    """Return the series with short gaps filled by straight lines, and a note on them.

    Raises
    ------
    InputError
        If a gap is longer than ``longest`` samples, more than 1 % is missing, or the tacho has a gap, which may hide
        a pulse.
    """
    starts, lengths = gaps(x)
    if not starts.size:
        return x, []
    worst = int(np.argmax(lengths))
    where = f"{lengths[worst]} samples are missing from sample {starts[worst]} on"
    if is_tacho:
        raise InputError(f"the tacho {name}: {where}, which may hide a pulse; cut the recording there")
    if lengths[worst] > longest:
        raise InputError(
            f"channel {name}: {where}; cut the recording there, or give a larger longest_gap (now {longest})"
        )
    if lengths.sum() > MOST_FILLED * x.size:
        raise InputError(
            f"channel {name}: {lengths.sum()} of {x.size} samples are missing; more than 1 % is not filled"
        )
    missing = np.isnan(x)
    y = x.copy()
    y[missing] = np.interp(np.flatnonzero(missing), np.flatnonzero(~missing), x[~missing])
    text = (
        f"{name}: {lengths.sum()} missing samples in {starts.size} gaps, the longest of {lengths.max()}, "
        "were filled by straight lines"
    )
    values: dict[str, str | int] = {
        "channel": name,
        "samples": int(lengths.sum()),
        "gaps": starts.size,
        "longest": int(lengths.max()),
    }
    return y, [Note(code="filled-gaps", text=text, values=values)]


def common_part(series: list[FloatArray], names: list[str]) -> tuple[int, int]:
    """Return the first sample that all series have, and the sample after the last.

    Raises
    ------
    InputError
        If a series is all missing, or more than a tenth of the longest is not shared.
    """
    firsts, lasts = zip(*(ends(x, name) for x, name in zip(series, names, strict=True)), strict=True)
    first, end = max(firsts), min(lasts)
    longest = max(x.size for x in series)
    if end - first < (1 - MOST_CUT) * longest:
        short = names[int(np.argmin(np.subtract(lasts, firsts)))]
        raise InputError(
            f"the channels do not cover the same time: samples {first} to {end} of {longest} are shared, and {short} "
            f"has samples {firsts[names.index(short)]} to {lasts[names.index(short)]}; choose channels that do"
        )
    return first, end


def ends(x: FloatArray, name: str) -> tuple[int, int]:
    """Return the first sample that is present, and the sample after the last.

    Raises
    ------
    InputError
        If there is none.
    """
    present = ~np.isnan(x)
    if not present.any():
        raise InputError(f"channel {name} holds no numbers; choose others by channels")
    return int(np.argmax(present)), x.size - int(np.argmax(present[::-1]))
