"""The kernel of the pooled distribution. Importing this module imports numba."""

import numpy as np
from numpy.typing import NDArray

from sigdb.core import kernel


@kernel
def cell_lag_products(
    re: NDArray[np.float64],
    im: NDArray[np.float64],
    first: NDArray[np.int64],
    last: NDArray[np.int64],
    fraction: NDArray[np.float64],
    lags: int,
    R: NDArray[np.float64],
) -> None:
    """R[s, c, 0 or 1, m] = Re or Im of sum_i w[c, i] z[i+m] conj(z[i-m]), m = 0 ... lags.

    ``re`` and ``im`` are ``(signals, n + 2 lags)``, extended by ``lags`` at either end. Cell c has samples first[c] up
    to last[c] with weight 1. Where fraction[c] > 0, the sample first[c] - 1 has that weight in cell c - 1 and the rest
    of 1 in cell c.
    """
    for s in range(re.shape[0]):
        for c in range(first.size):
            a, b = lags + first[c], lags + last[c]
            for m in range(lags + 1):
                # Slices, and real and imaginary parts apart: an index i - m would keep the loop from being vectorised.
                pr, pi = re[s, a + m : b + m], im[s, a + m : b + m]
                qr, qi = re[s, a - m : b - m], im[s, a - m : b - m]
                real, imag = 0.0, 0.0
                for i in range(b - a):
                    real += pr[i] * qr[i] + pi[i] * qi[i]
                    imag += pi[i] * qr[i] - pr[i] * qi[i]
                R[s, c, 0, m] = real
                R[s, c, 1, m] = imag
        for c in range(first.size):
            w = fraction[c]
            if w > 0.0:
                i = lags + first[c] - 1
                for m in range(lags + 1):
                    real = re[s, i + m] * re[s, i - m] + im[s, i + m] * im[s, i - m]
                    imag = im[s, i + m] * re[s, i - m] - re[s, i + m] * im[s, i - m]
                    R[s, c - 1, 0, m] += w * real
                    R[s, c - 1, 1, m] += w * imag
                    R[s, c, 0, m] += (1.0 - w) * real
                    R[s, c, 1, m] += (1.0 - w) * imag
