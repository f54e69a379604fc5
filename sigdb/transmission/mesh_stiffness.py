"""Mesh stiffness along the contact, pair by pair, healthy and damaged.

With u the pass coordinate (revolutions of the gear times its teeth) and x = u - j + 1 the place of tooth j in its
contact: ``k_j(u) = kp(x') (1 - l_j v(x'))`` with ``x' = x - s_j w(x)``, s_j the phase shift in passes and l_j the
stiffness loss. The windows w and v are one inside the tooth's contact and fall by raised cosines, wide enough that
the profile never runs backwards (a raised cosine of width b has a slope of pi / (2 b)).
"""

from collections.abc import Mapping

import numpy as np

from sigdb.core.typing import FloatArray
from sigdb.transmission.damage import ToothDamage
from sigdb.transmission.gears import Mesh, Trapezoid

_LEAST_EDGE = 0.1
_EDGE_PER_SHIFT = 1.6
"""Edge width, in passes, for a shift of one pass: above pi / 2, so that ``x - s w(x)`` rises everywhere."""


def pair_stiffness(profile: Trapezoid, x: FloatArray) -> FloatArray:
    """Stiffness of one tooth pair at x passes after first contact, for a mesh of unit mean stiffness.

    The sum over the pairs in contact has mean 1: the profile's area is 1.
    """
    rise = _raised_cosine(x / profile.flank)
    fall = _raised_cosine((profile.contact_ratio - x) / profile.flank)
    return rise * fall / (profile.contact_ratio - profile.flank)


def place_in_contact(u: FloatArray, teeth: int) -> FloatArray:
    """(teeth, n) place x of each tooth in its contact, in passes from -1 to teeth - 1; tooth j is row j - 1."""
    return (u - np.arange(teeth)[:, None] + 1) % teeth - 1


def pairs_in_contact(u: FloatArray) -> FloatArray:
    """(3, n) places x of the pairs of a healthy mesh that can be in contact, all its teeth being alike."""
    return u % 1 + np.arange(3)[:, None]


def tooth_stiffness(mesh: Mesh, teeth: int, u: FloatArray, damage: Mapping[int, ToothDamage]) -> FloatArray:
    """Stiffness of each tooth's pair over one revolution of a gear, N/m.

    Parameters
    ----------
    mesh
        Mean stiffness and profile.
    teeth
        Tooth count of the gear.
    u
        (n,) pass coordinate, 0 at the tacho mark, ``teeth`` a revolution later.
    damage
        Damage by tooth number, from 1.

    Returns
    -------
    ndarray, (teeth, n)
        Row j - 1 is tooth j. The mesh stiffness is the sum over rows.

    Raises
    ------
    InputError
        If a phase shift is more than half a tooth pass.

    Examples
    --------
    >>> import numpy as np, sigdb
    >>> mesh = sigdb.load_transmission("nasa-spiral-bevel").meshes["main"]
    >>> u = np.arange(768) / 64
    >>> k = tooth_stiffness(mesh, 12, u, {}).sum(axis=0)
    >>> bool(np.isclose(k.mean(), mesh.stiffness, rtol=1e-4))
    True
    """
    profile = mesh.profile
    rows = place_in_contact(u, teeth)
    return mesh.stiffness * np.array(
        [
            damaged_pair_stiffness(profile, x, damage[tooth], teeth) if tooth in damage else pair_stiffness(profile, x)
            for tooth, x in enumerate(rows, start=1)
        ]
    )


def damaged_pair_stiffness(profile: Trapezoid, x: FloatArray, damage: ToothDamage, teeth: int) -> FloatArray:
    """Stiffness of a pair with a damaged tooth of a gear, at x passes after first contact, as of `pair_stiffness`.

    Away from the contact by a pass or more it is zero, as that of a healthy pair.
    """
    shift = damage.shift_in_passes(teeth)
    end, edge = profile.contact_ratio, max(_LEAST_EDGE, _EDGE_PER_SHIFT * abs(shift))
    if shift:
        x = x - shift * _raised_cosine(1 + x / edge) * _raised_cosine(1 + (end - x) / edge)
    # The loss fades over `edge`, which slides from before the contact (extent 0) to behind it (extent 1).
    fading = _raised_cosine((damage.loss_extent * (end + edge) - x) / edge)
    return pair_stiffness(profile, x) * (1 - damage.stiffness_loss * fading)


def sliding_sense(profile: Trapezoid, x: FloatArray) -> FloatArray:
    """From -1 before the pitch point to 1 after it, within a tenth of a pass, at x passes after first contact."""
    return 2 * _raised_cosine((x - profile.pitch_point) / _LEAST_EDGE + 0.5) - 1


def _raised_cosine(x: FloatArray) -> FloatArray:
    """From 0 at x <= 0 to 1 at x >= 1."""
    return (1 - np.cos(np.pi * x.clip(0, 1))) / 2
