"""Stiffness of the mesh along the contact, pair by pair, healthy and damaged, and deviation of damaged flanks.

With u the pass coordinate (revolutions of the gear times its teeth) and x = u - j + 1 the place of tooth j in its
contact: ``k_j(u) = kp(x') (1 - l_j v(x'))`` with ``x' = x - s_j w(x)``, s_j the phase shift in passes and l_j the
stiffness loss. The windows w and v are one inside the tooth's contact and fall by raised cosines. A raised cosine of
width b has a slope of pi / (2 b); b is so wide that the profile never runs backwards.
"""

from collections.abc import Mapping

import numpy as np

from sigdb.core import FloatArray
from sigdb.transmission.damage import ToothDamage
from sigdb.transmission.mesh.profiles import raised_cosine
from sigdb.transmission.parts.gears import AnyProfile, Mesh

_LEAST_EDGE = 0.1
_EDGE_PER_SHIFT = 1.6
"""Edge width, in passes, for a shift of one pass: above pi / 2, so that ``x - s w(x)`` rises everywhere."""


def pair_stiffness(profile: AnyProfile, x: FloatArray) -> FloatArray:
    """Stiffness of one tooth pair at x passes after first contact, for a mesh of unit mean stiffness.

    The sum over the pairs in contact has mean 1: the profile's area is 1.
    """
    stiffness, touching = np.zeros(x.shape), (x > 0) & (x < profile.contact_ratio)
    stiffness[touching] = profile.pair_stiffness(x[touching])
    return stiffness


def place_in_contact(u: FloatArray, teeth: int) -> FloatArray:
    """(teeth, n) place x of each tooth in its contact, in passes from -1 to teeth - 1; tooth j is row j - 1."""
    return (u - np.arange(teeth)[:, None] + 1) % teeth - 1


def pairs_in_contact(profile: AnyProfile, u: FloatArray) -> FloatArray:
    """(pairs, n) places x of the pairs of a healthy mesh that can be in contact, all its teeth being alike."""
    return u % 1 + np.arange(int(np.ceil(profile.contact_ratio)))[:, None]


def tooth_stiffness(
    mesh: Mesh, teeth: int, u: FloatArray, damage: Mapping[int, ToothDamage], *, driving: bool | None = None
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
    driving
        Whether the gear is the driving one; needed only for damage of its geometry where both have as many teeth.

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
    for tooth, harm in damage.items():
        stiffness[tooth - 1] = damaged_pair_stiffness(mesh.profile, rows[tooth - 1], harm, teeth, driving=driving)
    return mesh.stiffness * stiffness


def damaged_profile(profile: AnyProfile, damage: ToothDamage, teeth: int, *, driving: bool | None = None) -> AnyProfile:
    """The profile of a pair with a damaged tooth: another only where its geometry is damaged.

    Raises
    ------
    InputError
        If the profile knows no geometry, the damage does not fit it, or it is not clear whose tooth is meant.
    """
    return profile.damaged(damage, teeth, driving) if damage.flaws else profile


def damaged_pair_stiffness(
    profile: AnyProfile, x: FloatArray, damage: ToothDamage, teeth: int, *, driving: bool | None = None
) -> FloatArray:
    """Stiffness of a pair with a damaged tooth of a gear, at x passes after first contact, as of `pair_stiffness`.

    Away from the contact by a pass or more it is zero, as that of a healthy pair. ``driving`` is as of
    `tooth_stiffness`.
    """
    profile = damaged_profile(profile, damage, teeth, driving=driving)
    x, edge = _shifted(profile, x, damage, teeth)
    # The loss fades over `edge`, which slides from before the contact (extent 0) to behind it (extent 1).
    fading = raised_cosine((damage.loss_extent * (profile.contact_ratio + edge) - x) / edge)
    return pair_stiffness(profile, x) * (1 - damage.stiffness_loss * fading)


def damaged_pair_deviation(
    profile: AnyProfile, x: FloatArray, damage: ToothDamage, teeth: int, *, driving: bool | None = None
) -> FloatArray:
    """Deviation of a pair with a damaged tooth from contact of its flanks along the normal, at x passes, m.

    It is ``flank_deviation`` within its window, and what the damage of the geometry leaves between the flanks. Positive
    is apart: the pair's force is its stiffness times the compression less the deviation. Arguments are as of
    `damaged_pair_stiffness`.
    """
    profile = damaged_profile(profile, damage, teeth, driving=driving)
    x, _ = _shifted(profile, x, damage, teeth)
    deviation = profile.separation(x)
    if damage.flank_deviation:
        # Its edges have their middle at its ends, so that the window's area is its extent.
        away = np.abs(x - damage.deviation_place * profile.contact_ratio)
        half = damage.deviation_extent * profile.contact_ratio / 2
        deviation = deviation + damage.flank_deviation * raised_cosine((half - away) / _LEAST_EDGE + 0.5)
    return deviation


def _shifted(profile: AnyProfile, x: FloatArray, damage: ToothDamage, teeth: int) -> tuple[FloatArray, float]:
    """Places in the contact of a pair with a phase shift, and the width of its edges in passes."""
    shift = damage.shift_in_passes(teeth)
    end, edge = profile.contact_ratio, max(_LEAST_EDGE, _EDGE_PER_SHIFT * abs(shift))
    if shift:
        x = x - shift * raised_cosine(1 + x / edge) * raised_cosine(1 + (end - x) / edge)
    return x, edge


def sliding_sense(profile: AnyProfile, x: FloatArray) -> FloatArray:
    """From -1 before the pitch point to 1 after it, within a tenth of a pass, at x passes after first contact."""
    return 2 * raised_cosine((x - profile.pitch_point) / _LEAST_EDGE + 0.5) - 1
