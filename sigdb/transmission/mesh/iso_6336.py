"""Mesh stiffness by ISO 6336-1, method B: c' of a pair of teeth and c_gamma of the mesh."""

from dataclasses import dataclass

import numpy as np

from sigdb.core import InputError
from sigdb.transmission.mesh.cylindrical_pair import CylindricalPair

MODEL_FACTOR = 0.8
"""C_M: measured against theoretical stiffness."""
_STEEL = 206e9
_LEAST_LINE_LOAD = 1e5


@dataclass(frozen=True, kw_only=True)
class MeshStiffness:
    """Stiffness of a face width of 1, in the transverse plane along the line of action, Pa.

    1 N/(mm um) of the standard is 1e9 Pa.

    Attributes
    ----------
    single
        c': greatest stiffness of one pair of teeth.
    mean
        c_gamma_alpha: mean of the mesh, for dynamics.
    face_load
        c_gamma_beta: mean of the mesh, for the distribution of load over the face.
    """

    single: float
    mean: float
    face_load: float


def iso_mesh_stiffness(
    pair: CylindricalPair,
    *,
    young_moduli: tuple[float, float] = (_STEEL, _STEEL),
    blank_factor: float = 1.0,
    line_load: float | None = None,
) -> MeshStiffness:
    """c' and c_gamma of ISO 6336-1:2006, 9 (method B).

    ``c' = C_M C_R C_B cos(beta) / q'``, with ``q'`` the flexibility by tooth counts and profile shifts;
    ``c_gamma_alpha = c' (0.75 eps_alpha + 0.25)`` and ``c_gamma_beta = 0.85 c_gamma_alpha``.

    Parameters
    ----------
    pair
        External spur or helical gears, contact ratio at least 1.2.
    young_moduli
        Young's moduli of both gears, Pa; the standard's steel has 206 GPa.
    blank_factor
        C_R: 1 for solid disks, less for gears with a thin web.
    line_load
        Tangential load, application factor included, for a face width of 1, N/m; below 100 N/mm stiffness falls in
        proportion. Left out: not below.

    Raises
    ------
    InputError
        If the contact ratio is below 1.2, for which the standard gives no mean.

    Examples
    --------
    >>> pair = CylindricalPair(teeth=(19, 48), normal_module=3.175e-3, face_width=0.016, pressure_angle_deg=20.0)
    >>> round(iso_mesh_stiffness(pair).single / 1e9, 4)
    12.8315
    """
    if pair.contact_ratio < 1.2:
        raise InputError(
            f"the contact ratio is {pair.contact_ratio:.3f}; ISO 6336-1 gives a mean mesh stiffness from 1.2 on"
        )
    helix = np.deg2rad(pair.helix_angle_deg)
    z1, z2 = (z / (np.cos(pair.base_helix) ** 2 * np.cos(helix)) for z in pair.teeth)
    x1, x2 = pair.profile_shifts
    q = (
        0.04723 + 0.15551 / z1 + 0.25791 / z2
        - 0.00635 * x1 - 0.11654 * x1 / z1 - 0.00193 * x2 - 0.24188 * x2 / z2
        + 0.00529 * x1**2 + 0.00182 * x2**2
    )  # fmt: skip
    rack_factor = (1 + 0.5 * (1.2 - pair.rack.dedendum)) * (1 - 0.02 * (20 - pair.pressure_angle_deg))
    e1, e2 = young_moduli
    elastic = 2 * e1 * e2 / (e1 + e2) / _STEEL
    load = 1.0 if line_load is None else min(1.0, line_load / _LEAST_LINE_LOAD)
    single = 1e9 / q * MODEL_FACTOR * blank_factor * rack_factor * elastic * load * float(np.cos(helix))
    mean = single * (0.75 * pair.contact_ratio + 0.25)
    return MeshStiffness(single=float(single), mean=float(mean), face_load=float(0.85 * mean))
