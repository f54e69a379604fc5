"""The raised cosine by which edges are smoothed, so that results converge with the time grid."""

import numpy as np

from sigdb.core.typing import FloatArray


def raised_cosine(x: FloatArray) -> FloatArray:
    """From 0 at x <= 0 to 1 at x >= 1.

    Examples
    --------
    >>> import numpy as np
    >>> raised_cosine(np.array([-1.0, 0.5, 2.0])).round(3).tolist()
    [0.0, 0.5, 1.0]
    """
    return (1 - np.cos(np.pi * np.clip(x, 0, 1))) / 2
