"""Stability of a rig under its varying mesh stiffness, by the monodromy matrix of one revolution.

Each modal coordinate is marched exactly for a mesh force that is linear within a step (first-order hold); the mesh's
compression at the end of a step follows in closed form, so there is no iteration.
"""

import numpy as np

from sigdb.core.typing import FloatArray
from sigdb.dynamics.hold import first_order_hold
from sigdb.transmission import ModalSystem


def floquet_multiplier(system: ModalSystem, stiffness: FloatArray, period: float) -> float:
    """Largest magnitude of a Floquet multiplier over a period; the steady state is stable below 1.

    Parameters
    ----------
    system
        A modal system.
    stiffness
        (meshes, n), or (n,) for one mesh: stiffness on n equal steps of the period, N/m, meshes in the system's order.
    period
        In s.

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
    h = period / stiffness.shape[1]
    decay, *holds = first_order_hold(pole, h)
    g0, g1 = (b * hold[:, None] for hold in holds)
    direct = system.direct[:meshes, :meshes]
    own = (c @ g1).real + direct
    kappa = (stiffness - system.mesh_stiffness[:, None]).T

    # State: the real parts of all coordinates, and the imaginary ones of pairs; a real pole has none.
    m = len(pole)
    paired = pole.imag > 0
    z = np.hstack([np.eye(m), 1j * np.eye(m)[:, paired]])
    force = -_solved(direct, kappa[-1], (c @ z).real)
    for k in kappa:
        free = decay[:, None] * z + g0 @ force
        force = -_solved(own, k, (c @ free).real)
        z = free + g1 @ force
    monodromy = np.vstack([z.real, z.imag[paired]])
    return float(np.abs(np.linalg.eigvals(monodromy)).max())


def _solved(own: FloatArray, kappa: FloatArray, free: FloatArray) -> FloatArray:
    """``kappa delta`` of the compressions ``delta = free - own kappa delta`` at one instant."""
    if len(kappa) == 1:
        return kappa[0] * free / (1 + own[0, 0] * kappa[0])
    return kappa[:, None] * np.linalg.solve(np.eye(len(kappa)) + own * kappa, free)
