"""Raw signals over many revolutions: run-ups, load changes, contact loss, with the track of a tacho."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from sigdb.core import ComplexArray, FloatArray, InputError, SigdbError
from sigdb.dynamics.excitation import checked_index_errors, turning
from sigdb.dynamics.march.marcher import Marcher, mesh_tables, meshes_from
from sigdb.dynamics.period import check_in_one_mesh, common_period, damaged_gear
from sigdb.dynamics.time_profile import TimeProfile
from sigdb.transmission import (
    Damage,
    ModalSystem,
    Transmission,
    as_damage,
    as_transmission,
    elements_from,
    modal_system,
    small_matrices,
)

STEPS_PER_TOOTH = 256
_SETTLED, _MOST_PERIODS = 1e-4, 1000
"""Change within a common period, as a fraction of the motion, at which it has settled; periods until it is given up."""
_CHUNK = 1 << 16
"""Steps that are held in memory together."""
_HALF_LENGTH = 32
"""Half the length of the anti-alias filter, in samples given out."""


@dataclass(frozen=True, kw_only=True)
class TimeHistory:
    """Signals of the sensors over time; sample 0 is at time 0, where all meshes begin a tooth pass.

    Attributes
    ----------
    sampling_rate
        Hz.
    signals
        (samples,) by sensor, in the unit of ``units``, without what the sampling rate cannot hold.
    units
        Unit by sensor.
    turns
        (samples,) revolutions of the damaged gear's shaft.
    speed_rpm, torque
        (samples,) of the operating point, rpm and N m.
    pulse_times
        Times of the tacho's pulses, the first at time 0, s.
    compression, mesh_force
        (samples,) by mesh, along its normal, m and N; the force is 0 where teeth are apart.
    contact
        Fraction of the time in which all meshes are closed.
    state
        (m,) modal coordinates one sample after the last. A march that continues has its first sample there.
    """

    sampling_rate: float
    signals: dict[str, FloatArray]
    units: dict[str, str]
    turns: FloatArray
    speed_rpm: FloatArray
    torque: FloatArray
    pulse_times: FloatArray
    compression: dict[str, FloatArray]
    mesh_force: dict[str, FloatArray]
    contact: float
    state: ComplexArray

    @property
    def time(self) -> FloatArray:
        """(samples,) s."""
        return np.arange(len(self.turns)) / self.sampling_rate


@small_matrices
def march(
    rig: Transmission | str | PathLike[str],
    damage: Damage | Mapping[str, Any] | None = None,
    *,
    duration: float,
    sampling_rate: float,
    speed_rpm: TimeProfile | float | None = None,
    torque: TimeProfile | float | None = None,
    index_errors: ArrayLike | None = None,
    tacho: str | None = None,
    pulses_per_revolution: int = 1,
    state: ComplexArray | None = None,
    settled: bool = False,
    steps_per_tooth: int = STEPS_PER_TOOTH,
    system: ModalSystem | None = None,
) -> TimeHistory:
    """March a rig in time, with backlash, while its speed and torque follow given profiles.

    The mesh phase and all that turns follow the angle. The modal system is that of the rig's operating speed:
    gyroscopic moments, and bearings that are described for one speed, stay as they are there, which matters little
    while speeds differ by a fraction. The speed is prescribed: the loads do not change it.

    Parameters
    ----------
    rig
        A transmission with torque through its meshes, the name of a built-in one, or a rig file.
    damage
        Tooth damage, or its fields as a dictionary; None for an undamaged gear.
    duration
        In s.
    sampling_rate
        Sampling rate of the signals, Hz. Steps are a whole fraction of a sample, and signals are filtered: flat to
        0.38 of the rate, half at 0.45.
    speed_rpm, torque
        Speed and torque of the operating point over time, rpm and N m; constant, as in the rig, if left out. Speeds are
        above zero.
    index_errors
        (teeth,) index error of each tooth of the damaged gear along the mesh normal, m; none if left out.
    tacho
        Shaft that the tacho is on; the damaged gear's if left out.
    pulses_per_revolution
        Pulses of the tacho in a revolution of its shaft.
    state
        Modal coordinates to begin with, of a history that ended or of
        :meth:`~sigdb.dynamics.PeriodicRig.modal_state`; at rest under the first torque if left out. All meshes begin
        a tooth pass at time 0, so that a history goes on in its own motion where it lasted whole common periods.
    settled
        Whether to begin with the motion to which the rig settles at the first speed and torque, in place of the
        transient from rest. It is marched before time 0, common period by common period.
    steps_per_tooth
        Least number of steps in a tooth pass, of the fastest mesh at the highest speed.
    system
        The rig's modal system, for example a truncated one; synthesised in full if left out.

    Returns
    -------
    TimeHistory

    Raises
    ------
    TypeError
        If the rig or the damage is of another type.
    InputError
        If something does not fit the rig, or a speed is not above zero.
    SigdbError
        If the motion before time 0 does not settle.

    Examples
    --------
    >>> import sigdb
    >>> from sigdb.dynamics import TimeProfile, march
    >>> rig = sigdb.load_transmission("nasa-spiral-bevel")
    >>> run_up = TimeProfile([0.0, 0.05], [12000.0, 14400.0])
    >>> history = march(rig, duration=0.05, sampling_rate=50e3, speed_rpm=run_up)
    >>> history.signals["pinion-vertical"].shape, len(history.pulse_times)
    ((2500,), 11)
    """
    rig, damage = as_transmission(rig), as_damage(damage)
    gear = damaged_gear(rig, damage.gear)
    if rig.operating.drive is None or not rig.operating.torque or not rig.operating.speed_rpm:
        raise InputError(
            f"rig {rig.name!r} has no torque through its meshes; give operating.drive, load, speed and torque"
        )
    teeth, shaft = rig.gears[gear].teeth, rig.gears[gear].shaft
    errors = checked_index_errors(index_errors, teeth)
    if damage.is_damage or errors.any():
        check_in_one_mesh(rig, gear)
    for name, value in (("duration", duration), ("sampling_rate", sampling_rate)):
        if not (np.isfinite(value) and value > 0):
            raise InputError(f"{name} = {value} must be above zero")
    if tacho is not None and not rig.ratio(tacho):
        turning_shafts = ", ".join(name for name in rig.shafts if rig.ratio(name))
        raise InputError(f"tacho = {tacho!r} is no turning shaft of rig {rig.name!r}; name one of {turning_shafts}")
    if not isinstance(steps_per_tooth, int | np.integer) or steps_per_tooth < 1:
        raise InputError(f"steps_per_tooth = {steps_per_tooth} must be a whole number of at least 1")
    if not isinstance(pulses_per_revolution, int | np.integer) or pulses_per_revolution < 1:
        raise InputError(f"pulses_per_revolution = {pulses_per_revolution} must be a whole number of at least 1")
    speed, load = _profile(speed_rpm, rig.operating.speed_rpm), _profile(torque, rig.operating.torque)
    if min(speed.value) <= 0:
        raise InputError(f"speed_rpm falls to {min(speed.value)}; a march needs speeds above zero")

    system = system or modal_system(rig)
    fastest = max(rig.mesh_frequency(name) for name in rig.meshes) * max(speed.value) / rig.operating.speed_rpm
    finer = max(1, int(np.ceil(fastest * steps_per_tooth / sampling_rate)))
    drive = _Drive(rig, system, gear, speed, load)
    tables = mesh_tables(rig, gear, damage.on_teeth(teeth), errors, system)
    marcher = Marcher(system, elements_from(rig, gear, system), tables, 1 / (finer * sampling_rate), drive.inputs)
    now = np.zeros(1)
    upper = system.poles.imag >= 0
    if settled and state is None:
        state = _settled_state(
            partial(march, rig, damage, index_errors=errors, steps_per_tooth=steps_per_tooth, system=system),
            rig, gear, sampling_rate, speed(now)[0], load(now)[0], np.abs(system.outputs[:, upper]),
        )  # fmt: skip
    if state is None:
        excess = load(now)[0] / rig.operating.torque - 1
        state = system.inputs[upper, len(rig.meshes)] * excess / -system.poles[upper]
    if np.shape(state) != (upper.sum(),):
        raise InputError(
            f"state has the shape {np.shape(state)}; this rig's modal system has {upper.sum()} coordinates: give the "
            "state of a history of the same rig, or none"
        )
    _, force, lift = drive(now)
    first = np.concatenate(marcher.start(state, 0.0, force[0], lift[0]))

    samples = max(1, round(duration * sampling_rate))
    outputs, forces, closed, end = _recorded(marcher, drive, first, samples, finer, sampling_rate)
    time = np.arange(samples) / sampling_rate
    names, m = meshes_from(rig, gear), len(rig.meshes)
    wheel = tacho or shaft
    turn = 60 / abs(rig.ratio(wheel))
    last = speed.integral(time[-1:])[0]
    pulses = np.arange(np.floor(last / turn * pulses_per_revolution + 1e-9) + 1) * turn / pulses_per_revolution
    return TimeHistory(
        sampling_rate=sampling_rate,
        signals=dict(zip(rig.sensors, outputs[:, m:].T, strict=True)),
        units={name: sensor.unit for name, sensor in rig.sensors.items()},
        turns=drive.turns(time),
        speed_rpm=speed(time),
        torque=load(time),
        pulse_times=speed.reached(pulses),
        compression=dict(zip(names, outputs[:, :m].T, strict=True)),
        mesh_force=dict(zip(names, forces.T, strict=True)),
        contact=closed,
        state=end,
    )


def _settled_state(
    marched: Callable[..., TimeHistory],
    rig: Transmission,
    gear: str,
    sampling_rate: float,
    speed_rpm: float,
    torque: float,
    weight: FloatArray,
) -> ComplexArray:
    """Return the modal coordinates of the motion that repeats after a common period, at its beginning.

    ``weight`` (outputs, m) is the part of each coordinate in each output.
    """
    revolutions, _ = common_period(rig, gear)
    period = revolutions * 60 / (speed_rpm * abs(rig.ratio(rig.gears[gear].shaft)))
    rate = np.ceil(sampling_rate * period) / period  # whole samples in a period
    state: ComplexArray | None = None
    for _ in range(_MOST_PERIODS):
        end = marched(duration=period, sampling_rate=rate, speed_rpm=speed_rpm, torque=torque, state=state).state
        if state is not None and (weight @ np.abs(end - state) <= _SETTLED * (weight @ np.abs(end))).all():
            return end
        state = end
    raise SigdbError(
        f"rig {rig.name!r}: the motion at {speed_rpm:g} rpm and {torque:g} N m does not settle within {_MOST_PERIODS} "
        "common periods; begin with another speed, or without settled"
    )


class _Drive:
    """Excitations that vary in time: the angle, the torque, and all excitations that turn.

    ``inputs`` (inputs of the system, k) are its forces.
    """

    def __init__(
        self, rig: Transmission, system: ModalSystem, gear: str, speed: TimeProfile, torque: TimeProfile
    ) -> None:
        shaft = rig.gears[gear].shaft
        self._speed, self._torque, self._operating = speed, torque, rig.operating
        self._ratio, self._turning = abs(rig.ratio(shaft)), turning(rig, system, shaft)
        self._order = [list(rig.meshes).index(name) for name in meshes_from(rig, gear)]
        self._lifts = any(each.harmonic.error.any() for each in self._turning)
        used = np.zeros(system.inputs.shape[1], bool)
        for each in self._turning:
            used |= each.harmonic.force != 0
        # A torque that is the operating point's is part of the static response.
        self._excess = any(value != rig.operating.torque for value in torque.value)
        used[len(rig.meshes)] |= self._excess
        self._used = np.flatnonzero(used)
        self.inputs = np.eye(len(used))[:, used]

    def turns(self, t: FloatArray) -> FloatArray:
        """Return the revolutions of the gear's shaft at times."""
        return self._ratio / 60 * self._speed.integral(t)

    def __call__(self, t: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return revolutions (steps,), forces (steps, k) and common errors (steps, meshes or 0) at times."""
        turns, share = self.turns(t), self._torque(t) / self._operating.torque
        force, lift = np.zeros((len(t), len(self._used))), np.zeros((len(t), len(self._order)))
        torque_input = len(self._order)
        if self._excess:
            force[:, self._used == torque_input] += (share - 1)[:, None]
        # d^2/dt^2 of exp(i order theta), over that at the operating speed.
        to_rad = 2 * np.pi / 60 * self._ratio
        speed, nominal = self._speed(t) * to_rad, self._operating.speed_rpm * to_rad
        for each in self._turning:
            order = each.harmonic.order
            phasor = np.exp(2j * np.pi * order * turns)
            inertia = (speed**2 - 1j * self._speed.slope(t) * to_rad / order) / nominal**2
            scale = inertia if each.inertial else share
            force += ((scale * phasor)[:, None] * each.harmonic.force[self._used]).real
            lift += (phasor[:, None] * each.harmonic.error[self._order]).real
        return turns, force, lift if self._lifts else lift[:, :0]


class _AntiAlias:
    """Filter of zero phase that gives out every ``finer``-th sample of its input; samples go along the first axis."""

    def __init__(self, finer: int, first: FloatArray) -> None:
        from scipy.signal import firwin  # slow to load, and a sweep does without it

        self._finer, self._half = finer, _HALF_LENGTH * finer if finer > 1 else 0
        self._taps = firwin(2 * self._half + 1, 0.9 / finer, window=("kaiser", 8.0)) if self._half else np.ones(1)
        # Samples before the first are taken to be equal to it.
        self._held = np.repeat(first[None], self._half + 1, axis=0)

    def __call__(self, more: FloatArray) -> FloatArray:
        from scipy.signal import upfirdn

        self._held = np.concatenate([self._held, more])
        ready = (len(self._held) - len(self._taps)) // self._finer + 1
        if ready < 1:
            return self._held[:0]
        skipped = 2 * self._half // self._finer
        filtered = upfirdn(self._taps, self._held, 1, self._finer, axis=0)[skipped : skipped + ready]
        self._held = self._held[ready * self._finer :]
        return filtered

    @property
    def beyond(self) -> int:
        """Number of input samples that it needs after the last sample given out."""
        return self._half


def _recorded(
    marcher: Marcher, drive: _Drive, first: FloatArray, samples: int, finer: int, sampling_rate: float
) -> tuple[FloatArray, FloatArray, float, ComplexArray]:
    """Outputs (samples, outputs), mesh forces (samples, meshes), the fraction of closed steps, the state at the end."""
    m, step = marcher.meshes, 1 / (finer * sampling_rate)
    whole = _AntiAlias(finer, first[:-m])
    outputs, forces, closed, state = [], [first[None, -m:]], 0, marcher.state
    end, chunk = samples * finer, max(1, _CHUNK // finer) * finer
    steps = max(end, end - finer + whole.beyond)
    for begin, stop in pairwise([*range(0, end, chunk), *range(end, steps, chunk), steps]):
        block, mesh_force = marcher.run(*drive(np.arange(begin + 1, stop + 1) * step))
        outputs.append(whole(block))
        forces.append(mesh_force[finer - 1 :: finer])
        if stop <= end:
            closed += int((mesh_force > 0).all(axis=1).sum())
            state = marcher.state
    return np.concatenate(outputs)[:samples], np.concatenate(forces)[:samples], closed / end, state


def _profile(profile: TimeProfile | float | None, usual: float) -> TimeProfile:
    if isinstance(profile, TimeProfile):
        return profile
    return TimeProfile([0.0], [usual if profile is None else float(profile)])
