"""Healthy recording of the same rig as a reference: it gives the path to the sensor and the errors of the gears."""

from dataclasses import dataclass, replace

import numpy as np

from sigdb.core import ComplexArray, FloatArray
from sigdb.diagnosis.transfer_path import TransferPath, apply_gain, transfer_path

_MODEL_ERROR = 0.1
"""Error of a template, as a fraction of the change about each order; assumed."""


@dataclass(frozen=True, kw_only=True, eq=False)
class HealthyReference:
    """A measured average, made comparable with templates behind a path.

    Attributes
    ----------
    path
        Path from simulated averages to the averages of this recording.
    x
        (n,) average to compare with templates behind the path.
    noise
        (n / 2 + 1,) standard deviation of its noise at each order, including the error of templates.
    changed
        Whether the path is assumed to have changed since the healthy recording.
    change_db
        Gain of each mesh harmonic of the path in this recording relative to the healthy recording, dB.
    turned
        Teeth by which the healthy average was turned to match the other.
    """

    path: TransferPath
    x: FloatArray
    noise: FloatArray
    changed: bool
    change_db: FloatArray
    turned: int


def healthy_references(
    measured: FloatArray,
    healthy: FloatArray,
    simulated: FloatArray,
    *,
    teeth: int,
    noise: FloatArray,
    healthy_noise: FloatArray,
    absolute: bool,
) -> tuple[HealthyReference, HealthyReference]:
    """Relate a measured average to a simulated rig by a healthy average of the same rig (healthy-only calibration).

    Let X, X_h and Y_h be the spectra of the recording, of the healthy recording and of the simulated healthy rig. The
    mesh harmonics give the path ``H = X_h / Y_h`` (:func:`transfer_path`). Templates behind H are compared with ::

        H Y_h + (X - X_h),

    the simulated healthy average plus the measured change: errors of these gears, and everything else that both
    recordings contain, cancel. Where load, mounting or sensor have changed, the mesh harmonics also give the change
    ``g = X / X_h``. Then ``X - g X_h`` is compared with templates behind ``g H``, without the mesh harmonics.

    Neither simulated damage nor a path between its harmonics is exact. Therefore a tenth (assumed) of the change, as an
    rms over one mesh harmonic about each order, counts as noise. In a recording almost without noise it limits the fit
    of a template.

    Parameters
    ----------
    measured, healthy, simulated
        (n,) averages over one revolution.
    teeth
        Tooth count of the averaged gear.
    noise, healthy_noise
        (n / 2 + 1,) standard deviations of the noise of the two measured averages at each order.
    absolute
        Whether both begin at the tacho mark. If not, the healthy average is turned by the whole teeth that make it most
        similar to the other. Both are turned by the part of a tooth that gives their first mesh harmonic the simulated
        phase. The phase of the gain then follows the structure, not the beginning of the averages.

    Returns
    -------
    same, changed
        References with the unchanged path and with the changed path.
    """
    turned = 0 if absolute else _best_turn(measured, healthy, teeth)
    healthy = np.roll(healthy, turned * (len(healthy) // teeth))
    if not absolute:
        delay = _delay(healthy, simulated, teeth)
        measured, healthy = (apply_gain(x, delay) for x in (measured, healthy))
    path = transfer_path(healthy, simulated, teeth=teeth, noise=healthy_noise)
    change = transfer_path(measured, healthy, teeth=teeth, noise=np.maximum(noise, healthy_noise))
    gain = np.abs(change.gain[change.harmonics * teeth])
    differs = path.band(measured - healthy)
    same = HealthyReference(
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
    """Return noise and model error as the standard deviation of white noise of the density at each order."""
    near = np.ones(teeth)
    power = np.convolve(np.abs(np.fft.rfft(differs)) ** 2 / len(differs), near, mode="same")
    covered = np.convolve(path.covered, near, mode="same")
    return np.sqrt(noise**2 + _MODEL_ERROR**2 * power / np.maximum(covered, 1.0))


def _delay(healthy: FloatArray, simulated: FloatArray, teeth: int) -> ComplexArray:
    """Return the gain (n / 2 + 1,) of the delay, below half a tooth, that gives the first mesh harmonic its phase."""
    phase = np.angle(np.fft.rfft(healthy)[teeth] / np.fft.rfft(simulated)[teeth])
    return np.asarray(np.exp(-1j * phase / teeth * np.arange(len(healthy) // 2 + 1)))


def _best_turn(measured: FloatArray, healthy: FloatArray, teeth: int) -> int:
    """Return the teeth by which the healthy average must turn to be most similar, without mesh harmonics."""
    x, y = (_without_mesh(average, teeth) for average in (measured, healthy))
    step = len(x) // teeth
    return int(np.argmax([x @ np.roll(y, j * step) for j in range(teeth)]))


def _without_mesh(x: FloatArray, teeth: int) -> FloatArray:
    spectrum = np.fft.rfft(x)
    spectrum[::teeth] = 0
    return np.fft.irfft(spectrum, len(x))
