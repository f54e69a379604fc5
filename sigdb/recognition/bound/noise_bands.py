"""Noise bands: rows in bands of their signal-to-noise ratio."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pandas as pd

from sigdb.core import BoolArray

WIDTH = 4.0
"""Nominal width of a band, dB: as many bands as fit best between whole decibels."""

ALL = "all"
"""Name of the band that holds all rows."""


@dataclass(frozen=True, kw_only=True, eq=False)
class NoiseBand:
    """Rows of similar noise.

    Attributes
    ----------
    name
        Text for readers; :data:`ALL` for all rows.
    low, high
        Ends of the band, dB; NaN where the rows have no signal-to-noise ratio.
    inside
        (rows,) whether a row is in the band.
    """

    name: str
    low: float
    high: float
    inside: BoolArray


def noise_bands(snr_db: pd.Series) -> list[NoiseBand]:
    """Return the bands that hold rows, from much noise to little, and at last all rows.

    Rows of one signal-to-noise ratio have the band of all rows only.

    Examples
    --------
    >>> import pandas as pd
    >>> [band.name for band in noise_bands(pd.Series([-9.5, -7.0, -2.5]))]
    ['-10 to -6 dB', '-6 to -2 dB', 'all']
    """
    values = snr_db.to_numpy(float)
    every = np.full(len(values), True)
    if not np.isfinite(values).all() or np.ptp(values) == 0:
        level = float(values[0]) if np.isfinite(values).all() else np.nan
        return [NoiseBand(name=ALL, low=level, high=level, inside=every)]
    low, high = np.floor(values.min()), np.ceil(values.max())
    edges = np.linspace(low, high, max(1, round((high - low) / WIDTH)) + 1)
    place = np.clip(np.searchsorted(edges, values, side="right"), 1, len(edges) - 1)
    bands = [
        NoiseBand(name=f"{a:g} to {b:g} dB", low=a, high=b, inside=place == i)
        for i, (a, b) in enumerate(pairwise(edges.tolist()), start=1)
        if (place == i).any()
    ]
    return bands if len(bands) == 1 else [*bands, NoiseBand(name=ALL, low=float(low), high=float(high), inside=every)]
