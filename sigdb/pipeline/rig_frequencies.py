"""Natural frequencies of a rig, and which of them its speeds and meshes excite."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from sigdb.pipeline.rig_parts import MESH_ORDERS
from sigdb.transmission import Transmission, coupled_modes

_SHAFT_ORDERS = 10
_NEAR = 0.05
_NO_PEAK = 0.7
"""Damping ratio from which on a mode's response has no peak."""
_LEAST_MODES = 6


def mode_numbers(rig: Transmission) -> tuple[list[dict[str, Any]], int]:
    """Modes that vibrate, to three times the highest mesh frequency, and the number of all that do not."""
    found = coupled_modes(rig)
    turning = max(abs(rig.speed(name)) for name in rig.shafts) / (2 * np.pi)
    meshing = max((rig.mesh_frequency(name) for name in rig.meshes), default=0.0)
    limit = MESH_ORDERS[-1] * meshing or _SHAFT_ORDERS * turning
    rows: list[dict[str, Any]] = [
        {"frequency_hz": float(frequency), "damping_ratio": float(ratio), "moves": moves}
        for frequency, ratio, moves in zip(found.frequency_hz, found.damping_ratio, found.moves, strict=True)
        if frequency > 0
    ]
    rows.sort(key=lambda row: row["frequency_hz"])
    within = [row for i, row in enumerate(rows) if i < _LEAST_MODES or row["frequency_hz"] <= limit]
    return within, len(found.frequency_hz) - len(rows)


def resonances(rig: Transmission, modes: list[dict[str, Any]]) -> Iterator[dict[str, Any]]:
    """Modes near the speed of a shaft or a harmonic of a mesh frequency."""
    exciting = [(f"shaft {name}", 1, abs(rig.speed(name)) / (2 * np.pi)) for name in rig.shafts]
    exciting += [(f"mesh {name}", n, n * rig.mesh_frequency(name)) for name in rig.meshes for n in MESH_ORDERS]
    for mode in modes:
        if mode["damping_ratio"] >= _NO_PEAK:
            continue
        for what, order, frequency in exciting:
            if frequency and abs(mode["frequency_hz"] / frequency - 1) <= _NEAR:
                yield mode | {"excited_by": what, "order": order, "excitation_hz": float(frequency)}
