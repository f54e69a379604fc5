"""Raw recordings made by the march in time, with all that a measurement has beside the mesh."""

from math import ceil

import numpy as np
from numpy.typing import ArrayLike

from sigdb.core import FloatArray, InputError
from sigdb.dynamics import damaged_gear
from sigdb.measurement import noise_deviation
from sigdb.recording.recording import Channel, Recording
from sigdb.recording.synthetic.motion import Motion, motion
from sigdb.recording.synthetic.noise import Noise, coloured_noise
from sigdb.recording.synthetic.sensor_resonance import through_path
from sigdb.recording.synthetic.surroundings import Surroundings
from sigdb.recording.synthetic.tacho import jittered, pulse_waveform
from sigdb.recording.synthetic.tones import tones
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
    """Record a rig as a sensor and a tacho would, by the march in time with backlash.

    The rig runs in before the record begins, half a pulse's interval before a mark: the tacho's first pulse is the
    mark from which teeth are numbered, of the damaged gear and of all others.

    Parameters
    ----------
    rig
        A transmission with torque through its meshes.
    damage
        Tooth damage; None for an undamaged gear.
    sampling_rate
        Of both channels, Hz. What it cannot hold is filtered out before: flat to 0.38 of it.
    revolutions, seconds
        How long the record is, one of the two: whole revolutions of the damaged gear's shaft from the mark on, or
        seconds at the operating point's speed, rounded up to revolutions.
    sensor
        Sensor of the rig; its first if left out.
    index_errors
        (teeth,) index error of each tooth of the damaged gear along the mesh normal, m: those of
        :func:`sigdb.measurement.index_errors` for a specimen; none if left out.
    surroundings
        What disturbs the recording; nothing if left out.
    seed
        Of what is drawn. Each ingredient has a stream of its own: switching one on changes no other.
    steps_per_tooth
        Least number of steps of the march in a tooth pass.

    Returns
    -------
    Recording
        Channels of the sensor and, named ``tacho``, of pulses that rise through a half at the marks. ``speed_rpm`` is
        the mean of the damaged gear's shaft, ``torque`` that of the drive.

    Raises
    ------
    InputError
        If something does not fit the rig, the record has no length or two, or the sampling rate cannot hold the path's
        resonance or the pulses.

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
    made = motion(
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
    return record(made, surroundings, seed=seed)


def record(made: Motion, surroundings: Surroundings | None = None, *, seed: int = 0) -> Recording:
    """A recording of a motion: several with other noise may be made of one.

    Parameters
    ----------
    made
        The motion, marched with the same speed, torque and tacho.
    surroundings, seed
        As in :func:`synthetic_recording`.

    Raises
    ------
    InputError
        As there.
    """
    surroundings = surroundings or Surroundings()
    of_tones, of_noise, of_tacho = (
        np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(one,))) for one in (1, 2, 3)
    )
    x: FloatArray = made.signal + _tones(made, surroundings, of_tones)
    if surroundings.path is not None:
        _check_held("path.frequency", surroundings.path.frequency, made.sampling_rate)
        x = through_path(x, made.sampling_rate, surroundings.path)
    x = x[made.begin :]
    if surroundings.noise is not None:
        x = x + _noise(made, surroundings.noise, len(x), of_noise)
    pulses = jittered(of_tacho, made.pulse_times, surroundings.tacho.jitter)
    closed = "" if made.contact == 1 else f"; all meshes are closed during {made.contact:.2%} of the time"
    return Recording(
        source=f"synthetic: {made.rig.name}",
        channels=(
            Channel(name=made.sensor, samples=x, sampling_rate=made.sampling_rate, unit=made.unit),
            Channel(name=TACHO, samples=_waveform(pulses, made, len(x)), sampling_rate=made.sampling_rate, unit=""),
        ),
        tacho=TACHO,
        notes=(f"made by the march in time, not measured{closed}",),
        teeth=made.rig.gears[made.gear].teeth,
        speed_rpm=made.speed_rpm,
        torque=made.torque,
        pulses_per_rev=float(surroundings.tacho.pulses_per_revolution),
        ratio=_ratio(made, surroundings.tacho.shaft),
    )


def _revolutions(rig: Transmission, damage: Damage | None, revolutions: int | None, seconds: float | None) -> int:
    """The length of a record in whole revolutions of the damaged gear's shaft."""
    if revolutions is not None and seconds is None:
        return revolutions
    if seconds is None or revolutions is not None:
        raise InputError("a recording has one length: give either revolutions or seconds")
    if not (np.isfinite(seconds) and seconds > 0):
        raise InputError(f"seconds = {seconds} must be above zero")
    shaft = rig.gears[damaged_gear(rig, (damage or Damage()).gear)].shaft
    return ceil(seconds * abs(rig.ratio(shaft)) * rig.operating.speed_rpm / 60)


def _ratio(made: Motion, shaft: str | None) -> float:
    """Revolutions of the damaged gear's shaft in one of another."""
    own = made.rig.gears[made.gear].shaft
    return abs(made.rig.ratio(own) / made.rig.ratio(shaft or own))


def _tones(made: Motion, surroundings: Surroundings, stream: np.random.Generator) -> FloatArray:
    """Tones of shafts and bearings, in the unit of the sensor."""
    orders: list[FloatArray] = []
    amplitudes: list[FloatArray] = []
    for shaft in surroundings.shafts:
        orders.append(np.array(shaft.harmonics, float) / _ratio(made, _known(made, shaft.shaft)))
        amplitudes.append(np.full(len(shaft.harmonics), shaft.amplitude))
    for bearing in surroundings.bearings:
        orders.append(bearing.orders / _ratio(made, _known(made, bearing.shaft)))
        amplitudes.append(bearing.amplitudes)
    if not orders:
        return np.zeros(1)
    o, a = np.concatenate(orders), made.reference * np.concatenate(amplitudes)
    phases = stream.uniform(0, 2 * np.pi, len(o))
    turning = made.rig.gears[made.gear].shaft
    _check_held(f"a tone of order {o.max():g} of {turning}", o.max() * made.speed_rpm / 60, made.sampling_rate)
    return tones(made.turns, o, a, phases)


def _known(made: Motion, shaft: str | None) -> str | None:
    if shaft is not None and not made.rig.ratio(shaft):
        known = ", ".join(name for name in made.rig.shafts if made.rig.ratio(name))
        raise InputError(f"shaft = {shaft!r} is no turning shaft of rig {made.rig.name!r}; name one of {known}")
    return shaft


def _check_held(what: str, frequency: float, sampling_rate: float) -> None:
    if frequency >= sampling_rate / 2:
        raise InputError(
            f"{what}, {frequency:g} Hz, is not below half the sampling_rate of {sampling_rate:g} Hz; raise the rate"
        )


def _noise(made: Motion, noise: Noise, samples: int, stream: np.random.Generator) -> FloatArray:
    deviation = noise_deviation(np.array(made.reference**2), np.array(noise.snr_db))
    return deviation * coloured_noise(stream, (samples,), made.sampling_rate, noise.corner_frequency)


def _waveform(pulses: FloatArray, made: Motion, samples: int) -> FloatArray:
    """Pulses that last a quarter of the shortest interval."""
    least = float(np.diff(pulses).min()) if len(pulses) > 1 else samples / made.sampling_rate
    if least * made.sampling_rate < 12:
        raise InputError(
            f"pulses of the tacho are {least:g} s apart, less than 12 samples at {made.sampling_rate:g} Hz; raise the "
            "sampling_rate, or lower pulses_per_revolution or the jitter"
        )
    return pulse_waveform(pulses, made.sampling_rate, samples, width=least / 4)
