"""Damage of simulated gear pairs, added to healthy recordings at its angle in every turn.

Damage is the difference of two averages of one rig, with and without it. The rigs have the tooth counts of the recorded
gears, and other sizes, bearings, inertias and torques than those that a diagnosis is given. The way from the mesh to
the sensor turns the rig's mesh harmonics into the recorded ones. Between the harmonics it wanders by 3 dB and 20 deg,
with nodes half a harmonic apart, since no interpolation is right there.
"""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from healthy_only import STEPS, MeanTurn

import sigdb
from sigdb.core import ComplexArray, FloatArray
from sigdb.dynamics import prepare_periodic
from sigdb.recording import Recording
from sigdb.transmission import Transmission

MODULES = ("1.5mm", "2.5mm", "3mm")
TORQUES = ("12Nm", "30Nm", "20Nm")
MEMBERS = 2
"""Rigs of each module: members of its ensemble, by seeds that no diagnosis uses."""
PAIR, SPEED = "32/80", "1780rpm"
WANDER_DB, WANDER_DEG = 3.0, 20.0
RIGS = len(MODULES) * MEMBERS
"""Number of rigs."""


@cache
def other_rig(number: int) -> Transmission:
    """Return a rig that no diagnosis is given."""
    size = number % len(MODULES)
    rig = sigdb.new_rig(teeth=PAIR, speed=SPEED, torque=TORQUES[size], module=MODULES[size], name="other-sizes")
    members = sigdb.ensemble(rig, MEMBERS, rng=1000 + size)
    return members[number // len(MODULES)]


@cache
def difference(number: int, loss: float, gear: str = "pinion") -> tuple[ComplexArray, ComplexArray]:
    """Return the spectra of a rig's healthy average and of the change by a loss at tooth 1, by whole orders of a gear.

    Where the loss opens the mesh, for which the periodic solution does not hold, the next rig stands in.
    """
    for other in range(number, number + RIGS):
        rig = other_rig(other % RIGS)
        prepared = prepare_periodic(rig, gear=gear, samples_per_tooth=STEPS, refine=False)
        damage = sigdb.Damage(tooth=1, gear=gear, stiffness_loss=loss)
        states = prepared.steady_state([{}, damage.on_teeth(rig.gears[gear].teeth)], specimens=False)
        if not any(states.contact_loss):
            sensors = len(rig.sensors)
            X = np.fft.rfft(states.signals_at()[:, number % sensors], axis=-1)
            n = STEPS * rig.gears[gear].teeth
            X = X[:, : n // 2 + 1] * n / states.signals_at().shape[-1]
            return X[0], X[1] - X[0]
    raise ValueError(f"a loss of {loss} opens the mesh of every rig")


@dataclass(frozen=True, kw_only=True)
class Injection:
    """Damage that is added to a recording.

    Attributes
    ----------
    rig
        Number of the rig.
    loss
        Loss of stiffness; or, with ``share_of_rms``, the loss whose change is scaled to that share.
    tooth
        Tooth, from 1.
    gear
        Gear of that tooth: ``pinion`` or ``wheel``.
    seed
        Seed of the way between mesh harmonics.
    share_of_rms
        Rms of the change relative to that of the average; None for what the way gives.
    """

    rig: int
    loss: float
    tooth: int
    seed: int
    share_of_rms: float | None = None
    gear: str = "pinion"

    def into(self, recording: Recording, channel: str, angle: FloatArray) -> tuple[Recording, float]:
        """Return the recording with damage in one channel, and the rms of the change relative to that of the average.

        ``angle`` is that of each sample, in tooth passes from the first contact of tooth 1 of both gears.
        """
        signal = recording.channel(channel)
        healthy, change = difference(self.rig, self.loss, self.gear)
        teeth = 2 * (len(healthy) - 1) // STEPS
        mean = MeanTurn.of(signal.samples, angle, teeth=teeth)
        k = np.arange(len(healthy))
        way = self._way(mean, healthy, k, teeth) * (k < mean.highest / 0.85)
        turn = np.fft.irfft(change * way * np.exp(-2j * np.pi * k * (self.tooth - 1) / teeth))
        rms = np.fft.irfft(mean.spectrum).std()
        share = float(turn.std() / rms)
        if self.share_of_rms is not None:
            turn, share = turn * self.share_of_rms / share, self.share_of_rms
        place = angle * STEPS
        added = np.interp(place % len(turn), np.arange(len(turn) + 1), np.append(turn, turn[0]))
        changed = replace(signal, samples=signal.samples + added)
        channels = tuple(changed if each.name == channel else each for each in recording.channels)
        source = f"{recording.source}, loss {self.loss:g} at tooth {self.tooth} of the {self.gear}"
        return replace(recording, channels=channels, source=source), share

    def _way(self, mean: MeanTurn, healthy: ComplexArray, k: np.ndarray, teeth: int) -> ComplexArray:
        """Return the gain of the way by order: right at mesh harmonics but for the wandering."""
        harmonics = np.arange(1, int(mean.highest // teeth) + 1) * teeth
        first = mean.spectrum[teeth] / healthy[teeth]
        delay = np.exp(1j * np.angle(first) / teeth * k)
        gains = mean.spectrum[harmonics] / (healthy[harmonics] * delay[harmonics])
        size = np.interp(k, harmonics, np.log(np.abs(gains)))
        phase = np.interp(k, harmonics, np.unwrap(np.angle(gains)))
        nodes = np.arange(0, len(k) + teeth, teeth // 2)
        stream = np.random.default_rng(self.seed)
        size = size + np.interp(k, nodes, stream.normal(0, WANDER_DB * np.log(10) / 20, len(nodes)))
        phase = phase + np.interp(k, nodes, stream.normal(0, np.deg2rad(WANDER_DEG), len(nodes)))
        return np.asarray(np.exp(size + 1j * phase) * delay)


def mesh_angle(recording: Recording, teeth: int, *, near_rpm: float) -> FloatArray:
    """Return the angle of each sample in tooth passes, by the phase of the strongest first mesh harmonic of a channel.

    It is counted from an arbitrary tooth. A band of 5 Hz holds the drift of the speed, and no sideband.
    """
    found = []
    for channel in recording.signals:
        X, f = np.fft.fft(channel.samples), np.fft.fftfreq(len(channel.samples), 1 / channel.sampling_rate)
        mesh = teeth * near_rpm / 60
        size = np.where(np.abs(f - mesh) < 0.01 * mesh, np.abs(X), 0)
        line = f[size.argmax()]
        analytic = np.fft.ifft(np.where(np.abs(f - line) < 5.0, X, 0))
        found.append((float(size.max() / np.median(size[size > 0])), np.unwrap(np.angle(analytic)) / (2 * np.pi)))
    angle = max(found, key=lambda each: each[0])[1]
    return np.asarray(angle - np.floor(angle[0]))
