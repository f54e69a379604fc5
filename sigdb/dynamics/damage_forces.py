"""Forces that the damaged teeth add over a revolution of the damaged gear."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from sigdb.core import FloatArray, IntArray
from sigdb.dynamics.excitation import profile_error
from sigdb.transmission import Mesh, ToothDamage, damaged_pair_stiffness, pair_stiffness, sliding_sense

_SHIFT_MARGIN = 1
"""Passes by which a shifted contact may begin early or end late, at most."""


@dataclass(frozen=True, kw_only=True)
class Change:
    """Forces that damage adds to those of the healthy mesh: ``f_q = sum_p errors_qp e_p - stiffness_q delta``.

    Inputs q are the mesh's normal and, where a damaged tooth has friction, its two friction vectors.

    Attributes
    ----------
    total
        Samples in the revolution.
    samples
        (s,) samples of the revolution that it touches, rising.
    stiffness
        (inputs, s) N/m.
    errors
        (inputs, teeth, s) force per index error of a tooth, N/m.
    profile
        (inputs, s) force of the profile errors, N.
    """

    total: int
    samples: IntArray
    stiffness: FloatArray
    errors: dict[int, FloatArray]
    profile: FloatArray

    def every(self, step: int) -> "Change":
        """The same on a grid that is coarser by a factor."""
        kept = self.samples % step == 0
        return Change(
            total=self.total // step,
            samples=self.samples[kept] // step,
            stiffness=self.stiffness[:, kept],
            errors={tooth: error[:, kept] for tooth, error in self.errors.items()},
            profile=self.profile[:, kept],
        )


def damage_change(
    mesh: Mesh,
    gear: str,
    teeth: int,
    base_pitch: float,
    damage: Mapping[int, ToothDamage],
    samples_per_tooth: int,
) -> Change:
    """Return the change that damage of a gear by tooth number makes to its mesh, with so many samples a tooth pass."""
    n, inputs = samples_per_tooth * teeth, 3 if any(tooth.friction for tooth in damage.values()) else 1
    around = _SHIFT_MARGIN if any(tooth.phase_shift_deg for tooth in damage.values()) else 0
    width = int(np.ceil(mesh.profile.contact_ratio)) + 2 * around
    places = np.arange(min(width, teeth) * samples_per_tooth)
    x = places / samples_per_tooth - around
    healthy = mesh.stiffness * pair_stiffness(mesh.profile, x)
    relief = profile_error(mesh, x)

    stiffness, profile = np.zeros((inputs, n)), np.zeros((inputs, n))
    errors = {}
    driving = gear == mesh.driving
    added = {kind: _added(mesh, base_pitch, kind, teeth, driving, x, healthy, inputs) for kind in set(damage.values())}
    for tooth, harm in damage.items():
        at = (places + (tooth - 1 - around) * samples_per_tooth) % n
        stiffness[:, at] += added[harm]
        profile[:, at] += added[harm] * relief
        errors[tooth] = np.zeros((inputs, n))
        errors[tooth][:, at] = added[harm]
    touched = np.flatnonzero(stiffness.any(axis=0))
    return Change(
        total=n,
        samples=touched,
        stiffness=stiffness[:, touched],
        errors={tooth: error[:, touched] for tooth, error in errors.items()},
        profile=profile[:, touched],
    )


def _added(
    mesh: Mesh,
    base_pitch: float,
    damage: ToothDamage,
    teeth: int,
    driving: bool,
    x: FloatArray,
    healthy: FloatArray,
    inputs: int,
) -> FloatArray:
    """Return the stiffness (inputs, x) that a damaged tooth adds to its pair, and that of its friction."""
    pair = mesh.stiffness * damaged_pair_stiffness(mesh.profile, x, damage, teeth, driving=driving)
    added = np.zeros((inputs, len(x)))
    added[0] = pair - healthy
    if damage.friction:
        way = (x - mesh.profile.pitch_point) * base_pitch
        added[1:] = damage.friction * pair * sliding_sense(mesh.profile, x) * np.array([np.ones_like(x), way])
    return added
