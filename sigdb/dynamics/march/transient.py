"""The march in time as a solver of the steady state: with backlash, until one common period repeats."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import ClassVar

import numpy as np

from sigdb.core import ComplexArray, FloatArray, InputError, NotApplicableError, SigdbError
from sigdb.dynamics.excitation import harmonics
from sigdb.dynamics.march.marcher import mesh_tables, meshes_from
from sigdb.dynamics.march.periodic_motion import PeriodicMotion
from sigdb.dynamics.period import check_in_one_mesh, common_period, damaged_gear
from sigdb.dynamics.periodic.periodic import SAMPLES_PER_TOOTH, PeriodicRig
from sigdb.dynamics.periodic.prepare import prepare_periodic
from sigdb.dynamics.periodic.steady_state import SteadyState
from sigdb.transmission import ModalSystem, ToothDamage, Transmission, modal_system, small_matrices, static_forces


@dataclass(frozen=True, kw_only=True)
class Transient:
    """The march in time: meshes lose contact and have backlash.

    Attributes
    ----------
    steps_per_tooth
        Steps in a tooth pass of the damaged gear, of the first march; the error falls with the square of their number.
    samples_per_tooth
        Samples given out in a tooth pass of the damaged gear; a divisor of a quarter of ``steps_per_tooth``.
    tolerance
        Greatest difference between successive periods, as a fraction of an output's peak-to-peak, at which a motion
        repeats. The expected remaining change must not be greater either.
    accuracy
        Error of the signals, as a fraction of their peak-to-peak, down to which the steps are halved.
    most_steps_per_tooth
        Steps in a tooth pass beyond which they are not halved. A motion that does not meet the accuracy then is marked.
    most_revolutions
        Revolutions of the damaged gear after which a motion that does not repeat is given up.
    """

    serves_all_specimens: ClassVar[bool] = False

    steps_per_tooth: int = 256
    samples_per_tooth: int = SAMPLES_PER_TOOTH
    tolerance: float = 1e-4
    accuracy: float = 2e-4
    most_steps_per_tooth: int = 16384
    most_revolutions: int = 1000

    def __post_init__(self) -> None:
        for name in ("steps_per_tooth", "samples_per_tooth", "most_steps_per_tooth", "most_revolutions"):
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
        if not self.accuracy > 0:
            raise InputError(f"accuracy = {self.accuracy} must be above 0; 2e-4 is usual")

    def prepare(
        self, rig: Transmission, gear: str | None = None, *, system: ModalSystem | None = None
    ) -> "PreparedMarch":
        """Prepare a rig for a damaged gear; see :class:`~sigdb.dynamics.solver.Solver`."""
        system = system or modal_system(rig)
        static_forces(rig, system.meshes, system.transfer(np.zeros(1))[0, : len(rig.meshes), len(rig.meshes)].real)
        try:
            linear = prepare_periodic(rig, gear=gear, samples_per_tooth=self.samples_per_tooth, system=system)
        except NotApplicableError:
            linear = None
        gear = damaged_gear(rig, gear)
        return PreparedMarch(rig=rig, gear=gear, teeth=rig.gears[gear].teeth, solver=self, system=system, linear=linear)


@dataclass(frozen=True, kw_only=True)
class Orbit:
    """A motion that repeats after a common period of the meshes.

    Attributes
    ----------
    signals
        (sensors, n) averaged over the period's revolutions, in the sensors' units.
    compression, mesh_force
        (meshes, N) over the period, m and N, the damaged gear's mesh first.
    static_compression, static_force
        (meshes,) under the mean torque and stiffness, m and N.
    revolutions
        Revolutions of the damaged gear until it repeated.
    steps_per_tooth
        Steps in a tooth pass of the finest march.
    error
        Estimated error of the signals by the step and by the motion that had not settled, as a fraction of their
        peak-to-peak; the greatest of all sensors.
    """

    signals: FloatArray
    compression: FloatArray
    mesh_force: FloatArray
    static_compression: FloatArray
    static_force: FloatArray
    revolutions: int
    steps_per_tooth: int
    error: float

    @property
    def min_compression(self) -> float:
        """Least compression of any mesh as a fraction of its static one."""
        return float((self.compression / self.static_compression[:, None]).min())

    @property
    def min_mesh_force(self) -> float:
        """Least force of any mesh as a fraction of its static one; 0 while teeth are apart."""
        return float((self.mesh_force / self.static_force[:, None]).min())

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
    """March a rig at its operating point until one common period of its meshes repeats, to the solver's accuracy.

    It marches with a quarter, half and all of the steps. The error falls with the square of the step, so two marches
    give signals without their leading error (Richardson), and the third gives an estimate of the rest. Where that is
    above the accuracy it goes on with twice as many steps, up to the most. Excitations that
    do not repeat with the period are left out, as in the periodic solution.

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

    Returns
    -------
    Orbit

    Raises
    ------
    SigdbError
        If the motion does not repeat, as after a bifurcation to a longer period or to chaos.
    """
    system = system or modal_system(rig)
    revolutions, passes = common_period(rig, gear)
    motion = PeriodicMotion(
        rig=rig,
        gear=gear,
        system=system,
        tables=mesh_tables(rig, gear, damage, index_errors, system),
        order=[list(rig.meshes).index(name) for name in meshes_from(rig, gear)],
        harmonics=harmonics(rig, system, rig.gears[gear].shaft, revolutions),
        revolutions=revolutions,
        passes=passes,
        samples_per_tooth=solver.samples_per_tooth,
        tolerance=solver.tolerance,
        most_revolutions=solver.most_revolutions,
    )
    signals: list[FloatArray] = []
    taken, steps = 0, solver.steps_per_tooth // 4
    while True:
        last = motion.repeated(state, steps)
        state, taken = last.state, taken + last.periods * revolutions
        signals = [*signals[-2:], last.signals]
        if steps >= solver.steps_per_tooth:
            more, by_step = _extrapolated(signals)
            error = by_step + last.left
            if error <= solver.accuracy or 2 * steps > solver.most_steps_per_tooth:
                break
        steps *= 2
    names = meshes_from(rig, gear)
    static_force = static_forces(rig, names, last.static_compression)
    every, m = steps // solver.samples_per_tooth, len(motion.order)
    return Orbit(
        signals=more,
        compression=last.outputs[::every, :m].T,
        mesh_force=last.mesh_force[::every].T,
        static_compression=static_force / np.array([rig.meshes[name].stiffness for name in names]),
        static_force=static_force,
        revolutions=taken,
        steps_per_tooth=steps,
        error=error,
    )


def _extrapolated(signals: Sequence[FloatArray]) -> tuple[FloatArray, float]:
    """Return the signals (sensors, n) without their leading error, from three halvings of the step, and their error."""
    less, more = (fine + (fine - coarse) / 3 for coarse, fine in pairwise(signals))
    size = np.ptp(more, axis=1)
    return more, float((np.abs(more - less).max(axis=1) / 3 / np.where(size > 0, size, np.inf)).max(initial=0.0))


@dataclass(frozen=True, kw_only=True)
class PreparedMarch:
    """A rig prepared by :class:`Transient`.

    Attributes
    ----------
    rig, gear, teeth
        The rig, its damaged gear, and its tooth count.
    solver
        Steps, samples and tolerance.
    system
        The rig's modal system.
    linear
        The periodic solution, from which a march begins; None where the rig has none.
    """

    rig: Transmission
    gear: str
    teeth: int
    solver: Transient
    system: ModalSystem
    linear: PeriodicRig | None

    def floquet_multiplier(self, damages: Sequence[Mapping[int, ToothDamage]]) -> float:
        """Return the largest Floquet multiplier of the linear rig, stable or not; nan where there is no such rig."""
        return float("nan") if self.linear is None else self.linear.linear_multiplier(damages)

    def healthy_signals(self) -> FloatArray:
        """Return the signals (sensors, n) of the undamaged rig for gears without index errors."""
        return self.steady_state([{}])[0].signals

    @small_matrices
    def steady_state(
        self, damages: Sequence[Mapping[int, ToothDamage]], index_errors: FloatArray | None = None
    ) -> SteadyState:
        """Return the motions of several cases of damage, with a leading axis for them.

        Parameters
        ----------
        damages : sequence of mappings
            Damage by tooth number, from 1, of each case.
        index_errors : ndarray, (teeth,), optional
            Index error of each tooth of the damaged gear, m; none if left out.

        Returns
        -------
        SteadyState
            A case has failed where its motion does not repeat.

        Raises
        ------
        InputError
            If the gear has damage or index errors, and takes part in several meshes.
        """
        errors = np.zeros(self.teeth) if index_errors is None else index_errors
        if errors.any() or any(tooth.is_damage for damage in damages for tooth in damage.values()):
            check_in_one_mesh(self.rig, self.gear)
        return SteadyState.stack([self._case(damage, errors) for damage in damages])

    def _case(self, damage: Mapping[int, ToothDamage], errors: FloatArray) -> SteadyState:
        start = np.zeros(int((self.system.poles.imag >= 0).sum()), complex)
        if self.linear is not None:
            start = self.linear.modal_state(damage, errors)
        try:
            orbit = settle(
                self.rig,
                gear=self.gear,
                damage=damage,
                index_errors=errors,
                state=start,
                solver=self.solver,
                system=self.system,
            )
        except SigdbError as failure:
            return self._state(self._no_orbit(), failure)
        return self._state(orbit)

    def _no_orbit(self) -> Orbit:
        revolutions, passes = common_period(self.rig, self.gear)
        n = self.teeth * self.solver.samples_per_tooth
        over_the_period = np.full((len(passes), revolutions * n), np.nan)
        return Orbit(
            signals=np.full((len(self.rig.sensors), n), np.nan),
            compression=over_the_period,
            mesh_force=over_the_period,
            static_compression=np.full(len(passes), np.nan),
            static_force=np.full(len(passes), np.nan),
            revolutions=0,
            steps_per_tooth=0,
            error=np.nan,
        )

    def _state(self, orbit: Orbit, failure: SigdbError | None = None) -> SteadyState:
        """One case, without a leading axis; responses are zero, since the motion holds for its index errors only."""
        revolutions, _ = common_period(self.rig, self.gear)
        excitations = harmonics(self.rig, self.system, self.rig.gears[self.gear].shaft, revolutions)
        elsewhere = orbit.compression[1:] / orbit.static_compression[1:, None]
        forces = orbit.mesh_force[1:] / orbit.static_force[1:, None]
        signals, compression = orbit.signals, orbit.compression[0]
        return SteadyState(
            signals=signals,
            specimen_response=np.zeros((*signals.shape, self.teeth)),
            harmonic_response=np.zeros((*signals.shape, len(excitations), 2)),
            orders=tuple(harmonic.order for harmonic in excitations),
            compression=compression,
            compression_response=np.zeros((*compression.shape, self.teeth)),
            compression_harmonic=np.zeros((*compression.shape, len(excitations), 2)),
            mesh_force=orbit.mesh_force[0],
            mesh_force_response=np.zeros((*compression.shape, self.teeth)),
            mesh_force_harmonic=np.zeros((*compression.shape, len(excitations), 2)),
            static_compression=float(orbit.static_compression[0]),
            static_force=float(orbit.static_force[0]),
            least_elsewhere=np.asarray(elsewhere.min(initial=np.inf)),
            force_elsewhere=forces,
            force_elsewhere_response=np.zeros((*forces.shape, self.teeth)),
            force_elsewhere_harmonic=np.zeros((*forces.shape, len(excitations), 2)),
            error=np.asarray(orbit.error),
            meets_accuracy=np.asarray(orbit.error <= self.solver.accuracy),
            is_linear=np.asarray(False),
            parts_contact=np.asarray(orbit.contact_loss),
            failures=(failure,),
        )
