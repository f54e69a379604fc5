"""Static compliance of a rig at its sensors: what they see under forces along each other, and under the torque."""

from dataclasses import dataclass

import numpy as np

from sigdb.core import FloatArray, InputError
from sigdb.transmission.rig import Transmission
from sigdb.transmission.system.assembly import assemble
from sigdb.transmission.system.small_matrices import small_matrices

_SINGULAR = 1e-13
"""Reciprocal condition of the scaled stiffness below which a part moves freely."""


@dataclass(frozen=True, kw_only=True)
class Compliance:
    """Static displacements that the s sensors of a rig see.

    Attributes
    ----------
    forces
        (s, s) displacement at each sensor, under 1 N along each sensor, m/N.
    torque
        (s,) displacement at each sensor under the rig's torque, m.
    """

    forces: FloatArray
    torque: FloatArray


@small_matrices
def static_compliance(rig: Transmission) -> Compliance:
    """Return the static displacements at a rig's sensors, with the mean stiffness of its meshes.

    Parameters
    ----------
    rig
        The transmission.

    Returns
    -------
    Compliance

    Raises
    ------
    InputError
        If a part of the rig can move freely apart from the train's rotation.

    Examples
    --------
    >>> import numpy as np, sigdb
    >>> from sigdb.transmission import static_compliance
    >>> seen = static_compliance(sigdb.load_transmission("friswell-turbogenerator"))
    >>> bool(np.isclose(1 / seen.forces[0, 0], 1.2e7, rtol=0.5))
    True
    """
    parts = assemble(rig)
    stiffness = parts.stiffness + parts.meshes @ np.diag(parts.mesh_stiffness) @ parts.meshes.T
    # The train's free rotation, which no sensor sees, is held by a spring of usual size.
    turning = parts.free_rotation
    stiffness = stiffness + np.median(np.diag(stiffness)) * np.outer(turning, turning)
    scale = 1 / np.sqrt(np.diag(stiffness).clip(min=np.finfo(float).tiny))
    scaled = stiffness * scale * scale[:, None]
    if not np.isfinite(scaled).all() or 1 / np.linalg.cond(scaled) < _SINGULAR:
        raise InputError(
            f"rig {rig.name!r}: a part of it can move freely, so a force has no static deflection; hold it with a "
            "bearing that has stiffness in that direction"
        )
    loads = np.column_stack([parts.sensors.T, parts.torque])
    displaced = parts.sensors @ (scale[:, None] * np.linalg.solve(scaled, scale[:, None] * loads))
    return Compliance(forces=displaced[:, :-1], torque=displaced[:, -1])
