"""What comes after the last sample of a record, by linear prediction."""

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from sigdb.signature._validation import Float64Array

MEMORY = 256
"""Samples that a prediction is made from."""

_ORDER = 32


def predicted(x: Float64Array, count: int) -> Float64Array:
    """``(channels, count)`` samples that continue x, ``(channels, samples)``; exact for up to 16 steady tones."""
    return np.array([_continued(one[-MEMORY:], count) for one in x]).reshape(len(x), count)


def _continued(x: Float64Array, count: int) -> Float64Array:
    order = min(_ORDER, x.size // 4)
    if order == 0 or count == 0:
        return np.full(count, x[-1])
    rows = sliding_window_view(x, order + 1)
    # Forwards and backwards: a tone obeys the same recurrence in both directions, and noise is predicted tamely.
    known, sought = np.concatenate([rows[:, :-1], rows[:, :0:-1]]), np.concatenate([rows[:, -1], rows[:, 0]])
    weights = np.linalg.lstsq(known, sought, rcond=None)[0]
    most = 2 * np.abs(x).max()
    series = np.append(x[-order:], np.empty(count))
    for i in range(order, order + count):
        series[i] = min(max(weights @ series[i - order : i], -most), most)
    return series[order:]
