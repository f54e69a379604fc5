"""Forces that the damaged teeth add over a revolution of the damaged gear."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from sigdb.core import FloatArray, IntArray
from sigdb.dynamics.excitation import profile_error
from sigdb.transmission import (
    Mesh,
    ToothDamage,
    damaged_pair_deviation,
    damaged_pair_stiffness,
    pair_stiffness,
    raised_cosine,
    sliding_sense,
)

_SHIFT_MARGIN = 1
"""Passes by which a shifted contact may begin early or end late, at most."""
_TOUCHING_EDGE = 0.5
"""Range of the static force over the needed one, about 1, in which a pair is taken to touch more and more."""
_LEAST_REACH = 2
"""Teeth on each side that are looked at as those that can be in contact together with a tooth, at least."""
_SOUND = ToothDamage()


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
        (inputs, s) force of the profile errors and of the deviation of damaged flanks, N.
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
    static_force: float,
) -> Change:
    """Return the change that damage of a gear makes to its mesh.

    Parameters
    ----------
    mesh, gear, teeth, base_pitch
        The mesh, the damaged gear and its tooth count, and the way along the normal in a tooth pass, m.
    damage
        Damage by tooth number, from 1.
    samples_per_tooth
        Samples in a tooth pass.
    static_force
        Force of the mesh under the steady torque, N: it decides where a tooth whose flank deviates still touches.
    """
    n, inputs = samples_per_tooth * teeth, 3 if any(tooth.friction for tooth in damage.values()) else 1
    around = _SHIFT_MARGIN if any(tooth.phase_shift_deg for tooth in damage.values()) else 0
    width = int(np.ceil(mesh.profile.contact_ratio)) + 2 * around
    places = np.arange(min(width, teeth) * samples_per_tooth)
    x = places / samples_per_tooth - around
    reach = max(_LEAST_REACH, int(np.ceil(mesh.profile.contact_ratio)) - 1)
    pairs = _Pairs(mesh, teeth, gear == mesh.driving, x)
    healthy, relief = pairs.at(_SOUND, 0)[0], profile_error(mesh, x)

    stiffness, profile = np.zeros((inputs, n)), np.zeros((inputs, n))
    errors = {}
    for tooth, kinds in _with_neighbours(damage, teeth, reach).items():
        at = (places + (tooth - 1 - around) * samples_per_tooth) % n
        pair, deviation = pairs.loaded(kinds, static_force)
        forces = np.zeros((inputs, len(x)))
        forces[0] = pair
        if friction := kinds[reach].friction:
            way = (x - mesh.profile.pitch_point) * base_pitch
            forces[1:] = friction * pair * sliding_sense(mesh.profile, x) * np.array([np.ones_like(x), way])
        change = forces.copy()
        change[0] -= healthy
        stiffness[:, at] += change
        profile[:, at] += change * relief + forces * deviation
        errors[tooth] = np.zeros((inputs, n))
        errors[tooth][:, at] = change
    touched = np.flatnonzero(stiffness.any(axis=0) | profile.any(axis=0))
    return Change(
        total=n,
        samples=touched,
        stiffness=stiffness[:, touched],
        errors={tooth: error[:, touched] for tooth, error in errors.items()},
        profile=profile[:, touched],
    )


def _with_neighbours(damage: Mapping[int, ToothDamage], teeth: int, reach: int) -> dict[int, tuple[ToothDamage, ...]]:
    """Return the teeth whose pairs change, each with the damage of the teeth around it, from so many before it on.

    A tooth with too much material takes load from its sound neighbours, which change too.
    """
    steps = range(-reach, reach + 1)
    proud = [tooth for tooth, kind in damage.items() if kind.flank_deviation < 0]
    changed = dict.fromkeys([*damage, *((tooth + step - 1) % teeth + 1 for tooth in proud for step in steps)])
    return {tooth: tuple(damage.get((tooth + step - 1) % teeth + 1, _SOUND) for step in steps) for tooth in changed}


class _Pairs:
    """Pairs of a mesh at places x of one gear's tooth, by the damage of the tooth; each is computed once."""

    def __init__(self, mesh: Mesh, teeth: int, driving: bool, x: FloatArray) -> None:
        self._mesh, self._teeth, self._driving, self._x = mesh, teeth, driving, x
        self._at: dict[tuple[ToothDamage, int], tuple[FloatArray, FloatArray]] = {}
        self._loaded: dict[tuple[ToothDamage, ...], tuple[FloatArray, FloatArray]] = {}

    def at(self, damage: ToothDamage, step: int) -> tuple[FloatArray, FloatArray]:
        """Return stiffness, N/m, and deviation, m, (x,) of the pair of the tooth so many steps behind."""
        if (damage, step) not in self._at:
            profile, x = self._mesh.profile, self._x - step
            if damage == _SOUND:
                stiffness, deviation = pair_stiffness(profile, x), np.zeros_like(x)
            else:
                stiffness, deviation = (
                    function(profile, x, damage, self._teeth, driving=self._driving)
                    for function in (damaged_pair_stiffness, damaged_pair_deviation)
                )
            self._at[damage, step] = self._mesh.stiffness * stiffness, deviation
        return self._at[damage, step]

    def loaded(self, kinds: tuple[ToothDamage, ...], static_force: float) -> tuple[FloatArray, FloatArray]:
        """Return the same of a tooth, with the damage of those around it, without stiffness where it does not touch.

        In slow motion it touches where the mesh yields to it: where the force that presses the others down to its
        deviation, ``sum_i k_i (e - e_i)`` over those that stand out, is less than the static one. The pair's own force
        is 0 where both are equal, so that the width of the edge hardly matters.
        """
        if kinds not in self._loaded:
            reach = len(kinds) // 2
            stiffness, deviation = self.at(kinds[reach], 0)
            if any(self.at(kind, 0)[1].any() for kind in set(kinds)):
                needed = np.zeros_like(deviation)
                for step in (*range(-reach, 0), *range(1, reach + 1)):
                    other, its_deviation = self.at(kinds[reach + step], step)
                    needed += other * np.maximum(deviation - its_deviation, 0)
                share = np.full_like(needed, np.inf)
                np.divide(static_force, needed, out=share, where=needed > 0)
                stiffness = stiffness * raised_cosine((share - 1) / _TOUCHING_EDGE + 0.5)
            self._loaded[kinds] = stiffness, deviation
        return self._loaded[kinds]
