"""Looks at a small gear whose teeth have errors: averages of one turn, in noise, without files."""

import numpy as np
import pandas as pd
import pytest

from sigdb.monitoring import Look
from sigdb.recording import MeshPresence, RecordedSignature

TEETH, SAMPLES, GROUPS = 12, 32, 8
PASSES = np.arange(TEETH * SAMPLES) / SAMPLES
MESH = sum(np.cos(2 * np.pi * h * PASSES + h) / h for h in (1, 2, 3))


@pytest.fixture(scope="session", autouse=True)
def _few_tries(few_tries):
    return few_tries


def signature(seed, *, event=0.0, gear=1, gain=1.0, load=1.0, speed_rpm=1500.0, groups=GROUPS):
    """A gear with an event 1.1 passes after first contact of tooth 5, other errors of its teeth, or another gain.

    Its load raises each mesh harmonic, and changes the errors of the teeth.
    """
    stream = np.random.default_rng(gear)
    errors = load * (1 + 0.1 * stream.standard_normal(TEETH) + (load - 1) * 0.3 * stream.standard_normal(TEETH))
    after = (PASSES - 5.1 + TEETH / 2) % TEETH - TEETH / 2
    x = errors[PASSES.astype(int)] * MESH + event * np.exp(-2 * after**2) * np.cos(3 * np.pi * after)
    noise = 0.1 * np.random.default_rng(seed).standard_normal((groups, len(x)))
    each, empty = gain * (x + noise), pd.DataFrame()
    return RecordedSignature(
        source=f"r{seed}", channel="a1", unit="m/s", gear="pinion", shaft="shaft", teeth=TEETH, angle="tacho",
        absolute=True, tsa=each.mean(axis=0), scatter=0.1, noise=np.full(len(x) // 2 + 1, 0.03), groups=each,
        averages=10 * groups, dropped=0, cycle=None, speed_rpm=speed_rpm, speed_track=empty, kept=0.9,
        presence=MeshPresence(present=True, reason="the mesh stands out", p_value=1e-9), highest_order=160.0,
        order_spectrum=empty, record_spectrum=empty, lines=empty, indicators={}, intervals=empty, envelope=None,
        shafts=empty, order_map=None, notes=(),
    )  # fmt: skip


@pytest.fixture(scope="session")
def look():
    """Called with a number, the day, and what differs in its signature."""

    def made(number, *, health="unknown", dated=True, **options):
        one = signature(number, **options)
        return Look(
            name=f"r{number}", key=f"r{number}", day=float(number) if dated else None, torque=None, load=None,
            health=health, kept=0.9, read=lambda: one,
        )  # fmt: skip

    return made


@pytest.fixture(scope="session")
def healthy(look):
    """Twelve healthy looks, and two that are not labelled."""
    return [look(number, health="healthy" if number < 12 else "unknown") for number in range(14)]
