"""Rigs whose meshes repeat so late that the healthy rig is too large to be factored: solved by iteration.

GMRES solves Hill's equations. Products with the mesh stiffness are formed on a finer grid, so without aliasing. Each
mesh alone repeats after a tooth pass and is factored in small blocks as the preconditioner. Only the effect of the
meshes on each other is left to iterate.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse.linalg import LinearOperator, gmres

from sigdb.core import BoolArray, ComplexArray, FloatArray, IntArray, SigdbError
from sigdb.dynamics.period import Period, over_the_period
from sigdb.dynamics.periodic.correction import LocalForces, inputs_of
from sigdb.dynamics.periodic.hill import at_harmonics, stiffness_matrix

_RESIDUAL = 1e-10
_PADDING = 2
"""Products are formed on a grid this much finer."""


@dataclass(frozen=True, kw_only=True)
class Alone:
    """A mesh without the others: inverse blocks (blocks, L, L), their harmonics (blocks, L), and those kept."""

    harmonics: IntArray
    kept: BoolArray
    inverses: ComplexArray

    def solve(self, spectrum: ComplexArray) -> ComplexArray:
        """Compression (K,) of the varying mesh, where the mean system has this one."""
        mean = np.where(self.kept, at_harmonics(spectrum, self.harmonics), 0)
        solution = np.matmul(self.inverses, mean[:, :, None])[:, :, 0]
        solved = np.zeros_like(spectrum)
        right, left = self.kept & (self.harmonics >= 0), self.kept & (self.harmonics < 0)
        solved[-self.harmonics[left]] = solution[left].conj()
        solved[self.harmonics[right]] = solution[right]
        return solved


@dataclass(frozen=True, kw_only=True)
class LongPeriod:
    """The healthy rig, and the damaged one, by iteration.

    Attributes
    ----------
    transfer
        See :class:`~sigdb.dynamics.periodic.hill.Healthy`.
    period
        The common period.
    kappa
        (meshes, F) stiffness less its mean on a padded grid of the period, N/m.
    alone
        Each mesh without the others.
    """

    transfer: ComplexArray
    period: Period
    kappa: FloatArray
    alone: tuple[Alone, ...]

    def respond(
        self, force: ComplexArray, free: ComplexArray | None = None, change: LocalForces | None = None
    ) -> ComplexArray:
        """Outputs of the healthy rig under forces, or of one with a change; see ``Healthy``.

        Raises
        ------
        SigdbError
            If the iteration does not converge.
        """
        outputs = np.einsum("koi,ikc->okc", self.transfer, force, optimize=True)
        if free is not None:
            outputs += free
        meshes = len(self.kappa)
        for column in range(outputs.shape[2]):
            delta = self._solved(outputs[:meshes, :, column], change)
            outputs[:, :, column] -= np.einsum("koi,ik->ok", self.transfer, self._restoring(delta, change))
        return outputs

    def _restoring(self, delta: ComplexArray, change: LocalForces | None) -> ComplexArray:
        """(inputs, K) forces of the varying stiffness against compressions (meshes, K)."""
        grid = replace(self.period, samples=self.kappa.shape[1])
        fine = np.fft.irfft(delta, n=grid.samples, axis=1) * (grid.samples / self.period.samples)
        force = np.zeros((self.transfer.shape[2], self.period.harmonics), complex)
        force[: len(delta)] = self.period.spectrum((self.kappa * fine)[:, :, None])[:, :, 0]
        if change is not None:
            inputs = inputs_of(change, len(delta))
            sampled = self.period.sampled(delta[0, :, None])[change.samples]
            against = change.everywhere(change.stiffness[:, :, None] * sampled)
            force[inputs] += self.period.spectrum(against)[:, :, 0]
        return force

    def _solved(self, mean: ComplexArray, change: LocalForces | None) -> ComplexArray:
        """(meshes, K) compressions, where the mean system has these."""
        shape, meshes = mean.shape, len(mean)
        if not mean.any():
            return np.zeros_like(mean)
        scale = np.abs(mean).max()

        def packed(spectrum: ComplexArray) -> FloatArray:
            return spectrum.ravel().view(float)

        def equation(x: FloatArray) -> FloatArray:
            delta = x.view(complex).reshape(shape)
            answer = np.einsum("koi,ik->ok", self.transfer[:, :meshes], self._restoring(delta, change))
            return packed(delta + answer)

        def alone(x: FloatArray) -> FloatArray:
            delta = x.view(complex).reshape(shape)
            return packed(np.array([mesh.solve(part) for mesh, part in zip(self.alone, delta, strict=True)]))

        size = 2 * mean.size
        operator, inverse = (LinearOperator((size, size), matvec=product, dtype=float) for product in (equation, alone))
        solution, info = gmres(
            operator, packed(mean / scale), M=inverse, rtol=_RESIDUAL, atol=0.0, restart=60, maxiter=10
        )
        if info:
            raise SigdbError("the periodic solution of the meshes does not converge; the rig may be unstable")
        return scale * solution.view(complex).reshape(shape)


def long_period(transfer: ComplexArray, kappa: Sequence[FloatArray], period: Period) -> LongPeriod:
    """Prepare the iteration; arguments as of :func:`~sigdb.dynamics.periodic.hill.hill`."""
    F = _PADDING * period.samples
    return LongPeriod(
        transfer=transfer,
        period=period,
        kappa=np.array([over_the_period(curve, count, F) for curve, count in zip(kappa, period.passes, strict=True)]),
        alone=tuple(
            _alone(transfer[:, i, i], curve, count, period.samples)
            for i, (curve, count) in enumerate(zip(kappa, period.passes, strict=True))
        ),
    )


def _alone(transfer: ComplexArray, kappa: FloatArray, passes: int, N: int) -> Alone:
    """Blocks of one mesh, whose passes need not divide the samples."""
    j = np.arange(-(N // (2 * passes)) - 1, N // (2 * passes) + 1)
    k = np.arange(passes // 2 + 1)[:, None] + passes * j
    kept = 2 * np.abs(k) < N
    k = np.where(kept, k, 0)
    H = np.where(kept, at_harmonics(transfer, k), 0)
    inverses = np.linalg.inv(np.eye(len(j)) + H[:, :, None] * stiffness_matrix(kappa, 1, len(j)))
    return Alone(harmonics=k, kept=kept, inverses=inverses)


class IteratedCorrection:
    """A :class:`~sigdb.dynamics.periodic.correction.Correction` of a rig with a long period.

    Parameters
    ----------
    rig
        The rig.
    forces
        Forces of the change.
    excitation
        Spectra ``free`` and ``force`` of what excites the rig, for the columns to be solved.
    rows
        Function of a spectrum of outputs that returns its rows.
    """

    def __init__(
        self,
        rig: LongPeriod,
        forces: LocalForces,
        excitation: tuple[ComplexArray, ComplexArray],
        rows: Callable[[ComplexArray], FloatArray],
    ) -> None:
        self._rig, self.forces, self._excitation, self._rows = rig, forces, excitation, rows

    def solved(self) -> tuple[FloatArray, FloatArray]:
        """Under all that excites it."""
        free, force = self._excitation
        force = force.copy()
        errors = self.forces.everywhere(self.forces.errors)
        force[inputs_of(self.forces, len(self._rig.kappa))] += self._rig.period.spectrum(errors)
        rows = self._rows(self._rig.respond(force, free, self.forces))
        return self.forces(rows[self.forces.samples]), rows

    def followed(self, force: ComplexArray) -> tuple[FloatArray, FloatArray]:
        """Under further forces, without errors."""
        rows = self._rows(self._rig.respond(force, None, self.forces))
        return -self.forces.stiffness[:, :, None] * rows[self.forces.samples], rows
