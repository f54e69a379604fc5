"""A gearbox that was never measured: healthy recordings of a pair of 32 and 80 teeth, made from a seed in a second.

Nothing is stored. The machine has what measured gearboxes have and the simulation of sigdb does not know: pitch errors
with run-out whose trace in the vibration changes with the load, a second stage of 48 teeth, hum, noise, a speed that
drifts, and a structure of many modes between the teeth and each of four accelerometers. No part of it uses sigdb's
dynamics, so that a diagnosis meets a machine that is no member of its own rigs.

    python benchmarks/gearbox_twin.py [--out FOLDER]    # writes new.csv and run.csv, both healthy
"""

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import upfirdn

from sigdb.core import ComplexArray, FloatArray
from sigdb.recording import Channel, Recording

TEETH, WHEEL = 32, 80
SECOND_STAGE, SECOND_WHEEL = 48, 64
RATE, SECONDS = 12_800.0, 6.0
CHANNELS = ("a1", "a2", "a3", "a4")
SPEED, SLIP = 29.76, 0.0018
"""Revolutions a second without load, and their loss a per cent of load, as public recordings of such a stand show."""

_FINE = 4
"""Ratio of the rate at which the motion is computed to the sampling rate."""
_STEPS = 64
"""Steps in a tooth pass of the force."""
_LEAD = 0.25
"""Seconds before and after a recording in which the structure settles."""
_PER_LOAD = np.deg2rad(2.6)
"""Turn of the trace of pitch errors for a per cent of load: 10 % leave a correlation of 0.9."""
_MODES, _DAMPING = 14, 0.04
_TRACE, _NOISE, _HUM, _OTHER_STAGE = 1.2, 0.7, 0.05, 0.6
"""Rms of the trace of pitch errors relative to that of the mesh; of noise, hum and the second stage relative to that of
the first stage. The average then keeps half of a recording's rms, its trace is as great as its mesh harmonics, and its
noise a tenth of its trace, as in public recordings of such a stand."""


@dataclass(frozen=True, kw_only=True)
class Twin:
    """A gearbox with its gears and sensors.

    Attributes
    ----------
    seed
        Seed of all that makes this gearbox differ from another.
    """

    seed: int

    def record(
        self, *, load: float, number: int, moved: bool = False, day: int = 0, seconds: float = SECONDS
    ) -> tuple[Recording, FloatArray]:
        """Return a healthy recording, and the angle of the pinion at each of its samples, in tooth passes.

        Parameters
        ----------
        load
            Load, per cent.
        number
            Number of the recording: its noise, its drift of speed and where in a turn it begins.
        moved
            Whether the sensors were moved: each mode reaches them by another share.
        day
            Day: on another one, warmth and assembly have changed the structure a little.
        seconds
            Length.
        """
        stream = np.random.default_rng([self.seed, 1, number])
        rate = _FINE * RATE
        t = np.arange(round((seconds + 2 * _LEAD) * rate)) / rate
        turns = self._turns(t, load, stream)
        first = _passes(turns, (TEETH, WHEEL), self._errors(0, TEETH, WHEEL), load, self.seed)
        second = _passes(
            turns * TEETH / WHEEL,
            (SECOND_STAGE, SECOND_WHEEL),
            self._errors(1, SECOND_STAGE, SECOND_WHEEL),
            load,
            self.seed + 1,
        )
        forces = [np.fft.rfft(first / first.std()), _OTHER_STAGE * np.fft.rfft(second / second.std())]
        signals = []
        for channel in range(len(CHANNELS)):
            heard = self._behind(forces, channel, len(t) // _FINE, moved=moved, day=day)
            kept = heard[round(_LEAD * RATE) :][: round(seconds * RATE)]
            time = np.arange(len(kept)) / RATE
            hum = np.sqrt(2) * np.cos(2 * np.pi * 50 * time + stream.uniform(0, 2 * np.pi))
            noise = _NOISE * stream.standard_normal(len(kept)) + _HUM * hum
            signals.append(kept + noise * kept.std())
        begin = round(_LEAD * rate)
        angle = turns[begin : begin + _FINE * len(kept) : _FINE]
        channels = [
            Channel(name=name, samples=x, sampling_rate=RATE, unit="m/s^2")
            for name, x in zip(CHANNELS, signals, strict=True)
        ]
        pulse = 5 / (1 + np.exp(-60 * np.sin(2 * np.pi * angle)))  # rises at each whole turn
        channels.append(Channel(name="tacho", samples=pulse, sampling_rate=RATE, unit="V"))
        source = f"twin {self.seed}, load {load:g} %, recording {number}"
        return Recording(source=source, channels=tuple(channels), tacho="tacho"), TEETH * angle

    def _turns(self, t: FloatArray, load: float, stream: np.random.Generator) -> FloatArray:
        """Return the turns of the pinion: the speed drifts by a tenth of a per cent over seconds."""
        speed = np.full(len(t), SPEED - SLIP * load)
        for period in (7.0, 3.1, 1.3):
            speed *= 1 + 5e-4 * np.cos(2 * np.pi * (t / period + stream.uniform()))
        turns = np.cumsum(speed) * (t[1] - t[0])
        return np.asarray(turns + stream.uniform(1, 2))

    def _errors(self, stage: int, *teeth: int) -> list[FloatArray]:
        """Return the pitch errors of both gears, um: two low orders and a little from tooth to tooth."""
        stream = np.random.default_rng([self.seed, 2, stage])
        found = []
        for Z in teeth:
            place = 2 * np.pi * np.arange(Z) / Z
            low = sum(a * np.cos(o * place + stream.uniform(0, 2 * np.pi)) for o, a in ((1, 8.0), (2, 6.0)))
            found.append(low + stream.standard_normal(Z))
        return found

    def _behind(self, forces: list[ComplexArray], channel: int, size: int, *, moved: bool, day: int) -> FloatArray:
        """Return the acceleration (size,) at a sensor, at the sampling rate, from the spectra of the forces."""
        modes = np.random.default_rng([self.seed, 3])
        f = np.sort(np.exp(modes.uniform(np.log(300), np.log(9000), _MODES)))
        shapes = modes.standard_normal((len(CHANNELS), _MODES))[channel] * modes.standard_normal((2, _MODES))
        if moved:
            other = np.random.default_rng([self.seed, 4, channel])
            shapes = shapes * np.exp(0.6 * other.standard_normal(_MODES)) + 0.3 * other.standard_normal(_MODES)
        warmth = np.random.default_rng([self.seed, 5, day])
        drift = warmth.standard_normal((2, _MODES)) if day else np.zeros((2, _MODES))
        f, shapes = f * (1 + 0.004 * drift[0]), shapes * (1 + 0.08 * drift[1])
        ratio = np.fft.rfftfreq(size, 1 / RATE)[:, None] / f
        resonances = ratio**2 / (1 - ratio**2 + 2j * _DAMPING * ratio)
        X = sum(force[: size // 2 + 1] * (resonances @ shape) for force, shape in zip(forces, shapes, strict=True))
        X *= np.clip((1 - np.linspace(0, 1, len(X))) / 0.1, 0, 1)  # the filter before the converter
        return np.asarray(np.fft.irfft(X, size) / _FINE)


def _passes(turns: FloatArray, teeth: tuple[int, int], errors: list[FloatArray], load: float, seed: int) -> FloatArray:
    """Return the force of a mesh at an angle in turns: its harmonics, and a trace of the pitch errors of each pass."""
    stream = np.random.default_rng([seed, 6])
    first, last = int(np.floor(turns[0] * teeth[0])) - 4, int(np.ceil(turns[-1] * teeth[0])) + 4
    passes = np.arange(first, last)
    error = sum(e[passes % len(e)] for e in errors)
    turn = _PER_LOAD * (load - 50)
    u = np.arange(2 * _STEPS) / _STEPS - 1
    bump = np.cos(np.pi * u / 2) ** 2
    traces = [bump * sum(a * np.cos(2 * np.pi * h * u + p) for h, a, p in _wave(stream, 6)) for _ in range(2)]
    trace = np.cos(turn) * traces[0] / np.linalg.norm(traces[0]) + np.sin(turn) * traces[1] / np.linalg.norm(traces[1])
    force = upfirdn(trace, error, up=_STEPS)[: len(passes) * _STEPS]
    place = np.arange(len(force)) / _STEPS
    mesh = sum(a * (0.6 + load / 100) * np.cos(2 * np.pi * h * place + p) for h, a, p in _wave(stream, 6))
    force = _TRACE * force / force.std() + mesh / mesh.std()
    return np.asarray(CubicSpline(place + first, force)(turns * teeth[0]))


def _wave(stream: np.random.Generator, harmonics: int) -> list[tuple[int, float, float]]:
    """Return number, amplitude and phase of harmonics that fall off slowly."""
    return [
        (h, float(np.exp(0.4 * stream.standard_normal()) / h**0.7), float(stream.uniform(0, 2 * np.pi)))
        for h in range(1, harmonics + 1)
    ]


def main() -> None:
    """Write two recordings of one twin as text."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path(), help="folder; the current one")
    given = parser.parse_args()
    for name, load, number in (("new", 40.0, 1), ("run", 50.0, 2)):
        recording, _ = Twin(seed=1).record(load=load, number=number)
        columns = np.column_stack([channel.samples for channel in recording.channels])
        head = ",".join(f"{channel.name} [{channel.unit}]" for channel in recording.channels)
        np.savetxt(given.out / f"{name}.csv", columns, delimiter=",", header=head, comments="", fmt="%.5g")


if __name__ == "__main__":
    main()
