"""Truncation: the part that a solution in a finite number of harmonics leaves out.

The harmonics beyond it, up to twice as high, respond to the forces that the solution itself predicts there. By the
varying mesh stiffness they act back on the harmonics that are kept. That is the first term of a series of corrections.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sigdb.core import ComplexArray, FloatArray
from sigdb.dynamics.period import Period, over_the_period
from sigdb.dynamics.periodic.correction import LocalForces, inputs_of

GRID = 2
"""Refinement, relative to the solution's grid, of the grid on which forces are formed."""


def twice(period: Period) -> Period:
    """The period on a grid twice as fine."""
    return replace(period, samples=2 * period.samples, refinement=2 * period.refinement)


@dataclass(frozen=True, kw_only=True)
class Truncation:
    """The harmonics beyond a solution.

    Attributes
    ----------
    period
        The common period on the grid of the solution.
    transfer
        (K', meshes, inputs) of the mean system at the harmonics of a grid twice as fine, zero where they are kept.
    stiffness, errors
        (meshes, F) healthy mesh stiffness less its mean, N/m, and force of the profile errors, N, on the finer grid.
    """

    period: Period
    transfer: ComplexArray
    stiffness: FloatArray
    errors: FloatArray

    def acting_back(self, delta: FloatArray, local: LocalForces | None = None) -> ComplexArray:
        """(inputs, K, 1) spectrum of forces on the harmonics kept, where the compressions are delta (meshes, F)."""
        beyond = twice(self.period)
        force = self._forces(delta, local)
        force[: len(delta)] += self.errors
        if local is not None:
            force[inputs_of(local, len(delta))] += local.everywhere(local.errors)[:, :, 0]
        more = np.einsum("kij,jk->ik", self.transfer, beyond.spectrum(force[:, :, None])[:, :, 0])
        fine = np.fft.irfft(more, n=delta.shape[1], axis=1) * (delta.shape[1] / beyond.samples)
        return self.period.spectrum(self._forces(fine, local)[:, :, None])

    def _forces(self, delta: FloatArray, local: LocalForces | None) -> FloatArray:
        force = np.zeros((self.transfer.shape[2], delta.shape[1]))
        force[: len(delta)] = -self.stiffness * delta
        if local is not None:
            against = local.stiffness * delta[0, local.samples]
            force[inputs_of(local, len(delta))] -= local.everywhere(against[:, :, None])[:, :, 0]
        return force


def truncation(
    transfer: ComplexArray, over_a_pass: Sequence[tuple[FloatArray, FloatArray]], period: Period
) -> Truncation:
    """Prepare the estimate.

    Parameters
    ----------
    transfer
        (K', meshes, inputs) at the harmonics of :func:`twice` the period.
    over_a_pass
        For each mesh its stiffness less its mean, and the force of its profile errors, over one tooth pass.
    period
        The common period on the grid of the solution.
    """
    F = GRID * period.samples
    transfer = transfer.copy()
    transfer[: (period.samples + 1) // 2] = 0
    stiffness, errors = (
        np.array([over_the_period(curve[i], count, F) for curve, count in zip(over_a_pass, period.passes, strict=True)])
        for i in range(2)
    )
    return Truncation(period=period, transfer=transfer, stiffness=stiffness, errors=errors)
