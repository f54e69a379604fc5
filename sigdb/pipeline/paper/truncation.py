"""P10: what modal truncation saves and what it costs."""

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from sigdb.core.typing import FloatArray
from sigdb.dynamics import PeriodicRig, prepare
from sigdb.pipeline.paper.claims import Finding
from sigdb.pipeline.paper.signals import TOOTH
from sigdb.transmission import ModalSystem, ToothDamage, Transmission, modal_system

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


def truncated_against_full(rig: Transmission, *, gear: str, sensor: str, repeats: int = 3) -> Finding:
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
    return Finding(value=error, holds=error <= ACCURATE and ratio <= QUICKER, numbers=numbers)


def _answers(rig: Transmission, gear: str, system: ModalSystem, row: int) -> list[FloatArray]:
    prepared: PeriodicRig = prepare(rig, gear=gear, system=system)
    return [prepared.steady_state(damage, specimens=False).signals[row] for damage in ({}, _DAMAGE)]


def _timed(call: Callable[[], Any], repeats: int) -> tuple[Any, float]:
    seconds = []
    for _ in range(repeats):
        started = time.perf_counter()
        result = call()
        seconds.append(time.perf_counter() - started)
    return result, min(seconds)
