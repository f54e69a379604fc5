"""Which cells of a grid of severities lie between the others, and which beyond them."""

import numpy as np
import pandas as pd

from sigdb.core.typing import BoolArray
from sigdb.recognition.severity import TARGETS


def between(cells: pd.DataFrame) -> BoolArray:
    """Whether each cell is held out so that its neighbours on both sides stay.

    A line is a row of cells that differ in one quantity only. A cell is held out where it is second, fourth, ... but
    not last on every line of three or more cells that runs through it, and there is such a line.

    Parameters
    ----------
    cells
        Distinct cells: one column for each of the severity's quantities.

    Examples
    --------
    >>> import pandas as pd
    >>> loss = [0.1, 0.2, 0.3, 0.4, 0.5]
    >>> cells = pd.DataFrame({"stiffness_loss": loss, "phase_shift_deg": 0.0, "damaged_teeth": 1})
    >>> between(cells).tolist()
    [False, True, False, True, False]
    """
    on_a_line, off_its_places = np.zeros(len(cells), bool), np.zeros(len(cells), bool)
    for axis in TARGETS:
        line = cells.groupby([other for other in TARGETS if other != axis])[axis]
        place, length = line.rank().to_numpy(), line.transform("size").to_numpy()
        long = length >= 3
        on_a_line |= long
        off_its_places |= long & ((place % 2 == 1) | (place == length))
    return on_a_line & ~off_its_places


def beyond(cells: pd.DataFrame) -> BoolArray:
    """Whether each cell has the greatest magnitude of a quantity that has three magnitudes or more.

    Examples
    --------
    >>> import pandas as pd
    >>> cells = pd.DataFrame({"stiffness_loss": [0.2, 0.3, 0.4], "phase_shift_deg": 0.0, "damaged_teeth": 1})
    >>> beyond(cells).tolist()
    [False, False, True]
    """
    outermost = np.zeros(len(cells), bool)
    for axis in TARGETS:
        magnitude = cells[axis].abs()
        if magnitude.nunique() >= 3:
            outermost |= (magnitude == magnitude.max()).to_numpy()
    return outermost
