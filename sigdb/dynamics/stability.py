"""Stability of a rig under its varying mesh stiffness, by the monodromy matrix of one revolution.

The march is exact in each modal coordinate for a mesh force that is linear within a step (first-order hold). The mesh's
compression at the end of a step follows in closed form, without iteration.
"""

from functools import reduce

import numpy as np

from sigdb.core import ComplexArray, FloatArray, NotApplicableError
from sigdb.transmission import ModalSystem, small_matrices

STABILITY_MODES = 48
"""Modes kept to assess stability: those that take part in the meshes; the others decay by themselves."""
_MOST_STEPS = 64
"""Most steps of a part of the period, whose forces are solved together."""
_MOST_PARTS = 32
"""Most parts that are solved at once, which bounds the memory."""
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
def floquet_multiplier(system: ModalSystem, stiffness: FloatArray, period: float, *, passes: int = 1) -> float:
    """Return the largest magnitude of a Floquet multiplier over a period; the steady state is stable below 1.

    Parameters
    ----------
    system
        A modal system.
    stiffness
        (meshes, n), or (n,) for one mesh: stiffness on n equal steps of the period, N/m, meshes in the system's order.
    period
        The period, s.
    passes
        Number of equal parts of the period, such as tooth passes: parts with the same stiffness are marched once.

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
    meshes, steps = stiffness.shape
    kappa = (stiffness - system.mesh_stiffness[:, None]).T.reshape(-1, _steps_of_part(steps // passes), meshes)
    kappa = np.concatenate([np.roll(kappa[:, -1:], 1, axis=0), kappa], axis=1)
    _, first, same = np.unique(kappa.reshape(len(kappa), -1), axis=0, return_index=True, return_inverse=True)
    with np.errstate(all="ignore"):  # a motion that is not finite is refused
        blocks = np.array_split(first, -(-len(first) // _MOST_PARTS))
        parts = np.concatenate([_propagators(system, kappa[block], period / steps) for block in blocks])
        monodromy = reduce(lambda so_far, part: parts[part] @ so_far, same[1:], parts[same[0]])
    if not np.isfinite(monodromy).all():
        raise NotApplicableError(
            f"the motion over a period of {period:.3g} s is not finite: speed, stiffness or masses are far from those "
            "of a transmission; check their units"
        )
    return float(np.abs(np.linalg.eigvals(monodromy)).max())


def _steps_of_part(steps: int) -> int:
    """Return the greatest number of steps, at most 64, that divides those of a pass."""
    return next(part for part in range(min(steps, _MOST_STEPS), 0, -1) if steps % part == 0)


def _propagators(system: ModalSystem, kappa: FloatArray, h: float) -> FloatArray:
    """Return the matrices (parts, states, states) from the beginning of each part of the period to its end.

    With the forces f of a first-order hold, the coordinates after k steps from z are ::

        z_k = E^k z + sum_j E^(k - j) (b g0 f_(j-1) + b g1 f_j),    j from 1 to k.

    The compressions ``Re(c z_k) + direct f_k`` are thus linear in z and in all forces up to f_k. With
    ``f_k = -kappa_k`` times the compression they are a triangular system of equations.

    Parameters
    ----------
    system
        The modal system.
    kappa
        (parts, n + 1, meshes) deviation of the stiffness from that of the system, N/m: at the beginning and after each
        of the n steps.
    h
        Step, s.
    """
    parts, n, meshes = len(kappa), kappa.shape[1] - 1, len(system.meshes)
    upper = system.poles.imag >= 0
    # Re(weight z) is the real output of a conjugate pair, whose second half is not marched.
    weight = np.where(system.poles[upper].imag > 0, 2.0, 1.0)
    pole, b, c = system.poles[upper], system.inputs[upper, :meshes], weight * system.outputs[:meshes, upper]
    direct, paired = system.direct[:meshes, :meshes], pole.imag > 0
    _, *holds = first_order_hold(pole, h)
    g0, g1 = (b * hold[:, None] for hold in holds)
    powers = np.exp(pole * h * np.arange(n + 1)[:, None])

    # Coordinates after i steps from unit forces: the first one, the last one, and all between act for two steps.
    between = powers[:-1, :, None] * (powers[1][:, None] * g1 + g0)
    later = np.concatenate([g1[None], between[:-1]])
    gains = np.zeros((n + 1, meshes, n + 1, meshes))
    for lag, gain in enumerate((c @ later).real):
        gains[np.arange(1 + lag, n + 1), :, np.arange(1, n + 1 - lag)] = gain
    gains[1:, :, 0] = (c @ (powers[:-1, :, None] * g0)).real
    gains[np.arange(n + 1), :, np.arange(n + 1)] += direct

    size = (n + 1) * meshes
    stiff = kappa.reshape(parts, size, 1)
    coordinates = (c * powers[:, None, :]).reshape(size, -1)
    free = np.hstack([coordinates.real, -coordinates.imag[:, paired]])
    forces = -np.linalg.solve(np.eye(size) + stiff * gains.reshape(size, size), stiff * free)
    by_force = np.concatenate([(powers[-2, :, None] * g0)[None], later[::-1]])
    z = np.diag(powers[-1]) @ np.hstack([np.eye(len(pole)), 1j * np.eye(len(pole))[:, paired]])
    z = z + by_force.transpose(1, 0, 2).reshape(len(pole), size) @ forces
    return np.concatenate([z.real, z.imag[:, paired]], axis=1)
