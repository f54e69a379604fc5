"""Averages of rows as matrices, one for each tooth count."""

from collections.abc import Iterator

import numpy as np
import pandas as pd

from sigdb.core.errors import InputError
from sigdb.core.typing import FloatArray, IntArray
from sigdb.recognition.views import by_teeth


def averages_by_teeth(X: pd.DataFrame) -> Iterator[tuple[int, IntArray, FloatArray]]:
    """Tooth counts, places of their rows, and their averages (rows, n).

    Raises
    ------
    InputError
        If the rows have no averages, or those of one tooth count differ in length.
    """
    if "tsa" not in X:
        raise InputError("X lacks the column 'tsa'; give rows of Database.features() with tsa of Database.signals()")
    tsa = X["tsa"].to_numpy()
    for teeth, at in by_teeth(X):
        lengths = sorted({np.size(one) for one in tsa[at]})
        if len(lengths) > 1 or lengths[0] % teeth:
            raise InputError(
                f"tsa of gears of {teeth} teeth has {lengths} samples; give averages of one length, as many samples a "
                "tooth pass each"
            )
        yield teeth, at, np.stack(list(tsa[at])).astype(float)
