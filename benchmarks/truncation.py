"""Modal truncation of the built-in spiral bevel rig: error and time, truncated against full.

The first conclusion of the paper (see the head of data/transmissions/nasa_spiral_bevel.toml) is that modal synthesis
greatly reduces the effort and keeps the accuracy. Two ways to leave modes out are compared with the full model, all
of it computed here in one run: component modes of the rotors, before the coupled eigenproblem, and conjugate pairs of
the coupled system, after it. Errors are the greatest difference of the periodic response over a revolution, as a
fraction of the full response's peak-to-peak; times are the best of several runs on one thread.

    python benchmarks/truncation.py [--json FILE]
"""

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from measuring import environment, json_option, publish
from threadpoolctl import threadpool_limits

import sigdb
from sigdb.dynamics import PeriodicRig, prepare_periodic
from sigdb.transmission import ModalSystem, ToothDamage, modal_system

RIG = "nasa-spiral-bevel"
COMPONENT_MODES = (4, 8, 16, 24, 32, 40)
COUPLED_PAIRS = (8, 16, 24, 32, 40, 48, 64)
CASES = {"healthy": {}, "damaged": {6: ToothDamage(stiffness_loss=0.5)}}
REPEATS = 5


@dataclass(frozen=True, kw_only=True)
class Row:
    """A truncation: what is kept, the poles, seconds, and errors by case and output."""

    kept: str
    modes: int | None
    poles: int
    synthesis_s: float
    response_s: float
    errors: dict[str, dict[str, float]]


def main() -> None:
    """Print the table, or a JSON document with the same numbers."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    json_option(parser)
    given = parser.parse_args()
    with threadpool_limits(1):
        machine, rows = environment("numpy", "scipy"), measure()
    print(f"{RIG}; damaged: stiffness loss 0.5 at tooth 6; errors as fractions of the full response's peak-to-peak")
    publish(machine, {"Truncations": table(rows)}, given.json)


def measure() -> list[Row]:
    """The full model first, then the truncated ones."""
    rig = sigdb.load_transmission(RIG)
    full, full_s = timed(lambda: modal_system(rig))
    prepared = prepare_periodic(rig)
    reference = responses(prepared)

    def row(kept: str, modes: int | None, system: ModalSystem, seconds: float) -> Row:
        other, response_s = timed(lambda: prepare_periodic(rig, system=system))
        found = responses(other)
        errors = {
            case: {
                name: float(np.abs(x - reference[case][name]).max() / np.ptp(reference[case][name]))
                for name, x in outputs.items()
            }
            for case, outputs in found.items()
        }
        return Row(
            kept=kept, modes=modes, poles=len(system.poles), synthesis_s=seconds, response_s=response_s, errors=errors
        )

    rows = [row("all", None, full, full_s)]
    for modes in COMPONENT_MODES:
        system, seconds = timed(lambda modes=modes: modal_system(rig, component_modes=modes))
        rows.append(row("component", modes, system, seconds))
    # The coupled system has to be solved in full before its pairs can be ranked.
    rows += [row("coupled", pairs, full.truncated(pairs), full_s) for pairs in COUPLED_PAIRS]
    return rows


def responses(prepared: PeriodicRig) -> dict[str, dict[str, Any]]:
    """Signals of all sensors and the compression of the mesh, by case."""
    found = {}
    for case, damage in CASES.items():
        state = prepared.steady_state([damage])[0]
        found[case] = dict(zip(prepared.system.sensors, state.signals, strict=True)) | {"mesh": state.compression}
    return found


def timed(call: Callable[[], Any]) -> tuple[Any, float]:
    """A result, and the least time of several runs, s."""
    seconds = []
    for _ in range(REPEATS):
        started = time.perf_counter()
        result = call()
        seconds.append(time.perf_counter() - started)
    return result, min(seconds)


def table(rows: list[Row]) -> list[dict[str, Any]]:
    """One row for each truncation, times in seconds and as multiples of the full model's."""
    return [
        {
            "kept": row.kept,
            "modes": "all" if row.modes is None else row.modes,
            "poles": row.poles,
            "synthesis, s": row.synthesis_s,
            "synthesis of the full": row.synthesis_s / rows[0].synthesis_s,
            "response, s": row.response_s,
            "response of the full": row.response_s / rows[0].response_s,
            **{f"{case} {output}": error for case, errors in row.errors.items() for output, error in errors.items()},
        }
        for row in rows
    ]


if __name__ == "__main__":
    main()
