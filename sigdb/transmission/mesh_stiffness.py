"""Mesh stiffness along the contact, pair by pair, healthy and damaged.

With u the pass coordinate (revolutions of the gear times its teeth) and x = u - j + 1 the place of tooth j in its
contact: ``k_j(u) = kp(x') (1 - l_j v(x'))`` with ``x' = x - s_j w(x)``, s_j the phase shift in passes and l_j the
stiffness loss. The windows w and v are one inside the tooth's contact and fall by raised cosines, wide enough that
the profile never runs backwards (a raised cosine of width b has a slope of pi / (2 b)).
"""

from collections.abc import Mapping

import numpy as np

from sigdb.core.errors import InputError
from sigdb.core.typing import FloatArray
from sigdb.transmission.damage import ToothDamage
from sigdb.transmission.gears import AnyProfile, Mesh
from sigdb.transmission.geometry_profiles import EnergyMethod
from sigdb.transmission.raised_cosine import raised_cosine

_LEAST_EDGE = 0.1
_EDGE_PER_SHIFT = 1.6
"""Edge width, in passes, for a shift of one pass: above pi / 2, so that ``x - s w(x)`` rises everywhere."""


def pair_stiffness(profile: AnyProfile, x: FloatArray) -> FloatArray:
    """Stiffness of one tooth pair at x passes after first contact, for a mesh of unit mean stiffness.

    The sum over the pairs in contact has mean 1: the profile's area is 1.
    """
    return profile.pair_stiffness(x)


def place_in_contact(u: FloatArray, teeth: int) -> FloatArray:
    """(teeth, n) place x of each tooth in its contact, in passes from -1 to teeth - 1; tooth j is row j - 1."""
    return (u - np.arange(teeth)[:, None] + 1) % teeth - 1


def pairs_in_contact(u: FloatArray) -> FloatArray:
    """(3, n) places x of the pairs of a healthy mesh that can be in contact, all its teeth being alike."""
    return u % 1 + np.arange(3)[:, None]


def tooth_stiffness(
    mesh: Mesh, teeth: int, u: FloatArray, damage: Mapping[int, ToothDamage], *, gear: str | None = None
) -> FloatArray:
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
    gear
        Name of the gear; needed only for damage by its geometry where both gears have as many teeth.

    Returns
    -------
    ndarray, (teeth, n)
        Row j - 1 is tooth j. The mesh stiffness is the sum over rows.

    Raises
    ------
    InputError
        If a phase shift is more than half a tooth pass, or the damage does not fit the mesh's profile.

    Examples
    --------
    >>> import numpy as np, sigdb
    >>> mesh = sigdb.load_transmission("nasa-spiral-bevel").meshes["main"]
    >>> u = np.arange(768) / 64
    >>> k = tooth_stiffness(mesh, 12, u, {}).sum(axis=0)
    >>> bool(np.isclose(k.mean(), mesh.stiffness, rtol=1e-4))
    True
    """
    rows = place_in_contact(u, teeth)
    stiffness = pair_stiffness(mesh.profile, rows)
    for tooth, one in damage.items():
        profile = damaged_profile(mesh, teeth, one, gear=gear)
        stiffness[tooth - 1] = _damaged_pair(profile, rows[tooth - 1], one, teeth)
    return mesh.stiffness * stiffness


def damaged_profile(mesh: Mesh, teeth: int, damage: ToothDamage, *, gear: str | None = None) -> AnyProfile:
    """The profile of a pair of which one tooth of a gear is damaged: the mesh's own but for damage by its geometry.

    Raises
    ------
    InputError
        If the damage does not fit the mesh's profile, or it is not clear which gear is meant.
    """
    if not damage.flaws:
        return mesh.profile
    if isinstance(mesh.profile, EnergyMethod):
        return mesh.profile.damaged(damage, _member(mesh, mesh.profile.pair.teeth, teeth, gear))
    return mesh.profile.damaged(damage, 0)


def _member(mesh: Mesh, both: tuple[int, int], teeth: int, gear: str | None) -> int:
    """0 for the driving gear, 1 for the driven one."""
    if gear is not None:
        return (mesh.driving, mesh.driven).index(gear)
    if both[0] == both[1]:
        raise InputError(
            f"{mesh.driving!r} and {mesh.driven!r} have {teeth} teeth each; say with gear which is damaged"
        )
    return both.index(teeth)


def _damaged_pair(profile: AnyProfile, x: FloatArray, damage: ToothDamage, teeth: int) -> FloatArray:
    shift = damage.shift_in_passes(teeth)
    end, edge = profile.contact_ratio, max(_LEAST_EDGE, _EDGE_PER_SHIFT * abs(shift))
    x = x - shift * raised_cosine(1 + x / edge) * raised_cosine(1 + (end - x) / edge)
    # The loss fades over `edge`, which slides from before the contact (extent 0) to behind it (extent 1).
    fading = raised_cosine((damage.loss_extent * (end + edge) - x) / edge)
    return pair_stiffness(profile, x) * (1 - damage.stiffness_loss * fading)
