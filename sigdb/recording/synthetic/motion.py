"""Motion of a rig for a recording: a march in time under a speed and a torque that may drift."""

from dataclasses import dataclass
from fractions import Fraction
from math import ceil

import numpy as np
from numpy.typing import ArrayLike

from sigdb.core import FloatArray, InputError
from sigdb.dynamics import PeriodicRig, TimeProfile, checked_index_errors, march, prepare_periodic
from sigdb.recording.synthetic.surroundings import Drift, Surroundings
from sigdb.transmission import Damage, Transmission

_SETTLING = 12
"""Fewest revolutions before a record: the slowest free motion of the built-in rigs then has died away."""


@dataclass(frozen=True, kw_only=True)
class Motion:
    """Signal of a sensor from the mesh alone, with a run-in before the record begins.

    Attributes
    ----------
    rig, gear, sensor, unit
        The rig, its damaged gear, its sensor and the sensor's unit.
    sampling_rate
        Sampling rate, Hz.
    signal
        (samples,) signal of the sensor.
    turns
        (samples,) revolutions of the damaged gear's shaft.
    pulse_times
        Exact times of the tacho's pulses in the record, s; the first is a mark of both shafts.
    begin
        First sample of the record.
    reference
        Standard deviation of the nominal healthy average at the operating point, in the sensor's unit.
    speed_rpm, torque
        Means over the record: speed of the damaged gear's shaft, rpm, and torque of the drive, N m.
    contact
        Fraction of the time in which all meshes are closed.
    """

    rig: Transmission
    gear: str
    sensor: str
    unit: str
    sampling_rate: float
    signal: FloatArray
    turns: FloatArray
    pulse_times: FloatArray
    begin: int
    reference: float
    speed_rpm: float
    torque: float
    contact: float


def simulate_motion(
    rig: Transmission,
    damage: Damage | None = None,
    *,
    sampling_rate: float,
    revolutions: int,
    sensor: str | None = None,
    index_errors: ArrayLike | None = None,
    surroundings: Surroundings | None = None,
    seed: int = 0,
    steps_per_tooth: int = 256,
    prepared: PeriodicRig | None = None,
) -> Motion:
    """March a rig in time for a recording.

    Only speed, torque and the tacho's shaft of the surroundings are used.

    Parameters
    ----------
    rig, damage, sensor, sampling_rate, revolutions, index_errors, surroundings, seed, steps_per_tooth
        As in :func:`synthetic_recording`.
    prepared
        The rig prepared for the damaged gear, where many motions share it.

    Raises
    ------
    InputError
        If something does not fit the rig, or revolutions is no whole number.
    """
    if not isinstance(revolutions, int | np.integer) or revolutions < 1:
        raise InputError(f"revolutions = {revolutions} must be a whole number of at least 1")
    damage, surroundings = damage or Damage(), surroundings or Surroundings()
    prepared = prepared or prepare_periodic(rig, gear=damage.gear)
    shaft = rig.gears[prepared.gear].shaft
    sensor = _checked_sensor(rig, sensor)
    errors = checked_index_errors(index_errors, prepared.teeth)
    stream = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(0,)))
    phases = stream.uniform(0, 2 * np.pi, 2)

    tacho = surroundings.tacho.shaft or shaft
    cycle = _common_revolutions(rig, shaft, tacho)
    lead = cycle * ceil(_SETTLING / cycle)
    nominal = abs(rig.ratio(shaft)) * rig.operating.speed_rpm / 60
    # Slower than nominal by the whole drift, it still turns far enough.
    least = _least(surroundings.speed)
    longest = (lead + revolutions + 2 * cycle) / (nominal * least)
    speed = _profile(surroundings.speed, rig.operating.speed_rpm, longest, phases[0])
    torque = _profile(surroundings.torque, rig.operating.torque, longest, phases[1])

    per_turn = 60 / abs(rig.ratio(shaft))
    spacing = abs(rig.ratio(shaft) / rig.ratio(tacho)) / surroundings.tacho.pulses_per_revolution
    begin, end = speed.reached(np.array([lead - spacing / 2, lead + revolutions + 1.5 * spacing]) * per_turn)
    history = march(
        rig,
        damage,
        duration=end,
        sampling_rate=sampling_rate,
        speed_rpm=speed,
        torque=torque,
        index_errors=errors,
        tacho=tacho,
        pulses_per_revolution=surroundings.tacho.pulses_per_revolution,
        state=prepared.modal_state(damage.on_teeth(prepared.teeth), errors),
        steps_per_tooth=steps_per_tooth,
        system=prepared.system,
    )
    first = ceil(begin * sampling_rate)
    return Motion(
        rig=rig,
        gear=prepared.gear,
        sensor=sensor,
        unit=rig.sensors[sensor].unit,
        sampling_rate=sampling_rate,
        signal=history.signals[sensor],
        turns=history.turns,
        pulse_times=history.pulse_times[history.pulse_times > begin] - first / sampling_rate,
        begin=first,
        reference=_reference(rig, prepared, sensor),
        speed_rpm=float(history.speed_rpm[first:].mean() * abs(rig.ratio(shaft))),
        torque=float(history.torque[first:].mean()),
        contact=history.contact,
    )


def _checked_sensor(rig: Transmission, sensor: str | None) -> str:
    names = list(rig.sensors)
    if sensor is None:
        return names[0]
    if sensor not in names:
        raise InputError(f"sensor = {sensor!r} is no sensor of rig {rig.name!r}; name one of {', '.join(names)}")
    return sensor


def _common_revolutions(rig: Transmission, shaft: str, tacho: str) -> int:
    """Return the revolutions of a shaft after which the tacho's shaft has made whole revolutions too."""
    if not rig.ratio(tacho):
        turning = ", ".join(name for name in rig.shafts if rig.ratio(name))
        raise InputError(f"tacho.shaft = {tacho!r} is no turning shaft of rig {rig.name!r}; name one of {turning}")
    return Fraction(abs(rig.ratio(tacho) / rig.ratio(shaft))).limit_denominator(10_000).denominator


def _least(drift: Drift | None) -> float:
    return 1.0 if drift is None else 1 + drift.offset - drift.depth


def _profile(drift: Drift | None, nominal: float, duration: float, phase: float) -> TimeProfile:
    return (drift or Drift()).profile(nominal, duration=duration, phase=phase)


def _reference(rig: Transmission, prepared: PeriodicRig, sensor: str) -> float:
    """Return the deviation of the nominal healthy signal with its harmonic excitations, as in databases."""
    return float(prepared.healthy_signals()[list(rig.sensors).index(sensor)].std())
