"""Stability of a rig under its varying mesh stiffness, by the monodromy matrix of one revolution.

The march is exact in each modal coordinate for a mesh force that is linear within a step (first-order hold). The mesh's
compression at the end of a step follows in closed form, without iteration.
"""

import numpy as np

from sigdb.core import ComplexArray, FloatArray, NotApplicableError
from sigdb.transmission import ModalSystem, small_matrices

STABILITY_MODES = 48
"""Modes kept to assess stability: those that take part in the meshes; the others decay by themselves."""
_SMALL = 1e-2
"""Bound below which the series of the hold's factors is exact to rounding, and the closed form is not."""


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


@small_matrices
def floquet_multiplier(system: ModalSystem, stiffness: FloatArray, period: float) -> float:
    """Return the largest magnitude of a Floquet multiplier over a period; the steady state is stable below 1.

    Parameters
    ----------
    system
        A modal system.
    stiffness
        (meshes, n), or (n,) for one mesh: stiffness on n equal steps of the period, N/m, meshes in the system's order.
    period
        The period, s.

    Returns
    -------
    float

    Raises
    ------
    NotApplicableError
        If the motion over the period is not finite.

    Examples
    --------
    Constant stiffness: the slowest pole decides.

    >>> import numpy as np, sigdb
    >>> from sigdb.transmission import modal_system
    >>> system = modal_system(sigdb.load_transmission("nasa-spiral-bevel"))
    >>> multiplier = floquet_multiplier(system, np.full(768, system.mesh_stiffness[0]), 1 / 240)
    >>> bool(np.isclose(multiplier, np.exp(system.poles.real.max() / 240)))
    True
    """
    stiffness = np.atleast_2d(stiffness)
    meshes = len(system.meshes)
    upper = system.poles.imag >= 0
    # Re(weight z) is the real output of a conjugate pair, whose second half is not marched.
    weight = np.where(system.poles[upper].imag > 0, 2.0, 1.0)
    pole, b, c = system.poles[upper], system.inputs[upper, :meshes], weight * system.outputs[:meshes, upper]
    with np.errstate(all="ignore"):  # a motion that is not finite is refused
        h = period / stiffness.shape[1]
        decay, *holds = first_order_hold(pole, h)
        g0, g1 = (b * hold[:, None] for hold in holds)
        direct = system.direct[:meshes, :meshes]
        compliance = (c @ g1).real + direct
        kappa = (stiffness - system.mesh_stiffness[:, None]).T

        # State: the real parts of all coordinates, and the imaginary ones of pairs; a real pole has none.
        m = len(pole)
        paired = pole.imag > 0
        z = np.hstack([np.eye(m), 1j * np.eye(m)[:, paired]])
        force = -_solved(direct, kappa[-1], (c @ z).real)
        for k in kappa:
            free = decay[:, None] * z + g0 @ force
            force = -_solved(compliance, k, (c @ free).real)
            z = free + g1 @ force
        monodromy = np.vstack([z.real, z.imag[paired]])
    if not np.isfinite(monodromy).all():
        raise NotApplicableError(
            f"the motion over a period of {period:.3g} s is not finite: speed, stiffness or masses are far from those "
            "of a transmission; check their units"
        )
    return float(np.abs(np.linalg.eigvals(monodromy)).max())


def _solved(compliance: FloatArray, kappa: FloatArray, free: FloatArray) -> FloatArray:
    """``kappa delta`` of the compressions ``delta = free - compliance kappa delta`` at one instant."""
    if len(kappa) == 1:
        return kappa[0] * free / (1 + compliance[0, 0] * kappa[0])
    return kappa[:, None] * np.linalg.solve(np.eye(len(kappa)) + compliance * kappa, free)
