"""The rig with one of its numbers changed: how far a claim hangs on it."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from sigdb.core import FloatArray, validated
from sigdb.dynamics import PeriodicRig, prepare
from sigdb.paper.claims import ClaimResult
from sigdb.paper.signals import TOOTH
from sigdb.transmission import ModalSystem, ToothDamage, Transmission, modal_system

_FACTORS = {
    "speed": (0.94, 0.97, 1.03, 1.06),
    "mesh stiffness": (0.8, 1.2),
    "bearing stiffness": (0.8, 1.2),
    "damping": (0.7, 1.3),
    "contact ratio": (0.9, 1.1),
    "edge width": (0.8, 1.2),
}
"""The speed moved by up to 6 % in the tests that the paper is about; the others are known no better than this."""


@dataclass(frozen=True, kw_only=True)
class Variation:
    """One number of a rig, the factor on it, and the changed rig."""

    what: str
    factor: float
    rig: Transmission


def variations(rig: Transmission, gear: str) -> Iterator[Variation]:
    """Every variation that the rig allows; edge width is the flank of the mesh's profile."""
    mesh = rig.meshes_of(gear)[0]
    paths = {
        "speed": "operating.speed_rpm",
        "mesh stiffness": f"meshes.{mesh}.stiffness",
        "damping": "damping_ratio",
        "contact ratio": f"meshes.{mesh}.profile.contact_ratio",
        "edge width": f"meshes.{mesh}.profile.flank",
    }
    for what, factors in _FACTORS.items():
        if what in ("contact ratio", "edge width") and rig.meshes[mesh].profile.kind != "trapezoid":
            continue
        for factor in factors:
            if what == "bearing stiffness":
                changed = with_bearings(rig, factor)
            else:
                changed = rig.replace({paths[what]: factor * rig.value(paths[what])})
            yield Variation(what=what, factor=factor, rig=changed)


def with_bearings(rig: Transmission, factor: float) -> Transmission:
    """The rig with the stiffness of all its bearings times a factor."""
    data = rig.model_dump()
    for bearing in data["bearings"].values():
        for name in ("stiffness", "tilt_stiffness", "stiffness_matrix"):
            if bearing.get(name) is not None:
                bearing[name] = _times(bearing[name], factor)
    return validated(Transmission, data, owner=f"rig {rig.name!r} with bearings times {factor}")


def _times(value: object, factor: float) -> object:
    if isinstance(value, list | tuple):
        return tuple(_times(one, factor) for one in value)
    return value * factor  # type: ignore[operator]


COMPONENT_MODES = 24
"""Elastic modes kept of each rotor, of about twice as many."""
ACCURATE, QUICKER = 0.01, 0.5
"""Accuracy is kept within 1 % of the signal's peak-to-peak; effort that is greatly reduced is at most half."""
_DAMAGE = {TOOTH: ToothDamage(stiffness_loss=0.5)}

SHOWS = "Modal synthesis greatly reduces the effort and keeps the accuracy."
LEADING = "error of the truncated model / peak-to-peak"
RULE = (
    f"With {COMPONENT_MODES} elastic modes of each rotor the signals, healthy and with 50 % loss, are within 0.01 of "
    "their peak-to-peak of the full model's, in at most half of the time."
)


def truncated_against_full(rig: Transmission, *, gear: str, sensor: str, repeats: int = 3) -> ClaimResult:
    """Error of signals and ratio of times, truncated against full; the times are the best of some runs."""
    row = list(rig.sensors).index(sensor)
    full, full_s = _timed(lambda: modal_system(rig), repeats)
    few, few_s = _timed(lambda: modal_system(rig, component_modes=COMPONENT_MODES), repeats)
    exact, exact_s = _timed(lambda: _answers(rig, gear, full, row), repeats)
    found, found_s = _timed(lambda: _answers(rig, gear, few, row), repeats)
    error = max(float(np.abs(a - b).max() / np.ptp(b)) for a, b in zip(found, exact, strict=True))
    ratio = (few_s + found_s) / (full_s + exact_s)
    numbers = {
        "error / peak-to-peak": error,
        "time, truncated / full": ratio,
        "synthesis, truncated / full": few_s / full_s,
        "response, truncated / full": found_s / exact_s,
        "poles of the full model": float(len(full.poles)),
        "poles of the truncated model": float(len(few.poles)),
    }
    return ClaimResult(value=error, holds=error <= ACCURATE and ratio <= QUICKER, numbers=numbers)


def _answers(rig: Transmission, gear: str, system: ModalSystem, row: int) -> list[FloatArray]:
    prepared: PeriodicRig = prepare(rig, gear=gear, system=system)
    return list(prepared.steady_state([{}, _DAMAGE], specimens=False).signals[:, row])


def _timed(call: Callable[[], Any], repeats: int) -> tuple[Any, float]:
    seconds = []
    for _ in range(repeats):
        started = time.perf_counter()
        result = call()
        seconds.append(time.perf_counter() - started)
    return result, min(seconds)
