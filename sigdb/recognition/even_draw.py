"""A bounded number of rows, drawn evenly over specimens and cases."""

import numpy as np
import pandas as pd

CASE = (
    "teeth",
    "tooth",
    "damaged_teeth",
    "phase_shift_deg",
    "stiffness_loss",
    "speed_rpm",
    "torque",
    "snr_db",
    "averages",
)
"""Columns that make a case."""


def evenly_drawn(rows: pd.DataFrame, most: int) -> pd.DataFrame:
    """At most so many of the rows, in their order, evenly over specimens, cases and noise draws.

    With c, s and d the numbers of a row's case, specimen and draw, the rows are kept whose fraction of
    ``c sqrt(2) + s sqrt(3) + d sqrt(5)`` is least. Such fractions fill the interval from 0 to 1 evenly along each of
    the three [1]_, so that each case and each specimen keeps nearly its share. Nothing is random: the same rows are
    drawn from the same rows in any order.

    Parameters
    ----------
    rows
        With ``specimen``, ``draw`` and the columns of :data:`CASE`.
    most
        Greatest number of rows.

    References
    ----------
    .. [1] R. D. Richtmyer, "The evaluation of definite integrals, and a quasi-Monte-Carlo method based on the
           properties of algebraic numbers", Los Alamos report LA-1342, 1951.
    """
    if len(rows) <= most:
        return rows
    case = rows.groupby(list(CASE), dropna=False).ngroup().to_numpy()
    specimen = np.unique(rows["specimen"], return_inverse=True)[1]
    key = np.sqrt(2) * case + np.sqrt(3) * specimen + np.sqrt(5) * rows["draw"].to_numpy()
    kept = np.lexsort((rows.index, key % 1))[:most]
    return rows.iloc[np.sort(kept)]
