"""First-order hold: the exact step of a modal coordinate under a force that is linear within the step."""

import numpy as np

from sigdb.core.typing import ComplexArray


def first_order_hold(poles: ComplexArray, h: float) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """Factors of the step ``z <- E z + (b g0) f_n + (b g1) f_(n+1)`` of ``z' = pole z + b f``.

    Parameters
    ----------
    poles
        In 1/s.
    h
        Step, s.

    Returns
    -------
    E, g0, g1
        ``exp(x)``, ``h (phi1 - phi2)`` and ``h phi2`` with ``x = pole h``, ``phi1 = (e^x - 1) / x``,
        ``phi2 = (e^x - 1 - x) / x^2``.

    Examples
    --------
    A constant force on an integrator:

    >>> E, g0, g1 = first_order_hold(np.array([0j]), 0.1)
    >>> float(E[0].real), float((g0 + g1)[0].real)
    (1.0, 0.1)
    """
    x = poles * h
    small = np.abs(x) < _SMALL
    safe = np.where(small, 1, x)
    phi1 = np.where(small, 1 + x / 2 * (1 + x / 3 * (1 + x / 4 * (1 + x / 5))), np.expm1(safe) / safe)
    phi2 = np.where(small, (1 + x / 3 * (1 + x / 4 * (1 + x / 5 * (1 + x / 6)))) / 2, (np.expm1(safe) - safe) / safe**2)
    return np.exp(x), h * (phi1 - phi2), h * phi2


_SMALL = 1e-2
"""Below it the series is exact to rounding and the closed form is not."""
