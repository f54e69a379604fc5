"""Squares of residuals that the modes of normal laws explain. Importing this module imports numba."""

import numpy as np

from sigdb.core import FloatArray, kernel


@kernel
def explained_squares(products: FloatArray, means: FloatArray, shares: FloatArray) -> FloatArray:
    """Return ``sum_m share (product - mean)^2``, (teeth, rows, templates).

    The products are (teeth, rows, templates r), the means (teeth or 1, rows or 1, templates, r), and the shares (rows,
    templates, r).
    """
    teeth, rows = products.shape[:2]
    templates, modes = shares.shape[1:]
    sums = np.empty((teeth, rows, templates))
    for t in range(teeth):
        turn = min(t, len(means) - 1)
        for i in range(rows):
            row = min(i, means.shape[1] - 1)
            for k in range(templates):
                total = 0.0
                for m in range(modes):
                    left = products[t, i, k * modes + m] - means[turn, row, k, m]
                    total += shares[i, k, m] * left * left
                sums[t, i, k] = total
    return sums


@kernel
def shares_and_determinants(ratios: FloatArray, gains: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the shares of modes and the logarithms of determinants for laws in which noise differs by row.

    With d = (ratio gain)^2 these are d / (1 + d), (rows, templates, r), and the sums of log(1 + d), (rows, templates).
    The ratios are (rows,), the gains (templates, r).
    """
    rows, (templates, modes) = len(ratios), gains.shape
    shares, logs = np.empty((rows, templates, modes)), np.empty((rows, templates))
    for i in range(rows):
        for k in range(templates):
            total, product = 0.0, 1.0
            for m in range(modes):
                d = (ratios[i] * gains[k, m]) ** 2
                shares[i, k, m] = d / (1 + d)
                product *= 1 + d
                if product > 1e100:
                    total += np.log(product)
                    product = 1.0
            logs[i, k] = total + np.log(product)
    return shares, logs
