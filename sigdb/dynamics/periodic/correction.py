"""The damaged rig as a small correction of the healthy one."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from sigdb.core import ComplexArray, FloatArray, IntArray
from sigdb.dynamics.damage_forces import Change
from sigdb.dynamics.excitation import HarmonicExcitation

Columns = IntArray | slice
"""Columns of the excitation for which a response is computed."""


@dataclass(frozen=True, kw_only=True)
class LocalForces:
    """Forces ``f_q = g_q - D_q o delta`` on the s samples of a period that damage touches, for several excitations.

    Attributes
    ----------
    total
        Samples in the period.
    samples
        (s,) those touched.
    stiffness
        (inputs, s) D, N/m.
    errors
        (inputs, s, columns) g, N.
    """

    total: int
    samples: IntArray
    stiffness: FloatArray
    errors: FloatArray

    def __call__(self, delta: FloatArray) -> FloatArray:
        """(inputs, s, columns) forces where the compression is delta (s, columns)."""
        return self.errors - self.stiffness[:, :, None] * delta

    def everywhere(self, force: FloatArray) -> FloatArray:
        """(inputs, total, columns) forces (inputs, s, columns), zero where damage touches nothing."""
        whole = np.zeros((len(force), self.total, force.shape[2]))
        whole[:, self.samples] = force
        return whole


def local_forces(
    change: Change, teeth: int, revolutions: int, orders: Sequence[HarmonicExcitation], columns: Columns
) -> LocalForces:
    """Return the forces of a change over some revolutions, for some columns of the excitation."""
    samples = (np.arange(revolutions)[:, None] * change.total + change.samples).ravel()
    g = np.zeros((len(change.stiffness), revolutions, len(change.samples), 1 + teeth + 2 * len(orders)))
    g[..., 0] = change.profile[:, None]
    for tooth, error_force in change.errors.items():
        g[..., tooth] = error_force[:, None]
    errors = g.reshape(len(g), len(samples), g.shape[-1])
    stiffness = np.tile(change.stiffness, revolutions)
    for i, harmonic in enumerate(orders):
        error = harmonic.error[0] * np.exp(2j * np.pi / change.total * harmonic.order * samples)
        errors[:, :, 1 + teeth + 2 * i] = stiffness * error.real
        errors[:, :, 2 + teeth + 2 * i] = stiffness * -error.imag
    return LocalForces(
        total=change.total * revolutions, samples=samples, stiffness=stiffness, errors=errors[:, :, columns]
    )


def inputs_of(forces: LocalForces, meshes: int) -> list[int]:
    """Inputs of the rig that local forces act on: the first mesh's normal, its friction vectors."""
    return [0, meshes, meshes + 1][: len(forces.stiffness)]


class Correction(Protocol):
    """The response of a rig with damage: its local forces (inputs, s, columns), and all rows of the response."""

    @property
    def forces(self) -> LocalForces:
        """Forces of the change."""
        ...

    def solved(self) -> tuple[FloatArray, FloatArray]:
        """Under all that excites it."""
        ...

    def followed(self, force: ComplexArray) -> tuple[FloatArray, FloatArray]:
        """Under further forces alone, a spectrum (inputs of the rig, K, columns)."""
        ...


class LocalCorrection:
    """Correction by the healthy rig's response: ``(I + sum_q P_q,SS D_q) delta_S = R_S + sum_q P_q,SS g_q``.

    Parameters
    ----------
    forces
        Forces of the change.
    healthy
        (rows, columns) response of the healthy rig; the first rows are the compression at each sample of the period.
    influences
        For each input (rows, s) response of the healthy rig to a unit force at each sample touched.
    respond
        (rows, columns) of the healthy rig under a spectrum of forces.
    """

    def __init__(
        self,
        forces: LocalForces,
        healthy: FloatArray,
        influences: Sequence[FloatArray],
        respond: Callable[[ComplexArray], FloatArray],
    ) -> None:
        self.forces, self._healthy, self._influences, self._respond = forces, healthy, influences, respond
        self._within = [P[forces.samples] for P in influences]
        self._local = sum(P * D for P, D in zip(self._within, forces.stiffness, strict=True))
        self._local.flat[:: len(self._local) + 1] += 1

    def solved(self) -> tuple[FloatArray, FloatArray]:
        """Under all that excites it."""
        right = self._healthy[self.forces.samples]
        for P, g in zip(self._within, self.forces.errors, strict=True):
            right = right + P @ g
        return self._with(self._healthy, self.forces(np.linalg.solve(self._local, right)))

    def followed(self, force: ComplexArray) -> tuple[FloatArray, FloatArray]:
        """Under further forces alone."""
        healthy = self._respond(force)
        delta = np.linalg.solve(self._local, healthy[self.forces.samples])
        return self._with(healthy, -self.forces.stiffness[:, :, None] * delta)

    def _with(self, healthy: FloatArray, force: FloatArray) -> tuple[FloatArray, FloatArray]:
        rows = self._influences[0] @ force[0]
        for P, f in zip(self._influences[1:], force[1:], strict=True):
            rows += P @ f
        rows += healthy
        return force, rows


def resampled(delta: FloatArray, factor: int) -> FloatArray:
    """A periodic function (N, columns) on a grid that is finer by a factor, by its harmonics."""
    return np.fft.irfft(np.fft.rfft(delta, axis=0), n=factor * len(delta), axis=0) * factor
