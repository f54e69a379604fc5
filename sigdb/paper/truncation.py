"""The claim on modal synthesis: a rig with fewer modes against the full one."""

import time
from collections.abc import Callable
from typing import TypeVar

import numpy as np

from sigdb.core import FloatArray
from sigdb.dynamics import PeriodicRig, prepare_periodic
from sigdb.paper.claim_results import ClaimResult
from sigdb.paper.claims import ClaimText
from sigdb.paper.signals import TOOTH
from sigdb.transmission import ModalSystem, ToothDamage, Transmission, modal_system

T = TypeVar("T")

COMPONENT_MODES = 24
"""Elastic modes that are kept of each rotor, about half of them."""
ACCURATE, QUICKER = 0.01, 0.5
"""Largest error relative to the signal's peak-to-peak, and largest ratio of the effort."""
_DAMAGE = {TOOTH: ToothDamage(stiffness_loss=0.5)}

TRUNCATION = ClaimText(
    id="P10",
    figure="5 to 9",
    kind="report",
    shows="Modal synthesis greatly reduces the effort and keeps the accuracy.",
    leading="error of the truncated model / peak-to-peak",
    rule=f"With {COMPONENT_MODES} elastic modes of each rotor the signals, healthy and with 50 % loss, are within 0.01 "
    "of their peak-to-peak of the full model's, in at most half of the time.",
)
"""The claim on effort and accuracy."""


def truncated_against_full(rig: Transmission, *, gear: str, sensor: str, repeats: int = 3) -> ClaimResult:
    """Return the error and the ratio of times of the truncated model; times are the best of several runs."""
    row = list(rig.sensors).index(sensor)
    full, full_s = _timed(lambda: modal_system(rig), repeats)
    few, few_s = _timed(lambda: modal_system(rig, component_modes=COMPONENT_MODES), repeats)
    exact, exact_s = _timed(lambda: _answers(rig, gear, full, row), repeats)
    truncated, truncated_s = _timed(lambda: _answers(rig, gear, few, row), repeats)
    error = max(float(np.abs(a - b).max() / np.ptp(b)) for a, b in zip(truncated, exact, strict=True))
    ratio = (few_s + truncated_s) / (full_s + exact_s)
    numbers = {
        "error / peak-to-peak": error,
        "time, truncated / full": ratio,
        "synthesis, truncated / full": few_s / full_s,
        "response, truncated / full": truncated_s / exact_s,
        "poles of the full model": float(len(full.poles)),
        "poles of the truncated model": float(len(few.poles)),
    }
    return ClaimResult(value=error, holds=error <= ACCURATE and ratio <= QUICKER, numbers=numbers)


def _answers(rig: Transmission, gear: str, system: ModalSystem, row: int) -> list[FloatArray]:
    prepared: PeriodicRig = prepare_periodic(rig, gear=gear, system=system)
    return list(prepared.steady_state([{}, _DAMAGE], specimens=False).signals[:, row])


def _timed(call: Callable[[], T], repeats: int) -> tuple[T, float]:
    """Return the result of a call, and the least time of several, s."""
    seconds = []
    for _ in range(repeats):
        started = time.perf_counter()
        result = call()
        seconds.append(time.perf_counter() - started)
    return result, min(seconds)
