"""Questions about recordings whose answer is known, of two machines: a synthetic twin, and a public test stand.

A healthy question compares two recordings of one undamaged machine, alike or unlike in one of several ways. An injected
one adds damage of a rig that the diagnosis is not given. An empty one is of recordings without the gear.
"""

import gzip
import hashlib
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Protocol

import numpy as np
from gearbox_twin import CHANNELS, RATE, SECONDS, SPEED, TEETH, WHEEL, Twin
from injection import RIGS, Injection, mesh_angle

from sigdb.core import FloatArray
from sigdb.recording import Channel, Recording, read_recording

LOSSES = (0.2, 0.4, 0.6)
GIVEN = ("rig", "counts", "teeth")
"""Facts that a diagnosis is given: a rig of the right tooth counts and other sizes, both counts, or one of them."""
ANGLES = ("tacho", "mesh phase")
NEAR_RPM = 1780.0

KINDS = ("halves", "other load", "between loads", "moved sensor", "other day")
WHICH = "which gear"
"""Kind of the questions with damage of the pinion or of the wheel, which both counts must tell apart."""
EMPTY = ("white noise", "pink noise", "hum", "another gear", "fallen sensor", "bearing without gears")

Measured = tuple[Recording, FloatArray]
"""A recording, and the angle of its pinion at each sample, in tooth passes from the first contact of tooth 1."""


@dataclass(frozen=True, kw_only=True)
class Pair:
    """A recording with its healthy recordings, by their names, of one channel."""

    kind: str
    run: str
    healthy: tuple[str, ...]
    channel: str
    load: float | None = None
    healthy_load: tuple[float, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Question:
    """A question with a known answer.

    Attributes
    ----------
    number
        Number in its section.
    pair
        The recordings.
    angle
        Angle by the tacho or the mesh phase.
    given
        Facts that the diagnosis is given, one of ``GIVEN``.
    injection
        Damage that is added to the run; None for none.
    """

    number: int
    pair: Pair
    angle: str
    given: str
    injection: Injection | None = None


class Machine(Protocol):
    """Recordings of an undamaged gear by name, and the pairs of them that are compared."""

    name: str
    angles: tuple[str, ...]

    def measured(self, name: str) -> Measured:
        """Return a recording with its angle."""
        ...

    def pairs(self, kind: str) -> list[Pair]:
        """Return the pairs of a kind."""
        ...


@dataclass(frozen=True)
class TwinMachine:
    """Two twins; names are of ``seed/load/number`` with further words."""

    name: str = "twin"
    angles: tuple[str, ...] = ANGLES

    def measured(self, name: str) -> Measured:
        return _twin(name)

    def pairs(self, kind: str) -> list[Pair]:
        found = []
        for number, channel in enumerate(CHANNELS):
            seed = number % 2 + 1
            a, b, c = f"{seed}/40/1", f"{seed}/50/2", f"{seed}/60/3"
            match kind:
                case "halves":
                    pair = Pair(kind=kind, run=f"{b}/first", healthy=(f"{b}/second",), channel=channel)
                case "other load":
                    pair = Pair(kind=kind, run=a, healthy=(b,), channel=channel)
                case "between loads":
                    loads = {"load": 50.0, "healthy_load": (40.0, 60.0)}
                    pair = Pair(kind=kind, run=b, healthy=(a, c), channel=channel, **loads)
                case "moved sensor":
                    pair = Pair(kind=kind, run=f"{seed}/50/4/moved", healthy=(b,), channel=channel)
                case _:
                    pair = Pair(kind=kind, run=f"{seed}/51/5/day", healthy=(b,), channel=channel)
            found.append(pair)
        return found


@cache
def _twin(name: str) -> Measured:
    part = name.rpartition("/")[2]
    if part in ("first", "second"):
        return halves(_twin(name.removesuffix(f"/{part}")))[part == "second"]
    if name.partition("/")[0] in EMPTY:
        return empty_recording(*name.split("/"))
    seed, load, number, *words = name.split("/")
    return Twin(seed=int(seed)).record(
        load=float(load), number=int(number), moved="moved" in words, day=int("day" in words)
    )


FILES = {
    "h30hz0": "healthy, no load",
    "h30hz40": "healthy, 40 %",
    "h30hz50": "healthy, 50 %",
    "h30hz60": "healthy, 60 %",
    "b30hz0": "the same gears on another day, no load",
    "b30hz50": "the same gears on another day, 50 %",
}
"""Recordings of the public stand that are used. Its label 'broken' shows no damage: the pitch errors of all three
shafts are those of the label 'healthy'."""


@dataclass(frozen=True)
class SpectraQuest:
    """The public recordings in a folder, at 12.8 kHz, pinion of 32 teeth driving 80."""

    folder: Path
    name: str = "spectraquest"
    angles: tuple[str, ...] = ("mesh phase",)
    _read: dict[str, Measured] = field(default_factory=dict)

    def measured(self, name: str) -> Measured:
        part = name.rpartition("/")[2]
        if part in ("first", "second"):
            return halves(self.measured(name.removesuffix(f"/{part}")))[part == "second"]
        if name not in self._read:
            recording = read_recording(self._path(name), sampling_rate=RATE)
            self._read[name] = recording, mesh_angle(recording, TEETH, near_rpm=NEAR_RPM)
        return self._read[name]

    def pairs(self, kind: str) -> list[Pair]:
        pairs = {
            "halves": [(f"{name}/first", (f"{name}/second",)) for name in ("h30hz40", "h30hz0", "b30hz50", "h30hz60")],
            "other load": [
                (a, (b,)) for a, b in (("h30hz40", "h30hz50"), ("h30hz60", "h30hz50"), ("h30hz0", "h30hz40"))
            ],
            "between loads": [("h30hz50", ("h30hz40", "h30hz60"))],
            "moved sensor": [("b30hz50", ("h30hz50",)), ("b30hz0", ("h30hz0",))],
            "other day": [("b30hz50", ("h30hz50",)), ("b30hz0", ("h30hz0",))],
        }[kind]
        channels = {"moved sensor": ("a1", "a2", "a3"), "other day": ("a4",)}.get(kind, CHANNELS)
        loads = {"load": 50.0, "healthy_load": (40.0, 60.0)} if kind == "between loads" else {}
        return [
            Pair(kind=kind, run=run, healthy=healthy, channel=channels[i % len(channels)], **loads)
            for i, (run, healthy) in enumerate(pairs * len(channels))
        ]

    def checksums(self) -> dict[str, str]:
        """Return the SHA-256 of the text of each file."""
        return {
            f"{name}.csv": hashlib.sha256(gzip.decompress(self._path(name).read_bytes())).hexdigest() for name in FILES
        }

    def _path(self, name: str) -> Path:
        return self.folder / f"{name}.csv.gz"


def halves(measured: Measured) -> tuple[Measured, Measured]:
    """Return the two halves of a recording."""
    recording, angle = measured
    middle = len(angle) // 2
    found = []
    for place, part in (("first half", slice(middle)), ("second half", slice(middle, None))):
        channels = tuple(replace(each, samples=each.samples[part]) for each in recording.channels)
        found.append((replace(recording, source=f"{recording.source}, {place}", channels=channels), angle[part]))
    return found[0], found[1]


def questions(machine: Machine) -> Iterator[Question]:
    """Yield the questions about a machine, always the same: healthy, injected, for the twin empty ones, which gear."""
    found: list[tuple[Pair, str, str, Injection | None]] = []
    angles = machine.angles * (2 // len(machine.angles))
    for kind in KINDS:
        pairs = machine.pairs(kind)
        for angle in angles:
            for given in GIVEN:
                found.append((pairs[len(found) % len(pairs)], angle, given, None))
    for kind in KINDS:
        pairs = machine.pairs(kind)
        for angle in angles:
            for loss in LOSSES:
                turn = len(found)
                tooth = int(np.random.default_rng([7, turn]).integers(1, TEETH + 1))
                injection = Injection(rig=turn % RIGS, loss=loss, tooth=tooth, seed=turn)
                given = GIVEN[(turn + turn // len(LOSSES)) % len(GIVEN)]
                found.append((pairs[turn % len(pairs)], angle, given, injection))
    if machine.name == "twin":
        for kind in EMPTY:
            healthy = "1/50/2" if kind == "fallen sensor" else f"{kind}/2"
            pair = Pair(kind=kind, run=f"{kind}/1", healthy=(healthy,), channel="a1")
            found += [(pair, angle, "teeth", None) for angle in machine.angles]
    for angle in angles:
        for loss in LOSSES:
            for gear, teeth in (("pinion", TEETH), ("wheel", WHEEL)):
                turn = len(found)
                pairs = machine.pairs(KINDS[turn % len(KINDS)])
                pair = replace(pairs[turn % len(pairs)], kind=WHICH)
                tooth = int(np.random.default_rng([8, turn]).integers(1, teeth + 1))
                injection = Injection(rig=turn % RIGS, loss=loss, tooth=tooth, seed=turn, gear=gear)
                found.append((pair, angle, "counts", injection))
    for number, (pair, angle, given, injection) in enumerate(found):
        yield Question(number=number, pair=pair, angle=angle, given=given, injection=injection)


def empty_recording(kind: str, number: str) -> Measured:
    """Return a recording in which no pinion of 32 teeth is to be seen, with a tacho."""
    stream = np.random.default_rng([EMPTY.index(kind), int(number)])
    n = round(SECONDS * RATE)
    t = np.arange(n) / RATE
    turns = (SPEED - 0.09) * t + stream.uniform(1, 2)
    white = stream.standard_normal(n)
    match kind:
        case "pink noise":
            f = np.fft.rfftfreq(n)
            x = np.fft.irfft(np.fft.rfft(white) / np.sqrt(np.maximum(f, f[1])), n)
        case "hum":
            x = sum(np.cos(2 * np.pi * 50 * h * t + stream.uniform(0, 6)) / h for h in (1, 2, 3, 5)) + 0.1 * white
        case "another gear":
            order = 23 * turns
            x = (
                sum(np.cos(2 * np.pi * h * order + h) * (1 + 0.1 * np.cos(2 * np.pi * turns)) for h in (1, 2, 3))
                + 0.3 * white
            )
        case "bearing without gears":
            hits = np.interp(np.arange(int(turns[0] * 3.57), int(turns[-1] * 3.57)) / 3.57, turns, np.arange(n)).astype(
                int
            )
            train = np.zeros(n)
            train[hits] = 1
            decay = np.exp(-np.arange(200) / 25) * np.sin(2 * np.pi * 0.27 * np.arange(200))
            x = 3 * np.convolve(train, decay)[:n] + 0.3 * white
        case _:
            x = white
    pulse = 5 / (1 + np.exp(-60 * np.sin(2 * np.pi * turns)))
    channels = (
        Channel(name="a1", samples=np.asarray(x, float), sampling_rate=RATE, unit="m/s^2"),
        Channel(name="tacho", samples=pulse, sampling_rate=RATE, unit="V"),
    )
    return Recording(source=kind, channels=channels, tacho="tacho"), TEETH * turns
