"""The periodic response of a rig by scipy's DOP853, from the same modal equations as sigdb's solvers.

``z' = poles z + b f`` with ``f = g(t) - (k(t) - kbar) delta`` and ``delta = delta_0 + Re(c z)``, for one of each
conjugate pair, from rest. All responses that a template holds are marched side by side as the columns of one state:
the gear without errors, and that to each tooth's index error. Mesh stiffness and error forces come from the tables that
sigdb's own march uses; the right-hand side is a handful of array operations.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from sigdb.dynamics import PeriodicRig
from sigdb.dynamics.march.marcher import mesh_tables
from sigdb.dynamics.period import Period
from sigdb.transmission import ToothDamage, Transmission

_FINER = 4
"""Samples of the last revolution for each one that is compared."""


@dataclass(frozen=True, kw_only=True)
class ModalEquations:
    """The equations of a rig of one mesh with damage, for ``columns`` excitations: no errors, then each tooth's."""

    rig: Transmission
    prepared: PeriodicRig
    damage: Mapping[int, ToothDamage]
    columns: int

    @cached_property
    def _upper(self) -> NDArray:
        return self.prepared.system.poles.imag >= 0

    @cached_property
    def _c(self) -> NDArray:
        """(outputs, m), for the real output of a conjugate pair whose second half is left out."""
        poles = self.prepared.system.poles[self._upper]
        return np.where(poles.imag > 0, 2.0, 1.0) * self.prepared.system.outputs[:, self._upper]

    @cached_property
    def _static(self) -> NDArray:
        """(outputs, columns) under the steady torque, in the first column."""
        system = self.prepared.system
        poles, b = system.poles[self._upper], system.inputs[self._upper, 1]
        static = np.zeros((len(self._c), self.columns))
        static[:, 0] = (self._c @ (b / -poles)).real + system.direct[:, 1]
        return static

    @cached_property
    def _tables(self) -> NDArray:
        """(T + 1, 1 + columns) stiffness less its mean, and the error force of each column, over a revolution."""
        unit = np.vstack([np.zeros(self.prepared.teeth), np.eye(self.prepared.teeth)])[: self.columns]
        made = [
            mesh_tables(self.rig, self.prepared.gear, self.damage, error, self.prepared.system).forces[0]
            for error in unit
        ]
        error = np.array([one[1] for one in made])
        error[1:] -= error[0]
        return np.ascontiguousarray(np.vstack([made[0][0] - self.prepared.meshes[0].stiffness, error]).T)

    def force(self, t: float, delta: NDArray) -> NDArray:
        """(columns,) force of the mesh beyond that of its mean stiffness."""
        place = t / self.prepared.seconds % 1.0 * (len(self._tables) - 1)
        left = int(place)
        lower = self._tables[left]
        now = lower + (place - left) * (self._tables[left + 1] - lower)
        return now[1:] - now[0] * delta

    def solve(self, revolutions: int, tolerance: float, size: NDArray, every: bool = False) -> NDArray:
        """(revolutions, sensors, n, columns) averages of the last revolution, or of every one.

        The tolerance of a modal coordinate is what changes no output by more than that fraction of its size (outputs,
        columns).
        """
        system = self.prepared.system
        poles, b, c = system.poles[self._upper], system.inputs[self._upper, 0], self._c[0]
        static, columns, period = self._static[0], self.columns, self.prepared.seconds

        def rate(t: float, y: NDArray) -> NDArray:
            z = y.view(complex).reshape(columns, -1)
            f = self.force(t, static + (z @ c).real)
            return (poles * z + f[:, None] * b).view(float).ravel()

        allowed = tolerance * (size[:, :, None] / np.abs(self._c)[:, None]).min(axis=0)
        n = _FINER * self.prepared.samples
        first = 0 if every else revolutions - 1
        t = (first + np.arange((revolutions - first) * n) / n) * period
        found = solve_ivp(
            rate,
            (0.0, revolutions * period),
            np.zeros(2 * columns * len(poles)),
            method="DOP853",
            t_eval=t,
            rtol=1e-12,
            atol=np.repeat(allowed.ravel(), 2),
        )
        return self._averaged(t, found.y.T).reshape(revolutions - first, *self._shape)

    @property
    def _shape(self) -> tuple[int, int, int]:
        return len(self._c) - 1, self.prepared.samples, self.columns

    def _averaged(self, t: NDArray, y: NDArray) -> NDArray:
        """(revolutions, sensors, n, columns) signals of states (times, reals), band-limited to the samples kept."""
        z = np.ascontiguousarray(y).view(complex).reshape(len(t), self.columns, -1)
        outputs = np.einsum("om,tkm->tok", self._c, z, optimize=True).real + self._static
        force = np.array([self.force(one, delta) for one, delta in zip(t, outputs[:, 0], strict=True)])
        outputs += self.prepared.system.direct[:, 0, None] * force[:, None]
        return averaged(
            outputs[:, 1:].reshape(-1, _FINER * self.prepared.samples, *outputs[0, 1:].shape), self.prepared
        )


def averaged(signals: NDArray, prepared: PeriodicRig) -> NDArray:
    """(revolutions, sensors, n, columns) of finer signals (revolutions, samples, sensors, columns)."""
    fine = signals.shape[1]
    grid = Period(samples=fine, revolutions=1, passes=(prepared.teeth,), refinement=fine // prepared.samples)
    return grid.averaged(np.fft.rfft(signals.swapaxes(1, 2), axis=2))
