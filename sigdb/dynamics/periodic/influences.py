"""Influences: responses of the healthy rig to a unit force at a sample of the period, kept for later cases."""

from collections import OrderedDict
from math import gcd
from threading import Lock

import numpy as np

from sigdb.core import ComplexArray, FloatArray, IntArray
from sigdb.dynamics.period import Period
from sigdb.dynamics.periodic.hill import Healthy

_GATHERED = 3
"""Sets of samples whose influence is kept: those of one case, which the next case often shares."""


def sampled_rows(spectrum: ComplexArray, meshes: int, period: Period) -> FloatArray:
    """Return the rows of a spectrum of outputs (outputs, K, columns).

    Returns
    -------
    ndarray, (rows, columns)
        Compressions of each mesh on the grid of the period, then the samples of each sensor, averaged over the
        revolutions.
    """
    columns = spectrum.shape[2]
    compressions, sensors = period.sampled(spectrum[:meshes]), period.averaged(spectrum[meshes:])
    return np.concatenate([compressions.reshape(-1, columns), sensors.reshape(-1, columns)])


class Influences:
    """Influences of one healthy rig, computed on demand and shared by all threads that solve cases of it.

    The arrays that are returned are kept and read-only.

    Parameters
    ----------
    solver
        The healthy rig, solved.
    meshes
        Number of meshes.
    period
        The common period on the grid of the solution.
    """

    def __init__(self, solver: Healthy, meshes: int, period: Period) -> None:
        self._solver, self._meshes, self._period = solver, meshes, period
        self._lock = Lock()
        self._first: dict[int, FloatArray] = {}
        self._gathered: OrderedDict[tuple[bytes, int], FloatArray] = OrderedDict()

    def at(self, samples: IntArray, source: int) -> FloatArray:
        """Return the response (rows, s) to a unit force on an input at each of the samples (s,) of the period."""
        key = samples.tobytes(), source
        with self._lock:
            if key in self._gathered:
                self._gathered.move_to_end(key)
                return self._gathered[key]
            if source not in self._first:
                self._first[source] = self._at_first_samples(source)
            first = self._first[source]
        gathered = self._gather(first, samples)
        gathered.setflags(write=False)
        with self._lock:
            self._gathered[key] = gathered
            while len(self._gathered) > _GATHERED:
                self._gathered.popitem(last=False)
        return gathered

    def _at_first_samples(self, source: int) -> FloatArray:
        """(rows, L) response to a unit force on an input at each of the first L samples; others are turns of it."""
        N, L = self._period.samples, self._period.samples // gcd(*self._period.passes)
        force = np.zeros((self._solver.transfer.shape[2], self._period.harmonics, L), complex)
        k = np.arange((N + 1) // 2)
        force[source, : len(k)] = np.exp(-2j * np.pi / N * k[:, None] * np.arange(L))
        return sampled_rows(self._solver.respond(force), self._meshes, self._period)

    def _gather(self, first: FloatArray, samples: IntArray) -> FloatArray:
        """(rows, s) columns of the first influences, turned to the samples."""
        N, m, finer = self._period.samples, self._meshes, self._period.refinement
        n, L = N // (self._period.revolutions * finer), first.shape[1]
        gathered = np.empty((len(first), len(samples)))
        blocks = samples // L
        for block in np.unique(blocks):
            here = np.flatnonzero(blocks == block)
            column = first[:, samples[here] % L]
            for rows, length, shift in ((slice(m * N), N, L), (slice(m * N, None), n, L // finer)):
                turned = np.roll(column[rows].reshape(-1, length, len(here)), block * shift, axis=1)
                gathered[rows, here] = turned.reshape(-1, len(here))
        return gathered
