"""Synthetic raw recordings by the march in time, with the disturbances of a measurement."""

from math import ceil

import numpy as np
from numpy.typing import ArrayLike

from sigdb.core import FloatArray, InputError, Note
from sigdb.dynamics import damaged_gear
from sigdb.measurement import noise_deviation
from sigdb.recording.recording import Channel, Recording
from sigdb.recording.synthetic.motion import Motion, simulate_motion
from sigdb.recording.synthetic.sensors import Noise, coloured_noise, jitter_times, pulse_waveform, through_path
from sigdb.recording.synthetic.surroundings import Surroundings
from sigdb.recording.synthetic.tones import sum_of_tones
from sigdb.transmission import Damage, Transmission

TACHO = "tacho"
"""Name of the tacho's channel."""


def synthetic_recording(
    rig: Transmission,
    damage: Damage | None = None,
    *,
    sampling_rate: float,
    revolutions: int | None = None,
    seconds: float | None = None,
    sensor: str | None = None,
    index_errors: ArrayLike | None = None,
    surroundings: Surroundings | None = None,
    seed: int = 0,
    steps_per_tooth: int = 256,
) -> Recording:
    """Simulate the recording of a rig by a sensor and a tacho, by the march in time with backlash.

    The rig runs in before the record begins. The record begins half a pulse's interval before a mark: the tacho's first
    pulse is the mark from which the teeth of all gears are numbered.

    Parameters
    ----------
    rig
        A transmission with torque through its meshes.
    damage
        Tooth damage; None for an undamaged gear.
    sampling_rate
        Sampling rate of both channels, Hz. An anti-aliasing filter is applied before: it is flat to 0.38 of the rate.
    revolutions, seconds
        Length of the record, by one of the two: whole revolutions of the damaged gear's shaft from the mark on, or
        seconds at the operating point's speed, rounded up to revolutions.
    sensor
        Sensor of the rig; its first if left out.
    index_errors
        (teeth,) index error of each tooth of the damaged gear along the mesh normal, m, for instance from
        :func:`sigdb.measurement.index_errors`; none if left out.
    surroundings
        Disturbances of the recording; none if left out.
    seed
        Seed of the random numbers. Each disturbance has its own stream: adding one changes no other.
    steps_per_tooth
        Smallest number of steps of the march in a tooth pass.

    Returns
    -------
    Recording
        A channel of the sensor, and a channel ``tacho`` with pulses that rise through a half at the marks.
        ``speed_rpm`` is the mean of the damaged gear's shaft, ``torque`` that of the drive.

    Raises
    ------
    InputError
        If something does not fit the rig, if the record has no length or two, or if the sampling rate is too low for
        the path's resonance or the pulses.

    Examples
    --------
    >>> import sigdb
    >>> from sigdb.recording import Surroundings, synthetic_recording
    >>> rig = sigdb.load_transmission("nasa-spiral-bevel")
    >>> damage = sigdb.Damage(tooth=6, stiffness_loss=0.4)
    >>> surroundings = Surroundings(speed={"depth": 0.01, "period": 0.2}, noise={"snr_db": 10.0})
    >>> recording = synthetic_recording(
    ...     rig, damage, sampling_rate=102.4e3, revolutions=12, surroundings=surroundings
    ... )
    >>> [channel.name for channel in recording.channels], recording.teeth
    (['pinion-vertical', 'tacho'], 12)
    """
    surroundings = surroundings or Surroundings()
    motion = simulate_motion(
        rig,
        damage,
        sampling_rate=sampling_rate,
        revolutions=_revolutions(rig, damage, revolutions, seconds),
        sensor=sensor,
        index_errors=index_errors,
        surroundings=surroundings,
        seed=seed,
        steps_per_tooth=steps_per_tooth,
    )
    return record(motion, surroundings, seed=seed)


def record(motion: Motion, surroundings: Surroundings | None = None, *, seed: int = 0) -> Recording:
    """Record a motion; several recordings with different noise may share one motion.

    Parameters
    ----------
    motion
        The motion, marched with the same speed, torque and tacho.
    surroundings, seed
        As in :func:`synthetic_recording`.

    Raises
    ------
    InputError
        As in :func:`synthetic_recording`.
    """
    surroundings = surroundings or Surroundings()
    tone_stream, noise_stream, tacho_stream = (
        np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(key,))) for key in (1, 2, 3)
    )
    x: FloatArray = motion.signal + _tones(motion, surroundings, tone_stream)
    if surroundings.path is not None:
        _check_held("path.frequency", surroundings.path.frequency, motion.sampling_rate)
        x = through_path(x, motion.sampling_rate, surroundings.path)
    x = x[motion.begin :]
    if surroundings.noise is not None:
        x = x + _noise(motion, surroundings.noise, len(x), noise_stream)
    pulses = jitter_times(tacho_stream, motion.pulse_times, surroundings.tacho.jitter)
    closed = "" if motion.contact == 1 else f"; all meshes are closed during {motion.contact:.2%} of the time"
    text = f"made by the march in time, not measured{closed}"
    return Recording(
        source=f"synthetic: {motion.rig.name}",
        channels=(
            Channel(name=motion.sensor, samples=x, sampling_rate=motion.sampling_rate, unit=motion.unit),
            Channel(name=TACHO, samples=_waveform(pulses, motion, len(x)), sampling_rate=motion.sampling_rate, unit=""),
        ),
        tacho=TACHO,
        notes=(Note(code="synthetic", text=text, values={"contact": motion.contact}),),
        teeth=motion.rig.gears[motion.gear].teeth,
        speed_rpm=motion.speed_rpm,
        torque=motion.torque,
        pulses_per_rev=float(surroundings.tacho.pulses_per_revolution),
        ratio=_ratio(motion, surroundings.tacho.shaft),
    )


def _revolutions(rig: Transmission, damage: Damage | None, revolutions: int | None, seconds: float | None) -> int:
    """Return the length of a record in whole revolutions of the damaged gear's shaft."""
    if revolutions is not None and seconds is None:
        return revolutions
    if seconds is None or revolutions is not None:
        raise InputError("a recording has one length: give either revolutions or seconds")
    if not (np.isfinite(seconds) and seconds > 0):
        raise InputError(f"seconds = {seconds} must be above zero")
    shaft = rig.gears[damaged_gear(rig, (damage or Damage()).gear)].shaft
    return ceil(seconds * abs(rig.ratio(shaft)) * rig.operating.speed_rpm / 60)


def _ratio(motion: Motion, shaft: str | None) -> float:
    """Return the revolutions of the damaged gear's shaft in a revolution of another shaft."""
    gear_shaft = motion.rig.gears[motion.gear].shaft
    return abs(motion.rig.ratio(gear_shaft) / motion.rig.ratio(shaft or gear_shaft))


def _tones(motion: Motion, surroundings: Surroundings, stream: np.random.Generator) -> FloatArray:
    """Return the tones of shafts and bearings, in the unit of the sensor."""
    orders: list[FloatArray] = []
    amplitudes: list[FloatArray] = []
    for shaft in surroundings.shafts:
        orders.append(np.array(shaft.harmonics, float) / _ratio(motion, _turning(motion, shaft.shaft)))
        amplitudes.append(np.full(len(shaft.harmonics), shaft.amplitude))
    for bearing in surroundings.bearings:
        orders.append(bearing.orders / _ratio(motion, _turning(motion, bearing.shaft)))
        amplitudes.append(bearing.amplitudes)
    if not orders:
        return np.zeros(1)
    o, a = np.concatenate(orders), motion.reference * np.concatenate(amplitudes)
    phases = stream.uniform(0, 2 * np.pi, len(o))
    turning = motion.rig.gears[motion.gear].shaft
    _check_held(f"a tone of order {o.max():g} of {turning}", o.max() * motion.speed_rpm / 60, motion.sampling_rate)
    return sum_of_tones(motion.turns, o, a, phases)


def _turning(motion: Motion, shaft: str | None) -> str | None:
    if shaft is not None and not motion.rig.ratio(shaft):
        turning = ", ".join(name for name in motion.rig.shafts if motion.rig.ratio(name))
        raise InputError(f"shaft = {shaft!r} is no turning shaft of rig {motion.rig.name!r}; name one of {turning}")
    return shaft


def _check_held(name: str, frequency: float, sampling_rate: float) -> None:
    if frequency >= sampling_rate / 2:
        raise InputError(
            f"{name}, {frequency:g} Hz, is not below half the sampling_rate of {sampling_rate:g} Hz; raise the rate"
        )


def _noise(motion: Motion, noise: Noise, samples: int, stream: np.random.Generator) -> FloatArray:
    deviation = noise_deviation(np.array(motion.reference**2), np.array(noise.snr_db))
    return deviation * coloured_noise(stream, (samples,), motion.sampling_rate, noise.corner_frequency)


def _waveform(pulses: FloatArray, motion: Motion, samples: int) -> FloatArray:
    """Return pulses that last a quarter of the shortest interval."""
    least = float(np.diff(pulses).min()) if len(pulses) > 1 else samples / motion.sampling_rate
    if least * motion.sampling_rate < 12:
        raise InputError(
            f"pulses of the tacho are {least:g} s apart, less than 12 samples at {motion.sampling_rate:g} Hz; raise "
            "the sampling_rate, or lower pulses_per_revolution or the jitter"
        )
    return pulse_waveform(pulses, motion.sampling_rate, samples, width=least / 4)
