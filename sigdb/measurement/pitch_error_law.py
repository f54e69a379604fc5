"""Pitch errors of a gear: tolerances after ISO 1328-1, and errors of its teeth with run-out and cumulative pitch."""

from dataclasses import dataclass
from math import cos, radians, sqrt

import numpy as np

from sigdb.core import FloatArray, InputError
from sigdb.measurement.specimen import slow_errors

_SLOW, _WHITE = 0.25, 0.2
"""Root mean square amplitude of each slow order over F_p, and standard deviation of the white part over f_pt."""
_TEETH, _DIAMETER, _MODULE, _CLASS = (5, 1000), (5e-3, 15.0), (0.5e-3, 70e-3), (1, 11)
"""Ranges in which the formulas of the standard hold; lengths in m."""


@dataclass(frozen=True, kw_only=True)
class PitchTolerances:
    """Tolerances of the pitch of a gear.

    Attributes
    ----------
    single_pitch
        f_ptT: largest deviation of a pitch from the mean one, m.
    cumulative_pitch
        F_pT: largest range of the places of all teeth, m.
    runout
        F_rT: largest range of the radial places of all tooth spaces, m.
    """

    single_pitch: float
    cumulative_pitch: float
    runout: float


def pitch_tolerances(teeth: int, *, module: float, tolerance_class: int, helix_angle: float = 0.0) -> PitchTolerances:
    r"""Return the pitch tolerances of a gear after ISO 1328-1:2013 [1]_, not rounded.

    With the module m_n and the reference diameter d in mm, and the flank tolerance class A, in micrometres ::

        f_ptT = (0.001 d + 0.4 m_n + 5) sqrt(2)^(A - 5)
        F_pT  = (0.002 d + 0.55 sqrt(d) + 0.7 m_n + 12) sqrt(2)^(A - 5)
        F_rT  = 0.9 F_pT

    Parameters
    ----------
    teeth : int
        Tooth count, 5 to 1000.
    module : float
        Normal module, 0.5e-3 to 70e-3 m.
    tolerance_class : int
        Flank tolerance class A, 1 (the tightest) to 11. Ground gears are of class 4 to 6, shaved or hobbed ones of
        class 7 to 9.
    helix_angle : float
        Helix angle, deg.

    Returns
    -------
    PitchTolerances

    Raises
    ------
    InputError
        If a number lies outside the range of the standard, which forbids to extrapolate.

    References
    ----------
    .. [1] ISO 1328-1:2013, Cylindrical gears, ISO system of flank tolerance classification, part 1: definitions and
       allowable values of deviations relevant to flanks of gear teeth, clause 5.

    Examples
    --------
    >>> tolerances = pitch_tolerances(32, module=2e-3, tolerance_class=6)
    >>> [round(1e6 * value, 1) for value in (tolerances.single_pitch, tolerances.cumulative_pitch, tolerances.runout)]
    [8.3, 25.4, 22.8]
    """
    diameter = teeth * module / cos(radians(helix_angle))
    _check("teeth", teeth, _TEETH, "")
    _check("module", module, _MODULE, " m")
    _check("tolerance_class", tolerance_class, _CLASS, "")
    _check("reference diameter", diameter, _DIAMETER, " m")
    d, m, step = 1e3 * diameter, 1e3 * module, sqrt(2) ** (tolerance_class - 5)
    cumulative = 1e-6 * (0.002 * d + 0.55 * sqrt(d) + 0.7 * m + 12) * step
    return PitchTolerances(
        single_pitch=1e-6 * (0.001 * d + 0.4 * m + 5) * step, cumulative_pitch=cumulative, runout=0.9 * cumulative
    )


def pitch_errors(
    stream: np.random.Generator, teeth: int, *, module: float, tolerance_class: int, helix_angle: float = 0.0
) -> FloatArray:
    r"""Draw the index errors of a gear with run-out, for a flank tolerance class of ISO 1328-1.

    The errors have a slow part, which run-out and an oval pitch curve leave, and a white part ::

        e_j = sum_{k = 1, 2} (a_k cos(2 pi k j / Z) + b_k sin(2 pi k j / Z)) + w_j - mean(w),

    a_k and b_k with a standard deviation of 0.25 F_pT / sqrt(2), so that the root mean square amplitude of each order
    is 0.25 F_pT, and w_j with one of 0.2 f_ptT.

    The standard gives tolerances, not a law. Two orders of the same size, a normal law and the two factors are assumed.
    With them the cumulative deviation ``max(e) - min(e)`` has a mean of 0.8 to 0.9 F_pT for 12 to 100 teeth. The
    greatest single deviation ``max |e_j - e_(j-1)|`` has one of 0.8 to 1.1 f_ptT. So a gear fills its class, whose
    upper neighbour begins at 0.71 of its tolerances, and one in four exceeds it. Tolerances along the pitch circle are
    taken along the mesh normal, which is 6 % less at a pressure angle of 20 deg.

    A recipe has the same law with ``index_error`` = 0.2 f_ptT and ``runout`` = 1.25 F_pT / f_ptT, which is about 3.8.

    Parameters
    ----------
    stream : numpy.random.Generator
        Random stream.
    teeth, module, tolerance_class, helix_angle
        As of :func:`pitch_tolerances`; the module in m, the angle in deg.

    Returns
    -------
    (teeth,) float64
        Errors along the mesh normal, m, with a mean of zero; positive where the tooth touches late.

    Raises
    ------
    InputError
        If a number lies outside the range of the standard.

    Examples
    --------
    >>> errors = pitch_errors(np.random.default_rng(0), 32, module=2e-3, tolerance_class=6)
    >>> errors.shape, bool(np.ptp(errors) < 50e-6)
    ((32,), True)
    """
    limits = pitch_tolerances(teeth, module=module, tolerance_class=tolerance_class, helix_angle=helix_angle)
    slow, white = slow_errors(stream, teeth), stream.standard_normal(teeth)
    return _SLOW * limits.cumulative_pitch * slow + _WHITE * limits.single_pitch * (white - white.mean())


def _check(name: str, value: float, limits: tuple[float, float], unit: str) -> None:
    low, high = limits
    if not low <= value <= high:
        raise InputError(
            f"{name} = {value:g}{unit} must be {low:g} to {high:g}{unit}: ISO 1328-1 gives no tolerances beyond"
        )
