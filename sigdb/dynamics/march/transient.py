"""The march in time as a solver of the steady state: with backlash, until one common period repeats."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from sigdb.core import ComplexArray, FloatArray, InputError, SigdbError
from sigdb.dynamics.excitation import HarmonicExcitation, harmonics
from sigdb.dynamics.march.marcher import Marcher, MeshTables, mesh_tables, meshes_from
from sigdb.dynamics.period import Period, common_period
from sigdb.dynamics.periodic.periodic import SAMPLES_PER_TOOTH
from sigdb.transmission import ModalSystem, ToothDamage, Transmission, modal_system

_SLOWEST = 0.999
"""Ratio of successive changes of a period above which the motion is not taken to settle."""


@dataclass(frozen=True, kw_only=True)
class Transient:
    """The march in time: meshes lose contact and have backlash.

    Attributes
    ----------
    steps_per_tooth
        Steps in a tooth pass of the damaged gear; the error falls with the square of their number.
    samples_per_tooth
        Samples given out in a tooth pass of the damaged gear; a divisor of a quarter of ``steps_per_tooth``.
    tolerance
        A period repeats when no output differs from the one before by more than this fraction of its peak-to-peak, nor
        is expected to change by more for good.
    most_revolutions
        Revolutions of the damaged gear after which a motion that does not repeat is given up.
    """

    steps_per_tooth: int = 256
    samples_per_tooth: int = SAMPLES_PER_TOOTH
    tolerance: float = 1e-4
    most_revolutions: int = 1000

    def __post_init__(self) -> None:
        for name in ("steps_per_tooth", "samples_per_tooth", "most_revolutions"):
            value = getattr(self, name)
            if not isinstance(value, int | np.integer) or value < 1:
                raise InputError(f"{name} = {value} must be a whole number of at least 1")
        if self.steps_per_tooth % (4 * self.samples_per_tooth):
            raise InputError(
                f"steps_per_tooth = {self.steps_per_tooth} must be a multiple of four times samples_per_tooth = "
                f"{self.samples_per_tooth}: the march is repeated with half and a quarter of the steps"
            )
        if not 0 < self.tolerance < 1:
            raise InputError(f"tolerance = {self.tolerance} must lie between 0 and 1; 1e-4 is usual")


@dataclass(frozen=True, kw_only=True)
class Orbit:
    """A motion that repeats after a common period of the meshes.

    Attributes
    ----------
    signals
        (sensors, n) averaged over the period's revolutions, in the sensors' units.
    compression, mesh_force
        (meshes, N) over the period, m and N, the damaged gear's mesh first.
    static_compression
        (meshes,) under the mean torque and stiffness, m.
    revolutions
        Revolutions of the damaged gear until it repeated.
    error
        Estimated error of the signals by the step and by what had not settled, as a fraction of their peak-to-peak, the
        greatest of all sensors.
    """

    signals: FloatArray
    compression: FloatArray
    mesh_force: FloatArray
    static_compression: FloatArray
    revolutions: int
    error: float

    @property
    def min_compression(self) -> float:
        """Least compression of any mesh as a fraction of its static one."""
        return float((self.compression / self.static_compression[:, None]).min())

    @property
    def contact_loss(self) -> bool:
        """Whether teeth part."""
        return bool((self.mesh_force <= 0).any())


def settle(
    rig: Transmission,
    *,
    gear: str,
    damage: Mapping[int, ToothDamage],
    index_errors: FloatArray,
    state: ComplexArray,
    solver: Transient,
    system: ModalSystem | None = None,
) -> Orbit:
    """March a rig at its operating point until one common period of its meshes repeats.

    It is done with a quarter, half and all of the steps. The error of the march falls with the square of its steps, so
    two marches together give signals without their leading error (Richardson), and three tell what is left.
    Excitations that do not repeat with the period are left out, as in the periodic solution.

    Parameters
    ----------
    rig
        A transmission with torque through its meshes.
    gear
        The damaged gear.
    damage
        Damage by tooth number, from 1.
    index_errors
        (teeth,) index error of each tooth of that gear, m.
    state
        (m,) modal coordinates to begin with, one of each conjugate pair, less those of the steady torque:
        :meth:`~sigdb.dynamics.PeriodicRig.modal_state`, or zeros for the static equilibrium under the mean stiffness.
    solver
        Steps, samples and tolerance.
    system
        The rig's modal system; synthesised in full if left out.

    Raises
    ------
    SigdbError
        If the motion does not repeat, as after a bifurcation to a longer period or to chaos.
    """
    system = system or modal_system(rig)
    revolutions, passes = common_period(rig, gear)
    motion = _PeriodicMotion(
        rig=rig,
        gear=gear,
        system=system,
        tables=mesh_tables(rig, gear, damage, index_errors),
        order=[list(rig.meshes).index(name) for name in meshes_from(rig, gear)],
        harmonics=harmonics(rig, system, rig.gears[gear].shaft, revolutions),
        revolutions=revolutions,
        passes=passes,
        solver=solver,
    )
    found, taken = [], 0
    for steps_per_tooth in (solver.steps_per_tooth // 4, solver.steps_per_tooth // 2, solver.steps_per_tooth):
        last = motion.repeated(state, steps_per_tooth)
        state, taken = last.state, taken + last.periods * revolutions
        found.append(last.signals)
    less, more = (fine + (fine - coarse) / 3 for coarse, fine in pairwise(found))
    size = np.ptp(more, axis=1)
    every, m = solver.steps_per_tooth // solver.samples_per_tooth, len(motion.order)
    return Orbit(
        signals=more,
        compression=last.outputs[::every, :m].T,
        mesh_force=last.mesh_force[::every].T,
        static_compression=last.static_compression,
        revolutions=taken,
        error=last.left
        + float((np.abs(more - less).max(axis=1) / 3 / np.where(size > 0, size, np.inf)).max(initial=0.0)),
    )


@dataclass(frozen=True, kw_only=True)
class _Repeated:
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
class _PeriodicMotion:
    """What is marched, whatever the steps."""

    rig: Transmission
    gear: str
    system: ModalSystem
    tables: MeshTables
    order: list[int]
    harmonics: tuple[HarmonicExcitation, ...]
    revolutions: int
    passes: tuple[int, ...]
    solver: Transient

    def repeated(self, state: ComplexArray, steps_per_tooth: int) -> _Repeated:
        """The period that repeats, marched from a state with so many steps a tooth pass."""
        teeth, shaft = self.rig.gears[self.gear].teeth, self.rig.gears[self.gear].shaft
        N = self.revolutions * teeth * steps_per_tooth
        step = 2 * np.pi * self.revolutions / abs(self.rig.speed(shaft)) / N
        turns = np.arange(N + 1) / (teeth * steps_per_tooth)
        force, lift = np.zeros((N + 1, self.system.inputs.shape[1])), np.zeros((N + 1, len(self.order)))
        for one in self.harmonics:
            phasor = np.exp(2j * np.pi * one.order * turns)[:, None]
            force += (phasor * one.force).real
            lift += (phasor * one.error[self.order]).real
        active = np.flatnonzero(force.any(axis=0))
        force, lift = np.ascontiguousarray(force[:, active]), lift if lift.any() else lift[:, :0]
        marcher = Marcher(
            self.rig, self.gear, self.system, self.tables, step, np.eye(self.system.inputs.shape[1])[:, active]
        )
        marcher.start(state, 0.0, force[0], lift[0])
        before, known = None, np.inf
        for periods in range(1, max(2, self.solver.most_revolutions // self.revolutions) + 1):
            outputs, mesh_force = marcher.run(turns[1:], force[1:], lift[1:])
            if not np.isfinite(outputs).all():
                break
            change = np.inf if before is None else self._change(outputs, before)
            # What is still to come of a motion that settles geometrically.
            ratio = min(change / known, _SLOWEST) if np.isfinite(known) and known > 0 else 0.0
            left = change * ratio / (1 - ratio)
            if np.isfinite(known) and max(change, left) <= self.solver.tolerance:
                from_the_mark = np.roll(outputs, 1, axis=0)
                return _Repeated(
                    signals=self._signals(from_the_mark, steps_per_tooth),
                    outputs=from_the_mark,
                    mesh_force=np.roll(mesh_force, 1, axis=0),
                    static_compression=marcher.static_compression,
                    state=marcher.state,
                    periods=periods,
                    left=left,
                )
            before, known = outputs, change
        raise SigdbError(
            f"rig {self.rig.name!r}: the motion does not repeat to {self.solver.tolerance:g} of its size within "
            f"{self.solver.most_revolutions} revolutions of the damaged gear; change the damage, the speed or the "
            "damping"
        )

    def _change(self, outputs: FloatArray, before: FloatArray) -> float:
        """Greatest change of an output from the period before, as a fraction of its peak-to-peak."""
        size = np.ptp(outputs, axis=0)
        return float((np.abs(outputs - before).max(axis=0) / np.where(size > 0, size, np.inf)).max())

    def _signals(self, outputs: FloatArray, steps_per_tooth: int) -> FloatArray:
        """(sensors, n) averaged signals of outputs at the steps of a period."""
        period = Period(
            samples=len(outputs),
            revolutions=self.revolutions,
            passes=self.passes,
            refinement=steps_per_tooth // self.solver.samples_per_tooth,
        )
        return period.averaged(np.fft.rfft(outputs[:, len(self.order) :], axis=0)).T
