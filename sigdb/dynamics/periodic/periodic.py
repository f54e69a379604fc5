"""The periodic steady state of a rig, exact for the linear, time-periodic equations.

The healthy rig is solved once for an operating point (:mod:`sigdb.dynamics.periodic.hill`). Damage then adds the forces
``f = g - D o delta`` on the samples S that it touches, and ``delta = R + P_S f`` with the healthy rig's response R and
its influence P, the response to a unit force at each sample. So only ``(I + P_SS D) delta_S = R_S + P_SS g`` is left to
solve, and every output is the healthy one plus a few columns: ``y = y_0 + A_S f``.

D on samples holds the alias of its finest details. Its effect is estimated for every case; where it is more than
`TOLERANCE` the alias is computed from a finer grid and taken out by iteration.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import gcd

import numpy as np

from sigdb.core import ComplexArray, FloatArray, SigdbError, UnstableRigError
from sigdb.dynamics.damage_forces import Change, damage_change
from sigdb.dynamics.excitation import HarmonicExcitation
from sigdb.dynamics.period import Period, check_in_one_mesh
from sigdb.dynamics.periodic.correction import (
    Columns,
    Correction,
    LocalCorrection,
    LocalForces,
    inputs_of,
    local_forces,
    resampled,
)
from sigdb.dynamics.periodic.error_forces import ErrorForces
from sigdb.dynamics.periodic.hill import Hill
from sigdb.dynamics.periodic.influences import Influences, sampled_rows
from sigdb.dynamics.periodic.long_period import IteratedCorrection, LongPeriod
from sigdb.dynamics.periodic.steady_state import SteadyState
from sigdb.dynamics.periodic.truncation import GRID, Truncation
from sigdb.dynamics.stability import STABILITY_MODES, floquet_multiplier
from sigdb.transmission import Mesh, ModalSystem, ToothDamage, Transmission, meshes_among, small_matrices

SAMPLES_PER_TOOTH = 64
LEAST_SAMPLES_PER_TOOTH = 16
TOLERANCE = 1e-4
"""Error by alias, as a fraction of a signal's peak-to-peak, above which the alias is taken out."""
_FINE = 8
"""Refinement of the grid from which alias is computed. Edges are C1, so alias falls with the third power of the
refinement, and in the acceleration of a gear with the second."""
_MOST_ITERATIONS = 30


@dataclass(frozen=True, kw_only=True)
class PeriodicRig:
    """A rig prepared for one gear at one operating point: all that does not depend on the damage.

    The damaged gear's mesh comes first, whatever its place in the rig.

    Attributes
    ----------
    rig
        The rig.
    system
        Its modal system.
    gear, teeth
        The damaged gear, and its tooth count.
    meshes, order
        The meshes, the damaged gear's first, and their places in the modal system. All begin a tooth pass at the mark.
    base_pitch
        Way of the first mesh's contact along its normal in a tooth pass, m.
    shaft_speed
        Speed of the damaged gear's shaft, rad/s.
    period
        The common period on the grid of the solution.
    samples
        n, samples given out in a revolution; N in the common period.
    harmonics
        Harmonic excitations, by order of that shaft.
    static_compression, static_force
        (meshes,) compression under the mean torque and stiffness, m, and force, N; of a mesh that carries no torque
        those of :func:`~sigdb.transmission.system.elements.static_forces`.
    healthy
        (meshes, samples of the grid) mesh stiffness without damage, N/m.
    error_forces
        Mesh forces by the errors of healthy teeth.
    excitation
        Spectra of what excites the rig: outputs with the mean mesh stiffness, and forces of errors.
    solver
        The healthy rig, solved; its inputs are the meshes and the two friction vectors of the first.
    truncation
        The harmonics beyond it.
    response
        (rows, columns) of the healthy rig: compressions of each mesh on the grid, n averaged samples of each sensor,
        under torque and profile errors, each tooth's index error, each order's two phases.
    error
        Estimated error of the healthy signals by the grid, as a fraction of their peak-to-peak.
    influences
        Responses of the healthy rig to unit forces; all threads may use them.
    """

    rig: Transmission
    system: ModalSystem
    gear: str
    teeth: int
    meshes: tuple[Mesh, ...]
    order: tuple[int, ...]
    base_pitch: float
    shaft_speed: float
    period: Period
    samples: int
    harmonics: tuple[HarmonicExcitation, ...]
    static_compression: FloatArray
    static_force: FloatArray
    healthy: FloatArray
    error_forces: ErrorForces
    excitation: tuple[ComplexArray, ComplexArray]
    solver: Hill | LongPeriod
    truncation: Truncation
    response: FloatArray
    error: float
    influences: Influences

    @property
    def samples_per_tooth(self) -> int:
        """Samples in a tooth pass."""
        return self.samples // self.teeth

    @property
    def seconds(self) -> float:
        """The common period, s."""
        return self.period.revolutions * 2 * np.pi / self.shaft_speed

    def healthy_error(self) -> float:
        """Estimate the error of the healthy signals by the grid, as a fraction of their peak-to-peak."""
        back = self.truncation.acting_back(self._finely(self.response))
        return _of_peak_to_peak(self._signals(self.rows(self.solver.respond(back))), self._signals(self.response))

    def mesh_stiffness(self, damage: Mapping[int, ToothDamage]) -> FloatArray:
        """Return the mesh stiffness (meshes, N) with damage by tooth number, N/m."""
        return self._stiffness(self._change(damage))

    def floquet_multiplier(self, damages: Sequence[Mapping[int, ToothDamage]]) -> float:
        """Return the largest Floquet multiplier with that damage which leaves the least mesh stiffness.

        Parameters
        ----------
        damages : sequence of mappings
            Damage by tooth number, from 1, of each case.

        Raises
        ------
        UnstableRigError
            If it is not below 1.
        """
        multiplier = self.linear_multiplier(damages)
        if not multiplier < 1:
            raise UnstableRigError(
                f"rig {self.rig.name!r} is unstable at {self.rig.operating.speed_rpm:g} rpm (Floquet multiplier "
                f"{multiplier:.3g} over a revolution): the varying mesh stiffness feeds a resonance; raise the damping "
                "or change the speed"
            )
        return multiplier

    def linear_multiplier(self, damages: Sequence[Mapping[int, ToothDamage]]) -> float:
        """Return what :meth:`floquet_multiplier` does, also where the rig is unstable."""
        stiffness = min(map(self.mesh_stiffness, damages), key=np.sum)[np.argsort(self.order)]
        system = self.system.truncated(STABILITY_MODES)
        # Without damage all meshes repeat after the passes that their counts have in common.
        return floquet_multiplier(system, stiffness, self.seconds, passes=gcd(*self.period.passes))

    def healthy_signals(self) -> FloatArray:
        """Return the signals (sensors, n) of the undamaged rig for gears without index errors."""
        return self.steady_state([{}], specimens=False)[0].signals_at()

    @small_matrices
    def steady_state(
        self,
        damages: Sequence[Mapping[int, ToothDamage]],
        index_errors: FloatArray | None = None,
        *,
        specimens: bool = True,
    ) -> SteadyState:
        """Return the steady states of several cases of damage; an empty mapping is the healthy rig.

        Parameters
        ----------
        damages : sequence of mappings
            Damage by tooth number, from 1, of each case.
        index_errors : ndarray, (teeth,), optional
            Not used: the result holds for any index errors.
        specimens : bool, default True
            Whether to compute the response to index errors too.

        Returns
        -------
        SteadyState
            With a leading axis for the cases. A case has failed where the grid is far too coarse for its damage. Index
            errors of a gear in several meshes act in the first alone.

        Raises
        ------
        InputError
            If the gear is damaged and takes part in several meshes.
        """
        if any(tooth.is_damage for damage in damages for tooth in damage.values()):
            check_in_one_mesh(self.rig, self.gear)
        return SteadyState.stack([self._case(damage, specimens) for damage in damages])

    def _stiffness(self, change: Change) -> FloatArray:
        change = change.every(self.period.refinement)
        stiffness = self.healthy[:, :: self.period.refinement].copy()
        stiffness[0].reshape(-1, self.samples)[:, change.samples] += change.stiffness[0]
        return stiffness

    def _case(self, damage: Mapping[int, ToothDamage], specimens: bool) -> SteadyState:
        """The steady state of one case; where its alias cannot be taken out it is the one with alias, and failed."""
        columns: Columns = slice(None)
        if not specimens:
            columns = np.delete(np.arange(self.response.shape[1]), slice(1, 1 + self.teeth))
        if not any(tooth.is_damage for tooth in damage.values()):
            return self._state(self._change(damage), self.response[:, columns], self.error, specimens)
        fine = self._change(damage, GRID)
        change = fine.every(GRID)
        forces = self._forces(change, columns)
        correction = self._correction(forces, columns)
        force, rows = correction.solved()
        nominal = self._forces(fine, slice(1))
        error = self._error(nominal, self.period.spectrum(forces.everywhere(force[:, :, :1])), rows)
        failure = None
        if error > TOLERANCE:
            try:
                rows = self._without_alias(self._forces(self._change(damage, _FINE), columns), correction, force, rows)
                error = self._error(nominal, None, rows) + error / _FINE**2
            except SigdbError as reason:
                failure = reason
        return self._state(change, rows, error, specimens, failure)

    def modal_state(self, damage: Mapping[int, ToothDamage], index_errors: FloatArray) -> ComplexArray:
        """(m,) modal coordinates at the mark, one of each conjugate pair, less those of the steady torque.

        They are those of the steady state with index errors (teeth,): a march that begins with them goes on in it.
        """
        m, N, columns = len(self.meshes), self.period.samples, slice(None)
        weights = np.concatenate([[1.0], index_errors, np.tile([1.0, 0.0], len(self.harmonics))])
        damaged = any(tooth.is_damage for tooth in damage.values())
        forces = self._forces(self._change(damage), columns)
        rows = self._correction(forces, columns).solved()[1] if damaged else self.response
        delta = (rows[: m * N] @ weights).reshape(m, N)
        mean = np.array([mesh.stiffness for mesh in self.meshes])
        force = self.excitation[1] @ weights
        force[:m] -= self.period.spectrum(((self.healthy - mean[:, None]) * delta)[:, :, None])[:, :, 0]
        if damaged:
            added = forces.errors @ weights - forces.stiffness * delta[0, forces.samples]
            force[inputs_of(forces, m)] += self.period.spectrum(forces.everywhere(added[:, :, None]))[:, :, 0]

        upper = self.system.poles.imag >= 0
        poles, inputs = self.system.poles[upper, None], self.system.inputs[upper]
        acting = inputs[:, [*self.order, *meshes_among(self.system.elements)[self.order[0]].columns[1:]]]
        spectrum, conjugate = acting @ force / N, acting @ force.conj() / N
        omega = 2j * np.pi / self.seconds * np.arange(self.period.harmonics)
        state = (spectrum / (omega - poles)).sum(axis=1) + (conjugate / (-omega - poles))[:, 1:].sum(axis=1)
        for harmonic in self.harmonics:
            speed, pole = 1j * harmonic.order * self.shaft_speed, poles[:, 0]
            state += inputs @ harmonic.force / 2 / (speed - pole) + inputs @ harmonic.force.conj() / 2 / (-speed - pole)
        return state

    def _change(self, damage: Mapping[int, ToothDamage], factor: int = 1) -> Change:
        step = factor * self.period.refinement * self.samples_per_tooth
        force = float(self.static_force[0])
        return damage_change(self.meshes[0], self.gear, self.teeth, self.base_pitch, damage, step, force)

    def _forces(self, change: Change, columns: Columns) -> LocalForces:
        return local_forces(change, self.teeth, self.period.revolutions, self.harmonics, columns)

    def _correction(self, forces: LocalForces, columns: Columns) -> Correction:
        if isinstance(self.solver, LongPeriod):
            free, force = self.excitation
            return IteratedCorrection(self.solver, forces, (free[:, :, columns], force[:, :, columns]), self.rows)
        influences = [self.influences.at(forces.samples, q) for q in inputs_of(forces, len(self.meshes))]
        return LocalCorrection(
            forces, self.response[:, columns], influences, lambda force: self.rows(self.solver.respond(force))
        )

    def _alias(self, forces: LocalForces, delta: FloatArray, counted: ComplexArray) -> ComplexArray:
        """Return the forces (inputs of the rig, K, columns) that are not counted yet; delta is on their finer grid."""
        alias = np.zeros((self.solver.transfer.shape[2], self.period.harmonics, delta.shape[1]), complex)
        true = forces.everywhere(forces(delta[forces.samples]))
        alias[inputs_of(forces, len(self.meshes))] = self.period.spectrum(true) - counted
        return alias

    def _finely(self, rows: FloatArray) -> FloatArray:
        """(meshes, F) compressions under torque on the grid of the truncation."""
        first = rows[: len(self.meshes) * self.period.samples, 0]
        return resampled(first.reshape(len(self.meshes), -1).T, GRID).T

    def _error(self, local: LocalForces, counted: ComplexArray | None, rows: FloatArray) -> float:
        """Return an estimate of the signals' error: the mean system's response to forces left out, by truncation and by
        alias.

        ``local`` are the forces under torque on the grid of the truncation; where no forces are known there is no
        alias.
        """
        delta = self._finely(rows)
        left_out = self.truncation.acting_back(delta, local)
        if counted is not None:
            left_out += self._alias(local, delta[0, :, None], counted)
        m = len(self.meshes)
        answer = self.period.averaged(np.einsum("koi,ikc->okc", self.solver.transfer[:, m:], left_out))
        return _of_peak_to_peak(answer[:, :, 0], self._signals(rows))

    def _without_alias(
        self, fine: LocalForces, correction: Correction, force: FloatArray, rows: FloatArray
    ) -> FloatArray:
        """Rows without alias, but for that of a finer grid, by iteration from the forces of the damage."""
        counted = self.period.spectrum(correction.forces.everywhere(force))
        inputs = inputs_of(fine, len(self.meshes))
        for _ in range(_MOST_ITERATIONS):
            alias = self._alias(fine, resampled(rows[: self.period.samples], _FINE), counted)
            more, further = correction.followed(alias)
            rows = rows + further
            counted = counted + alias[inputs] + self.period.spectrum(correction.forces.everywhere(more))
            if _of_peak_to_peak(self._signals(further), self._signals(rows)) < TOLERANCE / 10:
                return rows
        raise SigdbError(
            f"{self.samples_per_tooth} samples a tooth are too few for this damage: its response does not converge; "
            "give more samples_per_tooth"
        )

    def _signals(self, rows: FloatArray) -> FloatArray:
        """(sensors, n) signals under torque, of rows."""
        return rows[len(self.meshes) * self.period.samples :, 0].reshape(-1, self.samples)

    def rows(self, spectrum: ComplexArray) -> FloatArray:
        """Return the rows of a spectrum of outputs; see :func:`~sigdb.dynamics.periodic.influences.sampled_rows`."""
        return sampled_rows(spectrum, len(self.meshes), self.period)

    def _state(
        self,
        change: Change,
        rows: FloatArray,
        error: float,
        specimens: bool,
        failure: SigdbError | None = None,
    ) -> SteadyState:
        """One case, without a leading axis, from the change of its damage and the rows of its response."""
        m, N, n = len(self.meshes), self.period.samples, self.samples
        teeth, columns = self.teeth if specimens else 0, rows.shape[1]
        compressions = rows[: m * N].reshape(m, N, columns)[:, :: self.period.refinement]
        sensors = rows[m * N :].reshape(-1, n, columns)
        stiffness = self._stiffness(change)
        forces = stiffness[:, :, None] * compressions
        forces -= self.error_forces(change.every(self.period.refinement), stiffness, self.harmonics, specimens)
        forces[1:] /= self.static_force[1:, None, None]
        nominal = compressions[1:, :, 0] + compressions[1:, :, 1 + teeth :: 2].sum(axis=2)
        least_elsewhere = (nominal / self.static_compression[1:, None]).min(initial=np.inf)
        signals, by_error, by_order = _by_cause(sensors, teeth)
        compression, compression_response, compression_harmonic = _by_cause(compressions[0], teeth)
        mesh_force, mesh_force_response, mesh_force_harmonic = _by_cause(forces[0], teeth)
        elsewhere, elsewhere_response, elsewhere_harmonic = _by_cause(forces[1:], teeth)
        return SteadyState(
            signals=signals,
            specimen_response=by_error,
            harmonic_response=by_order,
            orders=tuple(harmonic.order for harmonic in self.harmonics),
            compression=compression,
            compression_response=compression_response,
            compression_harmonic=compression_harmonic,
            mesh_force=mesh_force,
            mesh_force_response=mesh_force_response,
            mesh_force_harmonic=mesh_force_harmonic,
            static_compression=float(self.static_compression[0]),
            static_force=float(self.static_force[0]),
            least_elsewhere=np.asarray(least_elsewhere),
            force_elsewhere=elsewhere,
            force_elsewhere_response=elsewhere_response,
            force_elsewhere_harmonic=elsewhere_harmonic,
            error=np.asarray(error),
            meets_accuracy=np.asarray(True),
            is_linear=np.asarray(True),
            parts_contact=np.asarray(False),
            failures=(failure,),
        )


def _by_cause(values: FloatArray, teeth: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Values (..., columns) by torque (...), by index errors (..., teeth) and by orders (..., orders, 2)."""
    harmonic = values[..., 1 + teeth :]
    by_order = harmonic.reshape(*values.shape[:-1], harmonic.shape[-1] // 2, 2)
    return values[..., 0], values[..., 1 : 1 + teeth], by_order


def _of_peak_to_peak(errors: FloatArray, signals: FloatArray) -> float:
    """Greatest error (sensors, n) of a sensor, as a fraction of its signal's peak-to-peak."""
    size = np.ptp(signals, axis=1)
    return float((np.abs(errors).max(axis=1) / np.where(size > 0, size, np.inf)).max(initial=0.0))
