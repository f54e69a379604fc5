"""What a healthy recording of the same rig tells: the path to the sensor, and what this pair of gears looks like."""

from dataclasses import dataclass, replace

import numpy as np

from sigdb.core import ComplexArray, FloatArray
from sigdb.diagnosis.transfer_path import TransferPath, filtered, sensor_path

_MODEL_ERROR = 0.1
"""What a template may be wrong by, as a share of what has changed about each order; assumed."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Reference:
    """A measured average brought to what templates behind a path would give.

    Attributes
    ----------
    path
        From simulated averages to those of this recording.
    x
        (n,) the average to compare with templates behind the path.
    noise
        (n / 2 + 1,) standard deviation of its noise at each order, with what templates may be wrong by.
    changed
        Whether the path is taken to have changed since the healthy recording.
    change_db
        Gain of each mesh harmonic of the path in this recording over that in the healthy one, dB.
    turned
        Teeth by which the healthy average was turned to lie on the other.
    """

    path: TransferPath
    x: FloatArray
    noise: FloatArray
    changed: bool
    change_db: FloatArray
    turned: int


def references(
    measured: FloatArray,
    healthy: FloatArray,
    simulated: FloatArray,
    *,
    teeth: int,
    noise: FloatArray,
    healthy_noise: FloatArray,
    absolute: bool,
) -> tuple[Reference, Reference]:
    """Bring a measured average to a simulated rig by a healthy average of the same rig (healthy-only calibration).

    With X, X_h and Y_h the spectra of the recording, of the healthy one and of the simulated healthy rig, the mesh
    harmonics give the path ``H = X_h / Y_h`` (:func:`sensor_path`). What is compared with templates behind H is ::

        H Y_h + (X - X_h),

    the simulated healthy average and what has changed in the measured one: errors of these gears, and all else that
    both recordings hold, cancel. Where load, mounting or sensor are not the same any more, the mesh harmonics give
    their change ``g = X / X_h`` too, and ``X - g X_h`` is compared with templates behind ``g H``, the mesh harmonics
    themselves left out.

    No simulated damage is exact, nor is a path between the harmonics that tell it. A tenth (assumed) of what has
    changed, as an rms over one mesh harmonic about each order, counts as noise: in a recording almost without noise it
    is what limits how well a template can fit.

    Parameters
    ----------
    measured, healthy, simulated
        (n,) averages of one revolution.
    teeth
        Tooth count of the averaged gear.
    noise, healthy_noise
        (n / 2 + 1,) standard deviations of the noise of the two measured averages at each order.
    absolute
        Whether both begin at the tacho mark. If not, the healthy one is turned by the whole teeth at which it is most
        like the other, and both by the part of a tooth at which their first mesh harmonic has the simulated phase: the
        shorter way from gain to gain is then that of the structure, not of where the averages begin.

    Returns
    -------
    same, changed
        With the path as it was, and with its change.
    """
    turned = 0 if absolute else _best_turn(measured, healthy, teeth)
    healthy = np.roll(healthy, turned * (len(healthy) // teeth))
    if not absolute:
        late = _late(healthy, simulated, teeth)
        measured, healthy = (filtered(x, late) for x in (measured, healthy))
    path = sensor_path(healthy, simulated, teeth=teeth, noise=healthy_noise)
    change = sensor_path(measured, healthy, teeth=teeth, noise=np.maximum(noise, healthy_noise))
    gain = np.abs(change.gain[change.harmonics * teeth])
    differs = path.band(measured - healthy)
    same = Reference(
        path=path,
        x=path(simulated) + differs,
        noise=_with_model_error(np.hypot(noise, healthy_noise), differs, path, teeth),
        changed=False,
        change_db=20 * np.log10(gain),
        turned=turned,
    )
    both = path.gain * change.gain
    both[::teeth] = 0
    used = np.intersect1d(path.harmonics, change.harmonics)
    moved = replace(path, gain=both, harmonics=used)
    differs = moved.band(measured - change(healthy))
    return same, replace(
        same,
        path=moved,
        x=moved(simulated) + differs,
        noise=_with_model_error(np.hypot(noise, np.abs(change.gain) * healthy_noise), differs, moved, teeth),
        changed=True,
    )


def _with_model_error(noise: FloatArray, differs: FloatArray, path: TransferPath, teeth: int) -> FloatArray:
    """Noise and model error, as standard deviations of white noise of the density at each order."""
    near = np.ones(teeth)
    power = np.convolve(np.abs(np.fft.rfft(differs)) ** 2 / len(differs), near, mode="same")
    known = np.convolve(path.known, near, mode="same")
    return np.sqrt(noise**2 + _MODEL_ERROR**2 * power / np.maximum(known, 1.0))


def _late(healthy: FloatArray, simulated: FloatArray, teeth: int) -> ComplexArray:
    """Gain (n / 2 + 1,) of a delay, by less than half a tooth, to the simulated phase of the first mesh harmonic."""
    phase = np.angle(np.fft.rfft(healthy)[teeth] / np.fft.rfft(simulated)[teeth])
    return np.asarray(np.exp(-1j * phase / teeth * np.arange(len(healthy) // 2 + 1)))


def _best_turn(measured: FloatArray, healthy: FloatArray, teeth: int) -> int:
    """Teeth by which the healthy average is to be turned to be most like the measured one, mesh harmonics aside."""
    one, other = (_without_mesh(x, teeth) for x in (measured, healthy))
    step = len(one) // teeth
    return int(np.argmax([one @ np.roll(other, j * step) for j in range(teeth)]))


def _without_mesh(x: FloatArray, teeth: int) -> FloatArray:
    spectrum = np.fft.rfft(x)
    spectrum[::teeth] = 0
    return np.fft.irfft(spectrum, len(x))
