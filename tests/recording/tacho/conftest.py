"""A shaft of known speed: times of its marks, the waveform of a tacho, the vibration of a gear of 12 teeth."""

from dataclasses import dataclass

import numpy as np
import pytest

from sigdb.recording import Channel, Recording


@dataclass(frozen=True)
class Shaft:
    """A shaft whose speed in rev/s is given on a fine grid of time."""

    t: np.ndarray
    speed: np.ndarray

    @property
    def turns(self):
        steps = (self.speed[1:] + self.speed[:-1]) / 2 * np.diff(self.t)
        return np.append(0.0, np.cumsum(steps))

    def marks(self, angles=(0.0,)):
        """Times at which marks pass, the first at once."""
        turns = self.turns
        at = (np.arange(int(turns[-1]) + 1)[:, None] + np.asarray(angles)).ravel()
        return np.interp(at[at < turns[-1]], turns, self.t)

    def angle(self, times):
        return np.interp(times, self.t, self.turns)

    def vibration(self, fs):
        """Mesh harmonics of 12 teeth, modulated, and a knock at tooth 6."""
        turns = self.angle(np.arange(0, self.t[-1], 1 / fs))
        theta = 2 * np.pi * turns
        mesh = (1 + 0.3 * np.cos(theta - 1)) * (np.cos(12 * theta) + 0.6 * np.cos(24 * theta + 0.4))
        knock = np.exp(-((((turns % 1) - 5.5 / 12) * 24) ** 2)) * np.cos(30 * theta)
        return mesh + 0.5 * np.cos(36 * theta + 1) + 0.8 * knock

    def waveform(self, times, fs, width=0.004):
        """Pulses from 0 to 1 that rise in a straight line over four samples through a half at each time."""
        t = np.arange(0, self.t[-1], 1 / fs)
        corners = np.array([-2 / fs, 2 / fs, width - 2 / fs, width + 2 / fs])
        knots = (np.asarray(times)[:, None] + corners).ravel()
        return np.interp(t, knots, np.tile([0.0, 1.0, 1.0, 0.0], len(times)))


def shafts():
    t = np.linspace(0, 8, 400_001)
    walk = np.random.default_rng(3).normal(size=60)
    load = np.convolve(np.where(t < 4, 20.0, 18.0), np.ones(2000) / 2000, mode="same")
    load[:2000], load[-2000:] = 20.0, 18.0
    stop = np.interp(t, [0, 3, 4, 5, 6, 8], [20, 20, 1e-6, 1e-6, 20, 20])
    return {
        "steady": Shaft(t, np.full(t.size, 20.0)),
        "wandering": Shaft(t, 20 * (1 + 0.003 * np.interp(t, np.linspace(0, 8, 60), walk))),
        "run-up": Shaft(t, 5 + 45 * t / 8),
        "torsion": Shaft(t, 20 * (1 + 0.05 * np.cos(2 * np.pi * 2 * 20 * t))),
        "load": Shaft(t, load),
        "stop": Shaft(t, stop),
        "from rest": Shaft(t, np.maximum(4 * t, 1e-9)),
        "to rest": Shaft(t, np.maximum(32 - 4 * t, 1e-9)),
    }


SHAFTS = shafts()


@pytest.fixture
def shaft():
    """The shafts by name."""
    return SHAFTS.__getitem__


@pytest.fixture
def recorded():
    """A recording of a shaft's vibration and a tacho's channel."""

    def make(shaft, tacho, fs=6400.0, **options):
        signal = Channel(name="a1", samples=shaft.vibration(fs), sampling_rate=fs, unit="m/s^2")
        if not isinstance(tacho, Channel):
            tacho = Channel(name="tacho", samples=np.asarray(tacho, float), sampling_rate=fs, unit="V")
        return Recording(source="made", channels=(signal, tacho), tacho="tacho", **options)

    return make
