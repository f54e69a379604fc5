"""The motion of a rig at its operating point, marched until one common period of its meshes repeats."""

from dataclasses import dataclass

import numpy as np

from sigdb.core import ComplexArray, FloatArray, SigdbError
from sigdb.dynamics.excitation import HarmonicExcitation
from sigdb.dynamics.march.marcher import Marcher, MeshTables
from sigdb.dynamics.period import Period
from sigdb.transmission import ModalSystem, Transmission, elements_from

_SLOWEST = 0.999
"""Ratio of successive changes of a period above which the motion is not taken to settle."""


@dataclass(frozen=True, kw_only=True)
class RepeatedPeriod:
    """A period that repeats: signals (sensors, n); outputs and mesh forces at each step from the mark; how far it may
    still be from settled, as a fraction of the outputs' peak-to-peak."""

    signals: FloatArray
    outputs: FloatArray
    mesh_force: FloatArray
    static_compression: FloatArray
    state: ComplexArray
    periods: int
    left: float


@dataclass(frozen=True, kw_only=True)
class PeriodicMotion:
    """A motion to be marched with any number of steps."""

    rig: Transmission
    gear: str
    system: ModalSystem
    tables: MeshTables
    order: list[int]
    harmonics: tuple[HarmonicExcitation, ...]
    revolutions: int
    passes: tuple[int, ...]
    samples_per_tooth: int
    tolerance: float
    most_revolutions: int

    def repeated(self, state: ComplexArray, steps_per_tooth: int) -> RepeatedPeriod:
        """Return the period that repeats, marched from a state with a number of steps a tooth pass."""
        teeth, shaft = self.rig.gears[self.gear].teeth, self.rig.gears[self.gear].shaft
        N = self.revolutions * teeth * steps_per_tooth
        step = 2 * np.pi * self.revolutions / abs(self.rig.speed(shaft)) / N
        turns = np.arange(N + 1) / (teeth * steps_per_tooth)
        force, lift = np.zeros((N + 1, self.system.inputs.shape[1])), np.zeros((N + 1, len(self.order)))
        for harmonic in self.harmonics:
            phasor = np.exp(2j * np.pi * harmonic.order * turns)[:, None]
            force += (phasor * harmonic.force).real
            lift += (phasor * harmonic.error[self.order]).real
        active = np.flatnonzero(force.any(axis=0))
        force, lift = np.ascontiguousarray(force[:, active]), lift if lift.any() else lift[:, :0]
        elements = elements_from(self.rig, self.gear, self.system)
        others = np.eye(self.system.inputs.shape[1])[:, active]
        marcher = Marcher(self.system, elements, self.tables, step, others)
        marcher.start(state, 0.0, force[0], lift[0])
        before, last_change = None, np.inf
        for periods in range(1, max(2, self.most_revolutions // self.revolutions) + 1):
            outputs, mesh_force = marcher.run(turns[1:], force[1:], lift[1:])
            if not np.isfinite(outputs).all():
                break
            change = np.inf if before is None else self._change(outputs, before)
            # The remaining change of a motion that settles geometrically.
            ratio = min(change / last_change, _SLOWEST) if np.isfinite(last_change) and last_change > 0 else 0.0
            left = change * ratio / (1 - ratio)
            if np.isfinite(last_change) and max(change, left) <= self.tolerance:
                from_the_mark = np.roll(outputs, 1, axis=0)
                return RepeatedPeriod(
                    signals=self._signals(from_the_mark, steps_per_tooth),
                    outputs=from_the_mark,
                    mesh_force=np.roll(mesh_force, 1, axis=0),
                    static_compression=marcher.static_compression,
                    state=marcher.state,
                    periods=periods,
                    left=left,
                )
            before, last_change = outputs, change
        raise SigdbError(
            f"rig {self.rig.name!r}: the motion does not repeat to {self.tolerance:g} of its size within "
            f"{self.most_revolutions} revolutions of the damaged gear; change the damage, the speed or the "
            "damping"
        )

    def _change(self, outputs: FloatArray, before: FloatArray) -> float:
        """Return the greatest change of an output from the period before, as a fraction of its peak-to-peak."""
        size = np.ptp(outputs, axis=0)
        return float((np.abs(outputs - before).max(axis=0) / np.where(size > 0, size, np.inf)).max())

    def _signals(self, outputs: FloatArray, steps_per_tooth: int) -> FloatArray:
        """(sensors, n) averaged signals of outputs at the steps of a period."""
        period = Period(
            samples=len(outputs),
            revolutions=self.revolutions,
            passes=self.passes,
            refinement=steps_per_tooth // self.samples_per_tooth,
        )
        return period.averaged(np.fft.rfft(outputs[:, len(self.order) :], axis=0)).T
