"""Compact storage of many similar signals, as integer steps along a common basis."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from sigdb.core import FloatArray


@dataclass(frozen=True, kw_only=True, eq=False)
class CompactSignals:
    """Signals of n samples as ``step * levels . basis``.

    Attributes
    ----------
    basis
        (r, n) float32, the principal components of all signals that share it, orthonormal, the strongest first.
    levels
        (r, ...) int32, whole steps along each component; most are near 0, so that they pack well.
    step
        Size of a step, in the signals' unit.
    """

    basis: NDArray[np.float32]
    levels: NDArray[np.int32]
    step: float

    @classmethod
    def of(cls, groups: Sequence[FloatArray], *, tolerance: float) -> list[Self]:
        """Groups of signals, which share a basis.

        Parameters
        ----------
        groups
            Arrays (..., n).
        tolerance
            Greatest error of a stored signal (Euclidean norm over the samples), in the signals' unit.
            It is raised to four times float32's precision of the greatest signal where it is less.

        Notes
        -----
        Components are left out while the rest of no signal exceeds tolerance / 2. With r components left, steps of
        ``tolerance / sqrt(r)`` err by at most tolerance / 2 in norm; the two errors are orthogonal.
        """
        rows = [signals.reshape(-1, signals.shape[-1]) for signals in groups]
        greatest = max(float(np.linalg.norm(signals, axis=1).max()) for signals in rows)
        tolerance = max(tolerance, 4 * float(np.finfo(np.float32).eps) * greatest, np.finfo(float).tiny)
        components = np.linalg.eigh(np.sum([signals.T @ signals for signals in rows], axis=0))[1][:, ::-1]
        rest = np.max([_rest(signals @ components) for signals in rows], axis=0)
        rank = max(1, int((rest > tolerance / 2).sum()))
        basis, step = components[:, :rank].T, tolerance / math.sqrt(rank)
        levels = [np.rint(np.moveaxis(signals @ basis.T, -1, 0) / step) for signals in groups]
        stored = np.ascontiguousarray(basis, np.float32)
        return [cls(basis=stored, levels=np.ascontiguousarray(signals, np.int32), step=step) for signals in levels]

    @property
    def samples(self) -> int:
        """Samples of a signal, n."""
        return self.basis.shape[1]

    def expanded(self) -> FloatArray:
        """(..., n) the signals, float64."""
        return np.moveaxis(self.step * self.levels, 0, -1) @ self.basis.astype(float)


def _rest(amplitudes: FloatArray) -> FloatArray:
    """(n,) greatest norm of a row's remainder without the components from each on."""
    return np.asarray(np.sqrt((amplitudes**2)[:, ::-1].cumsum(axis=1)[:, ::-1].max(axis=0)))
