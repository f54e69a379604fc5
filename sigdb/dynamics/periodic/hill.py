"""The healthy rig under periodic forces: Hill's equations in the harmonics of the common period.

The compressions of the meshes obey ``delta_k + H_k sum_k' kappa_(k-k') delta_k' = delta_0k + H_k g_k``, with H_k the
transfer function at harmonic k and kappa_k the Fourier coefficients of the healthy mesh stiffness less its mean. They
are zero except at multiples of each mesh's tooth passes. So only harmonics that differ by a multiple of ``g``, the
greatest common divisor of all passes, are coupled. The system falls apart into g blocks, conjugate in pairs, each
factored once. Products hold all harmonics that are kept and none by aliasing.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import gcd
from typing import Protocol

import numpy as np
from scipy.linalg import lu_factor, lu_solve, toeplitz

from sigdb.core import ComplexArray, FloatArray, IntArray
from sigdb.dynamics.period import Period


class Healthy(Protocol):
    """A solved healthy rig, by any method.

    Attributes
    ----------
    transfer
        (K, outputs, inputs) transfer function of the mean system at the harmonics k = 0 ... K - 1 of the period; meshes
        come first among outputs and inputs. Zero at the Nyquist harmonic, which holds no phase.
    """

    @property
    def transfer(self) -> ComplexArray: ...

    def respond(self, force: ComplexArray, free: ComplexArray | None = None) -> ComplexArray:
        """Outputs of the healthy rig under forces.

        Parameters
        ----------
        force
            (inputs, K, columns) spectrum of forces on the inputs.
        free
            (outputs, K, columns) spectrum of the outputs that other forces cause with the mean mesh stiffness.

        Returns
        -------
        ndarray, (outputs, K, columns)
            Spectrum of all outputs.
        """
        ...


@dataclass(frozen=True, kw_only=True)
class Hill:
    """The healthy rig, factored.

    Attributes
    ----------
    transfer
        See :class:`Healthy`.
    harmonics
        (blocks, L) harmonics of each block, from negative to positive; one of each conjugate pair of blocks.
    stiffness
        (meshes, L, L) Toeplitz matrices of kappa, in N/m, the same for all blocks.
    factors
        LU factors of each block.
    """

    transfer: ComplexArray
    harmonics: IntArray
    stiffness: ComplexArray
    factors: tuple[tuple[ComplexArray, IntArray], ...]

    def respond(self, force: ComplexArray, free: ComplexArray | None = None) -> ComplexArray:
        """Outputs of the healthy rig under forces; see :class:`Healthy`."""
        K, outputs, _ = self.transfer.shape
        meshes, columns = len(self.stiffness), force.shape[2]
        response = np.zeros((outputs, K, columns), complex)
        for k, (lu, pivots) in zip(self.harmonics, self.factors, strict=True):
            H = at_harmonics(self.transfer, k)
            out = np.matmul(H, at_harmonics(force.swapaxes(0, 1), k))  # (L, outputs, columns)
            if free is not None:
                out += at_harmonics(free.swapaxes(0, 1), k)
            if not out.any():
                continue
            # SciPy's wrapper counts the pivots from 1 in place while it solves: threads must not share them.
            delta = lu_solve(
                (lu, pivots.copy()), out[:, :meshes].swapaxes(0, 1).reshape(-1, columns), check_finite=False
            )
            kappa_delta = self.stiffness @ delta.reshape(meshes, len(k), columns)
            out -= np.matmul(H[:, :, :meshes], kappa_delta.swapaxes(0, 1))
            right, left = k >= 0, k < 0
            response[:, k[right]] = out[right].swapaxes(0, 1)
            response[:, -k[left]] = out[left].swapaxes(0, 1).conj()
        return response


def entries(period: Period) -> int:
    """Return the number of complex numbers in the blocks of a period, which factoring holds in memory."""
    g = gcd(*period.passes)
    return (g // 2 + 1) * (len(period.passes) * period.samples // g) ** 2


def hill(transfer: ComplexArray, kappa: Sequence[FloatArray], period: Period) -> Hill:
    """Factor the healthy rig.

    Parameters
    ----------
    transfer
        (K, outputs, inputs) transfer function at the harmonics of the period.
    kappa
        For each mesh (F,) samples over one tooth pass of its stiffness less its mean, fine enough to hold no alias.
    period
        The common period.
    """
    passes, total = period.passes, period.samples
    g, meshes = gcd(*passes), len(passes)
    L = total // g
    stiffness = np.array([stiffness_matrix(curve, count // g, L) for curve, count in zip(kappa, passes, strict=True)])
    steps = g * np.arange(L)
    harmonics = np.array([np.sort((b + steps + total // 2) % total - total // 2) for b in range(g // 2 + 1)])
    factors = []
    for k in harmonics:
        H = at_harmonics(transfer, k)[:, :meshes, :meshes]
        block = np.einsum("kil,lkj->iklj", H, stiffness, optimize=True).reshape(meshes * L, meshes * L)
        block[np.diag_indices_from(block)] += 1
        factors.append(lu_factor(block, overwrite_a=True, check_finite=False))
    return Hill(transfer=transfer, harmonics=harmonics, stiffness=stiffness, factors=tuple(factors))


def stiffness_matrix(kappa: FloatArray, step: int, L: int) -> ComplexArray:
    """(L, L) coefficients kappa_(k-k') of harmonics in a block, where the stiffness has every ``step``-th of them."""
    coefficients = np.fft.rfft(kappa) / len(kappa)
    column = np.zeros(L, complex)
    places = column[::step]
    count = min(len(places), len(coefficients))
    places[:count] = coefficients[:count]
    return toeplitz(column, column.conj())


def at_harmonics(spectrum: ComplexArray, k: IntArray) -> ComplexArray:
    """A one-sided spectrum, harmonics first, at harmonics of either sign."""
    values = spectrum[np.abs(k)]
    values[k < 0] = values[k < 0].conj()
    return values
