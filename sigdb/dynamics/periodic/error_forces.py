"""Forces that the errors of teeth take from the meshes: ``sum_p k_p e_p`` of ``sum_p k_p (delta - e_p)``."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from sigdb.core import FloatArray
from sigdb.dynamics.damage_forces import Change
from sigdb.dynamics.excitation import HarmonicExcitation, profile_error
from sigdb.transmission import Mesh, pair_stiffness, pairs_in_contact


@dataclass(frozen=True, kw_only=True)
class ErrorForces:
    """Forces of the errors of healthy teeth over the common period.

    Attributes
    ----------
    profile
        (meshes, N) force of the profile errors, N.
    by_tooth
        (n, teeth) force per index error of each tooth of the first mesh's gear over a revolution, N/m.
    """

    profile: FloatArray
    by_tooth: FloatArray

    @classmethod
    def of(cls, meshes: Sequence[Mesh], passes: Sequence[int], teeth: int, samples: int, revolutions: int) -> Self:
        """Return the forces on so many samples of a revolution; ``passes`` are those of each mesh in the period."""
        u = np.arange(samples * revolutions) / (samples * revolutions)
        profile = np.zeros((len(meshes), len(u)))
        for i, (mesh, count) in enumerate(zip(meshes, passes, strict=True)):
            if mesh.profile_error is not None:
                x = pairs_in_contact(mesh.profile, count * u)
                profile[i] = mesh.stiffness * (pair_stiffness(mesh.profile, x) * profile_error(mesh, x)).sum(axis=0)
        a_pass, mesh = samples // teeth, meshes[0]
        window = np.arange(int(np.ceil(mesh.profile.contact_ratio)) * a_pass)
        pair = mesh.stiffness * pair_stiffness(mesh.profile, window / a_pass)
        by_tooth = np.zeros((samples, teeth))
        for tooth in range(teeth):
            by_tooth[(window + tooth * a_pass) % samples, tooth] = pair
        return cls(profile=profile, by_tooth=by_tooth)

    def __call__(
        self, change: Change, stiffness: FloatArray, orders: Sequence[HarmonicExcitation], specimens: bool
    ) -> FloatArray:
        """(meshes, N, columns) forces with the change of a damage, as columns of the excitation.

        ``stiffness`` (meshes, N) is that with the damage. Without ``specimens`` the columns of index errors are left
        out.
        """
        meshes, N = self.profile.shape
        samples, teeth = self.by_tooth.shape[0], self.by_tooth.shape[1] if specimens else 0
        forces = np.zeros((meshes, N, 1 + teeth + 2 * len(orders)))
        forces[:, :, 0] = self.profile
        first = forces[0].reshape(-1, samples, forces.shape[2])
        first[:, change.samples, 0] += change.profile[0]
        first[:, :, 1 : 1 + teeth] = self.by_tooth[:, :teeth]
        for tooth, force in change.errors.items() if specimens else ():
            first[:, change.samples, tooth] += force[0]
        for i, harmonic in enumerate(orders):
            phasor = np.exp(2j * np.pi / samples * harmonic.order * np.arange(N))
            error = harmonic.error[:, None] * phasor
            forces[:, :, 1 + teeth + 2 * i] = stiffness * error.real
            forces[:, :, 2 + teeth + 2 * i] = stiffness * -error.imag
        return forces
